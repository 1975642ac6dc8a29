"""Where a run ends: the limit, its two roles, and the coupled problem from full dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
from dense_oracle import DenseBody, dense_body
from problem_list import PROBLEMS
from sample_runs import by_name, converged, problem, relative

import verification as vf
from verification.algorithm.fixed_point import Iterate
from verification.algorithm.runs import Run

# --- convergence ------------------------------------------------------------------------------------------------------


def settled(states: tuple[Iterate, ...]) -> int:
    """The first state from which the pattern no longer changes."""
    begin = len(states) - 1
    while begin > 0 and states[begin - 1].contact.pattern == states[-1].contact.pattern:
        begin -= 1
    return begin


@by_name
def test_a_converging_run_falls_step_by_step_to_1e_12(name):
    """Step II is solved to rounding: no plateau. Once the pattern has settled T is affine and the decay geometric.

    Every step falls, and log10 of the residual stays within half a decade of a straight line.
    """
    run = converged(name)
    assert run.history[-1] <= 1e-12
    logarithms = np.log10([state.residual for state in run.iterates[settled(run.iterates) :]])
    assert len(logarithms) > 10
    steps = np.arange(len(logarithms))
    line = np.polynomial.Polynomial.fit(steps, logarithms, 1)
    assert np.abs(logarithms - line(steps)).max() < 0.5
    assert (np.diff(logarithms) < 0).all()


@by_name
def test_the_state_at_1e_12_is_a_fixed_point_to_1e_11(name):
    last = converged(name).last
    assert relative(last.image, last.g) < 1e-11


#: A support that holds one body at a contact node stands in for friction there if this is the contact body.
IN_BOTH_ROLES = pytest.mark.parametrize("name", [name for name in PROBLEMS if "held tangentially" not in name])


@IN_BOTH_ROLES
def test_both_roles_have_the_same_limit(name):
    """The coupled problem does not know who solves which step."""
    one, other = converged(name).contact, converged(name, swapped=True).contact
    for quantity in ("pressure", "shear"):
        assert np.abs(getattr(one, quantity) - getattr(other, quantity)).max() < 1e-8 * np.abs(one.pressure).max()
    length = max(np.abs(one.gap).max(), np.abs(one.slip).max(), 1e-3 if one.pressure.max() > 0 else 0.0)
    for quantity in ("gap", "slip"):
        assert np.abs(getattr(one, quantity) - getattr(other, quantity)).max() < 1e-8 * length


@IN_BOTH_ROLES
def test_both_roles_call_the_states_of_the_limit_alike(name):
    assert converged(name).contact.status == converged(name, swapped=True).contact.status


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_global_method_finds_the_fixed_point(name):
    run, solution = converged(name), vf.solve(problem(PROBLEMS[name]))
    for quantity in ("pressure", "shear"):
        found, expected = getattr(run.contact, quantity), getattr(solution.contact, quantity)
        assert np.abs(found - expected).max() < 1e-9 * np.abs(solution.contact.pressure).max()


# --- the coupled problem, from full dense matrices --------------------------------------------------------------------


class Coupled:
    """Both bodies under the contact forces of a finished run: u = A^-1 (load + force), from dense matrices of its own.

    Interface values are along x and y, nodes from left to right; `force` acts on body 2, minus it on body 1.
    """

    def __init__(self, run: Run) -> None:
        self.pair = pair = run.pair
        self.bodies = [dense_body(pair, name) for name in ("body1", "body2")]
        force = pair.contact.orient(run.last.image)
        self.force = force if pair.neumann_body == 2 else -force
        self.u = [self.displacement(body, f) for body, f in zip(self.bodies, (-self.force, self.force), strict=True)]

    def displacement(self, body: DenseBody, force: np.ndarray) -> np.ndarray:
        """On all degrees of freedom."""
        free = ~body.held
        right = body.forces - body.everything @ body.values
        right[body.interface] += force
        u = body.values.copy()
        u[free] = np.linalg.solve(body.everything[np.ix_(free, free)], right[free])
        return u

    def total(self, i: int) -> np.ndarray:
        """All forces on body i but its own stresses: loads, contact, and the reactions that hold Gamma_u."""
        body, force = self.bodies[i], (-self.force, self.force)[i]
        acting = body.forces.copy()
        acting[body.interface] += force
        reactions = np.where(body.held, body.everything @ self.u[i] - acting, 0.0)
        return acting + reactions


def stresses(coupled: Coupled) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Nodal pressure forces, shear on body 2, distance, slip of body 1 against body 2, friction bound."""
    pair, n = coupled.pair, coupled.pair.contact.grid.n
    one, two = (u[body.interface] for u, body in zip(coupled.u, coupled.bodies, strict=True))
    plane = pair.contact.grid.dimension == 2
    pressure, shear = coupled.force[-n:], coupled.force[:-n] if plane else np.zeros(n)
    distance = two[-n:] - one[-n:] + float(pair.problem.contact.gap)
    slip = one[:-n] - two[:-n] if plane else np.zeros(n)
    contact, x = pair.problem.contact, pair.contact.grid.x
    w = np.convolve(np.diff(x), [0.5, 0.5]) if plane else np.ones(1)
    bound = np.zeros(n)
    if plane and contact.friction:
        if contact.law == "local":
            bound = float(contact.friction) * np.abs(pressure)
        else:
            r = float(contact.radius)
            hats = np.maximum(0, 1 - np.abs(np.subtract.outer(x, x)) / r) / r
            bound = float(contact.friction) * w * np.abs(hats @ pressure)
    return pressure, shear, distance, slip, bound


@by_name
def test_the_limit_obeys_signorini_and_coulomb_in_the_coupled_problem(name):
    """Both bodies carry equal and opposite forces; their displacements then meet (2.4) and (2.6), node by node."""
    coupled = Coupled(converged(name))
    pressure, shear, distance, slip, bound = stresses(coupled)
    force = max(np.abs(pressure).max(), np.abs(shear).max())
    length = max(np.abs(u).max() for u in coupled.u)
    assert force > 0
    f, d = 1e-9 * force, 1e-9 * length
    assert (pressure > -f).all()
    assert (distance > -d).all()
    assert ((pressure < f) | (distance < d)).all()
    held = ~(coupled.pair.body1.free & coupled.pair.body2.free)[: len(shear)]
    assert (np.abs(shear) < bound + f).all()
    slides = np.abs(slip) > d
    # friction on body 2 points where body 1 slides
    assert (np.abs(shear - bound * np.sign(slip))[slides & ~held[: len(slides)]] < f).all()


@by_name
def test_the_contact_quantities_are_those_of_the_coupled_problem(name):
    run = converged(name)
    coupled = Coupled(run)
    pressure, shear, distance, slip, _ = stresses(coupled)
    w = np.convolve(np.diff(run.pair.contact.grid.x), [0.5, 0.5]) if run.pair.contact.grid.n > 1 else np.ones(1)
    contact = run.contact
    largest, length = np.abs(contact.pressure).max(), max(np.abs(u).max() for u in coupled.u)
    assert np.abs(contact.pressure * w - pressure).max() < 1e-12 * largest * w.max()
    assert np.abs(contact.shear * w - shear).max() < 1e-12 * largest * w.max()
    assert np.abs(contact.gap - distance).max() < 1e-9 * length
    assert np.abs(contact.slip - slip).max() < 1e-9 * length
    assert contact.force["normal"] == pytest.approx(pressure.sum(), rel=1e-12)
    assert contact.force["tangential"] == pytest.approx(shear.sum(), rel=1e-9, abs=1e-9 * pressure.sum())


@by_name
def test_supports_carry_what_contact_and_loads_put_on_each_body(name):
    """Forces and moments balance on either body, and the supports of body 1 carry the contact force."""
    coupled = Coupled(converged(name))
    d = coupled.pair.contact.grid.dimension
    for i, body in enumerate(coupled.pair.on_meshes().elastic):
        forces = coupled.total(i).reshape(-1, d)
        points = body.mesh.points.astype(float)
        size = np.abs(forces).sum()
        assert np.abs(forces.sum(axis=0)).max() < 1e-11 * size
        if d == 2:
            moment = points[:, 0] * forces[:, 1] - points[:, 1] * forces[:, 0]
            assert abs(moment.sum()) < 1e-11 * size * np.abs(points).max()
    n = coupled.pair.contact.grid.n
    dense = coupled.bodies[0]
    reactions = (coupled.total(0) - dense.forces)[dense.held].reshape(-1)
    if d == 1:
        assert reactions.sum() + dense.forces.sum() == pytest.approx(coupled.force.sum(), rel=1e-10)
    else:
        held_up = (coupled.total(0) - dense.forces).reshape(-1, 2)[:, 1].sum()  # reactions and contact together
        own = dense.forces.reshape(-1, 2)[:, 1].sum()
        assert held_up + own == pytest.approx(0, abs=1e-10 * coupled.force[-n:].sum())

"""A contact body that only contact holds: both methods, step II without a minimiser, constants, bounds, roles."""

from __future__ import annotations

import json
from fractions import Fraction as F

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problem_list import blocks, changed, plates, small

import verification as vf
from verification.algorithm.affine_piece import piece_of
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.monolithic import solution_force
from verification.bounds.bound import NotComputed, Subject
from verification.contact import ContactError, ContactStep
from verification.interface.files import write_interface
from verification.registry import BOUNDS

SLIDING_TOP = {"prescribed": {"top": ["free", "-0.015"]}}
PRESSED = {"prescribed": None, "traction": {"top": [0, -3000]}}
SMOOTH = {"friction": 0}
LIFTED_ONLY = {"prescribed": {"left": [0, "free"]}, "traction": {"top": [0, -3000]}}

#: By name: the problem, and whether the grids differ.
LOOSE = {
    "sliding top": plates(body2=SLIDING_TOP),
    "sliding top, smooth": plates(body2=SLIDING_TOP, contact=SMOOTH),
    "pressed by traction alone": plates(body2=PRESSED),
    "pressed by traction alone, smooth": plates(body2=PRESSED, contact=SMOOTH),
    "pressed off its centre, so that it opens": plates(
        body2={"prescribed": None, "traction": {"top": [0, -3000], "left": [0, 2000]}}
    ),
    "sliding top on another grid": plates(body2=SLIDING_TOP | {"cells": [7, 3]}),
    "sliding top on another grid, smooth": plates(body2=SLIDING_TOP | {"cells": [7, 3]}, contact=SMOOTH),
    "pressed by traction alone on another grid": plates(body2=PRESSED | {"cells": [7, 3]}),
    "one cell on many": plates(body2=PRESSED | {"cells": [1, 2]}, contact=SMOOTH),
    "local law": plates(body2=SLIDING_TOP, contact={"law": "local", "radius": None}),
    "the lower body alone is loose": plates(
        body1={"fixed": None, "prescribed": {"bottom": ["free", 0]}}, iteration={"neumann_body": 2, "theta": "auto"}
    ),
    "lifted, not slid": plates(body2=LIFTED_ONLY, contact={"interval": ["0.6", "1.6"]}, iteration={"theta": "0.5"}),
}


def problem(name: str) -> vf.Problem:
    return vf.Problem.from_dict(LOOSE[name])


def far(pair: vf.ContactPair, one: np.ndarray, other: np.ndarray) -> float:
    return pair.neumann.dual_norm(one - other) / pair.neumann.dual_norm(other)


# --- both methods ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(LOOSE))
def test_the_limit_of_the_iteration_is_the_global_solution(name: str) -> None:
    pair = vf.build(problem(name))
    run = vf.run(pair)
    assert pair.contact.loose
    assert run.converged
    assert max(step.contact.kkt.residual for step in run.iterates) <= 1e-11
    if pair.interface.one_grid or not pair.interface.law.of_contact:
        assert far(pair, run.last.g, solution_force(pair)) < 1e-8


@pytest.mark.parametrize("name", ["sliding top", "pressed by traction alone on another grid"])
def test_both_solvers_of_step_ii_give_the_same_run(name: str) -> None:
    pair = vf.build(problem(name))
    one, other = (vf.run(pair, solver=solver).last.g for solver in ("active-set", "cvxpy"))
    assert far(pair, one, other) < 1e-11


@pytest.mark.parametrize("name", ["sliding top", "sliding top, smooth", "pressed by traction alone"])
def test_the_bodies_meet_where_they_touch_and_the_loads_are_carried(name: str) -> None:
    run = vf.run(problem(name))
    pair = run.pair
    lower, upper = run.displacements
    below = lower[run.pair.body1.mesh_body.nodes, 1]
    above = upper[run.pair.body2.mesh_body.nodes, 1]
    touching = run.last.contact.pattern.touching
    assert np.allclose(below[touching], above[touching], rtol=0, atol=1e-12)
    motions, loads = pair.contact.motions, pair.contact.load
    assert np.allclose(motions.T @ run.last.contact.force, motions.T @ loads, rtol=0, atol=1e-9 * np.abs(loads).sum())


@pytest.mark.parametrize("name", ["sliding top", "pressed by traction alone"])
def test_the_jacobian_of_an_affine_piece_is_the_difference_quotient_of_t(name: str) -> None:
    pair = vf.build(problem(name))
    last = vf.run(pair).last
    piece, T = piece_of(pair, last.g, last.contact.pattern), FixedPointMap(pair)
    d = 1e-6 * np.linalg.norm(last.g) * np.random.default_rng(0).standard_normal(len(last.g))
    ahead, behind = T(last.g + d)[1], T(last.g - d)[1]
    assert ahead.pattern == behind.pattern == last.contact.pattern
    found = (ahead.force - behind.force) / 2
    assert np.allclose(piece.force @ d, found, rtol=0, atol=1e-8 * np.abs(found).max())


def test_a_run_is_linearised_as_that_of_a_held_body_is() -> None:
    run = vf.run(problem("sliding top")).linearise()
    assert run.linearised is not None
    assert run.observed_rate.value == pytest.approx(run.linearised.predicted, rel=1e-2)


# --- what is known in closed form ------------------------------------------------------------------------------------


@pytest.mark.parametrize("cells", [((4, 2), (4, 2)), ((5, 2), (3, 1))])
@pytest.mark.parametrize("friction", [0, F(1, 2)])
def test_a_block_pressed_by_a_traction_on_another_has_its_pressure_at_every_node_and_step(cells, friction) -> None:
    pressed = blocks(
        cells=cells,
        poisson=(0, 0),
        body2={"prescribed": None, "traction": {"top": [0, F(-1, 3)]}},
        contact={"friction": friction, "radius": 1},
        iteration={"neumann_body": 1, "theta": F(1, 4), "tolerance": 1e-12},
    )
    run = vf.run(vf.Problem.from_dict(pressed))
    weights = run.pair.neumann.grid.weights
    for step in run.iterates[:8]:  # T is constant here, so that (III) alone moves g
        wanted = float((1 - F(3, 4) ** step.iteration) / 3)
        assert np.allclose(step.g, np.concatenate([0 * weights, wanted * weights]), rtol=0, atol=1e-15)
    assert vf.solve(run.pair).contact.pressure == pytest.approx(1 / 3, abs=1e-13)
    below, above = run.displacements
    assert below[run.pair.body1.mesh_body.nodes, 1] == pytest.approx(-1 / 9, abs=1e-11)  # of height 1, modulus 3
    assert above[:, 1].min() == pytest.approx(-1 / 9 - 1 / 6, abs=1e-11)


def test_the_block_shears_what_it_is_loaded_with_and_no_less() -> None:
    """A horizontal load below the friction bound is carried by shear; the iteration has to start where it is held."""
    pushed = vf.Problem.from_dict(plates(body2=PRESSED | {"body_force": [2, 0]}))
    pair = vf.build(pushed)
    start = solution_force(pair)
    run = list(zip(range(60), vf.iterate(pair, start=1.001 * start), strict=False))[-1][1]
    assert run.relative_residual < 1e-10
    shear = run.contact.force[pair.contact.grid.tangential].sum()
    assert abs(shear) == pytest.approx(2 * 1.2 * 0.3, rel=1e-9)
    held = vf.run(pair)
    assert held.converged
    assert held.start.source == "tied"
    assert far(pair, held.last.g, start) < 1e-8
    [said] = [warning for warning in held.warnings if "tied" in warning]
    assert "no minimiser: the loads move body 2 along Gamma_c, where friction holds 0" in said
    row = vf.sweep(pair, theta=[pair.settings.theta]).rows[0]
    assert row["iterations"] == held.iterations


def test_a_load_along_gamma_c_beyond_friction_has_no_solution_and_no_start() -> None:
    pushed = vf.Problem.from_dict(plates(body2=PRESSED | {"body_force": [3000, 0]}))
    with pytest.raises(ContactError, match="no minimiser: the loads move body 2 along Gamma_c"):
        vf.run(pushed)


@pytest.mark.parametrize("name", ["sliding top", "pressed by traction alone on another grid"])
def test_a_rigid_shift_of_the_supports_along_gamma_c_changes_no_force(name: str) -> None:
    base = LOOSE[name]
    shifted = changed(base, body1={"fixed": None, "prescribed": {"bottom": ["0.7", 0]}})
    one, other = (vf.run(vf.Problem.from_dict(data)) for data in (base, shifted))
    assert far(one.pair, other.last.g, one.last.g) < 1e-11
    if name == "sliding top":
        moved = changed(
            base,
            body1={"fixed": None, "prescribed": {"bottom": [0, "0.7"]}},
            body2={"prescribed": {"top": ["free", "0.685"]}},
        )
        assert far(one.pair, vf.run(vf.Problem.from_dict(moved)).last.g, one.last.g) < 1e-10


# --- step II ---------------------------------------------------------------------------------------------------------


@st.composite
def loose_steps(draw):
    """A step II that has a minimiser, by construction: S, its kernel, loads as S x + forces, bounds, those forces."""
    n, slides, lifts, seed = (draw(st.integers(*ends)) for ends in ((2, 5), (0, 1), (0, 2), (0, 2**32 - 1)))
    random = np.random.default_rng(seed)
    x = np.sort(random.uniform(-1, 1, n))
    motions = [np.r_[np.ones(n), np.zeros(n)]] * slides + [np.r_[np.zeros(n), np.ones(n)], np.r_[0 * x, x]][:lifts]
    Z = np.linalg.qr(np.array(motions).T)[0] if motions else np.zeros((2 * n, 0))
    G = random.standard_normal((2 * n, 2 * n))
    out = np.eye(2 * n) - Z @ Z.T
    bound = random.uniform(0, 1, n) * draw(st.sampled_from([0.0, 1.0]))
    force = np.r_[bound * random.uniform(-0.9, 0.9, n), random.uniform(0.1, 1, n)]
    S = out @ (G @ G.T + np.eye(2 * n)) @ out
    return (S + S.T) / 2, Z, S @ random.standard_normal(2 * n) + force, bound


@given(loose_steps())
def test_step_ii_of_a_loose_body_is_solved_wherever_forces_balance_its_loads(step) -> None:
    S, Z, q, bound = step
    solved = [
        ContactStep(S, np.ones(len(q), dtype=bool), len(bound), solver, motions=Z).solve(q, bound)
        for solver in ("auto", "cvxpy")
    ]
    assert max(found.kkt.residual for found in solved) <= 1e-11
    assert np.allclose(solved[0].force, solved[1].force, rtol=0, atol=1e-8 * np.abs(q).max())


@given(loose_steps(), st.floats(0.01, 10))
def test_step_ii_of_a_loose_body_is_refused_where_no_forces_balance_its_loads(step, beyond) -> None:
    S, Z, q, bound = step
    t = len(bound)
    free = np.ones(len(q), dtype=bool)
    if Z.shape[1] == 0:
        return
    pull = np.r_[np.zeros(t), -np.ones(t)]  # off, beyond what holds it down
    if np.abs(Z[t:]).max() > 1e-9:
        pulled = q - Z @ (Z.T @ q) + beyond * Z @ (Z.T @ pull)
        with pytest.raises(ContactError, match="the loads move the block off"):
            ContactStep(S, free, t, motions=Z, body="the block").solve(pulled, bound)
    if np.abs(Z[:t]).max() > 1e-9:
        along = np.r_[np.ones(t), np.zeros(t)]
        slid = q - along * (q[:t].mean() - bound.mean() - beyond)
        with pytest.raises(ContactError, match=f"along Gamma_c, where friction holds {bound.sum():.3g} at most"):
            ContactStep(S, free, t, motions=Z).solve(slid, bound)


def test_a_body_without_loads_may_be_left_where_it_is_and_one_that_is_lifted_may_not() -> None:
    left = vf.run(vf.Problem.from_dict(small(body2={"prescribed": None})))
    assert left.converged
    assert not left.last.g.any()
    for loads in ({"top": [0, 3000]}, {"top": [0, -10], "left": [0, 3000]}):
        lifted = vf.Problem.from_dict(small(body2={"prescribed": None, "traction": loads}))
        with pytest.raises(ContactError, match="no minimiser: the loads move body 2 off"):
            vf.run(lifted)
        with pytest.raises(vf.SolveError, match="contact alone holds a body, and the loads may pull or slide it off"):
            vf.solve(lifted)


def test_a_horizontal_load_without_friction_is_held_by_nothing() -> None:
    pushed = vf.Problem.from_dict(small(body2=SLIDING_TOP | {"body_force": ["1e-3", 0]}, contact=SMOOTH))
    with pytest.raises(ContactError, match="the loads move body 2 along Gamma_c, where friction holds 0 at most"):
        vf.run(pushed)
    with pytest.raises(vf.SolveError, match="slide it off"):
        vf.solve(pushed)


# --- constants and bounds --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(set(LOOSE) - {"one cell on many", "local law"}))
def test_the_constants_are_the_limits_of_those_of_a_body_held_by_ever_softer_springs(name: str) -> None:
    pair = vf.build(problem(name))
    measured, contact, free = vf.measure(pair), pair.contact, pair.contact.free
    S_n, t = pair.neumann.schur, contact.grid.t
    carry = pair.interface.carry_form
    spring = 1e-7 * np.diag(contact.schur).max()
    S = contact.schur + spring * contact.motions @ contact.motions.T
    top = lambda A, B: float(np.linalg.eigvals(np.linalg.solve(B, A)).real.max())
    assert free.all()
    assert measured.rho_max.value == pytest.approx(top(carry(S), S_n), rel=1e-5)
    condense = lambda A, m: np.linalg.inv(np.linalg.inv(A)[m:, m:])
    P = pair.interface.transfer
    normal = top(P.T @ condense(S, t) @ P, condense(S_n, pair.neumann.grid.t))
    assert measured.rho_normal.value == pytest.approx(normal, rel=1e-5)
    assert measured.rho_min.value == 0
    B_T = np.diag(np.r_[contact.grid.weights, np.zeros(t)])
    if contact.slides:
        assert measured.C_t1 is None
        assert measured.reason["C_t1"].startswith("infinite: the contact body can move rigidly along Gamma_c")
        Z = contact.motions
        assert top(B_T, S) * spring == pytest.approx(np.linalg.eigvalsh(Z.T @ B_T @ Z)[-1], rel=1e-4)
    else:
        assert measured.C_t1.value**2 == pytest.approx(top(B_T, S), rel=1e-5)


def test_m_of_a_loose_body_is_zero_and_m_of_the_other_is_not() -> None:
    document = vf.measure(problem("sliding top")).to_dict()
    assert document["body2"]["m"] == document["m"] == {"value": 0.0, "lo": 0.0, "hi": 0.0, "level": "exact"}
    assert document["body1"]["m"]["value"] > 0
    assert document["C_t1"] is document["kappa_1"] is None
    assert "infinite" in document["reason"]["C_t1"]
    assert "infinite" in document["reason"]["kappa_1"]
    assert document["rho_min"]["value"] == 0
    assert document["C_R"]["value"] >= 1  # traces are lifted into a loose body as into any
    smooth = vf.measure(problem("sliding top, smooth")).to_dict()
    assert (smooth["C_t1"], smooth["kappa_1"]["value"]) == (None, 0)


def test_without_friction_the_bound_in_energy_norms_and_the_semidefinite_one_speak_and_are_attained() -> None:
    found = vf.compare(vf.Problem.from_dict(small(body2=SLIDING_TOP, contact={"friction": 0})))
    energy, lmi = found.bounds["energy"], found.bounds["lmi"]
    rho, theta = found.measured.rho_normal.value, energy.theta
    assert energy.factor.value == pytest.approx(max(1 - theta, abs(1 - theta - theta * rho)), rel=1e-12)
    assert lmi.detail.lower <= lmi.factor.value <= energy.factor.value * (1 + 1e-6)
    assert lmi.detail.lower > 0.999 * energy.factor.value  # so that no smaller bound is one
    assert found.verdicts["energy"].verdict == found.verdicts["lmi"].verdict == "CONSISTENT"
    for name in ("printed", "repaired"):
        assert found.verdicts[name].verdict == "NOT_COMPUTED"
        assert "m = 0" in found.verdicts[name].reason
    assert found.losses is None
    assert "m = 0" in found.reason["losses"]
    assert (energy.friction.every, energy.friction.on) == (None, "k")  # no friction is allowed, where some would be
    json.dumps(found.to_dict())


@pytest.mark.parametrize("name", ["sliding top", "pressed by traction alone"])
def test_with_friction_no_bound_speaks_where_a_free_motion_is_tangential_and_auto_is_the_prediction(name) -> None:
    found = vf.compare(problem(name), theta="auto")
    for bound in ("energy", "lmi"):
        assert found.verdicts[bound].verdict == "NOT_COMPUTED"
        assert "C_t1 is infinite" in found.verdicts[bound].reason
    choice = found.run.choice
    assert choice.source == "predicted"
    assert float(choice.theta) == pytest.approx(2 / (2 + found.measured.rho_max.value))
    assert "no theta is proved: C_t1 is infinite" in choice.why
    assert found.run.converged


def test_with_friction_the_bound_in_energy_norms_speaks_where_the_free_motion_lifts_alone() -> None:
    wide = small(
        body1={"x": ["0.4", "1.6"], "cells": [6, 2]},
        body2=LIFTED_ONLY,
        contact={"interval": ["0.6", "1.6"], "friction": "0.01"},
        iteration={"theta": "0.3", "neumann_body": 1},
    )
    found = vf.compare(vf.Problem.from_dict(wide))
    assert found.measured.C_t1.value > 0
    assert found.verdicts["energy"].verdict == "CONSISTENT"
    assert found.bounds["energy"].factor.value < 1
    lmi = found.bounds["lmi"]
    assert found.verdicts["lmi"].verdict == "CONSISTENT"
    assert lmi.detail.lower <= lmi.factor.value < found.bounds["energy"].factor.value
    assert lmi.detail.gap < 1e-4
    subject = Subject.of(found.run.pair, found.measured)
    assert BOUNDS["energy"].region(subject).every == found.measured.friction_threshold.value
    assert BOUNDS["lmi"].region(subject).every > 3 * found.measured.friction_threshold.value
    with pytest.raises(NotComputed, match="m = 0"):
        BOUNDS["repaired"].region(subject)


@pytest.mark.parametrize("name", ["sliding top, smooth", "pressed by traction alone, smooth", "lifted, not slid"])
def test_no_step_is_longer_than_the_bound_in_energy_norms(name: str) -> None:
    problem_ = vf.Problem.from_dict(changed(LOOSE[name], contact={"friction": "0.01"} if name[0] == "l" else {}))
    pair = vf.build(problem_)
    energy = vf.compare(pair, bounds=("energy",)).bounds["energy"]
    T, random, theta = FixedPointMap(pair), np.random.default_rng(1), energy.theta
    loads = np.abs(vf.run(pair).last.g).max()
    for _ in range(40):
        one, other = (loads * random.standard_normal(pair.neumann.grid.size) for _ in range(2))
        images = [pair.interface.carry_back(T(g)[1].force) for g in (one, other)]
        step = theta * (images[0] - images[1]) + (1 - theta) * (one - other)
        assert pair.neumann.dual_norm(step) <= energy.factor.value * pair.neumann.dual_norm(one - other) * (1 + 1e-9)


# --- roles -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("neumann", [1, 2])
@pytest.mark.parametrize("grids", [[12, 3], [7, 3]])
def test_the_role_is_singular_and_never_the_pair(neumann: int, grids: list[int]) -> None:
    loose = vf.Problem.from_dict(plates(body2=SLIDING_TOP | {"cells": grids}, iteration={"neumann_body": neumann}))
    advice = vf.advise(loose)
    assert advice.neumann_body == 1
    roles = {role["neumann_body"]: role for role in advice.to_dict()["roles"]}
    assert [role.neumann_body for role in advice.roles] == [neumann, 3 - neumann]
    assert roles[1]["singular"] is False
    assert roles[2]["singular"] is True
    assert roles[2]["rho"] is None
    assert "Neumann problem of step I is singular: give body 1 the Neumann problem" in roles[2]["reason"]["rho"]
    assert roles[1]["theta_auto"]["source"] == "predicted"
    assert "C_t1 is infinite" in roles[1]["reason"]["friction_threshold"]
    if neumann == 2:
        with pytest.raises(vf.ProblemError, match=r"body2 can move rigidly \(1 free motion\).*step I is singular"):
            vf.run(loose)
        assert vf.solve(loose).kkt_residual <= 1e-11
    else:
        with pytest.raises(vf.ProblemError, match="step I is singular: give body 1"):
            vf.build(loose).swapped()


def test_bodies_that_can_move_together_are_held_by_nothing() -> None:
    both = vf.Problem.from_dict(small(body1={"fixed": None, "prescribed": {"bottom": ["free", 0]}}, body2=SLIDING_TOP))
    for call in (vf.run, vf.solve, vf.advise):
        with pytest.raises(vf.ProblemError, match="body1 and body2 can move rigidly together"):
            call(both)


def test_a_bar_that_contact_alone_holds_is_solved_and_not_iterated() -> None:
    bars = {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, 1], "cells": 2, "young": 3, "fixed": ["left"]},
        "body2": {"shape": "interval", "x": [1, 2], "cells": 2, "young": 1, "traction": {"right": [-1]}},
        "iteration": {"neumann_body": 1},
    }
    problem_ = vf.Problem.from_dict(bars)
    assert vf.solve(problem_).contact.pressure == pytest.approx(1)
    with pytest.raises(vf.ProblemError, match="nothing is left to iterate; `ndtheory solve` takes it"):
        vf.run(problem_)


@pytest.mark.parametrize("name", ["sliding top", "pressed by traction alone on another grid"])
def test_an_interface_file_knows_the_motions(name: str, tmp_path) -> None:
    pair, path = vf.build(problem(name)), tmp_path / "interface.npz"
    write_interface(pair, path)
    other = vf.build(path)
    assert far(pair, vf.run(other).last.g, vf.run(pair).last.g) < 1e-12
    assert vf.advise(other).roles[1].singular
    arrays = dict(np.load(path))
    assert {"motions1", "motions2"} & arrays.keys() == {"motions2"}
    for broken in (2 * arrays["motions2"], np.eye(len(arrays["S2"]))[:, :1], arrays["motions2"][:, :0]):
        np.savez(path, **arrays | {"motions2": broken})
        with pytest.raises(vf.ProblemError, match=r"motions2|S2 is singular"):
            vf.build(path)

"""What the theorem says of a loading history, and the balance of work and energy in each increment."""

import numpy as np
import pytest
from histories import PATH, VARIANTS, pressed_and_sheared
from made_up import Halfway

import verification as vf
from fem1d2d import stiffness
from verification.algorithm.history import steps_to
from verification.algorithm.rates import noise
from verification.problem.steps import at_rest
from verification.registry import BOUNDS


def problem(path=PATH, times=1, **tables):
    return vf.Problem.from_dict(pressed_and_sheared(path, times, **tables))


# --- work and energy --------------------------------------------------------------------------------------------------


def whole_force(body, u):
    """``A u`` on all unknowns, those that Gamma_u holds too."""
    return stiffness(body.mesh, body.material) @ u.ravel()


def on_nodes(body, vector, sign):
    """An interface vector, tangential components first, as nodal forces on a body."""
    found = np.zeros(body.mesh.points.shape)
    for p, part in enumerate(np.split(sign * vector, body.mesh.dimension)):
        found[body.nodes, p] = part
    return found.ravel()


@pytest.mark.parametrize(
    ("method", "name"),
    [
        ("iteration", "one grid"),
        ("monolithic", "other roles"),
        ("iteration", "grids that differ"),
        ("monolithic", "gap"),
    ],
)
def test_the_work_of_the_loads_is_the_change_of_energy_and_what_the_contact_takes(method, name):
    data = problem(**VARIANTS[name]).to_dict()
    data["iteration"]["tolerance"] = 1e-13
    data["step"][1]["body2"]["traction"] = {"right": [40, 20]}
    data["step"][0]["body1"] = {"body_force": [5, -30]}
    found = vf.march(vf.Problem.from_dict(data), method=method)
    assert found.converged
    before = {"u": [0.0, 0.0], "F": [0.0, 0.0], "E": 0.0, "contact": None}
    for each in found.increments:
        result, contact = each.result, each.contact
        bodies = result.bodies
        traction = np.concatenate([contact.weights * contact.shear, contact.weights * contact.pressure])
        felt = bodies.interface.carry_back(traction)
        outer, fields, energy, work = [], [], 0.0, 0.0
        for i, (body, sign) in enumerate(((bodies.body1, -1.0), (bodies.body2, 1.0))):
            u = result.displacements[i].ravel()
            force = whole_force(body, u)
            external = force - on_nodes(body, felt if body is bodies.neumann else traction, sign)
            given = np.zeros(len(u))  # what is applied on the unknowns: the loads of the body without its supports
            given[body.positions] = body.load + (whole_force(body, body.known.values))[body.positions]
            scale = np.abs(traction).max()
            assert np.abs((external - given)[body.positions]).max() <= 1e-8 * max(scale, np.abs(given).max())
            energy += 0.5 * float(u @ force)
            work += 0.5 * float((external + before["F"][i]) @ (u - before["u"][i]))
            outer.append(external)
            fields.append(u)
        earlier = before["contact"]
        p, gap = (0 * contact.x, bodies.interface.gap) if earlier is None else (earlier.pressure, earlier.gap)
        pressing = 0.5 * contact.weights @ ((contact.pressure + p) * (contact.gap - gap))
        size = max(energy, before["E"], abs(work))
        assert abs(work - (energy - before["E"]) - each.dissipated + pressing) <= 1e-11 * size
        assert each.dissipated >= -1e-12 * size
        before = {"u": fields, "F": outer, "E": energy, "contact": contact}


# --- what the theorem says --------------------------------------------------------------------------------------------


def test_every_increment_has_the_factor_of_the_first_and_keeps_its_promise():
    whole = problem(contact={"friction": "0.15"})
    found = vf.march(whole)
    energy = found.bounds["energy"]
    assert energy.factor.value < 1
    assert energy.factor.value == pytest.approx(
        vf.compare(at_rest(whole), bounds=["energy"]).bounds["energy"].factor.value, rel=1e-9
    )
    for each in found.increments:
        promise, run = each.promise, each.result
        assert promise.factor == energy.factor.value
        assert run.iterates[0].residual <= promise.residual * (1 + 1e-9) + 100 * noise(run.pair, run.iterates[0])
        assert each.iterations <= promise.steps
        assert each.verdicts["energy"].verdict in ("CONSISTENT", "NOT_COMPUTED")
    assert not found.proved_violated


def test_a_promise_is_made_of_the_load_the_residual_before_the_least_scale_and_the_least_factor(monkeypatch):
    """Two bounds prove a factor; a coarse tolerance leaves a residual that counts."""
    monkeypatch.setitem(BOUNDS, "halfway", Halfway())
    path = {"press": (3, [0, "-0.01"]), "ease": (2, [0, "-0.002"])}
    found = vf.march(problem(path, contact={"friction": "0.15"}, iteration={"tolerance": "1/100"}))
    factors = [found.bounds[name].factor.value for name in ("energy", "halfway")]
    assert max(factors) > 1.1 * min(factors)
    left, rho = 0.0, found.measured.rho_max.value
    differ = 0
    for each in found.increments:
        promise, run = each.promise, each.run
        scales = [iterate.scale for iterate in run.iterates]
        assert promise.factor == min(factors)
        assert promise.residual == pytest.approx(np.sqrt(rho) * promise.load + left, rel=1e-12)
        assert promise.steps == steps_to(promise.residual, 1e-2 * min(scales), min(factors))
        differ += promise.steps != steps_to(promise.residual, 1e-2 * max(scales), min(factors))
        left = run.last.residual
        assert left > 1e-4 * promise.residual
    assert differ > 0


@pytest.mark.parametrize(
    ("tables", "why"),
    [
        ({"contact": {"law": "local", "radius": None}}, "local"),
        ({"body2": {"prescribed": {"top": ["free", "-0.01"]}}, "body1": {"fixed": ["bottom"]}}, "contact alone holds"),
    ],
)
def test_outside_the_theorem_nothing_is_promised(tables, why):
    data = pressed_and_sheared(**tables)
    if "body2" in tables:
        data["step"] = [{"increments": 2, "body2": {"prescribed": {"top": ["free", "-0.01"]}}}]
    found = vf.march(vf.Problem.from_dict(data))
    assert found.converged
    assert all(each.promise is None and why in each.why_none for each in found.increments)


@pytest.mark.parametrize(("rule", "friction"), [("anderson", "0.2"), ("momentum", "0")])
def test_other_rules_follow_the_same_path_without_a_promise(rule, friction):
    whole = problem(contact={"friction": friction})
    found, plain = vf.march(whole, rule=rule), vf.march(whole)
    assert found.converged
    assert np.abs(found.fields["pressure"] - plain.fields["pressure"]).max() <= 1e-7 * plain.fields["pressure"].max()
    assert all("constant theta" in each.why_none for each in found.increments)
    assert {each.verdicts["energy"].verdict for each in found.increments} == {"HYPOTHESES_NOT_MET"}


def test_the_jacobian_predicts_the_steps_of_an_increment():
    found = vf.march(problem()).linearise()
    for each in found.increments[1:-3]:
        assert abs(each.predicted_steps - each.iterations) <= 4
    assert vf.march(problem(), method="monolithic").linearise().increments[0].predicted_steps is None


@pytest.mark.parametrize(
    ("first", "last", "factor", "steps"),
    [
        (1.0, 1e-3, 0.1, 3),
        (1.0, 0.999e-3, 0.1, 4),
        (1.0, 1.0, 0.5, 0),
        (0.0, 0.0, 0.5, 0),
        (1.0, 0.5, 0.0, 1),
        (1.0, 0.5, 1.0, None),
        (1.0, 0.0, 0.5, None),
        (float("nan"), 0.5, 0.5, None),
    ],
)
def test_steps_to_counts_what_a_factor_needs(first, last, factor, steps):
    assert steps_to(first, last, factor) == steps

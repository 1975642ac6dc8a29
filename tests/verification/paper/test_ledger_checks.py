"""Each check of solutions in the ledger finds what is wrong: forces, displacements, signs, weak forms."""

from dataclasses import replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest
from ledger_evidence import HOLDS, PRINTED, REPAIRED, STEP, holds

from fem1d2d import Condensation
from verification.interface.pair import pair_from
from verification.ledger import cases, convergence, weak_forms
from verification.ledger import solutions as ledger
from verification.ledger.convergence import RunsOfLevel
from verification.ledger.weak_forms import EXACT, Case, Fields, Weak
from verification.problem.specification import Problem

# Wrong solutions.


def pressed(name="sheared, body 2 Neumann"):
    return Case(name=name, problem=Problem.from_dict(cases.PROBLEMS[name]))


def loaded(case, force):
    """The fields under nodal forces on body 1 and on body 2, in the frame of the pair."""
    weak, fields = case.weak, []
    for body, own in zip((weak.one, weak.two), force, strict=True):
        load = body.load.copy()
        load[body.interface] += weak.pair.contact.orient(own)
        fields.append(body.solve(load))
    return Fields(one=fields[0], two=fields[1])


def given(case, **properties):
    """The case with some of its properties given instead of computed."""
    return type("Given", (Case,), properties)(name=case.name, problem=case.problem)


def with_solution(case, u):
    return given(case, solution=u, limit=u)


def asked(statement, *cases):
    class Given(RunsOfLevel):
        @cached_property
        def cases(self):
            return list(cases)

    return ledger.CHECKS[statement](Given(level="quick"))


def changed(case, node, component, share):
    """A nodal force on body 2 changed by a share of the largest one; component 0 is tangential."""
    g = case.g.copy()
    g[component * case.weak.pair.contact.grid.n + node] += share * np.abs(g).max()
    return g


AT_SOLUTION = ["2.3", "4.4", "5.1", "lemma-5.2"]


@pytest.mark.parametrize("statement", AT_SOLUTION)
def test_forces_that_are_not_opposite_are_found_out(statement):
    case = pressed()
    wrong = with_solution(case, loaded(case, (-case.g, changed(case, 3, 1, 1e-6))))
    assert (holds(asked(statement, case))[-1][1], holds(asked(statement, wrong))[-1][1]) == (True, False)


@pytest.mark.parametrize("statement", ["2.4", "4.4", "5.2", "5.3", "5.4"])
@pytest.mark.parametrize("component", [0, 1])
def test_a_contact_force_off_by_a_millionth_is_found_out(statement, component):
    case = pressed()
    g = changed(case, 3, component, 1e-6)
    wrong = with_solution(case, loaded(case, (-g, g)))
    if (statement, component) != ("2.4", 0):  # the normal jump hardly feels a shear at one node
        assert holds(asked(statement, wrong))[-1][1] is False


def test_a_shear_above_the_friction_bound_is_found_out():
    case = pressed()
    g = changed(case, 3, 0, 1e-6)
    assert holds(asked("2.6", with_solution(case, loaded(case, (-g, g))))) == [(PRINTED, False)]


def test_a_displacement_off_by_a_millionth_is_not_the_limit_of_the_run():
    case = pressed()
    other = Fields(one=case.solution.one * (1 + 1e-6), two=case.solution.two)
    wrong = given(case, solution=other, run=case.run, limit=case.limit)
    assert holds(asked("prop-5.1", wrong)) == [(STEP, True), (REPAIRED, True), (PRINTED, False)]


class Slippery(Weak):
    """A bound of friction that is one per mille too small."""

    def bound(self, two):
        return 0.999 * super().bound(two)


class OtherBody(Weak):
    """The bound of friction from the stress of the contact body."""

    u = None

    def bound(self, two):
        g, pair = -self.force(self.one, self.u.one), self.pair
        grid = pair.contact.grid
        return float(pair.friction) * grid.weights * np.abs(pair.interface.kernel @ g[grid.normal])


@pytest.mark.parametrize("statement", ["2.6", "4.4", "4.9.2", "5.2", "5.3", "5.5"])
def test_a_friction_bound_one_per_mille_too_small_is_found_out(statement):
    case = pressed()
    wrong = given(case, weak=Slippery(pair=pair_from(case.problem)))
    assert holds(asked(statement, wrong))[-1][1] is False


def test_the_friction_bound_is_that_of_the_neumann_body():
    case = pressed()
    rng = np.random.default_rng(0)
    worst = []
    for state in case.arbitrary:
        weak = OtherBody(pair=case.weak.pair)
        object.__setattr__(weak, "u", weak.at(state))
        d = weak_forms.moves_of_one(weak, weak.u, rng, 10)
        assert weak_forms.contact_inequality(case.weak, weak.u, d).min() >= -EXACT
        worst.append(weak_forms.contact_inequality(weak, weak.u, d).min())
    assert max(worst) < -1e-6


@pytest.mark.parametrize("sign", [1, -1])
def test_the_sign_of_step_III_is_found_out(sign):
    case = pressed()
    state, _ = case.steps[1]
    v = weak_forms.directions(np.random.default_rng(0), case.weak.two, 5)
    off = weak_forms.transfer(case.weak, case.weak.at(state), sign * state.image, v)
    assert (off.max() <= EXACT) == (sign == 1)
    assert sign == 1 or off.min() > 1e-6


@pytest.mark.parametrize("statement", ["4.9.1", "4.9.3", "5.4", "5.6"])
def test_a_force_off_by_a_millionth_is_found_out_in_the_weak_form(statement):
    case = pressed()
    spoil = lambda state: replace(state, g=state.g * (1 + 1e-6), image=state.image * (1 + 1e-6))
    steps, arbitrary = [(spoil(a), b) for a, b in case.steps], [spoil(state) for state in case.arbitrary]
    assert holds(asked(statement, given(case, steps=steps, arbitrary=arbitrary)))[0] == (PRINTED, False)


def test_a_lift_that_is_not_harmonic_is_found_out(monkeypatch):
    true = Condensation.extend

    def rough(self, trace, load=None):
        field = true(self, trace, load)
        field[self.inside[0]] *= 1.001
        return field

    case = pressed()
    assert holds(asked("4.5", case)) == HOLDS
    monkeypatch.setattr(Condensation, "extend", rough)
    assert holds(asked("4.5", case)) == [(PRINTED, False)]


def test_the_printed_friction_term_fails_where_a_sticking_node_moves():
    case = pressed("much friction")
    defect, w = ledger.printed_defect(case.weak, case.solution)
    assert defect < -0.5
    assert w[case.weak.pair.contact.grid.normal].max() <= 1e-15
    # without displacement along Gamma_c of body 1 both forms are one
    still = case.solution.one.copy()
    still[case.weak.one.interface[case.weak.pair.contact.grid.tangential]] = 0
    assert ledger.printed_defect(case.weak, Fields(one=still, two=case.solution.two))[0] >= 0


def test_on_two_bars_the_printed_sign_gives_the_factor_of_the_cobweb():
    bars = Case(name="bars", problem=Problem.from_dict(cases.CONVERGENT["two bars"] | {"iteration": {"theta": "0.3"}}))
    distance = convergence.distances(bars, -1, 4)
    rho, theta = 1.0, 0.3
    # an error e gives T an error -rho e, so that the printed step is e (1 - theta + theta rho) - 2 theta g
    error = [-1.0]
    for _ in range(3):
        error.append(error[-1] * (1 - theta + theta * rho) - 2 * theta)
    assert distance[:2] == pytest.approx(np.abs(error[:2]), rel=1e-9)


@pytest.mark.parametrize("of", [PRINTED, REPAIRED])
def test_a_contraction_factor_one_per_cent_too_small_is_found_out(of):
    quick = RunsOfLevel(level="quick")
    runs = {PRINTED: quick.inside, REPAIRED: quick.energy}
    verdict = lambda: holds(convergence.forces_converge(SimpleNamespace(inside=runs[PRINTED], energy=runs[REPAIRED])))
    assert verdict() == [(PRINTED, True), (REPAIRED, True)]
    runs[of] = [replace(run, factor=0.99 * run.factor) for run in runs[of]]
    assert verdict() == [(PRINTED, of != PRINTED), (REPAIRED, of != REPAIRED)]


def test_the_estimate_of_proposition_5_1_is_homogeneous_in_theta_m():
    case = pressed()
    states = case.run.iterates[:6]
    one, other = (convergence.strong_convergence(case.weak, states, 0.6, m) for m in (1.0, 300.0))
    assert other == pytest.approx(300 * one, rel=1e-12)
    assert other.max() > 1

"""The iteration against closed forms: two bars in rationals, every solver of step II, and how a run ends."""

from __future__ import annotations

import re
import tracemalloc
from collections.abc import Callable, Mapping
from fractions import Fraction
from itertools import islice, pairwise
from typing import Any

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from problem_list import PROBLEMS, SECTION_6, changed, loaded_bars
from sample_runs import SAMPLES, problem, relative

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap, Iterate
from verification.algorithm.loop import PATIENCE, RUNAWAY
from verification.algorithm.runs import MOST_BYTES, Run
from verification.contact import TOLERANCE, ContactError
from verification.interface.pair import pair_from

# --- two bars: everything in closed form ------------------------------------------------------------------------------


class ExactBars:
    """T of two bars in rationals: ``T g = max(0, l1 - S1 ((g + l2)/S2 + gap))``.

    S = E/L. The load l of a bar, along the normal of body "1" (of step II): S times the displacement of its far end
    and half of its body force; the other half is the support's. Step I: ``u2 = (g + l2)/S2``. Step II: u1 is free,
    ``l1/S1``, or stopped at ``u2 + gap``. Step III: the reaction is ``l1 - S1 u1``.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        spec = vf.Problem.from_dict(data)
        bodies = [spec.body1, spec.body2]
        up = 1
        if spec.iteration.neumann_body == 1:
            bodies.reverse()
            up = -1
        self.gap = spec.contact.gap
        stiffness, loads, self.terms = [], [], []
        for body in bodies:
            length = body.x[1] - body.x[0]
            S = body.young / length
            moved = next((v[0] for v in body.prescribed.values()), Fraction(0))
            stiffness.append(S)
            loads.append(up * (S * moved + body.body_force[0] * length / 2))
            self.terms.append(abs(S * moved) + abs(body.body_force[0] * length / 2))
        (self.S1, self.S2), (self.l1, self.l2) = stiffness, loads

    @property
    def rho(self) -> Fraction:
        return self.S1 / self.S2

    def __call__(self, g: Fraction) -> Fraction:
        return max(Fraction(0), self.l1 - self.S1 * ((g + self.l2) / self.S2 + self.gap))

    @property
    def fixed_point(self) -> Fraction:
        """``g = l1 - rho (g + l2) - S1 gap``, or 0 where that would pull."""
        return max(Fraction(0), (self.l1 - self.rho * self.l2 - self.S1 * self.gap) / (1 + self.rho))

    def size(self, g: Fraction) -> float:
        """All that T g adds, without signs: what rounding is measured by."""
        return float(self.terms[0] + self.rho * (abs(g) + self.terms[1]) + self.S1 * self.gap)


@strategies.fewer(2, at_night=1)
@given(data=strategies.bar_problems(), multiple=st.fractions(-4, 4, max_denominator=50))
def test_T_of_two_bars_is_a_broken_line(data, multiple):
    T = ExactBars(data)
    g = multiple * (abs(T.l1) + abs(T.l2) + T.S2 * T.gap)
    u, solution = FixedPointMap(pair_from(vf.Problem.from_dict(data)), "active-set")(np.array([float(g)]))
    assert solution.force[0] == pytest.approx(float(T(g)), rel=0, abs=1e-13 * T.size(g))
    assert u[0] == pytest.approx(float((g + T.l2) / T.S2), rel=0, abs=1e-13 * T.size(g) / float(T.S1))


@strategies.fewer(2, at_night=1)
@given(data=strategies.bar_problems())
def test_the_fixed_point_of_two_bars_is_where_the_broken_line_meets_the_diagonal(data):
    T = ExactBars(data)
    exact = T.fixed_point
    assert T(exact) == exact
    _, solution = FixedPointMap(pair_from(vf.Problem.from_dict(data)), "active-set")(np.array([float(exact)]))
    assert solution.force[0] == pytest.approx(float(exact), rel=0, abs=1e-13 * T.size(exact))


@strategies.fewer(2, at_night=1)
@given(data=strategies.bar_problems())
def test_the_iterates_of_two_bars_are_those_in_rationals(data):
    """Eight steps; rounding grows at most by the slope of T_theta."""
    T, theta, g = ExactBars(data), Fraction(data["iteration"]["theta"]), Fraction(0)
    growth, error = max(float(abs(1 - theta - theta * T.rho)), 1.0), 1e-13
    for state in islice(vf.iterate(vf.Problem.from_dict(data), solver="active-set"), 8):
        assert state.g[0] == pytest.approx(float(g), rel=0, abs=error * T.size(g))
        g = theta * T(g) + (1 - theta) * g
        error = growth * error + 1e-13


@pytest.mark.parametrize("theta", ["1/10", "2/5", "1/2", "7/10"])
@pytest.mark.parametrize("moduli", [(1, 1), (3, 2), (1, 4)])
def test_while_two_bars_touch_the_error_is_multiplied_by_1_minus_theta_minus_theta_rho(moduli, theta):
    """The cobweb: started beside the fixed point it never leaves the branch in contact."""
    data = loaded_bars((1, 2), moduli, theta)
    T, theta = ExactBars(data), Fraction(theta)
    exact = float(T.fixed_point)
    assert exact > 0
    states = list(
        islice(vf.iterate(vf.Problem.from_dict(data), solver="active-set", start=np.array([1.01 * exact])), 6)
    )
    assert all(state.contact.pattern.touching.all() for state in states)
    factor = float(1 - theta - theta * T.rho)
    for before, after in pairwise(states):
        assert after.g[0] - exact == pytest.approx(factor * (before.g[0] - exact), rel=1e-9, abs=1e-14 * exact)


def test_two_bars_converge_in_one_step_at_theta_1_over_1_plus_rho():
    data = loaded_bars((1, 2), (3, 2), 0.5)
    T = ExactBars(data)
    run = vf.run(vf.Problem.from_dict(data), theta=1 / (1 + T.rho), solver="active-set")
    assert (run.outcome, run.iterations) == ("converged", 1)
    assert run.last.g[0] == pytest.approx(float(T.fixed_point), rel=1e-14)


some = pytest.mark.parametrize("name", SAMPLES if strategies.AT_NIGHT else SAMPLES[1::2])


# --- repeatable, whoever solves step II -------------------------------------------------------------------------------


def same_states(one: Run, other: Run) -> bool:
    return one.iterations == other.iterations and all(
        np.array_equal(a.g, b.g)
        and np.array_equal(a.displacement, b.displacement)
        and np.array_equal(a.contact.v, b.contact.v)
        and a.residual == b.residual
        for a, b in zip(one.iterates, other.iterates, strict=True)
    )


@some
@pytest.mark.parametrize("solver", ["active-set", "auto"] if strategies.AT_NIGHT else ["auto"])
def test_a_run_repeats_to_the_digit(name, solver):
    one, other = (vf.run(problem(PROBLEMS[name], max_iterations=8), solver=solver) for _ in range(2))
    assert same_states(one, other)


@some
def test_all_solvers_give_the_same_iterates_and_certify_each(name):
    runs = {s: vf.run(problem(PROBLEMS[name], max_iterations=6), solver=s) for s in ("active-set", "auto", "cvxpy")}
    reference = runs["active-set"]
    assert {s.contact.solver for s in runs["cvxpy"].iterates} == {"cvxpy"}
    assert runs["auto"].iterates[0].contact.solver == "active-set"
    for run in runs.values():
        assert run.iterations == reference.iterations
        for state, expected in zip(run.iterates, reference.iterates, strict=True):
            assert state.contact.kkt.residual <= TOLERANCE == 1e-11
            assert relative(state.image, expected.image) < 1e-8
            assert relative(state.displacement, expected.displacement) < 1e-8
            assert relative(state.contact.v, expected.contact.v) < 1e-8


@strategies.fewer(2)
@given(data=strategies.contact_problems())
def test_each_state_follows_from_the_one_before(data):
    """(III), and the residual and the size in the norm (5.21)."""
    pair = pair_from(vf.Problem.from_dict(data))
    theta, S2 = float(data["iteration"]["theta"]), pair.neumann.schur
    try:
        states = list(islice(vf.iterate(pair, solver="active-set"), 4))
    except ContactError:
        states = list(islice(vf.iterate(pair, solver="auto"), 4))
    assert (states[0].g == 0).all()
    for i, state in enumerate(states):
        assert state.iteration == i
        difference = state.image - state.g
        assert state.residual == pytest.approx(np.sqrt(difference @ np.linalg.solve(S2, difference)), rel=1e-9, abs=0)
        # what T g displaces is what g and the load displace less what the load does: the load's rounding stays
        rounding = 1e-15 * max(side.dual_norm(side.load) for side in (pair.contact, pair.neumann))
        expected = np.sqrt(state.image @ np.linalg.solve(S2, state.image))
        assert state.size == pytest.approx(expected, rel=1e-9, abs=rounding)
        expected = np.sqrt(state.g @ np.linalg.solve(S2, state.g))
        assert state.scale == pytest.approx(max(expected, state.size), rel=1e-9, abs=rounding)
    for before, after in pairwise(states):
        assert np.array_equal(after.g, theta * before.image + (1 - theta) * before.g)


# --- outcomes ---------------------------------------------------------------------------------------------------------


def test_a_run_converges_at_the_first_residual_below_its_tolerance():
    for tolerance in ("1e-3", "1e-6", "1e-9"):
        run = vf.run(problem(SECTION_6, tolerance=tolerance), solver="active-set")
        assert run.outcome == "converged"
        assert run.history[-1] <= float(tolerance)
        assert all(value > float(tolerance) for value in run.history[:-1])


def test_a_run_that_wanders_at_a_level_stalls():
    """Stiff on soft, the soft body with the Neumann problem: theta = 0.9 is far outside, an open patch saturates T."""
    swung = changed(body1={"young": 20000}, body2={"young": 70000}, iteration={"theta": "0.9"})
    run = vf.run(vf.Problem.from_dict(swung), solver="auto")
    assert run.outcome == "stalled"
    assert min(run.history) > 1e-3
    residuals = [state.residual for state in run.iterates]
    assert int(np.argmin(residuals)) == run.iterations - PATIENCE


def test_a_run_ends_at_max_iterations():
    run = vf.run(problem(SECTION_6, max_iterations=3), solver="active-set")
    assert (run.outcome, run.iterations, run.evaluations, run.converged) == ("limit", 3, 4, False)


def test_a_run_whose_states_would_fill_the_memory_is_refused_before_its_first_step():
    given = problem(SECTION_6, max_iterations=10**9)
    with pytest.raises(vf.ProblemError, match="every iterate is kept") as error:
        vf.run(given, watch=lambda state: pytest.fail("a step was taken"))
    assert error.value.key == "iteration.max_iterations"
    most = int(re.search(r"at most (\d+)", error.value.needed)[1])
    tracemalloc.start()
    kept = list(islice(vf.iterate(given, theta=0.01), 120))[20:]  # the first steps build what is kept once
    start, _ = tracemalloc.get_traced_memory()
    del kept
    end, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (start - end) / 100 * most < 1.2 * MOST_BYTES


def test_a_run_whose_residual_grows_without_bound_diverges():
    """The local law at k = 50: nothing bounds the friction forces."""
    wild = changed(
        body1={"young": 20000},
        body2={"young": 70000},
        contact={"law": "local", "friction": 50},
        iteration={"theta": "0.9"},
    )
    run = vf.run(vf.Problem.from_dict(wild), solver="auto")
    assert run.outcome == "diverged"
    residuals = [state.residual for state in run.iterates]
    assert residuals[-1] > RUNAWAY * residuals[0] >= max(residuals[:-1])


def interrupt_after(count: int) -> Callable[[Iterate], None]:
    def watch(state: Iterate) -> None:
        if state.iteration == count:
            raise KeyboardInterrupt

    return watch


def test_an_interrupted_run_keeps_what_it_has_computed():
    whole = vf.run(problem(SECTION_6), solver="active-set")
    run = vf.run(problem(SECTION_6), solver="active-set", watch=interrupt_after(4))
    assert run.outcome == "interrupted"
    assert [state.residual for state in run.iterates] == [state.residual for state in whole.iterates[:5]]


def test_a_watcher_sees_every_state_in_order():
    seen: list[Iterate] = []
    run = vf.run(problem(SECTION_6), solver="active-set", watch=seen.append)
    assert tuple(seen) == run.iterates


@pytest.mark.parametrize("friction", [0, "0.2"])
@pytest.mark.parametrize("lift", ["0.015", "0.001"])
def test_bodies_that_are_pulled_apart_converge_to_no_force(lift, friction):
    """g = 0 is a fixed point: the run is over where it begins."""
    apart = changed(body2={"prescribed": {"top": ["0.001", lift]}}, contact={"friction": friction})
    run = vf.run(vf.Problem.from_dict(apart), solver="active-set")
    assert np.abs(run.contact.pressure).max() < 1e-9
    assert run.contact.pattern == {"stick": 0, "slip": 0, "open": 7}
    assert run.outcome == "converged"

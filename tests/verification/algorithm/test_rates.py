"""The observed rate and the largest step ratio: each step judged by the noise of its own states."""

from __future__ import annotations

import sys
from dataclasses import replace
from fractions import Fraction
from itertools import islice, pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from chain_problems import case, run_of
from strategies import AT_NIGHT

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.rates import CLEAR_OF_NOISE, largest_step_ratio, noise, observed_rate, rate_at_the_end
from verification.algorithm.runs import Run, run
from verification.bounds.verdicts import TIGHT, judge

EPSILON = sys.float_info.epsilon

#: A pair whose noise at a state is 4 eps |g|.
SAME = lambda values: values
PAIR = SimpleNamespace(
    interface=SimpleNamespace(slipped=np.zeros(0), moduli=SimpleNamespace(carry=SAME, carry_back=SAME)),
    neumann=SimpleNamespace(schur=np.zeros((1, 1)), inverse=np.eye(1), load=np.zeros(1)),
    contact=SimpleNamespace(schur=np.zeros((1, 1)), load=np.zeros(1)),
)


def states(residuals: list[float], noises: list[float], patterns: str = "") -> list[SimpleNamespace]:
    """Made-up states with these residuals, noises and, letter by letter, contact patterns."""
    of = lambda r, noise, pattern: SimpleNamespace(
        residual=r,
        g=np.array([noise / (4 * EPSILON)]),
        displacement=np.zeros(1),
        contact=SimpleNamespace(pattern=pattern),
    )
    return [of(*one) for one in zip(residuals, noises, patterns or "a" * len(residuals), strict=True)]


def soft_contact_body(theta: str) -> Run:
    """E1/E2 = 1e-4 with the Neumann problem on the soft body: the iteration runs away."""
    problem = vf.load(_section6())
    softer = replace(problem, body1=replace(problem.body1, young=Fraction(2)))
    return run(softer, theta=theta)


def _section6():
    from importlib import resources

    return resources.files("verification") / "data" / "section6.toml"


@pytest.fixture(scope="module")
def diverged() -> Run:
    return soft_contact_body("0.5")


def test_a_run_that_diverges_shows_its_growth_and_no_rate(diverged):
    """By a factor of 65 in one step; the noise of its last state is larger than the residuals before that step."""
    assert diverged.outcome == "diverged"
    residuals = [s.residual for s in diverged.iterates]
    grown = [b / a for a, b in pairwise(residuals)]
    seen = largest_step_ratio(diverged.pair, diverged.iterates)
    assert seen.value == pytest.approx(max(grown), rel=1e-12)
    assert seen.lo > 60
    assert CLEAR_OF_NOISE * noise(diverged.pair, diverged.last) > residuals[np.argmax(grown)]
    assert diverged.observed_rate is None
    assert diverged.observed_growth > 1
    document = diverged.to_dict()
    assert document["observed_rate"] is None
    assert "growth" in document["reason"]["observed_rate"]
    assert document["observed_growth"] == diverged.observed_growth


def test_a_run_that_does_not_diverge_has_no_growth():
    done = run(vf.load(_section6()))
    assert (done.outcome, done.observed_growth) == ("converged", None)
    assert "observed_growth" in done.to_dict()["reason"]


def test_a_step_is_judged_by_the_noise_of_its_own_two_states():
    """The noise of the last state does not reach the steps before it."""
    some = states([1.0, 0.5, 50.0], [1e-15, 1e-14, 1e-2])
    seen = largest_step_ratio(PAIR, some)
    assert (seen.value, seen.steps) == (100.0, 2)
    assert seen.lo == pytest.approx((50 - 1e-2) / (0.5 + 1e-14), rel=1e-12)
    assert seen.hi == pytest.approx((50 + 1e-2) / (0.5 - 1e-14), rel=1e-12)


def test_a_step_begins_clear_of_the_noise_and_may_end_below_it():
    seen = largest_step_ratio(PAIR, states([1.0, 1e-3, 1e-5], [1e-4] * 3))
    assert (seen.value, seen.steps) == (1e-3, 1)  # from 1e-3 the noise of 1e-4 hides where it leads
    assert seen.lo == pytest.approx((1e-3 - 1e-4) / (1 + 1e-4), rel=1e-9)
    assert seen.hi == pytest.approx((1e-3 + 1e-4) / (1 - 1e-4), rel=1e-9)
    assert largest_step_ratio(PAIR, states([1.0, 0.5], [1.1 / CLEAR_OF_NOISE] * 2)) is None
    below = largest_step_ratio(PAIR, states([1.0, 1e-6], [1e-4] * 2))
    assert below.lo == 0.0


def test_every_clear_step_counts_below_and_only_those_furthest_from_the_noise_above():
    near = largest_step_ratio(PAIR, states([1.0, 0.1, 0.09], [1e-10, 1e-4, 1e-4]))
    assert (near.value, near.steps) == (pytest.approx(0.9), 2)
    assert near.lo == pytest.approx((0.09 - 1e-4) / (0.1 + 1e-4), rel=1e-12)
    assert near.hi == near.value
    hidden = largest_step_ratio(PAIR, states([1.0, 0.5, 0.2525], [1e-12, 1e-12, 1e-2]))
    assert (hidden.value, hidden.steps) == (0.5, 2)  # 0.505 +- 0.02 shows no more than 0.5 does
    assert hidden.hi == pytest.approx((0.2525 + 1e-2) / (0.5 - 1e-12), rel=1e-12)  # as far from the noise as the first


def test_where_no_step_is_eight_digits_above_the_noise_those_furthest_from_it_give_the_upper_end():
    """The last step, within a per cent, would leave a bound of 0.505 undecided."""
    seen = largest_step_ratio(PAIR, states([1.0, 0.5, 0.25, 0.01, 0.005], [1e-6, 1e-6, 1e-6, 1e-6, 9e-5]))
    assert seen.hi == pytest.approx((0.25 + 1e-6) / (0.5 - 1e-6), rel=1e-12)
    assert judge(0.505, seen, "").verdict == "CONSISTENT"
    assert judge(0.499, seen, "").verdict == "VIOLATED"


@pytest.mark.parametrize("seed", range(40) if AT_NIGHT else (0, 1, 5))
def test_a_bound_just_below_any_step_that_is_clear_of_the_noise_is_violated(seed):
    """By the lower end of that step: a false bound does not pass because other steps are further from the noise."""
    pair, measured, theta, _ = case(seed, tolerance=1e-12, max_iterations=500)
    done = run_of(pair, measured, theta).iterates
    floors, residuals = [noise(pair, each) for each in done], [each.residual for each in done]
    steps = [i for i in range(len(done) - 1) if residuals[i] > CLEAR_OF_NOISE * floors[i]]
    low = [(residuals[i + 1] - floors[i + 1]) / (residuals[i] + floors[i]) for i in steps]
    seen = largest_step_ratio(pair, done)
    if not steps:  # a run that begins at its solution
        assert seen is None or seen.steps == 0
        return
    assert (seen.steps, seen.lo) == (len(steps), pytest.approx(max(low), rel=1e-12))
    for end in low:
        bound = end - 2 * TIGHT * (1 - end)
        assert judge(bound, seen, "").verdict == "VIOLATED"


def test_a_start_at_the_solution_takes_no_step():
    assert largest_step_ratio(PAIR, states([0.0], [1e-9])).steps == 0
    assert largest_step_ratio(PAIR, []) is None


def test_a_residual_that_overflows_ends_what_counts():
    some = states([1.0, 3.0, float("inf"), float("nan")], [1e-15, 1e-15, float("inf"), float("nan")])
    assert largest_step_ratio(PAIR, some).value == 3.0
    assert observed_rate(PAIR, some) is None


def test_two_step_ratios_are_the_least_that_show_a_rate():
    assert observed_rate(PAIR, states([1.0, 0.5], [1e-15] * 2)) is None
    found = observed_rate(PAIR, states([1.0, 0.5, 0.125], [1e-15] * 3))
    assert found.value == pytest.approx(np.sqrt(0.125), rel=1e-12)
    assert (found.begin, found.end) == (0, 2)
    assert str(found) == "0.354 (iterations 0 to 2)"
    assert observed_rate(PAIR, states([1.0, 0.5, 1e-20], [1e-15] * 3)) is None  # the third is noise


def test_the_rate_is_that_of_the_last_quarter_since_the_pattern_changed():
    """Sixteen steps in the final pattern: the last four count, and the four before them for the interval."""
    steps = [0.9] * 3 + [0.8] * 8 + [0.5] * 4 + [0.4] * 4
    residuals = [float(r) for r in np.cumprod([1.0, *steps])]
    found = observed_rate(PAIR, states(residuals, [1e-30] * 20, "aaa" + "b" * 17))
    assert (found.begin, found.end) == (15, 19)
    assert found.value == pytest.approx(0.4, rel=1e-12)
    assert (found.lo, found.hi) == (pytest.approx(0.4, rel=1e-9), pytest.approx(0.5, rel=1e-9))


def test_a_change_of_pattern_shortens_what_counts():
    """From the last change on there are seven steps, of which the last two count."""
    residuals = [float(r) for r in np.cumprod([1.0, *[0.9] * 12, *[0.5] * 7])]
    assert observed_rate(PAIR, states(residuals, [1e-30] * 20, "a" * 12 + "b" * 8)).begin == 17
    assert observed_rate(PAIR, states(residuals, [1e-30] * 20)).begin == 15


def test_the_interval_holds_the_noise_of_both_ends():
    """``(r_j +- noise_j) / (r_i -+ noise_i)``."""
    found = rate_at_the_end([1.0, 0.5, 0.25], [0.01, 0.0, 0.02], 0)
    assert found.value == pytest.approx(0.5)
    assert found.lo == pytest.approx(np.sqrt(0.23 / 1.01), rel=1e-12)
    assert found.hi == pytest.approx(np.sqrt(0.27 / 0.99), rel=1e-12)


# --- the noise of one evaluation --------------------------------------------------------------------------------------


def cantilever(length: int, height: str, cells: tuple[int, int]) -> vf.Problem:
    """The Neumann body is clamped at its left end alone and pressed onto a clamped layer."""
    x = {"shape": "rectangle", "poisson": "0.3", "x": [0, length]}
    layer = {"y": ["-0.5", 0], "cells": [cells[0], 3], "young": 70000, "fixed": ["bottom"]}
    beam = {"y": [0, height], "cells": list(cells), "young": 20000, "fixed": ["left"], "traction": {"top": [0, -1]}}
    start = Fraction(2 * length, cells[0])
    contact = {"friction": "0.2", "radius": "0.3", "interval": [str(start), length]}
    return vf.Problem.from_dict({"body1": x | layer, "body2": x | beam, "contact": contact})


exact = np.vectorize(Fraction, otypes=[object])


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """By Gauss and Jordan, in rationals."""
    rows = np.column_stack([exact(matrix), right])
    for i in range(len(rows)):
        rows[i] /= rows[i, i]
        for j in set(range(len(rows))) - {i}:
            rows[j] -= rows[j, i] * rows[i]
    return rows[:, -1]


def exact_image(pair: vf.ContactPair, state) -> np.ndarray:
    """T at an iterate in rationals, by steps I and II written out for its contact pattern; one grid, friction acts."""
    S, t, pattern = exact(pair.contact.schur), pair.contact.grid.t, state.contact.pattern
    g = exact(state.g)
    phi = exact(pair.neumann.known) + solved(pair.neumann.schur, g + exact(pair.neumann.load))
    phi[pair.contact.grid.normal] += exact(pair.interface.gap)
    pressure = exact(pair.interface.kernel) @ g[pair.neumann.grid.normal]
    friction = exact(pair.contact.grid.weights) * Fraction(pair.friction) * abs(pressure) * exact(pattern.sliding)
    q = exact(pair.contact.load) - S @ phi
    right = q.copy()
    right[:t] -= friction
    moves = np.flatnonzero(np.concatenate([pattern.sliding != 0, ~pattern.touching]))
    v = exact(np.zeros(len(q)))
    if len(moves):
        v[moves] = solved(pair.contact.schur[np.ix_(moves, moves)], right[moves])
    return q - S @ v


def test_the_noise_of_a_cantilever_covers_the_distance_to_T_in_rationals():
    """Of what step I solves for little is left in u, so that errors come through ``S2^-1``: 22 times |S1| |u| there."""
    pair = vf.build(cantilever(2, "0.2", (10, 2)))
    theta = 1 / (1 + vf.measure(pair).rho_max.value)
    for state in islice(vf.iterate(pair, theta=theta), 0, 41, 20):
        off = (exact(state.image) - exact_image(pair, state)).astype(float)
        assert 0 < pair.neumann.dual_norm(off) <= noise(pair, state)


def test_the_noise_of_a_cantilever_covers_the_sums_of_a_run():
    """T at the displacement that follows by sums against T at the one that is solved for, as for other bodies."""
    pair = vf.build(cantilever(1, "0.5", (8, 4)))
    T, compared = FixedPointMap(pair), 0
    for state in islice(vf.iterate(pair, theta="0.02"), 80):
        again = iterate_at(T, state.g)
        if again.contact.pattern == state.contact.pattern:
            assert pair.neumann.dual_norm(again.image - state.image) <= noise(pair, state)
            compared += 1
    assert compared > 40

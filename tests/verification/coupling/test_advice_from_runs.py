"""What one run says of rho: its readings beside runs whose rho is known, and where following the advice leads."""

import math
from fractions import Fraction as F
from itertools import islice, product

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from problem_list import changed
from strategies import AT_NIGHT

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap, iterates
from verification.algorithm.relaxation import Constant
from verification.coupling.from_runs import advise_run
from verification.coupling.readings import same_run
from verification.interface.pair import pair_from

#: A residual fallen to this share of its largest has converged.
FALLEN = 1e-6

#: Residuals below this share are rounding, above this multiple a run has diverged.
ROUNDING, RUNAWAY = 1e-11, 1e9


def steps(theta):
    """Over how many steps a user is asked to find the ratio steady."""
    return max(10, math.ceil(5 / theta))


def converged(residuals):
    return residuals[-1] <= FALLEN * max(residuals)


def ratio(residuals, theta):
    """What a user reads off: the steady ratio of the last steps, 1 where the residual rises and falls."""
    n = min(steps(theta), (len(residuals) - 1) // 2)
    last = np.array(residuals[-n - 1 :])
    ratios = last[1:] / last[:-1]
    if converged(residuals) or (ratios < 1).all() or (ratios > 1).all():
        return float(last[-1] / last[0]) ** (1 / n)
    return 1.0


def advice(theta, residuals):
    return advise_run(repr(theta), repr(ratio(residuals, theta)))


def reading(found, kind):
    return next((r for r in found.readings if r.kind == kind), None)


# --- linear runs: a tied interface, and one with open nodes ----------------------------------------------------------

MODES = {
    "tied": (0.2, 0.5, 1.1, 3.0),
    "tied, the modes close together": (2.5, 2.8, 3.0),
    "tied, stiff": (4.0, 9.0, 30.0),
    "tied, soft": (0.05, 0.2, 0.3),
    "open nodes": (0.0, 0.5, 3.0),
    "open nodes, stiff": (0.0, 2.0, 30.0),
    "open nodes, soft": (0.0, 0.1, 0.3),
}


def run_of(modes, theta):
    """The absolute residuals of a run that excites every mode."""
    factors = 1 - theta * (1 + np.array(modes))
    # the shares differ from one another, so that no two modes cancel
    longest = int(300 / max(math.log(abs(factors).max()), 1e-9))  # within the doubles
    count = min(40 + 8 * steps(theta), longest)
    residuals = [float(np.linalg.norm(factors**n * np.arange(1, len(modes) + 1))) for n in range(count)]
    kept = [r for r in residuals if r / residuals[0] > ROUNDING]
    return kept if len(kept) > 12 else residuals[:12]


def slowest(modes, theta):
    """The reading that is right, and whether another mode is so close that none is."""
    factors = {mode: 1 - theta * (1 + mode) for mode in modes}
    order = sorted(modes, key=lambda mode: -abs(factors[mode]))
    close = abs(factors[order[1]]) > 0.93 * abs(factors[order[0]])
    kind = "mode-high" if factors[order[0]] < 0 else "mode-low" if order[0] else "open"
    return kind, order[0], close


@pytest.mark.parametrize("theta", [0.02, 0.06, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
@pytest.mark.parametrize("name", MODES)
def test_of_a_linear_run_one_reading_is_right_and_none_contradicts_rho(name, theta):
    modes, rho = MODES[name], max(MODES[name])
    kind, mode, close = slowest(modes, theta)
    residuals = run_of(modes, theta)
    found = advice(theta, residuals)
    right = reading(found, kind)
    if not close:
        assert right is not None
        if kind == "mode-high":
            assert right.value == pytest.approx(mode, rel=1e-2, abs=1e-3)
        if kind == "mode-low":
            assert right.lo == pytest.approx(mode, rel=5e-2, abs=2e-2)
        assert right.lo is None or right.lo <= rho * (1 + 1e-6) + 1e-3
    if ratio(residuals, theta) > 1 - theta:  # then the bound needs no reading
        assert reading(found, "mode-high").lo <= rho * (1 + 1e-6) + 1e-9
    if found.roles:
        best = found.best.theta_predicted
        assert max(abs(1 - best * (1 + m)) for m in modes) < 1
        assert found.next.theta <= best


@pytest.mark.parametrize("start", [0.02, 0.1, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("name", MODES)
def test_following_the_advice_on_a_linear_run_ends_near_the_best_theta(name, start):
    """With open nodes near a theta that converges: these hide rho until theta is too large."""
    modes, rho, theta = MODES[name], max(MODES[name]), start
    visited = []
    for _ in range(16):
        found = advice(theta, run_of(modes, theta))
        visited.append(theta)
        if found.roles:
            break
        theta = found.next.theta
    factor = max(abs(1 - found.next.theta * (1 + m)) for m in modes)
    if found.roles:
        assert factor < 1
        assert found.next.theta == pytest.approx(min(2 / (2 + rho), 0.99), rel=0.05)
    else:
        assert 0 in modes
        assert min(max(abs(1 - t * (1 + m)) for m in modes) for t in visited) < 1


# --- runs with contact -----------------------------------------------------------------------------------------------


def plates(E1, E2, neumann_body, friction):
    """Section 6 with other moduli."""
    moduli = {"body1": {"young": E1}, "body2": {"young": E2}}
    data = changed(**moduli, contact={"friction": friction}, iteration={"neumann_body": neumann_body})
    return pair_from(vf.Problem.from_dict(data))


def both_lengths(pair, theta):
    """The absolute residuals of a run, in the norm (5.21) and as Euclidean lengths."""
    energy, euclidean = [], []
    for state in islice(iterates(FixedPointMap(pair), Constant().begin(pair, theta, None)), 60 + 2 * steps(theta)):
        energy.append(state.residual)
        euclidean.append(float(np.linalg.norm(state.image - state.g)))
        if not ROUNDING * max(energy) < energy[-1] < RUNAWAY * energy[0]:
            break
    return energy, euclidean


def contact_run(pair, theta):
    return both_lengths(pair, theta)[0]


PLATES = {
    "lower Neumann, soft": (2e4, 7e4, 1),
    "upper Neumann, soft": (7e4, 2e4, 2),
    "equal": (2e4, 2e4, 1),
    "lower Neumann, very soft": (1e3, 5e4, 1),
    "good roles": (7e4, 2e4, 1),
}


#: Each plate without friction, and with one friction in turn; at night with both.
RUBBING = [
    (name, friction)
    for i, name in enumerate(PLATES)
    for friction in ("0", *(("0.2", "1") if AT_NIGHT else ("0.2", "1")[i % 2 :][:1]))
]


@pytest.mark.parametrize(("name", "friction"), RUBBING)
def test_no_theta_is_pasted_from_a_run_that_stays_at_a_level(name, friction):
    """Taken as a mode, a ratio of about 1 led to a theta that never converges."""
    pair = plates(*PLATES[name], friction)
    measured = vf.measure(pair)
    rho = (measured.rho_max if friction != "0" else measured.rho_normal).value
    levels = 0
    for times in (1.1, 1.4, 2.2, 5):
        theta = round(times * 2 / (1 + rho), 4)
        if not theta < 1:
            continue
        residuals = contact_run(pair, theta)
        if converged(residuals):
            continue
        levels += 1
        for given_ratio in (ratio(residuals, theta), 1, 1 - min(0.08, theta / 2), 0.98, 1.05):
            found = advise_run(repr(theta), repr(given_ratio))
            assert found.roles == ()
            assert found.next.theta < theta
            with pytest.raises(ValueError, match="next"):
                _ = found.best
            level = reading(found, "level")
            assert level.value is None
            assert level.lo == pytest.approx(2 / theta - 1)
            if friction == "0":
                assert level.lo <= rho
    assert levels > 0 or rho <= 1.2


@pytest.mark.parametrize("name", PLATES)
def test_without_friction_rho_is_at_least_what_a_ratio_above_1_minus_theta_says(name):
    pair = plates(*PLATES[name], "0")
    rho = vf.measure(pair).rho_normal.value
    bounds = [0, 0]  # in either norm
    for theta in (0.9, 0.6, 0.35, 0.2, 0.1, min(1.9 / (1 + rho), 0.99)):
        for i, residuals in enumerate(both_lengths(pair, round(theta, 4))):
            if ratio(residuals, theta) > 1 - theta:
                bounds[i] += 1
                assert reading(advice(round(theta, 4), residuals), "mode-high").lo <= rho * (1 + 1e-6)
    assert min(bounds) > 0


#: Plates, frictions and starts in turn; at night each with each.
EVERY = list(product(PLATES, ["0", "0.2", "1"], [0.9, 0.3]))
FOLLOWED = EVERY if AT_NIGHT else EVERY[::5]


@pytest.mark.parametrize(("name", "friction", "start"), FOLLOWED)
def test_following_the_advice_ends_in_a_theta_that_converges_within_a_few_runs(name, friction, start):
    pair, theta = plates(*PLATES[name], friction), start
    found = advice(theta, contact_run(pair, theta))
    for _ in range(6):
        theta = found.next.theta
        residuals = contact_run(pair, theta)
        if converged(residuals):
            break
        assert found.roles == ()  # what is pasted converges
        found = advice(theta, residuals)
    assert converged(residuals)


# --- the arithmetic --------------------------------------------------------------------------------------------------

THETAS = st.fractions(F(1, 10**6), 1)
RATIOS = st.fractions(F(1, 10**6), 50)


@given(THETAS, RATIOS)
def test_a_bound_is_never_rounded_up_and_the_readings_solve_their_equations(theta, r):
    found = advise_run(theta, r)
    lambdas = {"mode-high": (1 + r) / theta - 1, "mode-low": (1 - r) / theta - 1, "level": 2 / theta - 1, "open": None}
    signs = {"mode-high": -r, "mode-low": r, "level": -1}
    for one in found.readings:
        exactly = lambdas[one.kind]
        assert (one.lo is None) == (exactly is None)
        if exactly is not None:
            assert 1 - theta * (1 + exactly) == signs[one.kind]
            assert F(one.lo) <= exactly
            assert one.lo == pytest.approx(float(exactly), rel=1e-15, abs=0)
    kinds = [one.kind for one in found.readings]
    assert kinds[0] == "mode-high"
    assert ("mode-low" in kinds) == (r <= 1 - theta)
    assert ("level" in kinds) <= (r > 1 - theta)
    assert r < 1 or "level" in kinds


@example(F(22859, 22861), F(46, 571525))  # four figures of theta alone would go back to 0.9999
@example(F(1, 2), F(3, 4))  # one reading is left
@example(F(1, 2), F(1))
@example(F(1, 2), F(3))
@given(THETAS, RATIOS)
def test_a_theta_is_pasted_only_where_one_reading_is_left_and_is_smaller_than_that_of_a_run_that_converges(theta, r):
    found = advise_run(theta, r)
    assert (found.roles != ()) == (len(found.readings) == 1)
    assert 0 < found.next.theta < 1
    if found.roles:
        assert 1 - theta < r < 1
        assert F(found.next.theta) <= theta
        assert found.best.theta_predicted == pytest.approx(float(2 / (1 + (1 + r) / theta)), rel=1e-12)
    elif r >= 1:
        assert F(found.next.theta) <= (theta / 2 if r == 1 else 2 * theta / (1 + r))
    elif r <= 1 - theta and theta > F(1, 1000):
        assert found.next.theta > theta


@given(st.fractions(F(1, 100), F(99, 100)), st.complex_numbers(max_magnitude=20), st.fractions(F(1, 100), 1))
def test_a_mode_that_a_theta_damps_is_damped_by_every_smaller_one(theta, eigenvalue, share):
    """Complex where something slides: what is pasted is smaller than a theta that converges near the solution."""
    factor = lambda t: abs(1 - float(t) * (1 - eigenvalue))
    assume(factor(theta) < 1 - 1e-9)
    assert factor(share * theta) < 1


def test_a_document_of_a_run_says_what_is_unknown_and_why():
    document = advise_run("0.1", "1.4").to_dict()
    assert document["schema"] == "ndtheory.advice/1"
    assert document["roles"] == []
    assert document["neumann_body"] is None
    assert [r["kind"] for r in document["readings"]] == ["mode-high", "level"]
    high, level = (r["rho"] for r in document["readings"])
    assert high == {"value": 23.0, "lo": 23.0, "hi": None, "level": "exact"}
    assert level == {"value": None, "lo": 19.0, "hi": None, "level": "exact"}
    for one in document["readings"]:
        assert {f"rho.{name}" for name, value in one["rho"].items() if value is None} == set(one["reason"])
        assert "without friction" in one["says"]
    assert "at least 19" in document["readings"][1]["says"]
    assert document["next"]["theta"] == pytest.approx(2 / 24.75, rel=1e-3)
    assert "absolute" in document["run"]["residual"]
    from_problem = vf.advise(vf.Problem.from_dict(changed())).to_dict()
    assert (from_problem["readings"], from_problem["next"], from_problem["run"]) == ([], None, None)
    assert {"next", "run"} <= set(from_problem["reason"])


@pytest.mark.parametrize(
    ("theta", "ratio", "kinds"),
    [
        ("0.45", "0.8", ["mode-high"]),
        ("0.1", "1.4", ["mode-high", "level"]),
        ("0.3", "0.97", ["mode-high", "level"]),
        ("0.1", "0.5", ["mode-high", "mode-low"]),
        ("0.6", "0.4", ["mode-high", "mode-low", "open"]),
        ("0.6", "0.405", ["mode-high", "open"]),
        ("1", "1/2", ["mode-high"]),
    ],
)
def test_the_readings_of_a_ratio(theta, ratio, kinds):
    assert [one.kind for one in advise_run(theta, ratio).readings] == kinds


def test_a_bound_in_words_is_not_rounded_up_and_a_theta_of_1_is_a_run_of_its_own():
    assert "rho is at least 5.333, " in vf.advise_run("0.3", "0.9").readings[0].says  # 16/3
    assert "rho is at least 5.666; " in vf.advise_run("0.3", "1").readings[1].says  # 17/3
    assert same_run(1.0, F(1))
    assert not same_run(0.99, F(1))
    assert same_run(0.3005, F(3, 10))

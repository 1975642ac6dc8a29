"""The theorem in energy norms beside a search in 160 digits that knows none of its formulas, and in exact rationals.

The oracle is given the quadratic of (5.24) in x = |d_1|/|d_2| and the inequality that bounds x.  All else it finds:
the largest x among the roots of a polynomial, q by comparing both ends and the vertex, the interval by halving, the
best theta by golden sections.
"""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction as F

import numpy as np
import oracle
import pytest
import strategies
from energy_oracle import (
    RHO,
    SHARES,
    cases,
    differences,
    energies,
    energy,
    formula_differences,
    near_threshold,
    rational_ratios,
    right_side,
    summit,
)
from hypothesis import given
from hypothesis import strategies as st

from ndtheory import EnergyConstants, energy_norms, evaluate_energy, exact

pytestmark = pytest.mark.usefixtures("many_digits")

# --- against the search --------------------------------------------------------------------------------------------


@strategies.fewer(2)
@given(cases())
def test_every_field_and_formula_agrees_with_a_search_for_the_worst_case(case):
    """A factor is reported where the worst case shrinks, below 1 by no less at the best theta, which needs no theta."""
    constants, theta = case
    assert differences(*case) == []
    assert formula_differences(*case) == []
    without, found = (evaluate_energy(EnergyConstants(**constants), t) for t in (None, theta))
    contracts = energy(**constants).contracts(oracle.real(theta))
    assert found.verdict == ("contraction" if contracts else "no conclusion")
    assert (found.factor is not None) == (found.one_minus_factor is not None) == contracts
    assert without == replace(found, theta=None, factor=None, one_minus_factor=None, verdict=None)
    assert found.factor is None or found.factor_proved.value <= found.factor.value
    assert found.interval is None or found.interval[0] < found.theta_proved <= found.interval[1]


# --- exact rationals -----------------------------------------------------------------------------------------------


@given(rational_ratios())
def test_r_is_the_positive_root_and_there_the_work_is_minus_sqrt_rho_r(numbers):
    root, kappa_1, kappa_2, ratio = numbers
    assert energy_norms.largest_ratio(root**2, kappa_1, kappa_2) == ratio
    assert ratio**2 == (root + kappa_1) * ratio + kappa_2
    assert energy_norms.work(ratio, kappa_1, kappa_2) == -root * ratio


@given(rational_ratios(), strategies.thetas(), SHARES)
def test_q_is_the_larger_of_both_ends_and_the_vertex_in_exact_rationals(numbers, theta, share):
    """No x between 0 and r exceeds it; at r it is the distance of theta (1 + sqrt(rho) r) from 1."""
    root, kappa_1, kappa_2, ratio = numbers
    data = (root**2, kappa_1, kappa_2)
    quadratic = lambda x: right_side(x, theta, *data)
    worst, largest = summit(quadratic, ratio)
    found, lost = energy_norms.worst_ratio(theta, *data), energy_norms.one_minus_square(theta, *data)
    assert quadratic(worst) == quadratic(found) == largest == 1 - lost
    assert 0 <= found <= ratio
    assert energy_norms.square_at(worst, theta, *data) == largest >= quadratic(share * ratio)
    square = (1 - theta * (1 + root * ratio)) ** 2
    assert energy_norms.square_at(ratio, theta, *data) == square == 1 - energy_norms.one_minus_end(theta, *data)


@given(rational_ratios())
def test_both_branches_meet_at_the_turning_theta(numbers):
    root, kappa_1, kappa_2, ratio = numbers
    data = (root**2, kappa_1, kappa_2)
    turn = energy_norms.turning_theta(*data)
    assert 0 < turn < 1
    assert energy_norms.one_minus_end(turn, *data) == energy_norms.one_minus_inside(turn, *data)
    assert turn * (1 + root * ratio) > 1, "so q grows from there on"
    assert (turn == 2 / (2 + root**2)) == (kappa_1 == 0)


@strategies.fewer(2, at_night=1)
@given(energies(), st.integers(20, 60))
def test_q_is_continuous_at_the_turning_theta(constants, digits):
    found = energy(**constants)
    turn = oracle.rational(found.turning, 75)
    below, above = (evaluate_energy(EnergyConstants(**constants), turn + side * turn / 10**digits) for side in (-1, 1))
    assert below.verdict == above.verdict
    assert below.factor is None or below.factor.value == pytest.approx(above.factor.value, abs=1e-15)


@given(st.integers(1, 10**6), st.integers(1, 10**6), st.integers(0, 10**6), st.integers(1, 10**6))
def test_rational_constants_are_kept_as_they_were_written(numerator, denominator, kappa, normal):
    rho = F(numerator, denominator)
    given = EnergyConstants(
        rho=f"{numerator}/{denominator}",
        kappa_1=kappa / 1024,
        kappa_2=Decimal(kappa).scaleb(-3),
        rho_normal=rho / normal,
    )
    assert (given.rho, given.rho_normal) == (rho, rho / normal)
    assert (given.kappa_1, given.kappa_2) == (exact(kappa / 1024), F(kappa, 1000))
    assert evaluate_energy(given).rho.value == float(given.at_work)


# --- without friction ----------------------------------------------------------------------------------------------


@given(RHO, strategies.thetas())
def test_without_friction_q_is_the_larger_of_1_minus_theta_and_1_minus_theta_minus_theta_rho(rho, theta):
    found = evaluate_energy(EnergyConstants(rho=rho), theta)
    q = max(1 - theta, abs(1 - theta - theta * rho))
    assert found.verdict == ("contraction" if q < 1 else "no conclusion")
    if q < 1:
        assert found.factor.value == float(q)
        assert found.one_minus_factor.value == float(1 - q)


@given(RHO)
def test_without_friction_the_best_theta_is_2_over_2_plus_rho_below_the_smaller_of_1_and_2_over_1_plus_rho(rho):
    found = evaluate_energy(EnergyConstants(rho=rho))
    assert found.interval == (0, float(min(F(1), 2 / (1 + rho))))
    assert found.theta_max_proved.value == found.interval[1]
    assert found.theta_proved == found.theta_predicted == float(2 / (2 + rho))
    assert found.factor_proved.value == found.rate_predicted == float(rho / (2 + rho))
    assert (found.ratio.value, found.friction_multiple) == (float(oracle.square_root(rho)), None)


@given(RHO, st.integers(1, 99).map(lambda n: F(n, 100)), strategies.thetas())
def test_without_friction_the_tangential_components_do_not_count(rho, share, theta):
    normal = share * rho
    assert evaluate_energy(EnergyConstants(rho=rho, rho_normal=normal), theta) == evaluate_energy(
        EnergyConstants(rho=normal), theta
    )


@strategies.fewer(4, at_night=2)
@given(cases(), st.integers(1, 99).map(lambda n: F(n, 100)))
def test_with_any_friction_the_tangential_components_count(case, share):
    constants, theta = case
    constants = {**constants, "kappa_1": constants["kappa_1"] or F(1, 10**9)}
    known, unknown = ({**constants, "rho_normal": normal} for normal in (share * constants["rho"], None))
    assert EnergyConstants(**known).at_work == constants["rho"]
    assert evaluate_energy(EnergyConstants(**known), theta) == evaluate_energy(EnergyConstants(**unknown), theta)


def test_the_slightest_friction_makes_the_bound_jump_from_rho_normal_to_rho():
    slides = evaluate_energy(EnergyConstants(rho=3, rho_normal=1), "3/5")
    for key in ("kappa_1", "kappa_2"):
        sticks = evaluate_energy(EnergyConstants(rho=3, rho_normal=1, **{key: "1e-30"}), "3/5")
        assert (slides.factor.value, slides.theta_proved, slides.factor_proved.value) == (0.4, 2 / 3, 1 / 3)
        assert (sticks.factor, sticks.theta_proved, sticks.factor_proved.value) == (None, 0.4, 0.6)
        assert (slides.interval, sticks.interval) == ((0, 1), (0, 0.5))


# --- more friction, a stiffer contact body -------------------------------------------------------------------------


@strategies.fewer(2, at_night=1)
@given(cases(), st.sampled_from(["rho", "kappa_1", "kappa_2"]), strategies.log_uniform(-12, 2))
def test_q_grows_with_rho_and_with_friction(case, key, growth):
    """At fixed x the quadratic grows with each of the three, and so does r."""
    constants, theta = case
    constants = {**constants, "rho_normal": None}
    more = {**constants, key: constants[key] * (1 + growth) or growth}
    less, more = (evaluate_energy(EnergyConstants(**given), theta) for given in (constants, more))
    assert less.ratio.value <= more.ratio.value
    assert more.verdict == "no conclusion" or less.factor.value <= more.factor.value
    if more.interval is not None:
        assert less.interval[0] <= more.interval[0]
        assert less.interval[1] >= more.interval[1]
        assert less.factor_proved.value <= more.factor_proved.value
    if less.friction_multiple is not None and key != "rho":
        assert less.friction_multiple.value >= more.friction_multiple.value


@given(energies())
def test_friction_makes_the_best_theta_no_larger_and_its_factor_no_smaller_than_predicted(constants):
    found = evaluate_energy(EnergyConstants(**constants))
    if found.interval is not None:
        assert found.theta_proved <= found.theta_predicted
        assert found.factor_proved.value >= found.rate_predicted


@given(RHO, st.integers(0, 999).map(lambda n: F(n, 1000)))
def test_without_kappa_1_the_best_theta_is_the_predicted_one_whatever_kappa_2(rho, kappa_2):
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_2=kappa_2))
    assert found.theta_proved == found.theta_predicted


def test_the_best_theta_moves_either_way_with_kappa_2():
    best = lambda **given: evaluate_energy(EnergyConstants(**given)).theta_proved
    assert best(rho="1/30", kappa_1="27/20", kappa_2="1/10") < best(rho="1/30", kappa_1="27/20", kappa_2="1/9")
    assert best(rho=6, kappa_1="2/5", kappa_2="7/20") > best(rho=6, kappa_1="2/5", kappa_2="8/20")


@given(RHO, near_threshold())
def test_every_small_theta_contracts_exactly_when_kappa_2_plus_a_quarter_of_kappa_1_squared_is_below_1(rho, friction):
    kappa_1, kappa_2 = friction
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2), F(1, 10**60))
    below = kappa_2 + kappa_1**2 / 4 < 1
    assert found.verdict == ("contraction" if below else "no conclusion")
    assert (found.interval is not None and found.interval[0] == 0) == below
    assert (found.friction_multiple.value >= 1) == (below or found.friction_multiple.value == 1)


def test_friction_beyond_the_threshold_leaves_an_interval_away_from_0():
    """rho = 1/16, kappa_1 = 51/20, kappa_2 = 0: q = 1 at 7/12 exactly, and q(3/4) = sqrt(3841)/62.5 < 1."""
    constants = {"rho": F(1, 16), "kappa_1": F(51, 20)}
    found = evaluate_energy(EnergyConstants(**constants), "3/4")
    assert found.friction_multiple.value < 1
    assert found.interval == (7 / 12, float(energy(**constants).interval[1]))
    assert found.verdict == "contraction"
    assert evaluate_energy(EnergyConstants(**constants), F(7, 12) - F(1, 10**50)).verdict == "no conclusion"
    assert evaluate_energy(EnergyConstants(**constants), F(7, 12) + F(1, 10**50)).verdict == "contraction"


@given(st.integers(25, 300), st.integers(0, 99).map(lambda n: F(n, 100)), SHARES, RHO)
def test_close_to_theta_0_1_minus_q_is_theta_times_1_minus_the_friction_number(digits, number, share, rho):
    """But for terms smaller by a factor theta rho/(1 - number), at most 1e-17; q itself rounds to 1."""
    theta, w = F(1, 10**digits), share * number
    constants = EnergyConstants(rho=rho, kappa_1=2 * w, kappa_2=number - w**2)
    found = evaluate_energy(constants, theta)
    assert found.one_minus_factor.value == pytest.approx(float(theta * (1 - number)), rel=1e-15)
    assert found.factor.value == 1


# --- at the edges --------------------------------------------------------------------------------------------------


@given(rational_ratios(s=st.integers(101, 1000).map(lambda n: F(n, 100))))
def test_2_over_1_plus_sqrt_rho_r_itself_is_outside_the_interval(numbers):
    """There the quadratic is 1 at x = r, exactly."""
    root, kappa_1, kappa_2, ratio = numbers
    found = evaluate_energy(EnergyConstants(rho=root**2, kappa_1=kappa_1, kappa_2=kappa_2), 2 / (1 + root * ratio))
    assert (found.verdict, found.factor) == ("no conclusion", None)


@given(strategies.log_uniform(0.01, 6))
def test_without_friction_the_interval_is_open_at_2_over_1_plus_rho(rho):
    end = 2 / (1 + rho)
    constants = EnergyConstants(rho=rho)
    assert evaluate_energy(constants, end).verdict == "no conclusion"
    assert evaluate_energy(constants, end * (1 - F(1, 10**50))).verdict == "contraction"


@pytest.mark.parametrize("theta", ["2/3", "7/12", "1/3"])
def test_the_interval_is_open_at_ends_whose_decimals_do_not_end(theta):
    """rho = 2 and rho = 5 without friction, and the lower end 7/12 of rho = 1/16, kappa_1 = 51/20."""
    given = {"2/3": {"rho": 2}, "7/12": {"rho": "1/16", "kappa_1": "51/20"}, "1/3": {"rho": 5}}[theta]
    assert evaluate_energy(EnergyConstants(**given), theta).verdict == "no conclusion"


@strategies.fewer(8, at_night=4)
@given(RHO, SHARES)
def test_at_the_threshold_itself_the_interval_is_that_of_the_search(rho, share):
    """kappa_2 + kappa_1^2/4 = 1 exactly: q^2 = 1 + O(theta^2), so the sign of the next term decides."""
    constants = {"rho": rho, "kappa_1": 2 * share, "kappa_2": 1 - share**2}
    assert differences(constants) == []


@pytest.mark.parametrize(
    ("rho", "kappa_1", "kappa_2", "interval"),
    [
        (3, 0, 1, (0, 4 / (5 + 21**0.5))),  # 2/(1 + sqrt(rho) r) with r = (sqrt(3) + sqrt(7))/2
        ("1/2", 2, 0, (0, 2 / 3)),  # (2 - 2 rho)/(2 - rho), below the turning theta
        (1, 2, 0, None),
        (4, 2, 0, None),
    ],
)
def test_at_the_threshold_small_thetas_contract_for_a_soft_contact_body(rho, kappa_1, kappa_2, interval):
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2)).interval
    assert found == (interval if interval is None else pytest.approx(interval))


@given(RHO, SHARES)
def test_at_the_threshold_small_thetas_contract_exactly_when_sqrt_rho_kappa_1_is_below_2(rho, share):
    """And if none of them does, no theta does: the excess is convex, and 0 at theta = 0."""
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_1=2 * share, kappa_2=1 - share**2)).interval
    assert (None if found is None else found[0]) == (0 if rho * share**2 < 1 else None)


@pytest.mark.parametrize(("rho", "kappa_1", "kappa_2", "low"), [(1, "2/3", "8/9", 0), (3, "4/3", "5/9", None)])
def test_at_the_threshold_it_does_not_matter_how_ninths_round(rho, kappa_1, kappa_2, low):
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2)).interval
    assert (None if found is None else found[0]) == low


@strategies.fewer(8, at_night=4)
@given(st.integers(1, 60).map(lambda n: F(n, 12)), st.integers(1, 100).map(lambda n: F(n, 100)))
def test_the_interval_may_end_at_the_turning_theta(root, share):
    """Chosen so that ``2/(1 + sqrt(rho) r)`` is the turning theta; share > 0 keeps kappa_1 > 0, <= 1 kappa_2 >= 0."""
    least = (1 + root**2) / root
    ratio = least * (1 + share / (least**2 + 1))
    kappa_1 = 2 * ratio * (1 + root**2 - root * ratio) / (1 - root * ratio)
    constants = {"rho": root**2, "kappa_1": kappa_1, "kappa_2": ratio * (ratio - root - kappa_1)}
    assert energy_norms.turning_theta(*constants.values()) == 2 / (1 + root * ratio)
    assert differences(constants) == []


@strategies.fewer(8, at_night=4)
@given(st.integers(1, 60).map(lambda n: F(n, 12)), SHARES)
def test_where_q_only_touches_1_there_is_no_interval(root, share):
    """``sqrt(rho) kappa_1 = 1 + rho (1 - kappa_2)``: a double root of q^2 - 1 below the turning theta."""
    kappa_2 = share * (1 + 1 / root**2)
    constants = {"rho": root**2, "kappa_1": (1 + root**2 * (1 - kappa_2)) / root, "kappa_2": kappa_2}
    assert differences(constants) == []


def test_q_touches_1_at_3_quarters_for_rho_a_quarter_and_kappa_1_5_halves():
    found = evaluate_energy(EnergyConstants(rho="1/4", kappa_1="5/2"), "3/4")
    assert (found.interval, found.theta_proved, found.factor_proved, found.theta_max_proved) == (None,) * 4
    assert found.verdict == "no conclusion"


# --- two thresholds on friction ---------------------------------------------------------------------------------------


def least_square(rho: float, kappa_1: float, kappa_2: float) -> float:
    """The least q^2 over theta, by looking: theta and x on grids, the definition of q^2 and nothing else."""
    s = rho**0.5 + kappa_1
    r = (s + (s * s + 4 * kappa_2) ** 0.5) / 2
    x, t = r * np.arange(401) / 400, np.arange(1, 401)[:, None] / 400
    f = kappa_2 + kappa_1 * x - x * x
    return float(((1 - t) ** 2 + 2 * t * (1 - t) * f + t * t * rho * x * x).max(axis=1).min() - 1)


@pytest.mark.parametrize("rho", ["1/20", "1/2", 1, 3])
@pytest.mark.parametrize(("kappa_1", "kappa_2"), [(1, 0), (0, 1), (1, "1/3"), ("1/4", 2)])
def test_below_the_limit_of_friction_some_theta_is_proved_and_above_it_none(rho, kappa_1, kappa_2):
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2))
    every, some = found.friction_multiple.value, found.friction_limit_multiple.value
    assert every <= some
    rho, kappa_1, kappa_2 = (float(F(v)) for v in (rho, kappa_1, kappa_2))
    assert least_square(rho, 0.99 * some * kappa_1, 0.99 * some * kappa_2) < 0
    assert least_square(rho, 1.001 * some * kappa_1, 1.001 * some * kappa_2) >= 0


def test_without_friction_nothing_limits_it():
    found = evaluate_energy(EnergyConstants(rho=2))
    assert found.friction_limit_multiple is None
    assert found.to_dict()["reason"]["friction_limit_multiple"] == "no friction"

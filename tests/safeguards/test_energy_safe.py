"""Each branch of the theorem in energy norms against the worst x, found by trying both ends and the vertex: rationals.

With ``kappa_2 = r (r - sqrt(rho) - kappa_1)`` and rational sqrt(rho), kappa_1 and r every number is rational.
"""

from decimal import Decimal
from fractions import Fraction as F
from itertools import product

import pytest

from ndtheory import EnergyConstants, Number, energy_norms, evaluate_energy
from ndtheory.number import decimal, working_precision

#: sqrt(rho), kappa_1 and r - sqrt(rho) - kappa_1.
DRAWN = list(product((F(1, 4), F(1), F(3)), (F(0), F(1, 8), F(1)), (F(0), F(1, 16), F(1, 2))))

#: Ends that are met exactly: at 0, which the interval begins at or not, at the turning theta, and where q touches 1.
DRAWN += [(F(7, 4), F(1), F(1, 4)), (F(39, 8), F(1), F(1, 8)), (F(1), F(11, 15), F(7, 15)), (F(1, 2), F(5, 2), F(0))]

#: The quadratic has one root, or both at 0.
DRAWN += [(F(1, 2), F(0), F(1, 2)), (F(1), F(2), F(0))]
THETAS = [F(n, 24) for n in range(1, 25)]


def data(s, kappa_1, more):
    r = s + kappa_1 + more
    return s * s, kappa_1, r * more


def squares(theta, s, kappa_1, more):
    """The right-hand side of (5.24) at both ends and at the vertex, with their x."""
    rho, kappa_1, kappa_2 = data(s, kappa_1, more)
    r, kept = s + kappa_1 + more, 1 - theta
    value = lambda x: kept**2 + 2 * theta * kept * (kappa_2 + kappa_1 * x - x * x) + theta**2 * rho * x * x
    bend = 2 * theta * kept - theta**2 * rho  # -x^2 of it
    vertex = [theta * kept * kappa_1 / bend] if bend > 0 else []
    return [(value(x), x) for x in (F(0), r, *vertex) if 0 <= x <= r]


def square(theta, *drawn):
    return max(squares(theta, *drawn))[0]


@pytest.mark.parametrize("drawn", DRAWN, ids=lambda drawn: "-".join(map(str, drawn)))
def test_q_and_the_worst_x_are_those_of_both_ends_and_the_vertex(drawn):
    at = data(*drawn)
    assert energy_norms.largest_ratio(*at) == sum(drawn)
    turn = energy_norms.turning_theta(*at)
    for theta in {*THETAS, turn, turn * F(99, 100)}:
        worst, places = square(theta, *drawn), squares(theta, *drawn)
        assert energy_norms.one_minus_square(theta, *at) == 1 - worst
        assert max(places)[0] == energy_norms.square_at(energy_norms.worst_ratio(theta, *at), theta, *at)
        assert (worst == places[1][0]) == (theta >= turn)
        if theta <= turn:
            assert energy_norms.one_minus_inside(theta, *at) == 1 - worst
        if theta < turn and 2 - (2 + at[0]) * theta:
            step = F(1, 10**12)
            rise = (square(theta - step, *drawn) - square(theta + step, *drawn)) / (2 * step)
            assert abs(energy_norms.slope_inside(theta, *at) - rise) < F(1, 10**6)
    assert energy_norms.slope_inside(F(2) / (2 + at[0]), at[0], F(0), at[2]) is not None


NEAR = F(1, 10**20)


@pytest.mark.parametrize("drawn", DRAWN, ids=lambda drawn: "-".join(map(str, drawn)))
def test_the_interval_is_where_q_is_below_1_and_the_best_theta_has_the_least_q(drawn):
    at = data(*drawn)
    with working_precision():
        decimals = [decimal(value) for value in at]
        found = energy_norms.contraction_interval(*decimals, Decimal(10) ** -40)
        contracts = [theta for theta in [*THETAS[:-1], F(1, 10**6)] if square(theta, *drawn) < 1]
        if found is None:
            assert contracts == []
            return
        low, high = map(F, found)
        for theta in [*THETAS[:-1], F(1, 10**6)]:
            at_an_end = min(abs(theta - low), abs(theta - high)) < NEAR
            assert theta not in contracts if at_an_end else (low < theta < high) == (theta in contracts)
        assert 0 <= low < high <= 1
        for end, inwards in ((low, 1 + NEAR), (high, 1 - NEAR)):
            if 0 < end < 1:
                assert square(end * inwards, *drawn) < 1 < square(end / inwards, *drawn)
        if low == 0:
            assert square(F(1, 10**30), *drawn) < 1
        best = F(energy_norms.best_theta(*decimals, Decimal(10) ** -40))
    around = [square(theta, *drawn) for theta in (best * (1 - F(1, 10**9)), best * (1 + F(1, 10**9)))]
    assert square(best, *drawn) <= min(*around, *(square(theta, *drawn) for theta in THETAS)) + F(1, 10**40)


def least_square(rho, kappa_1, kappa_2):
    """The least of (q^2 - 1)/theta, a maximum of lines in theta and so convex, by sections in floats."""
    r = ((s := rho**0.5 + kappa_1) + (s * s + 4 * kappa_2) ** 0.5) / 2

    def excess(theta):
        line = lambda x: 2 * (w := kappa_2 + kappa_1 * x - x * x) - 2 + theta * (1 - 2 * w + rho * x * x)
        bend = 2 - 2 * theta - theta * rho
        x = (1 - theta) * kappa_1 / bend if bend > 0 else r
        return max(line(0), line(r), line(min(x, r)))

    low, high = 0.0, 1.0
    for _ in range(80):
        a, b = low + (high - low) * 0.382, low + (high - low) * 0.618
        low, high = (low, b) if excess(a) < excess(b) else (a, high)
    return excess((low + high) / 2)


@pytest.mark.parametrize("rho", [0.3, 1.0, 1.44, 4.0, 9.0])
@pytest.mark.parametrize("share", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
def test_up_to_the_limit_of_friction_some_theta_is_proved_and_beyond_it_none(rho, share):
    kappa_1, kappa_2 = 0.1 * (1 - share), 0.1 * share
    limit, multiple = (
        energy_norms.friction_limit(rho, kappa_1, kappa_2),
        energy_norms.friction_multiple(kappa_1, kappa_2),
    )
    assert limit >= multiple * (1 - 1e-12)
    assert least_square(rho, kappa_1 * limit * 0.999, kappa_2 * limit * 0.999) < -1e-9
    assert least_square(rho, kappa_1 * limit * 1.001, kappa_2 * limit * 1.001) > -1e-9
    t = multiple
    assert t * kappa_2 + (t * kappa_1) ** 2 / 4 == pytest.approx(1, rel=1e-12)
    assert energy_norms.friction_number(t * kappa_1, t * kappa_2) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize(("low", "high"), [(F(1, 2), F(3, 2)), (F(0), F(4)), (F(2), F(2))])
def test_of_a_tied_interface_the_factor_is_that_of_the_mode_that_shrinks_least(low, high):
    modes = [low + (high - low) * F(n, 7) for n in range(8)]
    for theta in THETAS:
        assert energy_norms.tied_factor(theta, low, high) == max(abs(1 - theta * (1 + mode)) for mode in modes)
        assert energy_norms.predicted_factor(theta, high) == max(
            abs(1 - theta * (1 + mode)) for mode in (0, *modes, high)
        )
        assert energy_norms.tied_factor(theta, low, high) >= energy_norms.tied_rate(low, high)
        assert energy_norms.predicted_factor(theta, high) >= energy_norms.predicted_rate(high)
    assert energy_norms.tied_factor(energy_norms.tied_theta(low, high), low, high) == energy_norms.tied_rate(low, high)
    assert energy_norms.predicted_factor(energy_norms.predicted_theta(high), high) == energy_norms.predicted_rate(high)


# --- what is said of constants ----------------------------------------------------------------------------------------


def test_a_theta_at_an_end_or_within_its_rounding_has_no_factor():
    constants = EnergyConstants(rho=2)  # q < 1 below 2/3
    said = lambda theta: evaluate_energy(constants, theta).verdict
    for digits in (30, 60, 90, 120, 150, 180):
        below = 2 * 10**digits // 3
        assert said(F(below + 1, 10**digits)) == "no conclusion"
        assert said(F(below, 10**digits)) == "contraction" or digits > 40
    assert said(F(2, 3)) == "no conclusion"
    # friction between the two thresholds: the interval begins above 0
    rubs = EnergyConstants(rho=F(1, 100), kappa_1=F(1), kappa_2=F(4, 5))
    low = F(evaluate_energy(rubs).interval[0])
    assert low > 0
    assert evaluate_energy(rubs, low * F(99, 100)).factor is None
    assert evaluate_energy(rubs, low * F(101, 100)).factor is not None


def test_an_enclosure_of_the_constants_encloses_what_follows():
    number = Number(value=2.0, lo=1.75, hi=2.25, level="guaranteed")
    found = evaluate_energy(EnergyConstants(rho=number), theta="1/2")
    for name, ends in {
        "ratio": (F(7, 4) ** F(1, 2), 1.5),
        "factor": (0.5, 0.625),
        "theta_max_proved": (2 / 3.25, 2 / 2.75),
        "factor_proved": (1.75 / 3.75, 2.25 / 4.25),
    }.items():
        value = getattr(found, name)
        assert value.lo == pytest.approx(float(min(ends)), rel=1e-15), name
        assert value.hi == pytest.approx(float(max(ends)), rel=1e-15), name
        assert value.level == "guaranteed"
    low, high = found.interval_proved
    assert low == 0
    assert 0.6153 < high <= F(2) / F(13, 4)


@pytest.mark.parametrize("rho", range(2, 40))
def test_the_exact_end_of_an_interval_is_outside_however_its_decimals_round(rho):
    assert evaluate_energy(EnergyConstants(rho=rho), F(2, 1 + rho)).factor is None


def test_an_interval_without_a_double_is_none():
    """``sqrt(rho) kappa_1 = 1 + rho`` is where q touches 1, at 3/4; here its root is about 1e-20 wide."""
    found = evaluate_energy(EnergyConstants(rho=F(1, 4), kappa_1=F(5, 2) * (1 - F(1, 10**40))))
    assert (found.interval, found.theta_proved) == (None, None)
    assert evaluate_energy(EnergyConstants(rho=F(1, 4), kappa_1=F(5, 2) * (1 - F(1, 10**20)))).interval is not None

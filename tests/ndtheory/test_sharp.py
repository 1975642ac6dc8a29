"""The theorem in energy norms beside a search in 160 digits that knows none of its formulas, and in exact rationals.

The oracle is given the quadratic of (5.24) in x = |d_1|/|d_2| and the inequality that bounds x.  All else it finds:
the largest x among the roots of a polynomial, q by comparing both ends and the vertex, the interval by halving, the
best theta by golden sections.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from decimal import Decimal
from fractions import Fraction as F
from functools import cached_property, lru_cache, partial

import oracle
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from ndtheory import EnergyConstants, HypothesisError, Number, evaluate_sharp, exact, sharp

DIGITS = 160
HALVINGS = 270  # 2^-270 = 5e-82
SECTIONS = 320  # 0.618^320 = 1e-67
ZERO = mpf(10) ** -60  # thetas as small as 1e-67 divide rounding errors of 1e-148: what vanishes is below 1e-80
LAST_PLACE = mpf("3e-16")  # relative: a double next to the number meant
MANY_DIGITS = mpf("1e-60")  # relative: what the oracle keeps


@pytest.fixture(autouse=True, scope="module")
def many_digits():
    with mp.workdps(DIGITS):
        yield


# --- the oracle ----------------------------------------------------------------------------------------------------


def golden(function: Callable[[mpf], mpf], low: mpf, high: mpf, enough: Callable[[mpf], bool] | None = None) -> mpf:
    """Where a function that falls and then rises is least, or the first place found where it is low enough."""
    share = (mp.sqrt(5) - 1) / 2
    left, right = high - share * (high - low), low + share * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(SECTIONS):
        if enough is not None and enough(min(at_left, at_right)):
            return left if at_left < at_right else right
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - share * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + share * (high - low)
            at_right = function(right)
    return (low + high) / 2


def halve(holds: Callable[[mpf], bool], yes: mpf, no: mpf) -> mpf:
    """The point between `yes` and `no` where a condition ceases to hold."""
    for _ in range(HALVINGS):
        middle = (yes + no) / 2
        yes, no = (middle, no) if holds(middle) else (yes, middle)
    return yes


def summit(quadratic: Callable, end):
    """Where a quadratic is largest on [0, end], at an end or at its vertex, and its value there.

    Three values of the quadratic, which are dear, tell all others.
    """
    at_0, at_1, at_2 = quadratic(0), quadratic(1), quadratic(2)
    bend = at_2 - 2 * at_1 + at_0
    slope = at_1 - at_0 - bend / 2
    inside = [-slope / bend] if bend < 0 and 0 < -slope / bend < end else []
    value = lambda x: at_0 + x * (slope + x * bend / 2)
    return max(((x, value(x)) for x in [0 * end, end, *inside]), key=lambda found: found[1])


def work(x, kappa_1, kappa_2):
    """What friction may add, less the energy of the contact body."""
    return kappa_2 + kappa_1 * x - x * x


def right_side(x, theta, rho, kappa_1, kappa_2):
    """Of (5.24): two squares and twice a product."""
    kept = 1 - theta
    return kept * kept + 2 * kept * theta * work(x, kappa_1, kappa_2) + theta * theta * rho * x * x


@dataclass(frozen=True)
class Energy:
    """``q(theta)^2``, the largest right-hand side of (5.24), and what is found from it by searching."""

    rho: mpf
    kappa_1: mpf
    kappa_2: mpf

    @property
    def data(self) -> tuple[mpf, mpf, mpf]:
        return self.rho, self.kappa_1, self.kappa_2

    @cached_property
    def ratio(self) -> mpf:
        """The largest x with x^2 <= (sqrt(rho) + kappa_1) x + kappa_2."""
        roots = mp.polyroots([1, -mp.sqrt(self.rho) - self.kappa_1, -self.kappa_2], maxsteps=500, extraprec=500)
        return max(map(mp.re, roots))

    def summit(self, theta: mpf) -> tuple[mpf, mpf]:
        return summit(lambda x: right_side(x, theta, *self.data), self.ratio)

    def worst(self, theta: mpf) -> mpf:
        return self.summit(theta)[0]

    def square(self, theta: mpf) -> mpf:
        """q(theta)^2."""
        return self.summit(theta)[1]

    def excess(self, theta: mpf) -> mpf:
        """(q^2 - 1)/theta: at each x a line in theta, so convex."""
        return (self.square(theta) - 1) / theta

    def contracts(self, theta: mpf) -> bool:
        return bool(self.excess(theta) < -ZERO)

    @cached_property
    def largest_work(self) -> mpf:
        return summit(partial(work, kappa_1=self.kappa_1, kappa_2=self.kappa_2), self.ratio)[1]

    @cached_property
    def interval(self) -> tuple[mpf, mpf] | None:
        """Where q < 1 in (0, 1)."""
        inside = golden(self.excess, mpf(0), mpf(1), enough=lambda value: value < -ZERO)
        if not self.contracts(inside):
            return None
        low = mpf(0) if self.largest_work < 1 + ZERO else halve(self.contracts, inside, mpf(0))
        return low, mpf(1) if self.excess(mpf(1)) <= 0 else halve(self.contracts, inside, mpf(1))

    @cached_property
    def best(self) -> mpf | None:
        """The theta of least q."""
        return None if self.interval is None else golden(self.square, *self.interval)

    @cached_property
    def turning(self) -> mpf:
        """The theta from which on the worst x is r."""
        return halve(lambda theta: self.worst(theta) < self.ratio, mpf(0), mpf(1))

    @cached_property
    def friction_multiple(self) -> mpf | None:
        """The t for which the largest work of t kappa_1, t kappa_2 is 1."""
        if self.kappa_1 == self.kappa_2 == 0:
            return None
        missing = lambda t: replace(self, kappa_1=t * self.kappa_1, kappa_2=t * self.kappa_2).largest_work - 1
        most = mpf(1)
        while missing(most) <= 0:
            most *= 4
        return mp.findroot(missing, (mpf(0), most), solver="anderson", tol=MANY_DIGITS**2)


@lru_cache(maxsize=256)
def energy(*, rho, kappa_1=0, kappa_2=0, rho_normal=None) -> Energy:
    """Without friction tangential components carry no force: then rho_normal counts, where it is known."""
    slides = rho_normal is not None and kappa_1 == kappa_2 == 0
    return Energy(*map(oracle.real, (rho_normal if slides else rho, kappa_1, kappa_2)))


# --- comparisons ---------------------------------------------------------------------------------------------------

FIELDS = [
    *("rho", "kappa_1", "kappa_2", "ratio", "friction_multiple", "friction_limit_multiple", "interval"),
    *(
        "theta_proved",
        "factor_proved",
        "theta_max_proved",
        "theta_predicted",
        "rate_predicted",
        "theta",
        "factor",
        "one_minus_factor",
        "verdict",
    ),
]


def close(got, want, tolerance=LAST_PLACE) -> bool:
    """Equal but for the last place; None only beside None, and a pair member by member."""
    if got is None or want is None or isinstance(want, str):
        return got == want
    if isinstance(want, tuple):
        return all(map(close, got, want))
    return bool(abs(oracle.real(getattr(got, "value", got)) - want) <= tolerance * abs(want))


@lru_cache(maxsize=256)
def predicted(rho: mpf) -> tuple[mpf, mpf]:
    """The best theta without friction and q there."""
    alone = Energy(rho, mpf(0), mpf(0))
    theta = golden(alone.square, mpf(0), mpf(1))
    return theta, mp.sqrt(alone.square(theta))


def wanted(constants, theta=None) -> dict:
    """Every field of the answer, found by the oracle."""
    found = energy(**constants)
    q = None
    if theta is not None:
        theta = oracle.real(theta)
        q = mp.sqrt(found.square(theta)) if found.contracts(theta) else None
    return {
        **dict(zip(("rho", "kappa_1", "kappa_2"), found.data, strict=True)),
        "ratio": found.ratio,
        "friction_multiple": found.friction_multiple,
        "interval": found.interval,
        "theta_proved": found.best,
        "factor_proved": None if found.best is None else mp.sqrt(found.square(found.best)),
        "theta_max_proved": None if found.interval is None else found.interval[1],
        **dict(zip(("theta_predicted", "rate_predicted"), predicted(found.rho), strict=True)),
        "theta": theta,
        "factor": q,
        "one_minus_factor": None if q is None else 1 - q,
        "verdict": None if theta is None else "no conclusion" if q is None else "contraction",
    }


def differences(constants, theta=None) -> list[str]:
    """Names of the fields in which `evaluate_sharp` departs from the oracle."""
    found = evaluate_sharp(EnergyConstants(**constants), theta)
    return [name for name, want in wanted(constants, theta).items() if not close(getattr(found, name), want)]


def formula_differences(constants, theta) -> list[str]:
    """Names of the formulas that, in 160 digits, depart from the oracle."""
    found, t = energy(**constants), oracle.real(theta)
    data, friction = found.data, found.data[1:]
    x, branch = found.ratio / 3, "one_minus_inside" if t < found.turning else "one_minus_end"
    values = {
        "largest_ratio": (data, found.ratio),
        "work": ((x, *friction), work(x, *friction)),
        "square_at": ((x, t, *data), right_side(x, t, *data)),
        "turning_theta": (data, found.turning),
        "worst_ratio": ((t, *data), found.worst(t)),
        branch: ((t, *data), 1 - found.square(t)),
        "one_minus_square": ((t, *data), 1 - found.square(t)),
        "friction_number": (friction, found.largest_work),
        "predicted_theta": ((data[0],), predicted(data[0])[0]),
        "predicted_rate": ((data[0],), predicted(data[0])[1]),
        "predicted_factor": ((t, data[0]), mp.sqrt(Energy(data[0], mpf(0), mpf(0)).square(t))),
    }
    if found.friction_multiple is not None:
        values["friction_multiple"] = (friction, found.friction_multiple)
    if t < found.turning:
        step = t * MANY_DIGITS
        rise = found.square(t - step) - found.square(t + step)
        values["slope_inside"] = ((t, *data), rise / (2 * step))
    return [
        name
        for name, (arguments, want) in values.items()
        if not abs(getattr(sharp, name)(*arguments) - want) <= mpf("1e-30") * max(abs(want), ZERO)
    ]


# --- cases ---------------------------------------------------------------------------------------------------------

RHO = strategies.log_uniform(-6, 6)
ANY_KAPPA = st.one_of(st.just(F(0)), strategies.log_uniform(-9, 3), strategies.log_uniform(-2, 0.3))
SHARES = st.fractions(0, 1, max_denominator=100)


@st.composite
def near_threshold(draw):
    """kappa_1, kappa_2 with kappa_2 + kappa_1^2/4 next to 1."""
    number, share = 1 + draw(strategies.offsets()), draw(SHARES)
    return oracle.rational(2 * mp.sqrt(oracle.real(share * number)), 40), (1 - share) * number


@st.composite
def energies(draw):
    """Admissible constants: with and without friction, few or many digits, rho_normal known or not."""
    rho = draw(RHO)
    none = st.just((F(0), F(0)))
    kappa_1, kappa_2 = draw(st.one_of(none, st.tuples(ANY_KAPPA, ANY_KAPPA), near_threshold()))
    normal = draw(st.one_of(st.none(), st.integers(1, 100).map(lambda n: rho * F(n, 100))))
    return {"rho": rho, "kappa_1": kappa_1, "kappa_2": kappa_2, "rho_normal": normal}


def inside(theta: F, end: F) -> F:
    """theta, or if that is not below 1 its mirror image on the other side of `end`."""
    return theta if theta < 1 else end * end / theta


@st.composite
def cases(draw):
    """Constants, and 0 < theta < 1 anywhere or next to an end of the interval, the turning or the best theta."""
    constants = draw(energies())
    found, place = energy(**constants), draw(st.sampled_from(["anywhere", "low end", "high end", "turning", "best"]))
    if place == "anywhere":
        return constants, draw(strategies.thetas())
    if place == "turning" or found.interval is None:
        end = found.turning
    else:
        end = found.best if place == "best" else found.interval[place == "high end"] or found.interval[1]
    end = oracle.rational(end, 70)
    return constants, inside(end * (1 + draw(strategies.offsets())), end)


ANY_ROOT = st.one_of(strategies.log_uniform(-3, 3), st.integers(1, 12).map(lambda n: F(n, 4)))


@st.composite
def rational_ratios(draw, s=ANY_ROOT):
    """sqrt(rho), kappa_1, kappa_2 and r, all rational: kappa_2 = r (r - sqrt(rho) - kappa_1)."""
    root, kappa_1 = draw(s), draw(ANY_KAPPA)
    ratio = root + kappa_1 + draw(ANY_KAPPA)
    return root, kappa_1, ratio * (ratio - root - kappa_1), ratio


# --- against the search --------------------------------------------------------------------------------------------


@strategies.fewer(2)
@given(cases())
def test_every_field_agrees_with_a_search_for_the_worst_case(case):
    assert differences(*case) == []


@strategies.fewer(2)
@given(cases())
def test_every_formula_agrees_with_a_search_for_the_worst_case(case):
    assert formula_differences(*case) == []


@strategies.fewer(2, at_night=1)
@given(cases())
def test_a_factor_is_reported_exactly_where_the_worst_case_shrinks(case):
    constants, theta = case
    found = evaluate_sharp(EnergyConstants(**constants), theta)
    contracts = energy(**constants).contracts(oracle.real(theta))
    assert found.verdict == ("contraction" if contracts else "no conclusion")
    assert (found.factor is not None) == (found.one_minus_factor is not None) == contracts


@strategies.fewer(2, at_night=1)
@given(cases())
def test_the_interval_and_the_best_theta_do_not_depend_on_the_theta_given(case):
    constants, theta = case
    without, with_theta = (evaluate_sharp(EnergyConstants(**constants), t) for t in (None, theta))
    assert without == replace(with_theta, theta=None, factor=None, one_minus_factor=None, verdict=None)


@strategies.fewer(2, at_night=1)
@given(cases())
def test_no_theta_has_a_smaller_factor_than_the_one_called_best(case):
    constants, theta = case
    found = evaluate_sharp(EnergyConstants(**constants), theta)
    assert found.factor is None or found.factor_proved.value <= found.factor.value
    assert found.interval is None or found.interval[0] < found.theta_proved <= found.interval[1]


# --- exact rationals -----------------------------------------------------------------------------------------------


@given(rational_ratios())
def test_r_is_the_positive_root_and_there_the_work_is_minus_sqrt_rho_r(numbers):
    root, kappa_1, kappa_2, ratio = numbers
    assert sharp.largest_ratio(root**2, kappa_1, kappa_2) == ratio
    assert ratio**2 == (root + kappa_1) * ratio + kappa_2
    assert sharp.work(ratio, kappa_1, kappa_2) == -root * ratio


@given(rational_ratios(), strategies.thetas())
def test_q_is_the_larger_of_both_ends_and_the_vertex_in_exact_rationals(numbers, theta):
    root, kappa_1, kappa_2, ratio = numbers
    data = (root**2, kappa_1, kappa_2)
    quadratic = lambda x: right_side(x, theta, *data)
    worst, largest = summit(quadratic, ratio)
    assert quadratic(worst) == largest
    assert quadratic(sharp.worst_ratio(theta, *data)) == quadratic(worst)
    assert 0 <= sharp.worst_ratio(theta, *data) <= ratio
    assert sharp.square_at(worst, theta, *data) == quadratic(worst)
    assert sharp.one_minus_square(theta, *data) == 1 - quadratic(worst)


@given(rational_ratios(), strategies.thetas(), SHARES)
def test_no_x_between_0_and_r_exceeds_q(numbers, theta, share):
    root, kappa_1, kappa_2, ratio = numbers
    data = (root**2, kappa_1, kappa_2)
    assert right_side(share * ratio, theta, *data) <= 1 - sharp.one_minus_square(theta, *data)


@given(rational_ratios(), strategies.thetas())
def test_at_x_equal_to_r_q_is_the_distance_of_theta_times_1_plus_sqrt_rho_r_from_1(numbers, theta):
    root, kappa_1, kappa_2, ratio = numbers
    data = (root**2, kappa_1, kappa_2)
    square = (1 - theta * (1 + root * ratio)) ** 2
    assert sharp.square_at(ratio, theta, *data) == square == 1 - sharp.one_minus_end(theta, *data)


@given(rational_ratios())
def test_both_branches_meet_at_the_turning_theta(numbers):
    root, kappa_1, kappa_2, ratio = numbers
    data = (root**2, kappa_1, kappa_2)
    turn = sharp.turning_theta(*data)
    assert 0 < turn < 1
    assert sharp.one_minus_end(turn, *data) == sharp.one_minus_inside(turn, *data)
    assert turn * (1 + root * ratio) > 1, "so q grows from there on"
    assert (turn == 2 / (2 + root**2)) == (kappa_1 == 0)


@strategies.fewer(2, at_night=1)
@given(energies(), st.integers(20, 60))
def test_q_is_continuous_at_the_turning_theta(constants, digits):
    found = energy(**constants)
    turn = oracle.rational(found.turning, 75)
    below, above = (evaluate_sharp(EnergyConstants(**constants), turn + side * turn / 10**digits) for side in (-1, 1))
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
    assert evaluate_sharp(given).rho.value == float(given.at_work)


# --- without friction ----------------------------------------------------------------------------------------------


@given(RHO, strategies.thetas())
def test_without_friction_q_is_the_larger_of_1_minus_theta_and_1_minus_theta_minus_theta_rho(rho, theta):
    found = evaluate_sharp(EnergyConstants(rho=rho), theta)
    q = max(1 - theta, abs(1 - theta - theta * rho))
    assert found.verdict == ("contraction" if q < 1 else "no conclusion")
    if q < 1:
        assert found.factor.value == float(q)
        assert found.one_minus_factor.value == float(1 - q)


@given(RHO)
def test_without_friction_the_best_theta_is_2_over_2_plus_rho_below_the_smaller_of_1_and_2_over_1_plus_rho(rho):
    found = evaluate_sharp(EnergyConstants(rho=rho))
    assert found.interval == (0, float(min(F(1), 2 / (1 + rho))))
    assert found.theta_max_proved.value == found.interval[1]
    assert found.theta_proved == found.theta_predicted == float(2 / (2 + rho))
    assert found.factor_proved.value == found.rate_predicted == float(rho / (2 + rho))
    assert (found.ratio.value, found.friction_multiple) == (float(oracle.square_root(rho)), None)


@given(RHO, st.integers(1, 99).map(lambda n: F(n, 100)), strategies.thetas())
def test_without_friction_the_tangential_components_do_not_count(rho, share, theta):
    normal = share * rho
    assert evaluate_sharp(EnergyConstants(rho=rho, rho_normal=normal), theta) == evaluate_sharp(
        EnergyConstants(rho=normal), theta
    )


@strategies.fewer(4, at_night=2)
@given(cases(), st.integers(1, 99).map(lambda n: F(n, 100)))
def test_with_any_friction_the_tangential_components_count(case, share):
    constants, theta = case
    constants = {**constants, "kappa_1": constants["kappa_1"] or F(1, 10**9)}
    known, unknown = ({**constants, "rho_normal": normal} for normal in (share * constants["rho"], None))
    assert EnergyConstants(**known).at_work == constants["rho"]
    assert evaluate_sharp(EnergyConstants(**known), theta) == evaluate_sharp(EnergyConstants(**unknown), theta)


def test_the_slightest_friction_makes_the_bound_jump_from_rho_normal_to_rho():
    slides = evaluate_sharp(EnergyConstants(rho=3, rho_normal=1), "3/5")
    for key in ("kappa_1", "kappa_2"):
        sticks = evaluate_sharp(EnergyConstants(rho=3, rho_normal=1, **{key: "1e-30"}), "3/5")
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
    less, more = (evaluate_sharp(EnergyConstants(**given), theta) for given in (constants, more))
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
    found = evaluate_sharp(EnergyConstants(**constants))
    if found.interval is not None:
        assert found.theta_proved <= found.theta_predicted
        assert found.factor_proved.value >= found.rate_predicted


@given(RHO, st.integers(0, 999).map(lambda n: F(n, 1000)))
def test_without_kappa_1_the_best_theta_is_the_predicted_one_whatever_kappa_2(rho, kappa_2):
    found = evaluate_sharp(EnergyConstants(rho=rho, kappa_2=kappa_2))
    assert found.theta_proved == found.theta_predicted


def test_the_best_theta_moves_either_way_with_kappa_2():
    best = lambda **given: evaluate_sharp(EnergyConstants(**given)).theta_proved
    assert best(rho="1/30", kappa_1="27/20", kappa_2="1/10") < best(rho="1/30", kappa_1="27/20", kappa_2="1/9")
    assert best(rho=6, kappa_1="2/5", kappa_2="7/20") > best(rho=6, kappa_1="2/5", kappa_2="8/20")


@given(RHO, near_threshold())
def test_every_small_theta_contracts_exactly_when_kappa_2_plus_a_quarter_of_kappa_1_squared_is_below_1(rho, friction):
    kappa_1, kappa_2 = friction
    found = evaluate_sharp(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2), F(1, 10**60))
    below = kappa_2 + kappa_1**2 / 4 < 1
    assert found.verdict == ("contraction" if below else "no conclusion")
    assert (found.interval is not None and found.interval[0] == 0) == below
    assert (found.friction_multiple.value >= 1) == (below or found.friction_multiple.value == 1)


def test_friction_beyond_the_threshold_leaves_an_interval_away_from_0():
    """rho = 1/16, kappa_1 = 51/20, kappa_2 = 0: q = 1 at 7/12 exactly, and q(3/4) = sqrt(3841)/62.5 < 1."""
    constants = {"rho": F(1, 16), "kappa_1": F(51, 20)}
    found = evaluate_sharp(EnergyConstants(**constants), "3/4")
    assert found.friction_multiple.value < 1
    assert found.interval == (7 / 12, float(energy(**constants).interval[1]))
    assert found.verdict == "contraction"
    assert evaluate_sharp(EnergyConstants(**constants), F(7, 12) - F(1, 10**50)).verdict == "no conclusion"
    assert evaluate_sharp(EnergyConstants(**constants), F(7, 12) + F(1, 10**50)).verdict == "contraction"


@given(st.integers(25, 300), st.integers(0, 99).map(lambda n: F(n, 100)), SHARES, RHO)
def test_close_to_theta_0_1_minus_q_is_theta_times_1_minus_the_friction_number(digits, number, share, rho):
    """But for terms smaller by a factor theta rho/(1 - number), at most 1e-17; q itself rounds to 1."""
    theta, w = F(1, 10**digits), share * number
    constants = EnergyConstants(rho=rho, kappa_1=2 * w, kappa_2=number - w**2)
    found = evaluate_sharp(constants, theta)
    assert found.one_minus_factor.value == pytest.approx(float(theta * (1 - number)), rel=1e-15)
    assert found.factor.value == 1


# --- at the edges --------------------------------------------------------------------------------------------------


@given(rational_ratios(s=st.integers(101, 1000).map(lambda n: F(n, 100))))
def test_2_over_1_plus_sqrt_rho_r_itself_is_outside_the_interval(numbers):
    """There the quadratic is 1 at x = r, exactly."""
    root, kappa_1, kappa_2, ratio = numbers
    found = evaluate_sharp(EnergyConstants(rho=root**2, kappa_1=kappa_1, kappa_2=kappa_2), 2 / (1 + root * ratio))
    assert (found.verdict, found.factor) == ("no conclusion", None)


@given(strategies.log_uniform(0.01, 6))
def test_without_friction_the_interval_is_open_at_2_over_1_plus_rho(rho):
    end = 2 / (1 + rho)
    constants = EnergyConstants(rho=rho)
    assert evaluate_sharp(constants, end).verdict == "no conclusion"
    assert evaluate_sharp(constants, end * (1 - F(1, 10**50))).verdict == "contraction"


@pytest.mark.parametrize("theta", ["2/3", "7/12", "1/3"])
def test_the_interval_is_open_at_ends_whose_decimals_do_not_end(theta):
    """rho = 2 and rho = 5 without friction, and the lower end 7/12 of rho = 1/16, kappa_1 = 51/20."""
    given = {"2/3": {"rho": 2}, "7/12": {"rho": "1/16", "kappa_1": "51/20"}, "1/3": {"rho": 5}}[theta]
    assert evaluate_sharp(EnergyConstants(**given), theta).verdict == "no conclusion"


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
    found = evaluate_sharp(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2)).interval
    assert found == (interval if interval is None else pytest.approx(interval))


@given(RHO, SHARES)
def test_at_the_threshold_small_thetas_contract_exactly_when_sqrt_rho_kappa_1_is_below_2(rho, share):
    """And if none of them does, no theta does: the excess is convex, and 0 at theta = 0."""
    found = evaluate_sharp(EnergyConstants(rho=rho, kappa_1=2 * share, kappa_2=1 - share**2)).interval
    assert (None if found is None else found[0]) == (0 if rho * share**2 < 1 else None)


@pytest.mark.parametrize(("rho", "kappa_1", "kappa_2", "low"), [(1, "2/3", "8/9", 0), (3, "4/3", "5/9", None)])
def test_at_the_threshold_it_does_not_matter_how_ninths_round(rho, kappa_1, kappa_2, low):
    found = evaluate_sharp(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2)).interval
    assert (None if found is None else found[0]) == low


@strategies.fewer(8, at_night=4)
@given(st.integers(1, 60).map(lambda n: F(n, 12)), st.integers(1, 100).map(lambda n: F(n, 100)))
def test_the_interval_may_end_at_the_turning_theta(root, share):
    """Chosen so that ``2/(1 + sqrt(rho) r)`` is the turning theta; share > 0 keeps kappa_1 > 0, <= 1 kappa_2 >= 0."""
    least = (1 + root**2) / root
    ratio = least * (1 + share / (least**2 + 1))
    kappa_1 = 2 * ratio * (1 + root**2 - root * ratio) / (1 - root * ratio)
    constants = {"rho": root**2, "kappa_1": kappa_1, "kappa_2": ratio * (ratio - root - kappa_1)}
    assert sharp.turning_theta(*constants.values()) == 2 / (1 + root * ratio)
    assert differences(constants) == []


@strategies.fewer(8, at_night=4)
@given(st.integers(1, 60).map(lambda n: F(n, 12)), SHARES)
def test_where_q_only_touches_1_there_is_no_interval(root, share):
    """``sqrt(rho) kappa_1 = 1 + rho (1 - kappa_2)``: a double root of q^2 - 1 below the turning theta."""
    kappa_2 = share * (1 + 1 / root**2)
    constants = {"rho": root**2, "kappa_1": (1 + root**2 * (1 - kappa_2)) / root, "kappa_2": kappa_2}
    assert differences(constants) == []


def test_q_touches_1_at_3_quarters_for_rho_a_quarter_and_kappa_1_5_halves():
    found = evaluate_sharp(EnergyConstants(rho="1/4", kappa_1="5/2"), "3/4")
    assert (found.interval, found.theta_proved, found.factor_proved, found.theta_max_proved) == (None,) * 4
    assert found.verdict == "no conclusion"


# --- each hypothesis, just broken and just kept --------------------------------------------------------------------

NO_NUMBER = [
    *(float("nan"), float("inf"), float("-inf"), True, False, "", "abc", "nan", "1/0", "1e999999", "-1", -1, [1], 1j),
    *("1_000", 10**400),
]
BROKEN = {
    "rho": [None, 0, 0.0, "0", "-1e-300", "9e-76", "1.1e75", *NO_NUMBER],
    "kappa_1": [None, "-1e-300", -1e-300, 1e-300, "1.1e75", *NO_NUMBER],
    "kappa_2": [None, "-1e-300", -1e-300, 1e-300, "1.1e75", *NO_NUMBER],
    "rho_normal": [0, "0", "-1e-300", "2." + 60 * "0" + "1", 2.0000000000000004, *NO_NUMBER],
}
NEEDED = {
    "rho": "a number rho > 0 (1e-75 to 1e75)",
    "kappa_1": "a number kappa_1 >= 0 (0, or 1e-75 to 1e75)",
    "kappa_2": "a number kappa_2 >= 0 (0, or 1e-75 to 1e75)",
    "rho_normal": "a number 0 < rho_normal <= rho = 2",
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in BROKEN.items() for value in values])
def test_a_broken_hypothesis_on_an_energy_constant_is_named_with_the_value_received(key, value):
    with pytest.raises(HypothesisError) as refusal:
        EnergyConstants(**{"rho": 2, key: value})
    assert (refusal.value.key, refusal.value.needed) == (key, NEEDED[key])
    shown = "an integer of 1329 bits" if value == 10**400 else value
    assert str(refusal.value) == f"{key} = {shown}: needed {NEEDED[key]}"


@pytest.mark.parametrize("value", [0, 1, 0.0, 1.0, "1", "-1e-300", 1.5, "1." + 60 * "0" + "1", *NO_NUMBER])
def test_a_theta_that_is_not_between_0_and_1_is_refused(value):
    with pytest.raises(HypothesisError, match=r"^theta = .*: needed a number with 0 < theta < 1$") as refusal:
        evaluate_sharp(EnergyConstants(rho=1), value)
    assert refusal.value.key == "theta"


def test_rho_is_required_and_constants_are_given_by_name():
    with pytest.raises(TypeError):
        EnergyConstants()
    with pytest.raises(TypeError):
        EnergyConstants(1)


@pytest.mark.parametrize("small", ["1e-75", F(1, 10**75)])
def test_the_hypotheses_of_the_energy_constants_are_kept_with_equality(small):
    assert EnergyConstants(rho=small, rho_normal=small, kappa_1=0, kappa_2="0").at_work == F(1, 10**75)
    assert EnergyConstants(rho=small, kappa_1=small, kappa_2="1e75").frictionless is False
    assert EnergyConstants(rho=2, rho_normal="1.9999999999999999999").at_work == F(2) - F(1, 10**19)
    assert evaluate_sharp(EnergyConstants(rho=1), "1e-300").one_minus_factor.value == 1e-300
    assert evaluate_sharp(EnergyConstants(rho="1/2"), "0." + 60 * "9").verdict == "contraction"


# --- the written form ----------------------------------------------------------------------------------------------


@given(energies(), st.one_of(st.none(), strategies.thetas()))
def test_what_is_null_has_a_reason_and_nothing_else_has_one(constants, theta):
    found = evaluate_sharp(EnergyConstants(**constants), theta)
    document = json.loads(json.dumps(found.to_dict()))
    assert list(document) == [*FIELDS, "reason"] == [*(field.name for field in fields(found)), "reason"]
    assert {name for name, value in document.items() if value is None} == set(document["reason"])
    assert all(document["reason"].values())


@given(energies(), st.one_of(st.none(), strategies.thetas()))
def test_the_written_form_holds_the_numbers_themselves(constants, theta):
    found = evaluate_sharp(EnergyConstants(**constants), theta)
    document = json.loads(json.dumps(found.to_dict()))
    for name in FIELDS:
        value = getattr(found, name)
        if isinstance(value, Number):
            assert document[name] == {"value": value.value, "lo": None, "hi": None, "level": "float"}
        else:
            assert document[name] == (list(value) if isinstance(value, tuple) else value)


def test_each_reason_says_what_is_missing():
    reason = lambda theta=None, **given: evaluate_sharp(EnergyConstants(rho=1, **given), theta).reason
    none, outside = "no theta given", "theta outside the interval: no conclusion"
    still = dict.fromkeys(["friction_multiple", "friction_limit_multiple"], "no friction")
    assert reason() == {**still, **dict.fromkeys(["theta", "factor", "one_minus_factor", "verdict"], none)}
    assert reason("1/2") == still
    assert reason("9/10", kappa_1="1/2") == dict.fromkeys(["factor", "one_minus_factor"], outside)
    assert reason("9/10", kappa_2=3) == {
        **dict.fromkeys(["interval", "theta_proved", "factor_proved", "theta_max_proved"], "q >= 1 for every theta"),
        **dict.fromkeys(["factor", "one_minus_factor"], outside),
    }


# --- the comparison is alive ---------------------------------------------------------------------------------------

#: Below and above the turning theta, with either kappa, both and none; friction beyond the threshold; rho_normal.
WITNESSES = [
    ({"rho": F(3, 2), "kappa_1": F(1, 2), "kappa_2": F(1, 10)}, F(3, 10)),
    ({"rho": F(3, 2), "kappa_1": F(1, 2), "kappa_2": F(1, 10)}, F(3, 5)),
    ({"rho": F(1, 2), "kappa_1": F(0), "kappa_2": F(1, 3)}, F(9, 10)),
    ({"rho": F(1, 100), "kappa_1": F(1), "kappa_2": F(4, 5)}, F(1, 2)),
    ({"rho": F(5), "rho_normal": F(3)}, F(9, 20)),
    ({"rho": F(5), "rho_normal": F(3), "kappa_2": F(1, 4)}, F(1, 4)),
]


def departures(constants, theta) -> list[str]:
    constants = {"rho_normal": None, "kappa_1": F(0), "kappa_2": F(0), **constants}
    return differences(constants, theta) + formula_differences(constants, theta)


def refuted(witness) -> bool:
    """Whether a comparison fails, or cannot be made."""
    try:
        return departures(*witness) != []
    except (ArithmeticError, IndexError):
        return True


def scaled(name):
    """A formula made a tenth smaller."""
    formula = getattr(sharp, name)
    return lambda *arguments: (1 - arguments[0] / arguments[0] / 10) * formula(*arguments)


def turned(theta):
    return lambda rho, kappa_1, kappa_2: theta * rho / rho


def friction_inside(bend):
    """1 - q^2 below the turning theta with another friction term."""
    return lambda t, rho, k1, k2: t * (2 - t - 2 * (1 - t) * k2 - (bend(t, k1, 2 - (2 + rho) * t) if k1 else 0))


def with_interval(change):
    interval = sharp.contraction_interval
    return lambda *data: change(*found, *data[:3]) if (found := interval(*data)) else None


root_of, ratio_of, turn_of = sharp.sqrt, sharp.largest_ratio, sharp.turning_theta

#: name: (formula replaced, its replacement)
MUTANTS = {
    "no kappa_2 in r": ("largest_ratio", lambda rho, k1, k2: root_of(rho) + k1),
    "no kappa_1 in r": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho, 0 * k1, k2)),
    "rho for sqrt(rho) in r": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho**2, k1, k2)),
    "2 kappa_2 for 4 kappa_2 in r": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho, k1, k2 / 2)),
    "r not halved": ("largest_ratio", lambda rho, k1, k2: 2 * ratio_of(rho, k1, k2)),
    "the other root": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho, k1, k2) - root_of(rho) - k1),
    "no kappa_2 in f": ("work", lambda x, k1, k2: k1 * x - x * x),
    "no kappa_1 in f": ("work", lambda x, k1, k2: k2 - x * x),
    "x for x^2 in f": ("work", lambda x, k1, k2: k2 + k1 * x - x),
    "no factor 2 in (5.24)": (
        "square_at",
        lambda x, t, rho, k1, k2: (1 - t) ** 2 + t * (1 - t) * work(x, k1, k2) + t**2 * rho * x * x,
    ),
    "theta for theta^2 in (5.24)": (
        "square_at",
        lambda x, t, rho, k1, k2: (1 - t) ** 2 + 2 * t * (1 - t) * work(x, k1, k2) + t * rho * x * x,
    ),
    "sqrt(rho) for rho in (5.24)": ("square_at", lambda x, t, rho, k1, k2: right_side(x, t, root_of(rho), k1, k2)),
    "the worst x always r": ("worst_ratio", lambda t, *data: ratio_of(*data)),
    "the worst x kappa_1/2": ("worst_ratio", lambda t, rho, k1, k2: k1 / 2),
    "the end branch everywhere": ("turning_theta", turned(0)),
    "the inside branch everywhere": ("turning_theta", turned(1)),
    "turning at 2/(2 + rho)": ("turning_theta", lambda rho, k1, k2: 2 / (2 + rho)),
    "kappa_1 twice in the turning theta": (
        "turning_theta",
        lambda rho, k1, k2: (2 * (r := ratio_of(rho, k1, k2)) - 2 * k1) / ((2 + rho) * r - k1),
    ),
    "rho for sqrt(rho) at the end": (
        "one_minus_end",
        lambda t, rho, k1, k2: 1 - (1 - t * (1 + rho * ratio_of(rho, k1, k2))) ** 2,
    ),
    "q for q^2 at the end": (
        "one_minus_end",
        lambda t, rho, k1, k2: 1 - abs(1 - t * (1 + root_of(rho) * ratio_of(rho, k1, k2))),
    ),
    "kappa_1 not squared": ("one_minus_inside", friction_inside(lambda t, k1, bottom: (1 - t) ** 2 * k1 / bottom)),
    "1 - theta not squared": ("one_minus_inside", friction_inside(lambda t, k1, bottom: (1 - t) * k1**2 / bottom)),
    "no kappa_1 inside": ("one_minus_inside", friction_inside(lambda t, k1, bottom: 0)),
    "kappa_2 once inside": (
        "one_minus_inside",
        lambda t, rho, k1, k2: t * (2 - t - (1 - t) * k2 - ((1 - t) * k1) ** 2 / (2 - (2 + rho) * t)),
    ),
    "wrong branch": ("one_minus_inside", sharp.one_minus_end),
    "the other wrong branch": ("one_minus_end", sharp.one_minus_inside),
    "slope without its bend": ("slope_inside", lambda t, rho, k1, k2: 2 - 2 * t - 2 * (1 - 2 * t) * k2),
    "slope with kappa_1": (
        "slope_inside",
        lambda t, rho, k1, k2: (
            2
            - 2 * t
            - 2 * (1 - 2 * t) * k2
            - 2 * k1 * (1 - t) * (1 - 3 * t + (2 + rho) * t**2) / (2 - (2 + rho) * t) ** 2
        ),
    ),
    "kappa_1/4 for kappa_1^2/4": ("friction_number", lambda k1, k2: k2 + k1 / 4),
    "kappa_1^2/2 for kappa_1^2/4": ("friction_number", lambda k1, k2: k2 + k1**2 / 2),
    "no kappa_2 in the friction number": ("friction_number", lambda k1, k2: k1**2 / 4),
    "1 for 2 in the multiple": ("friction_multiple", lambda k1, k2: 1 / (k2 + root_of(k2**2 + k1**2))),
    "kappa_1 for kappa_1^2 in the multiple": ("friction_multiple", lambda k1, k2: 2 / (k2 + root_of(k2**2 + k1))),
    "one over the friction number": ("friction_multiple", lambda k1, k2: 1 / (k2 + k1**2 / 4)),
    "2/(1 + rho) predicted": ("predicted_theta", lambda rho: 2 / (1 + rho)),
    "1/(2 + rho) predicted": ("predicted_rate", lambda rho: 1 / (2 + rho)),
    "no open node in the predicted factor": ("predicted_factor", lambda t, rho: abs(1 - t * (1 + rho))),
    "an open node alone in the predicted factor": ("predicted_factor", lambda t, rho: abs(1 - t)),
    "theta rho with the printed sign": ("predicted_factor", lambda t, rho: max(1 - t, abs(1 - t + t * rho))),
    "an interval that always starts at 0": ("contraction_interval", with_interval(lambda lo, hi, *data: (0 * lo, hi))),
    "an interval capped at the turning theta": (
        "contraction_interval",
        with_interval(lambda lo, hi, *data: (lo, min(hi, turn_of(*data)))),
    ),
    "an interval never capped": (
        "contraction_interval",
        with_interval(lambda lo, hi, *data: (lo, 2 / (1 + root_of(data[0]) * ratio_of(*data)))),
    ),
    "the turning theta called best": ("best_theta", lambda *data: turn_of(*data[:3])),
    "no best theta": ("best_theta", lambda *data: None),
    **{
        f"0.9 {name}": (name, scaled(name))
        for name in [
            *("largest_ratio", "work", "square_at", "turning_theta", "worst_ratio", "one_minus_end"),
            *("one_minus_inside", "one_minus_square", "slope_inside", "friction_number", "friction_multiple"),
            *("predicted_theta", "predicted_rate", "predicted_factor", "best_theta"),
        ]
    },
}


def test_the_theorem_in_energy_norms_passes_on_every_witness():
    assert [departures(*witness) for witness in WITNESSES] == [[]] * len(WITNESSES)


@pytest.mark.parametrize(("name", "formula"), MUTANTS.values(), ids=MUTANTS)
def test_no_mutated_formula_of_the_energy_norms_survives_the_comparison(monkeypatch, name, formula):
    monkeypatch.setattr(sharp, name, formula)
    assert any(map(refuted, WITNESSES))


@pytest.mark.parametrize(
    "rule", [lambda c: c.rho, lambda c: c.rho_normal or c.rho], ids=["rho always", "rho_normal always"]
)
def test_the_comparison_knows_which_rho_is_at_work(monkeypatch, rule):
    monkeypatch.setattr(EnergyConstants, "at_work", property(rule))
    assert any(map(refuted, WITNESSES))


# --- two thresholds on friction ---------------------------------------------------------------------------------------


def least_square(rho: float, kappa_1: float, kappa_2: float) -> float:
    """The least q^2 over theta, by looking: theta and x on grids, the definition of q^2 and nothing else."""
    s = rho**0.5 + kappa_1
    r = (s + (s * s + 4 * kappa_2) ** 0.5) / 2
    xs, thetas = [r * i / 400 for i in range(401)], [i / 400 for i in range(1, 401)]
    f = [kappa_2 + kappa_1 * x - x * x for x in xs]
    square = lambda t: max((1 - t) ** 2 + 2 * t * (1 - t) * v + t * t * rho * x * x for v, x in zip(f, xs, strict=True))
    return min(square(t) - 1 for t in thetas)


@pytest.mark.parametrize("rho", ["1/20", "1/2", 1, 3])
@pytest.mark.parametrize(("kappa_1", "kappa_2"), [(1, 0), (0, 1), (1, "1/3"), ("1/4", 2)])
def test_below_the_limit_of_friction_some_theta_is_proved_and_above_it_none(rho, kappa_1, kappa_2):
    found = evaluate_sharp(EnergyConstants(rho=rho, kappa_1=kappa_1, kappa_2=kappa_2))
    every, some = found.friction_multiple.value, found.friction_limit_multiple.value
    assert every <= some
    rho, kappa_1, kappa_2 = (float(F(v)) for v in (rho, kappa_1, kappa_2))
    assert least_square(rho, 0.99 * some * kappa_1, 0.99 * some * kappa_2) < 0
    assert least_square(rho, 1.001 * some * kappa_1, 1.001 * some * kappa_2) >= 0


def test_without_friction_nothing_limits_it():
    found = evaluate_sharp(EnergyConstants(rho=2))
    assert found.friction_limit_multiple is None
    assert found.reason["friction_limit_multiple"] == "no friction"

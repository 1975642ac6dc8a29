"""Numbers that carry a level and an enclosure through the constants and through every bound."""

import json
import math
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction as F

import oracle
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from ndtheory import (
    EDITIONS,
    PRINTED,
    REPAIRED,
    Constants,
    EnergyConstants,
    HypothesisError,
    Number,
    bounds,
    evaluate,
    evaluate_energy,
)
from ndtheory.number import LEVELS, above, below, decimal, rounded, weakest, working_precision

LEVEL = st.sampled_from(LEVELS)
ENCLOSED = st.sampled_from(["verified", "guaranteed"])

# --- levels and numbers --------------------------------------------------------------------------------------------


@given(st.lists(LEVEL))
def test_the_weakest_level_is_the_last_in_the_order_and_exact_without_any(levels):
    assert LEVELS == ("exact", "verified", "guaranteed", "float")
    assert LEVELS.index(weakest(levels)) == max(map(LEVELS.index, levels), default=0)


@given(strategies.log_uniform(-300, 300), st.sampled_from([-1, 0, 1]))
def test_a_rational_lies_between_neighbouring_doubles(size, sign):
    value = sign * size
    assert F(below(value)) <= value <= F(above(value))
    assert (below(value) == above(value)) == (F(float(value)) == value)
    assert above(value) <= math.nextafter(below(value), math.inf)
    assert (below(Decimal(str(float(value)))), above(-value)) == (below(F(Decimal(str(float(value))))), -below(value))


@pytest.mark.parametrize(
    "given",
    [
        {"value": 1.0, "lo": 1.1, "hi": 2.0, "level": "verified"},
        {"value": 1.0, "lo": 0.5, "hi": 0.9, "level": "guaranteed"},
        {"value": 1.0, "lo": 1.1, "level": "verified"},
        {"value": 1.0, "hi": 0.9, "level": "verified"},
        {"value": math.nan, "lo": 0.0, "hi": 1.0, "level": "verified"},
        {"value": 1.0, "lo": 0.0, "hi": math.nan, "level": "verified"},
        {"value": 1.0, "lo": 0.0, "hi": math.inf, "level": "verified"},
        {"value": 1.0, "lo": 0.5, "hi": 1.5, "level": "float"},
        {"value": 1.0, "lo": 0.5, "level": "float"},
        {"value": 1.0, "hi": 1.5, "level": "float"},
        {"value": 1.0, "level": "verified"},
        {"value": 1.0, "level": "exact"},
        {"value": 1.0, "lo": 0.5, "hi": 1.0, "level": "exact"},
        {"value": 1.0, "level": "certain"},
    ],
)
def test_a_number_with_ends_that_contradict_its_value_or_its_level_is_refused(given):
    with pytest.raises(ValueError, match=r"needed|belong"):
        Number(**given)


@pytest.mark.parametrize("ends", [{"lo": 0.5}, {"hi": 1.5}, {"lo": 0.5, "hi": 1.5}])
def test_one_end_of_an_enclosure_may_be_known_alone(ends):
    number = Number(value=1.0, **ends, level="verified")
    assert number.to_dict() == {"value": 1.0, "lo": None, "hi": None, "level": "verified"} | ends


@given(strategies.log_uniform(-12, 12))
def test_a_rational_is_exact_where_a_double_is_that_rational_and_verified_between_two_doubles_elsewhere(value):
    number = Number.enclosed(value, value, value, "exact")
    assert number.level == ("exact" if F(number.value) == value else "verified")
    assert F(number.lo) <= value <= F(number.hi)
    assert Number(**json.loads(json.dumps(number.to_dict()))) == number


# --- constants keep what they were given ---------------------------------------------------------------------------

M_GUARANTEED = Number(value=2.0, lo=1.5, hi=2.5, level="guaranteed")


def test_constants_keep_the_numbers_given_and_the_level_of_what_was_written():
    given = Constants(m=1, M=M_GUARANTEED, C_R="4/3", C_s=0.1, C_tr="1/2", k="1/4")
    assert (given.M, given.number("M")) == (2, M_GUARANTEED)
    assert given.number("m") == Number(value=1.0, lo=1.0, hi=1.0, level="exact")
    assert given.number("C_R").level == "verified"
    assert given.number("C_s") == Number.of_float(0.1)
    assert given.number("C_K") == Number.of_float(0.0125)
    assert given.number("k").level == "exact"
    assert Constants(m=1, M=2, C_R=1, C_K=0).number("k") is None
    assert given.level == "float"


def test_a_product_of_enclosed_constants_is_enclosed_at_the_weakest_level():
    tr = Number(value=0.5, lo=0.25, hi=0.75, level="verified")
    s = Number(value=2.0, lo=1.0, hi=3.0, level="guaranteed")
    given = Constants(m=1, M=2, C_R=1, C_s=s, C_tr=tr, k="1/4")
    assert given.number("C_K") == Number(value=0.25, lo=1 / 16, hi=9 / 16, level="guaranteed")


def test_energy_constants_keep_the_numbers_given():
    given = EnergyConstants(rho=M_GUARANTEED, kappa_1="1/3", rho_normal=1)
    assert (given.rho, given.number("rho"), given.level) == (2, M_GUARANTEED, "guaranteed")
    assert [given.number(key).level for key in ("kappa_1", "kappa_2", "rho_normal")] == ["verified", "exact", "exact"]
    assert EnergyConstants(rho=2).number("rho_normal") is None


@pytest.mark.parametrize("make", [Constants, EnergyConstants])
def test_a_number_that_breaks_a_hypothesis_is_refused_by_its_value(make):
    number = Number(value=-1.5, lo=-2.0, hi=1.0, level="verified")
    given = {"m": number, "M": 2, "C_R": 1, "C_K": 0} if make is Constants else {"rho": number}
    with pytest.raises(HypothesisError, match=r"= -1\.5: needed a number (m|rho) > 0"):
        make(**given)


def test_a_lower_end_is_moved_to_what_the_hypotheses_allow():
    lift = Number(value=1.0, lo=0.9, hi=1.1, level="verified")
    friction = Number(value=0.0, lo=-0.1, hi=0.1, level="verified")
    assert Constants(m=1, M=2, C_R=lift, C_K=0).ends("C_R") == (1, F(1.1))
    assert EnergyConstants(rho=2, kappa_2=friction).ends("kappa_2") == (0, F(0.1))


# --- the results of plain constants are what they were -------------------------------------------------------------


def numbers(found) -> dict[str, Number | None]:
    """The fields of a result that are Numbers."""
    values = {name: getattr(found, name) for name in found.__dataclass_fields__}
    return {name: value for name, value in values.items() if isinstance(value, Number)}


def as_floats(constants):
    return {key: None if value is None else Number.of_float(value) for key, value in constants.items()}


@pytest.mark.parametrize("edition", EDITIONS, ids=lambda edition: edition.name)
@given(data=st.data())
def test_numbers_of_level_float_give_what_the_floats_give_and_no_enclosure(edition, data):
    constants, theta = data.draw(strategies.theory_cases(edition.name))
    floats = {key: float(value) for key, value in constants.items()}
    found = evaluate(edition, Constants(**as_floats(floats)), theta)
    assert found == evaluate(edition, Constants(**floats), theta)
    assert {number.level for number in numbers(found).values()} == {"float"}


@given(strategies.log_uniform(-6, 6), strategies.log_uniform(-3, 1), strategies.log_uniform(-3, 1), strategies.thetas())
def test_energy_constants_of_level_float_give_what_the_floats_give_and_no_enclosure(rho, kappa_1, kappa_2, theta):
    floats = {"rho": float(rho), "kappa_1": float(kappa_1), "kappa_2": float(kappa_2)}
    found = evaluate_energy(EnergyConstants(**as_floats(floats)), theta)
    assert found == evaluate_energy(EnergyConstants(**floats), theta)
    assert {number.level for number in numbers(found).values()} == {"float"}


def test_constants_written_exactly_give_results_without_enclosures_as_ever():
    found = evaluate(REPAIRED, Constants(m=1, M=2, C_R="4/3", C_K="1/1000"), "1/10")
    assert {number.level for number in numbers(found).values()} == {"float"}
    assert {number.level for number in numbers(evaluate_energy(EnergyConstants(rho=2))).values()} == {"float"}


# --- enclosures ----------------------------------------------------------------------------------------------------

WIDTH = st.one_of(st.just(F(0)), strategies.log_uniform(-17, -1))


@st.composite
def boxes(draw, constants, keys):
    """Numbers around some constants, and rationals inside them."""
    given, inside = dict(constants), dict(constants)
    level = draw(ENCLOSED)
    for key in keys:
        value, below_by, above_by = constants[key], draw(WIDTH), draw(WIDTH)
        lo, hi = below(value * (1 - below_by)), above(value * (1 + above_by))
        given[key] = Number(value=float(value), lo=lo, hi=hi, level=level)
        inside[key] = F(lo) + draw(st.integers(0, 100).map(lambda n: F(n, 100))) * (F(hi) - F(lo))
    return given, inside, level


@st.composite
def boxes_of_section_5(draw, edition):
    """m, M >= 2 m, C_R and friction of any size with theta anywhere or near an end, or both inside the theorem."""
    m = strategies.log_uniform(-6, 6)
    constants, theta = draw(strategies.theory_cases(edition.name, m=m, thinnest=F(1, 10**20)))
    constants = {**constants, "M": 2 * constants["M"]}
    if draw(st.booleans()):
        paper, share = oracle.EDITIONS[edition.name], st.integers(1, 99).map(lambda n: F(n, 100))
        constants["C_K"] = oracle.rational(paper(**constants).threshold("C3"), 7) * draw(share)
        theta = oracle.rational(paper(**constants).C1, 7) * draw(share)
    keys = draw(st.lists(st.sampled_from(sorted(constants)), min_size=1, unique=True))
    given, inside, level = draw(boxes(constants, keys))
    inside["C_R"] = max(inside["C_R"], F(1))
    return given, inside, level, theta


def contains(number, value, level) -> bool:
    """Whether a Number has this level and contains a value, a Number that is right to its last place."""
    last = math.ulp(value.value)
    return number.level == level and number.lo - last <= value.value <= number.hi + last


@pytest.mark.parametrize("edition", EDITIONS, ids=lambda edition: edition.name)
@given(data=st.data())
def test_every_enclosure_contains_the_results_at_all_constants_enclosed(edition, data):
    given, inside, level, theta = data.draw(boxes_of_section_5(edition))
    found, point = (evaluate(edition, Constants(**c), theta) for c in (given, inside))
    always = {"C_K", "C_T", "C_T_tilde", "C0"}
    for name, number in numbers(found).items():
        value = getattr(point, name)
        assert number.level == (level if name in always else number.level)
        if number.level != "float":
            assert number.lo <= number.value <= number.hi
            assert value is not None
            assert contains(number, value, level)


@st.composite
def boxes_in_energy_norms(draw):
    rho = draw(strategies.log_uniform(-3, 3))
    friction = st.one_of(st.just(F(0)), strategies.log_uniform(-6, 0.3))
    constants = {"rho": rho, "kappa_1": draw(friction), "kappa_2": draw(friction)}
    keys = draw(st.lists(st.sampled_from(sorted(constants)), min_size=1, unique=True))
    given, inside, level = draw(boxes(constants, keys))
    for key in ("kappa_1", "kappa_2"):
        if key in keys and draw(st.booleans()):  # from 0 on
            given[key] = replace(given[key], lo=0.0)
    return given, inside, level, draw(strategies.thetas())


@given(boxes_in_energy_norms())
def test_every_enclosure_contains_the_results_at_all_energy_constants_enclosed(case):
    given, inside, level, theta = case
    found, point = (evaluate_energy(EnergyConstants(**c), theta) for c in (given, inside))
    for name, number in numbers(found).items():
        assert number.level == (level if name in ("rho", "kappa_1", "kappa_2", "ratio") else number.level)
        if number.level != "float":
            assert number.lo <= number.value <= number.hi
            assert contains(number, getattr(point, name), level)


@pytest.mark.parametrize("edition", EDITIONS, ids=lambda edition: edition.name)
@strategies.fewer(2)
@given(data=st.data())
def test_an_enclosure_ends_at_the_results_of_its_corners(edition, data):
    """No end is moved further than the rounding of a double needs."""
    given, _, _, theta = data.draw(boxes_of_section_5(edition))
    found = evaluate(edition, Constants(**given), theta)
    end = lambda number, side: getattr(number, side) if isinstance(number, Number) else number
    corner = lambda m, others: {key: exactly(end(v, m if key == "m" else others), key) for key, v in given.items()}
    best, worst = (evaluate(edition, Constants(**corner(*sides)), theta) for sides in (("hi", "lo"), ("lo", "hi")))
    for name, number in numbers(found).items():
        if number.level != "float":
            low, high = sorted(getattr(at, name).value for at in (best, worst))
            if name == "C1" and None in (best.interval, worst.interval):  # not monotone there
                assert contains(number, best.C1, number.level)
                assert contains(number, worst.C1, number.level)
                continue
            assert number.lo == pytest.approx(low, rel=4e-16, abs=0)
            assert number.hi == pytest.approx(high, rel=4e-16, abs=0)


def exactly(value, key):
    value = F(value)
    return max(value, F(1)) if key == "C_R" else value


@pytest.mark.parametrize("edition", EDITIONS, ids=lambda edition: edition.name)
@strategies.fewer(4)
@given(data=st.data())
def test_doubles_given_as_exact_give_enclosures_of_the_paper_s_formulas_in_400_digits(edition, data):
    """Outward rounding: two neighbours of each result, which contain it."""
    constants, theta = data.draw(strategies.theory_cases(edition.name, m=strategies.log_uniform(-6, 6)))
    doubles = {key: float(value) for key, value in constants.items()}
    given = {key: Number(value=v, lo=v, hi=v, level="exact") for key, v in doubles.items()}
    found = evaluate(edition, Constants(**given), theta)
    paper = oracle.EDITIONS[edition.name](**{key: F(repr(v)) for key, v in doubles.items()})
    with mp.workdps(oracle.DIGITS):
        want = {name: getattr(paper, name) for name in ("C_K", "C_T", "C0", "C1", "C6")}
        want |= {name: paper.threshold(name) for name in ("C2", "C3", "C4", "C5")}
        for name, value in want.items():
            number = getattr(found, name)
            if number is not None and number.level != "float":
                assert number.level == "verified" or number.lo == number.hi
                assert number.lo <= value <= number.hi


def test_what_some_of_the_constants_enclosed_do_not_have_has_no_enclosure():
    """C2 on C_K is 0.092 for m = 1, M = 2, C_R = 1: friction up to 0.5 may leave no interval."""
    friction = Number(value=0.01, lo=0.0, hi=0.5, level="verified")
    found = evaluate(REPAIRED, Constants(m=1, M=2, C_R=1, C_K=friction), "1/10")
    assert found.verdict == "contraction"
    assert [found.factor.level, found.one_minus_factor.level] == ["float"] * 2
    assert [found.C0.level, found.C1.level, found.C2.level, found.C_T.level] == ["verified"] * 4


@pytest.mark.parametrize("edition", EDITIONS, ids=lambda edition: edition.name)
def test_C1_has_an_enclosure_on_both_sides_of_C2_and_beyond_it(edition):
    """From no friction to five times C2; C1 is not monotone there."""
    threshold = F(evaluate(edition, Constants(m="1/2", M=2, C_R=2, C_K="1/10")).C2.value)
    for low, high in ((0, F(1, 2)), (F(9, 10), F(11, 10)), (2, 5)):
        ends = [float(share * threshold) for share in (low, high)]
        friction = Number(value=sum(ends) / 2, lo=ends[0], hi=ends[1], level="verified")
        found = evaluate(edition, Constants(m="1/2", M=2, C_R=2, C_K=friction)).C1
        assert found.level == "verified"
        for i in range(21):
            at = F(ends[0]) + F(i, 20) * (F(ends[1]) - F(ends[0]))
            assert contains(found, evaluate(edition, Constants(m="1/2", M=2, C_R=2, C_K=at)).C1, "verified")


@pytest.mark.parametrize("M", ["2", "7/3", "50/7"])
def test_the_interval_that_is_proved_lies_inside_the_one_of_the_weakest_constants(M):
    m, C_R = Number(value=1.0, lo=0.99, hi=1.01, level="verified"), F(4, 3)
    least, A = F(0.99), F(M) * C_R
    D, Q = (F(M) * A / least**2) ** 2, (A**2 * F(M) / least**3) ** 2
    low, high = evaluate(REPAIRED, Constants(m=m, M=M, C_R=C_R, C_K=0)).interval_proved
    assert low == 0
    assert 0 < bounds.C1(D, Q) - F(high) < F(math.ulp(high)) * 2
    known = evaluate(REPAIRED, Constants(m=least, M=M, C_R=C_R, C_K=0))
    friction = (known.C4.value + known.C2.value) / 2
    largest = max(F(friction), F(str(friction)))  # a double is read as its shortest decimal
    rubs = Number(value=friction, lo=friction * 0.99, hi=friction, level="verified")
    low, high = evaluate(REPAIRED, Constants(m=m, M=M, C_R=C_R, C_K=rubs)).interval_proved
    with working_precision():
        worst = bounds.C6(bounds.P(decimal(largest), *map(decimal, (least, F(M), C_R, least))))
        assert 0 < Decimal(low) - worst < Decimal(math.ulp(low)) * 2


@pytest.mark.parametrize(("lo", "proved"), [(1.0, True), (0.99, False)])
def test_the_printed_proof_holds_for_all_coercivities_enclosed_or_is_not_called_a_proof(lo, proved):
    m = Number(value=1.005, lo=lo, hi=1.01, level="verified")
    assert evaluate(PRINTED, Constants(m=m, M=3, C_R=1, C_K=0)).proved is proved
    assert evaluate(REPAIRED, Constants(m=m, M=3, C_R=1, C_K=0)).proved


def test_theta_must_be_inside_the_interval_throughout_for_an_enclosure_of_the_factor():
    """rho = 2 within 1/4: q < 1 below 2/(1 + rho), that is 8/13 at the worst."""
    rho = Number(value=2.0, lo=1.75, hi=2.25, level="verified")
    near, far = (evaluate_energy(EnergyConstants(rho=rho), theta) for theta in ("3/5", "5/8"))
    assert near.theta_max_proved.lo == pytest.approx(8 / 13)
    assert near.factor.level == "verified"
    assert near.factor.hi == pytest.approx(0.95)
    assert (far.verdict, far.factor.level, far.factor.lo) == ("contraction", "float", None)


def test_friction_that_may_vanish_spans_the_jump_from_rho_normal_to_rho():
    friction = Number(value=0.25, lo=0.0, hi=0.5, level="guaranteed")
    found = evaluate_energy(EnergyConstants(rho=2, rho_normal=1, kappa_2=friction), "1/4")
    assert (found.rho.value, found.rho.level) == (2, "guaranteed")
    assert found.rho.lo == pytest.approx(1)
    assert found.rho.hi == pytest.approx(2)
    assert found.friction_multiple.level == "float", "without friction there is no largest multiple"


def known(value):
    """A double that is what it says."""
    return Number(value=float(value), lo=float(value), hi=float(value), level="exact")


def test_an_interval_without_two_doubles_inside_is_not_proved():
    """Friction one double below C2, where C6 and C1 meet."""
    given = {"m": known(1), "M": known(2.5), "C_R": known(1)}
    just_below = evaluate(REPAIRED, Constants(**given, C_K=known(0))).C2.lo
    found = evaluate(REPAIRED, Constants(**given, C_K=known(just_below)))
    assert found.interval[0] < found.interval[1]
    assert found.interval_proved is None
    further = evaluate(REPAIRED, Constants(**given, C_K=known(just_below * (1 - 1e-9)))).interval_proved
    assert further[0] < further[1]


def test_an_end_that_may_be_rounding_proves_no_interval():
    """C1 is some 2e-80 here."""
    found = evaluate(REPAIRED, Constants(m=known(1), M=known(1e20), C_R=known(1e20), C_K=known(0)))
    assert found.interval == (0, pytest.approx(2e-80))
    assert found.interval_proved is None


@pytest.mark.parametrize(
    "other", [0.3, Number.of_float(0.3), *(Number(value=0.3, **{end: 0.3}, level="verified") for end in ("lo", "hi"))]
)
def test_one_constant_without_an_enclosure_leaves_all_results_without(other):
    rho = Number(value=2.0, lo=1.75, hi=2.25, level="verified")
    found = evaluate_energy(EnergyConstants(rho=rho, kappa_1=other), "1/4")
    assert {number.level for number in numbers(found).values()} == {"float"}


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.5), (-1.0, 1.5), (1e-31, 1.5), (0.5, 2.5)])
def test_a_coercivity_that_may_vanish_or_exceed_M_leaves_no_enclosure(low, high):
    m = Number(value=1.0, lo=low, hi=high, level="verified")
    found = evaluate(REPAIRED, Constants(m=m, M=2, C_R=1, C_K=0), "1/10")
    assert {number.level for number in numbers(found).values()} == {"float"}


def test_an_end_in_200_digits_is_moved_outward_by_more_than_its_rounding_and_given_up_where_rounding_may_be_all():
    one, least = Decimal(1), Decimal("1e-70")
    with working_precision():
        number = rounded(one, [one, one], "verified")
        assert (number.lo, number.hi) == (math.nextafter(1, 0), math.nextafter(1, 2))
        assert rounded(least, [least, one], "verified") == Number.of_float(1e-70)
        assert rounded(one, [Decimal(0), one], "guaranteed").lo == 0
        assert rounded(one, [None, one], "verified") == rounded(one, [], "verified") == Number.of_float(1)
        assert rounded(None, [one, one], "verified") is None


def test_nothing_is_called_exact_after_a_root():
    two = Number(value=2.0, lo=2.0, hi=2.0, level="exact")
    found = evaluate_energy(EnergyConstants(rho=two), "1/2")
    assert found.ratio.level == "verified"
    assert found.ratio.lo < math.sqrt(2) + 1e-15
    assert F(found.ratio.lo) ** 2 < 2 < F(found.ratio.hi) ** 2

"""Proposition 5.6 at the edges of its intervals, and each hypothesis just broken and just kept."""

from fractions import Fraction as F

import oracle
import pytest
import strategies
from bounds_comparison import differences, in_both_editions

from ndtheory import PRINTED, REPAIRED, Constants, HypothesisError, bounds, evaluate, relaxation_factor

# --- at the edges --------------------------------------------------------------------------------------------------

#: m = 1 and C_K = C2 exactly, where C0 = C1 = C6, however its root rounds: M, C_R, C_K
AT_C2 = [("4/3", "9/8", "1/4"), ("3/2", "2", "1/9"), ("8/3", "3", "1/64"), ("15/4", "4", "1/225")]
AT_C2 += [("40/21", "7/3", "81/1600"), ("56/45", "9/5", "625/3136")]


@in_both_editions
@pytest.mark.parametrize(("M", "C_R", "C_K"), AT_C2)
def test_friction_equal_to_C2_is_too_much(edition, M, C_R, C_K):
    found = evaluate(edition, Constants(m=1, M=M, C_R=C_R, C_K=C_K), "1/10")
    assert found.C2.value == float(F(C_K))
    assert found.C0 == found.C1 == found.C6
    assert (found.interval, found.verdict, found.factor) == (None, "no conclusion", None)


@in_both_editions
def test_the_interval_is_open_at_C1(edition):
    """Without friction and with m = 1, M = 2, C_R = 1: C1 = 34/97."""
    constants = Constants(m=1, M=2, C_R=1, C_K=0)
    assert evaluate(edition, constants).C1.value == 34 / 97
    assert evaluate(edition, constants, "34/97").verdict == "no conclusion"
    assert evaluate(edition, constants, F(34, 97) - F(1, 10**50)).verdict == "contraction"


@in_both_editions
def test_the_interval_is_open_at_C1_however_C1_rounds(edition):
    assert evaluate(edition, Constants(m=1, M=4, C_R=3, C_K=0), "922/67277").verdict == "no conclusion"


def test_the_interval_is_open_at_C6_however_C6_rounds():
    constants = Constants(m="1/16", M="5/16", C_R="5/2", C_K="49/265225")
    assert evaluate(REPAIRED, constants, "10578622/2824350647").verdict == "no conclusion"


@in_both_editions
def test_at_the_end_point_C3_where_a_prime_vanishes_every_theta_below_C1_contracts(edition):
    """m = M = 1, C_K = 1/16, C_R = 107/16: G(C_K) = 1/2 exactly, h2 = 1 - theta."""
    constants = Constants(m=1, M=1, C_R="107/16", C_K="1/16")
    found = evaluate(edition, constants, "1/100")
    assert found.C3.value == 1 / 16
    assert found.C6 is None
    assert found.factor.value == float(oracle.square_root(F(99, 100)))
    assert 1 / 100 < found.C0.value < found.C1.value


@in_both_editions
def test_at_the_end_point_C4_where_a_prime_is_minus_1_there_is_still_no_lower_end(edition):
    """m = M = 1, C_K = 1/16, C_R = 235/16: G(C_K) = 1 exactly, h2 = 1 - theta^2."""
    found = evaluate(edition, Constants(m=1, M=1, C_R="235/16", C_K="1/16"), "1/1000")
    assert found.C4.value == 1 / 16
    assert found.C6 is None
    assert found.interval[0] == 0
    assert found.factor.value == float(oracle.square_root(F(999_999, 1_000_000)))


@pytest.mark.parametrize("m", ["1e10", "1e12"])
def test_the_layer_between_C4_and_C5_is_resolved_in_any_unit(m):
    body = {"m": F(m), "M": F(m) * 10**6, "C_R": F(10) ** 12}
    low, high = strategies.layer(oracle.printed(**body, C_K=0))
    constants = {**body, "C_K": (low + high) / 2}
    theta = oracle.rational(oracle.printed(**constants).C6, 60) * (1 + F(1, 10**6))
    assert differences(PRINTED, constants, theta) == []


def test_the_repaired_edition_has_m_in_place_of_m_tilde_everywhere():
    found = evaluate(REPAIRED, Constants(m=4, M=5, C_R=2, C_K=1))
    assert found.C_T_tilde == found.C_T


def test_rationals_stay_rational_in_the_printed_edition():
    m, M, C_R, x = F(4), F(5), F(2), F(1, 9)
    assert isinstance(bounds.D(x, PRINTED.coercivity(m), M, C_R, PRINTED.unit(m)), F)


# --- each hypothesis, just broken and just kept --------------------------------------------------------------------

NO_NUMBER = [*map(float, ("nan", "inf", "-inf")), None, True, False, "", "abc", "nan", "1/0", "1e999999", "-1", -1]
BROKEN = {
    "m": [0, 0.0, "0", "-1e-300"],
    "M": ["1/2", 0.9999999999999999, 0],
    "C_R": [0.9999999999999999, "0." + 60 * "9", 0],
    "C_K": ["-1e-300", -1e-300],
    "C_s": ["-1e-300", -1e-300],
    "C_tr": ["-1e-300", -1e-300],
    "k": ["-1e-300", -0.2],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key in BROKEN for value in NO_NUMBER + BROKEN[key]])
def test_a_broken_hypothesis_is_named_with_the_value_received(key, value):
    given = {"m": 1, "M": 1, "C_R": 1} | ({"C_s": 1, "C_tr": 1, "k": 1} if key in ("C_s", "C_tr", "k") else {"C_K": 0})
    with pytest.raises(HypothesisError) as refusal:
        Constants(**{**given, key: value})
    assert key in str(refusal.value)
    assert f"= {value}: needed " in str(refusal.value)


@pytest.mark.parametrize("value", [0, 1, 0.0, 1.0, "1", -0.5, "-1e-300", 1.5, "1." + 60 * "0" + "1", *NO_NUMBER])
def test_theta_outside_0_1_is_refused(value):
    with pytest.raises(HypothesisError) as refusal:
        relaxation_factor(value)
    assert str(refusal.value) == f"theta = {value}: needed a number with 0 < theta < 1"
    if value is not None:
        with pytest.raises(HypothesisError):
            evaluate(REPAIRED, Constants(m=1, M=1, C_R=1, C_K=0), value)


@in_both_editions
def test_the_hypotheses_are_kept_with_equality(edition):
    """m = M, C_R = 1, C_K = 0: then C1 = 1, the largest it can be, and C0 = 2/3."""
    found = evaluate(edition, Constants(m=1, M=1, C_R=1, C_K=0), "0." + 30 * "9")
    assert (found.C0.value, found.interval, found.verdict) == (2 / 3, (0, 1), "contraction")


def test_C_K_is_given_once_and_completely():
    for extra in ({"k": 0}, {"C_s": 1}, {"C_tr": 1}):
        with pytest.raises(HypothesisError, match="either C_K or C_s, C_tr and k"):
            Constants(m=1, M=1, C_R=1, C_K=0, **extra)
        with pytest.raises(HypothesisError, match="or C_K alone"):
            Constants(m=1, M=1, C_R=1, **extra)
    with pytest.raises(HypothesisError, match="C_s, C_tr, k = None"):
        Constants(m=1, M=1, C_R=1)

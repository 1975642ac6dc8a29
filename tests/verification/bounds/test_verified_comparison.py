"""A comparison with proofs: what it calls verified is proved, what it cannot prove says so."""

from dataclasses import replace
from fractions import Fraction as F

import numpy as np
import pytest
from problem_list import bars, changed, small

import verification as vf
from ndtheory import PRINTED, Constants, EnergyConstants, Number, evaluate, evaluate_energy
from verification.algorithm.rates import StepRatio
from verification.bounds.bound import BoundResult
from verification.bounds.verdicts import judge, judge_bound
from verification.certificate.claims import Claims, Confirmation, NoCertificate, describe
from verification.certificate.contraction import certify
from verification.certificate.exact_bodies import NotExact
from verification.certificate.proved_constants import verify
from verification.constants import measure
from verification.interface.pair import pair_from
from verification.semidefinite.lipschitz import work_out
from verification.semidefinite.multipliers import QuadraticForms

SMALL = vf.Problem.from_dict(small())


@pytest.fixture
def compared(shared, known_bounds):
    return lambda name, problem: shared(("verified comparison", name), lambda: vf.compare(problem(), verified=True))


@pytest.fixture
def whole(compared):
    return compared("small", lambda: SMALL)


@pytest.fixture
def plain(shared, known_bounds):
    return shared("plain comparison", lambda: vf.compare(SMALL))


def numbers(whole):
    """What is told at level verified."""
    repaired, energy = whole.bounds["repaired"].detail, whole.bounds["energy"]
    found = {name: getattr(repaired, name) for name in ("C_T", "C0", "C2", "C3", "C4", "C5", "C_K")}
    return found | {
        "q": energy.factor,
        "1 - q": energy.one_minus_factor,
        "theta_max": energy.detail.theta_max_proved,
        "every": energy.friction.every,
        "some": energy.friction.some,
    }


def test_bounds_are_enclosures_of_those_in_doubles(whole, plain):
    for name, number in numbers(whole).items():
        assert number.level == "verified", name
        assert number.lo < number.hi, name
        assert numbers(plain)[name].level == "float", name
        assert number.value == pytest.approx(numbers(plain)[name].value, rel=1e-9), name
        assert number.hi - number.lo < 1e-6 * number.value, name


def test_the_interval_that_is_proved_lies_inside_that_in_doubles(whole):
    energy = whole.bounds["energy"]
    assert energy.interval == energy.detail.interval_proved
    assert energy.interval_level == "verified"
    assert energy.interval[1] == energy.detail.theta_max_proved.lo < energy.detail.interval[1]


def test_the_semidefinite_factor_is_that_of_a_certificate(whole, plain):
    lmi = whole.bounds["lmi"].detail
    certificate = certify(SMALL)
    assert lmi.certified
    assert lmi.lipschitz.level == "verified"
    assert F(lmi.lipschitz.hi) >= certificate.factor > lmi.lower
    assert F(lmi.lipschitz.hi) - certificate.factor < F(1, 10**9)
    assert lmi.divided.level == "float"
    assert lmi.lower <= lmi.divided.value == plain.bounds["lmi"].detail.lipschitz.value <= lmi.lipschitz.hi
    rest = whole.bounds["lmi"].one_minus_factor
    assert F(rest.lo) <= 1 - F(lmi.lipschitz.hi)


def test_the_largest_theta_and_the_friction_threshold_are_proved_from_below(whole, plain):
    proved, doubles = whole.bounds["lmi"].detail, plain.bounds["lmi"].detail
    assert proved.unverified == {}
    assert doubles.unverified is None
    for name in ("theta_max", "friction_threshold"):
        number, other = getattr(proved, name), getattr(doubles, name)
        assert (number.level, other.level) == ("verified", "float"), name
        assert number.hi is None
        assert 0.98 * number.value < number.lo <= number.value == pytest.approx(other.value, rel=1e-9), name
    assert whole.bounds["lmi"].interval == (0.0, proved.theta_max.lo)
    assert whole.bounds["lmi"].interval_level == "verified"


def semidefinite(problem, theta):
    pair = pair_from(problem)
    measured = measure(pair)
    return pair, measured, work_out(pair, measured, theta)


def test_the_largest_theta_is_that_of_the_exact_constant_where_this_is_known():
    """Without friction every theta below 2/(1 + rho_N) contracts, and none above."""
    problem = vf.Problem.from_dict(changed(small(), body1={"young": "9"}, contact={"friction": "0"}))
    pair, measured, found = semidefinite(problem, 0.1)
    least = found.proved(pair, measured, F(1, 10)).theta_max.lo
    rho = verify(measured, pair).rho_normal
    assert rho.lo > 1
    assert F(least) < 2 / (1 + F(rho.lo))
    assert least == pytest.approx(2 / (1 + rho.value), rel=1e-6)


def test_a_theta_or_a_friction_that_the_multipliers_do_not_prove_is_refused():
    pair, measured, found = semidefinite(
        vf.Problem.from_dict(changed(small(), body1={"young": "9"}, contact={"friction": "1/5"})), 0.1
    )
    confirmation = Confirmation(pair)
    multipliers = lambda k: QuadraticForms(pair, measured, friction=k).friction_number().multipliers
    twice = lambda k: tuple(2 * values for values in multipliers(k))
    theta, k = found.theta_max.value, found.friction_threshold.value
    assert theta < 0.9
    assert 0.999 * theta < confirmation.theta_max(theta, found.largest) <= F(theta)
    assert 0.999 * k < confirmation.friction_threshold(k, twice) <= F(k)
    for share in (0.9, 0.8):  # far below: what is rounded up would be confirmed too
        assert confirmation.theta_max(share * theta, found.largest) <= F(share * theta)
        assert confirmation.friction_threshold(share * k, twice) <= F(share * k)
    with pytest.raises(NoCertificate, match="not confirmed"):
        confirmation.theta_max(1.02 * theta, found.largest)
    with pytest.raises(NoCertificate, match="not confirmed"):
        confirmation.friction_threshold(1.1 * k, twice)
    with pytest.raises(NoCertificate, match="not confirmed"):
        confirmation.friction_threshold(k, lambda k: tuple(values / 100 for values in multipliers(k)))


def test_the_multipliers_of_the_largest_theta_prove_every_smaller_one():
    pair, measured, found = semidefinite(SMALL, 0.5)
    claims = Claims(describe(SMALL, pair), lambda text, share: None)
    least = F(found.proved(pair, measured, F(1, 2)).theta_max.lo)
    for share in (F(1), F(1, 2), F(1, 1000)):
        theta = least * share
        lam, tau, a, b = ([str(F(float(theta * F(float(v))))) for v in values] for values in found.largest)
        written = {"lambda": lam, "tau": [str(F(x) * (1 - F(1, 10**12))) for x in tau], "a": a, "b": b}
        assert claims.accepted(theta, F(1), written) is not None


def test_the_verdicts_hold_the_run_against_the_proved_ends(whole, plain):
    for name in ("energy", "lmi"):
        assert "proved bound" in whole.verdicts[name].reason
        assert "proved" not in plain.verdicts[name].reason
        assert whole.verdicts[name].verdict == plain.verdicts[name].verdict == "CONSISTENT"
        told = F(whole.verdicts[name].reason.split("proved bound ")[1].split(":")[0])
        assert told >= F(whole.bounds[name].factor.hi)


def test_the_documents_of_both_differ_in_what_is_proved_alone(whole, plain):
    proved, doubles = whole.to_dict(), plain.to_dict()
    assert proved["constants"]["unverified"] == {}
    assert proved["lmi"]["certified"]
    assert "certified" not in proved["lmi"]["reason"]
    assert not doubles["lmi"]["certified"]
    assert "divided" not in doubles["lmi"]
    assert "unverified" not in doubles["constants"]
    assert proved["energy"]["friction_threshold"]["level"] == "verified"
    assert doubles["bounds"]["editions"]["energy"]["interval_proved"] is None


NOT_PROVED = {
    "bars": (bars(iteration={"theta": "0.2"}), "plane problem"),
    "beyond what one program proves": (changed(small(), contact={"friction": "3"}), "does not contract"),
}


@pytest.mark.parametrize("name", NOT_PROVED)
def test_what_cannot_be_certified_says_why(compared, name):
    tables, why = NOT_PROVED[name]
    lmi = compared(name, lambda: vf.Problem.from_dict(tables)).bounds["lmi"].detail
    assert not lmi.certified
    assert lmi.divided is None
    assert why in lmi.to_dict()["reason"]["certified"]


def not_exact(*given):
    raise NotExact("these bodies are made up")


def test_of_bodies_that_are_not_exact_the_factor_stays_one_in_doubles(whole, plain, monkeypatch):
    monkeypatch.setattr("verification.certificate.claims.describe", not_exact)
    lmi, pair = plain.bounds["lmi"].detail, plain.run.pair
    found = lmi.proved(pair, plain.measured, F(7, 10))
    assert not found.certified
    assert found.lipschitz == lmi.lipschitz
    assert "these bodies are made up" in found.to_dict()["reason"]["certified"]
    assert set(found.to_dict()["unverified"]) == {"theta_max", "friction_threshold"}
    assert found.theta_max == lmi.theta_max


def test_of_matrices_nothing_is_proved_and_the_comparison_says_why():
    S_1, S_2 = np.diag([2.0, 3.0, 2.0, 3.0]), np.diag([4.0, 5.0, 4.0, 5.0])
    pair = vf.build(S1=S_1, S2=S_2, x=np.array([0.0, 1.0]))
    whole = vf.compare(pair, theta="0.4", verified=True)
    assert "made from matrices" in whole.measured.unverified["rho_max"]
    assert whole.bounds["energy"].level == "float"
    assert "made from matrices" in whole.bounds["lmi"].detail.not_proved
    assert "proved" not in whole.verdicts["energy"].reason


# --- proved ends ------------------------------------------------------------------------------------------------------


def enclosed(value, width=1e-3):
    return Number(value=value, lo=value - width, hi=value + width, level="verified")


def test_a_verdict_comes_from_the_proved_end():
    """A factor of 0.5 that is proved to be at most 0.501: 0.5005 does not violate it."""
    result = BoundResult(name="energy", proved=True, factor=enclosed(0.5))
    seen = StepRatio(value=0.5005, lo=0.5004, hi=0.5006, steps=3)
    assert judge(0.5, seen, "").verdict == "VIOLATED"
    found = judge_bound(result, seen, "")
    assert found.verdict == "CONSISTENT"
    assert "proved bound 0.501" in found.reason
    in_doubles = judge_bound(replace(result, proved=False), seen, "")
    assert in_doubles.verdict == "VIOLATED"
    assert "proved" not in in_doubles.reason


def test_an_end_that_is_told_as_proved_is_rounded_upwards():
    found = judge(0.70001, StepRatio(value=0.1, lo=0.1, hi=0.1, steps=3), "", proved=True)
    assert found.reason.endswith("proved bound 0.7001")


def test_the_printed_proof_holds_where_all_of_the_enclosed_m_are_1_at_least():
    at = lambda m: evaluate(PRINTED, Constants(m=m, M=5, C_R=2, C_K="1/1000"))
    assert at(enclosed(1.002)).proved
    assert not at(enclosed(1.0005)).proved
    assert at(Number.of_float(1.0005)).proved


def test_an_interval_is_proved_where_it_holds_for_every_constant_enclosed():
    constants = EnergyConstants(rho=enclosed(2.0), kappa_1=enclosed(0.3), kappa_2=enclosed(0.2))
    found = evaluate_energy(constants)
    worst = evaluate_energy(EnergyConstants(rho="2.001", kappa_1="0.301", kappa_2="0.201"))
    low, high = found.interval_proved
    assert low >= worst.interval[0]
    assert worst.interval[1] * (1 - 1e-12) < high <= worst.interval[1]
    assert worst.interval_proved is None
    assert evaluate_energy(EnergyConstants(rho=2.0, kappa_1=0.3, kappa_2=0.2)).interval_proved is None


def test_no_interval_is_proved_where_some_of_the_constants_enclosed_have_none():
    wide = EnergyConstants(rho=enclosed(1.0), kappa_1=enclosed(0.1), kappa_2=enclosed(1.2, 1.0))
    found = evaluate_energy(wide)
    assert found.interval is not None
    assert found.interval_proved is None
    assert "enclosures" in found.to_dict()["reason"]["interval_proved"]

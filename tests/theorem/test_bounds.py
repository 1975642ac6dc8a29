"""Proposition 5.6, printed and repaired, beside the paper's formulas in 400 digits and in exact rationals."""

import json
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction as F

import oracle
import pytest
import strategies
from bounds_comparison import THRESHOLDS, close, differences, in_both_editions, read
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from ndtheory import PRINTED, REPAIRED, Constants, bounds, evaluate

# --- against the paper --------------------------------------------------------------------------------------------


@in_both_editions
@given(data=st.data())
def test_every_field_agrees_with_the_formulas_of_the_paper(edition, data):
    """With and without theta, and what is null in the JSON has a reason and nothing else has one."""
    constants, theta = data.draw(strategies.theory_cases(edition.name))
    assert differences(edition, constants, theta) == []
    without, found = (evaluate(edition, Constants(**constants), t) for t in (None, theta))
    assert without == replace(found, theta=None, factor=None, one_minus_factor=None, verdict=None)
    document = json.loads(json.dumps(found.to_dict()))
    assert {name for name, value in document.items() if value is None} == set(document["reason"])


@in_both_editions
@given(data=st.data())
def test_contraction_is_K_below_1_or_max_0_C6_below_theta_below_C1_and_friction_below_C2(edition, data):
    """By Proposition 5.6, wording by wording."""
    constants, theta = data.draw(strategies.theory_cases(edition.name, thinnest=0))
    paper = oracle.EDITIONS[edition.name](**constants)
    friction_below = oracle.real(constants["C_K"]) < paper.threshold("C2")
    inside = friction_below and max(0, paper.C6 or 0) < oracle.real(theta) < paper.C1
    assert paper.contracts(theta) == (paper.K(theta) < 1) == inside
    assert evaluate(edition, Constants(**constants), theta).verdict == ("contraction" if inside else "no conclusion")


@given(strategies.constants())
def test_G_and_the_bracket_of_5_36_are_two_ways_to_a_prime(constants):
    for paper in (edition(**constants) for edition in oracle.EDITIONS.values()):
        with mp.workdps(oracle.DIGITS):
            assert close(paper.G(paper.C_K), paper.bracket * paper.m**3)
            assert close(paper.a_prime, 1 - 2 / paper.m**3 * paper.G(paper.C_K), scale=1 + 2 * paper.bracket)


@in_both_editions
@given(data=st.data())
def test_the_formulas_hold_in_plain_floats(edition, data):
    constants = {name: float(v) for name, v in data.draw(strategies.constants(editions=(edition.name,))).items()}
    theta = float(data.draw(strategies.thetas()))
    paper = oracle.EDITIONS[edition.name](**constants)
    (x, m, M, C_R), u = read(edition, constants)
    shared = (x, m, M, C_R)
    P, D, Q = bounds.P(*shared, u), bounds.D(*shared, u), bounds.Q(*shared)
    with mp.workdps(oracle.DIGITS):
        assert close(bounds.lipschitz(constants["m"], M, C_R, x), paper.C_T)
        assert close(bounds.lipschitz(m, M, C_R, x), paper.C_T_tilde)
        assert close(bounds.C0(m, M, C_R), paper.C0)
        assert close(bounds.G(*shared, u), paper.G(paper.C_K))
        assert close(P, paper.bracket)
        assert close(D, paper.C_T_tilde**2 / paper.C_R**2 - paper.bracket)
        assert close(Q, paper.C_T_tilde**2 * paper.M**2 / paper.m**2)
        assert close(bounds.C1(D, Q), paper.C1)
        if paper.C6 is not None and P > 1:
            assert close(bounds.C6(P), paper.C6, scale=1)
        t = oracle.real(theta)
        assert close(bounds.one_minus_h1(theta, D, Q), 1 - paper.h1(t), scale=t * (abs(paper.b) + t * paper.a))
        assert close(bounds.one_minus_h2(theta, P), 1 - paper.h2(t), scale=t * (2 + 2 * paper.bracket))
        for name in THRESHOLDS:
            assert close(bounds.inverse_G(float(paper.right[name]), m, M, C_R, u), paper.threshold(name))


# --- exact identities: m and C_K squares, so every number is rational ----------------------------------------------


@in_both_editions
@given(data=st.data())
def test_a_b_a_prime_and_b_prime_are_exactly_those_of_the_paper(edition, data):
    """And a >= 1, b <= -2, C1 <= 1; h1 meets h2 at C0 and is the larger above it; C5 is C2; C0 < C1 below C2 alone."""
    constants = data.draw(strategies.square_constants(edition.name))
    theta = data.draw(strategies.thetas())
    (x, m, M, C_R), u = read(edition, constants)
    P, D, Q = bounds.P(x, m, M, C_R, u), bounds.D(x, m, M, C_R, u), bounds.Q(x, m, M, C_R)
    C_T, C0, C1 = bounds.lipschitz(m, M, C_R, x), bounds.C0(m, M, C_R), bounds.C1(D, Q)
    gain_1, gain_2 = (lambda t: bounds.one_minus_h1(t, D, Q)), (lambda t: bounds.one_minus_h2(t, P))
    bracket = (x * C_T / (M * C_R) / u + x / m**2) * M**2 / m
    a = C_T**2 * M**2 / m**2 + 2 * C_T**2 / C_R**2 - 2 * bracket + 1
    b = -2 * C_T**2 / C_R**2 + 2 * bracket - 2
    a_prime = 1 - 2 * bracket
    assert (bracket, a, b) == (P, 1 + 2 * D + Q, -2 * (1 + D))
    assert C1 == -b / a <= 1 <= a
    assert b <= -2
    assert gain_1(theta) == 1 - (a * theta**2 + b * theta + 1)
    assert gain_2(theta) == 1 - (a_prime * theta**2 - (1 + a_prime) * theta + 1)
    assert a_prime == 0 or bounds.C6(P) == 1 + 1 / a_prime
    assert 0 < C0 <= F(2, 3)
    assert gain_1(C0) == gain_2(C0)
    assert (gain_1(theta) <= gain_2(theta)) == (theta >= C0)
    of_C2 = m**5 / (M * C_R) ** 2 + m**3
    assert of_C2 == (2 - C0) / (1 - C0) * m**3 / 2
    assert (C0 < C1) == (bounds.G(x, m, M, C_R, u) < of_C2)


@in_both_editions
@given(data=st.data())
def test_the_verdict_is_the_sign_of_exact_rationals(edition, data):
    constants = data.draw(strategies.square_constants(edition.name))
    (x, m, M, C_R), u = read(edition, constants)
    P, D, Q = bounds.P(x, m, M, C_R, u), bounds.D(x, m, M, C_R, u), bounds.Q(x, m, M, C_R)
    ends = [bounds.C0(m, M, C_R), bounds.C1(D, Q)] + [bounds.C6(P)] * (P > 1)
    near = st.builds(lambda end, offset: end * (1 + offset), st.sampled_from(ends), strategies.offsets(12))
    theta = data.draw(st.one_of(strategies.thetas(), near.map(lambda t: t if t < 1 else 1 / t if t > 1 else t / 2)))
    gain = min(bounds.one_minus_h1(theta, D, Q), bounds.one_minus_h2(theta, P))
    assert evaluate(edition, Constants(**constants), theta).verdict == ("contraction" if gain > 0 else "no conclusion")
    assert (gain > 0) == (max(0, bounds.C6(P) if P > 1 else 0) < theta < bounds.C1(D, Q) and ends[0] < ends[1])


# --- metamorphic laws ----------------------------------------------------------------------------------------------


def in_unit(constants, unit):
    """The same bodies with stresses counted in another unit."""
    return {name: v if name == "C_R" else v * unit for name, v in constants.items()}


@given(strategies.theory_cases("repaired"), st.integers(-9, 9).map(lambda j: F(10) ** j))
def test_the_repaired_theorem_does_not_know_the_unit_of_stress(case, unit):
    constants, theta = case
    here, there = (evaluate(REPAIRED, Constants(**c), theta) for c in (constants, in_unit(constants, unit)))
    for name in ["C0", "C1", "C6", "interval", "factor", "one_minus_factor", "verdict"]:
        assert getattr(here, name) == getattr(there, name)
    for name in THRESHOLDS:
        assert getattr(there, name).value == pytest.approx(getattr(here, name).value * float(unit), rel=1e-15)


@given(strategies.constants(m=strategies.log_uniform(-6, -0.01)), st.integers(-6, -1).map(lambda j: F(10) ** j))
def test_the_printed_theorem_allows_more_friction_in_a_larger_unit_of_stress(constants, unit):
    here, there = (evaluate(PRINTED, Constants(**c)) for c in (constants, in_unit(constants, unit)))
    for name in THRESHOLDS:
        assert getattr(there, name).value / float(unit) > getattr(here, name).value


def test_the_printed_verdict_changes_with_the_unit_of_stress():
    constants = {"m": F(1), "M": F(4, 3), "C_R": F(9, 8), "C_K": F(3, 10)}
    verdicts = {
        (edition.name, unit): evaluate(edition, Constants(**in_unit(constants, unit)), "2/5").verdict
        for edition in (PRINTED, REPAIRED)
        for unit in (1, F(1, 4))
    }
    assert verdicts.pop(("printed", F(1, 4))) == "contraction"
    assert set(verdicts.values()) == {"no conclusion"}


@given(strategies.theory_cases("repaired", m=st.just(F(1))))
def test_the_two_editions_agree_when_m_is_1(case):
    constants, theta = case
    first, second = (evaluate(edition, Constants(**constants), theta) for edition in (PRINTED, REPAIRED))
    assert replace(first, edition=REPAIRED) == second


@given(strategies.theory_cases("repaired", m=strategies.log_uniform(-12, -0.01)))
def test_the_printed_edition_claims_more_than_is_proved_where_m_is_below_1(case):
    constants, theta = case
    first, second = (evaluate(edition, Constants(**constants), theta) for edition in (PRINTED, REPAIRED))
    assert not first.proved
    assert all(getattr(first, name).value >= getattr(second, name).value for name in THRESHOLDS)
    assert first.verdict == "contraction" or second.verdict == "no conclusion"
    assert second.factor is None or first.factor.value <= second.factor.value


@given(strategies.theory_cases("printed", m=strategies.log_uniform(0, 12)))
def test_the_printed_edition_follows_from_the_repaired_one_where_m_is_at_least_1(case):
    constants, theta = case
    first, second = (evaluate(edition, Constants(**constants), theta) for edition in (PRINTED, REPAIRED))
    assert first.proved
    assert all(getattr(first, name).value <= getattr(second, name).value for name in THRESHOLDS)
    assert first.verdict == "no conclusion" or second.verdict == "contraction"
    assert first.factor is None or first.factor.value >= second.factor.value


@in_both_editions
@given(data=st.data())
def test_the_thresholds_are_ordered_C3_C4_C2(edition, data):
    found = evaluate(edition, Constants(**data.draw(strategies.constants())))
    assert 0 < found.C3.value < found.C4.value <= found.C2.value == found.C5.value


@in_both_editions
@given(body=strategies.bodies(), fraction=strategies.thetas())
def test_without_friction_every_theta_between_0_and_C1_contracts(edition, body, fraction):
    """Remark 5.10."""
    constants = {**body, "C_K": F(0)}
    C1 = oracle.EDITIONS[edition.name](**constants).C1
    found = evaluate(edition, Constants(**constants), oracle.rational(C1, 50) * fraction)
    assert found.verdict == "contraction"
    assert found.interval == (0, found.C1.value)
    assert found.interval[0] < found.interval[1]
    assert found.C6 is None


@in_both_editions
@given(data=st.data(), C_s=strategies.log_uniform(-9, 9), C_tr=strategies.log_uniform(-9, 9))
def test_thresholds_on_k_are_thresholds_on_C_K_over_C_s_C_tr(edition, data, C_s, C_tr):
    constants, theta = data.draw(strategies.theory_cases(edition.name))
    C_K = constants.pop("C_K")
    on_C_K = evaluate(edition, Constants(**constants, C_K=C_K), theta)
    on_k = evaluate(edition, Constants(**constants, C_s=C_s, C_tr=C_tr, k=C_K / (C_s * C_tr)), theta)
    assert (on_C_K.threshold_on, on_k.threshold_on) == ("C_K", "k")
    for name in THRESHOLDS:
        assert getattr(on_k, name).value * float(C_s * C_tr) == pytest.approx(getattr(on_C_K, name).value, rel=1e-15)
    unmoved = {name: getattr(on_C_K, name) for name in (*THRESHOLDS, "threshold_on")}
    assert replace(on_k, **unmoved) == on_C_K


@in_both_editions
@pytest.mark.parametrize(("C_s", "C_tr"), [(0, 1), (1, 0)])
def test_a_body_whose_contact_stress_or_trace_vanishes_bears_any_friction(edition, C_s, C_tr):
    found = evaluate(edition, Constants(m=1, M=2, C_R=1, C_s=C_s, C_tr=C_tr, k=1000), "1/10")
    assert found.verdict == "contraction"
    assert [getattr(found, name) for name in THRESHOLDS] == [None] * 4


# --- the comparison is alive ---------------------------------------------------------------------------------------

#: Each edition contracts here by h1 and by h2 (C0 = 8/17), without a lower end and with one; m below and above 1.
WITNESSES = [
    ({"m": F(1, 4), "M": F(1, 3), "C_R": F(9, 8), "C_K": C_K}, theta)
    for C_K in (F(1, 100), F(1, 20), F(1, 10))
    for theta in (F(1, 4), F(2, 5), F(19, 40))
] + [({"m": F(4), "M": F(9, 2), "C_R": F(9, 8), "C_K": F(3, 400)}, F(1, 100))]


def scaled(name):
    """A formula made a tenth smaller."""
    formula = getattr(bounds, name)
    return lambda *arguments: Decimal("0.9") * formula(*arguments)


def Q_with_C_T(x, m, M, C_R):
    """h1 as printed, with C_T where C~_T is meant: they differ at the last witness, where m = 4 and m~ = 1."""
    return (bounds.lipschitz(4 if m == 1 else m, M, C_R, x) * M / m) ** 2


FORMULAS = ["lipschitz", "C0", "G", "inverse_G", "P", "D", "Q", "C1", "C6", "one_minus_h1", "one_minus_h2"]

#: name: (edition, formula replaced or None, its replacement)
MUTANTS = {
    "(5.30) without its 1/m": (replace(REPAIRED, unit=lambda m: m / m), None, None),
    "(5.30) with its 1/m": (replace(PRINTED, unit=lambda m: m), None, None),
    "m for m~": (replace(PRINTED, coercivity=lambda m: m), None, None),
    "m~ for m": (replace(REPAIRED, coercivity=lambda m: min(m, m / m)), None, None),
    "C_R for C_R^2 in C0": (REPAIRED, "C0", lambda m, M, C_R: 2 * m**2 / (M**2 * C_R + 2 * m**2)),
    "C_T for C~_T in h1": (PRINTED, "Q", Q_with_C_T),
    "no square root in C_T": (REPAIRED, "lipschitz", lambda m, M, C_R, x: M * C_R / m**2 * (M * C_R + x)),
    "M for M C_R in C_T": (REPAIRED, "lipschitz", lambda m, M, C_R, x: M * C_R / m**2 * (M + x + (x * m).sqrt())),
    "no x^(3/2) in G": (REPAIRED, "G", lambda x, m, M, C_R, u: M**2 / u * x * (x + M * C_R + u)),
    "m^2 for m^3 in a'": (REPAIRED, "P", lambda *arguments: bounds.G(*arguments) / arguments[1] ** 2),
    "(5.23) with sqrt(M)": (REPAIRED, "Q", lambda x, m, M, C_R: bounds.lipschitz(m, M, C_R, x) ** 2 * M / m),
    "no lower end C6": (REPAIRED, "C6", lambda P: Decimal(0)),
    "h1 left out": (REPAIRED, "one_minus_h1", lambda theta, D, Q: Decimal(1)),
    "h2 left out": (REPAIRED, "one_minus_h2", lambda theta, P: Decimal(1)),
    **{f"0.9 {name}": (REPAIRED, name, scaled(name)) for name in FORMULAS},
}


@in_both_editions
def test_the_theorem_passes_on_every_witness(edition):
    assert [differences(edition, *witness) for witness in WITNESSES] == [[]] * len(WITNESSES)


@pytest.mark.parametrize(("edition", "name", "formula"), MUTANTS.values(), ids=MUTANTS)
def test_no_mutated_formula_survives_the_comparison(monkeypatch, edition, name, formula):
    if name is not None:
        monkeypatch.setattr(bounds, name, formula)
    assert any(differences(edition, *witness) for witness in WITNESSES)

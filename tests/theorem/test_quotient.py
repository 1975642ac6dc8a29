"""Rational expressions as products of powers: the same function, and no sign that some value contradicts."""

import pytest
import sympy as sp
from hypothesis import assume, example, given
from hypothesis import strategies as st

from ndtheory.symbolic.engine import nonnegative, positive
from ndtheory.symbolic.quotient import NotRational, Quotient, sign

x = positive("x")
p, q = nonnegative("p q")
real = sp.Symbol("t", real=True)

LEAVES = st.sampled_from([x, p, real, sp.Integer(0), sp.Integer(1), sp.Integer(-2), sp.Rational(2, 3)])
TREES = st.recursive(
    LEAVES,
    lambda tree: st.one_of(
        st.builds(sp.Add, tree, tree), st.builds(sp.Mul, tree, tree), st.builds(sp.Pow, tree, st.integers(-3, 3))
    ),
    max_leaves=12,
)
VALUES = st.fractions("1/10", 10, max_denominator=10).map(sp.Rational)


def read(tree):
    try:
        return Quotient.of(tree)
    except NotRational:
        return None


def of_factors(quotient, at):
    """The product of the factors at a point; None where one of them divides by 0."""
    value = lambda polynomial: polynomial.as_expr().subs(at)
    if any(power < 0 and value(base) == 0 for base, power in quotient.powers.items()):
        return None
    return sp.prod([value(base) ** power for base, power in quotient.powers.items()], start=value(quotient.polynomial))


@given(TREES, VALUES, VALUES, VALUES)
@example((1 + 1 / (1 + x)) ** 2, sp.Integer(1), sp.Integer(1), sp.Integer(1))  # a power of a quotient with a factor
@example((x / (1 + p) + 1) / (1 + p), sp.Integer(1), sp.Integer(1), sp.Integer(1))  # a product with a factor in common
def test_a_quotient_and_its_cancelled_form_have_the_values_of_the_expression(tree, at_x, at_p, at_t):
    at = {x: at_x, p: at_p, real: -at_t}
    quotient = read(tree)
    assume(quotient is not None)
    expected = tree.subs(at)
    assume(expected.is_finite)
    assert of_factors(quotient, at) in (expected, None)
    assert of_factors(quotient.cancelled(), at) in (expected, None)
    assert (quotient.polynomial == 0) == (sp.cancel(sp.together(tree)) == 0)


@given(TREES, VALUES, st.one_of(VALUES, st.just(sp.Integer(0))), VALUES, st.booleans())
def test_no_sign_is_certified_that_a_value_contradicts(tree, at_x, at_p, at_t, strict):
    quotient = read(tree)
    assume(quotient is not None)
    expected = tree.subs({x: at_x, p: at_p, real: -at_t})
    for form in (quotient, quotient.cancelled()):
        if form.is_certified(strict=strict) and expected.is_finite:
            assert expected > 0 or (expected == 0 and not strict)


@pytest.mark.parametrize(
    ("expression", "weak", "strict"),
    [
        (x / (1 + p), True, True),
        (p / (1 + x), True, False),
        (x + p, True, True),
        (-x / (-1 - p), True, True),
        (-x / (1 + p), False, False),
        (x / (-1 - p), False, False),
        (x / (-1 - p) ** 2, True, True),
        (x / (-1 - p) ** 3, False, False),
        (1 / p, False, False),  # p = 0 is no value
        (1 / (p + q), False, False),
        ((x - p) ** 2, False, False),  # a square must be named
        (real * x, False, False),
        (x - x * (1 + p) / (1 + p), True, False),
        (sp.Integer(0), True, False),
        (sp.Rational(1, 3), True, True),
    ],
)
def test_what_the_factors_show(expression, weak, strict):
    quotient = Quotient.of(expression)
    assert quotient.is_certified(strict=False) == weak
    assert quotient.is_certified(strict=True) == strict


def test_a_common_factor_of_unknown_sign_shows_nothing_until_it_is_cancelled():
    quotient = Quotient.of((x**3 + p**3) / (x**2 - x * p + p**2))
    assert not quotient.is_certified(strict=True)
    assert quotient.cancelled().is_certified(strict=True)


def test_the_sign_of_a_polynomial_is_that_of_all_its_coefficients():
    of = lambda expression, nonzero: sign(Quotient.of(expression).polynomial, nonzero=nonzero)
    assert [of(x + p + 1, nonzero) for nonzero in (False, True)] == [1, 1]
    assert [of(-p - q, nonzero) for nonzero in (False, True)] == [-1, 0]
    assert [of(x - p, nonzero) for nonzero in (False, True)] == [0, 0]
    assert [of(sp.Integer(0), nonzero) for nonzero in (False, True)] == [1, 0]


def test_common_factors_of_a_sum_are_not_expanded():
    quotient = Quotient.of(x / (1 + p) ** 9 + 1 / (1 + p) ** 10)
    assert [(base.as_expr(), power) for base, power in quotient.powers.items()] == [(1 + p, -10)]
    assert quotient.polynomial.as_expr() == sp.expand(x * (1 + p) + 1)


@pytest.mark.parametrize(
    "expression",
    [sp.sqrt(x), sp.sqrt(2) * x, sp.Min(x, p), sp.Float(0.5) * x, 1 / ((x + 1) ** 2 - x**2 - 2 * x - 1), sp.pi, sp.zoo],
)
def test_what_is_no_quotient_of_polynomials_is_refused(expression):
    with pytest.raises(NotRational):
        Quotient.of(expression)

"""Sums, products and forms of enclosures hold the exact ones, also where rounding is as bad as it can be."""

import random
from fractions import Fraction

import numpy as np
import pytest

from fem1d2d.proofs.enclosed import LARGEST, SMALLEST, UNIT, Enclosed, gamma, nearest, total, upwards

F = np.vectorize(Fraction, otypes=[object])

#: 1, and then numbers that vanish beside it: a sum that adds them to 1 one by one loses them all.
LOST = np.concatenate([[1.0], np.full(4095, 0.99 * UNIT)])


def inside(found: Enclosed, exact) -> bool:
    """True if every entry of an exact matrix lies within the radius."""
    return bool((abs(F(found.middle) - exact) <= F(found.radius)).all())


def test_gamma_is_n_u_over_1_minus_n_u_rounded_upwards():
    u = Fraction(UNIT)
    for n in [*range(1, 3000), *(2**i + j for i in range(12, 30) for j in (-1, 0, 1))]:
        assert n * u / (1 - n * u) <= Fraction(gamma(n)) < n * u / (1 - n * u) * (1 + Fraction(1, 10**14))


def test_upwards_is_not_below_a_sum_whose_terms_are_lost_or_underflow():
    exact = sum(map(Fraction, LOST))
    lost = 1.0
    for term in LOST[1:]:
        lost += term
    assert lost == 1.0 < exact
    assert Fraction(upwards(lost, len(LOST))) >= exact
    assert upwards(1e-200 * 1e-200, 1) >= Fraction(10) ** -400


def test_row_sums_are_not_below_the_exact_ones():
    matrix = np.vstack([LOST, LOST[::-1]])
    for found, row in zip(total(matrix), matrix, strict=True):
        assert Fraction(float(found)) >= sum(map(Fraction, row))


def test_rationals_lie_within_the_radius_and_doubles_have_none():
    exact = np.array([[Fraction(1, 3), Fraction(1, 4)]])
    found = Enclosed.rounded(exact)
    assert inside(found, exact)
    assert found.radius[0, 0] > 0 == found.radius[0, 1]


@pytest.mark.parametrize("entry", [LARGEST * 2, SMALLEST / 2])
def test_entries_and_multipliers_of_extraordinary_size_are_refused(entry):
    with pytest.raises(ValueError, match="ordinary size"):
        nearest(np.array([[Fraction(entry)]]))
    one = Enclosed.exactly(np.eye(1))
    with pytest.raises(ValueError, match="ordinary size"):
        one.plus(entry, one)


def test_doubles_are_no_rationals():
    with pytest.raises(TypeError, match="rationals"):
        nearest(np.array([[0.1]]))


def test_a_combination_holds_that_of_any_two_members():
    drawn = random.Random(2008)
    number = lambda: drawn.choice([1.0, -1.0]) * drawn.uniform(1, 2) * 2.0 ** drawn.randint(-3, 3)
    for _ in range(1500):
        factor, times = number(), number()
        a, b = np.array([[number()]]), np.array([[number()]])
        found = Enclosed.exactly(a).plus(times, Enclosed.exactly(b), factor)
        assert inside(found, Fraction(factor) * F(a) + Fraction(times) * F(b))
        r, s = np.array([[abs(number())]]), np.array([[abs(number())]])
        found = Enclosed(middle=0 * a, radius=r).plus(times, Enclosed(middle=0 * b, radius=s), factor)
        assert inside(found, abs(Fraction(factor)) * F(r) + abs(Fraction(times)) * F(s))


def test_a_combination_that_cancels_keeps_the_errors_of_its_parts():
    a, b = np.array([[1.0 + 2.0**-30]]), np.array([[1.0]])
    third = 1 / 3
    found = Enclosed.exactly(a).plus(-third, Enclosed.exactly(b), third)
    assert inside(found, Fraction(third) * (F(a) - F(b)))
    sizes = 4 * Fraction(UNIT) * Fraction(third) * (F(a) + F(b))[0, 0]
    assert Fraction(found.radius[0, 0]) >= sizes


def test_a_product_holds_that_of_any_two_members_and_what_its_sums_lose():
    ones = np.ones((len(LOST), 1))
    for row in (LOST, LOST[::-1], np.roll(LOST, 7)):
        found = Enclosed.exactly(row[None, :]).times(Enclosed.exactly(ones))
        assert inside(found, np.array([[sum(map(Fraction, row))]]))
    drawn = np.random.default_rng(2008)
    for _ in range(500):
        A, B, r, s = (drawn.uniform(0.1, 1, (2, 2)) for _ in range(4))
        both = Enclosed(middle=A, radius=r).times(Enclosed(middle=B, radius=s))
        assert inside(both, (F(A) + F(r)) @ (F(B) + F(s)))
        radii = Enclosed(middle=0 * A, radius=r).times(Enclosed(middle=0 * B, radius=s))
        assert inside(radii, F(r) @ F(s))


def test_a_form_holds_that_of_any_member_and_what_its_sums_lose():
    lost = LOST[:400]
    exact, x = sum(map(Fraction, lost)), np.ones(len(lost))
    for row in (lost, np.roll(lost, 5)):
        matrix = np.zeros((len(lost), len(lost)))
        matrix[0] = row
        low, high = Enclosed.exactly(matrix).form(x)
        assert Fraction(low) <= exact <= Fraction(high)
    drawn = np.random.default_rng(2008)
    for _ in range(200):
        A, r, v = drawn.uniform(-1, 1, (3, 3)), drawn.uniform(0, 1, (3, 3)), drawn.uniform(-1, 1, 3)
        low, high = Enclosed(middle=A, radius=r).form(v)
        middle, most = F(v) @ F(A) @ F(v), abs(F(v)) @ F(r) @ abs(F(v))
        assert Fraction(low) <= middle - most
        assert middle + most <= Fraction(high)

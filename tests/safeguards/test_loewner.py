"""Bounds of Schur complements lie on their side of the exact ones, in rationals, whoever made the factors."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp

from fem1d2d.proofs.enclosed import UNIT, Enclosed
from fem1d2d.proofs.loewner import Elimination, positive_definite

F = np.vectorize(Fraction, otypes=[object])
LAST = np.array([-1])


class Told(Elimination):
    """An elimination whose factors are made up."""

    def __init__(self, matrix, interface, L, pivots, errors):
        super().__init__(matrix, interface, errors=errors)
        self.told = L, pivots, None

    def factors(self, shift):
        return self.told


def schur(A):
    """The Schur complement on the last unknown, by elimination; None where what is eliminated is not definite."""
    A = A.copy()
    for i in range(len(A) - 1):
        if not A[i, i] > 0:
            return None
        for j in range(i + 1, len(A)):
            A[j] -= A[j, i] / A[i, i] * A[i]
    return A[-1, -1]


def holds(side, bound, exact) -> bool:
    return bool(Fraction(bound) <= exact if side == 1 else Fraction(bound) >= exact)


# --- factors that are wrong -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [1, -1])
def test_factors_that_are_wrong_prove_nothing_false(side):
    drawn, proved, definite = np.random.default_rng(27), 0, 0
    for _ in range(500):
        L = np.vstack([np.tril(drawn.uniform(-1, 1, (2, 2)), -1) + np.eye(2), drawn.uniform(-1, 1, (1, 2))])
        pivots = drawn.uniform(0.5, 3, 2)
        off = drawn.uniform(-0.3, 0.3, (3, 3))
        A = L @ np.diag(pivots) @ L.T + side * np.diag([*drawn.uniform(-0.2, 0.8, 2), 1.0]) + off + off.T
        A = np.tril(A) + np.tril(A, -1).T
        exact = schur(F(A))
        found = Told(Enclosed.exactly(A), np.array([2]), L, pivots, np.zeros(3)).bound(side)
        if found is not None and side == -1 and exact is None:
            continue  # an upper bound takes for granted that the block inside is definite
        if found is not None:
            assert exact is not None
            assert holds(side, found[0, 0], exact)
            proved += 1
        definite += exact is not None
    assert 10 < proved < definite


def test_a_matrix_with_a_negative_pivot_is_not_definite():
    for pivots in ([1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]):
        assert not positive_definite(Enclosed.exactly(sp.csc_array(np.diag(pivots))))
        matrix = Enclosed.exactly(sp.csc_array(np.diag([*pivots, 1.0])))
        assert Elimination(matrix, np.array([2])).bound(1) is None
    assert positive_definite(Enclosed.exactly(sp.csc_array(np.eye(2))))
    assert not positive_definite(Enclosed.exactly(sp.csc_array(np.array([[0.0, 1], [1, 0]]))))


@pytest.mark.parametrize("entry", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_has_no_bound(entry):
    alone = Enclosed(middle=np.array([[entry]]), radius=np.zeros((1, 1)))
    with np.errstate(invalid="ignore"):
        assert Elimination(alone, np.array([0])).bound(1) is None
    assert not positive_definite(alone)
    both = Enclosed(middle=np.array([[2.0, entry], [entry, 2.0]]), radius=np.zeros((2, 2)))
    assert not positive_definite(both)


# --- rounding ---------------------------------------------------------------------------------------------------------


def arrow(b, corner):
    """The identity, and a last row and column."""
    n = len(b)
    b = sp.csr_array(b[None, :])
    return sp.block_array([[sp.eye_array(n), b.T], [b, sp.csr_array([[corner]])]], format="csc")


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize(("share", "side"), [(0.99, 1), (1.01, -1)])
def test_a_sum_that_loses_or_gains_half_a_place_a_term_stays_within_the_bound(share, side, turn):
    """``c - 1 - sum b_j^2``: each square added to 1 is lost, or counts twice."""
    b = np.concatenate([[1.0], np.full(3000, np.sqrt(share * UNIT))])[::turn]  # sums run either way
    order = np.arange(len(b) + 1)
    exact_sum = sum(Fraction(value) ** 2 for value in b)
    for corner in (1.0, 2.0, float(exact_sum), 1e3):
        found = Elimination(Enclosed.exactly(arrow(b, corner)), LAST + len(b) + 1, order).bound(side)
        assert found is not None
        assert holds(side, found[0, 0], Fraction(corner) - exact_sum)


def test_an_arrow_whose_last_pivot_is_lost_in_a_sum_is_not_called_definite():
    b = np.concatenate([[1.0], np.full(3000, np.sqrt(0.99 * UNIT))])
    exact, order, said = sum(Fraction(value) ** 2 for value in b), np.arange(len(b) + 1), set()
    for excess in [*np.linspace(-2, 2, 21) * 3000 * UNIT, 1e-6]:
        found = positive_definite(Enclosed.exactly(arrow(b, 1 + excess)), order)
        assert Fraction(1 + excess) > exact or not found
        said.add(found)
    assert said == {True, False}


@pytest.mark.parametrize("side", [1, -1])
def test_the_rounding_of_what_is_left_on_the_interface_counts(side):
    """Beside a corner of 1 the square that is taken off is too small to matter in the factors' own bound."""
    drawn = np.random.default_rng(3)
    for size in (1e-12, 1e-9, 1e-4, 1.0):
        for _ in range(40):
            a, c = drawn.uniform(1, 2, 2)
            A = np.array([[a, b := size * drawn.uniform(0.5, 1)], [b, c]])
            found = Elimination(Enclosed.exactly(A), np.array([1])).bound(side)
            assert holds(side, found[0, 0], schur(F(A)))
            assert abs(found[0, 0] - (c - b * b / a)) < 1e-13


# --- a radius ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("inside", [0, 1, 2])
def test_a_bound_holds_for_every_matrix_within_the_radius(inside, side):
    drawn = np.random.default_rng(inside)
    for _ in range(10):
        A = np.eye(inside + 1) * 2 + (noise := drawn.uniform(-0.3, 0.3, (inside + 1,) * 2)) + noise.T
        A = np.tril(A) + np.tril(A, -1).T
        R = (r := drawn.uniform(0, 0.05, A.shape)) + r.T
        R = np.tril(R) + np.tril(R, -1).T
        found = Elimination(Enclosed(middle=A, radius=R), np.array([inside])).bound(side)
        assert found is not None
        lower = np.tril_indices(inside + 1)
        for signs in product((1, -1), repeat=len(lower[0])):
            member = F(A)
            for i, j, sign in zip(*lower, signs, strict=True):
                member[i, j] += sign * Fraction(R[i, j])
                member[j, i] = member[i, j]
            assert holds(side, found[0, 0], schur(member))


def definite(A) -> bool:
    return schur(A) is not None and bool(schur(A) > 0)


def test_only_what_is_definite_within_the_whole_radius_is_called_so():
    """Two by two of doubles, from far inside to far outside the threshold ``r = 1``."""
    said = set()
    for share in [0.0, 0.5, *(1 + n * UNIT for n in (-40, -8, -4, -2, 0, 2, 4, 8)), 1.5]:
        for size in (1.0, 3.0, 1e-3, 7e9):
            A = np.array([[2.0, size], [size, size**2]])
            radius = np.array([[share * (1 - UNIT), 0.0], [0.0, 0.0]])
            found = positive_definite(Enclosed(middle=A, radius=radius))
            worst = F(A) - F(radius)
            assert definite(worst) or not found
            said.add((share < 0.9, found))
    assert said == {(True, True), (False, False)}


@pytest.mark.parametrize("side", [1, -1])
def test_an_interface_of_two_has_a_matrix_below_or_above_each_within_the_radius(side):
    drawn = np.random.default_rng(9)
    for inside in (0, 1):
        for _ in range(6):
            A = 3 * np.eye(2 + inside) + (noise := drawn.uniform(-0.5, 0.5, (2 + inside,) * 2)) + noise.T
            A = np.tril(A) + np.tril(A, -1).T
            R = np.full(A.shape, 0.03)
            at = np.arange(inside, inside + 2)
            found = Elimination(Enclosed(middle=A, radius=R), at).bound(side)
            for signs in product((1, -1), repeat=2 + inside):
                for all_ in (1, -1):
                    member = F(A) + all_ * np.outer(signs, signs) * Fraction(0.03)
                    left = member
                    if inside:
                        left = member[1:, 1:] - np.outer(member[1:, 0], member[0, 1:]) / member[0, 0]
                    apart = side * (left - F(found))
                    assert apart[0, 0] >= 0
                    assert apart[0, 0] * apart[1, 1] >= apart[0, 1] ** 2


@pytest.mark.parametrize("side", [1, -1])
def test_the_rounding_of_large_entries_beside_a_small_diagonal_counts(side):
    """What is taken off 1000 is less than its last place, and more than that of the diagonal."""
    drawn, at = np.random.default_rng(5), np.arange(1, 3)
    for _ in range(12):
        b = drawn.uniform(1e-7, 4e-7, 2) * drawn.choice([-1, 1], 2)
        beside = 1000 + drawn.uniform()
        A = np.array([[1.0, *b], [b[0], 1.0, beside], [b[1], beside, 1.0]])
        found = Elimination(Enclosed.exactly(A), at).bound(side)
        apart = side * (F(A[1:, 1:]) - np.outer(F(b), F(b)) - F(found))
        assert apart[0, 0] >= 0
        assert apart[0, 0] * apart[1, 1] >= apart[0, 1] ** 2

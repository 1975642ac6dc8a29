"""Schur complements and positive definiteness, proved in doubles: bounds in the order of symmetric matrices.

X is at most Y where ``v' X v <= v' Y v`` for every v.  The proofs here use a factorisation in doubles, but need not
trust the program that made it.  With its triangular part L, the pivots d > 0 of the unknowns I inside, and any
symmetric matrix s on the interface B,

    M = L diag(d) L' + [0 0; 0 s]

has the Schur complement s on B, exactly.  The difference A - M is computed, and its rounding errors are bounded; where
it is diagonally dominant with a diagonal >= 0, M is at most A, and so is s at most the Schur complement of A, the least
energy over I.  Where M - A is dominant, s is at least that Schur complement.  What makes the difference dominant is a
shift of the diagonal by about twice the bound of the rounding errors: the matrix that is factorised is A with its
diagonal a little smaller (for a lower bound) or larger (for an upper one).  Without an interface the lower bound says
that A is positive definite.

The errors of a product of the factors are bounded by ``gamma |L| diag(d) |L'|``, and the residual itself is evaluated.
(Rump, Verification of positive definiteness, BIT 46, 2006, has an a priori bound from the trace, which is larger by the
number of unknowns over the width of the rows.)  A row of L with r entries needs only ``gamma(r)``, and most are short.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from scipy.linalg import LinAlgError, cholesky, solve_triangular
from scipy.sparse.linalg import splu

from fem1d2d.condense import SYMMETRIC, elimination_order
from fem1d2d.mesh import Floats, Ints
from fem1d2d.proofs.enclosed import TINY, UNIT, Enclosed, Matrix, diagonal, gamma, total, upwards

#: +1: a bound from below, -1: one from above.
Side = Literal[1, -1]

#: The shift is SHIFT times the bound of the rounding errors; if that does not suffice, MORE times as much, and so on.
SHIFT, MORE, TRIES = 2.0, 8.0, 3

#: What is added to the row sums of the radius in the shift, relatively, so that their own rounding does not count.
SLACK = 2.0**-30


class Elimination:
    """A symmetric matrix, known up to a radius, whose unknowns inside are eliminated.

    Parameters
    ----------
    matrix : Enclosed
        Its middle is symmetric; the proofs hold for every symmetric matrix within the radius.
    interface : int array, optional
        Positions of B, in the order wanted; none if left out.
    order : int array, optional
        An order of elimination that ends with the interface, for a sparse matrix.
    errors : array, shape (n,), optional
        The :attr:`errors` of a nearly equal matrix, to save their computation.
    """

    def __init__(
        self,
        matrix: Enclosed,
        interface: Ints | None = None,
        order: Ints | None = None,
        *,
        errors: Floats | None = None,
    ) -> None:
        self.matrix = matrix
        if errors is not None:
            self.errors = errors
        self.interface: Ints = np.empty(0, dtype=np.int64) if interface is None else interface
        n = matrix.middle.shape[0]
        self.inside: Ints = np.delete(np.arange(n), self.interface)
        self._order = order

    @cached_property
    def order(self) -> Ints:
        """The order of elimination."""
        if not self._sparse:
            return np.concatenate([self.inside, self.interface])
        if self._order is not None:
            return self._order
        # the pattern alone counts, and a dominant diagonal keeps the search from a pivot of 0
        middle = self.matrix.middle
        return elimination_order((middle + diagonal(total(abs(middle)), middle)).tocsc(), self.interface)

    @property
    def _sparse(self) -> bool:
        return not isinstance(self.matrix.middle, np.ndarray)

    def factors(self, shift: Floats) -> tuple[Matrix, Floats, Any] | None:
        """L with a column for each unknown inside, its pivots, and a solver; None unless all pivots are positive.

        ``shift``, shape (n,), is added to the diagonal.  On the interface it changes no result, and avoids pivots of 0.
        """
        shifted = self.matrix.middle + diagonal(shift, self.matrix.middle)
        if self._sparse:
            return self._sparse_factors(shifted.tocsc())
        try:
            corner = cholesky(shifted[np.ix_(self.inside, self.inside)], lower=True)
        except (LinAlgError, ValueError):  # not positive definite, not finite
            return None
        L = np.empty((len(shifted), len(self.inside)))
        L[self.inside] = corner
        if len(self.interface):
            coupling = shifted[np.ix_(self.inside, self.interface)]
            L[self.interface] = solve_triangular(corner, coupling, lower=True).T
        pivots = np.ones(len(self.inside))
        solve = lambda r: solve_triangular(corner, solve_triangular(corner, r, lower=True), lower=True, trans=1)
        return L, pivots, solve

    def _sparse_factors(self, shifted: Any) -> tuple[Matrix, Floats, Any] | None:
        order = self.order
        try:
            factor = splu(shifted[:, order][order].tocsc(), permc_spec="NATURAL", **SYMMETRIC)
        except RuntimeError:  # exactly singular
            return None
        L, place = factor.L.tocsc(), factor.perm_r
        row = np.repeat(np.arange(L.shape[1]), np.diff(L.indptr))
        triangular = (L.indices >= row).all() and (L.diagonal() == 1).all()
        columns = np.sort(place[: len(self.inside)])
        pivots = factor.U.diagonal()[columns]
        if not (
            triangular and np.array_equal(place, factor.perm_c) and (pivots > 0).all() and np.isfinite(L.data).all()
        ):
            return None
        rows = np.empty_like(order)
        rows[order] = place

        def solve(right: Floats) -> Floats:
            result = np.empty_like(right)
            result[order] = factor.solve(right[order])
            return result

        return L[:, columns].tocsr()[rows], pivots, solve

    @cached_property
    def plain(self) -> tuple[Matrix, Floats, Any] | None:
        """The factors of the matrix itself; the solver is correct only without an interface."""
        return self.factors(self._lifted(np.zeros(self.matrix.middle.shape[0])))

    @cached_property
    def errors(self) -> Floats:
        """The bound of the rounding errors in each row, for the factors of the matrix itself, shape (n,).

        A shifted matrix has nearly the same.  Infinite without factors.
        """
        if self.plain is None:
            return np.full(self.matrix.middle.shape[0], np.inf)
        return self._errors(*self.plain[:2])

    @cached_property
    def radius(self) -> Floats:
        """Row sums of the radius, shape (n,)."""
        return total(self.matrix.radius)

    def shift(self, factor: float = SHIFT) -> Floats:
        """The shift of the diagonal: the row sums of the radius, and a multiple of the errors, shape (n,)."""
        return np.asarray((1 + SLACK) * self.radius + factor * self.errors)

    def _lifted(self, shift: Floats) -> Floats:
        """The shift, with an amount on the interface that keeps the matrix from being singular."""
        shift = shift.copy()
        shift[self.interface] = np.abs(self.matrix.middle.diagonal()).max(initial=0.0)
        return shift

    def _errors(self, L: Matrix, pivots: Floats) -> Floats:
        """Bounds of the row sums of the rounding errors in ``L diag(d) L'``, shape (n,)."""
        sizes, n = abs(L), L.shape[0]
        terms = L.shape[1] if isinstance(L, np.ndarray) else np.diff(L.indptr)
        columns = upwards(sizes.T @ np.ones(n), n)
        products = upwards(sizes @ (pivots * columns), terms + 2)
        return np.asarray(upwards(gamma(terms + 3) * products + n * TINY, 4))

    def bound(self, side: Side) -> Floats | None:
        """A matrix of doubles that is at most (+1) or at least (-1) the Schur complement on B, or None.

        Shape (b, b), symmetric.  A bound from below proves that the block of the unknowns inside is positive definite;
        one from above assumes it.
        """
        if not len(self.inside):
            nothing = np.zeros(len(self.interface))
            block = self.matrix.block(self.interface, self.interface)
            return _remainder(block.middle, nothing, total(block.radius), side)
        if not np.isfinite(self.errors).all():
            return None
        for i in range(TRIES):
            factors = self.factors(self._lifted(-side * self.shift(SHIFT * MORE**i)))
            if factors is not None:
                if (found := self._decided(*factors[:2], side)) is not None:
                    return found
            elif side == 1:  # nor is it positive definite with more taken off
                break
        return None

    def _decided(self, L: Matrix, pivots: Floats, side: Side) -> Floats | None:
        """The bound from the factors of a shifted matrix; None where their residual is not dominant."""
        scaled = L * pivots if isinstance(L, np.ndarray) else L @ sp.diags_array(pivots)
        residual = self.matrix.middle - scaled @ L.T
        errors = upwards(self._errors(L, pivots) + self.radius, 2)
        own = np.asarray(residual.diagonal())
        beside = upwards(np.maximum(total(abs(residual)) - np.abs(own), 0.0) + errors, 8)
        # written so that NaN fails
        if not (side * own * (1 - 8 * UNIT) >= beside)[self.inside].all():
            return None
        b = self.interface
        rest = total(abs(residual[b][:, self.inside]))
        return _remainder(residual[b][:, b], rest, errors[b], side)


def _remainder(block: Matrix, rest: Floats, errors: Floats, side: Side) -> Floats | None:
    """The symmetric part of a block, its diagonal moved by all possible errors of its rows; None if not finite.

    Each entry of the block was rounded once, when it was subtracted; ``rest`` has row sums of the entries beside it.
    """
    dense = block if isinstance(block, np.ndarray) else block.toarray()
    symmetric = np.tril(dense) + np.tril(dense, -1).T
    wrong = total(np.abs(dense - symmetric)) + total(np.abs(dense)) * 2 * UNIT + rest + errors
    moved = np.diag(symmetric) - side * upwards(wrong, 8)
    np.fill_diagonal(symmetric, np.nextafter(moved, -side * np.inf))
    symmetric.setflags(write=False)
    return symmetric if np.isfinite(symmetric).all() else None


def positive_definite(matrix: Enclosed, order: Ints | None = None) -> bool:
    """True if every symmetric matrix within the radius is proved to be positive definite; False proves nothing.

    Rows and columns of a dense one are scaled first, so that large entries do not hide small ones.

    Examples
    --------
    >>> A = Enclosed(middle=np.array([[2.0, 1.0], [1.0, 2.0]]), radius=np.full((2, 2), 0.25))
    >>> positive_definite(A), positive_definite(A.plus(-1.0, Enclosed.exactly(np.eye(2))))
    (True, False)
    """
    middle = matrix.middle
    if isinstance(middle, np.ndarray):
        own = np.diag(middle)
        if not (np.isfinite(middle).all() and (own > 0).all()):
            return False
        scale = 2.0 ** -np.round(np.log2(own) / 2)  # powers of two: rounding does not enter
        both = np.outer(scale, scale)
        matrix = Enclosed(middle=middle * both, radius=matrix.radius * both)
    return Elimination(matrix, order=order).bound(1) is not None

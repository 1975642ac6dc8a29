"""Matrices known up to an entrywise radius, and arithmetic in doubles that bounds its own rounding errors.

Every bound rests on the standard model: an operation on doubles returns the exact result times ``1 + d`` with
``|d| <= UNIT``, or is off by less than ``TINY`` where it underflows.  A sum of n products, in any order and with or
without fused operations, is then off by at most ``gamma(n)`` times the sum of the moduli (Higham, Accuracy and
Stability of Numerical Algorithms, Section 3.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem1d2d.mesh import Floats, Ints

#: Half the distance from 1 to the next double: the largest relative error of one rounding.
UNIT = float(np.finfo(float).eps) / 2

#: Far above the error of any number of operations that underflow, and far below numbers of ordinary size.
TINY = 2.0**-1000

#: Sizes between which entries and multipliers are taken, so that no product of two of them underflows or overflows.
SMALLEST, LARGEST = 2.0**-400, 2.0**400

#: A sparse array in columns, or a dense one.
Matrix = Any


def gamma(n: Any) -> Any:
    """``n u / (1 - n u)``, rounded upwards: bounds the relative error of n roundings; n may be an array."""
    return n * UNIT / (1 - n * UNIT) * (1 + 4 * UNIT)


def upwards(x: Any, n: Any) -> Any:
    """An upper bound of a sum of numbers >= 0 that n roundings made x; n may be an array."""
    return x * (1 + 2 * gamma(n + 2)) + TINY


@dataclass(frozen=True, kw_only=True, eq=False)
class Enclosed:
    """All matrices that differ from one by at most a radius, entry by entry.

    Attributes
    ----------
    middle, radius : arrays of one shape, both sparse or both dense
        The radius is >= 0.
    """

    middle: Matrix
    radius: Matrix

    @classmethod
    def exactly(cls, middle: Matrix) -> Enclosed:
        """One matrix of doubles."""
        return cls(middle=middle, radius=0.0 * middle)

    @classmethod
    def rounded(cls, exact: NDArray[Any]) -> Enclosed:
        """A dense matrix of rationals, each entry rounded by :func:`nearest`; doubles have radius 0."""
        middle = nearest(exact)
        return cls(middle=middle, radius=np.where(middle == exact, 0.0, UNIT * np.abs(middle)))

    def plus(self, times: float, other: Enclosed, factor: float = 1.0) -> Enclosed:
        """``factor self + times other``; ValueError if a multiplier lies beyond SMALLEST or LARGEST."""
        if not all(SMALLEST <= abs(a) <= LARGEST for a in (factor, times)):
            raise ValueError(f"multipliers {factor:g}, {times:g}: needed numbers of ordinary size")
        middle = factor * self.middle + times * other.middle
        size = abs(factor) * abs(self.middle) + abs(times) * abs(other.middle)
        radius = abs(factor) * self.radius + abs(times) * other.radius + 4 * UNIT * size
        return Enclosed(middle=middle, radius=(1 + 16 * UNIT) * radius)

    def block(self, rows: Ints, columns: Ints) -> Enclosed:
        """Some rows and columns."""
        return Enclosed(middle=self.middle[rows][:, columns], radius=self.radius[rows][:, columns])

    def times(self, other: Enclosed) -> Enclosed:
        """The product of dense matrices."""
        A, B, n = self.middle, other.middle, self.middle.shape[1]
        size = np.abs(A) @ np.abs(B)
        radius = np.abs(A) @ other.radius + self.radius @ (np.abs(B) + other.radius) + gamma(n + 1) * size
        return Enclosed(middle=A @ B, radius=upwards(radius, 2 * n + 4))

    @property
    def T(self) -> Enclosed:
        """The transpose."""
        return Enclosed(middle=self.middle.T, radius=self.radius.T)

    def symmetric(self) -> Enclosed:
        """The symmetric matrices among these dense ones, about a symmetric middle."""
        middle = np.tril(self.middle) + np.tril(self.middle, -1).T
        return Enclosed(middle=middle, radius=np.tril(self.radius) + np.tril(self.radius, -1).T)

    def form(self, x: Floats) -> tuple[float, float]:
        """An enclosure of ``x' X x`` for all these matrices and a vector of doubles.

        Examples
        --------
        >>> from fractions import Fraction
        >>> thirds = Enclosed.rounded(np.array([[Fraction(1, 3)]]))
        >>> low, high = thirds.form(np.array([3.0]))
        >>> low < 3 < high < low + 1e-14
        True
        """
        sizes = np.abs(x)
        terms = self.middle.shape[1] if isinstance(self.middle, np.ndarray) else np.diff(self.middle.tocsr().indptr)
        error = self.radius @ sizes + gamma(terms + 1) * (abs(self.middle) @ sizes)
        products = x * (self.middle @ x)
        n = len(x) + np.max(terms, initial=0)
        bound = upwards(float(sizes @ error) + 4 * UNIT * float(np.abs(products).sum()), 2 * n + 8)
        value = math.fsum(products)
        return math.nextafter(value - bound, -math.inf), math.nextafter(value + bound, math.inf)


def nearest(exact: NDArray[Any]) -> Floats:
    """The doubles nearest to rationals, each off by at most UNIT times its own size.

    Raises
    ------
    TypeError
        Entries that were computed in doubles.
    ValueError
        Entries beyond SMALLEST or LARGEST.
    """
    if exact.dtype.kind not in "iO" or any(isinstance(entry, float) for entry in exact.flat):
        raise TypeError("entries computed in doubles: needed rationals")
    middle: Floats = exact.astype(float)
    sizes = np.abs(middle)
    if not ((sizes <= LARGEST) & ((sizes >= SMALLEST) | (exact == 0))).all():
        raise ValueError("entries that are not of ordinary size")
    return middle


def total(matrix: Matrix) -> Floats:
    """Upper bounds of the row sums of a matrix with entries >= 0, dense or sparse."""
    terms = matrix.shape[1] if isinstance(matrix, np.ndarray) else np.diff(matrix.tocsr().indptr)
    return np.asarray(upwards(np.asarray(matrix.sum(axis=1)).ravel(), terms))


def diagonal(values: Floats, like: Matrix) -> Matrix:
    """A diagonal matrix, sparse or dense as another one is."""
    return np.diag(values) if isinstance(like, np.ndarray) else sp.diags_array(values, format="csc")

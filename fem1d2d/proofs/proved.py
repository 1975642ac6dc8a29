"""Largest eigenvalues of pencils between proved bounds.

``X <= r Y`` in the order of symmetric matrices bounds the largest eigenvalue of ``X x = value Y x`` by r, and a
Rayleigh quotient of any vector bounds it from below.  The first is a proof of positive definiteness
(:mod:`fem1d2d.proofs.loewner`), the second an evaluation with its rounding errors; the eigenvector and the value of a
solver only serve as guesses.
"""

from __future__ import annotations

import math

import numpy as np

from fem1d2d.mesh import Floats, Ints
from fem1d2d.pencil import largest
from fem1d2d.proofs.enclosed import LARGEST, SMALLEST, Enclosed
from fem1d2d.proofs.loewner import Elimination

#: X and Y of a pencil.
Pencil = tuple[Enclosed, Enclosed]

#: The vector comes from SOLVES solves with ``(1 + NEAR) value Y - X``.
NEAR, SOLVES = 1e-7, 6

#: The first bound that is tried exceeds the value by ABOVE times the effect of the errors, each later one by FARTHER
#: times as much as the one before.
ABOVE, FARTHER, TRIES = 3.0, 8.0, 12

#: Least relative distance of the first bound from the value.
LEAST = 2.0**-48

Ends = tuple[float | None, float | None]


def enclose_largest(
    above: Pencil, below: Pencil | None = None, *, guess: float | None = None, order: Ints | None = None
) -> Ends:
    """Bounds of the largest eigenvalue of ``X x = value Y x``; None where a bound could not be proved.

    Parameters
    ----------
    above : pair of Enclosed
        An X at least as large, and a Y at most as large as the true ones, in the order of symmetric matrices.
    below : pair of Enclosed, optional
        An X at most, and a Y at least as large; the same pair if left out.
    guess : float, optional
        An approximation of the value, which is positive; needed for sparse matrices.
    order : int array, optional
        An order of elimination for sparse matrices.

    Examples
    --------
    >>> X, Y = (Enclosed.exactly(np.diag(entries)) for entries in ([1.0, 4.0], [1.0, 3.0]))
    >>> low, high = enclose_largest((X, Y))
    >>> low < 4 / 3 < high < low + 1e-12
    True
    """
    X, Y = above
    value, x = guess, None
    if value is None:
        try:
            found = largest(X.middle, Y.middle)
        except ValueError:  # Y not definite, not finite
            return None, None
        value, x = found.value, found.vector
    if not SMALLEST <= value <= LARGEST:
        return None, None
    first = Elimination(Y.plus(-1.0, X, factor=(1 + NEAR) * value), order=order)
    if first.plain is None:
        return None if x is None else _quotient(below or above, x), None
    if x is None:
        x = np.random.default_rng(0).standard_normal(Y.middle.shape[0])
        for _ in range(SOLVES):
            x = first.plain[2](Y.middle @ (x / np.abs(x).max()))
    low = _quotient(below or above, x)
    moves = ABOVE * float(first.shift() @ x**2) / float(x @ (Y.middle @ x)) / value
    distance = max(moves, LEAST)
    for _ in range(TRIES):
        r = value * (1 + distance)
        if Elimination(Y.plus(-1.0, X, factor=r), order=first.order, errors=first.errors).bound(1) is not None:
            return low, r
        distance *= FARTHER
    return low, None


def _quotient(pencil: Pencil, x: Floats) -> float | None:
    """A lower bound of the Rayleigh quotient; None where it is not proved to be positive."""
    X, Y = pencil
    x = x / np.abs(x).max()
    numerator, denominator = X.form(x)[0], Y.form(x)[1]
    if not (numerator > 0 and 0 < denominator < math.inf):
        return None
    return math.nextafter(numerator / denominator, 0.0)


def inverse(ends: Ends) -> Ends:
    """Bounds of 1/x for x > 0 between bounds."""
    low, high = ends
    return (
        None if high is None else math.nextafter(1 / high, 0.0),
        None if low is None else math.nextafter(1 / low, math.inf),
    )


def root(ends: Ends) -> Ends:
    """Bounds of the square root of x >= 0 between bounds."""
    low, high = ends
    return (
        None if low is None else math.nextafter(math.sqrt(low), 0.0),
        None if high is None else math.nextafter(math.sqrt(high), math.inf),
    )

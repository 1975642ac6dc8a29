"""Extremal eigenvalues of symmetric pencils, with residuals that bound their error."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.linalg.lapack import dpotrf, dpotrs, dsygvx, dsygvx_lwork

from fem1d2d.condense import Apply, solver
from fem1d2d.mesh import Floats, Ints

#: Up to this size a pencil is solved densely.
DENSE = 40

#: The relative residual asked of Lanczos.
LANCZOS = 1e-10

#: Vectors that Lanczos keeps, and how many of the upper end of the spectrum stay when they are full and it restarts.
BASIS, KEPT = 40, 15

#: The same where both ends are wanted; then numbers from the lower and from the upper end.
LONG_BASIS, KEPT_BOTH = 120, (15, 30)

#: The step from which on the residual is looked at.
SOON = 8

#: Where both ends are wanted: steps from one look to the next, which costs as much as a step with 10^4 unknowns.
LOOK = 5

#: Most steps of Lanczos for the largest eigenvalue, and how often it starts again from the vector that it has found.
MOST, RESTARTS = 3000, 3


@dataclass(frozen=True, kw_only=True)
class Eigenvalue:
    """An eigenvalue of ``A x = value B x`` with its error bound.

    Attributes
    ----------
    value : float
    vector : array, shape (n,)
        With ``x' B x = 1``.
    residual : float
        ``|A x - value B x|`` in the norm of ``B^-1``: some eigenvalue lies within it of ``value``, and the error of an
        isolated one is of the order of its square.
    """

    value: float
    vector: Floats
    residual: float


def rayleigh_quotient(apply_A: Apply, x: Floats, mass: Floats, solve_B: Apply) -> Eigenvalue:
    """The Rayleigh quotient of any vector x; ``mass`` is B x."""
    unit = math.sqrt(float(x @ mass))
    x, mass = x / unit, mass / unit
    force = apply_A(x)
    value = float(x @ force)
    r: Floats = force - value * mass
    x.setflags(write=False)
    return Eigenvalue(value=value, vector=x, residual=math.sqrt(max(float(r @ solve_B(r)), 0.0)))


def largest(A: Floats, B: Floats) -> Eigenvalue:
    """Largest eigenvalue of a dense pencil, A symmetric, B symmetric positive definite, both of shape (n, n).

    LAPACK is called directly: for ten rows the checks of scipy take longer than the eigenvalue.  ValueError if an entry
    is not finite, numpy.linalg.LinAlgError if B is not positive definite.
    """
    if not (np.isfinite(A).all() and np.isfinite(B).all()):
        raise ValueError("a pencil with entries that are not finite")
    n = len(A)
    factor, failed = dpotrf(B)
    if failed:
        raise np.linalg.LinAlgError("a pencil whose second matrix is not positive definite")
    _, vectors, count, _, failed = dsygvx(A, B, uplo="L", range="I", il=n, iu=n, lwork=_work(n))
    if failed or not count:  # LAPACK's subsets miss an eigenvalue of high multiplicity
        _, vectors = eigh(A, B, driver="gvd")
        count = n
    x = vectors[:, count - 1]
    return rayleigh_quotient(A.__matmul__, x, B @ x, lambda r: np.asarray(dpotrs(factor, r)[0]))


@lru_cache(maxsize=256)
def _work(n: int) -> int:
    """The workspace that LAPACK needs to work in blocks."""
    return int(dsygvx_lwork(n, uplo="L")[0])


def largest_of(
    apply_A: Apply,
    apply_B: Apply,
    solve_B: Apply,
    n: int,
    *,
    above: tuple[float, Apply] | None = None,
    tolerance: float = LANCZOS,
    progress: Callable[[int], None] = lambda steps: None,
) -> Eigenvalue:
    """Largest eigenvalue of a pencil that is given by products and solves.

    Lanczos from a fixed start, so that it repeats to the digit.  A step costs one product with each matrix and one
    solve.  Some eigenvalue lies within the residual of the value, up to the error of the products and solves.  That it
    is the largest is not proved: Lanczos misses a larger one where the start is nearly orthogonal to its eigenvectors,
    or where two are so close that they are not yet separated when the residual is small enough.

    Parameters
    ----------
    apply_A, apply_B : callable
        ``x -> A x`` and ``x -> B x`` for vectors of shape (n,); A symmetric, B symmetric positive definite.
    solve_B : callable
        ``r -> B^-1 r``.
    n : int
    above : tuple of float and callable, optional
        An upper bound s of the spectrum and ``r -> (s B - A)^-1 r``, which a step then solves instead of B: it
        separates eigenvalues that crowd below s by their distance to s.  Without it these cost many steps.
    tolerance : float
        The relative residual at which Lanczos stops.
    progress : callable
        Called after each step with the number of steps.

    Examples
    --------
    >>> A = np.linspace(1.0, 3.0, 1000)
    >>> found = largest_of(lambda x: A * x, lambda x: x / 2, lambda r: 2 * r, 1000)
    >>> round(found.value, 9), found.residual < 1e-9
    (6.0, True)
    """
    if n <= DENSE:
        columns = ([apply(e) for e in np.eye(n)] for apply in (apply_A, apply_B))
        return largest(*((M + M.T) / 2 for M in map(np.array, columns)))
    sigma, solve = (None, solve_B) if above is None else above
    count = itertools.count(1)

    def step(r: Floats) -> Floats:
        x = solve(r)
        progress(next(count))
        return x

    def enough(steps: int, values: Floats, residuals: Floats) -> bool:
        return bool(residuals[-1] <= tolerance / 2 * abs(values[-1]))

    product = apply_A if sigma is None else apply_B  # eigenvalues of (B, sigma B - A) are 1/(sigma - value)
    start = np.random.default_rng(0).standard_normal(n)
    for _ in range(RESTARTS):  # a residual in another norm, or of a cluster, may be too large still
        ritz = _lanczos(
            product, step, start, room=BASIS, kept=(0, KEPT), most=MOST, look=lambda k: k > SOON, enough=enough
        )
        x = ritz.vectors[:, -1] @ ritz.X
        found = rayleigh_quotient(apply_A, x, apply_B(x), solve_B)
        if found.residual <= tolerance * abs(found.value):
            break
        start = apply_B(found.vector) if sigma is None else sigma * apply_B(found.vector) - apply_A(found.vector)
    return found


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """The ends of a spectrum that Lanczos found in ``steps`` products with A.

    Some eigenvalue lies within the residual of each.  The least eigenvalue is at most ``least.value``, the largest one
    at least ``largest.value``, up to rounding: they are Rayleigh quotients.
    """

    least: Eigenvalue
    largest: Eigenvalue
    steps: int


def extremes_by_solves(
    apply_A: Apply,
    solve_B: Apply,
    n: int,
    *,
    tolerance: float = 1e-6,
    least_tolerance: float = 1e-2,
    most: int = 1000,
    progress: Callable[[int, float, float], None] = lambda steps, value, residual: None,
) -> Extremes:
    """Least and largest eigenvalue of a pencil that is given by products with A and solves with B.

    Lanczos for ``A B^-1`` on vectors y = B x, symmetric in the scalar product ``y' B^-1 z``, orthogonalised in full and
    restarted with the vectors of both ends.  A step costs one product and one solve.  It stops at the tolerances or
    after ``most`` steps: see the residuals.  That no eigenvalue lies outside is not proved, as for :func:`largest_of`.

    Parameters
    ----------
    apply_A, solve_B, n
        As for :func:`largest_of`.
    tolerance, least_tolerance : float
        Residuals of the largest and of the least eigenvalue at which it stops, as parts of the largest one.
    most : int
        The largest number of steps.
    progress : callable
        Called with steps, largest value and its residual after the first step and then every few.

    Examples
    --------
    >>> A = np.linspace(1.0, 3.0, 1000)
    >>> found = extremes_by_solves(lambda x: A * x, lambda r: 2 * r, 1000)
    >>> round(found.largest.value, 9), found.largest.residual < 1e-5, round(found.least.value, 3)
    (6.0, True, 2.0)
    """

    def enough(steps: int, values: Floats, residuals: Floats) -> bool:
        progress(steps, float(values[-1]), float(residuals[-1]))
        scale = float(np.abs(values).max())
        return bool(residuals[-1] <= tolerance * scale and residuals[0] <= least_tolerance * scale)

    look = lambda steps: steps % LOOK == 1
    start = np.random.default_rng(0).standard_normal(n)
    ritz = _lanczos(apply_A, solve_B, start, room=LONG_BASIS, kept=KEPT_BOTH, most=most, look=look, enough=enough)

    def pair(i: int) -> Eigenvalue:
        mass = ritz.vectors[:, i] @ ritz.Y
        return rayleigh_quotient(apply_A, solve_B(mass), mass, solve_B)

    return Extremes(least=pair(0), largest=pair(-1), steps=ritz.steps)


class _Ritz(NamedTuple):
    """The end of Lanczos: coefficients of the Ritz vectors, as columns, in the rows of Y and of ``X = Y B^-1``."""

    vectors: Floats
    Y: Floats
    X: Floats
    steps: int


def _lanczos(
    apply_A: Apply,
    solve_B: Apply,
    y: Floats,
    *,
    room: int,
    kept: tuple[int, int],
    most: int,
    look: Callable[[int], bool],
    enough: Callable[[int, Floats, Floats], bool],
) -> _Ritz:
    """Lanczos for ``A B^-1`` from a vector y, symmetric in the scalar product ``y' B^-1 z``, orthogonalised in full.

    When ``room`` vectors are full it restarts with some ``kept`` of the lower and of the upper end.  Where a ``look``
    is due, ``enough`` takes the steps, the Ritz values and their residuals.  ValueError if ``y' B^-1 y`` is not
    positive.
    """
    n = len(y)
    room = min(n, room)
    Y, X = np.empty((room, n)), np.empty((room, n))  # y and x = B^-1 y, orthonormal: Y X' = 1
    H = np.zeros((room, room))
    x = solve_B(y)
    square = float(x @ y)
    if not square > 0:
        raise ValueError("a pencil whose second matrix is not positive definite")
    beta, j = math.sqrt(square), 0
    for steps in range(1, most + 1):
        Y[j], X[j] = y / beta, x / beta
        y = np.array(apply_A(X[j]), dtype=float)
        size = np.linalg.norm(y)
        for _ in range(2):  # the second time removes what rounding left
            part = X[: j + 1] @ y
            y -= part @ Y[: j + 1]
            H[: j + 1, j] += part
        H[j, : j + 1] = H[: j + 1, j]
        x = solve_B(y)
        exhausted = j + 1 == n or np.linalg.norm(y) <= n * np.finfo(float).eps * size
        beta = 0.0 if exhausted else math.sqrt(max(float(x @ y), 0.0))
        if look(steps) or not beta or j + 1 == room or steps == most:
            values, vectors = eigh(H[: j + 1, : j + 1])
            if enough(steps, values, beta * np.abs(vectors[-1])) or not beta:
                break
        j += 1
        if j == room and steps < most:
            low, high = kept
            ends = np.r_[:low, room - high : room]
            j = len(ends)
            Y[:j], X[:j] = vectors[:, ends].T @ Y, vectors[:, ends].T @ X
            H[:] = 0.0
            H[np.arange(j), np.arange(j)] = values[ends]
    return _Ritz(vectors, Y[: len(vectors)], X[: len(vectors)], steps)


def largest_sparse(
    A: sp.csc_array, B: sp.csc_array, solve_B: Apply, *, above: float | None = None, order: Ints | None = None
) -> Eigenvalue:
    """Largest eigenvalue of a large pencil of sparse matrices, as :func:`largest_of`.

    ``above`` is an upper bound of the spectrum, ``order`` an order of elimination for ``above * B - A``, see
    :func:`fem1d2d.condense.elimination_order`.
    """
    if A.shape[0] <= DENSE:
        return largest(A.toarray(), B.toarray())
    nearest = None if above is None else (above, solver(above * B - A, order))
    return largest_of(A.__matmul__, B.__matmul__, solve_B, A.shape[0], above=nearest)

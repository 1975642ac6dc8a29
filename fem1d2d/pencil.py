"""Extremal eigenvalues of symmetric pencils, with residuals that bound their error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh, eigh_tridiagonal
from scipy.linalg.lapack import dpotrf, dpotrs, dsygvx, dsygvx_lwork
from scipy.sparse.linalg import LinearOperator, eigsh

from fem1d2d.condense import solver
from fem1d2d.mesh import Floats, Ints

#: Up to this size a pencil is solved densely.
DENSE = 40

#: The relative residual asked of Lanczos.
LANCZOS = 1e-10

#: Vectors that Lanczos keeps; when they are full it restarts from what they have found.
BASIS = 24

#: Most steps of the Lanczos without restart that is tried first on sparse matrices, and the step from which on it
#: checks the residual.
PLAIN, SOON = 40, 8

#: Where products and solves are given as functions, they cost more than memory: vectors kept then, and the numbers of
#: them that a restart keeps from the lower and from the upper end.
LONG_BASIS, KEPT = 120, (15, 30)

#: Steps from one look at the ends of the spectrum to the next: it costs as much as a step with 10^4 unknowns.
LOOK = 5


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


def rayleigh_quotient(A: Any, B: Any, x: Floats, solve_B: Callable[[Floats], Floats]) -> Eigenvalue:
    """The Rayleigh quotient of any vector x, for arrays, sparse arrays or linear operators A and B."""
    x = x / math.sqrt(float(x @ (B @ x)))
    value = float(x @ (A @ x))
    r: Floats = A @ x - value * (B @ x)
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
    return rayleigh_quotient(A, B, vectors[:, count - 1], lambda r: np.asarray(dpotrs(factor, r)[0]))


@lru_cache(maxsize=256)
def _work(n: int) -> int:
    """The workspace that LAPACK needs to work in blocks."""
    return int(dsygvx_lwork(n, uplo="L")[0])


def largest_of(
    apply_A: Callable[[Floats], Floats],
    apply_B: Callable[[Floats], Floats],
    solve_B: Callable[[Floats], Floats],
    n: int,
    *,
    above: tuple[float, Callable[[Floats], Floats]] | None = None,
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
    A, B = (LinearOperator((n, n), matvec=apply, dtype=float) for apply in (apply_A, apply_B))
    if n <= DENSE:
        return largest(*((M + M.T) / 2 for M in (A @ np.eye(n), B @ np.eye(n))))
    sigma, solve = (None, solve_B) if above is None else above
    steps = 0

    def step(r: Floats) -> Floats:
        nonlocal steps
        x = solve(r)
        steps += 1
        progress(steps)
        return x if sigma is None else -x

    operator = LinearOperator((n, n), matvec=step, dtype=float)
    options: dict[str, Any] = {"k": 1, "M": B, "tol": tolerance, "ncv": min(n - 1, BASIS)}
    options |= (
        {"Minv": operator, "which": "LA"} if sigma is None else {"sigma": sigma, "OPinv": operator, "which": "LM"}
    )
    start = np.random.default_rng(0).standard_normal(n)
    for _ in range(3):  # ARPACK's own estimate of the residual fails at some multiple eigenvalues; a restart mends it
        _, vectors = eigsh(A, v0=start, **options)
        found = rayleigh_quotient(A, B, vectors[:, 0], solve_B)
        if found.residual <= tolerance * abs(found.value):
            break
        start = found.vector
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
    apply_A: Callable[[Floats], Floats],
    solve_B: Callable[[Floats], Floats],
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
    room = min(n, LONG_BASIS)
    Y, X = np.empty((room, n)), np.empty((room, n))  # y and x = B^-1 y, orthonormal: Y X' = 1
    H = np.zeros((room, room))
    y = np.random.default_rng(0).standard_normal(n)
    x = solve_B(y)
    beta, j = math.sqrt(float(x @ y)), 0
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
        if steps % LOOK == 1 or not beta or j + 1 == room or steps == most:
            values, vectors = eigh(H[: j + 1, : j + 1])
            residuals, scale = beta * np.abs(vectors[-1]), float(np.abs(values).max())
            progress(steps, float(values[-1]), float(residuals[-1]))
            if not beta or (residuals[-1] <= tolerance * scale and residuals[0] <= least_tolerance * scale):
                break
        j += 1
        if j == room and steps < most:
            low, high = KEPT
            kept = np.r_[:low, room - high : room]
            j = len(kept)
            Y[:j], X[:j] = vectors[:, kept].T @ Y, vectors[:, kept].T @ X
            H[:] = 0.0
            H[np.arange(j), np.arange(j)] = values[kept]
    rows = len(values)

    def pair(i: int) -> Eigenvalue:
        force = vectors[:, i] @ Y[:rows]
        trace = solve_B(force)
        unit = math.sqrt(float(trace @ force))
        force, trace = force / unit, trace / unit
        product = apply_A(trace)
        value = float(trace @ product)
        r = product - value * force
        trace.setflags(write=False)
        return Eigenvalue(value=value, vector=trace, residual=math.sqrt(max(float(r @ solve_B(r)), 0.0)))

    return Extremes(least=pair(0), largest=pair(-1), steps=steps)


def largest_sparse(
    A: sp.csc_array,
    B: sp.csc_array,
    solve_B: Callable[[Floats], Floats],
    *,
    above: float | None = None,
    order: Ints | None = None,
) -> Eigenvalue:
    """Largest eigenvalue of a large pencil of sparse matrices, as :func:`largest_of`.

    ``above`` is an upper bound of the spectrum, ``order`` an order of elimination for ``above * B - A``, see
    :func:`fem1d2d.condense.elimination_order`.
    """
    n = A.shape[0]
    if n <= DENSE:
        return largest(A.toarray(), B.toarray())
    if above is None:
        nearest, vector = None, _plain_lanczos(A, solve_B)
    else:
        nearest = (above, solver(above * B - A, order))
        vector = _plain_lanczos(B, nearest[1])
    found = rayleigh_quotient(A, B, vector, solve_B)
    if found.residual <= LANCZOS * abs(found.value):
        return found
    return largest_of(A.__matmul__, B.__matmul__, solve_B, n, above=nearest)


def _plain_lanczos(A: sp.csc_array, solve_B: Callable[[Floats], Floats]) -> Floats:
    """Approximate eigenvector of the largest eigenvalue of (A, B), by Lanczos for ``B^-1 A`` without restart.

    A step costs one product and one solve, with ARPACK three products, and it ends as soon as the residual is small
    enough, which ARPACK checks only when its basis is full.
    """
    n = A.shape[0]
    room = min(n, PLAIN)
    Y, X = np.empty((room, n)), np.empty((room, n))  # y and x = B^-1 y, orthonormal: Y X' = 1
    diagonal, beside = np.empty(room), np.empty(room)
    y: Floats = np.random.default_rng(0).standard_normal(n)
    x = solve_B(y)
    beta = math.sqrt(max(float(x @ y), 0.0))
    if not beta:
        return y
    for j in range(room):
        np.divide(y, beta, out=Y[j])
        np.divide(x, beta, out=X[j])
        y = A @ X[j]
        size = np.linalg.norm(y)
        part = X[: j + 1] @ y
        y -= part @ Y[: j + 1]
        diagonal[j] = part[j]
        x = solve_B(y)
        exhausted = np.linalg.norm(y) <= n * np.finfo(float).eps * size
        beside[j] = beta = 0.0 if exhausted else math.sqrt(max(float(x @ y), 0.0))
        if j >= SOON or not beta or j + 1 == room:
            value, vector = eigh_tridiagonal(diagonal[: j + 1], beside[:j], select="i", select_range=(j, j))
            if beta * abs(vector[-1, 0]) <= LANCZOS / 2 * abs(value[0]):
                break
    return np.asarray(vector[:, 0] @ X[: j + 1])

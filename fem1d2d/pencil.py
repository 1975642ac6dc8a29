"""Extremal eigenvalues of symmetric pencils, with residuals that bound their error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from fem1d2d.condense import solver
from fem1d2d.mesh import Floats, Ints

#: Up to this size a pencil is solved densely.
DENSE = 40

#: The relative residual asked of Lanczos.
LANCZOS = 1e-10

#: Vectors that Lanczos keeps; when they are full it restarts from what they have found.
BASIS = 24


@dataclass(frozen=True, kw_only=True)
class Eigenvalue:
    """An eigenvalue of ``A x = value B x`` with its error bound.

    Attributes
    ----------
    value : float
    vector : array, shape (n,)
        With ``x' B x = 1``.
    residual : float
        ``|A x - value B x|`` in the norm of ``B^-1``: some eigenvalue lies within it of ``value``, and the error
        of an isolated one is of the order of its square.
    """

    value: float
    vector: Floats
    residual: float


def rayleigh_quotient(A: Any, B: Any, x: Floats, solve_B: Callable[[Floats], Floats]) -> Eigenvalue:
    """The Rayleigh quotient of any vector x; some eigenvalue lies within its ``residual``.

    A and B are whatever can be multiplied by a vector: arrays, sparse arrays, linear operators.
    """
    x = x / math.sqrt(float(x @ (B @ x)))
    value = float(x @ (A @ x))
    r: Floats = A @ x - value * (B @ x)
    x.setflags(write=False)
    return Eigenvalue(value=value, vector=x, residual=math.sqrt(max(float(r @ solve_B(r)), 0.0)))


def largest(A: Floats, B: Floats) -> Eigenvalue:
    """Largest eigenvalue of a dense pencil, A symmetric, B symmetric positive definite, both of shape (n, n)."""
    n = len(A)
    factor = cho_factor(B)
    _, vectors = eigh(A, B, subset_by_index=[n - 1, n - 1], driver="gvx")
    if vectors.shape[1] == 0:  # LAPACK's subsets miss an eigenvalue of high multiplicity
        _, vectors = eigh(A, B, driver="gvd")
    return rayleigh_quotient(A, B, vectors[:, -1], lambda r: np.asarray(cho_solve(factor, r)))


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
    """Largest eigenvalue of a pencil of which only products and solves are known.

    Lanczos from a fixed start, so that it repeats to the digit.  A step costs one product with each matrix and one
    solve.  The residual of the result says that some eigenvalue lies within it of the value, up to the error of the
    products and solves.  It does not say that this eigenvalue is the largest: that is the word of Lanczos, which misses
    a larger one where the start is all but orthogonal to its eigenvectors, or where the two are so near each other that
    it has not told them apart when the residual is small enough.

    Parameters
    ----------
    apply_A, apply_B : callable
        ``x -> A x`` and ``x -> B x`` for vectors of shape (n,); A symmetric, B symmetric positive definite.
    solve_B : callable
        ``r -> B^-1 r``.
    n : int
    above : tuple of float and callable, optional
        An upper bound s of the spectrum and ``r -> (s B - A)^-1 r``: eigenvalues that crowd below it are told apart by
        their distance to it, and a step takes this solve in place of that with B.  Without it many eigenvalues that
        crowd at the top cost many steps.
    tolerance : float
        The relative residual at which Lanczos stops.
    progress : callable
        Told the number of steps after each.

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


def largest_sparse(
    A: sp.csc_array,
    B: sp.csc_array,
    solve_B: Callable[[Floats], Floats],
    *,
    above: float | None = None,
    order: Ints | None = None,
) -> Eigenvalue:
    """Largest eigenvalue of a large pencil of sparse matrices, as :func:`largest_of`.

    Parameters
    ----------
    A, B : sparse array, shape (n, n)
        A symmetric, B symmetric positive definite.
    solve_B : callable
        ``r -> B^-1 r``.
    above : float, optional
        An upper bound of the spectrum: eigenvalues that crowd below it are told apart by their distance to it.
    order : int array, shape (n,), optional
        An order of elimination for ``above * B - A``, see :func:`fem1d2d.condense.elimination_order`.
    """
    n = A.shape[0]
    if n <= DENSE:
        return largest(A.toarray(), B.toarray())
    nearest = None if above is None else (above, solver(above * B - A, order))
    return largest_of(A.__matmul__, B.__matmul__, solve_B, n, above=nearest)

"""Extremal eigenvalues of symmetric pencils, with residuals that bound their error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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


def rayleigh_quotient(
    A: Floats | sp.csc_array, B: Floats | sp.csc_array, x: Floats, solve_B: Callable[[Floats], Floats]
) -> Eigenvalue:
    """The Rayleigh quotient of any vector x; some eigenvalue lies within its ``residual``."""
    x = x / np.sqrt(x @ (B @ x))
    value = float(x @ (A @ x))
    r = A @ x - value * (B @ x)
    x.setflags(write=False)
    return Eigenvalue(value=value, vector=x, residual=float(np.sqrt(max(r @ solve_B(r), 0.0))))


def largest(A: Floats, B: Floats) -> Eigenvalue:
    """Largest eigenvalue of a dense pencil, A symmetric, B symmetric positive definite, both of shape (n, n)."""
    n = len(A)
    factor = cho_factor(B)
    _, vectors = eigh(A, B, subset_by_index=[n - 1, n - 1], driver="gvx")
    if vectors.shape[1] == 0:  # LAPACK's subsets miss an eigenvalue of high multiplicity
        _, vectors = eigh(A, B, driver="gvd")
    return rayleigh_quotient(A, B, vectors[:, -1], lambda r: np.asarray(cho_solve(factor, r)))


def largest_sparse(
    A: sp.csc_array,
    B: sp.csc_array,
    solve_B: Callable[[Floats], Floats],
    *,
    above: float | None = None,
    order: Ints | None = None,
) -> Eigenvalue:
    """Largest eigenvalue of a large pencil by Lanczos, from a fixed start, so that it repeats to the digit.

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
    inverse = LinearOperator((n, n), matvec=solve_B, dtype=float)
    options = {"k": 1, "M": B, "tol": LANCZOS, "ncv": min(n - 1, 24)}
    if above is None:
        options |= {"Minv": inverse, "which": "LA"}
    else:
        nearest = solver(above * B - A, order)
        distance = LinearOperator((n, n), matvec=lambda r: -nearest(r), dtype=float)
        options |= {"sigma": above, "OPinv": distance, "which": "LM"}
    start = np.random.default_rng(0).standard_normal(n)
    for _ in range(3):  # ARPACK's own estimate of the residual fails at some multiple eigenvalues; a restart mends it
        _, vectors = eigsh(A, v0=start, **options)
        found = rayleigh_quotient(A, B, vectors[:, 0], solve_B)
        if found.residual <= LANCZOS * abs(found.value):
            break
        start = found.vector
    return found

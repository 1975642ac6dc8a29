"""Positive definiteness in spite of rounding: what a floating-point Cholesky factorisation can decide."""

from __future__ import annotations

import numpy as np

from fem1d2d.mesh import Floats

#: Half the distance from 1 to the next double.
UNIT = float(np.finfo(float).eps) / 2


def gamma(n: int) -> float:
    """``n u / (1 - n u)``: bounds the relative error of a sum of n products, in any order."""
    return n * UNIT / (1 - n * UNIT)


def norm_bound(matrix: Floats) -> float:
    """A bound of the largest eigenvalue of a symmetric matrix with entries >= 0.

    By Collatz and Wielandt ``max_i (E x)_i / x_i`` bounds it for every x > 0; a few power steps make it sharp.

    Examples
    --------
    >>> round(norm_bound(np.array([[0.0, 2.0], [2.0, 3.0]])), 6)
    4.0
    """
    n = len(matrix)
    x = np.ones(n)
    for _ in range(20):
        x = matrix @ x + 1e-300
        x = np.maximum(x / x.max(), 1e-8)
    return float(((matrix @ x) / x).max()) * (1 + gamma(n + 2))


def positive_definite(matrix: Floats, error: Floats) -> bool:
    """Whether every symmetric matrix within an entrywise error of this one is positive definite.

    Where the floating-point Cholesky factorisation of ``A - c`` runs to its end, with ``c >= gamma_{n+1}/(1 -
    gamma_{n+1}) tr A``, A is positive definite (Rump, Verification of positive definiteness, BIT 46, 2006).  Rows and
    columns are scaled first, so that what is large does not hide what is small.  False says nothing.

    Parameters
    ----------
    matrix : array, shape (n, n)
    error : array, shape (n, n)
        Entries >= 0.

    Examples
    --------
    >>> A = np.array([[2.0, 1.0], [1.0, 2.0]])
    >>> positive_definite(A, np.full((2, 2), 0.4)), positive_definite(A, np.full((2, 2), 0.6))
    (True, False)
    """
    n = len(matrix)
    diagonal = np.diag(matrix)
    if not (np.isfinite(matrix).all() and (diagonal > 0).all()):
        return False
    scale = 2.0 ** -np.round(np.log2(diagonal) / 2)  # powers of two: rounding does not enter
    matrix, error = matrix * np.outer(scale, scale), error * np.outer(scale, scale)
    of_cholesky = gamma(n + 2) / (1 - gamma(n + 2)) * float(np.abs(np.diag(matrix)).sum())
    shift = (norm_bound(error) + of_cholesky) * (1 + 4 * UNIT)
    try:
        np.linalg.cholesky(matrix - shift * np.eye(n))
    except np.linalg.LinAlgError:
        return False
    return True

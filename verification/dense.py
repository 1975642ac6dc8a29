"""Products and solves with dense symmetric matrices by BLAS itself, for each step of the iteration.

The input checks of numpy and scipy cost more than a product of a hundred rows.  Matrices and vectors are checked where
they come in; here nothing is.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dsymv, dtrsv
from scipy.linalg.lapack import dpocon, dpotrf, dpotrs

from fem1d2d.mesh import Floats, Ints
from verification.machine.threads import one_thread

#: A component of an orthonormal rigid motion below this is 0.
STILL = 1e-9


def times(S: Floats, v: Floats) -> Floats:
    """Return ``S v`` for a symmetric S, of which one triangle is read: half the memory of a general product."""
    product: Floats = dsymv(1.0, S if S.flags.f_contiguous else S.T, v)  # a transpose copies nothing
    return product


def symmetric(matrices: Floats) -> Floats:
    """Return the symmetric part of a matrix, or of each of several, shape (.., n, n)."""
    return np.asarray((matrices + np.swapaxes(matrices, -1, -2)) / 2)


def vanishing(motions: Floats, rows: Ints) -> Floats:
    """Return combinations of orthonormal columns, shape (n, k), that vanish on some rows, orthonormal too."""
    k = motions.shape[1]
    if not k or not len(rows):
        return motions
    if k == 1:  # the decomposition of one column is its length
        return motions[:, int(np.linalg.norm(motions[rows]) > STILL) :]
    _, values, right = np.linalg.svd(np.linalg.qr(motions[rows], mode="r"))
    rank = int((values > STILL).sum())
    return np.asarray(motions @ right[rank:].T)


def pinned(S: Floats, rows: Ints, motions: Floats) -> Floats:
    """Return the block of some rows and columns of S, made definite where motions of its kernel move only these rows.

    With N these motions it is ``S + c N N'``: a solution for a right-hand side orthogonal to N is one of S, exactly.
    S, shape (n, n), is symmetric positive semidefinite, and ``motions``, shape (n, k), an orthonormal basis of its
    kernel.
    """
    others = np.ones(len(S), dtype=bool)
    others[rows] = False
    N, block = vanishing(motions, np.flatnonzero(others))[rows], S[np.ix_(rows, rows)]
    return np.asarray(block + float(np.diag(S).max()) * N @ N.T) if N.size else block


def worst(values: Floats) -> float:
    """Return the largest of some numbers and 0; NaN where one is NaN."""
    return float(np.maximum.reduce(values, initial=0.0))


def _block(S: Floats, rows: Ints, motions: Floats | None) -> Floats:
    """Return some rows and columns of S, its kernel pinned."""
    if motions is not None and motions.shape[1]:
        return pinned(S, rows, motions)
    return S if len(rows) == len(S) else S[np.ix_(rows, rows)]


def reciprocal_condition(S: Floats, rows: Ints, motions: Floats | None = None) -> float:
    """Estimate ``1 / (|S| |S^-1|)`` in the norm of the largest column sum, for the matrix of :class:`Cholesky`.

    LAPACK's estimate is seldom more than three times too large; it is 0 where S is not positive definite in doubles, 1
    without rows.
    """
    if not len(rows):
        return 1.0
    block = np.asarray_chkfinite(_block(S, rows, motions))
    factor, minor = dpotrf(block, clean=0)
    return 0.0 if minor else float(dpocon(factor, np.abs(block).sum(axis=0).max())[0])


class Cholesky:
    """``S^-1`` on some rows of a symmetric S, shape (n, n), that is positive definite there, 0 on the others.

    There may be all rows, or none; ``motions``, shape (n, k), is the kernel of a semidefinite S, see :func:`pinned`.
    """

    def __init__(self, S: Floats, rows: Ints, motions: Floats | None = None) -> None:
        self._rows, self._all = rows, len(rows) == len(S)
        self._factor = None
        if len(rows):
            self._factor, minor = dpotrf(np.asarray_chkfinite(_block(S, rows, motions)), clean=0)
            if minor:
                raise np.linalg.LinAlgError(f"the leading minor {minor} is not positive: needed a definite matrix")

    def solve(self, right: Floats) -> Floats:
        """Return ``S^-1 right`` for a vector, shape (n,), or columns, shape (n, m)."""
        if self._all:
            return self._back(right)
        result = np.zeros(right.shape)
        if self._factor is not None:
            result[self._rows] = self._back(right[self._rows])
        return result

    def _back(self, right: Floats) -> Floats:
        found: Floats
        if right.ndim == 1:  # LAPACK's own solve is written for many columns, and takes three times as long for one
            found = dtrsv(self._factor, dtrsv(self._factor, right, trans=1), overwrite_x=1)
        else:
            with one_thread():  # with four threads OpenBLAS 0.3.28, of scipy 1.15, crashes here
                found = np.ascontiguousarray(dpotrs(self._factor, right)[0])
        return found

"""Products and solves with dense symmetric matrices by BLAS itself, for what is done at every step of the iteration.

The checks at the doors of numpy and scipy cost more than a product of a hundred rows.  Matrices and vectors are checked
where they come in; here nothing is.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dsymv, dtrsv
from scipy.linalg.lapack import dpocon, dpotrf, dpotrs

from fem1d2d.mesh import Floats, Ints
from verification.threads import one_thread

#: A component of an orthonormal rigid motion below this is 0.
STILL = 1e-9


def times(S: Floats, v: Floats) -> Floats:
    """``S v`` for a symmetric S, of which one triangle is read: half the memory of a general product."""
    product: Floats = dsymv(1.0, S if S.flags.f_contiguous else S.T, v)  # a transpose is no copy
    return product


def vanishing(motions: Floats, rows: Ints) -> Floats:
    """Combinations of orthonormal columns that vanish on some rows, orthonormal too, shape (n, as many as there are).

    Parameters
    ----------
    motions : array, shape (n, k)
    """
    k = motions.shape[1]
    if not k or not len(rows):
        return motions
    _, values, right = np.linalg.svd(np.linalg.qr(motions[rows], mode="r"))
    rank = int((values > STILL).sum())
    return np.asarray(motions @ right[rank:].T)


def pinned(S: Floats, rows: Ints, motions: Floats) -> Floats:
    """The block of some rows and columns of S, made definite where motions of its kernel move these rows alone.

    With N these motions it is ``S + c N N'``: a solution for a right-hand side orthogonal to N is one of S, exactly.

    Parameters
    ----------
    S : array, shape (n, n)
        Symmetric, positive semidefinite.
    motions : array, shape (n, k)
        An orthonormal basis of the kernel.
    """
    N = vanishing(motions, np.setdiff1d(np.arange(len(S)), rows))[rows]
    return np.asarray(S[np.ix_(rows, rows)] + float(np.diag(S).max()) * N @ N.T)


def worst(values: Floats) -> float:
    """The largest of some numbers and 0; not a number where one is none."""
    return float(np.maximum.reduce(values, initial=0.0))


def _block(S: Floats, rows: Ints, motions: Floats | None) -> Floats:
    """Some rows and columns of S, its kernel pinned."""
    if motions is not None and motions.shape[1]:
        return pinned(S, rows, motions)
    return S if len(rows) == len(S) else S[np.ix_(rows, rows)]


def reciprocal_condition(S: Floats, rows: Ints, motions: Floats | None = None) -> float:
    """Estimate ``1 / (|S| |S^-1|)`` in the norm of the largest column sum, for what :class:`Cholesky` solves with.

    Returns
    -------
    float
        LAPACK's estimate, seldom more than three times too large; 0 where S is not positive definite in doubles, 1
        without rows.
    """
    if not len(rows):
        return 1.0
    block = np.asarray_chkfinite(_block(S, rows, motions))
    factor, minor = dpotrf(block, clean=0)
    return 0.0 if minor else float(dpocon(factor, np.abs(block).sum(axis=0).max())[0])


class Cholesky:
    """``S^-1`` on some rows of a symmetric S that is positive definite there, 0 on the others.

    Parameters
    ----------
    S : array, shape (n, n)
    rows : int array
        May be all, or none.
    motions : array, shape (n, k), optional
        The kernel of S, where S is semidefinite; see :func:`pinned`.
    """

    def __init__(self, S: Floats, rows: Ints, motions: Floats | None = None) -> None:
        self._rows, self._all = rows, len(rows) == len(S)
        self._factor = None
        if len(rows):
            self._factor, minor = dpotrf(np.asarray_chkfinite(_block(S, rows, motions)), clean=0)
            if minor:
                raise np.linalg.LinAlgError(f"the leading minor {minor} is not positive: needed a definite matrix")

    def solve(self, right: Floats) -> Floats:
        """``S^-1 right`` for a vector, shape (n,), or columns, shape (n, m)."""
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

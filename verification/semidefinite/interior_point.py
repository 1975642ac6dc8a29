"""The semidefinite program of the bound, and a primal-dual interior-point method for it.

Each multiplier weighs a product of two rows, so in the direction of Helmberg, Rendl, Vanderbei and Wolkowicz, Kojima,
Shindoh and Hara, and Monteiro (HKM) the Schur complement is a sum of elementwise products of parts of two Gram
matrices, one in X and one in Z^-1, with all rows::

    tr(A_i X A_j Z^-1),   A_i = (a_i b_i' + b_i a_i')/2

and a step costs O(d^3) for forms of d rows and as many multipliers.  Predictor and corrector follow Mehrotra.  All
multipliers that are visited satisfy the program strictly, so whatever the method ends with proves something.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.blas import dsymv, dtrmm, dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf, dpotri, dstev

from fem1d2d.mesh import Floats
from verification.dense import symmetric
from verification.machine.threads import one_thread
from verification.semidefinite import LMIError

#: Steps after which it ends anyway; 10 to 15 are usual.
MOST_STEPS = 60

#: Added to the diagonal of the scaled Schur complement, one after the other, until it can be factorised.
SHIFTS = (0.0, 1e-14, 1e-12, 1e-10, 1e-8)

#: Steps of the method of Lanczos; a matrix of no more rows is decomposed.
LANCZOS = 30

#: Rows of length 1 that agree in so many digits after the point are one row.
ALIKE = 12

#: How well a step length is known, relatively.
NEAR = 0.02

#: The Krylov space ends where a new direction is this short, relatively.
EXHAUSTED = 1e-12

#: A value of s below this is as good as 0.
SMALL = 1e-3

#: Where the gap is this share of s a similar program starts.  On Section 6 with 25 nodes a start at 1, 0.3, 0.1, 0.03
#: and 0.01 leaves 7.4, 7.2, 5.6, 6.4 and 7.9 steps of the 10.4 of a start from known multipliers.
EARLY = 0.1

Indices = NDArray[np.intp]

#: lambda, tau, a, b by node; lambda alone without friction.  Where something is fixed at nodes, also what multiplies
#: w k zeta v_T, v_N^2, p_N^2, p_T^2 and p_T sqrt(w k) zeta.
Weights = tuple[Floats, ...]


@dataclass(frozen=True, kw_only=True)
class Stop:
    """End of a solver: where it knows s up to ``accuracy``, relatively, or at any s below ``enough``."""

    accuracy: float = 1e-7
    enough: float = -math.inf


#: The stop of a solver that is asked only for the least s.
USUAL = Stop()


@dataclass(frozen=True, kw_only=True, eq=False)
class Program:
    """The least s for which ``fixed + s free - sum_i y_i (a_i b_i' + b_i a_i')/2`` is positive semidefinite.

    The multipliers are ``y >= 0``, with ``4 y_a y_b >= y_tau^2`` in each row of ``cones``.

    Attributes
    ----------
    fixed, free : array, shape (d, d)
        Symmetric.
    left, right : array, shape (K, d), or (R, d) with ``tie``
        Their rows are a_i and b_i.
    cones : int array, shape (n, 3)
        Positions of (tau, a, b) among the multipliers.
    most : array, shape (K,)
        Largest multipliers; inf without a limit.
    tie : array, shape (R, K), or None
        1 where a row has a multiplier, if several rows share one; None: each has its own.
    s, y : float, array of shape (K,)
        A start of a search: the matrix is positive definite there, and every inequality strict.
    highest : float or None
        Where given, the largest s up to it is wanted instead of the least.
    blocks : tuple of slices
        The blocks of the matrix on its diagonal, the whole by default: what is beside them is 0, or does not count.
    """

    fixed: Floats
    free: Floats
    left: Floats
    right: Floats
    cones: Indices
    most: Floats
    s: float
    y: Floats
    highest: float | None = None
    stop: Stop = USUAL
    tie: Floats | None = None
    blocks: tuple[slice, ...] = (slice(None),)


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """A solver's answer.

    ``s`` is the value, ``y``, shape (K,), are the multipliers; ``moments``, shape (d, d), are the dual variable of the
    matrix: the second moments of the pairs of forces that are worst for it.  It has ``converged`` if the gap to the
    dual value is below the accuracy asked for.  ``early`` are s and y close to the central path and far from its end: a
    program with more conditions may start there.
    """

    s: float
    y: Floats
    moments: Floats
    steps: int
    converged: bool
    early: tuple[float, Floats] | None = None


class MatrixBlock:
    """A block of the matrix of the program: ``fixed + s free - sum_i y_i (a_i b_i' + b_i a_i')/2``.

    The rows are scaled to length one, and the multipliers with them.
    """

    def __init__(self, program: Program, block: slice, left: Floats, right: Floats) -> None:
        self.block, self.fixed, self.free = block, program.fixed[block, block][None], program.free[block, block]
        left, right, self.tie = left[:, block], right[:, block], program.tie
        if self.tie is not None:  # most rows of a program of many blocks are 0 in this one
            own = left.any(axis=1) & right.any(axis=1)
            left, right, self.tie = left[own], right[own], self.tie[own]
        self.left, self.right, self.rows = left, right, len(self.free)
        both = np.vstack([left, right])
        place: dict[bytes, int] = {}  # zeta and the slip are in several products
        at = [place.setdefault(row.tobytes(), len(place)) for row in np.round(both, ALIKE) + 0.0]  # no -0
        self._distinct = both[np.unique(at, return_index=True)[1]]
        self._a, self._b = np.split(np.array(at, dtype=np.intp), 2)
        self._weighed = np.flatnonzero(self.free.any(axis=0))
        self._weights = self.free[np.ix_(self._weighed, self._weighed)]

    def linear(self, y: Floats) -> Floats:
        """The part of the slack that is linear in (s, y), shape (1, d, d)."""
        by_row = y[1:] if self.tie is None else self.tie @ y[1:]
        half = self.left.T @ (by_row[:, None] * self.right)
        return np.asarray((y[0] * self.free - symmetric(half))[None])

    def adjoint(self, matrix: Floats, total: Floats) -> None:
        """Add the inner products of the coefficients of (s, y) with a symmetric matrix."""
        total[0] += np.vdot(self.free, matrix[0])
        total[1:] -= self._tied(np.einsum("ij,ij->i", self.left @ matrix[0], self.right))

    def _tied(self, by_row: Floats) -> Floats:
        """The sum over the rows of each multiplier, for numbers by row or by two rows."""
        if self.tie is None:
            return by_row
        total = self.tie.T @ by_row
        return total if total.ndim == 1 else np.asarray(total @ self.tie)

    def root(self, matrix: Floats) -> Floats:
        """The lower triangular L with ``L L'`` a matrix; LinAlgError unless it is positive definite."""
        L, failed = dpotrf(matrix[0].T, lower=1, clean=1)
        if failed:
            raise np.linalg.LinAlgError("not positive definite")
        return np.asarray(L)

    def inverse(self, root: Floats) -> Floats:
        """The inverse of the matrix of a root."""
        lower = np.tril(dpotri(root, lower=1)[0])
        return np.asarray((lower + np.tril(lower, -1).T)[None])

    def least(self, root: Floats, step: Floats) -> float:
        """The least eigenvalue of a matrix against the one of a root, or a lower bound close to it."""
        if self.rows > LANCZOS:
            return _least(root, step[0])
        half = dtrsm(1.0, root, step[0], lower=1)
        return float(np.linalg.eigvalsh(dtrsm(1.0, root, half.T, lower=1))[0])

    def schur(self, X: Floats, inverse: Floats, roots: tuple[Floats, Floats], M: Floats) -> None:
        """Add ``tr(G_i X G_j Z^-1)`` for the coefficients G_i of (s, y), from X, Z^-1 and the roots of X and Z."""
        by_X = dtrmm(1.0, roots[0], self._distinct.T, lower=1, trans_a=1)
        by_Z = dtrsm(1.0, roots[1], self._distinct.T, lower=1)
        X_rows, Z_rows = by_X.T @ by_X, by_Z.T @ by_Z  # the Gram matrices
        aa, bb, ab = (np.ix_(i, j) for i, j in ((self._a, self._a), (self._b, self._b), (self._a, self._b)))
        X_ab, Z_ab = X_rows[ab], Z_rows[ab]
        part = X_rows[bb] * Z_rows[aa] + X_rows[aa] * Z_rows[bb] + X_ab.T * Z_ab + X_ab * Z_ab.T
        M[1:, 1:] += self._tied(part / 4)
        product = symmetric(X[0][:, self._weighed] @ self._weights @ inverse[0][self._weighed])
        mixed = np.zeros(len(M))
        self.adjoint(product[None], mixed)
        M[0] += mixed
        M[1:, 0] += mixed[1:]


class Cones:
    """Small blocks of one size: ``fixed_j + sum_k y_{j,k} E_{j,k}``, symmetric of 1 or 2 rows.

    ``fixed`` has the shape (n, r, r); ``terms`` are positions in (s, y), shape (n,), with their coefficients E, (n, r,
    r).
    """

    def __init__(self, fixed: Floats, terms: Sequence[tuple[Indices, Floats]]) -> None:
        self.fixed, self.terms = fixed, terms
        self.rows = fixed.shape[0] * fixed.shape[1]

    def linear(self, y: Floats) -> Floats:
        """The part of the slack that is linear in (s, y), shape (n, r, r)."""
        return np.asarray(sum(y[at][:, None, None] * E for at, E in self.terms))

    def adjoint(self, matrix: Floats, total: Floats) -> None:
        """Add the inner products of the coefficients of (s, y) with symmetric matrices."""
        for at, E in self.terms:
            total[at] += np.einsum("nij,nij->n", E, matrix)

    def root(self, matrices: Floats) -> Floats:
        """The inverses of the lower triangular L with ``L L'`` each matrix; LinAlgError unless all are definite."""
        return np.asarray(np.linalg.inv(np.linalg.cholesky(matrices)))

    def inverse(self, root: Floats) -> Floats:
        """The inverses of the matrices of some roots."""
        return _turned(root) @ root

    def least(self, root: Floats, steps: Floats) -> float:
        """The least of the eigenvalues of matrices against those of some roots."""
        return float(np.linalg.eigvalsh(root @ steps @ _turned(root)).min())

    def schur(self, X: Floats, inverse: Floats, roots: tuple[Floats, Floats], M: Floats) -> None:
        """Add ``tr(E_i X E_j Z^-1)``."""
        for i, E in self.terms:
            left = E @ X
            for j, F in self.terms:
                M[i, j] += np.einsum("nij,nji->n", left, F @ inverse)


@one_thread()
def solve(program: Program) -> Optimum:
    """The least s (or the largest), with its multipliers and moments.

    LMIError where the program's own start is not strictly feasible in floating point.
    """
    maximise = program.highest is not None
    lengths = [np.linalg.norm(rows, axis=1) for rows in (program.left, program.right)]
    # A node that no force reaches has rows without a length: its multiplier weighs nothing.
    lengths = [np.where(length > 0, length, 1.0) for length in lengths]
    size = lengths[0] * lengths[1]
    if program.tie is not None:  # rows with one multiplier have one scale
        most = [np.max(program.tie * length[:, None], axis=0) for length in lengths]
        lengths, size = [values[program.tie.argmax(axis=1)] for values in most], most[0] * most[1]
    rows = [r / n[:, None] for r, n in zip((program.left, program.right), lengths, strict=True)]
    forms = [MatrixBlock(program, block, *rows) for block in program.blocks]
    blocks: list[MatrixBlock | Cones] = [*forms, *_cones(program, size)]
    cost = np.zeros(1 + len(size))
    cost[0] = -1.0 if maximise else 1.0
    order = sum(block.rows for block in blocks)

    y = np.concatenate([[program.s], program.y * size])
    Z = [block.fixed + block.linear(y) for block in blocks]
    try:
        roots = [block.root(z) for block, z in zip(blocks, Z, strict=True)]
    except np.linalg.LinAlgError:
        raise LMIError("no multipliers to start from: what the known ones leave is lost in rounding") from None
    inverse = [block.inverse(root) for block, root in zip(blocks, roots, strict=True)]
    weight = sum(np.vdot(form.free, z[0]) for form, z in zip(forms, inverse, strict=False))
    mu = abs(1 / weight)  # on the central path, except for the equation of s
    X = [mu * z for z in inverse]

    steps, converged, early = 0, False, None
    while steps < MOST_STEPS:
        gap = _inner(X, Z)
        near = gap <= program.stop.accuracy * max(abs(y[0]), SMALL)
        converged = near and np.abs(cost - _adjoint(blocks, X, len(cost))).max() <= program.stop.accuracy
        if early is None and gap <= EARLY * max(abs(y[0]), SMALL):
            early = float(y[0]), y[1:] / size
        if converged or y[0] < program.stop.enough:
            break
        M = np.zeros((len(cost),) * 2)
        try:
            roots_X = [block.root(x) for block, x in zip(blocks, X, strict=True)]
            for block, x, z, *both in zip(blocks, X, inverse, roots_X, roots, strict=True):
                block.schur(x, z, (both[0], both[1]), M)
            newton = _Newton(blocks=blocks, cost=cost, X=X, inverse=inverse, eliminate=_elimination(M))
            _, dZ, turned, dX = newton.step()
            along_Z, along_X = min(_longest(blocks, roots, dZ), 1.0), min(_longest(blocks, roots_X, dX), 1.0)
            left = _inner(_moved(X, along_X, dX), _moved(Z, along_Z, dZ)) / gap
            shorter = min(along_Z, along_X)
            centring = min(max(left, 0.0) ** max(1.0, 3 * shorter**2), 1.0)
            mu = centring * gap / order
            dy, dZ, _, dX = newton.step(
                [mu * z - symmetric(d @ t) for z, d, t in zip(inverse, dX, turned, strict=True)]
            )
            share = 0.9 + 0.09 * shorter
            along_Z = min(share * _longest(blocks, roots, dZ), 1.0)
            along_X = min(share * _longest(blocks, roots_X, dX), 1.0)
            trial = y + along_Z * dy
            Z_trial = [block.fixed + block.linear(trial) for block in blocks]
            roots = [block.root(z) for block, z in zip(blocks, Z_trial, strict=True)]
        except np.linalg.LinAlgError:  # rounding is larger than what is left
            break
        y, Z, X = trial, Z_trial, _moved(X, along_X, dX)
        inverse = [block.inverse(root) for block, root in zip(blocks, roots, strict=True)]
        steps += 1
    moments = np.zeros_like(program.fixed)
    for form, x in zip(forms, X, strict=False):
        moments[form.block, form.block] = x[0]
    return Optimum(s=float(y[0]), y=y[1:] / size, moments=moments, steps=steps, converged=bool(converged), early=early)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Newton:
    """The equations of one step: the dual constraints, ``Z = fixed + linear(y)`` and ``X Z = centre``, linearised."""

    blocks: list[MatrixBlock | Cones]
    cost: Floats
    X: list[Floats]
    inverse: list[Floats]
    eliminate: Callable[[Floats], Floats]

    def step(self, wanted: list[Floats] | None = None) -> tuple[Floats, list[Floats], list[Floats], list[Floats]]:
        """The changes of (s, y) and Z, the latter times Z^-1, and the change of X.

        ``wanted`` is the centre times Z^-1 without the terms of second order of ``X Z``; 0 by default.
        """
        right = -self.cost if wanted is None else _adjoint(self.blocks, wanted, len(self.cost)) - self.cost
        dy = self.eliminate(right)
        dZ = [block.linear(dy) for block in self.blocks]
        turned = [d @ z for d, z in zip(dZ, self.inverse, strict=True)]
        dX = [-x - symmetric(x @ t) for x, t in zip(self.X, turned, strict=True)]
        return dy, dZ, turned, dX if wanted is None else _moved(wanted, 1.0, dX)


def _adjoint(blocks: list[MatrixBlock | Cones], matrices: list[Floats], size: int) -> Floats:
    total = np.zeros(size)
    for block, matrix in zip(blocks, matrices, strict=True):
        block.adjoint(matrix, total)
    return total


def _cones(program: Program, size: Floats) -> list[Cones]:
    """The inequalities of the multipliers, and ``s <= highest``, as small blocks."""
    tau, a, b = program.cones.T
    alone = np.setdiff1d(np.arange(len(size)), np.concatenate([a, b]))  # 4 a b >= tau^2 implies a, b >= 0
    one = np.ones((len(alone), 1, 1))
    blocks = [Cones(0 * one, [(1 + alone, one)])]
    limited = np.flatnonzero(np.isfinite(program.most))
    if len(limited):
        most = (program.most[limited] * size[limited])[:, None, None]
        blocks.append(Cones(most, [(1 + limited, -np.ones_like(most))]))
    if program.highest is not None:
        blocks.append(Cones(np.full((1, 1, 1), program.highest), [(np.array([0]), -np.ones((1, 1, 1)))]))
    if len(tau):
        E = np.zeros((3, len(tau), 2, 2))
        E[0, :, 0, 1] = E[0, :, 1, 0] = np.sqrt(size[a] * size[b]) / size[tau] / 2
        E[1, :, 0, 0] = E[2, :, 1, 1] = 1.0
        blocks.append(Cones(np.zeros((len(tau), 2, 2)), [(1 + i, e) for i, e in zip((tau, a, b), E, strict=True)]))
    return blocks


def _elimination(M: Floats) -> Callable[[Floats], Floats]:
    """``r -> M^-1 r`` for a positive definite M, scaled to a unit diagonal and refined once."""
    diagonal = np.diag(M)
    if not (diagonal > 0).all():
        raise np.linalg.LinAlgError("not positive definite")
    scale = 1 / np.sqrt(diagonal)
    scaled = M * np.outer(scale, scale)
    for shift in SHIFTS:
        try:
            factor = cho_factor(scaled + shift * np.eye(len(M)), check_finite=False)
            break
        except np.linalg.LinAlgError:
            if shift == SHIFTS[-1]:
                raise
    once = lambda r: scale * cho_solve(factor, scale * r, check_finite=False)

    def eliminate(r: Floats) -> Floats:
        found = once(r)
        return np.asarray(found + once(r - M @ found))

    return eliminate


def _turned(matrices: Floats) -> Floats:
    return np.swapaxes(matrices, -1, -2)


def _inner(X: list[Floats], Z: list[Floats]) -> float:
    return float(sum(np.vdot(x, z) for x, z in zip(X, Z, strict=True)))


def _moved(matrices: list[Floats], along: float, steps: list[Floats]) -> list[Floats]:
    return [m + along * d for m, d in zip(matrices, steps, strict=True)]


def _longest(blocks: list[MatrixBlock | Cones], roots: list[Floats], steps: list[Floats]) -> float:
    """Largest step, at most, along which matrices with these roots stay positive semidefinite."""
    low = min(block.least(root, step) for block, root, step in zip(blocks, roots, steps, strict=True))
    return -1 / low if low < 0 else math.inf


def _least(L: Floats, step: Floats) -> float:
    """A lower bound, close to it, of the least eigenvalue of ``L^-1 step L'^-1``, by the method of Lanczos.

    An eigenvalue lies within the norm of its residual of each Ritz value; that the least one does is not sure, and
    where a step leaves the cone the factorisation that follows refuses it.
    """
    diagonal, beside = np.empty(LANCZOS), np.empty(LANCZOS)
    v = np.cos(np.arange(len(L)) ** 2)  # no special direction
    v, before, length = v / math.sqrt(v @ v), np.zeros(len(L)), 0.0
    for k in range(LANCZOS):
        image = dtrsv(L, dsymv(1.0, step.T, dtrsv(L, v, lower=1, trans=1)), lower=1) - length * before
        diagonal[k] = image @ v
        image -= diagonal[k] * v
        beside[k] = length = math.sqrt(image @ image)
        exhausted = length <= EXHAUSTED * abs(diagonal[: k + 1]).max()
        if k % 5 == 4 or exhausted or k == LANCZOS - 1:
            values, vectors, _ = dstev(diagonal[: k + 1], beside[: max(k, 1)])
            residual = length * abs(vectors[-1, 0])
            if residual <= NEAR * abs(values[0]) or exhausted:
                break
        v, before = image / length, v
    return float(values[0] - residual)

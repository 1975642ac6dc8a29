"""The best quadratic norm for all pieces of T_theta on a small periodic mesh: by programs and enumeration."""

from __future__ import annotations

import warnings
from contextlib import suppress
from itertools import product

import cvxpy as cp
import numpy as np
from sequences import Sequences

from verification.interface.pair import ContactPair

#: How closely the least factor of some pieces is known, and how near to it one of all pieces ends the search.
NEAR, ENOUGH = 5e-4, 5e-3

#: The largest |g|_Q^2 over the norm (5.21), the least being 1.
CONDITION = 1e4

#: Pieces in turn that a program has another time.
WORST = 8


def symmetries(n: int) -> np.ndarray:
    """Moves by two nodes and reflections at node 0, as matrices of forces: alternating cells stay the same."""
    reflected = np.kron(np.diag([-1.0, 1.0]), np.roll(np.eye(n)[::-1], 1, axis=0))
    moves = [np.kron(np.eye(2), np.roll(np.eye(n), 2 * i, axis=0)) for i in range(n // 2)]
    return np.array(moves + [reflected @ move for move in moves])


def different(n: int) -> np.ndarray:
    """All patterns, one of those that symmetries make of each other, shape (m, n)."""
    patterns = np.array(list(product(range(6), repeat=n)), dtype=np.int8)
    mirrored = np.array([0, 2, 1, 3, 5, 4], dtype=np.int8)[np.roll(patterns[:, ::-1], 1, axis=1)]
    powers = 6 ** np.arange(n)
    names = [np.roll(some, 2 * i, axis=1) @ powers for some in (patterns, mirrored) for i in range(n // 2)]
    return patterns[patterns @ powers == np.min(names, axis=0)]


class CommonNorm:
    """Norms ``g' Q g`` with the symmetries of a mesh, in coordinates in which (5.21) is Euclidean."""

    def __init__(self, pair: ContactPair, theta: float) -> None:
        root, n = pair.neumann.root, pair.contact.grid.n
        pieces = Sequences(pair, theta).jacobians(different(n))
        self.pieces = np.linalg.solve(root, pieces @ root)
        moves = np.linalg.solve(root, symmetries(n) @ root)
        units = np.eye((2 * n) ** 2).reshape(-1, 2 * n, 2 * n)
        means = sum(move.T @ (units + units.swapaxes(1, 2)) @ move for move in moves)
        _, sizes, rows = np.linalg.svd(means.reshape(len(units), -1))
        self.basis = rows[sizes > 1e-9 * sizes[0]].reshape(-1, 2 * n, 2 * n)

    def factors(self, Q: np.ndarray, pieces: np.ndarray) -> np.ndarray:
        """|J|_Q of pieces, shape (m,)."""
        root = np.linalg.cholesky(Q).T
        return np.linalg.norm(root @ np.linalg.solve(root.T, pieces.swapaxes(1, 2)).swapaxes(1, 2), 2, axis=(1, 2))

    def serves(self, pieces: np.ndarray, q: float) -> np.ndarray | None:
        """A norm in which some pieces contract by q; None where a solver finds none."""
        y, spare, size = cp.Variable(len(self.basis)), cp.Variable(), len(self.basis[0])
        Q = cp.reshape(self.basis.reshape(len(self.basis), -1).T @ y, (size, size), order="C")
        limits = [Q >> np.eye(size), Q << CONDITION * np.eye(size), spare >= -1]
        limits += [q**2 * Q - J.T @ Q @ J + spare * np.eye(size) >> 0 for J in pieces]
        with warnings.catch_warnings(), suppress(cp.SolverError):
            warnings.simplefilter("ignore")  # an inaccurate answer is checked all the same
            cp.Problem(cp.Minimize(spare), limits).solve(solver=cp.CLARABEL)
        if Q.value is None or not np.linalg.eigvalsh(Q.value)[0] > 0:
            return None
        return Q.value if self.factors(Q.value, pieces).max() <= q * (1 + NEAR) else None

    def least(self, low: float, high: float) -> tuple[float, float]:
        """Two factors: programs find no norm with a smaller one than the first, and one with the second for all pieces.

        Parameters
        ----------
        low, high : float
            A factor that no norm beats, and one that some norm has.
        """
        alone = self.factors(np.eye(len(self.basis[0])), self.pieces)
        chosen, best = list(np.argsort(alone)[-WORST:]), float(alone.max())
        while True:
            q, Q = high, self.serves(self.pieces[chosen], high)
            assert Q is not None
            while q - low > NEAR * q:
                found = self.serves(self.pieces[chosen], (low + q) / 2)
                low, q, Q = ((low + q) / 2, q, Q) if found is None else (low, (low + q) / 2, found)
            factors = self.factors(Q, self.pieces)
            best = min(best, float(factors.max()))
            if best <= low * (1 + ENOUGH):
                return low, best
            chosen += [i for i in np.argsort(factors)[-WORST:] if i not in chosen]

"""Sequences of affine pieces of T_theta, and the search for those of a large spectral radius.

A pattern has a digit for each contact node: 0, 1, 2 where it touches and sticks, slides along its tangent or against it
(with S sigma_N of one sign); 3, 4, 5 where it is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from verification.algorithm.affine_piece import Piece
from verification.contact.active_set import Pattern
from verification.interface.pair import ContactPair

#: The direction of slip of each digit.
SLIDES = np.array([0, 1, -1, 0, 1, -1], dtype=np.int8)

#: By less a change is no progress.
LEAST = 1e-9


def digits(text: str) -> np.ndarray:
    """A pattern, or several with blanks between them, shape (m, n)."""
    return np.array([[int(digit) for digit in word] for word in text.split()])


def piece(pair: ContactPair, pattern: np.ndarray) -> Piece:
    """The piece of a pattern."""
    state = Pattern(touching=pattern < 3, sliding=SLIDES[pattern])
    n = len(pattern)
    return Piece(pair=pair, pattern=state, sign=np.ones(n, dtype=np.int8), still=np.zeros(n, dtype=bool))


def regular(n: int, longest: int) -> np.ndarray:
    """All patterns that repeat after 1 to ``longest`` nodes, shape (m, n)."""
    patterns = [np.resize(part, n) for length in range(1, longest + 1) for part in product(range(6), repeat=length)]
    return np.unique(np.array(patterns), axis=0)


class Sequences:
    """T_theta of one pair, on one grid, on pieces one after the other.

    Parameters
    ----------
    moved : int
        Nodes by which pieces move after each sequence: on a mesh that does not change if it is moved so far the
        sequence is repeated until all are where they were.
    """

    def __init__(self, pair: ContactPair, theta: float, moved: int = 0) -> None:
        self.n, self.theta = pair.contact.grid.n, theta
        self.flexible, self.carried = pair.contact.inverse, pair.neumann.flexibility(np.eye(2 * self.n))
        self.bound = np.zeros((self.n, 2 * self.n))
        weights = float(pair.friction) * pair.contact.grid.weights
        self.bound[:, self.n :] = weights[:, None] * pair.interface.kernel
        self.move = np.kron(np.eye(2), np.roll(np.eye(self.n), moved, axis=0))
        self.size = np.abs(self.flexible).max()

    def jacobians(self, patterns: np.ndarray) -> np.ndarray:
        """J of T_theta on the pieces of some patterns, shape (m, 2 n, 2 n): forces or jumps are known at each node."""
        slides = SLIDES[patterns]
        known = np.concatenate([slides != 0, patterns >= 3], axis=1)[:, :, None]
        force = np.zeros((len(patterns), 2 * self.n, 2 * self.n))
        force[:, : self.n] = slides[:, :, None] * self.bound
        matrix = np.where(known, self.size * np.eye(2 * self.n), self.flexible)
        found = np.linalg.solve(matrix, np.where(known, self.size * force, -self.carried))
        return self.theta * found + (1 - self.theta) * np.eye(2 * self.n)

    def radius(self, patterns: np.ndarray) -> float:
        """The spectral radius of a sequence to the power 1/m: no norm that serves all pieces has a smaller factor."""
        return float(self.radii(self.product(self.jacobians(patterns))[None])[0]) ** (1 / len(patterns))

    def climb(self, patterns: np.ndarray) -> tuple[np.ndarray, float]:
        """Change one node in one pattern, that which helps most, as long as that helps; the sequence and its radius."""
        patterns, best = patterns.copy(), self.radius(patterns)
        while True:
            pieces, level = self.jacobians(patterns), best + LEAST
            for i, pattern in enumerate(patterns):
                beside = self.beside(pattern)
                before, after = self.product(pieces[:i], move=False), self.product(pieces[i + 1 :])
                radii = self.radii(after @ self.jacobians(beside) @ before) ** (1 / len(patterns))
                if radii.max() > level:
                    level, chosen = float(radii.max()), (i, beside[radii.argmax()])
            if level == best + LEAST:
                return patterns, best
            patterns[chosen[0]], best = chosen[1], level

    def search(self, random: np.random.Generator, *, length: int, starts: int) -> tuple[np.ndarray, float]:
        """The best sequence of some length from random starts."""
        found = (self.climb(random.integers(0, 6, (length, self.n))) for _ in range(starts))
        return max(found, key=lambda result: result[1])

    def product(self, matrices: Sequence[np.ndarray], *, move: bool = True) -> np.ndarray:
        """The last matrix times .. times the first one, moved."""
        total = np.eye(2 * self.n)
        for matrix in matrices:
            total = matrix @ total
        return self.move @ total if move else total

    def radii(self, matrices: np.ndarray) -> np.ndarray:
        """The spectral radius of each matrix, shape (m,)."""
        return np.abs(np.linalg.eigvals(matrices)).max(axis=1)

    def beside(self, pattern: np.ndarray) -> np.ndarray:
        """The patterns that differ at one node."""
        node, state = np.nonzero(np.arange(6) != pattern[:, None])
        beside = np.repeat(pattern[None], len(node), axis=0)
        beside[np.arange(len(node)), node] = state
        return beside

"""Growth of an error in the slip from which an increment of a loading history starts: bounds, and pairs that attain it.

With the flexibility W of both bodies at Gamma_c, contact forces lambda on body 2 change the jump d by ``-W lambda``.
The norm of a tangential jump s is ``|s|_K^2 = s' (W^-1)_TT s``.  The page on loading histories has the proofs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fem1d2d.mesh import Bools, Floats
from verification.algorithm.monolithic import contact_system
from verification.contact.active_set import Signs
from verification.contact.system import ContactSystem
from verification.interface.assembly import TwoBodies, discretise
from verification.problem import Problem
from verification.semidefinite import LARGEST
from verification.semidefinite.interior_point import Program, solve

#: The program starts with kappa^2 nearer to 1 by this share, and with multipliers and s larger by it: strictly inside.
INSIDE = 0.1

#: A friction bound that is this share of the largest one is 0: the hat of the kernel ends at a node, up to rounding.
NONE = 1e-12

#: A pattern takes the place of another one if its factor is larger by this.
GROWS = 1e-9

#: By node: open or touches; and slips to one side, sticks, slips to the other.  Rows: touches, slips; columns: nodes.
Patterns = Signs

#: All states of one node.
STATES = np.array([[a, b] for a in (0, 1) for b in (-1, 0, 1)], dtype=np.int8)


@dataclass(frozen=True, kw_only=True, eq=False)
class GrowingPair:
    """Two slips at the start of an increment, and the growth of their distance.

    ``factor`` is ``|t - t~|_K / |s - s~|_K`` for the slips t at the end, ``jump``, shape (2 n,), the jump that the
    loads cause without contact forces, less the gap; ``slips`` have the shape (n,).
    """

    factor: float
    jump: Floats
    slips: tuple[Floats, Floats]


class SlipErrors:
    """The map of an increment from the slip at its start to the slip at its end.

    Raises
    ------
    ValueError
        Bodies in 1D, a contact node that is held, a body that contact alone holds, more nodes than
        :data:`verification.semidefinite.LARGEST`, or no friction: then the slip at the start does not enter.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> errors = SlipErrors(example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2"))
    >>> print(f"{errors.closed:.3f} {errors.bound:.4f}")
    1.239 1.0068
    """

    def __init__(self, problem: Problem | TwoBodies) -> None:
        bodies = problem if isinstance(problem, TwoBodies) else discretise(problem)
        system = contact_system(bodies)
        self.W, self.friction, self.weights = system.W, system.friction, bodies.interface.contact.weights
        self.n = n = system.t
        if not 0 < n <= LARGEST or system.M.shape[1] or not system.flexible.all() or not self.friction.any():
            raise ValueError(f"needed friction and 1 to {LARGEST} free contact nodes of held plane bodies")
        self.K, self.K_0 = np.linalg.inv(self.W)[:n, :n], np.linalg.inv(self.W[:n, :n])

    @cached_property
    def _root(self) -> Floats:
        """R with ``|s|_K = |R s|``."""
        return np.asarray(np.linalg.cholesky(self.K).T)

    @cached_property
    def kappa(self) -> float:
        """``k sup |S lambda_N| / |lambda|_W`` times ``sup |s| / |s|_{K_0}``, with ``|.|`` in L^2(Gamma_c)."""
        felt = np.zeros_like(self.W)
        felt[self.n :, self.n :] = self.friction.T @ (self.friction / self.weights[:, None])
        return math.sqrt(_largest(felt, self.W) * self._spread)

    @cached_property
    def _spread(self) -> float:
        return _largest(np.diag(self.weights), self.K_0)

    @cached_property
    def mu(self) -> float:
        """``sup |s|_K / |s|_{K_0}``: 1 where pressure causes no slip."""
        return math.sqrt(_largest(self.K, self.K_0))

    @cached_property
    def closed(self) -> float:
        """The bound ``mu / sqrt(1 - kappa^2)`` of the factor; inf unless kappa < 1."""
        return self.mu / math.sqrt(1 - self.kappa**2) if self.kappa < 1 else math.inf

    @property
    def bound(self) -> float:
        """The bound by multipliers, in doubles: not above the closed one; inf unless kappa < 1."""
        return min(self.closed, math.sqrt(solve(self.program()).s)) if self.kappa < 1 else math.inf

    def program(self) -> Program:
        """The program of the least square of a bound, which starts from the multipliers of the closed one.

        In coordinates of energy for (s, d): ``l^2 |s|_K^2 - |d_T|_K^2`` less the multiplied conditions of each node,
        ``lambda_N d_N >= 0`` and ``lambda_T y + a b^2 + c y^2 >= 0`` with ``4 a c >= 1``, where ``y = d_T - s`` and b
        is the change of the friction bound.
        """
        n = self.n
        slip, jump, force = np.zeros((3, 2 * n, 3 * n))
        root = np.linalg.cholesky(self.W)
        slip[:n, :n], jump[:, n:], force[:, n:] = np.linalg.inv(self._root), root, -np.linalg.inv(root).T
        y, felt, i = (jump - slip)[:n], self.friction @ force[n:], np.arange(n)
        wider = (1 - INSIDE) * self.kappa**2 + INSIDE
        m = (1 + INSIDE) * self.mu**2 / (1 - wider)
        of_bound, of_slip = m * self._spread * wider / self.kappa**2 / self.weights, m * self.weights / self._spread
        return Program(
            fixed=-jump[:n].T @ self.K @ jump[:n],
            free=slip[:n].T @ self.K @ slip[:n],
            left=np.vstack([force[n:], force[:n], felt, y]),
            right=np.vstack([jump[n:], y, felt, y]),
            cones=np.stack([n + i, 2 * n + i, 3 * n + i], axis=1),
            most=np.full(4 * n, np.inf),
            s=(1 + INSIDE) * m,
            y=np.concatenate([np.full(2 * n, 2 * m), of_bound, of_slip]),
        )

    def jacobians(self, patterns: Patterns) -> Floats:
        """dt/ds on the affine pieces of some patterns, shape (patterns, 2, n)."""
        n, (touches, slips) = self.n, np.moveaxis(patterns, 1, 0)[..., None]
        identity = np.eye(2 * n)
        tied = np.concatenate([slips == 0, touches == 1], axis=1)
        rows = np.where(tied, self.W, identity)
        rows[:, :n, n:] -= slips * self.friction
        return self.W[:n] @ np.linalg.solve(rows, identity[:, :n] * tied)

    def factors(self, patterns: Patterns) -> Floats:
        """Norms of the Jacobians, by ``|.|_K``; 0 for patterns that no loads cause."""
        found = np.linalg.norm(self._root @ self.jacobians(patterns) @ np.linalg.inv(self._root), 2, axis=(1, 2))
        return np.where(self.possible(patterns), found, 0.0)

    def possible(self, patterns: Patterns) -> Bools:
        """True for patterns that some loads cause: a node sticks where it has a friction bound."""
        bound, none = patterns[:, 0] @ self.friction.T, NONE * self.friction.sum(axis=1).max()
        return np.asarray(np.where(patterns[:, 1] == 0, bound > none, bound > -none).all(axis=1))

    def search(self, random: np.random.Generator, starts: int = 3) -> GrowingPair:
        """The pair of the largest factor that was found: states of single nodes change as long as it grows."""
        best, most = None, 0.0
        for _ in range(starts):
            pattern, value = np.stack([np.ones(self.n), random.choice([-1, 0, 1], self.n)]).astype(np.int8), 0.0
            while True:
                others = np.repeat(pattern[None], len(STATES) * self.n, axis=0)
                for j in range(self.n):
                    others[j * len(STATES) : (j + 1) * len(STATES), :, j] = STATES
                found = self.factors(others)
                if found.max() <= value + GROWS:
                    break
                pattern, value = others[found.argmax()], found.max()
            if best is None or value > most:
                best, most = pattern, value
        assert best is not None
        return self.pair(best)

    def pair(self, pattern: Patterns) -> GrowingPair:
        """Two slips and loads for which an increment ends on the piece of a pattern, so that its factor is attained."""
        n, (touches, slips) = self.n, pattern.astype(float)
        bound = self.friction @ touches
        force = np.concatenate([slips * bound, touches])
        size = np.abs(self.W @ force).max()
        jump = self.W @ force + size * np.concatenate([slips, touches - 1])
        _, lengths, along = np.linalg.svd(self._root @ self.jacobians(pattern[None])[0] @ np.linalg.inv(self._root))
        error = np.linalg.solve(self._root, along[0])
        error *= 1e-4 * size * bound.max() / np.abs(error).max()  # so small that no state changes
        return GrowingPair(factor=float(lengths[0]), jump=jump, slips=(np.zeros(n), error))

    def end(self, jump: Floats, slip: Floats) -> Floats:
        """The slip at the end of an increment by the global method, for the ``jump`` of a :class:`GrowingPair`."""
        system = ContactSystem(self.W, jump - np.concatenate([slip, np.zeros(self.n)]), self.friction)
        return np.asarray(system.jump(system.solve().force, np.zeros(0))[: self.n] + slip)


def _largest(A: NDArray[Any], B: NDArray[Any]) -> float:
    return float(eigh(A, B, eigvals_only=True)[-1])

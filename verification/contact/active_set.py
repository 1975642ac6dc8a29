"""Step II exactly: guess which nodes touch and slip, solve the linear system, mend the guess."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fem1d2d.mesh import Floats
from verification.value import Value

#: Signs are read with this slack relative to the largest force, so that rounding does not flip a node for ever.
SLACK = 1e-14

#: A guess is mended at most so often; a few suffice unless it cycles.
LIMIT = 60


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Pattern(Value):
    """What each contact node does.

    Attributes
    ----------
    touching : bool array, shape (n,)
    sliding : int array, shape (t,)
        0 where the node sticks, else the sign of its slip and of its friction force.
    """

    touching: NDArray[np.bool_]
    sliding: NDArray[np.int8]

    @property
    def summary(self) -> str:
        return f"{int(self.touching.sum())} of {len(self.touching)} nodes touch, {int((self.sliding != 0).sum())} slide"

    @property
    def key(self) -> bytes:
        """Equal for equal patterns."""
        return self.touching.tobytes() + self.sliding.tobytes()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pattern) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    @classmethod
    def sticking(cls, n: int, tangential: int) -> Pattern:
        """Every node touches and sticks."""
        return cls(touching=np.ones(n, dtype=bool), sliding=np.zeros(tangential, dtype=np.int8))

    @classmethod
    def of(cls, v: Floats, force: Floats, bound: Floats, stiffness: float) -> Pattern:
        """Read the pattern off an approximate solution: the nearer branch of each condition."""
        t = len(bound)
        slips = np.abs(v[:t]) * stiffness > bound - np.abs(force[:t])
        sign = np.where(v[:t] != 0, np.sign(v[:t]), np.sign(force[:t]))
        return cls(touching=force[t:] > -v[t:] * stiffness, sliding=(slips * sign).astype(np.int8))


class ActiveSet:
    """The solver for one stiffness matrix; remembers the last factorisation.

    Parameters
    ----------
    S : array, shape (t + n, t + n)
        Symmetric, positive definite on the free components.
    free : bool array, shape (t + n,)
    tangential : int
        t.
    """

    def __init__(self, S: Floats, free: NDArray[np.bool_], tangential: int) -> None:
        self._S, self._free, self._t = S, free, tangential
        self._last: tuple[bytes, NDArray[np.intp], tuple[NDArray[np.float64], bool]] | None = None

    def _moving(self, pattern: Pattern) -> tuple[NDArray[np.intp], tuple[NDArray[np.float64], bool] | None]:
        moves = np.concatenate([pattern.sliding != 0, ~pattern.touching]) & self._free
        key = moves.tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1], self._last[2]
        rows = np.flatnonzero(moves)
        if len(rows) == 0:
            return rows, None
        factor = cho_factor(self._S[np.ix_(rows, rows)], check_finite=False)
        self._last = key, rows, factor
        return rows, factor

    def equilibrium(self, q: Floats, bound: Floats, pattern: Pattern) -> tuple[Floats, Floats]:
        """v and force for a given pattern: v = 0 where a node touches or sticks, the friction bound where it slides."""
        rows, factor = self._moving(pattern)
        v = np.zeros_like(q)
        if factor is not None:
            right = q.copy()
            right[: self._t] -= bound * pattern.sliding
            v[rows] = cho_solve(factor, right[rows], check_finite=False)
        force = q - self._S @ v
        force[self._t :][~pattern.touching] = 0.0  # what the pattern says holds exactly; the certificate sees the rest
        slides = pattern.sliding != 0
        force[: self._t][slides] = (bound * pattern.sliding)[slides]
        return v, force

    def solve(self, q: Floats, bound: Floats, start: Pattern) -> tuple[Floats, Floats, Pattern] | None:
        """Mend the pattern until every sign agrees.

        A touching node that pulls opens, an open one that penetrates touches; a sticking node above its bound slides
        the way it is pushed; a sliding one of the wrong sign goes to stick, never straight to the opposite slip, which
        would cycle.  A node whose bound is zero slides.

        Returns
        -------
        v, force : array, shape (t + n,)
        pattern : Pattern
            None instead of the three where the pattern does not settle.
        """
        t, free = self._t, self._free[: self._t]
        largest = max(float(np.abs(q).max(initial=0.0)), float(bound.max(initial=0.0)))
        force_slack = SLACK * largest
        length_slack = force_slack / float(np.diag(self._S).max())
        smooth = (bound == 0) & free
        pattern = start
        seen: set[bytes] = set()
        for _ in range(LIMIT):
            sliding = np.where(free, pattern.sliding, 0)
            sliding = np.where(smooth & (sliding == 0), 1, sliding).astype(np.int8)
            pattern = Pattern(touching=pattern.touching, sliding=sliding)
            if pattern.key in seen:
                return None
            seen.add(pattern.key)
            v, force = self.equilibrium(q, bound, pattern)
            touching = np.where(pattern.touching, force[t:] >= -force_slack, v[t:] > length_slack)
            pushed = np.where(np.abs(force[:t]) > bound + force_slack, np.sign(force[:t]), 0)
            kept = np.where(sliding * v[:t] >= -length_slack, sliding, 0)
            mended = np.where(free, np.where(smooth, sliding, np.where(sliding == 0, pushed, kept)), 0).astype(np.int8)
            following = Pattern(touching=touching, sliding=mended)
            if following == pattern:
                return v, force, pattern
            pattern = following
        return None

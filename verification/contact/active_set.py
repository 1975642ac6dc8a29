"""Step II exactly: guess which nodes touch and slip, solve the linear system, correct the guess."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Bools, Floats
from verification.dense import STILL, Cholesky, vanishing, worst
from verification.value import Value

#: 0 or a sign at each node, as of its slip.
Signs = NDArray[np.int8]

#: Signs are read with this slack relative to the largest force, so that rounding does not flip a node for ever.
SLACK = 1e-14

#: Corrections of a guess, at most, besides one for each node: the border of a zone may move by one node at a time.
LIMIT = 60

#: Numbers (32 MB) of the linear systems that are kept: a run that comes back to a pattern finds its system there.
KEPT = 4_000_000


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Pattern(Value):
    """Contact state of each node.

    ``touching`` has the shape (n,); ``sliding``, shape (t,), is 0 where the node sticks, else the sign of its slip and
    of its friction force.
    """

    touching: Bools
    sliding: Signs

    @property
    def summary(self) -> str:
        return f"{int(self.touching.sum())} of {len(self.touching)} nodes touch, {int((self.sliding != 0).sum())} slide"

    @cached_property
    def key(self) -> bytes:
        """Bytes that are equal for equal patterns."""
        return self.touching.tobytes() + self.sliding.tobytes()

    @cached_property
    def moves(self) -> Bools:
        """True where a component moves: where a node slides, and where it is open, shape (t + n,)."""
        return np.concatenate([self.sliding != 0, ~self.touching])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pattern) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    @classmethod
    def sticking(cls, n: int, tangential: int) -> Pattern:
        """Return the pattern in which every node touches and sticks."""
        return cls(touching=np.ones(n, dtype=bool), sliding=np.zeros(tangential, dtype=np.int8))

    @classmethod
    def of(cls, v: Floats, force: Floats, bound: Floats, stiffness: float) -> Pattern:
        """Read the pattern off an approximate solution: the nearer branch of each condition."""
        t = len(bound)
        slips = np.abs(v[:t]) * stiffness > bound - np.abs(force[:t])
        sign = np.where(v[:t] != 0, np.sign(v[:t]), np.sign(force[:t]))
        return cls(touching=force[t:] > -v[t:] * stiffness, sliding=(slips * sign).astype(np.int8))


class System:
    """The linear system that a pattern makes of step II.

    v = 0 where a node touches or sticks, the force is 0 where it is open and the friction bound where it slides.
    ``motions``, shape (t + n, k), is the kernel of S, where only contact holds the body.  Motions that the pattern
    leaves free, the columns of ``loose``, are pinned: the force does not depend on them, and where the loads work in
    one the equilibrium fails.
    """

    def __init__(self, S: Floats, free: Bools, pattern: Pattern, motions: Floats | None = None) -> None:
        self.pattern = pattern
        self._slides, self._open = pattern.sliding != 0, ~pattern.touching
        self.sign = pattern.sliding.astype(float)
        self.loose = None if motions is None else vanishing(motions, np.flatnonzero(~pattern.moves))
        self._rows = np.flatnonzero(pattern.moves & free)
        self._columns, self._factor = S[self._rows], Cholesky(S, self._rows, motions)

    def solve(self, q: Floats, bound: Floats) -> tuple[Floats, Floats]:
        """Return v and force, shape (t + n,) each."""
        t, friction = len(bound), bound * self.sign
        right = q.copy()
        right[:t] -= friction
        v = self._factor.solve(right)
        force: Floats = q - v[self._rows] @ self._columns
        # the conditions of the pattern hold exactly; the certificate checks the others
        np.putmask(force[t:], self._open, 0.0)
        np.putmask(force[:t], self._slides, friction)
        return v, force


class Systems:
    """The linear systems of the patterns of one stiffness matrix (see :class:`System`), each made once while in use."""

    def __init__(self, S: Floats, free: Bools, motions: Floats | None = None) -> None:
        made = lru_cache(maxsize=1 + KEPT // (2 * S.size + 1))
        self.of: Callable[[Pattern], System] = made(lambda pattern: System(S, free, pattern, motions))


class ActiveSet:
    """The solver for one stiffness matrix.

    ``S``, shape (t + n, t + n), is symmetric, positive definite on the ``free`` components orthogonal to the
    ``motions``, shape (t + n, k), its kernel where only contact holds the body; ``tangential`` is t.  ``systems`` of
    the same matrix are shared by solvers that run one after the other.
    """

    def __init__(
        self, S: Floats, free: Bools, tangential: int, motions: Floats | None = None, systems: Systems | None = None
    ) -> None:
        self._t, self._systems = tangential, systems or Systems(S, free, motions)
        self._held = None if free[:tangential].all() else ~free[:tangential]
        self._stiffness, self._limit = float(np.diag(S).max()), LIMIT + len(S) - tangential

    def _begin(self, start: Pattern, smooth: Bools, hint: Pattern | None) -> Pattern:
        """Return the first guess: no held node slides, every node whose bound is zero does.

        A hint takes the place of the start, except for the direction of nodes whose bound is zero: nothing mends that.
        """
        sliding = start.sliding
        if hint is not None:
            sliding = np.where(smooth, sliding, hint.sliding)
            start = Pattern(touching=hint.touching, sliding=sliding)
        if self._held is not None:
            sliding = np.where(self._held, 0, sliding)
        if np.count_nonzero(smooth):
            sliding = np.where(smooth & (sliding == 0), 1, sliding)
        return start if sliding is start.sliding else Pattern(touching=start.touching, sliding=sliding.astype(np.int8))

    def solve(
        self, q: Floats, bound: Floats, start: Pattern, hint: Pattern | None = None
    ) -> tuple[Floats, Floats, Pattern] | None:
        """Correct the pattern until every sign agrees: v, the force and the pattern; None where it does not settle.

        The first guess is ``hint`` where there is one.
        """
        seen: set[bytes] = set()
        for v, force, pattern, agrees in islice(self._guesses(q, bound, start, hint), self._limit):
            if agrees:
                return v, force, pattern
            if pattern.key in seen:
                return None
            seen.add(pattern.key)
        return None

    def repeated(self, q: Floats, bound: Floats, start: Pattern) -> Iterator[tuple[Floats, Floats, Pattern]]:
        """Yield the guesses that come again and again where the pattern does not settle; none where it does."""
        seen: list[bytes] = []
        for v, force, pattern, agrees in islice(self._guesses(q, bound, start), 2 * self._limit):
            times = seen.count(pattern.key)
            if agrees or times > 1:
                return
            seen.append(pattern.key)
            if times:
                yield v, force, pattern

    def _guesses(
        self, q: Floats, bound: Floats, pattern: Pattern, hint: Pattern | None = None
    ) -> Iterator[tuple[Floats, Floats, Pattern, bool]]:
        """Yield v and force of each guess and whether every sign agrees; the next guess is the last one mended.

        A touching node that pulls opens, an open one that penetrates touches; a sticking node above its bound slides
        the way it is pushed; a sliding one of the wrong sign goes to stick, never straight to the opposite slip, which
        would cycle.  A node whose bound is zero slides.  Where all nodes slide along a rigid motion :func:`_shifted`
        says which of them sticks.
        """
        t = self._t
        force_slack = SLACK * max(worst(np.abs(q)), worst(bound))
        length_slack = force_slack / self._stiffness
        smooth = bound == 0 if self._held is None else (bound == 0) & ~self._held
        pattern = self._begin(pattern, smooth, hint)
        while True:
            system = self._systems.of(pattern)
            v, force = system.solve(q, bound)
            # v_N = 0 where a node touches and force_N = 0 where it is open, so that each sign is about the others
            pulls, enters = force[t:] < -force_slack, v[t:] > length_slack
            pushed, back = np.abs(force[:t]) > bound + force_slack, system.sign * v[:t] < -length_slack
            if np.count_nonzero(back):
                back &= ~smooth
            if self._held is not None:
                pushed &= ~self._held
            yield v, force, system.pattern, not any(map(np.count_nonzero, (pulls, enters, pushed, back)))
            sliding = _shifted(system, q, bound, v)
            if sliding is None:
                sliding = np.where(pushed, np.sign(force[:t]), np.where(back, 0, pattern.sliding))
            pattern = Pattern(touching=pattern.touching & ~pulls | enters, sliding=sliding.astype(np.int8))


def _shifted(system: System, q: Floats, bound: Floats, v: Floats) -> Floats | None:
    """Return the slips after the shift in a rigid motion that lessens the energy most; None where there is none.

    If every node slides, nothing in the system of the pattern resists a motion z along Gamma_c, and v is known up to a
    multiple of it.  The energy ``sum_j bound_j |v_j + s z_j| - s q' z`` is least where the friction of the nodes whose
    slip s has reversed outweighs the loads: the node at which it does sticks.
    """
    if system.loose is None or system.loose.shape[1] != 1:
        return None
    t, z = len(bound), system.loose[:, 0]
    if np.abs(z[t:]).max() > STILL:
        return None
    rubs = np.flatnonzero((bound > 0) & (np.abs(z[:t]) > STILL))
    shifts, friction = -v[rubs] / z[rubs], bound[rubs] * np.abs(z[rubs])
    order = np.argsort(shifts)
    slope = 2 * np.cumsum(friction[order]) - friction.sum() - float(q @ z)
    if not len(rubs) or slope[-1] < 0 or slope[0] - 2 * friction[order[0]] > 0:
        return None  # the loads move the body off
    last = order[int(np.argmax(slope >= 0))]
    sliding = system.sign.copy()
    sliding[rubs] = np.sign(v[rubs] + shifts[last] * z[rubs])
    sliding[rubs[last]] = 0
    return sliding

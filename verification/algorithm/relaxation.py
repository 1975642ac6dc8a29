"""How the next g is chosen: constant relaxation and what may take its place.

A rule sees the states one by one and answers with the next g at which T is evaluated.  Only the constant factor is
inside the theorem; momentum has a proved rate without friction; the others have none.  Inner products are those of the
norm (5.21), so that no rule knows the units.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import piece_of
from verification.algorithm.iterate import State
from verification.interface.pair import Pair
from verification.problem.specification import Relaxation

#: How many earlier steps Anderson mixing remembers.
DEPTH = 10

#: Columns of the least-squares problem of Anderson mixing are dropped below this share of the largest.
RANK = 1e-8

#: The line search of the Newton rule shortens a step by a factor in this range, and gives up below the last length.
SHORTEST, LONGEST, TOO_SHORT = 0.1, 0.7, 1e-2


class Rule(ABC):
    """A relaxation rule; keeps what it remembers of earlier states.

    Parameters
    ----------
    pair : Pair
    theta : float
        The constant factor, or the first one.
    """

    def __init__(self, pair: Pair, theta: float) -> None:
        self.pair, self.theta = pair, theta

    @abstractmethod
    def __call__(self, state: State) -> Floats:
        """The g at which T is evaluated next."""

    def inner(self, a: Floats, b: Floats) -> float:
        """The inner product of the norm (5.21)."""
        return float(a @ self.pair.neumann.flexibility(b))


class Constant(Rule):
    """(III): ``g <- theta T g + (1 - theta) g``."""

    def __call__(self, state: State) -> Floats:
        return self.theta * state.image + (1 - self.theta) * state.g


class Aitken(Rule):
    """Aitken's factor ``theta <- -theta <r', r - r'> / |r - r'|^2`` from the last two residuals ``r = T g - g``."""

    def __init__(self, pair: Pair, theta: float) -> None:
        super().__init__(pair, theta)
        self._last: Floats | None = None

    def __call__(self, state: State) -> Floats:
        r = state.image - state.g
        if self._last is not None:
            change = r - self._last
            size = self.inner(change, change)
            if size > 0:
                self.theta *= -self.inner(self._last, change) / size
        self._last = r
        return state.g + self.theta * r


class Anderson(Rule):
    """Anderson mixing: the combination of the last g whose residuals have the least sum, relaxed by theta."""

    def __init__(self, pair: Pair, theta: float) -> None:
        super().__init__(pair, theta)
        self._g: list[Floats] = []
        self._r: list[Floats] = []

    def __call__(self, state: State) -> Floats:
        r = state.image - state.g
        self._g.append(state.g)
        self._r.append(r)
        del self._g[: -DEPTH - 1], self._r[: -DEPTH - 1]
        following: Floats = state.g + self.theta * r
        if len(self._g) > 1:
            coordinates = self.pair.neumann.root.T @ self.pair.neumann.flexibility(np.column_stack(self._r))
            changes = np.diff(coordinates, axis=1)
            shares = np.linalg.lstsq(changes, coordinates[:, -1], rcond=RANK)[0]
            moved = np.diff(np.column_stack(self._g), axis=1) + self.theta * np.diff(np.column_stack(self._r), axis=1)
            following -= moved @ shares
        return following


class Newton(Rule):
    """``g <- g + (1 - T')^-1 (T g - g)`` with T' on the affine piece of g, and a line search on the residual.

    A step that does not lessen the residual is shortened to where the chord between both residuals comes closest to 0;
    each trial costs an evaluation of T.  Where that fails, one step with theta leads to another piece.
    """

    def __init__(self, pair: Pair, theta: float) -> None:
        super().__init__(pair, theta)
        self._from: State | None = None
        self._step: Floats
        self._length = 1.0

    def __call__(self, state: State) -> Floats:
        start = self._from
        if start is None or state.residual < start.residual:
            return self._set_out(state)
        r = start.image - start.g
        change = state.image - state.g - r
        size = self.inner(change, change)
        share = -self.inner(r, change) / size if 0 < size < math.inf else SHORTEST
        self._length *= min(max(share, SHORTEST), LONGEST)
        if self._length < TOO_SHORT:
            self._from = None
            return start.g + self.theta * r
        return start.g + self._length * self._step

    def _set_out(self, state: State) -> Floats:
        r = state.image - state.g
        T = piece_of(self.pair, state.g, state.contact.pattern).force
        try:
            self._step = np.asarray(np.linalg.solve(np.eye(len(r)) - T, r), dtype=float)
        except np.linalg.LinAlgError:  # the solution on this piece is not isolated
            self._step = self.theta * r
        self._from, self._length = state, 1.0
        return state.g + self._step


class Momentum(Rule):
    """The triple momentum method of Van Scoy, Freeman and Lynch (2018), with ``mu = 1`` and ``L = 1 + rho``.

    Without friction T - 1 is minus the gradient of an energy that is 1-strongly convex and (1 + rho)-smooth in the norm
    (5.21), so its proved rate ``p = 1 - 1/sqrt(1 + rho)`` holds.

    Parameters
    ----------
    rho : float
        rho_normal without friction, else rho.
    """

    def __init__(self, pair: Pair, rho: float) -> None:
        p = momentum_rate(rho)
        super().__init__(pair, momentum_step(rho))
        self._beta, self._gamma = p**2 / (2 - p), p**2 / ((1 + p) * (2 - p))
        self._last: tuple[Floats, Floats] | None = None

    def __call__(self, state: State) -> Floats:
        xi, before = self._last or (state.g, state.g)
        following = xi + self._beta * (xi - before) + self.theta * (state.image - state.g)
        self._last = following, xi
        return following + self._gamma * (following - xi)


def momentum_rate(rho: float) -> float:
    """``1 - 1/sqrt(1 + rho)``, what the triple momentum method gains a step.

    Examples
    --------
    >>> momentum_rate(3.0)
    0.5
    """
    return 1 - 1 / math.sqrt(1 + rho)


def momentum_step(rho: float) -> float:
    """The length of its gradient step, which takes the place of theta."""
    return (1 + momentum_rate(rho)) / (1 + rho)


_RULES: dict[Relaxation, type[Rule]] = {"constant": Constant, "aitken": Aitken, "anderson": Anderson, "newton": Newton}


def rule(pair: Pair, relaxation: Relaxation, theta: float, rho: float | None = None) -> Rule:
    """The rule of a name.

    Parameters
    ----------
    rho : float, optional
        Needed by ``momentum``, which takes its factors from it.
    """
    if relaxation == "momentum":
        if rho is None:
            raise ValueError("momentum needs rho")
        return Momentum(pair, rho)
    return _RULES[relaxation](pair, theta)


def outside(relaxation: Relaxation, friction: float) -> str | None:
    """Why no theorem speaks of a rule; None where one does."""
    if relaxation == "constant" or (relaxation == "momentum" and friction == 0):
        return None
    if relaxation == "momentum":
        return "momentum with friction: its rate is proved for k = 0 alone"
    return f"the {relaxation} relaxation: the theorem is about a constant theta"

"""The rate a run shows in the norm (5.21), as an interval that knows its noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from verification.iteration import State
from verification.pair import Pair

#: Residuals below this multiple of the noise are not used.
CLEAR_OF_NOISE = 100.0


@dataclass(frozen=True, kw_only=True)
class ObservedRate:
    """The asymptotic rate of a run.

    Attributes
    ----------
    value : float
        Geometric mean of the step ratios since the contact pattern last changed.
    lo, hi : float
        Hull of the rates over both halves of that stretch, widened by the noise.
    steps : int
        How many step ratios it rests on.
    """

    value: float
    lo: float
    hi: float
    steps: int


def noise(pair: Pair, state: State) -> float:
    """Rounding error of one evaluation of T, as a residual in the norm (5.21).

    Forces are differences of products ``|S1| |u|`` and of loads, each with a relative error of some units in the last
    place.
    """
    neumann, contact = pair.neumann, pair.contact
    magnitude = np.abs(contact.stiffness) @ np.abs(state.displacement) + np.abs(contact.load) + np.abs(state.g)
    return float(4 * np.finfo(float).eps * neumann.dual_norm(magnitude))


def usable(residuals: Sequence[float], floor: float) -> int:
    """How many leading residuals stand clear of the noise."""
    for i, residual in enumerate(residuals):
        if not residual > CLEAR_OF_NOISE * floor:
            return i
    return len(residuals)


def observed_rate(pair: Pair, states: Sequence[State]) -> ObservedRate | None:
    """The asymptotic rate, or None where fewer than two step ratios stand clear of the noise."""
    if not states:
        return None
    floor = noise(pair, states[-1])
    count = usable([s.residual for s in states], floor)
    if count < 3:
        return None
    last = states[count - 1].contact.pattern
    begin = count - 1
    while begin > 0 and states[begin - 1].contact.pattern == last:
        begin -= 1
    begin = min(begin, count - 3)
    residuals = [s.residual for s in states[begin:count]]

    def rate(i: int, j: int, error: float = 0.0) -> float:
        return float(((residuals[j] + error) / (residuals[i] - error)) ** (1 / (j - i)))

    end = len(residuals) - 1
    middle = end // 2
    halves = [(0, middle), (middle, end), (0, end)]
    return ObservedRate(
        value=rate(0, end),
        lo=min(rate(i, j, -floor) for i, j in halves),
        hi=max(rate(i, j, floor) for i, j in halves),
        steps=end,
    )


@dataclass(frozen=True, kw_only=True)
class StepRatio:
    """The largest Lipschitz quotient of T_theta along a run, with its error.

    Consecutive iterates are a pair of Proposition 5.6: ``|||T_theta psi - T_theta psi~||| / |||psi - psi~|||``
    is the ratio of consecutive residuals.
    """

    value: float
    lo: float
    hi: float
    steps: int


def largest_step_ratio(pair: Pair, states: Sequence[State]) -> StepRatio | None:
    """The largest step ratio clear of the noise, or None where there is none."""
    if not states:
        return None
    floor = noise(pair, states[-1])
    residuals = [s.residual for s in states]
    count = usable(residuals, floor)
    if count < 2:
        return None
    before, after = np.array(residuals[: count - 1]), np.array(residuals[1:count])
    worst = int(np.argmax(after / before))
    return StepRatio(
        value=float(after[worst] / before[worst]),
        lo=float((after[worst] - floor) / (before[worst] + floor)),
        hi=float(((after + floor) / (before - floor)).max()),
        steps=count - 1,
    )

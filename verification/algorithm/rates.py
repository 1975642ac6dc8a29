"""The rate a run shows in the norm (5.21), and the largest factor of a single step, with the noise of each iterate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.iterate import Iterate
from verification.interface.pair import ContactPair

#: Residuals below this multiple of their noise are not used.
CLEAR_OF_NOISE = 100.0

#: Above this multiple of its noise a step ratio has eight digits.
FAR_FROM_NOISE = 1e8


def noise(pair: ContactPair, iterate: Iterate) -> float:
    """Rounding error of one evaluation of T, as a residual in the norm (5.21).

    Forces are differences of products ``|S1| |u|`` and of loads, each with a relative error of some units in the last
    place.
    """
    neumann, contact = pair.neumann, pair.contact
    displacement = pair.interface.carry(iterate.displacement)
    reaction = np.abs(contact.stiffness) @ np.abs(displacement) + np.abs(contact.load)
    magnitude = np.abs(pair.interface.carry_back(reaction)) + np.abs(iterate.g)
    return float(4 * np.finfo(float).eps * neumann.dual_norm(magnitude))


@dataclass(frozen=True, kw_only=True)
class ObservedRate:
    """The rate at the end of a run.

    Attributes
    ----------
    value : float
        Geometric mean of the last quarter of the step ratios since the contact pattern last changed.
    lo, hi : float
        Hull of the rates over that quarter and over the one before it, widened by the noise.
    begin, end : int
        The iterates whose residuals it compares.
    """

    value: float
    lo: float
    hi: float
    begin: int
    end: int


def observed_rate(pair: ContactPair, iterates: Sequence[Iterate]) -> ObservedRate | None:
    """The rate that a run shows at its end, or None where fewer than two step ratios stand clear of the noise.

    Every residual is held against the noise of its own iterate; after the first one that is not clear of it
    nothing counts.
    """
    floors = [noise(pair, iterate) for iterate in iterates]
    return rate_of([iterate.residual for iterate in iterates], floors, [each.contact.pattern for each in iterates])


def rate_of(residuals: Sequence[float], floors: Sequence[float], patterns: Sequence[object]) -> ObservedRate | None:
    """As :func:`observed_rate`, from the residuals, the noise of each and what can be compared of the patterns."""
    clear = [residual > CLEAR_OF_NOISE * floor for residual, floor in zip(residuals, floors, strict=True)]
    count = clear.index(False) if False in clear else len(clear)
    if count < 3:
        return None
    return rate_at_the_end(residuals[:count], floors[:count], _settled(patterns[:count]))


def settled(iterates: Sequence[Iterate]) -> int:
    """From which iterate on the contact pattern is the last one."""
    return _settled([iterate.contact.pattern for iterate in iterates])


def _settled(patterns: Sequence[object]) -> int:
    first = len(patterns) - 1
    while first > 0 and patterns[first - 1] == patterns[-1]:
        first -= 1
    return first


def rate_at_the_end(residuals: Sequence[float], floors: Sequence[float], since: int) -> ObservedRate:
    """The rate over the last quarter of the steps since the contact pattern settled.

    Parameters
    ----------
    residuals, floors : sequence of float
        At least three residuals and the noise of each.
    since : int
        The first iterate with the final pattern.
    """
    end = len(residuals) - 1
    begin = min(since, end - 2)
    # an even number of steps: modes of either sign alternate
    quarter = max(2, (end - begin) // 8 * 2)
    before = max(begin, end - 2 * quarter), end - quarter
    windows = [(end - quarter, end)] + ([before] if before[0] < before[1] else [])

    def rate(i: int, j: int, sign: int = 0) -> float:
        after, first = residuals[j] + sign * floors[j], residuals[i] - sign * floors[i]
        return float((after / first) ** (1 / (j - i)))

    return ObservedRate(
        value=rate(end - quarter, end),
        lo=min(rate(i, j, -1) for i, j in windows),
        hi=max(rate(i, j, +1) for i, j in windows),
        begin=end - quarter,
        end=end,
    )


@dataclass(frozen=True, kw_only=True)
class StepRatio:
    """The largest Lipschitz quotient of T_theta along a run, with its error.

    Consecutive iterates are a pair of Proposition 5.6: ``|||T_theta psi - T_theta psi~||| / |||psi - psi~|||``
    is the ratio of consecutive residuals.

    Attributes
    ----------
    value, lo, hi : float
        0 where no step was taken.
    steps : int
        How many steps it was taken over; 0 where the start is the solution.
    """

    value: float
    lo: float
    hi: float
    steps: int


def largest_step_ratio(pair: ContactPair, iterates: Sequence[Iterate]) -> StepRatio | None:
    """The largest step ratio clear of the noise, or None where there is none.

    A step is judged by the noise of its own two iterates; it may end below the noise, not begin there.  Steps far above
    it count alone, where there are any.
    """
    if not iterates:
        return None
    if iterates[0].residual == 0:
        return StepRatio(value=0.0, lo=0.0, hi=0.0, steps=0)
    residual: Floats = np.array([iterate.residual for iterate in iterates])
    floor: Floats = np.array([noise(pair, iterate) for iterate in iterates])
    for multiple in (FAR_FROM_NOISE, CLEAR_OF_NOISE):
        begins = np.flatnonzero((residual[:-1] > multiple * floor[:-1]) & np.isfinite(residual[1:]))
        if len(begins):
            break
    else:
        return None
    before, after = residual[begins], residual[begins + 1]
    error_before, error_after = floor[begins], floor[begins + 1]
    return StepRatio(
        value=float((after / before).max()),
        lo=max(float(((after - error_after) / (before + error_before)).max()), 0.0),
        hi=float(((after + error_after) / (before - error_before)).max()),
        steps=len(begins),
    )

"""The rate of a run in the norm (5.21), and the largest factor of a single step, with the noise of each iterate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.keys import Part, key, says
from verification.algorithm.iterate import Iterate
from verification.interface.pair import ContactPair

#: Residuals below this multiple of their noise are not used.
CLEAR_OF_NOISE = 100.0

#: Steps from residuals above this multiple of their noise, or within a decade of the run's largest multiple, give the
#: upper end of a step ratio: eight digits.
FAR_FROM_NOISE = 1e8


class Noise:
    """Rounding error of one evaluation of T for a pair, as a residual in the norm (5.21).

    Each product and each sum has a relative error of some units in the last place of its terms.  Step I solves
    ``S2 u = g + l2``, which leaves an error of that size in each equation, ``|S2| |u| + |g| + |l2|``, and ``|S2^-1|``
    times that in u: far more than the rounding of u itself where the body is as slender as a cantilever.  Step II adds
    ``|S1|`` times u and the loads.
    """

    def __init__(self, pair: ContactPair) -> None:
        self._interface = pair.interface.moduli
        self._stiffness, self._flexibility = np.abs(pair.contact.schur), np.abs(pair.neumann.inverse)
        self._neumann_stiffness = np.abs(pair.neumann.schur)
        self._load, self._neumann_load = (np.abs(side.load)[:, None] for side in (pair.contact, pair.neumann))
        slipped = np.abs(pair.interface.slipped)  # all tangential components, which come first
        self._load = self._load + (self._stiffness[:, : len(slipped)] @ slipped)[:, None]

    def of(self, g: Floats, u: Floats) -> Floats:
        """Return the error at each column of g, shape (2 n, m), with its displacement in u."""
        g, u = np.abs(g), np.abs(u)
        with np.errstate(over="ignore", invalid="ignore"):  # in a run that diverges, which has no clear residual then
            off = self._flexibility @ (self._neumann_stiffness @ u + g + self._neumann_load)
            added = g + self._interface.carry_back(self._stiffness @ self._interface.carry(u + off) + self._load)
            # no sum of errors of these sizes, of whatever signs, is longer
            error: Floats = 4 * np.finfo(float).eps * np.sqrt(np.einsum("ij,ij->j", added, self._flexibility @ added))
        return error


def noise(pair: ContactPair, iterate: Iterate) -> float:
    """Return the :class:`Noise` of one iterate."""
    return noises(pair, [iterate])[0]


def noises(pair: ContactPair, iterates: Sequence[Iterate]) -> list[float]:
    """Return the :class:`Noise` of each of some iterates."""
    g = np.stack([iterate.g for iterate in iterates], axis=1)
    u = np.stack([iterate.displacement for iterate in iterates], axis=1)
    found: list[float] = Noise(pair).of(g, u).tolist()
    return found


@dataclass(frozen=True, kw_only=True)
class ObservedRate:
    """The rate at the end of a run.

    ``value`` is the geometric mean of the last quarter of the step ratios since the contact pattern last changed, from
    ``lo`` to ``hi`` the hull of the rates over that quarter and over the one before it, widened by the noise; ``begin``
    and ``end`` are the iterates whose residuals it compares.
    """

    value: float
    lo: float
    hi: float
    begin: int
    end: int

    def __str__(self) -> str:
        return f"{self.value:.3g} (iterations {self.begin} to {self.end})"


def observed_rate(pair: ContactPair, iterates: Sequence[Iterate]) -> ObservedRate | None:
    """Return the rate that a run shows at its end, or None where fewer than two step ratios are clear of the noise.

    Every residual is compared with the noise of the same iterate; nothing after the first one that is not clear of it
    counts.
    """
    return rate_of(
        [iterate.residual for iterate in iterates], noises(pair, iterates), [each.contact.pattern for each in iterates]
    )


def rate_of(residuals: Sequence[float], floors: Sequence[float], patterns: Sequence[object]) -> ObservedRate | None:
    """Estimate the rate from residuals, the noise of each, and contact patterns of any type that can be compared."""
    clear = [residual > CLEAR_OF_NOISE * floor for residual, floor in zip(residuals, floors, strict=True)]
    count = clear.index(False) if False in clear else len(clear)
    if count < 3:
        return None
    return rate_at_the_end(residuals[:count], floors[:count], settled(patterns[:count]))


def settled(patterns: Sequence[object]) -> int:
    """Return the number of the first iterate from which on the contact pattern is the last one."""
    first = len(patterns) - 1
    while first > 0 and patterns[first - 1] == patterns[-1]:
        first -= 1
    return first


def rate_at_the_end(residuals: Sequence[float], floors: Sequence[float], since: int) -> ObservedRate:
    """Return the rate over the last quarter of the steps since the contact pattern settled.

    ``residuals`` are at least three, with their noise as ``floors``; ``since`` is the first iterate with the final
    pattern.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceNorm:
    """A norm ``|g|_Q`` of forces on the Neumann grid, at least (5.21) and at most sqrt(condition) times (5.21).

    ``matrix`` is Q, shape (N, N), ``|g|_Q^2 = g' Q g``.
    """

    matrix: Floats
    condition: float

    def of(self, force: Floats) -> float:
        """The norm of a force."""
        return math.sqrt(max(float(force @ self.matrix @ force), 0.0))


@dataclass(frozen=True, kw_only=True)
class StepRatio(Part):
    """The largest Lipschitz quotient of T_theta along a run, with its error.

    Consecutive iterates are a pair of Proposition 5.6: ``|||T_theta psi - T_theta psi~||| / |||psi - psi~|||``
    is the ratio of consecutive residuals.

    Attributes
    ----------
    value, lo : float
        The step whose lower end by its own noise is largest; 0 where no step was taken.
    hi : float
        The largest upper end of the steps furthest from the noise, at least ``value``.
    steps : int
        Number of steps it was taken over; 0 where the start is the solution.
    """

    value: float = key("in the norm (5.21), unless another one is asked for")
    lo: float
    hi: float
    steps: int

    @property
    @says()
    def interval(self) -> tuple[float, float]:
        """Its two ends by rounding."""
        return self.lo, self.hi


def largest_step_ratio(
    pair: ContactPair, iterates: Sequence[Iterate], norm: ForceNorm | None = None
) -> StepRatio | None:
    """Return the largest step ratio clear of the noise, in (5.21) or another norm, or None where there is none.

    A step is judged by the noise of its two iterates; it may end below the noise, not begin there.  Every clear step
    counts for the lower end.  Only the steps furthest from the noise count for the upper end: a step near the noise
    would raise it by rounding.
    """
    if not iterates:
        return None
    if iterates[0].residual == 0:
        return StepRatio(value=0.0, lo=0.0, hi=0.0, steps=0)
    residual: Floats = np.array([iterate.residual for iterate in iterates])
    floor: Floats = np.array(noises(pair, iterates))
    if norm is not None:
        residual = np.array([norm.of(iterate.image - iterate.g) for iterate in iterates])
        floor = math.sqrt(norm.condition) * floor
    begins = np.flatnonzero((residual[:-1] > CLEAR_OF_NOISE * floor[:-1]) & np.isfinite(residual[1:] + floor[1:]))
    if not len(begins):
        return None
    before, after = residual[begins], residual[begins + 1]
    error_before, error_after = floor[begins], floor[begins + 1]
    lo, hi = (after - error_after) / (before + error_before), (after + error_after) / (before - error_before)
    most, level = int(np.argmax(lo)), min(FAR_FROM_NOISE, 0.1 * float((before / error_before).max()))
    value = float(after[most] / before[most])
    return StepRatio(
        value=value,
        lo=max(float(lo[most]), 0.0),
        hi=max(float(hi[before >= level * error_before].max()), value),
        steps=len(begins),
    )


def steps(rate: float | Fraction, tolerance: float = 1e-9, rest: float | None = None) -> int | None:
    """Number of steps of a rate to a tolerance; None where no number is enough, or no double is so large.

    ``rest`` is 1 - rate, where it is known without the cancellation that a rate near 1 in doubles has.

    >>> steps(0.1, 1e-3), steps(1.0, rest=1e-20) > 2e21, steps(1.0)
    (3, True, None)
    """
    rest = float(1 - rate if rest is None else rest)
    if not 0 < rest < 1:
        return 1 if rest == 1 else None
    count = math.log(tolerance) / math.log1p(-rest) * (1 - 1e-12)
    return math.ceil(count) if count < math.inf else None

"""The pace of one series of residuals: a steady ratio, a level, the plateau of a relative residual, or neither."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Literal

import numpy as np

from fem1d2d.mesh import Floats
from verification.coupling.ends import SWIFT
from verification.coupling.log_files import Column
from verification.coupling.readings import FEWEST_STEPS, Observed, spread, steps_needed

#: Logarithms of ratios that scatter and drift by less, or by a fifth of theta, are steady.
STEADY = 0.03

#: Ratios still move where their logarithms in both halves of a window differ by more than this and rounding.
MOVES = 3e-4

#: Below this a relative residual ``|T x - x|/|T x|`` has the ratios of the absolute one, nearly: for the solution y and
#: without friction, or tied, ``|T x - T y| <= |T x - x|`` in the norm (5.21): ``|T x|`` is ``|y|`` within this share.
SMALL = 0.1

#: Of a run that arrives so many steps of a relative residual need not be below SMALL, as its first one is 1 or so.
FIRST = 2

#: The residuals that are relative to a size which changes.
RELATIVE = ("relative", "previous")

#: A plateau P is flat where it varies by less than this share of P - 1, which tells rho.  A tied run comes as close to
#: it as its numbers have digits; a run whose contact opens and closes has been seen at 1.0018, within 4 % of P - 1.
FLAT = 0.01

#: Below this share of the largest residual a level may be the accuracy of the participants' own solvers; below the
#: second one it is, where nothing opens.
FLOOR, LINEAR_FLOOR = 1e-3, 0.1

#: A run whose residual has fallen to this share has converged, and a level below is the accuracy of the solvers.
CONVERGED = 1e-6

#: Residuals below this share of the largest one are rounding.
ROUNDING = 1e-12

#: The rounding of one step of a run, as a share of the largest residual or of the size of the solution.
ROUNDED = 1e-15

#: Ratios that have not settled when a run arrives may have risen by this share over the stretch that is looked at.
RISE = 0.3

#: Ratios of a residual with constant relaxation do not fall by this factor.
DROP = 8.0

#: How often the steady stretch is looked for further from the end.
TRIES = 12

#: Of more windows the last ones are read.
MOST_WINDOWS = 300

#: Windows that are too short one by one are pooled where there are so many.
FEWEST_WINDOWS = 5

#: Two ratios between these at the end of a series that is too short show that it explodes: the last bounds the pace.
EXPLODES, ABSURD = 1.5, 1e9

Kind = Literal["steady", "level", "floor", "plateau", "unsteady", "short", "growth"]


@dataclass(frozen=True, kw_only=True)
class Pace:
    """The course of one series of residuals: the ratio of consecutive ones, or P of a plateau, with its limits.

    ``floor`` is a level so low that the accuracy of the participants' solvers may set it; its ratio comes from the
    steady steps before.  ``steps`` of ``length`` residuals can be read.  ``height`` is the last one as a share of the
    largest; where it is lost in rounding or zero, the share of rounding.  The series is ``lost`` if it ends in inf or
    nan, has ``arrived`` if it ends in rounding or zero, a step after those that can be read, and ``adapts`` if it falls
    much faster than before after it rose: a constant factor does not do that.  Of a level that repeats itself
    ``period`` is the number of steps after which it does, and ``least`` the ratio by which it may still fall.  What has
    visibly not settled ``moves``.
    """

    kind: Kind
    value: float | None = None
    least: float | None = None
    most: float | None = None
    steps: int
    length: int = 0
    height: float = 1.0
    lost: bool = False
    arrived: bool = False
    adapts: bool = False
    period: int = 0
    moves: bool = False

    @property
    def swift(self) -> bool:
        """True if the series falls by SWIFT a step or faster in the mean."""
        return not self.lost and math.log(self.height) <= (self.steps + self.arrived) * math.log(SWIFT)

    @property
    def grows(self) -> bool:
        """True if the ratio is above 1."""
        return self.least is not None and self.least > 1

    @property
    def falls(self) -> bool:
        """True if the ratio is below 1."""
        return self.most is not None and self.most < 1


def pace(residuals: Floats, column: Column, theta: Fraction, *, linear: bool = False) -> Pace:
    """The course of the residuals of one time window.

    The ratio is the median over the last ``steps`` steps of geometric means over an even number of consecutive ones, a
    fifth of the steps: contact that is open and closed alternately makes them alternate, and noise is smaller in a
    mean.  It is steady where these means scatter little between their deciles, and their medians in both halves agree.
    It must be steady over the steps that theta needs; over fewer where the residual has fallen to CONVERGED of the
    largest, or has grown by as much: neither is a level.  Nothing opens where the coupling is ``linear``.
    """
    relative, steps = column.residual in RELATIVE, steps_needed(theta)
    usable = np.flatnonzero(np.isfinite(residuals) & (residuals > 0))
    end = int(usable[-1]) + 1 if usable.size else 0
    lost = end < len(residuals) and not math.isfinite(float(residuals[end]))
    gaps = np.flatnonzero(np.diff(usable) > 1)  # a relative residual is inf where T x vanishes: the bodies part
    values = residuals[int(usable[gaps[-1] + 1]) if gaps.size else int(usable[0]) if usable.size else 0 : end]
    arrived = bool(values.size) and end < len(residuals) and residuals[end] == 0
    share = ROUNDING
    if values.size:
        peak = int(np.argmax(values))
        share = max(ROUNDING, 100 * column.decimals / float(values[peak]))
        under = np.flatnonzero(values[peak:] < (ROUNDING if relative else share * values[peak]))
        arrived = arrived or bool(under.size)
        values = values[: peak + int(under[0])] if under.size else values
    taken = max(len(values) - 1, 0)
    height = float(values[-1] / values.max()) if taken else 1.0
    if arrived:  # at rounding or zero
        height = min(height, share)
    grown = taken > 0 and values[0] < CONVERGED * values[-1]
    if height < CONVERGED or grown:  # no level: fewer steps show the ratio
        steps = min(steps, max(FEWEST_STEPS - FIRST * relative, taken // 2))
    known: dict[str, Any] = {"length": len(residuals), "height": height, "arrived": arrived, "adapts": _adapts(values)}
    growth = values[-2:] / values[-3:-1] if taken > 1 and not relative else np.zeros(1)
    explodes = growth.min() > EXPLODES and values[-1] == values.max()
    lost |= bool(explodes and growth.max() >= ABSURD)
    growing = None
    if explodes and not lost:
        r = float(growth[-1])
        growing = Pace(kind="growth", value=r, least=r * (1 - 1e-9), most=r, steps=taken, **known)
    if taken < steps:
        return growing or Pace(kind="short", steps=max(taken, int(arrived)), lost=lost, **known)
    known["steps"] = taken
    logs = np.log(values)
    limit = min(STEADY, float(theta) / 5)

    def ratio(end: int) -> Pace | None:
        """The steady ratio of the steps before ``end``; None where there is none."""
        stretch = logs[end - steps - 1 : end]
        largest = float(np.exp(stretch.max()))
        if relative and largest > SMALL:
            return None
        lag = 2 * max(1, steps // 10)
        means = _slopes(stretch, lag)
        median, half = float(np.median(means)), len(means) // 2
        scatter, drift = _scatter(means), abs(float(np.median(means[:half]) - np.median(means[half:])))
        before = 0.0 if relative else float(logs[: end - steps].max())  # the size of what was subtracted
        unit = ROUNDED * math.exp(before - float(stretch.min()))
        written = column.digits + column.decimals * math.exp(-float(stretch.min())) + unit
        if (
            2 * written / lag > limit
            or max(scatter, drift) > limit + written
            or _scatter(_slopes(stretch, 2)) > STEADY + written
        ):
            return None
        sure = scatter + drift + 2 * written / steps + 1e-9
        if relative:
            sure += math.log((1 + largest) / (1 - largest)) / steps
        least, most = math.exp(median - sure), math.exp(median + sure)
        moves = drift > MOVES + 2 * written / lag
        return Pace(kind="steady", value=math.exp(median), least=least, most=most, moves=moves, **known)

    last = ratio(len(values))
    tail = values[-steps - 1 :]
    flat = last is not None and not last.grows and not last.falls
    if last is not None and not flat:
        return last
    if column.residual == "relative" and (plateau := _plateau(tail, column.digits)) is not None:
        return Pace(kind="plateau", **plateau, **known)
    ends = range(len(values), steps, -max(1, steps // 2))[1 : TRIES + 1]
    earlier = (found for end in ends if (found := ratio(end)) is not None)
    before = next((found for found in earlier if found.falls or found.grows), None)  # no part of the level itself
    lengths = [n for n in (steps, 2 * steps, 4 * steps) if n <= taken]  # a rough level shows over a longer stretch
    if flat or any(_level(logs[-n - 1 :], float(spread(theta)), limit) for n in lengths):
        fallen = float(values[-1]) if relative else height
        kind: Kind = "floor" if height < FLOOR or (linear and fallen < LINEAR_FLOOR) else "level"
        if height < CONVERGED and before is not None and before.falls:
            return before
        if before is not None and (kind == "floor" or before.grows):
            return replace(before, kind=kind)
        stretch = logs[-lengths[-1] - 1 :]
        return Pace(kind=kind, period=_period(stretch), least=_fall(stretch), **known)
    if before is not None and before.grows:
        return before
    if height < CONVERGED and (settles := _settling(tail, relative, limit, steps)) is not None:
        return Pace(kind="steady", moves=True, **settles, **known)
    small = int(np.argmax(values[::-1] > SMALL)) if relative and values.max() > SMALL else taken + 1
    if 0 < small <= steps:  # that a relative residual shows; windows of a few of them can be pooled
        return Pace(kind="short", **(known | {"steps": small - 1, "lost": lost}))
    return growing or Pace(kind="unsteady", lost=lost, **known)


def _settling(tail: Floats, relative: bool, limit: float, steps: int) -> dict[str, Any] | None:
    """Last ratio, and its limits, of a run that has arrived while its ratios still rise to the slowest mode's.

    The ratios of a linear run rise, since faster modes die out first.  Their logarithms lie on a line up to what is
    allowed of a steady ratio; by as much as they have risen over the stretch they may still rise.
    """
    if relative and float(tail.max()) > SMALL:
        return None
    lag = 2 * max(1, steps // 10)
    means = _slopes(np.log(tail), lag)
    x = np.arange(len(means)) - (len(means) - 1) / 2
    tilt = float(x @ means / (x @ x))
    rise, scatter = tilt * (len(means) - 1), _scatter(means - tilt * x)
    middle, last = float(means.mean()), float(means.mean()) + rise / 2
    if not (0 < rise <= RISE and scatter <= limit and last + rise + scatter < 0):
        return None
    return {"least": math.exp(middle - scatter), "value": math.exp(last), "most": math.exp(last + rise + scatter)}


def _adapts(values: Floats) -> bool:
    """True if a step falls DROP times faster than one before it, which rises.

    With a constant factor the residuals of a symmetric linear coupling are log-convex, ``r_n^2 <= r_{n-1} r_{n+1}``, in
    the norm in which it is symmetric: their ratios do not fall.
    """
    ratios = np.diff(np.log(values))
    if not ratios.size:
        return False
    before = np.maximum.accumulate(ratios)
    return bool(((before > 0) & (before - ratios > math.log(DROP))).any())


def _period(logs: Floats) -> int:
    """The least number of steps after which residuals repeat themselves three times; 0 where they do not."""
    repeats = lambda p: float(np.abs(logs[p:] - logs[:-p])[-2 * p :].max()) <= FLAT
    return next((p for p in range(1, len(logs) // 3 + 1) if repeats(p)), 0)


def _slopes(logs: Floats, lag: int) -> Floats:
    """Logarithms of the mean ratio over ``lag`` steps."""
    return (logs[lag:] - logs[:-lag]) / lag


def _scatter(values: Floats) -> float:
    """Half the distance between the deciles."""
    return float(np.quantile(values, 0.9) - np.quantile(values, 0.1)) / 2


def _plateau(tail: Floats, digits: float) -> dict[str, Any] | None:
    """Median, least and largest value of a flat stretch above 1."""
    least, most = float(tail.min()) * (1 - digits), float(tail.max()) * (1 + digits)
    middle = float(np.median(tail))
    flat = float(tail.max() - tail.min()) <= FLAT * (middle - 1) + 2 * digits * middle
    return {"least": least, "value": middle, "most": most} if least > 1 and flat else None


def _fall(logs: Floats) -> float:
    """The least mean ratio that a stretch at a level may have, by three standard errors of both halves; 1 at most."""
    first, last = np.array_split(logs, 2)
    sure = 3 * math.hypot(first.std(), last.std()) / math.sqrt(len(last))
    return math.exp(min(float(last.mean() - first.mean()) - sure, 0.0) / len(last))


def _level(logs: Floats, spread: float, limit: float) -> bool:
    """True if residuals stay as they are, or rise and fall, without a trend."""
    ratios, half = np.diff(logs), len(logs) // 2
    trend = abs(float(np.mean(logs[half:]) - np.mean(logs[:half]))) / half
    turns = min(np.count_nonzero(ratios > 0), np.count_nonzero(ratios < 0)) >= len(ratios) // 5
    still = float(np.abs(_slopes(logs, 2)).max()) <= limit
    return trend <= (limit if still else spread) and bool(turns or still)


# --- several windows --------------------------------------------------------------------------------------------------


def pooled(windows: Sequence[Floats], *, relative: bool, steps: int) -> Observed | None:
    """Median ratio of many time windows that are too short to be read one by one, and its limits.

    Only the second half of the steps of each window counts, where the slowest mode leads.  A mode that is slower than a
    window is long does not show, so that this is a pace and no bound.  Relative residuals ``|T x - x|/|T x|`` count
    below SMALL; so many ``steps`` must count in all.
    """
    ratios, count = [], 0
    for window in windows:
        values = window[np.isfinite(window) & (window > 0)]
        half = (len(values) - 1) // 2
        if len(values) < len(window) or half < 1 or (relative and values[-half - 1] > SMALL):
            continue
        ratios.append(float(np.log(values[-1] / values[-half - 1])) / half)
        count += half
    if len(ratios) < FEWEST_WINDOWS or count < steps:
        return None
    least, middle, most = np.exp(np.quantile(ratios, [0.1, 0.5, 0.9]))
    return Observed.of(float(middle), float(least), float(most))


def together(paces: Sequence[Pace]) -> Observed | None:
    """Median ratio or plateau of several windows, and its limits; of ten and more without the outer tenths.

    A run that grows in some windows does so.
    """
    if not paces:
        return None
    paces = [one for one in paces if one.kind != "plateau" and one.grows] or paces
    least, most = (np.array([getattr(one, name) for one in paces]) for name in ("least", "most"))
    middle = float(np.median([one.value for one in paces if one.value is not None]))
    low, high = float(least.min()), float(most.max())
    if len(paces) >= 10:
        low, high = min(middle, float(np.quantile(least, 0.1))), max(middle, float(np.quantile(most, 0.9)))
    return replace(Observed.of(middle, low, high), moves=any(one.moves for one in paces))

"""Logs of other runs as they were seen, and the bounds of rho that they give together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ndtheory.keys import Part, derived, key
from ndtheory.keys import says as means
from ndtheory.number import above, below
from verification.coupling.kinds import CONTACT, Kind
from verification.coupling.log_files import Column, Log
from verification.coupling.pace import CONVERGED, MOST_WINDOWS, RELATIVE, Pace, pace, pooled, together
from verification.coupling.readings import (
    FEWEST_STEPS,
    Made,
    NextRun,
    Observed,
    RunReading,
    few,
    rho_in_parallel,
    steps_needed,
)

#: A residual below this share of its largest value has fallen, although the log is too short for a ratio.
FALLEN = 0.1

#: So many steps of the second halves of all windows are enough to pool them.
POOLED = 30

#: Residuals at the end of a log by which the units of two fields are compared, and how far these may be apart.
STRAIGHT, WIDE = 40, 4.0

#: Numbers of one run, as rho by two fields, agree within this factor.
AGREE = Fraction(103, 100)

#: Assumption under which a ratio bounds rho from below, and from above.
FROM_BELOW = "no friction, or a tied interface"
MORE_ACCURATE = ", a residual that stays at its level in a longer run too, and solvers that are more accurate than that"
RATIOS_RISE = ", and a norm in which the coupling is symmetric, so that ratios only rise"
TIED = "a tied interface"
LINEAR = "a linear coupling with real eigenvalues, none below 0"
FROM_ABOVE = "all of Gamma_c closed near the solution, nothing sliding"
SHOWN = ", and a log that shows the stiffest mode"

_TOGETHER: dict[str, Any] = {
    "says": "from all windows together",
    "null": "where no window shows one",
    "why": "no window shows one",
}
_BOUND: dict[str, Any] = {
    "says": r"the largest lower bound of $\rho$, and the smallest upper one that it leaves, an estimate",
    "null": "where no log gives one",
}

#: The kinds of a pace, in words.
_WORDS = {
    "steady": "steady",
    "level": "at a level",
    "floor": "at a low level",
    "plateau": "at a plateau",
    "unsteady": "without a steady ratio",
    "short": "with too few steps",
    "growth": "growing over too few steps",
}


@dataclass(frozen=True, kw_only=True)
class SeenColumn(Part):
    """The residuals of one field of a log, with the paces of the windows that were read.

    Short windows are not read where there are others, of many the last ones.
    """

    name: str = key("as the log names it")
    residual: str = key(
        "`absolute`; `relative`, over the size of $Tg$; `previous`, over that of $g$; `drop`, over the first or the "
        "largest one of the window; `assumed`, taken as absolute because its name does not tell"
    )
    paces: tuple[Pace, ...]
    windows: int = key("time windows in the log", unit="1")
    ratio: Observed | None = key(**_TOGETHER)
    plateau: Observed | None = key(**_TOGETHER)
    pooled: Observed | None = key(
        "the ratio over the second halves of all windows, where none shows a ratio: it bounds nothing",
        null="where windows are read one by one, or are fewer than five",
        why="windows are read one by one, or are too few or too short to be pooled",
        default=None,
    )

    @property
    @means(
        "windows whose residual changes by a steady ratio at its end (`steady`), stays at a `level`, is relative and "
        "flat above 1 (`plateau`), ends at a level below 1e-3 of the largest, or 0.1 where nothing opens, which the "
        "accuracy of the solvers may set (`floor`), or from which nothing follows (`unsteady`, and `short` of too few "
        "steps), but of `growth` the last ratio as a bound from below; of more than 300 windows the last ones are "
        "read, and only those of ten steps and more where there are any",
        type="map of integer",
        unit="1",
    )
    def read(self) -> dict[str, int]:
        return {kind: self.count(kind) for kind in _WORDS}

    def count(self, *kinds: str) -> int:
        """Number of windows that were read and are of these kinds."""
        return sum(pace.kind in kinds for pace in self.paces)

    @property
    @means("the same in words")
    def says(self) -> str:
        if len(self.paces) == 1:
            found = _WORDS[self.paces[0].kind]
            found += f", a cycle of {self.paces[0].period} steps" * (self.paces[0].period > 1)
        else:
            counts = ((self.count(kind), words) for kind, words in _WORDS.items())
            found = f"of {self.windows} windows {', '.join(f'{n} {words}' for n, words in counts if n)}"
        if self.ratio is not None:
            found += f"; ratio {self.ratio}"
        if self.plateau is not None:
            found += f"; plateau {self.plateau}"
        if self.count("short") == len(self.paces):
            found += f", {max(pace.steps for pace in self.paces)} steps at most"
        if self.pooled is not None:
            found += f"; pooled, the second half of each: ratio {self.pooled}"
        return found


def seen_column(column: Column, theta: Fraction, kind: Kind = CONTACT) -> SeenColumn:
    """Read the windows of one field one by one and put them together; pool them where none shows a ratio."""
    windows = ([window for window in column.windows if len(window) > FEWEST_STEPS] or column.windows)[-MOST_WINDOWS:]
    paces = tuple(pace(window, column, theta, linear=kind.linear) for window in windows)
    short = all(one.kind in ("short", "unsteady") for one in paces)
    relative, steps = column.residual in RELATIVE, min(steps_needed(theta), POOLED)
    # a field of parallel coupling grows where the other one falls
    no_ratio = ("plateau", "growth") if kind.parallel else ("plateau",)
    return SeenColumn(
        name=column.name,
        residual=column.residual,
        paces=paces,
        windows=len(column.windows),
        ratio=together([one for one in paces if one.value is not None and one.kind not in no_ratio]),
        plateau=together([one for one in paces if one.kind == "plateau"]),
        pooled=pooled(windows, relative=relative, steps=steps) if short else None,
    )


def of_both_fields(log: Log) -> Log:
    """A log of *parallel* coupling with one series: modes turn, so that one field is small where the other is large.

    The first field counts with a unit in which the logarithms of both together are as straight as they can be; of
    several kinds of residuals absolute ones are taken.
    """
    columns = [column for column in log.columns if column.residual == "absolute"]
    columns = columns if len(columns) > 1 else list(log.columns)
    if len(columns) < 2 or [*map(len, columns[0].windows)] != [*map(len, columns[1].windows)]:
        return log
    one, other, *_ = columns
    longest = max(range(len(one.windows)), key=lambda i: len(one.windows[i]))
    g, u = (np.asarray(column.windows[longest]) ** 2 for column in (one, other))
    counts = np.isfinite(g) & np.isfinite(u) & (g > 0) & (u > 0)
    g, u = g[counts][-STRAIGHT:], u[counts][-STRAIGHT:]
    if len(g) < FEWEST_STEPS:
        return log
    middle = float(np.log(u / g).mean())
    bent = lambda shift: float((np.diff(np.log(g * math.exp(middle + shift) + u), 2) ** 2).sum())
    found = minimize_scalar(bent, bounds=(-WIDE, WIDE), method="bounded", options={"xatol": 1e-6})
    unit = math.exp(middle + float(found.x))
    joined = tuple(np.sqrt(unit * a**2 + b**2) for a, b in zip(one.windows, other.windows, strict=True))
    digits = max(column.digits + column.decimals for column in (one, other))
    name = f"{one.name} and {other.name}"
    return replace(log, columns=(replace(one, name=name, windows=joined, digits=digits, decimals=0.0),))


def _same(one: Observed, other: Observed) -> bool:
    """True if two plateaus are of one rho."""
    rho = [1 / (plateau.value - 1) for plateau in (one, other)]
    return max(rho) <= AGREE * min(rho)


@dataclass(frozen=True, kw_only=True)
class SeenLog(Part):
    """One log of a run with constant theta.

    If this were the only log ``next`` would be the run to make; ``rho`` belongs to the only reading.
    """

    file: str = key("the path as given")
    form: str = key("the name of its form, `columns`, or `pattern`")
    theta: Fraction = key("as given, or as the log names it", type="number", unit="1", of=float)
    columns: tuple[SeenColumn, ...] = key("the residuals of each field")
    readings: tuple[RunReading, ...] = key(
        "the possible readings of this log without the others; empty where nothing in it is steady or at a level"
    )
    next: NextRun
    rho: Fraction | None
    notes: tuple[str, ...] = key("lines that were left out")

    @property
    @means(
        "over how many steps a ratio had to be steady; ten (eight if relative) or half of the steps suffice where the "
        "residual fell below 1e-6 of its largest",
        name="steady_over",
        unit="1",
    )
    def steps(self) -> int:
        return steps_needed(self.theta)

    @property
    def paces(self) -> list[Pace]:
        """The paces of all columns."""
        return [pace for column in self.columns for pace in column.paces]

    @property
    def length(self) -> int:
        """The most steps of a window."""
        return max((pace.steps for pace in self.paces), default=0)

    @property
    def slowest(self) -> Observed | None:
        """The ratio of the field which is slowest: a norm that does not see a mode falls faster."""
        found = [column.ratio for column in self.columns if column.ratio is not None]
        return max(found, key=lambda ratio: ratio.value, default=None)

    @property
    def plateaus(self) -> list[Observed]:
        """The plateaus of all fields that show one, as they were read."""
        return [column.plateau for column in self.columns if column.plateau is not None]

    @property
    def plateau(self) -> Observed | None:
        """The plateau of the first residual of relaxed data that shows one; of data that are not relaxed as its equal.

        In a tied run that diverges the stiffest mode is multiplied by -q with ``q = theta (1 + rho) - 1``.  Relaxed
        data stay at ``1 + 1/rho``, and the data that the other participant returns at ``1 + 1/q``.
        """
        found = self.plateaus
        if not found:
            return None
        partner = lambda one: any(_same(one, other.of_relaxed(self.theta)) for other in found if other is not one)
        relaxed = [one for one in found if partner(one)]
        relaxed += [one for one in found if 1 / (one.least - 1) * AGREE >= 2 / self.theta - 1]
        return relaxed[0] if relaxed else found[0].of_relaxed(self.theta)

    @property
    def rho_elsewise(self) -> Fraction | None:
        """rho if the only field at a plateau, which may be relaxed, is not; None elsewhere."""
        found = self.plateaus
        if len(found) != 1 or self.plateau != found[0]:
            return None
        return 1 / (found[0].of_relaxed(self.theta).value - 1)

    @property
    def explodes(self) -> bool:
        """True if a residual grows over too few steps for a ratio."""
        return any(column.count("growth") for column in self.columns)

    @property
    def stays(self) -> bool:
        """True if a residual of the run stays at a level or a plateau."""
        return any(column.count("level", "plateau") for column in self.columns)

    @property
    def converges(self) -> bool:
        """True if every field that shows a ratio falls, and none stays at a level, however low."""
        ratio = self.slowest
        at_level = any(column.count("level", "plateau", "floor") for column in self.columns)
        return ratio is not None and ratio.most < 1 and not at_level

    @property
    def diverges(self) -> bool:
        """True if the run does not converge as far as the log goes."""
        ratio = self.slowest
        return self.stays or (ratio is not None and ratio.least > 1)

    @property
    def swift(self) -> bool:
        """True if the residual falls so fast, in the mean of every window, that no faster run is looked for."""
        paces = [pace for pace in self.paces if pace.steps]
        return bool(paces) and all(pace.swift and not pace.adapts for pace in paces)

    @property
    def pooled(self) -> Observed | None:
        """The pace of the slowest field of which all windows are too short."""
        found = [column.pooled for column in self.columns if column.pooled is not None]
        return max(found, key=lambda ratio: ratio.value, default=None)

    @property
    def falls(self) -> bool:
        """True if the run converges, or is too short to be read and ends below a tenth of its largest residual."""
        paces = [pace for pace in self.paces if pace.steps]
        unread = self.slowest is None and not self.stays and bool(paces)
        return self.converges or (unread and all(not p.lost and p.height < FALLEN for p in paces))

    @property
    def made(self) -> Made:
        """Data from which the next run is chosen."""
        most = None if self.slowest is None else self.slowest.most
        means = [pace.height ** (1 / (pace.steps + pace.arrived)) for pace in self.paces if pace.steps]
        mean = max(means, default=1.0)
        if most is None and self.falls and all(pace.height < CONVERGED for pace in self.paces):
            most = Fraction(mean)
        return Made(theta=self.theta, falls=self.falls, rises=self.diverges, ratio=most, mean=mean)


@dataclass(frozen=True, kw_only=True)
class LogBound(Part):
    """A bound of rho, and the log that it comes from."""

    value: Fraction = key(type="number", unit="1", of=below)
    log: SeenLog

    file = derived("the log it comes from", lambda bound: bound.log.file)
    theta = derived("that of this log", lambda bound: float(bound.log.theta), float, unit="1")

    says: str = key("what this log shows")
    assumes: str = key("what must hold for the bound")


@dataclass(frozen=True, kw_only=True)
class RhoInterval(Part):
    """A bound of rho from below, and an estimate from above; ``contradiction`` says why no rho lies between them."""

    lo: LogBound | None = key(**_BOUND, why="no log bounds rho from below without a reading")
    hi: LogBound | None = key(
        **_BOUND, why="no log that converges gives one", of=lambda hi: hi.to_dict() | {"value": above(hi.value)}
    )
    contradiction: str | None = key(
        "which logs exclude each other",
        null="where none do",
        why=lambda rho: "the logs agree" if rho.lo and rho.hi else "one bound alone contradicts nothing",
    )


def bounds(logs: Sequence[SeenLog], kind: Kind = CONTACT) -> tuple[list[LogBound], list[LogBound]]:
    """Every bound of rho from below, and estimate from above, that a log gives."""
    lower, upper = [], []
    given = lambda words: kind.given(words) or LINEAR
    rho = lambda r, theta: rho_in_parallel(theta, r) if kind.parallel else (1 + r) / theta - 1
    for log in logs:
        ratio, plateau, theta = log.slowest, log.plateau, log.theta
        if ratio is not None and not {"mode-low", "open"} & {reading.kind for reading in log.readings}:
            says = f"its residual changes by {few(ratio.least)} a step or more, beyond 1 - theta"
            assumes = given(FROM_BELOW)
            assumes += RATIOS_RISE * log.explodes
            lower.append(LogBound(value=rho(ratio.least, theta), log=log, says=says, assumes=assumes))
        if log.diverges:
            assumes = given(FROM_BELOW) + MORE_ACCURATE * log.stays
            says, value = "its residual grows, or stays at a level", 2 / theta - 1
            least = min((pace.least or 1.0 for pace in log.paces if pace.kind == "level"), default=1.0)
            if kind.linear and least < 1:
                says, value = f"its residual falls by {few(least)} a step at most", rho(Fraction(least), theta)
            lower.append(LogBound(value=value, log=log, says=says, assumes=assumes))
        if plateau is not None and any(reading.kind == "plateau" for reading in log.readings):
            says = f"the relative residual of relaxed data stays at {few(plateau.value)}"
            lower.append(LogBound(value=1 / (plateau.most - 1), log=log, says=says, assumes=given(TIED)))
        if ratio is not None and log.converges:
            says = f"its residual changes by {few(ratio.most)} a step at most"
            upper.append(LogBound(value=rho(ratio.most, theta), log=log, says=says, assumes=given(FROM_ABOVE) + SHOWN))
    return lower, upper

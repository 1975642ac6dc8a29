"""What was seen in the logs of other runs, and what these bound together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from verification.advice.ends import DEAR, FEWEST, TO
from verification.advice.pace import CONVERGED, Pace
from verification.advice.readings import NextRun, Observed, RunReading

#: What a ratio assumes to bound rho from below, and what from above.
FROM_BELOW = "no friction, or a tied interface"
TIED = "a tied interface"
FROM_ABOVE = "a tied interface, or near the solution all of Gamma_c closed and nothing sliding"


@dataclass(frozen=True, kw_only=True)
class SeenColumn:
    """The residuals of one field of a log.

    Attributes
    ----------
    name : str
    residual : str
        ``absolute``, ``relative``, ``drop``, or ``assumed``: taken as absolute.
    paces : tuple of Pace
        Those of the time windows that were read.
    windows : int
        How many time windows the log has; too short ones are not read where there are others, of many the last ones.
    ratio, plateau : Observed or None
        Of the windows put together.
    """

    name: str
    residual: str
    paces: tuple[Pace, ...]
    windows: int
    ratio: Observed | None
    plateau: Observed | None

    def count(self, *kinds: str) -> int:
        """How many of the windows that were read are of these kinds."""
        return sum(pace.kind in kinds for pace in self.paces)

    @property
    def says(self) -> str:
        """What was seen, in words."""
        words = {
            "steady": "steady", "level": "at a level", "floor": "at a low level", "plateau": "at a plateau",
            "unsteady": "not steady", "short": "too short",
        }  # fmt: skip
        counts = {kind: self.count(kind) for kind in words}
        found = ", ".join(f"{n} {words[kind]}" for kind, n in counts.items() if n)
        if len(self.paces) == 1:
            found = next(words[kind] for kind, n in counts.items() if n)
        else:
            found = f"of {self.windows} windows {found}"
        if self.ratio is not None:
            found += f"; ratio {_within(self.ratio)}"
        if self.plateau is not None:
            found += f"; plateau {_within(self.plateau)}"
        if self.count("short") == len(self.paces):
            found += f", {max(pace.steps for pace in self.paces)} steps at most"
        return found

    def to_dict(self) -> dict[str, Any]:
        """A member of ``logs.columns``."""
        return {
            "name": self.name,
            "residual": self.residual,
            "windows": self.windows,
            "read": {kind: self.count(kind) for kind in ("steady", "level", "floor", "plateau", "unsteady", "short")},
            "ratio": _three(self.ratio),
            "plateau": _three(self.plateau),
            "says": self.says,
            "reason": {name: "no window shows one" for name in ("ratio", "plateau") if getattr(self, name) is None},
        }


@dataclass(frozen=True, kw_only=True)
class SeenLog:
    """One log of a run with constant theta.

    Attributes
    ----------
    file : str
    form : str
    theta : Fraction
    steps : int
        Over how many steps a ratio had to be steady.
    columns : tuple of SeenColumn
    readings : tuple of RunReading
        What this log can mean; empty where nothing in it is steady.
    next : NextRun
        The run to make next if there were no other log.
    rho : Fraction or None
        That of its only reading.
    notes : tuple of str
    """

    file: str
    form: str
    theta: Fraction
    steps: int
    columns: tuple[SeenColumn, ...]
    readings: tuple[RunReading, ...]
    next: NextRun
    rho: Fraction | None
    notes: tuple[str, ...]

    @property
    def slowest(self) -> Observed | None:
        """The ratio of the field which is slowest: a norm that does not see a mode falls faster."""
        found = [column.ratio for column in self.columns if column.ratio is not None]
        return max(found, key=lambda ratio: ratio.value, default=None)

    @property
    def plateau(self) -> Observed | None:
        """The plateau of the first relative residual that shows one."""
        return next((column.plateau for column in self.columns if column.plateau is not None), None)

    @property
    def stays(self) -> bool:
        """Whether a residual of the run stays at a level or a plateau."""
        return any(column.count("level", "plateau") for column in self.columns)

    @property
    def converges(self) -> bool:
        """Whether every field that shows a ratio falls, and none stays at a level, however low."""
        ratio = self.slowest
        return (
            ratio is not None and ratio.most < 1 and not any(c.count("level", "plateau", "floor") for c in self.columns)
        )

    @property
    def diverges(self) -> bool:
        """Whether the run does not converge as far as the log goes."""
        ratio = self.slowest
        return self.stays or (ratio is not None and ratio.least > 1)

    @property
    def swift(self) -> bool:
        """Whether the run has fallen to CONVERGED so fast, in the mean, that no faster one is looked for."""
        paces = [pace for column in self.columns for pace in column.paces]
        return all(p.height < CONVERGED and math.log(p.height) / p.steps <= TO / (DEAR * FEWEST) for p in paces)

    def to_dict(self) -> dict[str, Any]:
        """A member of ``logs``."""
        return {
            "file": self.file,
            "form": self.form,
            "theta": float(self.theta),
            "steady_over": self.steps,
            "columns": [column.to_dict() for column in self.columns],
            "readings": [reading.to_dict() for reading in self.readings],
            "notes": list(self.notes),
        }


@dataclass(frozen=True, kw_only=True)
class LogBound:
    """A bound of rho, the log that it comes from, and what it assumes.

    Attributes
    ----------
    value : Fraction
    log : SeenLog
    says : str
    assumes : str
    """

    value: Fraction
    log: SeenLog
    says: str
    assumes: str

    def to_dict(self) -> dict[str, Any]:
        """The object ``interval.lo`` or ``interval.hi``."""
        return {
            "value": float(self.value),
            "file": self.log.file,
            "theta": float(self.log.theta),
            "says": self.says,
            "assumes": self.assumes,
        }


@dataclass(frozen=True, kw_only=True)
class Interval:
    """What logs of one coupling say of rho together.

    Attributes
    ----------
    lo, hi : LogBound or None
    contradiction : str or None
        Why there is no rho between them.
    """

    lo: LogBound | None
    hi: LogBound | None
    contradiction: str | None

    def to_dict(self) -> dict[str, Any]:
        """The object ``interval``."""
        reason = {}
        if self.lo is None:
            reason["lo"] = "no log bounds rho from below without a reading"
        if self.hi is None:
            reason["hi"] = "no log converges"
        if self.contradiction is None:
            reason["contradiction"] = "the logs agree" if self.lo and self.hi else "one bound alone contradicts nothing"
        return {
            "lo": None if self.lo is None else self.lo.to_dict(),
            "hi": None if self.hi is None else self.hi.to_dict(),
            "contradiction": self.contradiction,
            "reason": reason,
        }


def bounds(logs: Sequence[SeenLog]) -> tuple[list[LogBound], list[LogBound]]:
    """Every bound of rho from below and from above that a log gives."""
    lower, upper = [], []
    for log in logs:
        ratio, plateau, theta = log.slowest, log.plateau, log.theta
        if ratio is not None and not {"mode-low", "open"} & {reading.kind for reading in log.readings}:
            says = f"its residual changes by {_few(ratio.least)} a step or more, beyond 1 - theta"
            lower.append(LogBound(value=(1 + ratio.least) / theta - 1, log=log, says=says, assumes=FROM_BELOW))
        if log.diverges:
            lower.append(LogBound(value=2 / theta - 1, log=log, says="it does not converge", assumes=FROM_BELOW))
        if plateau is not None and any(reading.kind == "plateau" for reading in log.readings):
            says = f"its relative residual stays at {_few(plateau.value)}"
            lower.append(LogBound(value=1 / (plateau.most - 1), log=log, says=says, assumes=TIED))
        if ratio is not None and log.converges:
            says = f"its residual changes by {_few(ratio.most)} a step at most"
            upper.append(LogBound(value=(1 + ratio.most) / theta - 1, log=log, says=says, assumes=FROM_ABOVE))
    return lower, upper


def _three(seen: Observed | None) -> dict[str, float] | None:
    return None if seen is None else {name: float(getattr(seen, name)) for name in ("value", "least", "most")}


def _within(seen: Observed) -> str:
    return f"{_few(seen.value)} ({_few(seen.least)} to {_few(seen.most)})"


def _few(value: Fraction) -> str:
    return f"{float(value):.4g}"

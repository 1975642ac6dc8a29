"""What was seen in the logs of other runs, and what these bound together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ndtheory.number import above, below
from verification.advice.next_run import Made
from verification.advice.pace import Pace
from verification.advice.readings import NextRun, Observed, RunReading

#: A residual below this share of its largest value has fallen, although the log is too short for a ratio.
FALLEN = 0.1

#: What a ratio assumes to bound rho from below, and what from above.
FROM_BELOW = "no friction, or a tied interface"
TIED = "a tied interface"
FROM_ABOVE = "a tied interface, or near the solution all of Gamma_c closed and nothing sliding"


_WHY_NOT = {
    "ratio": "no window shows one",
    "plateau": "no window shows one",
    "pooled": "windows are read one by one, or are too few or too short to be pooled",
}


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
    pooled : Observed or None
        The pace of windows that are all too short, which bounds nothing.
    """

    name: str
    residual: str
    paces: tuple[Pace, ...]
    windows: int
    ratio: Observed | None
    plateau: Observed | None
    pooled: Observed | None = None

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
        if self.pooled is not None:
            found += f"; pooled, the second half of each: ratio {_within(self.pooled)}"
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
            "pooled": _three(self.pooled),
            "says": self.says,
            "reason": {name: why for name, why in _WHY_NOT.items() if getattr(self, name) is None},
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
        """True if the residual falls so fast, in the mean of every window, that no faster run is looked for."""
        paces = [pace for column in self.columns for pace in column.paces if pace.steps]
        return bool(paces) and all(pace.swift for pace in paces)

    @property
    def pooled(self) -> Observed | None:
        """The pace of the slowest field of which all windows are too short."""
        found = [column.pooled for column in self.columns if column.pooled is not None]
        return max(found, key=lambda ratio: ratio.value, default=None)

    @property
    def falls(self) -> bool:
        """True if the run converges, or is too short to be read and ends below a tenth of its largest residual."""
        paces = [pace for column in self.columns for pace in column.paces if pace.steps]
        unread = self.slowest is None and not self.stays and bool(paces)
        return self.converges or (unread and all(not p.lost and p.height < FALLEN for p in paces))

    @property
    def made(self) -> Made:
        """Input of the choice of the next run."""
        most = None if self.slowest is None else self.slowest.most
        return Made(theta=self.theta, falls=self.falls, rises=self.diverges, ratio=most)

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

    def to_dict(self, *, up: bool) -> dict[str, Any]:
        """The object ``interval.lo`` or ``interval.hi``, whose value is rounded outwards."""
        return {
            "value": above(self.value) if up else below(self.value),
            "file": self.log.file,
            "theta": float(self.log.theta),
            "says": self.says,
            "assumes": self.assumes,
        }


@dataclass(frozen=True, kw_only=True)
class RhoInterval:
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
            "lo": None if self.lo is None else self.lo.to_dict(up=False),
            "hi": None if self.hi is None else self.hi.to_dict(up=True),
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

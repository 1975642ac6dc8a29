"""The experiments of Section 6 in every reading, with a verdict on each figure."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from ndtheory.keys import Key, Part, derived, key, says
from verification.algorithm.monolithic import SolveError, solve
from verification.document import Document
from verification.interface.fields import ContactFields
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.problem import Problem
from verification.problem.tables import ProblemError
from verification.reproduce.claims import (
    CLAIMS,
    PRINTED_THETA,
    SERVES,
    Curve,
    Verdict,
    curves_hold,
    share_as_printed,
    zones,
    zones_hold,
)
from verification.reproduce.readings import READINGS, ModelReading
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import FAILED, Row
from verification.sweeps.sweep import duration, sweep_grid
from verification.sweeps.workers import Placed, Work, work_of

FIGURES = tuple(CLAIMS)

#: Seconds before a time to go is estimated.
FIRST_ESTIMATE = 2.0

#: 0.05 to 0.95.
THETAS = tuple(f"{n / 20:.2f}" for n in range(1, 20))

#: The keys of a zone.
ZONE = {
    "state": Key(says="`stick`, `slip` or `open`", type="text"),
    "from": Key(says=r"from the left end of $\Gamma_c$", unit="length", type="number"),
    "to": Key(says=r"from the left end of $\Gamma_c$", unit="length", type="number"),
}


@dataclass(frozen=True, kw_only=True)
class Outcome(Part):
    """One figure in one reading: contact for Figure 5, curves for the others."""

    reading: ModelReading = key("which one")
    holds: bool | None = key(
        "whether the reading reproduces the figure", null="where it is refused or undecided", why=None
    )
    closeness: float = key(
        r"how near it comes: the share of $\Gamma_c$ in the printed state, or the fewest steps over those at 0.6 on the"
        " worst curve",
        default=0.0,
    )
    contact: ContactFields | None = key(
        r"states along $\Gamma_c$ in order",
        name="zones",
        default=None,
        type="list of object",
        null="except for `fig5`",
        why=None,
        of=lambda contact: [{"state": state, "from": low, "to": high} for state, low, high in zones(contact)],
        inside=ZONE,
    )
    curves: tuple[Curve, ...] = key("the curves of a figure; empty for `fig5`", default=())
    reason: str = key("why the reading is refused or undecided; empty elsewhere", default="")

    @property
    def refused(self) -> bool:
        """True if nothing of it was computed."""
        return self.holds is None and not self.curves


@dataclass(frozen=True, kw_only=True)
class Result(Part):
    """A figure of the paper in all readings; ``rows`` are the runs behind it, with the name of the reading."""

    figure: str = key("`fig5`, `fig10`, `fig11` or `fig12`")
    outcomes: tuple[Outcome, ...] = key("one for each reading", name="readings")
    rows: tuple[dict[str, Any], ...] = field(default=(), repr=False)

    claim = derived("the claim of the paper about it", lambda result: CLAIMS[result.figure].says, name="says")
    criterion = derived("when a reading reproduces it", lambda result: CLAIMS[result.figure].criterion)

    @property
    @says("`reproduced`, `reproduced under an assumption`, `undecided` or `not reproduced`")
    def verdict(self) -> Verdict:
        """Reproduced if all readings of the text show it, under an assumption if any reading does."""
        seen = [o for o in self.outcomes if not o.refused]
        of_text = [o.holds for o in seen if not o.reading.departs]
        if of_text and all(of_text):
            return "reproduced"
        if any(o.holds for o in seen):
            return "reproduced under an assumption"
        return "undecided" if any(o.holds is None for o in seen) else "not reproduced"

    @property
    @says("the name of the reading that comes nearest", type="text", of=lambda outcome: outcome.reading.name)
    def closest(self) -> Outcome:
        """The reading that comes nearest; among equals the one that departs least from the text, and the first."""
        return max(self.outcomes, key=lambda o: (bool(o.holds), o.closeness, -len(o.reading.departs)))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Reproduction(Document):
    """Figures of Section 6, run again."""

    schema: ClassVar[str] = "ndtheory.reproduce/1"
    units: ClassVar[Mapping[str, str]] = {"length": "mm", "stress": "MPa"}  # type: ignore[misc]

    results: tuple[Result, ...] = key("one for each figure", name="figures")

    @property
    def summary(self) -> str:
        return "; ".join(f"{result.figure}: {result.verdict}" for result in self.results)

    @property
    @says("the reading that comes nearest to all figures together", name="closest.reading")
    def closest(self) -> ModelReading:
        """Most figures reproduced, then nearest in the mean."""
        score = lambda reading: (
            self.reproduced(reading),
            sum(o.closeness for o in self._of(reading)),
            -len(reading.departs),
        )
        return max((outcome.reading for outcome in self.results[0].outcomes), key=score)

    @property
    @says("how many figures it reproduces", name="closest.reproduced")
    def reproduced_closest(self) -> int:
        return self.reproduced(self.closest)

    def reproduced(self, reading: ModelReading) -> int:
        """The number of figures that a reading reproduces."""
        return sum(bool(outcome.holds) for outcome in self._of(reading))

    def _of(self, reading: ModelReading) -> list[Outcome]:
        return [o for result in self.results for o in result.outcomes if o.reading == reading]


def reproduce(
    figures: Sequence[str] = FIGURES,
    *,
    readings: Sequence[ModelReading] = READINGS,
    jobs: int = 1,
    store: Path | None = None,
    progress: Progress = silent,
) -> Reproduction:
    """Run the experiments behind figures of Section 6 in every reading.

    Parameters
    ----------
    figures : sequence of {'fig5', 'fig10', 'fig11', 'fig12'}
    readings : sequence of ModelReading
    jobs : int
        Processes for the runs.
    store : path, optional
        A file that keeps the runs, and has those that were made before.  Figure 5 has no run: it is solved anew.
    progress : callable
        Receives the figure with the number of rows that are done, and their share.

    Raises
    ------
    ValueError
        An unknown figure.
    """
    for name in figures:
        if name not in CLAIMS:
            raise ValueError(f"no figure {name!r}; there are {', '.join(CLAIMS)}")
    outcomes: dict[str, list[Outcome]] = {name: [] for name in figures}
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in figures}
    tell = _counted(progress, len(readings) * sum(map(size_of, outcomes)))
    done = 0
    for reading in readings:
        work = shared(work_of(jobs), reading.problem(60))
        for name in outcomes:
            now = partial(tell, name, done, size_of(name))
            now("", 0.0)
            outcome, behind = _zones(reading) if name == "fig5" else _curves(name, reading, work, store, now)
            outcomes[name].append(outcome)
            rows[name] += [{"reading": reading.name, **row} for row in behind]
            done += size_of(name)
    return Reproduction(
        results=tuple(Result(figure=name, outcomes=tuple(outcomes[name]), rows=tuple(rows[name])) for name in figures)
    )


def size_of(figure: str) -> int:
    """The number of rows of a figure in one reading; Figure 5 counts as one."""
    return 1 if figure == "fig5" else len(THETAS) * math.prod(map(len, CLAIMS[figure].axes.values()))


def _counted(progress: Progress, total: int) -> Callable[[str, int, int, str, float | None], None]:
    """Progress by rows, with the time to go after the first ones that took any."""
    begun = time.monotonic()

    def tell(figure: str, before: int, size: int, what: str, share: float | None) -> None:
        done, passed = before + size * (share or 0.0), time.monotonic() - begun
        left = f", {duration(passed * (total - done) / done)} to go" if done and passed > FIRST_ESTIMATE else ""
        progress(f"{figure}: row {done:.0f} of {total}{left}", done / total)

    return tell


def _zones(reading: ModelReading) -> tuple[Outcome, list[dict[str, Any]]]:
    """Figure 5: the states along Gamma_c, by the global method; a run finds the same, where there is one."""
    try:
        contact = solve(reading.problem(190)).contact
    except (ProblemError, SolveError) as error:
        return Outcome(reading=reading, holds=None, reason=str(error)), []
    columns = contact.table()
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    return Outcome(
        reading=reading, holds=zones_hold(contact), closeness=share_as_printed(contact), contact=contact
    ), rows


def changed(problem: Problem, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a grid that the problem does not have: a row with these alone is the same."""
    own = {"friction": problem.contact.friction, "young": (problem.body1.young, problem.body2.young)}
    return {name: value for name, value in values.items() if own.get(name) != value}


def shared(work: Work, problem: Problem) -> Work:
    """Work for the sweeps of one problem, one after the other, which makes each row once: figures share curves."""
    known: dict[tuple[tuple[str, Any], ...], Row] = {}

    def made(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
        keys = {place: tuple(changed(problem, values).items()) for place, values in wanted}
        ready = [(place, known[key]) for place, key in keys.items() if key in known]
        if ready:
            yield ready
        left = dict(wanted).keys() - dict(ready).keys()
        for rows in work(start, [one for one in wanted if one[0] in left]):
            known.update((keys[place], row) for place, row in rows)
            yield rows

    return made


def _curves(
    name: str, reading: ModelReading, work: Work, store: Path | None, progress: Progress
) -> tuple[Outcome, list[dict[str, Any]]]:
    """A figure of steps over theta."""
    claim = CLAIMS[name]
    grid = SweepGrid.of({**claim.axes, "theta": THETAS})
    found = sweep_grid(reading.problem(60), grid, work=work, store=store, progress=progress)
    if found.interrupted:
        raise KeyboardInterrupt
    rows = [dict(row) for row in found.rows]
    of_curve = [rows[i : i + len(THETAS)] for i in range(0, len(rows), len(THETAS))]  # theta changes fastest
    for label, some in zip(claim.labels, of_curve, strict=True):
        for row in some:
            row["curve"] = label
    return outcome_of(name, reading, dict(zip(claim.labels, of_curve, strict=True))), rows


def outcome_of(
    figure: str, reading: ModelReading, rows: Mapping[str, Sequence[Mapping[str, Any]]], missing: str = ""
) -> Outcome:
    """The outcome of a figure from the runs of each curve, by label.

    A curve on which only some theta were run may refute; a reading that it does not refute needs all of them.
    ``missing`` names the runs of the figure that were not made: without them a reading is refuted or undecided.
    """
    failed = [row for some in rows.values() for row in some if row["outcome"] in FAILED]
    curves = tuple(curve for label, some in rows.items() if PRINTED_THETA in (curve := curve_of(label, some)).steps)
    reason = str(failed[0]["reason"]) if failed else missing
    worst = max((curve.cost for curve in curves), default=math.inf)
    near = 0.0 if math.isinf(worst) else 1 / worst
    holds: bool | None = None
    if curves and worst > SERVES:
        holds, reason = False, ""
    elif not reason:
        holds = curves_hold(figure, curves)
    return Outcome(reading=reading, holds=holds, closeness=near, curves=curves, reason=reason)


def curve_of(label: str, rows: Sequence[Mapping[str, Any]]) -> Curve:
    """The curve of some runs, without those that failed."""
    ran = [row for row in rows if row["outcome"] not in FAILED]
    steps = {float(row["theta"]): row["iterations_paper"] for row in ran}
    unrelaxed = {float(row["theta"]): row["iterations"] if row["outcome"] == "converged" else None for row in ran}
    return Curve(label=label, steps=steps, unrelaxed=unrelaxed, rho=ran[0]["rho"] if ran else None)

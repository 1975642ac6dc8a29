"""Runs over grids: a sweep with the best theta of each curve, or its runs, and the plane of theta and k."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Any

from verification import registry
from verification.algorithm.loop import Outcome
from verification.problem.specification import Problem
from verification.show.numbers import NONE, count, figures, near_one
from verification.show.parts import Cell, Facts, Next, Quantity, Sections, closing, following, section, table
from verification.sweeps.region import MOST_STEPS, Plane
from verification.sweeps.row import Row
from verification.sweeps.store import Plan
from verification.sweeps.sweep import Sweep

#: Lines of a table that are shown; the file has them all.
MOST_LINES = 24

#: How columns are headed where there is little room.
HEADS = {"young1": "E1", "young2": "E2", "neumann_body": "Neumann", "friction": "k"}


@registry.sections.register
def sections(found: Sweep, target: Path | None = None) -> Sections:
    """The sections; ``target`` is where the rows are written."""
    curves = [name for name in found.axes if name != "theta"]
    shown = [name for name in curves if len({each[name] for each in found.rows}) > 1]
    if "theta" in found.axes:
        id, title, last = "best", "WHICH THETA TAKES THE FEWEST STEPS?", "converged"
        lines = [(*(_short(rows[0][name]) for name in shown), *_best(rows)) for rows in found.values(curves).values()]
    else:
        id, title, last = "rows", "HOW MANY STEPS DOES EACH RUN TAKE?", "outcome"
        lines = [(*(_short(each[name]) for name in shown), *_line(each), each["outcome"]) for each in found.rows]
    head = (*(HEADS.get(name, name) for name in shown), "theta", "steps", "6.3", "rate", "rho", last)
    outcomes = [str(each["outcome"]) for each in found.rows]
    notes = [", ".join(f"{outcomes.count(name)} {name}" for name in dict.fromkeys(outcomes))]
    if len(lines) > MOST_LINES:
        notes.insert(0, f"and {len(lines) - MOST_LINES} more lines")
    notes.append("6.3: steps by the increment test of Section 6.3; steps: by the unrelaxed residual.")
    then: Next | str = ""
    if target is not None:
        of_file = found.problem is not None and found.problem.source != "<dict>"
        then = following("compare") if of_file else "ndtheory example"
    runs = f"{len(found.rows)} of {found.asked} runs" if found.interrupted else f"{found.asked} runs"
    rows = table(head, lines[:MOST_LINES], right=range(len(shown) + 5))
    return (
        section("setting", "", Facts(_title(found.problem), (runs,))),
        section(id, title, rows, *notes),
        closing("anything about a theta between two of the grid", then=then),
    )


@registry.sections.register
def plan(found: Plan) -> Sections:
    """A sweep that was planned, not run."""
    title = Facts(_title(found.problem), (f"{found.asked} runs",))
    left = f"{found.stored} are in the store, {found.left} are left; nothing was run"
    return (section("setting", "", title, left),)


def _title(problem: Problem | None) -> str:
    return "matrices" if problem is None else problem.title


def _best(rows: list[Row]) -> list[Cell]:
    arrived = [each for each in rows if each["iterations"] is not None]
    best = min(arrived, key=lambda each: (each["iterations"], each["observed_rate"] or 1.0), default=None)
    of = f"{len(arrived)} of {len(rows)} thetas"
    return [*((*[NONE] * 4, figures(rows[0]["rho"])) if best is None else _line(best)), of]


def _line(each: Row) -> list[Cell]:
    rate = each["observed_rate"]
    counts = [count(each["iterations"]), count(each["iterations_paper"])]
    return [_short(each["theta"]), *counts, NONE if rate is None else near_one(rate), figures(each["rho"])]


def _short(value: Any) -> Cell:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return Quantity(value, f"{value:.4g}" if isinstance(value, float) else str(value))
    return NONE if value is None else str(value)


@registry.sections.register
def plane(found: Plane, target: Path | None = None) -> Sections:
    """The sections of the plane of theta and k; ``target`` is where the figure is drawn."""
    rows = []
    notes: list[str] = []
    for name, region in found.regions.items():
        if region.k:
            highest = figures(max(hi for _, hi in region.theta))
            some = region.every if region.some is None else region.some  # where every small theta contracts some do
            rows.append((name, figures(region.every), figures(some), highest))
            notes += registry.BOUNDS[name].remarks(None, found.units["stress"])
    notes += [f"{name}: {reason}" for name, reason in found.reason.items()]
    lines = table(("bound", "every small theta: k <", "some theta: k <", "theta at most"), rows)
    outcomes = [point.outcome for point in found.points]
    after = {Outcome.LIMIT: f" after {MOST_STEPS} steps"}
    runs = [", ".join(f"{outcomes.count(one)} {one.seen}{after.get(one, '')}" for one in dict.fromkeys(outcomes))]
    strongest = max((p.k for p in found.points if p.outcome == "converged"), default=None)
    if strongest is not None:
        runs.append(f"the largest friction with a run that converged: k = {strongest:g}")
    return (
        section("setting", "", Facts(found.title)),
        section("regions", "WHERE IS ONE STEP PROVED TO CONTRACT?", lines, *notes),
        section("runs", "WHAT DID RUNS DO?", *runs),
        closing(
            "non-convergence outside a region, or anything on the continuum",
            then="" if target is None else f"open {quote(str(target))}",
        ),
    )

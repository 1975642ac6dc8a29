"""Runs of another code, given as the ratio of one or as logs, and the values of rho that they allow."""

from __future__ import annotations

from collections.abc import Sequence

from verification.advice.readings import RunReading, SeenRun
from verification.advice.roles import Advice
from verification.advice.runs_with_friction import FrictionBounds
from verification.advice.seen import LogBound, RhoInterval, SeenLog
from verification.sections.advised import next_run
from verification.sections.numbers import NONE, rounded
from verification.sections.parts import Cell, Note, Quantity, Section, Sections, Table, section, table

#: So many columns of all logs together are shown; the document holds every one.
MOST_COLUMNS = 8

#: What the kind of a residual is called, where not by its name.
RESIDUALS = {"assumed": "taken as absolute", "drop": "over the first one"}


def assumed(found: Advice) -> Section:
    """The assumption under which runs are read, before all else."""
    notes = [Note(f"Assumed: {found.assumes}.", 0)]
    if not found.tied and found.friction_bounds is None:
        notes.append(Note("With friction what follows may be false: add --friction.", 0))
    return section("assumed", "", *notes)


def of_a_run(found: Advice, run: SeenRun) -> Sections:
    """What a run says of rho, and which one is to be made next."""
    given = f"theta = {float(run.theta):.4g}; the residual |Tg - g| changes by {float(run.ratio):.4g} a step"
    notes = (
        f"{given}, absolute and unrelaxed, steadily over {run.steps} steps or more.",
        "A residual that rises and falls has no steady ratio: give 1.",
        "The relative residual |Tg - g|/|Tg| of coupling libraries tells other things.",
    )
    said = section("rho", "WHAT DOES THE RUN SAY OF RHO?", *notes, _readings(found.readings))
    return (said, *_with_friction(found.friction_bounds), *([] if found.next is None else [next_run(found.next)]))


def of_logs(found: Advice, interval: RhoInterval) -> Sections:
    """What logs say of rho, alone and together, and which run is to be made next."""
    read = [_readings(found.readings)] if found.readings else []
    notes = [] if read else ["Nothing: no residual falls, grows or stays steadily."]
    if interval.contradiction is not None:
        notes.append(f"CONTRADICTION: {interval.contradiction}.")
    else:
        notes += _bound("least", interval.lo, found.logs) + _bound("most", interval.hi, found.logs)
    return (
        _seen(found.logs),
        section("rho", "WHAT DO THEY SAY OF RHO?", *read, *notes),
        *_with_friction(found.friction_bounds),
        *([] if found.next is None else [next_run(found.next)]),
    )


def _seen(logs: Sequence[SeenLog]) -> Section:
    """The logs, column by column."""
    parts: list[Note | str] = []
    room = MOST_COLUMNS
    for log in logs:
        parts.append(f"theta = {float(log.theta):.4g}, {log.form}, {log.file}")
        for column in log.columns[:room]:
            parts.append(Note(f"{column.name}, {RESIDUALS.get(column.residual, column.residual)}: {column.says}", 4))
        room -= len(log.columns[:room])
        parts += [Note(words, 4) for words in log.notes]
    left = sum(len(log.columns) for log in logs) - MOST_COLUMNS
    if left > 0:
        parts.append(f"and {left} columns more, see --json")
    steps = " and ".join(f"{n}" for n in sorted({log.steps for log in logs})) + " steps"
    parts.append(f"Assumed: theta constant in each run, no Aitken or quasi-Newton.  A ratio counts over {steps}.")
    return section("logs", "WHAT DO THE LOGS SHOW?", *parts)


def _readings(readings: Sequence[RunReading]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for reading in readings:
        low = reading.lo
        rho = NONE if low is None else Quantity(float(low), f">= {rounded(low, 3, up=False)}")
        rows.append((reading.kind, rho, reading.says))
    return table(("reading", "rho", "if it is the right one"), rows)


def _bound(which: str, bound: LogBound | None, logs: Sequence[SeenLog]) -> list[str]:
    if bound is None:
        return []
    source = f"theta = {float(bound.log.theta):.4g}: {bound.says}" if len(logs) > 1 else bound.says
    value = rounded(float(bound.value), 3, up=which == "most")
    return [f"rho is at {which} {value} given {bound.assumes} ({source})"]


def _with_friction(bounds: FrictionBounds | None) -> Sections:
    """Bounds that hold with friction; nothing without friction."""
    if bounds is None:
        return ()
    said = []
    if bounds.image is not None:
        image = rounded(bounds.image, 3, up=False)
        theorem = "sqrt(rho) R, with 2 R = s + sqrt(s^2 + 4 kappa_2) and s = sqrt(rho) + kappa_1"
        said.append(f"The Lipschitz constant of T in the norm (5.21) is at least {image}; it is at most {theorem}.")
    if bounds.eigenvalue is not None and bounds.theta is not None and bounds.rate is not None:
        least, most = (rounded(end, 3, up=up) for end, up in zip(bounds.eigenvalue, (False, True), strict=True))
        gain = rounded(1 - bounds.rate, 3, up=False)
        near = f"Near the solution of the run at theta = {bounds.theta:.4g}, if contact does not change there, its"
        words = f"slowest mode has |1 + lambda| from {least} to {most}, and a smaller theta' takes at most"
        said.append(f"{near} {words} 1 - {gain} theta'/{bounds.theta:.4g} a step.")
    return (section("with friction", "WHAT IS PROVED WITH FRICTION?", *(said or ["Nothing."])),)

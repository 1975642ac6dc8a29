"""Sections of advice from runs of other codes: what they show of rho, and the run to make next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from verification.coupling.accelerated import Accelerated
from verification.coupling.advice import Advice
from verification.coupling.pace import RELATIVE
from verification.coupling.readings import RunReading
from verification.coupling.runs import Logs, OneRun, Runs
from verification.coupling.runs_with_friction import UNSETTLED, FrictionBounds
from verification.coupling.sections import (
    AS_ABOVE,
    few_methods,
    next_run,
    of,
    paste,
    paste_and_quote,
    which_body_and_theta,
    which_method,
)
from verification.coupling.seen import LogBound, SeenLog
from verification.show.numbers import NONE, rounded
from verification.show.parts import Cell, Note, Quantity, Section, Sections, Table, closing, section, table

#: Columns of all logs together that are shown; the document holds every one.
MOST_COLUMNS = 8

#: What decides where a residual stays at a level: without friction, where nothing opens or slips, and with friction.
STUCK = {
    "contact": "without friction every theta below 2/(1 + rho) converges; if a smaller one does not, a solver has "
    "noise or a memory, or there is friction",
    "linear": "theta is at the limit of a mode; or a solver has noise or a memory, as two evaluations of one x show, "
    "or is not linear, and then a smaller theta need not help",
    "friction": "with friction a smaller theta need not help",
}

#: Words for kinds of residuals; the others are called by their names.
RESIDUALS = {"assumed": "taken as absolute", "drop": "over the first or largest one", "previous": "over |x|"}


@of.register
def _of_run(run: OneRun, found: Advice) -> Iterator[Section]:
    yield _assumed(run)
    yield from of_a_run(run)
    if found.roles and run.kind.signed:
        yield from which_body_and_theta(found)
    yield from which_method(found)
    if found.roles:
        yield from paste_and_quote(found)
    made = (*run.earlier, (run.theta, run.ratio)) if not run.kind.signed else ()
    before = "".join(f"--theta {float(theta):g} --ratio {float(ratio):g} " for theta, ratio in made)
    options = f"{run.kind.typed}{'--friction ' * run.rubs}{before}"
    again = AS_ABOVE if found.roles and made else f"ndtheory advise run {options}--theta {{}} --ratio R (R: its ratio)"
    yield _end(run, found, again)


@of.register
def _of_logs(logs: Logs, found: Advice) -> Iterator[Section]:
    yield _assumed(logs)
    yield from of_logs(logs)
    few = [few_methods(found)] if found.roles and any(row.bound for row in found.methods) else []
    if not few:
        yield from which_method(found)
    if found.roles:
        yield paste(found, *few)
    again = AS_ABOVE if found.roles else "a run with theta = {0}; then this again plus --log LOG --theta {0}"
    yield _end(logs, found, again)


def _end(runs: Runs, found: Advice, again: str) -> Section:
    theta = f"{runs.next.theta:g}"
    then = f"no run; keep theta = {theta}" if runs.next.kept and not found.roles else again.format(theta)
    friction = runs.kind.given("a bound of rho with friction, or ")
    return closing(f"{friction}that a reading is the right one", then=then)


def _assumed(runs: Runs) -> Section:
    """The assumption under which runs are read, before all else."""
    free = not (runs.kind.linear or runs.kind.parallel or runs.rubs)
    otherwise = " With friction add --friction." if free else ""
    return section("assumed", "", Note(f"Assumed: {runs.assumes}.{otherwise}", 0))


def of_a_run(run: OneRun) -> Sections:
    """The readings of a run as values of rho, and the run to make next."""
    given = (
        f"theta = {float(run.theta):.4g}; the residual |Tg - g| is multiplied by {float(run.ratio):.4g} in each step"
    )
    notes = (
        f"{given}, absolute and unrelaxed, steadily over {run.steps} steps or more.",
        "A residual that rises and falls has no steady ratio: give 1.",
        "For the relative residual |Tg - g|/|Tg| that coupling libraries log, use --log.",
    )
    said = section("rho", "WHAT DOES THE RUN SAY OF RHO?", *notes, _readings(run.readings))
    return (said, *_with_friction(run.friction_bounds), next_run(run.next))


def of_logs(found: Logs) -> Sections:
    """The values of rho that each log and all logs together allow, and the run to make next."""
    read = [_readings(found.readings)] if found.readings else []
    notes = [f"Aitken's {log.factors.says}." for log in found.accelerated if log.factors is not None]
    if not read and any(log.stays for log in found.logs):
        changes = found.kind.given(", or where contact changes")
        notes.append(f"Nothing by itself: a level is about where theta begins to diverge{changes}.")
    elif not read and any(log.slowest for log in found.logs):
        notes.append("No reading by itself: the ratios are read together.")
    elif not read and found.logs:
        notes.append("Nothing: no time window shows a steady ratio or level over enough steps.")
    elif not read and not notes:
        notes.append("Nothing: residuals show rho only where the relaxation is constant.")
    stuck = [log for log in found.logs if log.stays]
    if stuck and not any(log.converges for log in found.logs):
        at = ", ".join(f"{float(log.theta):.4g}" for log in stuck)
        why = STUCK["friction" if found.rubs else "linear" if found.kind.linear else "contact"]
        notes.append(f"No progress with theta = {at}: {why}. IQN-ILS, another start or exchanged roles may.")
        if all(column.residual in RELATIVE for log in stuck for column in log.columns):
            notes.append("Relative residuals stay so too where the run grows, whose ratio only absolute ones show.")
    if found.logs and not found.decided and not found.next.kept:
        notes.append("A few vectors of a run decide more than its log: ndtheory advise vectors --help.")
    if found.interval.contradiction is not None:
        notes.append(f"CONTRADICTION: {found.interval.contradiction}.")
    else:
        notes += _bound("least", found.interval.lo, found.logs) + _bound("most", found.interval.hi, found.logs)
    return (
        _seen(found.logs, found.accelerated),
        section("rho", "WHAT DO THEY SAY OF RHO?", *read, *notes),
        *_with_friction(found.friction_bounds),
        next_run(found.next),
    )


def _seen(logs: Sequence[SeenLog], accelerated: Sequence[Accelerated]) -> Section:
    """The logs, column by column."""
    parts: list[Note | str] = []
    most = max(MOST_COLUMNS // max(len(logs), 1), 1)
    for log in logs:
        parts.append(f"theta = {float(log.theta):.4g}, {log.form}, {log.file}")
        for column in log.columns[:most]:
            parts.append(Note(f"{column.name}, {RESIDUALS.get(column.residual, column.residual)}: {column.says}", 4))
        parts += [Note(words, 4) for words in log.notes]
    if left := sum(len(log.columns[most:]) for log in logs):
        parts.append(f"and {left} columns more, see --json")
    for one in accelerated:
        parts.append(f"{one.accelerator}, {one.form}, {one.file}")
        parts += [Note(words, 4) for words in (one.says if one.factors is None else one.counted, *one.notes)]
    if logs:
        steps = " and ".join(map(str, sorted({log.steps for log in logs}))) + " steps"
        parts.append(f"Assumed: theta constant in each run, no Aitken or quasi-Newton.  A ratio counts over {steps}.")
    return section("logs", "WHAT DO THE LOGS SHOW?", *parts)


def _readings(readings: Sequence[RunReading]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for reading in readings:
        low = reading.lo
        rho = NONE if low is None else Quantity(float(low), f">= {rounded(low, 4, up=False)}")
        rows.append((reading.kind, rho, reading.says))
    return table(("reading", "rho", "if it is the right one"), rows)


def _bound(which: str, bound: LogBound | None, logs: Sequence[SeenLog]) -> list[str]:
    if bound is None:
        return []
    source = f"theta = {float(bound.log.theta):.4g}: {bound.says}" if len(logs) > 1 else bound.says
    value = rounded(float(bound.value), 4, up=which == "most")
    estimated = ", an estimate" * (which == "most")
    return [f"rho is at {which} {value}{estimated} given {bound.assumes} ({source})"]


def _with_friction(bounds: FrictionBounds | None) -> Sections:
    """A bound and estimates with friction; nothing without friction."""
    if bounds is None:
        return ()
    said = []
    if bounds.image is not None:
        image = rounded(bounds.image, 3, up=False)
        theorem = "sqrt(rho) R, with 2 R = s + sqrt(s^2 + 4 kappa_2) and s = sqrt(rho) + kappa_1"
        known = f"T has a Lipschitz constant of {image} or more in the norm"
        proved = f"Proved: {known} of the log, if absolute;" if bounds.image != 1 else "Proved:"
        said.append(f"{proved} if residuals go on so, {known} (5.21), where it is at most {theorem}.")
    if bounds.eigenvalue is not None and bounds.theta is not None and bounds.rate is not None:
        least, most = (rounded(end, 3, up=up) for end, up in zip(bounds.eigenvalue, (False, True), strict=True))
        gain = rounded(1 - bounds.rate, 3, up=False)
        near = f"Estimated, of the modes seen at theta = {bounds.theta:.4g}, if the ratio is the limit and contact does"
        words = (
            f"not change: the slowest one has |1 + lambda| from {least} to {most}, and a smaller theta' takes at most"
        )
        said.append(f"{near} {words} 1 - {gain} theta'/{bounds.theta:.4g} a step. More steps may show slower modes.")
    return (
        section("with friction", "WHAT IS PROVED OR ESTIMATED WITH FRICTION?", *(said or [f"Nothing: {UNSETTLED}."])),
    )

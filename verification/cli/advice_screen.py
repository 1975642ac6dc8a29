"""What ``advise`` shows."""

from __future__ import annotations

from verification.advice.readings import NextRun, RunReading, SeenRun
from verification.advice.roles import Advice
from verification.advice.seen import Interval, LogBound, SeenLog
from verification.cli.console import figures, heading, near_one, note, printable, say, table
from verification.cli.matrices import matrices
from verification.cli.moduli_screen import moduli
from verification.cli.screens import steps
from verification.cli.typed import Typed
from verification.problem.reading import takes_theta


def advice(found: Advice, typed: Typed | None = None) -> None:
    """The screen of ``advise``."""
    if found.moduli is not None:
        moduli(found, found.moduli)
        return
    if found.matrices is not None:
        matrices(found.matrices)
    if found.run is not None and found.next is not None:
        _seen(found.run, found.readings, found.next)
    if found.interval is not None and found.next is not None:
        _logs(found.logs, found.interval, found.readings, found.next)
        if found.roles:
            _paste(None, f"{found.next.theta:g}")
            note("Predicted for the roles that the bodies have; logs tell nothing of the other assignment.", "  ")
    theta = _roles(found) if found.roles and not found.logs else None
    say()
    for reason in found.outside:
        note(f"Outside the theorem: {reason}.")
    if found.next is not None:
        say("Not claimed: a bound of rho with friction, or that a reading is the right one.")
        if found.logs:
            say(f"Next: the same with --log LOG --theta {found.next.theta:g} (LOG: the log of that run)")
            return
        say(f"Next: ndtheory advise --theta {found.next.theta:g} --ratio R (R: the ratio of that run)")
        return
    say("Not claimed: that the predicted theta is the best one for your loads.")
    if found.problem is not None:
        if typed is not None and found.best.theta_auto is None:  # too large for a run
            typed.suggest("constants")
        elif typed is not None:
            options = [] if found.roles[0].neumann_body == found.neumann_body else ["--swap-roles"]
            if theta is not None and takes_theta(found.problem.iteration.relaxation):
                options += ["--theta", theta]
            typed.suggest("run", *options)
    else:
        say("Next: ndtheory advise --help")


def _seen(run: SeenRun, readings: tuple[RunReading, ...], following: NextRun) -> None:
    """What a run says of rho, and which one is to be made next."""
    heading("WHAT DOES THE RUN SAY OF RHO?")
    given = f"theta = {float(run.theta):.4g}; the residual |Tg - g| changes by {float(run.ratio):.4g} a step"
    note(f"{given}, absolute and unrelaxed, steadily over {run.steps} steps or more.", "  ")
    note("A residual that rises and falls has no steady ratio: give 1.", "  ")
    note("The relative residual |Tg - g|/|Tg| of coupling libraries tells other things.", "  ")
    _readings(readings)
    heading("WHICH RUN NEXT?")
    note(f"theta = {following.theta:g}: {following.why}", "  ")


def _readings(readings: tuple[RunReading, ...]) -> None:
    rows = [["reading", "rho", "if it is the right one"]]
    for reading in readings:
        rho = "-" if reading.lo is None else f">= {figures(reading.lo)}"
        rows.append([reading.kind, rho, reading.says])
    table(rows)


#: So many columns of all logs together are shown; the document holds every one.
MOST_COLUMNS = 8


def _logs(logs: tuple[SeenLog, ...], interval: Interval, readings: tuple[RunReading, ...], following: NextRun) -> None:
    """What logs say of rho, alone and together, and which run is to be made next."""
    heading("WHAT DO THE LOGS SHOW?")
    room = MOST_COLUMNS
    for log in logs:
        note(f"theta = {float(log.theta):.4g}, {log.form}, {printable(log.file)}", "  ")
        for column in log.columns[:room]:
            residual = {"assumed": "taken as absolute", "drop": "over the first one"}.get(
                column.residual, column.residual
            )
            note(f"{printable(column.name)}, {residual}: {column.says}", "    ")
        room -= len(log.columns[:room])
        for words in log.notes:
            note(words, "    ")
    left = sum(len(log.columns) for log in logs) - MOST_COLUMNS
    if left > 0:
        say(f"  and {left} columns more, see --json")
    note(f"Assumed: theta constant in each run, no Aitken or quasi-Newton.  A ratio counts over {_steps(logs)}.", "  ")
    heading("WHAT DO THEY SAY OF RHO?")
    if readings:
        _readings(readings)
    else:
        say("  Nothing: no residual falls, grows or stays steadily.")
    if interval.contradiction is not None:
        note(f"CONTRADICTION: {interval.contradiction}.", "  ")
    else:
        _bound("least", interval.lo, logs)
        _bound("most", interval.hi, logs)
    heading("WHICH RUN NEXT?")
    note(f"theta = {following.theta:g}: {following.why}", "  ")


def _steps(logs: tuple[SeenLog, ...]) -> str:
    return " and ".join(f"{n}" for n in sorted({log.steps for log in logs})) + " steps"


def _bound(which: str, bound: LogBound | None, logs: tuple[SeenLog, ...]) -> None:
    if bound is not None:
        source = f"theta = {float(bound.log.theta):.4g}: {bound.says}" if len(logs) > 1 else bound.says
        note(f"rho is at {which} {figures(float(bound.value))} given {bound.assumes} ({source})", "  ")


def _roles(found: Advice) -> str:
    """What is known of each role; returns the theta to paste."""
    best = found.best
    names = {1: "body 1", 2: "body 2", None: "as in that run"}
    heading("WHICH BODY GETS THE NEUMANN PROBLEM?")
    if found.neumann_body is None:
        say("  One run tells nothing of the other assignment.")
    else:
        other = next(role for role in found.roles if role is not best)
        say(f"  {names[found.neumann_body]}: predicted rate {near_one(best.predicted[1])} a step,")
        if other.rho is not None:
            say(f"  against {near_one(other.predicted[1])} with the roles exchanged")
        else:
            note(f"{names[other.neumann_body]}: {other.reason['rho']}", "  ")
    heading("WHICH THETA?")
    rows = [["Neumann", "rho", "", "theta", "rate", "steps", ""]]
    why = {}
    possible = [role for role in found.roles if role.rho is not None]
    for role in possible:
        name, rate = names[role.neumann_body], role.predicted[1]
        theta = figures(role.theta_predicted)
        rows.append([name, figures(role.rho), "predicted", theta, near_one(rate), steps(rate, 1e-9), "not a bound"])
        if role.factor_proved is not None and role.theta_proved is not None:
            q = role.factor_proved.value
            rows.append(["", "", "proved", figures(role.theta_proved), near_one(q), f"<= {steps(q, 1e-9)}", ""])
        else:
            rows.append(["", "", "proved", "-", "-", "-", "no conclusion"])
            why[name] = role.reason["theta_proved"]
    table(rows)
    for name, reason in why.items():
        note(f"{name}: {reason}", "  ")
    say("  predicted: theta = 2/(2 + rho); proved: the theta of least proved factor")
    say("  steps: to 1e-9 of the first error")
    for role in possible:
        auto = role.theta_auto
        if auto is not None:
            takes = f'theta = "auto" takes {float(auto.theta):.4g}, the {auto.source} one: {auto.why}'
            note(f"{names[role.neumann_body]}: {takes}", "  ")
    if found.friction is not None:
        heading("HOW MUCH FRICTION IS PROVED?")
        for role in possible:
            if role.friction_threshold is None:
                note(f"{names[role.neumann_body]}: {role.reason['friction_threshold']}", "  ")
            else:
                allowed = f"every small theta contracts for k < {figures(role.friction_threshold)}"
                say(f"  {names[role.neumann_body]}: {allowed} (here k = {figures(found.friction, 2)})")
    theta = f"{min(best.predicted[0], 0.99):.3g}" if found.next is None else f"{found.next.theta:g}"
    _paste(found.neumann_body, theta)
    return theta


def _paste(neumann_body: int | None, theta: str) -> None:
    """The lines for a problem file and for a coupling configuration."""
    heading("TO PASTE")
    body = f"neumann_body = {neumann_body}\n  " if neumann_body else ""
    say(f"  {body}theta = {theta}")
    say(f'  <acceleration:constant><relaxation value="{theta}" /></acceleration:constant>')

"""What ``advise`` shows."""

from __future__ import annotations

from verification.advice.readings import LARGEST_TO_PASTE, NextRun, RunReading, SeenRun
from verification.advice.role import Role, in_steps
from verification.advice.roles import Advice
from verification.advice.runs_with_friction import FrictionBounds
from verification.advice.seen import Interval, LogBound, SeenLog
from verification.advice.snippets import SNIPPETS
from verification.cli.console import figures, heading, near_one, note, say, table
from verification.cli.levels import rounded
from verification.cli.matrices import matrices
from verification.cli.moduli_screen import moduli
from verification.cli.screens import steps
from verification.cli.typed import Typed
from verification.problem.vocabulary import vocabulary


def advice(found: Advice, typed: Typed | None = None) -> None:
    """The screen of ``advise``."""
    if found.moduli is not None:
        moduli(found, found.moduli)
        return
    if found.assumes is not None:
        _assumed(found)
    if found.matrices is not None:
        matrices(found.matrices)
    if found.run is not None and found.next is not None:
        _seen(found.run, found.readings, found.next, found.friction_bounds)
    if found.interval is not None and found.next is not None:
        _logs(found.logs, found.interval, found.readings, found.next, found.friction_bounds)
        if found.roles:
            _paste(found)
            note("Predicted for the roles that the bodies have; logs tell nothing of the other assignment.", "  ")
    if found.roles and not found.logs:
        _which_body(found)
        _which_theta(found)
        _friction(found)
        _paste(found)
        _quote(found)
    say()
    for reason in found.outside:
        note(f"Outside the theorem: {reason}.")
    if found.next is not None:
        say("Not claimed: a bound of rho with friction, or that a reading is the right one.")
        assumed = "--tied " * found.tied + "--friction " * (found.friction_bounds is not None)
        if found.next.kept and not found.roles:
            say(f"Next: no run; keep theta = {found.next.theta:g}")
        elif found.logs:
            say(f"Next: the same with --log LOG --theta {found.next.theta:g} (LOG: the log of that run)")
        else:
            say(f"Next: ndtheory advise {assumed}--theta {found.next.theta:g} --ratio R (R: its ratio)")
        return
    what = "that nothing opens or slips" if found.tied else "that the predicted theta is the best one for your loads"
    say(f"Not claimed: {what}.")
    if found.problem is not None:
        if typed is not None and found.best.theta_auto is None:  # too large for a run
            typed.suggest("constants")
        elif typed is not None:
            options = [] if found.roles[0].neumann_body == found.neumann_body else ["--swap-roles"]
            if found.theta is not None and vocabulary().takes_theta(found.problem.iteration.relaxation):
                options += ["--theta", f"{found.theta:g}"]
            typed.suggest("run", *options)
    else:
        say("Next: ndtheory advise --help")


def _assumed(found: Advice) -> None:
    """The assumption under which runs are read, before all else."""
    say(f"Assumed: {found.assumes}.")
    if not found.tied and found.friction_bounds is None:
        say("With friction what follows may be false: add --friction.")


def _with_friction(bounds: FrictionBounds | None) -> None:
    """Bounds that hold with friction; nothing without friction."""
    if bounds is None:
        return
    heading("WHAT IS PROVED WITH FRICTION?")
    if bounds.image is not None:
        image = rounded(bounds.image, 3, up=False)
        theorem = "sqrt(rho) R, with 2 R = s + sqrt(s^2 + 4 kappa_2) and s = sqrt(rho) + kappa_1"
        note(f"The Lipschitz constant of T in the norm (5.21) is at least {image}; it is at most {theorem}.", "  ")
    if bounds.eigenvalue is not None and bounds.theta is not None and bounds.rate is not None:
        least, most = (rounded(end, 3, up=up) for end, up in zip(bounds.eigenvalue, (False, True), strict=True))
        gain = rounded(1 - bounds.rate, 3, up=False)
        near = f"Near the solution of the run at theta = {bounds.theta:.4g}, if contact does not change there, its"
        words = f"slowest mode has |1 + lambda| from {least} to {most}, and a smaller theta' takes at most"
        note(f"{near} {words} 1 - {gain} theta'/{bounds.theta:.4g} a step.", "  ")
    if bounds.image is None and bounds.eigenvalue is None:
        say("  Nothing.")


def _seen(run: SeenRun, readings: tuple[RunReading, ...], following: NextRun, rubs: FrictionBounds | None) -> None:
    """What a run says of rho, and which one is to be made next."""
    heading("WHAT DOES THE RUN SAY OF RHO?")
    given = f"theta = {float(run.theta):.4g}; the residual |Tg - g| changes by {float(run.ratio):.4g} a step"
    note(f"{given}, absolute and unrelaxed, steadily over {run.steps} steps or more.", "  ")
    note("A residual that rises and falls has no steady ratio: give 1.", "  ")
    note("The relative residual |Tg - g|/|Tg| of coupling libraries tells other things.", "  ")
    _readings(readings)
    _with_friction(rubs)
    heading("WHICH RUN NEXT?")
    note(f"theta = {following.theta:g}: {following.why}", "  ")


def _readings(readings: tuple[RunReading, ...]) -> None:
    rows = [["reading", "rho", "if it is the right one"]]
    for reading in readings:
        rho = "-" if reading.lo is None else f">= {rounded(reading.lo, 3, up=False)}"
        rows.append([reading.kind, rho, reading.says])
    table(rows)


#: So many columns of all logs together are shown; the document holds every one.
MOST_COLUMNS = 8


def _logs(
    logs: tuple[SeenLog, ...],
    interval: Interval,
    readings: tuple[RunReading, ...],
    following: NextRun,
    rubs: FrictionBounds | None,
) -> None:
    """What logs say of rho, alone and together, and which run is to be made next."""
    heading("WHAT DO THE LOGS SHOW?")
    room = MOST_COLUMNS
    for log in logs:
        note(f"theta = {float(log.theta):.4g}, {log.form}, {log.file}", "  ")
        for column in log.columns[:room]:
            residual = {"assumed": "taken as absolute", "drop": "over the first one"}.get(
                column.residual, column.residual
            )
            note(f"{column.name}, {residual}: {column.says}", "    ")
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
    _with_friction(rubs)
    heading("WHICH RUN NEXT?")
    note(f"theta = {following.theta:g}: {following.why}", "  ")


def _steps(logs: tuple[SeenLog, ...]) -> str:
    return " and ".join(f"{n}" for n in sorted({log.steps for log in logs})) + " steps"


def _bound(which: str, bound: LogBound | None, logs: tuple[SeenLog, ...]) -> None:
    if bound is not None:
        source = f"theta = {float(bound.log.theta):.4g}: {bound.says}" if len(logs) > 1 else bound.says
        value = rounded(float(bound.value), 3, up=which == "most")
        note(f"rho is at {which} {value} given {bound.assumes} ({source})", "  ")


NAMES = {1: "body 1", 2: "body 2", None: "as in that run"}


def _which_body(found: Advice) -> None:
    """Which body gets the Neumann problem, what exchanging the roles changes, and who reads what."""
    best, other = found.best, found.other
    heading("WHICH BODY GETS THE NEUMANN PROBLEM?")
    if found.neumann_body is None:
        say("  One run tells nothing of the other assignment.")
        neumann, contact = "the Neumann body", "the contact body"
    else:
        rate = found.chosen(best)[1]
        kind = "rate if tied" if found.tied else "predicted rate"
        say(f"  {NAMES[found.neumann_body]}: {kind} {near_one(rate)} a step, {in_steps(rate)} to 1e-9,")
        if other is None:
            refused = next(role for role in found.roles if role is not best)
            note(f"{NAMES[refused.neumann_body]}: {refused.reason['rho']}", "  ")
        elif found.no_difference:
            say("  and no difference with the roles exchanged")
        else:
            away = found.chosen(other)[1]
            say(f"  against {near_one(away)} with the roles exchanged, {in_steps(away)}")
        neumann, contact = NAMES[found.neumann_body], f"{NAMES[3 - found.neumann_body]}, the contact body,"
    writes = "reads forces and writes displacements", "reads displacements and writes forces"
    note(f"The solver of {neumann} {writes[0]}, that of {contact} {writes[1]}.", "  ")


def _which_theta(found: Advice) -> None:
    """What is predicted and proved of each role, what holds if nothing opens or slips, and what "auto" takes."""
    heading("WHICH THETA?")
    rows = [["Neumann", "rho", "", "theta", "rate", "steps", ""]]
    why = {}
    possible = [role for role in found.roles if role.rho is not None]
    for role in possible:
        name, rate = NAMES[role.neumann_body], role.predicted[1]
        theta, bound = figures(role.theta_predicted), "proved" if role.proved else "not a bound"
        rows.append([name, figures(role.rho), "predicted", theta, near_one(rate), steps(rate, 1e-9), bound])
        if role.factor_proved is not None and role.theta_proved is not None:
            q = role.factor_proved.value
            rows.append(["", "", "proved", figures(role.theta_proved), near_one(q), f"<= {steps(q, 1e-9)}", ""])
        else:
            rows.append(["", "", "proved", "-", "-", "-", "no conclusion"])
            if role.theta_auto is None:  # which says it below
                why[name] = role.reason["theta_proved"]
        if role.theta_tied is not None and role.rate_tied is not None:
            rate = role.rate_tied
            numbers = [figures(role.theta_tied), near_one(rate), f"<= {steps(rate, 1e-9)}"]
            rows.append(["", "", "if tied", *numbers, _at_predicted(role)])
        elif found.tied:
            why[name] = role.why_not_tied
    table(rows)
    _together(why)
    say("  predicted: theta = 2/(2 + rho); proved: the theta of least proved factor")
    ends = [
        f"{figures(role.rho_min)}, {figures(role.rho_tied)} ({NAMES[role.neumann_body]})"
        for role in possible
        if role.ends is not None
    ]
    if ends:
        note(f"if tied, nothing opens or slips: 2/(2+rho_min+rho) of {', '.join(ends)}", "  ")
    say(f"  steps: to 1e-9 of the first error{'; at the end those of the predicted theta' * bool(ends)}")
    for role in possible:
        auto = role.theta_auto
        if auto is not None:
            takes = f'theta = "auto" takes {float(auto.theta):.4g}, the {auto.source} one: {auto.why}'
            note(f"{NAMES[role.neumann_body]}: {takes}", "  ")


def _at_predicted(role: Role) -> str:
    """The steps of the predicted theta where nothing opens or slips."""
    theta = role.predicted[0]
    rate = role.factor_where_tied(theta)
    if rate is None or rate >= 1:
        return f"grows at {figures(theta)}"
    return f"{steps(rate, 1e-9)} at {figures(theta)}"


def _friction(found: Advice) -> None:
    """How much friction is proved."""
    if found.friction is None:
        return
    heading("HOW MUCH FRICTION IS PROVED?")
    said = {}
    for role in found.roles:
        if role.rho is None:
            continue
        said[NAMES[role.neumann_body]] = role.reason.get("friction_threshold", "")
        if role.friction_threshold is not None:
            allowed = f"every small theta contracts for k < {figures(role.friction_threshold)}"
            said[NAMES[role.neumann_body]] = f"{allowed} (here k = {figures(found.friction, 2)})"
    _together(said)


def _together(said: dict[str, str]) -> None:
    """What is to be said of each role, once where it is the same of both."""
    for text in dict.fromkeys(said.values()):
        note(f"{', '.join(name for name, own in said.items() if own == text)}: {text}", "  ")


def _paste(found: Advice) -> None:
    """The lines for a problem file and for a coupling configuration."""
    heading("TO PASTE")
    if found.neumann_body is not None:
        say(f"  neumann_body = {found.neumann_body}")
    say(f"  theta = {found.theta:g}")
    say(f'  <acceleration:constant><relaxation value="{found.theta:g}" /></acceleration:constant>')
    note(f"Whole blocks: --snippets {', '.join(SNIPPETS)} or all.", "  ")
    auto = found.best.theta_auto
    if auto is not None and found.theta is not None:
        if found.theta == float(LARGEST_TO_PASTE) <= auto.theta:
            note(f'theta = "auto" takes {float(auto.theta):.4g}; {found.theta:g} is the largest to paste.', "  ")
        elif abs(found.theta - float(auto.theta)) <= 1e-3 * found.theta:
            note('This is what theta = "auto" takes, rounded.', "  ")
        elif found.tied:
            note('theta = "auto" takes another one, since contact may open and slip.', "  ")
        elif auto.source == "proved":
            note('theta = "auto" keeps to the proved one up to twice the predicted steps.', "  ")
    same = "The same theta for forces and displacements (heat: fluxes and temperatures) in serial coupling"
    note(f"{same}, not in parallel coupling.", "  ")
    note("Transient: rho is that of K + c M/dt^2; the better role may change with dt.", "  ")


def _quote(found: Advice) -> None:
    """One reason that can be quoted."""
    if found.quote is not None:
        heading("TO QUOTE")
        note(found.quote, "  ")


def snippets(found: Advice, library: str) -> None:
    """The whole blocks for a library, or for all of them, each below its name."""
    names = list(SNIPPETS) if library == "all" else [library]
    for name in names:
        if library == "all":
            heading(name)
        say(found.snippet(name), lines=True)

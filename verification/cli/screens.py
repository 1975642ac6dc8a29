"""What the commands show: one screen, 80 columns, a heading for each question."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import Any

from verification.advice.readings import NextRun, RunReading, SeenRun
from verification.advice.roles import Advice
from verification.algorithm.runs import Run
from verification.bounds.region import MOST_STEPS, Plane
from verification.cli.calculator import bounds_table
from verification.cli.console import figures, heading, near_one, note, printable, say, table
from verification.cli.typed import Typed
from verification.comparison import Comparison
from verification.constants import ENERGY_NAMES, NAMES, Measured
from verification.interface import assembly
from verification.interface.fields import ContactFields
from verification.interface.friction import LAWS
from verification.monolithic import Solution
from verification.problem.reading import takes_theta
from verification.problem.specification import Problem


def show(result: Any) -> bool:
    """Show a result on the screen of its command; False where it has none, as one of matrices alone."""
    screens: dict[type, Callable[[Any], None]] = {
        Measured: constants,
        Run: run,
        Solution: solution,
        Comparison: comparison,
        Advice: advice,
        Plane: plane,
    }
    screen = screens.get(type(result))
    if screen is None or (result.problem is None and not isinstance(result, Advice)):
        return False
    screen(result)
    return True


def _setting(problem: Problem, nodes: int | None = None, interface: int | None = None) -> None:
    """Two lines that say what is computed."""
    units, contact = problem.units, problem.contact
    counts = "" if nodes is None else f" | {nodes} nodes, {interface} on Gamma_c"
    bodies = (problem.body1, problem.body2)
    moduli = " / ".join("rigid" if body.rigid else f"{float(body.young):g}" for body in bodies)
    say(f"{printable(problem.title)}{counts} | E {moduli} {units['stress']}")
    body = {1: "lower", 2: "upper"}[problem.iteration.neumann_body]
    law = LAWS[contact.law].label if LAWS[contact.law].needs_radius else f"{LAWS[contact.law].label} law"
    friction = "no friction" if not contact.friction else f"k = {figures(float(contact.friction), 2)}, {law}"
    if contact.friction and contact.radius is not None and LAWS[contact.law].needs_radius:
        friction += f", r = {float(contact.radius):g} {units['length']}"
    if any(body.rigid for body in bodies):
        say(f"Obstacle: {'lower' if problem.body1.rigid else 'upper'} body | {friction}")
    else:
        say(f"Neumann body: {body} | {friction} | {_how(problem)}")


def _how(problem: Problem) -> str:
    """How the iteration is relaxed."""
    theta, relaxation = problem.iteration.theta, problem.iteration.relaxation
    if relaxation != "constant":
        return relaxation
    return f"theta = {theta if theta == 'auto' else f'{float(theta):.4g}'}"


def constants(measured: Measured, typed: Typed | None = None) -> None:
    """The screen of ``constants``."""
    problem = measured.problem
    assert problem is not None  # see `show`
    levels = measured.levels or (measured,)
    stress = problem.units["stress"]
    _setting(problem, measured.nodes, measured.interface_nodes)
    heading("WHAT DOES THE THEOREM NEED TO KNOW?")
    units = {"m": stress, "M": stress, "C_K": stress}
    rows = [["nodes", *(str(level.nodes) for level in levels), "unit"]]
    for name in (*NAMES, *ENERGY_NAMES):
        rows.append([name, *(figures(getattr(level, name), 6) for level in levels), units.get(name, "")])
    table(rows, right=range(1, len(levels) + 1))
    for reason in dict.fromkeys(measured.reason.values()):
        names = ", ".join(name for name, why in measured.reason.items() if why == reason)
        note(f"{names}: {reason}", "  ")
    say()
    say("Exact for this mesh, up to rounding.  On a mesh m is above and M below its")
    say("continuous value: for the continuous theorem both err on the unsafe side.")
    if typed is not None:
        typed.suggest("advise" if measured.interface_nodes > assembly.MOST_CONTACT_NODES else "compare")


def _happened(run: Run, comparison: Comparison | None = None) -> None:
    problem = _problem(run)
    heading("WHAT HAPPENED")
    rate, linear = run.observed_rate, run.linearised
    rows = [["", "rate", "steps", ""]]
    if run.forecast is not None:
        made = run.forecast
        name = f"forecast at step {made.made_at_iteration}"
        rows.append([name, near_one(made.rate), str(made.iterations), "prediction, not a bound"])
    if linear is not None:
        steps = _steps(linear.rate, problem.iteration.tolerance)
        consistency = "" if linear.predicted is None else f"; consistency of J {near_one(linear.predicted)}"
        rows.append(["linearised at the solution", near_one(linear.rate), steps, f"afterwards{consistency}"])
    shown = "-" if rate is None else near_one(rate.value)
    if run.observed_growth is not None:
        shown = f"grows by {run.observed_growth:.4g}"
    rows.append(["observed", shown, str(run.iterations), f"seen: {run.outcome}"])
    cvxpy = None if comparison is None else comparison.cvxpy
    if cvxpy is not None:
        shown = "-" if cvxpy.observed_rate is None else near_one(cvxpy.observed_rate)
        apart = f"T differs by {cvxpy.largest_difference:.0e} at most"
        name = "cvxpy alone" if cvxpy.whole else "cvxpy alone, first and last"
        rows.append([name, shown, str(cvxpy.steps - 1) if cvxpy.whole else "-", apart])
    table(rows)
    if run.forecast is None and run.relaxation == "constant" and comparison is None:  # there the verdict tells why
        note(f"no forecast: {run.why_no_forecast}", "  ")
    if linear is None:
        note(f"not linearised: {run.why_not_linearised}", "  ")
    if run.relaxation != "constant":
        proved = "" if run.proved_rate is None else f"; proved rate {near_one(run.proved_rate.value)}"
        say(f"  {run.evaluations} evaluations of T, with the {run.relaxation} relaxation{proved}")
    elif run.choice.source != "given":
        note(f"theta = {float(run.theta):.4g} is the {run.choice.source} one: {run.choice.why}", "  ")
    _contact(problem, run.contact, f"; KKT residual of step II {run.last.contact.kkt.residual:.1e}")


def _steps(rate: float, tolerance: float) -> str:
    """How many steps of a rate lead to a tolerance."""
    if not 0 < rate < 1:
        return "1" if rate == 0 else "-"
    return str(math.ceil(math.log(tolerance) / math.log(rate)))


def _contact(problem: Problem, contact: ContactFields, solved: str = "") -> None:
    """What happens along Gamma_c, in totals, and how well it was solved."""
    units, total = problem.units, contact.force
    normal = f"{figures(total['normal'], 6)} normal"
    say("  nodes               " + ", ".join(f"{count} {name}" for name, count in contact.pattern.items()))
    if problem.dimension == 1:
        note(f"force               {normal}, {units['stress']}{solved}", "  ")
        return
    rounding = 1e-12 * max(abs(total["normal"]), abs(total["tangential"]))
    tangential = total["tangential"] if abs(total["tangential"]) > rounding else 0.0
    unit = f"{units['stress']} {units['length']} (per unit thickness)"
    note(f"force               {normal}, {figures(tangential)} tangential, {unit}", "  ")
    note(f"largest pressure    {figures(float(contact.pressure.max()), 4)} {units['stress']}{solved}", "  ")


def _limits(outside: list[str]) -> None:
    say()
    for reason in outside:
        note(f"Outside the theorem: {reason}.")
    say("Not claimed: anything about the continuum, or the local Coulomb law.")


def run(finished: Run, typed: Typed | None = None) -> None:
    """The screen of ``run``."""
    nodes = sum(len(body.mesh.points) for body in finished.bodies.elastic)
    _setting(_problem(finished), nodes, finished.pair.contact.grid.n)
    _happened(finished)
    _limits(finished.outside)
    if typed is not None:
        typed.suggest("compare", iteration=True)


def solution(found: Solution, typed: Typed | None = None) -> None:
    """The screen of ``solve``."""
    bodies = found.bodies
    _setting(bodies.problem, sum(len(body.mesh.points) for body in bodies.elastic), bodies.interface.contact.n)
    heading("WHAT IS THE SOLUTION?")
    _contact(bodies.problem, found.contact)
    say(f"  KKT residual {found.kkt_residual:.1e} after {found.linear_solves} linear systems on Gamma_c")
    _limits(bodies.outside)
    if typed is not None:
        typed.suggest(*(["run"] if len(bodies.elastic) == 2 else ["solve", "-o", "results"]))


def _problem(run: Run) -> Problem:
    """The problem of a run, with the theta it had."""
    problem = run.pair.problem
    assert problem is not None  # see `show`
    return problem.with_theta(run.theta)


def comparison(result: Comparison, typed: Typed | None = None) -> None:
    """The screen of ``compare`` and ``demo``."""
    finished, measured = result.run, result.measured
    _setting(_problem(finished), measured.nodes, measured.interface_nodes)
    heading("HOW LARGE ARE THE CONSTANTS?")
    stress = finished.units["stress"]
    m, M, C_R, C_s, C_tr, C_K, rho = (
        figures(getattr(measured, name), 4) for name in ("m", "M", "C_R", "C_s", "C_tr", "C_K", "rho_max")
    )
    say(f"  m = {m} {stress}, M = {M} {stress}, C_R = {C_R}")
    say(f"  C_s = {C_s}, C_tr = {C_tr}, C_K = {C_K} {stress}, rho = {rho}")
    heading("DOES ONE STEP CONTRACT?")
    if result.computed:
        bounds_table(result.computed, stress)
    else:
        note("no bound applies: " + next(iter(measured.reason.values()), ""), "  ")
    for name in ("lmi", "losses", "cvxpy"):
        if name in result.reason:
            note(f"{name}: {result.reason[name]}", "  ")
    if result.losses is not None and result.losses.friction:
        heading("WHAT DOES EACH ESTIMATE GIVE AWAY?")
        estimates = [loss for loss in result.losses.friction if not loss.only_unit]
        total = sum(loss.decades for loss in estimates)
        unit = sum(loss.decades for loss in result.losses.friction) - total
        say(f"  {total:.1f} decades from the largest friction term found to (5.30), repaired:")
        links = ", ".join(f"{loss.label} {loss.decades:.1f}" for loss in estimates)
        note(f"{links}; the unit adds {unit:.1f}", "  ")
    _happened(finished, result)
    heading("DOES THE RUN AGREE WITH THE BOUND?")
    table([["bound", "verdict", "why"], *([n, j.verdict, j.reason] for n, j in result.verdicts.items())])
    _limits(finished.outside)
    if typed is not None:
        typed.suggest("advise")


def advice(found: Advice, typed: Typed | None = None) -> None:
    """The screen of ``advise``."""
    if found.run is not None and found.next is not None:
        _seen(found.run, found.readings, found.next)
    theta = _roles(found) if found.roles else None
    say()
    for reason in found.outside:
        note(f"Outside the theorem: {reason}.")
    if found.next is not None:
        say("Not claimed: a bound of rho with friction, or that a reading is the right one.")
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
    rows = [["reading", "rho", "if it is the right one"]]
    for reading in readings:
        rho = "-" if reading.lo is None else f">= {figures(reading.lo)}"
        rows.append([reading.kind, rho, reading.says])
    table(rows)
    heading("WHICH RUN NEXT?")
    note(f"theta = {following.theta:g}: {following.why}", "  ")


def _roles(found: Advice) -> str:
    """What is known of each role; returns the theta to paste."""
    best = found.best
    names = {1: "body 1", 2: "body 2", None: "as in that run"}
    heading("WHICH BODY GETS THE NEUMANN PROBLEM?")
    if found.neumann_body is None:
        say("  One run tells nothing of the other assignment.")
    else:
        other = next(role for role in found.roles if role is not best)
        say(f"  {names[found.neumann_body]}: predicted rate {near_one(best.rate_predicted)} a step,")
        say(f"  against {near_one(other.rate_predicted)} with the roles exchanged")
    heading("WHICH THETA?")
    rows = [["Neumann", "rho", "", "theta", "rate", "steps", ""]]
    why = {}
    for role in found.roles:
        name, rate = names[role.neumann_body], role.rate_predicted
        theta = figures(role.theta_predicted)
        rows.append([name, figures(role.rho), "predicted", theta, near_one(rate), _steps(rate, 1e-9), "not a bound"])
        if role.factor_proved is not None and role.theta_proved is not None:
            q = role.factor_proved.value
            rows.append(["", "", "proved", figures(role.theta_proved), near_one(q), f"<= {_steps(q, 1e-9)}", ""])
        else:
            rows.append(["", "", "proved", "-", "-", "-", "no conclusion"])
            why[name] = role.reason["theta_proved"]
    table(rows)
    for name, reason in why.items():
        note(f"{name}: {reason}", "  ")
    say("  predicted: theta = 2/(2 + rho); proved: the theta of least proved factor")
    say("  steps: to 1e-9 of the first error")
    for role in found.roles:
        auto = role.theta_auto
        if auto is not None:
            takes = f'theta = "auto" takes {float(auto.theta):.4g}, the {auto.source} one: {auto.why}'
            note(f"{names[role.neumann_body]}: {takes}", "  ")
    if found.friction is not None:
        heading("HOW MUCH FRICTION IS PROVED?")
        for role in found.roles:
            if role.friction_threshold is None:
                note(f"{names[role.neumann_body]}: {role.reason['friction_threshold']}", "  ")
            else:
                allowed = f"every small theta contracts for k < {figures(role.friction_threshold)}"
                say(f"  {names[role.neumann_body]}: {allowed} (here k = {figures(found.friction, 2)})")
    heading("TO PASTE")
    theta = f"{min(best.theta_predicted, 0.99):.3g}" if found.next is None else f"{found.next.theta:g}"
    body = f"neumann_body = {found.neumann_body}\n  " if found.neumann_body else ""
    say(f"  {body}theta = {theta}")
    say(f'  <acceleration:constant><relaxation value="{theta}" /></acceleration:constant>')
    return theta


def plane(found: Plane, target: Path | None = None) -> None:
    """The screen of ``region``."""
    say(printable(found.title))
    heading("WHERE IS ONE STEP PROVED TO CONTRACT?")
    rows = [["bound", "every small theta: k <", "some theta: k <", "theta at most"]]
    for name, region in found.regions.items():
        if region.k:
            highest = figures(max(hi for _, hi in region.theta))
            rows.append([name, figures(region.every), figures(region.some), highest])
    table(rows)
    note(f"printed: with stresses in {found.units['stress']}; in another unit its figures are others", "  ")
    for name, reason in found.reason.items():
        note(f"{name}: {reason}", "  ")
    heading("WHAT DID RUNS DO?")
    outcomes = [point.outcome for point in found.points]
    words = {"limit": f"still falling when stopped after {MOST_STEPS} steps"}
    note(", ".join(f"{outcomes.count(name)} {words.get(name, name)}" for name in dict.fromkeys(outcomes)), "  ")
    strongest = max((p.k for p in found.points if p.outcome == "converged"), default=None)
    if strongest is not None:
        say(f"  the largest friction with a run that converged: k = {strongest:g}")
    say()
    say("Not claimed: non-convergence outside a region, or anything on the continuum.")
    if target is not None:
        say(f"Next: open {quote(str(target))}")


def worth_trying(rho: float) -> float:
    """2/(2 + rho), and below 1 when it is written with two figures."""
    return min(2 / (2 + rho), 0.99)

"""What the commands show: one screen, 80 columns, a heading for each question."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

from verification.cli.calculator import edition_rows
from verification.cli.console import figures, heading, near_one, printable, say, table
from verification.contact_state import ContactState
from verification.measured import Measured
from verification.monolithic import Solution
from verification.pair import Facing
from verification.problem import Problem
from verification.runs import Run
from verification.verdicts import Comparison


def _setting(problem: Problem, nodes: int | None = None, interface: int | None = None) -> None:
    """Two lines that say what is computed."""
    units, contact = problem.units, problem.contact
    counts = "" if nodes is None else f" | {nodes} nodes, {interface} on Gamma_c"
    bodies = (problem.body1, problem.body2)
    moduli = " / ".join("rigid" if body.rigid else f"{float(body.young):g}" for body in bodies)
    say(f"{printable(problem.title)}{counts} | E {moduli} {units['stress']}")
    body = {1: "lower", 2: "upper"}[problem.iteration.neumann_body]
    law = {"nonlocal": "non-local", "local": "local law"}[contact.law]
    friction = "no friction" if not contact.friction else f"k = {figures(float(contact.friction), 2)}, {law}"
    if contact.friction and contact.radius is not None and contact.law == "nonlocal":
        friction += f", r = {float(contact.radius):g} {units['length']}"
    if any(body.rigid for body in bodies):
        say(f"Obstacle: {'lower' if problem.body1.rigid else 'upper'} body | {friction}")
    else:
        say(f"Neumann body: {body} | {friction} | theta = {float(problem.iteration.theta):g}")


def constants(problem: Problem, measured: Measured) -> None:
    """The screen of ``constants``."""
    levels = measured.levels or (measured,)
    stress = problem.units["stress"]
    _setting(problem, measured.body1.nodes + measured.body2.nodes, measured.interface_nodes)
    heading("WHAT DOES THE THEOREM NEED TO KNOW?")
    units = {"m": stress, "M": stress, "C_K": stress}
    names = ["m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K", "rho_max", "rho_min", "rho_normal"]
    rows = [["nodes", *(str(level.body1.nodes + level.body2.nodes) for level in levels), "unit"]]
    for name in names:
        rows.append([name, *(figures(getattr(level, name), 6) for level in levels), units.get(name, "")])
    table(rows, right=range(1, len(levels) + 1))
    for name, reason in measured.reason.items():
        say(f"  {name}: {reason}")
    say()
    say("Exact for this mesh, up to rounding.  On a mesh m is above and M below its")
    say("continuous value: for the continuous theorem both err on the unsafe side.")
    if problem.source != "<dict>":
        say(f"Next: ndtheory compare {quote(problem.source)}")


def _happened(run: Run) -> None:
    problem = run.pair.problem
    heading("WHAT HAPPENED")
    rate = run.observed_rate
    rows = [["", "rate", "steps", ""]]
    shown = "-" if rate is None else f"{near_one(rate.value)} in [{near_one(rate.lo)}, {near_one(rate.hi)}]"
    rows.append(["observed", shown, str(run.iterations), run.outcome])
    table(rows)
    say()
    _contact(problem, run.contact)
    say(f"  contact step solved to a KKT residual of {run.last.contact.kkt.residual:.1e}")


def _contact(problem: Problem, contact: ContactState) -> None:
    """What happens along Gamma_c, in totals."""
    units, total = problem.units, contact.force
    force = units["stress"] + (f" {units['length']} (per unit thickness)" if problem.dimension == 2 else "")
    say("  nodes               " + ", ".join(f"{count} {name}" for name, count in contact.pattern.items()))
    say(f"  normal force        {figures(total['normal'], 6)} {force}")
    if problem.dimension == 2:
        rounding = 1e-12 * max(abs(total["normal"]), abs(total["tangential"]))
        tangential = total["tangential"] if abs(total["tangential"]) > rounding else 0.0
        say(f"  tangential force    {figures(tangential)} {force}")
        say(f"  largest pressure    {figures(float(contact.pressure.max()), 4)} {units['stress']}")


def _limits(facing: Facing) -> None:
    say()
    for reason in facing.outside:
        say(f"Outside the theorem: {reason}.")
    say("Not claimed: anything about the continuum, or the local Coulomb law.")


def run(finished: Run, file: Path) -> None:
    """The screen of ``run``."""
    bodies = (finished.pair.body1, finished.pair.body2)
    _setting(_at(finished), sum(len(body.mesh.points) for body in bodies), finished.pair.n)
    _happened(finished)
    _limits(finished.pair)
    say(f"Next: ndtheory compare {quote(str(file))}")


def solution(found: Solution, file: Path) -> None:
    """The screen of ``solve``."""
    facing = found.facing
    _setting(facing.problem, sum(len(body.mesh.points) for body in facing.elastic), facing.n)
    heading("WHAT IS THE SOLUTION?")
    _contact(facing.problem, found.contact)
    say(f"  KKT residual {found.kkt_residual:.1e} after {found.linear_solves} linear systems on Gamma_c")
    _limits(facing)
    iterates = len(facing.elastic) == 2
    say(f"Next: ndtheory {'run' if iterates else 'solve'} {quote(str(file))}{'' if iterates else ' -o results'}")


def _at(run: Run) -> Problem:
    return run.pair.problem.with_theta(run.theta)


def comparison(result: Comparison, file: Path) -> None:
    """The screen of ``compare`` and ``demo``."""
    finished, measured = result.run, result.measured
    _setting(_at(finished), measured.body1.nodes + measured.body2.nodes, measured.interface_nodes)
    heading("HOW LARGE ARE THE CONSTANTS?")
    stress = finished.units["stress"]
    m, M, C_R, C_s, C_tr, C_K, rho = (
        figures(getattr(measured, name), 4) for name in ("m", "M", "C_R", "C_s", "C_tr", "C_K", "rho_max")
    )
    say(f"  m = {m} {stress}, M = {M} {stress}, C_R = {C_R}")
    say(f"  C_s = {C_s}, C_tr = {C_tr}, C_K = {C_K} {stress}, rho = {rho}")
    heading("DOES ONE STEP CONTRACT?")
    if result.bounds:
        table(edition_rows(result.bounds))
    else:
        say("  no edition applies: " + next(iter(measured.reason.values()), ""))
    _happened(finished)
    heading("DOES THE RUN AGREE WITH THE BOUND?")
    table([["edition", "verdict", "why"], *([n, j.verdict, j.reason] for n, j in result.verdicts.items())])
    _limits(finished.pair)
    say(f"Next: ndtheory run {quote(str(file))} --theta {_next_theta(result)}")


def _next_theta(result: Comparison) -> str:
    """A theta worth trying, of two figures."""
    rho = result.measured.rho_max
    return "0.5" if rho is None else f"{worth_trying(rho.value):.2g}"


def worth_trying(rho: float) -> float:
    """2/(2 + rho), and below 1 when it is written with two figures."""
    return min(2 / (2 + rho), 0.99)

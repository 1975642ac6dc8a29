"""What the commands show: one screen, 80 columns, a heading for each question."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import quote

from verification.algorithm.reference import Reference
from verification.algorithm.runs import Run
from verification.algorithm.theta import Choice
from verification.bounds.bound import BoundResult
from verification.bounds.losses import Losses
from verification.bounds.region import MOST_STEPS, Plane
from verification.cli.calculator import bounds_table
from verification.cli.console import figures, heading, near_one, note, part, say, table
from verification.cli.levels import between
from verification.cli.typed import Typed
from verification.comparison import Comparison, Listener
from verification.constants import Measured
from verification.constants.measured import ENERGY_NAMES, NAMES
from verification.interface import assembly
from verification.interface.fields import ContactFields
from verification.interface.friction import LAWS
from verification.interface.interface import Interface
from verification.interface.pair import ContactPair
from verification.monolithic import Solution
from verification.problem.specification import Problem

#: The constants that ``compare`` shows.
COMPARED = ("m", "M", "C_R", "C_s", "C_tr", "C_K", "rho_max")


def _setting(problem: Problem, nodes: int | None = None, interface: int | None = None) -> None:
    """Two lines that say what is computed."""
    units, contact = problem.units, problem.contact
    counts = "" if nodes is None else f" | {nodes} nodes, {interface} on Gamma_c"
    bodies = (problem.body1, problem.body2)
    moduli = " / ".join("rigid" if body.rigid else f"{float(body.young):g}" for body in bodies)
    say(f"{problem.title}{counts} | E {moduli} {units['stress']}")
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
    verified = measured.unverified is not None
    if verified:
        for level in levels:
            _between_bounds(level, units)
    else:
        rows = [["nodes", *(str(level.nodes) for level in levels), "unit"]]
        for name in (*NAMES, *ENERGY_NAMES):
            rows.append([name, *(figures(getattr(level, name), 6) for level in levels), units.get(name, "")])
        table(rows, right=range(1, len(levels) + 1))
    for reason in dict.fromkeys(measured.reason.values()):
        names = ", ".join(name for name, why in measured.reason.items() if why == reason)
        note(f"{names}: {reason}", "  ")
    say()
    if verified:
        note("exact, verified: proved for the exact data of the file on this mesh, all rounding errors bounded.")
    else:
        note("Exact for this mesh, up to rounding.")
    note(
        "On a mesh m is above and M below its continuous value: for the continuous theorem both err on the unsafe side."
    )
    if typed is not None:
        typed.suggest("advise" if measured.interface_nodes > assembly.MOST_CONTACT_NODES else "compare")


def _between_bounds(
    measured: Measured, units: Mapping[str, str], names: Sequence[str] = (*NAMES, *ENERGY_NAMES)
) -> None:
    """Constants with the bounds that are proved of them, and why there are none."""
    rows = [[f"{measured.nodes} nodes", "about", "at least", "at most", "level", "unit"]]
    for name in names:
        number = getattr(measured, name)
        level = "" if number is None else number.level
        rows.append([name, figures(number, 4), *between(number), level, units.get(name, "")])
    table(rows, right=(1, 2, 3))
    why = {name: reason for name, reason in (measured.unverified or {}).items() if name in names}
    for reason in dict.fromkeys(why.values()):
        note(f"not proved, {', '.join(name for name in why if why[name] == reason)}: {reason}", "  ")


def _happened(run: Run, *, alone: bool) -> None:
    """What a run did; ``alone`` where no verdict says why there is no forecast."""
    problem = _problem(run)
    heading("WHAT HAPPENED")
    rate, linear = run.observed_rate, run.linearised
    rows = [["", "rate", "steps", ""]]
    if run.forecast is not None:
        made = run.forecast
        name = f"forecast at step {made.made_at_iteration}"
        rows.append([name, near_one(made.rate), str(made.iterations), "prediction, not a bound"])
    if linear is not None:
        count = steps(linear.rate, problem.iteration.tolerance)
        consistency = "" if linear.predicted is None else f"; consistency of J {near_one(linear.predicted)}"
        rows.append(["linearised at the solution", near_one(linear.rate), count, f"afterwards{consistency}"])
    shown = "-" if rate is None else near_one(rate.value)
    if run.observed_growth is not None:
        shown = f"grows by {run.observed_growth:.4g}"
    rows.append(["observed", shown, str(run.iterations), f"seen: {run.outcome}"])
    table(rows)
    if run.forecast is None and run.relaxation == "constant" and alone:
        note(f"no forecast: {run.why_no_forecast}", "  ")
    if linear is None:
        note(f"not linearised: {run.why_not_linearised}", "  ")
    if run.relaxation != "constant":
        proved = "" if run.proved_rate is None else f"; proved rate {near_one(run.proved_rate.value)}"
        say(f"  {run.evaluations} evaluations of T, with the {run.relaxation} relaxation{proved}")
    elif run.choice.source != "given":
        note(f"theta = {float(run.theta):.4g} is the {run.choice.source} one: {run.choice.why}", "  ")
    _grids(run.pair.contact_body, run.pair.interface)
    _contact(problem, run.contact, f"; KKT residual of step II {run.last.contact.kkt.residual:.1e}")


def steps(rate: float, tolerance: float) -> str:
    """How many steps of a rate lead to a tolerance."""
    if not 0 < rate < 1:
        return "1" if rate == 0 else "-"
    return str(math.ceil(math.log(tolerance) / math.log(rate)))


def _grids(contact_body: int, interface: Interface) -> None:
    """Who carries the contact grid, where there are two."""
    if interface.transfer is not None:
        names = {1: "lower", 2: "upper"}
        own, other = names[contact_body], names[3 - contact_body]
        counts = f"{interface.contact.n} nodes of the {own} body, Neumann grid: {interface.neumann.n} of the {other}"
        note(f"contact grid        {counts}", "  ")


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
    _happened(finished, alone=True)
    _limits(finished.outside)
    if typed is not None:
        typed.suggest("compare", iteration=True)


def solution(found: Solution, typed: Typed | None = None) -> None:
    """The screen of ``solve``."""
    bodies = found.bodies
    _setting(bodies.problem, sum(len(body.mesh.points) for body in bodies.elastic), bodies.interface.contact.n)
    heading("WHAT IS THE SOLUTION?")
    _grids(bodies.problem.contact_body, bodies.interface)
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


class Parts(Listener):
    """The parts of the screen of ``compare`` and ``demo``, each shown when it is told.

    Parameters
    ----------
    pair : ContactPair
        What is compared, made from a problem.
    needed : bool
        Whether the comparison is wanted for more than its screen.
    """

    def __init__(self, pair: ContactPair, *, needed: bool = False) -> None:
        self.pair, self.needed, self.verified = pair, needed, False

    def constants(self, measured: Measured, choice: Choice) -> None:
        assert self.pair.problem is not None  # see `show`
        stress = self.pair.units["stress"]
        m, M, C_R, C_s, C_tr, C_K, rho = (figures(getattr(measured, name), 4) for name in COMPARED)
        self.verified = measured.unverified is not None
        with part(needed=self.needed):
            _setting(self.pair.problem.with_theta(choice.theta), measured.nodes, measured.interface_nodes)
            heading("HOW LARGE ARE THE CONSTANTS?")
            if measured.unverified is not None:
                _between_bounds(measured, {"m": stress, "M": stress, "C_K": stress}, COMPARED)
                return
            say(f"  m = {m} {stress}, M = {M} {stress}, C_R = {C_R}")
            say(f"  C_s = {C_s}, C_tr = {C_tr}, C_K = {C_K} {stress}, rho = {rho}")

    def bounds(self, results: Sequence[BoundResult], measured: Measured) -> None:
        computed = [result for result in results if result.detail is not None]
        with part(needed=self.needed):
            heading("DOES ONE STEP CONTRACT?")
            if computed:
                bounds_table(computed, self.pair.units["stress"])
            else:
                note("no bound applies: " + measured.why_no_energy, "  ")

    def run(self, finished: Run) -> None:
        with part(needed=self.needed):
            _happened(finished, alone=False)

    def cvxpy(self, reference: Reference | None, why: str) -> None:
        with part(needed=self.needed):
            if reference is None:
                note(f"cvxpy: {why}", "  ")
                return
            rate = "no rate" if reference.observed_rate is None else f"rate {near_one(reference.observed_rate)}"
            what = f"{rate}, {reference.steps - 1} steps" if reference.whole else "first and last step"
            note(f"cvxpy alone         {what}; T differs by {reference.largest_difference:.0e} at most", "  ")

    def losses(self, losses: Losses | None, why: str) -> None:
        friction = () if losses is None else losses.friction
        with part(needed=self.needed):
            if friction or why:
                heading("WHAT DOES EACH ESTIMATE GIVE AWAY?")
            if why:
                note(f"losses: {why}", "  ")
            if friction:
                estimates = [loss for loss in friction if not loss.only_unit]
                total = sum(loss.decades for loss in estimates)
                unit = sum(loss.decades for loss in friction) - total
                say(f"  {total:.1f} decades from the largest friction term found to (5.30), repaired:")
                links = ", ".join(f"{loss.label} {loss.decades:.1f}" for loss in estimates)
                note(f"{links}; the unit adds {unit:.1f}", "  ")

    def programs(self, results: Sequence[BoundResult]) -> None:
        computed = [result for result in results if result.detail is not None]
        with part(needed=self.needed):
            heading("WHAT DO SEMIDEFINITE PROGRAMS PROVE OF ONE STEP?")
            if computed:
                bounds_table(computed, self.pair.units["stress"])
            for result in results:
                if result.detail is None:
                    note(f"{result.name}: {result.not_computed}", "  ")
                elif self.verified and not result.detail.certified:
                    note(f"{result.name} is not proved: {result.detail.not_proved}", "  ")


def comparison(result: Comparison) -> None:
    """The screen of ``compare`` and ``demo``."""
    result.tell(Parts(result.run.pair))
    verdicts(result)


def verdicts(result: Comparison, typed: Typed | None = None) -> None:
    """The end of that screen."""
    heading("DOES THE RUN AGREE WITH THE BOUND?")
    table([["bound", "verdict", "why"], *([n, j.verdict, j.reason] for n, j in result.verdicts.items())])
    _limits(result.run.outside)
    if typed is not None:
        typed.suggest("advise")


def plane(found: Plane, target: Path | None = None) -> None:
    """The screen of ``region``."""
    say(found.title)
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

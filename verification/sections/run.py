"""A run of the iteration, and the solution of the global method."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from verification import registry
from verification.algorithm.monolithic import Solution
from verification.algorithm.rates import steps
from verification.algorithm.runs import Run
from verification.interface.assembly import TwoBodies, pressure_errors
from verification.interface.fields import ContactFields
from verification.interface.interface import Interface
from verification.interface.values import PointValue, columns_of
from verification.problem.specification import Problem
from verification.problem.specs import PLACES
from verification.sections.setting import limits, setting
from verification.show.numbers import NONE, count, figures, near_one
from verification.show.parts import (
    Cell,
    Labelled,
    Next,
    Note,
    Quantity,
    Section,
    Sections,
    Shown,
    following,
    section,
    table,
)

AT_POINTS = "WHAT HAPPENS AT THE POINTS?"

#: What the table of a run shows, and its figures.
RATES = (
    "The rate by which one step multiplies the error in the long run, and the steps to the tolerance: forecast half "
    "way, computed at the solution, and observed. The steps of the linearisation are those that its rate alone takes "
    "from the start; the forecast goes on from the residual of the run."
)
PICTURES = (
    ("residuals", "The residual step by step (points), and how each bound proves that it falls (lines)."),
    (
        "bodies",
        "The bodies and what happens along Gamma_c: where its nodes stick, slip or are open, and the pressure and "
        "shear they bear.",
    ),
)


@registry.sections.register
def sections(finished: Run) -> Sections:
    """The sections; none of a run on matrices without a problem."""
    if finished.problem is None:
        return ()
    nodes, cuts = counted(finished.bodies)
    after = following("solve") if finished.pair.neumann.rigid else following("compare", iteration=True)
    return (
        setting(finished.problem.with_theta(finished.theta), nodes, finished.pair.contact.grid.n, cuts),
        happened(finished, alone=True),
        *at_points(finished.points, finished.units, finished.unfinished),
        limits(finished.outside, then(finished, "run", after)),
    )


def counted(bodies: TwoBodies) -> tuple[int, list[str]]:
    """The number of nodes of all bodies, and the cells of their files that were cut into triangles."""
    meshes = [body.mesh for body in bodies.elastic]
    return sum(len(mesh.points) for mesh in meshes), [mesh.cut for mesh in meshes]


def then(finished: Run | Solution, command: str, otherwise: Next) -> Next:
    """The command to type next: where a run did not converge, a command with the change that may let it."""
    if isinstance(finished, Solution) or not finished.unfinished:
        return otherwise
    return following(command, *(() if finished.remedy is None else finished.remedy.options), iteration=True)


def unfinished(finished: Run, first: str = "") -> list[Shown]:
    """The head of values that do not solve the problem, with the first of them, and the change to try."""
    return [*remedied(finished), Note(first, lead=f"{finished.unfinished.capitalize()}:")]


def remedied(finished: Run) -> list[Shown]:
    """The change that may let a run converge, where no command reports it on stderr."""
    said = "" if finished.remedy is None else f"{finished.remedy.sentence()}."
    return [Note(said, only=place) for place in ("notebook", "report") if said]


def happened(finished: Run, *, alone: bool) -> Section:
    """The course of a run; ``alone`` if no answer shows its end and no verdict explains a missing forecast."""
    problem = finished.problem
    assert problem is not None  # see `sections`
    rate, linear, made = finished.observed_rate, finished.linearised, finished.forecast
    rows: list[tuple[Cell, ...]] = []
    if made is not None:
        name = f"forecast at step {made.made_at_iteration}"
        rows.append((name, near_one(made.rate), count(made.iterations), "prediction, not a bound"))
    if linear is not None:
        needed = count(steps(linear.rate, problem.iteration.tolerance))
        rows.append(("linearised at the solution", near_one(linear.rate), needed, "after the run, by its rate"))
    seen: Cell = NONE if rate is None else near_one(rate.value)
    if finished.outcome == "stalled":
        seen = NONE  # no rate of convergence
    if finished.observed_growth is not None:
        seen = Quantity(finished.observed_growth, f"grows by {finished.observed_growth:.4g}")
    if alone or not rows:
        rows.insert(0, ("observed", seen, count(finished.iterations), finished.outcome.words))
    parts: list[Shown | str] = [table(("", "rate", "steps", ""), rows)]
    if linear is not None and linear.predicted is not None:
        rate_of_it = f"this linearisation has the rate {near_one(linear.predicted)} along the run"
        parts.append(Labelled("replayed", rate_of_it, only="report"))
    if made is None and finished.relaxation == "constant" and alone:
        parts.append(f"no forecast: {finished.why_no_forecast}")
    if linear is None:
        parts.append(f"not linearised: {finished.why_not_linearised}")
    if finished.relaxation != "constant":
        proved = "" if finished.proved_rate is None else f"; proved rate {near_one(finished.proved_rate.value)}"
        evaluated = f"{finished.evaluations} evaluations of T"
        parts.append(f"{evaluated}, with the {finished.relaxation} relaxation{proved}")
    elif finished.choice.source != "given":
        chosen = f"theta = {float(finished.theta):.4g} is the {finished.choice.source} one"
        parts.append(f"{chosen}: {finished.choice.why}")
    parts += _grids(problem, finished.pair.contact_body, finished.pair.interface)
    parts += [Labelled("locking", said) for said in pressure_errors(problem, finished.bodies.elastic)]
    nodes = _nodes(problem, finished.contact)
    parts += unfinished(finished, nodes) if finished.unfinished else [Labelled("nodes", nodes)]
    parts += _contact(problem, finished.contact, f"; KKT residual of step II {finished.last.contact.kkt.residual:.1e}")
    parts.append(Note(_at_the_end(finished), only="report"))
    return section("run", "WHAT HAPPENED", *parts, caption=RATES, pictures=PICTURES)


def _at_the_end(finished: Run) -> str:
    """The end of a run, which only a report shows."""
    rate, linear = finished.observed_rate, finished.linearised
    said = [f"Relative residual without relaxation at the end: {figures(finished.last.relative_residual)}."]
    if rate is not None:
        said.append(f"Observed rate between {near_one(rate.lo)} and {near_one(rate.hi)}.")
    elif finished.observed_growth is None:
        said.append("The observed rate is not measurable.")
    if linear is not None:
        norm = near_one(linear.norm)
        said.append(f"At the solution J has the spectral radius {near_one(linear.radius)} and the norm {norm}.")
    return " ".join(said)


@registry.sections.register
def solution(found: Solution) -> Sections:
    """The sections of the global method."""
    bodies, problem = found.bodies, found.bodies.problem
    nodes, cuts = counted(bodies)
    runs = len(bodies.elastic) == 2 and not bodies.interface.only_solved
    then = following("run") if runs else following("solve", "-o", "results")
    states = Labelled("nodes", _nodes(problem, found.contact))
    hints = (Labelled("locking", said) for said in pressure_errors(problem, bodies.elastic))
    parts = (
        *_grids(problem, problem.contact_body, bodies.interface),
        *hints,
        states,
        *_contact(problem, found.contact),
    )
    certified = f"KKT residual {found.kkt_residual:.1e} after {found.linear_solves} linear systems on Gamma_c"
    return (
        setting(problem, nodes, bodies.interface.contact.n, cuts),
        section("solution", "WHAT IS THE SOLUTION?", *parts, certified),
        *at_points(found.points, found.units),
        limits(bodies.outside, then),
    )


def at_points(points: Sequence[PointValue], units: Mapping[str, str], unfinished: str = "") -> Sections:
    """The values at the points that a problem names; no section where it names none."""
    if not points:
        return ()
    lead = [Note("", lead=f"{unfinished.capitalize()}:")] if unfinished else []
    return (section("points", AT_POINTS, *lead, *point_rows([("", one) for one in points], units)),)


def point_rows(points: Sequence[tuple[str, PointValue]], units: Mapping[str, str]) -> Iterator[Shown | str]:
    """A table of values at points, each with words for when, and their units."""
    values = columns_of([one for _, one in points])
    shown = [name for name in values if name not in ("body", "name", "x", "y")]
    when, rounding = any(moment for moment, _ in points), 1e-12
    numbers = [
        [figures(value if abs(value) > rounding * max(map(abs, values[name])) else 0.0, 4) for value in values[name]]
        for name in shown
    ]
    rows = [
        (*([moment] if when else []), f"{one.name} (body {one.body})", *cells)
        for (moment, one), *cells in zip(points, *numbers, strict=True)
    ]
    yield table((*(["end of"] if when else []), "point", *shown), rows)
    yield f"u in {units['length']}, stresses in {units['stress']}: means over the cells that hold the point"


def _grids(problem: Problem, contact_body: int, interface: Interface) -> list[Shown]:
    """The ends of Gamma_c that are read as planes of symmetry, and the body that carries the contact grid, if any."""
    ends = " and ".join(interface.contact.place(j) for j, plane in enumerate(interface.planes[0]) if plane)
    found: list[Shown] = [Labelled("symmetry", f"half of a whole: a plane of symmetry at {ends}")] if ends else []
    if interface.one_grid:
        return found
    own, other = f"the {PLACES[contact_body]} body", f"the {PLACES[3 - contact_body]}"
    if interface.contact.normals is not None:  # either body may lie above
        own, other = problem.words(contact_body), problem.words(3 - contact_body)
    counts = f"{interface.contact.n} nodes of {own}, Neumann grid: {interface.neumann.n} of {other}"
    return [*found, Labelled("contact grid", counts)]


def _nodes(problem: Problem, contact: ContactFields) -> str:
    """The number of nodes in each state."""
    states = contact.pattern
    if not problem.contact.friction:
        states = {"closed": states["stick"] + states["slip"], "open": states["open"]}
    counts = ", ".join(f"{number} {name}" for name, number in states.items())
    return f"{counts}: nothing touches" if contact.apart else counts


def _contact(problem: Problem, contact: ContactFields, solved: str = "") -> list[Shown]:
    """Forces along Gamma_c, in totals, and the residual of step II."""
    units, total = problem.units, contact.force
    normal = f"{figures(total['normal'], 6)} normal"
    if problem.dimension == 1:
        return [Labelled("force", f"{normal}, {units['stress']}{solved}")]
    rounding = 1e-12 * max(abs(total["normal"]), abs(total["tangential"]))
    tangential = total["tangential"] if abs(total["tangential"]) > rounding else 0.0
    unit = f"{units['stress']} {units['length']} (per unit thickness)"
    pressure = figures(float(contact.pressure.max()), 4)
    totals = [Labelled("force", f"{normal}, {figures(tangential)} tangential, {unit}")]
    if problem.contact.surface is not None:
        x, y = (figures(float(value), 6) for value in contact.weights @ contact.tractions)
        totals.append(Labelled("on body 2", f"{x} along x, {y} along y"))
    if contact.lines:
        totals = [Labelled("force", f"in {unit}")]
    for each in contact.forces:
        one, other = each["bodies"]
        words = f"{figures(each['normal'], 6)} normal, {figures(each['tangential'])} tangential"
        totals.append(Labelled(f"{one} on {other}", words))
    return [*totals, Labelled("largest pressure", f"{pressure} {units['stress']}{solved}")]

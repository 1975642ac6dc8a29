"""The problem in two lines, and the limits of a result."""

from __future__ import annotations

from collections.abc import Iterable

from verification.problem.specification import Problem
from verification.problem.specs import PLACES
from verification.registry import LAWS
from verification.show.numbers import figures
from verification.show.parts import Facts, Next, Section, closing, outside_the_theorem, section


def setting(problem: Problem, nodes: int | None, interface: int, cuts: Iterable[str] = ()) -> Section:
    """A problem, on so many nodes of both bodies and of Gamma_c, and what cells of their files were cut."""
    units, contact = problem.units, problem.contact
    counts = [] if nodes is None else [f"{nodes} nodes, {interface} on Gamma_c"]
    counts += [f"triangles cut from {cut}" for cut in dict.fromkeys(cuts) if cut]
    bodies = problem.bodies.values()
    moduli = " / ".join("rigid" if one.rigid else " to ".join(f"{float(E):g}" for E in one.youngs) for one in bodies)
    body = problem.iteration.neumann_body
    friction = "no friction" if not contact.friction else f"k = {frictions(problem)}, {_laws(problem)}"
    if any(one.rigid for one in bodies):
        facts = [f"Obstacle: {'lower' if problem.body1.rigid else 'upper'} body", friction]
    else:
        place = "" if problem.named else f" ({PLACES[body]})"  # either body may lie above along a named line
        numbers = problem.numbers(body)
        who = f"Neumann {'body' if len(numbers) == 1 else 'bodies'}: {', '.join(map(str, numbers))}"
        facts = [f"{who}{place}", friction, _how(problem)]
    thin = ["plane stress"] if problem.plane == "stress" else []
    first = Facts(problem.title, (*counts, f"E {moduli} {units['stress']}", *thin))
    return section("setting", "", first, Facts("", tuple(facts)))


def _laws(problem: Problem) -> str:
    """The law of friction, or those of several lines."""
    said, length = [], problem.units["length"]
    for line in problem.contacts:
        law = LAWS[line.law]
        radius = f", r = {float(line.radius):g} {length}" if line.radius is not None and law.needs_radius else ""
        if line.friction:
            said.append(f"{law.label if law.needs_radius else f'{law.label} law'}{radius}")
    return " and ".join(dict.fromkeys(said))


def frictions(problem: Problem) -> str:
    """k, or the least and the largest one where it varies."""
    return " to ".join(f"{figures(k, 2)}" for k in problem.frictions)


def _how(problem: Problem) -> str:
    """The relaxation of the iteration."""
    theta, relaxation = problem.iteration.theta, problem.iteration.relaxation
    if relaxation != "constant":
        return relaxation
    return f"theta = {theta if theta == 'auto' else f'{float(theta):.4g}'}"


def limits(outside: Iterable[str], then: Next) -> Section:
    """The limits of a result for a mesh, and the reasons why it lies outside the theorem."""
    notes = map(outside_the_theorem, outside)
    return closing("anything about the continuum, or the local Coulomb law", *notes, then=then)

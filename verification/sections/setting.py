"""The problem in two lines, and the limits of a result."""

from __future__ import annotations

from collections.abc import Iterable

from verification.interface.friction import LAWS
from verification.problem.specification import Problem
from verification.problem.specs import PLACES, ContactSpec
from verification.sections.numbers import figures
from verification.sections.parts import Facts, Next, Note, Section, closing, section


def setting(problem: Problem, nodes: int | None, interface: int) -> Section:
    """A problem, on so many nodes of both bodies and of Gamma_c."""
    units, contact = problem.units, problem.contact
    counts = [] if nodes is None else [f"{nodes} nodes, {interface} on Gamma_c"]
    bodies = (problem.body1, problem.body2)
    moduli = " / ".join("rigid" if one.rigid else " to ".join(f"{float(E):g}" for E in one.youngs) for one in bodies)
    body = problem.iteration.neumann_body
    law = LAWS[contact.law].label if LAWS[contact.law].needs_radius else f"{LAWS[contact.law].label} law"
    friction = "no friction" if not contact.friction else f"k = {frictions(contact)}, {law}"
    if contact.friction and contact.radius is not None and LAWS[contact.law].needs_radius:
        friction += f", r = {float(contact.radius):g} {units['length']}"
    if any(one.rigid for one in bodies):
        facts = [f"Obstacle: {'lower' if problem.body1.rigid else 'upper'} body", friction]
    else:
        place = f" ({PLACES[body]})" if contact.surface is None else ""  # either body may lie above along a named line
        facts = [f"Neumann body: {body}{place}", friction, _how(problem)]
    thin = ["plane stress"] if problem.plane == "stress" else []
    first = Facts(problem.title, (*counts, f"E {moduli} {units['stress']}", *thin))
    return section("setting", "", first, Facts("", tuple(facts)))


def frictions(contact: ContactSpec) -> str:
    """k, or the least and the largest one where it varies."""
    return " to ".join(f"{figures(k, 2)}" for k in contact.frictions)


def _how(problem: Problem) -> str:
    """The relaxation of the iteration."""
    theta, relaxation = problem.iteration.theta, problem.iteration.relaxation
    if relaxation != "constant":
        return relaxation
    return f"theta = {theta if theta == 'auto' else f'{float(theta):.4g}'}"


def outside_the_theorem(reason: str) -> Note:
    """A reason why a problem lies outside the theorem."""
    return Note(f"{reason}.", 0, "Outside the theorem:")


def limits(outside: Iterable[str], then: Next) -> Section:
    """The limits of a result for a mesh, and the reasons why it lies outside the theorem."""
    notes = map(outside_the_theorem, outside)
    return closing("anything about the continuum, or the local Coulomb law", *notes, then=then)

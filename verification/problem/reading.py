"""From nested dictionaries to the validated data of a problem: the keys of each table, and what they need together."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from verification.problem.colours import OddRing, neumann_bodies
from verification.problem.entries import read_entries
from verification.problem.readers import Components, tables_of
from verification.problem.specs import BodySpec, ContactSpec, IterationSpec, Loads, ProblemSpec, StepSpec
from verification.problem.tables import ProblemError, TomlTable
from verification.registry import LAWS

#: Largest ratio of the two moduli: at 1e60 the bounds of Section 5, with high powers of M C_R / m, overflow a double.
MOST_CONTRAST = Fraction(10**30)

#: The same in one stiffness matrix, of a body with several materials or of several bodies: a hard inclusion of 1e12
#: changes the force by 2e-4, one of 1e14 by a percent.
MOST_WITHIN = Fraction(10**8)

#: The laws of more than two bodies.
COVERED, MORE = ("nonlocal", "local"), "where there are more than two bodies"


def read_problem(data: Mapping[str, Any], source: str) -> ProblemSpec:
    """Validate a nested dictionary with the keys of the problem file; errors name its source.

    Raises
    ------
    ProblemError
        Naming source, key, value received and what is needed.
    """
    if not isinstance(data, Mapping):
        raise ProblemError(source, "", None, f"needed a table of keys, received {type(data).__name__}")
    top = TomlTable(data, source)
    found = read_entries(ProblemSpec, top)
    several = isinstance(top.get("contact"), (list, tuple))
    around = {"dimension": found["dimension"], "plane": found["plane"], "source": source, "several": several}
    bodies = (_bodies_of_several if several else _bodies_of_two)(top, around)
    around |= {"numbers": bodies}
    contacts = [_read_contact(table, around) for table in _contacts(top, several=several)]
    for i, body in bodies.items():
        if body.rigid:
            _check_face(top, i, body, contacts[0].surface)
    around |= {"touching": [contact.bodies for contact in contacts]}
    around |= {"chosen": _colour(top, bodies, around["touching"])} if several else {}
    table = top.table("iteration")
    iteration = read_entries(IterationSpec, table, **around)
    table.close()
    if several:
        chosen = iteration["neumann_bodies"]
        iteration["neumann_body"] = 1 if 1 in chosen else 2
        one, other = (
            BodySpec.union((i, body) for i, body in bodies.items() if (i in chosen) == with_1)
            for with_1 in (1 in chosen, 1 not in chosen)
        )  # body 1 of the result has body 1 of the file among its members
    else:
        one, other = bodies[1], bodies[2]
    found |= {"body1": one, "body2": other, "contacts": tuple(contacts), "iteration": IterationSpec(**iteration)}
    found |= {"steps": _read_steps(top, bodies, around)}
    top.close()
    return ProblemSpec(**found, source=source)


# --- bodies -----------------------------------------------------------------------------------------------------------


def _bodies_of_two(top: TomlTable, around: Mapping[str, Any]) -> dict[int, BodySpec]:
    """Read two bodies, of which one may be an obstacle."""
    if "body3" in top:
        needed = (
            "needed tables [[contact]], each with bodies = [1, 2] and surface, where there are more than two bodies"
        )
        raise top.refuse("contact", None, needed)
    bodies = {i: _read_body(top.table(f"body{i}", required=True), around) for i in (1, 2)}
    elastic = [body for body in bodies.values() if not body.rigid]
    if not elastic:
        raise top.refuse("body2.shape", "rigid", "needed at least one elastic body")
    if not _within(elastic, MOST_CONTRAST):
        needed = f"needed a modulus within {float(MOST_CONTRAST):g} times that of body1, {float(bodies[1].young):g}"
        needed += '; for `solve`, shape = "rigid" makes an obstacle'
        raise top.refuse("body2.young", bodies[2].young, needed)
    return bodies


def _bodies_of_several(top: TomlTable, around: Mapping[str, Any]) -> dict[int, BodySpec]:
    """Read any number of elastic bodies."""
    if around["dimension"] == 1:
        raise top.refuse("contact", None, "needed one table [contact]: in one dimension there are two bodies")
    numbers = sorted({1, 2} | {int(name[4:]) for name in top.names() if re.fullmatch("body[1-9][0-9]{0,8}", str(name))})
    bodies = {i: _read_body(top.table(f"body{i}", required=True), around) for i in numbers}
    for i, body in bodies.items():
        if body.rigid:
            needed = "needed an elastic body, as there are several; one that is fixed and stiff replaces an obstacle"
            raise top.refuse(f"body{i}.shape", "rigid", needed)
        if not _within([bodies[j] for j in numbers if j <= i], MOST_WITHIN):
            needed = f"needed a modulus within {float(MOST_WITHIN):g} times those before it"
            raise top.refuse(f"body{i}.young", body.young, needed)
    return bodies


def _check_face(top: TomlTable, i: int, body: BodySpec, surface: tuple[str, str] | None) -> None:
    """Refuse an obstacle whose face is not the one that the contact names."""
    key = f"body{i}.{'circle' if body.circle else 'line' if body.line else 'shape'}"
    if body.line and body.circle:
        raise top.refuse(f"body{i}.line", None, "needed either line or circle, not both")
    if body.face and (body.x or body.y):
        raise top.refuse(key, None, "needed either x and y, or line or circle, not both")
    if body.face and not body.side:
        raise top.refuse(f"body{i}.side", None, "this key is missing: needed a name of the line for contact.surface")
    if body.face and surface is None:
        raise top.refuse("contact.surface", None, f"this key is missing: needed it, with {body.side!r} for body{i}")
    if surface and not body.face:
        needed = "needed line or circle, and side, which names it (or contact.interval instead of surface)"
        raise top.refuse(key, "rigid", needed)
    if surface and surface[i - 1] != body.side:
        raise top.refuse("contact.surface", list(surface), f"body{i} has the side {body.side!r} only")


def _within(bodies: list[BodySpec], most: Fraction) -> bool:
    """Return True if no modulus of some bodies is more than ``most`` times another one."""
    youngs = [E for body in bodies for E in body.youngs]
    return max(youngs) <= most * min(youngs)


def _read_body(table: TomlTable, around: Mapping[str, Any]) -> BodySpec:
    if "mesh" in table:
        if around["dimension"] == 1:
            raise table.refuse("mesh", None, "in one dimension a body is an interval")
        for name in ("shape", "x", "y", "cells"):
            if name in table:
                raise table.refuse(name, None, "needed either mesh or shape, x, y and cells, not both")
    found = read_entries(BodySpec, table, kept=(Fraction(0),) * around["dimension"], **around)
    young, poisson = found["young"], found["poisson"]
    surfaces = {surface: None for value in (young, poisson) if isinstance(value, dict) for surface in value}
    E, nu = (value if isinstance(value, dict) else dict.fromkeys(surfaces, value) for value in (young, poisson))
    if not E.keys() == nu.keys():
        raise table.refuse("poisson", poisson, f"needed the same surfaces as young has, {', '.join(E)}")
    if surfaces and max(E.values()) > MOST_WITHIN * min(E.values()):
        raise table.refuse("young", young, f"needed moduli within {float(MOST_WITHIN):g} times each other")
    if surfaces:
        materials = {surface: (E[surface], nu[surface]) for surface in surfaces}
        found |= {"young": max(E.values()), "poisson": max(nu.values()), "materials": materials}
    for name in found["fixed"]:
        if name in found["prescribed"]:
            values = list(found["prescribed"][name])
            raise table.refuse(f"prescribed.{name}", values, f"side {name!r} is fixed already")
    _check_tractions(table, found["traction"], found["fixed"], found["prescribed"])
    table.close()
    return BodySpec(**found, plane=around["plane"])


def _check_tractions(
    table: TomlTable, traction: Mapping[str, Components], fixed: tuple[str, ...], prescribed: Mapping[str, Components]
) -> None:
    """Refuse a force on a component that a side holds."""
    for name, force in traction.items():
        held = prescribed.get(name, (None,) * len(force)) if name not in fixed else (Fraction(0),) * len(force)
        if any(t != 0 and h is not None for t, h in zip(force, held, strict=True)):
            needed = "this component of the side is held: a force there is lost"
            raise table.refuse(f"traction.{name}", list(force), needed)


# --- contacts and roles -----------------------------------------------------------------------------------------------


def _contacts(top: TomlTable, *, several: bool) -> list[TomlTable]:
    """Return the table ``[contact]``, or the tables ``[[contact]]``."""
    if not several:
        return [top.table("contact")]
    tables = top.take("contact", tables_of(top, "contact"))
    if not tables:
        raise top.refuse("contact", [], "needed a table, or several, each as [[contact]]")
    return tables


def _read_contact(table: TomlTable, around: Mapping[str, Any]) -> ContactSpec:
    found = read_entries(ContactSpec, table, **around)
    found["friction"], found["profile"] = found["friction"]
    table.close()
    contact = ContactSpec(**found)
    bars, several, law = around["dimension"] == 1, around["several"], LAWS[contact.law]
    friction, ends, sides = contact.friction, contact.interval, contact.surface
    for wrong, key, value, needed in (
        (bars and sides, "surface", sides, "two bars meet at a point; leave it out"),
        (ends and sides, "surface", sides, "needed either surface or interval, not both; leave it out"),
        (bars and friction, "friction", friction, "needed 0: two bars have no friction"),
        (bars and ends, "interval", ends, "two bars meet at a point; leave it out in one dimension"),
        (
            friction and law.needs_radius and contact.radius is None,
            "radius",
            None,
            f'this key is missing; the {law.label} law needs the radius of its kernel (or law = "local")',
        ),
        (several and not sides, "surface", None, "needed two names of sides, of each of its bodies one"),
        (several and contact.gap, "gap", contact.gap, f"needed 0 {MORE}: draw them apart"),
        (several and contact.law not in COVERED, "law", contact.law, f'needed "nonlocal" or "local" {MORE}'),
    ):
        if wrong:
            raise table.refuse(key, value, needed)
    return contact


def _colour(top: TomlTable, bodies: Mapping[int, BodySpec], touching: list[tuple[int, int]]) -> tuple[int, ...]:
    """Return the bodies with the Neumann problem where the file does not name them."""
    if untouched := bodies.keys() - {i for pair in touching for i in pair}:
        raise top.refuse(f"body{min(untouched)}", None, "needed a table [[contact]] with another body")
    held = {i for i, body in bodies.items() if body.fixed or any(None not in v for v in body.prescribed.values())}
    try:
        found = neumann_bodies(touching, held, {i for i, body in bodies.items() if body.fixed or body.prescribed})
    except OddRing as error:
        needed = (
            f"{error}: two neighbours would have one role, and taken one after another around the ring they need not"
            " converge; needed bodies of two colours, of which only different ones touch"
        )
        raise top.refuse("contact.bodies", None, needed) from None
    return tuple(sorted(found))


# --- steps ------------------------------------------------------------------------------------------------------------


def _read_steps(top: TomlTable, bodies: Mapping[int, BodySpec], around: Mapping[str, Any]) -> tuple[StepSpec, ...]:
    """Read the tables ``[[step]]`` of a loading history, in which the supports of the bodies stay the same.

    A side that the first step prescribes need not be prescribed by the body.
    """
    held = {i: dict(body.prescribed) for i, body in bodies.items()}
    steps: list[StepSpec] = []
    for number, table in enumerate(top.take("step", tables_of(top, "step"), []), 1):
        found = read_entries(StepSpec, table, number=number, before=sum(step.increments for step in steps))
        loads = {}
        for i, body in bodies.items():
            within = dict(around, shape=body.shape, parts=body.parts, kept=())
            loads[i] = _read_loads(table.table(f"body{i}"), body, held[i], within, first=number == 1)
        table.close()
        steps.append(StepSpec(**found, body1=loads.pop(1), body2=loads.pop(2), others=loads))
    return tuple(steps)


def _read_loads(
    table: TomlTable, body: BodySpec, held: dict[str, Components], around: Mapping[str, Any], *, first: bool
) -> Loads:
    """Read the loads of a body at the end of a step; ``held`` has the sides prescribed before, and gets new ones."""
    if body.rigid:
        if names := list(table.names()):
            raise table.refuse(names[0], None, "a rigid body has no loads")
        return Loads()
    loads = Loads(**read_entries(Loads, table, **around))
    for side, values in loads.prescribed.items():
        refuse = lambda needed, side=side, values=values: table.refuse(f"prescribed.{side}", list(values), needed)
        if side in body.fixed:
            raise refuse(f"side {side!r} is fixed already")
        if not first and side not in held:
            raise refuse("needed a side that the body or the first step prescribes: supports stay through a history")
        if [v is None for v in held.setdefault(side, values)] != [v is None for v in values]:
            needed = 'needed "free" where it was "free" before, only there: supports stay through a history'
            raise refuse(f"{needed}; prescribe this component in each step, in place of a traction")
    _check_tractions(table, loads.traction, body.fixed, held)
    table.close()
    return loads

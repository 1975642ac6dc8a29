"""Reading of the tables of a problem file: from nested dictionaries to the validated data of a problem."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

from ndtheory import HypothesisError
from verification.problem.colours import OddRing, Touching, neumann_bodies
from verification.problem.specs import (
    INTERVAL_SIDES,
    LEAST_FRICTION,
    MOST_CELLS,
    MOST_CONTRAST,
    MOST_FRICTION,
    MOST_INCREMENTS,
    MOST_WITHIN,
    RECTANGLE_SIDES,
    BodySpec,
    Components,
    ContactSpec,
    IterationSpec,
    Loads,
    MeshFile,
    ProblemSpec,
    Profile,
    SidePart,
    StepSpec,
    Theta,
    read_theta,
)
from verification.problem.tables import (
    NO_UNIT,
    ProblemError,
    TomlTable,
    Unfit,
    choice,
    ends,
    integer,
    label,
    non_negative,
    number,
    positive,
    several,
    text,
)
from verification.registry import LAWS, RULES


def takes_theta(relaxation: Any) -> bool:
    """Return True if the rule of that name uses a given theta; names of no rule are refused elsewhere."""
    rule = RULES.get(relaxation) if isinstance(relaxation, str) else None
    return rule is None or rule.takes_theta


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
    dimension: Literal[1, 2] = top.take("dimension", choice(1, 2), 2)
    title = top.take("title", label, "untitled")
    units = top.table("units")
    labels = {name: units.take(name, label, default) for name, default in (("length", "mm"), ("stress", "MPa"))}
    units.close()
    if dimension == 1 and "plane" in top:
        raise top.refuse("plane", None, "a bar has none; leave it out in one dimension")
    plane = top.take("plane", _plane, "strain")
    read = _read_several if isinstance(data.get("contact"), (list, tuple)) else _read_two
    body1, body2, contact, iteration = read(top, dimension, plane, source)
    if contact.lines and "step" in top:
        raise top.refuse("step", None, "needed two bodies: histories of more bodies are not supported yet")
    steps = _read_steps(top, {"body1": body1, "body2": body2}, dimension)
    norm = top.table("norm")
    length = norm.take("length", positive, Fraction(1))
    norm.close()
    top.close()
    return ProblemSpec(
        title=title,
        dimension=dimension,
        units=labels,
        body1=body1,
        body2=body2,
        contact=contact,
        iteration=iteration,
        length=length,
        steps=steps,
        source=source,
    )


#: Two bodies as the iteration takes them, their contact, and the iteration.
Pair = tuple[BodySpec, BodySpec, ContactSpec, IterationSpec]


def _read_two(top: TomlTable, dimension: Literal[1, 2], plane: Literal["strain", "stress"], source: str) -> Pair:
    """Read two bodies and the table ``[contact]``."""
    if "body3" in top:
        needed = (
            "needed tables [[contact]], each with bodies = [1, 2] and surface, where there are more than two bodies"
        )
        raise top.refuse("contact", None, needed)
    body1 = _read_body(top.table("body1", required=True), dimension, plane, source)
    body2 = _read_body(top.table("body2", required=True), dimension, plane, source)
    if body1.rigid and body2.rigid:
        raise top.refuse("body2.shape", "rigid", "needed at least one elastic body")
    if not (body1.rigid or body2.rigid or _within_contrast(body1, body2)):
        needed = f"needed a modulus within {float(MOST_CONTRAST):g} times that of body1, {float(body1.young):g}"
        raise top.refuse("body2.young", body2.young, f'{needed}; for `solve`, shape = "rigid" makes an obstacle')
    contact = _read_contact(top.table("contact"), dimension)
    for name, body in (("body1", body1), ("body2", body2)):
        if body.rigid and contact.surface:
            needed = "needed an elastic body: an obstacle has no named sides (contact.interval takes one)"
            raise top.refuse(f"{name}.shape", "rigid", needed)
    iteration = top.table("iteration")
    return body1, body2, contact, _read_iteration(iteration, iteration.take("neumann_body", choice(1, 2), 2))


def _read_several(top: TomlTable, dimension: Literal[1, 2], plane: Literal["strain", "stress"], source: str) -> Pair:
    """Read any number of bodies and the tables ``[[contact]]``, as two bodies: those of one role are one.

    Body 1 of the result has body 1 of the file among its members.
    """
    if dimension == 1:
        raise top.refuse("contact", None, "needed one table [contact]: in one dimension there are two bodies")
    numbers = sorted({1, 2} | {int(name[4:]) for name in top.names() if re.fullmatch("body[1-9][0-9]*", str(name))})
    bodies = {i: _read_body(top.table(f"body{i}", required=True), dimension, plane, source) for i in numbers}
    for i, body in bodies.items():
        if body.rigid:
            raise top.refuse(f"body{i}.shape", "rigid", "needed an elastic body: an obstacle has no named sides")
        if not _within_contrast(*(bodies[j] for j in numbers if j <= i), most=MOST_WITHIN):
            needed = f"needed a modulus within {float(MOST_WITHIN):g} times those before it"
            raise top.refuse(f"body{i}.young", body.young, needed)
    tables = top.take("contact", _tables_of(top, "contact"))
    if not tables:
        raise top.refuse("contact", [], "needed a table, or several, each as [[contact]]")
    lines = [_read_line(table, bodies) for table in tables]
    laws = [contact.law for _, contact in lines if contact.friction] or [lines[0][1].law]
    law = min(laws, key=lambda name: LAWS[name].needs_radius)  # the theorem is about one with a radius
    touching = [pair for pair, _ in lines]
    if untouched := bodies.keys() - {i for pair in touching for i in pair}:
        raise top.refuse(f"body{min(untouched)}", None, "needed a table [[contact]] with another body")
    iteration = top.table("iteration")
    if "neumann_body" in iteration:
        raise iteration.refuse(
            "neumann_body", None, "needed neumann_bodies, a list of numbers, with tables [[contact]]"
        )
    held = {i for i, body in bodies.items() if body.fixed or any(None not in v for v in body.prescribed.values())}
    try:
        default = neumann_bodies(touching, held, {i for i, body in bodies.items() if body.fixed or body.prescribed})
    except OddRing as error:
        needed = (
            f"{error}: two neighbours would have one role, and taken one after another around the ring they need not"
            " converge; needed bodies of two colours, of which only different ones touch"
        )
        raise top.refuse("contact.bodies", None, needed) from None
    chosen = iteration.take("neumann_bodies", _roles_of(touching, bodies), default)
    neumann_body: Literal[1, 2] = 1 if 1 in chosen else 2
    first, second = (
        BodySpec.union((i, body) for i, body in bodies.items() if (i in chosen) == neumann)
        for neumann in (neumann_body == 1, neumann_body == 2)
    )
    return first, second, ContactSpec.of_lines(lines, law), _read_iteration(iteration, neumann_body)


def _tables_of(top: TomlTable, name: str) -> Callable[[Any], list[TomlTable]]:
    """Return a reader of an array of tables."""

    def read(value: Any) -> list[TomlTable]:
        if not isinstance(value, (list, tuple)) or not all(isinstance(each, Mapping) for each in value):
            raise Unfit(f"needed tables, each as [[{name}]]")
        return [top.within(f"{name}[{i}]", each) for i, each in enumerate(value, 1)]

    return read


def _read_line(table: TomlTable, bodies: Mapping[int, BodySpec]) -> tuple[tuple[int, int], ContactSpec]:
    """Read a table ``[[contact]]``: the numbers of its bodies, and the rest of it."""

    def two(value: Any) -> tuple[int, int]:
        needed = f"two different numbers of bodies, of {', '.join(map(str, bodies))}"
        one, other = several(choice(*bodies), 2, needed)(value)
        if one == other:
            raise Unfit(f"needed {needed}")
        return one, other

    pair = table.take("bodies", two)
    contact = _read_contact(table, 2)
    if contact.surface is None:
        raise table.refuse("surface", None, "needed two names of sides, of each of its bodies one")
    if contact.gap:
        raise table.refuse("gap", contact.gap, "needed 0 where there are more than two bodies: draw them apart")
    if contact.law not in ("nonlocal", "local"):
        raise table.refuse("law", contact.law, 'needed "nonlocal" or "local" where there are more than two bodies')
    return pair, contact


def _roles_of(touching: Touching, bodies: Mapping[int, BodySpec]) -> Callable[[Any], set[int]]:
    """Return a reader of the bodies with the Neumann problem: of each contact exactly one."""

    def read(value: Any) -> set[int]:
        if not isinstance(value, (list, tuple)) or len(set(map(str, value))) < len(value):
            raise Unfit("needed a list of different numbers of bodies, as [1, 3]")
        chosen = {choice(*bodies)(i) for i in value}
        for one, other in touching:
            if (one in chosen) == (other in chosen):
                raise Unfit(
                    f"needed one of the two bodies of each contact, not {'both' if one in chosen else 'none'}"
                    f" of {one} and {other}"
                )
        return chosen

    return read


def _read_shape(table: TomlTable, dimension: int, source: str) -> dict[str, Any]:
    """Read the geometry of a body: a mesh file, or a shape with its cells."""
    if "mesh" in table:
        if dimension == 1:
            raise table.refuse("mesh", None, "in one dimension a body is an interval")
        for name in ("shape", "x", "y", "cells"):
            if name in table:
                raise table.refuse(name, None, "needed either mesh or shape, x, y and cells, not both")
        return {"shape": "mesh", "mesh": _read_mesh(table, source)}
    axes = ("x", "y")[:dimension]
    shape = table.take("shape", choice("interval" if dimension == 1 else "rectangle", "rigid"))
    if shape == "rigid":
        return {"shape": shape, **{axis: table.take(axis, ends, None) for axis in axes}}
    read: dict[str, Any] = {axis: table.take(axis, ends) for axis in axes}
    pair = several(at_least_one, 2, "two whole numbers >= 1, along x and y")
    read["cells"] = table.take("cells", pair) if dimension == 2 else (table.take("cells", at_least_one),)
    if math.prod(read["cells"]) > MOST_CELLS:
        raise table.refuse("cells", list(read["cells"]), f"needed at most {MOST_CELLS} cells")
    return {"shape": shape, **read}


def _read_mesh(table: TomlTable, source: str) -> MeshFile:
    """Read a mesh file: its name, its name and the SHA-256 it must have, or one that was read before."""

    def read(value: Any) -> MeshFile | TomlTable | str:
        if isinstance(value, Mapping):
            return TomlTable(value, source, table.key("mesh"))
        return value if isinstance(value, MeshFile) else text(value)

    given = table.take("mesh", read)
    if isinstance(given, MeshFile):
        return given
    if isinstance(given, TomlTable):
        name, sha256 = given.take("path", text), given.take("sha256", _sha256)
        given.close()
    else:
        name, sha256 = given, None
    path = (Path() if source == "<dict>" else Path(source).parent) / name
    try:
        return MeshFile.read(path, sha256)
    except Unfit as error:
        raise table.refuse("mesh", path, str(error)) from None


def _sha256(value: object) -> str:
    """Read a SHA-256 in hexadecimal digits."""
    given = text(value)
    if not re.fullmatch("[0-9a-f]{64}", given):
        raise Unfit("needed the SHA-256 of the mesh file, 64 hexadecimal digits")
    return given


def _components(dimension: int, *, free: bool) -> Any:
    """Return a reader of vectors by components; in 1D it takes a bare number too."""
    plain = number()
    one = lambda value: None if free and value == "free" else plain(value)
    needed = "a number" if dimension == 1 else "two numbers, along x and y"
    if free:
        needed += ' ("free" leaves a component free)'

    def read(value: Any) -> Components:
        listed = [value] if dimension == 1 and not isinstance(value, (list, tuple)) else value
        try:
            return several(one, dimension, needed)(listed)
        except Unfit as error:
            raise Unfit(f"needed {needed}" + NO_UNIT * str(error).endswith(NO_UNIT)) from None

    return read


def _by_side(table: TomlTable, sides: tuple[str, ...] | None, read: Any) -> Mapping[str, Any]:
    """Read a sub-table keyed by side names; the sides of a mesh file are known only later."""
    result = {}
    for name in _names(table):
        if sides is not None and name not in sides:
            raise table.refuse(name, None, "unknown side; known here: " + ", ".join(sides))
        result[name] = table.take(name, read)
    return result


def _read_parts(table: TomlTable, sides: tuple[str, ...] | None, dimension: int) -> Mapping[str, SidePart]:
    """Read parts of sides, each with its own name: the side, and the ends of the part along x or y."""
    parts = {}
    for name in _names(table):
        if dimension == 1:
            raise table.refuse(name, None, "the side of a bar is a point: it has no parts")
        if sides is not None and name in sides:
            raise table.refuse(name, None, "needed a name that no side has; known here: " + ", ".join(sides))
        part = table.table(name, required=True)
        if "x" in part and "y" in part:
            raise part.refuse("x", None, "needed the ends of a part along x or along y, received both")
        axis: Literal["x", "y"] = "y" if "y" in part else "x"
        side, reach = part.take("side", choice(*sides) if sides is not None else label), part.take(axis, ends)
        part.close()
        parts[name] = SidePart(side=side, axis=axis, ends=reach)
    return parts


def _names(table: TomlTable) -> Iterator[str]:
    """Yield the keys of a table, each of which must be a name that a file can hold."""
    for name in table.names():
        try:
            yield label(name)
        except Unfit as error:
            raise table.refuse(str(name), None, str(error)) from None


#: The sides of a shape; a mesh file names its own, which are known only later.
SIDES: Mapping[str, tuple[str, ...]] = {"rectangle": RECTANGLE_SIDES, "interval": INTERVAL_SIDES}


def _plane(value: Any) -> Any:
    """Read the name of a plane model."""
    if value == "axisymmetric":
        raise Unfit('bodies of revolution have other matrices and no proofs here; needed "strain" or "stress"')
    return choice("strain", "stress")(value)


def _poisson(plane: str) -> Callable[[Any], Fraction]:
    """Return a reader of Poisson's ratio: in plane stress the body of plane strain must be one as well."""
    if plane == "strain":
        return number("a number with -1 < nu < 0.5", lambda v: -1 < v < Fraction(1, 2))
    return number("a number with -0.5 < nu <= 0.5 in plane stress", lambda v: -Fraction(1, 2) < v <= Fraction(1, 2))


def _read_moduli(table: TomlTable, readers: Mapping[str, Any], dimension: int, *, meshed: bool) -> dict[str, Any]:
    """Read ``young`` and ``poisson``: numbers, or tables of them by named surfaces of a mesh file."""

    def by_surface(name: str) -> Callable[[Any], Any]:
        def read(value: Any) -> Any:
            if not isinstance(value, Mapping) or not value:
                return readers[name](value)
            if not meshed:
                raise Unfit("needed a number: only a mesh file has named surfaces")
            inside = table.within(name, value)
            return {surface: inside.take(surface, readers[name]) for surface in _names(inside)}

        return read

    young = table.take("young", by_surface("young"))
    if dimension == 1:
        if "poisson" in table:
            raise table.refuse("poisson", None, "a bar has no Poisson ratio; leave it out in one dimension")
        return {"young": young}
    poisson = table.take("poisson", by_surface("poisson"))
    surfaces = {surface: None for value in (young, poisson) if isinstance(value, dict) for surface in value}
    E, nu = (value if isinstance(value, dict) else dict.fromkeys(surfaces, value) for value in (young, poisson))
    if not E.keys() == nu.keys():
        raise table.refuse("poisson", poisson, f"needed the same surfaces as young has, {', '.join(E)}")
    if surfaces and max(E.values()) > MOST_WITHIN * min(E.values()):
        raise table.refuse("young", young, f"needed moduli within {float(MOST_WITHIN):g} times each other")
    materials = {surface: (E[surface], nu[surface]) for surface in surfaces}
    largest = [max(pair) for pair in zip(*materials.values(), strict=True)] or [young, poisson]
    return {"young": largest[0], "poisson": largest[1], "materials": materials}


def _within_contrast(*bodies: BodySpec, most: Fraction = MOST_CONTRAST) -> bool:
    """Return True if no modulus of some bodies is more than ``most`` times another one."""
    youngs = [E for body in bodies for E in body.youngs]
    return max(youngs) <= most * min(youngs)


def _read_body(table: TomlTable, dimension: int, plane: Literal["strain", "stress"], source: str) -> BodySpec:
    shape = _read_shape(table, dimension, source)
    if shape["shape"] == "rigid":
        table.close()
        return BodySpec(**shape)
    sides = SIDES.get(shape["shape"])
    parts = _read_parts(table.table("parts"), sides, dimension)
    if sides is not None:
        sides += tuple(parts)

    def side_list(value: Any) -> tuple[str, ...]:
        if not isinstance(value, (list, tuple)) or not all(isinstance(name, str) for name in value):
            raise Unfit('needed a list of side names, as ["bottom"]')
        for name in value:
            label(name)
            if sides is not None and name not in sides:
                raise Unfit(f"unknown side {name!r}; known here: {', '.join(sides)}")
        if len(set(value)) < len(value):
            raise Unfit("needed each side once")
        return tuple(value)

    moduli = _read_moduli(table, {"young": positive, "poisson": _poisson(plane)}, dimension, meshed=sides is None)
    fixed = table.take("fixed", side_list, ())
    prescribed = _by_side(table.table("prescribed"), sides, _components(dimension, free=True))
    for name in fixed:
        if name in prescribed:
            raise table.refuse(f"prescribed.{name}", list(prescribed[name]), f"side {name!r} is fixed already")
    traction = _by_side(table.table("traction"), sides, _components(dimension, free=False))
    _check_tractions(table, traction, fixed, prescribed)
    body_force = table.take("body_force", _components(dimension, free=False), (Fraction(0),) * dimension)
    table.close()
    return BodySpec(
        **shape,
        **moduli,
        parts=parts,
        fixed=fixed,
        prescribed=prescribed,
        traction=traction,
        body_force=body_force,
        plane=plane,
    )


def _read_contact(table: TomlTable, dimension: int) -> ContactSpec:
    friction, profile = table.take("friction", lambda value: _friction(value, table), (Fraction(0), None))
    law = table.take("law", choice(*LAWS), "nonlocal")
    radius = table.take("radius", positive, None)
    interval: Any = table.take("interval", ends, None)
    gap = table.take("gap", non_negative, Fraction(0))
    names = several(label, 2, 'two names of sides, of body 1 and of body 2, as ["deck", "tip"]')
    surface: Any = table.take("surface", names, None)
    table.close()
    if surface is not None and (interval is not None or dimension == 1):
        why = "needed either surface or interval, not both" if dimension == 2 else "two bars meet at a point"
        raise table.refuse("surface", list(surface), f"{why}; leave it out")
    if dimension == 1:
        if friction:
            raise table.refuse("friction", friction, "needed 0: two bars have no friction")
        if interval:
            raise table.refuse("interval", list(interval), "two bars meet at a point; leave it out in one dimension")
    elif friction and LAWS[law].needs_radius and radius is None:
        raise table.refuse(
            "radius",
            None,
            f'this key is missing; the {LAWS[law].label} law needs the radius of its kernel (or law = "local")',
        )
    return ContactSpec(
        interval=interval, surface=surface, friction=friction, law=law, radius=radius, gap=gap, profile=profile
    )


def _friction(value: Any, table: TomlTable) -> tuple[Fraction, Profile | None]:
    """Read a coefficient of friction, or a table of it along Gamma_c: the largest one, and how it varies."""
    if not isinstance(value, Mapping) or not value:
        return coefficient(value), None
    inside = table.within("friction", value)
    s, k = inside.take("s", _positions), inside.take("k", _listed(coefficient))
    inside.close()
    if len(s) != len(k):
        raise inside.refuse("k", list(k), f"needed as many values as s has, {len(s)}")
    return Profile.of(s, k)


def _listed(read: Callable[[Any], Fraction]) -> Callable[[Any], tuple[Fraction, ...]]:
    """Return a reader of a list of two numbers or more."""

    def read_all(value: Any) -> tuple[Fraction, ...]:
        if not isinstance(value, (list, tuple)) or len(value) < 2:
            raise Unfit("needed a list of two numbers or more")
        return tuple(map(read, value))

    return read_all


def _positions(value: Any) -> tuple[Fraction, ...]:
    """Read distances along Gamma_c, which begins at 0."""
    s = _listed(number("increasing numbers, the first one at most 0"))(value)
    if s[0] > 0 or not all(float(a) < float(b) for a, b in pairwise(s)):
        raise Unfit("needed increasing numbers, the first one at most 0")
    return s


def _read_steps(top: TomlTable, bodies: Mapping[str, BodySpec], dimension: int) -> tuple[StepSpec, ...]:
    """Read the tables ``[[step]]`` of a loading history, in which the supports of the bodies stay the same.

    A side that the first step prescribes need not be prescribed by the body.
    """

    held = {name: dict(body.prescribed) for name, body in bodies.items()}
    steps: list[StepSpec] = []
    for i, table in enumerate(top.take("step", _tables_of(top, "step"), []), 1):
        name, count = table.take("name", label, f"step {i}"), table.take("increments", at_least_one, 1)
        if count + sum(step.increments for step in steps) > MOST_INCREMENTS:
            raise table.refuse("increments", count, f"needed at most {MOST_INCREMENTS} increments of all steps")
        loads = {
            key: _read_loads(table.table(key), body, held[key], dimension, first=i == 1) for key, body in bodies.items()
        }
        table.close()
        steps.append(StepSpec(name=name, increments=count, **loads))
    return tuple(steps)


def _read_loads(table: TomlTable, body: BodySpec, held: dict[str, Components], dimension: int, *, first: bool) -> Loads:
    """Read the loads of a body at the end of a step; ``held`` has the sides prescribed before, and gets new ones."""
    if body.rigid:
        if names := list(table.names()):
            raise table.refuse(names[0], None, "a rigid body has no loads")
        return Loads()
    sides = SIDES.get(body.shape)
    sides = None if sides is None else sides + tuple(body.parts)
    prescribed = _by_side(table.table("prescribed"), sides, _components(dimension, free=True))
    for side, values in prescribed.items():
        refuse = lambda needed, side=side, values=values: table.refuse(f"prescribed.{side}", list(values), needed)
        if side in body.fixed:
            raise refuse(f"side {side!r} is fixed already")
        if not first and side not in held:
            raise refuse("needed a side that the body or the first step prescribes: supports stay through a history")
        if [v is None for v in held.setdefault(side, values)] != [v is None for v in values]:
            raise refuse('needed "free" where it was "free" before, only there: supports stay through a history')
    traction = _by_side(table.table("traction"), sides, _components(dimension, free=False))
    _check_tractions(table, traction, body.fixed, held)
    body_force = table.take("body_force", _components(dimension, free=False), None)
    table.close()
    return Loads(prescribed=prescribed, traction=traction, body_force=body_force)


def _check_tractions(
    table: TomlTable, traction: Mapping[str, Components], fixed: tuple[str, ...], prescribed: Mapping[str, Components]
) -> None:
    """Refuse a force on a component that a side holds."""
    for name, force in traction.items():
        held = prescribed.get(name, (None,) * len(force)) if name not in fixed else (Fraction(0),) * len(force)
        if any(t != 0 and h is not None for t, h in zip(force, held, strict=True)):
            needed = "this component of the side is held: a force there is lost"
            raise table.refuse(f"traction.{name}", list(force), needed)


def factor(value: Any) -> Theta:
    """Read theta, or "auto"."""
    try:
        return read_theta(value)
    except HypothesisError as error:
        raise Unfit(f"needed {error.needed}") from None


coefficient = number(
    f"a number >= 0, at most {float(MOST_FRICTION):g}", lambda v: 0 <= v <= MOST_FRICTION, least=LEAST_FRICTION
)
tolerance = number("a number with 0 < tolerance < 1", lambda v: 0 < v < 1)
at_least_one = integer("a whole number >= 1", 1)


def _read_iteration(table: TomlTable, neumann_body: Literal[1, 2]) -> IterationSpec:
    relaxation: str = table.take("relaxation", choice(*RULES), "constant")
    spec = IterationSpec(
        neumann_body=neumann_body,
        theta=table.take("theta", factor, Fraction(1, 2) if takes_theta(relaxation) else "auto"),
        relaxation=relaxation,
        tolerance=float(table.take("tolerance", tolerance, Fraction(1, 10**9))),
        max_iterations=table.take("max_iterations", at_least_one, 500),
    )
    table.close()
    return spec

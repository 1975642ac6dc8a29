"""Readers of the keys of a problem file, beyond those of single values: vectors, values by name, positions."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal, TypeVar

from ndtheory import HypothesisError, relaxation_factor
from verification.problem.entries import At
from verification.problem.tables import NO_UNIT, TomlTable, Unfit, choice, integer, label, number, several, text
from verification.registry import RULES

V = TypeVar("V")

#: A displacement or a force by component; None leaves a displacement component free.
Components = tuple[Fraction | None, ...]

#: A relaxation factor, or ``auto`` for the one that the theory chooses.
Theta = Fraction | Literal["auto"]

#: The sides of a shape; a mesh file names its own, which are known only later.
SIDES = {"rectangle": ("left", "right", "bottom", "top"), "interval": ("left", "right")}

#: Least coefficient of friction but 0: the theorem as printed allows 1e-44 and less for steel in Pa.  Smaller ones
#: would lead to a kappa_1 or kappa_2 that is refused.
LEAST_FRICTION = Fraction(1, 10**70)

#: Largest coefficient of friction: all contact sticks already, and larger ones would only overflow.
MOST_FRICTION = Fraction(10**9)


coefficient = number(
    f"a number >= 0, at most {float(MOST_FRICTION):g}", lambda v: 0 <= v <= MOST_FRICTION, least=LEAST_FRICTION
)
tolerance = number("a number with 0 < tolerance < 1", lambda v: 0 < v < 1)
at_least_one = integer("a whole number >= 1", 1)


def takes_theta(relaxation: Any) -> bool:
    """Return True if the rule of that name uses a given theta; names of no rule are refused elsewhere."""
    rule = RULES.get(relaxation) if isinstance(relaxation, str) else None
    return rule is None or rule.takes_theta


def read_theta(value: Any) -> Theta:
    """Read a relaxation factor, or "auto"; HypothesisError for anything else."""
    if isinstance(value, str) and value == "auto":
        return "auto"
    try:
        return relaxation_factor(value)
    except HypothesisError as error:
        raise HypothesisError(error.key, error.value, f'{error.needed}, or "auto"') from None


def factor(value: Any) -> Theta:
    """Read theta, or "auto"."""
    try:
        return read_theta(value)
    except HypothesisError as error:
        raise Unfit(f"needed {error.needed}") from None


def plane(value: Any) -> Any:
    """Read the name of a plane model."""
    if value == "axisymmetric":
        raise Unfit('bodies of revolution have other matrices and no proofs here; needed "strain" or "stress"')
    return choice("strain", "stress")(value)


_strain = number("a number with -1 < nu < 0.5", lambda v: -1 < v < Fraction(1, 2))
_stress = number("a number with -0.5 < nu <= 0.5 in plane stress", lambda v: -Fraction(1, 2) < v <= Fraction(1, 2))


def poisson(at: At) -> Callable[[Any], Fraction]:
    """Return a reader of Poisson's ratio: in plane stress the body of plane strain must be one as well."""
    return _strain if at["plane"] == "strain" else _stress


def sha256(value: object) -> str:
    """Read a SHA-256 in hexadecimal digits."""
    given = text(value)
    if not re.fullmatch("[0-9a-f]{64}", given):
        raise Unfit("needed the SHA-256 of the mesh file, 64 hexadecimal digits")
    return given


def listed(read: Callable[[Any], Fraction]) -> Callable[[Any], tuple[Fraction, ...]]:
    """Return a reader of a list of two numbers or more."""

    def read_all(value: Any) -> tuple[Fraction, ...]:
        if not isinstance(value, list) or len(value) < 2:
            raise Unfit("needed a list of two numbers or more")
        return tuple(map(read, value))

    return read_all


def positions(value: Any) -> tuple[Fraction, ...]:
    """Read distances along Gamma_c, which begins at 0."""
    s = listed(number("increasing numbers, the first one at most 0"))(value)
    if s[0] > 0 or not all(float(a) < float(b) for a, b in pairwise(s)):
        raise Unfit("needed increasing numbers, the first one at most 0")
    return s


def vector(value: Any, at: At, *, free: bool = False) -> Components:
    """Read a vector by components; in 1D a bare number too."""
    dimension, plain = at["dimension"], number()
    one = lambda given: None if free and given == "free" else plain(given)
    needed = "a number" if dimension == 1 else "two numbers, along x and y"
    if free:
        needed += ' ("free" leaves a component free)'
    given = [value] if dimension == 1 and not isinstance(value, (list, tuple)) else value
    try:
        return several(one, dimension, needed)(given)
    except Unfit as error:
        raise Unfit(f"needed {needed}" + NO_UNIT * str(error).endswith(NO_UNIT)) from None


def names(table: TomlTable) -> Iterator[str]:
    """Yield the keys of a table, each of which must be a name that a file can hold."""
    for name in table.names():
        try:
            yield label(name)
        except Unfit as error:
            raise table.refuse(str(name), None, str(error)) from None


def sides(at: At) -> tuple[str, ...] | None:
    """Return the names of the sides of a body and of their parts; None where a mesh file has them."""
    known = SIDES.get(at["shape"])
    return None if known is None else known + tuple(at["parts"])


def by_side(value: Any, at: At, *, free: bool = False) -> dict[str, Components]:
    """Read vectors by the names of sides."""
    table, known, result = at.inside(value), sides(at), {}
    for name in names(table):
        if known is not None and name not in known:
            raise table.refuse(name, None, "unknown side; known here: " + ", ".join(known))
        result[name] = table.take(name, lambda given: vector(given, at, free=free))
    return result


def place(value: Any, at: At) -> tuple[Fraction, ...]:
    """Read a point, as it is drawn."""
    found: tuple[Any, ...] = vector(value, at)
    return found


def by_name(value: Any, at: At) -> dict[str, tuple[Fraction, ...]]:
    """Read points by their names."""
    table = at.inside(value)
    return {name: table.take(name, lambda given: place(given, at)) for name in names(table)}


def polyline(value: Any, at: At) -> tuple[tuple[Fraction, ...], ...]:
    """Read the points of a line, each with two coordinates, of which neighbours differ."""
    if not isinstance(value, list) or len(value) < 2:
        raise Unfit("needed a list of two points or more, as [[0.0, 0.0], [1.0, 0.2]]")
    found = tuple(place(point, at) for point in value)
    if any(list(map(float, one)) == list(map(float, other)) for one, other in pairwise(found)):
        raise Unfit("needed points that differ from the one before")
    return found


def forces_at(value: Any, at: At) -> dict[tuple[Fraction, ...], Components]:
    """Read forces by the points at which they act, in tables of both."""
    needed = "needed a list of tables, as [{ at = [1.0, 0.3], force = [0.0, -60.0] }]"
    found: dict[tuple[Fraction, ...], Components] = {}
    for table in tables_of(at.table, at.name, needed)(value):
        point = table.take("at", lambda given: place(given, at))
        if point in found:
            raise table.refuse("at", list(point), "needed one force for each point")
        found[point] = table.take("force", lambda given: vector(given, at))
        table.close()
    return found


def by_surface(value: Any, at: At, read: Callable[[Any], Fraction]) -> Any:
    """Read a number, or a table of them by the named surfaces of a mesh file."""
    if not isinstance(value, Mapping) or not value:
        return read(value)
    if at["mesh"] is None:
        raise Unfit("needed a number: only a mesh file has named surfaces")
    table = at.inside(value)
    return {surface: table.take(surface, read) for surface in names(table)}


def side_list(value: Any, at: At) -> tuple[str, ...]:
    """Read a list of sides."""
    if not _all_are(str, value):
        raise Unfit('needed a list of side names, as ["bottom"]')
    known = sides(at)
    for name in value:
        label(name)
        if known is not None and name not in known:
            raise Unfit(f"unknown side {name!r}; known here: {', '.join(known)}")
    if len(set(value)) < len(value):
        raise Unfit("needed each side once")
    return tuple(value)


def groups(value: Any) -> tuple[str, ...]:
    """Read the name of a group of cells, or a list of some."""
    names = [value] if isinstance(value, str) else value
    if not names or not _all_are(str, names):
        raise Unfit('needed a name of a surface in quotes, or a list of some, as ["left", "wing"]')
    if len(set(names)) < len(names):
        raise Unfit("needed each surface once")
    return tuple(map(label, names))


def two_bodies(value: Any, at: At) -> tuple[int, int]:
    """Read the numbers of two bodies that touch each other."""
    needed = f"two different numbers of bodies, of {', '.join(map(str, at['numbers']))}"
    one, other = several(choice(*at["numbers"]), 2, needed)(value)
    if one == other:
        raise Unfit(f"needed {needed}")
    return one, other


def roles(value: Any, at: At) -> tuple[int, ...]:
    """Read the bodies with the Neumann problem: of each contact exactly one."""
    if not isinstance(value, list) or len(set(map(str, value))) < len(value):
        raise Unfit("needed a list of different numbers of bodies, as [1, 3]")
    chosen = {choice(*at["numbers"])(i) for i in value}
    for one, other in at["touching"]:
        if (one in chosen) == (other in chosen):
            count = "both" if one in chosen else "none"
            raise Unfit(f"needed one of the two bodies of each contact, not {count} of {one} and {other}")
    return tuple(sorted(chosen))


def _all_are(kind: type, value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(each, kind) for each in value)


def tables_of(top: TomlTable, name: str, needed: str = "") -> Callable[[Any], list[TomlTable]]:
    """Return a reader of an array of tables."""

    def read(value: Any) -> list[TomlTable]:
        if not _all_are(Mapping, value):
            raise Unfit(needed or f"needed tables, each as [[{name}]]")
        return [top.within(f"{name}[{i}]", each) for i, each in enumerate(value, 1)]

    return read

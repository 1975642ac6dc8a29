"""A problem: two bodies, their contact, the iteration and the norm, read from TOML or a dictionary and validated."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from ndtheory import HypothesisError, relaxation_factor
from verification.problem.tables import (
    ProblemError,
    Table,
    Unfit,
    choice,
    ends,
    integer,
    non_negative,
    number,
    positive,
    several,
    text,
    unreadable,
)

#: A displacement or a force by component; None leaves a displacement component free.
Components = tuple[Fraction | None, ...]

#: A relaxation factor, or the one that theory chooses.
Theta = Fraction | Literal["auto"]

Relaxation = Literal["constant", "aitken", "anderson", "newton", "momentum"]
RELAXATIONS: tuple[Relaxation, ...] = ("constant", "aitken", "anderson", "newton", "momentum")

RECTANGLE_SIDES = ("left", "right", "bottom", "top")
INTERVAL_SIDES = ("left", "right")

#: Largest number of cells of a body; a typing error should not fill the memory.
MOST_CELLS = 250_000

#: Largest ratio of the two moduli: at 1e60 the bounds of Section 5, with high powers of M C_R / m, overflow a double.
MOST_CONTRAST = Fraction(10**30)

#: Largest coefficient of friction; larger ones differ from it by nothing but overflow, as all contact sticks.
MOST_FRICTION = Fraction(10**9)

#: Largest size of a problem file.
MOST_BYTES = 1_000_000


@dataclass(frozen=True, kw_only=True)
class BodySpec:
    """A body as the problem file describes it; lengths and stresses in the file's units.

    Attributes
    ----------
    shape : {'rectangle', 'interval', 'mesh', 'rigid'}
        A rigid body is an obstacle: of the rest it has x and y at most.
    x, y : pair of Fraction or None
    cells : tuple of int or None
    mesh : Path or None
    young, poisson : Fraction
        E in stress; Poisson's ratio is 0 for a bar.  Both 0 where rigid.
    fixed : tuple of str
    prescribed, traction : mapping from side to components
        Displacement (length; None: free) and force per area (stress).
    body_force : tuple of Fraction
        Force per volume.
    """

    shape: Literal["rectangle", "interval", "mesh", "rigid"]
    x: tuple[Fraction, Fraction] | None = None
    y: tuple[Fraction, Fraction] | None = None
    cells: tuple[int, ...] | None = None
    mesh: Path | None = None
    young: Fraction = Fraction(0)
    poisson: Fraction = Fraction(0)
    fixed: tuple[str, ...] = ()
    prescribed: Mapping[str, Components] = field(default_factory=dict)
    traction: Mapping[str, tuple[Fraction, ...]] = field(default_factory=dict)
    body_force: tuple[Fraction, ...] = ()

    @property
    def rigid(self) -> bool:
        """Whether the body is an obstacle."""
        return self.shape == "rigid"


@dataclass(frozen=True, kw_only=True)
class ContactSpec:
    """Gamma_c, the friction law and the initial distance.

    Attributes
    ----------
    interval : pair of Fraction or None
        Ends of Gamma_c along x; None: the overlap of the two surfaces.
    friction : Fraction
        k, constant along Gamma_c.
    law : {'nonlocal', 'local'}
    radius : Fraction or None
        Radius r of the hat kernel (length); None with the local law or without friction.
    gap : Fraction
        Initial distance (length).
    """

    interval: tuple[Fraction, Fraction] | None
    friction: Fraction
    law: Literal["nonlocal", "local"]
    radius: Fraction | None
    gap: Fraction


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a run goes: its relaxation and when it ends.

    Attributes
    ----------
    theta : Fraction or 'auto'
        ``auto``: the proved theta; the predicted one where nothing is proved or the proved one is more than twice as
        slow.  Momentum takes its step from rho: ``auto`` unless the file has a theta, which is then not used.
    relaxation : {'constant', 'aitken', 'anderson', 'newton', 'momentum'}
        Beside ``constant`` outside the theorem; see :mod:`verification.algorithm.relaxation`.
    tolerance : float
        The run ends when ``|||T g - g||| <= tolerance |||T g|||`` in the norm (5.21), with the largest T g so far.
    max_iterations : int
    """

    theta: Theta = Fraction(1, 2)
    relaxation: Relaxation = "constant"
    tolerance: float = 1e-9
    max_iterations: int = 500

    @property
    def warnings(self) -> list[str]:
        """What is set and has no effect."""
        if self.relaxation != "momentum" or self.theta == "auto":
            return []
        return [f"iteration.theta = {float(self.theta):g} is not used: momentum takes its step from rho"]


@dataclass(frozen=True, kw_only=True)
class IterationSpec(Settings):
    """The table ``[iteration]``.

    Attributes
    ----------
    neumann_body : {1, 2}
        Who gets the linear problem of step I: 2 as in Section 3, 1 as in Section 6.
    """

    neumann_body: Literal[1, 2] = 2

    @property
    def settings(self) -> Settings:
        """The table without the roles."""
        return Settings(**{field.name: getattr(self, field.name) for field in fields(Settings)})


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A validated problem; see the problem file in the documentation.

    Attributes
    ----------
    source : str
        The file it came from, or ``<dict>``; errors name it.
    units : mapping
        Labels ``length`` and ``stress``.
    length : Fraction
        L of the norm ``|v|^2/L^2 + |grad v|^2``.

    Examples
    --------
    >>> bars = Problem.from_dict({
    ...     "dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": "-1/10"}},
    ... })
    >>> bars.iteration.neumann_body, bars.body2.prescribed["right"]
    (2, (Fraction(-1, 10),))
    """

    title: str
    dimension: Literal[1, 2]
    units: Mapping[str, str]
    body1: BodySpec
    body2: BodySpec
    contact: ContactSpec
    iteration: IterationSpec
    length: Fraction
    source: str = "<dict>"

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], source: str = "<dict>") -> Problem:
        """Validate a nested dictionary with the keys of the problem file.

        Raises
        ------
        ProblemError
            Naming source, key, value received and what is needed.
        """
        if not isinstance(data, Mapping):
            raise ProblemError(source, "", None, f"needed a table of keys, received {type(data).__name__}")
        return _read_problem(Table(data, source), source)

    def with_theta(self, theta: Any) -> Problem:
        """The same problem at another theta.

        Raises
        ------
        HypothesisError
            Unless 0 < theta < 1 or "auto".
        """
        return replace(self, iteration=replace(self.iteration, theta=read_theta(theta)))

    def swapped(self) -> Problem:
        """The same problem with the Neumann problem given to the other body."""
        other: Literal[1, 2] = 1 if self.iteration.neumann_body == 2 else 2
        return replace(self, iteration=replace(self.iteration, neumann_body=other))

    def refined(self, halvings: int) -> Problem:
        """The same problem on a mesh halved ``halvings`` times.

        Raises
        ------
        ProblemError
            A body given by a mesh file cannot be halved.
        """

        def halved(name: str, body: BodySpec) -> BodySpec:
            if not halvings:
                return body
            if body.rigid:
                return body
            if body.cells is None:
                raise ProblemError(
                    self.source, f"{name}.mesh", body.mesh.name if body.mesh else None, "a mesh file cannot be halved"
                )
            cells = tuple(n * 2**halvings for n in body.cells)
            if math.prod(cells) > MOST_CELLS:
                needed = f"needed at most {MOST_CELLS} cells after {halvings} halvings"
                raise ProblemError(self.source, f"{name}.cells", list(cells), needed)
            return replace(body, cells=cells)

        if not isinstance(halvings, int) or halvings < 0:  # type: ignore[redundant-expr]  # a caller need not be typed
            raise ValueError(f"{halvings} halvings: a whole number >= 0 is needed")
        return replace(self, body1=halved("body1", self.body1), body2=halved("body2", self.body2))


def read_theta(value: Any) -> Theta:
    """A relaxation factor, or "auto".

    Raises
    ------
    HypothesisError
    """
    if value == "auto":
        return "auto"
    try:
        return relaxation_factor(value)
    except HypothesisError as error:
        raise HypothesisError(error.key, error.value, f'{error.needed}, or "auto"') from None


def load(path: Path | str) -> Problem:
    """Read a problem file; decimals are read exactly.

    Raises
    ------
    ProblemError
        Not a file, not readable, not TOML, or a value that does not fit.
    """
    path = Path(path)
    name = str(path)
    why = unreadable(path, MOST_BYTES)
    if why:
        raise ProblemError(name, "", None, why)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ProblemError(name, "", None, f"cannot be read: {error.strerror}") from None
    if not content.strip():
        raise ProblemError(name, "", None, "the file is empty; `ndtheory example` prints one to start from")
    try:
        data = tomllib.loads(content.decode("utf-8-sig"), parse_float=Decimal)
    except UnicodeDecodeError:
        raise ProblemError(name, "", None, "a TOML text file is needed, this is not UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError, ArithmeticError, ValueError) as error:
        raise ProblemError(
            name, "", None, f"not TOML: {' '.join(str(error).split()) or type(error).__name__}"
        ) from None
    return _read_problem(Table(data, name), name)


def _read_problem(top: Table, source: str) -> Problem:
    dimension: Literal[1, 2] = top.take("dimension", choice(1, 2), 2)
    title = top.take("title", text, "untitled")
    units = top.table("units")
    labels = {name: units.take(name, text, default) for name, default in (("length", "mm"), ("stress", "MPa"))}
    units.close()
    body1 = _read_body(top.table("body1", required=True), dimension, source)
    body2 = _read_body(top.table("body2", required=True), dimension, source)
    if body1.rigid and body2.rigid:
        raise top.refuse("body2.shape", "rigid", "needed at least one elastic body")
    if not (body1.rigid or body2.rigid or 1 / MOST_CONTRAST <= body1.young / body2.young <= MOST_CONTRAST):
        needed = f"needed a modulus within {float(MOST_CONTRAST):g} times that of body1, {float(body1.young):g}"
        raise top.refuse("body2.young", body2.young, f'{needed}; for `solve`, shape = "rigid" makes an obstacle')
    contact = _read_contact(top.table("contact"), dimension)
    iteration = _read_iteration(top.table("iteration"))
    norm = top.table("norm")
    length = norm.take("length", positive, Fraction(1))
    norm.close()
    top.close()
    return Problem(
        title=title,
        dimension=dimension,
        units=labels,
        body1=body1,
        body2=body2,
        contact=contact,
        iteration=iteration,
        length=length,
        source=source,
    )


def _read_shape(table: Table, dimension: int, source: str) -> dict[str, Any]:
    """The geometry of a body: a mesh file, or a shape with its cells."""
    count = integer("a whole number >= 1", 1)
    if "mesh" in table:
        if dimension == 1:
            raise table.refuse("mesh", None, "in one dimension a body is an interval")
        for name in ("shape", "x", "y", "cells"):
            if name in table:
                raise table.refuse(name, None, "needed either mesh or shape, x, y and cells, not both")
        path = Path(table.take("mesh", text))
        folder = Path(source).parent if source != "<dict>" else Path()
        return {"shape": "mesh", "mesh": path if path.is_absolute() else folder / path}
    natural = "interval" if dimension == 1 else "rectangle"
    shape = table.take("shape", choice(natural, "rigid"))
    if shape == "rigid":
        read_rigid = {"x": table.take("x", ends, None)}
        if dimension == 2:
            read_rigid["y"] = table.take("y", ends, None)
        return {"shape": shape, **read_rigid}
    if dimension == 1:
        read: dict[str, Any] = {"x": table.take("x", ends), "cells": (table.take("cells", count),)}
    else:
        pair = several(count, 2, "two whole numbers >= 1, along x and y")
        read = {"x": table.take("x", ends), "y": table.take("y", ends), "cells": table.take("cells", pair)}
    if math.prod(read["cells"]) > MOST_CELLS:
        raise table.refuse("cells", list(read["cells"]), f"needed at most {MOST_CELLS} cells")
    return {"shape": shape, **read}


def _components(dimension: int, *, free: bool) -> Any:
    """Read a vector by components; in 1D a bare number will do."""
    plain = number()

    def one(value: Any) -> Fraction | None:
        if free and value == "free":
            return None
        return plain(value)

    needed = "a number" if dimension == 1 else "two numbers, along x and y"
    if free:
        needed += ' ("free" leaves a component free)'

    def read(value: Any) -> Components:
        listed = [value] if dimension == 1 and not isinstance(value, (list, tuple)) else value
        try:
            return several(one, dimension, needed)(listed)
        except Unfit:
            raise Unfit(f"needed {needed}") from None

    return read


def _by_side(table: Table, sides: tuple[str, ...] | None, read: Any) -> Mapping[str, Any]:
    """Read a sub-table keyed by side names; the sides of a mesh file are known only later."""
    result = {}
    for name in table.names():
        if sides is not None and name not in sides:
            raise table.refuse(name, None, "unknown side; known here: " + ", ".join(sides))
        result[name] = table.take(name, read)
    return result


def _read_body(table: Table, dimension: int, source: str) -> BodySpec:
    shape = _read_shape(table, dimension, source)
    if shape["shape"] == "rigid":
        table.close()
        return BodySpec(**shape)
    sides = {"rectangle": RECTANGLE_SIDES, "interval": INTERVAL_SIDES, "mesh": None}[shape["shape"]]

    def side_list(value: Any) -> tuple[str, ...]:
        if not isinstance(value, (list, tuple)) or not all(isinstance(name, str) for name in value):
            raise Unfit('needed a list of side names, as ["bottom"]')
        for name in value:
            if sides is not None and name not in sides:
                raise Unfit(f"unknown side {name!r}; known here: {', '.join(sides)}")
        if len(set(value)) < len(value):
            raise Unfit("needed each side once")
        return tuple(value)

    young = table.take("young", positive)
    if dimension == 2:
        poisson = table.take("poisson", number("a number with -1 < nu < 0.5", lambda v: -1 < v < Fraction(1, 2)))
    else:
        if "poisson" in table:
            raise table.refuse("poisson", None, "a bar has no Poisson ratio; leave it out in one dimension")
        poisson = Fraction(0)
    fixed = table.take("fixed", side_list, ())
    prescribed = _by_side(table.table("prescribed"), sides, _components(dimension, free=True))
    for name in fixed:
        if name in prescribed:
            raise table.refuse(f"prescribed.{name}", list(prescribed[name]), f"side {name!r} is fixed already")
    traction = _by_side(table.table("traction"), sides, _components(dimension, free=False))
    for name, force in traction.items():
        held = prescribed.get(name, (None,) * dimension) if name not in fixed else (Fraction(0),) * dimension
        if any(t != 0 and h is not None for t, h in zip(force, held, strict=True)):
            raise table.refuse(
                f"traction.{name}", list(force), "this component of the side is held: a force there is lost"
            )
    body_force = table.take("body_force", _components(dimension, free=False), (Fraction(0),) * dimension)
    table.close()
    return BodySpec(
        **shape,
        young=young,
        poisson=poisson,
        fixed=fixed,
        prescribed=prescribed,
        traction=traction,
        body_force=body_force,
    )


def _read_contact(table: Table, dimension: int) -> ContactSpec:
    coefficient = number(f"a number >= 0, at most {float(MOST_FRICTION):g}", lambda v: 0 <= v <= MOST_FRICTION)
    friction = table.take("friction", coefficient, Fraction(0))
    law = table.take("law", choice("nonlocal", "local"), "nonlocal")
    radius = table.take("radius", positive, None)
    interval = table.take("interval", ends, None)
    gap = table.take("gap", non_negative, Fraction(0))
    table.close()
    if dimension == 1:
        if friction:
            raise table.refuse("friction", friction, "needed 0: two bars have no friction")
        if interval:
            raise table.refuse("interval", list(interval), "two bars meet at a point; leave it out in one dimension")
    elif friction and law == "nonlocal" and radius is None:
        raise table.refuse(
            "radius", None, 'this key is missing; the non-local law needs the radius of its kernel (or law = "local")'
        )
    return ContactSpec(interval=interval, friction=friction, law=law, radius=radius, gap=gap)


def _read_iteration(table: Table) -> IterationSpec:
    def theta(value: Any) -> Theta:
        try:
            return read_theta(value)
        except HypothesisError as error:
            raise Unfit(f"needed {error.needed}") from None

    relaxation: Relaxation = table.take("relaxation", choice(*RELAXATIONS), "constant")
    spec = IterationSpec(
        neumann_body=table.take("neumann_body", choice(1, 2), 2),
        theta=table.take("theta", theta, "auto" if relaxation == "momentum" else Fraction(1, 2)),
        relaxation=relaxation,
        tolerance=float(
            table.take("tolerance", number("a number with 0 < tolerance < 1", lambda v: 0 < v < 1), Fraction(1, 10**9))
        ),
        max_iterations=table.take("max_iterations", integer("a whole number >= 1", 1), 500),
    )
    table.close()
    return spec

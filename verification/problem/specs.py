"""The tables of a problem file: two bodies, their contacts, the iteration and the norm, each key said once."""

from __future__ import annotations

import hashlib
import math
from bisect import bisect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, Self

from ndtheory.keys import Key, Part, key, says
from ndtheory.moduli import Moduli
from verification.problem import readers
from verification.problem.entries import EMPTY, REQUIRED, At, Entries, ReadOnly, Spread, entry, read_table
from verification.problem.readers import SIDES, Components, Theta
from verification.problem.tables import (
    ProblemError,
    Unfit,
    choice,
    ends,
    label,
    non_negative,
    positive,
    several,
    text,
    unreadable,
)
from verification.registry import LAWS, RULES

#: Where the bodies of a file are.
PLACES = {1: "lower", 2: "upper"}

#: Largest size of a mesh file: several times the size of the largest mesh as text.
MOST_MESH_BYTES = 200_000_000

#: Largest number of cells of a body, so that a typing error does not fill the memory.
MOST_CELLS = 250_000

#: Largest number of increments of a loading history, all of whose results are kept.
MOST_INCREMENTS = 2000

#: The order of keys that come last in a table.
LAST = 10**6

#: Two numbers [a, b], a < b.
Ends = tuple[Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class MeshFile(Part):
    """A mesh file as it was when the problem was read."""

    path: Path = key("absolute, so that it means the same file wherever the process or the problem goes")
    sha256: str = key("of the content, in hexadecimal digits")

    @classmethod
    def read(cls, path: Path, sha256: str | None = None) -> MeshFile:
        """Return the file at a path.

        Raises
        ------
        Unfit
            Not a file, too large, or with another SHA-256 than the one given.
        """
        file = cls(path=path.absolute(), sha256=sha256 or _fingerprint(path))
        if sha256 and (why := file.unusable()):
            raise Unfit(why)
        return file

    def unusable(self) -> str | None:
        """Return why the file is not the one that was read, or None where it is."""
        try:
            found = _fingerprint(self.path)
        except Unfit as error:
            return str(error)
        if found == self.sha256:
            return None
        return f"its content has changed: needed the file with sha256 {self.sha256}, this one has {found}"


def _fingerprint(path: Path) -> str:
    if why := unreadable(path, MOST_MESH_BYTES):
        raise Unfit(why)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise Unfit(f"cannot be read: {error.strerror}") from None


def _mesh(value: Any, at: At) -> MeshFile:
    """Read a mesh file: its name, its name and the SHA-256 it must have, or one that was read before."""
    if isinstance(value, MeshFile):
        return value
    digest = None
    if isinstance(value, Mapping):
        inside = at.inside(value)
        value, digest = inside.take("path", text), inside.take("sha256", readers.sha256)
        inside.close()
    path = (Path() if at["source"] == "<dict>" else Path(at["source"]).parent) / text(value)
    try:
        return MeshFile.read(path, digest)
    except Unfit as error:
        raise at.table.refuse("mesh", path, str(error)) from None


_ONE = "needed the ends of a part along x or along y, received both"


@dataclass(frozen=True, kw_only=True)
class SidePart(Entries):
    """A part of a side of a body: the side's edges between two positions along an axis (unit of length)."""

    side: str = entry(
        "the side to which a named part belongs",
        reader=lambda value, at: (label if at["sides"] is None else choice(*at["sides"]))(value),
    )
    x: Ends | None = entry(
        "its ends along x", ends, unit="length", initial=None, only=lambda at: "y" not in at.table or _ONE
    )
    y: Ends | None = entry("its ends along y", ends, unit="length", initial=None, only=lambda at: "y" in at.table)

    @property
    def axis(self) -> Literal["x", "y"]:
        """The axis along which it has ends."""
        return "y" if self.x is None else "x"

    @property
    def ends(self) -> Ends:
        """Its ends along that axis."""
        found = self.x or self.y
        assert found is not None
        return found


def _parts(value: Any, at: At) -> dict[str, SidePart]:
    """Read parts of sides, each with its own name."""
    table, known, parts = at.inside(value), SIDES.get(at["shape"]), {}
    for name in readers.names(table):
        if at["dimension"] == 1:
            raise table.refuse(name, None, "the side of a bar is a point: it has no parts")
        if known is not None and name in known:
            raise table.refuse(name, None, "needed a name that no side has; known here: " + ", ".join(known))
        parts[name] = read_table(SidePart, table.table(name, required=True), sides=known)
    return parts


#: Points on an arc of 360 degrees: a smooth curve through them is within 1e-8 radii of the circle.
ON_CIRCLE = 360


@dataclass(frozen=True, kw_only=True)
class Arc(Entries):
    """A part of a circle."""

    centre: tuple[Fraction, ...] = entry("its centre", unit="length", reader=readers.place, type="vector")
    radius: Fraction = entry("its radius", positive, unit="length")
    arc: tuple[Fraction, Fraction] = entry(
        "its ends in degrees, anticlockwise from the direction of x", ends, (Fraction(0), Fraction(360)), "degree"
    )

    @property
    def points(self) -> list[tuple[float, float]]:
        """Points on it, from one end to the other; a whole circle ends where it begins."""
        low, high = map(float, self.arc)
        turn = min(high - low, 360.0)
        count = max(8, math.ceil(ON_CIRCLE * turn / 360))
        turns = [math.radians(low + turn * i / count) for i in range(count + 1)]
        x, y = map(float, self.centre)
        found = [(x + float(self.radius) * math.cos(a), y + float(self.radius) * math.sin(a)) for a in turns]
        return [*found[:-1], found[0]] if turn == 360 else found


_elastic = lambda at: at["shape"] != "rigid"
_drawn_rigid = lambda at: not _elastic(at) and at["dimension"] == 2
#: What the loads have in common: none of a rigid body, and they come last in a table.
_LOAD: dict[str, Any] = {"only": _elastic, "order": LAST}
_ON_SIDES: dict[str, Any] = {**_LOAD, "default": EMPTY, "initial": ReadOnly(), "type": "map of vector"}


@dataclass(frozen=True, kw_only=True)
class Loads(Entries):
    """Loads of a body, or those that a step of a loading history names: without a body force it keeps its value."""

    prescribed: Mapping[str, Components] = entry(
        'sides with a given displacement, such as `{ top = [0.0, -0.015] }`; `"free"` leaves a component free',
        unit="length",
        reader=lambda value, at: readers.by_side(value, at, free=True),
        **_ON_SIDES,
    )
    traction: Mapping[str, tuple[Fraction, ...]] = entry(
        "force per area on sides, such as `{ right = [0.0, -60.0] }`",
        unit="stress",
        reader=readers.by_side,
        **_ON_SIDES,
    )
    body_force: tuple[Fraction, ...] = entry(
        "force per volume, such as `[0.0, -1.0]`",
        None,
        lambda at: at["kept"],
        "stress/length",
        reader=readers.vector,
        initial=(),
        type="vector",
        **_LOAD,
    )
    point_load: Mapping[tuple[Fraction, ...], tuple[Fraction, ...]] = entry(
        "forces at points, such as `[{ at = [1.0, 0.3], force = [0.0, -60.0] }]`: each acts on the nearest node of the"
        " body, at most half an edge away",
        unit="stress · length",
        reader=readers.forces_at,
        default=ReadOnly(),
        write=lambda loads: tuple({"at": point, "force": force} for point, force in loads.point_load.items()),
        type="list of object",
        inside={
            "at": Key(says="the point, before deformation", unit="length", type="vector"),
            "force": Key(says="its force per unit thickness", unit="stress · length", type="vector"),
        },
        **_LOAD,
    )


_nothing = lambda value: None
_drawn = lambda at: "mesh" not in at.table
_needed = lambda at: REQUIRED if _elastic(at) else None
_of_surfaces = lambda body, i: {name: moduli[i] for name, moduli in body.materials.items()}
_NO_POISSON = "a bar has no Poisson ratio; leave it out in one dimension"


def _cells(value: Any, at: At) -> tuple[int, ...]:
    """Read numbers of cells."""
    pair = several(readers.at_least_one, 2, "two whole numbers >= 1, along x and y")
    cells = pair(value) if at["dimension"] == 2 else (readers.at_least_one(value),)
    if math.prod(cells) > MOST_CELLS:
        raise Unfit(f"needed at most {MOST_CELLS} cells")
    return cells


@dataclass(frozen=True, kw_only=True)
class BodySpec(Loads):
    """A body as the problem file describes it; lengths and stresses in the file's units.

    Attributes
    ----------
    shape : {'rectangle', 'interval', 'mesh', 'rigid', 'union'}
        A rigid body is an obstacle: of the other attributes it has at most x and y, or line or circle, and side.  A
        union has only members, plane and the moduli, see :meth:`union`.
    young, poisson : Fraction
        E in stress; Poisson's ratio is 0 for a bar.  Both 0 where rigid, the largest ones of several materials.
    materials : read-only mapping from surface to pair of Fraction
        E and Poisson's ratio of each named surface of a mesh file; empty where the body is of one material.
    plane : {'strain', 'stress'}
        Plane strain or plane stress, the same for both bodies.
    members : tuple of pairs of a number and BodySpec
        The bodies of a union with their numbers in the file, in their order; empty for a single body.
    """

    part = "Body"

    shape: Literal["rectangle", "interval", "mesh", "rigid", "union"] = entry(
        '`"rectangle"`, in one dimension `"interval"`; `"rigid"` makes the body an obstacle. `solve` always'
        " accepts it; `run` only if it has the Neumann problem",
        reader=lambda value, at: choice("interval" if at["dimension"] == 1 else "rectangle", "rigid")(value),
        only=_drawn,
        initial="mesh",
        write=lambda body: None if body.mesh else body.shape,
        absent="with a mesh file",
    )
    x: Ends | None = entry(
        "ends `[a, b]`, a < b; an obstacle may have none", ends, _needed, "length", initial=None, only=_drawn
    )
    y: Ends | None = entry(
        "the ends in y", ends, _needed, "length", initial=None, only=lambda at: at["dimension"] == 2 and _drawn(at)
    )
    cells: tuple[int, ...] | None = entry(
        "`[along x, along y]`, in one dimension one number",
        reader=_cells,
        initial=None,
        only=lambda at: _elastic(at) and _drawn(at),
        write=lambda body: body.cells if body.shape == "rectangle" else body.cells and body.cells[0],
        type="free",
        unit="1",
    )
    split: Literal["alternating", "both"] = entry(
        "`both` diagonals split each cell of a rectangle into four triangles, which do not lock near "
        r"$\nu = 1/2$; or `alternating` ones",
        choice("alternating", "both"),
        "alternating",
        initial="alternating",
        only=lambda at: at["dimension"] == 2 and _elastic(at) and _drawn(at),
        write=lambda body: body.split if body.shape == "rectangle" else None,
        later=True,
        absent="with a mesh file, of an obstacle and in one dimension",
    )
    line: tuple[tuple[Fraction, ...], ...] = entry(
        "the face of an obstacle as a line through points, `[[0.0, 0.0], [1.0, 0.2]]`, instead of `x` and `y`",
        unit="length",
        reader=readers.polyline,
        default=(),
        only=_drawn_rigid,
        type="list of vector",
        absent="of other bodies",
    )
    circle: Arc | None = entry(
        "the face of an obstacle as an arc, `{ centre = [0.0, 1.0], radius = 1.0, arc = [240, 300] }`",
        reader=lambda value, at: read_table(Arc, at.inside(value), dimension=2),
        default=None,
        only=_drawn_rigid,
        absent="of other bodies",
    )
    side: str = entry(
        "the name of that face for `contact.surface`",
        label,
        "",
        only=_drawn_rigid,
        write=lambda body: body.side or None,
        absent="of other bodies",
    )
    mesh: MeshFile | None = entry(
        "a triangle mesh file instead of `shape`, `x`, `y` and `cells`; its sides are its named lines."
        ' `{ path = "..", sha256 = ".." }` refuses a file with another content',
        reader=_mesh,
        only=lambda at: "mesh" in at.table,
        initial=None,
        counts=lambda mesh: mesh and mesh.sha256,
    )
    group: tuple[str, ...] = entry(
        'the named surfaces (`Physical Surface` of Gmsh, element sets of Abaqus) that make this body, such as `"left"` '
        'or `["left", "wing"]`, where a mesh file holds several bodies',
        readers.groups,
        (),
        initial=(),
        only=lambda at: at["shape"] == "mesh",
        later=True,
        absent="without a mesh file",
    )
    young: Fraction = entry(
        "$E > 0$; with a mesh file also a table by its named surfaces",
        reader=lambda value, at: readers.by_surface(value, at, positive),
        initial=Fraction(0),
        only=_elastic,
        write=lambda body: _of_surfaces(body, 0) or body.young or None,
        type="free",
        unit="stress",
        absent="of an obstacle",
    )
    poisson: Fraction = entry(
        r"$-1 < \nu < 1/2$, in plane stress $-1/2 < \nu \le 1/2$; or a table like that of `young`",
        reader=lambda value, at: readers.by_surface(value, at, readers.poisson(at)),
        initial=Fraction(0),
        only=lambda at: _elastic(at) and (at["dimension"] == 2 or _NO_POISSON),
        write=lambda body: _of_surfaces(body, 1) or (body.poisson if body.shape in ("rectangle", "mesh") else None),
        type="free",
        unit="1",
        absent="of an obstacle and in one dimension",
    )
    parts: Mapping[str, SidePart] = entry(
        'parts of sides by name, such as `{ pressed = { side = "top", x = [0.0, 0.8] } }`: the edges of that side'
        " between two positions along x or y; `fixed`, `prescribed`, `traction` take the name",
        reader=_parts,
        default=EMPTY,
        initial=ReadOnly(),
        only=_elastic,
    )
    fixed: tuple[str, ...] = entry(
        'sides with $u = 0$, such as `["bottom"]`',
        reader=readers.side_list,
        default=(),
        only=_elastic,
        counts=lambda sides: tuple(sorted(sides)),
    )
    points: Mapping[str, tuple[Fraction, ...]] = entry(
        "points of the body, such as `{ tip = [0.0, 1.0] }`: `run`, `solve` and `march` give displacement and stress"
        " there",
        unit="length",
        reader=readers.by_name,
        default=EMPTY,
        initial=ReadOnly(),
        only=_elastic,
        counts=_nothing,
        type="map of vector",
    )
    plane: Literal["strain", "stress"] = "strain"
    materials: Mapping[str, tuple[Fraction, Fraction]] = ReadOnly()
    members: tuple[tuple[int, BodySpec], ...] = ()

    @classmethod
    def union(cls, members: Iterable[tuple[int, BodySpec]]) -> BodySpec:
        """Return bodies that have one role and do not touch each other as one body.

        Its surfaces are ``body3`` for the whole body 3 of the file, or ``body3.steel`` for one of its surfaces.
        """
        each = tuple(sorted(members, key=lambda member: member[0]))
        materials: dict[str, tuple[Fraction, Fraction]] = {}
        for i, body in each:
            materials |= {f"body{i}.{surface}": moduli for surface, moduli in body.materials.items()}
            materials |= {} if body.materials else {f"body{i}": (body.young, body.poisson)}
        young, poisson = map(max, zip(*materials.values(), strict=True))
        plane = each[0][1].plane
        moduli = {"young": young, "poisson": poisson, "materials": materials}
        return cls(shape="union", plane=plane, members=each, **moduli)

    @property
    def rigid(self) -> bool:
        """True if the body is an obstacle."""
        return self.shape == "rigid"

    @property
    def face(self) -> list[tuple[float, float]]:
        """Points of the line or the arc that an obstacle is, empty where it has none."""
        return self.circle.points if self.circle else [(float(x), float(y)) for x, y in self.line]

    @property
    def youngs(self) -> tuple[Fraction, ...]:
        """E, or the least and the largest one of several materials."""
        each = {E for E, _ in self.materials.values()} or {self.young}
        return (self.young,) if len(each) == 1 else (min(each), max(each))

    @property
    def moduli(self) -> Moduli:
        """Those of the body of plane strain with the same law in the plane."""
        E, nu = self.young, self.poisson
        if self.plane == "stress":
            E, nu = E * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu)
        return Moduli(young=E, poisson=nu)


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A coefficient of friction that varies along Gamma_c, over its largest value; linear between positions.

    Attributes
    ----------
    s : tuple of Fraction
        Distances from the left end of Gamma_c along the contact body's line, increasing, unit of length.
    share : tuple of Fraction
        ``k(s) / max k`` there, from 0 to 1.

    Examples
    --------
    >>> Profile(s=(Fraction(0), Fraction(2)), share=(Fraction(1), Fraction(1, 2))).at(Fraction(1))
    Fraction(3, 4)
    """

    s: tuple[Fraction, ...]
    share: tuple[Fraction, ...]

    @classmethod
    def of(cls, s: Iterable[Fraction], k: Iterable[Fraction]) -> tuple[Fraction, Profile | None]:
        """Return the largest k and the profile; None where k is 0."""
        values = tuple(k)
        largest = max(values)
        return largest, cls(s=tuple(s), share=tuple(v / largest for v in values)) if largest else None

    def at(self, s: Fraction) -> Fraction:
        """Return the share at a distance; beyond the ends, where only rounding leads, it is the last one."""
        i = min(max(bisect(self.s, s), 1), len(self.s) - 1)
        (low, high), (left, right) = self.share[i - 1 : i + 1], self.s[i - 1 : i + 1]
        return low + (high - low) * (min(max(s, left), right) - left) / (right - left)

    def mirrored(self, length: Fraction) -> Profile:
        """Return the profile over distances from the other end of a line of this length."""
        return Profile(s=tuple(length - s for s in self.s[::-1]), share=self.share[::-1])

    def table(self, k: Fraction) -> dict[str, tuple[Fraction, ...]]:
        """Return ``s`` and ``k`` as a problem file has them, for a largest k."""
        return {"s": self.s, "k": tuple(k * share for share in self.share)}


def _friction(value: Any, at: At) -> tuple[Fraction, Profile | None]:
    """Read a coefficient, or a table of it along Gamma_c: the largest one, and how it varies."""
    if not isinstance(value, Mapping) or not value:
        return readers.coefficient(value), None
    inside = at.inside(value)
    s, k = inside.take("s", readers.positions), inside.take("k", readers.listed(readers.coefficient))
    inside.close()
    if len(s) != len(k):
        raise inside.refuse("k", list(k), f"needed as many values as s has, {len(s)}")
    return Profile.of(s, k)


_SIDES = 'two names of sides, of body 1 and of body 2, as ["deck", "tip"]'


@dataclass(frozen=True, kw_only=True)
class ContactSpec(Entries):
    """A contact of two bodies: where they meet, the law of friction there, and the initial distance.

    Attributes
    ----------
    bodies : pair of int
        Their numbers in the file, in the order of ``surface``.
    friction : Fraction
        k, the largest one where it varies along the line.
    profile : Profile or None
        How k varies; None where it is constant.
    """

    part = "Contact table"

    bodies: tuple[int, int] = entry(
        "in tables `[[contact]]`: the numbers of two bodies",
        reader=readers.two_bodies,
        only=lambda at: at["several"],
        initial=(1, 2),
        absent="in a single table `[contact]`: they are 1 and 2",
    )
    interval: Ends | None = entry(
        r"$\Gamma_c$, part of the x axis between nodes (an end within a thousandth of an edge from a node is moved"
        " there); without it the overlap of the flat top and the flat bottom",
        ends,
        None,
        "length",
    )
    friction: Fraction = entry(
        r"the coefficient $0 \le k \le 10^9$, exactly; where it varies a table of `s` (length) and `k`",
        reader=_friction,
        default=(Fraction(0), None),
        initial=Fraction(0),
        shown="0",
        write=lambda contact: (
            contact.profile.table(contact.friction) if contact.profile and contact.friction else contact.friction
        ),
        type="free",
        unit="1",
    )
    law: str = entry(
        '`"nonlocal"`, or `"local"` (outside the theorem); `"local-contact"` is the local law with the pressure of the'
        " contact grid, Coulomb's law at each node; where the grids differ, only `solve` accepts it",
        lambda value: choice(*LAWS)(value),  # those that are registered at that moment
        "nonlocal",
    )
    radius: Fraction | None = entry(
        "radius $r$ of the hat kernel; needed by the non-local law with friction", positive, None, "length"
    )
    gap: Fraction = entry(
        r"$\ge 0$, added to the distance of the surfaces as they are drawn", non_negative, Fraction(0), "length"
    )
    surface: tuple[str, str] | None = entry(
        "instead of `interval`: the sides of the bodies that meet, lines of any shape", several(label, 2, _SIDES), None
    )
    profile: Profile | None = None

    @property
    def frictions(self) -> tuple[float, ...]:
        """k, or the least and the largest one where it varies."""
        shares = () if self.profile is None else (min(self.profile.share),)
        return tuple(float(self.friction * share) for share in (*shares, 1))


@dataclass(frozen=True, kw_only=True)
class Settings(Entries):
    """Settings of a run: its relaxation and when it ends; see the problem file."""

    theta: Theta = entry(
        r'relaxation factor, $0 < \theta < 1$; or `"auto"`: the proved theta, unless none is proved or it is predicted'
        " to need more than twice the steps of the predicted one. Not used by momentum",
        readers.factor,
        lambda at: Fraction(1, 2) if readers.takes_theta(at.table.get("relaxation")) else "auto",
        "1",
        initial=Fraction(1, 2),
        shown="1/2",
    )
    relaxation: str = entry(
        '`"constant"`, or outside the theorem `"aitken"`, `"anderson"`, `"iqn-ils"`, `"newton"`, `"momentum"` (proved'
        r" at $k = 0$; takes its step from $\rho$)",
        lambda value: choice(*RULES)(value),
        "constant",
    )
    tolerance: float = entry(
        r"the run ends when $\lvert\lvert\lvert Tg - g\rvert\rvert\rvert$ is at most this part of the larger of"
        r" $\lvert\lvert\lvert g\rvert\rvert\rvert$ and $\lvert\lvert\lvert Tg\rvert\rvert\rvert$, in a state"
        " of contact",
        lambda value: float(readers.tolerance(value)),
        1e-9,
        "1",
        type="exact",
    )
    max_iterations: int = entry(
        "the run ends after so many steps. The largest value is limited, because every iterate is kept and may fill"
        " 2 GB, which is 624,000 steps at 25 contact nodes",
        readers.at_least_one,
        500,
        "1",
    )


@dataclass(frozen=True, kw_only=True)
class IterationSpec(Settings):
    """The table ``[iteration]``: settings of a run, and who gets the linear problem of step I."""

    neumann_body: Literal[1, 2] = entry(
        "the {term}`Neumann body`, which gets the linear problem of step I: 2 as in Section 3, 1 as in Section 6",
        choice(1, 2),
        2,
        only=lambda at: not at["several"] or "needed neumann_bodies, a list of numbers, with tables [[contact]]",
        write=lambda iteration: None if iteration.neumann_bodies else iteration.neumann_body,
        type="integer",
        absent="with tables `[[contact]]`",
        order=-2,
    )
    neumann_bodies: tuple[int, ...] = entry(
        "with tables `[[contact]]`, instead of `neumann_body`: the numbers of all bodies with the linear problem of"
        " step I, such as `[1, 3]`",
        reader=readers.roles,
        default=lambda at: at["chosen"],
        initial=(),
        only=lambda at: at["several"],
        shown="a colour whose bodies have supports, without body 1 if there is a choice",
        order=-1,
    )

    @property
    def settings(self) -> Settings:
        """The table without the roles."""
        return Settings(**{field.name: getattr(self, field.name) for field in fields(Settings)})


def _increments(value: Any, at: At) -> int:
    """Read the number of increments of a step."""
    if readers.at_least_one(value) + at["before"] > MOST_INCREMENTS:
        raise Unfit(f"needed at most {MOST_INCREMENTS} increments of all steps")
    return int(value)


@dataclass(frozen=True, kw_only=True)
class StepSpec(Entries):
    """A step of a loading history: the loads at its end, reached in equal increments from those before."""

    part = "Step"

    name: str = entry("its name on screens", label, lambda at: f"step {at['number']}", shown='`"step 1"`, ..')
    increments: int = entry(
        f"number of equal increments, at most {MOST_INCREMENTS} in all steps", None, 1, "1", reader=_increments
    )
    body1: Loads = entry("loads at the end of the step", shown="as before", absent="where there is none")
    body2: Loads = entry(
        "loads at the end of the step, and so on for further bodies",
        shown="as before",
        absent="where there is none",
        write=lambda step: Spread((f"body{i}", loads) for i, loads in step.loads.items() if i > 1),
    )
    others: Mapping[int, Loads] = ReadOnly()

    @property
    def loads(self) -> dict[int, Loads]:
        """The loads that it names, by the numbers of the bodies."""
        return {1: self.body1, 2: self.body2, **self.others}


@dataclass(frozen=True, kw_only=True)
class Units(Entries):
    """The table ``[units]``."""

    length: str = entry("label of the unit of length", label, "mm")
    stress: str = entry("label of the unit of stress", label, "MPa")


@dataclass(frozen=True, kw_only=True)
class Norm(Entries):
    """The table ``[norm]``."""

    length: Fraction = entry(
        r"$L$ in the norm $\lvert v\rvert^2/L^2 + \lvert\nabla v\rvert^2$", positive, Fraction(1), "length"
    )


@dataclass(frozen=True, kw_only=True, repr=False)
class ProblemSpec(Entries):
    """The tables of a problem file, each key with its value; see :class:`verification.Problem`."""

    part = "Problem"

    title: str = entry("a text for screens and figures, without control characters", label, "untitled", counts=_nothing)
    dimension: Literal[1, 2] = entry("1 (two bars) or 2 (bodies in the plane)", choice(1, 2), 2, type="integer")
    plane: Literal["strain", "stress"] = entry(
        '`"strain"` for thick bodies, `"stress"` for thin plates; all bodies, in the plane only',
        readers.plane,
        "strain",
        only=lambda at: at["dimension"] == 2 or "a bar has none; leave it out in one dimension",
        write=lambda problem: problem.plane if problem.dimension == 2 else None,
        later=True,
        absent="in one dimension",
    )
    units: Mapping[str, str] = entry(
        default=EMPTY,
        reader=lambda value, at: vars(read_table(Units, at.inside(value))),
        counts=_nothing,
        type="object",
        table=Units,
    )
    body1: BodySpec = entry("below", write=lambda problem: problem.bodies[1])
    body2: BodySpec = entry(
        "above", write=lambda problem: Spread((f"body{i}", body) for i, body in problem.bodies.items() if i > 1)
    )
    contacts: tuple[ContactSpec, ...] = entry(
        "the table `[contact]`, or a list of the tables `[[contact]]` where the file has them",
        name="contact",
        write=lambda problem: problem.contacts if problem.several else replace(problem.contacts[0], bodies=()),
        type="Contact table, or list of Contact table",
        table=ContactSpec,
    )
    iteration: IterationSpec = entry()
    norm: Norm = entry(reader=lambda value, at: read_table(Norm, at.inside(value)), default=EMPTY, initial=Norm())
    steps: tuple[StepSpec, ...] = entry("of a loading history", name="step", initial=())
    source: str = field(default="<dict>", compare=False)

    @property
    @says("and so on", absent="of two bodies")
    def body3(self) -> BodySpec | None:
        """Body 3 of the file."""
        return self.bodies.get(3)

    @property
    def length(self) -> Fraction:
        """L of the norm ``|v|^2/L^2 + |grad v|^2``."""
        return self.norm.length

    def refuse(self, key: str, value: object, needed: str) -> ProblemError:
        """Return the error for a key of this problem."""
        return ProblemError(self.source, key, value, needed)

    # --- bodies of the file, and the two bodies of the iteration ---

    @property
    def several(self) -> bool:
        """True if the file has tables ``[[contact]]``: body 1 and body 2 are then unions of its bodies."""
        return bool(self.body1.members)

    @property
    def bodies(self) -> dict[int, BodySpec]:
        """The bodies of the file by their numbers."""
        members = dict(self.body1.members + self.body2.members)
        return dict(sorted(members.items())) or {1: self.body1, 2: self.body2}

    def holding(self, bodies: Mapping[int, BodySpec]) -> Self:
        """Return the same problem with other bodies of the same numbers, which keep their roles."""
        if not self.several:
            return replace(self, body1=bodies[1], body2=bodies[2])
        one, other = (BodySpec.union((i, bodies[i]) for i in self.numbers(body)) for body in (1, 2))
        return replace(self, body1=one, body2=other)

    def numbers(self, body: int) -> tuple[int, ...]:
        """Return the numbers in the file of the bodies that body 1 or body 2 stands for."""
        return tuple(i for i, _ in (self.body1, self.body2)[body - 1].members) or (body,)

    def words(self, body: int) -> str:
        """Return what body 1 or body 2 stands for: ``body 2``, or ``bodies 2, 4``."""
        numbers = self.numbers(body)
        return f"{'body' if len(numbers) == 1 else 'bodies'} {', '.join(map(str, numbers))}"

    # --- contacts: one by one, and what holds for all together ---

    @property
    def contact(self) -> ContactSpec:
        """The contact; where there are several, what the theorem takes of all: the largest k, a law with a radius."""
        if not self.several:
            return self.contacts[0]
        laws = [one.law for one in self.contacts if one.friction] or [self.contacts[0].law]
        radii = {one.radius for one in self.contacts}
        return ContactSpec(
            friction=max(one.friction for one in self.contacts),
            law=min(laws, key=lambda name: LAWS[name].needs_radius),
            radius=radii.pop() if len(radii) == 1 else None,
        )

    @property
    def shares(self) -> tuple[Fraction, ...]:
        """The friction of each contact over the largest one; 1 where there is none."""
        k = self.contact.friction
        return tuple(one.friction / k if k else Fraction(1) for one in self.contacts)

    @property
    def varies(self) -> bool:
        """True if the coefficient of friction may differ from place to place: k is then the largest one."""
        return self.several or self.contact.profile is not None

    @property
    def named(self) -> bool:
        """True if Gamma_c is one or more named lines."""
        return self.contacts[0].surface is not None

    @property
    def frictions(self) -> tuple[float, ...]:
        """k, or the least and the largest one where it varies."""
        each = {k for contact in self.contacts for k in contact.frictions}
        return (min(each), max(each)) if len(each) > 1 else (*each,)

    @property
    def friction_words(self) -> str:
        """The same as a text: ``0.3``, or ``0.1 to 0.3``."""
        return " to ".join(f"{k:g}" for k in self.frictions)

    def rubbing(self, k: Fraction) -> Self:
        """Return the same problem with k as its largest friction, of which contacts keep their shares."""
        each = zip(self.contacts, self.shares, strict=True)
        return replace(self, contacts=tuple(replace(one, friction=k * share) for one, share in each))

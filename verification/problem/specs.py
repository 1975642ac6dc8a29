"""Parts of a problem: two bodies, their contact, the iteration and the norm, as plain data."""

from __future__ import annotations

import hashlib
from bisect import bisect
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, TypeVar

from ndtheory import HypothesisError, relaxation_factor
from ndtheory.moduli import Moduli
from verification.problem.tables import Unfit, unreadable

V = TypeVar("V")

#: A displacement or a force by component; None leaves a displacement component free.
Components = tuple[Fraction | None, ...]

#: A relaxation factor, or ``auto`` for the one that the theory chooses.
Theta = Fraction | Literal["auto"]

#: Where the bodies of a file are.
PLACES = {1: "lower", 2: "upper"}

RECTANGLE_SIDES = ("left", "right", "bottom", "top")
INTERVAL_SIDES = ("left", "right")

#: Largest size of a mesh file: several times the size of the largest mesh as text.
MOST_MESH_BYTES = 200_000_000

#: Largest number of cells of a body, so that a typing error does not fill the memory.
MOST_CELLS = 250_000

#: Largest ratio of the two moduli: at 1e60 the bounds of Section 5, with high powers of M C_R / m, overflow a double.
MOST_CONTRAST = Fraction(10**30)

#: The same in one stiffness matrix, of a body with several materials or of several bodies: a hard inclusion of 1e12
#: changes the force by 2e-4, one of 1e14 by a percent.
MOST_WITHIN = Fraction(10**8)

#: Largest number of increments of a loading history, all of whose results are kept.
MOST_INCREMENTS = 2000

#: Least coefficient of friction but 0: the theorem as printed allows 1e-44 and less for steel in Pa.  Smaller ones
#: would lead to a kappa_1 or kappa_2 that is refused.
LEAST_FRICTION = Fraction(1, 10**70)

#: Largest coefficient of friction: all contact sticks already, and larger ones would only overflow.
MOST_FRICTION = Fraction(10**9)


class ReadOnly(Mapping[str, V]):
    """An immutable mapping that a frozen dataclass can hold; equal ones iterate alike, in the order of the keys.

    >>> ReadOnly({"top": 1, "left": 2})
    {'left': 2, 'top': 1}
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, V] | Iterable[tuple[str, V]] = ()) -> None:
        self._values = dict(sorted(dict(values).items()))

    def __getitem__(self, key: str) -> V:
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return hash(tuple(self._values.items()))

    def __repr__(self) -> str:
        return repr(self._values)


@dataclass(frozen=True, kw_only=True)
class MeshFile:
    """A mesh file as it was when the problem was read.

    Attributes
    ----------
    path : Path
        Absolute, so that it means the same file wherever the process or the problem goes.
    sha256 : str
        Of the content, in hexadecimal digits.
    """

    path: Path
    sha256: str

    @classmethod
    def read(cls, path: Path, sha256: str | None = None) -> MeshFile:
        """Return the file at a path.

        Raises
        ------
        Unfit
            Not a file, too large, or with another SHA-256 than the one given.
        """
        file = cls(path=path.absolute(), sha256=sha256 or _fingerprint(path))
        why = file.unusable() if sha256 else None
        if why:
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
    why = unreadable(path, MOST_MESH_BYTES)
    if why:
        raise Unfit(why)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise Unfit(f"cannot be read: {error.strerror}") from None


@dataclass(frozen=True, kw_only=True)
class SidePart:
    """A part of a side of a body: the side's edges between two positions along an axis (unit of length)."""

    side: str
    axis: Literal["x", "y"]
    ends: tuple[Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class BodySpec:
    """A body as the problem file describes it; lengths and stresses in the file's units.

    Attributes
    ----------
    shape : {'rectangle', 'interval', 'mesh', 'rigid', 'union'}
        A rigid body is an obstacle: of the other attributes it has at most x and y.  A union has only members, plane
        and the moduli, see :meth:`union`.
    young, poisson : Fraction
        E in stress; Poisson's ratio is 0 for a bar.  Both 0 where rigid, the largest ones of several materials.
    materials : read-only mapping from surface to pair of Fraction
        E and Poisson's ratio of each named surface of a mesh file; empty where the body is of one material.
    plane : {'strain', 'stress'}
        Plane strain or plane stress, the same for both bodies.
    parts : read-only mapping from name to SidePart
        Parts of sides, each with a name that is used like a side's.
    prescribed, traction : read-only mapping from side to components
        Displacement (length; None: free) and force per area (stress).
    body_force : tuple of Fraction
        Force per volume.
    members : tuple of pairs of a number and BodySpec
        The bodies of a union with their numbers in the file, in their order; empty for a single body.
    """

    shape: Literal["rectangle", "interval", "mesh", "rigid", "union"]
    x: tuple[Fraction, Fraction] | None = None
    y: tuple[Fraction, Fraction] | None = None
    cells: tuple[int, ...] | None = None
    mesh: MeshFile | None = None
    young: Fraction = Fraction(0)
    poisson: Fraction = Fraction(0)
    parts: Mapping[str, SidePart] = field(default_factory=ReadOnly)
    fixed: tuple[str, ...] = ()
    prescribed: Mapping[str, Components] = field(default_factory=ReadOnly)
    traction: Mapping[str, tuple[Fraction, ...]] = field(default_factory=ReadOnly)
    body_force: tuple[Fraction, ...] = ()
    plane: Literal["strain", "stress"] = "strain"
    materials: Mapping[str, tuple[Fraction, Fraction]] = field(default_factory=ReadOnly)
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

    def __post_init__(self) -> None:
        for name in ("parts", "prescribed", "traction", "materials"):
            object.__setattr__(self, name, ReadOnly(getattr(self, name)))

    @property
    def rigid(self) -> bool:
        """True if the body is an obstacle."""
        return self.shape == "rigid"

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


@dataclass(frozen=True, kw_only=True)
class Loads:
    """Loads of a body that a step of a loading history names: prescribed displacements, tractions, body force.

    Attributes as those of :class:`BodySpec`; the body force is None where it keeps its value.
    """

    prescribed: Mapping[str, Components] = field(default_factory=ReadOnly)
    traction: Mapping[str, tuple[Fraction, ...]] = field(default_factory=ReadOnly)
    body_force: tuple[Fraction, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("prescribed", "traction"):
            object.__setattr__(self, name, ReadOnly(getattr(self, name)))


@dataclass(frozen=True, kw_only=True)
class StepSpec:
    """A step of a loading history: the loads at its end, reached in equal increments from those before."""

    name: str
    increments: int
    body1: Loads
    body2: Loads


@dataclass(frozen=True, kw_only=True)
class Line:
    """A table ``[[contact]]``: the line along which two bodies of a file meet.

    Attributes
    ----------
    bodies : pair of int
        Their numbers in the file, in the order of its ``surface``.
    contact : ContactSpec
        The rest of the table.
    share : Fraction
        Its friction over the largest one of all lines; 1 where there is none.
    """

    bodies: tuple[int, int]
    contact: ContactSpec
    share: Fraction = Fraction(1)


@dataclass(frozen=True, kw_only=True)
class ContactSpec:
    """Gamma_c, the friction law and the initial distance.

    Attributes
    ----------
    interval : pair of Fraction or None
        Ends of Gamma_c along x; None: the overlap of the two surfaces.
    surface : pair of str or None
        Names of the sides of body 1 and of body 2 that meet, instead of an interval: a line of any shape.
    friction : Fraction
        k, the largest one where it varies along Gamma_c.
    law : str
        One of :data:`verification.registry.LAWS`.
    radius : Fraction or None
        Radius r of the hat kernel (length); None with a law that has none or without friction.
    gap : Fraction
        Initial distance (length).
    profile : Profile or None
        How k varies; None where it is constant.
    lines : tuple of Line
        The contacts of more than two bodies, which together are Gamma_c; empty for two bodies.
    """

    interval: tuple[Fraction, Fraction] | None
    friction: Fraction
    law: str
    radius: Fraction | None
    gap: Fraction
    profile: Profile | None = None
    surface: tuple[str, str] | None = None
    lines: tuple[Line, ...] = ()

    @classmethod
    def of_lines(cls, lines: Iterable[tuple[tuple[int, int], ContactSpec]], law: str) -> ContactSpec:
        """Return the contacts of several bodies as one, whose friction is the largest one."""
        pairs = tuple(lines)
        k = max(contact.friction for _, contact in pairs)
        radii = {contact.radius for _, contact in pairs}
        each = (
            Line(bodies=bodies, contact=contact, share=contact.friction / k if k else Fraction(1))
            for bodies, contact in pairs
        )
        radius = radii.pop() if len(radii) == 1 else None
        return cls(interval=None, friction=k, law=law, radius=radius, gap=Fraction(0), lines=tuple(each))

    def rubbing(self, k: Fraction) -> ContactSpec:
        """Return the same contact with k as its largest coefficient of friction, of which lines keep their shares."""
        lines = (replace(line, contact=line.contact.rubbing(k * line.share)) for line in self.lines)
        return replace(self, friction=k, lines=tuple(lines))

    @property
    def varies(self) -> bool:
        """True if the coefficient of friction may differ from place to place: k is then the largest one."""
        return self.profile is not None or bool(self.lines)

    @property
    def named(self) -> bool:
        """True if Gamma_c is one or more named lines."""
        return self.surface is not None or bool(self.lines)

    @property
    def frictions(self) -> tuple[float, ...]:
        """k, or the least and the largest one where it varies."""
        if self.lines:
            each = {k for line in self.lines for k in line.contact.frictions}
            return (min(each), max(each)) if len(each) > 1 else (*each,)
        shares = () if self.profile is None else (min(self.profile.share),)
        return tuple(float(self.friction * share) for share in (*shares, 1))

    @property
    def friction_words(self) -> str:
        """The same as a text: ``0.3``, or ``0.1 to 0.3``."""
        return " to ".join(f"{k:g}" for k in self.frictions)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a run: its relaxation and when it ends.

    Attributes
    ----------
    theta : Fraction or 'auto'
        ``auto``: the proved theta; the predicted one where nothing is proved or the proved one is more than twice as
        slow.  Momentum takes its step from rho: ``auto`` unless the file has a theta, which is then not used.
    relaxation : str
        One of :data:`verification.registry.RULES`; the theorem covers only ``constant``.
    tolerance : float
        The run ends when ``|||T g - g||| <= tolerance |||T g|||`` in the norm (5.21), with the largest T g so far.
    """

    theta: Theta = Fraction(1, 2)
    relaxation: str = "constant"
    tolerance: float = 1e-9
    max_iterations: int = 500


@dataclass(frozen=True, kw_only=True)
class IterationSpec(Settings):
    """The table ``[iteration]``: settings of a run, and the body of the linear problem of step I.

    ``neumann_body`` is 2 in Section 3, 1 in Section 6.
    """

    neumann_body: Literal[1, 2] = 2

    @property
    def settings(self) -> Settings:
        """The table without the roles."""
        return Settings(**{field.name: getattr(self, field.name) for field in fields(Settings)})


@dataclass(frozen=True, kw_only=True, repr=False)
class ProblemSpec:
    """The tables of a problem file, each key with its value; see :class:`verification.Problem`."""

    title: str
    dimension: Literal[1, 2]
    units: Mapping[str, str]
    body1: BodySpec
    body2: BodySpec
    contact: ContactSpec
    iteration: IterationSpec
    length: Fraction
    steps: tuple[StepSpec, ...] = ()
    source: str = field(default="<dict>", compare=False)

    @property
    def bodies(self) -> dict[int, BodySpec]:
        """The bodies of the file by their numbers."""
        members = dict(self.body1.members + self.body2.members)
        return dict(sorted(members.items())) or {1: self.body1, 2: self.body2}

    def numbers(self, body: int) -> tuple[int, ...]:
        """Return the numbers in the file of the bodies that body 1 or body 2 stands for."""
        return tuple(i for i, _ in (self.body1, self.body2)[body - 1].members) or (body,)

    def words(self, body: int) -> str:
        """Return what body 1 or body 2 stands for: ``body 2``, or ``bodies 2, 4``."""
        numbers = self.numbers(body)
        return f"{'body' if len(numbers) == 1 else 'bodies'} {', '.join(map(str, numbers))}"

    @property
    def plane(self) -> Literal["strain", "stress"]:
        """Plane strain or plane stress; without a meaning in one dimension."""
        return self.body2.plane if self.body1.rigid else self.body1.plane

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", ReadOnly(self.units))


def read_theta(value: Any) -> Theta:
    """Read a relaxation factor, or "auto".

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

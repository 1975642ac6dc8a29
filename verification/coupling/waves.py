"""Data of two plates that exchange heat, or of a fluid and a wall, before there is a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from ndtheory import HypothesisError, Number
from ndtheory.constants import take
from ndtheory.keys import derived, key
from ndtheory.moduli import Wall, added_mass, conduction, cooled
from verification.coupling.evidence import Evidence
from verification.coupling.kinds import BodyNumber, Kind
from verification.coupling.methods import MethodRow
from verification.coupling.readings import NextRun
from verification.coupling.roles import Role, plain_role
from verification.coupling.seen_moduli import from_below
from verification.coupling.spectrum import Spectrum
from verification.problem.writing import written_number

#: Sizes of what is given: the ratios then stay far from the ends of doubles.
LARGEST, SMALLEST = 10**12, Fraction(1, 10**12)

#: So many waves of a wall stand for its spectrum in the predictions of methods.
WAVES = 40

#: Reason for everything that needs an upper bound of rho for a fluid at a wall.
ONE_WAVE = "one wave bounds rho from below"

#: Reason against the fluid as the Neumann body.
SHORT_WAVES = "the shorter a wave, the smaller its added mass, so that rho would grow without limit on finer meshes"

#: The same against a fluid with a film coefficient.
SHORT_WAVES_OF_HEAT = "the shorter a wave, the more the wall conducts, so that rho would grow on finer meshes"


def _data(meaning: str, null: str = "where not given") -> Any:
    return key(
        meaning,
        type="list of exact",
        unit="one set of units",
        null=null,
        why="not given",
        of=lambda values: [written_number(value) for value in values],
        default=None,
    )


@dataclass(frozen=True, kw_only=True)
class Waves(Evidence):
    """Data of two bodies whose waves are known, by their parameter of ``advise_moduli``."""

    #: What is exchanged, the first parameter, how many numbers each has, and what it needs beside others.
    subject: ClassVar[str]
    first: ClassVar[str]
    counts: ClassVar[Mapping[str, tuple[int, ...]]]
    needed: ClassVar[tuple[tuple[str, str], ...]]

    exchanged = derived("`heat` or `fluid`", lambda waves: waves.subject, name="kind")

    film: tuple[Fraction, ...] | None = _data("film coefficient of a fluid (body 1) at a wall (body 2)")
    conductivity: tuple[Fraction, ...] | None = _data("of plate 1 and of plate 2, the capacity per volume")
    capacity: tuple[Fraction, ...] | None = _data("of plate 1 and of plate 2, the capacity per volume")
    density: tuple[Fraction, ...] | None = _data("of the fluid (body 1) and of the wall (body 2)", "for heat")
    length: tuple[Fraction, ...] | None = _data("of the wall, and the radius of a tube", "for heat")
    dt: tuple[Fraction, ...] | None = _data("the step in time")
    thickness: tuple[Fraction, ...] | None = _data("of both plates, or of the wall", "where plates are thick")
    young: tuple[Fraction, ...] | None = _data("of the wall")
    poisson: tuple[Fraction, ...] | None = _data("of the wall")

    @cached_property
    def given(self) -> dict[str, tuple[Fraction, ...]]:
        """The numbers that were given, by parameter."""
        return {name: numbers for name in PARAMETERS if (numbers := getattr(self, name)) is not None}

    def one(self, name: str) -> Fraction | None:
        """The first number of a parameter; None where it was not given."""
        return self.given[name][0] if name in self.given else None


#: The parameters, in the order in which they are shown.
PARAMETERS = ("film", "conductivity", "capacity", "density", "length", "dt", "thickness", "young", "poisson")


@dataclass(frozen=True, kw_only=True)
class Heat(Waves):
    """Two plates that exchange heat: both ends of the spectrum, so that theta and its factor are known."""

    subject, first = "heat", "conductivity"
    counts: ClassVar[Mapping[str, tuple[int, ...]]] = {"conductivity": (2,), "capacity": (2,), "thickness": (2,)} | {
        "dt": (1,)
    }
    needed: ClassVar[tuple[tuple[str, str], ...]] = (("dt", "capacity"), ("capacity thickness", "dt"))
    reasons: ClassVar[Mapping[str, str]] = {"quote": "no stiffness was given"}

    def spectra(self) -> tuple[Role, ...]:
        """The role of each plate."""
        return tuple(self._role(body) for body in BODIES)

    def _role(self, body: BodyNumber) -> Role:
        order = slice(None, None, 1 if body == 2 else -1)  # contact body, Neumann body
        pairs = {name: self.given[name][order] for name in PARAMETERS if len(self.given.get(name, ())) == 2}
        low, high = conduction(pairs.pop("conductivity"), **pairs, dt=self.one("dt"))
        if not 0 < low <= high < float("inf"):
            raise HypothesisError("dt", self.one("dt"), "a step in time that heat does not outrun: plates are too thin")
        known: dict[str, Any] = {"rho_min": Number.of_float(low), "rho_tied": Number.of_float(high)}
        known |= {"spectrum": Spectrum.between(low, high), "no_threshold": "heat has no friction"}
        return plain_role(body, Fraction(high), **known)

    def prefers(self, roles: Sequence[Role]) -> BodyNumber | None:
        """The plate with the smaller product of both ends, which has the smaller rate, too."""
        product = lambda role: role.rho_min.value * role.rho_tied.value
        return min(roles, key=product).neumann_body


@dataclass(frozen=True, kw_only=True)
class Film(Heat):
    """A fluid that takes heat from a wall, body 2, by a film coefficient: the same for all waves of the wall."""

    first = "film"
    counts: ClassVar[Mapping[str, tuple[int, ...]]] = dict.fromkeys(
        ("film", "conductivity", "capacity", "thickness", "dt"), (1,)
    )
    needed = ("", "conductivity"), ("dt", "capacity"), ("capacity", "dt")

    def spectra(self) -> tuple[Role, ...]:
        """The wall as the Neumann body, and the fluid, which is refused."""
        film, conductivity = self.given["film"][0], self.given["conductivity"][0]
        capacity, thickness = self.one("capacity"), self.one("thickness")
        if capacity is None and thickness is None:
            raise HypothesisError("thickness", "nothing", "thickness beside film, or capacity and dt of a thick wall")
        high = cooled(film, conductivity, capacity=capacity, thickness=thickness, dt=self.one("dt"))
        ends: dict[str, Any] = {"rho_min": Number.of_float(0.0), "rho_tied": Number.of_float(high)}
        known = {"spectrum": Spectrum.between(0.0, high), "no_threshold": "heat has no friction"}
        return plain_role(2, Fraction(high), **ends, **known), Role.unknown(1, SHORT_WAVES_OF_HEAT)

    def prefers(self, roles: Sequence[Role]) -> BodyNumber:
        """The wall."""
        return 2


@dataclass(frozen=True, kw_only=True)
class Fluid(Waves):
    """A fluid at a wall, body 2: the added mass of each wave over the mass of the wall; the longest bounds rho."""

    subject, first = "fluid", "density"
    counts: ClassVar[Mapping[str, tuple[int, ...]]] = {"density": (2,), "length": (1, 2)} | dict.fromkeys(
        ("thickness", "young", "poisson", "dt"), (1,)
    )
    needed = ("", "thickness"), ("", "length"), ("young", "poisson"), ("young", "dt"), ("poisson", "young")

    @cached_property
    def values(self) -> list[float]:
        """The eigenvalue of each wave."""
        length, *radius = self.given["length"]
        fluid, density = self.given["density"]
        wall = Wall(
            density=density,
            thickness=self.given["thickness"][0],
            length=length,
            radius=radius[0] if radius else None,
            young=self.one("young"),
            poisson=self.one("poisson") or Fraction(0),
        )
        return [added_mass(fluid, wall, dt=self.one("dt"), wave=n) for n in range(1, WAVES + 1)]

    def spectra(self) -> tuple[Role, ...]:
        """The wall as the Neumann body, and the fluid, which is refused."""
        wall = Role.unknown(2, ONE_WAVE, rho=Number.of_float(max(self.values)), level="bounded")
        return wall, Role.unknown(1, SHORT_WAVES)

    def prefers(self, roles: Sequence[Role]) -> BodyNumber:
        """The wall."""
        return 2

    def methods(self, roles: Sequence[Role]) -> tuple[MethodRow, ...]:
        """On the waves, for the best theta of these."""
        return self.rows_on(Spectrum.of(self.values), 2)

    def next_run(self) -> NextRun:
        """A run to begin with."""
        return from_below(max(self.values), self.kind)

    @property
    def why_no_theta(self) -> str:
        return "one wave bounds rho from below: `next` is a run to begin with"

    @property
    def summary(self) -> str:
        return f"rho is at least {max(self.values):.4g} with the Neumann problem on the wall"


#: The bodies in their order.
BODIES: tuple[BodyNumber, BodyNumber] = (1, 2)


def read_waves(source: type[Waves], given: dict[str, Any], *, parallel: bool) -> Waves:
    """The evidence of plates that exchange heat, or of a fluid and a wall; ``given`` has what is not None.

    HypothesisError for a parameter that this source does not have, one that is missing, or numbers out of range.
    """
    for name, value in given.items():
        if name not in source.counts:
            raise HypothesisError(name, shown(value), f"no {name} beside {source.first}")
    known: dict[str, Any] = {name: _numbers(name, value, source.counts[name]) for name, value in given.items()}
    lacks = [
        (beside, name) for beside, name in source.needed if name not in given and given.keys() >= {*beside.split()}
    ]
    for beside, name in lacks:
        all_of = " and ".join(other for also, other in lacks if also == beside)
        raise HypothesisError(name, "nothing", f"{all_of} beside {beside.replace(' ', ' and ') or source.first}")
    return source(kind=Kind(name="tied", parallel=parallel), **known)


def shown(value: Any) -> Any:
    """A parameter as it is typed."""
    return value if isinstance(value, str) or not hasattr(value, "__len__") else ",".join(map(str, value))


def _numbers(key: str, value: Any, counts: tuple[int, ...]) -> tuple[Fraction, ...]:
    several = value if hasattr(value, "__len__") and not isinstance(value, str) else [value]
    if len(several) not in counts:
        names = {1: "one number", 2: "two numbers, separated by a comma"}
        raise HypothesisError(key, shown(value), " or ".join(names[n] for n in counts))
    if key == "poisson":
        return (take(key, several[0], "a number with -1 < nu <= 1/2", lambda v: -1 < v <= Fraction(1, 2)),)
    return tuple(take(key, v, "numbers > 0 (1e-12 to 1e12)", lambda v: SMALLEST <= v <= LARGEST) for v in several)

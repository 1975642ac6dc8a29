"""The answer for two layers: both roles beside each other, in doubles or proved for all wave numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from ndtheory import HypothesisError, Number
from ndtheory.constants import relaxation_factor, take
from ndtheory.continuum.circle import TwoLayers
from ndtheory.continuum.strip import Strip
from ndtheory.keys import Key, Part, key, says
from ndtheory.moduli import Moduli
from verification.document import Document
from verification.free_norm.numbers import Found, numbers, proved, with_friction
from verification.free_norm.search import Search, comparable
from verification.semidefinite import LMIError

#: The keys of what was given.
INPUTS = {
    "young": Key(says="E", type="list of number", unit="stress"),
    "poisson": Key(says="nu", type="list of number"),
    "depth": Key(says="thickness", type="list of number", unit="length"),
    "radius": Key(says="r of the hat kernel", type="number", unit="length"),
    "friction": Key(says="k", type="number"),
}

_none: dict[str, Any] = {"null": "where one step is not proved to contract", "default": None}


@dataclass(frozen=True, kw_only=True)
class EnergyOfLayers(Part):
    """The factor in the norm (5.21)."""

    factor: Number | None = key(
        "at theta, by multipliers that all wave numbers share; 1 or more proves nothing",
        null="without a theta, or where no multipliers are found",
        default=None,
    )


@dataclass(frozen=True, kw_only=True)
class FreeNorm(Part):
    """The results in a norm that the proof may choose."""

    factor: Number | None = key("at theta", **_none)
    theta_best: float | None = key("the theta of the least factor, to 0.005", **_none)
    factor_best: Number | None = key("there", **_none)
    theta_max: Number | None = key("every theta below it contracts", **_none)
    friction_threshold: Number = key("every small theta contracts below it")
    friction_limit: Number = key("some theta contracts below it: the same, as smaller thetas then contract as well")


@dataclass(frozen=True, kw_only=True)
class LayersRole(Part):
    """Two layers in one of both roles."""

    neumann: int = key("1 or 2: the Neumann body, in the order given")
    theta: float | None = key("the one given; without it the best one in the free norm", **_none)
    energy: EnergyOfLayers = key("in the norm (5.21)")
    lyapunov: FreeNorm = key("in the free norm")


@dataclass(frozen=True, kw_only=True)
class Layers(Document):
    """Two layers without ends, each clamped at its far side, in contact along any part of a line."""

    schema: ClassVar[str] = "ndtheory.layers/1"
    units: ClassVar[Mapping[str, str]] = {"length": "that of --depth", "stress": "that of --young"}  # type: ignore[misc]

    layers: TwoLayers
    friction: Fraction

    @property
    @says(inside=INPUTS)
    def inputs(self) -> dict[str, Any]:
        """As given, the Neumann body of the first role first."""
        both = (self.layers.neumann, self.layers.contact)
        return {
            "young": [float(strip.body.young) for strip in both],
            "poisson": [float(strip.body.poisson) for strip in both],
            "depth": [float(strip.thickness) for strip in both],
            "radius": float(self.layers.radius),
            "friction": float(self.friction),
        }

    roles: tuple[LayersRole, LayersRole] = key("as given, and exchanged")
    proved: bool = key("true if all numbers with ends are proved for every wave number, in intervals")

    @property
    def summary(self) -> str:
        free = self.roles[0].lyapunov.factor
        return f"two layers: {'no factor is found' if free is None else f'factor {free.value:.4g} in the free norm'}"


def two_layers(
    *,
    young: Sequence[Any],
    poisson: Sequence[Any],
    depth: Sequence[Any],
    friction: Any,
    radius: Any,
    theta: Any = None,
    verified: bool = False,
) -> Layers:
    """The circle criterion for two layers, the Neumann body first, in both roles.

    Parameters
    ----------
    young, poisson, depth : pairs of numbers
        E, nu and thickness of the Neumann layer and of the contact layer, in plane strain.
    friction, radius, theta : number
        k > 0, r > 0 in the unit of the depths, 0 < theta < 1; the best theta by default.
    verified : bool
        True to prove each number in intervals.

    Raises
    ------
    HypothesisError

    Examples
    --------
    >>> found = two_layers(
    ...     young=(70000, 20000), poisson=("0.3", "0.3"), depth=("0.3", "0.3"), friction="6", radius="0.1"
    ... )
    >>> [round(role.lyapunov.friction_threshold.value, 1) for role in found.roles]
    [5.1, 5.0]
    """
    E, nu, d = (_pair(name, pair) for name, pair in (("young", young), ("poisson", poisson), ("depth", depth)))
    try:
        bodies = tuple(Moduli(young=e, poisson=n) for e, n in zip(E, nu, strict=True))
    except HypothesisError as error:
        raise HypothesisError({"E": "young", "nu": "poisson"}[error.key], error.value, error.needed) from None
    if not all(body.kappa > 1 for body in bodies):
        raise HypothesisError("poisson", ", ".join(map(str, nu)), "compressible layers, nu < 1/2")
    depths = [take("depth", value, "a thickness > 0", lambda v: v > 0) for value in d]
    r = take("radius", radius, "a radius > 0", lambda v: v > 0)
    k = take("friction", friction, "a coefficient k > 0: without friction (5.21) is the best norm", lambda v: v > 0)
    chosen = None if theta is None else Fraction(relaxation_factor(theta))
    neumann, contact = (Strip(body=body, thickness=depth) for body, depth in zip(bodies, depths, strict=True))
    given = comparable(TwoLayers(contact=contact, neumann=neumann, radius=r))
    first, second = (
        _role(number, Search(layers), k, chosen, verified) for number, layers in ((1, given), (2, given.swapped))
    )
    return Layers(layers=given, friction=k, roles=(first, second), proved=verified)


def _pair(name: str, pair: Any) -> tuple[Any, Any]:
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        given = ",".join(map(str, pair)) if isinstance(pair, (list, tuple)) else pair
        raise HypothesisError(name, given, "two numbers, of the Neumann layer and of the contact layer")
    return pair[0], pair[1]


def _role(number: int, search: Search, k: Fraction, theta: Fraction | None, verified: bool) -> LayersRole:
    found: Found = proved if verified else lambda value, side, holds: Number.of_float(value)
    known = numbers(search, k, theta, found)
    if theta is None and "theta_best" in known:
        theta = Fraction(str(known["theta_best"]))
    energy = None
    if theta is not None:
        with suppress(LMIError):  # no multipliers at all
            q, by, weight = search.energy_factor(float(theta), float(k))
            exact = with_friction(by, k), Fraction(weight)
            energy = found(q, 1, lambda value: search.layers.contracts_in_energy(theta, value, *exact))
    return LayersRole(
        neumann=number,
        theta=None if theta is None else float(theta),
        energy=EnergyOfLayers(factor=energy),
        lyapunov=FreeNorm(friction_limit=known["friction_threshold"], **known),
    )

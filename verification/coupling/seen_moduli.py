"""Data of two bodies before there is a mesh, and bounds of rho for both roles from their moduli."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from ndtheory import Number
from ndtheory.energy_norms import parallel_factor, parallel_theta, predicted_theta
from ndtheory.moduli import Moduli
from ndtheory.number import above
from verification.coupling.kinds import BodyNumber
from verification.coupling.readings import LARGEST_TO_PASTE, rounded_down
from verification.problem.writing import written_number
from verification.value import to_plain

Corners = Literal["none", "1", "2", "both"]

#: What is exchanged: fluxes and temperatures, or pressures and displacements.
Kind = Literal["heat", "fluid"]

#: Parameters of each kind, and how many numbers they may have.
WAVES_KEYS: dict[str, dict[str, tuple[int, ...]]] = {
    "heat": {"conductivity": (2,), "capacity": (2,), "thickness": (2,), "dt": (1,)},
    "fluid": {"density": (2,), "thickness": (1,), "length": (1, 2), "young": (1,), "poisson": (1,), "dt": (1,)},
}


@dataclass(frozen=True, kw_only=True)
class LowerBounds:
    """Lower bounds of rho in the continuum: where a piece of Gamma_c may stick, and where both bodies slide freely."""

    stick: Number
    slide: Number

    def to_dict(self) -> dict[str, Any]:
        """The bounds, and from which theta on no step contracts."""
        kinds = ("stick", "slide")
        excluded = {name: excluded_from(getattr(self, name)) for name in kinds}
        why = "the bound is below 1, and excludes no theta up to 1"
        return {
            **{name: getattr(self, name).to_dict() for name in kinds},
            **{f"theta_excluded_{name}": theta for name, theta in excluded.items()},
            "reason": {f"theta_excluded_{name}": why for name, theta in excluded.items() if theta is None},
        }


def excluded_from(bound: Number) -> float | None:
    """``2/(1 + bound)``: from this theta on no step contracts; None where that is above 1."""
    theta = 2 / (1 + bound.value)
    return theta if theta <= 1 else None


@dataclass(frozen=True, kw_only=True)
class StartTheta:
    """A theta to start with, where the mirror image of the contact body fits into the Neumann body.

    ``C_c <= s C_n``, so that rho_normal is at most s.  With friction rho is guessed to be at most ``guess``, as with
    bodies like the Neumann body, which ``guessed_from`` names.
    """

    s: Fraction
    guess: float
    guessed_from: str

    @property
    def theta_free(self) -> float:
        """``2/(2 + s)``, at most 0.99: proved without friction."""
        return rounded_down(min(predicted_theta(self.s), LARGEST_TO_PASTE))

    @property
    def theta_guess(self) -> float:
        """``2/(2 + guess)``, not above `theta_free`: a guess with friction."""
        return min(rounded_down(min(predicted_theta(Fraction(self.guess)), LARGEST_TO_PASTE)), self.theta_free)

    def factor_free(self, theta: float) -> Number:
        """``1 - theta``, the factor proved without friction for a theta up to ``2/(2 + s)``, as of an open node."""
        return exactly(1 - Fraction(theta))

    def to_dict(self) -> dict[str, Any]:
        """The object ``start``."""
        s = above(self.s)  # not below the bound
        return {
            "s": Number(value=s, hi=s, level="exact").to_dict(),
            "theta_frictionless": self.theta_free,
            "factor_frictionless": self.factor_free(self.theta_free).to_dict(),
            "rho_guess": self.guess,
            "guessed_from": self.guessed_from,
            "theta_guess": self.theta_guess,
            "factor_frictionless_of_guess": self.factor_free(self.theta_guess).to_dict(),
        }


@dataclass(frozen=True, kw_only=True)
class ModuliRole:
    """Bounds from moduli when one body gets the Neumann problem.

    Attributes
    ----------
    neumann_body : {1, 2}
    corners : mapping
        The bounds by the body that ends in corners of 90 degrees at the ends of Gamma_c: ``'none'`` holds for every
        geometry, ``'1'``, ``'2'``, ``'both'`` add the effect of such ends.
    start, why_no_start : StartTheta or None, str
    """

    neumann_body: BodyNumber
    corners: Mapping[Corners, LowerBounds]
    start: StartTheta | None
    why_no_start: str = ""

    def to_dict(self) -> dict[str, Any]:
        """A member of ``moduli.roles``."""
        return {
            "neumann_body": self.neumann_body,
            "bounds": [{"corners": name} | bounds.to_dict() for name, bounds in self.corners.items()],
            "start": to_plain(self.start),
            "reason": {"start": self.why_no_start} if self.start is None else {},
        }


@dataclass(frozen=True, kw_only=True)
class SeenModuli:
    """The moduli of two bodies, and bounds for both roles.

    Attributes
    ----------
    bodies : pair of Moduli
        Bodies 1 and 2.
    corners : {'none', '1', '2', 'both'} or None
        The body that ends in corners of 90 degrees at the ends of Gamma_c; None where that was not given.
    mirror, flat : tuple of {1, 2}, bool
        The bodies whose mirror image fits into the other one, and True if the other one is a flat layer, as the user
        confirms.
    roles : pair of ModuliRole
        With the Neumann problem on body 1 and on body 2.
    """

    bodies: tuple[Moduli, Moduli]
    corners: Corners | None
    mirror: tuple[BodyNumber, ...]
    flat: bool
    roles: tuple[ModuliRole, ModuliRole]

    def bounds(self, role: ModuliRole) -> LowerBounds:
        """The bounds of a role for the ends that were given, or for every geometry."""
        return role.corners[self.corners or "none"]

    def largest(self, role: ModuliRole) -> float:
        """The largest bound that the ends may bring, as far as they are known."""
        known = role.corners.values() if self.corners is None else [self.bounds(role)]
        return max(bounds.stick.value for bounds in known)

    def smaller(self, kind: Literal["stick", "slide"]) -> BodyNumber | None:
        """The Neumann body of the role with the smaller bound; None where both are equal."""
        one, two = (getattr(self.bounds(role), kind).value for role in self.roles)
        if math.isclose(one, two, rel_tol=1e-12):
            return None
        return 1 if one < two else 2

    @property
    def summary(self) -> str:
        """The bounds of both roles in one line."""
        each = (f"{self.bounds(role).stick.value:.4g} with Neumann body {role.neumann_body}" for role in self.roles)
        return f"rho is at least {', '.join(each)}, where a piece of Gamma_c may stick"

    def to_dict(self) -> dict[str, Any]:
        """The object ``moduli``."""
        return {
            "young": [written_number(body.young) for body in self.bodies],
            "poisson": [written_number(body.poisson) for body in self.bodies],
            "plane": self.bodies[0].plane,
            "corners": self.corners,
            "mirror": list(self.mirror),
            "flat": self.flat,
            "neumann_body_frictionless": self.smaller("slide"),
            "roles": to_plain(self.roles),
            "reason": ({} if self.corners else {"corners": "not told"})
            | ({} if self.smaller("slide") else {"neumann_body_frictionless": "both roles have the same bound"}),
        }


@dataclass(frozen=True, kw_only=True)
class Parallel:
    """The best constant theta of *parallel* coupling where nothing opens or slips, and its factor a step.

    With ``bound`` rho is only bounded from below: theta is at most, and the factor at least this.
    """

    neumann_body: BodyNumber | None
    theta: float
    factor: float
    bound: bool

    @classmethod
    def of(cls, neumann_body: BodyNumber | None, rho: float, *, bound: bool = False) -> Parallel:
        """The best theta and its factor."""
        theta = parallel_theta(rho)
        return cls(neumann_body=neumann_body, theta=theta, factor=parallel_factor(theta, rho), bound=bound)

    def to_dict(self) -> dict[str, Any]:
        """A member of ``parallel``."""
        return dict(vars(self))


@dataclass(frozen=True, kw_only=True)
class SeenWaves:
    """Data of two plates that exchange heat, or of a fluid and a wall, by their parameter of ``advise_moduli``."""

    kind: Kind
    given: dict[str, tuple[Fraction, ...]]

    def one(self, key: str) -> Fraction | None:
        """The first number of a parameter; None where it was not given."""
        return self.given[key][0] if key in self.given else None

    def to_dict(self) -> dict[str, Any]:
        """The object ``waves``."""
        keys = WAVES_KEYS["heat"] | WAVES_KEYS["fluid"]
        numbers = {key: [written_number(v) for v in self.given[key]] if key in self.given else None for key in keys}
        return {"kind": self.kind, **numbers, "reason": {key: "not given" for key, v in numbers.items() if v is None}}


def exactly(value: Fraction) -> Number:
    """A rational as a number of the level ``exact``."""
    return Number.enclosed(value, value, value, "exact")

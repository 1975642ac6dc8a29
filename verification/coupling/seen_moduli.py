"""Data of two elastic bodies before there is a mesh, and bounds of rho for both roles from their moduli."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, Literal

from ndtheory import Number
from ndtheory.energy_norms import parallel_theta, predicted_rate, predicted_theta
from ndtheory.keys import Part, derived, key, says
from ndtheory.moduli import Moduli
from ndtheory.number import above
from verification.coupling.evidence import Evidence
from verification.coupling.kinds import LARGEST_TO_PASTE, BodyNumber, Kind
from verification.coupling.readings import NextRun, or_at_one, rounded_down
from verification.coupling.roles import PROVED, Role
from verification.problem.writing import written_number

Corners = Literal["none", "1", "2", "both"]

#: Reason for a missing friction threshold beside the values that are proved for k = 0.
NO_FRICTION = "a mirror image proves nothing of friction: the proved values are for k = 0"

#: Reason for a missing theta for a tied interface.
ONE_END = "moduli bound rho from below, and no other end of the spectrum"

_EXCLUDED: dict[str, Any] = {
    "says": "2/(1 + bound): from here on no theta contracts",
    "unit": "1",
    "null": "where it is above 1",
    "why": "the bound is below 1, and excludes no theta up to 1",
}


@dataclass(frozen=True, kw_only=True)
class LowerBounds(Part):
    """Lower bounds of rho in the continuum: where a piece of Gamma_c may stick, and where both bodies slide freely."""

    corners: Corners = key(
        "`none`: whatever the geometry; `1`, `2`, `both`: with corners of 90 degrees of that body at the ends of "
        r"$\Gamma_c$, where the other one goes on"
    )
    stick: Number = key(r"where a piece of $\Gamma_c$, or at such an end, may stick", type="Number", unit="1")
    slide: Number = key(r"the bound of $\rho_N$, for the case without friction", type="Number", unit="1")

    theta_excluded_stick = derived(of=lambda bounds: excluded_from(bounds.stick), hint=float | None, **_EXCLUDED)
    theta_excluded_slide = derived(of=lambda bounds: excluded_from(bounds.slide), hint=float | None, **_EXCLUDED)


def excluded_from(bound: Number) -> float | None:
    """``2/(1 + bound)``: from this theta on no step contracts; None where that is above 1."""
    theta = 2 / (1 + bound.value)
    return theta if theta <= 1 else None


@dataclass(frozen=True, kw_only=True)
class StartTheta(Part):
    """A theta to start with, where the mirror image of the contact body fits into the Neumann body.

    ``C_c <= s C_n``, so that rho_normal is at most s.  With friction rho is guessed to be at most ``guess``, as with
    bodies like the Neumann body, which ``guessed_from`` names.
    """

    s: Fraction = key(
        r"$\rho_N$ is at most this, in the continuum and on nested meshes",
        unit="1",
        type="Number",
        of=lambda s: Number(value=above(s), hi=above(s), level="exact"),  # not below the bound
    )
    guess: float = key(r"guess of an upper bound of $\rho$ with friction", name="rho_guess", unit="1")
    guessed_from: str = key("the bodies whose value that is")

    @property
    @says("$2/(2+s)$ in four figures, at most 0.99", name="theta_frictionless", unit="1")
    def theta_free(self) -> float:
        return rounded_down(min(predicted_theta(self.s), LARGEST_TO_PASTE))

    @property
    @says(r"$2/(2+\rho)$ of the guess in four figures", unit="1")
    def theta_guess(self) -> float:
        return min(rounded_down(min(predicted_theta(Fraction(self.guess)), LARGEST_TO_PASTE)), self.theta_free)

    def factor_free(self, theta: float) -> Number:
        """``1 - theta``, the factor proved without friction for a theta up to ``2/(2 + s)``, as of an open node."""
        return exactly(1 - Fraction(theta))

    @property
    @says("its factor, proved without friction", type="Number", unit="1")
    def factor_frictionless(self) -> Number:
        return self.factor_free(self.theta_free)

    @property
    @says("the factor of that theta, proved without friction", type="Number", unit="1")
    def factor_frictionless_of_guess(self) -> Number:
        return self.factor_free(self.theta_guess)


@dataclass(frozen=True, kw_only=True)
class ModuliRole(Part):
    """Bounds from moduli when one body gets the Neumann problem, by the body that ends in corners."""

    neumann_body: BodyNumber = key(type="integer")
    corners: Mapping[Corners, LowerBounds]
    start: StartTheta | None = key(
        "a theta to start with",
        null="unless the mirror image of the contact body fits",
        why=lambda role: role.why_no_start,
    )
    why_no_start: str = ""

    @property
    @says(r"lower bounds of $\rho$ in the continuum, and nearly on fine meshes", name="bounds")
    def each(self) -> tuple[LowerBounds, ...]:
        return tuple(self.corners.values())

    def known(self, bounds: LowerBounds) -> Role:
        """The role with one of its bounds of rho, and what is proved of it without friction."""
        reason = {
            "theta_predicted": "moduli bound rho from below, which predicts no theta",
            "rate_predicted": "moduli bound rho from below, which predicts no rate",
            "friction_threshold": NO_FRICTION if self.start else "moduli say nothing about friction",
            "rho_min": ONE_END,
        }
        proved: dict[str, Any] = {}
        if self.start is None:
            reason |= dict.fromkeys(PROVED, self.why_no_start)
        else:
            s = self.start.s
            most = exactly(min(2 / (1 + s), Fraction(1)))
            proved = dict(zip(PROVED, (float(predicted_theta(s)), exactly(predicted_rate(s)), most), strict=True))
        return Role(neumann_body=self.neumann_body, rho=bounds.stick, level="bounded", reason=reason, **proved)


@dataclass(frozen=True, kw_only=True)
class ElasticBodies(Evidence):
    """The moduli of two bodies, and bounds for both roles.

    ``corners`` is the body that ends in corners of 90 degrees at the ends of Gamma_c; ``mirror`` and ``flat`` are as
    the user confirms.
    """

    reasons: ClassVar[Mapping[str, str]] = {"neumann_body": "both roles have the same bounds"}

    bodies: tuple[Moduli, Moduli]
    corners: Corners | None = key(
        r"which body ends in corners of 90 degrees at the ends of $\Gamma_c$: `none`, `1`, `2` or `both`",
        null="where that was not given",
        why="not told",
    )
    mirror: tuple[BodyNumber, ...] = key(
        "the bodies whose mirror image fits into the other one, as the user confirms", type="list of integer"
    )
    flat: bool = key(
        "whether the user states that the other one is at least twice as wide as high, and held along its other side"
    )
    roles: tuple[ModuliRole, ModuliRole] = key("with the Neumann problem on body 1 and on body 2")

    @property
    @says("of body 1 and of body 2", type="list of exact", unit="stress")
    def young(self) -> list[Any]:
        return [written_number(body.young) for body in self.bodies]

    @property
    @says("of body 1 and of body 2", type="list of exact", unit="1")
    def poisson(self) -> list[Any]:
        return [written_number(body.poisson) for body in self.bodies]

    plane = derived("`strain`, `stress` or `3d`", lambda bodies: bodies.bodies[0].plane)

    def spectra(self) -> tuple[Role, ...]:
        """Bounds of rho from below in both roles."""
        return tuple(role.known(self.bounds(role)) for role in self.roles)

    def prefers(self, roles: Sequence[Role]) -> BodyNumber | None:
        """The body with the smaller bound, else the only one of which something is proved."""
        tried = self.smaller("stick") or self.smaller("slide")
        started = [role.neumann_body for role in self.roles if role.start is not None]
        return started[0] if tried is None and len(started) == 1 else tried

    @property
    def tried(self) -> ModuliRole:
        """The role to begin with."""
        return self.roles[(self.prefers(()) or 1) - 1]

    def next_run(self) -> NextRun:
        """The theta to start with in the role that is tried, or the run to make."""
        role, parallel = self.tried, self.kind.parallel
        if role.start is not None and parallel:
            theta = min(parallel_theta(Fraction(role.start.guess)), Fraction(role.start.theta_guess))
            why = "a guess for parallel coupling, 1/(1 + rho) with the guess of rho"
            return NextRun(theta=rounded_down(theta), why=why)
        if role.start is not None:
            why = (
                "with friction a guess: a run at it, with its ratio of residuals, tells more; "
                f"without friction {role.start.theta_free:.4g} is proved, as is this one"
            )
            return NextRun(theta=role.start.theta_guess, why=why)
        where = "tied" if parallel else "without friction or tied"
        among = "the largest bound above" if self.corners is None else "the bound above"
        who = "either body" if (body := self.prefers(())) is None else f"body {body}"
        return from_below(
            self.largest(role), self.kind, f"the Neumann problem on {who}, ", f" with {among}", f" {where}"
        )

    @property
    def why_no_theta(self) -> str:
        return "moduli bound rho from below: `next` is a theta to begin with"

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
    @says(
        r"the Neumann body of the role with the smaller bound of $\rho_N$",
        type="integer",
        null="where both are the same",
        why="both roles have the same bound",
    )
    def neumann_body_frictionless(self) -> BodyNumber | None:
        return self.smaller("slide")

    @property
    def summary(self) -> str:
        """The bounds of both roles in one line."""
        each = (f"{self.bounds(role).stick.value:.4g} with Neumann body {role.neumann_body}" for role in self.roles)
        return f"rho is at least {', '.join(each)}, where a piece of Gamma_c may stick"


def from_below(bound: float, kind: Kind, who: str = "", among: str = "", where: str = "") -> NextRun:
    """The run to begin with where only a bound of rho from below is known."""
    why = (
        f"{who}1/(2 + {bound:.4g}){among}, which contracts{where} if rho is below {3 + 2 * bound:.4g}; "
        f"halve it if the residual does not fall{or_at_one(bound, kind)}"
    )
    return NextRun(theta=rounded_down(1 / (2 + Fraction(bound))), why=why)


def exactly(value: Fraction) -> Number:
    """A rational as a number of the level ``exact``."""
    return Number.enclosed(value, value, value, "exact")

"""The assignments of the roles as far as they are known: rho, both ends of the spectrum, theta, and proofs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from typing import Any, Literal

from ndtheory import EnergyBounds, EnergyConstants, Number, evaluate_energy
from ndtheory.energy_norms import predicted_rate, predicted_theta, tied_factor, tied_rate, tied_theta
from ndtheory.keys import ABSENT, Part, key, says
from verification.algorithm.rates import steps
from verification.algorithm.theta import Choice
from verification.constants.cells import NAMES
from verification.coupling.cells import Suggested, no_cells
from verification.coupling.kinds import BodyNumber
from verification.coupling.spectrum import Spectrum
from verification.interface.assembly import SingularRole
from verification.problem.tables import ProblemError

#: Exchanging the roles makes no difference where it changes the number of steps by no more than this share of it.
SAME = 0.02

#: The entries of a role that rest on an upper bound of rho.
PROVED = ("theta_proved", "factor_proved", "theta_max_proved")

#: How rho is known: as a value, by a bound from below, or as an estimate from vectors or factors.
Level = Literal["known", "bounded", "estimated"]

#: The entries of a role for a tied interface, in this order.
TIED = ("rho_min", "rho_tied", "theta_tied", "rate_tied")

_REFUSED = "from moduli, where the role is refused, and of kind `general`"
_NO_FILE = "where the advice is not about a problem file"
_ENDS: dict[str, Any] = {
    "says": "the smallest and the largest eigenvalue of (S of the contact body, S of the Neumann body), in both "
    "components; `rho_tied` is `rho`, but where that is `rho_normal`",
    "unit": "1",
    "type": "Number",
    "null": "of runs, and without friction above 2000 contact nodes, where `tied` was not asked",
    "why": lambda role: role.why_not_tied,
}
_OF_CELLS: dict[str, Any] = {
    "says": r"$\rho^*$ and $\rho_N^*$ in these roles, as in the constants",
    "unit": "1",
    "type": "Number",
    "null": "where they are",
    "absent": _NO_FILE,
    "why": lambda role: role.cells.of_file.why,
}


@dataclass(frozen=True, kw_only=True)
class Role(Part):
    """Prediction and proofs for the iteration when one body gets the Neumann problem.

    ``reason`` says why a value is None: all are where the role is refused.  ``energy`` are the constants behind the
    proved values, ``spectrum`` eigenvalues for predictions of methods, ``cells`` rho of the file's cells in these roles
    with cells that have a smaller one; each is None where there is none.  ``level`` says how rho is known.
    """

    neumann_body: BodyNumber | None = key(
        "who has the Neumann problem in these roles", null="where that is not known", type="integer"
    )
    rho: Number | None = key(
        r"the largest ratio of the stiffness of the contact body to the stiffness of the Neumann body on $\Gamma_c$; "
        "from moduli a lower bound",
        unit="1",
        type="Number",
        null="as all below, where the role is refused",
    )
    theta_proved: float | None = key(
        "the theta of least proved factor",
        unit="1",
        null=r"where none is proved, as with friction above 2000 contact nodes, or where Lanczos found $\rho$",
        default=None,
    )
    factor_proved: Number | None = key(
        "that factor", unit="1", type="Number", null="where none is proved", default=None
    )
    theta_max_proved: Number | None = key(
        "the largest theta that is proved", unit="1", type="Number", null="where none is", default=None
    )
    theta_predicted: float | None = key(r"$2/(2+\rho)$, no bound with friction", unit="1", null=_REFUSED, default=None)
    rate_predicted: float | None = key(
        r"$\rho/(2+\rho)$, no bound with friction", unit="1", null=_REFUSED, default=None
    )
    rho_min: Number | None = key(**_ENDS, default=None)
    rho_tied: Number | None = key(**_ENDS, default=None)
    friction_threshold: Number | None = key(
        "friction below which every small theta is proved",
        unit="1",
        type="Number",
        null="without a law of friction, where $C_{t1}$ is infinite, and above 2000 contact nodes",
        default=None,
    )
    singular: bool = key(
        "whether the Neumann problem would be singular, as only contact holds that body; the role is then refused",
        default=False,
    )
    theta_auto: Choice | None = key(
        'what `theta = "auto"` takes',
        null="without a problem, and above 2000 contact nodes, where nothing runs",
        why="no problem file",
        default=None,
    )
    reason: Mapping[str, str]
    energy: EnergyConstants | None = None
    spectrum: Spectrum | None = None
    cells: Suggested | None = None
    level: Level = "known"

    @property
    def ends(self) -> tuple[Fraction, Fraction] | None:
        """rho_min and rho_tied; None where they are not known."""
        if self.rho_min is None or self.rho_tied is None:
            return None
        largest = Fraction(self.rho_tied.value)
        return min(Fraction(self.rho_min.value), largest), largest  # which may be rounded past

    @property
    @says(
        r"$2/(2+\rho_{\min}+\rho)$ of these two: the best theta where nothing opens or slips",
        unit="1",
        null="where they are",
        why=lambda role: role.why_not_tied,
    )
    def theta_tied(self) -> float | None:
        return None if self.ends is None else float(tied_theta(*self.ends))

    @property
    @says(
        r"$(\rho-\rho_{\min})/(2+\rho_{\min}+\rho)$: at that theta no step has a larger factor, where nothing opens or "
        "slips",
        unit="1",
        null="where they are",
        why=lambda role: role.why_not_tied,
    )
    def rate_tied(self) -> float | None:
        return None if self.ends is None else float(tied_rate(*self.ends))

    @property
    @says(**_OF_CELLS)
    def rho_cells(self) -> Number | None:
        return ABSENT if self.cells is None else self.cells.of_file.numbers.get(NAMES[False])

    @property
    @says(**_OF_CELLS)
    def rho_normal_cells(self) -> Number | None:
        return ABSENT if self.cells is None else self.cells.of_file.numbers.get(NAMES[True])

    @property
    @says(
        r"cells of one shape with common nodes, whose diagonals mirror each other, wider than high where $\nu$ is "
        r"above 1/3: suggested where they make $\rho^*$ ($\rho_N^*$ without friction) at least 5 % smaller",
        name="cells",
        null=r"elsewhere, and where $\rho$ of the mesh is larger than $\rho^*$, because then long waves or the ends of "
        r"$\Gamma_c$ decide",
        absent=_NO_FILE,
        why=lambda role: role.cells.why,
    )
    def suggested(self) -> Suggested | None:
        return ABSENT if self.cells is None else self.cells if self.cells.cells else None

    def factor_where_tied(self, theta: float) -> float | None:
        """The factor of another theta where nothing opens or slips; above 1 where it diverges."""
        return None if self.ends is None else float(tied_factor(Fraction(theta), *self.ends))

    @property
    def why_not_tied(self) -> str:
        """Why the ends of the spectrum are not known."""
        return self.reason.get("rho_min", "")

    @property
    def predicted(self) -> tuple[float, float]:
        """``theta_predicted`` and ``rate_predicted``; ValueError where the role is refused or rho is only bounded."""
        if self.theta_predicted is None or self.rate_predicted is None:
            raise ValueError(self.reason["theta_predicted"])
        return self.theta_predicted, self.rate_predicted

    def advised(self, *, tied: bool = False) -> tuple[float, float]:
        """theta and the rate by which it is chosen: the predicted ones, or those for a tied interface.

        Where eigenvalues are complex, or estimated, the whole spectrum decides.  ValueError where the role is refused,
        or the ends of its spectrum are not known.
        """
        if self.spectrum is not None and (self.spectrum.source == "vectors" or not self.spectrum.real):
            return self.spectrum.theta, self.spectrum.factor(self.spectrum.theta)
        if not tied:
            return self.predicted
        if self.theta_tied is None or self.rate_tied is None:
            raise ValueError(self.reason["rho"] if self.rho is None else self.why_not_tied)
        return self.theta_tied, self.rate_tied

    @property
    def proved(self) -> bool:
        """True if the predicted rate is proved, as it is without friction."""
        bound = self.factor_proved
        return bound is not None and self.rate_predicted is not None and bound.value <= (1 + 1e-9) * self.rate_predicted

    @classmethod
    def unknown(cls, neumann_body: BodyNumber | None, why: str, **known: Any) -> Role:
        """A role of which only rho may be known: no value but the reason."""
        values = [field.name for field in fields(cls) if field.name not in (*OTHERS, *known)]
        given: dict[str, Any] = {"rho": None, "neumann_body": neumann_body, "reason": dict.fromkeys(values, why)}
        return cls(**given | known)

    @classmethod
    def refused(cls, neumann_body: BodyNumber, error: ValueError, *, of_file: bool = False) -> Role:
        """A role, of a problem file or of other input, that is refused."""
        why = f"these roles are refused: {error.needed if isinstance(error, ProblemError) else error}"
        cells, singular = no_cells(why) if of_file else None, isinstance(error, SingularRole)
        return replace(cls.unknown(neumann_body, why), cells=cells, singular=singular)


#: The fields of a role that have no reason beside them.
OTHERS = ("neumann_body", "reason", "singular", "energy", "spectrum", "cells", "level")


def role_of(
    neumann_body: BodyNumber | None,
    rho: Number | Fraction,
    *,
    bounds: EnergyBounds | None = None,
    nothing: str = "",
    threshold: Number | None = None,
    no_threshold: str = "",
    reason: Mapping[str, str] | None = None,
    **known: Any,
) -> Role:
    """The role for a known rho: its prediction, and the proofs of the theorem in energy norms, which are ``bounds``.

    ``nothing`` says why nothing is proved, ``no_threshold`` why there is no friction below which every small theta is,
    if it is not for want of a proof, ``reason`` why other values are None; ``known`` are other attributes of the role.
    """
    ratio = Fraction(rho.value) if isinstance(rho, Number) else rho
    theta, rate = float(predicted_theta(ratio)), float(predicted_rate(ratio))
    proved: dict[str, Any] = {}
    because = dict.fromkeys(PROVED, nothing)
    if bounds is not None:
        theta, rate = bounds.theta_predicted, bounds.rate_predicted
        if not nothing:
            proved = {name: getattr(bounds, name) for name in PROVED}
            because = {name: why for name, why in bounds.to_dict()["reason"].items() if name in PROVED}
    if threshold is None:
        because["friction_threshold"] = no_threshold or nothing
    return Role(
        neumann_body=neumann_body,
        rho=rho if isinstance(rho, Number) else Number.of_float(rho),
        theta_predicted=theta,
        rate_predicted=rate,
        friction_threshold=threshold,
        reason={**(reason or {}), **because},
        **proved,
        **known,
    )


def role_on(neumann_body: BodyNumber | None, spectrum: Spectrum, *, least: float = 0.0, **settings: Any) -> Role:
    """The role of a spectrum, ends below ``least`` counting as that; ``settings`` are parameters of :func:`role_of`."""
    low, high = (Number.of_float(max(end, least)) for end in (spectrum.low, spectrum.high))
    return role_of(neumann_body, high, rho_min=low, rho_tied=high, spectrum=spectrum, **settings)


def unnumbered(of: str) -> dict[str, str]:
    """Why the body of a role has no number."""
    return {"neumann_body": f"{of} do not tell which body had the Neumann problem"}


def estimated(spectrum: Spectrum, of: str, *, least: float = 0.0) -> Role:
    """The role of a spectrum that was estimated; ``of`` names what it was read from, ``least`` is as in role_on."""
    nothing = f"{of}, from which eigenvalues were estimated, prove nothing"
    role = role_on(None, spectrum, nothing=nothing, least=least, reason=unnumbered(of), level="estimated")
    if least >= 0:
        return role
    why = dict.fromkeys(
        ("theta_predicted", "rate_predicted"), "a coupling of kind general: no eigenvalue is known to be 0"
    )
    return replace(role, theta_predicted=None, rate_predicted=None, reason={**role.reason, **why})


def plain_role(neumann_body: BodyNumber, rho: Fraction, **settings: Any) -> Role:
    """The role without friction, from rho; ``settings`` are parameters of :func:`role_of`."""
    bounds = evaluate_energy(EnergyConstants(rho=rho))
    settings.setdefault("no_threshold", "matrices say nothing about friction: the proved values are for k = 0")
    return role_of(neumann_body, bounds.rho, bounds=bounds, **settings)


def with_both_ends(roles: Sequence[Role], rho: Sequence[Number | None] = ()) -> tuple[Role, ...]:
    """Both roles of a pair on the same unknowns, with the ends of the spectrum where neither is refused.

    The eigenvalues of (S_n, S_c) and (S_c, S_n) are reciprocal: ``rho_min`` of one role is one over rho of the other.
    Both ``rho`` are given where the roles have rho_normal.
    """
    one, other = rho or [role.rho for role in roles]
    if one is None or other is None:
        return tuple(roles)
    least = [Number.of_float(1 / Fraction(number.value)) for number in (other, one)]
    ends = zip(roles, least, (one, other), strict=True)
    return tuple(replace(role, rho_min=low, rho_tied=high) for role, low, high in ends)


def in_steps(rate: float) -> str:
    """The steps to 1e-9 in words."""
    count = steps(rate)
    return "no end of steps" if count is None else f"{count} step{'s' * (count != 1)}"


def fewer(rate: float, other: float, *, either: bool = False) -> bool:
    """True if a rate takes fewer steps than another one, or with ``either`` more, by more than SAME of them."""
    one, two = (math.inf if count is None else count for count in map(steps, (rate, other)))
    return one < (1 - SAME) * two or (either and two < (1 - SAME) * one)

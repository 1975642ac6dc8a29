"""What is known of the iteration when one body gets the Neumann problem."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Literal

from ndtheory import EnergyBounds, EnergyConstants, Number
from ndtheory.energy_norms import predicted_rate, predicted_theta, tied_factor, tied_rate, tied_theta
from verification.algorithm.theta import Choice
from verification.interface.assembly import SingularRole
from verification.problem import ProblemError

#: What a refused role has a value of.
NO_VALUES = ("neumann_body", "reason", "singular", "energy")

#: Exchanging the roles makes no difference where it changes the number of steps by no more than this share of it.
SAME = 0.02

#: The entries of a role that rest on an upper bound of rho.
PROVED = ("theta_proved", "factor_proved", "theta_max_proved")

#: What is known of a tied interface, in this order.
TIED = ("rho_min", "rho_tied", "theta_tied", "rate_tied")

#: Why it is not known of a run of another code.
ONE_END = "residuals show one end of the spectrum"


@dataclass(frozen=True, kw_only=True)
class Role:
    """What is known of the iteration when one body gets the Neumann problem.

    Attributes
    ----------
    neumann_body : {1, 2} or None
        None where it is not known which body that is.
    rho : Number or None
        Stiffness of the contact body over that of the Neumann body, at worst; with rho_normal without friction.  From
        moduli alone a bound from below.  None, as all that rests on it, where the role is refused.
    theta_proved : float or None
        The theta of least proved factor.
    factor_proved, theta_max_proved : Number or None
    theta_predicted, rate_predicted : float or None
        ``2/(2 + rho)`` and ``rho/(2 + rho)``: a prediction, proved without friction; None of a bound from below.
    friction_threshold : Number or None
        Friction below which every small theta is proved.
    singular : bool
        Whether the Neumann problem has no unique solution, as contact alone holds that body; such a role is refused.
    reason : mapping
        Why a value is None.
    theta_auto : Choice or None
        What ``theta = "auto"`` takes in these roles; None where there is no problem file.
    energy : EnergyConstants or None
        What the proved values rest on; None where nothing is proved.
    rho_min, rho_tied : Number or None
        Both ends of the spectrum of (S of the contact body, S of the Neumann body): rho_tied is rho, but where rho is
        rho_normal.  None where they are not known, and ``reason["rho_min"]`` says why.
    """

    neumann_body: Literal[1, 2] | None
    rho: Number | None
    theta_proved: float | None
    factor_proved: Number | None
    theta_max_proved: Number | None
    theta_predicted: float | None
    rate_predicted: float | None
    friction_threshold: Number | None
    reason: Mapping[str, str]
    singular: bool = False
    theta_auto: Choice | None = None
    energy: EnergyConstants | None = None
    rho_min: Number | None = None
    rho_tied: Number | None = None

    @property
    def ends(self) -> tuple[Fraction, Fraction] | None:
        """rho_min and rho_tied; None where they are not known."""
        if self.rho_min is None or self.rho_tied is None:
            return None
        largest = Fraction(self.rho_tied.value)
        return min(max(Fraction(self.rho_min.value), Fraction(0)), largest), largest  # both may be rounded past

    @property
    def theta_tied(self) -> float | None:
        """``2/(2 + rho_min + rho_tied)``: the best theta where nothing opens or slips."""
        return None if self.ends is None else float(tied_theta(*self.ends))

    @property
    def rate_tied(self) -> float | None:
        """``(rho_tied - rho_min)/(2 + rho_min + rho_tied)``: at that theta no step has a larger factor there."""
        return None if self.ends is None else float(tied_rate(*self.ends))

    def factor_where_tied(self, theta: float) -> float | None:
        """The factor of another theta where nothing opens or slips; above 1 where it diverges."""
        return None if self.ends is None else float(tied_factor(Fraction(theta), *self.ends))

    def advised(self, *, tied: bool = False) -> tuple[float, float]:
        """theta and the rate by which it is chosen: the predicted ones, or those of a tied interface.

        Raises
        ------
        ValueError
            The role is refused, or the ends of its spectrum are not known.
        """
        if not tied:
            return self.predicted
        if self.theta_tied is None or self.rate_tied is None:
            raise ValueError(self.reason["rho"] if self.rho is None else self.why_not_tied)
        return self.theta_tied, self.rate_tied

    @property
    def proved(self) -> bool:
        """Whether the predicted rate is proved, as it is without friction."""
        bound = self.factor_proved
        return bound is not None and self.rate_predicted is not None and bound.value <= (1 + 1e-9) * self.rate_predicted

    @property
    def why_not_tied(self) -> str:
        """Why the ends of the spectrum are not known."""
        return self.reason.get("rho_min", ONE_END)

    @property
    def predicted(self) -> tuple[float, float]:
        """``theta_predicted`` and ``rate_predicted``.

        Raises
        ------
        ValueError
            The role is refused, or rho is bounded from below only.
        """
        if self.theta_predicted is None or self.rate_predicted is None:
            raise ValueError(self.reason["theta_predicted"])
        return self.theta_predicted, self.rate_predicted

    def to_dict(self) -> dict[str, Any]:
        """A member of ``roles``."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "energy"}
        values |= {name: getattr(self, name) for name in TIED}
        values["reason"] = dict(self.reason)
        if self.theta_auto is None:
            values["reason"].setdefault("theta_auto", "no problem file")
        if self.ends is None:
            values["reason"] |= dict.fromkeys(TIED, self.why_not_tied)
        return {name: v.to_dict() if isinstance(v, (Number, Choice)) else v for name, v in values.items()}

    @classmethod
    def refused(cls, neumann_body: Literal[1, 2], error: ValueError) -> Role:
        """A role of which nothing is known but why it is refused."""
        why = error.needed if isinstance(error, ProblemError) else str(error)
        values = [name for name in cls.__dataclass_fields__ if name not in NO_VALUES]
        return cls(
            neumann_body=neumann_body,
            **dict.fromkeys(values),
            reason=dict.fromkeys(values, f"these roles are refused: {why}"),
            singular=isinstance(error, SingularRole),
        )


def role_of(
    neumann_body: Literal[1, 2] | None,
    rho: Number,
    *,
    bounds: EnergyBounds | None = None,
    nothing: str = "",
    threshold: Number | None = None,
    no_threshold: str = "",
    ratio: Fraction | None = None,
    reason: Mapping[str, str] | None = None,
    **known: Any,
) -> Role:
    """The role of which rho is known: what it predicts, and what the theorem in energy norms proves.

    Parameters
    ----------
    neumann_body : {1, 2} or None
    rho : Number
    bounds : EnergyBounds, optional
        The theorem for this rho, and for the friction there is.
    nothing : str
        Why nothing is proved; empty where the bounds are.
    threshold : Number, optional
        Friction below which every small theta is proved.
    no_threshold : str
        Why that is None, if it is not for want of a proof.
    ratio : Fraction, optional
        rho before it was rounded.
    reason : mapping, optional
        Why other values are None.
    **known
        Other attributes of :class:`Role`.
    """
    ratio = Fraction(rho.value) if ratio is None else ratio
    theta, rate = float(predicted_theta(ratio)), float(predicted_rate(ratio))
    proved: dict[str, Any] = dict.fromkeys(PROVED)
    because = dict.fromkeys(PROVED, nothing)
    if bounds is not None:
        theta, rate = bounds.theta_predicted, bounds.rate_predicted
    if bounds is not None and not nothing:
        proved = {name: getattr(bounds, name) for name in PROVED}
        because = {name: why for name, why in bounds.reason.items() if name in PROVED}
    if threshold is None:
        because["friction_threshold"] = no_threshold or nothing
    return Role(
        neumann_body=neumann_body,
        rho=rho,
        theta_predicted=theta,
        rate_predicted=rate,
        friction_threshold=threshold,
        reason={**(reason or {}), **because},
        **proved,
        **known,
    )


def with_both_ends(roles: Sequence[Role]) -> tuple[Role, ...]:
    """Both roles of a pair on the same unknowns, with the ends of the spectrum where neither is refused.

    The eigenvalues of (S_n, S_c) are the reciprocals of those of (S_c, S_n): ``rho_min`` of one role is one over
    ``rho`` of the other.
    """
    one, other = (role.rho for role in roles)
    if one is None or other is None:
        return tuple(roles)
    least = [Number.of_float(1 / Fraction(rho.value)) for rho in (other, one)]
    return tuple(replace(role, rho_min=low, rho_tied=role.rho) for role, low in zip(roles, least, strict=True))


def steps(rate: float, tolerance: float = 1e-9) -> int | None:
    """How many steps of a rate lead to a tolerance; None where none do."""
    if not 0 < rate < 1:
        return 1 if rate == 0 else None
    return math.ceil(math.log(tolerance) / math.log(rate))


def best_of(roles: Iterable[Role], *, tied: bool = False) -> Role:
    """The role that takes fewer steps; the first one where it makes no difference, or where the other is refused."""
    first, *rest = (role for role in roles if role.rho is not None)
    return next((role for role in rest if fewer(role.advised(tied=tied)[1], first.advised(tied=tied)[1])), first)


def in_steps(rate: float) -> str:
    """The steps to 1e-9 in words."""
    count = steps(rate)
    return "no end of steps" if count is None else f"{count} step{'s' * (count != 1)}"


def fewer(rate: float, other: float, *, either: bool = False) -> bool:
    """Whether a rate takes fewer steps than another one, or with ``either`` more, by more than SAME of them."""
    one, two = (math.inf if count is None else count for count in map(steps, (rate, other)))
    return one < (1 - SAME) * two or (either and two < (1 - SAME) * one)

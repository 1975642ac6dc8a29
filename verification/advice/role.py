"""What is known of the iteration when one body gets the Neumann problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ndtheory import EnergyConstants, Number
from verification.algorithm.theta import Choice
from verification.interface.pair import SingularRole
from verification.problem import ProblemError

#: What a refused role has a value of.
NO_VALUES = ("neumann_body", "reason", "singular", "energy")


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
        values["reason"] = dict(self.reason)
        if self.theta_auto is None:
            values["reason"].setdefault("theta_auto", "no problem file")
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

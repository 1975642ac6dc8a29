"""The answer of the theorem in energy norms, the result of :func:`ndtheory.energy_norms.evaluate_energy`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ndtheory.bounds import NO_PROVED_INTERVAL, Conclusion
from ndtheory.number import Number


@dataclass(frozen=True, kw_only=True)
class EnergyBounds:
    """What the theorem in energy norms says.

    Attributes
    ----------
    rho : Number
        The one at work: rho_normal without friction, where it is known.
    kappa_1, kappa_2 : Number
    ratio : Number
        r, the largest ``|d_1|/|d_2|``.
    friction_multiple : Number or None
        The factor by which friction may grow until no small theta is proved: times k it is the threshold k_s.  None
        without friction.
    friction_limit_multiple : Number or None
        The factor by which it may grow until no theta at all is proved: times k it is k_e >= k_s.  None without
        friction.
    interval : tuple of float or None
        q < 1 for lo < theta < hi, capped at 1; None where q >= 1 everywhere.
    interval_proved : tuple of float or None
        The same whichever of the constants enclosed are the true ones; None where there are no such thetas, or no
        enclosures.
    theta_proved : float or None
        The theta of least q; None where q >= 1 everywhere.
    factor_proved : Number or None
        q there.
    theta_max_proved : Number or None
        The upper end of the interval.
    theta_predicted, rate_predicted : float
        ``2/(2 + rho)`` and ``rho/(2 + rho)``: proved without friction, a prediction with it.
    theta : float or None
        The one asked about; None where none was given.
    factor, one_minus_factor : Number or None
        q(theta) < 1 and 1 - q; None outside the interval.
    verdict : {'contraction', 'no conclusion'} or None
        Whether theta lies in the interval; None without theta.
    """

    rho: Number
    kappa_1: Number
    kappa_2: Number
    ratio: Number
    friction_multiple: Number | None
    friction_limit_multiple: Number | None
    interval: tuple[float, float] | None
    interval_proved: tuple[float, float] | None
    theta_proved: float | None
    factor_proved: Number | None
    theta_max_proved: Number | None
    theta_predicted: float
    rate_predicted: float
    theta: float | None
    factor: Number | None
    one_minus_factor: Number | None
    verdict: Conclusion | None

    @property
    def reason(self) -> dict[str, str]:
        """Why a value is None."""
        reasons: dict[str, str] = {}
        if self.friction_multiple is None:
            reasons |= dict.fromkeys(("friction_multiple", "friction_limit_multiple"), "no friction")
        if self.interval is None:
            names = ("interval", "theta_proved", "factor_proved", "theta_max_proved")
            reasons |= dict.fromkeys(names, "q >= 1 for every theta")
        if self.interval_proved is None:
            reasons["interval_proved"] = NO_PROVED_INTERVAL
        if self.theta is None:
            reasons |= dict.fromkeys(("theta", "factor", "one_minus_factor", "verdict"), "no theta given")
        elif self.factor is None:
            reasons |= dict.fromkeys(("factor", "one_minus_factor"), "theta outside the interval: no conclusion")
        return reasons

    def to_dict(self) -> dict[str, Any]:
        """The object ``editions.energy`` of ``ndtheory.bounds/1``; what is null has a reason beside it."""
        result: dict[str, Any] = {}
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            result[name] = value.to_dict() if isinstance(value, Number) else value
        for name in ("interval", "interval_proved"):
            result[name] = None if result[name] is None else list(result[name])
        return {**result, "reason": self.reason}

"""The theorem in energy norms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ndtheory import evaluate_energy
from ndtheory.number import Numeric, weakest
from verification.bounds.bound import Bound, BoundResult, Subject, Thresholds, why_not
from verification.progress import Progress, silent

if TYPE_CHECKING:
    from verification.constants import Measured


class Energy(Bound):
    """The same proof as Section 5, with no constant larger than it must be; see ``docs/energy.md``."""

    name, words = "energy", "the theorem in energy norms"
    colour, dashes, fill, hatch = "#00724F", (0, (7, 2)), "#8FD3B6", ".."
    attained = True  # without friction
    certifies = True

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        if subject.energy is None:
            return self.absent(subject.why_energy)
        found = evaluate_energy(subject.energy, theta)
        friction = Thresholds(every=found.friction_multiple, some=found.friction_limit_multiple, on="multiple")
        why, without = "", False
        if subject.measured is not None:  # then they are known on k
            measured = subject.measured
            friction = Thresholds(every=measured.friction_threshold, some=measured.friction_limit, on="k")
            without = measured.C_t1 is None  # at 0 alone: no friction is allowed
            if theta is not None and found.factor is None:
                why = why_not(found.interval, friction.some, measured.friction, found.theta)
        return BoundResult(
            name=self.name,
            proved=True,
            theta=found.theta,
            factor=found.factor,
            one_minus_factor=found.one_minus_factor,
            interval=found.interval_proved or found.interval,
            interval_level=weakest([subject.energy.level, "verified"]) if found.interval_proved else "float",
            friction=Thresholds(on="any") if friction.every is None and not without else friction,
            why=why,
            detail=found,
        )

    def objects(self, result: BoundResult, measured: Measured) -> dict[str, dict[str, Any] | None]:
        """Its document with both rho and both thresholds on k."""
        document = result.to_dict()
        if document is None:
            return {self.name: None}
        threshold = measured.friction_threshold
        if threshold is None:
            document["reason"] |= dict.fromkeys(("friction_threshold", "friction_limit"), measured.why_no_threshold)
        number = lambda value: None if value is None else value.to_dict()
        document |= {
            "rho": number(measured.rho_max),
            "rho_normal": number(measured.rho_normal),
            "rho_at_work": document["rho"],
            "friction_threshold": number(threshold),
            "friction_limit": number(measured.friction_limit),
        }
        return {self.name: document}

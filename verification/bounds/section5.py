"""The theorem of Section 5, as printed and repaired."""

from __future__ import annotations

from ndtheory import PRINTED, REPAIRED, evaluate
from ndtheory.bounds import Edition
from ndtheory.number import Numeric, weakest
from verification.bounds.bound import Bound, BoundResult, Subject, Thresholds, why_not
from verification.progress import Progress, silent


class Section5(Bound):
    """An edition of Proposition 5.6.

    Parameters
    ----------
    edition : Edition
    """

    edition: Edition

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        if subject.constants is None:
            return self.absent(subject.why)
        found = evaluate(self.edition, subject.constants, theta)
        why = ""
        if theta is not None and found.factor is None:
            friction = float(subject.constants.C_K if subject.constants.k is None else subject.constants.k)
            why = why_not(found.interval, found.C2, friction, found.theta) + self._unit(subject)
        return BoundResult(
            name=self.name,
            proved=found.proved,
            theta=found.theta,
            factor=found.factor,
            one_minus_factor=found.one_minus_factor,
            interval=found.interval_proved or found.interval,
            interval_level=weakest([subject.constants.level, "verified"]) if found.interval_proved else "float",
            friction=Thresholds(every=found.C4, some=found.C2, on="any" if found.C2 is None else found.threshold_on),
            why=why,
            detail=found,
        )

    def _unit(self, subject: Subject) -> str:
        """What a figure of this edition must be told with."""
        return ""


class Printed(Section5):
    """As the paper prints it: in a unit of stress in which m >= 1."""

    name, words, edition = "printed", "the theorem as printed", PRINTED
    colour, dashes, fill, hatch = "#555555", ":", "#555555", "xx"
    finding = of_unit = True

    def _unit(self, subject: Subject) -> str:
        return "" if subject.measured is None else f" (in {subject.measured.units['stress']})"

    def remarks(self, result: BoundResult | None, unit: str) -> tuple[str, ...]:
        return (f"{self.name}: with stresses in {unit}; in another unit its figures are others",)


class Repaired(Section5):
    """With the lost power of m put back: the same in every unit."""

    name, words, edition = "repaired", "the theorem repaired", REPAIRED
    colour, dashes, fill, hatch = "#0B5A94", (0, (5, 1, 1, 1, 1, 1)), "#4A90C4", "//"
    certifies = True

"""The semidefinite bound: the Lipschitz constant of one step, between two bounds, for up to a hundred contact nodes."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from ndtheory import Number
from ndtheory.constants import relaxation_factor
from ndtheory.number import Numeric, below
from verification.bounds import LARGEST
from verification.bounds.bound import Bound, BoundResult, NotComputed, Region, Subject, Thresholds
from verification.progress import Progress, silent

if TYPE_CHECKING:
    from verification.bounds.exact import Enclosure
    from verification.bounds.multipliers import QuadraticForms
    from verification.interface.pair import ContactPair

#: How many friction values trace the border of its region.
TRACED = 12


def _rest(factor: Number) -> Number:
    """What a factor is below 1."""
    if factor.hi is None:
        return Number.of_float(1 - factor.value)
    least = below(1 - Fraction(factor.hi))
    return Number(value=max(1 - factor.value, least), lo=least, level=factor.level)


class SemidefiniteBound(Bound):
    """The factor proved by multipliers of the conditions of step II; see ``docs/energy.md``."""

    name, words = "lmi", "the semidefinite bound"
    colour, dashes, fill = "#8A5A00", "-.", "#FFF3B0"
    calculated = False
    attained = True  # without friction
    apart = certifies = True

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        if theta is None or subject.pair is None or subject.measured is None:
            return self.absent("needed a pair of bodies and a theta")
        if subject.pair.contact.grid.n > LARGEST:
            return self.absent(f"{subject.pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        from verification.bounds.lipschitz import LMIError, work_out

        chosen = relaxation_factor(theta)
        theta = float(chosen)
        try:
            found = work_out(subject.pair, subject.measured, theta, exact=subject.exact, progress=progress)
        except (LMIError, ValueError) as error:
            return self.absent(str(error))
        if subject.measured.unverified is not None:  # proofs were asked for
            found = found.proved(subject.pair, subject.measured, chosen, progress=progress)
        factor, allowed, largest = found.factor, found.friction_threshold, found.theta_max
        return BoundResult(
            name=self.name,
            proved=True,
            theta=theta,
            factor=factor,
            one_minus_factor=None if factor is None else _rest(factor),
            interval=None if largest is None else (0.0, largest.value if largest.lo is None else largest.lo),
            interval_level="float" if largest is None else largest.level,
            friction=Thresholds(
                every=allowed, on="k" if allowed is not None or subject.measured.C_t1 is None else "any"
            ),
            why=found.why_no_factor,
            not_computed=found.gave_up if factor is None else "",
            detail=found,
        )

    def remarks(self, result: BoundResult | None, unit: str) -> tuple[str, ...]:
        found = None if result is None else result.detail
        if found is None:
            return ()
        said = [f"{self.name}: {found.lower:.3f} occurs for some loads, {found.gap:.2%} less"]
        if found.divided is not None:
            divided = f"dividing the pieces of T gives {found.divided.value:#.4g} in doubles"
            said.append(f"{self.name}: proved is the factor of one program; {divided}")
        if found.unverified is not None and not found.certified:
            said.append(f"{self.name} is not proved: {found.not_proved}")
        return tuple(said)

    def enclose(self, pair: ContactPair, forms: QuadraticForms, theta: float) -> Enclosure:
        from verification.bounds.exact import enclose

        return enclose(pair, forms, theta, gap=float("inf"), programs=1)

    def region(self, subject: Subject, *, progress: Progress = silent) -> Region:
        from verification.bounds.lipschitz import LMIError, thetas

        pair, measured = subject.pair, subject.measured
        if pair is None or measured is None or measured.friction_threshold is None:
            raise NotComputed("needed a pair of bodies with a law of friction")
        if pair.contact.grid.n > LARGEST:
            raise NotComputed(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        try:
            last, kept = thetas(pair, measured, TRACED, progress=progress)
        except (LMIError, ValueError) as error:
            raise NotComputed(str(error)) from None
        return Region(k=tuple(k for k, _ in kept), theta=tuple((0.0, end) for _, end in kept), every=last, some=None)

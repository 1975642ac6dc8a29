"""The semidefinite bound beside the others: programs are loaded once it is worked out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ndtheory.constants import relaxation_factor
from ndtheory.number import Numeric
from verification.bounds.bound import Bound, BoundResult, NotComputed, Region, Subject, Thresholds, rest_of, trace
from verification.machine.progress import Progress, silent
from verification.registry import BOUNDS
from verification.semidefinite import LARGEST, LMIError

if TYPE_CHECKING:
    from fractions import Fraction

    from verification.constants import Measured
    from verification.interface.pair import ContactPair
    from verification.semidefinite.lipschitz import Enclosure
    from verification.semidefinite.multipliers import QuadraticForms

#: Friction values that trace the border of the region, at most.
TRACED = 25


def pair_of(subject: Subject, needed: str, *, law: bool = False) -> tuple[ContactPair, Measured]:
    """The pair of a subject and its constants, where it is small enough for programs.

    Raises
    ------
    NotComputed
        Without a pair, with ``law`` also without a law of friction: ``needed``; with more than LARGEST nodes.
    """
    pair, measured = subject.pair, subject.measured
    if pair is None or measured is None or (law and measured.friction_threshold is None):
        raise NotComputed(needed)
    if pair.contact.grid.n > LARGEST:
        raise NotComputed(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
    return pair, measured


def asked(subject: Subject, theta: Numeric | None) -> tuple[ContactPair, Measured, Fraction]:
    """The pair of a subject, its constants, and the theta of a factor; NotComputed as by :func:`pair_of`."""
    needed = "needed a pair of bodies and a theta"
    if theta is None:
        raise NotComputed(needed)
    return *pair_of(subject, needed), relaxation_factor(theta)


class SemidefiniteBound(Bound):
    """The factor proved by multipliers of the conditions of step II, up to LARGEST nodes; see ``docs/energy.md``."""

    name, words = "lmi", "the semidefinite bound"
    colour, dashes, fill = "#8A5A00", "-.", "#EDC95E"
    calculated, repeats = False, 1e-4
    attained = True  # without friction
    apart = certifies = divides = True

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        from verification.semidefinite.lipschitz import work_out

        try:
            pair, measured, chosen = asked(subject, theta)
        except NotComputed as error:
            return self.absent(str(error))
        theta = float(chosen)
        try:
            found = work_out(pair, measured, theta, exact=subject.exact, progress=progress)
        except (LMIError, ValueError) as error:
            return self.absent(str(error))
        if measured.unverified is not None:  # proofs were asked for
            found = found.proved(pair, measured, chosen, progress=progress)
        factor, allowed, largest = found.factor, found.friction_threshold, found.theta_max
        on = "k" if allowed is not None or measured.C_t1 is None else "any"
        return BoundResult(
            name=self.name,
            proved=True,
            theta=theta,
            factor=factor,
            one_minus_factor=None if factor is None else rest_of(factor),
            interval=None if largest is None else (0.0, largest.value if largest.lo is None else largest.lo),
            interval_level="float" if largest is None else largest.level,
            friction=Thresholds(every=allowed, on=on),
            why=found.why_no_factor,
            not_computed=found.gave_up if factor is None else "",
            detail=found,
        )

    def curve(self, subject: Subject, thetas: Sequence[float]) -> list[float | None]:
        from verification.semidefinite.multipliers import QuadraticForms

        forms = QuadraticForms(*pair_of(subject, "needed a pair of bodies"))
        return [forms.factor(theta).value for theta in thetas]

    def remarks(self, result: BoundResult | None, unit: str) -> tuple[str, ...]:
        found = None if result is None else result.detail
        if found is None:
            return ()
        said = [f"{self.name}: some loads reach a factor of {found.lower:.3f}, {100 * found.gap:.2f} % less"]
        if found.divided is not None:
            divided = f"dividing the pieces of T gives {found.divided.value:#.4g} in doubles"
            said.append(f"{self.name}: proved is the factor of one program; {divided}")
        if found.unverified is not None and not found.certified:
            said.append(f"{self.name} is not proved: {found.not_proved}")
        return tuple(said)

    def enclose(
        self, pair: ContactPair, forms: QuadraticForms, theta: float, *, exact: bool, progress: Progress
    ) -> Enclosure:
        from verification.semidefinite.lipschitz import CERTIFIED, CLOSE, budget, enclose

        programs = min(CERTIFIED, 20 * budget(pair.contact.grid.n)) if exact else 1
        gap = CLOSE if exact else float("inf")
        return enclose(pair, forms, theta, gap=gap, programs=programs, progress=progress)

    def region(self, subject: Subject, *, progress: Progress = silent) -> Region:
        from verification.semidefinite.lipschitz import thetas

        pair, measured = pair_of(subject, "needed a pair of bodies with a law of friction", law=True)
        try:
            last, largest = thetas(pair, measured, progress=progress)
            interval = lambda k: None if (end := largest(k)) is None else (0.0, end)
            k, theta = trace(interval, last, TRACED)
        except (LMIError, ValueError) as error:
            raise NotComputed(str(error)) from None
        return Region(k=k, theta=theta, every=last, some=last)


BOUNDS.provide(SemidefiniteBound())

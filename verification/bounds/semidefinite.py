"""The semidefinite bound: the Lipschitz constant of one step, between two bounds, for up to a hundred contact nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from ndtheory import Number
from ndtheory.constants import relaxation_factor
from ndtheory.number import above, below
from verification.bounds.bound import LARGEST, Bound, BoundResult, NotComputed, Region, Subject, Thresholds
from verification.progress import Progress, silent
from verification.value import freeze

if TYPE_CHECKING:
    from verification.bounds.exact import Enclosure
    from verification.bounds.multipliers import Certified, QuadraticForms
    from verification.bounds.program import Weights
    from verification.constants import Measured
    from verification.interface.pair import ContactPair

#: How many friction values trace the border of its region.
TRACED = 12

#: Why no value of this bound is called certified.
NOT_CERTIFIED = "checked in doubles with a bound on their rounding, for the interface matrices as computed"


@dataclass(frozen=True, kw_only=True)
class Semidefinite:
    """What the semidefinite bound says of a pair of bodies at one theta.

    Attributes
    ----------
    lipschitz : Number
        A Lipschitz constant of T_theta in the norm (5.21), checked in doubles with a bound on their rounding.
    lower : float
        The largest factor found, of an affine piece of T_theta that some loads and gaps bring about.
    programs : int
        How many programs brought both so close.
    why_apart : str
        Why they are further apart than was asked for; empty where they are not.
    theta_max : Number or None
        Every smaller theta contracts; None where none is proved to.
    friction_threshold : Number or None
        Every small theta contracts below it; None without a law of friction.
    gave_up : str
        Why the solver proposed no multipliers at this theta, so that the known ones alone stand behind ``lipschitz``;
        empty where it did.
    no_threshold : str
        Why there is no friction threshold.
    whole : Certified or None
        What the multipliers of one program prove for all pieces of T together.
    divided : Number or None
        Where ``lipschitz`` is proved: the smaller one in doubles that dividing the pieces of T gives.
    largest : tuple of arrays
        The multipliers behind ``theta_max``, over theta.
    not_proved : str
        Why ``lipschitz`` is not proved; empty where it is.
    unverified : mapping or None
        Why ``theta_max`` or ``friction_threshold`` is not proved, where that was tried; None where it was not.
    """

    lipschitz: Number
    lower: float
    programs: int
    why_apart: str
    theta_max: Number | None
    friction_threshold: Number | None
    gave_up: str = ""
    no_threshold: str = "no law of friction"
    whole: Certified | None = None
    divided: Number | None = None
    largest: Weights = ()
    not_proved: str = NOT_CERTIFIED
    unverified: Mapping[str, str] | None = None

    @property
    def factor(self) -> Number | None:
        """The Lipschitz constant where it is a contraction factor."""
        return self.lipschitz if self.lipschitz.value < 1 else None

    @property
    def gap(self) -> float:
        """How far the bound is above the largest factor found, relatively."""
        return self.lipschitz.value / self.lower - 1

    @property
    def certified(self) -> bool:
        """Whether the factor is more than a number in doubles."""
        return self.lipschitz.level != "float"

    @property
    def why_no_factor(self) -> str:
        """Why there is no conclusion at this theta; empty where there is."""
        if self.factor is not None:
            return ""
        return self.gave_up or f"its bound {self.lipschitz.value:.3g} of the Lipschitz constant is not below 1"

    def to_dict(self) -> dict[str, Any]:
        """The object ``lmi`` of ``ndtheory.compare/1``."""
        numbers = {
            "factor": self.factor,
            "lipschitz": self.lipschitz,
            "theta_max": self.theta_max,
            "friction_threshold": self.friction_threshold,
        }
        reasons = {
            "factor": self.why_no_factor,
            "theta_max": "no theta is proved to contract at this friction",
            "friction_threshold": self.no_threshold,
        }
        reason = {name: reasons[name] for name, number in numbers.items() if number is None}
        return {
            **{name: None if number is None else number.to_dict() for name, number in numbers.items()},
            "lower": self.lower,
            "gap": self.gap,
            "programs": self.programs,
            "certified": self.certified,
            **({} if self.divided is None else {"divided": self.divided.to_dict()}),
            **({} if self.unverified is None else {"unverified": dict(self.unverified)}),
            "reason": reason if self.certified else reason | {"certified": self.not_proved},
        }

    def proved(
        self, pair: ContactPair, measured: Measured, theta: Fraction, *, progress: Progress = silent
    ) -> Semidefinite:
        """The same with numbers that are proved for the rational data, or the reasons why some are not.

        The Lipschitz constant that is proved is that of a single program: its multipliers hold for all pieces of T at
        once, and one quadratic form decides.  What dividing the pieces gives beyond it stays in ``divided``.

        Parameters
        ----------
        pair : ContactPair
            Of which this is said.
        measured : Measured
            Its constants.
        theta : Fraction
            At which it is.
        progress : callable
        """
        from verification.bounds.multipliers import QuadraticForms
        from verification.bounds.program import LMIError
        from verification.certificate.claims import Confirmation, NoCertificate  # it lists the bounds

        assert self.whole is not None
        try:
            confirmation = Confirmation(pair, progress=progress)
        except NoCertificate as error:
            return replace(self, not_proved=str(error), unverified=dict.fromkeys(self._found_beside(), str(error)))

        def multipliers(k: float) -> Weights:
            found = QuadraticForms(pair, measured, friction=k).friction_number()
            return tuple(2 * values for values in found.multipliers)

        proofs: dict[str, Callable[[Number], Fraction]] = {
            "theta_max": lambda number: confirmation.theta_max(number.value, self.largest),
            "friction_threshold": lambda number: confirmation.friction_threshold(number.value, multipliers),
        }
        kept: dict[str, Any] = {}
        why: dict[str, str] = {}
        for name, number in self._found_beside().items():
            try:
                least = below(proofs[name](number))
                kept[name] = Number(value=max(number.value, least), lo=least, level="verified")
            except (NoCertificate, LMIError) as error:
                why[name] = str(error)
        beside = replace(self, **kept, unverified=why)
        try:
            found = confirmation.factor(theta, self.whole.value, self.whole.multipliers)
        except NoCertificate as error:
            return replace(beside, not_proved=str(error))
        most = above(found)
        if not most < 1:
            return replace(beside, not_proved=f"1 - {float(1 - found):.3g} is proved, which no double tells from 1")
        number = Number(value=min(self.whole.value, most), hi=most, level="verified")
        return replace(beside, lipschitz=number, divided=self.lipschitz, not_proved="")

    def _found_beside(self) -> dict[str, Number]:
        """The largest theta and the friction threshold, where there are any."""
        found = {"theta_max": self.theta_max, "friction_threshold": self.friction_threshold}
        return {name: number for name, number in found.items() if number is not None}


def work_out(
    pair: ContactPair, measured: Measured, theta: float, *, exact: bool = False, progress: Progress = silent
) -> Semidefinite:
    """Solve the programs of a pair of bodies at one theta.

    Parameters
    ----------
    pair : ContactPair
    measured : Measured
        Its constants.
    theta : float
    exact : bool
        Go on to a gap of :data:`verification.bounds.exact.CLOSE`, however many programs that takes.
    progress : callable

    Raises
    ------
    LMIError
    ValueError
        As :class:`verification.bounds.multipliers.QuadraticForms`.
    """
    import numpy as np

    from verification.bounds.exact import CLOSE, GAP, budget, enclose
    from verification.bounds.multipliers import QuadraticForms, friction_threshold

    progress("semidefinite bound: largest theta", None)
    forms = QuadraticForms(pair, measured)
    largest = forms.largest_theta()
    energy = measured.friction_threshold
    allowed = None if energy is None else friction_threshold(pair, measured, energy.value, progress=progress)
    progress("semidefinite bound: factor of one step", None)
    asked = {"gap": CLOSE, "programs": None} if exact else {"gap": GAP, "programs": budget(pair.contact.grid.n)}
    found = enclose(pair, forms, theta, **asked, progress=progress)
    return Semidefinite(
        lipschitz=Number.of_float(found.upper.value),
        whole=replace(found.whole, multipliers=freeze(tuple(map(np.array, found.whole.multipliers)))),
        largest=() if largest is None else freeze(tuple(map(np.array, largest.multipliers))),
        lower=found.lower,
        programs=found.programs,
        why_apart=found.why_apart,
        theta_max=None if largest is None else Number.of_float(largest.value),
        friction_threshold=None if allowed is None else Number.of_float(allowed),
        gave_up=found.upper.gave_up,
        no_threshold=measured.why_no_threshold,
    )


def _rest(factor: Number) -> Number:
    """What a factor is below 1."""
    if factor.hi is None:
        return Number.of_float(1 - factor.value)
    least = below(1 - Fraction(factor.hi))
    return Number(value=max(1 - factor.value, least), lo=least, level=factor.level)


class SemidefiniteBound(Bound):
    """What multipliers of the conditions of step II prove, sign by sign of slip if need be; see ``docs/energy.md``."""

    name, words = "lmi", "the semidefinite bound"
    colour, dashes, fill = "#8A5A00", "-.", "#FFF3B0"
    calculated = False
    attained = True  # without friction
    apart = certifies = True

    def evaluate(self, subject: Subject, theta: Any = None, *, progress: Progress = silent) -> BoundResult:
        if theta is None or subject.pair is None or subject.measured is None:
            return self.absent("needed a pair of bodies and a theta")
        if subject.pair.contact.grid.n > LARGEST:
            return self.absent(f"{subject.pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        from verification.bounds.program import LMIError

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

    def enclose(self, pair: ContactPair, forms: QuadraticForms, theta: float) -> Enclosure:
        from verification.bounds.exact import enclose

        return enclose(pair, forms, theta, gap=float("inf"), programs=1)

    def region(self, subject: Subject, *, progress: Progress = silent) -> Region:
        import numpy as np

        from verification.bounds.multipliers import QuadraticForms, friction_threshold
        from verification.bounds.program import LMIError

        pair, measured = subject.pair, subject.measured
        if pair is None or measured is None or measured.friction_threshold is None:
            raise NotComputed("needed a pair of bodies with a law of friction")
        if pair.contact.grid.n > LARGEST:
            raise NotComputed(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        try:
            last = friction_threshold(pair, measured, measured.friction_threshold.value, progress=progress)
            kept = []
            for i, k in enumerate(last * np.arange(1, TRACED + 1) / TRACED):
                progress(f"semidefinite bound: largest theta at k = {k:.3g}", i / TRACED)
                found = QuadraticForms(pair, measured, friction=float(k)).largest_theta()
                if found is not None:
                    kept.append((float(k), (0.0, found.value)))
        except (LMIError, ValueError) as error:
            raise NotComputed(str(error)) from None
        return Region(k=tuple(k for k, _ in kept), theta=tuple(ends for _, ends in kept), every=last, some=None)

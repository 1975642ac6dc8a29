"""The free norm as a bound beside the others: it is worked out where it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import Number
from ndtheory.constants import relaxation_factor
from ndtheory.keys import Part, key
from ndtheory.number import Numeric
from verification.bounds.bound import Bound, BoundResult, NotComputed, Region, Subject, Thresholds, rest_of, trace
from verification.machine.progress import Progress, silent
from verification.registry import BOUNDS
from verification.semidefinite import LARGEST

if TYPE_CHECKING:
    from verification.constants import Measured
    from verification.interface.pair import ContactPair
    from verification.semidefinite.lipschitz import Enclosure
    from verification.semidefinite.multipliers import QuadraticForms

#: Friction values that trace the border of the region, at most.
TRACED = 15

NO_NORM = "no norm is found in which theta = {:g} contracts"

_none: dict[str, Any] = {"why": lambda found: found.why, "default": None}


@dataclass(frozen=True, kw_only=True)
class FreeNormOfPair(Part):
    """What is proved of a pair of bodies in a norm that the proof may choose."""

    part: ClassVar[str] = "Bound in the free norm"

    factor: Number | None = key("of one step, in the norm found", null="where no norm is found", **_none)
    condition: float | None = key(
        "of that norm: the largest over the least ratio of its square to that of (5.21)",
        null="where no norm is found",
        **_none,
    )
    radius: float = key("the largest spectral radius found of a piece of $T_\\theta$: no norm has a smaller factor")
    theta_best: float | None = key(
        "the theta of the least factor, to 0.01", null="where no theta is found to contract", **_none
    )
    factor_best: Number | None = key("there", null="where no theta is found to contract", **_none)
    theta_max: Number | None = key(
        "every theta up to it contracts", null="where no theta is found to contract", **_none
    )
    friction_threshold: Number | None = key(
        "every small theta contracts up to it, and some theta: the same, as smaller thetas contract, too",
        null="without a law of friction, or where none is found",
        why="no friction was found, or there is no law of friction",
        default=None,
    )
    why: str = ""


class FreeNormBound(Bound):
    """The least factor in any norm ``g' Q g`` that is found; see ``docs/free_norm.md``."""

    name, words = "lyapunov", "the free norm"
    colour, dashes, fill = "#7A2E8C", (0, (3, 1, 1, 1)), "#E3C8EA"
    calculated = False
    apart = on_request = certifies = True

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        pair, measured = subject.pair, subject.measured
        if theta is None or pair is None or measured is None:
            return self.absent("needed a pair of bodies and a theta")
        if pair.contact.grid.n > LARGEST:
            return self.absent(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        from verification.free_norm.norm import FreeNorm, largest_radius
        from verification.semidefinite.interior_point import LMIError

        step = float(relaxation_factor(theta))
        try:
            progress("free norm: factor of one step", None)
            free = FreeNorm(pair, measured)
            proof, largest = free.factor(step), free.largest_theta()
            progress("free norm: best theta", None)
            best = None if largest is None else free.best_theta(largest.theta)
            allowed = _friction(subject, progress)
        except (LMIError, ValueError) as error:
            return self.absent(str(error))
        why = "" if proof else NO_NORM.format(step)
        number = lambda value: None if value is None else Number.of_float(value)
        factor = number(proof and proof.factor)
        detail = FreeNormOfPair(
            factor=factor,
            condition=None if proof is None else proof.norm.condition,
            radius=largest_radius(pair, step)[0],
            theta_best=None if best is None else best.theta,
            factor_best=number(best and best.factor),
            theta_max=number(largest and largest.theta),
            friction_threshold=allowed,
            why=why or "no theta is found to contract",
        )
        on = "k" if allowed is not None or measured.C_t1 is None else "any"
        return BoundResult(
            name=self.name,
            proved=True,
            theta=step,
            factor=factor,
            one_minus_factor=None if factor is None else rest_of(factor),
            norm=None if proof is None else proof.norm,
            interval=None if largest is None else (0.0, largest.theta),
            friction=Thresholds(every=allowed, some=allowed, on=on),
            why=why,
            detail=detail,
        )

    def enclose(
        self, pair: ContactPair, forms: QuadraticForms, theta: float, *, exact: bool, progress: Progress
    ) -> Enclosure:
        from verification.free_norm.norm import FreeNorm, largest_radius
        from verification.semidefinite.interior_point import LMIError
        from verification.semidefinite.lipschitz import Enclosure, Leaf
        from verification.semidefinite.multipliers import Certified

        proof = FreeNorm(pair, forms.measured).factor(theta)
        if proof is None:
            raise LMIError(NO_NORM.format(theta))
        upper = Certified(
            value=proof.factor, evaluated=proof.factor, proposed=proof.factor, multipliers=proof.multipliers
        )
        everywhere, (lower, piece) = forms.everywhere, largest_radius(pair, theta)
        tree = Leaf(pieces=everywhere, upper=upper, proved_on=everywhere, proposal=None)
        return Enclosure(upper=upper, whole=upper, tree=tree, lower=lower, piece=piece, programs=0, norm=proof.norm)

    def remarks(self, result: BoundResult | None, unit: str) -> tuple[str, ...]:
        found = None if result is None else result.detail
        if found is None:
            return ()
        said = f"{self.name}: some piece of T has the spectral radius {found.radius:.3f}, below which no norm comes"
        if found.condition is None:
            return (said,)
        root = found.condition**0.5
        return (f"{self.name}: in a norm between (5.21) and {root:.3g} times (5.21), not in (5.21) itself", said)

    def region(self, subject: Subject, *, progress: Progress = silent) -> Region:
        pair, measured = subject.pair, subject.measured
        if pair is None or measured is None or measured.friction_threshold is None:
            raise NotComputed("needed a pair of bodies with a law of friction")
        if pair.contact.grid.n > LARGEST:
            raise NotComputed(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        from verification.free_norm.norm import FreeNorm
        from verification.semidefinite.interior_point import LMIError

        def interval(k: float) -> tuple[float, float] | None:
            progress(f"free norm: largest theta at k = {k:.3g}", None)
            found = FreeNorm(pair, measured, friction=k).largest_theta()
            return None if found is None else (0.0, found.theta)

        try:
            allowed = _friction(subject, progress)
            if allowed is None:
                raise NotComputed("no friction is found at which small thetas contract")
            k, theta = trace(interval, allowed.value, TRACED)
        except (LMIError, ValueError) as error:
            raise NotComputed(str(error)) from None
        return Region(k=k, theta=theta, every=allowed.value, some=allowed.value)

    def objects(self, result: BoundResult, measured: Measured, verdict: str) -> dict[str, Any]:
        """Its document with the verdict of the run on it, where it was asked for."""
        found = super().objects(result, measured, verdict)[self.name] if result.asked else None
        return {} if found is None else {self.name: found | {"verdict": verdict}}


def _friction(subject: Subject, progress: Progress) -> Number | None:
    """The friction below which every small theta contracts; None where none is found, or friction has no law."""
    from verification.free_norm.norm import friction_threshold
    from verification.semidefinite.interior_point import LMIError

    pair, measured = subject.pair, subject.measured
    if pair is None or measured is None or measured.friction_threshold is None:
        return None
    try:
        return Number.of_float(friction_threshold(pair, measured, measured.friction_threshold.value, progress=progress))
    except LMIError:
        return None


BOUNDS.provide(FreeNormBound())

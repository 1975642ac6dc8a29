"""The free norm as a bound beside the others: it is worked out where it is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import Number
from ndtheory.keys import Part, key
from ndtheory.number import Numeric, above
from verification.bounds.bound import Bound, BoundResult, NotComputed, Region, Subject, Thresholds, rest_of, trace
from verification.machine.progress import Progress, silent
from verification.registry import BOUNDS
from verification.semidefinite import LMIError
from verification.semidefinite.bound import asked, pair_of

if TYPE_CHECKING:
    from verification.algorithm.rates import ForceNorm
    from verification.constants import Measured
    from verification.free_norm.norm import Proved
    from verification.interface.pair import ContactPair
    from verification.semidefinite.lipschitz import Enclosure
    from verification.semidefinite.multipliers import QuadraticForms

#: Friction values that trace the border of the region, at most.
TRACED = 25

NO_NORM = "no factor below 1 is found for theta = {:g} in a norm"

_none: dict[str, Any] = {"why": lambda found: found.why, "default": None}


@dataclass(frozen=True, kw_only=True)
class FreeNormOfPair(Part):
    """The numbers proved of a pair of bodies in a norm that the proof may choose."""

    part: ClassVar[str] = "Bound in the free norm"

    factor: Number | None = key("of one step, in the norm found", null="where none below 1 is found", **_none)
    condition: float | None = key(
        "of that norm: the largest over the least ratio of its square to that of (5.21)",
        null="where no norm is found",
        **_none,
    )
    radius: float = key("the largest spectral radius found of a piece of $T_\\theta$: no norm has a smaller factor")
    theta_best: float | None = key(
        "the theta of the least factor, to 0.02", null="where no theta is found to contract", **_none
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
    unverified: Mapping[str, str] | None = key(
        "why one of these is not proved for the rational data", absent="without `--verified`", default=None
    )
    verdict: str | None = key("of the run in that norm, as in `verdicts`", absent="outside a comparison", default=None)
    why: str = ""


class FreeNormBound(Bound):
    """The least factor in any norm ``g' Q g`` that is found; see ``docs/free_norm.md``."""

    name, words = "lyapunov", "the free norm"
    colour, dashes, fill = "#7A2E8C", (0, (3, 1, 1, 1)), "#F6EAFA"
    calculated, repeats = False, 5e-3
    apart = on_request = certifies = True

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:

        try:
            pair, measured, chosen = asked(subject, theta)
        except NotComputed as error:
            return self.absent(str(error))
        try:
            detail, norm = _work_out(pair, measured, chosen, progress)
        except (LMIError, ValueError) as error:
            return self.absent(str(error))
        on = "any" if measured.friction_threshold is None and measured.C_t1 is not None else "k"
        largest = detail.theta_max
        return BoundResult(
            name=self.name,
            proved=True,
            theta=float(chosen),
            factor=detail.factor,
            one_minus_factor=None if detail.factor is None else rest_of(detail.factor),
            norm=norm,
            interval=None if largest is None else (0.0, largest.value),
            interval_level="float" if largest is None else largest.level,
            friction=Thresholds(every=detail.friction_threshold, some=detail.friction_threshold, on=on),
            why="" if detail.factor is not None else detail.why,
            detail=detail,
        )

    def curve(self, subject: Subject, thetas: Sequence[float]) -> list[float | None]:
        from verification.free_norm.norm import FreeNorm

        free = FreeNorm(*pair_of(subject, "needed a pair of bodies"))
        found = [free.factor(theta) for theta in thetas]
        return [None if proof is None else proof.factor for proof in found]

    def enclose(
        self, pair: ContactPair, forms: QuadraticForms, theta: float, *, exact: bool, progress: Progress
    ) -> Enclosure:
        from verification.free_norm.norm import FreeNorm
        from verification.free_norm.radius import largest_radius
        from verification.semidefinite.lipschitz import Enclosure, Leaf
        from verification.semidefinite.multipliers import Certified

        proof = FreeNorm(pair, forms.measured).factor(theta)
        if proof is None:
            raise LMIError(NO_NORM.format(theta))
        upper = Certified(
            value=proof.factor, evaluated=proof.factor, proposed=proof.factor, multipliers=proof.multipliers
        )
        everywhere, worst = forms.everywhere, largest_radius(pair, theta)
        tree = Leaf(pieces=everywhere, upper=upper, proved_on=everywhere, proposal=None)
        return Enclosure(
            upper=upper, whole=upper, tree=tree, lower=worst.value, piece=worst.pieces[0], programs=0, norm=proof.norm
        )

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
        pair, measured = pair_of(subject, "needed a pair of bodies with a law of friction", law=True)
        from verification.free_norm.norm import FreeNorm

        def interval(k: float) -> tuple[float, float] | None:
            progress(f"free norm: largest theta at k = {k:.3g}", None)
            found = FreeNorm(pair, measured, friction=k).largest_theta()
            return None if found is None else (0.0, found.theta)

        try:
            allowed = _friction(pair, measured, progress)
            if allowed is None:
                raise NotComputed("no friction is found at which small thetas contract")
            k, theta = trace(interval, allowed[0], TRACED)
        except (LMIError, ValueError) as error:
            raise NotComputed(str(error)) from None
        return Region(k=k, theta=theta, every=allowed[0], some=allowed[0])

    def objects(self, result: BoundResult, measured: Measured, verdict: str) -> dict[str, Any]:
        """Its document with the verdict of the run on it, where it was asked for."""
        return {} if result.detail is None else {self.name: replace(result.detail, verdict=verdict)}


def _work_out(
    pair: ContactPair, measured: Measured, theta: Fraction, progress: Progress
) -> tuple[FreeNormOfPair, ForceNorm | None]:
    """The numbers for a pair, proved for its rational data where the constants were, and the norm of its factor."""
    from verification.free_norm.norm import FreeNorm
    from verification.free_norm.radius import largest_radius

    progress("free norm: factor of one step", None)
    free = FreeNorm(pair, measured)
    proof, largest = free.factor(float(theta)), free.largest_theta()
    progress("free norm: best theta", None)
    best = None if largest is None else free.best_theta(largest.theta)
    allowed = _friction(pair, measured, progress)
    found = {
        "factor": proof and proof.factor,
        "factor_best": best and best.factor,
        "theta_max": largest and largest.theta,
        "friction_threshold": allowed and allowed[0],
    }
    number: dict[str, Any] = {name: value and Number.of_float(value) for name, value in found.items()}
    unverified: dict[str, str] | None = None
    if measured.unverified is not None:  # proofs were asked for
        exact = None if best is None else Fraction(str(best.theta))
        proofs = {"factor": (theta, proof), "factor_best": (exact, best), "theta_max": (None, largest)}
        number, unverified = _verified(pair, number, proofs, allowed, progress)
    return FreeNormOfPair(
        **number,
        condition=None if proof is None else proof.norm.condition,
        radius=largest_radius(pair, float(theta)).value,
        theta_best=None if best is None else best.theta,
        why=NO_NORM.format(float(theta)) if proof is None else "no theta is found to contract",
        unverified=unverified,
    ), None if proof is None else proof.norm


def _verified(
    pair: ContactPair,
    numbers: Mapping[str, Number | None],
    proofs: Mapping[str, tuple[Fraction | None, Proved | None]],
    allowed: tuple[float, Proved] | None,
    progress: Progress,
) -> tuple[dict[str, Number | None], dict[str, str]]:
    """The numbers that are proved for the rational data, the others as they were, and why these are not proved.

    Proofs are of a factor at a theta, or of all thetas up to their own.
    """
    from verification.certificate.claims import Confirmation, NoCertificate, written_norm

    found, why = dict(numbers), dict[str, str]()
    try:
        confirmation = Confirmation(pair, progress=progress)
    except NoCertificate as error:
        return found, {name: str(error) for name, number in numbers.items() if number is not None}
    norm = lambda proof: written_norm(proof.norm, pair.neumann)
    for name, (theta, proof) in proofs.items():
        if proof is None:
            continue
        try:
            if theta is None:
                confirmation.contracts(proof.theta, proof.multipliers, norm(proof))
                found[name] = Number(value=proof.theta, lo=proof.theta, level="verified")
            else:
                most = above(confirmation.factor(theta, proof.factor, proof.multipliers, norm(proof)))
                found[name] = Number.within(proof.factor, None, most, "verified")
        except NoCertificate as error:
            why[name] = str(error)
    if allowed is not None:
        k, proof = allowed
        try:
            confirmation.contracts(proof.theta, proof.multipliers, norm(proof), k)
            found["friction_threshold"] = Number(value=k, lo=k, level="verified")
        except NoCertificate as error:
            why["friction_threshold"] = str(error)
    return found, why


def _friction(pair: ContactPair, measured: Measured, progress: Progress) -> tuple[float, Proved] | None:
    """The friction up to which every small theta contracts; None where none is found, or friction has no law."""
    from verification.free_norm.norm import friction_threshold

    if measured.friction_threshold is None:
        return None
    try:
        return friction_threshold(pair, measured, measured.friction_threshold.value, progress=progress)
    except LMIError:
        return None


BOUNDS.provide(FreeNormBound())

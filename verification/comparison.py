"""Bounds against observation: one honest verdict for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ndtheory import EDITIONS, Bounds, Number, SharpBounds, evaluate
from verification.algorithm.iterate import Iterate
from verification.algorithm.rates import StepRatio, largest_step_ratio
from verification.algorithm.runs import Run, run
from verification.algorithm.theta import sharp_bounds
from verification.bounds.losses import Losses, locate
from verification.bounds.table import LARGEST, EditionRow, Thresholds, row_of
from verification.constants import Measured, measure
from verification.contact import Solver
from verification.document import Document
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair
from verification.interrupts import INTERRUPTED
from verification.problem import Problem
from verification.progress import Progress, silent

if TYPE_CHECKING:
    from verification.bounds.semidefinite import Semidefinite

#: The editions whose violation is a bug or an error in a proof.
PROVED = ("repaired", "sharp", "lmi")

#: A bound may be attained: a ratio above it by less than this share of 1 - bound is equal to it.
TIGHT = 1e-6

#: A forecast comes true where its rate is the observed one to this, and its steps to one.
AGREES = 1e-3

Verdict = Literal["CONSISTENT", "VIOLATED", "INCONCLUSIVE", "HYPOTHESES_NOT_MET", "NOT_COMPUTED"]


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A verdict on one edition of the theorem, with its reason in words."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison(Document):
    """Constants, bounds, a run, and what the run says of each bound.

    Attributes
    ----------
    measured : Measured
    bounds : mapping from edition to Bounds
        Printed and repaired; empty where a constant does not exist.
    sharp : SharpBounds or None
        The theorem in energy norms.
    lmi : Semidefinite or None
        The semidefinite edition.
    losses : Losses or None
        What each inequality of the proof gives away.
    run : Run
    step_ratio : StepRatio or None
        The largest Lipschitz quotient seen.
    verdicts : mapping from edition to Judgement
        And of ``linearised``, the forecast made half way.
    reason : mapping
        Why sharp, lmi, losses or step_ratio is None.
    """

    schema: ClassVar[str] = "ndtheory.compare/1"

    measured: Measured
    bounds: Mapping[str, Bounds]
    sharp: SharpBounds | None
    lmi: Semidefinite | None
    losses: Losses | None
    run: Run
    step_ratio: StepRatio | None
    verdicts: Mapping[str, Judgement]
    reason: Mapping[str, str]

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.run.units

    @property
    def editions(self) -> list[EditionRow]:
        """Every edition there is, from the weakest to the strongest."""
        rows = [row_of(name, b) for name, b in self.bounds.items()]
        if self.sharp is not None:
            every, some = self.measured.friction_threshold, self.measured.friction_limit
            rows.append(
                row_of("sharp", self.sharp, Thresholds(every=every, some=some, on="any" if every is None else "k"))
            )
        if self.lmi is not None:
            factor, highest, allowed = self.lmi.factor, self.lmi.theta_max, self.lmi.friction_threshold
            rows.append(
                EditionRow(
                    name="lmi",
                    friction=Thresholds(every=allowed, on="any" if allowed is None else "k"),
                    interval=None if highest is None else (0.0, highest.value),
                    theta=float(self.run.theta),
                    factor=factor,
                    one_minus_factor=None if factor is None else Number.of_float(1 - factor.value),
                )
            )
        return rows

    @property
    def proved_violated(self) -> bool:
        """Whether a proved claim was violated: a bug, or an error in a proof.  A printed one violated is a finding."""
        return any(judgement.verdict == "VIOLATED" for name, judgement in self.verdicts.items() if name in PROVED)

    @property
    def inconclusive(self) -> bool:
        """Whether rounding hides an answer."""
        return any(judgement.verdict == "INCONCLUSIVE" for judgement in self.verdicts.values())

    def content(self) -> dict[str, Any]:
        editions: dict[str, Any] = {e.name: None for e in EDITIONS}
        editions |= {name: bounds.to_dict() for name, bounds in self.bounds.items()}
        editions["sharp"] = None if self.sharp is None else self.sharp.to_dict()
        why = next(iter(self.measured.reason.values()), "")
        return {
            "title": self.run.pair.title,
            "constants": self.measured.content(),
            "bounds": {
                "editions": editions,
                "reason": {name: why for name, value in editions.items() if value is None},
            },
            "sharp": self._sharp(),
            "lmi": None if self.lmi is None else self.lmi.to_dict(),
            "losses": None if self.losses is None else self.losses.to_dict(),
            "run": self.run.content(),
            "step_ratio": None
            if self.step_ratio is None
            else {"value": self.step_ratio.value, "interval": [self.step_ratio.lo, self.step_ratio.hi]},
            "verdicts": {name: judgement.verdict for name, judgement in self.verdicts.items()},
            "reasons": {name: judgement.reason for name, judgement in self.verdicts.items()},
            "reason": dict(self.reason),
        }

    def _sharp(self) -> dict[str, Any] | None:
        """The object ``sharp``: the edition's own document with both rho and both thresholds on k."""
        if self.sharp is None:
            return None
        measured, document = self.measured, self.sharp.to_dict()
        threshold = measured.friction_threshold
        if threshold is None:
            document["reason"] |= dict.fromkeys(("friction_threshold", "friction_limit"), "no law of friction")
        number = lambda value: None if value is None else value.to_dict()
        return document | {
            "rho": number(measured.rho_max),
            "rho_normal": number(measured.rho_normal),
            "rho_at_work": document["rho"],
            "friction_threshold": number(threshold),
            "friction_limit": number(measured.friction_limit),
        }


def judge(bound: float | None, seen: StepRatio | None, why_none: str) -> Judgement:
    """Hold a bound on the factor of one step against the largest factor seen.

    A bound may be attained: what lies above it by less than :data:`TIGHT` of ``1 - bound`` is not told from it.

    Parameters
    ----------
    bound : float or None
        None: the edition draws no conclusion; ``why_none`` says why.
    seen : StepRatio or None
        None: no step stands clear of rounding.

    Examples
    --------
    >>> judge(0.5, StepRatio(value=0.4, lo=0.39, hi=0.41, steps=9), "").verdict
    'CONSISTENT'
    """
    if bound is None:
        return Judgement(verdict="HYPOTHESES_NOT_MET", reason=why_none)
    if seen is None:
        return Judgement(verdict="INCONCLUSIVE", reason="no step stands clear of rounding")
    if seen.steps == 0:
        return Judgement(verdict="NOT_COMPUTED", reason="no step was taken")
    digits = 4 if seen.hi <= bound else 6  # six where the bound is attained or violated
    says = f"ratios <= {seen.value:.{digits}g} in {seen.steps} steps, bound {bound:.{digits}g}"
    if seen.hi <= bound:
        return Judgement(verdict="CONSISTENT", reason=says)
    slack = TIGHT * (1 - bound)
    if seen.lo > bound + slack:
        return Judgement(verdict="VIOLATED", reason=says)
    if seen.hi <= bound + slack:
        return Judgement(verdict="CONSISTENT", reason=f"{says}: attained")
    return Judgement(verdict="INCONCLUSIVE", reason=f"{says}: closer than rounding")


def judge_forecast(run: Run) -> Judgement:
    """Hold what was said half way against what the run then did."""
    made, seen = run.forecast, run.observed_rate
    if made is None:
        return Judgement(verdict="NOT_COMPUTED", reason=run.why_no_forecast)
    says = f"forecast {made.rate:.4g}, {made.iterations} steps"
    if run.outcome == "interrupted":
        return Judgement(verdict="NOT_COMPUTED", reason=f"{says}; the run was interrupted")
    if seen is None:
        return Judgement(verdict="VIOLATED", reason=f"{says}; the run {run.outcome}, and shows no rate")
    ended = "" if run.converged else f", {run.outcome}"
    right = abs(seen.value - made.rate) <= AGREES and abs(run.iterations - made.iterations) <= 1 and run.converged
    return Judgement(
        verdict="CONSISTENT" if right else "VIOLATED", reason=f"{says}; seen {seen.value:.4g}, {run.iterations}{ended}"
    )


def compare(
    problem: Problem | ContactPair | Path | str,
    *,
    theta: Any = None,
    solver: Solver = "auto",
    watch: Callable[[Iterate], None] = lambda state: None,
    progress: Progress = silent,
) -> Comparison:
    """Measure the constants, evaluate the bounds, run the algorithm, and judge.

    Parameters and errors as for :func:`verification.run`; ``progress`` is told what is being done.  Ctrl-C after the
    first state of the run leaves out what was still to come: ``run.interrupted`` is true, ``reason`` says what is
    missing.
    """
    pair = pair_of(problem)
    measured = measure(pair, progress=progress)
    progress("iterating", None)
    finished = run(pair, theta=theta, solver=solver, watch=watch, measured=measured)
    chosen, constants = finished.theta, measured.constants()
    bounds: dict[str, Bounds] = {} if constants is None else {e.name: evaluate(e, constants, chosen) for e in EDITIONS}
    sharp = sharp_bounds(measured, chosen)
    reason: dict[str, str] = {}
    lmi, losses = None, None
    if pair.contact.grid.n > LARGEST:
        reason |= dict.fromkeys(("lmi", "losses"), f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
    else:
        reason |= dict.fromkeys(("lmi", "losses"), INTERRUPTED)
    try:
        if pair.contact.grid.n <= LARGEST and not finished.interrupted:
            losses = locate(pair, measured, progress=progress)
            reason["losses"] = next(iter(measured.reason.values()), "a contact node is held")
            lmi, reason["lmi"] = _semidefinite(pair, float(chosen), measured, progress)
        progress("linearising", None)
        _ = finished.forecast, finished.linearised  # here, where Ctrl-C keeps what there is
    except KeyboardInterrupt:
        finished = replace(finished, interrupted=True)
    for name in [name for name, found in (("lmi", lmi), ("losses", losses)) if found is not None]:
        del reason[name]
    if sharp is None:
        reason["sharp"] = next(iter(measured.reason.values()), "")
    seen = largest_step_ratio(pair, finished.iterates)
    if seen is None:
        reason["step_ratio"] = "no step stands clear of rounding"

    outside = "outside the theorem: " + "; ".join(finished.outside) if finished.outside else ""
    if finished.relaxation != "constant" and not outside:
        outside = f"the editions speak of a constant theta, not of {finished.relaxation}"
    verdicts: dict[str, Judgement] = {}

    def hold(name: str, factor: Number | None, why: str, absent: str = "") -> None:
        if outside:
            verdicts[name] = Judgement(verdict="HYPOTHESES_NOT_MET", reason=outside)
        elif absent:
            verdicts[name] = Judgement(verdict="NOT_COMPUTED", reason=absent)
        else:
            verdicts[name] = judge(None if factor is None else factor.value, seen, why)

    unknown = next(iter(measured.reason.values()), "")
    friction = measured.friction
    for e in EDITIONS:
        if e.name not in bounds:
            hold(e.name, None, "", unknown)
        else:
            of = bounds[e.name]
            unit = f" (in {pair.units['stress']})" if e.name == "printed" else ""
            hold(e.name, of.factor, _why_not(of.interval, of.C2, friction, chosen) + unit)
    if sharp is None:
        hold("sharp", None, "", unknown)
    else:
        hold("sharp", sharp.factor, _why_not(sharp.interval, measured.friction_limit, friction, chosen))
    if lmi is None:
        hold("lmi", None, "", reason["lmi"])
    else:
        hold("lmi", lmi.factor, lmi.why_no_factor, lmi.gave_up if lmi.factor is None else "")
    verdicts["linearised"] = judge_forecast(finished)
    return Comparison(
        measured=measured,
        bounds=bounds,
        sharp=sharp,
        lmi=lmi,
        losses=losses,
        run=finished,
        step_ratio=seen,
        verdicts=verdicts,
        reason=reason,
    )


def _why_not(interval: tuple[float, float] | None, threshold: Number | None, friction: float, theta: Fraction) -> str:
    """Why an edition draws no conclusion."""
    if interval is not None:
        return f"theta = {float(theta):g} is outside ({interval[0]:.2g}, {interval[1]:.2g})"
    scale = threshold.value if threshold is not None else float("inf")
    return f"friction {friction:g} is not below {scale:.2g}"


def _semidefinite(
    pair: ContactPair, theta: float, measured: Measured, progress: Progress
) -> tuple[Semidefinite | None, str]:
    from verification.bounds.program import LMIError
    from verification.bounds.semidefinite import evaluate_lmi

    try:
        return evaluate_lmi(pair, measured, theta, progress=progress), ""
    except (LMIError, ValueError) as error:
        return None, str(error)

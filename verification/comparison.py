"""Bounds against observation: a verdict on each bound, with its reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ndtheory import EDITIONS
from verification.algorithm.iterate import Iterate
from verification.algorithm.rates import StepRatio, largest_step_ratio
from verification.algorithm.reference import Reference, by_cvxpy_alone
from verification.algorithm.relaxation import Constant
from verification.algorithm.runs import NOT_ASKED, Run, run
from verification.bounds.bound import LARGEST, BoundResult, Subject
from verification.bounds.losses import Losses, locate
from verification.bounds.table import BOUNDS
from verification.constants import Measured, measure
from verification.contact import ContactError, Solver
from verification.document import Document
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair
from verification.interrupts import INTERRUPTED
from verification.problem import Problem
from verification.progress import Progress, silent

if TYPE_CHECKING:
    from verification.figures import Figure

#: The bounds whose violation is a bug or an error in a proof.
NO_FINDING = tuple(bound.name for bound in BOUNDS.values() if not bound.finding)

#: A bound may be attained: a ratio above it by less than this share of 1 - bound is equal to it.
TIGHT = 1e-6

#: A forecast comes true where its rate is the observed one to this, and its steps to one.
AGREES = 1e-3

RunVerdict = Literal["CONSISTENT", "VIOLATED", "INCONCLUSIVE", "HYPOTHESES_NOT_MET", "NOT_COMPUTED"]


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A verdict on one bound, with its reason in words."""

    verdict: RunVerdict
    reason: str


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison(Document):
    """Constants, bounds, a run, and what the run says of each bound.

    Attributes
    ----------
    measured : Measured
    bounds : mapping from name to BoundResult
        From the weakest to the strongest.
    losses : Losses or None
        What each inequality of the proof gives away.
    run : Run
    step_ratio : StepRatio or None
        The largest Lipschitz quotient seen.
    cvxpy : Reference or None
        The run repeated with every step taken from cvxpy's own answer.
    verdicts : mapping from the name of a bound to Judgement
        And of ``linearised``, the forecast made half way.
    reason : mapping
        Why a bound, losses, step_ratio or cvxpy is missing.
    """

    schema: ClassVar[str] = "ndtheory.compare/1"

    measured: Measured
    bounds: Mapping[str, BoundResult]
    losses: Losses | None
    run: Run
    step_ratio: StepRatio | None
    cvxpy: Reference | None
    verdicts: Mapping[str, Judgement]
    reason: Mapping[str, str]

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.run.units

    @property
    def problem(self) -> Problem | None:  # type: ignore[override]
        """What was compared."""
        return self.run.problem

    @property
    def summary(self) -> str:
        verdicts = ", ".join(f"{name} {judgement.verdict}" for name, judgement in self.verdicts.items())
        return f"{self.run.pair.title}, {self.run.outcome}; {verdicts}"

    def plot(self) -> Figure:
        """The residuals beside what each bound proves of them."""
        from verification.figures import draw_residuals

        return draw_residuals(self.run, self.computed)

    @property
    def computed(self) -> list[BoundResult]:
        """The bounds that were worked out."""
        return [result for result in self.bounds.values() if result.detail is not None]

    @property
    def proved_violated(self) -> bool:
        """Whether a proved claim was violated: a bug, or an error in a proof.  A printed one violated is a finding."""
        return any(judgement.verdict == "VIOLATED" for name, judgement in self.verdicts.items() if name in NO_FINDING)

    @property
    def inconclusive(self) -> bool:
        """Whether rounding hides an answer."""
        return any(judgement.verdict == "INCONCLUSIVE" for judgement in self.verdicts.values())

    def content(self) -> dict[str, Any]:
        editions = {name: self.bounds[name].to_dict() for name in (*(e.name for e in EDITIONS), "sharp")}
        return {
            "title": self.run.pair.title,
            "constants": self.measured.content(),
            "bounds": {
                "editions": editions,
                "reason": {name: self.bounds[name].not_computed for name, value in editions.items() if value is None},
            },
            "sharp": self._sharp(),
            "lmi": self.bounds["lmi"].to_dict(),
            "losses": None if self.losses is None else self.losses.to_dict(),
            "run": self.run.content(),
            "step_ratio": None
            if self.step_ratio is None
            else {"value": self.step_ratio.value, "interval": [self.step_ratio.lo, self.step_ratio.hi]},
            "cvxpy": None if self.cvxpy is None else self.cvxpy.to_dict(),
            "verdicts": {name: judgement.verdict for name, judgement in self.verdicts.items()},
            "reasons": {name: judgement.reason for name, judgement in self.verdicts.items()},
            "reason": dict(self.reason),
        }

    def _sharp(self) -> dict[str, Any] | None:
        """The object ``sharp``: the bound's own document with both rho and both thresholds on k."""
        measured, document = self.measured, self.bounds["sharp"].to_dict()
        if document is None:
            return None
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
        None: the bound draws no conclusion; ``why_none`` says why.
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
    exact: bool = False,
    watch: Callable[[Iterate], None] = lambda state: None,
    progress: Progress = silent,
) -> Comparison:
    """Measure the constants, evaluate the bounds, run the algorithm, and judge.

    Ctrl-C after the first iterate of the run leaves out what was still to come: ``run.interrupted`` is true, ``reason``
    says what is missing.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    theta : number or 'auto', optional
        Relaxation factor, 0 < theta < 1; the problem's by default.
    solver : {'auto', 'cvxpy', 'active-set'}
        Who takes step II.
    exact : bool
        Bring the semidefinite bound to within 0.1 % of a factor that occurs, however many programs that takes.
    watch : callable
        Called with every iterate.
    progress : callable
        Told what is being done.

    Returns
    -------
    Comparison

    Raises
    ------
    ProblemError
        Bad input.
    HypothesisError
        theta outside (0, 1).
    ContactError
        Step II did not reach its KKT certificate at the first iterate.

    Examples
    --------
    >>> bars = {"dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 2, "young": 1, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 2, "young": 3, "prescribed": {"right": -0.1}}}
    >>> compare(Problem.from_dict(bars)).verdicts["sharp"].verdict
    'CONSISTENT'
    """
    pair = pair_of(problem)
    measured = measure(pair, progress=progress)
    progress("iterating", None)
    finished = run(pair, theta=theta, solver=solver, watch=watch, measured=measured)
    reason: dict[str, str] = {}
    losses, results = None, {name: bound.absent(INTERRUPTED) for name, bound in BOUNDS.items()}
    subject, interrupted = Subject.of(pair, measured, exact=exact), finished.interrupted
    try:
        if pair.contact.grid.n > LARGEST:
            reason["losses"] = f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}"
        elif interrupted:
            reason["losses"] = INTERRUPTED
        else:
            reason["losses"] = INTERRUPTED
            losses = locate(pair, measured, progress=progress)
            reason["losses"] = next(iter(measured.reason.values()), "a contact node is held")
    except KeyboardInterrupt:
        interrupted = True
    for name, bound in BOUNDS.items():
        try:
            if bound.calculated or not interrupted:
                results[name] = bound.evaluate(subject, finished.theta, progress=progress)
        except KeyboardInterrupt:
            interrupted = True
    cvxpy, reason["cvxpy"] = None, INTERRUPTED
    try:
        if not interrupted:
            progress("linearising", None)
            finished = finished.linearise()
            progress("repeating the run by cvxpy alone", None)
            cvxpy = by_cvxpy_alone(finished)
    except ContactError as error:
        reason["cvxpy"] = str(error)
    except KeyboardInterrupt:
        interrupted = True
    if cvxpy is not None:
        del reason["cvxpy"]
    if interrupted:
        finished = replace(finished, interrupted=True)
        if finished.why_not_linearised == NOT_ASKED:
            finished = finished.linearise()  # which says why there is nothing
    if losses is not None:
        del reason["losses"]
    for name in ("sharp", "lmi"):
        if results[name].detail is None:
            reason[name] = results[name].not_computed
    seen = largest_step_ratio(pair, finished.iterates)
    if seen is None:
        reason["step_ratio"] = "no step stands clear of rounding"

    outside = "outside the theorem: " + "; ".join(finished.outside) if finished.outside else ""
    if not isinstance(finished.rule, Constant) and not outside:
        outside = f"the bounds speak of a constant theta, not of {finished.relaxation}"
    verdicts = {name: _verdict(result, seen, outside) for name, result in results.items()}
    verdicts["linearised"] = judge_forecast(finished)
    return Comparison(
        measured=measured,
        bounds=results,
        losses=losses,
        run=finished,
        step_ratio=seen,
        cvxpy=cvxpy,
        verdicts=verdicts,
        reason=reason,
    )


def _verdict(result: BoundResult, seen: StepRatio | None, outside: str) -> Judgement:
    """What the run says of one bound."""
    if outside:
        return Judgement(verdict="HYPOTHESES_NOT_MET", reason=outside)
    if result.not_computed:
        return Judgement(verdict="NOT_COMPUTED", reason=result.not_computed)
    return judge(None if result.factor is None else result.factor.value, seen, result.why)

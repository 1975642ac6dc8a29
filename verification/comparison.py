"""Bounds against observation: a verdict on each bound, with its reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from ndtheory import EDITIONS
from ndtheory.number import Numeric
from verification.algorithm.iterate import Iterate
from verification.algorithm.rates import StepRatio, largest_step_ratio
from verification.algorithm.reference import Reference, by_cvxpy_alone
from verification.algorithm.relaxation import Constant
from verification.algorithm.runs import Run, check_memory, run
from verification.algorithm.theta import Choice, begin
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
from verification.verdicts import Judgement, judge_bound, judge_forecast

#: The bounds whose violation is a bug or an error in a proof.
NO_FINDING = tuple(bound.name for bound in BOUNDS.values() if not bound.finding)

T = TypeVar("T")


class Listener:
    """Hears each part of a comparison as soon as it is known, in the order of these methods.

    Here nothing is done with them; a screen shows them.  Ctrl-C in a method leaves out what is still to come.
    """

    def constants(self, measured: Measured, choice: Choice) -> None:
        """The constants, and the theta of the run."""

    def bounds(self, results: Sequence[BoundResult], measured: Measured) -> None:
        """The bounds that follow from the constants."""

    def run(self, finished: Run) -> None:
        """The run, linearised."""

    def cvxpy(self, reference: Reference | None, why: str) -> None:
        """The run by cvxpy alone, or why there is none."""

    def losses(self, losses: Losses | None, why: str) -> None:
        """What each inequality of the proof gives away, or why that is not known."""

    def programs(self, results: Sequence[BoundResult]) -> None:
        """The bounds that take the matrices of the pair."""


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

    def tell(self, listener: Listener) -> None:
        """Tell each part, as it was told when it was worked out."""
        listener.constants(self.measured, self.run.choice)
        listener.bounds(self._bounds(calculated=True), self.measured)
        listener.run(self.run)
        listener.cvxpy(self.cvxpy, self.reason.get("cvxpy", ""))
        listener.losses(self.losses, self.reason.get("losses", ""))
        listener.programs(self._bounds(calculated=False))

    def _bounds(self, *, calculated: bool) -> list[BoundResult]:
        return [result for name, result in self.bounds.items() if BOUNDS[name].calculated == calculated]

    @property
    def computed(self) -> list[BoundResult]:
        """The bounds that were worked out."""
        return [result for result in self.bounds.values() if result.worked_out]

    @property
    def proved_violated(self) -> bool:
        """Whether a proved claim was violated: a bug, or an error in a proof.  A printed one violated is a finding."""
        return any(judgement.verdict == "VIOLATED" for name, judgement in self.verdicts.items() if name in NO_FINDING)

    @property
    def inconclusive(self) -> bool:
        """Whether rounding hides an answer."""
        return any(judgement.verdict == "INCONCLUSIVE" for judgement in self.verdicts.values())

    def content(self) -> dict[str, Any]:
        editions = {name: self.bounds[name].to_dict() for name in (*(e.name for e in EDITIONS), "energy")}
        return {
            "title": self.run.pair.title,
            "constants": self.measured.content(),
            "bounds": {
                "editions": editions,
                "reason": {name: self.bounds[name].not_computed for name, value in editions.items() if value is None},
            },
            "energy": self._energy(),
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

    def _energy(self) -> dict[str, Any] | None:
        """The object ``energy``: the bound's own document with both rho and both thresholds on k."""
        measured, document = self.measured, self.bounds["energy"].to_dict()
        if document is None:
            return None
        threshold = measured.friction_threshold
        if threshold is None:
            document["reason"] |= dict.fromkeys(("friction_threshold", "friction_limit"), measured.why_no_threshold)
        number = lambda value: None if value is None else value.to_dict()
        return document | {
            "rho": number(measured.rho_max),
            "rho_normal": number(measured.rho_normal),
            "rho_at_work": document["rho"],
            "friction_threshold": number(threshold),
            "friction_limit": number(measured.friction_limit),
        }


def compare(
    problem: Problem | ContactPair | Path | str,
    *,
    theta: Numeric | None = None,
    solver: Solver = "auto",
    exact: bool = False,
    verified: bool = False,
    watch: Callable[[Iterate], None] = lambda state: None,
    progress: Progress = silent,
    listener: Listener | None = None,
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
    verified : bool
        Prove bounds of the constants for the exact data of the problem, of what follows from them, and the factor that
        one semidefinite program gives.  What could not be proved keeps the level ``float``.
    watch : callable
        Called with every iterate.
    progress : callable
        Told what is being done.
    listener : Listener, optional
        Told each part when it is known, what takes long last.

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
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(1, 3))
    >>> compare(bars).verdicts["energy"].verdict
    'CONSISTENT'
    """
    pair, listener = pair_of(problem), listener or Listener()
    check_memory(pair)  # nothing is told of a run that would be refused
    measured = measure(pair, verified=verified, progress=progress)
    choice, subject = begin(pair, theta, None, measured)[1], Subject.of(pair, measured, exact=exact)
    results = {
        name: bound.evaluate(subject, choice.theta) if bound.calculated else bound.absent(INTERRUPTED)
        for name, bound in BOUNDS.items()
    }
    listener.constants(measured, choice)
    listener.bounds([result for name, result in results.items() if BOUNDS[name].calculated], measured)
    progress("iterating", None)
    finished = run(pair, theta=theta, solver=solver, watch=watch, measured=measured)
    left = _UntilCtrlC(finished.interrupted)

    progress("linearising", None)
    linearised = left.work(finished.linearise, None)
    finished = linearised or replace(finished, interrupted=True).linearise()  # which says why there is nothing
    left.tell(listener.run, finished)
    progress("repeating the run by cvxpy alone", None)
    no_reference: tuple[Reference | None, str] = (None, INTERRUPTED)
    cvxpy, no_cvxpy = left.work(lambda: _reference(finished), no_reference)
    left.tell(listener.cvxpy, cvxpy, no_cvxpy)
    none_lost: tuple[Losses | None, str] = (None, INTERRUPTED)
    losses, no_losses = left.work(lambda: _losses(pair, measured, progress), none_lost)
    left.tell(listener.losses, losses, no_losses)
    programs = [name for name, bound in BOUNDS.items() if not bound.calculated]
    for name in programs:
        evaluate = BOUNDS[name].evaluate
        results[name] = left.work(lambda: evaluate(subject, choice.theta, progress=progress), results[name])  # noqa: B023
    left.tell(listener.programs, [results[name] for name in programs])

    finished = replace(finished, interrupted=left.interrupted)
    missing = {"losses": no_losses, "cvxpy": no_cvxpy}
    missing |= {name: results[name].not_computed for name in ("energy", "lmi") if results[name].detail is None}
    reason = {name: why for name, why in missing.items() if why}
    seen = largest_step_ratio(pair, finished.iterates)
    if seen is None:
        reason["step_ratio"] = "no step stands clear of rounding"

    outside = "outside the theorem: " + "; ".join(finished.outside) if finished.outside else ""
    if not isinstance(finished.rule, Constant) and not outside:
        outside = f"the bounds speak of a constant theta, not of {finished.relaxation}"
    verdicts = {name: judge_bound(result, seen, outside) for name, result in results.items()}
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


class _UntilCtrlC:
    """Work that is left: after Ctrl-C nothing more of it is begun, and all of it is told.

    Parameters
    ----------
    interrupted : bool
        Whether there was a Ctrl-C before.
    """

    def __init__(self, interrupted: bool) -> None:
        self.interrupted = interrupted

    def work(self, compute: Callable[[], T], missing: T) -> T:
        """What is computed; what is given instead where Ctrl-C came first."""
        if not self.interrupted:
            try:
                return compute()
            except KeyboardInterrupt:
                self.interrupted = True
        return missing

    def tell(self, method: Callable[..., None], *parts: Any) -> None:
        """Tell one part."""
        try:
            method(*parts)
        except KeyboardInterrupt:
            self.interrupted = True


def _reference(finished: Run) -> tuple[Reference | None, str]:
    """The run by cvxpy alone, or why there is none."""
    try:
        return by_cvxpy_alone(finished), ""
    except ContactError as error:
        return None, str(error)


def _losses(pair: ContactPair, measured: Measured, progress: Progress) -> tuple[Losses | None, str]:
    """What each inequality gives away, or why that was not worked out."""
    if pair.contact.grid.n > LARGEST:
        return None, f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}"
    found = locate(pair, measured, progress=progress)
    return found, "" if found is not None else measured.why_no_constants or "a contact node is held"

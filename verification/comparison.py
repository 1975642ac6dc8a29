"""Comparison of bounds with observation: a verdict on each bound, with its reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from ndtheory.keys import derived, key, says
from ndtheory.number import Numeric
from verification.algorithm.iterate import Iterate
from verification.algorithm.rates import StepRatio, largest_step_ratio
from verification.algorithm.reference import Reference, by_cvxpy_alone
from verification.algorithm.relaxation import Constant
from verification.algorithm.runs import Run, check_memory, run, unwatched
from verification.algorithm.theta import Choice, choose
from verification.bounds.bound import NOT_ASKED, BoundResult, Subject
from verification.bounds.losses import Losses
from verification.bounds.table import BY_NAME, EnergyOfPair, chosen
from verification.bounds.verdicts import Judgement, judge_bound, judge_forecast
from verification.constants import Measured, measure
from verification.contact import ContactError, Solver
from verification.document import Document
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair
from verification.machine.interrupts import INTERRUPTED
from verification.machine.progress import Progress, silent
from verification.problem import Problem
from verification.registry import BOUNDS, PROOFS

T = TypeVar("T")


class Listener:
    """A receiver of each part of a comparison as soon as it is known, in the order of these methods.

    This one ignores them; a screen shows them, the answer, which needs the run, before what led to it.  A part that was
    not asked for is left out.  Ctrl-C in a method leaves out all later parts.
    """

    def constants(self, measured: Measured, choice: Choice) -> None:
        """The constants, and the theta of the run."""

    def bounds(self, results: Sequence[BoundResult], measured: Measured) -> None:
        """The bounds that follow from the constants."""

    def run(self, finished: Run) -> None:
        """The run, linearised."""

    def cvxpy(self, reference: Reference | None, why: str) -> None:
        """The run by cvxpy only, or why there is none."""

    def losses(self, losses: Losses | None, why: str) -> None:
        """The factor that each inequality of the proof loses, or why that is not known."""

    def programs(self, results: Sequence[BoundResult]) -> None:
        """The bounds that need the matrices of the pair."""


def _beside_each_other(bounds: Mapping[str, BoundResult]) -> dict[str, BoundResult]:
    """The bounds that share one key of the document."""
    return {name: bound for name, bound in bounds.items() if not BOUNDS[name].apart}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison(Document):
    """Constants, bounds, a run, and a verdict of the run on each bound.

    Attributes
    ----------
    bounds : mapping from name to BoundResult
        From the weakest to the strongest.
    verdicts : mapping from the name of a bound to Judgement
        Also of ``linearised``, the forecast made half way.
    reason : mapping
        Why a bound, losses, step_ratio or cvxpy is missing; losses and cvxpy come with bounds that need the matrices.
    """

    schema: ClassVar[str] = "ndtheory.compare/1"

    measured: Measured = key("measured on the mesh", name="constants")
    bounds: Mapping[str, BoundResult] = key(name="bounds.editions", of=_beside_each_other, inside=BY_NAME)
    losses: Losses | None = key(
        "how much each inequality of the proof loses", null="where it was not worked out, or `lmi` was not asked for"
    )
    run: Run = key("the iteration, linearised at its end")
    step_ratio: StepRatio | None = key(
        "the largest Lipschitz quotient of T between iterates", null="where no step is clear of rounding errors"
    )
    cvxpy: Reference | None = key(
        "the run repeated with every step II taken from cvxpy's own answer",
        null="where it gave none, or `lmi` was not asked for",
    )
    verdicts: Mapping[str, Judgement] = key(
        "one for each bound and for `linearised`, the forecast: `CONSISTENT`, `VIOLATED`, `INCONCLUSIVE`, "
        "`HYPOTHESES_NOT_MET` or `NOT_COMPUTED`",
        of=lambda verdicts: {name: judgement.verdict for name, judgement in verdicts.items()},
        type="map of text",
    )
    reason: Mapping[str, str]

    title = derived("title of the problem", lambda comparison: comparison.run.pair.title)
    energy = derived(
        "the bound in energy norms",
        lambda comparison: comparison.objects.get("energy"),
        EnergyOfPair,
        null=r"where $\rho$ does not exist, or it was not asked for",
    )
    lmi = derived(
        "the semidefinite bound",
        lambda comparison: comparison.objects.get("lmi"),
        type="Semidefinite bound",
        null="where it was not worked out, as with more than 100 contact nodes",
    )
    lyapunov = derived(
        "the bound in a norm that the proof chooses",
        lambda comparison: comparison.objects.get("lyapunov"),
        type="Bound in the free norm",
        absent="where it was not asked for, or not worked out",
    )

    @property
    @says()
    def reasons(self) -> dict[str, str]:
        """Why that verdict."""
        return {name: judgement.reason for name, judgement in self.verdicts.items()}

    @property
    @says(name="bounds.reason")
    def not_computed(self) -> dict[str, str]:
        """Why one of `bounds.editions` is null."""
        bounds = _beside_each_other(self.bounds)
        return {name: bound.not_computed for name, bound in bounds.items() if not bound.worked_out}

    @property
    def objects(self) -> dict[str, Any]:
        """The documents of single bounds, which are beside ``bounds``."""
        own = [
            BOUNDS[name].objects(result, self.measured, self.verdicts[name].verdict)
            for name, result in self.bounds.items()
        ]
        return {key: value for objects in own for key, value in objects.items()}

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.run.units

    @property
    def problem(self) -> Problem | None:  # type: ignore[override]
        """The problem of the run."""
        return self.run.problem

    @property
    def summary(self) -> str:
        verdicts = ", ".join(f"{name} {judgement.verdict}" for name, judgement in self.verdicts.items())
        return f"{self.title}, {self.run.outcome}; {verdicts}"

    def tell(self, listener: Listener) -> None:
        """Pass each part to a listener, in the order in which they were computed."""
        listener.constants(self.measured, self.run.choice)
        if calculated := self._asked(calculated=True):
            listener.bounds(calculated, self.measured)
        listener.run(self.run)
        if programs := self._asked(calculated=False):
            listener.cvxpy(self.cvxpy, self.reason.get("cvxpy", ""))
            listener.losses(self.losses, self.reason.get("losses", ""))
            listener.programs(programs)

    def _asked(self, *, calculated: bool) -> list[BoundResult]:
        return [
            result for name, result in self.bounds.items() if BOUNDS[name].calculated == calculated and result.asked
        ]

    @property
    def computed(self) -> list[BoundResult]:
        """The bounds that were computed."""
        return [result for result in self.bounds.values() if result.worked_out]

    @property
    def proved_violated(self) -> bool:
        """True if a proved claim was violated: a bug, or an error in a proof.  A violated printed one is a finding."""
        violated = {name for name, judgement in self.verdicts.items() if judgement.verdict == "VIOLATED"}
        return any(not BOUNDS[name].finding for name in violated & set(self.bounds))

    @property
    def inconclusive(self) -> bool:
        """True if rounding hides an answer."""
        return any(judgement.verdict == "INCONCLUSIVE" for judgement in self.verdicts.values())

    def content(self) -> dict[str, Any]:
        return self.objects | super().content()


def compare(
    problem: Problem | ContactPair | Path | str,
    *,
    theta: Numeric | None = None,
    solver: Solver = "auto",
    exact: bool = False,
    verified: bool = False,
    bounds: Sequence[str] | str | None = None,
    watch: Callable[[Iterate], None] = unwatched,
    progress: Progress = silent,
    listener: Listener | None = None,
) -> Comparison:
    """Measure the constants, evaluate the bounds, run the algorithm, and judge.

    Ctrl-C after the first iterate of the run leaves out all later parts: ``run.interrupted`` is true, ``reason`` names
    what is missing.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    theta : number or 'auto', optional
        Relaxation factor, 0 < theta < 1; the problem's by default.
    solver : {'auto', 'cvxpy', 'active-set'}
        Solver of step II.
    exact : bool
        Bring the semidefinite bound to within 0.1 % of a factor that occurs, however many programs that takes.
    verified : bool
        Prove bounds of the constants for the exact data of the problem, of what follows from them, and the factor that
        one semidefinite program gives.  What could not be proved keeps the level ``float``.
    bounds : sequence of str, optional
        Names of :data:`verification.registry.BOUNDS`; all but ``lyapunov`` by default.  The others are
        ``NOT_COMPUTED``.  Unless one of the names needs the matrices of the bodies, as the semidefinite bound does, a
        comparison costs little more than its run: the other slow parts, ``losses`` and ``cvxpy``, are left out, too.
    watch : callable
        Called with every iterate.
    progress : callable
        Called with the name of each part when it begins.
    listener : Listener, optional
        Receives each part when it is known, slow parts last.

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
    ValueError
        An unknown bound, or none.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(1, 3))
    >>> found = compare(bars, bounds=["repaired", "energy"])
    >>> found.verdicts["energy"].verdict, found.verdicts["lmi"].reason
    ('CONSISTENT', 'not asked for')
    """
    asked, listener = chosen(bounds), listener or Listener()
    pair = pair_of(problem)
    check_memory(pair)  # before anything is shown of a run that would be refused
    measured = measure(pair, verified=verified, progress=progress)
    choice, subject = choose(pair, theta, measured), Subject.of(pair, measured, exact=exact)
    calculated = [name for name in asked if BOUNDS[name].calculated]
    programs = [name for name in asked if not BOUNDS[name].calculated]
    left_out = {name: INTERRUPTED if name in asked else NOT_ASKED for name in (*chosen(None), *asked)}
    results = {name: bound.absent(left_out[name]) for name, bound in BOUNDS.items() if name in left_out}
    results |= {name: BOUNDS[name].evaluate(subject, choice.theta) for name in calculated}
    listener.constants(measured, choice)
    if calculated:
        listener.bounds([results[name] for name in calculated], measured)
    progress("iterating", None)
    finished = run(pair, theta=theta, solver=solver, watch=watch, measured=measured)
    left = _UntilCtrlC(finished.interrupted)

    progress("linearising", None)
    linearised = left.work(finished.linearise, None)
    finished = linearised or replace(finished, interrupted=True).linearise()  # which says why there is nothing
    left.tell(listener.run, finished)
    slow = " or ".join(name for name in results if not BOUNDS[name].calculated)
    none: tuple[None, str] = (None, INTERRUPTED if programs else f"{NOT_ASKED}: it comes with {slow}")
    reference: tuple[Reference | None, str] = none
    lost: tuple[Losses | None, str] = none
    if programs:
        progress("repeating the run by cvxpy alone", None)
        reference = left.work(lambda: _reference(finished), reference)
        left.tell(listener.cvxpy, *reference)
        lost = left.work(lambda: PROOFS["losses"].of(pair, measured, progress=progress), lost)
        left.tell(listener.losses, *lost)
        for name in programs:
            evaluate = BOUNDS[name].evaluate
            results[name] = left.work(lambda: evaluate(subject, choice.theta, progress=progress), results[name])  # noqa: B023
        left.tell(listener.programs, [results[name] for name in programs])

    finished = replace(finished, interrupted=left.interrupted)
    missing = {"losses": lost[1], "cvxpy": reference[1]}
    missing |= {name: result.not_computed for name, result in results.items() if not result.worked_out}
    reason = {name: why for name, why in missing.items() if why}
    seen = largest_step_ratio(pair, finished.iterates)
    if seen is None:
        reason["step_ratio"] = "no step is clear of rounding"

    outside = "outside the theorem: " + "; ".join(finished.outside) if finished.outside else ""
    if not isinstance(finished.rule, Constant) and not outside:
        outside = f"the bounds hold for a constant theta, not for {finished.relaxation}"
    in_its_norm = {
        name: seen if result.norm is None else largest_step_ratio(pair, finished.iterates, result.norm)
        for name, result in results.items()
    }
    verdicts = {name: judge_bound(result, in_its_norm[name], outside) for name, result in results.items()}
    verdicts["linearised"] = judge_forecast(finished)
    return Comparison(
        measured=measured,
        bounds=results,
        losses=lost[0],
        run=finished,
        step_ratio=seen,
        cvxpy=reference[0],
        verdicts=verdicts,
        reason=reason,
    )


class _UntilCtrlC:
    """The remaining parts of a comparison.  After Ctrl-C no further one is computed, but each is still reported."""

    def __init__(self, interrupted: bool) -> None:
        self.interrupted = interrupted

    def work(self, compute: Callable[[], T], missing: T) -> T:
        """Compute a part; return ``missing`` instead where Ctrl-C comes first."""
        if not self.interrupted:
            try:
                return compute()
            except KeyboardInterrupt:
                self.interrupted = True
        return missing

    def tell(self, method: Callable[..., None], *parts: Any) -> None:
        """Report one part."""
        try:
            method(*parts)
        except KeyboardInterrupt:
            self.interrupted = True


def _reference(finished: Run) -> tuple[Reference | None, str]:
    """Run by cvxpy only, or return why that failed."""
    try:
        return by_cvxpy_alone(finished), ""
    except ContactError as error:
        return None, str(error)

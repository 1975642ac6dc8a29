"""Bounds against observation: one honest verdict for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, Literal

from ndtheory import EDITIONS, Bounds, evaluate, relaxation_factor
from verification.bodies import build
from verification.contact import Solver
from verification.document import Document
from verification.iteration import State
from verification.measured import Measured, measure
from verification.pair import Pair
from verification.problem import Problem
from verification.rates import StepRatio, largest_step_ratio
from verification.runs import Run, run

Verdict = Literal["CONSISTENT", "VIOLATED", "INCONCLUSIVE", "HYPOTHESES_NOT_MET"]


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
        Empty where a constant does not exist.
    run : Run
    step_ratio : StepRatio or None
        The largest Lipschitz quotient seen.
    verdicts : mapping from edition to Judgement
    """

    schema: ClassVar[str] = "ndtheory.compare/1"

    measured: Measured
    bounds: Mapping[str, Bounds]
    run: Run
    step_ratio: StepRatio | None
    verdicts: Mapping[str, Judgement]

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.run.units

    @property
    def proved_violated(self) -> bool:
        """Whether a proved claim failed: a bug, or an error in a proof.  A violated printed claim is a finding."""
        return any(j.verdict == "VIOLATED" for name, j in self.verdicts.items() if name != "printed")

    @property
    def inconclusive(self) -> bool:
        """Whether rounding hides an answer."""
        return any(judgement.verdict == "INCONCLUSIVE" for judgement in self.verdicts.values())

    def content(self) -> dict[str, Any]:
        editions: dict[str, Any] = {e.name: None for e in EDITIONS}
        editions |= {name: bounds.to_dict() for name, bounds in self.bounds.items()}
        reason = dict.fromkeys(("sharp", "lmi"), "not computed by this version")
        if self.step_ratio is None:
            reason["step_ratio"] = "no step stands clear of rounding"
        no_bounds = {} if self.bounds else {e.name: next(iter(self.measured.reason.values()), "") for e in EDITIONS}
        return {
            "title": self.run.pair.problem.title,
            "constants": self.measured.content(),
            "bounds": {"editions": {**editions, "sharp": None}, "reason": {**no_bounds, "sharp": reason["sharp"]}},
            "sharp": None,
            "lmi": None,
            "run": self.run.content(),
            "step_ratio": None
            if self.step_ratio is None
            else {"value": self.step_ratio.value, "interval": [self.step_ratio.lo, self.step_ratio.hi]},
            "verdicts": {name: judgement.verdict for name, judgement in self.verdicts.items()},
            "reasons": {name: judgement.reason for name, judgement in self.verdicts.items()},
            "reason": reason,
        }


def judge(bound: float | None, seen: StepRatio | None, why_none: str) -> Judgement:
    """Hold a bound on the factor of one step against the largest factor seen.

    Parameters
    ----------
    bound : float or None
        None: the edition draws no conclusion; ``why_none`` says why.
    seen : StepRatio or None

    Examples
    --------
    >>> judge(0.5, StepRatio(value=0.4, lo=0.39, hi=0.41, steps=9), "").verdict
    'CONSISTENT'
    """
    if bound is None:
        return Judgement(verdict="HYPOTHESES_NOT_MET", reason=why_none)
    if seen is None:
        return Judgement(verdict="INCONCLUSIVE", reason="no step stands clear of rounding")
    says = f"ratios <= {seen.value:.6g} in {seen.steps} steps, bound {bound:.6g}"
    if seen.hi <= bound:
        return Judgement(verdict="CONSISTENT", reason=says)
    if seen.lo > bound:
        return Judgement(verdict="VIOLATED", reason=says)
    return Judgement(verdict="INCONCLUSIVE", reason=f"{says}: closer than rounding")


def compare(
    problem: Problem | Pair,
    *,
    theta: Any = None,
    solver: Solver = "auto",
    watch: Callable[[State], None] = lambda state: None,
) -> Comparison:
    """Measure the constants, evaluate the bounds, run the algorithm, and judge.

    Parameters and errors as for :func:`verification.run`.
    """
    pair = build(problem) if isinstance(problem, Problem) else problem
    chosen: Fraction = pair.problem.iteration.theta if theta is None else relaxation_factor(theta)
    measured = measure(pair)
    constants = measured.constants()
    bounds: dict[str, Bounds] = {} if constants is None else {e.name: evaluate(e, constants, chosen) for e in EDITIONS}
    finished = run(pair, theta=chosen, solver=solver, watch=watch)
    seen = largest_step_ratio(pair, finished.states)
    outside = "; ".join(pair.outside)
    verdicts: dict[str, Judgement] = {}
    for edition in EDITIONS:
        b = bounds.get(edition.name)
        if b is None or outside:
            verdicts[edition.name] = judge(None, seen, f"outside the theorem: {outside}")
            continue
        if b.interval is None:
            scale = b.C2.value if b.C2 is not None else float("inf")
            why = f"friction {measured.friction:g} is not below {scale:.2g}"
        else:
            why = f"theta = {float(chosen):g} is outside ({b.interval[0]:.2g}, {b.interval[1]:.2g})"
        verdicts[edition.name] = judge(None if b.factor is None else b.factor.value, seen, why)
    return Comparison(measured=measured, bounds=bounds, run=finished, step_ratio=seen, verdicts=verdicts)

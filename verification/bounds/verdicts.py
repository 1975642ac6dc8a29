"""A verdict on each bound and forecast, with its reason, from a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ndtheory.number import directed
from verification.algorithm.rates import StepRatio
from verification.algorithm.runs import Run
from verification.bounds.bound import NOT_ASKED, BoundResult
from verification.show.numbers import near_one

#: A bound may be attained: a ratio above it by less than this share of 1 - bound counts as equal.
TIGHT = 1e-6

#: A forecast is right if its rate differs from the observed one by at most this, and its steps by one.
AGREES = 1e-3

RunVerdict = Literal["CONSISTENT", "VIOLATED", "INCONCLUSIVE", "HYPOTHESES_NOT_MET", "NOT_COMPUTED"]


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A verdict on one bound, with its reason in words."""

    verdict: RunVerdict
    reason: str


def judge(
    bound: float | None, seen: StepRatio | None, why_none: str, *, proved: bool = False, rest: float | None = None
) -> Judgement:
    """Compare a bound on the factor of one step with the largest factor seen.

    A bound may be attained: an excess below :data:`TIGHT` of ``1 - bound`` counts as equality.

    Parameters
    ----------
    bound : float or None
        None: the bound draws no conclusion; ``why_none`` says why.
    seen : StepRatio or None
        None: no step is clear of rounding.
    proved : bool
        Whether the bound is the upper end of an enclosure; then it is called proved, and rounded upwards.
    rest : float, optional
        1 - bound, where it is known without cancellation; rounded down if proved.

    Examples
    --------
    >>> judge(0.5, StepRatio(value=0.4, lo=0.39, hi=0.41, steps=9), "").verdict
    'CONSISTENT'
    """
    if bound is None:
        return Judgement(verdict="HYPOTHESES_NOT_MET", reason=why_none)
    if seen is None:
        return Judgement(verdict="INCONCLUSIVE", reason="no step is clear of rounding")
    if seen.steps == 0:
        return Judgement(verdict="NOT_COMPUTED", reason="no step was taken")
    digits = 4 if seen.hi <= bound else 6  # six where the bound is attained or violated
    rest, bound_up = 1 - bound if rest is None else rest, bound
    if proved:
        bound_up, rest = (
            float(directed(x, n, up=up)) for x, n, up in ((bound, digits, True), (rest, digits - 2, False))
        )
    shown = f"{'proved ' * proved}bound {near_one(bound_up, digits, rest)}"
    says = f"ratios <= {near_one(seen.value, digits)} in {seen.steps} steps, {shown}"
    if seen.hi <= bound:
        return Judgement(verdict="CONSISTENT", reason=says)
    slack = TIGHT * (1 - bound)
    if seen.lo > bound + slack:
        return Judgement(verdict="VIOLATED", reason=says)
    if seen.hi <= bound + slack:
        return Judgement(verdict="CONSISTENT", reason=f"{says}: attained")
    return Judgement(verdict="INCONCLUSIVE", reason=f"{says}: closer than rounding")


def judge_forecast(run: Run) -> Judgement:
    """Compare the forecast made half way with the rest of the run."""
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


def judge_bound(result: BoundResult, seen: StepRatio | None, outside: str) -> Judgement:
    """Judge one bound by the run; ``outside`` is why the theorem does not apply to the run."""
    if not result.asked:
        return Judgement(verdict="NOT_COMPUTED", reason=NOT_ASKED)
    if outside:
        return Judgement(verdict="HYPOTHESES_NOT_MET", reason=outside)
    if result.not_computed:
        return Judgement(verdict="NOT_COMPUTED", reason=result.not_computed)
    factor, rest = result.factor, result.one_minus_factor
    if factor is not None and factor.hi is not None and result.proved:
        return judge(factor.hi, seen, result.why, proved=True, rest=None if rest is None else rest.lo)
    least = None if rest is None else rest.value
    return judge(None if factor is None else factor.value, seen, result.why, rest=least)

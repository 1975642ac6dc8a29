"""The answer of a comparison in three lines, before its tables: what the run did, what is proved of it, which theta."""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory import EnergyBounds
from verification.algorithm.runs import Run
from verification.bounds.bound import BoundResult
from verification.show.layout import LABEL, WIDTH
from verification.show.numbers import factor, figures, interval, near_one
from verification.show.parts import Labelled, Section, section

#: What the lines of the answer mean.
CAPTION = (
    "The result of this run; the largest factor by which one step multiplies the error, for any loads; the theta that "
    "is predicted to be best, and the thetas that a bound allows."
)

#: Letters of a labelled text on one line of a screen.
ONE_LINE = WIDTH - LABEL - 2


def answer(finished: Run, bounds: Sequence[BoundResult], *, alone: bool = True) -> Section:
    """The answer after a run; ``alone`` where no table of the bounds follows in this section.

    Parameters
    ----------
    finished : Run
    bounds : sequence of BoundResult
        Those that follow from the constants; the others take longer, and come below.
    """
    proved = [bound for bound in bounds if bound.proved and bound.worked_out]
    applies = finished.relaxation == "constant" and not finished.outside
    theta = _theta(proved, allowed=_widest(proved) if applies else None)
    bound = [Labelled("bound", _bound(finished, proved))] if alone else []
    parts = (Labelled("observed", _seen(finished)), *bound, *theta)
    return section("answer", "DOES IT CONVERGE, AND HOW FAST?", *parts, caption=CAPTION)


def _seen(finished: Run) -> str:
    """Outcome of the run, and its rate."""
    count = f"{finished.iterations} step{'s' * (finished.iterations != 1)}"
    steps = f"{finished.outcome.words} after {count}"
    if finished.observed_growth is not None:
        return f"{steps}; each multiplies the error by {finished.observed_growth:.4g}"
    if finished.observed_rate is None and finished.converged:
        return f"{steps}, too few to see a rate"
    if finished.observed_rate is None or finished.outcome == "stalled":
        return steps
    rate = near_one(finished.observed_rate.value)
    says = f"{steps}; at the end a step leaves {rate}"
    return says if len(says) <= ONE_LINE else f"{steps}; at the end {rate} a step"


def _bound(finished: Run, bounds: Sequence[BoundResult]) -> str:
    """The smallest factor that a bound gives for one step, or how far the bounds reach; none may be known yet."""
    if finished.relaxation != "constant":
        return f"none: bounds are for a constant theta, not for {finished.relaxation}"
    if finished.outside:
        return "none: the problem is outside the theorem"
    if not bounds:
        return "see below"
    found = [bound for bound in bounds if bound.factor is not None]
    if not found and (allowed := _widest(bounds)) is not None:
        return f"from constants: none, theta is outside {interval(allowed.interval, allowed.interval_level)}"
    if not found:
        limits = [bound.friction.some.value for bound in bounds if bound.friction.some is not None]
        varies = any(bound.friction.on == "multiple" for bound in bounds)
        what = "for less than {} times as much" if varies else "for k < {}"
        reach = f"; some theta contracts {what.format(figures(max(limits)))}" if limits else " at this friction"
        return f"from constants: none{reach}"
    best = min(found, key=lambda bound: bound.factor.value if bound.factor is not None else 1.0)
    how = "in doubles" if best.level == "float" else best.level
    return f"at most {factor(best.factor, best.one_minus_factor)} of the error is left ({best.name}, {how})"


def _theta(bounds: Sequence[BoundResult], allowed: BoundResult | None) -> list[Labelled]:
    """The theta that is predicted to be the best one, and those that a bound allows."""
    words = []
    for detail in (bound.detail for bound in bounds):
        if isinstance(detail, EnergyBounds):
            words.append(f"{figures(detail.theta_predicted)} predicted best")
    if allowed is not None:
        words.append(f"the {allowed.name} bound allows {interval(allowed.interval, allowed.interval_level)}")
    return [Labelled("theta", "; ".join(words))] if words else []


def _widest(bounds: Sequence[BoundResult]) -> BoundResult | None:
    """The bound that allows most theta; None where none allows any."""
    width = lambda bound: bound.interval[1] - bound.interval[0] if bound.interval is not None else -1.0
    widest = max(bounds, key=width, default=None)
    return None if widest is None or widest.interval is None else widest

"""The ruler of steps: how many bounds promise, a linearisation predicts, and a run took, to one tolerance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from verification.algorithm.rates import steps
from verification.algorithm.runs import Run
from verification.bounds.bound import BoundResult
from verification.registry import BOUNDS

#: The names of the marks that no bound makes.
PREDICTED, OBSERVED = "predicted", "observed"


@dataclass(frozen=True)
class Mark:
    """A number of steps, by a bound (``promised``), by the linearisation at the solution, or as seen in a run."""

    name: str
    steps: int
    colour: str
    promised: bool


def promised(result: BoundResult, tolerance: float) -> int | None:
    """Steps after which the error, in (5.21), is at most ``tolerance`` times the first one by a bound; None without a
    factor.

    A factor in another norm bounds the error in (5.21) up to the condition of that norm.
    """
    if result.factor is None or result.one_minus_factor is None:
        return None
    ends = result.factor.hi, result.one_minus_factor.lo
    factor = result.factor.value if ends[0] is None else ends[0]
    rest = result.one_minus_factor.value if ends[1] is None else ends[1]
    longer = 1.0 if result.norm is None else result.norm.condition**-0.5
    return steps(factor, tolerance * longer, rest)


def ruler(results: Iterable[BoundResult], run: Run) -> tuple[Mark, ...]:
    """The marks of one run: of each bound that covers it, then predicted, then observed."""
    tolerance = run.pair.settings.tolerance
    covers = run.relaxation == "constant" and not run.outside
    found = [
        Mark(result.name, count, BOUNDS[result.name].colour, promised=True)
        for result in results
        if covers and (count := promised(result, tolerance)) is not None
    ]
    predicted = None if run.linearised is None else steps(run.linearised.rate, tolerance)
    if predicted is not None:
        found.append(Mark(PREDICTED, predicted, "0.5", promised=False))
    return (*found, *([Mark(OBSERVED, run.iterations, "0.1", promised=False)] if run.converged else []))

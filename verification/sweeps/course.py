"""What one run of a sweep does: when it ends, by which test, and at which rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from verification.algorithm.fixed_point import FixedPointMap, iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, linearised_rate
from verification.algorithm.rates import rate_of
from verification.algorithm.relaxation import Relaxation, Rule, Step
from verification.algorithm.runs import PATIENCE, RUNAWAY, Ending, Outcome, Run
from verification.algorithm.theta import Choice
from verification.contact import ContactError
from verification.interface.pair import ContactPair
from verification.monolithic import SolveError
from verification.sweeps.lean import KnownPieces, lengths

#: The bound of the test of Section 6.3.
PAPER = 1e-9

#: A residual within this share of the tolerance is on either side of it by rounding: it has about seven digits there.
TIE = 1e-6


@dataclass(frozen=True, kw_only=True)
class Course:
    """What a run did.

    Attributes
    ----------
    steps : int
        Steps until it ended, as :attr:`Run.iterations` counts them.
    paper : int or None
        n at which the test of Section 6.3 is met.
    outcome : {'converged', 'stalled', 'limit', 'diverged'}
    observed_rate, linearised_rate : float or None
        As a run has them.
    reason : mapping
        Why a value is None, or why the outcome is not ``converged``.
    """

    steps: int
    paper: int | None
    outcome: Outcome
    observed_rate: float | None
    linearised_rate: float | None
    reason: Mapping[str, str] = field(default_factory=dict)


def meets_paper_test(g: Floats, before: Floats) -> NDArray[np.bool_]:
    """The test of Section 6.3: ``|g_n - g_{n-1}|/|g_n| < 1e-9`` or ``|g_n - g_{n-1}| < 1e-9``, for every column.

    Norms are Euclidean; the second part is in the unit of force of the file.
    """
    increment = lengths(g - before)
    return (increment < PAPER) | (increment < PAPER * lengths(g))


def course(pair: ContactPair, rule: Rule, choice: Choice, step: Step, pieces: KnownPieces) -> Course:
    """Run from g = 0 until both tests are met, or the run stalls, runs away or reaches its limit.

    Raises
    ------
    ContactError
        Step II did not reach its certificate before the run ended.
    """
    if isinstance(step, Relaxation) and not pair.held:
        found = _lean(pieces, step.theta)
        if found is not None:
            return found
    # where rounding decides the steps of `run` do: a residual that wanders at a level, or meets the tolerance exactly
    return _stepwise(pair, rule, choice, step)


def _lean(pieces: KnownPieces, theta: float) -> Course | None:
    """With constant relaxation: steps on one affine piece are taken together; None where rounding decides the count."""
    settings, T = pieces.pair.settings, FixedPointMap(pieces.pair)
    ending, bound = Ending(settings), settings.tolerance
    residuals: list[float] = []
    floors: list[float] = []
    kinds: list[bytes] = []
    outcome: Outcome | None = None
    paper, why, scale, n = None, "", 0.0, -1
    before = last = first = np.zeros(0)
    piece: tuple[bytes, ...] = ()
    try:
        for taken in pieces.steps(T, theta):
            if paper is None:
                paper = _paper(taken.g, before, n)
            if taken.piece != piece and outcome is None:
                piece, first = taken.piece, taken.g[:, 0]
            for i, (residual, size) in enumerate(zip(taken.residual.tolist(), taken.size.tolist(), strict=True)):
                n, scale = n + 1, max(scale, size)
                ended = ending.at(n, residual, scale)
                if outcome is None:
                    if abs(residual - bound * scale) <= TIE * bound * scale:
                        return None
                    residuals.append(residual)
                    floors.append(float(taken.floor[i]))
                    kinds.append(taken.pattern)
                    outcome, last = ended, taken.g[:, i]
                if outcome and ((paper is not None and paper <= n) or ending.given_up(n, residual)):
                    paper = None if paper is None or paper > n else paper
                    break
            else:
                before = taken.g[:, -1]
                continue
            break
    except ContactError as error:
        if outcome is None:
            raise
        why = str(error)
    assert outcome is not None  # the iterates have no end of their own
    if outcome == "stalled":
        return None
    reason = _reason(outcome, len(residuals) - 1, paper, why)
    observed = None if outcome == "diverged" else rate_of(residuals, floors, kinds)
    if observed is None:
        reason["observed_rate"] = _no_rate(outcome)
    linear = None
    try:
        if outcome == "converged":
            here = iterate_at(T, last)
            linear = linearised_rate(pieces.piece(last, here.contact.pattern), here, theta, first)
        else:
            here = pieces.solution()
            linear = linearised_rate(pieces.piece(here.g, here.contact.pattern), here, theta)
    except (NotLinear, SolveError, ContactError) as error:
        reason["linearised_rate"] = str(error)
    return Course(
        steps=len(residuals) - 1,
        paper=paper,
        outcome=outcome,
        observed_rate=None if observed is None else observed.value,
        linearised_rate=linear,
        reason=reason,
    )


def _paper(g: Floats, before: Floats, last: int) -> int | None:
    """n of the first column of g at which :func:`meets_paper_test` is true, where ``last`` columns came before."""
    columns = np.column_stack([before, g]) if len(before) else g
    met = np.flatnonzero(meets_paper_test(columns[:, 1:], columns[:, :-1]))
    return None if not len(met) else last + int(met[0]) + (1 if len(before) else 2)


def _stepwise(pair: ContactPair, rule: Rule, choice: Choice, step: Step) -> Course:
    """With any rule: as :func:`verification.run` goes."""
    seen: list[Iterate] = []
    ending, paper, why = Ending(pair.settings), None, ""
    outcome: Outcome | None = None
    before: Floats | None = None
    try:
        for found in iterates(FixedPointMap(pair), step):
            if paper is None and before is not None and meets_paper_test(found.g[:, None], before[:, None])[0]:
                paper = found.iteration
            if outcome is None:
                seen.append(found)
            ended = ending.at(found.iteration, found.residual, found.scale)
            outcome = outcome or ended
            if outcome is not None and (paper is not None or ending.given_up(found.iteration, found.residual)):
                break
            before = found.g
    except ContactError as error:
        if outcome is None:
            raise
        why = str(error)
    assert outcome is not None  # the iterates have no end of their own
    run = Run(pair=pair, rule=rule, choice=choice, iterates=tuple(seen), outcome=outcome).linearise()
    return _judged(run, paper, why)


def _judged(run: Run, paper: int | None, why: str) -> Course:
    observed, linear = run.observed_rate, run.linearised
    reason = _reason(run.outcome, run.iterations, paper, why)
    if observed is None:
        reason["observed_rate"] = _no_rate(run.outcome)
    if linear is None:
        reason["linearised_rate"] = run.why_not_linearised
    return Course(
        steps=run.iterations,
        paper=paper,
        outcome=run.outcome,
        observed_rate=None if observed is None else observed.value,
        linearised_rate=None if linear is None else linear.rate,
        reason=reason,
    )


def _reason(outcome: Outcome, steps: int, paper: int | None, why: str) -> dict[str, str]:
    """Why a run has no count of steps."""
    found = {
        "converged": {},
        "limit": {"iterations": f"not converged in {steps} steps"},
        "stalled": {"iterations": f"no new least residual over {PATIENCE} steps"},
        "diverged": {"iterations": f"the residual grew by more than {RUNAWAY:g}"},
        "interrupted": {},
    }[outcome]
    if paper is None:
        found["iterations_paper"] = why or f"not met before the run ended: {outcome}"
    return found


def _no_rate(outcome: Outcome) -> str:
    return "the run diverged" if outcome == "diverged" else "too few steps stand clear of the rounding"

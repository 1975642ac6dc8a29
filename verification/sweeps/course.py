"""One run of a sweep: when it ends, by which test, and at which rate."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from verification.algorithm.ending import NO_FORCE, PATIENCE, RUNAWAY, Ending, Outcome, arrived, coupled_residual
from verification.algorithm.fixed_point import iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, linearised_rate
from verification.algorithm.rates import noises, rate_of
from verification.algorithm.relaxation import Constant, Relaxation, Rule, Step
from verification.algorithm.theta import Choice
from verification.contact import ContactError
from verification.interface.pair import ContactPair
from verification.monolithic import SolveError
from verification.sweeps.lean import KnownPieces, key_of, lengths

#: The bound of the test of Section 6.3.
PAPER = 1e-9

#: Steps without a new least residual after which a run most likely stalls; few other runs have as many.
WANDERS = 12

#: A residual within this share of the tolerance is on either side of it by rounding: it has about seven digits there.
TIE = 1e-6


@dataclass(frozen=True, kw_only=True)
class Course:
    """Result of a run.

    Attributes
    ----------
    steps : int
        Steps until it ended, as :attr:`verification.algorithm.runs.Run.iterations` counts them.
    paper : int or None
        n at which the test of Section 6.3 is met.
    outcome : {'converged', 'stalled', 'limit', 'diverged'}
    observed_rate, linearised_rate, coupled_residual : float or None
        As in a run.
    reason : mapping
        Why a value is None, or why the outcome is not ``converged``.
    """

    steps: int
    paper: int | None
    outcome: Outcome
    observed_rate: float | None
    linearised_rate: float | None
    coupled_residual: float | None
    reason: Mapping[str, str] = field(default_factory=dict)


def meets_paper_test(g: Floats, before: Floats) -> NDArray[np.bool_]:
    """Apply the test of Section 6.3, ``|g_n - g_{n-1}|/|g_n| < 1e-9`` or ``|g_n - g_{n-1}| < 1e-9``, to every column.

    Norms are Euclidean; the second part is in the unit of force of the file.
    """
    increment = lengths(g - before)
    return (increment < PAPER) | (increment < PAPER * lengths(g))


def course(pair: ContactPair, rule: Rule, choice: Choice, step: Step, pieces: KnownPieces) -> Course:
    """Run from the start of a pair until both tests are met, or the run stalls, runs away or reaches its limit.

    Raises
    ------
    ContactError
        Step II did not reach its certificate before the run ended.
    """
    went = _lean(pieces, step.theta) if isinstance(step, Relaxation) and not pair.held else None
    # where rounding decides the steps of `run` do: a residual that wanders at a level, or meets the tolerance exactly
    went = went or _stepwise(pieces, step)
    reason = _reason(went.outcome, len(went.residuals) - 1, went.paper, went.why)
    observed = None if went.outcome == "diverged" else rate_of(went.residuals, went.floors, went.kinds)
    if observed is None:
        reason["observed_rate"] = _no_rate(went.outcome)
    end: Iterate | None = None
    coupled, linear = None, None
    try:
        end = went.end()
        coupled = coupled_residual(pair, end)
    except ContactError as error:
        reason["coupled_residual"] = str(error)
    else:
        if coupled is None:
            reason["coupled_residual"] = NO_FORCE
    try:
        if not isinstance(rule, Constant):
            raise NotLinear(f"the {rule.name} relaxation is no constant theta")
        here, first = (end, went.entry()) if end and went.outcome == "converged" else (pieces.solution(), None)
        linear = linearised_rate(pieces.piece(here.g, here.contact.pattern), here, float(choice.theta), first)
    except (NotLinear, SolveError, ContactError) as error:
        reason["linearised_rate"] = str(error)
    return Course(
        steps=len(went.residuals) - 1,
        paper=went.paper,
        outcome=went.outcome,
        observed_rate=None if observed is None else observed.value,
        linearised_rate=linear,
        coupled_residual=coupled,
        reason=reason,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Went:
    """How a run went.

    Attributes
    ----------
    outcome : {'converged', 'stalled', 'limit', 'diverged'}
    residuals, floors : list of float
        Those of every evaluation until it ended, and the rounding of each.
    kinds : list
        What tells one contact pattern from another, for each.
    paper : int or None
        n at which the test of Section 6.3 is met.
    why : str
        What ended it before that test was met, other than its outcome.
    end : callable
        T at its last g.
    entry : callable
        The g with which it came onto the piece of the last g for good.
    """

    outcome: Outcome
    residuals: Sequence[float]
    floors: Sequence[float]
    kinds: Sequence[object]
    paper: int | None
    why: str
    end: Callable[[], Iterate]
    entry: Callable[[], Floats]


def _lean(pieces: KnownPieces, theta: float) -> _Went | None:
    """With constant relaxation: steps on one affine piece are taken together; None where rounding decides the count."""
    pair, settings, T = pieces.pair, pieces.pair.settings, pieces.map()
    ending, bound = Ending(settings), settings.tolerance
    joined = lambda g: arrived(pair, iterate_at(T, g))
    residuals: list[float] = []
    walked: list[tuple[Floats, Floats]] = []
    kinds: list[object] = []
    outcome: Outcome | None = None
    paper, why, n, least, since = None, "", -1, math.inf, 0
    before = last = first = np.zeros(0)
    piece: tuple[bytes, ...] = ()
    try:
        for taken in pieces.steps(T, theta):
            if paper is None:
                paper = _paper(taken.g, before, n)
            if outcome is None:
                walked.append((taken.g, taken.u))
                if taken.piece != piece:
                    piece, first = taken.piece, taken.g[:, 0]
            for i, (residual, scale) in enumerate(zip(taken.residual.tolist(), taken.scale.tolist(), strict=True)):
                n, g = n + 1, taken.g[:, i]
                ended = ending.at(n, residual, scale, partial(joined, g))
                if outcome is None:
                    if abs(residual - bound * scale) <= TIE * bound * scale:
                        return None
                    residuals.append(residual)
                    kinds.append(taken.pattern)
                    outcome, last = ended, g
                    least, since = (residual, 0) if residual < least else (least, since + 1)
                    if since > WANDERS:
                        return None
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
    gs, us = (np.hstack(parts)[:, : len(residuals)] for parts in zip(*walked, strict=True))
    return _Went(
        outcome=outcome,
        residuals=residuals,
        floors=pieces.norm.rounding(gs, us).tolist(),
        kinds=kinds,
        paper=paper,
        why=why,
        end=lambda: iterate_at(T, last),
        entry=lambda: first,
    )


def _paper(g: Floats, before: Floats, last: int) -> int | None:
    """n of the first column of g at which :func:`meets_paper_test` is true, where ``last`` columns came before."""
    columns = np.column_stack([before, g]) if len(before) else g
    met = np.flatnonzero(meets_paper_test(columns[:, 1:], columns[:, :-1]))
    return None if not len(met) else last + int(met[0]) + (1 if len(before) else 2)


def _stepwise(pieces: KnownPieces, step: Step) -> _Went:
    """With any rule: as :func:`verification.run` goes."""
    pair = pieces.pair
    seen: list[Iterate] = []
    ending, paper, why = Ending(pair.settings), None, ""
    outcome: Outcome | None = None
    before: Floats | None = None
    try:
        for found in iterates(pieces.map(), step, pieces.start.g):
            if paper is None and before is not None and meets_paper_test(found.g[:, None], before[:, None])[0]:
                paper = found.iteration
            if outcome is None:
                seen.append(found)
            ended = ending.at(found.iteration, found.residual, found.scale, partial(arrived, pair, found))
            outcome = outcome or ended
            if outcome is not None and (paper is not None or ending.given_up(found.iteration, found.residual)):
                break
            before = found.g
    except ContactError as error:
        if outcome is None:
            raise
        why = str(error)
    assert outcome is not None  # the iterates have no end of their own

    def entry() -> Floats:
        last = key_of(pieces.piece(seen[-1].g, seen[-1].contact.pattern))
        same = takewhile(lambda each: key_of(pieces.piece(each.g, each.contact.pattern)) == last, reversed(seen))
        return deque(same, maxlen=1)[0].g

    return _Went(
        outcome=outcome,
        residuals=[each.residual for each in seen],
        floors=noises(pair, seen),
        kinds=[each.contact.pattern for each in seen],
        paper=paper,
        why=why,
        end=lambda: seen[-1],
        entry=entry,
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

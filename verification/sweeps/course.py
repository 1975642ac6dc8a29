"""One run of a sweep: when it ends, by which test, and at which rate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from verification.algorithm.ending import NO_FORCE, PATIENCE, RUNAWAY, Ending, Outcome, arrived, coupled_residual
from verification.algorithm.fixed_point import FixedPointMap, iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, linearised_rate
from verification.algorithm.rates import rate_of
from verification.algorithm.relaxation import Constant, Relaxation, Rule, Step
from verification.algorithm.theta import Choice
from verification.contact import ContactError
from verification.interface.pair import ContactPair
from verification.monolithic import SolveError
from verification.sweeps.lean import KnownPieces, Steps, lengths

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
    T, went = pieces.map(), None
    if isinstance(step, Relaxation) and not pair.held:
        went = _follow(pieces, pieces.steps(T, step.theta), T, lean=True)
    if went is None:  # any rule, and where rounding decides: a residual that wanders, or meets the tolerance exactly
        T = pieces.map()
        went = _follow(pieces, map(pieces.single, iterates(T, step, pieces.start.g)), T, lean=False)
    assert went is not None  # only lean steps leave it to others
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
        here, first = (end, went.entry) if end and went.outcome == "converged" else (pieces.solution(), None)
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
    """The steps of a run.

    Attributes
    ----------
    outcome : {'converged', 'stalled', 'limit', 'diverged'}
    residuals, floors : list of float
        Of every evaluation until it ended, and the rounding of each.
    kinds : list
        The contact pattern of each, in a form that can be compared.
    paper : int or None
        n at which the test of Section 6.3 is met.
    why : str
        The error that ended it before that test was met.
    end : callable
        T at its last g.
    entry : array
        The g with which it came onto the piece of the last g for good.
    """

    outcome: Outcome
    residuals: Sequence[float]
    floors: Sequence[float]
    kinds: Sequence[object]
    paper: int | None
    why: str
    end: Callable[[], Iterate]
    entry: Floats


def _follow(pieces: KnownPieces, batches: Iterable[Steps], T: FixedPointMap, *, lean: bool) -> _Went | None:
    """Follow a run, and go on until the test of Section 6.3 is met or the run is given up.

    Lean steps, which are not evaluated one by one, give None where rounding decides when the run ends.
    """
    pair, bound = pieces.pair, pieces.pair.settings.tolerance
    ending = Ending(pair.settings)
    residuals: list[float] = []
    walked: list[tuple[Floats, Floats]] = []
    kinds: list[object] = []
    outcome: Outcome | None = None
    paper, why, n, least, since = None, "", -1, math.inf, 0
    before = first = np.zeros(0)
    piece: tuple[bytes, ...] = ()
    evaluated: Callable[[], Iterate]
    joined = lambda here: arrived(pair, here())
    try:
        for taken in batches:
            if paper is None:
                paper = _paper(taken.g, before, n)
            if outcome is None:
                walked.append((taken.g, taken.u))
                if taken.piece != piece:
                    piece, first = taken.piece, taken.g[:, 0]
            for i, (residual, scale) in enumerate(zip(taken.residual.tolist(), taken.scale.tolist(), strict=True)):
                n += 1
                here = partial(_evaluated, T, taken, i)
                ended = ending.at(n, residual, scale, partial(joined, here))
                if outcome is None:
                    residuals.append(residual)
                    kinds.append(taken.pattern)
                    outcome, evaluated = ended, here
                    least, since = (residual, 0) if residual < least else (least, since + 1)
                    if lean and (since > WANDERS or abs(residual - bound * scale) <= TIE * bound * scale):
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
    assert outcome is not None  # the iterates do not end
    gs, us = (np.hstack(parts)[:, : len(residuals)] for parts in zip(*walked, strict=True))
    return _Went(
        outcome=outcome,
        residuals=residuals,
        floors=pieces.noise.of(gs, us).tolist(),
        kinds=kinds,
        paper=paper,
        why=why,
        end=evaluated,
        entry=first,
    )


def _evaluated(T: FixedPointMap, taken: Steps, i: int) -> Iterate:
    """Return T at one of some steps."""
    return taken.found or iterate_at(T, taken.g[:, i])


def _paper(g: Floats, before: Floats, last: int) -> int | None:
    """Return n of the first column of g at which :func:`meets_paper_test` is true; ``last`` is n of the one before."""
    columns = np.column_stack([before, g]) if len(before) else g
    met = np.flatnonzero(meets_paper_test(columns[:, 1:], columns[:, :-1]))
    return None if not len(met) else last + int(met[0]) + (1 if len(before) else 2)


def _reason(outcome: Outcome, steps: int, paper: int | None, why: str) -> dict[str, str]:
    """Return why a run has no count of steps."""
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

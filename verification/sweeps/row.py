"""One row of a sweep, a function of a problem and the values of a grid which never raises; and what rows share."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache, partial
from itertools import count, groupby, repeat
from typing import Any, NamedTuple

import numpy as np

from fem1d2d.mesh import Bools, Floats
from ndtheory import HypothesisError
from ndtheory.energy_norms import one_minus_square
from ndtheory.keys import Key
from ndtheory.texts import printable
from verification.algorithm.arrival import NO_FORCE, arrived, coupled_residual
from verification.algorithm.fixed_point import FixedPointMap, iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, linearised_rate
from verification.algorithm.loop import Ending, Outcome, follow
from verification.algorithm.monolithic import SolveError
from verification.algorithm.rates import Noise, ObservedRate, rate_of
from verification.algorithm.relaxation import Constant, Relaxation, Rule, rule_of
from verification.algorithm.theta import Choice, choose
from verification.constants import Measured, measure
from verification.contact import ContactError
from verification.interface.interface import Law
from verification.interface.pair import ContactPair, pair_from
from verification.machine.threads import one_thread
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.pieces import KnownPieces, Steps, lengths

#: The bound of the test of Section 6.3.
PAPER = 1e-9

#: Steps without a new least residual after which a run most likely stalls; few other runs have as many.
WANDERS = 12

#: A residual within this share of the tolerance is on either side of it by rounding: it has about seven digits there.
TIE = 1e-6

Row = dict[str, Any]

#: The axes of a grid that change bodies or what joins them; friction and theta do not.
OF_BODIES = ("young", "neumann_body", "law", "radius")

#: Values of those axes, as pairs of name and value.
Changes = tuple[tuple[str, Any], ...]

#: Number of constants that are kept.  Of what holds matrices the last one is kept: rows that share it are neighbours.
KEPT = 16

#: Outcomes of a row without a run.  A refused row is refused again; an error may have had a reason that passes.
REFUSED, ERROR = "refused", "error"
FAILED = (REFUSED, ERROR)

_number = partial(Key, type="number")
_whole = partial(Key, type="integer")
_text = partial(Key, type="text")
REFUSED_MATRICES = "where the row was refused and the pair comes from matrices"
NO_MODULUS = "of a rigid body, of one with several materials, and of a pair made from matrices"

#: The columns of a row: first the values of the grid, then the results.  A meaning begins with the column's full name.
COLUMNS = {
    "theta": _number(says="relaxation factor theta; the one that was used", null='where "auto" or a rule found none'),
    "friction": _number(says="coefficient of friction k", null=REFUSED_MATRICES),
    "young1": _number(says="Young's modulus of body 1", unit="stress", null=NO_MODULUS),
    "young2": _number(says="Young's modulus of body 2", unit="stress", null=NO_MODULUS),
    "neumann_body": _whole(says="body of the Neumann problem", null=REFUSED_MATRICES),
    "refine": _whole(says="halvings of the mesh"),
    "law": _text(says="law of friction", null="of a pair made from matrices that has none"),
    "radius": _number(says="radius of the kernel of S", unit="length", null="where the problem has none"),
    "rule": _text(says="rule of relaxation"),
    "iterations": _whole(
        says="steps to the tolerance of the unrelaxed residual; as a run counts them", null="where it was not reached"
    ),
    "iterations_paper": _whole(
        says="steps by the test of Section 6.3; n at which it is met:"
        r" $\lvert g_n - g_{n-1}\rvert_2/\lvert g_n\rvert_2 < 10^{-9}$ or $\lvert g_n - g_{n-1}\rvert_2 < 10^{-9}$ in"
        " the unit of force",
        null="where it was not before the run ended",
    ),
    "steps": _whole(says="steps done; whatever the outcome", null="without a run"),
    "outcome": _text(
        says="how the run ended; as in **Run**; `refused` where the problem has no such run, `error` where a"
        " computation gave none"
    ),
    "observed_rate": _number(says="rate at the end of the run; as in **Run**", null="where the run shows none"),
    "linearised_rate": _number(says="rate of the linearisation; as in **Run**", null="where it was not linearised"),
    "coupled_residual": _number(
        says="violation of contact by the joined state at the end; as in **Run**", null="without a force or a run"
    ),
    "energy_factor": _number(
        says="q(theta) of the theorem in energy norms; proved on this mesh; it bounds the growth where it is 1 or more",
        null="outside the theorem and of a rule without a constant theta",
    ),
    "proved_rate": _number(
        says="proved rate; below 1, of this run on this mesh: `energy_factor` of a constant theta, the rule's own rate"
        " of momentum without friction",
        null="elsewhere",
    ),
    "rho": _number(says="rho; for the roles of the row", null="where it does not exist"),
    "reason": _text(says="why results are missing; by the names of the columns", null="where none is"),
}
GIVEN, RESULTS = tuple(COLUMNS)[:9], tuple(COLUMNS)[9:]


def title(column: str, units: Mapping[str, str]) -> str:
    """Return the full name of a column, with its unit where that is not 1."""
    unit = units.get(COLUMNS[column].unit or "", "")
    return COLUMNS[column].says.partition(";")[0] + (f" ({unit})" if unit else "")


def problem_of(start: Problem | ContactPair) -> Problem | None:
    """Return the problem of a sweep; None of a pair from matrices."""
    return start if isinstance(start, Problem) else start.problem


class SharedBodies:
    """The pairs and the constants of a sweep of ``start``, each made once while it is in use.

    A row does not depend on the rows before it: bodies are always scaled from the problem's own bodies on the mesh of
    the row, and constants always measured for the modulus of body 2 that the problem has.
    """

    def __init__(self, start: Problem | ContactPair) -> None:
        self.start = start
        self.problem = problem_of(start)
        self._law: Law | None = None if isinstance(start, Problem) else start.interface.law
        self._base = lru_cache(maxsize=2)(self._condense)
        self._pair = lru_cache(maxsize=1)(self._change)
        self._constants = lru_cache(maxsize=KEPT)(self._measure)
        self._setting = lru_cache(maxsize=1)(self._tried)

    def setting(self, values: Mapping[str, Any]) -> KnownPieces:
        """Return what a row shares with the rows that differ only in theta or in the rule."""
        changes = tuple((name, values[name]) for name in OF_BODIES if name in values)
        found = self._setting(values.get("refine", 0), changes, values.get("friction"))
        if isinstance(found, Exception):
            raise found.with_traceback(None)
        return found

    def _tried(self, refine: int, changes: Changes, friction: Fraction | None) -> KnownPieces | Exception:
        named = dict(changes)
        if "young" in named and self.problem is not None:
            # rho and the kappas do not change where both moduli are multiplied by one number
            lower, upper = named["young"]
            second = self.problem.body2.young
            named["young"] = (lower / upper * second, second)
        try:
            pair = self._pair(refine, changes)
            pair = pair if friction is None else pair.at(friction=friction)
            measured = self._constants(refine, tuple(named.items()))
            if measured.of_friction:  # else friction is absent, or its constants do not exist
                measured = measured.with_friction(float(pair.friction))
            return KnownPieces(pair, measured)
        except (ProblemError, HypothesisError) as error:  # the next rows are refused for the same reason
            return error

    def _condense(self, refine: int) -> ContactPair:
        """Condense the bodies of the problem on a mesh halved so often."""
        if isinstance(self.start, ContactPair) and not refine:
            return self.start
        return pair_from(self._refined(refine), law=self._law)

    def _refined(self, refine: int) -> Problem:
        if self.problem is None:
            raise ProblemError("<matrices>", "refine", refine, "needed a problem, whose mesh can be halved")
        return self.problem.refined(refine)

    def _change(self, refine: int, changes: Changes) -> ContactPair:
        changed = dict(changes)
        if self.problem is None:
            base = self._base(refine)
            roles = changed.pop("neumann_body", base.neumann_body)
            if changed:
                name, value = next(iter(changed.items()))
                raise ProblemError("<matrices>", name, value, "needed a problem, whose values can change")
            return base if roles == base.neumann_body else base.swapped()
        try:
            base = self._base(refine)
        except ProblemError:  # the roles or the law of the problem do not fit; another row may have ones that do
            if not changed:
                raise
            law = None if {"law", "radius"} & changed.keys() else self._law
            return pair_from(self._refined(refine).changed(**changed), law=law)
        return base.changed(**changed) if changed else base

    def _measure(self, refine: int, changes: Changes) -> Measured:
        """Measure rho and the constants of the energy norms, not those of Section 5."""
        pair = self._pair(refine, changes)
        contact, neumann = replace(pair.contact, body=None), replace(pair.neumann, body=None)
        return measure(replace(pair, contact=contact, neumann=neumann, problem=None))


def row(problem: Problem | ContactPair, values: Mapping[str, Any], bodies: SharedBodies | None = None) -> Row:
    """Run a problem with other values, and return the row of results.

    ``values`` are as :meth:`verification.sweeps.grid.SweepGrid.rows` yields them: the name of an axis to its value.
    ``bodies`` are condensed bodies of the same problem; no digit of the row depends on them.

    Returns
    -------
    dict
        The values, the columns :data:`RESULTS`, and None where there is nothing, with ``reason`` in words; a "#" in
        words is written ``%23``.
    """
    found = _given(problem_of(problem), values)
    try:
        with one_thread():
            setting = (bodies or SharedBodies(problem)).setting(values)
            pair = setting.pair
            found |= {"friction": float(pair.friction), "neumann_body": pair.neumann_body}
            found |= {} if pair.interface.law is None else {"law": pair.interface.law.name}
            why = _run(found, setting, values)
    except ProblemError as error:
        return _closed(found, {"outcome": str(ProblemError("", error.key, error.value, error.needed))}, REFUSED)
    except HypothesisError as error:
        return _closed(found, {"outcome": str(error)}, REFUSED)
    except (ContactError, SolveError) as error:
        return _closed(found, {"outcome": str(error)}, ERROR)
    except Exception as error:  # the fault of one row costs no other row
        return _closed(found, {"outcome": f"{type(error).__name__}: {error}"}, ERROR)
    return _closed(found, why)


def lost(problem: Problem | ContactPair, values: Mapping[str, Any], words: str) -> Row:
    """Return the row of a run that ended with the process that made it."""
    return _closed(_given(problem_of(problem), values), {"outcome": words}, ERROR)


def _closed(found: Row, why: Mapping[str, str], outcome: str | None = None) -> Row:
    """Return a row with the reasons of what is None; ``outcome`` is for a row without a run."""
    found["outcome"] = outcome or found["outcome"]
    found["reason"] = "; ".join(f"{name}: {' '.join(words.split())}" for name, words in why.items()) or None
    # in a CSV file a "#" begins a comment, in quotes too
    return {
        name: printable(value).replace("#", "%23") if isinstance(value, str) else value for name, value in found.items()
    }


def _given(problem: Problem | None, values: Mapping[str, Any]) -> Row:
    """Return a row without results; columns of the grid that do not vary have the values of the problem."""
    start: Row = {"rule": "constant", "refine": 0, "young": (None, None)}
    if problem is not None:
        moduli = (None if body.rigid or body.materials else body.young for body in (problem.body1, problem.body2))
        start |= (
            vars(problem.contact) | vars(problem.iteration) | {"young": moduli, "rule": problem.iteration.relaxation}
        )
    start |= values
    start["young1"], start["young2"] = start["young"]
    return {name: plain(start.get(name)) for name in GIVEN} | dict.fromkeys(RESULTS)


def plain(value: Any) -> Any:
    """Return a value of an axis as a column has it: a number as a float, a rule by its name, "auto" as None."""
    if isinstance(value, Rule):
        return value.name
    return None if value == "auto" else float(value) if isinstance(value, Fraction) else value


def _run(found: Row, setting: KnownPieces, values: Mapping[str, Any]) -> dict[str, str]:
    """Fill the columns of a run; return why some of them are None."""
    pair, measured = setting.pair, setting.measured
    found["rho"] = None if measured.rho_max is None else measured.rho_max.value
    why = {} if measured.rho_max else {"rho": measured.reason["rho_max"]}
    rule = rule_of(values.get("rule", pair.settings.relaxation))
    choice = choose(pair, values.get("theta"), measured, rule=rule)
    found |= {"theta": float(choice.theta), "rule": rule.name}
    proved, unproved = _proved(setting, rule, choice)
    found |= proved
    why |= unproved
    columns, unmet = course(pair, rule, choice, setting)
    found |= columns
    return why | unmet


def _proved(setting: KnownPieces, rule: Rule, choice: Choice) -> tuple[Row, dict[str, str]]:
    """Return the columns that a theorem gives, and why one is None."""
    pair, factor, rate = setting.pair, None, None
    outside = pair.outside + ([words] if (words := rule.outside(pair.friction)) else [])
    of_factor = of_rate = outside[0] if outside else "rho or the constants of friction do not exist"
    if isinstance(rule, Constant) and not outside:
        if setting.energy is not None:  # even if q(theta) is 1 or more
            factor = math.sqrt(max(1 - one_minus_square(float(choice.theta), *setting.energy), 0.0))
            rate, of_rate = (factor, "") if factor < 1 else (None, "q(theta) is not below 1")
    elif not outside:  # q is about steps with one factor, even where the rule itself has a proved rate
        of_factor = f"{rule.words}: no constant theta"
        rate = None if choice.rho is None else rule.proved_rate(choice.rho)
    found = {"energy_factor": factor, "proved_rate": rate}
    reasons = {"energy_factor": of_factor, "proved_rate": of_rate}
    return found, {name: words for name, words in reasons.items() if found[name] is None}


# --- how its run goes and ends ----------------------------------------------------------------------------------------


def meets_paper_test(g: Floats, before: Floats) -> Bools:
    """Apply the test of Section 6.3, ``|g_n - g_{n-1}|/|g_n| < 1e-9`` or ``|g_n - g_{n-1}| < 1e-9``, to every column.

    Norms are Euclidean; the second part is in the unit of force of the file.
    """
    increment = lengths(g - before)
    return (increment < PAPER) | (increment < PAPER * lengths(g))


class State(NamedTuple):
    """One evaluation of T in a sweep, of some steps their column ``i``; ``paper`` if the test of Section 6.3 is met."""

    residual: float
    scale: float
    paper: bool
    steps: Steps
    i: int

    def iterate(self, T: FixedPointMap, least: float) -> Iterate:
        """Return all values of this evaluation."""
        return self.steps.found or iterate_at(T, self.steps.g[:, self.i], least)


def states(batches: Iterable[Steps], least: float) -> Iterator[State]:
    """Yield the evaluations of a run one by one; ``least`` is a scale that none falls below."""
    before: Floats | None = None
    for steps in batches:
        g = steps.g
        before = np.full((len(g), 1), math.nan) if before is None else before
        paper = meets_paper_test(g, before if g.shape[1] == 1 else np.column_stack([before, g[:, :-1]])).tolist()
        scales = np.maximum(steps.scale, least).tolist()
        yield from map(State, steps.residual.tolist(), scales, paper, repeat(steps), count())
        before = g[:, -1:]


class Undecided(Exception):
    """Rounding decides when a run ends: its steps must be evaluated one by one."""


def course(pair: ContactPair, rule: Rule, choice: Choice, pieces: KnownPieces) -> tuple[dict[str, Any], dict[str, str]]:
    """Run a pair from its start until both tests are met, or the run stalls, runs away or reaches its limit.

    Returns
    -------
    dict
        The columns of the run in its row, by name: ``steps``, the number until the run ended; ``iterations``, the same
        if it converged; ``iterations_paper``, n at which the test of Section 6.3 is met; ``outcome``; the other three
        as a run has them.
    dict
        Why a column is None, by its name.

    Raises
    ------
    ContactError
        Step II did not reach its certificate before the run ended.
    """
    T, step = pieces.map(), rule.begin(pair, float(choice.theta), choice.rho)
    went = None
    if isinstance(step, Relaxation) and not pair.held:
        with suppress(Undecided):
            went = _follow(pieces, pieces.steps(T, step.theta), T, lean=True)
    if went is None:  # any rule, and where rounding decides: a residual that wanders, or meets the tolerance exactly
        T.restart()
        went = _follow(pieces, map(pieces.single, iterates(T, step, pieces.start.g, pieces.least)), T, lean=False)
    steps, outcome, why = len(went.seen) - 1, went.outcome, went.outcome.why
    reason = {"iterations": why.format(steps=steps)} if why else {}
    if went.paper is None:
        reason["iterations_paper"] = went.why or f"not met before the run ended: {outcome}"
    observed = None if outcome is Outcome.DIVERGED else went.rate(pieces.noise)
    if observed is None:
        diverged = outcome is Outcome.DIVERGED
        reason["observed_rate"] = "the run diverged" if diverged else "too few steps are clear of the rounding"
    end: Iterate | None = None
    coupled, linear = None, None
    try:
        end = went.seen[-1].iterate(T, pieces.least)
        coupled = coupled_residual(pair, end)
    except ContactError as error:
        reason["coupled_residual"] = str(error)
    else:
        if coupled is None:
            reason["coupled_residual"] = NO_FORCE
    try:
        if not isinstance(rule, Constant):
            raise NotLinear(f"the {rule.name} relaxation does not keep theta constant")
        here, first = (end, went.entry) if end and outcome is Outcome.CONVERGED else (pieces.solution(), None)
        linear = linearised_rate(pieces.piece(here), here, float(choice.theta), first)
    except (NotLinear, SolveError, ContactError) as error:
        reason["linearised_rate"] = str(error)
    columns = {
        "iterations": steps if outcome is Outcome.CONVERGED else None,
        "iterations_paper": went.paper,
        "steps": steps,
        "outcome": outcome.value,
        "observed_rate": None if observed is None else observed.value,
        "linearised_rate": linear,
        "coupled_residual": coupled,
    }
    return columns, reason


@dataclass(frozen=True, kw_only=True, eq=False)
class _Went:
    """A run to its end.

    ``seen`` are all evaluations until it ended, ``paper`` is n at which the test of Section 6.3 is met, ``why`` the
    error that ended it before that.
    """

    outcome: Outcome
    seen: Sequence[State]
    paper: int | None
    why: str

    @property
    def batches(self) -> list[Steps]:
        """The steps that were taken together."""
        return [steps for steps, _ in groupby(state.steps for state in self.seen)]

    def rate(self, noise: Noise) -> ObservedRate | None:
        """Return the rate at its end."""
        g, u = (np.hstack([getattr(b, name) for b in self.batches])[:, : len(self.seen)] for name in "gu")
        floors: list[float] = noise.of(g, u).tolist()
        return rate_of([state.residual for state in self.seen], floors, [state.steps.piece[0] for state in self.seen])

    @property
    def entry(self) -> Floats:
        """The g with which it came onto the piece of its last g for good."""
        last = self.batches[-1]
        for steps in reversed(self.batches):
            if steps.piece != last.piece:
                break
            last = steps
        return last.g[:, 0]


def _follow(pieces: KnownPieces, batches: Iterable[Steps], T: FixedPointMap, *, lean: bool) -> _Went:
    """Follow a run to its end, and on until the test of Section 6.3 is met or the run is given up.

    Raises
    ------
    Undecided
        Of lean steps, which are not evaluated one by one.
    """
    pair, least, tolerance = pieces.pair, pieces.least, pieces.pair.settings.tolerance
    ending, walk, seen = Ending(tolerance, pair.settings.max_iterations), states(batches, least), list[State]()

    def ended(state: State) -> Outcome | None:
        outcome = ending.at(state.residual, state.scale, lambda: arrived(pair, state.iterate(T, least)))
        bound = tolerance * state.scale
        if lean and (ending.since > WANDERS or abs(state.residual - bound) <= TIE * bound):
            raise Undecided
        return outcome

    def met(state: State) -> Outcome | None:
        return Outcome.CONVERGED if state.paper else ending.at(state.residual, state.scale, lambda: False)

    outcome, why = follow(walk, ended, seen), ""
    paper = next((n for n, state in enumerate(seen) if state.paper), None)
    if paper is None and not ending.given_up(seen[-1].residual):
        after = list[State]()
        try:
            if follow(walk, met, after) is Outcome.CONVERGED:
                paper = len(seen) + len(after) - 1
        except ContactError as error:
            why = str(error)
    return _Went(outcome=outcome, seen=seen, paper=paper, why=why)

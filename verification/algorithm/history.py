"""A loading history: increments in each of which friction measures slip from the end of the one before.

An increment is a problem of the kind that the theorem is about.  The slip so far, ``u1_T - u2_T`` at the end of the
increment before, is an offset of step II that cancels in every difference: each increment has the same constants,
bounds and Jacobians, and the same factor of one step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.keys import Part, derived, key, says
from ndtheory.number import Numeric
from verification.algorithm.arrival import NO_FORCE
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.monolithic import Solution, SolveError, solve
from verification.algorithm.rates import largest_step_ratio, steps
from verification.algorithm.relaxation import Constant, Rule, rule_of
from verification.algorithm.runs import Run, check_memory, run_from
from verification.algorithm.start import LEAST, Start, begin_at, tied_size
from verification.algorithm.theta import choose
from verification.bounds.bound import BoundResult, Subject
from verification.bounds.table import BY_NAME
from verification.bounds.verdicts import Judgement, judge_bound
from verification.constants import Measured, measure
from verification.contact import ContactError, Solver
from verification.contact.active_set import Systems
from verification.document import Document
from verification.interface.assembly import TwoBodies, discretise
from verification.interface.fields import GROWN, ContactFields
from verification.interface.interface import Interface
from verification.interface.pair import ContactPair, pair_from
from verification.interface.values import ASKED, PointValue, columns_of, values_on_sides
from verification.problem import Problem, load
from verification.problem.steps import Moment, at_rest, moments
from verification.registry import BOUNDS
from verification.value import Value

if TYPE_CHECKING:
    from verification.document import Figure

Method = Literal["iteration", "monolithic"]

#: Why an increment of the global method has no number of the iteration.
NO_ITERATION = "the global method solves the increment at once"

#: When an increment has no number of a Jacobian, and the unit of the work of friction.
NOT_LINEARISED, WORK = "where it was not linearised", "stress · length²"


@dataclass(frozen=True, kw_only=True)
class Promise(Part):
    """The statement of the theorem on an increment before it is run.

    The load is the energy norm, in the contact body, of the change of the jump ``u_c - P u_n`` that the loads would
    cause without contact forces.  The bound of the first residual is ``sqrt(rho)`` times that, plus the residual with
    which the increment before ended.  After so many steps the residual is at most the tolerance times the least scale
    of the run.
    """

    load: float = key(
        "size of the load increment: energy norm, in the contact body, of the change of the jump without contact "
        "forces",
        unit="√stress · length",
    )
    residual: float = key("bound of the first residual", unit="√stress · length")
    factor: float | None = key("the least proved factor of one step", null="where none is below 1", why=None)
    steps: int | None = key("number of steps that suffice", null="without a factor", why=None)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Increment(Value, Part):
    """An increment that was computed.

    Attributes
    ----------
    moment : Moment
        Its end.
    result : Run or Solution
        The run, or the solution of the global method, under the loads at this moment.
    before : ContactFields or None
        Those of the increment before.
    verdicts : mapping from the name of a bound to Judgement
        By the steps of this run.
    """

    part: ClassVar[str] = "Increment"

    moment: Moment
    result: Run | Solution
    before: ContactFields | None
    promise: Promise | None = key(
        "what the theorem says in advance",
        null="where it says nothing, and with the global method",
        why=lambda increment: increment.why_none,
        default=None,
    )
    why_none: str = NO_ITERATION
    verdicts: Mapping[str, Judgement] = key(
        "one for each bound, as in a comparison; none with the global method",
        of=lambda verdicts: {name: judgement.verdict for name, judgement in verdicts.items()},
        type="map of text",
        default_factory=dict,
    )

    @property
    @says(spread=True)
    def contact(self) -> ContactFields:
        """Stresses and motions along Gamma_c at its end."""
        return self.result.contact

    slip_increment = derived(
        "the part of `contact.slip` that the increment brought, from which friction is measured",
        lambda increment: increment.contact.slip_increment,
        list[float],
        name="contact.slip_increment",
        unit="length",
    )

    @property
    @says(**ASKED)
    def points(self) -> tuple[PointValue, ...]:
        """Values at the points that the problem names, at its end."""
        return self.result.points

    step = derived("number of its step, from 1", lambda increment: increment.moment.step, int)
    name = derived("the name of the step", lambda increment: increment.moment.name)

    @property
    @says()
    def time(self) -> float:
        """0 where the history begins, the number of the step at its end."""
        return float(self.moment.time)

    @property
    def summary(self) -> str:
        return f"time {self.time:g} ({self.name}), {self.outcome}, {self.contact.summary}"

    @property
    @says(unit=WORK)
    def dissipated(self) -> float:
        """Work of friction in this increment, by the mean of the shear before and after, per unit thickness."""
        shear = self.contact.shear if self.before is None else self.contact.shear + self.before.shear
        return float((self.contact.weights * (0.5 * shear)) @ self.contact.slip_increment)

    @property
    def run(self) -> Run | None:
        """The run; None with the global method."""
        return self.result if isinstance(self.result, Run) else None

    @property
    @says()
    def outcome(self) -> str:
        """Outcome of its run; ``converged`` of the global method, whose solutions are certified."""
        return "converged" if self.run is None else self.run.outcome

    @property
    @says(null="with the global method", why=NO_ITERATION)
    def iterations(self) -> int | None:
        """Number of steps of its run."""
        return None if self.run is None else self.run.iterations

    @property
    @says(null=NOT_LINEARISED, why=None)
    def predicted_steps(self) -> int | None:
        """Number of steps at the rate of the Jacobian at the solution."""
        run = self.run
        if run is None or run.linearised is None:
            return None
        return steps_to(run.iterates[0].residual, run.pair.settings.tolerance * run.last.scale, run.linearised.rate)

    @property
    @says(null=NOT_LINEARISED, why=None)
    def linearised_rate(self) -> float | None:
        """Rate of that Jacobian."""
        return None if self.run is None or self.run.linearised is None else self.run.linearised.rate

    @property
    @says(
        null="with the global method, and without a force",
        why=lambda increment: NO_ITERATION if increment.run is None else NO_FORCE,
    )
    def coupled_residual(self) -> float | None:
        """Coupled residual of its run."""
        return None if self.run is None else self.run.coupled_residual


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class History(Document):
    """A loading history as far as it was computed.

    Attributes
    ----------
    measured : Measured or None
        The constants; None with the global method.
    bounds : mapping from name to BoundResult
        The bounds that follow from them, which hold for each increment.
    interrupted : bool
        True if Ctrl-C ended it.
    """

    schema: ClassVar[str] = "ndtheory.history/1"

    problem: Problem = key("title of the problem", name="title", of=lambda problem: problem.title, type="text")
    method: Method = key("`iteration`, or `monolithic`: the global method")
    increments: tuple[Increment, ...] = key("in their order; there is none at time 0")
    planned: int = key("number of increments of all steps")
    measured: Measured | None = key(
        "one set for all increments", name="constants", null="with the global method", why=NO_ITERATION
    )
    bounds: Mapping[str, BoundResult] = key(
        "of each increment; none with the global method",
        inside={name: replace(each, absent="with the global method") for name, each in BY_NAME.items()},
    )
    ended: str = key("why the history ended early; empty where it is whole", default="")
    interrupted: bool = False

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.problem.units

    @property
    @says(null="with the global method", why=NO_ITERATION)
    def theta(self) -> float | None:
        """The relaxation factor of every run."""
        first = self.increments[0].run
        return None if first is None else float(first.theta)

    @property
    @says(**ASKED)
    def points(self) -> tuple[PointValue, ...]:
        """Values at the points that the problem names, at the end of the last increment."""
        return self.increments[-1].points

    @property
    @says(unit=WORK)
    def dissipated(self) -> float:
        """Work of friction in all increments, per unit thickness."""
        return sum(each.dissipated for each in self.increments)

    @property
    def summary(self) -> str:
        done = f"{self.problem.title}, {len(self.increments)} of {self.planned} increments by the {self.method}"
        return f"{done}, the last one a {self.unfinished}" if self.unfinished else done

    @property
    def unfinished(self) -> str:
        """The words for the values of the last increment where its run did not converge; empty where it did."""
        last = self.increments[-1].run
        return "" if last is None else last.unfinished

    @property
    def converged(self) -> bool:
        """True if every increment was computed and has converged."""
        return not self.ended

    @property
    @says(name="outside_theorem")
    def outside(self) -> list[str]:
        """Why the theorem does not apply to the increments; empty where it does."""
        return self.increments[0].result.outside

    @property
    def proved_violated(self) -> bool:
        """True if an increment violates a proved bound: a bug, or an error in a proof."""
        return any(
            judgement.verdict == "VIOLATED" and not BOUNDS[name].finding
            for each in self.increments
            for name, judgement in each.verdicts.items()
        )

    @property
    @says()
    def warnings(self) -> list[str]:
        """Facts to know before trusting the numbers.

        Of the increment in which most nodes touch, and the worst checks.
        """
        of_checks = ("largest_strain", "penetration_outside")
        worst = [max(self.increments, key=lambda one: getattr(one.result.checks, name) or 0.0) for name in of_checks]
        widest = min(self.increments, key=lambda one: one.contact.pattern["open"])
        lines = dict.fromkeys(line for each in (widest, *worst) for line in each.result.warnings)
        length = self.units["length"]
        apart = [line for each in self.increments for line in each.contact.warnings(length)]  # most part, or meet later
        nearest = min(self.increments, key=lambda one: float(one.contact.gap.min()))
        steps = [line for line in lines if line not in apart and not (len(self.increments) > 1 and GROWN in line)]
        return steps + nearest.contact.warnings(length)

    @cached_property
    def fields(self) -> Mapping[str, Floats]:
        """Pressure, shear, bound, gap, slip and slip_increment, each of shape (increments, contact nodes)."""
        names = ("pressure", "shear", "bound", "gap", "slip", "slip_increment")
        return {name: np.array([getattr(each.contact, name) for each in self.increments]) for name in names}

    @cached_property
    def driven(self) -> tuple[str, Floats, int]:
        """The load that drives the history: its name, its values from time 0 on, and its axis, 0 along Gamma_c.

        It is the prescribed displacement that varies most, along Gamma_c where one varies there and the problem is
        plane; the mean slip where no displacement is prescribed.
        """
        found, contact = [], self.increments[0].contact
        along = None if contact.normal is None else int(np.abs(contact.normal.mean(axis=0)).argmin())
        problems = [each.result.problem for each in self.increments if each.result.problem is not None]
        for i in self.problem.bodies:
            bodies = [problem.bodies[i] for problem in problems]
            for side, first in bodies[0].prescribed.items():
                for axis in (axis for axis, value in enumerate(first) if value is not None):
                    values = np.array([0.0, *(float(body.prescribed[side][axis] or 0) for body in bodies)])
                    label = f"displacement of {side} of body{i} along {'xy'[axis]}"
                    found.append((axis == along, np.ptp(values), label, values, int(axis != along)))
        if moving := [each for each in found if each[1] > 0]:
            return max(moving, key=lambda each: each[:2])[2:]
        return "mean slip", np.array([0.0, *(self.fields["slip"] @ contact.weights / contact.weights.sum())]), 0

    def linearise(self) -> History:
        """Return the same history with the Jacobian at the end of each increment, for the steps it predicts."""
        each = (one if one.run is None else replace(one, result=one.run.linearise()) for one in self.increments)
        return replace(self, increments=tuple(each))

    def table(self) -> dict[str, list[Any]]:
        """Return one row for each increment as columns: ``pandas.DataFrame(history.table())`` reads it."""
        rows = [each.to_dict() for each in self.increments]
        plain = ("step", "name", "time", "iterations", "outcome", "coupled_residual", "dissipated", "predicted_steps")
        flat = [{name: row[name] for name in plain} | row["force"] | row["pattern"] for row in rows]
        for row, each in zip(flat, self.increments, strict=True):
            row["load"], row["proved_steps"] = (each.promise.load, each.promise.steps) if each.promise else (None, None)
        return {name: [row[name] for row in flat] for name in flat[0]}

    def contact_table(self) -> dict[str, list[Any]]:
        """Return one row for each contact node of each increment, as columns."""
        found = self._over_time(lambda each: each.contact.table())
        return {**found, "slip_increment": self.fields["slip_increment"].ravel().tolist()}

    def point_table(self) -> dict[str, list[Any]]:
        """Return one row for each point that the problem names and each increment, as columns."""
        return self._over_time(lambda each: columns_of(each.points))

    def side_table(self) -> dict[str, list[Any]]:
        """Return one row for each node of the named sides and each increment, as columns."""
        return self._over_time(lambda each: values_on_sides(each.result.bodies, each.result.displacements))

    def _over_time(self, table: Callable[[Increment], Mapping[str, list[Any]]]) -> dict[str, list[Any]]:
        found: dict[str, list[Any]] = {}
        for each in self.increments:
            columns = table(each)
            rows = len(next(iter(columns.values()), ()))
            when: dict[str, list[Any]] = {"step": [each.step] * rows, "time": [each.time] * rows}
            for name, values in (when | dict(columns)).items():
                found.setdefault(name, []).extend(values)
        return found

    def plot(self, view: str = "loop", **options: Any) -> Figure:
        """Draw a view of the history; ValueError for another word, or where there is nothing to draw.

        Views: ``loop``, force against displacement; ``states``, a map over position and time of what sticks, slips and
        is open; ``shear`` against the friction bound at a few increments (``times=[..]`` chooses them); ``points``, the
        displacement over time of the points that the problem names.
        """
        return self.drawn(view=view, **options)


def steps_to(first: float, last: float, factor: float) -> int | None:
    """Return the number of steps by which a residual falls from one size to another; None unless 0 <= factor < 1.

    >>> steps_to(1.0, 1e-3, 0.1), steps_to(1.0, 2.0, 0.5)
    (3, 0)
    """
    if first <= last:
        return 0
    return steps(factor, last / first) if 0 < last < first < math.inf else None


def march(
    problem: Problem | ContactPair | Path | str,
    *,
    method: Method = "iteration",
    theta: Numeric | None = None,
    rule: Rule | str | None = None,
    solver: Solver = "auto",
    watch: Callable[[Increment, int], object] = lambda increment, planned: None,
) -> History:
    """Compute the loading history of the ``[[step]]`` tables of a problem, increment by increment.

    Each increment starts from the forces of the one before, and friction measures slip from its end.  The history ends
    early where a run does not converge, as the slip after it is needed by all others.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    method : {'iteration', 'monolithic'}
        The Neumann-Dirichlet iteration, or the global method: the same history by another path, for comparison.
    theta, rule, solver
        As :func:`verification.run` takes them; not used by the global method.
    watch : callable
        Called with each increment when it is done, and the number of all.

    Returns
    -------
    History

    Raises
    ------
    ProblemError
        Bad input, as a problem without steps.
    ContactError, SolveError
        The first increment has no certified solution.
    ValueError
        Another method, or a pair made from matrices.
    KeyboardInterrupt
        Before the first increment is done; later it ends the history with what was computed.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> steps = [{"increments": 2, "body2": {"prescribed": {"right": "-1/10"}}}]
    >>> done = march(Problem.from_dict(example("two-bars").to_dict() | {"step": steps}))
    >>> [(each.time, each.outcome) for each in done.increments]
    [(0.5, 'converged'), (1.0, 'converged')]
    """
    if method not in get_args(Method):
        raise ValueError(f"method {method!r}: needed 'iteration' or 'monolithic'")
    whole, rest = _at_rest(problem)
    path = list(moments(whole))
    start = pair_from(rest) if method == "iteration" and isinstance(rest, Problem) else rest
    bodies = discretise(start) if isinstance(start, Problem) else start.on_meshes()
    for end in _ends(path):
        bodies.under(end, None)  # refuses sides that contradict each other
    by = _Iteration(start, theta, rule, solver) if method == "iteration" and isinstance(start, ContactPair) else None
    increments = _by_global_method(bodies, path) if by is None else by.increments(path)
    done: list[Increment] = []
    ended, interrupted = "", False
    try:
        for increment in increments:
            done.append(increment)
            watch(increment, len(path))
            if increment.outcome != "converged":
                ended = f"the run of increment {len(done)} of {len(path)} ended otherwise: {increment.outcome}"
                break
    except KeyboardInterrupt:
        if not done:
            raise
        interrupted, ended = True, f"interrupted after increment {len(done)} of {len(path)}"
    except (ContactError, SolveError) as error:
        if not done:
            raise
        ended = f"increment {len(done) + 1} of {len(path)} has no solution: {error}"
    return History(
        problem=whole,
        method=method,
        increments=tuple(done),
        planned=len(path),
        measured=None if by is None else by.measured,
        bounds={} if by is None else by.bounds,
        ended=ended,
        interrupted=interrupted,
    )


def _at_rest(problem: Problem | ContactPair | Path | str) -> tuple[Problem, Problem | ContactPair]:
    """Return a problem with its steps, and the problem or its pair before the first one."""
    if isinstance(problem, ContactPair):
        if problem.problem is None:
            raise ValueError("this pair is made from matrices: needed a problem with [[step]] tables")
        whole = problem.problem
    else:
        whole = problem if isinstance(problem, Problem) else load(problem)
    if not whole.steps:
        raise whole.refuse("step", None, "needed [[step]] tables, one for each step of the loading history")
    rest = at_rest(whole)
    if not isinstance(problem, ContactPair):
        return whole, rest
    if rest.prescribes != whole.prescribes:
        raise whole.refuse("step", None, "needed a pair whose bodies prescribe the sides that the first step does")
    return whole, problem.under(rest)


def _ends(path: list[Moment]) -> list[Problem]:
    """Return the problems at the ends of steps, between which loads change in proportion."""
    return [moment.problem for moment in path if moment.time.denominator == 1]


def _slipped(before: ContactFields | None, interface: Interface) -> Floats | None:
    return None if before is None else before.slip[: interface.contact.t]


def _by_global_method(bodies: TwoBodies, path: list[Moment]) -> Iterator[Increment]:
    before: ContactFields | None = None
    for moment in path:
        solution = solve(bodies.under(moment.problem, _slipped(before, bodies.interface)))
        yield Increment(moment=moment, result=solution, before=before)
        before = solution.contact


class _Iteration:
    """The increments by the iteration: constants, bounds and theta once, linear systems shared by all runs."""

    def __init__(self, pair: ContactPair, theta: Numeric | None, rule: Rule | str | None, solver: Solver) -> None:
        check_memory(pair)
        self._pair, self._solver = pair, solver
        self.measured = measure(pair)
        self._rule = rule_of(rule or pair.settings.relaxation)
        self._choice = choose(pair, theta, self.measured, rule=self._rule)
        subject = Subject.of(pair, self.measured)
        calculated = {name: bound for name, bound in BOUNDS.items() if bound.calculated}
        self.bounds = {name: bound.evaluate(subject, self._choice.theta) for name, bound in calculated.items()}
        constant = isinstance(self._rule, Constant)
        other = [] if constant else [f"the bounds are about a constant theta, not {self._rule.name}"]
        self._outside = "; ".join([*pair.outside, *other])
        proved = [bound.factor for name, bound in self.bounds.items() if not BOUNDS[name].finding]
        below = [factor.value for factor in proved if factor is not None and factor.value < 1]
        self._factor = min(below, default=None)

    def increments(self, path: list[Moment]) -> Iterator[Increment]:
        contact = self._pair.contact
        motions = contact.motions if contact.loose else np.zeros((contact.grid.size, 0))
        systems = Systems(contact.schur, contact.free, motions)
        before: Run | None = None
        largest = 0.0
        # a norm of what follows from the loads is largest at an end
        tied = max(tied_size(self._pair.under(problem, None)) for problem in _ends(path))
        for moment in path:
            earlier = None if before is None else before.contact
            pair = self._pair.under(moment.problem, _slipped(earlier, self._pair.interface))
            T = FixedPointMap(pair, self._solver, systems=systems)
            if before is None or not largest:
                start = begin_at(T)
            else:
                start = Start(g=before.last.g, source="given", why="the forces of the increment before")
            start = replace(start, scale=LEAST * max(largest, tied))
            run = run_from(T, self._rule, self._choice, start)
            if run.outcome == "interrupted":
                raise KeyboardInterrupt
            largest = max(largest, run.last.size)
            seen = largest_step_ratio(pair, run.iterates)
            verdicts = {name: judge_bound(bound, seen, self._outside) for name, bound in self.bounds.items()}
            promise, why = self._promise(before, run)
            yield Increment(moment=moment, result=run, before=earlier, promise=promise, why_none=why, verdicts=verdicts)
            before = run

    def _promise(self, before: Run | None, run: Run) -> tuple[Promise | None, str]:
        """Bound the first residual of a run and its steps, or return why that cannot be done.

        At the forces with which the increment before ended, its own T and the T of this increment without the change of
        loads have the same value: the slip so far stands where the slip was.  The loads change q of step II by
        ``S_c dj``, with dj the change of the jump without contact forces; step II, at the same friction bound, is not
        expansive from q to the reaction in the norm of ``S_c^-1``, and ``|P' f|^2 <= rho |f|^2`` from there to (5.21).
        """
        pair, rho = run.pair, self.measured.rho_max
        if self._outside or pair.contact.loose or rho is None:
            return None, self._outside or "contact alone holds the contact body: the loads may throw it anywhere"
        earlier = iterate_at(FixedPointMap(self._pair), run.start.g) if before is None else before.last
        if not np.array_equal(run.start.g, earlier.g):
            return None, run.start.why or "the run starts from 0, not from the forces before it"
        change = _free_jump(pair) - _free_jump(self._pair if before is None else before.pair)
        size = math.sqrt(max(float(change @ pair.contact.schur @ change), 0.0))
        residual = math.sqrt(rho.value) * size + earlier.residual
        least = pair.settings.tolerance * min(iterate.scale for iterate in run.iterates)
        steps = None if self._factor is None else steps_to(residual, least, self._factor)
        return Promise(load=size, residual=residual, factor=self._factor, steps=steps), ""


def _free_jump(pair: ContactPair) -> Floats:
    """Return ``u_c - P u_n`` along Gamma_c without contact forces."""
    return pair.contact.unloaded - pair.interface.carry(pair.neumann.unloaded)

"""A run of the algorithm from its start to its outcome."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from fem1d2d.mesh import Floats
from ndtheory import Number
from ndtheory.keys import Key, derived, key, says
from ndtheory.number import Numeric
from verification.algorithm.arrival import NO_FORCE, arrived, coupled_residual
from verification.algorithm.fixed_point import FixedPointMap, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import Forecast, Linearisation, NotLinear, at_solution, forecast, linearise
from verification.algorithm.loop import Ending, Outcome, follow
from verification.algorithm.monolithic import SolveError
from verification.algorithm.rates import ObservedRate, observed_rate
from verification.algorithm.relaxation import Constant, Rule, rule_of
from verification.algorithm.remedy import Remedy, remedy_of
from verification.algorithm.start import Start, begin_at, compared_with
from verification.algorithm.theta import Choice, choose
from verification.constants import Measured
from verification.contact import ContactError, Solver
from verification.document import Document
from verification.interface.assembly import TwoBodies
from verification.interface.build import pair_of
from verification.interface.checks import Checks, check_state
from verification.interface.fields import ContactFields
from verification.interface.interface import Grids
from verification.interface.pair import ContactPair
from verification.interface.values import ASKED, PointValue, values_at_points
from verification.machine.interrupts import INTERRUPTED
from verification.machine.threads import one_thread
from verification.problem import Problem
from verification.problem.tables import ProblemError

if TYPE_CHECKING:
    from verification.document import Figure

R = TypeVar("R")

#: Why a run is not linearised: that takes longer than the run, and is done only on request.
NOT_ASKED = "not worked out: linearise() does"

#: Why a run shows no rate.
FEW = "fewer than two step ratios are clear of rounding"

SOLVED = Key(says="how often each solver solved step II", type="integer")

#: Bytes that the iterates of a run may fill, and the measured size of each without its four arrays.
MOST_BYTES, ITERATE_BYTES = 2_000_000_000, 1600


def _no_rate(run: Run) -> str:
    return "the run diverged: it shows growth, not a rate" if run.outcome == "diverged" else FEW


def _of_jacobian(attribute: str, says: str, null: str = "", why: str = "") -> Any:
    """A value of the linearisation, null where there is none, and where ``null`` says."""
    return derived(
        says,
        lambda run: getattr(run.linearised, attribute, None),
        float,
        null=f"where it was not linearised{null}",
        why=lambda run: why if run.linearised else run.why_not_linearised,
    )


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Run(Document):
    """A finished run.

    Attributes
    ----------
    pair : ContactPair
        The bodies that were run, with the settings that ended the run.
    rule : Rule
        The relaxation rule, which chose each next g.
    iterates : tuple of Iterate
        At least one.
    interrupted : bool
        True if Ctrl-C ended the run, or what was to be worked out after it: nothing is linearised then.
    linearised : Linearisation or None
        The linearisation at the solution; None where ``why_not_linearised`` says why.
    """

    schema: ClassVar[str] = "ndtheory.run/1"
    part: ClassVar[str] = "Run"

    pair: ContactPair = key("title of the problem", name="title", of=lambda pair: pair.title, type="text")
    rule: Rule
    choice: Choice
    start: Start = key(
        "where the run starts: `zero`, `given`, or `tied`, the solution of the bodies tied together; `reason` says why "
        "where it is not `zero`",
        of=lambda start: start.source,
        type="text",
    )
    iterates: tuple[Iterate, ...]
    outcome: Outcome = key("`converged`, `stalled`, `limit`, `diverged` or `interrupted`")
    interrupted: bool = False
    linearised: Linearisation | None = None
    why_not_linearised: str = NOT_ASKED
    forecast: Forecast | None = key(
        "the prediction of the end by the Jacobian half way",
        null="where none was asked for or made",
        why=lambda run: run.why_no_forecast,
        default=None,
    )
    why_no_forecast: str = NOT_ASKED

    linearised_rate = _of_jacobian("rate", "spectral radius of the Jacobian at the end, on what the run excites")
    linearised_norm = _of_jacobian("norm", "norm of that Jacobian")
    linearised_radius = _of_jacobian("radius", "spectral radius of that Jacobian")
    linearised_margin = _of_jacobian(
        "margin",
        "how far g may move until a node changes its state, relative",
        ", and where none does",
        "no change of g changes a state",
    )
    predicted_rate = _of_jacobian(
        "predicted",
        "the rate that the Jacobian gives for the error of the run, a test of the Jacobian",
        ", and where the run has no suitable steps",
        "the run did not end in a stretch of steps without a change of state",
    )
    theta_source = derived(
        "`given`, `proved`, `predicted`, or the rule that takes its own step", lambda run: run.choice.source
    )
    theta_reason = derived("why this one", lambda run: run.choice.why)
    neumann_body = derived("1 or 2", lambda run: run.pair.neumann_body, int)
    grids = derived(
        r"the grids along $\Gamma_c$",
        lambda run: Grids(contact_body=run.pair.contact_body, **run.pair.interface.counts),
        Grids,
    )
    unrelaxed_residual = derived(
        r"$\lvert\lvert\lvert Tg - g\rvert\rvert\rvert$ over the larger of $\lvert\lvert\lvert g\rvert\rvert\rvert$ "
        r"and $\lvert\lvert\lvert Tg\rvert\rvert\rvert$",
        lambda run: run.last.relative_residual,
        float,
        null="where it is infinite",
    )
    kkt_residual = derived(
        "the largest violation of a condition of step II, relative", lambda run: run.last.contact.kkt.residual, float
    )

    @property
    @says(of=float, type="number")
    def theta(self) -> Fraction:
        """The relaxation factor; the step length of the triple momentum method."""
        return self.choice.theta

    relaxation = derived("the name of the rule", lambda run: run.rule.name)

    @property
    @says(name="outside_theorem")
    def outside(self) -> list[str]:
        """Why the theorem does not apply to the problem; empty where it does."""
        rule = self.rule.outside(self.pair.friction)
        return self.pair.outside + ([rule] if rule else [])

    @property
    @says(null="elsewhere", why="momentum without friction has one; for a constant theta see the bounds")
    def proved_rate(self) -> Number | None:
        """The proved rate of a rule that has one, as momentum without friction."""
        rate = None if self.outside or self.choice.rho is None else self.rule.proved_rate(self.choice.rho)
        return None if rate is None else Number.of_float(rate)

    @property
    @says()
    def converged(self) -> bool:
        """True if the residual fell to the tolerance, relative to the present forces, in a state of contact."""
        return self.outcome == "converged"

    @property
    def unfinished(self) -> str:
        """The words for the values at the end of a run that did not converge; empty where it did."""
        return self.outcome.unfinished

    @cached_property
    def remedy(self) -> Remedy | None:
        """The change to try where the run did not converge; None where it did, or was interrupted.

        It may measure rho for both roles.
        """
        if self.outcome in ("converged", "interrupted"):
            return None
        return remedy_of(
            self.pair,
            self.rule,
            float(self.theta),
            outcome=self.outcome,
            last=self.last,
            rate=self.observed_rate,
            coupled=self.coupled_residual,
        )

    @cached_property
    @says(null="without a force", why=NO_FORCE)
    def coupled_residual(self) -> float | None:
        """Largest violation of a condition of contact by the joined state at the end, relative to its own traction g.

        Both displacements are joined, with g as the traction between the bodies; in the norm (5.21).  See
        :func:`verification.algorithm.arrival.coupled_residual`.
        """
        return coupled_residual(self.pair, self.last)

    @property
    def last(self) -> Iterate:
        """The last iterate."""
        return self.iterates[-1]

    iterations = derived("relaxations (III) done until the last evaluation of T", lambda run: run.last.iteration, int)
    evaluations = derived("evaluations of T", lambda run: len(run.iterates), int)

    @cached_property
    def _at_the_end(self) -> ObservedRate | None:
        return observed_rate(self.pair, self.iterates)

    @property
    @says(
        of=lambda rate: rate.value, type="number", null="where too few steps are clear of rounding errors", why=_no_rate
    )
    def observed_rate(self) -> ObservedRate | None:
        """Factor of the error per step at the end of the run: ``value``, between ``lo`` and ``hi``.

        None where too few steps are clear of the noise, or the run diverged.
        """
        return None if self.outcome == "diverged" else self._at_the_end

    @property
    @says(null="with it", why=_no_rate)
    def observed_rate_interval(self) -> tuple[float, float] | None:
        """Both ends of the observed rate."""
        return None if self.observed_rate is None else (self.observed_rate.lo, self.observed_rate.hi)

    @property
    @says(null="elsewhere", why=lambda run: FEW if run.outcome == "diverged" else "the run did not diverge")
    def observed_growth(self) -> float | None:
        """The factor by which the residual of a run that diverged grew in a step at its end; None of any other run."""
        grown = self._at_the_end if self.outcome == "diverged" else None
        return None if grown is None else grown.value

    def linearise(self) -> Run:
        """Return the same run with its linearisation at the solution, and the forecast that could be made half way.

        A run that did not arrive is linearised at the solution of the global method.
        """
        settings, theta = self.pair.settings, float(self.theta)

        def at_the_end() -> Linearisation:
            if self.converged:
                return linearise(self.pair, self.last, theta, self.iterates)
            return linearise(self.pair, at_solution(FixedPointMap(self.pair)), theta)

        linearised, why = self._tried(at_the_end)
        made, why_none = self._tried(
            lambda: forecast(self.pair, self.iterates, theta, settings.tolerance, settings.max_iterations)
        )
        return replace(self, linearised=linearised, why_not_linearised=why, forecast=made, why_no_forecast=why_none)

    def _tried(self, compute: Callable[[], R]) -> tuple[R | None, str]:
        """Compute something for a constant theta, or return why there is nothing."""
        if self.interrupted:
            return None, INTERRUPTED
        if not isinstance(self.rule, Constant):
            return None, f"the {self.relaxation} relaxation does not keep theta constant"
        try:
            with one_thread():
                return compute(), ""
        except (NotLinear, SolveError, ContactError) as error:
            return None, str(error)

    @cached_property
    @says(spread=True)
    def contact(self) -> ContactFields:
        """Stresses and motions along Gamma_c at the last iterate."""
        return self.contact_at(self.last)

    def contact_at(self, iterate: Iterate) -> ContactFields:
        """Return stresses and motions along Gamma_c at an iterate."""
        pair, solved = self.pair, iterate.contact
        turned = np.ones(len(solved.v))
        turned[pair.contact.grid.tangential] = pair.normal_sign  # to body 1 against body 2
        shown, v = pair.interface.shown, solved.v
        if shown is not pair.interface:
            v = v + pair.interface.carry(iterate.displacement) - shown.carry(iterate.displacement)
        force, jump = turned * solved.force, turned * v
        return ContactFields.of(
            pair.interface, force=force, bound=pair.bound(iterate.g), jump=jump, state=solved.pattern
        )

    @property
    def bodies(self) -> TwoBodies:
        """The bodies on their meshes; ValueError where the pair is made from matrices."""
        return self.pair.on_meshes()

    @cached_property
    def displacements(self) -> tuple[Floats | None, Floats | None]:
        """Displacement of all nodes of body 1 and body 2 at the last iterate, shape (nodes, d), unit of length.

        None of an obstacle.  ValueError where the pair is made from matrices.
        """
        first, second = (
            None if side.rigid else side.mesh_body.displacement(trace)
            for side, trace in zip((self.pair.body1, self.pair.body2), self.traces_at(self.last), strict=True)
        )
        return first, second

    def traces_at(self, iterate: Iterate) -> tuple[Floats, Floats]:
        """Return the displacements of body 1 and body 2 along Gamma_c at an iterate, normal components along y."""
        contact, neumann = self.pair.contact, self.pair.neumann
        moved = self.pair.interface.carry(iterate.displacement) + iterate.contact.v + self.pair.offset
        of_contact, of_neumann = contact.orient(moved), neumann.orient(iterate.displacement)
        return (of_contact, of_neumann) if self.pair.neumann_body == 2 else (of_neumann, of_contact)

    @cached_property
    @says()
    def checks(self) -> Checks:
        """Checks of the bodies outside Gamma_c and of their strains, at the last iterate."""
        why = "the run diverged" if self.outcome == "diverged" else ""
        return check_state(self.pair, lambda: self.displacements, lambda: self.contact, why)

    @cached_property
    @says(**ASKED)
    def points(self) -> tuple[PointValue, ...]:
        """Values at the points that the problem names, at the last iterate."""
        if self.problem is None or self.outcome == "diverged" or not self.bodies.places:
            return ()
        return values_at_points(self.bodies, self.displacements)

    @property
    @says(inside=dict.fromkeys(("cvxpy", "active_set"), SOLVED))
    def solves(self) -> dict[str, int]:
        """Number of times that each solver solved step II."""
        solvers = [iterate.contact.solver for iterate in self.iterates]
        return {"cvxpy": solvers.count("cvxpy"), "active_set": solvers.count("active-set")}

    @property
    @says(type="list of number or null")
    def history(self) -> list[float]:
        """Relative unrelaxed residual of every evaluation; a member is null where it is infinite."""
        return [iterate.relative_residual for iterate in self.iterates]

    @property
    def reason(self) -> dict[str, str]:
        """Why the run does not start at zero."""
        return {"start": self.start.why} if self.start.why else {}

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.pair.units

    @property
    def problem(self) -> Problem | None:  # type: ignore[override]
        """The problem of the pair."""
        return self.pair.problem

    @property
    def summary(self) -> str:
        rate = "" if self.observed_rate is None else f", observed rate {self.observed_rate.value:.4g}"
        ended = f"{self.outcome} after {self.iterations} steps at theta {float(self.theta):.4g}{rate}"
        return ", ".join(filter(None, (self.pair.title, ended, self.unfinished)))

    def table(self) -> dict[str, list[Any]]:
        """Return the history as columns, one row for each evaluation of T: ``pandas.DataFrame(run.table())`` reads it.

        Columns: iteration; residual (force, in the norm (5.21)) and relative_residual; kkt_residual and solver of step
        II; the numbers of nodes that stick, slip and are open.
        """
        rows = self.iterates
        patterns = [self.contact_at(iterate).pattern for iterate in rows]
        return {
            "iteration": [iterate.iteration for iterate in rows],
            "residual": [iterate.residual for iterate in rows],
            "relative_residual": [iterate.relative_residual for iterate in rows],
            "kkt_residual": [iterate.contact.kkt.residual for iterate in rows],
            "solver": [iterate.contact.solver for iterate in rows],
            **{name: [pattern[name] for pattern in patterns] for name in ("stick", "slip", "open")},
        }

    @property
    @says()
    def warnings(self) -> list[str]:
        """Facts to know before trusting the numbers."""
        tied = [self.start.why] if self.start.source == "tied" else []
        grown = self.contact.grown(self.pair.interface, float(self.pair.friction))
        state = [*grown, *self.contact.warnings(self.units["length"]), *self.checks.warnings] if self.converged else []
        return self.pair.warnings + self.choice.warnings + tied + state

    def plot(self, view: str = "residuals", **options: Any) -> Figure:
        """Draw the "residuals" over the steps, or the "bodies" at the last iterate; ValueError for another word.

        The bodies take the options of :meth:`verification.Solution.plot`: ``stress="mises"``, ``zoom=True``.
        """
        return self.drawn(view=view, **options)


def unwatched(iterate: Iterate) -> None:
    """Show nothing."""


def check_memory(pair: ContactPair) -> None:
    """Refuse, by a ProblemError, a run whose iterates would not fit into memory: every one is kept."""
    most, asked = MOST_BYTES // (ITERATE_BYTES + 4 * 8 * pair.neumann.grid.size), pair.settings.max_iterations
    if asked > most:
        n = pair.contact.grid.n
        needed = f"needed at most {most}: every iterate is kept, and so many of {n} contact nodes fill 2 GB"
        raise ProblemError(pair.source, "iteration.max_iterations", asked, needed)


def run(
    problem: Problem | ContactPair | Path | str,
    *,
    theta: Numeric | None = None,
    rule: Rule | str | None = None,
    start: ArrayLike | None = None,
    solver: Solver = "auto",
    watch: Callable[[Iterate], None] = unwatched,
    measured: Measured | None = None,
) -> Run:
    """Run the algorithm until it converges, stalls, diverges, reaches its limit, or Ctrl-C ends it.

    g are the forces that the bodies exchange, T g those after one step without relaxation. The run has converged
    where ``|||T g - g|||`` is at most the tolerance times the larger of ``|||g|||`` and ``|||T g|||``, and the
    joined state satisfies the contact laws (:func:`verification.algorithm.arrival.arrived`).

    Parameters
    ----------
    problem : Problem, ContactPair or path
    theta : number, str or 'auto', optional
        Relaxation factor, 0 < theta < 1; the problem's by default.  A text such as "0.6" is read exactly.
    rule : Rule or str, optional
        The relaxation rule, or the name of one; the problem's by default.
    start : array, shape (2 n,), optional
        g_0: nodal forces on the Neumann grid, tangential ones first, as ``run.last.g`` of an earlier run.  By default
        0, or the solution of the tied bodies where step II has no minimiser at 0.
    solver : {'auto', 'cvxpy', 'active-set'}
        Solver of step II.
    watch : callable
        Called with each iterate, for live progress.
    measured : Measured, optional
        The constants, where they are known already; an automatic theta and momentum need them.

    Returns
    -------
    Run

    Raises
    ------
    ProblemError, HypothesisError
        Bad input.
    ContactError
        Step II did not reach its KKT certificate, or has no minimiser at the start.
    KeyboardInterrupt
        Before the first iterate; later it ends the run with what was computed.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(2, 1))
    >>> finished = run(bars, theta="1/3")
    >>> finished.outcome, finished.iterations
    ('converged', 1)
    """
    pair = pair_of(problem, obstacle=True)
    check_memory(pair)
    relaxation = rule_of(rule or pair.settings.relaxation)
    choice = choose(pair, theta, measured, rule=relaxation)
    T = FixedPointMap(pair, solver)
    return run_from(T, relaxation, choice, begin_at(T, start), watch)


def run_from(
    T: FixedPointMap, rule: Rule, choice: Choice, start: Start, watch: Callable[[Iterate], None] = unwatched
) -> Run:
    """Run T with a rule and a theta from a start to its outcome; parameters and errors as for :func:`run`."""
    pair, step = T.pair, rule.begin(T.pair, float(choice.theta), choice.rho)
    ending = Ending(pair.settings.tolerance, pair.settings.max_iterations)
    seen: list[Iterate] = []

    def ended(found: Iterate) -> Outcome | None:
        watch(found)
        return ending.at(found.residual, found.scale, lambda: arrived(pair, found))

    try:
        outcome = follow(iterates(T, step, start.g, compared_with(pair, start)), ended, seen)
    except KeyboardInterrupt:
        if not seen:
            raise
        outcome = Outcome.INTERRUPTED
    return Run(
        pair=pair,
        rule=rule,
        choice=choice,
        start=start,
        iterates=tuple(seen),
        outcome=outcome,
        interrupted=outcome is Outcome.INTERRUPTED,
    )

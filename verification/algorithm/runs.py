"""A run of the algorithm from g = 0 to its outcome."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory import Number
from verification.algorithm.fixed_point import FixedPointMap, state_at, states
from verification.algorithm.iterate import State
from verification.algorithm.linearisation import Forecast, Linearisation, NotLinear, forecast, linearise
from verification.algorithm.rates import ObservedRate, observed_rate
from verification.algorithm.relaxation import momentum_rate, outside, rule
from verification.algorithm.theta import Choice, choose
from verification.constants import Measured
from verification.contact import ContactError, Solver
from verification.document import Document
from verification.interface.assembly import build
from verification.interface.fields import ContactState
from verification.interface.pair import Pair
from verification.interrupts import INTERRUPTED
from verification.monolithic import SolveError, solve
from verification.problem.specification import Problem, Relaxation
from verification.problem.tables import ProblemError
from verification.threads import one_thread

Outcome = Literal["converged", "stalled", "limit", "diverged", "interrupted"]

#: A run without a new least residual over so many steps has stalled.
PATIENCE = 50

#: A residual grown by this factor over the first one has diverged.
RUNAWAY = 1e8

#: What the states of a run may fill, and what each of them takes beside its four arrays: measured.
MOST_BYTES, STATE_BYTES = 2_000_000_000, 1600


@dataclass(frozen=True, kw_only=True, eq=False)
class Run(Document):
    """A finished run.

    Attributes
    ----------
    pair : Pair
    choice : Choice
        theta and where it comes from.
    states : tuple of State
        At least one.
    outcome : {'converged', 'stalled', 'limit', 'diverged', 'interrupted'}
    interrupted : bool
        Whether Ctrl-C ended the run, or what was to be worked out after it: nothing is linearised then.
    """

    schema: ClassVar[str] = "ndtheory.run/1"

    pair: Pair
    choice: Choice
    states: tuple[State, ...]
    outcome: Outcome
    interrupted: bool = False

    @property
    def theta(self) -> Fraction:
        """The relaxation factor; the step length of the triple momentum method."""
        return self.choice.theta

    @property
    def relaxation(self) -> Relaxation:
        """The rule."""
        return self.pair.problem.iteration.relaxation

    @property
    def outside(self) -> list[str]:
        """Why the theorem does not speak of this run; empty where it does."""
        rule = outside(self.relaxation, float(self.pair.problem.contact.friction))
        return self.pair.outside + ([rule] if rule else [])

    @property
    def proved_rate(self) -> Number | None:
        """The rate that is proved of the rule itself: momentum without friction has one; None otherwise."""
        if self.relaxation != "momentum" or self.outside or self.choice.rho is None:
            return None
        return Number.of_float(momentum_rate(self.choice.rho))

    @property
    def converged(self) -> bool:
        """Whether the residual fell to the tolerance, relative to the largest ``|||T g|||`` seen."""
        return self.outcome == "converged"

    @property
    def last(self) -> State:
        """The last state."""
        return self.states[-1]

    @property
    def iterations(self) -> int:
        """Relaxations (III) done until the last evaluation of T."""
        return self.last.iteration

    @property
    def evaluations(self) -> int:
        """Evaluations of T."""
        return len(self.states)

    @cached_property
    def _at_the_end(self) -> ObservedRate | None:
        return observed_rate(self.pair, self.states)

    @property
    def observed_rate(self) -> ObservedRate | None:
        """The asymptotic rate; None where too few steps stand clear of the noise, or the run diverged."""
        return None if self.outcome == "diverged" else self._at_the_end

    @property
    def observed_growth(self) -> float | None:
        """By what factor a step the residual of a run that diverged grew at its end; None of any other run."""
        grown = self._at_the_end if self.outcome == "diverged" else None
        return None if grown is None else grown.value

    @cached_property
    def linearised(self) -> Linearisation | None:
        """The linearisation at the solution; None where ``why_not_linearised`` says why.

        A run that did not arrive is linearised at the solution of the global method.
        """
        return self._linearised[0]

    @property
    def why_not_linearised(self) -> str:
        """Why there is no linearisation; empty where there is."""
        return self._linearised[1]

    @cached_property
    def _linearised(self) -> tuple[Linearisation | None, str]:
        if self.interrupted:
            return None, INTERRUPTED
        if self.relaxation != "constant":
            return None, f"the {self.relaxation} relaxation is no constant theta"
        try:
            with one_thread():
                if self.converged:
                    return linearise(self.pair, self.last, float(self.theta), self.states), ""
                return linearise(self.pair, self._solution(), float(self.theta)), ""
        except (NotLinear, SolveError, ContactError) as error:
            return None, str(error)

    @property
    def forecast(self) -> Forecast | None:
        """What could be said of the run half way; None where ``why_no_forecast`` says why."""
        return self._forecast[0]

    @property
    def why_no_forecast(self) -> str:
        """Why there is no forecast; empty where there is."""
        return self._forecast[1]

    @cached_property
    def _forecast(self) -> tuple[Forecast | None, str]:
        if self.interrupted:
            return None, INTERRUPTED
        if self.relaxation != "constant":
            return None, f"the {self.relaxation} relaxation is no constant theta"
        settings = self.pair.problem.iteration
        try:
            with one_thread():
                made = forecast(self.pair, self.states, float(self.theta), settings.tolerance, settings.max_iterations)
            return made, ""
        except NotLinear as error:
            return None, str(error)

    def _solution(self) -> State:
        """T at the solution of the global method."""
        pair = self.pair
        found = solve(pair).contact
        g = np.concatenate([pair.upward * found.shear[: pair.tangential.stop], found.pressure])
        weights = np.tile(found.weights, pair.problem.dimension)
        return state_at(FixedPointMap(pair), weights * g)

    @cached_property
    def contact(self) -> ContactState:
        """Gamma_c at the last state."""
        pair, solved = self.pair, self.last.contact
        turned = np.ones(len(solved.v))
        turned[pair.tangential] = pair.upward  # from contact body against Neumann body to body 1 against body 2
        pattern = solved.pattern
        return ContactState.of(
            pair,
            force=turned * solved.force,
            jump=turned * solved.v,
            touching=pattern.touching,
            sliding=pattern.sliding,
        )

    @property
    def facing(self) -> Pair:
        """The bodies."""
        return self.pair

    @cached_property
    def displacements(self) -> tuple[Floats, Floats]:
        """Displacement of all nodes of body 1 and body 2 at the last state, shape (nodes, d), unit of length."""
        pair, state = self.pair, self.last
        moved = state.displacement + state.contact.v
        moved[pair.normal] += pair.gap
        neumann, contact = pair.orient(state.displacement), pair.orient(moved)
        first, second = (contact, neumann) if pair.problem.iteration.neumann_body == 2 else (neumann, contact)
        return pair.body1.displacement(first), pair.body2.displacement(second)

    @property
    def history(self) -> list[float]:
        """Relative unrelaxed residual of every evaluation."""
        return [s.relative_residual for s in self.states]

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.pair.problem.units

    def content(self) -> dict[str, Any]:
        rate = self.observed_rate
        solvers = [s.contact.solver for s in self.states]
        linear = self.linearised
        proved = self.proved_rate
        reason: dict[str, str] = {}
        if proved is None:
            reason["proved_rate"] = "momentum without friction has one; for a constant theta see the editions"
        if linear is None:
            names = ("linearised_rate", "linearised_norm", "linearised_radius", "linearised_margin", "predicted_rate")
            reason |= dict.fromkeys(names, self.why_not_linearised)
        else:
            if linear.predicted is None:
                reason["predicted_rate"] = "the run did not end in a stretch of steps without a change of state"
            if not np.isfinite(linear.margin):
                reason["linearised_margin"] = "no change of g changes a state"
        few = "fewer than two step ratios stand clear of rounding"
        if rate is None:
            why = "the run diverged: it shows growth, not a rate" if self.outcome == "diverged" else few
            reason |= {"observed_rate": why, "observed_rate_interval": why}
        if self.observed_growth is None:
            reason["observed_growth"] = "the run did not diverge" if self.outcome != "diverged" else few
        if self.forecast is None:
            reason["forecast"] = self.why_no_forecast
        return {
            "title": self.pair.problem.title,
            "theta": float(self.theta),
            "theta_source": self.choice.source,
            "theta_reason": self.choice.why,
            "relaxation": self.relaxation,
            "neumann_body": self.pair.problem.iteration.neumann_body,
            "iterations": self.iterations,
            "evaluations": self.evaluations,
            "outcome": self.outcome,
            "converged": self.converged,
            "proved_rate": None if proved is None else proved.to_dict(),
            "observed_rate": None if rate is None else rate.value,
            "observed_rate_interval": None if rate is None else [rate.lo, rate.hi],
            "observed_growth": self.observed_growth,
            "forecast": None if self.forecast is None else vars(self.forecast),
            "linearised_rate": None if linear is None else linear.rate,
            "linearised_norm": None if linear is None else linear.norm,
            "linearised_radius": None if linear is None else linear.radius,
            "linearised_margin": None if linear is None or not np.isfinite(linear.margin) else linear.margin,
            "predicted_rate": None if linear is None else linear.predicted,
            "unrelaxed_residual": _finite(self.last.relative_residual),
            "kkt_residual": self.last.contact.kkt.residual,
            "solves": {"cvxpy": solvers.count("cvxpy"), "active_set": solvers.count("active-set")},
            **self.contact.to_dict(),
            "history": [_finite(r) for r in self.history],
            "outside_theorem": self.outside,
            "warnings": self.pair.warnings + self.pair.problem.iteration.warnings,
            "reason": reason,
        }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _check_memory(pair: Pair) -> None:
    """Refuse a run whose states would not fit into memory: every one is kept."""
    problem, size = pair.problem, len(pair.neumann.load)
    most, asked = MOST_BYTES // (STATE_BYTES + 4 * 8 * size), problem.iteration.max_iterations
    if asked > most:
        needed = f"needed at most {most}: every state is kept, and so many of {pair.n} contact nodes fill 2 GB"
        raise ProblemError(problem.source, "iteration.max_iterations", asked, needed)


def run(
    problem: Problem | Pair,
    *,
    theta: Any = None,
    solver: Solver = "auto",
    watch: Callable[[State], None] = lambda state: None,
    measured: Measured | None = None,
) -> Run:
    """Run the algorithm from g = 0 until it converges, stalls, runs away, reaches its limit or Ctrl-C.

    Parameters
    ----------
    problem : Problem or Pair
    theta : number or 'auto', optional
        Relaxation factor, 0 < theta < 1; the problem's by default.
    solver : {'auto', 'cvxpy', 'active-set'}
        Who solves step II.
    watch : callable
        Called with each state, for live progress.
    measured : Measured, optional
        The constants, where they are known already; an automatic theta and momentum need them.

    Raises
    ------
    ProblemError, HypothesisError
        Bad input.
    ContactError
        Step II did not reach its KKT certificate.
    KeyboardInterrupt
        Before the first state; later it ends the run with what was computed.
    """
    pair = build(problem) if isinstance(problem, Problem) else problem
    settings = pair.problem.iteration
    _check_memory(pair)
    choice = choose(pair, theta, measured)
    relax = rule(pair, settings.relaxation, float(choice.theta), choice.rho)
    seen: list[State] = []
    least, since = float("inf"), 0
    outcome: Outcome = "limit"
    try:
        for state in states(FixedPointMap(pair, solver), relax):
            seen.append(state)
            watch(state)
            least, since = (state.residual, 0) if state.residual < least else (least, since + 1)
            if state.residual <= settings.tolerance * state.scale:
                outcome = "converged"
            elif not state.residual <= RUNAWAY * seen[0].residual:
                outcome = "diverged"
            elif since >= PATIENCE:
                outcome = "stalled"
            elif state.iteration < settings.max_iterations:
                continue
            break
    except KeyboardInterrupt:
        if not seen:
            raise
        outcome = "interrupted"
    return Run(pair=pair, choice=choice, states=tuple(seen), outcome=outcome, interrupted=outcome == "interrupted")

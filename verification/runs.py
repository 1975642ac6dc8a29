"""A run of the algorithm from g = 0 to its outcome."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory import relaxation_factor
from verification.bodies import build
from verification.contact import Solver
from verification.contact_state import ContactState
from verification.document import Document
from verification.iteration import State, iterate
from verification.pair import Pair
from verification.problem import Problem
from verification.rates import ObservedRate, observed_rate

Outcome = Literal["converged", "stalled", "limit", "diverged", "interrupted"]

#: A run without a new least residual over so many steps has stalled.
PATIENCE = 50

#: A residual grown by this factor over the first one has diverged.
RUNAWAY = 1e8


@dataclass(frozen=True, kw_only=True, eq=False)
class Run(Document):
    """A finished run.

    Attributes
    ----------
    pair : Pair
    theta : Fraction
    states : tuple of State
        At least one.
    outcome : {'converged', 'stalled', 'limit', 'diverged', 'interrupted'}
    """

    schema: ClassVar[str] = "ndtheory.run/1"

    pair: Pair
    theta: Fraction
    states: tuple[State, ...]
    outcome: Outcome

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
    def observed_rate(self) -> ObservedRate | None:
        """The asymptotic rate, None where too few steps stand clear of the noise."""
        return observed_rate(self.pair, self.states)

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
        reason = {"linearised_rate": "not computed by this version", "linearised_norm": "not computed by this version"}
        if rate is None:
            few = "fewer than two step ratios stand clear of rounding"
            reason |= {"observed_rate": few, "observed_rate_interval": few}
        return {
            "title": self.pair.problem.title,
            "theta": float(self.theta),
            "relaxation": "constant",
            "neumann_body": self.pair.problem.iteration.neumann_body,
            "iterations": self.iterations,
            "evaluations": self.evaluations,
            "outcome": self.outcome,
            "converged": self.converged,
            "observed_rate": None if rate is None else rate.value,
            "observed_rate_interval": None if rate is None else [rate.lo, rate.hi],
            "linearised_rate": None,
            "linearised_norm": None,
            "unrelaxed_residual": _finite(self.last.relative_residual),
            "kkt_residual": self.last.contact.kkt.residual,
            "solves": {"cvxpy": solvers.count("cvxpy"), "active_set": solvers.count("active-set")},
            **self.contact.to_dict(),
            "history": [_finite(r) for r in self.history],
            "outside_theorem": self.pair.outside,
            "warnings": self.pair.warnings,
            "reason": reason,
        }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def run(
    problem: Problem | Pair,
    *,
    theta: Any = None,
    solver: Solver = "auto",
    watch: Callable[[State], None] = lambda state: None,
) -> Run:
    """Run the algorithm from g = 0 until it converges, stalls, runs away, reaches its limit or Ctrl-C.

    Parameters
    ----------
    problem : Problem or Pair
    theta : number, optional
        Relaxation factor, 0 < theta < 1; the problem's by default.
    solver : {'auto', 'cvxpy', 'active-set'}
        Who solves step II.
    watch : callable
        Called with each state, for live progress.

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
    chosen = settings.theta if theta is None else relaxation_factor(theta)
    states: list[State] = []
    least, since = float("inf"), 0
    outcome: Outcome = "limit"
    try:
        for state in iterate(pair, theta=chosen, solver=solver):
            states.append(state)
            watch(state)
            least, since = (state.residual, 0) if state.residual < least else (least, since + 1)
            if state.residual <= settings.tolerance * state.scale:
                outcome = "converged"
            elif not state.residual <= RUNAWAY * states[0].residual:
                outcome = "diverged"
            elif since >= PATIENCE:
                outcome = "stalled"
            elif state.iteration < settings.max_iterations:
                continue
            break
    except KeyboardInterrupt:
        if not states:
            raise
        outcome = "interrupted"
    return Run(pair=pair, theta=chosen, states=tuple(states), outcome=outcome)

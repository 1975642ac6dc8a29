"""The Neumann-Dirichlet algorithm (4.9), as a generator of frozen states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.iterate import State
from verification.algorithm.relaxation import Rule, rule
from verification.algorithm.theta import choose
from verification.contact import ContactSolution, ContactStep, Solver
from verification.interface.assembly import build
from verification.interface.pair import Pair
from verification.problem.specification import Problem
from verification.threads import one_thread


class FixedPointMap:
    """T of (5.4) for a pair of bodies: steps I and II, with g in, T g out.

    Parameters
    ----------
    pair : Pair
    solver : {'auto', 'cvxpy', 'active-set'}
    """

    def __init__(self, pair: Pair, solver: Solver = "auto") -> None:
        self.pair = pair
        contact, near = pair.contact, pair.nearly_incompressible
        self._step = ContactStep(contact.stiffness, contact.body.unknown, pair.tangential.stop, solver, near)

    def bound(self, g: Floats) -> Floats:
        """Friction bound on nodal forces, ``w_j k |(S sigma_N)_j|`` with sigma_N = g_N, shape (t,)."""
        pair = self.pair
        friction = float(pair.problem.contact.friction)
        if friction == 0 or pair.regularisation is None:
            return np.zeros(pair.tangential.stop)
        return np.asarray(friction * pair.weights * np.abs(pair.regularisation @ g[pair.normal]))

    def __call__(self, g: Floats) -> tuple[Floats, ContactSolution]:
        """Steps I and II: the displacement of the Neumann body and the solved contact step.

        Raises
        ------
        ContactError
        """
        pair = self.pair
        neumann, contact = pair.neumann, pair.contact
        # (I)   S2 u2 = g + l2
        u = neumann.known + neumann.flexibility(g + neumann.load)
        # (II)  minimise over phi = u2 + v, phi_N <= u2_N + gap
        obstacle = u.copy()
        obstacle[pair.normal] += pair.gap
        bound = self.bound(g)
        solution = self._step.solve(contact.load - contact.stiffness @ obstacle, bound)
        if not contact.body.unknown.all():
            solution = self._held(solution, obstacle, bound)
        return u, solution

    def _held(self, solution: ContactSolution, obstacle: Floats, bound: Floats) -> ContactSolution:
        """Where the contact body is held tangentially its support takes any force: friction follows the slip alone."""
        v, force = solution.v.copy(), solution.force.copy()
        rows = np.flatnonzero(~self.pair.contact.body.unknown)
        v[rows] = self.pair.contact.known[rows] - obstacle[rows]
        passes = self.pair.neumann.body.unknown[rows]
        force[rows] = np.where(passes, bound[rows] * np.sign(v[rows]), 0.0)
        sliding = solution.pattern.sliding.copy()
        sliding[rows] = np.where(passes, np.sign(v[rows]), 0)
        return replace(solution, v=v, force=force, pattern=replace(solution.pattern, sliding=sliding))


def iterate(
    problem: Problem | Pair, *, theta: Any = None, solver: Solver = "auto", start: Floats | None = None
) -> Iterator[State]:
    """Run the algorithm without end; the caller decides when to stop.

    Parameters
    ----------
    problem : Problem or Pair
    theta : number or 'auto', optional
        Relaxation factor, 0 < theta < 1; the problem's by default.
    solver : {'auto', 'cvxpy', 'active-set'}
    start : array, optional
        g_0; zero by default.

    Yields
    ------
    State

    Raises
    ------
    HypothesisError
        theta outside (0, 1).
    ContactError
        Step II did not reach its KKT certificate.
    """
    pair = build(problem) if isinstance(problem, Problem) else problem
    choice = choose(pair, theta)
    relax = rule(pair, pair.problem.iteration.relaxation, float(choice.theta), choice.rho)
    return states(FixedPointMap(pair, solver), relax, start)


def state_at(T: FixedPointMap, g: Floats, *, iteration: int = 0, scale: float = 0.0) -> State:
    """Evaluate T at g."""
    neumann = T.pair.neumann
    with one_thread():
        u, solution = T(g)
        image = solution.force
        residual, size = neumann.dual_norm(image - g), neumann.dual_norm(image)
    for array in (g, u, image, solution.v):
        array.setflags(write=False)
    return State(
        iteration=iteration, g=g, displacement=u, contact=solution, residual=residual, size=size, scale=max(scale, size)
    )


def states(T: FixedPointMap, relax: Rule, start: Floats | None = None) -> Iterator[State]:
    """The states that a rule passes through, without end."""
    g = np.zeros(len(T.pair.neumann.load)) if start is None else np.array(start, dtype=float)
    iteration, scale = 0, 0.0
    while True:
        state = state_at(T, g, iteration=iteration, scale=scale)
        yield state
        with one_thread():
            g = relax(state)  # (III)
        iteration, scale = iteration + 1, state.scale

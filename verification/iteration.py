"""The Neumann-Dirichlet algorithm (4.9), as a generator of frozen states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory import relaxation_factor
from verification.bodies import build
from verification.contact import ContactSolution, ContactStep, Solver
from verification.pair import Pair
from verification.problem import Problem
from verification.threads import one_thread


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """What one evaluation of T shows.

    Interface vectors: tangential components, then normal ones along n of the contact body.

    Attributes
    ----------
    iteration : int
        How many relaxations led to g.
    g : array
        Nodal forces on the Neumann body before the step.
    displacement : array
        Interface displacement of the Neumann body, from step I.
    contact : ContactSolution
        Step II; its ``force`` is T g.
    residual : float
        ``|||T g - g|||`` in the norm (5.21): judged before relaxation, so that a small theta does not flatter.
    size : float
        ``|||T g|||``.
    scale : float
        The largest size so far, which the residual is compared with: T g itself may vanish where the bodies part.
    """

    iteration: int
    g: Floats
    displacement: Floats
    contact: ContactSolution
    residual: float
    size: float
    scale: float

    @property
    def image(self) -> Floats:
        """T g."""
        return self.contact.force

    @property
    def relative_residual(self) -> float:
        """The residual over the scale; 0 where both vanish."""
        return self.residual / self.scale if self.scale > 0 else (0.0 if self.residual == 0 else float("inf"))


class FixedPointMap:
    """T of (5.4) for a pair of bodies: steps I and II, with g in, T g out.

    Parameters
    ----------
    pair : Pair
    solver : {'auto', 'cvxpy', 'active-set'}
    """

    def __init__(self, pair: Pair, solver: Solver = "auto") -> None:
        self.pair = pair
        self._step = ContactStep(pair.contact.stiffness, pair.contact.body.unknown, pair.tangential.stop, solver)

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
    theta : number, optional
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
    chosen = pair.problem.iteration.theta if theta is None else relaxation_factor(theta)
    return _states(FixedPointMap(pair, solver), float(chosen), start)


def _states(T: FixedPointMap, theta: float, start: Floats | None) -> Iterator[State]:
    neumann = T.pair.neumann
    g = np.zeros(len(neumann.load)) if start is None else np.array(start, dtype=float)
    iteration, scale = 0, 0.0
    while True:
        with one_thread():
            u, solution = T(g)
            image = solution.force
            residual, size = neumann.dual_norm(image - g), neumann.dual_norm(image)
            scale = max(scale, size)
        for array in (g, u, image, solution.v):
            array.setflags(write=False)
        yield State(
            iteration=iteration, g=g, displacement=u, contact=solution, residual=residual, size=size, scale=scale
        )
        g = theta * image + (1 - theta) * g  # (III)
        iteration += 1

"""The Neumann-Dirichlet algorithm (4.9), as a generator of frozen iterates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.iterate import Iterate
from verification.algorithm.relaxation import Rule, Step
from verification.algorithm.theta import begin
from verification.contact import ContactSolution, ContactStep, Solver
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair
from verification.problem import Problem
from verification.threads import one_thread


class FixedPointMap:
    """T of (5.4) for a pair of bodies: steps I and II, with g in, T g out.

    Parameters
    ----------
    pair : ContactPair
        The bodies with their loads; its roles say who has step I and who has step II.
    solver : {'auto', 'cvxpy', 'active-set'}
    step : type, optional
        Who takes step II.
    """

    def __init__(self, pair: ContactPair, solver: Solver = "auto", *, step: type[ContactStep] = ContactStep) -> None:
        self.pair = pair
        contact = pair.contact
        self._step = step(contact.stiffness, contact.free, contact.grid.t, solver, pair.nearly_incompressible)

    def __call__(self, g: Floats) -> tuple[Floats, ContactSolution]:
        """Steps I and II: the displacement of the Neumann body and the solved contact step.

        Raises
        ------
        ContactError
        """
        pair = self.pair
        neumann, contact, interface = pair.neumann, pair.contact, pair.interface
        # (I)   S2 u2 = g + l2
        u = neumann.known + neumann.flexibility(g + neumann.load)
        # (II)  minimise over phi = P u2 + v, phi_N <= (P u2)_N + gap
        obstacle = interface.carry(u).copy()
        obstacle[contact.grid.normal] += interface.gap
        bound = pair.bound(g)
        solution = self._step.solve(contact.load - contact.stiffness @ obstacle, bound)
        if not contact.free.all():
            solution = self._held(solution, obstacle, bound)
        return u, solution

    def _held(self, solution: ContactSolution, obstacle: Floats, bound: Floats) -> ContactSolution:
        """Where the contact body is held tangentially its support takes any force: friction follows the slip alone."""
        v, force = solution.v.copy(), solution.force.copy()
        rows = np.flatnonzero(~self.pair.contact.free)
        v[rows] = self.pair.contact.known[rows] - obstacle[rows]
        passes = self.pair.neumann.free[rows]
        force[rows] = np.where(passes, bound[rows] * np.sign(v[rows]), 0.0)
        sliding = solution.pattern.sliding.copy()
        sliding[rows] = np.where(passes, np.sign(v[rows]), 0)
        return replace(solution, v=v, force=force, pattern=replace(solution.pattern, sliding=sliding))


def iterate(
    problem: Problem | ContactPair,
    *,
    theta: Any = None,
    rule: Rule | str | None = None,
    solver: Solver = "auto",
    start: Floats | None = None,
) -> Iterator[Iterate]:
    """Run the algorithm without end; the caller decides when to stop.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    theta : number or 'auto', optional
        Relaxation factor, 0 < theta < 1; the problem's by default.
    rule : Rule or str, optional
        The relaxation rule, or the name of one; the problem's by default.
    solver : {'auto', 'cvxpy', 'active-set'}
    start : array, optional
        g_0; zero by default.

    Yields
    ------
    Iterate

    Raises
    ------
    HypothesisError
        theta outside (0, 1).
    ContactError
        Step II did not reach its KKT certificate.

    Examples
    --------
    >>> from itertools import islice
    >>> bars = {"dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": -0.1}}}
    >>> [round(float(step.g[0]), 4) for step in islice(iterate(Problem.from_dict(bars), theta="1/2"), 3)]
    [0.0, 0.1, 0.05]
    """
    pair = pair_of(problem)
    _, _, step = begin(pair, theta, rule)
    return iterates(FixedPointMap(pair, solver), step, start)


def iterate_at(T: FixedPointMap, g: Floats, *, iteration: int = 0, scale: float = 0.0) -> Iterate:
    """Evaluate T at g."""
    neumann = T.pair.neumann
    with one_thread():
        u, solution = T(g)
        image = T.pair.interface.carry_back(solution.force)
        residual, size = neumann.dual_norm(image - g), neumann.dual_norm(image)
    return Iterate(
        iteration=iteration,
        g=g,
        image=image,
        displacement=u,
        contact=solution,
        residual=residual,
        size=size,
        scale=max(scale, size),
    )


def iterates(T: FixedPointMap, step: Step, start: Floats | None = None) -> Iterator[Iterate]:
    """The iterates that a rule passes through, without end."""
    g = np.zeros(T.pair.neumann.grid.size) if start is None else np.array(start, dtype=float)
    iteration, scale = 0, 0.0
    while True:
        found = iterate_at(T, g, iteration=iteration, scale=scale)
        yield found
        with one_thread():
            g = step(found)  # (III)
        iteration, scale = iteration + 1, found.scale

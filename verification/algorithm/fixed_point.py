"""The Neumann-Dirichlet algorithm (4.9), as a generator of frozen iterates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.iterate import Iterate
from verification.algorithm.relaxation import Relaxation, Step
from verification.contact import ContactSolution, ContactStep, Solver
from verification.contact.active_set import Systems
from verification.dense import times
from verification.interface.pair import ContactPair
from verification.machine.threads import one_thread

#: Steps after which (I) is solved anew.  On the sample problems of the tests, 400 steps each, its displacement then
#: stays within 35 units in the last place of the solved one in the energy norm; never solved anew, within 530.  T then
#: differs by 0.2 of the rounding of one evaluation (``rates.noise``) at most.
RENEWED = 8


class FixedPointMap:
    """T of (5.4) for a pair of bodies: steps I and II, with g in, T g out.

    ``pair`` has the bodies with their loads and roles, ``step`` is the class that solves step II; ``systems`` are
    linear systems to share with maps of pairs with this contact body, on which no digit of T depends.
    """

    def __init__(
        self,
        pair: ContactPair,
        solver: Solver = "auto",
        *,
        step: type[ContactStep] = ContactStep,
        systems: Systems | None = None,
    ) -> None:
        self.pair = pair
        contact = pair.contact
        near, motions = pair.nearly_incompressible, contact.motions
        body = pair.words(pair.contact_body)
        self._step = step(contact.schur, contact.free, contact.grid.t, solver, near, motions, body, systems)
        self._all_free = bool(contact.free.all())

    def __call__(self, g: Floats) -> tuple[Floats, ContactSolution]:
        """Solve steps I and II: the displacement of the Neumann body and the contact step; may raise ContactError."""
        u = self.displacement(g)
        return u, self.contact(g, u)

    def restart(self) -> None:
        """Begin another run, with the same iterates as a new map would give; what this one has met saves time."""
        self._step.restart()

    def displacement(self, g: Floats) -> Floats:
        """Solve (I): ``S2 u2 = g + l2``."""
        neumann = self.pair.neumann
        return neumann.known + neumann.flexibility(g + neumann.load)

    def contact(self, g: Floats, u: Floats) -> ContactSolution:
        """Solve (II): minimise over ``phi = P u2 + offset + v`` with ``v_N <= 0``; may raise ContactError."""
        contact, interface = self.pair.contact, self.pair.interface
        obstacle = interface.carry(u) + self.pair.offset
        bound = self.pair.bound(g)
        solution = self._step.solve(contact.load - times(contact.schur, obstacle), bound)
        return solution if self._all_free else self._held(solution, obstacle)

    def _held(self, solution: ContactSolution, obstacle: Floats) -> ContactSolution:
        """Correct held nodes: their support takes any shear, and no friction acts."""
        v, force, sliding = solution.v.copy(), solution.force.copy(), solution.pattern.sliding.copy()
        rows = np.flatnonzero(~self.pair.contact.free)
        v[rows] = self.pair.contact.known[rows] - obstacle[rows]
        force[rows], sliding[rows] = 0.0, 0
        return replace(solution, v=v, force=force, pattern=replace(solution.pattern, sliding=sliding))


def iterate_at(T: FixedPointMap, g: Floats, least: float = 0.0) -> Iterate:
    """Evaluate T at g; its scale is ``least`` or more."""
    with one_thread():
        return _evaluate(T, g, T.displacement(g), None, least)[0]


def _evaluate(
    T: FixedPointMap, g: Floats, u: Floats, before: Iterate | None = None, least: float = 0.0
) -> tuple[Iterate, Floats]:
    """Evaluate T at g, which displaces the Neumann body by u; also return ``S2^-1 (T g - g)``."""
    neumann = T.pair.neumann
    solution = T.contact(g, u)
    image = T.pair.interface.carry_back(solution.force)
    off = image - g
    change = neumann.flexibility(off)
    residual = _root(float(off @ change))
    moved = u - neumann.unloaded  # S2^-1 g
    size = _root(float(image @ (moved + change)))  # S2^-1 T g = S2^-1 g + S2^-1 (T g - g)
    found = Iterate(
        iteration=0 if before is None else before.iteration + 1,
        g=g,
        image=image,
        displacement=u,
        contact=solution,
        residual=residual,
        size=size,
        scale=max(size, _root(float(g @ moved)), least),
    )
    return found, change


def iterates(T: FixedPointMap, step: Step, start: Floats | None = None, least: float = 0.0) -> Iterator[Iterate]:
    """Yield the iterates of a rule without end; ``least`` is a scale that none falls below.

    Where (III) has one factor, the displacement of the next g follows from the solve that the residual needs, as
    ``S2^-1 g+ = S2^-1 g + theta S2^-1 (T g - g)``: a step takes one solve with S2.  Every :data:`RENEWED` steps, and
    after any other rule, (I) is solved for g itself.
    """
    g = np.zeros(T.pair.neumann.grid.size) if start is None else np.array(start, dtype=float)
    with one_thread():
        found, change = _evaluate(T, g, T.displacement(g), None, least)
    while True:
        yield found
        with one_thread():
            g = step(found)  # (III)
            if isinstance(step, Relaxation) and (found.iteration + 1) % RENEWED:
                u = found.displacement + step.theta * change
            else:
                u = T.displacement(g)
            found, change = _evaluate(T, g, u, found, least)


def _root(square: float) -> float:
    return math.sqrt(max(square, 0.0))

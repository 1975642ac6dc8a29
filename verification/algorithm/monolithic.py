"""The global method: both bodies at once, without decomposition.

It shares only the problem, the meshes and the assembled matrices with the iteration.  The unknown is the
contact force lambda (on body 2; compressive in the normal direction).  With the flexibilities F_a of the bodies on
Gamma_c the jump is

    d = d_0 - W lambda,   W = F_1 + F_2,   d_T = u1_T - u2_T - slip so far,  d_N = [u_N] - gap,

(plus ``M alpha`` where a body can move rigidly: then ``M' lambda`` must balance its loads)

and contact with Coulomb friction asks for ``lambda_N >= 0, d_N <= 0, lambda_N d_N = 0`` (2.4) and ``|lambda_T| <= b``,
``lambda_T d_T = b |d_T|`` (2.6) with ``b = w k |S lambda_N|``.  Everything is solved at once by a semi-smooth Newton
method; where its patterns repeat, sweeps of a nonlinear Gauss-Seidel method lead it to another start.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.keys import derived, key, says
from verification.contact.system import ContactSystem, SolveError
from verification.dense import STILL
from verification.document import Document
from verification.interface.assembly import TwoBodies, discretise
from verification.interface.body import Body
from verification.interface.checks import Checks, check_state
from verification.interface.fields import ContactFields
from verification.interface.interface import Grids
from verification.interface.pair import ContactPair
from verification.interface.values import ASKED, PointValue, values_at_points
from verification.machine.threads import one_thread
from verification.problem import Problem, load

if TYPE_CHECKING:
    from verification.document import Figure

__all__ = ["ContactSystem", "Solution", "SolveError", "contact_system", "solution_force", "solve"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Solution(Document):
    """The solution of the global method.

    Attributes
    ----------
    force : array
        lambda: tangential forces on body 2, then compressive normal ones; nodal forces per thickness.
    motion : array
        Coefficients of the rigid motions of body 1, then of body 2, that only contact holds.
    """

    schema: ClassVar[str] = "ndtheory.solve/1"

    bodies: TwoBodies = key("title of the problem", name="title", of=lambda bodies: bodies.problem.title, type="text")
    force: Floats
    motion: Floats
    contact: ContactFields = key(spread=True)
    kkt_residual: float = key("the largest violation of a contact condition, relative: at most 1e-11")
    linear_solves: int = key(r"linear systems on $\Gamma_c$")

    grids = derived(
        r"the grids along $\Gamma_c$",
        lambda solution: Grids(contact_body=solution.problem.contact_body, **solution.bodies.interface.counts),
        Grids,
    )

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return self.bodies.problem.units

    @property
    def problem(self) -> Problem:  # type: ignore[override]
        """The problem that was solved."""
        return self.bodies.problem

    @property
    def summary(self) -> str:
        return f"{self.problem.title}, {self.contact.summary}, KKT residual {self.kkt_residual:.1e}"

    @cached_property
    def displacements(self) -> tuple[Floats | None, Floats | None]:
        """Displacement of all nodes of body 1 and body 2, shape (nodes, d), unit of length; None where rigid."""
        fields: list[Floats | None] = [None, None]
        used = 0
        for i, (body, sign) in enumerate(((self.bodies.body1, -1.0), (self.bodies.body2, 1.0))):
            if body is not None:
                force = self.force if body is not self.bodies.neumann else self.bodies.interface.carry_back(self.force)
                elastic = body.response.loaded + body.response.field(sign * force[body.unknown])
                k = body.motions.shape[1]
                fields[i] = body.at_nodes(elastic + body.motions @ self.motion[used : used + k])
                used += k
        return fields[0], fields[1]

    @property
    @says(name="outside_theorem")
    def outside(self) -> list[str]:
        """Why the theorem does not apply to the problem; empty where it does."""
        return self.bodies.outside

    @cached_property
    @says()
    def checks(self) -> Checks:
        """Checks of the bodies outside Gamma_c, and of their strains."""
        return check_state(self.bodies, lambda: self.displacements, lambda: self.contact)

    @cached_property
    @says(**ASKED)
    def points(self) -> tuple[PointValue, ...]:
        """Values at the points that the problem names."""
        return values_at_points(self.bodies, self.displacements) if self.bodies.places else ()

    @property
    @says()
    def warnings(self) -> list[str]:
        """Facts to know before trusting the numbers."""
        grown = self.contact.grown(self.bodies.interface, float(self.bodies.friction))
        return [*self.bodies.warnings, *grown, *self.contact.warnings(self.units["length"]), *self.checks.warnings]

    def plot(self, **options: Any) -> Figure:
        """Draw the deformed bodies above pressure, shear, friction bound and states along Gamma_c.

        Options: ``stress="mises"`` or ``"sigma_yy"`` colours the cells, ``motions=True`` adds a panel with gap and
        slip, ``zoom=True`` draws only the part where the bodies touch.
        """
        return self.drawn(**options)


def solve(problem: Problem | TwoBodies | ContactPair | Path | str) -> Solution:
    """Solve both bodies at once.

    Parameters
    ----------
    problem : Problem, TwoBodies, ContactPair or path
        One body may be rigid.

    Returns
    -------
    Solution
        ``contact.pressure``, ``contact.shear`` and ``contact.status`` along Gamma_c; ``displacements`` of both bodies.

    Raises
    ------
    ProblemError
        Bad input.
    SolveError
        The KKT certificate was not reached.
    ValueError
        A pair made from matrices.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> round(float(solve(example("two-bars")).contact.pressure[0]), 12)
    0.075
    """
    if isinstance(problem, ContactPair):
        bodies = problem.on_meshes()
    elif isinstance(problem, TwoBodies):
        bodies = problem
    else:
        bodies = discretise(problem if isinstance(problem, Problem) else load(problem))
    with one_thread():
        system = contact_system(bodies)
        found = system.solve()
        bound = system.bound(found.force)
        residual = system.residual(found.force, found.motion)
        shown = bodies.interface.shown
        if shown is not bodies.interface:
            system = contact_system(replace(bodies, interface=shown))
        jump = system.jump(found.force, found.motion)
    return Solution(
        bodies=bodies,
        force=found.force,
        motion=found.motion,
        contact=ContactFields.of(bodies.interface, force=found.force, bound=bound, jump=jump, state=found.branches),
        kkt_residual=residual,
        linear_solves=system.linear_solves,
    )


def solution_force(pair: ContactPair) -> Floats:
    """Return g of the iteration at the solution of the global method.

    Raises
    ------
    SolveError
    ValueError
        A pair made from matrices.
    """
    found = solve(pair).contact
    stress = np.concatenate([pair.normal_sign * found.shear[: pair.contact.grid.t], found.pressure])
    return pair.interface.carry_back(np.tile(found.weights, pair.contact.grid.dimension) * stress)


def contact_system(bodies: TwoBodies) -> ContactSystem:
    """Assemble W, d_0 and the friction law of a problem."""
    interface, grid = bodies.interface, bodies.interface.contact
    t, size = grid.t, grid.size
    W, d0 = np.zeros((size, size)), -interface.offset
    motions, resultant = [np.zeros((size, 0))], [np.zeros(0)]
    for body, sign in ((bodies.body1, 1.0), (bodies.body2, -1.0)):
        if body is not None:
            flexibility, trace = _flexibility(body)
            moves = np.zeros((len(body.unknown), body.motions.shape[1]))
            moves[body.unknown] = body.motions[body.interface]
            moves[:, np.abs(moves).max(axis=0) <= STILL] = 0.0  # of a piece on a hinge: else rounding would hold it
            if body is bodies.neumann:  # as the contact grid sees it
                flexibility = interface.carry(interface.carry(flexibility).T)
                trace, moves = interface.carry(trace), interface.carry(moves)
            W += flexibility
            d0 += sign * trace
            motions.append(sign * moves)
            resultant.append(body.motions.T @ body.load)
    friction = np.zeros((t, grid.n))
    k = float(bodies.friction)
    if k and interface.contact_kernel is not None:
        friction = k * grid.weights[:, None] * interface.contact_kernel
    return ContactSystem(W, d0, friction, motions=np.concatenate(motions, axis=1), resultant=np.concatenate(resultant))


def _flexibility(body: Body) -> tuple[Floats, Floats]:
    """Return ``(A^-1)_BB`` and the trace of the solution without contact, on all interface components."""
    rows = np.flatnonzero(body.unknown)
    flexibility = np.zeros((len(body.unknown), len(body.unknown)))
    flexibility[np.ix_(rows, rows)] = body.response.flexibility
    trace = body.known_trace.copy()
    trace[rows] = body.response.loaded[body.interface]
    return flexibility, trace

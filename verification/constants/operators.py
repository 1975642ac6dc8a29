"""rho of two bodies without interface matrices: by solves with the sparse matrices of the bodies.

S_a on a trace costs one solve inside the body, ``S_a^-1`` on a force one solve with the whole body, so that Lanczos
finds the largest eigenvalue of (S_c, S_n), c the contact body and n the Neumann body, on any number of contact nodes.

Its eigenvalues crowd: the stiff end of the spectrum belongs to short waves along Gamma_c, or to waves as long as the
bodies are thick, and every long interface has many of them.  So Lanczos comes in two parts.  The first is short and
says about where rho lies.  The second, repeated where that was too rough, separates the eigenvalues that crowd below a
shift s a little above, by solves with

    K = s A_n - A_c    (both bodies joined at their interface unknowns),

a sparse matrix whose elimination leaves ``s S_n - S_c`` on the interface.  K has as many negative eigenvalues as body c
has unknowns inside, and one more for each eigenvalue of (S_c, S_n) above s.  They are counted by the pivots of K: a
shift below rho is seen and raised.  So the value is known to be the largest eigenvalue, up to the rounding of the
pivots: none lies above s, and the Lanczos iteration finds the one nearest to s.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fem1d2d import Condensation, Eigenvalue, largest_of, solver_with_inertia
from fem1d2d.condense import Apply
from fem1d2d.mesh import Floats, Ints
from fem1d2d.pencil import LANCZOS
from verification.interface import assembly
from verification.interface.assembly import TooManyContactNodes, TwoBodies, held_bodies
from verification.interface.body import Body
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.problem import Problem, ProblemError, load

#: The relative residual of Lanczos where it only has to say where to shift.
ROUGH = 1e-3

#: The first shift lies above the rough value by this part of it, each later one by so many times more than the last.
SHIFT, FARTHER = 1e-5, 10

#: Why rho does not exist.
TRACES_DIFFER = "the bodies hold different tangential components of Gamma_c: their traces differ"


def pair_or_bodies(problem: Problem | ContactPair | Path | str) -> ContactPair | TwoBodies:
    """The pair that a problem stands for; its bodies on their meshes where it has too many contact nodes for matrices.

    Raises
    ------
    ProblemError
        As :func:`verification.build`.
    """
    try:
        return pair_of(problem)
    except TooManyContactNodes:
        assert not isinstance(problem, ContactPair)
        return held_bodies(problem if isinstance(problem, Problem) else load(problem), dense=False)


def needs_matrices(bodies: TwoBodies) -> str:
    """Why what needs interface matrices was not computed."""
    return f"{bodies.interface.contact.n} contact nodes: dense interface matrices end at {assembly.MOST_CONTACT_NODES}"


class Traces:
    """Products with S and ``S^-1`` of one body, which is held, on the ``interface`` unknowns."""

    def __init__(self, body: Body, interface: Ints) -> None:
        self.body, self.interface = body, interface
        self.force = Condensation(body.stiffness, interface).times

    def trace(self, force: Floats) -> Floats:
        """``S^-1 force``."""
        load = np.zeros(self.body.stiffness.shape[0])
        load[self.interface] = force
        return self.body.solve(load)[self.interface]

    def joined(self, shared: int, first: int, size: int) -> sp.csc_array:
        """Its stiffness matrix in a larger one: the trace in the first rows, the other unknowns from ``first`` on."""
        A = self.body.stiffness.tocoo()
        place = np.full(A.shape[0], -1)
        place[self.interface] = np.arange(shared)
        place[place < 0] = first + np.arange(A.shape[0] - shared)
        return sp.csc_array((A.data, (place[A.row], place[A.col])), shape=(size, size))


class Pencils:
    """The pencils (S_c, S_n) of two bodies, in both roles, with all components of the trace and with the normal ones.

    The factorisations for one choice of components are kept until the other one is asked for.  ``bodies`` are both
    elastic and held, as :func:`verification.interface.assembly.held_bodies` returns them.

    Raises
    ------
    ProblemError
        The grids of the bodies differ.
    """

    def __init__(self, bodies: TwoBodies, progress: Progress = silent) -> None:
        if not bodies.interface.one_grid:
            counts = " and ".join(map(str, bodies.interface.counts.values()))
            needed = (
                f"needed one grid for both bodies, these have {counts} nodes: between grids that differ rho is found"
                f" with interface matrices, up to {assembly.MOST_CONTACT_NODES} contact nodes"
            )
            raise ProblemError(bodies.problem.source, "contact", None, needed)
        self.bodies, self.progress = bodies, progress
        self._held: tuple[bool, list[Traces]] | None = None

    @property
    def reason(self) -> dict[str, str]:
        """Why the pencil does not exist, by the names of the constants; empty where it does."""
        lower, upper = self.bodies.elastic
        if np.array_equal(lower.unknown, upper.unknown):
            return {}
        return dict.fromkeys(("rho_max", "rho_min", "rho_normal"), TRACES_DIFFER)

    def _roles(self, neumann_body: int, normal: bool) -> tuple[Traces, Traces]:
        if self._held is None or self._held[0] != normal:
            self._held = None  # its factorisations are the largest part of the memory
            n = self.bodies.interface.contact.n
            self._held = normal, [Traces(b, b.interface[-n:] if normal else b.interface) for b in self.bodies.elastic]
        lower, upper = self._held[1]
        return (lower, upper) if neumann_body == 2 else (upper, lower)

    def shifted(self, shift: float, *, neumann_body: int, normal: bool = False) -> tuple[Apply, int | None]:
        """``r -> (shift S_n - S_c)^-1 r``, and how many eigenvalues of (S_c, S_n) lie above the shift.

        None where the pivots do not tell how many, see :func:`fem1d2d.condense.solver_with_inertia`.
        """
        contact, neumann = self._roles(neumann_body, normal)
        shared, size_n = len(contact.interface), neumann.body.stiffness.shape[0]
        inside = contact.body.stiffness.shape[0] - shared
        size = size_n + inside
        joined = shift * neumann.joined(shared, shared, size) - contact.joined(shared, size_n, size)
        with one_thread():
            solve, negative = solver_with_inertia(joined)

        def nearest(r: Floats) -> Floats:
            return solve(np.concatenate([r, np.zeros(size - shared)]))[:shared]

        return nearest, None if negative is None else negative - inside

    def largest(self, *, neumann_body: int, normal: bool = False) -> Eigenvalue:
        """rho where that body has the Neumann problem; rho_normal where ``normal``.

        The residual bounds the distance to some eigenvalue, and no eigenvalue lies above the shift, SHIFT above the
        value or a few times more: see the top of this module.
        """
        contact, neumann = self._roles(neumann_body, normal)
        name = f"{'rho_normal' if normal else 'rho'}, Neumann body {neumann_body}"
        tell = lambda steps: self.progress(f"{name}: step {steps} of Lanczos", None)
        pencil = (contact.force, neumann.force, neumann.trace, len(contact.interface))
        with one_thread():
            found = largest_of(*pencil, tolerance=ROUGH, progress=tell)
            for last in (False, True):
                distance, nearest = SHIFT, None
                while nearest is None:
                    shift = (1 + distance) * found.value
                    self.progress(f"{name}: counting the eigenvalues above {shift:.6g}", None)
                    nearest, count = self.shifted(shift, neumann_body=neumann_body, normal=normal)
                    if count != 0:
                        nearest, distance = None, distance * FARTHER
                near = last or distance == SHIFT
                found = largest_of(*pencil, above=(shift, nearest), tolerance=LANCZOS if near else ROUGH, progress=tell)
                if near:
                    break
        return found

"""Two bodies facing each other along Gamma_c, and their roles."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cholesky, qr

from fem1d2d import Condensation, Material, Mesh, Supports, solver
from fem1d2d.mesh import Floats, Ints
from verification.problem.specification import Problem
from verification.threads import one_thread

Name = Literal["body1", "body2"]

#: Poisson ratio from which on linear triangles err visibly.  Two models against a mesh that does not lock (rectangles
#: split by both diagonals, 72 cells along Gamma_c): at 0.48 the nodal pressures of the built-in split are off by 5 and
#: 6 % (0.7 and 2.3 % at 0.3) and the force by 2 %, 7 to 11 % with 12 cells; at 0.499 the pressures by 40 and 11 %.
LOCKING = 0.48

#: Part of the friction that the kernel may lose or add without a warning.  The share under an even pressure agrees with
#: that of a block that slides as a whole within 0.01: 0.93 and 0.92 at radius 0.2 on a length of 1, 0.67 and 0.67 at 1.
SHARE = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """An elastic body condensed onto its contact nodes.

    Interface vectors list all tangential components from left to right, then all normal ones (along y; along x in 1D).

    Attributes
    ----------
    name : {'body1', 'body2'}
    mesh : Mesh
    material : Material
    known : Supports
        Displacements known on Gamma_u.
    nodes : int array, shape (n,)
        Contact nodes from left to right.
    free : int array
        Positions of the unknowns among all d * node + p.
    unknown : bool array, shape (2 n,) or (n,) in 1D
        Interface components that Gamma_u leaves free; a False one is held tangentially.
    interface : int array
        Positions of the unknown interface components among the unknowns.
    stiffness, gram_matrix : sparse array
        The stiffness matrix and the H1 Gram matrix of the unknowns.
    load : array
        Loads on the unknowns: body force, tractions, prescribed displacements.
    motions : array, shape (unknowns, k)
        Rigid motions that only contact can hold; k = 0 in the iteration.
    """

    name: Name
    mesh: Mesh
    material: Material
    known: Supports
    nodes: Ints
    free: Ints
    unknown: NDArray[np.bool_]
    interface: Ints
    stiffness: sp.csc_array
    gram_matrix: sp.csc_array
    load: Floats
    motions: Floats

    @cached_property
    def solve(self) -> Callable[[Floats], Floats]:
        """``load -> A^-1 load`` on the unknowns, for one load or columns of loads.

        Where rigid motions are left, as many unknowns are pinned: exact, up to a motion, for loads in equilibrium.
        """
        with one_thread():
            k = self.motions.shape[1]
            if k == 0:
                return solver(self.stiffness)
            _, _, order = qr(self.motions.T, pivoting=True, mode="economic")
            rest = np.sort(order[k:])
            pinned = solver(self.stiffness[rest][:, rest])

        def solve(load: Floats) -> Floats:
            result = np.zeros_like(load)
            result[rest] = pinned(load[rest])
            return result

        return solve

    @cached_property
    def elastic(self) -> Condensation:
        """The stiffness matrix condensed onto the interface."""
        with one_thread():
            condensed = Condensation(self.stiffness, self.interface)
            condensed.lift  # noqa: B018  loads need it too: once for both
            return condensed

    @cached_property
    def gram(self) -> Condensation:
        """The Gram matrix condensed onto the interface."""
        with one_thread():
            return Condensation(self.gram_matrix, self.interface)

    @property
    def known_trace(self) -> Floats:
        """Interface displacements that Gamma_u prescribes, 0 where it does not."""
        return np.concatenate([self.known.values[self.nodes, p] for p in range(self.mesh.dimension)])

    def displacement(self, trace: Floats) -> Floats:
        """Displacement of all nodes for given interface values, shape (nodes, d), unit of length."""
        full = self.known.values.ravel().copy()
        full[self.free] = self.elastic.extend(trace[self.unknown], self.load)
        return full.reshape(self.mesh.points.shape)


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """A body as the algorithm sees it: its interface matrices with the normal along n of the contact body.

    Held components have zero rows and columns.

    Attributes
    ----------
    body : Body
    stiffness : array, shape (2 n, 2 n)
        S_a, stress (times length in 1D per unit thickness).
    load : array, shape (2 n,)
        l_a: loads condensed onto the interface.
    known : array, shape (2 n,)
        Known trace of held components.
    """

    body: Body
    stiffness: Floats
    load: Floats
    known: Floats

    @cached_property
    def _factor(self) -> tuple[NDArray[np.float64], bool]:
        rows = self.body.unknown
        factor: tuple[NDArray[np.float64], bool] = cho_factor(self.stiffness[np.ix_(rows, rows)])
        return factor

    def flexibility(self, force: Floats) -> Floats:
        """``S_a^-1 force`` on the free components, 0 on held ones, shape (2 n,)."""
        result = np.zeros_like(force)
        result[self.body.unknown] = cho_solve(self._factor, force[self.body.unknown], check_finite=False)
        return result

    @cached_property
    def inverse(self) -> Floats:
        """``S_a^-1`` as a matrix, 0 on held components, shape (2 n, 2 n)."""
        return self.flexibility(np.eye(len(self.load)))

    @cached_property
    def root(self) -> Floats:
        """L with ``S_a = L L'``, shape (2 n, free components): columns orthonormal in the norm (5.21)."""
        rows = self.body.unknown
        result = np.zeros((len(rows), int(rows.sum())))
        result[rows] = cholesky(self.stiffness[np.ix_(rows, rows)], lower=True)
        return result

    def dual_norm(self, force: Floats) -> float:
        """The norm (5.21), ``sqrt(force' S_a^-1 force)``, when this is the Neumann body."""
        return math.sqrt(max(float(force @ self.flexibility(force)), 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Facing:
    """Two bodies facing each other along Gamma_c; one of them may be rigid.

    Attributes
    ----------
    problem : Problem
    body1, body2 : Body or None
        None where rigid.
    x : array, shape (n,)
        Positions of the contact nodes; in 1D the one point.
    weights : array, shape (n,)
        w_j of the trapezoid rule (length; 1 in 1D).
    gap : array, shape (n,)
        Initial distance.
    regularisation : array, shape (n, n) or None
        The operator S on normal nodal forces; None without a law of friction.
    """

    problem: Problem
    body1: Body | None
    body2: Body | None
    x: Floats
    weights: Floats
    gap: Floats
    regularisation: Floats | None

    @property
    def n(self) -> int:
        """Number of contact nodes."""
        return len(self.x)

    @property
    def tangential(self) -> slice:
        """Tangential components of an interface vector; empty in 1D."""
        return slice(0, self.n * (self.problem.dimension - 1))

    @property
    def normal(self) -> slice:
        """Normal components of an interface vector."""
        start = self.n * (self.problem.dimension - 1)
        return slice(start, start + self.n)

    @property
    def elastic(self) -> list[Body]:
        """The bodies that are not rigid."""
        return [body for body in (self.body1, self.body2) if body is not None]

    @property
    def outside(self) -> list[str]:
        """Why the theorem does not speak of this problem; empty where it does."""
        reasons = []
        if self.problem.contact.law == "local" and self.problem.contact.friction:
            reasons.append("the local Coulomb law: S must map into L2(Gamma_c)")
        if not all(body.unknown.all() for body in self.elastic):
            reasons.append("a contact node is held tangentially: Gamma_u and Gamma_c must not meet")
        return reasons

    @property
    def nearly_incompressible(self) -> str:
        """The keys that hold a Poisson ratio of LOCKING or more, for a message; empty where none does."""
        ratios = {f"{body.name}.poisson": float(getattr(self.problem, body.name).poisson) for body in self.elastic}
        return " and ".join(f"{key} = {ratio:.12g}" for key, ratio in ratios.items() if ratio >= LOCKING)

    @property
    def warnings(self) -> list[str]:
        """What a user should know before trusting the numbers."""
        found = []
        if self.nearly_incompressible:
            found.append(
                f"{self.nearly_incompressible}: near 1/2 linear triangles make a body too stiff and scatter the nodal"
                f" pressures (Section 6 at {LOCKING:g}: 5 %, at 0.499: 40 %); needed a finer mesh, or a mesh file whose"
                " rectangles are split by both diagonals"
            )
        contact = self.problem.contact
        if contact.law == "local" or not contact.friction or self.regularisation is None or contact.radius is None:
            return found
        r, width, length = float(contact.radius), float(np.diff(self.x).max()), float(self.x[-1] - self.x[0])
        # What a sliding body carries under an even pressure, as a part of k times the normal force.
        share = float(self.weights @ self.regularisation @ self.weights / self.weights.sum())
        if r < width * (1 - 1e-9):
            found.append(
                f"contact.radius = {r:g} is below the mesh width {width:g}: the kernel sees single nodes and multiplies"
                f" friction by about width/radius = {width / r:.3g}"
            )
        elif share < 1 - SHARE:
            found.append(
                f"contact.radius = {r:g} is not small against the length {length:g} of Gamma_c: the kernel is cut off"
                f" at the ends, and a body that slides under an even pressure carries {100 * share:.0f} % of k times"
                " the normal force"
            )
        elif share > 1 + SHARE:
            found.append(
                f"contact.radius = {r:g} is no multiple of the mesh width {width:g}: sums of the kernel multiply"
                f" friction by about {share:.2f}"
            )
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair(Facing):
    """Two elastic bodies facing each other, with the roles of the algorithm."""

    body1: Body
    body2: Body

    @property
    def upward(self) -> float:
        """+1 where the outward normal of the contact body points up (body 1), -1 where it points down (body 2)."""
        return 1.0 if self.problem.iteration.neumann_body == 2 else -1.0

    def orient(self, interface: Floats) -> Floats:
        """Turn the normal components of interface vectors between y and n of the contact body (its own inverse)."""
        turned = interface.copy()
        turned[self.normal] *= self.upward
        return turned

    def orient_form(self, matrix: Floats) -> Floats:
        """The same for a symmetric matrix on interface vectors."""
        return self.orient(self.orient(matrix).T)

    def _side(self, body: Body) -> Side:
        size = len(body.unknown)
        rows = np.flatnonzero(body.unknown)
        matrix = np.zeros((size, size))
        matrix[np.ix_(rows, rows)] = body.elastic.schur
        load = np.zeros(size)
        load[rows] = body.elastic.condense(body.load)
        matrix = self.orient_form(matrix)
        return Side(body=body, stiffness=matrix, load=self.orient(load), known=self.orient(body.known_trace))

    @cached_property
    def neumann(self) -> Side:
        """The body of step I."""
        return self._side(self.body2 if self.problem.iteration.neumann_body == 2 else self.body1)

    @cached_property
    def contact(self) -> Side:
        """The body of step II."""
        return self._side(self.body1 if self.problem.iteration.neumann_body == 2 else self.body2)

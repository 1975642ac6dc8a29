"""An elastic body on its mesh, and the same body condensed onto its contact nodes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cholesky, qr

from fem1d2d import (
    FEW,
    Condensation,
    Lifted,
    Material,
    Mesh,
    Response,
    Supports,
    Uncoupled,
    bar,
    elimination_order,
    gram,
    plane_strain,
    plane_stress,
    solver,
    stiffness,
)
from fem1d2d.mesh import Floats, Ints
from verification.dense import STILL, Cholesky
from verification.interface.interface import Grid, Nodes
from verification.machine.threads import one_thread
from verification.problem.specs import BodySpec
from verification.value import Value, copied, freeze, lent, original_of

Name = Literal["body1", "body2"]

#: How many times as stiff as the other body an obstacle is in the iteration: what it moves is rounding.
RIGID = 1e12

#: The traces of no rigid motion.
NO_MOTIONS: Floats = freeze(np.zeros((0, 0)))


def material_of(spec: BodySpec, number: Callable[[Fraction], Any] = float, mesh: Mesh | None = None) -> Material:
    """Return the material of a body of a problem, its moduli as some type of number.

    A body of several materials needs its mesh.  MeshError unless each cell lies in one of their surfaces.
    """
    if spec.shape == "interval":
        return bar(number(spec.young))
    law = plane_stress if spec.plane == "stress" else plane_strain
    if not spec.materials:
        return law(number(spec.young), number(spec.poisson))
    if mesh is None:
        raise ValueError("a body of several materials: needed its mesh")
    materials = [law(number(E), number(nu)) for E, nu in spec.materials.values()]
    return Material.of_cells(materials, mesh.split(list(spec.materials)))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Body(Value):
    """An elastic body on its mesh; interface vectors have their normal components from body 1 to body 2.

    Attributes
    ----------
    name : {'body1', 'body2'}
    poisson : float
        Poisson's ratio, in plane stress of the body of plane strain with the same law in the plane; 0 for a bar.
    known : Supports
        Displacements known on Gamma_u.
    nodes : int array, shape (n,)
        Contact nodes in the direction of s.
    positions : int array
        Positions of the unknowns among all d * node + p.  At a contact node with another normal than (0, 1) the
        unknowns are the tangential and the normal component, instead of those along x and y.
    unknown : bool array, shape (2 n,) or (n,) in 1D
        Interface components that Gamma_u leaves free; a False one is held tangentially.
    interface : int array
        Positions of the unknown interface components among the unknowns.
    stiffness : sparse array
        The stiffness matrix of the unknowns.
    load : array
        Loads on the unknowns: body force, tractions, prescribed displacements.
    motions : array, shape (unknowns, k)
        Rigid motions that only contact can hold; in the iteration only the contact body may have some.
    length : float
        L of the norm of H1, unit length.
    turned : sparse array or None
        Q: values of the unknowns from their components along x and y; None where those are the unknowns.
    normals : array, shape (n, 2), or None
        Those of the contact nodes; None where all are (0, 1).
    """

    name: Name
    mesh: Mesh
    material: Material
    poisson: float
    known: Supports
    nodes: Ints
    positions: Ints
    unknown: NDArray[np.bool_]
    interface: Ints
    stiffness: sp.csc_array
    load: Floats
    motions: Floats
    length: float
    turned: sp.csc_array | None = None
    normals: Floats | None = None

    @property
    def summary(self) -> str:
        return f"{self.name}, {len(self.mesh.points)} nodes, {len(self.nodes)} on Gamma_c"

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the stiffness matrix, most of its bytes: it is assembled again."""
        return {name: value for name, value in super().__getstate__().items() if name != "stiffness"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        if "stiffness" not in state:
            matrix = stiffness(self.mesh, self.material)[self.positions][:, self.positions]
            object.__setattr__(self, "stiffness", freeze(in_frames(matrix.tocsc(), self.turned)))

    def under(self, known: Supports, load: Floats) -> Body:
        """Return the body under other loads, with the factorisations of this one.

        Parameters
        ----------
        known : Supports
            Other values of the displacements that are known here.
        load : array, shape (n, d)
            Nodal forces of the body force and of tractions.
        """
        right = (load.ravel() - self._whole @ known.values.ravel())[self.positions]
        return copied(self, known=known, load=right if self.turned is None else self.turned @ right)

    @lent
    def _whole(self) -> sp.csc_array:
        """The stiffness matrix with the unknowns that Gamma_u holds."""
        return stiffness(self.mesh, self.material)

    @lent
    def gram_matrix(self) -> sp.csc_array:
        """The Gram matrix of H1 on the unknowns; a run does not need it."""
        whole = gram(self.mesh, self.length)
        return freeze(in_frames(whole[self.positions][:, self.positions].tocsc(), self.turned))

    @lent
    def _left(self) -> Ints:
        """The unknowns that are left where as many are pinned as rigid motions are left."""
        _, _, order = qr(self.motions.T, pivoting=True, mode="economic")
        return np.sort(order[self.motions.shape[1] :])

    @lent
    def solve(self) -> Callable[[Floats], Floats]:
        """The function ``load -> A^-1 load`` on the unknowns, for one load or columns of loads.

        Where rigid motions are left, as many unknowns are pinned: exact, up to a motion, for loads in equilibrium.
        """
        with one_thread():
            if self.motions.shape[1] == 0:
                return solver(self.stiffness)
            left = self._left
            pinned = solver(self.stiffness[left][:, left])

        def solve(load: Floats) -> Floats:
            result = np.zeros_like(load)
            result[left] = pinned(load[left])
            return result

        return solve

    @cached_property
    def response(self) -> Response:
        """The displacements under the loads and under forces on the interface, pinned as in :attr:`solve`."""
        with one_thread():
            if (original := original_of(self)) is not None:
                return replace(original.response, loaded=original.solve(self.load))
            if self.motions.shape[1] == 0:
                return self.elastic.response(self.load)
            left = self._left
            felt = np.isin(self.interface, left)
            kind = Lifted if self.few else Condensation
            interface = np.searchsorted(left, self.interface[felt])
            pinned = kind(self.stiffness[left][:, left].tocsc(), interface).response(self.load[left])
        flexibility, loaded = np.zeros((len(felt), len(felt))), np.zeros(len(self.load))
        flexibility[np.ix_(felt, felt)] = pinned.flexibility
        loaded[left] = pinned.loaded

        def field(force: Floats) -> Floats:
            result = np.zeros(len(self.load))
            result[left] = pinned.field(force[felt])
            return result

        return Response(flexibility=flexibility, loaded=loaded, field=field)

    @lent
    def order(self) -> Ints:
        """An order of elimination that ends with the interface, one for all matrices of the mesh."""
        return elimination_order(self.stiffness, self.interface)

    @property
    def few(self) -> bool:
        """True if it has so few unknowns that dense matrices cost less than sparse ones."""
        return len(self.positions) <= FEW

    @lent
    def elastic(self) -> Condensation:
        """The stiffness matrix condensed onto the interface."""
        loose = self.motions.shape[1] > 0
        if self.few:
            return Lifted(self.stiffness, self.interface, singular=loose)
        return Condensation(self.stiffness, self.interface, self.order, singular=loose)

    @lent
    def gram(self) -> Condensation:
        """The Gram matrix condensed onto the interface."""
        if self.few:
            return Lifted(self.gram_matrix, self.interface)
        if self.turned is not None:  # which couples both components
            return Condensation(self.gram_matrix, self.interface, self.order)
        return Uncoupled(self.gram_matrix, self.interface, self.positions % self.mesh.dimension, self.order)

    @lent
    def lift_gram(self) -> Floats:
        """``N_a = R_a' H_a R_a``: the H1 norm squared of the elastic lift (4.5), on the free components."""
        with one_thread():
            return freeze(self.elastic.on_lifts(self.gram_matrix))

    def times_as_stiff(self, other: Body) -> float | None:
        """Return the ratio of its stiffness matrix to that of ``other``, if only Young's moduli and loads differ."""
        plan = lambda body: (
            *(body.mesh.points, body.mesh.cells, body.known.held, body.nodes, body.poisson, body.normals),
        )
        if not all(map(np.array_equal, plan(self), plan(other))):
            return None
        return self.material.over(other.material)

    def equals(self, other: Body) -> bool:
        """Return True if it is the same body, loads and norm included."""
        rest = lambda body: (body.known.values, body.load, body.length)
        return self.times_as_stiff(other) == 1.0 and all(map(np.array_equal, rest(self), rest(other)))

    @property
    def known_trace(self) -> Floats:
        """Interface displacements that Gamma_u prescribes, 0 where it does not."""
        values = self.known.values[self.nodes]
        if self.normals is not None:
            x, y = self.normals.T
            return np.concatenate([values[:, 0] * y - values[:, 1] * x, values[:, 0] * x + values[:, 1] * y])
        return np.concatenate([values[:, p] for p in range(self.mesh.dimension)])

    @property
    def motion_traces(self) -> Floats:
        """Orthonormal traces on Gamma_c of the rigid motions that only contact holds, shape (2 n, rank)."""
        if not self.motions.shape[1]:
            return NO_MOTIONS
        left, values, _ = np.linalg.svd(self.motions[self.interface], full_matrices=False)
        rank = int((values > STILL).sum())
        traces = np.zeros((len(self.unknown), rank))
        traces[self.unknown] = left[:, :rank]
        return traces

    def displacement(self, trace: Floats) -> Floats:
        """Return the displacement of all nodes for given interface values, shape (nodes, d), unit of length."""
        return self.at_nodes(self.elastic.extend(trace[self.unknown], self.load))

    def at_nodes(self, unknowns: Floats) -> Floats:
        """Return the displacement of all nodes along the axes, shape (nodes, d), for values of the unknowns."""
        full = self.known.values.ravel().copy()
        full[self.positions] = unknowns if self.turned is None else self.turned.T @ unknowns
        return full.reshape(self.mesh.points.shape)

    def of_nodes(self, displacement: Floats) -> Floats:
        """Return the values of the unknowns of a displacement of all nodes along the axes."""
        unknowns = displacement.ravel()[self.positions]
        return unknowns if self.turned is None else np.asarray(self.turned @ unknowns)


def turning(normals: NDArray[Any], places: Ints, size: int) -> sp.csc_array:
    """Return Q of a body, from unknowns along x and y to tangential and normal ones at its contact nodes.

    Where a support holds one component, the other one is normal.

    Parameters
    ----------
    normals : array, shape (n, 2)
        Those of the contact nodes.
    places : int array, shape (2, n)
        Positions of their components along x and y among the unknowns, -1 where held.
    size : int
        Number of unknowns.
    """
    x, y = normals.T
    both = (places >= 0).all(axis=0)
    one = ((places >= 0).any(axis=0)) & ~both
    single = places.max(axis=0)[one]
    along_x, along_y = places[:, both]
    rest = np.setdiff1d(np.arange(size), np.concatenate([along_x, along_y, single]))
    rows = np.concatenate([rest, single, along_x, along_x, along_y, along_y])
    columns = np.concatenate([rest, single, along_x, along_y, along_x, along_y])
    entries = [np.ones(len(rest)), (x + y)[one], y[both], -x[both], x[both], y[both]]
    turned = sp.csc_array((np.concatenate(entries), (rows, columns)), shape=(size, size))
    turned.sort_indices()  # now: it will be read-only
    return turned


def in_frames(matrix: sp.csc_array, turned: sp.csc_array | None) -> sp.csc_array:
    """Return ``Q X Q'`` of a symmetric matrix on the unknowns along x and y, exactly symmetric."""
    if turned is None:
        return matrix
    result = (turned @ matrix @ turned.T).tocsc()
    result = ((result + result.T) / 2).tocsc()
    result.sort_indices()  # now: it will be read-only
    return result


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Condensed(Value):
    """A body condensed onto its contact nodes: the algorithm and its bounds use nothing else of it.

    Interface vectors have their normal components along n of the contact body.  Held components have zero rows and
    columns.

    Attributes
    ----------
    schur : array, shape (2 n, 2 n)
        S_a, stress (times length in 1D per unit thickness).
    load : array, shape (2 n,)
        l_a: loads condensed onto the interface.
    known : array, shape (2 n,)
        Known trace of held components.
    free : bool array, shape (2 n,)
        Components that Gamma_u leaves free.
    body : Body or None
        The body on its mesh; None where only matrices are known.
    upward : bool
        Whether the normal components point along y, as those of ``body`` do.
    motions : array, shape (2 n, k)
        Orthonormal traces of the rigid motions that only contact holds: the kernel of S_a; of shape (0, 0) without.
    own_load : array, shape (2 n,), or None
        The l_a of the loads of ``body``; a ``load`` that differs has further forces on Gamma_c.
    rigid : bool
        True for an obstacle, which has no body.
    """

    grid: Grid
    schur: Floats
    load: Floats
    known: Floats
    free: NDArray[np.bool_]
    body: Body | None = None
    upward: bool = True
    motions: Floats = field(default_factory=lambda: NO_MOTIONS)
    own_load: Floats | None = None
    rigid: bool = False

    @classmethod
    def obstacle(cls, other: Condensed) -> Condensed:
        """Return an obstacle on the grid of the body in contact with it, RIGID times as stiff and without loads.

        The norm (5.21) is then the one of that body, scaled.
        """
        zero = np.zeros(other.grid.size)
        held = other.schur + np.abs(other.schur).max() * (other.motions @ other.motions.T if other.loose else 0.0)
        return cls(
            grid=other.grid, schur=RIGID * held, load=zero, known=zero, free=other.free, upward=other.upward, rigid=True
        )

    @property
    def loose(self) -> bool:
        """True if only contact holds the body: S_a is then semidefinite."""
        return bool(self.motions.size)

    @property
    def slides(self) -> bool:
        """True if a rigid motion that only contact holds is tangential somewhere on Gamma_c."""
        return bool(np.abs(self.motions[self.grid.tangential]).max(initial=0.0) > STILL)

    @property
    def lifts(self) -> bool:
        """True if a rigid motion that only contact holds has a normal component on Gamma_c."""
        return bool(np.abs(self.motions[self.grid.normal]).max(initial=0.0) > STILL)

    @property
    def support(self) -> tuple[Nodes, Nodes]:
        """The contact nodes that Gamma_u holds tangentially, and those of them that it holds at 0."""
        held = ~self.free[self.grid.tangential]
        return held, held & (self.known[self.grid.tangential] == 0)

    @property
    def summary(self) -> str:
        return f"{self.grid.n} contact nodes, {'from matrices' if self.body is None else self.body.name}"

    @classmethod
    def of(cls, body: Body, grid: Grid, like: Body | None = None) -> Condensed:
        """Condense a body onto its contact nodes; normal components along y.

        A body ``like`` it that differs only in Young's modulus and loads lends its condensation: the stiffness is a
        multiple, and the lift the same.
        """
        times = None if like is None else body.times_as_stiff(like)
        elastic = body.elastic if like is None or times is None else like.elastic
        rows = np.flatnonzero(body.unknown)
        size = len(body.unknown)
        matrix, load = np.zeros((size, size)), np.zeros(size)
        with one_thread():
            load[rows] = elastic.condense(body.load)  # before the Schur complement, which its factorisation gives too
            matrix[np.ix_(rows, rows)] = elastic.schur if times is None else times * elastic.schur
        return cls(
            grid=grid,
            schur=matrix,
            load=load,
            known=body.known_trace,
            free=body.unknown.copy(),
            body=body,
            motions=body.motion_traces,
            own_load=load,
        )

    def under(self, body: Body) -> Condensed:
        """Return the same side with the loads of its body under other ones, as :meth:`Body.under` makes it."""
        load = np.zeros(self.grid.size)
        with one_thread():
            load[body.unknown] = body.elastic.condense(body.load)
        load = self.orient(load)
        return copied(self, body=body, load=load, own_load=load, known=self.orient(body.known_trace))

    def turned(self) -> Condensed:
        """Return the same body with its normal components along the opposite direction."""
        turn = self.grid.turn
        return replace(
            self,
            schur=turn(turn(self.schur).T),
            load=turn(self.load),
            known=turn(self.known),
            upward=not self.upward,
            motions=turn(self.motions) if self.loose else self.motions,
            own_load=None if self.own_load is None else turn(self.own_load),
        )

    def orient(self, interface: Floats) -> Floats:
        """Turn interface vectors between the directions of ``body`` and those used here (its own inverse)."""
        return interface.copy() if self.upward else self.grid.turn(interface)

    def orient_form(self, matrix: Floats) -> Floats:
        """Do the same with a symmetric matrix on the free components."""
        if self.upward:
            return matrix
        sign = np.where(np.arange(self.grid.size) < self.grid.t, 1.0, -1.0)[self.free]
        return np.asarray(sign[:, None] * matrix * sign)

    @property
    def mesh_body(self) -> Body:
        """The body on its mesh; ValueError where only matrices are known."""
        if self.body is None:
            raise ValueError("this pair is made from matrices: needed the meshes of both bodies")
        return self.body

    @property
    def loaded_body(self) -> Body:
        """The body on its mesh under the loads of this side; ValueError where only matrices are known."""
        body = self.mesh_body
        if self.own_load is None or np.array_equal(self.load, self.own_load):
            return body
        load = body.load.copy()
        load[body.interface] += self.orient(self.load - self.own_load)[body.unknown]
        return replace(body, load=load)

    @lent
    def _factor(self) -> Cholesky:
        return Cholesky(self.schur, np.flatnonzero(self.free), self.motions)

    def flexibility(self, force: Floats) -> Floats:
        """Return ``S_a^-1 force`` on the free components, 0 on held ones, for one force or columns of them.

        Where only contact holds the body, its motions are pinned: right for forces that do no work in them.
        """
        return self._factor.solve(force)

    @lent
    def inverse(self) -> Floats:
        """``S_a^-1`` as a matrix, 0 on held components, shape (2 n, 2 n)."""
        return freeze(self.flexibility(np.eye(len(self.load))))

    @lent
    def root(self) -> Floats:
        """L with ``S_a = L L'``, shape (2 n, free components): columns orthonormal in the norm (5.21)."""
        result = np.zeros((len(self.free), int(self.free.sum())))
        result[self.free] = cholesky(self.schur[np.ix_(self.free, self.free)], lower=True)
        return freeze(result)

    @cached_property
    def gram(self) -> Floats:
        """E_a: the H1 norm squared of the extension of least H1 norm, on the free components; needs ``body``."""
        with one_thread():
            return freeze(self.orient_form(self.mesh_body.gram.schur))

    @cached_property
    def lift_gram(self) -> Floats:
        """``N_a = R_a' H_a R_a``: H1 norm squared of the elastic lift (4.5), on the free components; needs ``body``."""
        return freeze(self.orient_form(self.mesh_body.lift_gram))

    @cached_property
    def unloaded(self) -> Floats:
        """The displacement without contact forces, ``known + S_a^-1 l_a``."""
        return freeze(self.known + self.flexibility(self.load))

    def dual_norm(self, force: Floats) -> float:
        """Return the norm (5.21), ``sqrt(force' S_a^-1 force)``, when this is the Neumann body."""
        return math.sqrt(max(float(force @ self.flexibility(force)), 0.0))

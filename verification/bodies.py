"""Problem -> two condensed bodies facing each other along Gamma_c."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fem1d2d import (
    Condensation,
    Material,
    Mesh,
    MeshError,
    Supports,
    bar,
    body_load,
    from_file,
    gram,
    interval,
    nodes_between,
    plane_strain,
    rectangle,
    rigid_motions,
    side_load,
    stiffness,
    supports,
    surface,
    trapezoid,
)
from fem1d2d.mesh import Floats, Ints
from fem1d2d.trace import SAME, extent
from verification.friction import friction_operator
from verification.problem import BodySpec, Problem
from verification.reader import ProblemError
from verification.threads import one_thread

Name = Literal["body1", "body2"]


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
    elastic, gram : Condensation
        The stiffness matrix and the H1 Gram matrix of the unknowns, condensed onto the interface.
    load : array
        Loads on the unknowns: body force, tractions, prescribed displacements.
    """

    name: Name
    mesh: Mesh
    material: Material
    known: Supports
    nodes: Ints
    free: Ints
    unknown: NDArray[np.bool_]
    elastic: Condensation
    gram: Condensation
    load: Floats

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

    def dual_norm(self, force: Floats) -> float:
        """The norm (5.21), ``sqrt(force' S_a^-1 force)``, when this is the Neumann body."""
        return math.sqrt(max(float(force @ self.flexibility(force)), 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """Two bodies facing each other, with their roles.

    Attributes
    ----------
    problem : Problem
    body1, body2 : Body
    x : array, shape (n,)
        Positions of the contact nodes; in 1D the one point.
    weights : array, shape (n,)
        w_j of the trapezoid rule (length; 1 in 1D).
    gap : float
        Initial distance.
    regularisation : array, shape (n, n) or None
        The operator S on normal nodal forces; None without a law of friction.
    """

    problem: Problem
    body1: Body
    body2: Body
    x: Floats
    weights: Floats
    gap: float
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
    def upward(self) -> float:
        """+1 where the outward normal of the contact body points up (body 1), -1 where it points down (body 2)."""
        return 1.0 if self.problem.iteration.neumann_body == 2 else -1.0

    def orient(self, interface: Floats) -> Floats:
        """Turn the normal components of interface vectors between y and n of the contact body (its own inverse)."""
        turned = interface.copy()
        turned[self.normal] *= self.upward
        return turned

    def _side(self, body: Body) -> Side:
        size = len(body.unknown)
        rows = np.flatnonzero(body.unknown)
        matrix = np.zeros((size, size))
        matrix[np.ix_(rows, rows)] = body.elastic.schur
        load = np.zeros(size)
        load[rows] = body.elastic.condense(body.load)
        matrix = self.orient(self.orient(matrix).T)
        return Side(body=body, stiffness=matrix, load=self.orient(load), known=self.orient(body.known_trace))

    @cached_property
    def neumann(self) -> Side:
        """The body of step I."""
        return self._side(self.body2 if self.problem.iteration.neumann_body == 2 else self.body1)

    @cached_property
    def contact(self) -> Side:
        """The body of step II."""
        return self._side(self.body1 if self.problem.iteration.neumann_body == 2 else self.body2)

    @property
    def outside(self) -> list[str]:
        """Why the theorem does not speak of this problem; empty where it does."""
        reasons = []
        if self.problem.contact.law == "local" and self.problem.contact.friction:
            reasons.append("the local Coulomb law: S must map into L2(Gamma_c)")
        if not (self.body1.unknown.all() and self.body2.unknown.all()):
            reasons.append("a contact node is held tangentially: Gamma_u and Gamma_c must not meet")
        return reasons

    @property
    def warnings(self) -> list[str]:
        """What a user should know before trusting the numbers."""
        radius = self.problem.contact.radius
        if radius is None or self.problem.contact.law == "local" or self.n < 2:
            return []
        r, width = float(radius), float(np.diff(self.x).max())
        if r >= width:
            return []
        return [f"contact.radius = {r:g} is below the mesh width {width:g}: the kernel sees single nodes"]


def build(problem: Problem) -> Pair:
    """Mesh, assemble and condense both bodies.

    Raises
    ------
    ProblemError
        A body that can move rigidly, bodies that do not meet, grids that do not match, an interval outside the overlap,
        Gamma_u holding the normal component of a contact node, an unreadable mesh.
    """
    mesh1, mesh2 = _mesh(problem, "body1"), _mesh(problem, "body2")
    nodes1, nodes2 = _interface(problem, mesh1, mesh2)
    with one_thread():
        body1, body2 = _body(problem, "body1", mesh1, nodes1), _body(problem, "body2", mesh2, nodes2)
    x = mesh1.points[nodes1, 0].astype(float)
    weights = trapezoid(x)
    contact = problem.contact
    radius = None if contact.radius is None else float(contact.radius)
    regularisation = None
    if problem.dimension == 2 and (contact.law == "local" or radius is not None):
        regularisation = friction_operator(x, weights, law=contact.law, radius=radius)
    return Pair(
        problem=problem,
        body1=body1,
        body2=body2,
        x=x,
        weights=weights,
        gap=float(contact.gap),
        regularisation=regularisation,
    )


def _mesh(problem: Problem, name: Name) -> Mesh:
    spec: BodySpec = getattr(problem, name)
    if spec.mesh is not None:
        try:
            mesh = from_file(spec.mesh)
        except MeshError as error:
            raise ProblemError(problem.source, f"{name}.mesh", str(spec.mesh), str(error)) from None
        for key, sides in (("fixed", spec.fixed), ("prescribed", spec.prescribed), ("traction", spec.traction)):
            for side in sides:
                if side not in mesh.sides:
                    raise ProblemError(
                        problem.source,
                        f"{name}.{key}",
                        side,
                        "unknown side; the mesh file names " + ", ".join(mesh.sides),
                    )
        return mesh
    assert spec.x is not None
    assert spec.cells is not None
    x = (float(spec.x[0]), float(spec.x[1]))
    if problem.dimension == 1:
        return interval(x, spec.cells[0])
    assert spec.y is not None
    return rectangle(x, (float(spec.y[0]), float(spec.y[1])), (spec.cells[0], spec.cells[1]))


def _interface(problem: Problem, mesh1: Mesh, mesh2: Mesh) -> tuple[Ints, Ints]:
    """Contact nodes of both bodies, facing each other one by one."""
    refuse = lambda key, value, needed: ProblemError(problem.source, key, value, needed)
    try:
        nodes1, nodes2 = surface(mesh1, upper=True), surface(mesh2, upper=False)
    except MeshError as error:
        raise refuse("contact", None, str(error)) from None
    size = max(extent(mesh1), extent(mesh2))
    level1, level2 = (float(mesh.points[nodes[0], -1]) for mesh, nodes in ((mesh1, nodes1), (mesh2, nodes2)))
    distance, gap = level2 - level1, float(problem.contact.gap)
    if min(abs(distance), abs(distance - gap)) > SAME * size:
        axis = "x" if problem.dimension == 1 else "y"
        raise refuse(
            f"body2.{axis}",
            None,
            f"the bodies do not meet: body 1 ends at {axis} = {level1:g}, body 2 begins at {axis} = {level2:g}"
            " (draw them touching; contact.gap sets the initial distance)",
        )
    if problem.dimension == 1:
        return nodes1, nodes2
    x1, x2 = mesh1.points[nodes1, 0].astype(float), mesh2.points[nodes2, 0].astype(float)
    overlap = (max(x1[0], x2[0]), min(x1[-1], x2[-1]))
    if overlap[1] - overlap[0] <= SAME * size:
        raise refuse(
            "body2.x",
            None,
            f"the bodies do not meet: body 1 covers x = {x1[0]:g} to {x1[-1]:g}, body 2 x = {x2[0]:g} to {x2[-1]:g}",
        )
    ends = overlap
    if problem.contact.interval is not None:
        ends = (float(problem.contact.interval[0]), float(problem.contact.interval[1]))
        if ends[0] < overlap[0] - SAME * size or ends[1] > overlap[1] + SAME * size:
            raise refuse(
                "contact.interval",
                list(problem.contact.interval),
                f"needed an interval inside the overlap [{overlap[0]:g}, {overlap[1]:g}]",
            )
    nodes1, nodes2 = nodes_between(mesh1, nodes1, ends), nodes_between(mesh2, nodes2, ends)
    x1, x2 = mesh1.points[nodes1, 0].astype(float), mesh2.points[nodes2, 0].astype(float)
    if len(x1) != len(x2) or not np.allclose(x1, x2, rtol=0, atol=SAME * size):
        raise refuse(
            "body2.cells",
            None,
            f"non-matching grids are not supported yet: on [{ends[0]:g}, {ends[1]:g}] body 1 has {len(x1)} nodes"
            f" and body 2 has {len(x2)}, which must lie at the same x",
        )
    if len(x1) < 2 or max(x1[0] - ends[0], ends[1] - x1[-1]) > SAME * size:
        near = f"from {x1[0]:g} to {x1[-1]:g}" if len(x1) else "nowhere"
        raise refuse(
            "contact.interval",
            None if problem.contact.interval is None else list(problem.contact.interval),
            f"Gamma_c must begin and end at nodes of both bodies; inside [{ends[0]:g}, {ends[1]:g}] they lie {near}",
        )
    return nodes1, nodes2


def _body(problem: Problem, name: Name, mesh: Mesh, nodes: Ints) -> Body:
    spec: BodySpec = getattr(problem, name)
    d = mesh.dimension
    plain = lambda values: [float(v) for v in values]
    sides: dict[str, list[float | None]] = {side: [0.0] * d for side in spec.fixed}
    sides |= {side: [None if v is None else float(v) for v in values] for side, values in spec.prescribed.items()}
    try:
        known = supports(mesh, sides)
    except MeshError as error:
        raise ProblemError(problem.source, f"{name}.prescribed", None, str(error)) from None
    if known.known[nodes, d - 1].any():
        where = mesh.points[nodes[np.argmax(known.known[nodes, d - 1])]].astype(float)
        raise ProblemError(
            problem.source,
            f"{name}.fixed" if spec.fixed else f"{name}.prescribed",
            list(spec.fixed) if spec.fixed else list(spec.prescribed),
            "Gamma_u must leave the normal component of every contact node free; it holds the one at "
            f"({', '.join(f'{c:g}' for c in where)})",
        )
    motions = rigid_motions(mesh, known.known)
    if motions:
        raise ProblemError(
            problem.source,
            name,
            None,
            f"{name} can move rigidly ({motions} free motion{'s' if motions > 1 else ''}): "
            "fix or prescribe more of its sides",
        )
    material = plane_strain(float(spec.young), float(spec.poisson)) if d == 2 else bar(float(spec.young))
    matrix = stiffness(mesh, material)
    load = body_load(mesh, plain(spec.body_force))
    interface_edges = np.isin(mesh.boundary, nodes).all(axis=1)
    contact_edges = {tuple(edge) for edge in np.sort(mesh.boundary[interface_edges], axis=1)}
    for side, force in spec.traction.items():
        outside = [tuple(sorted(edge)) not in contact_edges for edge in mesh.sides[side]]
        load += side_load(mesh, mesh.sides[side][np.array(outside, dtype=bool)], plain(force))
    free = np.flatnonzero(~known.known.ravel())
    right = load.ravel()[free] - matrix[free] @ known.values.ravel()
    position = np.full(known.known.size, -1)
    position[free] = np.arange(len(free))
    interface = np.concatenate([position[d * nodes + p] for p in range(d)])
    unknown = interface >= 0
    inner = interface[unknown]
    return Body(
        name=name,
        mesh=mesh,
        material=material,
        known=known,
        nodes=nodes,
        free=free,
        unknown=unknown,
        elastic=Condensation(matrix[free][:, free].tocsc(), inner),
        gram=Condensation(gram(mesh, float(problem.length))[free][:, free].tocsc(), inner),
        load=right,
    )

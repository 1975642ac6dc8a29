"""Problem -> two condensed bodies facing each other along Gamma_c."""

from __future__ import annotations

import numpy as np

from fem1d2d import (
    Mesh,
    MeshError,
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
from fem1d2d.mesh import Ints
from fem1d2d.trace import SAME, extent
from verification.friction import friction_operator
from verification.pair import Body, Name, Pair
from verification.problem import BodySpec, Problem
from verification.reader import ProblemError


def build(problem: Problem) -> Pair:
    """Mesh and assemble both bodies; they are condensed when first asked.

    Raises
    ------
    ProblemError
        A body that can move rigidly, bodies that do not meet, grids that do not match, an interval outside the overlap,
        Gamma_u holding the normal component of a contact node, an unreadable mesh.
    """
    mesh1, mesh2 = _mesh(problem, "body1"), _mesh(problem, "body2")
    nodes1, nodes2 = _interface(problem, mesh1, mesh2)
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
    return Body(
        name=name,
        mesh=mesh,
        material=material,
        known=known,
        nodes=nodes,
        free=free,
        unknown=unknown,
        interface=interface[unknown],
        stiffness=matrix[free][:, free].tocsc(),
        gram_matrix=gram(mesh, float(problem.length))[free][:, free].tocsc(),
        load=right,
    )

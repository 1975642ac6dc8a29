"""From a problem to its two bodies: meshes, supports, stiffness matrices, Gamma_c, and their condensation onto it."""

from __future__ import annotations

import numpy as np

from fem1d2d import (
    Mesh,
    MeshError,
    bar,
    body_load,
    facing,
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
)
from fem1d2d.mesh import Floats, Ints
from fem1d2d.trace import SAME, extent
from verification.interface.body import Body, Condensed, Name
from verification.interface.friction import LAWS, Law
from verification.interface.grid import Grid
from verification.interface.interface import Interface
from verification.interface.pair import ContactPair, TwoBodies
from verification.problem.specification import MOST_CELLS, BodySpec, Problem
from verification.problem.tables import ProblemError, short

#: Interface matrices are dense; more contact nodes would fill the memory.
MOST_CONTACT_NODES = 2000


class TooManyContactNodes(ProblemError):
    """A sound problem, too large for dense interface matrices."""


def build(problem: Problem, *, law: Law | None = None, like: ContactPair | None = None) -> ContactPair:
    """Two condensed bodies with roles, as the iteration and its constants need them.

    Parameters
    ----------
    problem : Problem
        Its ``[iteration]`` gives the roles and the pair's settings.
    law : Law, optional
        A law of friction in place of the problem's.
    like : ContactPair, optional
        What it has condensed is shared by bodies that are the same, or differ in Young's modulus and loads alone.

    Raises
    ------
    ProblemError
        As :func:`discretise`, and where a body is rigid or can move rigidly.
    """
    bodies, iteration = held_bodies(problem, law=law), problem.iteration
    known = (None, None) if like is None else (like.body1, like.body2)
    upward, grid = iteration.neumann_body == 2, bodies.interface.contact
    lower, upper = (_condensed(body, grid, upward, side) for body, side in zip(bodies.elastic, known, strict=True))
    return ContactPair(
        contact=lower if upward else upper,
        neumann=upper if upward else lower,
        interface=bodies.interface,
        friction=bodies.friction,
        neumann_body=iteration.neumann_body,
        settings=iteration.settings,
        problem=problem,
    )


def held_bodies(problem: Problem, *, law: Law | None = None, dense: bool = True) -> TwoBodies:
    """The bodies on their meshes as the iteration needs them: elastic, and held by their supports.

    Parameters
    ----------
    problem : Problem
    law : Law, optional
        As for :func:`build`.
    dense : bool
        As for :func:`discretise`.

    Raises
    ------
    ProblemError
        As :func:`build`.
    """
    iteration = problem.iteration
    for name in ("body1", "body2"):
        if getattr(problem, name).rigid:
            role = "Neumann" if iteration.neumann_body == int(name[-1]) else "contact"
            raise ProblemError(
                problem.source,
                f"{name}.shape",
                "rigid",
                f"needed an elastic body: it has the {role} problem of the iteration; `ndtheory solve` takes obstacles",
            )
    bodies = discretise(problem, law=law, dense=dense)
    for body in bodies.elastic:
        k = body.motions.shape[1]
        if k:
            neumann = iteration.neumann_body == int(body.name[-1])
            step = "the Neumann problem of step I" if neumann else "the contact problem of step II"
            raise ProblemError(
                problem.source,
                body.name,
                None,
                f"{body.name} can move rigidly ({k} free motion{'s' if k > 1 else ''}), so that its stiffness matrix in"
                f" {step} is singular: fix or prescribe more of its sides, or use `ndtheory solve`",
            )
    return bodies


def _condensed(body: Body, grid: Grid, upward: bool, like: Condensed | None) -> Condensed:
    """A body condensed, its normal components along y or against it; one like it may be condensed already."""
    if like is None or like.body is None:
        found = Condensed.of(body, grid)
    elif body.equals(like.body):
        found = like
    else:
        found = Condensed.of(body, grid, like.body)
    return found if found.upward == upward else found.turned()


def discretise(problem: Problem, *, law: Law | None = None, dense: bool = True) -> TwoBodies:
    """Mesh and assemble the bodies and find Gamma_c.

    Parameters
    ----------
    problem : Problem
    law : Law, optional
        A law of friction in place of the problem's.
    dense : bool
        False where no interface matrices will be made: then there may be any number of contact nodes.

    Raises
    ------
    TooManyContactNodes
        More than MOST_CONTACT_NODES of them, for dense interface matrices.
    ProblemError
        A body held by nothing but contact, bodies that do not meet, grids that do not match, an interval outside the
        overlap, Gamma_u holding the normal component of a contact node, an unreadable mesh.
    """
    meshes = [None if spec.rigid else _mesh(problem, name) for name, spec in _specs(problem)]
    nodes, x, gap = _interface(problem, meshes)
    if dense and len(x) > MOST_CONTACT_NODES:
        raise TooManyContactNodes(
            problem.source, "contact", None, f"needed at most {MOST_CONTACT_NODES} contact nodes, these are {len(x)}"
        )
    body1, body2 = (
        None if mesh is None else _body(problem, name, mesh, own)
        for (name, _), mesh, own in zip(_specs(problem), meshes, nodes, strict=True)
    )
    grid = Grid.on(x, problem.dimension)
    return TwoBodies(
        body1=body1,
        body2=body2,
        interface=Interface(
            contact=grid, neumann=grid, gap=gap, law=law or LAWS[problem.contact.law].of(problem.contact.radius)
        ),
        friction=problem.contact.friction,
        problem=problem,
    )


def _specs(problem: Problem) -> list[tuple[Name, BodySpec]]:
    return [("body1", problem.body1), ("body2", problem.body2)]


def _mesh(problem: Problem, name: Name) -> Mesh:
    spec: BodySpec = getattr(problem, name)
    if spec.mesh is not None:
        path = spec.mesh.path
        refuse = lambda needed: ProblemError(problem.source, f"{name}.mesh", path, needed)
        why = spec.mesh.unusable()
        if why:
            raise refuse(why)
        try:
            mesh = from_file(path)
        except MeshError as error:
            raise refuse(str(error).removeprefix(f"{path}: ")) from None
        if len(mesh.cells) > 2 * MOST_CELLS:
            raise refuse(f"needed at most {2 * MOST_CELLS} triangles, these are {len(mesh.cells)}")
        for key, sides in (("fixed", spec.fixed), ("prescribed", spec.prescribed), ("traction", spec.traction)):
            for side in sides:
                if side not in mesh.sides:
                    raise ProblemError(
                        problem.source,
                        f"{name}.{key}",
                        side,
                        "unknown side; the mesh file names " + short(", ".join(mesh.sides)),
                    )
        return mesh
    assert spec.x is not None
    assert spec.cells is not None
    x = (float(spec.x[0]), float(spec.x[1]))
    try:
        if problem.dimension == 1:
            return interval(x, spec.cells[0])
        assert spec.y is not None
        return rectangle(x, (float(spec.y[0]), float(spec.y[1])), (spec.cells[0], spec.cells[1]))
    except MeshError as error:  # coordinates that no longer differ in doubles
        raise ProblemError(problem.source, f"{name}.cells", list(spec.cells), str(error)) from None


def _interface(problem: Problem, meshes: list[Mesh | None]) -> tuple[list[Ints], Floats, Floats]:
    """Contact nodes of both bodies facing each other one by one (none on a rigid body), their x, and their distance."""
    refuse = lambda key, value, needed: ProblemError(problem.source, key, value, needed)
    axis = "x" if problem.dimension == 1 else "y"
    size = max(extent(mesh) for mesh in meshes if mesh is not None)
    chosen = problem.contact.interval
    ends = None if chosen is None else (float(chosen[0]), float(chosen[1]))
    nodes: list[Ints] = []
    for mesh, upper in zip(meshes, (True, False), strict=True):
        try:
            if mesh is None:
                nodes.append(np.empty(0, dtype=np.int64))
            elif mesh.dimension == 1 or ends is None:
                nodes.append(surface(mesh, upper=upper))
            else:
                nodes.append(facing(mesh, upper=upper, ends=ends))
        except MeshError as error:
            raise refuse("contact.interval", None, f"{error}; needed the part of the x axis where they meet") from None

    if problem.dimension == 2:
        reach = _reach(problem, meshes, nodes)
        overlap = (max(low for low, _ in reach), min(high for _, high in reach))
        if not overlap[1] - overlap[0] > SAME * size:
            covers = ", ".join(f"body {i} covers x = {low:g} to {high:g}" for i, (low, high) in enumerate(reach, 1))
            raise refuse("body2.x", None, f"the bodies do not meet: {covers}")
        if ends is None:
            ends = overlap
        elif ends[0] < overlap[0] - SAME * size or ends[1] > overlap[1] + SAME * size:
            needed = f"needed an interval inside the overlap [{overlap[0]:g}, {overlap[1]:g}]"
            raise refuse("contact.interval", list(chosen or ()), needed)
        nodes = [
            own if mesh is None else nodes_between(mesh, own, ends) for mesh, own in zip(meshes, nodes, strict=True)
        ]
        _check_matching(problem, meshes, nodes, ends, size)

    points = [None if mesh is None else mesh.points[own].astype(float) for mesh, own in zip(meshes, nodes, strict=True)]
    x = next(p[:, 0] for p in points if p is not None)
    levels = [
        _obstacle_level(spec, name, points) if p is None else p[:, -1]
        for (name, spec), p in zip(_specs(problem), points, strict=True)
    ]
    distance = np.broadcast_to(levels[1] - levels[0], x.shape)
    nearest, gap = float(distance.min()), float(problem.contact.gap)
    if min(abs(nearest), abs(nearest - gap)) > SAME * size:
        low, high = float(np.max(levels[0])), float(np.min(levels[1]))
        raise refuse(
            f"body2.{axis}",
            None,
            f"the bodies do not meet: body 1 ends at {axis} = {low:g}, body 2 begins at {axis} = {high:g}"
            " (draw them touching; contact.gap sets the initial distance)",
        )
    # A distance within rounding of the nearest one is that one: flat bodies have one gap.
    return nodes, x, np.where(distance - nearest <= SAME * size, 0.0, distance - nearest) + gap


def _reach(problem: Problem, meshes: list[Mesh | None], nodes: list[Ints]) -> list[tuple[float, float]]:
    """How far each body reaches along x; an obstacle without x is endless."""
    reach = []
    for (_, spec), mesh, own in zip(_specs(problem), meshes, nodes, strict=True):
        if mesh is not None:
            x = mesh.points[own if problem.contact.interval is None else slice(None), 0].astype(float)
            reach.append((float(x.min()), float(x.max())))
        else:
            reach.append((-np.inf, np.inf) if spec.x is None else (float(spec.x[0]), float(spec.x[1])))
    return reach


def _obstacle_level(spec: BodySpec, name: Name, points: list[Floats | None]) -> Floats:
    """Where the face of an obstacle lies; without coordinates it touches the other body."""
    ends = spec.x if points[0 if points[0] is not None else 1].shape[1] == 1 else spec.y  # type: ignore[union-attr]
    if ends is not None:
        return np.array(float(ends[1] if name == "body1" else ends[0]))
    other = next(p[:, -1] for p in points if p is not None)
    return np.array(other.min() if name == "body1" else other.max())


def _check_matching(
    problem: Problem, meshes: list[Mesh | None], nodes: list[Ints], ends: tuple[float, float], size: float
) -> None:
    """The grids must match, and Gamma_c must begin and end at nodes."""
    refuse = lambda key, value, needed: ProblemError(problem.source, key, value, needed)
    positions = [mesh.points[own, 0].astype(float) for mesh, own in zip(meshes, nodes, strict=True) if mesh is not None]
    if len(positions) == 2:
        x1, x2 = positions
        if len(x1) != len(x2) or not np.allclose(x1, x2, rtol=0, atol=SAME * size):
            raise refuse(
                "body2.cells",
                None,
                f"non-matching grids are not supported yet: on [{ends[0]:g}, {ends[1]:g}] body 1 has {len(x1)} nodes"
                f" and body 2 has {len(x2)}, which must lie at the same x",
            )
    x = positions[0]
    if len(x) < 2 or max(x[0] - ends[0], ends[1] - x[-1]) > SAME * size:
        near = f"from {x[0]:g} to {x[-1]:g}" if len(x) else "nowhere"
        raise refuse(
            "contact.interval",
            None if problem.contact.interval is None else list(problem.contact.interval),
            f"Gamma_c must begin and end at nodes of both bodies; inside [{ends[0]:g}, {ends[1]:g}] they lie {near}",
        )


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
        node = nodes[np.argmax(known.known[nodes, d - 1])]
        where = mesh.points[node].astype(float)
        holds = next(side for side, values in sides.items() if values[d - 1] is not None and node in mesh.sides[side])
        raise ProblemError(
            problem.source,
            f"{name}.fixed" if holds in spec.fixed else f"{name}.prescribed.{holds}",
            list(spec.fixed) if holds in spec.fixed else None,
            "Gamma_u must leave the normal component of every contact node free; it holds the one at "
            f"({', '.join(f'{c:g}' for c in where)})",
        )
    motions = rigid_motions(mesh, known.known)
    if motions.shape[2] and not known.known.any():
        raise ProblemError(
            problem.source,
            name,
            None,
            f"{name} can move rigidly, held by nothing but contact: fix or prescribe some of its sides",
        )
    material = plane_strain(float(spec.young), float(spec.poisson)) if d == 2 else bar(float(spec.young))
    matrix = stiffness(mesh, material)
    load = body_load(mesh, plain(spec.body_force))
    interface_edges = np.isin(mesh.boundary, nodes).all(axis=1)
    contact_edges = {tuple(edge) for edge in np.sort(mesh.boundary[interface_edges], axis=1)}
    for side, force in spec.traction.items():
        outside = [tuple(sorted(edge)) not in contact_edges for edge in mesh.sides[side]]
        if any(force) and not any(outside):
            raise ProblemError(
                problem.source,
                f"{name}.traction.{side}",
                list(force),
                "Gamma_c covers this side: a force there is lost",
            )
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
        poisson=float(spec.poisson),
        known=known,
        nodes=nodes,
        free=free,
        unknown=unknown,
        interface=interface[unknown],
        stiffness=matrix[free][:, free].tocsc(),
        gram_matrix=gram(mesh, float(problem.length))[free][:, free].tocsc(),
        load=right,
        motions=motions.reshape(known.known.size, motions.shape[2])[free],
    )

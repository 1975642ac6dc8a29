"""Gamma_c, where the surfaces of two bodies lie opposite each other, and the join of their grids there."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d import Line, Mesh, MeshError, Supports, facing, mortar, surface, trapezoid
from fem1d2d.mesh import Floats, Ints, place_of, undirected
from fem1d2d.trace import SAME, extent
from verification.interface.interface import Grid, Interface, Law, Support
from verification.problem.specification import Problem
from verification.problem.specs import BodySpec
from verification.registry import LAWS

#: Largest number of nodes of a transfer, whose matrix is dense: more would fill the memory.
MOST_NODES_APART = 2000

#: The largest slope of the contact body's line: its normals are taken as vertical.
STEEPEST = 0.02

#: The deepest overlap of the bodies as they are drawn, relative to the smaller height: strains stay small.
MOST_OVERLAP = 0.05

#: The part of an edge within which an end of the interval means a node: coordinates are printed with six digits.
SNAP = 1e-3

#: The largest radius of a kernel between two planes of symmetry, in lengths of Gamma_c: it has an image in each length.
FARTHEST = 1000

#: Body 1 lies below, body 2 above.
UPPER = (True, False)

#: Within this part of the smaller extent of the bodies a second part of a side that faces the other body could touch.
REACH = 0.1

#: How bodies that overlap come apart, and how sides that face each other in any direction are found.
APART = "; draw them apart, or set contact.gap (only with two bodies)"
CUT = "; contact.surface instead cuts whole sides to whole edges"
BY_NAME = "contact.surface names sides that face each other in any direction"

Ends = tuple[float, float]


def join(
    problem: Problem, meshes: list[Mesh | None], known: list[Supports | None], law: Law | None = None
) -> tuple[list[Ints], Interface]:
    """Find Gamma_c, the nodes of each body on it, and the transfer between their grids.

    Gamma_c begins and ends at nodes of the body that carries the contact grid.  The surface of the other body covers
    it: its outermost nodes may lie beyond.

    Parameters
    ----------
    meshes : list of Mesh or None
        Of body 1 and of body 2; None where rigid.
    known : list of Supports or None
        Of the same bodies.
    law : Law, optional
        A law of friction in place of the problem's.

    Returns
    -------
    list of int array
        Nodes from left to right, or in the direction of a named line; none on a rigid body.
    Interface

    Raises
    ------
    ProblemError
        Bodies that do not lie opposite each other or lie deep in each other, an interval outside the overlap or
        without nodes of the contact body at its ends, a surface with a hole, a steep contact body, too many nodes; a
        named line that is none, with a sharp corner, or that the other body does not face everywhere.
    """
    nodes, grids, P, gap = (_along_x if problem.contact.surface is None else _along_lines)(problem, meshes, known)
    contact, neumann = grids if problem.contact_body == 1 else grids[::-1]
    law = law or LAWS[problem.contact.law].of_file(problem.contact)
    support = _supported(known, nodes)[:: 1 if problem.contact_body == 1 else -1]
    interface = Interface.joining(contact, neumann, P, support, gap=gap, law=law, profile=problem.contact.profile)
    check_profile(problem, interface)
    radius, needed = problem.contact.radius, ""
    if radius and radius > FARTHEST * contact.s[-1] and interface.planes[0].sum() > 1:
        needed = f"needed at most {FARTHEST} times the length of Gamma_c between two planes of symmetry"
    elif P is not None and interface.contact_kernel is not None and not interface.contact_kernel.any():
        needed = "needed a larger one: it reaches no node of the Neumann grid from any contact node, so that S is 0"
    if needed:
        raise problem.refuse("contact.radius", radius, needed)
    return nodes, interface


#: Nodes and grids of both bodies, the transfer, and the gap.
Joined = tuple[list[Ints], list[Grid], Floats | None, Floats]


def _along_x(problem: Problem, meshes: list[Mesh | None], known: list[Supports | None]) -> Joined:
    """Join two surfaces over a part of the x axis, with vertical normals."""
    size = max(extent(mesh) for mesh in meshes if mesh is not None)
    contact = problem.contact_body - 1
    given = problem.contact.interval
    chosen = None if given is None else (float(given[0]), float(given[1]))
    nodes = _surfaces(problem, meshes, chosen)
    if problem.dimension == 2:
        if chosen is not None and (mesh := meshes[contact]) is not None:
            chosen = _snapped(chosen, np.unique(mesh.points[nodes[contact], 0].astype(float)))
            nodes = _surfaces(problem, meshes, chosen)
        ends = _ends(problem, meshes, nodes, size, chosen)
        if problem.contact.interval is None:
            nodes = _surfaces(problem, meshes, ends)
        _check_nodes(problem, meshes, nodes, ends, contact)
    points = [None if mesh is None else mesh.points[own].astype(float) for mesh, own in zip(meshes, nodes, strict=True)]
    if problem.dimension == 2:
        check_slopes(problem, points)
    levels = [
        p[:, -1] if p is not None else obstacle_level(spec, points[1 - i], upper=UPPER[i])
        for i, (spec, p) in enumerate(zip((problem.body1, problem.body2), points, strict=True))
    ]
    positions = [p[:, 0] for p in points if p is not None]
    # one grid has the positions of body 1, so that constants do not depend on the roles, to the last digit
    grids, P = [Grid.on(positions[0], problem.dimension)] * 2, None
    if problem.dimension == 2 and len(positions) == 2 and not _same(positions[0], positions[1], SAME * size):
        x, P, w = _transfer(problem, positions[contact], positions[1 - contact])
        grids = [Grid.on(positions[contact]), Grid(x=x, weights=w)]
        levels[1 - contact] = np.interp(grids[0].x, x, levels[1 - contact])  # of convex bodies never below 0
        grids = grids if contact == 0 else grids[::-1]
    at = grids[contact].x
    if problem.dimension == 2 and points[contact] is not None:
        own = points[contact]
        grids[contact] = replace(grids[contact], points=own)
        grids[1 - contact] = grids[1 - contact] if P is not None else grids[contact]
    gap = _gap(problem, levels[1] - levels[0], SAME * size)
    j = int(np.argmin(gap))
    height = min(float(np.ptp(mesh.points[:, -1].astype(float))) for mesh in meshes if mesh is not None)
    if gap[j] < -MOST_OVERLAP * height:
        axis, where = ("x", "") if problem.dimension == 1 else ("y", f"at x = {at[j]:g} ")
        low, high = (np.broadcast_to(level, at.shape)[j] for level in levels)
        needed = (
            f"the bodies overlap: {where}body 1 ends at {axis} = {low:g}, body 2 begins at {axis} ="
            f" {high:g}; needed an overlap of at most {100 * MOST_OVERLAP:g} % of the height {height:g}{APART}"
        )
        raise problem.refuse(f"body2.{axis}", None, needed)
    return nodes, grids, P, np.broadcast_to(gap, at.shape).copy()


def _transfer(problem: Problem, contact: Floats, neumann: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the positions of the Neumann grid, P, and its weights."""
    most = max(len(contact), len(neumann))
    if most > MOST_NODES_APART:
        needed = f"needed at most {MOST_NODES_APART} contact nodes on grids that differ, these are {most}"
        raise problem.refuse("contact", None, needed)
    return transferred(contact, neumann)


def transferred(contact: Any, neumann: Any) -> tuple[Any, Any, Any]:
    """Return the positions of the Neumann grid, P, and its weights, in numbers of any kind."""
    x = neumann.copy()
    x[0], x[-1] = min(x[0], contact[0]), max(x[-1], contact[-1])  # ends that differ by rounding
    P = mortar(contact, x)
    return x, P, P.T @ trapezoid(contact)


def _along_lines(problem: Problem, meshes: list[Mesh | None], known: list[Supports | None]) -> Joined:
    """Join two named sides of any shape along the contact body's line and its normals.

    Body 2 lies on the left of the direction of s, so that the normals lead from body 1 to body 2.
    """
    sides, parts = problem.contact.surface, []
    assert sides is not None
    refuse = lambda needed: problem.refuse("contact.surface", list(sides), needed)
    drawn = []
    for i, (side, mesh, spec) in enumerate(zip(sides, meshes, (problem.body1, problem.body2), strict=True)):
        if mesh is not None and side not in mesh.sides:
            raise refuse(f"body {i + 1} has no side {side!r}; {mesh.lacks(side)}")
        drawn.append(np.array(spec.face) if mesh is None else mesh.points[np.unique(mesh.sides[side])].astype(float))
    for i, (side, mesh, held, away) in enumerate(zip(sides, meshes, known, drawn[::-1], strict=True)):
        if mesh is None:  # the body lies on either side of the line, to be seen from the other body
            parts.append(Line.through(drawn[i], away=away) + Line.through(drawn[i][::-1], away=away))
        else:
            assert held is not None
            parts.append(Line.parts(mesh, side, left=i == 1, mirrored=held.held, away=away))
    contact = problem.contact_body - 1
    height = min(float(np.ptp(mesh.points.astype(float), axis=0).min()) for mesh in meshes if mesh is not None)
    try:
        line, own, other = facing_parts(parts[contact], parts[1 - contact], sides[contact], REACH * height)
    except MeshError as error:
        needed = f"side {sides[1 - contact]!r} of body {2 - contact} {error}, of {sides[contact]!r}"
        remedy = "name other sides or parts"
        if meshes[1 - contact] is not None:
            with suppress(MeshError):
                facing_parts(parts[1 - contact], parts[contact], sides[1 - contact], REACH * height)
                remedy = f"it is found with exchanged roles: let body {contact + 1} have the Neumann problem"
        raise refuse(f"{needed}: Gamma_c is the one part of the contact body's side that it faces; {remedy}") from None
    line = _between_supports(line, other, known, contact)
    lines = [own, other] if contact == 0 else [other, own]
    seen = line.seen_from(other)
    within, kept = line.slack, seen.reaches
    s, nodes = seen.s[kept], [line.nodes, other.nodes[kept]]
    P = None
    normals, grid_of = line.normals_at(s), lambda of: replace(Grid.on(of.s), points=of.points, normals=of.normals)
    if meshes[1 - contact] is None:
        nodes[1] = np.empty(0, dtype=np.int64)
        grids = [grid_of(line)] * 2
    elif _same(line.s, s, within):
        # one line for both roles, so that constants have the same digits in both
        alike = bool(kept.all()) and line.alike(own) and own.alike(other)
        own = lines[0] if alike else line
        grids = [grid_of(own)] * 2
    else:
        x, P, w = _transfer(problem, line.s, s)
        grids = [grid_of(line), Grid(x=x, weights=w, points=other.points[kept], normals=normals)]
    if all(
        np.array_equal(grid.upright, [(0.0, 1.0)] * grid.n) for grid in grids
    ):  # upright: the components are those along x and y
        grids = [replace(grid, normals=None) for grid in grids]
    gap = _gap(problem, (1 - 2 * contact) * seen.gap, within)
    j = int(np.argmin(gap))
    if gap[j] < -MOST_OVERLAP * height:
        depth = f"by {-gap[j]:.4g} at {place_of(line.points[j])}"
        needed = f"needed an overlap of at most {100 * MOST_OVERLAP:g} % of the smaller extent {height:g}{APART}"
        raise refuse(f"the bodies overlap {depth}: {needed}")
    return nodes if contact == 0 else nodes[::-1], grids if contact == 0 else grids[::-1], P, gap


def held_normals(held: Supports | None, nodes: Ints, normals: Floats) -> NDArray[np.bool_]:
    """Return True for the nodes whose normal component, or a part of it, a support holds."""
    return np.zeros(len(nodes), bool) if held is None else np.asarray((held.held[nodes] & (normals != 0)).any(axis=1))


def _between_supports(line: Line, other: Line, known: list[Supports | None], contact: int) -> Line:
    """Cut off the ends of Gamma_c that lie apart where a support holds a normal of the contact body, or opposite."""
    seen = line.seen_from(other)
    opposite = np.interp(line.s, seen.s, held_normals(known[1 - contact], other.nodes, line.normals_at(seen.s)))
    held = held_normals(known[contact], line.nodes, line.normals) | (opposite > SAME)
    free = np.flatnonzero(~held | ((1 - 2 * contact) * seen.gap <= line.slack))
    return line.part(slice(free[0], free[-1] + 1)) if len(free) > 1 else line


def facing_parts(own: list[Line], others: list[Line], side: str, reach: float) -> tuple[Line, Line, Line]:
    """Find the part of one side that another side faces: Gamma_c with normals between both, and the two parts.

    Of several parts that face each other it is the nearest one; within ``reach`` there must be no second one.

    Raises
    ------
    MeshError
        None of them faces another one, or a second one is near.
    """
    found: list[tuple[float, Line, Line, Line]] = []
    why: list[MeshError] = []
    for one, other in product(own, others):
        try:
            line = one.facing(other)
            found.append((float(np.abs(line.seen_from(other).gap).min()), line, one, other))
        except MeshError as error:
            closed = all(each.nodes[0] == each.nodes[-1] for each in (one, other))
            why.append(MeshError(f"{error}; both lines are closed: needed parts with two ends") if closed else error)
    if not found:
        raise why[0] if len(why) == 1 else MeshError("has no part that faces one as a whole edge")
    found.sort(key=lambda pair: pair[0])
    (_, line, one, other), near = found[0], [pair for pair in found[1:] if pair[0] <= reach]
    for _, _, second, _ in near:
        for before, after in ((one, second), (second, one)):
            if before.nodes[-1] == after.nodes[0]:
                raise MeshError(f"faces both sides of a corner: {before.corner(after, side)}")
        raise MeshError(f"faces another part too, near {place_of(second.points[len(second.points) // 2])}")
    if line.nodes[0] == line.nodes[-1]:
        raise MeshError("faces all of a closed line: needed parts with two ends")
    return line, one, other


def check_profile(problem: Problem, interface: Interface) -> None:
    """Refuse a table of the coefficient of friction that ends before Gamma_c does."""
    profile, length = interface.profile, float(interface.contact.s[-1])
    if profile is not None and float(profile.s[-1]) < length * (1 - SAME):
        needed = f"needed distances up to the length of Gamma_c, {length:g}"
        raise problem.refuse("contact.friction.s", list(profile.s), needed)


def _supported(known: list[Supports | None], nodes: list[Ints]) -> list[Support]:
    """Find what supports hold of the contact nodes: only tangential components, as normal ones are refused."""
    found: list[Support] = []
    for body, own in zip(known, nodes, strict=True):
        held, moved = (None, None) if body is None else (np.any(part[own], axis=1) for part in (body.held, body.values))
        found.append(None if held is None or moved is None else (held, held & ~moved))
    return found


def _surfaces(problem: Problem, meshes: list[Mesh | None], ends: Ends | None) -> list[Ints]:
    """Find the nodes of both surfaces, or those whose hat functions reach between two positions."""
    nodes = []
    for mesh, upper in zip(meshes, UPPER, strict=True):
        try:
            if mesh is None:
                nodes.append(np.empty(0, dtype=np.int64))
            elif ends is not None and problem.contact.interval is not None:  # only then may it be curved
                nodes.append(facing(mesh, upper=upper, ends=ends))
            else:
                nodes.append(surface(mesh, upper=upper, ends=ends))
        except MeshError as error:
            needed = f"{error}; needed the part of the x axis where they meet, or else {BY_NAME}"
            raise problem.refuse("contact.interval", None, needed) from None
    return nodes


def _snapped(ends: Ends, x: Floats) -> Ends:
    """Return the ends of an interval, each moved to the node that lies within SNAP of an edge from it, if any."""
    found = list(ends)
    for i, end in enumerate(ends):
        near = int(np.argmin(np.abs(x - end))) if len(x) > 1 else 0
        edges = np.abs(np.diff(x[max(near - 1, 0) : near + 2]))
        if len(edges) and abs(x[near] - end) <= SNAP * edges.min():
            found[i] = float(x[near])
    return found[0], found[1]


def _ends(problem: Problem, meshes: list[Mesh | None], nodes: list[Ints], size: float, chosen: Ends | None) -> Ends:
    """Return the ends of Gamma_c: ``chosen``, as the problem gives them, or of the part where both have a surface."""
    reach = []
    for spec, mesh, own in zip((problem.body1, problem.body2), meshes, nodes, strict=True):
        if mesh is not None:  # a chosen part may be curved: the whole body counts then
            x = mesh.points[own if chosen is None else slice(None), 0].astype(float)
            reach.append((float(x.min()), float(x.max())))
        else:  # an obstacle without x is endless
            reach.append((-np.inf, np.inf) if spec.x is None else (float(spec.x[0]), float(spec.x[1])))
    overlap = (max(low for low, _ in reach), min(high for _, high in reach))
    if not overlap[1] - overlap[0] > SAME * size:
        covers = ", ".join(f"body {i} covers x = {low:g} to {high:g}" for i, (low, high) in enumerate(reach, 1))
        raise problem.refuse("body2.x", None, f"the bodies do not meet: {covers}; {BY_NAME}")
    if chosen is None:
        return overlap
    if chosen[0] < overlap[0] - SAME * size or chosen[1] > overlap[1] + SAME * size:
        needed = f"needed an interval inside the overlap [{overlap[0]:g}, {overlap[1]:g}]"
        raise problem.refuse("contact.interval", list(problem.contact.interval or ()), needed)
    return chosen


def _check_nodes(problem: Problem, meshes: list[Mesh | None], nodes: list[Ints], ends: Ends, contact: int) -> None:
    """Refuse a Gamma_c that does not begin and end at nodes of the contact body, a surface with a hole, and none."""
    given = None if problem.contact.interval is None else list(problem.contact.interval)
    fits = [False, False]
    for i, (mesh, own) in enumerate(zip(meshes, nodes, strict=True)):
        if mesh is None:
            continue
        if not len(own):  # all edges of the surface are steep, or short against the extent of the mesh
            needed = f"body {i + 1} has no surface that faces the other body from x = {ends[0]:g} to {ends[1]:g}"
            raise problem.refuse("contact.interval", given, needed)
        x = mesh.points[own, 0].astype(float)
        off = SAME * extent(mesh)
        fits[i] = bool(len(x) > 1 and abs(x[0] - ends[0]) <= off and abs(x[-1] - ends[1]) <= off)
        between, of = np.column_stack([own[:-1], own[1:]]), len(mesh.points)
        holes = np.flatnonzero(~np.isin(undirected(between, of), undirected(mesh.boundary, of)))
        if len(holes):
            where = f"between x = {x[holes[0]]:g} and {x[holes[0] + 1]:g}"
            needed = f"body {i + 1} has no surface {where}: needed a Gamma_c of one piece"
            raise problem.refuse("contact.interval", given, needed)
    if not fits[contact]:
        mesh = meshes[contact]
        assert mesh is not None
        x = np.unique(mesh.points[nodes[contact], 0].astype(float))
        near = ", ".join(f"{value:g}" for value in (x if len(x) < 4 else x[[0, 1, -2, -1]]))
        swap = f"; body {2 - contact} has them: let body {contact + 1} have the Neumann problem"
        other = meshes[1 - contact]
        possible = fits[1 - contact] and other is not None and _flat(other.points[nodes[1 - contact]])
        needed = (
            f"Gamma_c = [{ends[0]:g}, {ends[1]:g}] must begin and end at nodes of the contact body, body {contact + 1},"
            f" whose nodes near its ends lie at {near or 'no x'}{swap if possible else CUT}"
        )
        raise problem.refuse("contact.interval", given, needed)


def obstacle_level(spec: BodySpec, other: Floats | None, *, upper: bool) -> Floats:
    """Return the level of the face of an obstacle; without coordinates it touches the other body."""
    assert other is not None
    ends = spec.x if other.shape[1] == 1 else spec.y
    if ends is not None:
        return np.array(float(ends[1] if upper else ends[0]))
    return np.array(other[:, -1].min() if upper else other[:, -1].max())


def width_at(x: Floats, at: float) -> float:
    """Return the longest edge beside the node of a grid that is nearest to a position; 0 of a single node."""
    near = int(np.argmin(np.abs(x - at)))
    return float(np.abs(np.diff(x[max(near - 1, 0) : near + 2])).max(initial=0.0))


def obstacle_edges(spec: BodySpec, size: float, grid: Grid, *, upper: bool) -> tuple[Floats, Floats]:
    """Return the ends of the edges around an obstacle that is a line or an arc, with the obstacle on their left.

    It is as deep as ``size``, or as the circle inside which it lies.  ``upper`` as of :func:`obstacle_level`.
    """
    face, at = np.array(spec.face), grid.points
    assert at is not None
    steps = np.gradient(face, axis=0)
    behind = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / np.linalg.norm(steps, axis=1)[:, None]
    middle = len(at) // 2
    near = int(np.argmin(np.linalg.norm(face - at[middle], axis=1)))
    if behind[near] @ grid.upright[middle] * (-1 if upper else 1) < 0:
        face, behind = face[::-1], -behind[::-1]
    inside = spec.circle is not None and behind[0] @ (face[0] - np.array(spec.circle.centre, dtype=float)) < 0
    deep = min(size, (1 - SAME) * float(spec.circle.radius)) if spec.circle and inside else size
    around = np.vstack([face, (face + deep * behind)[::-1], face[:1]])
    return around[:-1], around[1:]


def check_slopes(problem: Problem, points: Sequence[Floats | None]) -> None:
    """Refuse a contact body whose line is steep along Gamma_c: its normals are taken as vertical.

    Parameters
    ----------
    points : pair of array, shape (n, 2), or None
        Contact nodes of body 1 and of body 2, from left to right; None where rigid.  The face of an obstacle is flat,
        and gives the body opposite its normals.
    """
    contact = problem.contact_body
    own, other = points[contact - 1], points[2 - contact]
    if own is None or other is None or _flat(own):
        return
    rise = _slopes(own)
    j = int(np.argmax(np.abs(rise)))
    remedy = f"body {3 - contact} is steep too: name both sides by contact.surface, which takes lines of any shape"
    if _flat(other):
        remedy = f"body {3 - contact} is flat: give body {contact} the Neumann problem"
        remedy += f" (iteration.neumann_body = {contact})"
    raise problem.refuse(
        f"body{contact}.mesh",
        None,
        f"body {contact} is the contact body, and its line has the slope {rise[j]:.3g} from {place_of(own[j])}"
        f" to {place_of(own[j + 1])}; needed at most {STEEPEST:g} along Gamma_c, where its normals are taken as"
        f" vertical; {remedy}",
    )


def _slopes(points: Floats) -> Floats:
    """Return the slopes of a line between its nodes, which follow each other from left to right."""
    dx, dy = np.diff(points.astype(float), axis=0).T
    return np.asarray(dy / dx)


def _flat(points: Floats) -> bool:
    """Return True if a line is flat enough for vertical normals."""
    return bool(np.abs(_slopes(points)).max() <= STEEPEST + SAME)


def _gap(problem: Problem, distance: Floats, rounding: float) -> Floats:
    """Return the initial distance at the contact nodes: of the surfaces as they are drawn, plus ``contact.gap``.

    It is negative where the bodies are drawn into each other.  Flat bodies have one distance: a value that differs
    from the least one by rounding is set to it, and one that differs from 0 by rounding is set to 0.
    """
    least = float(distance.min())
    least = 0.0 if abs(least) <= rounding else least
    return np.asarray(np.where(np.abs(distance - least) <= rounding, least, distance) + float(problem.contact.gap))


def _same(one: Floats, other: Floats, within: float) -> bool:
    return len(one) == len(other) and np.allclose(one, other, rtol=0, atol=within)

"""Bodies as mesh files draw them, and the lines of their surfaces that may touch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem1d2d import Line, Mesh, MeshError, mesh_files, pieces
from fem1d2d.mesh import Cells, Floats, Ints, measures, undirected, where
from fem1d2d.trace import SAME
from ndtheory.keys import Part, key, says
from verification.interface.joining import MOST_OVERLAP, facing_parts, width_at
from verification.problem.colours import OddRing, colours

#: Lines may touch whose least distance is at most this part of the smaller extent of their bodies.
NEAR = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn(Part):
    """A body of a mesh file; ``planes`` are those for which elements of the file are made."""

    path: Path = key("the mesh file")
    group: tuple[str, ...] = key("the named surfaces that make it; empty where it is the whole file")
    materials: tuple[str, ...] = key("the named surfaces of several materials; empty where it is of one")
    planes: frozenset[str]
    mesh: Mesh

    @property
    @says("names of its sides")
    def sides(self) -> tuple[str, ...]:
        return tuple(self.mesh.sides)

    @property
    @says("number of its triangles")
    def cells(self) -> int:
        return len(self.mesh.cells)

    @property
    def size(self) -> float:
        """The smaller extent, unit of length."""
        return float(np.ptp(self.mesh.points, axis=0).min())

    @property
    def place(self) -> tuple[float, float]:
        """The place in an order from below; bodies of one height are ordered from the left."""
        areas = measures(self.mesh.points, self.mesh.cells)
        x, y = areas @ self.mesh.points[self.mesh.cells].mean(axis=1) / areas.sum()
        return round(float(y) / self.size, 6), float(x)

    def lines(self, away: Floats, *, left: bool) -> dict[str, list[Line]]:
        """Return the lines of its boundary in the direction that has it on the left, or on the right.

        They are sides, by their names, and the parts of the boundary without a name, by their ends; ``away`` as of
        :meth:`fem1d2d.Line.parts`.
        """
        rows = self.mesh.boundary, np.vstack([self.mesh.boundary[:0], *self.mesh.sides.values()])
        outer, named = (undirected(edges, len(self.mesh.points)) for edges in rows)
        bare = replace(self.mesh, sides={"": self.mesh.boundary[~np.isin(outer, named)]})
        found = {side: Line.parts(self.mesh, side, left=left, away=away) for side in self.mesh.sides}
        for line in Line.parts(bare, "", left=left, away=away):
            found[where(line.points, np.array([0, -1]))] = [line]
        return found


def bodies_of(path: Path, *, one: bool) -> list[Drawn]:
    """Find the bodies of a mesh file: its pieces, or all of it where they are ``one`` body.

    Raises
    ------
    MeshError
        As :func:`fem1d2d.from_file`, and for several pieces that named surfaces do not separate.
    """
    try:
        read = mesh_files.contents(path)
        piece = pieces(Cells(points=read.points, cells=read.triangles)) * (not one)
        read = read if one else mesh_files.with_pieces(read)
        groups = [_surfaces(read.surfaces, piece == k) for k in range(int(piece.max()) + 1)]
        if (several := len(groups) > 1) and not all(whole or parts for whole, parts in groups):
            needed = "needed a physical surface (in Abaqus an element set) for each body"
            why = "pieces of it share no edge, and some lie in no named surface"
            raise MeshError(f"{needed}: {len(groups)} {why}")
        if read.split and not several and not groups[0][1]:
            raise MeshError(read.split)
        bodies = [(parts or whole if several else parts, parts) for whole, parts in groups]
        meshes = [mesh_files.part_of(read, group) for group, _ in bodies]
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    planes = frozenset(read.plane)
    return [
        Drawn(path=path, group=group, materials=parts, planes=planes, mesh=mesh)
        for (group, parts), mesh in zip(bodies, meshes, strict=True)
    ]


def _surfaces(surfaces: Mapping[str, Ints], free: NDArray[np.bool_]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Find the named surface that is a piece, and several that make it together."""
    count, chosen = int(free.sum()), set()
    inside = {name: np.unique(members) for name, members in surfaces.items() if free[members].all()}
    whole = [name for name, members in inside.items() if len(members) == count]
    for name in sorted(inside.keys() - {*whole}, key=lambda name: (-len(inside[name]), name)):
        if free[inside[name]].all():  # no other one has a part of it
            free[inside[name]] = False
            chosen.add(name)
    return tuple(whole[:1]), () if free.any() else tuple(name for name in inside if name in chosen)


@dataclass(frozen=True, kw_only=True, eq=False)
class Touch(Part):
    """Two lines that may touch; ``normal`` is the mean one, from the first body to the second.

    ``nodes`` has the nodes of each body there, ``length`` is the length of the contact, ``width`` its longest edge
    where the bodies are nearest.
    """

    bodies: tuple[int, int] = key("numbers of two bodies")
    surface: tuple[str, str] = key("the side of each")
    gap: float = key("the least distance along the normals", unit="length")
    contact: int = key("the body of the two with the contact grid")
    normal: Floats
    nodes: tuple[Ints, Ints]
    length: float
    width: float

    def overlap(self, other: Touch) -> float:
        """Return the largest part of its nodes of a body that another one has too."""
        each = product(zip(self.bodies, self.nodes, strict=True), zip(other.bodies, other.nodes, strict=True))
        return max((float(np.isin(own, nodes).mean()) for (i, own), (j, nodes) in each if i == j), default=0.0)


def touching(bodies: Sequence[Drawn]) -> tuple[list[Touch], list[Touch]]:
    """Choose the contacts of bodies, which are numbered from 1: named sides that face each other, the nearest first.

    No two contacts share a node, and no odd number of bodies touches in a ring.  The second list has lines that are no
    contact for one of these reasons, and the nearest lines of two bodies that have none for want of a name.
    """
    found = [touch for i, j in combinations(range(1, len(bodies) + 1), 2) for touch in _facing(bodies, (i, j))]
    found.sort(key=lambda touch: (max(touch.gap, 0.0), -touch.length))
    chosen: list[Touch] = []
    left_out: list[Touch] = []
    for touch in found:
        covered = max((touch.overlap(other) for other in chosen), default=0.0)
        if covered < 1 and all(
            side in bodies[i - 1].sides for i, side in zip(touch.bodies, touch.surface, strict=True)
        ):
            try:
                colours([each.bodies for each in (*chosen, touch)])
                (left_out if covered else chosen).append(touch)
            except OddRing:
                left_out.append(touch)
    for touch in found:
        if all(touch.bodies != other.bodies for other in (*chosen, *left_out)):
            left_out.append(touch)
    return chosen, left_out


def _facing(bodies: Sequence[Drawn], pair: tuple[int, int]) -> Iterator[Touch]:
    """Yield the lines of two bodies that face each other nearby."""
    one, other = (bodies[i - 1] for i in pair)
    size = min(one.size, other.size)
    firsts, seconds = one.lines(other.mesh.points, left=False), other.lines(one.mesh.points, left=True)
    for surface in product(firsts, seconds):
        lines = firsts[surface[0]], seconds[surface[1]]
        boxes = [np.concatenate([line.points for line in of]) for of in lines]
        (low, high), (bottom, top) = ((points.min(axis=0), points.max(axis=0)) for points in boxes)
        apart = np.maximum(low, bottom) - np.minimum(high, top)
        near = np.linalg.norm(np.maximum(apart, 0.0)) <= NEAR * size
        # of two, the body with shorter edges along the contact gets its grid; of more the colours give the roles
        edges = [float(np.median(np.concatenate([np.diff(line.s) for line in of]))) for of in lines]
        order = (1, 2) if len(bodies) != 2 or edges[0] <= edges[1] * (1 + SAME) else (2, 1)
        for contact in order if near else ():
            with suppress(MeshError):
                touch = _touch(pair, surface, lines, contact, NEAR * size)
                if -MOST_OVERLAP * size <= touch.gap <= NEAR * size:
                    yield touch
                    break


def _touch(
    pair: tuple[int, int], surface: tuple[str, str], lines: tuple[list[Line], list[Line]], contact: int, reach: float
) -> Touch:
    """Join two sides on the grid of one; MeshError where they do not face each other."""
    step = 1 if contact == 1 else -1
    line, _, other = facing_parts(lines[contact - 1], lines[2 - contact], surface[contact - 1], reach)
    seen = line.seen_from(other)
    nearest = line.s[int(np.argmin(step * seen.gap))]
    nodes = line.nodes, other.nodes[seen.reaches]
    return Touch(
        bodies=pair,
        surface=surface,
        gap=float((step * seen.gap).min()),
        contact=pair[contact - 1],
        normal=line.normals.mean(axis=0),
        nodes=nodes if contact == 1 else (nodes[1], nodes[0]),
        length=float(line.s[-1]),
        width=max(width_at(line.s, nearest), width_at(seen.s, nearest)),
    )

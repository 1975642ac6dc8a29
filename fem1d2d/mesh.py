"""Meshes of intervals, triangles and convex polygons with named sides."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fem1d2d import outline
from fem1d2d.outline import Bools as Bools
from fem1d2d.outline import Floats as Floats
from fem1d2d.outline import Ints as Ints


class MeshError(ValueError):
    """A mesh that cannot be used; the message says what was needed and what was received."""


#: Coordinates are not larger than this: beyond, products of a few overflow a double.
LARGEST = 1e30

#: Lengths and square roots of areas of cells are not smaller than this: squares of their reciprocals fit a double.
SMALLEST = 1e-40


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Cells:
    """The part of a mesh that element matrices need: ``points`` of shape (n, d), and ``cells``, the nodes of each."""

    points: NDArray[Any]
    cells: Ints

    @property
    def dimension(self) -> int:
        """1 or 2."""
        return int(self.points.shape[1])


@dataclass(frozen=True, kw_only=True, repr=False)
class Mesh(Cells):
    """A mesh of intervals or convex polygons of one kind, whose cells meet only in common facets.

    It may have holes, and pieces that share only single nodes or nothing.

    Parameters
    ----------
    points : array, shape (n, d)
        Coordinates in the file's unit of length; floats, or rationals in an object array.
    cells : int array, shape (c, k)
        Corners of each cell, anticlockwise in 2D; k = 2 in 1D, 3 or more in 2D.
    sides : mapping from name to int array, shape (s, d)
        Boundary facets of each named side: end points in 1D, edges in 2D, each listed once.
    surfaces : mapping from name to int array, shape (m,)
        Numbers of the cells of each named surface; those of two surfaces may be the same.
    cut : str
        Cells of a file that were cut into these, in words.
    shares : mapping from text to bool
        The named surfaces of a file of which it takes a group, by names such as ``wing of both.msh``: True if it has
        cells of them.
    off : mapping from name to str
        Where, in words, the named lines of a file are that are neither edges of the boundary nor sides.
    centres : int array, shape (q,)
        Nodes in the middle of quadrilaterals that were split by both diagonals.

    Attributes
    ----------
    boundary : int array, shape (b, d)
        Facets that belong to one cell only; in 2D the body lies to the left of each.

    Raises
    ------
    MeshError
        Indices of cells or sides out of range, a cell of negative measure, zero or nearly so, a node that no cell uses,
        cells that lie on each other or touch without being joined, a side with a facet inside the body or listed twice.
    """

    sides: Mapping[str, Ints]
    surfaces: Mapping[str, Ints] = field(default_factory=dict)
    cut: str = ""
    shares: Mapping[str, bool] = field(default_factory=dict)
    off: Mapping[str, str] = field(default_factory=dict)
    centres: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    boundary: Ints = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = np.array(self.points)
        if points.ndim != 2 or points.shape[1] not in (1, 2):
            raise MeshError(f"points of shape {points.shape}: (n, 1) or (n, 2) is needed")
        if points.dtype.kind not in "iufO":
            raise MeshError(f"points hold {points.dtype} values: numbers are needed")
        if points.dtype != object:
            points = points.astype(float)
            if not np.isfinite(points).all():
                raise MeshError("a coordinate is not finite")
            if not (np.abs(points) <= LARGEST).all():
                raise MeshError(f"a coordinate is {np.abs(points).max():g}: at most {LARGEST:g} is needed")
        corners = np.shape(self.cells)[1:2] if points.shape[1] == 2 else ()
        cells = _whole("cells", self.cells, max((points.shape[1] + 1, *corners)))
        if len(cells) == 0:
            raise MeshError(f"cells of shape {cells.shape}: (c, {points.shape[1] + 1}) with c >= 1 is needed")
        sides = {name: _whole(f"side {name!r}", facets, points.shape[1]) for name, facets in self.sides.items()}
        for what, named in (("cells", cells), *((f"side {name!r}", facets) for name, facets in sides.items())):
            outside = named[(named < 0) | (named >= len(points))]
            if len(outside):
                raise MeshError(f"{what} name node {outside[0]}, the mesh has {len(points)} nodes")
        sizes, size, least = measures(points, cells), "length", SMALLEST
        if points.shape[1] == 2:
            size, least = "area", SMALLEST**2
        if not (sizes > 0).all():
            raise MeshError(f"cell {int(np.argmin(sizes > 0))} has no positive {size}")
        if not (sizes >= least).all():
            cell = int(np.argmin(sizes))
            raise MeshError(f"cell {cell} has the {size} {float(sizes[cell]):.2g}: at least {least:.2g} is needed")
        if cells.shape[1] > 3:
            convex = np.all([measures(points, np.roll(cells, i, axis=1)[:, :3]) > 0 for i in range(cells.shape[1])], 0)
            if not convex.all():
                raise MeshError(f"cell {int(np.argmin(convex))} is not convex")
        loose = int((np.bincount(cells.ravel(), minlength=len(points)) == 0).sum())
        if loose:
            raise MeshError(f"{loose} nodes belong to no cell")
        boundary = _boundary(points, cells)
        why = outline.fault(points, boundary) if points.shape[1] == 2 else _line_fault(points, cells)
        if why:
            raise MeshError(why)
        on_boundary = undirected(boundary, len(points))
        for name, facets in sides.items():
            named = undirected(facets, len(points))
            wrong = ~np.isin(named, on_boundary)
            if wrong.any():
                inside = where(points, facets[int(np.argmax(wrong))])
                raise MeshError(f"side {name!r} has a facet {inside}, which is none of the boundary")
            _, first, count = np.unique(named, return_index=True, return_counts=True)
            if (count > 1).any():
                twice = where(points, facets[first[np.argmax(count > 1)]])
                raise MeshError(f"side {name!r} lists the facet {twice} {count.max()} times: once is needed")
        surfaces = {name: np.array(members, dtype=np.int64) for name, members in self.surfaces.items()}
        centres = np.array(self.centres, dtype=np.int64)
        for array in (points, cells, boundary, centres, *sides.values(), *surfaces.values()):
            array.setflags(write=False)
        kept: dict[str, Any] = {"points": points, "cells": cells, "boundary": boundary, "centres": centres}
        kept |= {"sides": MappingProxyType(sides), "surfaces": MappingProxyType(surfaces)}
        for name, value in kept.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<Mesh: {len(self.points)} nodes, {len(self.cells)} cells, sides {', '.join(self.sides) or 'none'}>"

    def __reduce__(self) -> tuple[Any, ...]:  # a read-only mapping cannot be pickled, and numpy returns writable arrays
        whole: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self) if field.init}
        return partial(Mesh, **whole | {name: dict(whole[name]) for name in ("sides", "surfaces", "shares", "off")}), ()

    def along(self, side: str) -> Ints:
        """Return the facets of a named side as the boundary has them, with the mesh on the left of an edge."""
        on_boundary, on_side = (undirected(each, len(self.points)) for each in (self.boundary, self.sides[side]))
        return self.boundary[np.isin(on_boundary, on_side)]

    def lacks(self, side: str) -> str:
        """Why it has no side of that name: where such a line of the file lies, else the names of its sides."""
        return self.off.get(side, f"its sides: {', '.join(self.sides)}")

    @property
    def quadrilaterals(self) -> tuple[Ints, Ints]:
        """The four cells around each centre, and the corners of the quadrilateral that they are, each shape (q, 4).

        Corners follow each other anticlockwise.

        Examples
        --------
        >>> rectangle((0.0, 2.0), (0.0, 1.0), (2, 1), "both").quadrilaterals[1].tolist()
        [[0, 2, 3, 1], [2, 4, 5, 3]]
        """
        if not len(self.centres):
            return (np.empty((0, 4), dtype=np.int64),) * 2
        place = np.full(len(self.points), -1)
        place[self.centres] = np.arange(len(self.centres))
        cell, corner = np.nonzero(place[self.cells] >= 0)
        around = cell[np.argsort(place[self.cells[cell, corner]], kind="stable")].reshape(-1, 4)
        apex = np.argmax(place[self.cells[around]] >= 0, axis=2)
        starts = np.take_along_axis(self.cells[around], ((apex + 1) % 3)[..., None], axis=2)[..., 0]
        spokes = (self.points[starts] - self.points[self.centres][:, None]).astype(float)
        turn = np.argsort(np.angle(spokes @ [1, 1j]), axis=1, kind="stable")
        return around, np.take_along_axis(starts, turn, axis=1)

    def split(self, names: Sequence[str]) -> Ints:
        """Return which of these surfaces each cell lies in, shape (c,).

        MeshError for an unknown surface, and unless each cell lies in one of them.

        Examples
        --------
        >>> mesh = interval((0.0, 1.0), 3)
        >>> surfaces = {"rubber": [0], "steel": [1, 2]}
        >>> Mesh(points=mesh.points, cells=mesh.cells, sides={}, surfaces=surfaces).split(["steel", "rubber"])
        array([1, 0, 0])
        """
        which = np.full(len(self.cells), -1)
        for i, name in enumerate(names):
            if name not in self.surfaces:
                raise MeshError(f"no surface {name!r}; named surfaces: {', '.join(self.surfaces) or 'none'}")
            members = self.surfaces[name]
            if (which[members] >= 0).any():
                other = names[which[members].max()]
                raise MeshError(f"surfaces {other!r} and {name!r} have a cell in common: each cell is needed in one")
            which[members] = i
        if (which < 0).any():
            left = int((which < 0).sum())
            raise MeshError(f"{left} of {len(which)} cells lie in none of the surfaces {', '.join(names)}")
        return which


def shared(meshes: Iterable[Mesh]) -> dict[str, bool]:
    """The named surfaces of the files from which meshes take groups: True where one of them has cells of it."""
    found: dict[str, bool] = {}
    for mesh in meshes:
        found |= {name: has or found.get(name, False) for name, has in mesh.shares.items()}
    return found


def _whole(what: str, values: Any, columns: int) -> Ints:
    """Node numbers, shape (n, columns)."""
    array = np.array(values)
    if array.shape == (0,):
        array = array.reshape(0, columns)
    if array.ndim != 2 or array.shape[1] != columns:
        least = " with c >= 1" if what == "cells" else ""
        raise MeshError(f"{what} of shape {array.shape}: ({what[0]}, {columns}){least} is needed")
    if len(array) and array.dtype.kind not in "iu":
        raise MeshError(f"{what} hold {array.dtype} numbers: whole ones are needed")
    return array.astype(np.int64)


def place_of(point: Iterable[Any]) -> str:
    """A point, for a message."""
    return f"({', '.join(f'{float(c):g}' for c in point)})"


def where(points: NDArray[Any], facet: Ints) -> str:
    """Place of a facet, for a message."""
    ends = [place_of(points[node]) for node in facet]
    return f"at {ends[0]}" if len(ends) == 1 else f"from {ends[0]} to {ends[1]}"


def undirected(facets: Ints, nodes: int) -> Ints:
    """One number for each facet, the same for both directions."""
    facets = np.asarray(facets, dtype=np.int64)  # files have smaller integers, whose products overflow
    return np.asarray(facets.min(axis=1) * nodes + facets.max(axis=1) if facets.shape[1] == 2 else facets[:, 0])


def _boundary(points: NDArray[Any], cells: Ints) -> Ints:
    """Facets that belong to one cell only, in order of their nodes; two cells on the same side of one are refused."""
    n = len(points)
    if points.shape[1] == 1:  # a node is the end of one cell and the beginning of another
        facets = np.concatenate([cells[:, 1:], cells[:, :1]])
        forwards = np.repeat([1, 0], len(cells))
    else:
        facets = edges(cells)
        forwards = (facets[:, 0] < facets[:, 1]).astype(np.int64)
    numbers = 2 * undirected(facets, n) + forwards
    directed = np.sort(numbers)
    if (directed[1:] == directed[:-1]).any():
        _, inverse, count = np.unique(numbers, return_inverse=True, return_counts=True)
        facet = int(np.argmax((count > 1)[inverse]))
        one, other = np.flatnonzero(inverse == inverse[facet])[:2] % len(cells)
        if set(cells[one].tolist()) == set(cells[other].tolist()):
            raise MeshError(f"cells {one} and {other} have the same nodes: each cell is needed once")
        raise MeshError(f"cells {one} and {other} lie on the same side of the facet {where(points, facets[facet])}")
    either = directed // 2
    alone = np.ones(len(either), dtype=bool)
    alone[1:] &= either[1:] != either[:-1]
    alone[:-1] &= either[1:] != either[:-1]
    either, forwards = either[alone], directed[alone] % 2
    if points.shape[1] == 1:
        return np.asarray(either[:, None])
    low, high = either // n, either % n
    return np.column_stack([np.where(forwards, low, high), np.where(forwards, high, low)])


def _line_fault(points: NDArray[Any], cells: Ints) -> str | None:
    """The reason why cells of a line lie on each other or are not joined, or None."""
    order = np.argsort(points[cells[:, 0], 0], kind="stable")
    ends, starts = cells[order[:-1], 1], cells[order[1:], 0]
    wrong = (points[ends, 0] > points[starts, 0]) | ((points[ends, 0] == points[starts, 0]) & (ends != starts))
    if not wrong.any():
        return None
    k = int(np.argmax(wrong))
    return f"cells {order[k]} and {order[k + 1]} lie on each other or touch without a common node"


def edges(cells: Ints) -> Ints:
    """The edges of plane cells, each with its cell to the left, shape (k c, 2): one edge of all cells, the next, .."""
    k = cells.shape[1]
    return np.concatenate([cells[:, [i % k, (i + 1) % k]] for i in range(1, k + 1)])


def measures(points: NDArray[Any], cells: Ints) -> NDArray[Any]:
    """Signed lengths or areas of the cells, shape (c,); rational for rational points."""
    p = points[cells]
    if points.shape[1] == 1:
        return np.asarray(p[:, 1, 0] - p[:, 0, 0])
    spokes = [p[:, i] - p[:, 0] for i in range(1, p.shape[1])]
    first, *others = ((u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2 for u, v in pairwise(spokes))
    return np.asarray(sum(others, start=first))


def crossed(mesh: Mesh) -> bool:
    """True if all cells are quadrilaterals split into four from a node inside.

    Each has then one corner inside the body at which four triangles meet.  Triangles of both diagonals do not lock near
    nu = 1/2; a node beside the point where these cross makes them lock, the less the nearer it is.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> around = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> four = Mesh(points=np.vstack([square, [[0.5, 0.5]]]), cells=around, sides={})
    >>> crossed(four), crossed(rectangle((0.0, 2.0), (0.0, 2.0), (2, 2)))
    (True, False)
    """
    if mesh.cells.shape[1] != 3:
        return False
    middle = np.bincount(mesh.cells.ravel()) == 4
    middle[mesh.boundary] = False
    return bool((middle[mesh.cells].sum(axis=1) == 1).all())


def _grid(ends: Sequence[Any], cells: int) -> NDArray[Any]:
    a, b = ends
    if cells < 1:
        raise MeshError(f"{cells} cells: at least one is needed")
    if not a < b:
        raise MeshError(f"ends {a}, {b}: the first must be the smaller")
    if isinstance(a, float):
        return np.linspace(a, b, cells + 1)
    return np.array([a + (b - a) * i / cells for i in range(cells + 1)], dtype=object)


def interval(x: Sequence[Any], cells: int) -> Mesh:
    """A bar ``[a, b]`` in equal cells, with the sides ``left`` and ``right``.

    Parameters
    ----------
    x : pair of float or of Fraction
        The ends, unit length; fractions stay exact.  MeshError unless the first is the smaller one.
    cells : int
        MeshError unless there is one.

    Examples
    --------
    >>> interval((0.0, 1.0), 2).points[:, 0]
    array([0. , 0.5, 1. ])
    """
    points = _grid(x, cells)
    nodes = np.arange(cells + 1)
    return Mesh(
        points=points[:, None],
        cells=np.column_stack([nodes[:-1], nodes[1:]]),
        sides={"left": np.array([[0]]), "right": np.array([[cells]])},
    )


#: How the cells of a rectangle are cut into triangles.
Split = Literal["alternating", "both"]


def rectangle_points(
    x: Sequence[Any], y: Sequence[Any], cells: tuple[int, int], split: Split = "alternating"
) -> NDArray[Any]:
    """The nodes of :func:`rectangle`, of the same parameters, shape (n, 2); exact for fractions."""
    axes = [_grid(ends, n) for ends, n in zip((x, y), cells, strict=True)]
    nodes = lambda axes: np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    middles = [(axis[:-1] + axis[1:]) / 2 for axis in axes] if split == "both" else [axis[:0] for axis in axes]
    return np.concatenate([nodes(axes), nodes(middles)])


def rectangle(x: Sequence[Any], y: Sequence[Any], cells: tuple[int, int], split: Split = "alternating") -> Mesh:
    """A rectangle in equal cells, each split into two triangles along alternating diagonals, or into four along both.

    Of alternating ones cell (i, j) is split from its lower left to its upper right corner where i + j is even, along
    the other diagonal where it is odd.  Nodes are numbered upwards first, then the centres of cells that both split.
    Sides: ``left``, ``right``, ``bottom``, ``top``.

    Parameters
    ----------
    x, y : pairs of float or of Fraction
        The ends along x and along y, with units and errors as for :func:`interval`.
    cells : pair of int
        Cells along x and along y.
    split : {'alternating', 'both'}

    Examples
    --------
    >>> mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 1))
    >>> len(mesh.points), len(mesh.cells), sorted(mesh.sides)
    (6, 4, ['bottom', 'left', 'right', 'top'])
    >>> rectangle((0.0, 2.0), (0.0, 1.0), (2, 1), "both").cells.tolist()[:4]
    [[0, 2, 6], [2, 3, 6], [3, 1, 6], [1, 0, 6]]
    """
    nx, ny = cells
    points = rectangle_points(x, y, cells, split)
    node = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    sw, se, nw, ne = node[:-1, :-1], node[1:, :-1], node[:-1, 1:], node[1:, 1:]
    if split == "both":
        middle, around = node.size + np.arange(nx * ny).reshape(nx, ny), pairwise([sw, se, ne, nw, sw])
        triangles = np.stack([np.stack([a, b, middle], -1) for a, b in around], 2).reshape(-1, 3)
    else:
        even = (np.add.outer(np.arange(nx), np.arange(ny)) % 2 == 0)[..., None]
        first = np.where(even, np.stack([sw, se, ne], -1), np.stack([sw, se, nw], -1))
        second = np.where(even, np.stack([sw, ne, nw], -1), np.stack([se, ne, nw], -1))
        triangles = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    edge = lambda line: np.column_stack([line[:-1], line[1:]])
    return Mesh(
        points=points,
        cells=triangles,
        centres=np.arange(node.size, len(points)),
        sides={"left": edge(node[0]), "right": edge(node[-1]), "bottom": edge(node[:, 0]), "top": edge(node[:, -1])},
    )


def sector(angles: Sequence[float], radii: Sequence[float], cells: int) -> Mesh:
    """A sector of a disc around the origin: triangles at its apex, and split quadrilaterals between the other radii.

    Radii that grow like powers of one number give cells of one shape, as small as wanted at the apex.  Nodes are
    numbered from the apex outwards, on each arc from the first angle to the second.  Sides: ``first`` and ``second``
    at both angles, ``arc``.

    Parameters
    ----------
    angles : pair of float
        In radians, the smaller one first, less than 2 pi apart.
    radii : sequence of float
        Growing, positive; unit length.
    cells : int
        Cells along an arc, at least 1.

    Raises
    ------
    MeshError
        Angles, radii or cells that are none of this.

    Examples
    --------
    >>> mesh = sector((0.0, 2.0), (0.5, 1.0), 3)
    >>> len(mesh.points), len(mesh.cells), sorted(mesh.sides)
    (9, 9, ['arc', 'first', 'second'])
    """
    turns, r = _grid([float(angle) for angle in angles], cells), np.array(radii, float)
    if not angles[1] - angles[0] < 2 * np.pi:
        raise MeshError(f"angles {angles[0]}, {angles[1]}: less than 2 pi apart is needed")
    if r.ndim != 1 or not len(r) or not (np.diff(r, prepend=0.0) > 0).all():
        raise MeshError(f"radii {list(radii)}: growing positive numbers are needed")
    around = np.multiply.outer(r, np.stack([np.cos(turns), np.sin(turns)], axis=-1)).reshape(-1, 2)
    node = 1 + np.arange(len(around)).reshape(len(r), cells + 1)
    fan = np.column_stack([np.zeros(cells, dtype=np.int64), node[0, :-1], node[0, 1:]])
    near, far, far_next, near_next = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    halves = [np.stack(corners, -1).reshape(-1, 3) for corners in ((near, far, far_next), (near, far_next, near_next))]
    edge = lambda line: np.column_stack([line[:-1], line[1:]])
    rays = [edge(np.concatenate([[0], node[:, j]])) for j in (0, -1)]
    return Mesh(
        points=np.concatenate([np.zeros((1, 2)), around]),
        cells=np.concatenate([fan, *halves]),
        sides={"first": rays[0], "second": rays[1], "arc": edge(node[-1])},
    )

"""Meshes of intervals and triangles with named sides."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class MeshError(ValueError):
    """A mesh that cannot be used; the message says what was needed and what was received."""


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A simplicial mesh in one or two dimensions.

    Parameters
    ----------
    points : array, shape (n, d)
        Coordinates in the file's unit of length; floats, or rationals in an object array.
    cells : int array, shape (c, d + 1)
        Vertices of each cell; positively oriented.
    sides : mapping from name to int array, shape (s, d)
        Boundary facets of each named side: end points in 1D, edges in 2D.

    Raises
    ------
    MeshError
        Indices of cells or sides out of range, a cell of zero or negative measure, a node that no cell uses.
    """

    points: NDArray[Any]
    cells: Ints
    sides: Mapping[str, Ints]

    def __post_init__(self) -> None:
        points, cells = np.array(self.points), np.array(self.cells, dtype=np.int64)
        if points.ndim != 2 or points.shape[1] not in (1, 2):
            raise MeshError(f"points of shape {points.shape}: (n, 1) or (n, 2) is needed")
        if cells.ndim != 2 or cells.shape[1] != points.shape[1] + 1 or len(cells) == 0:
            raise MeshError(f"cells of shape {cells.shape}: (c, {points.shape[1] + 1}) with c >= 1 is needed")
        sides = {name: np.array(facets, dtype=np.int64) for name, facets in self.sides.items()}
        for what, named in (("cells", cells), *((f"side {name!r}", facets) for name, facets in sides.items())):
            outside = named[(named < 0) | (named >= len(points))]
            if len(outside):
                raise MeshError(f"{what} name node {outside[0]}, the mesh has {len(points)} nodes")
        if points.dtype != object and not np.isfinite(points).all():
            raise MeshError("a coordinate is not finite")
        if not (measures(points, cells) > 0).all():
            raise MeshError(f"cell {int(np.argmin(measures(points, cells) > 0))} has no positive measure")
        if len(np.unique(cells)) != len(points):
            raise MeshError(f"{len(points) - len(np.unique(cells))} nodes belong to no cell")
        for array in (points, cells, *sides.values()):
            array.setflags(write=False)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "sides", MappingProxyType(sides))

    @property
    def dimension(self) -> int:
        """1 or 2."""
        return int(self.points.shape[1])

    @property
    def boundary(self) -> Ints:
        """Facets that belong to one cell only, shape (b, d); in 2D the body lies to the left of each."""
        corners = self.cells.shape[1]
        opposite = [[(i + j) % corners for j in range(1, corners)] for i in range(corners)]
        facets = np.concatenate([self.cells[:, facet] for facet in opposite])
        _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
        return np.asarray(facets[first[count == 1]], dtype=np.int64)


def measures(points: NDArray[Any], cells: Ints) -> NDArray[Any]:
    """Signed lengths or areas of the cells, shape (c,); rational for rational points."""
    p = points[cells]
    if points.shape[1] == 1:
        return np.asarray(p[:, 1, 0] - p[:, 0, 0])
    u, v = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return np.asarray((u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2)


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
    cells : int

    Raises
    ------
    MeshError
        No cell, or ends in the wrong order.

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


def rectangle(x: Sequence[Any], y: Sequence[Any], cells: tuple[int, int]) -> Mesh:
    """A rectangle in equal cells, each split into two triangles along alternating diagonals.

    Cell (i, j) is split from its lower left to its upper right corner where i + j is even, along the other
    diagonal where it is odd.  Nodes are numbered upwards first.  Sides: ``left``, ``right``, ``bottom``, ``top``.

    Parameters
    ----------
    x, y : pairs of float or of Fraction
    cells : pair of int
        Cells along x and along y.

    Raises
    ------
    MeshError
        No cell, or ends in the wrong order.

    Examples
    --------
    >>> mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 1))
    >>> len(mesh.points), len(mesh.cells), sorted(mesh.sides)
    (6, 4, ['bottom', 'left', 'right', 'top'])
    """
    nx, ny = cells
    gx, gy = _grid(x, nx), _grid(y, ny)
    points = np.stack(np.meshgrid(gx, gy, indexing="ij"), axis=-1).reshape(-1, 2)
    node = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    sw, se, nw, ne = node[:-1, :-1], node[1:, :-1], node[:-1, 1:], node[1:, 1:]
    even = (np.add.outer(np.arange(nx), np.arange(ny)) % 2 == 0)[..., None]
    first = np.where(even, np.stack([sw, se, ne], -1), np.stack([sw, se, nw], -1))
    second = np.where(even, np.stack([sw, ne, nw], -1), np.stack([se, ne, nw], -1))
    edge = lambda line: np.column_stack([line[:-1], line[1:]])
    return Mesh(
        points=points,
        cells=np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)]),
        sides={"left": edge(node[0]), "right": edge(node[-1]), "bottom": edge(node[:, 0]), "top": edge(node[:, -1])},
    )


def from_file(path: Path | str) -> Mesh:
    """A triangle mesh in any format meshio reads; its sides are the physical names of its lines.

    Raises
    ------
    MeshError
        Unreadable, no triangles or other cells too, not plane, no named lines, a side that no triangle touches.
    """
    import meshio

    path = Path(path)
    if not path.is_file():
        raise MeshError(f"{path}: no such mesh file")
    words = io.StringIO()  # its readers print, and exit the interpreter on what they cannot read
    try:
        with contextlib.redirect_stdout(words), contextlib.redirect_stderr(words):
            read = meshio.read(path)
    except (Exception, SystemExit) as error:
        why = " ".join(words.getvalue().split()) or f"{type(error).__name__}: {error}"
        raise MeshError(f"{path}: meshio cannot read it ({why})") from None
    triangles = read.cells_dict.get("triangle")
    if triangles is None or len(triangles) == 0:
        raise MeshError(f"{path}: no triangles in it, only {', '.join(read.cells_dict) or 'nothing'}")
    others = sorted(set(read.cells_dict) - {"triangle", "line", "vertex"})
    if others:
        raise MeshError(f"{path}: needed triangles alone, it has {', '.join(others)} too")
    points = np.asarray(read.points, dtype=float)
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > 0:
        raise MeshError(f"{path}: the points do not lie in a plane z = constant")
    points = points[:, :2]
    flipped = measures(points, triangles) < 0
    triangles = np.where(flipped[:, None], triangles[:, ::-1], triangles)
    lines: dict[str, Ints] = {}
    for name, blocks in read.cell_sets_dict.items():
        if "line" in blocks and not name.startswith("gmsh:"):
            lines[name] = np.asarray(read.cells_dict["line"][blocks["line"]], dtype=np.int64)
    if not lines and "gmsh:physical" in read.cell_data_dict:
        tags = read.cell_data_dict["gmsh:physical"].get("line", np.empty(0))
        for name, (tag, dimension) in read.field_data.items():
            if dimension == 1:
                lines[name] = np.asarray(read.cells_dict["line"][tags == tag], dtype=np.int64)
    if not lines:
        raise MeshError(f"{path}: no named lines; give the sides physical names")
    used = np.unique(triangles)  # geometry points of the mesher belong to no triangle
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    sides = {name: number[facets] for name, facets in lines.items()}
    for name, facets in sides.items():
        if (facets < 0).any():
            raise MeshError(f"{path}: side {name!r} has a node that no triangle uses")
    return Mesh(points=points[used], cells=number[triangles], sides=sides)

"""Mesh files for the tests, as Gmsh writes them, and what they must be read as."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import meshio
import numpy as np
import pytest

from fem1d2d import Mesh, MeshError, from_file, mesh_files, mesh_reader, rectangle


def write_gmsh22(
    path: Path, points: np.ndarray, cells: np.ndarray, sides: Mapping[str, np.ndarray], surfaces: Sequence[str] = ()
) -> None:
    """Triangles in the plane, their sides as physical names 1, 2, ..; the inside has the tag 9, or a name for each of
    some equal parts.
    """
    tags = np.concatenate([np.full(len(facets), i) for i, facets in enumerate(sides.values(), 1)])
    inside = 9 + np.arange(len(cells)) * len(surfaces) // len(cells)
    meshio.write(
        path,
        meshio.Mesh(
            np.pad(points, ((0, 0), (0, 1))),
            [("line", np.concatenate(list(sides.values()))), ("triangle", cells)],
            cell_data={"gmsh:physical": [tags, inside], "gmsh:geometrical": [tags, inside]},
            field_data={name: np.array([i, 1]) for i, name in enumerate(sides, 1)}
            | {name: np.array([i, 2]) for i, name in enumerate(surfaces, 9)},
        ),
        file_format="gmsh22",
        binary=False,
    )


def rotation(angle: float) -> np.ndarray:
    """The matrix by which rows of points are multiplied to be rotated about the origin."""
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def write_curved(
    path: Path, x: Sequence[float], low: Callable[[np.ndarray], np.ndarray], high: Callable[[np.ndarray], np.ndarray]
) -> str:
    """A body between two curves y = low(x) and y = high(x), in columns between the given x, as high as wide.

    Its sides are ``bottom``, ``top``, ``left`` and ``right``.
    """
    columns, height = np.array(x, float), float(np.max(high(np.array(x)) - low(np.array(x))))
    flat = rectangle((0.0, 1.0), (0.0, 1.0), (len(columns) - 1, max(2, round(len(columns) * height / np.ptp(columns)))))
    across = np.repeat(columns, len(flat.points) // len(columns))
    y = (1 - flat.points[:, 1]) * low(across) + flat.points[:, 1] * high(across)
    write_gmsh22(path, np.column_stack([across, y]), flat.cells, flat.sides)
    return str(path)


SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])

#: A unit square in gmsh's own format 4.1: node tags with holes, a centre of a circle that no element uses, one block
#: of elements for each curve, two curves in one group, curves in two groups, a named point.
GMSH41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
5
0 5 "corner"
1 7 "base"
1 8 "flank"
1 9 "all"
2 3 "body"
$EndPhysicalNames
$Entities
2 4 1 0
1 0.5 0.5 0 0
2 0 0 0 1 5
1 0 0 0 1 0 0 2 7 9 2 1 -2
2 1 0 0 1 1 0 2 8 9 2 2 -3
3 0 1 0 1 1 0 1 9 2 3 -4
4 0 0 0 0 1 0 2 8 9 2 4 -1
1 0 0 0 1 1 0 1 3 4 1 2 3 4
$EndEntities
$Nodes
2 5 2 20
0 1 0 1
20
0.25 9 0
2 1 0 4
2
4
9
11
0 0 0
1 0 0
1 1 0
0 1 0
$EndNodes
$Elements
6 7 1 7
0 2 15 1
7 2
1 1 1 1
1 2 4
1 2 1 1
2 4 9
1 3 1 1
3 9 11
1 4 1 1
4 11 2
2 1 2 2
5 2 4 9
6 2 11 9
$EndElements
"""

#: Nodes 1 to 4 of a unit square, one line of the side "bottom", two triangles; numbers count from 1.
MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "bottom"
2 9 "body"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
{count}
{elements}
$EndElements
"""
LINE, CELLS = "1 2 1 1 1 2", ["2 2 9 1 1 2 3", "2 2 9 1 1 3 4"]


def read_here(path: Path) -> mesh_files.Read:
    """Stands for `fem1d2d.mesh_files.read_in_process`, without the process: that saves 0.2 s for each file."""
    try:
        return mesh_files.Read(*mesh_reader.contents(path).values())
    except mesh_reader.NotRead as error:
        raise MeshError(str(error)) from None


def lines_of(mesh: Mesh) -> dict[str, set]:
    """Sides as sets of pairs of coordinates."""
    point = lambda node: tuple(mesh.points[node].tolist())
    return {side: {frozenset(map(point, f)) for f in facets.tolist()} for side, facets in mesh.sides.items()}


def refused(path: Path, message: str) -> None:
    """Assert that a file is refused in one line, which names it."""
    with pytest.raises(MeshError, match=message) as caught:
        from_file(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    assert caught.value.__cause__ is None

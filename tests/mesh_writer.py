"""Mesh files for the tests, as Gmsh writes them."""

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np


def write_gmsh22(path: Path, points: np.ndarray, cells: np.ndarray, sides: Mapping[str, np.ndarray]) -> None:
    """Triangles in the plane, their sides as physical names 1, 2, ..; the inside has the tag 9."""
    tags = np.concatenate([np.full(len(facets), i) for i, facets in enumerate(sides.values(), 1)])
    inside = np.full(len(cells), 9)
    meshio.write(
        path,
        meshio.Mesh(
            np.pad(points, ((0, 0), (0, 1))),
            [("line", np.concatenate(list(sides.values()))), ("triangle", cells)],
            cell_data={"gmsh:physical": [tags, inside], "gmsh:geometrical": [tags, inside]},
            field_data={name: np.array([i, 1]) for i, name in enumerate(sides, 1)},
        ),
        file_format="gmsh22",
        binary=False,
    )

"""Problems of the ledger whose bodies meet along a slope or a curve, as mesh files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import meshio
import numpy as np

from fem1d2d import Mesh, rectangle
from fem1d2d.mesh import Floats

#: Ends in x of the contact body and of the Neumann body, which faces all of it, and the height of a body.
ENDS, LONGER, HEIGHT = (0.4, 1.6), (0.2, 1.8), 0.3


@cache
def _folder() -> TemporaryDirectory[str]:
    """A folder for mesh files, which is removed when the process ends."""
    return TemporaryDirectory(prefix="ndtheory-ledger-")


def curved(random: np.random.Generator) -> dict[str, Any]:
    """Two bodies along ``y = a x + b x^2`` with everything drawn at random; half of them are pressed in.

    Their grids along Gamma_c differ in most draws.
    """
    pick = lambda low, high: round(float(random.uniform(low, high)), 3)
    a, b = pick(-0.5, 0.5), [0.0, pick(-0.3, 0.3)][random.integers(2)]
    line = lambda x: a * x + b * x**2
    young = [round(10 ** random.uniform(-1, 1), 3) for _ in range(2)]
    apart = pick(-0.004, 0) if random.random() < 1 / 2 else pick(0, 0.004)
    neumann_body, both = int(random.integers(1, 3)), ((-HEIGHT, 0.0), (apart, HEIGHT + apart))
    bodies = [
        {"mesh": _written(LONGER if i == neumann_body else ENDS, y, int(random.integers(4, 9)), line)}
        | {"young": E, "poisson": pick(-0.3, 0.45)}
        for i, (y, E) in enumerate(zip(both, young, strict=True), 1)
    ]
    return {
        "body1": bodies[0] | {"fixed": ["bottom"]},
        "body2": bodies[1] | {"prescribed": {"top": [pick(-0.01, 0.01), pick(-0.02, -0.005)]}},
        "contact": {"surface": ["top", "bottom"], "friction": pick(0, 0.5), "radius": pick(0.3, 0.8)},
        "iteration": {"neumann_body": neumann_body, "theta": "auto"},
    }


def _written(x: tuple[float, float], y: tuple[float, float], columns: int, line: Any) -> str:
    """The mesh file of a plate, sheared upwards by the height of a line."""
    flat = rectangle(x, y, (columns, 2))
    points = flat.points + np.column_stack([np.zeros(len(flat.points)), line(flat.points[:, 0])])
    path = Path(_folder().name) / f"{len(list(Path(_folder().name).iterdir()))}.msh"
    write(path, points, flat)
    return str(path)


def write(path: Path, points: Floats, mesh: Mesh) -> None:
    """Write a mesh with other points as Gmsh does, its sides as physical groups."""
    sides: Mapping[str, Any] = mesh.sides
    tags = [np.full(len(facets), tag) for tag, facets in enumerate(sides.values(), 1)]
    groups = [np.concatenate(tags), np.full(len(mesh.cells), len(tags) + 1)]
    written = meshio.Mesh(
        np.pad(points, ((0, 0), (0, 1))),
        [("line", np.concatenate(list(sides.values()))), ("triangle", mesh.cells)],
        cell_data={"gmsh:physical": groups, "gmsh:geometrical": groups},
        field_data={name: np.array([tag, 1]) for tag, name in enumerate(sides, 1)},
    )
    meshio.write(path, written, file_format="gmsh22", binary=False)

"""Problems that the documents of the tests of keys are about."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np

import verification as vf


def triangles(path: Path, side: str = "bottom", low: int = -1) -> None:
    """A unit square of two triangles, below the x axis or elsewhere, with a named bottom or top and a named surface."""
    points = [(0, low, 0), (1, low, 0), (1, low + 1, 0), (0, low + 1, 0)]
    cells = [("line", [[0, 1]] if side == "bottom" else [[2, 3]]), ("triangle", [[0, 1, 2], [0, 2, 3]])]
    tags = [np.array([1]), np.array([9, 9])]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    names = {side: np.array([1, 1]), "square": np.array([9, 2])}
    mesh = meshio.Mesh(np.array(points, float), cells, cell_data=data, field_data=names)
    meshio.write(path, mesh, file_format="gmsh22", binary=False)


def stack() -> vf.Problem:
    """Three plates."""
    plate = {"shape": "rectangle", "x": [0, 2], "cells": [2, 1], "young": 1, "poisson": "0.3"}
    bodies = {f"body{i}": {**plate, "y": [i - 1, i]} for i in (1, 2, 3)}
    bodies["body1"]["fixed"], bodies["body3"]["prescribed"] = ["bottom"], {"top": [0, "-0.1"]}
    touch = {"surface": ["top", "bottom"], "friction": "0.3", "radius": 1}
    return vf.Problem.from_dict({**bodies, "contact": [{**touch, "bodies": [i, i + 1]} for i in (1, 2)]})


def obstacles() -> Iterator[dict[str, Any]]:
    """A plate that is pressed up against a wheel and against a wedge."""
    plate = {"shape": "rectangle", "x": [-1, 1], "y": [-1, 0], "cells": [4, 1], "young": 1, "poisson": "0.3"}
    plate |= {"prescribed": {"bottom": [0, "0.01"]}}
    for face in ({"circle": {"centre": [0, 9], "radius": 9}}, {"line": [[-2, 0], [2, 0]]}):
        obstacle = {"shape": "rigid", "side": "face", **face}
        yield {"body1": plate, "body2": obstacle, "contact": {"surface": ["top", "face"]}}

"""The fields of each body as a VTU file, which ParaView opens."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fem1d2d import MeshError, stresses, von_mises
from fem1d2d.element import as_drawn, lacks
from fem1d2d.mesh import Floats
from ndtheory import __version__
from ndtheory.texts import printable
from verification.algorithm.history import History
from verification.algorithm.monolithic import Solution
from verification.algorithm.runs import Run
from verification.interface.body import Body

#: Rows and columns of a stress tensor in the order of VTK.
SIX = (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)


def write_series(history: History, room: Path) -> None:
    """Write ``body1.pvd`` and ``body2.pvd``, the fields of all increments over time, and a VTU file for each one."""
    places = [f"-{i:04}" for i in range(1, len(history.increments) + 1)]
    for place, increment in zip(places, history.increments, strict=True):
        write_fields(increment.result, room, place)
    for name in ("body1", "body2"):
        sets = [
            f'<DataSet timestep="{increment.time!r}" part="0" file="{name}{place}.vtu"/>'
            for place, increment in zip(places, history.increments, strict=True)
            if (room / f"{name}{place}.vtu").exists()
        ]
        if sets:
            head = f'<?xml version="1.0"?>\n<!-- ndtheory {__version__} -->\n<VTKFile type="Collection"><Collection>'
            text = "\n".join([head, *sets, "</Collection></VTKFile>", ""])
            (room / f"{name}.pvd").write_text(text, encoding="utf-8")


def write_fields(result: Run | Solution, room: Path, place: str = "") -> None:
    """Write ``body1.vtu`` and ``body2.vtu``: displacement at the nodes, stresses on the cells; none where rigid.

    Quadrilaterals that were cut into triangles are written as they were, without their centres.  A run is written at
    its last iterate; ``place`` follows the name of the body.
    """
    bodies, units = result.bodies, result.units
    says = f"lengths in {units['length']}, stresses in {units['stress']}"
    for body, u in bodies.each(result.displacements):
        _write(room / f"{body.name}{place}.vtu", body, u, says)


def _write(path: Path, body: Body, u: Floats, says: str) -> None:
    import meshio

    mesh = body.mesh
    if why := lacks(mesh, "vtk"):
        raise MeshError(f"{body.name}: {why}")
    spatial = lambda vectors: np.pad(vectors, ((0, 0), (0, 3 - mesh.dimension)))
    kept, blocks = as_drawn(mesh, stresses(mesh, body.material, u))
    written = meshio.Mesh(
        spatial(mesh.points[kept]),
        [(kind, cells) for kind, cells, _ in blocks],
        point_data={"displacement": spatial(u[kept])},
        cell_data={
            "stress": [stress[:, *SIX] for *_, stress in blocks],
            "von_mises": [von_mises(stress) for *_, stress in blocks],
        },
    )
    meshio.write(path, written, file_format="vtu")
    first, _, rest = path.read_text("utf-8").partition("\n")
    comment = re.sub("-+", "-", f"ndtheory {__version__}: {body.name}, {printable(says)}")  # XML has no -- in one
    path.write_text(f"{first}\n<!-- {comment} -->\n{rest}", encoding="utf-8")

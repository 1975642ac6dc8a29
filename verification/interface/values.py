"""Displacement and stress at the points that a problem names, and at the nodes of the named sides of its bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from fem1d2d import means_at_nodes, stresses, von_mises
from fem1d2d.line import chains
from fem1d2d.mesh import Floats
from ndtheory.keys import ABSENT, Key, Part, key
from verification.interface.assembly import TwoBodies
from verification.value import Value

#: The components of a stress in the plane, by their places in a tensor.
COMPONENTS = {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}

OF_STRESS = Key(says="mean over the cells that hold the point: one, or all around a node", unit="stress", type="number")
OF_MISES = Key(says="equivalent stress of that mean", unit="stress", type="number")

#: The key of a result that has values at points.
ASKED: dict[str, Any] = {
    "says": "displacement and stress at the points that the file names",
    "absent": "where it names none, and where the run diverged",
    "of": lambda points: points or ABSENT,
}

Displacements = Sequence[Floats | None]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PointValue(Value, Part):
    """Displacement and stress at a point of a body."""

    part: ClassVar[str] = "Point"

    body: int = key("number of its body in the file")
    name: str = key("its name in `points` of the body")
    x: float = key("before deformation", unit="length")
    y: float | None = key("before deformation", unit="length", null="in 1D", why=None)
    displacement: Floats = key("along x and y", unit="length")
    stress: dict[str, float] = key(inside=dict.fromkeys(COMPONENTS, OF_STRESS) | {"mises": OF_MISES})

    @property
    def summary(self) -> str:
        return f"{self.name} of body {self.body}, displacement {self.displacement}"


def values_at_points(bodies: TwoBodies, moved: Displacements) -> tuple[PointValue, ...]:
    """Return the values at the points that the problem names, body by body.

    Parameters
    ----------
    moved : pair of array or None
        Displacement of all nodes of body 1 and of body 2, shape (nodes, d), unit of length; None where rigid.
    """
    fields = {body.name: u for body, u in bodies.each(moved)}
    tensors: dict[str, Floats] = {}
    found = []
    for body, number, name, point, place in bodies.places:
        u = fields[body.name]
        if body.name not in tensors:
            tensors[body.name] = stresses(body.mesh, body.material, u)
        mean = place.of_cells(tensors[body.name])
        stress = {of: float(mean[at]) for of, at in COMPONENTS.items()} | {"mises": float(von_mises(mean[None])[0])}
        found.append(
            PointValue(
                body=number,
                name=name,
                x=float(point[0]),
                y=float(point[1]) if len(point) > 1 else None,
                displacement=place.of_nodes(u),
                stress=stress,
            )
        )
    return tuple(found)


def columns_of(points: Sequence[PointValue]) -> dict[str, list[Any]]:
    """Return values at points as columns, one row for each; in one dimension without y, uy, syy and sxy."""
    rows = [
        {"body": one.body, "name": one.name, "x": one.x, "y": one.y}
        | {f"u{axis}": float(u) for axis, u in zip("xy", one.displacement, strict=False)}
        | {of if of == "mises" else f"s{of}": value for of, value in one.stress.items()}
        for one in points
    ]
    plane = any(one.y is not None for one in points)
    shown = [name for name in (rows[0] if rows else ()) if plane or name not in ("y", "syy", "sxy")]
    return {name: [row[name] for row in rows] for name in shown}


def values_on_sides(bodies: TwoBodies, moved: Displacements) -> dict[str, list[Any]]:
    """Return one row for each node of each named side, as columns; stresses are means over the cells around a node.

    The nodes of a side follow each other with the body on the left, and s is the distance along it, from 0 in each of
    its pieces.  ``moved`` as of :func:`values_at_points`.
    """
    table: dict[str, list[Any]] = {}
    for body, u in bodies.each(moved):
        mesh, d = body.mesh, body.mesh.dimension
        stress = means_at_nodes(mesh, stresses(mesh, body.material, u))
        for side in mesh.sides:
            owner, _, own = side.partition(".") if bodies.problem.several else (body.name, "", side)
            for nodes in chains(mesh.along(side)) if d == 2 else mesh.along(side):
                at = mesh.points[nodes].astype(float)
                steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
                columns: dict[str, list[Any]] = {"body": [int(owner.removeprefix("body"))] * len(nodes)}
                columns |= {"side": [own] * len(nodes), "s": np.append(0.0, np.cumsum(steps)).tolist()}
                columns |= {axis: at[:, i].tolist() for i, axis in enumerate("xy"[:d])}
                columns |= {f"u{axis}": u[nodes, i].tolist() for i, axis in enumerate("xy"[:d])}
                shown = {of: place for of, place in COMPONENTS.items() if max(place) < d}
                columns |= {f"s{of}": stress[nodes][:, *place].tolist() for of, place in shown.items()}
                for name, values in (columns | {"mises": von_mises(stress[nodes]).tolist()}).items():
                    table.setdefault(name, []).extend(values)
    return table

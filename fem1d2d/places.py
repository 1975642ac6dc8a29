"""Points of a body: the node near one, and the displacement and the stress there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem1d2d.element import gradients, lacks
from fem1d2d.mesh import Floats, Ints, Mesh, MeshError, place_of
from fem1d2d.trace import SAME, extent


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A point of a body.

    Attributes
    ----------
    nodes : int array, shape (k,)
        The corners of a cell that holds it, or the node on which it lies.
    weights : array, shape (k,)
        Values of their shape functions there.
    cells : int array
        The cells that hold it: one inside a cell, all around a node or beside an edge.
    """

    nodes: Ints
    weights: Floats
    cells: Ints

    def of_nodes(self, values: Floats) -> Floats:
        """Return the value there of a field given at the nodes, shape (n, ..)."""
        return np.asarray(np.tensordot(self.weights, values[self.nodes], axes=1))

    def of_cells(self, values: Floats) -> Floats:
        """Return the value there of a field given on the cells, shape (c, ..): the mean of the cells that hold it."""
        return np.asarray(values[self.cells].mean(axis=0))


def place(mesh: Mesh, point: Floats, members: Ints | None = None) -> Place:
    """Find a point in a body.

    Parameters
    ----------
    point : array, shape (d,)
    members : int array, optional
        The cells of the body; all of the mesh by default.

    Raises
    ------
    MeshError
        The point lies outside the body; or inside a cell whose element has no values there, only at its nodes.

    Examples
    --------
    >>> from fem1d2d import rectangle
    >>> mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 1))
    >>> float(place(mesh, np.array([0.25, 0.5])).of_nodes(mesh.points[:, 0]))
    0.25
    """
    members = np.arange(len(mesh.cells)) if members is None else members
    points, cells = mesh.points.astype(float), mesh.cells[members]
    slack = SAME * extent(mesh)
    nearest, distance = _nearest(points, cells, point)
    if distance <= slack:
        return Place(nodes=np.array([nearest]), weights=np.ones(1), cells=members[(cells == nearest).any(axis=1)])
    if why := lacks(mesh, "values"):
        raise MeshError(f"{why}: needed a node, the nearest one is {place_of(points[nearest])}")
    slopes = gradients(mesh)[members]
    hats = 1 / cells.shape[1] + ((point - points[cells].mean(axis=1))[:, None] * slopes).sum(axis=2)
    holds = (hats >= -slack * np.linalg.norm(slopes, axis=2)).all(axis=1)
    if not holds.any():
        raise MeshError(f"{place_of(point)} lies outside the body, whose nearest node is {place_of(points[nearest])}")
    first = int(np.argmax(holds))
    return Place(nodes=cells[first], weights=hats[first], cells=members[holds])


def node_at(mesh: Mesh, point: Floats, members: Ints | None = None) -> int:
    """Return the node of a body next to a point, at most half an edge away, of the longest of the cells around it.

    Parameters as of :func:`place`.

    MeshError where none is so near.
    """
    cells = mesh.cells if members is None else mesh.cells[members]
    points = mesh.points.astype(float)
    node, distance = _nearest(points, cells, point)
    corners = points[cells[(cells == node).any(axis=1)]]
    longest = max(float(np.linalg.norm(np.roll(corners, i, axis=1) - corners, axis=2).max()) for i in range(1, 3))
    if not distance <= longest / 2 + SAME * extent(mesh):
        raise MeshError(
            f"no node lies within half an edge of {place_of(point)}, the nearest one is {place_of(points[node])}"
        )
    return node


def means_at_nodes(mesh: Mesh, values: Floats) -> Floats:
    """Return the mean, over the cells around each node, of a field given on the cells, shape (c, ..)."""
    total = np.zeros((len(mesh.points), *values.shape[1:]))
    for corner in mesh.cells.T:
        np.add.at(total, corner, values)
    count = np.bincount(mesh.cells.ravel(), minlength=len(mesh.points))
    return np.asarray(total / count.reshape(-1, *[1] * (values.ndim - 1)))


def _nearest(points: Floats, cells: Ints, point: Floats) -> tuple[int, float]:
    """The nearest of the nodes of some cells, and its distance."""
    nodes = np.unique(cells)
    distances = np.linalg.norm(points[nodes] - point, axis=1)
    found = int(np.argmin(distances))
    return int(nodes[found]), float(distances[found])

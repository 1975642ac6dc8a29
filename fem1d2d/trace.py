"""The interface: its nodes in order, and the trapezoid rule on them."""

from __future__ import annotations

import numpy as np

from fem1d2d.mesh import Floats, Ints, Mesh, MeshError

#: Two coordinates are the same within this fraction of the body's extent.
SAME = 1e-9


def extent(mesh: Mesh) -> float:
    """Largest extent of a mesh along an axis, unit of length."""
    return float(np.ptp(mesh.points.astype(float), axis=0).max())


def surface(mesh: Mesh, *, upper: bool, ends: tuple[float, float] | None = None) -> Ints:
    """Nodes of the flat top (or bottom), the boundary at the largest (smallest) last coordinate, from left to right.

    Parameters
    ----------
    upper : bool
        True for the top of a lower body, False for the bottom of an upper one.  In 1D: the right or the left end.
    ends : pair of float, optional
        A part of the x axis, in the mesh's unit of length (2D): the nodes of the edges that reach into it, the
        outermost of which may lie beyond.

    Raises
    ------
    MeshError
        No boundary edge lies flat at the extreme node (2D).
    """
    points = mesh.points.astype(float)
    height = points[:, -1]
    level = height.max() if upper else height.min()
    flat = np.abs(height - level) <= SAME * extent(mesh)
    if mesh.dimension == 1:
        return np.flatnonzero(flat)
    edges = mesh.boundary
    edges = edges[flat[edges].all(axis=1)]
    nodes = np.unique(edges if ends is None else _between(mesh, edges, ends))
    if len(nodes) == 0:
        raise MeshError(f"no flat {'top' if upper else 'bottom'}: no boundary edge lies at y = {level:g}")
    return np.asarray(nodes[np.argsort(points[nodes, 0], kind="stable")])


def facing(mesh: Mesh, *, upper: bool, ends: tuple[float, float]) -> Ints:
    """Nodes of the boundary that faces up (or down) between two positions, from left to right (2D).

    The surface may be curved, like a cylinder on a plane.  ``ends`` are used as by :func:`surface`.

    Raises
    ------
    MeshError
        Two points of the surface lie above each other.
    """
    edges = mesh.boundary
    x = mesh.points[:, 0].astype(float)
    rightwards = x[edges[:, 1]] - x[edges[:, 0]]  # the body lies to the left of an edge: below one that runs leftwards
    slack = SAME * extent(mesh)
    nodes = np.unique(_between(mesh, edges[rightwards < -slack if upper else rightwards > slack], ends))
    nodes = nodes[np.argsort(x[nodes], kind="stable")]
    double = np.flatnonzero(np.diff(x[nodes]) <= slack)
    if len(double):
        raise MeshError(
            f"two points of the surface that faces {'up' if upper else 'down'} lie at x = {x[nodes[double[0]]]:g}"
        )
    return nodes


def _between(mesh: Mesh, edges: Ints, ends: tuple[float, float]) -> Ints:
    """The edges among these that reach further than rounding between two positions."""
    x, slack = mesh.points[edges, 0].astype(float), SAME * extent(mesh)
    return np.asarray(edges[(x.min(axis=1) < ends[1] - slack) & (x.max(axis=1) > ends[0] + slack)])


def trapezoid(x: Floats) -> Floats:
    """Weights w_j of the trapezoid rule on ordered points, shape (n,), unit of length; one point has weight 1.

    Rational points (an object array) have rational weights.

    Examples
    --------
    >>> trapezoid(np.array([0.0, 1.0, 3.0]))
    array([0.5, 1.5, 1. ])
    """
    if len(x) <= 1:
        return np.ones(len(x))
    steps, zero = np.diff(x) / 2, np.zeros(1, dtype=x.dtype)
    return np.asarray(np.concatenate([steps, zero]) + np.concatenate([zero, steps]))

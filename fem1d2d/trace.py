"""The interface: its nodes in order, the trapezoid rule on them, and the mortar transfer between two of its grids."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

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

    The surface may be curved, like a cylinder on a plane; MeshError if two of its points lie above each other.
    ``ends`` are used as by :func:`surface`.
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


def mortar(contact: NDArray[Any], neumann: NDArray[Any]) -> NDArray[Any]:
    """P: nodal values on one grid of piecewise linear functions given on another, shape (n_c, n_n).

    ``P = D^-1 M`` with ``M_ji = int psi_j phi_i`` and ``D = diag(int phi_j)`` over the interval of the contact grid,
    exact on the intersections of both grids.  psi_j is the dual basis of the contact grid, on every cell ``2 phi_j``
    minus the other hat function: ``int psi_j phi_k = 0`` for j != k, and ``sum_j psi_j = 1``.  So

    * P reproduces functions that are piecewise linear on the contact grid, constants and rigid motions among them;
    * ``P' w_c = w_n``, where w are integrals of hat functions over that interval: a constant pressure stays constant.

    psi_j is negative in places, and so are some entries of P (none below -1/3).

    Parameters
    ----------
    contact, neumann : array, shapes (n_c,), (n_n,)
        Increasing positions, n_c >= 2; of the second grid all nodes whose hat functions reach into the interval of the
        first, so that the outermost may lie outside; ValueError if it does not cover that interval.  Rational entries
        (object arrays) give rational ones.

    Examples
    --------
    >>> mortar(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0]))
    array([[1. , 0. ],
           [0.5, 0.5],
           [0. , 1. ]])
    """
    if not (neumann[0] <= contact[0] and contact[-1] <= neumann[-1]):
        covered = [float(grid[end]) for grid in (neumann, contact) for end in (0, -1)]
        raise ValueError("the grid from {:g} to {:g} does not cover that from {:g} to {:g}".format(*covered))
    inside = neumann[(neumann > contact[0]) & (neumann < contact[-1])]
    points = np.unique(np.concatenate([contact, inside]))
    start, end = points[:-1], points[1:]
    cell_c, one_c = _hats(contact, start, end)
    cell_n, one_n = _hats(neumann, start, end)
    M = np.zeros((len(contact), len(neumann)), dtype=points.dtype)
    for j in range(2):
        psi = [2 * a - b for a, b in zip(one_c[j], one_c[1 - j], strict=True)]
        for i in range(2):
            phi = one_n[i]
            product = 2 * (psi[0] * phi[0] + psi[1] * phi[1]) + psi[0] * phi[1] + psi[1] * phi[0]
            np.add.at(M, (cell_c + j, cell_n + i), (end - start) * product / 6)
    return np.asarray(M / M.sum(axis=1)[:, None])  # int psi_j = int phi_j, and the hat functions phi_i add up to 1


def _hats(grid: NDArray[Any], start: NDArray[Any], end: NDArray[Any]) -> tuple[NDArray[np.int64], list[Any]]:
    """The cells of a grid in which segments lie, and both hat functions there at both ends of each segment."""
    cell = np.clip(np.searchsorted(grid, start, side="right") - 1, 0, len(grid) - 2)
    left, right = grid[cell], grid[cell + 1]
    rising = [(x - left) / (right - left) for x in (start, end)]
    return cell, [[1 - value for value in rising], rising]

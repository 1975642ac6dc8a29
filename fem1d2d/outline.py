"""The outline of a plane body: which points lie inside the body, and how deep."""

from __future__ import annotations

import numpy as np

from fem1d2d.overlap import Floats, cells_over, ranges


def depths(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance of each point inside a body to its outline, shape (n,), unit of length; 0 for points outside.

    The body may have holes and pieces, and need not be convex.

    Parameters
    ----------
    points : array, shape (n, 2)
    start, end : array, shape (b, 2)
        The ends of the edges of the outline, the body to the left of each.

    Examples
    --------
    >>> corners = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)])
    >>> depths(np.array([(1.0, 0.5), (3.75, 1.0), (5.0, 1.0)]), corners, np.roll(corners, -1, axis=0))
    array([0.5 , 0.25, 0.  ])
    """
    depth = np.zeros(len(points))
    near = np.flatnonzero(((points > start.min(axis=0)) & (points < start.max(axis=0))).all(axis=1))
    inside = near[cells_over(points[near], start, end) > 0]
    if len(inside):
        depth[inside] = _distances(points[inside], start, end)
    return depth


def _distances(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance of each point to the nearest edge, shape (n,).

    Only edges are looked at whose abscissas come as near as the nearest corner.
    """
    from scipy.spatial import cKDTree  # loads for longer than most outlines take, and few points lie inside

    nearest = np.asarray(cKDTree(start).query(points)[0], dtype=float)
    left, right = np.minimum(start[:, 0], end[:, 0]), np.maximum(start[:, 0], end[:, 0])
    order = np.argsort(left, kind="stable")
    first = np.searchsorted(left[order], points[:, 0] - nearest - (right - left).max())
    last = np.searchsorted(left[order], points[:, 0] + nearest, side="right")
    for i, place in ranges(first, last - first):
        edge = order[place]
        u, v = end[edge] - start[edge], points[i] - start[edge]
        squared = (u * u).sum(axis=1)
        along = np.clip((u * v).sum(axis=1) / np.where(squared > 0, squared, 1.0), 0, 1)
        np.minimum.at(nearest, i, np.hypot(*(v - along[:, None] * u).T))
    return nearest

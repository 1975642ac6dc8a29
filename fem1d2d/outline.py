"""The outline of a plane body: cells that lie on each other, points inside, and how deep these lie.

Where all cells are positively oriented and each inner edge lies in two cells with opposite directions, the number of
cells over a point changes only across boundary edges: on the left of one it is larger by 1 than on its right.  So no
point lies in two cells if and only if every boundary edge has no cell on its right.  Edges that meet only in end points
have the same number of cells along their whole right side, and one point of each is enough.  Where the boundary is one
convex polygon, as for a rectangle, that number is its winding number, and nothing is left to check.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from numbers import Rational
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: Coordinates that a mesher computed differ by this part of the largest one: smaller distances count as 0.
ROUNDING = 8 * float(np.finfo(float).eps)

#: A box with no more edges than this is not divided further.
FEW = 16

#: Pairs that are computed together: arrays of some 10 MB.
TOGETHER = 200_000


def fault(points: NDArray[Any], edges: Ints) -> str | None:
    """The place where cells lie on each other or are not joined, in words; None where they fit together.

    Parameters
    ----------
    points : array, shape (n, 2)
        Floats, or rationals in an object array (compared exactly).
    edges : int array, shape (b, 2)
        The boundary, the body to the left of each edge.

    Examples
    --------
    >>> square, triangle = [(0, 0), (2, 0), (2, 2), (0, 2)], [(1, 0.5), (1.5, 1), (1, 1.5)]
    >>> edges = np.array([(0, 1), (1, 2), (2, 3), (3, 0)])
    >>> print(fault(np.array(square, dtype=float), edges))
    None
    >>> fault(np.array([*square, *triangle], dtype=float), np.array([*edges, (4, 5), (5, 6), (6, 4)]))
    'the boundary edge from (1, 0.5) to (1.5, 1) lies inside another cell'
    """
    given = points
    of = lambda i: "from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g})".format(*map(float, given[edges[i]].ravel()))
    rounding: float = 0 if points.dtype == object else ROUNDING
    if rounding:  # powers of two: the same digits, near one in any unit
        points = np.ldexp(points, -np.frexp(np.abs(points).max(axis=0))[1])
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    floats = start.astype(float), end.astype(float)
    if not rounding:
        start, end = whole_numbers(points[edges.T])[0]
    if _convex(edges, (start, end), floats):
        return None
    for i, j in _near(*floats):
        crossing, touching = _meet(start[i], end[i], start[j], end[j], rounding)
        if crossing.any():
            k = int(np.argmax(crossing))
            return f"the boundary edges {of(i[k])} and {of(j[k])} cross: cells lie on each other"
        if touching.any():
            k = int(np.argmax(touching))
            return f"the boundary edges {of(i[k])} and {of(j[k])} touch, but their cells are not joined there"
    flat = np.abs(floats[1] - floats[0])
    flat = flat[:, 0] >= flat[:, 1]
    mirrored = floats[1][:, ::-1], floats[0][:, ::-1]  # at the diagonal: with the ends exchanged the body stays left
    for ends, asked in ((floats, np.flatnonzero(flat)), (mirrored, np.flatnonzero(~flat))):
        covered = _covered(*ends, asked)
        if covered.any():
            return f"the boundary edge {of(np.argmax(covered))} lies inside another cell"
    return None


def whole_numbers(values: NDArray[Any]) -> tuple[NDArray[Any], int]:
    """Rationals as multiples of 1/unit, and that unit: whole numbers are faster than fractions."""
    exact = [
        (int(x.numerator), int(x.denominator)) if isinstance(x, Rational) else x.as_integer_ratio()
        for x in values.ravel().tolist()
    ]
    unit = math.lcm(*(denominator for _, denominator in exact))
    whole = np.array([numerator * (unit // denominator) for numerator, denominator in exact], dtype=object)
    return whole.reshape(values.shape), unit


def _convex(edges: Ints, exactly: tuple[NDArray[Any], NDArray[Any]], floats: tuple[Floats, Floats]) -> bool:
    """True if the edges, one after the other, form one polygon that turns left or goes straight on, once round."""
    following, ends = {node: edge for edge, node in enumerate(edges[:, 0].tolist())}, edges[:, 1].tolist()
    order, edge = [0], following.get(ends[0])
    while edge and len(order) < len(edges):
        order.append(edge)
        edge = following.get(ends[edge])
    if edge != 0 or len(order) < len(edges):
        return False

    def corners(start: NDArray[Any], end: NDArray[Any]) -> tuple[Any, Any]:
        """The turn of the next edge to the left of each, and its advance."""
        u = (end - start)[order]
        v = np.roll(u, -1, axis=0)
        return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(axis=1)

    left, ahead = corners(*exactly)
    if not ((left > 0) | ((left == 0) & (ahead > 0))).all():
        return False
    return bool(np.arctan2(*corners(*floats)).sum() < 3 * np.pi)  # a multiple of 2 pi, up to rounding


def _meet(a: NDArray[Any], b: NDArray[Any], c: NDArray[Any], d: NDArray[Any], rounding: float) -> tuple[Bools, Bools]:
    """True where edges ab and cd cross, and where they touch in more than an end point of both."""

    def place(p: NDArray[Any], q: NDArray[Any], r: NDArray[Any]) -> tuple[Any, Any, Any]:
        """Side of pq on which r lies (0: on its line), its distance along pq, and the rounding of both."""
        u, v = q - p, r - p
        slack = rounding * (np.abs(u).sum(axis=1) + np.abs(v).sum(axis=1))
        turn = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        return (turn > slack).astype(int) - (turn < -slack), (u * v).sum(axis=1), slack

    placed = [place(p, q, r) for p, q, r in ((a, b, c), (a, b, d), (c, d, a), (c, d, b))]
    (side_c, along_c, slack_c), (side_d, along_d, slack_d), (side_a, _, _), (side_b, _, _) = placed
    crossing = (side_c * side_d < 0) & (side_a * side_b < 0)
    length = [((q - p) ** 2).sum(axis=1) for p, q in ((a, b), (a, b), (c, d), (c, d))]
    touching = np.zeros(len(a), dtype=bool)
    for (side, along, slack), whole in zip(placed, length, strict=True):
        touching |= (side == 0) & (along > slack) & (along < whole - slack)
    shared = np.minimum(length[0], np.maximum(along_c, along_d)) - np.maximum(0, np.minimum(along_c, along_d))
    on_one_line = (side_a == 0) & (side_b == 0) & (side_c == 0) & (side_d == 0)
    return crossing, touching | (on_one_line & (shared > np.maximum(slack_c, slack_d)))


def _near(start: Floats, end: Floats) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of edges in the same small box; all that meet are among them.

    A box fits around its edges.  It is halved across the axis that leaves fewer of them in the fuller half, if it has
    many and the cut goes through less than half of them.
    """
    slack = 4 * ROUNDING
    least, most, along = np.minimum(start, end) - slack, np.maximum(start, end) + slack, end - start

    def meets(edge: Ints, low: Floats, high: Floats) -> Bools:
        """True where an edge meets a box that its bounding box meets: their shadows on the edge's normal meet."""
        u, v, half = along[edge], (low + high) / 2 - start[edge], (high - low) / 2
        turn = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        return np.asarray(turn <= half[:, 0] * np.abs(u[:, 1]) + half[:, 1] * np.abs(u[:, 0]) + slack)

    edge, first = np.arange(len(start)), np.zeros(1, dtype=np.int64)
    low, high = least.min(axis=0)[None], most.max(axis=0)[None]
    while len(edge):
        low = np.maximum(low, np.minimum.reduceat(least[edge], first))
        high = np.minimum(high, np.maximum.reduceat(most[edge], first))
        count = np.diff(first, append=len(edge))
        box = np.repeat(np.arange(len(first)), count)
        middle = (low + high) / 2
        halves, fuller, cut = [], [], []
        for axis in range(2):
            lower_high, upper_low = high.copy(), low.copy()
            lower_high[:, axis] = upper_low[:, axis] = middle[:, axis]
            lower, upper = least[edge, axis] <= middle[box, axis], most[edge, axis] >= middle[box, axis]
            lower[lower] = meets(edge[lower], low[box[lower]], lower_high[box[lower]])
            upper[upper] = meets(edge[upper], upper_low[box[upper]], high[box[upper]])
            halves.append((lower, upper, lower_high, upper_low))
            inside = [np.add.reduceat(part.astype(np.int64), first) for part in (lower, upper, lower & upper)]
            fuller.append(np.maximum(*inside[:2]))
            cut.append(inside[2])
        across = (fuller[1] < fuller[0]).astype(int)
        done = (count <= FEW) | (2 * np.where(across, cut[1], cut[0]) > count)
        ready, of = edge[done[box]], box[done[box]]  # the edges of one box are neighbours
        following = np.searchsorted(of, of, side="right") - np.arange(len(of)) - 1
        for one, other in ranges(np.arange(1, len(of) + 1), following):
            yield ready[one], ready[other]
        edges, boxes, lows, highs = [], [], [], []
        for axis, (lower, upper, lower_high, upper_low) in enumerate(halves):
            chosen = (~done & (across == axis))[box]
            for part, (half, bottom, top) in enumerate(((lower, low, lower_high), (upper, upper_low, high))):
                kept = np.flatnonzero(chosen & half)
                edges.append(edge[kept])
                boxes.append(2 * box[kept] + part)
                lows.append(bottom[box[kept]])
                highs.append(top[box[kept]])
        order = np.argsort(np.concatenate(boxes), kind="stable")
        edge = np.concatenate(edges)[order]
        _, first = np.unique(np.concatenate(boxes)[order], return_index=True)
        low, high = np.concatenate(lows)[order][first], np.concatenate(highs)[order][first]


def ranges(first: Ints, count: Ints) -> Iterator[tuple[Ints, Ints]]:
    """(i, j) for all i and first[i] <= j < first[i] + count[i], some at a time."""
    total = np.concatenate([[0], np.cumsum(count)])
    for begin in range(0, int(total[-1]), TOGETHER):
        place = np.arange(begin, min(begin + TOGETHER, int(total[-1])))
        i = np.searchsorted(total, place, side="right") - 1
        yield i, first[i] + place - total[i]


def _covered(start: Floats, end: Floats, asked: Ints) -> Bools:
    """True where a cell lies to the right of an edge's middle, for edges that meet only in end points.

    ``asked`` are edges less steep than 45 degrees: the middle of a steep one may round to the abscissa of an end.
    """
    covered = np.zeros(len(start), dtype=bool)
    leftwards = end[asked, 0] < start[asked, 0]
    covered[asked] = cells_over((start[asked] + end[asked]) / 2, start, end, own=asked) != leftwards
    return covered


def cells_over(points: Floats, start: Floats, end: Floats, own: Ints | None = None) -> Ints:
    """Count the cells over each point by the boundary edges below it: +1 where one runs rightwards, -1 leftwards.

    Parameters
    ----------
    points : array, shape (n, 2)
    start, end : array, shape (b, 2)
        The ends of the boundary edges, the body to the left of each.
    own : int array, shape (n,), optional
        The edge on which a point lies: it is not counted.
    """
    rightwards = np.sign(end[:, 0] - start[:, 0]).astype(int)
    left, right = np.where((rightwards > 0)[:, None], (start, end), (end, start))
    order = np.argsort(points[:, 0], kind="stable")
    spans = np.flatnonzero(rightwards)
    first, last = (np.searchsorted(points[order, 0], ends[spans, 0]) for ends in (left, right))
    count = np.zeros(len(points), dtype=np.int64)
    for i, place in ranges(first, last - first):
        edge, point = spans[i], order[place]
        u, v = right[edge] - left[edge], points[point] - left[edge]
        under = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0
        if own is not None:
            under &= edge != own[point]
        np.add.at(count, point[under], rightwards[edge[under]])
    return count


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

    Only edges whose abscissas come as near as the nearest corner are compared.
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

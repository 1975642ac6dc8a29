"""A line of contact: ordered nodes along a named side, with lengths, normals, and the projection of another line on it.

The positions of the rest are distances s along the line.  A line has one direction, and its normals lie on the left.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fem1d2d.mesh import Bools, Floats, Ints, Mesh, MeshError, place_of
from fem1d2d.trace import SAME

#: Pairs of an edge and a node that are computed together: arrays of some 10 MB.
TOGETHER = 200_000

#: Rounds in which the normals between two lines settle: each lessens the change by the gap over a radius of curvature.
MEANS = 30

#: The largest corner between two edges, in degrees: beyond it a bisector is far from both normals, and the line is cut.
SHARPEST = 20.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """A polygonal line of a body's surface.

    Attributes
    ----------
    nodes : int array, shape (n,)
        In the direction of s.
    points : array, shape (n, 2)
        Their coordinates.
    normals : array, shape (n, 2)
        Unit normals on the left of the line: the bisectors of its corners, at an end the normal of the edge.
    images : pair of array, shape (2,), or None
        The next points beyond both ends, where the line goes on as its mirror image.
    """

    nodes: Ints
    points: Floats
    normals: Floats
    images: tuple[Floats | None, Floats | None] = (None, None)

    @classmethod
    def parts(
        cls, mesh: Mesh, side: str, *, left: bool, mirrored: Bools | None = None, away: Floats | None = None
    ) -> list[Line]:
        """Order the nodes of a named side, which is cut at corners of more than SHARPEST degrees.

        Parameters
        ----------
        left : bool
            True if the body lies on the left of the direction of s, False if on the right.
        mirrored : bool array, shape (nodes, 2), optional
            Components that a support holds: where it holds one of an end node, the line goes on as its mirror image, as
            in one half of a symmetric body, and that end's normal lies along the axis; not beyond a corner.
        away : array, shape (m, 2), optional
            Points far from which a closed line without a corner begins and ends.
        """
        edges, points = mesh.along(side), mesh.points.astype(float)
        pieces = chains(edges if left else edges[:, ::-1])
        return [line for nodes in pieces for line in cls._cut(nodes, points, mirrored, away)]

    @classmethod
    def through(cls, points: Floats, *, away: Floats | None = None) -> list[Line]:
        """Cut a line through given points, shape (n, 2), as a side is cut; parameters as of :meth:`parts`."""
        nodes = np.arange(len(points))
        nodes[-1] = 0 if (points[0] == points[-1]).all() else nodes[-1]
        return cls._cut(nodes, points, None, away)

    @classmethod
    def _cut(cls, nodes: Ints, points: Floats, mirrored: Bools | None, away: Floats | None) -> list[Line]:
        turns = _turns(points[nodes])
        if nodes[0] == nodes[-1]:
            first = int(np.argmax(turns[:-1]))
            if turns[first] <= SHARPEST and away is not None:
                distances = np.linalg.norm(points[nodes[:-1], None] - away, axis=2)
                first = int(np.argmax(distances.min(axis=1)))  # the node farthest from all of these
            nodes, turns = (np.append(np.roll(values[:-1], -first), values[first]) for values in (nodes, turns))
        cuts = np.flatnonzero(turns[1:-1] > SHARPEST) + 1
        ends = pairwise([0, *cuts.tolist(), len(nodes) - 1])
        return [cls._smooth(nodes[begin : end + 1], points, mirrored) for begin, end in ends]

    @classmethod
    def _smooth(cls, nodes: Ints, every: Floats, mirrored: Bools | None) -> Line:
        """The line through nodes that follow each other."""
        points = every[nodes]
        steps = np.diff(points, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        steps /= lengths[:, None]
        before, after = np.vstack([steps[:1], steps]), np.vstack([steps, steps[-1:]])
        images: list[Floats | None] = [None, None]
        if mirrored is not None:
            for end, edge in ((0, before), (-1, after)):
                held = mirrored[nodes[end]]
                image = np.where(held, 1.0, -1.0) * steps[end]
                if held.sum() == 1 and image @ steps[end] > np.cos(np.radians(SHARPEST)):
                    edge[end] = image
                    images[end] = points[end] + (image if end else -image) * lengths[end]
        tangents = before + after
        normals = _directions(np.stack([-tangents[:, 1], tangents[:, 0]], axis=1))
        return cls(nodes=nodes, points=points, normals=normals, images=(images[0], images[1]))

    def corner(self, following: Line, side: str) -> str:
        """Why the corner at which this line ends and another one begins lies on no line of contact."""
        turn = _turns(np.vstack([self.points[-2:], following.points[1:2]]))[1]
        return (
            f"the corner of side {side!r} at {place_of(self.points[-1])} has {turn:.3g} degrees: needed at most"
            f" {SHARPEST:g}; cut it there, or mesh a curve finer"
        )

    @cached_property
    def s(self) -> Floats:
        """Distances along the line from its first node, shape (n,)."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])

    def normals_at(self, s: Floats) -> Floats:
        """Unit normals at positions, linear between the nodes; beyond an end its own one."""
        normals = np.stack([np.interp(s, self.s, self.normals[:, i]) for i in range(2)], axis=1)
        sizes = np.linalg.norm(normals, axis=1)[:, None]
        return np.asarray(np.where(np.abs(sizes - 1) > np.finfo(float).eps, normals / sizes, normals))

    def alike(self, other: Line) -> bool:
        """True if both lines have the same normals at all their nodes, to rounding."""
        return len(self.nodes) == len(other.nodes) and np.allclose(self.normals, other.normals, rtol=0, atol=SAME)

    @cached_property
    def slack(self) -> float:
        """Length within which two places along the line are the same: of its extent, and of rounding of coordinates."""
        rounding = 8 * float(np.spacing(np.abs(self.points).max()))
        return max(SAME * float(np.ptp(self.points, axis=0).max()), rounding)

    def facing(self, other: Line) -> Line:
        """Return the part of this line that faces another one, of the same direction, with normals between both.

        Both surfaces end on one common line, whose normal is to first order in the slopes the mean of theirs: at each
        node the direction of n + n', where n' is the other line's normal at the place that this very direction meets.
        The normals of one line alone are off by half the angle between them, an error of the order slope/k in a shear.

        Raises
        ------
        MeshError
            The other line faces no edge of this one, or several parts of it, or normals cross before it.
        """
        between = self
        for _ in range(MEANS):
            both = self.normals + other.normals_at(between._meetings(other)[0])
            opposite = np.linalg.norm(both, axis=1) < SAME
            normals = _directions(np.where(opposite[:, None], self.normals, both))
            settled = np.abs(normals - between.normals).max() <= SAME
            between = replace(between, normals=normals)
            if settled:
                break
        met, faces = between._meetings(other)
        faces &= (self.normals * other.normals_at(met)).sum(axis=1) > SAME  # lines at a right angle face nothing
        begins = np.flatnonzero(np.diff(faces.astype(int), prepend=0) == 1)
        ends = np.flatnonzero(np.diff(faces.astype(int), append=0) == -1)
        whole = [slice(begin, end + 1) for begin, end in zip(begins, ends, strict=True) if end > begin]
        if not whole:
            raise MeshError(f"does not face {place_of(self.points[0])}, nor any edge of that line as a whole")
        if len(whole) > 1:
            raise MeshError(f"does not face {place_of(self.points[whole[0].stop])}, but parts on both sides of it")
        kept = whole[0]
        if (np.diff(met[kept]) <= 0).any():
            back = kept.start + int(np.argmin(np.diff(met[kept])))
            raise MeshError(f"is met by normals that cross near {place_of(self.points[back])}")
        return between.part(kept)

    def part(self, kept: slice) -> Line:
        """The line between two of its nodes."""
        return Line(nodes=self.nodes[kept], points=self.points[kept], normals=self.normals[kept])

    def curve(self, s: Floats) -> Floats:
        """Points on the smooth curve through the nodes at positions, shape (len(s), 2)."""
        known, points = self.s, self.points
        for end, image in zip((0, -1), self.images, strict=True):
            if image is not None:
                step = (1 if end else -1) * float(np.linalg.norm(points[end] - image))
                at = len(known) if end else 0
                known, points = np.insert(known, at, known[end] + step), np.insert(points, at, image, axis=0)
        return smooth(known, points, s)

    def seen_from(self, other: Line) -> Seen:
        """Find where the normals of this line, as :meth:`facing` returns it, meet another one.

        Raises
        ------
        MeshError
            The normal at a node meets no part of the other line that faces it.
        """
        met, faces = self._meetings(other)
        if not faces.all():
            raise MeshError(f"does not face {place_of(self.points[np.argmin(faces)])}")
        gap = ((other.curve(met) - self.points) * self.normals).sum(axis=1)
        s = _onto(other.s, met, self.s)
        reaches = np.append(s[1:] > self.slack, True) & np.insert(s[:-1] < self.s[-1] - self.slack, 0, True)
        return Seen(gap=gap, s=s, reaches=reaches)

    def _meetings(self, other: Line) -> tuple[Floats, Bools]:
        """The positions on another line that normals meet first, and where they do; elsewhere its nearer end."""
        n, step = len(self.points), max(1, TOGETHER // len(other.points))
        parts = [self._meets(other, np.arange(i, min(i + step, n))) for i in range(0, n, step)]
        met, faces = (np.concatenate(found) for found in zip(*parts, strict=True))
        return met, faces

    def _meets(self, other: Line, nodes: Ints) -> tuple[Floats, Bools]:
        points, normals = self.points[nodes], self.normals[nodes]
        start, along = other.points[:-1, None], np.diff(other.points, axis=0)[:, None]  # (edges, 1, 2)
        tangents = np.stack([normals[:, 1], -normals[:, 0]], axis=1)
        rise = (along * tangents).sum(axis=2)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            place = ((points - start) * tangents).sum(axis=2) / rise
            beyond = max(self.slack, other.slack) / np.linalg.norm(along, axis=2)
        meets = (rise > 0) & (place >= -beyond) & (place <= 1 + beyond)
        place = np.clip(np.where(meets, place, 0.0), 0.0, 1.0)
        far = np.abs(((start + place[..., None] * along - points) * normals).sum(axis=2))
        edge = np.argmin(np.where(meets, far, np.inf), axis=0)
        met = other.s[edge] + place[edge, np.arange(len(nodes))] * np.diff(other.s)[edge]
        faces = meets.any(axis=0)
        ends = np.linalg.norm(points[:, None] - other.points[[0, -1]], axis=2).argmin(axis=1)
        return np.where(faces, met, other.s[[0, -1]][ends]), faces


@dataclass(frozen=True, kw_only=True, eq=False)
class Seen:
    """Another line as it is seen along the normals of one.

    Attributes
    ----------
    gap : array, shape (nodes of the one,)
        Distance along the normal at each node, negative where it lies behind.
    s : array, shape (nodes of the other,)
        Positions of its nodes on the one; nodes beyond the ends go on at the pace of the outermost edges.
    reaches : bool array, shape (nodes of the other,)
        True for its nodes whose hat functions reach into the one.
    """

    gap: Floats
    s: Floats
    reaches: Bools


def smooth(known: Floats, values: Floats, x: Floats) -> Floats:
    """A smooth function through values at known positions, shape (n,) or (n, d), evaluated at x.

    The nodes of a mesh lie on the curve that was meshed, and its edges beside it: an arc seen from its chords has a
    ripple as high as each of them, and contact would feel it.  On each edge this is the cubic whose slopes at both
    nodes are those of parabolas through three nodes: a straight line stays straight.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 3.0, 4.0])
    >>> smooth(x, x**2, np.array([2.0, 3.5]))
    array([ 4.  , 12.25])
    """
    slopes = np.gradient(values, known, axis=0, edge_order=1 if len(known) < 3 else 2)
    edge = np.clip(np.searchsorted(known, x, side="right") - 1, 0, len(known) - 2)
    length, along = np.diff(known)[edge], x - known[edge]
    if values.ndim > 1:
        length, along = length[:, None], along[:, None]
    u, rise = along / length, values[edge + 1] - values[edge]
    bulge = (1 - u) * (slopes[edge] * length - rise) - u * (slopes[edge + 1] * length - rise)
    return np.asarray(values[edge] + u * rise + u * (1 - u) * bulge)


def _onto(x: Floats, known: Floats, values: Floats) -> Floats:
    """A piecewise linear function at x, continued beyond the known positions by its outermost pieces."""
    found = np.interp(x, known, values)
    for end, beside, beyond in ((0, 1, x < known[0]), (-1, -2, x > known[-1])):
        pace = (values[beside] - values[end]) / (known[beside] - known[end])
        found[beyond] = values[end] + pace * (x[beyond] - known[end])
    return found


def _turns(points: Floats) -> Floats:
    """Angles between the edges that meet at each point of a line, in degrees; 0 at an end that is not the other end."""
    steps = np.diff(points, axis=0)
    closed = bool((points[0] == points[-1]).all())
    before, after = np.vstack([steps[[-1 if closed else 0]], steps]), np.vstack([steps, steps[[0 if closed else -1]]])
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.asarray(np.abs(np.degrees(np.arctan2(turn, (before * after).sum(axis=1)))))


def chains(edges: Ints) -> list[Ints]:
    """The nodes of edges that follow each other, piece by piece; a closed piece ends where it begins.

    A node at which several edges begin or end, as one at which two parts of a body touch, ends all pieces there.

    Examples
    --------
    >>> [nodes.tolist() for nodes in chains(np.array([[4, 5], [1, 2], [0, 1], [7, 8], [8, 7]]))]
    [[0, 1, 2], [4, 5], [7, 8, 7]]
    """
    outs, ins = (Counter(ends) for ends in edges.T.tolist())
    following = {a: b for a, b in edges.tolist() if outs[a] == ins[a] == 1}  # inside a piece
    begun = sorted(edge for edge in edges.tolist() if edge[0] not in following)
    found = []
    while begun or following:
        piece = begun.pop(0) if begun else [min(following)]
        while piece[-1] in following:
            piece.append(following.pop(piece[-1]))
        found.append(np.array(piece))
    return found


def _directions(vectors: Floats) -> Floats:
    """Unit vectors; one that lies along an axis to rounding is that axis."""
    found = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    found[np.abs(found) < SAME] = 0.0
    along = np.abs(found) > 1 - SAME**2 / 2
    found[along] = np.rint(found[along])
    return np.asarray(found)

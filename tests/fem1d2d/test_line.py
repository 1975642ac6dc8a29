"""Lines of contact: order, direction, normals, corners, and another line as it is seen along the normals."""

from itertools import pairwise

import numpy as np
import pytest
from mesh_writer import rotation

from fem1d2d import Line, Mesh, MeshError, mortar, rectangle, trapezoid


def ring(radii, angles, *, cells=(1, 8), turn=0.0):
    """A sector of a ring about the origin with the sides inner, outer, first and second."""
    flat = rectangle(radii, angles, cells)
    r, a = flat.points[:, 0], flat.points[:, 1] + turn
    names = {"left": "inner", "right": "outer", "bottom": "first", "top": "second"}
    points = np.column_stack([r * np.cos(a), r * np.sin(a)])
    return Mesh(points=points, cells=flat.cells, sides={names[k]: v for k, v in flat.sides.items()})


def only(mesh, side, **options):
    """The line that is the whole side."""
    [line] = Line.parts(mesh, side, **options)
    return line


def test_a_line_runs_so_that_body_2_lies_on_the_left():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (4, 2))
    for side, left, first, normal in (
        ("top", False, (0, 1), (0, 1)),
        ("top", True, (2, 1), (0, -1)),
        ("bottom", True, (0, 0), (0, 1)),
        ("right", False, (2, 1), (1, 0)),
        ("right", True, (2, 0), (-1, 0)),
    ):
        line = only(mesh, side, left=left)
        assert line.points[0].tolist() == list(first)
        assert (line.normals == normal).all()
        assert line.s[0] == 0
        assert (np.diff(line.s) > 0).all()


def test_normals_of_an_arc_are_bisectors_and_mirrored_where_an_end_stands_on_an_axis():
    mesh = ring((1.0, 2.0), (0.0, np.pi / 2), cells=(1, 8))
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[mesh.points[:, 1] < 1e-12, 1] = True
    line = only(mesh, "outer", left=False, mirrored=held)
    radial = line.points / 2
    order = np.argsort(np.arctan2(*line.points.T[::-1]))
    assert np.abs(line.normals - radial)[1:-1].max() <= 1e-14
    lower, upper = order[0], order[-1]
    assert line.normals[lower].tolist() == [1.0, 0.0]
    half_a_chord = np.pi / 32
    assert np.hypot(*(line.normals - radial)[upper]) == pytest.approx(2 * np.sin(half_a_chord / 2), rel=1e-9)


def disc(cells):
    """A disc of radius 1 with the side circle."""
    angles = 2 * np.pi * np.arange(cells) / cells
    points = np.vstack([np.column_stack([np.cos(angles), np.sin(angles)]), [[0, 0]]])
    edges = np.column_stack([np.arange(cells), np.roll(np.arange(cells), -1)])
    triangles = np.column_stack([edges, np.full(cells, cells)])
    return Mesh(points=points, cells=triangles, sides={"circle": edges})


def test_a_side_is_cut_at_its_corners_and_a_closed_one_far_from_given_points():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (4, 2))
    outline = Mesh(points=mesh.points, cells=mesh.cells, sides={"all": np.concatenate([*mesh.sides.values()])})
    parts = Line.parts(outline, "all", left=True)
    ends = [(line.points[0].tolist(), line.points[-1].tolist()) for line in parts]
    corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
    first = corners.index(ends[0][0])
    around = corners[first:] + corners[:first]
    assert ends == list(zip(around, [*around[1:], around[0]], strict=True))
    circle = disc(24)
    [line] = Line.parts(circle, "circle", left=True, away=np.array([[3.0, 0.0]]))
    assert line.points[0] == pytest.approx([-1, 0], abs=1e-12)
    assert (line.points[0] == line.points[-1]).all()
    assert len(line.nodes) == 25
    [line] = Line.parts(circle, "circle", left=True, away=np.array([[3.0, 0.0], [-1.2, 0.5], [-1.2, -0.5]]))
    assert line.points[0][0] > 0.5  # far from the nearest of them, not from the farthest


def test_parts_have_each_edge_of_a_side_once_where_two_parts_of_a_body_share_only_a_node():
    """Two triangles: at the node they share two edges begin, and each line through it ends there."""
    points = np.array([[0.0, 0], [-1, 1], [-1, -1], [1, -1], [1, 1]])
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2], [0, 3, 4]]), sides={})
    for edges in (mesh.boundary, mesh.boundary[1:]):
        lines = Line.parts(Mesh(points=points, cells=mesh.cells, sides={"line": edges}), "line", left=True)
        assert sorted(edge for line in lines for edge in pairwise(line.nodes.tolist())) == sorted(map(tuple, edges))
        assert all(0 not in line.nodes[1:-1] for line in lines)


@pytest.mark.parametrize("turn", [0.0, 0.7, 3.0])
def test_the_gap_of_concentric_arcs_is_that_of_the_circles_not_of_their_chords(turn):
    inner = ring((1.0, 2.0), (0.2, 1.3), cells=(1, 11), turn=turn)
    gaps = {}
    for cells in (7, 14):
        outer = ring((2.01, 3.0), (0.0, 1.5), cells=(1, cells), turn=turn)
        seen = only(inner, "outer", left=False).seen_from(only(outer, "inner", left=True))
        gaps[cells] = np.abs(seen.gap - 0.01)[1:-1].max()  # at the ends a normal is off by half a chord
        height = 2.01 * (1 - np.cos(1.5 / cells / 2))
        assert gaps[cells] <= 0.02 * height
    assert gaps[14] <= gaps[7] / 10


def test_a_constant_pressure_passes_from_line_to_line_and_positions_are_exact_on_straight_ones():
    rng = np.random.default_rng(0)
    for _ in range(20):
        angle, gap = rng.uniform(0, 2 * np.pi), rng.uniform(-0.01, 0.1)
        turn = rotation(angle)
        lower = rectangle((0.0, 1.0), (-0.5, 0.0), (int(rng.integers(1, 9)), 1))
        upper = rectangle((-0.3, 1.4), (gap, gap + 0.5), (int(rng.integers(1, 9)), 1))
        lower, upper = (Mesh(points=m.points @ turn, cells=m.cells, sides=m.sides) for m in (lower, upper))
        line, other = only(lower, "top", left=False), only(upper, "bottom", left=True)
        seen = line.seen_from(other)
        assert np.abs(seen.gap - gap).max() <= 1e-14
        assert np.abs(seen.s - (other.s - 0.3)).max() <= 1e-14
        P = mortar(line.s, seen.s)
        assert np.abs(P @ np.ones(len(seen.s)) - 1).max() <= 1e-12
        assert trapezoid(line.s) @ P @ seen.s == pytest.approx(0.5, abs=1e-12)


def bent(x, curvature, *, upper, cells=12):
    """A block whose top, or bottom if ``upper``, is a parabola of this curvature through the origin."""
    flat = rectangle(x, (0.0, 1.0), (cells, 1))
    near = 1 - flat.points[:, 1] if upper else flat.points[:, 1]
    y = near * curvature * flat.points[:, 0] ** 2 / 2 + (1 - near) * (1.0 if upper else -1.0)
    return Mesh(points=np.column_stack([flat.points[:, 0], y]), cells=flat.cells, sides=flat.sides)


@pytest.mark.parametrize("cells", [10, 12])
def test_normals_between_two_equal_cylinders_are_vertical_and_half_as_steep_on_a_plane(cells):
    """The mean of both surfaces, each at the place that this mean meets."""
    round_one = only(bent((-0.3, 0.3), 1.0, upper=True), "bottom", left=True)
    image = only(bent((-0.3, 0.3), -1.0, upper=False), "top", left=False)
    assert np.abs(image.normals[:, 0]).max() > 0.2
    for line, other in ((round_one, image), (image, round_one)):
        assert line.facing(other).normals.tolist() == [[0.0, 1.0]] * 13
    plane = only(rectangle((-0.5, 0.5), (-1.0, 0.0), (cells, 1)), "top", left=False)
    tilt = lambda line: line.normals[:, 0] / line.normals[:, 1]
    half = round_one.facing(plane)
    assert np.abs(tilt(half) - tilt(round_one) / 2).max() <= 0.02 * np.abs(tilt(round_one)).max()
    on_plane = plane.facing(round_one)
    slopes = np.interp(on_plane.points[:, 0], round_one.points[:, 0], tilt(round_one))
    assert np.abs(tilt(on_plane) - slopes / 2).max() <= 0.02 * np.abs(slopes).max()


def test_the_part_of_a_line_that_faces_another_is_cut_to_whole_edges():
    lower = only(rectangle((0.0, 1.0), (-0.5, 0.0), (5, 1)), "top", left=False)
    for ends, kept in (((0.1, 0.7), [0.2, 0.4, 0.6]), ((-1, 0.4), [0.0, 0.2, 0.4]), ((0.2, 0.4), [0.2, 0.4])):
        upper = only(rectangle(ends, (0.0, 0.5), (4, 1)), "bottom", left=True)
        assert lower.facing(upper).points[:, 0] == pytest.approx(kept)
    for ends in ((0.25, 0.35), (0.2, 0.35), (1.5, 2.0)):
        upper = only(rectangle(ends, (0.0, 0.5), (4, 1)), "bottom", left=True)
        with pytest.raises(MeshError, match=r"does not face .*nor any edge"):
            lower.facing(upper)
    with pytest.raises(MeshError, match="does not face"):
        lower.facing(only(rectangle((0.0, 1.0), (0.1, 0.5), (4, 1)), "top", left=True))


def test_a_line_that_faces_another_only_in_part_is_refused_with_the_place():
    lower = rectangle((0.0, 1.0), (-0.5, 0.0), (4, 1))
    upper = rectangle((0.0, 0.6), (0.0, 0.5), (4, 1))
    line, other = only(lower, "top", left=False), only(upper, "bottom", left=True)
    assert other.seen_from(line).s[[0, -1]].tolist() == [0.0, 1.0]
    with pytest.raises(MeshError, match=r"does not face \(0.75, 0\)"):
        line.seen_from(other)


def test_tolerances_along_a_line_are_those_of_the_line_not_of_the_body():
    """Parts of 1e-8 of the extents of both bodies, one of three cells and one of two."""
    lower, upper = rectangle((0.0, 1e-8), (-1.0, 0.0), (3, 1)), rectangle((0.0, 1e-8), (0.0, 1.0), (2, 1))
    line, other = only(lower, "top", left=False), only(upper, "bottom", left=True)
    seen = line.facing(other).seen_from(other)
    assert seen.s == pytest.approx([0.0, 0.5e-8, 1e-8], rel=1e-12)


def test_of_two_edges_above_a_node_the_nearer_one_there_is_met():
    """The farther one begins lower: what counts is where the normal meets it."""
    flat = Line(nodes=np.arange(2), points=np.array([[1.0, 0.0], [1.2, 0.0]]), normals=np.tile([0.0, 1.0], (2, 1)))
    straight = [[x, 0.9 + x / 10] for x in (-1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0)]
    folded = np.array([[0.0, 0.1], [2.0, 3.0], [-1.1, 3.0], *straight])
    other = Line(nodes=np.arange(10), points=folded, normals=np.tile([0.0, -1.0], (10, 1)))
    assert flat.seen_from(other).gap == pytest.approx([1.0, 1.02])


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_normals_that_cross_before_they_meet_the_other_line_are_refused_whatever_the_size(size):
    """Half as steep as those of a hollow arc, they meet near a diameter above it: a line beyond would be reversed."""
    hollow = ring((size, 2 * size), (1.25 * np.pi, 1.75 * np.pi))
    line = only(hollow, "inner", left=False)
    for level, crossed in ((-0.2, False), (0.5, False), (1.5, True)):
        flat = rectangle((-size, size), (level * size, (level + 1) * size), (4, 2))
        other = only(flat, "bottom", left=True)
        if crossed:
            with pytest.raises(MeshError, match="normals that cross near"):
                line.facing(other)
        else:
            assert (np.diff(line.facing(other).seen_from(other).s) > 0).all()

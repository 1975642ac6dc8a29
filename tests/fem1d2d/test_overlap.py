"""Cells side by side: nothing twice, nothing on top of another, and no valid mesh refused."""

from fractions import Fraction
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import fewer, in_floats, lines, numbers, plane_meshes

from fem1d2d import Mesh, MeshError, interval, rectangle
from fem1d2d.mesh import measures


def joined(*meshes):
    """One mesh of several, each with its own nodes."""
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    return {
        "points": np.concatenate([mesh.points for mesh in meshes]),
        "cells": np.concatenate([mesh.cells + k for mesh, k in zip(meshes, first[:-1], strict=True)]),
        "sides": {},
    }


def box(x, y, cells=(2, 2)):
    return rectangle(x, y, cells)


def copies(mesh, places):
    """One mesh of many like one, each moved and with its own nodes."""
    first = len(mesh.points) * np.arange(len(places))[:, None, None]
    points, cells = np.array(places)[:, None] + mesh.points, first + mesh.cells
    return {"points": points.reshape(-1, 2), "cells": cells.reshape(-1, 3), "sides": {}}


def turned(mesh, angle, about=(0.0, 0.0)):
    c, s = np.cos(angle), np.sin(angle)
    return Mesh(points=(mesh.points - about) @ np.array([[c, s], [-s, c]]) + about, cells=mesh.cells, sides={})


def triangles(points, cells):
    return {"points": np.array(points, dtype=float), "cells": np.array(cells), "sides": {}}


def disc(rings, around, radius=1.0, centre=(0.0, 0.0)):
    """A disc in rings of triangles around its centre."""
    angle = 2 * np.pi * np.arange(around) / around
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([[[0.0, 0.0]], *(circle * r / rings for r in range(1, rings + 1))]) * radius + centre
    i, j = np.arange(around), (np.arange(around) + 1) % around
    cells = [np.column_stack([0 * i, 1 + i, 1 + j])]
    for ring in range(1, rings):
        inner, outer = 1 + (ring - 1) * around, 1 + ring * around
        cells += [
            np.column_stack([inner + i, outer + i, outer + j]),
            np.column_stack([inner + i, outer + j, inner + j]),
        ]
    return {"points": points, "cells": np.concatenate(cells), "sides": {}}


# --- accepted ---------------------------------------------------------------------------------------------------------

HOLLOW = rectangle((0.0, 3.0), (0.0, 3.0), (3, 3))
HOLLOW = Mesh(points=HOLLOW.points, cells=[c for c in HOLLOW.cells.tolist() if not set(c) <= {5, 6, 9, 10}], sides={})
TOUCHING = triangles([[0, 0], [1, 0], [1, 1], [2, 1], [2, 2]], [[0, 1, 2], [2, 3, 4]])
PIECES = {
    "apart": joined(box((0.0, 1.0), (0.0, 1.0)), box((2.0, 3.0), (0.0, 1.0))),
    "one above the other": joined(box((0.0, 1.0), (0.0, 1.0)), box((0.0, 1.0), (2.0, 3.0), (3, 1))),
    "a hole": {"points": HOLLOW.points, "cells": HOLLOW.cells, "sides": {}},
    "an island in a hole": joined(HOLLOW, box((1.25, 1.75), (1.25, 1.75))),
    "a hole in an island in a hole": joined(
        HOLLOW,
        Mesh(points=1.1 + HOLLOW.points / 4, cells=HOLLOW.cells, sides={}),
        box((1.4, 1.45), (1.4, 1.45), (1, 1)),
    ),
    "two cells with one common node": TOUCHING,
    "two corners at one place": joined(box((0.0, 1.0), (0.0, 1.0)), box((1.0, 2.0), (1.0, 2.0))),
    "two corners at one place up to rounding": joined(box((0.0, 0.3), (0.0, 0.3)), box((0.1 + 0.2, 1.0), (0.3, 1.0))),
    "two corners that rounding pushes into each other": joined(
        box((0.0, 0.1 + 0.2), (0.0, 0.1 + 0.2)), box((0.3, 1.0), (0.3, 1.0))
    ),
    "a disc with 5000 nearly straight corners": disc(1, 5000),
    "a disc far away": disc(3, 300, 1.0, (1e6, -1e6)),
    "a small disc": disc(3, 300, 1e-9, (1.0, 1.0)),
    "an upright side with nodes off by rounding": triangles(
        [[0.1 * 3, 0.0], [2.0, 1.0], [0.3, 1.0], [0.1 + 0.2, 2.0]], [[0, 1, 2], [1, 3, 2]]
    ),
    "a level side with nodes off by rounding": triangles(
        [[0.0, 0.1 * 3], [1.0, 2.0], [1.0, 0.3], [2.0, 0.1 + 0.2]], [[0, 2, 1], [1, 2, 3]]
    ),
    "a flat strip": joined(box((0.0, 2.0), (0.0, 1e-14), (40, 2))),
    "a strip turned by 30 degrees": joined(turned(box((0.0, 2.0), (0.0, 1e-3), (400, 1)), np.pi / 6)),
    "cells that shrink towards a corner by 2^-100": triangles(
        [[0, 0], *([x, y] for k in range(101) for x, y in ((2.0**-k, 0), (2.0**-k, 2.0**-k)))],
        [[0, 201, 202], *(t for k in range(0, 200, 2) for t in ([k + 3, k + 1, k + 2], [k + 3, k + 2, k + 4]))],
    ),
    "300 squares": copies(
        box((0.0, 1.0), (0.0, 1.0), (1, 1)), [(2.0 * i, 3.0 * j) for i in range(20) for j in range(15)]
    ),
    "a comb": copies(box((0.0, 0.5 / 500), (0.0, 1.0), (1, 1)), [(i / 500, 0.0) for i in range(500)]),
    "spokes": joined(*(turned(box((1.0, 2.0), (-0.02, 0.02), (3, 1)), a) for a in np.arange(0, 6.28, 0.1))),
}  # fmt: skip


@pytest.mark.parametrize("mesh", PIECES.values(), ids=PIECES)
def test_pieces_holes_and_curves_are_no_overlap(mesh):
    made = Mesh(**mesh)
    assert len(made.boundary)
    assert (measures(made.points, made.cells) > 0).all()


@fewer(2)
@given(plane_meshes(most=3), st.floats(0, 7), st.floats(-1e3, 1e3), st.floats(-12, 12))
def test_a_mesh_that_is_turned_moved_and_magnified_stays_one(mesh, angle, shift, exponent):
    mesh = in_floats(mesh)
    moved = turned(mesh, angle).points * 10**exponent + shift * 10**exponent
    assert len(Mesh(points=moved, cells=mesh.cells, sides=mesh.sides).boundary) == len(mesh.boundary)


# --- refused ----------------------------------------------------------------------------------------------------------

UNIT = box((0.0, 1.0), (0.0, 1.0))
FAULTS = {
    "every cell twice": (
        {"points": UNIT.points, "cells": np.concatenate([UNIT.cells, UNIT.cells])},
        "cells 0 and 8 have the same nodes: each cell is needed once",
    ),
    "every cell twice, from another corner on": (
        {"points": UNIT.points, "cells": np.concatenate([UNIT.cells, np.roll(UNIT.cells, 1, axis=1)])},
        "cells 0 and 8 have the same nodes",
    ),
    "every cell twice with nodes of its own": (joined(UNIT, UNIT), "touch, but their cells are not joined"),
    "every cell twice with nodes off by rounding": (
        joined(UNIT, Mesh(points=UNIT.points * (1 + 2e-16), cells=UNIT.cells, sides={})),
        "touch, but their cells are not joined",
    ),
    "two cells on one side of an edge": (
        triangles([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 1, 2], [0, 1, 3]]),
        r"cells 0 and 1 lie on the same side of the facet from \(0, 0\) to \(1, 0\)",
    ),
    "three cells on one edge": (
        triangles([[0, 0], [1, 0], [0, 1], [1, -1], [1, 1]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]]),
        "cells 0 and 2 lie on the same side",
    ),
    "crossing squares": (
        joined(box((0.0, 2.0), (0.0, 2.0)), box((1.5, 3.5), (1.5, 3.5))),
        r"the boundary edges from \(.*\) to \(.*\) and from \(.*\) to \(.*\) cross: cells lie on each other",
    ),
    "a cross of two bars": (joined(box((-2.0, 2.0), (-0.1, 0.1)), box((-0.1, 0.1), (-2.0, 2.0))), "cross"),
    "a square inside a cell": (
        joined(box((0.0, 3.0), (0.0, 3.0), (1, 1)), box((1.0, 1.1), (2.0, 2.1), (1, 1))),
        r"the boundary edge from \(1(.1)?, 2(.1)?\) to \(1(.1)?, 2(.1)?\) lies inside another cell",
    ),
    "a mesh around all cells of another": (
        joined(box((0.0, 1.0), (0.0, 1.0)), box((-1.0, 2.0), (-1.0, 2.0), (1, 1))),
        "lies inside another cell",
    ),
    "a cell inside the fan of its node": (
        triangles([[0, 0], [3, -1], [3, 1], [1, -0.1], [1, 0.1]], [[0, 1, 2], [0, 3, 4]]),
        "lies inside another cell",
    ),
    "a fan of more than a full turn": (
        triangles(
            [[0, 0], *((0.9**k * np.array([np.cos(k), np.sin(k)])).tolist() for k in range(9))],
            [[0, k, k + 1] for k in range(1, 9)],
        ),
        "cross|inside another cell",
    ),
    "a hanging node": (
        triangles([[0, 0], [2, 0], [1, 1], [1, 0], [0.5, -1], [1.5, -1]], [[0, 1, 2], [0, 4, 3], [3, 5, 1]]),
        "touch, but their cells are not joined",
    ),
    "a hanging node off by rounding": (
        triangles([[0, 0], [0.3, 0.9], [0, 1], [0.1, 0.1 * 3], [1, 0]], [[0, 1, 2], [0, 4, 3], [3, 4, 1]]),
        "touch, but their cells are not joined",
    ),
    "grids side by side that do not match": (
        joined(box((0.0, 1.0), (0.0, 1.0), (2, 2)), box((1.0, 2.0), (0.0, 1.0), (2, 3))),
        "touch, but their cells are not joined",
    ),
    "a slit of doubled nodes": (
        joined(box((0.0, 1.0), (0.0, 1.0)), box((1.0, 2.0), (0.0, 1.0))),
        "touch, but their cells are not joined",
    ),
    "a corner on an edge": (
        joined(box((0.0, 1.0), (0.0, 1.0), (1, 1)), turned(box((0.5, 1.5), (1.0, 2.0)), np.pi / 4, (0.5, 1.0))),
        "touch, but their cells are not joined",
    ),
}


@pytest.mark.parametrize(("mesh", "message"), FAULTS.values(), ids=FAULTS)
def test_cells_that_lie_on_each_other_or_are_not_joined_are_refused(mesh, message):
    with pytest.raises(MeshError, match=message):
        Mesh(**{"sides": {}} | mesh)


@given(plane_meshes(most=3, exact=True), st.data())
def test_no_cell_can_be_added_between_the_nodes_of_a_parallelogram(mesh, data):
    """It is full: any further cell lies on others."""
    nodes = data.draw(st.permutations(range(len(mesh.points))).map(lambda order: list(order[:3])))
    if measures(mesh.points, np.array([nodes]))[0] < 0:
        nodes = nodes[::-1]
    with pytest.raises(MeshError, match=r"no positive area|same nodes|same side|cross|touch|inside another cell"):
        Mesh(points=in_floats(mesh).points, cells=[*mesh.cells.tolist(), nodes], sides={})


squares = st.tuples(numbers(-2, 2, 4), numbers(-2, 2, 4), numbers(Fraction(1, 4), 2, 4), numbers(Fraction(1, 4), 2, 4))


@given(squares, squares, st.integers(1, 3), st.integers(1, 3), st.booleans())
def test_two_rectangles_fit_together_unless_they_share_more_than_corners(one, other, n, m, exact):
    low, high, gaps = [], [], []
    number = Fraction if exact else float
    meshes = []
    for (x, y, width, height), cells in ((one, (n, m)), (other, (m, n))):
        ends = [tuple(map(number, pair)) for pair in ((x, x + width), (y, y + height))]
        meshes.append(rectangle(*ends, cells))
        low.append((x, y))
        high.append((x + width, y + height))
    gaps = [max(low[0][k], low[1][k]) - min(high[0][k], high[1][k]) for k in range(2)]
    at_corners = max(gaps) == 0 == min(gaps)
    if max(gaps) > 0 or at_corners:
        assert len(Mesh(**joined(*meshes)).boundary) == sum(len(mesh.boundary) for mesh in meshes)
    else:
        with pytest.raises(MeshError, match="cross|inside another cell|not joined" if max(gaps) < 0 else "not joined"):
            Mesh(**joined(*meshes))


@given(plane_meshes(most=3), st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(0, 7))
def test_a_copy_moved_onto_a_mesh_is_refused(mesh, x, y, angle):
    """Turned about and moved within the first cell: whatever the meshes, some point lies in two cells."""
    mesh = in_floats(mesh)
    centre = mesh.points[mesh.cells[0]].mean(axis=0)
    inside = np.abs(mesh.points[mesh.cells[0]] - centre).min(axis=0) * 0.1
    copy = turned(mesh, angle, centre)
    copy = Mesh(points=copy.points + inside * (x, y), cells=mesh.cells, sides={})
    with pytest.raises(MeshError, match=r"cross|inside another cell|touch, but"):
        Mesh(**joined(mesh, copy))


def test_a_wide_strip_of_cells_is_judged_in_time_near_linear():
    """40,002 boundary edges: by pairs they would be 8 * 10^8."""
    mesh = rectangle((0.0, 1.0), (0.0, 1.0), (1, 20_000))
    assert len(mesh.boundary) == 40_002
    with pytest.raises(MeshError, match=r"cross|touch|inside"):
        Mesh(**joined(mesh, box((0.5, 0.7), (0.5, 0.7))))


def common(one, other):
    """The common part of two triangles by clipping, as a set of corners; exact."""
    part = one
    for a, b in pairwise([*other, other[0]]):
        side = lambda p, a=a, b=b: (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
        kept = []
        for p, q in pairwise([*part, *part[:1]]) if len(part) > 1 else [(p, p) for p in part]:
            if side(p) >= 0:
                kept.append(p)
            if side(p) * side(q) < 0:
                t = side(p) / (side(p) - side(q))
                kept.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
        part = list(dict.fromkeys(kept))
    return set(part)


def fit(points, one, other):
    """Whether two cells meet in nothing, a corner of both, or an edge with common nodes; by definition."""
    shared = common([points[n] for n in one], [points[n] for n in other])
    corners = {points[n] for n in one} & {points[n] for n in other}
    if len(shared) == 2 and shared <= corners:
        return len(set(one) & set(other)) == 2
    return not shared or (len(shared) == 1 and shared <= corners)


@st.composite
def few_triangles(draw):
    """Two to four positively oriented triangles between points of a small grid, some of them doubled."""
    points = draw(st.lists(st.tuples(*[numbers(0, 3, 1)] * 2), min_size=4, max_size=8, unique=draw(st.booleans())))
    cells = []
    for _ in range(draw(st.integers(2, 4))):
        a, b, c = draw(st.permutations(range(len(points))))[:3]
        area = (points[b][0] - points[a][0]) * (points[c][1] - points[a][1])
        area -= (points[b][1] - points[a][1]) * (points[c][0] - points[a][0])
        if area:
            cells.append((a, b, c) if area > 0 else (a, c, b))
    return points, cells


@given(few_triangles(), st.booleans())
def test_triangles_make_a_mesh_if_and_only_if_each_two_meet_as_a_mesh_defines(given_mesh, exact):
    points, cells = given_mesh
    assume(cells)
    used = sorted({n for cell in cells for n in cell})
    kind = {"dtype": object if exact else float}
    make = lambda: Mesh(
        points=np.array([points[n] for n in used], **kind),
        cells=np.array([[used.index(n) for n in cell] for cell in cells]),
        sides={},
    )
    if all(fit(points, one, other) for one, other in combinations(cells, 2)):
        assert len(make().cells) == len(cells)
    else:
        with pytest.raises(MeshError):
            make()


# --- one dimension ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("points", "cells", "message"),
    [
        ([0, 1, 2], [[0, 1], [1, 2], [0, 1]], "cells 0 and 2 have the same nodes"),
        ([0, 1, 2], [[0, 1], [0, 2]], r"cells 0 and 1 lie on the same side of the facet at \(0\)"),
        ([0, 1, 2, 3], [[0, 2], [1, 3]], "cells 0 and 1 lie on each other"),
        ([0, 1, 1, 2], [[0, 1], [2, 3]], "without a common node"),
        ([1, 2, 0, 1], [[0, 1], [2, 3]], "without a common node"),
        ([0, 3, 1, 2], [[0, 1], [2, 3]], "cells 0 and 1 lie on each other"),
    ],
)
def test_cells_of_a_line_that_lie_on_each_other_are_refused(points, cells, message):
    with pytest.raises(MeshError, match=message):
        Mesh(points=np.array(points, dtype=float)[:, None], cells=cells, sides={})


@given(lines(), lines())
def test_two_lines_apart_are_one_mesh(one, other):
    one, other = in_floats(one), in_floats(other)
    shift = one.points.max() - other.points.min() + 0.5
    other = Mesh(points=other.points + shift, cells=other.cells, sides={})
    assert len(Mesh(**joined(one, other)).boundary) == 4


# --- sides ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("facets", "message"),
    [
        ([[0, 1], [0, 1]], r"side 'base' lists the facet from \(0, 0\) to \(0, 0.5\) 2 times: once is needed"),
        ([[0, 1], [1, 0]], "2 times"),
        ([[0, 1], [1, 2], [1, 0], [0, 1]], "3 times"),
        ([[0, 4]], r"side 'base' has a facet from \(0, 0\) to \(0.5, 0.5\), which is none of the boundary"),
        ([[0, 2]], r"from \(0, 0\) to \(0, 1\), which is none of the boundary"),
        ([[1, 1]], "none of the boundary"),
        ([[0], [1]], r"side 'base' of shape \(2, 1\): \(s, 2\) is needed"),
        ([[0.0, 1.0]], "side 'base' hold float64 numbers: whole ones are needed"),
    ],
)
def test_a_side_lists_edges_of_the_boundary_once_each(facets, message):
    with pytest.raises(MeshError, match=message):
        Mesh(points=UNIT.points, cells=UNIT.cells, sides={"base": np.array(facets)})


@pytest.mark.parametrize(("facets", "message"), [([[0], [0]], "at \\(0\\) 2 times"), ([[1]], "none of the boundary")])
def test_a_side_of_a_line_is_one_of_its_ends(facets, message):
    line = interval((0.0, 1.0), 2)
    with pytest.raises(MeshError, match=message):
        Mesh(points=line.points, cells=line.cells, sides={"left": np.array(facets)})


def test_sides_may_share_edges_and_hold_none():
    sides = {"left": [[0, 1], [1, 2]], "half": [[1, 0]], "none": []}
    mesh = Mesh(points=UNIT.points, cells=UNIT.cells, sides=sides)
    assert {name: facets.shape for name, facets in mesh.sides.items()} == {
        "left": (2, 2),
        "half": (1, 2),
        "none": (0, 2),
    }


@pytest.mark.parametrize(
    ("points", "message"),
    [([[0, 0], [1e31, 0], [0, 1e31]], "a coordinate is 1e.31: at most 1e.30 is needed"), ([["a", "b"]], "points")],
)
def test_points_are_numbers_that_products_can_hold(points, message):
    with pytest.raises(MeshError, match=message):
        Mesh(points=np.array(points), cells=[[0, 1, 2]], sides={})

"""Intervals, rectangles and the constructor's refusals."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer, in_floats, lines, meshes, numbers, plane_meshes, renumbered

from fem1d2d import Mesh, MeshError, interval, rectangle, sector
from fem1d2d.mesh import LARGEST, crossed, measures

sizes = numbers(Fraction(1, 4), 3, 12)
counts = st.integers(1, 5)


def edges(facets):
    """Facets as a set of sets of nodes."""
    return {frozenset(facet) for facet in np.asarray(facets).tolist()}


def all_edges(mesh):
    return [frozenset((a, b)) for cell in mesh.cells.tolist() for a, b in pairwise([*cell, cell[0]])]


# --- intervals --------------------------------------------------------------------------------------------------------


@given(numbers(-3, 3, 12), sizes, counts)
def test_an_interval_is_its_equal_cells_from_left_to_right(a, length, n):
    mesh = interval((a, a + length), n)
    assert mesh.dimension == 1
    assert mesh.points[:, 0].tolist() == [a + length * i / n for i in range(n + 1)]
    assert mesh.cells.tolist() == [[i, i + 1] for i in range(n)]
    assert {side: facets.tolist() for side, facets in mesh.sides.items()} == {"left": [[0]], "right": [[n]]}


@given(numbers(-3, 3, 12), sizes, counts)
def test_an_interval_in_floats_is_the_rational_one_to_two_roundings_and_has_its_ends(a, length, n):
    mesh, exact = interval((float(a), float(a + length)), n), interval((a, a + length), n)
    assert mesh.points.dtype == float
    assert mesh.points[[0, -1], 0].tolist() == [float(a), float(a + length)]
    np.testing.assert_allclose(mesh.points, exact.points.astype(float), rtol=0, atol=2 * np.finfo(float).eps * 6)


@given(lines())
def test_the_boundary_of_a_line_is_its_two_ends(mesh):
    assert sorted(mesh.boundary.ravel().tolist()) == [0, len(mesh.points) - 1]


# --- rectangles -------------------------------------------------------------------------------------------------------


@fewer(3, at_night=1)
@given(numbers(-3, 3, 12), sizes, numbers(-3, 3, 12), sizes, counts, counts)
def test_a_rectangle_numbers_its_grid_upwards_first(a, width, b, height, nx, ny):
    mesh = rectangle((a, a + width), (b, b + height), (nx, ny))
    grid = [[a + width * i / nx, b + height * j / ny] for i in range(nx + 1) for j in range(ny + 1)]
    assert mesh.points.tolist() == grid


@given(counts, counts)
def test_diagonals_go_up_to_the_right_where_i_plus_j_is_even_and_down_where_it_is_odd(nx, ny):
    mesh = rectangle((0.0, 1.0), (0.0, 1.0), (nx, ny))
    node = lambda i, j: i * (ny + 1) + j
    expected = set()
    for i in range(nx):
        for j in range(ny):
            sw, se, nw, ne = node(i, j), node(i + 1, j), node(i, j + 1), node(i + 1, j + 1)
            low, high = (nw, se) if (i + j) % 2 == 0 else (sw, ne)  # the corners that the diagonal does not touch
            diagonal = {sw, se, nw, ne} - {low, high}
            expected |= {frozenset(diagonal | {low}), frozenset(diagonal | {high})}
    assert {frozenset(cell) for cell in mesh.cells.tolist()} == expected
    assert len(mesh.cells) == 2 * nx * ny


@given(sizes, sizes, counts, counts)
def test_triangles_of_a_rectangle_are_halves_of_its_cells(width, height, nx, ny):
    mesh = rectangle((Fraction(0), width), (Fraction(0), height), (nx, ny))
    assert (measures(mesh.points, mesh.cells) == width * height / (2 * nx * ny)).all()


@given(counts, counts)
def test_the_boundary_of_a_rectangle_is_the_disjoint_union_of_its_sides(nx, ny):
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (nx, ny))
    assert {side: len(facets) for side, facets in mesh.sides.items()} == {
        "left": ny, "right": ny, "bottom": nx, "top": nx
    }  # fmt: skip
    assert len(mesh.boundary) == 2 * (nx + ny)
    assert set().union(*[edges(facets) for facets in mesh.sides.values()]) == edges(mesh.boundary)


@fewer(3, at_night=1)
@given(sizes, sizes, counts, counts)
def test_each_side_of_a_rectangle_lies_where_its_name_says(width, height, nx, ny):
    mesh = rectangle((Fraction(0), width), (Fraction(0), height), (nx, ny))
    for side, axis, level in [("left", 0, 0), ("right", 0, width), ("bottom", 1, 0), ("top", 1, height)]:
        assert (mesh.points[mesh.sides[side]][..., axis] == level).all()


@fewer(3, at_night=1)
@given(plane_meshes(most=3))
def test_a_mesh_of_a_disc_is_conforming_and_obeys_euler(mesh):
    count = {edge: all_edges(mesh).count(edge) for edge in all_edges(mesh)}
    assert {edge for edge, n in count.items() if n == 1} == edges(mesh.boundary)
    assert set(count.values()) <= {1, 2}
    assert len(mesh.points) - len(count) + len(mesh.cells) == 1


@fewer(3, at_night=1)
@given(plane_meshes(most=3))
def test_the_body_lies_to_the_left_of_its_boundary(mesh):
    start, end = (mesh.points[mesh.boundary[:, i]] for i in range(2))
    assert sorted(mesh.boundary[:, 0].tolist()) == sorted(mesh.boundary[:, 1].tolist())  # closed
    assert (start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]).sum() / 2 == measures(mesh.points, mesh.cells).sum()
    cell = {edge: cell for cell in mesh.cells.tolist() for edge in pairwise([*cell, cell[0]])}
    for edge in map(tuple, mesh.boundary.tolist()):
        a, b, inner = *edge, (set(cell[edge]) - set(edge)).pop()
        assert measures(mesh.points, np.array([[a, b, inner]]))[0] > 0


@fewer(3, at_night=1)
@given(meshes(), st.randoms(use_true_random=False))
def test_renumbering_nodes_renames_the_boundary(mesh, random):
    order = random.sample(range(len(mesh.points)), len(mesh.points))
    assert edges(np.array(order)[renumbered(mesh, order).boundary]) == edges(mesh.boundary)


def test_the_boundary_of_an_annulus_has_two_circles():
    mesh = rectangle((0.0, 3.0), (0.0, 3.0), (3, 3))
    middle = {5, 6, 9, 10}
    hollow = Mesh(points=mesh.points, cells=[c for c in mesh.cells.tolist() if not set(c) <= middle], sides={})
    inner_edges = {frozenset(e) for e in [(5, 6), (6, 10), (9, 10), (5, 9)]}
    assert edges(hollow.boundary) == edges(mesh.boundary) | inner_edges


@given(st.floats(-6, 6), st.floats(0.1, 6.2), st.integers(1, 4), counts)
def test_a_sector_has_the_area_of_its_polygon_and_its_sides_lie_on_both_rays_and_the_arc(first, opening, arcs, n):
    radii = np.geomspace(1e-12, 1, arcs)
    n += 2 * int(opening)  # at most half a turn for each cell
    mesh = sector((first, first + opening), radii, n)
    assert measures(mesh.points, mesh.cells).sum() == pytest.approx(n * np.sin(opening / n) / 2 * radii[-1] ** 2)
    assert set().union(*[edges(facets) for facets in mesh.sides.values()]) == edges(mesh.boundary)
    for side, angle in (("first", first), ("second", first + opening)):
        inner, outer = mesh.points[mesh.sides[side]].transpose(1, 0, 2)
        assert np.hypot(*outer.T) == pytest.approx(radii)
        assert np.hypot(*inner.T) == pytest.approx([0, *radii[:-1]])
        assert outer @ [-np.sin(angle), np.cos(angle)] == pytest.approx(0 * radii, abs=1e-12)
        assert (outer @ [np.cos(angle), np.sin(angle)] > 0).all()
    assert np.hypot(*mesh.points[mesh.sides["arc"]].reshape(-1, 2).T) == pytest.approx(radii[-1])


# --- frozen -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("array", [lambda m: m.points, lambda m: m.cells, lambda m: m.sides["top"]])
def test_the_arrays_of_a_mesh_are_read_only(array):
    mesh = rectangle((0.0, 1.0), (0.0, 1.0), (1, 1))
    with pytest.raises(ValueError, match="read-only"):
        array(mesh)[0] = 0


def test_the_sides_of_a_mesh_cannot_be_replaced():
    mesh = rectangle((0.0, 1.0), (0.0, 1.0), (1, 1))
    with pytest.raises(TypeError):
        mesh.sides["top"] = mesh.sides["bottom"]
    with pytest.raises(AttributeError):
        mesh.sides = {}


def test_a_mesh_keeps_nothing_of_the_arrays_it_was_made_from():
    points, cells, facets = np.array([[0.0], [1.0], [2.0]]), np.array([[0, 1], [1, 2]]), np.array([[0]])
    sides = {"left": facets}
    mesh = Mesh(points=points[:], cells=cells[:], sides=sides)
    points[1], cells[0], facets[0] = 5.0, [1, 2], 2
    sides["right"] = facets
    assert (mesh.points[1, 0], mesh.cells[0].tolist()) == (1.0, [0, 1])
    assert {side: f.tolist() for side, f in mesh.sides.items()} == {"left": [[0]]}


# --- refusals ---------------------------------------------------------------------------------------------------------

SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


def make(points, cells, **sides):
    return Mesh(points=np.array(points), cells=np.array(cells), sides=sides)


@pytest.mark.parametrize(
    ("points", "cells", "message"),
    [
        ([0.0, 1.0], [[0, 1]], r"points of shape \(2,\): \(n, 1\) or \(n, 2\) is needed"),
        ([[0.0, 0.0, 0.0]] * 3, [[0, 1, 2]], r"points of shape \(3, 3\)"),
        (np.empty((3, 0)), [[0, 1, 2]], r"points of shape \(3, 0\)"),
        (SQUARE, [[0, 1]], r"cells of shape \(1, 2\): \(c, 3\) with c >= 1 is needed"),
        (SQUARE, [0, 1, 2], r"cells of shape \(3,\)"),
        (SQUARE, np.empty((0, 3)), r"cells of shape \(0, 3\): \(c, 3\) with c >= 1"),
        ([[0.0], [1.0]], [[0, 1, 1]], r"cells of shape \(1, 3\): \(c, 2\)"),
        (SQUARE, [[0, 1, 2], [0, 2, 4]], "cells name node 4, the mesh has 4 nodes"),
        (SQUARE, [[0, 1, 2], [-2, -1, 0]], "cells name node -2, the mesh has 4 nodes"),
        (SQUARE, [[0, 1, 2], [0, 2, -1]], "cells name node -1, the mesh has 4 nodes"),
        ([[0.0, 0.0], [1.0, 0.0], [0.0, np.nan]], [[0, 1, 2]], "a coordinate is not finite"),
        ([[0.0], [np.inf]], [[0, 1]], "a coordinate is not finite"),
        (SQUARE, [[0, 1, 2], [0, 3, 2]], "cell 1 has no positive area"),
        (SQUARE, [[0, 1, 2], [0, 2, 2], [0, 2, 3]], "cell 1 has no positive area"),
        ([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], [[0, 1, 2]], "cell 0 has no positive area"),
        ([[0.0], [1.0]], [[1, 0]], "cell 0 has no positive length"),
        ([[0.0], [0.0]], [[0, 1]], "cell 0 has no positive length"),
        ([[0.0], [1.0], [1.0 + 1e-15]], [[0, 1], [1, 2], [2, 2]], "cell 2 has no positive length"),
        ([[0.0], [1e-50]], [[0, 1]], "cell 0 has the length 1e-50: at least 1e-40 is needed"),
        ([[0, 0], [1e20, 0], [0, 1e-105]], [[0, 1, 2]], "cell 0 has the area 5e-86: at least 1e-80 is needed"),
        (SQUARE, [[0, 1, 2]], "1 nodes belong to no cell"),
        ([[0.0], [1.0], [2.0], [3.0]], [[1, 2]], "2 nodes belong to no cell"),
        (np.array([[Fraction(0)], [Fraction(0)]]), [[0, 1]], "cell 0 has no positive length"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_refused_by_its_fault(points, cells, message):
    with pytest.raises(MeshError, match=message):
        make(points, cells)


@pytest.mark.parametrize(("facets", "node"), [([[2, 4]], 4), ([[-1, 0]], -1)])
def test_a_side_that_names_no_node_of_the_mesh_is_refused(facets, node):
    with pytest.raises(MeshError, match=f"side 'left' names? node {node}, the mesh has 4 nodes"):
        make(SQUARE, [[0, 1, 2], [0, 2, 3]], left=np.array(facets))


def test_the_same_points_are_accepted_once_the_fault_is_gone():
    mesh = make(SQUARE, [[0, 1, 2], [0, 2, 3]], left=np.array([[3, 0]]))
    assert measures(mesh.points, mesh.cells).tolist() == [0.5, 0.5]


@pytest.mark.parametrize("cells", [0, -1])
def test_a_grid_without_cells_is_refused(cells):
    message = f"{cells} cells: at least one is needed"
    with pytest.raises(MeshError, match=message):
        interval((0.0, 1.0), cells)
    for pair in [(cells, 1), (1, cells)]:
        with pytest.raises(MeshError, match=message):
            rectangle((0.0, 1.0), (0.0, 1.0), pair)


@pytest.mark.parametrize("ends", [(1.0, 0.0), (1.0, 1.0), (0.0, float("nan")), (Fraction(1), Fraction(1, 2))])
def test_ends_that_are_not_in_order_are_refused(ends):
    message = f"ends {ends[0]}, {ends[1]}: the first must be the smaller"
    with pytest.raises(MeshError, match=message):
        interval(ends, 2)
    for pair in [(ends, (0.0, 1.0)), ((0.0, 1.0), ends)]:
        with pytest.raises(MeshError, match=message):
            rectangle(*pair, (2, 2))


@pytest.mark.parametrize(
    ("angles", "radii", "cells", "message"),
    [
        ((0, 1), (1.0,), 0, "0 cells: at least one is needed"),
        ((1, 0), (1.0,), 2, "the first must be the smaller"),
        ((0, 7), (1.0,), 2, "less than 2 pi apart"),
        ((0, 1), (), 2, "growing positive numbers"),
        ((0, 1), (0.0, 1.0), 2, "growing positive numbers"),
        ((0, 1), (1.0, 0.5), 2, "growing positive numbers"),
    ],
)
def test_a_sector_that_is_none_is_refused(angles, radii, cells, message):
    with pytest.raises(MeshError, match=message):
        sector(angles, radii, cells)


def test_the_largest_coordinate_is_taken_and_the_double_beyond_it_is_refused():
    for sign in (1.0, -1.0):
        make([[0.0], [sign * LARGEST]], [[0, 1] if sign > 0 else [1, 0]])
        with pytest.raises(MeshError, match="at most"):
            make([[0.0], [sign * np.nextafter(LARGEST, np.inf)]], [[0, 1] if sign > 0 else [1, 0]])


def test_an_interval_too_short_for_its_floats_is_refused():
    with pytest.raises(MeshError, match="no positive length"):
        interval((1.0, float(np.nextafter(1.0, 2.0))), 3)


def by_both_diagonals(nx, ny):
    grid = rectangle((0.0, float(nx)), (0.0, float(ny)), (nx, ny)).points
    node = lambda i, j: i * (ny + 1) + j
    cells, middles = [], []
    for i in range(nx):
        for j in range(ny):
            around = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]
            cells += [[a, b, len(grid) + len(middles)] for a, b in pairwise([*around, around[0]])]
            middles.append(grid[around].mean(axis=0))
    return Mesh(points=np.vstack([grid, middles]), cells=np.array(cells), sides={})


@pytest.mark.parametrize(("nx", "ny"), [(1, 1), (3, 2), (4, 4)])
def test_quadrilaterals_split_by_both_diagonals_are_told_from_any_other_mesh(nx, ny):
    whole = by_both_diagonals(nx, ny)
    assert crossed(whole)
    assert not crossed(rectangle((0.0, 1.0), (0.0, 1.0), (nx, ny)))
    assert not crossed(interval((0.0, 1.0), nx))
    beside = rectangle((nx + 1.0, nx + 2.0), (0.0, 1.0), (2, 1))
    cells = np.vstack([whole.cells, beside.cells + len(whole.points)])
    assert not crossed(Mesh(points=np.vstack([whole.points, beside.points]), cells=cells, sides={}))


@fewer(3, at_night=1)
@given(plane_meshes())
def test_a_mesh_with_one_cell_turned_over_is_refused(mesh):
    cells = mesh.cells.copy()
    cells[-1] = cells[-1][::-1]
    with pytest.raises(MeshError, match=f"cell {len(cells) - 1} has no positive area"):
        Mesh(points=in_floats(mesh).points, cells=cells, sides={})

"""Points of a mesh: linear fields come back exactly, stresses are means of the cells around; others are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem1d2d import Mesh, MeshError, interval, means_at_nodes, node_at, place, rectangle
from fem1d2d.element import ELEMENTS, P1
from fem1d2d.trace import SAME, extent

SPLITS = st.sampled_from(["alternating", "both"])
SHARES = st.floats(0, 1)


@given(SPLITS, SHARES, SHARES, st.integers(1, 4), st.integers(1, 3))
def test_a_linear_field_has_its_own_value_at_every_point_of_a_body(split, s, t, nx, ny):
    mesh = rectangle((-1.0, 2.0), (0.5, 1.5), (nx, ny), split)
    point = np.array([-1 + 3 * s, 0.5 + t])
    found = place(mesh, point)
    distances = np.linalg.norm(mesh.points - point, axis=1)
    if distances.min() <= SAME * extent(mesh):  # as near as that it is the node
        point = mesh.points[distances.argmin()]
    assert found.of_nodes(mesh.points) == pytest.approx(point, abs=1e-12)
    assert found.weights.sum() == pytest.approx(1, abs=1e-12)
    assert found.of_nodes(mesh.points[:, 0] - 3 * mesh.points[:, 1]) == pytest.approx(point @ [1, -3], abs=1e-12)


def test_a_point_lies_in_one_cell_on_two_at_an_edge_and_in_all_around_a_node():
    mesh = rectangle((0.0, 2.0), (0.0, 2.0), (2, 2), "both")
    cells = np.arange(len(mesh.cells), dtype=float)
    for point, count in (((0.2, 0.5), 1), ((1.0, 0.5), 2), ((1.0, 1.0), 8), ((0.5, 0.5), 4), ((0.0, 0.0), 2)):
        found = place(mesh, np.array(point))
        assert len(found.cells) == count
        corners = mesh.points[mesh.cells[found.cells]]
        assert ((corners.min(axis=1) <= point) & (point <= corners.max(axis=1))).all()
        assert found.of_cells(cells) == pytest.approx(np.mean(found.cells))
    assert len(place(mesh, np.array([1.0, 1.0]), np.arange(4)).cells) == 2  # of the first rectangle alone


def test_means_at_nodes_of_a_bar_are_those_of_its_neighbours():
    assert means_at_nodes(interval((0.0, 3.0), 3), np.array([1.0, 2.0, 6.0])).tolist() == [1.0, 1.5, 4.0, 6.0]


@pytest.mark.parametrize("point", [(2.1, 0.5), (-1e-6, 0.0), (1.0, -0.2)])
def test_a_point_outside_is_refused_with_the_nearest_node(point):
    with pytest.raises(MeshError, match=r"lies outside the body, whose nearest node is \("):
        place(rectangle((0.0, 2.0), (0.0, 1.0), (2, 1)), np.array(point))


def test_inside_a_cell_of_another_element_there_are_values_at_its_nodes_only(monkeypatch):
    square = Mesh(points=np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), cells=np.array([[0, 1, 2, 3]]), sides={})
    bare = type("Bare", (P1,), {"supports": frozenset()})
    monkeypatch.setitem(ELEMENTS, (2, 4), bare("squares", "quad"))
    assert place(square, np.array([1.0, 1.0])).nodes.tolist() == [2]
    with pytest.raises(MeshError, match=r"no values inside the cells with squares: needed a node, the nearest one"):
        place(square, np.array([0.4, 0.4]))


@given(SHARES, SHARES)
def test_the_node_at_a_point_is_the_nearest_one(s, t):
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (4, 2))
    point = np.array([2 * s, t])
    found = node_at(mesh, point)
    distances = np.linalg.norm(mesh.points - point, axis=1)
    assert distances[found] == distances.min()


def test_a_point_more_than_half_an_edge_away_from_every_node_has_none():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 1))
    half = np.sqrt(2) / 2  # of a diagonal, the longest edge
    assert node_at(mesh, np.array([1.0, 1.0 + 0.99 * half])) == 3
    with pytest.raises(MeshError, match=r"no node lies within half an edge of \(1, 2\), the nearest one is \(1, 1\)"):
        node_at(mesh, np.array([1.0, 2.0]))

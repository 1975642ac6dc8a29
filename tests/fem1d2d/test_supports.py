"""Known displacements, and the rigid motions that they leave: the kernel of the stiffness matrix, by elimination."""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from strategies import fewer, in_floats, lines, plane_meshes

import fem1d2d
from fem1d2d import Material, Mesh, MeshError, interval, rectangle, stiffness, supports
from fem1d2d.supports import pieces

LAW = Material(lame_lambda=Fraction(1), lame_mu=Fraction(1))
SQUARE = rectangle((0.0, 1.0), (0.0, 1.0), (2, 2))
NODES = {side: np.unique(facets) for side, facets in SQUARE.sides.items()}


def nullity(mesh, known):
    """Dimension of the kernel of the stiffness matrix of the free unknowns, in rationals."""
    free = np.flatnonzero(~known.ravel())
    return len(free) - fem_oracle.rank(fem_oracle.stiffness(mesh, LAW)[np.ix_(free, free)])


def unknown(mesh):
    return np.zeros(mesh.points.shape, dtype=bool)


def beside(*pieces):
    """Meshes that share no node, as one mesh."""
    starts = np.cumsum([0, *[len(p.points) for p in pieces]])
    cells = [piece.cells + start for piece, start in zip(pieces, starts, strict=False)]
    return Mesh(points=np.concatenate([p.points for p in pieces]), cells=np.concatenate(cells), sides={})


# --- supports ---------------------------------------------------------------------------------------------------------


@given(st.dictionaries(st.sampled_from(sorted(NODES)), st.tuples(st.booleans(), st.booleans())))
def test_a_component_is_known_at_the_nodes_of_the_sides_that_prescribe_it(held):
    given_sides = {side: [0.0 if yes else None for yes in components] for side, components in held.items()}
    expected = unknown(SQUARE)
    for side, components in held.items():
        for node in NODES[side]:
            expected[node] |= components
    found = supports(SQUARE, given_sides)
    assert np.array_equal(found.held, expected)
    assert not found.values.any()


@given(st.sampled_from(sorted(NODES)), st.floats(-1, 1), st.one_of(st.none(), st.floats(-1, 1)))
def test_values_stand_where_they_are_prescribed_and_zero_elsewhere(side, ux, uy):
    found = supports(SQUARE, {side: [ux, uy]})
    expected = np.zeros((9, 2))
    expected[NODES[side]] = [ux, 0.0 if uy is None else uy]
    assert np.array_equal(found.values, expected)
    on_side = np.isin(np.arange(9), NODES[side])
    assert np.array_equal(found.held, np.column_stack([on_side, on_side & (uy is not None)]))


def test_no_sides_leave_everything_free():
    assert not supports(SQUARE, {}).held.any()


@given(lines(), st.floats(-1, 1), st.floats(-1, 1))
def test_a_bar_is_held_at_its_ends(mesh, left, right):
    found = supports(in_floats(mesh), {"left": [left], "right": [right]})
    assert np.flatnonzero(found.held).tolist() == [0, len(mesh.points) - 1]
    assert found.values[[0, -1], 0].tolist() == [left, right]


def test_supports_are_read_only():
    found = supports(SQUARE, {"left": [0.0, 0.0]})
    for array in (found.held, found.values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


@pytest.mark.parametrize(("p", "name"), [(0, "x"), (1, "y")])
def test_two_sides_that_prescribe_different_values_at_a_corner_are_refused(p, name):
    one, other = [None, None], [None, None]
    one[p], other[p] = 0.25, -0.5
    message = r"side 'top' prescribes -0.5 at \(0, 1\) where another side prescribes 0.25 for the same component"
    with pytest.raises(MeshError, match=message):
        supports(SQUARE, {"left": one, "top": other})


def test_a_side_that_moves_against_a_fixed_one_is_refused():
    with pytest.raises(MeshError, match=r"prescribes 1 at \(1, 0\) where another side prescribes 0"):
        supports(SQUARE, {"bottom": [0.0, 0.0], "right": [1.0, None]})


@pytest.mark.parametrize(
    ("left", "top"),
    [
        ([0.25, None], [None, -0.5]),  # different components
        ([0.25, 1.0], [0.25, 1.0]),  # equal values
        ([0.0, 0.0], [-0.0, None]),
        ([None, None], [0.25, 0.5]),
    ],
)
def test_sides_that_agree_at_their_corner_are_accepted_in_either_order(left, top):
    one, other = (
        supports(SQUARE, dict(sides)) for sides in [[("left", left), ("top", top)], [("top", top), ("left", left)]]
    )
    assert np.array_equal(one.held, other.held)
    assert np.array_equal(one.values, other.values)


def test_opposite_sides_may_move_apart():
    found = supports(SQUARE, {"left": [-1.0, None], "right": [1.0, None]})
    assert found.values[:, 0].tolist() == [-1, -1, -1, 0, 0, 0, 1, 1, 1]


# --- rigid motions ----------------------------------------------------------------------------------------------------


def held(mesh, *components):
    known = unknown(mesh)
    for node, p in components:
        known[node, p] = True
    return known


def rigid_motions(mesh, known):
    """How many."""
    return fem1d2d.rigid_motions(mesh, known).shape[2]


@pytest.mark.parametrize(
    ("known", "motions"),
    [
        ([], 3),
        ([(0, 0)], 2),
        ([(0, 0), (0, 1)], 1),  # a hinge
        ([(0, 1), (3, 1), (6, 1)], 1),  # rollers along the bottom
        ([(0, 1), (6, 1), (2, 0)], 0),
        ([(0, 0), (0, 1), (6, 1)], 0),  # a hinge and a roller
        ([(0, 0), (0, 1), (6, 0)], 1),  # a roller that rolls about the hinge
        ([(0, 0), (0, 1), (1, 0)], 0),
        ([(0, 1), (6, 1), (2, 1)], 1),
        ([(0, 0), (0, 1), (8, 0), (8, 1)], 0),  # two points
    ],
)
def test_the_rigid_motions_of_a_square_are_counted_as_by_hand(known, motions):
    assert rigid_motions(SQUARE, held(SQUARE, *known)) == motions
    assert nullity(SQUARE, held(SQUARE, *known)) == motions


@pytest.mark.parametrize(
    ("sides", "motions"),
    [
        ({"bottom": [0.0, 0.0]}, 0),
        ({"bottom": [None, 0.0]}, 1),
        ({"bottom": [None, 0.0], "top": [None, -0.1]}, 1),
        ({"bottom": [None, 0.0], "left": [0.0, None]}, 0),
        ({"left": [0.0, None], "right": [0.0, None]}, 1),
        ({"left": [None, None]}, 3),
    ],
)
def test_sides_leave_the_rigid_motions_that_slide_along_them(sides, motions):
    assert rigid_motions(SQUARE, supports(SQUARE, sides).held) == motions


def test_a_roller_on_a_circle_about_the_hinge_holds_nothing():
    points = np.array([[0.0, 0.0], [3.0, -4.0], [3.0, 4.0]])
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2]]), sides={})
    assert rigid_motions(mesh, held(mesh, (1, 0), (2, 0))) == 1
    assert rigid_motions(mesh, held(mesh, (1, 0), (2, 0), (0, 0))) == 1
    assert rigid_motions(mesh, held(mesh, (1, 0), (2, 0), (0, 1))) == 0


@given(lines(), st.data())
def test_a_bar_moves_unless_a_node_is_held(mesh, data):
    known = np.array(data.draw(st.lists(st.booleans(), min_size=len(mesh.points), max_size=len(mesh.points))))[:, None]
    assert rigid_motions(mesh, known) == (0 if known.any() else 1) == nullity(mesh, known)


@st.composite
def held_meshes(draw, most=2):
    """A plane mesh with up to four known components, anywhere."""
    mesh = draw(plane_meshes(most))
    some = st.tuples(st.integers(0, len(mesh.points) - 1), st.integers(0, 1))
    return mesh, held(mesh, *draw(st.lists(some, max_size=4)))


@fewer(2)
@given(held_meshes())
def test_the_rigid_motions_are_the_kernel_of_the_stiffness_matrix(case):
    mesh, known = case
    assert rigid_motions(mesh, known) == rigid_motions(in_floats(mesh), known) == nullity(mesh, known)


@st.composite
def broken_meshes(draw):
    """What is left of a grid without some of its cells: pieces that hinge on nodes, alone and in rings."""
    grid = rectangle((Fraction(0), Fraction(2)), (Fraction(0), Fraction(2)), (2, draw(st.integers(1, 2))))
    kept = draw(st.lists(st.sampled_from(range(len(grid.cells))), min_size=1, unique=True))
    nodes, cells = np.unique(grid.cells[kept], return_inverse=True)
    mesh = Mesh(points=grid.points[nodes], cells=cells.reshape(-1, 3), sides={})
    some = st.tuples(st.integers(0, len(nodes) - 1), st.integers(0, 1))
    return mesh, held(mesh, *draw(st.lists(some, max_size=5)))


@given(broken_meshes())
def test_pieces_that_share_one_node_hinge_on_it(case):
    mesh, known = case
    assert rigid_motions(mesh, known) == nullity(mesh, known)


#: Two triangles that share one node, the first of them held.
HINGED = Mesh(
    points=np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]], dtype=object) * Fraction(1),
    cells=np.array([[0, 1, 2], [0, 3, 4]]),
    sides={},
)


def test_cells_are_one_piece_where_they_share_a_facet_and_hinged_ones_also_where_they_share_a_node():
    assert pieces(HINGED).tolist() == [0, 1]
    assert pieces(HINGED, hinged=True).tolist() == [0, 0]
    for hinged in (False, True):
        assert not pieces(SQUARE, hinged=hinged).any()
        assert not pieces(interval((0.0, 1.0), 4), hinged=hinged).any()


@given(st.one_of(held_meshes(), broken_meshes()))
@example((HINGED, held(HINGED, (1, 0), (1, 1), (2, 0))))
@example((HINGED, unknown(HINGED)))
def test_rigid_motions_are_orthonormal_cost_no_energy_and_keep_to_the_supports(case):
    mesh, known = case
    motions = fem1d2d.rigid_motions(mesh, known)
    flat = motions.reshape(known.size, motions.shape[2])
    matrix = stiffness(in_floats(mesh), Material(lame_lambda=1.0, lame_mu=1.0))
    assert np.abs(flat.T @ flat - np.eye(flat.shape[1])).max(initial=0) <= 1e-13
    assert np.abs(matrix @ flat).max(initial=0) <= 1e-11 * abs(matrix).max()
    assert np.abs(motions[known]).max(initial=0) <= 1e-12


def test_a_ring_of_four_triangles_hinged_at_their_corners_is_a_mechanism():
    """A parallelogram: of 12 motions of its bars, four hinges leave 4, and one of these changes its shape."""
    corners = np.array([[0, 0], [4, 0], [4, 4], [0, 4]]) * Fraction(1)
    outer = np.array([[2, -1], [5, 2], [2, 5], [-1, 2]]) * Fraction(1)
    cells = [[4, 1, 0], [5, 2, 1], [6, 3, 2], [7, 0, 3]]
    mesh = Mesh(points=np.concatenate([corners, outer]), cells=np.array(cells), sides={})
    assert rigid_motions(mesh, unknown(mesh)) == nullity(mesh, unknown(mesh)) == 4
    assert rigid_motions(mesh, held(mesh, (0, 0), (0, 1), (1, 0), (1, 1))) == 1


@pytest.mark.parametrize("distance", [1.0, 2.0**-10, 2.0**-25])
def test_two_held_points_hold_a_body_however_near_they_lie(distance):
    points = np.array([[0.0, 0.0], [distance, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2], [0, 2, 3]]), sides={})
    assert rigid_motions(mesh, held(mesh, (0, 0), (0, 1), (1, 1))) == 0


def test_rollers_that_lie_on_one_line_up_to_rounding_leave_the_body_to_slide():
    points = np.array([[0.1 * 3, 0.0], [2.0, 1.0], [0.3, 1.0], [0.1 + 0.2, 2.0]])
    assert len(set(points[[0, 2], 0])) == 2
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2], [1, 3, 2]]), sides={})
    assert rigid_motions(mesh, held(mesh, (0, 1), (2, 1), (3, 1))) == 2
    assert rigid_motions(mesh, held(mesh, (0, 0), (2, 0), (3, 0))) == 1


@fewer(4)
@given(held_meshes(most=1), held_meshes(most=1))
def test_the_motions_of_pieces_that_share_no_node_add_up(one, other):
    shift = np.array([Fraction(100), Fraction(0)], dtype=object)
    second = Mesh(points=other[0].points + shift, cells=other[0].cells, sides={})
    mesh, known = beside(one[0], second), np.concatenate([one[1], other[1]])
    kernels = nullity(*one), nullity(second, other[1])
    assert rigid_motions(mesh, known) == nullity(mesh, known) == sum(kernels)


def test_a_piece_that_hangs_on_nothing_is_found_beside_a_held_one():
    square = rectangle((0.0, 1.0), (0.0, 1.0), (1, 1))
    mesh = beside(square, rectangle((2.0, 3.0), (0.0, 1.0), (1, 1)))
    known = unknown(mesh)
    known[:4] = True
    assert rigid_motions(mesh, known) == 3
    for cells in (1, 2):
        bars = beside(interval((0.0, 1.0), cells), interval((2.0, 3.0), cells))
        assert rigid_motions(bars, np.arange(2 * cells + 2)[:, None] == 0) == 1


def test_nothing_moves_where_everything_is_known():
    assert rigid_motions(SQUARE, np.ones((9, 2), dtype=bool)) == 0


@pytest.mark.parametrize("size", [2.0**-30, 1.0, 2.0**30])
@pytest.mark.parametrize("far", [0.0, 2.0**36])
def test_the_count_does_not_see_the_unit_of_length_or_the_origin(size, far):
    mesh = Mesh(points=(SQUARE.points + far) * size, cells=SQUARE.cells, sides=SQUARE.sides)
    for sides, motions in [({"bottom": [None, 0.0]}, 1), ({"bottom": [0.0, 0.0]}, 0), ({}, 3)]:
        assert rigid_motions(mesh, supports(mesh, sides).held) == motions


def test_triangles_that_share_one_node_only_turn_about_it():
    known = held(HINGED, (0, 0), (0, 1), (1, 0), (1, 1))
    assert nullity(HINGED, known) == 1
    assert rigid_motions(HINGED, known) == 1

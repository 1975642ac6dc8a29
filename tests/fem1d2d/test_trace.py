"""The interface: flat tops and bottoms, parts of them, the trapezoid rule."""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import in_floats, lines, numbers, powers_of_two, renumbered, vectors

from fem1d2d import Mesh, MeshError, facing, interval, rectangle, surface, trapezoid
from fem1d2d.assembly import facet_weights
from fem1d2d.trace import extent

counts = st.integers(1, 4)


@st.composite
def flat_bodies(draw):
    """A rectangle in floats whose nodes have any order, and its width and height."""
    width, height = draw(powers_of_two()), draw(powers_of_two())
    mesh = rectangle((0.0, float(width)), (0.0, float(height)), (draw(counts), draw(counts)))
    order = draw(st.permutations(range(len(mesh.points))))
    return renumbered(mesh, order), float(width), float(height)


@pytest.mark.parametrize("far", [0.0, -10.0, 1e3])
def test_the_extent_is_the_longest_side_wherever_the_body_lies(far):
    for width, height in ((4.0, 1.0), (1.0, 4.0)):
        assert extent(rectangle((far, far + width), (0.0, height), (2, 3))) == 4
    assert extent(interval((far, far + 4), 3)) == 4


@given(flat_bodies(), st.booleans())
def test_the_surface_of_a_rectangle_is_its_top_or_bottom_from_left_to_right(body, upper):
    mesh, _, height = body
    nodes = surface(mesh, upper=upper)
    assert set(nodes.tolist()) == set(mesh.sides["top" if upper else "bottom"].ravel().tolist())
    assert (mesh.points[nodes, 1] == (height if upper else 0)).all()
    assert (np.diff(mesh.points[nodes, 0]) > 0).all()


@given(lines(), st.booleans(), st.randoms(use_true_random=False))
def test_the_surface_of_a_line_is_one_end(mesh, upper, random):
    again = renumbered(mesh, random.sample(range(len(mesh.points)), len(mesh.points)))
    (node,) = surface(again, upper=upper)
    assert again.points[node, 0] == mesh.points[-1 if upper else 0, 0]


def test_the_surface_ignores_flat_edges_below_the_top_and_joins_two_towers():
    mesh = rectangle((0.0, 3.0), (0.0, 2.0), (3, 2))
    centres = mesh.points[mesh.cells].mean(axis=1)
    cells = mesh.cells[~((centres[:, 0] > 1) & (centres[:, 0] < 2) & (centres[:, 1] > 1))]
    towers = Mesh(points=mesh.points, cells=cells, sides={})
    assert towers.points[surface(towers, upper=True)].tolist() == [[0, 2], [1, 2], [2, 2], [3, 2]]
    assert len(surface(towers, upper=False)) == 4


def test_a_single_peak_at_the_height_of_a_flat_top_is_not_part_of_the_surface():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0], [2.5, 1.0], [3.0, 0.0]])
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2], [0, 2, 3], [4, 6, 5], [1, 4, 2]]), sides={})
    assert surface(mesh, upper=True).tolist() == [3, 2]


@pytest.mark.parametrize(("upper", "word", "level"), [(True, "top", "1"), (False, "bottom", "-1")])
def test_a_body_that_ends_in_a_peak_has_no_surface(upper, word, level):
    points = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2], [0, 2, 3]]), sides={})
    with pytest.raises(MeshError, match=f"no flat {word}: no boundary edge lies at y = {level}"):
        surface(mesh, upper=upper)


@pytest.mark.parametrize("turn", [0.01, 0.5, 2.0])
def test_a_rotated_rectangle_has_no_surface(turn):
    mesh = rectangle((0.0, 1.0), (0.0, 1.0), (2, 2))
    c, s = np.cos(turn), np.sin(turn)
    turned = Mesh(points=mesh.points @ np.array([[c, s], [-s, c]]), cells=mesh.cells, sides={})
    for upper in (True, False):
        with pytest.raises(MeshError, match="no flat"):
            surface(turned, upper=upper)


@pytest.mark.parametrize(("uneven", "kept"), [(0.9e-9, 3), (-0.9e-9, 3), (1.1e-9, 0), (-1.1e-9, 2)])
@pytest.mark.parametrize("extent", [1e-3, 1.0, 1e3])
def test_the_top_is_flat_up_to_a_billionth_of_the_extent(uneven, kept, extent):
    mesh = rectangle((0.0, extent), (0.0, extent), (2, 1))
    points = mesh.points.copy()
    points[5, 1] += uneven * extent
    uneven_mesh = Mesh(points=points, cells=mesh.cells, sides={})
    if kept:
        assert len(surface(uneven_mesh, upper=True)) == kept
    else:
        with pytest.raises(MeshError, match="no flat top"):
            surface(uneven_mesh, upper=True)


# --- surfaces that are not flat ---------------------------------------------------------------------------------------


@given(flat_bodies(), st.booleans())
def test_what_faces_up_or_down_on_a_rectangle_is_its_flat_surface(body, upper):
    mesh, width, _ = body
    assert facing(mesh, upper=upper, ends=(0.0, width)).tolist() == surface(mesh, upper=upper).tolist()


@st.composite
def hills(draw):
    """Rectangles of height 1 under a top, and over a bottom, that rises and falls by less than half of it."""
    nx, ny = draw(counts), draw(counts)
    flat = rectangle((0.0, 1.0), (0.0, 1.0), (nx, ny))
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    low, high = random.integers(-3, 4, nx + 1) / 8, 1 + random.integers(-3, 4, nx + 1) / 8
    column = np.repeat(np.arange(nx + 1), ny + 1)
    y = low[column] + (high - low)[column] * flat.points[:, 1]
    mesh = Mesh(points=np.column_stack([flat.points[:, 0], y]), cells=flat.cells, sides=flat.sides)
    return renumbered(mesh, draw(st.permutations(range(len(y)))))


def reaching(mesh, nodes, ends):
    """Those of some nodes, from left to right, whose hat functions reach between two positions."""
    x = mesh.points[nodes, 0].astype(float)
    low, high = np.append(x[:1], x[:-1]), np.append(x[1:], x[-1:])
    return [node for node, a, b in zip(nodes, low, high, strict=True) if a < ends[1] and b > ends[0]]


@given(hills(), st.booleans(), st.integers(0, 8), st.integers(0, 8))
def test_what_faces_up_on_a_hill_is_its_top_between_the_ends_from_left_to_right(mesh, upper, a, b):
    ends = min(a, b) / 8, max(a, b) / 8
    assume(a != b)
    side = np.unique(mesh.sides["top" if upper else "bottom"])
    side = side[np.argsort(mesh.points[side, 0])]
    assert facing(mesh, upper=upper, ends=ends).tolist() == reaching(mesh, side.tolist(), ends)


@given(hills(), st.booleans())
def test_what_faces_up_on_a_body_faces_down_on_its_reflection(mesh, upper):
    mirror = Mesh(points=mesh.points * [1, -1], cells=mesh.cells[:, ::-1], sides={})
    ends = (0.0, 1.0)
    assert facing(mesh, upper=upper, ends=ends).tolist() == facing(mirror, upper=not upper, ends=ends).tolist()


def test_a_circle_faces_up_on_its_upper_half():
    angle = np.arange(8) * np.pi / 4 + np.pi / 8
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    cells = np.array([[0, 1 + i, 1 + (i + 1) % 8] for i in range(8)])
    circle = Mesh(points=np.concatenate([[[0.0, 0.0]], rim]), cells=cells, sides={})
    assert facing(circle, upper=True, ends=(-1.0, 1.0)).tolist() == [4, 3, 2, 1]
    assert facing(circle, upper=False, ends=(-1.0, 1.0)).tolist() == [5, 6, 7, 8]
    assert facing(circle, upper=False, ends=(-0.5, 0.5)).tolist() == [5, 6, 7, 8]
    assert facing(circle, upper=False, ends=(-0.3, 0.3)).tolist() == [6, 7]


@pytest.mark.parametrize("extent", [1e-3, 1.0, 1e3])
def test_a_flank_within_a_billionth_of_the_extent_of_upright_faces_neither_way(extent):
    mesh = lambda lean: Mesh(
        points=extent * np.array([[0.0, 0.0], [1.0, 0.0], [1.0 + lean, 1.0], [0.0, 1.0]]),
        cells=np.array([[0, 1, 2], [0, 2, 3]]),
        sides={},
    )
    ends = (-extent, 2 * extent)
    assert facing(mesh(0.9e-9), upper=False, ends=ends).tolist() == [0, 1]
    assert facing(mesh(0.1), upper=False, ends=ends).tolist() == [0, 1, 2]


@pytest.mark.parametrize(("upper", "word"), [(True, "up"), (False, "down")])
def test_a_body_with_two_surfaces_above_each_other_is_refused(upper, word):
    mesh = rectangle((0.0, 2.0), (0.0, 3.0), (2, 3))
    centres = mesh.points[mesh.cells].mean(axis=1)
    notch = (centres[:, 0] > 1) & (centres[:, 1] > 1) & (centres[:, 1] < 2)
    notched = Mesh(points=mesh.points, cells=mesh.cells[~notch], sides={})
    with pytest.raises(MeshError, match=f"two points of the surface that faces {word} lie at x = 1"):
        facing(notched, upper=upper, ends=(0.0, 2.0))
    assert mesh.points[facing(notched, upper=upper, ends=(0.0, 0.9))].tolist() == [[0, 3 * upper], [1, 3 * upper]]


# --- parts of a surface -----------------------------------------------------------------------------------------------


@given(flat_bodies(), st.integers(0, 8), st.integers(0, 8))
def test_a_part_of_a_surface_is_the_nodes_whose_hat_functions_reach_into_it(body, a, b):
    mesh, width, _ = body
    ends = width * min(a, b) / 8, width * max(a, b) / 8
    assume(a != b)
    assert surface(mesh, upper=True, ends=ends).tolist() == reaching(mesh, surface(mesh, upper=True).tolist(), ends)


@pytest.mark.parametrize("extent", [1e-3, 1.0, 1e3])
def test_an_end_within_a_billionth_of_the_extent_of_a_node_lies_at_it(extent):
    mesh = rectangle((0.0, extent), (0.0, extent / 2), (4, 1))
    part = lambda off: surface(mesh, upper=True, ends=((0.25 - off) * extent, (0.75 + off) * extent))
    assert len(part(0.9e-9)) == len(part(-0.9e-9)) == len(part(-0.1)) == 3
    assert len(part(1.1e-9)) == 5


# --- the trapezoid rule -----------------------------------------------------------------------------------------------


@given(lines(most=8, denominator=16), vectors(size=2))
def test_the_trapezoid_rule_integrates_linear_functions_exactly(mesh, v):
    x = mesh.points[:, 0]
    weights = fem_oracle.exactly(trapezoid(x.astype(float)))
    integral = (x[-1] - x[0]) * (v[0] + v[1] * (x[0] + x[-1]) / 2)
    assert weights @ (v[0] + v[1] * x) == integral


@given(lines(most=8, denominator=16))
def test_the_trapezoid_rule_overestimates_a_convex_function_by_its_second_differences(mesh):
    x = mesh.points[:, 0]
    error = fem_oracle.exactly(trapezoid(x.astype(float))) @ x**2 - (x[-1] ** 3 - x[0] ** 3) / 3
    assert error == (np.diff(x) ** 3).sum() / 6


@given(flat_bodies())
def test_the_trapezoid_rule_on_a_top_is_the_integral_of_its_hat_functions(body):
    mesh, _, _ = body
    top = surface(mesh, upper=True)
    assert trapezoid(mesh.points[top, 0]).tolist() == facet_weights(mesh, mesh.sides["top"])[top].tolist()


def test_one_point_has_weight_one():
    bar = interval((0.0, 2.0), 2)
    assert trapezoid(bar.points[surface(bar, upper=True), 0]).tolist() == [1.0]


def test_no_points_have_no_weights():
    assert trapezoid(np.empty(0)).shape == (0,)


@given(lines(denominator=16), numbers(-4, 4), powers_of_two())
def test_weights_are_lengths_they_do_not_see_the_origin_and_scale_with_the_unit(mesh, shift, scale):
    x = in_floats(mesh).points[:, 0]
    assert np.array_equal(trapezoid((x + float(shift)) * float(scale)), trapezoid(x) * float(scale))
    assert Fraction(trapezoid(x).sum()) == mesh.points[-1, 0] - mesh.points[0, 0]

"""A layered drawing: boxes and lanes apart, edges downwards and around boxes, the same at every call."""

from itertools import combinations, pairwise

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from verification.figures.layers import layered, spread

BOX, GAP, LANE = (20.0, 10.0), (4.0, 8.0), 3.0


@st.composite
def graphs(draw):
    """Boxes named by numbers; edges lead only to larger ones, so there is no circle."""
    names = [str(i) for i in range(draw(st.integers(1, 14)))]
    return {name: draw(st.lists(st.sampled_from(names[:i]), unique=True)) if i else [] for i, name in enumerate(names)}


def drawn(above, most=3):
    return layered(above, most=most, box=BOX, gap=GAP, lane=lambda id: LANE)


def box_of(centre):
    return centre[0] - BOX[0] / 2, centre[0] + BOX[0] / 2, centre[1] - BOX[1] / 2, centre[1] + BOX[1] / 2


def along(points, steps=12):
    """Points of an edge as it is drawn: an S between rows, straight down in a row."""
    for (x, y), (to, end) in zip(points[::2], points[1::2], strict=True):
        for t in np.linspace(0, 1, steps):
            s = 3 * t * t - 2 * t**3  # the x of a cubic whose handles are vertical
            yield x + (to - x) * s, y + (end - y) * (1.5 * t * (1 - t) + t**3 if t else 0)


@strategies.fewer(2)
@given(graphs(), st.integers(1, 4))
def test_no_box_overlaps_another_all_lie_in_the_picture_and_it_is_the_same_at_every_call(above, most):
    picture = drawn(above, most)
    assert picture == drawn(dict(above), most)
    assert set(picture.centres) == set(above)
    for a, b in combinations(picture.centres.values(), 2):
        assert abs(a[0] - b[0]) >= BOX[0] + GAP[0] - 1e-9 or abs(a[1] - b[1]) >= BOX[1] + GAP[1] - 1e-9
    for centre in picture.centres.values():
        left, right, top, bottom = box_of(centre)
        assert left >= 0
        assert right <= picture.size[0] + 1e-9
        assert top >= 0
        assert bottom <= picture.size[1]
    levels = [y for _, y in picture.centres.values()]
    assert max(levels.count(y) for y in levels) <= most


@strategies.fewer(2)
@given(graphs())
def test_every_edge_goes_down_from_its_box_to_its_box(above):
    picture = drawn(above)
    assert set(picture.edges) == {(head, id) for id, heads in above.items() for head in heads}
    for (begin, end), points in picture.edges.items():
        assert all(a[1] < b[1] for a, b in pairwise(points))
        left, right, _, bottom = box_of(picture.centres[begin])
        assert left < points[0][0] < right
        assert points[0][1] == bottom
        left, right, top, _ = box_of(picture.centres[end])
        assert left < points[-1][0] < right
        assert points[-1][1] == top
        assert all(a[0] == b[0] for a, b in zip(points[1:-1:2], points[2:-1:2], strict=True))


@strategies.fewer(2)
@given(graphs())
def test_no_edge_passes_through_a_box(above):
    picture = drawn(above)
    for edge, points in picture.edges.items():
        for id, centre in picture.centres.items():
            left, right, top, bottom = box_of(centre)
            inside = [left < x < right and top < y < bottom for x, y in along(points)]
            assert not any(inside), (edge, id)


def test_edges_of_one_box_share_a_lane_and_others_have_their_own():
    chain = {"a": [], "b": [], "c": ["a", "b"], "d": ["c", "a", "b"], "e": ["d", "a", "b"]}
    picture = drawn(chain)
    assert picture.edges["a", "e"][1:3] == picture.edges["a", "d"][1:3]
    apart = abs(picture.edges["a", "e"][1][0] - picture.edges["b", "e"][1][0])
    assert apart >= LANE + GAP[0] - 1e-9


def test_a_tree_is_drawn_without_a_crossing():
    """In the order given its edges cross."""
    tree = {"root": [], "a": ["root"], "b": ["root"], "b1": ["b"], "a1": ["a"], "b2": ["b"], "a2": ["a"]}
    picture = drawn(tree, most=4)
    x = {id: centre[0] for id, centre in picture.centres.items()}
    assert (x["a"] < x["b"]) == (max(x["a1"], x["a2"]) < min(x["b1"], x["b2"]))
    assert (x["a"] > x["b"]) == (min(x["a1"], x["a2"]) > max(x["b1"], x["b2"]))


def test_a_box_lies_at_the_mean_of_its_neighbours_where_there_is_room():
    picture = drawn({"a": [], "b": [], "c": ["a", "b"]})
    x = {id: centre[0] for id, centre in picture.centres.items()}
    assert x["c"] == pytest.approx((x["a"] + x["b"]) / 2)


def test_places_without_overlap_are_the_nearest_ones():
    """Against a general minimiser, on the least gaps between neighbours."""
    random = np.random.default_rng(2008)
    for _ in range(20):
        sizes, wanted = random.uniform(1, 5, 6), random.uniform(0, 40, 6)
        apart = (sizes[1:] + sizes[:-1]) / 2
        found = spread(list(wanted), list(sizes), 60.0)
        limits = [{"type": "ineq", "fun": lambda x: np.diff(x) - apart}]  # noqa: B023
        ends = [(sizes[0] / 2, 60 - sizes[-1] / 2)] * 6
        best = minimize(lambda x: ((x - wanted) ** 2).sum(), np.arange(6) * 8.0 + 4, constraints=limits, bounds=ends)  # noqa: B023
        assert np.allclose(found, best.x, atol=1e-3)


def test_a_circle_is_refused():
    with pytest.raises(ValueError, match="cycle"):
        drawn({"a": ["b"], "b": ["a"]})

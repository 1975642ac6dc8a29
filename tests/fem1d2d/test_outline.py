"""How deep points lie inside an outline, against loops over angles and edges."""

import math
from fractions import Fraction

import numpy as np
import pytest

from fem1d2d import depths, rectangle
from fem1d2d.outline import whole_numbers


def ring(points):
    """The edges of a closed polygon."""
    points = np.array(points, float)
    return points, np.roll(points, -1, axis=0)


def join(*rings):
    starts, ends = zip(*rings, strict=True)
    return np.concatenate(starts), np.concatenate(ends)


def depth(point, start, end):
    """By the angle under which each edge is seen, which add up to 2 pi inside, and the nearest point of each edge."""
    turns, nearest = 0.0, math.inf
    for a, b in zip(start - point, end - point, strict=True):
        turns += math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)
        along = min(1.0, max(0.0, -a @ (b - a) / ((b - a) @ (b - a))))
        nearest = min(nearest, math.hypot(*(a + along * (b - a))))
    return nearest if turns > math.pi else 0.0


def star(random, corners):
    """A polygon around the origin, anything but convex."""
    angle = np.sort(random.uniform(0, 2 * math.pi, corners))
    return ring(random.uniform(0.2, 1, corners)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


HOLE = join(ring([(-1, -1), (1, -1), (1, 1), (-1, 1)]), ring([(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)]))
PIECES = join(ring([(-1, -1), (-0.1, -1), (-0.1, 1), (-1, 1)]), ring([(0.2, -1), (1, -1), (1, 0.5)]))
COMB = ring([(x, y) for i in range(40) for x, y in ((i, 0.9), (i + 0.3, 0.2), (i + 0.6, 0.9))] + [(40, -1), (-1, -1)])


@pytest.mark.parametrize(
    "outline",
    [*(star(np.random.default_rng(seed), 3 + 4 * seed) for seed in range(6)), HOLE, PIECES, COMB[::-1]],
    ids=lambda outline: f"{len(outline[0])} edges",
)
def test_a_depth_is_the_distance_of_a_point_inside_to_the_nearest_edge(outline):
    low, high = outline[0].min(axis=0), outline[0].max(axis=0)
    points = np.random.default_rng(7).uniform(low - 0.1, high + 0.1, (200, 2))
    found, expected = depths(points, *outline), np.array([depth(point, *outline) for point in points])
    assert found == pytest.approx(expected, abs=1e-14)
    assert 0 < np.count_nonzero(found) < len(points)


def test_a_corner_is_not_deeper_than_rounding_in_its_own_outline_however_it_is_turned():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (7, 4))
    for angle in np.linspace(0, 2 * math.pi, 50):
        turned = mesh.points @ [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        start, end = (turned[mesh.boundary[:, i]] for i in range(2))
        assert depths(start, start, end).max() <= 1e-15
        assert depths(turned, start, end).max() == pytest.approx(0.5)


def test_no_point_lies_in_no_outline():
    assert depths(np.empty((0, 2)), *HOLE).tolist() == []


def test_exact_coordinates_may_be_any_rationals_and_floats():
    values = np.array([Fraction(1, 3), 2, np.int64(5), 0.25], dtype=object)
    whole, unit = whole_numbers(values)
    assert [Fraction(x, unit) for x in whole.tolist()] == [Fraction(1, 3), 2, 5, Fraction(1, 4)]
    assert {type(x) for x in whole.tolist()} == {int}

"""The search over contact patterns: what it finds is attained by two forces, whatever the rank of the operator S."""

import numpy as np
import pytest

import verification as vf
from verification.algorithm.affine_piece import Piece
from verification.algorithm.fixed_point import FixedPointMap
from verification.bounds.pattern_search import beside, factor_search, largest_factor, signs
from verification.contact.active_set import Pattern

N, THETA = 4, 0.6


def stiffness(random):
    root = random.standard_normal((2 * N, 2 * N))
    return root @ root.T + np.eye(2 * N)


RANDOM = np.random.default_rng(3)
S1, S2 = stiffness(RANDOM), 0.2 * stiffness(RANDOM)
FULL = np.eye(N) + 0.2 * np.ones((N, N))
KERNELS = {
    "regular": FULL,
    "of rank 1, of one sign": np.ones((N, N)),
    "of rank 1, with a sum that cancels": np.outer([1.0, -1.0, 2.0, 1.0], [1.0, -1.0, 3.0, -3.0]),
    "one node out of reach": FULL * np.array([1.0, 1.0, 0.0, 1.0])[:, None],
    "two nodes out of reach": FULL * np.array([0.0, 1.0, 0.0, 1.0])[:, None],
    "none in reach": np.zeros((N, N)),
}


def pair_with(kernel, load1=None):
    x = np.arange(float(N))
    return vf.build(S1=S1, S2=S2, load1=load1, x=x, weights=np.ones(N), kernel=kernel, friction="0.8")


def with_the_pattern(kernel, piece):
    """Loads and a force g for which step II has the pattern of a piece, each condition with room to spare."""
    g = np.zeros(2 * N)
    normal = np.random.default_rng(5).standard_normal((20000, N))
    fits = (np.sign(np.where(np.abs(normal @ kernel.T) < 1e-12, 0, normal @ kernel.T)) == piece.sign).all(axis=1)
    g[N:] = normal[fits][np.argmax(np.abs(normal[fits] @ kernel.T + (piece.sign == 0)).min(axis=1))]
    bound = 0.8 * np.abs(kernel @ g[N:])
    sliding, touching = piece.pattern.sliding, piece.pattern.touching
    v = np.concatenate([sliding, -1.0 * ~touching])
    reaction = np.concatenate([sliding * bound, 1.0 * touching])
    return g, reaction + S1 @ (np.linalg.solve(S2, g) + v)


@pytest.mark.parametrize("name", KERNELS)
def test_the_factor_that_is_found_is_attained_by_two_forces(name):
    kernel = KERNELS[name]
    found = largest_factor(pair_with(kernel), THETA, random=np.random.default_rng(0))
    g, load1 = with_the_pattern(kernel, found.piece)
    pair = pair_with(kernel, load1)
    T, norm = FixedPointMap(pair), pair.neumann.dual_norm
    relaxed = lambda force: THETA * T(force)[1].force + (1 - THETA) * force
    direction = found.piece.basis @ np.linalg.svd(found.piece.relaxed(THETA))[2][0]
    one, two = g + 1e-4 * direction, g - 1e-4 * direction
    assert T(one)[1].pattern == T(two)[1].pattern
    assert norm(relaxed(one) - relaxed(two)) / norm(one - two) == pytest.approx(found.value, rel=1e-6)


def test_without_any_node_in_reach_the_largest_factor_is_that_without_friction():
    pair = pair_with(KERNELS["none in reach"])
    found = largest_factor(pair, THETA, random=np.random.default_rng(0)).value
    assert found == pytest.approx(largest_factor(pair.at(friction=0), THETA, random=np.random.default_rng(0)).value)


def random_pattern(random, pair):
    n, t = pair.contact.grid.n, pair.contact.grid.t
    return Pattern(touching=random.random(n) < 0.5, sliding=random.integers(-1, 2, size=t).astype(np.int8))


def across_a_transfer():
    x, P = np.arange(float(N)), np.full((N, 6), 0.1) + 0.4 * np.eye(N, 6)
    S_2, kernel = np.eye(12) + np.ones((12, 12)), np.eye(N, 6) + 0.2
    return vf.build(S1=S1, S2=S_2, x=x, weights=np.ones(N), kernel=kernel, transfer=P, friction="0.8")


PAIRS = {
    "a transfer between grids": across_a_transfer,
    "matching grids": lambda: vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)))),
    "without friction": lambda: vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)), friction=0)),
    "a node out of reach": lambda: pair_with(KERNELS["one node out of reach"]),
}


@pytest.mark.parametrize("name", PAIRS)
def test_what_t_makes_of_a_force_beside_a_pattern_is_what_it_makes_of_it_on_each_piece(name):
    pair, random = PAIRS[name](), np.random.default_rng(7)
    for _ in range(5):
        base, sign = random_pattern(random, pair), signs(pair)
        n = pair.contact.grid.n
        node = random.integers(n, size=12)
        touching, sliding = np.repeat(base.touching[None], 12, axis=0), np.repeat(base.sliding[None], 12, axis=0)
        touching[np.arange(12), node] = random.random(12) < 0.5
        sliding[np.arange(12), node] = random.integers(-1, 2, size=12)
        g = random.standard_normal(pair.neumann.grid.size)
        found = beside(pair, g, base, touching, sliding, node, sign)
        for i in range(12):
            pattern = Pattern(touching=touching[i], sliding=sliding[i])
            piece = Piece(pair=pair, pattern=pattern, sign=sign, still=np.zeros(pair.neumann.grid.n, dtype=bool))
            assert found.jump[i] == pytest.approx(piece.jump @ g, rel=1e-9, abs=1e-9 * np.abs(found.jump).max())
            expected = piece.reaction @ g
            assert found.reaction[i] == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(found.reaction).max())


def test_a_piece_is_above_a_level_exactly_where_its_value_is():
    pair = pair_with(KERNELS["regular"])
    value = factor_search(pair, THETA).found(*factor_search(pair, THETA).extremes()[0]).value
    for level, is_above in ((0.5, True), (1 - 1e-9, True), (1 + 1e-9, False), (2.0, False)):
        search = factor_search(pair, THETA)
        pattern = search.extremes()[0]
        found = search.above(level * value, *pattern)
        assert (found is not None) == is_above
        assert (search.above(level * value, *pattern) is not None) == is_above  # asked again
        assert search.found(*pattern).value == pytest.approx(value)

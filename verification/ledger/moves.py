"""Test functions of the weak forms (:mod:`verification.ledger.weak_forms`): random ones, and those that come close."""

from __future__ import annotations

import numpy as np

from fem1d2d.mesh import Floats
from verification.interface.body import Body
from verification.ledger.weak_forms import Fields, Weak


def directions(rng: np.random.Generator, body: Body, count: int) -> Floats:
    """Rough and smooth random fields of a body, largest value 1, as columns."""
    rough = rng.standard_normal((len(body.positions), count))
    smooth = body.solve(rng.standard_normal((len(body.positions), count)))
    columns = np.concatenate([rough, smooth], axis=1)
    return np.asarray(columns / np.abs(columns).max(axis=0))


def hats(body: Body) -> Floats:
    """Both signs of the hat function of every interface unknown, as columns."""
    columns = np.zeros((len(body.positions), len(body.interface)))
    columns[body.interface, np.arange(len(body.interface))] = 1.0
    return np.concatenate([columns, -columns], axis=1)


def closing(weak: Weak, u: Fields) -> Floats:
    """Moves of body 1 by hat functions that undo the jump of u at one node, in one direction."""
    count = len(weak.one.interface)
    return np.asarray(hats(weak.one)[:, :count] * -weak.pair.contact.orient(weak.jump(u.one, u.two)))


def _sizes(rng: np.random.Generator, size: float, count: int) -> Floats:
    return np.asarray(size * 10.0 ** rng.uniform(-4, 1, count))


def moves_in_K(weak: Weak, u: Fields, rng: np.random.Generator, count: int) -> Fields:
    """Columns ``v - u`` with v in K: random fields, hat functions on one body, on the other and on both, closing moves.

    Where a column would penetrate one of the bodies gives way; where the grids differ it is body 1, node by node.
    """
    size = largest(u)
    one, two = (directions(rng, body, count) for body in (weak.one, weak.two))
    hat_1, hat_2 = hats(weak.one), hats(weak.two)
    still_1, still_2 = np.zeros((len(u.one), hat_2.shape[1])), np.zeros((len(u.two), hat_1.shape[1]))
    with_2 = still_1.copy()
    with_2[weak.one.interface] = weak.pair.contact.orient(weak.carried(hat_2))
    columns_1 = np.concatenate([one, hat_1, still_1, with_2] * 2 + [100 * one], axis=1)
    columns_2 = np.concatenate([two, still_2, hat_2, hat_2] * 2 + [100 * two], axis=1)
    sizes = _sizes(rng, size, columns_1.shape[1])
    undone = closing(weak, u)
    one = np.concatenate([sizes * columns_1, undone], axis=1)
    two = np.concatenate([sizes * columns_2, np.zeros((len(u.two), undone.shape[1]))], axis=1)
    normal, up = weak.pair.contact.grid.normal, weak.pair.upward
    rows = weak.one.interface[normal]
    room = -weak.jump(u.one, u.two)[normal][:, None]
    one_grid = weak.pair.interface.transfer is None
    first = (rng.random(one.shape[1]) < 0.5) | (not one_grid)
    above = up * one[rows], weak.carried(two)[normal]
    if one_grid:
        two[weak.two.interface[normal]] = up * np.where(first, above[1], np.maximum(above[1], above[0] - room))
    one[rows] = up * np.where(first, np.minimum(above[0], above[1] + room), above[0])
    return Fields(one=one, two=two)


def moves_of_one(weak: Weak, u: Fields, rng: np.random.Generator, count: int) -> Floats:
    """Columns ``v - u^1`` with v in V^1_-(u^2_N): random fields, hat functions, closing moves."""
    random, hat = directions(rng, weak.one, count), hats(weak.one)
    columns = np.concatenate([random, hat, hat, 100 * random], axis=1)
    d = np.concatenate([_sizes(rng, largest(u), columns.shape[1]) * columns, closing(weak, u)], axis=1)
    normal, up = weak.pair.contact.grid.normal, weak.pair.upward
    rows = weak.one.interface[normal]
    d[rows] = up * np.minimum(up * d[rows], -weak.jump(u.one, u.two)[normal][:, None])
    return np.asarray(d)


def obstacle_tests(weak: Weak, u: Fields, rng: np.random.Generator, count: int) -> Floats:
    """Columns w of V^1_-(0): random ones, and ``u^1 - R u^2`` moved as in ``moves_of_one``."""
    body, normal, up = weak.one, weak.pair.contact.grid.normal, weak.pair.upward
    random, hat = directions(rng, body, count), hats(body)
    start = u.one - weak.lift(body, weak.carried(u.two))
    columns = np.concatenate([random, hat, hat], axis=1)
    moves = np.concatenate([_sizes(rng, largest(u), columns.shape[1]) * columns, closing(weak, u)], axis=1)
    w = np.concatenate([start[:, None] + moves, 10 * largest(u) * random], axis=1)
    rows = body.interface[normal]
    w[rows] = up * np.minimum(up * w[rows], weak.pair.interface.gap[:, None])
    return w


def largest(u: Fields) -> float:
    return float(max(np.abs(u.one).max(), np.abs(u.two).max()))

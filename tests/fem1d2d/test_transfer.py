"""The mortar transfer, against integrals taken another way, in rationals, and the laws it must obey."""

from fractions import Fraction as F
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem1d2d import mortar, trapezoid


@st.composite
def pairs_of_grids(draw):
    """Two rational grids; the second covers the first and may reach beyond either end, or share nodes with it."""
    places = draw(st.lists(st.integers(0, 60), min_size=2, max_size=6, unique=True))
    contact = sorted(F(p, 7) for p in places)
    inner = draw(st.lists(st.integers(1, 42), max_size=6, unique=True))
    ends = [contact[0] - F(draw(st.sampled_from([0, 1, 5])), 3), contact[-1] + F(draw(st.sampled_from([0, 1, 5])), 3)]
    between = {x for x in (F(p, 5) for p in inner) if contact[0] < x < contact[-1]}
    shared = {x for x in contact[1:-1] if draw(st.booleans())}
    return np.array(contact, dtype=object), np.array(sorted({*ends, *between, *shared}), dtype=object)


def hat(grid, i, x):
    """The value of a hat function, from the definition."""
    if i > 0 and grid[i - 1] <= x <= grid[i]:
        return (x - grid[i - 1]) / (grid[i] - grid[i - 1])
    if i < len(grid) - 1 and grid[i] <= x <= grid[i + 1]:
        return (grid[i + 1] - x) / (grid[i + 1] - grid[i])
    return F(int(x == grid[i]))


def simpson(f, a, b):
    """Exact for polynomials of degree 3."""
    return (b - a) / 6 * (f(a) + 4 * f((a + b) / 2) + f(b))


def duals(own, a, b):
    """The dual functions of a cell, ``sum_k (int f_j) (mass^-1)_jk f_k``, and the integrals of the hat functions."""
    (m, o), (_, p) = ([simpson(lambda x, f=f, g=g: f(x) * g(x), a, b) for g in own] for f in own)
    mean = [simpson(f, a, b) for f in own]
    det = m * p - o * o
    return [
        lambda x: mean[0] * (p * own[0](x) - o * own[1](x)) / det,
        lambda x: mean[1] * (m * own[1](x) - o * own[0](x)) / det,
    ], mean


def projected(contact, neumann):
    """P by its definition, cell by cell."""
    rows = [[F(0)] * len(neumann) for _ in contact]
    weight = [F(0)] * len(contact)
    for e, (a, b) in enumerate(pairwise(contact)):
        own = [lambda x, j=j: hat(contact, j, x) for j in (e, e + 1)]
        points = sorted({a, b, *(x for x in neumann if a < x < b)})
        for j, (psi, mean) in enumerate(zip(*duals(own, a, b), strict=True)):
            weight[e + j] += mean
            for i in range(len(neumann)):
                product = lambda x, i=i, psi=psi: psi(x) * hat(neumann, i, x)
                rows[e + j][i] += sum(simpson(product, *ends) for ends in pairwise(points))
    return np.array([[value / w for value in row] for row, w in zip(rows, weight, strict=True)], dtype=object)


@given(pairs_of_grids())
def test_the_transfer_is_the_projection_with_the_dual_functions_of_each_cell(grids):
    assert (mortar(*grids) == projected(*grids)).all()


@given(pairs_of_grids())
def test_constants_and_linear_functions_pass_exactly_and_a_constant_pressure_comes_back_as_one(grids):
    contact, neumann = grids
    P = mortar(contact, neumann)
    assert (P.sum(axis=1) == 1).all()
    assert (P @ neumann == contact).all()
    ends = sorted({contact[0], contact[-1], *(x for x in neumann if contact[0] < x < contact[-1])})
    integrals = [
        sum(simpson(lambda x, i=i: hat(neumann, i, x), *e) for e in pairwise(ends)) for i in range(len(neumann))
    ]
    assert (P.T @ np.array(exact_trapezoid(contact), dtype=object) == np.array(integrals, dtype=object)).all()


def exact_trapezoid(x):
    steps = [(b - a) / 2 for a, b in pairwise(x)]
    return [a + b for a, b in zip([*steps, F(0)], [F(0), *steps], strict=True)]


@given(pairs_of_grids())
def test_what_is_piecewise_linear_on_the_contact_grid_passes_from_any_finer_grid(grids):
    contact, other = grids
    finer = np.array(sorted({*contact, *other}), dtype=object)
    values = [(3 * j * j) % 7 for j in range(len(contact))]
    on_finer = [sum(v * hat(contact, j, x) for j, v in enumerate(values)) for x in finer]
    inside = [i for i, x in enumerate(finer) if contact[0] <= x <= contact[-1]]
    P = mortar(contact, finer[inside])
    assert (P @ np.array(on_finer, dtype=object)[inside] == values).all()
    assert (mortar(contact, contact) == np.eye(len(contact), dtype=int)).all()


@given(pairs_of_grids())
def test_reversing_the_axis_reverses_the_transfer_and_doubles_agree_with_rationals(grids):
    contact, neumann = grids
    P = mortar(contact, neumann)
    assert (mortar(-contact[::-1], -neumann[::-1]) == P[::-1, ::-1]).all()
    found = mortar(contact.astype(float), neumann.astype(float))
    assert np.abs(found - P.astype(float)).max() < 1e-13


@given(pairs_of_grids())
def test_no_entry_lies_below_minus_a_third(grids):
    assert mortar(*grids).min() > F(-1, 3)


def test_minus_a_third_is_nearly_reached():
    """By a hat function that is 1 where a dual one is negative, and 0 elsewhere."""
    P = mortar(np.array([0.0, 1.0]), np.array([-1.0, 0.6666, 0.66667, 1000.0]))
    assert P.min() < -0.333


@pytest.mark.parametrize("nodes", [(3, 1000), (1000, 3), (1000, 777)])
def test_grids_of_very_different_width_keep_the_laws_to_rounding(nodes):
    random = np.random.default_rng(0)
    contact, neumann = (np.concatenate([[0.0], np.sort(random.uniform(0, 1, n - 2)), [1.0]]) for n in nodes)
    P = mortar(contact, neumann)
    assert np.abs(P.sum(axis=1) - 1).max() < 1e-12
    assert np.abs(P @ neumann - contact).max() < 1e-12
    assert np.abs(P.T @ trapezoid(contact) - trapezoid(neumann)).max() < 1e-14


@pytest.mark.parametrize("sliver", [1e-9, 1e-12, 1e-15])
def test_slivers_between_nodes_do_no_harm(sliver):
    contact = np.linspace(0.0, 1.0, 6)
    neumann = np.array([0.0, 0.2 + sliver, 0.4 - sliver, 0.55, 0.8 + sliver, 1.0])
    P, Q = mortar(contact, neumann), mortar(contact, np.array([0.0, 0.2, 0.4, 0.55, 0.8, 1.0]))
    assert np.abs(P - Q).max() < 20 * sliver + 1e-14
    assert np.abs(P.T @ trapezoid(contact) - trapezoid(neumann)).max() < 1e-15


@pytest.mark.parametrize("cells", [(8, 6), (6, 8), (5, 13), (40, 39)])
def test_the_value_of_the_nearest_node_carries_no_constant_pressure(cells):
    contact, neumann = (np.linspace(0, 1, n + 1) for n in cells)
    nearest = np.zeros((len(contact), len(neumann)))
    nearest[np.arange(len(contact)), np.abs(contact[:, None] - neumann).argmin(axis=1)] = 1
    of = lambda P: P.T @ trapezoid(contact) / trapezoid(neumann)
    assert np.abs(of(nearest) - 1).max() > 0.04
    assert np.abs(of(mortar(contact, neumann)) - 1).max() < 1e-14


@pytest.mark.parametrize("neumann", [[0.1, 1.0], [0.0, 0.9]])
def test_a_grid_that_does_not_cover_the_other_is_refused(neumann):
    with pytest.raises(ValueError, match=r"from 0.* does not cover that from 0 to 1"):
        mortar(np.array([0.0, 0.5, 1.0]), np.array(neumann))

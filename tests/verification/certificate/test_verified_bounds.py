"""Bounds proved in doubles, against exact rationals: definiteness, Schur complements, eigenvalues, element matrices."""

import math
import random
from fractions import Fraction as F
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from flint import fmpz_mat
from hypothesis import given
from hypothesis import strategies as st
from strategies import AT_NIGHT, fewer

from fem1d2d import bar, element, interval, plane_strain, rectangle
from fem1d2d.proofs import exact
from fem1d2d.proofs.enclosed import Enclosed
from fem1d2d.proofs.exact import Shapes, fractions
from fem1d2d.proofs.loewner import Elimination, positive_definite
from fem1d2d.proofs.proved import enclose_largest, inverse, root

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
KINDS = (
    "definite",
    "definite inside",
    "Schur complement from below",
    "Schur complement from above",
    "eigenvalue from below",
    "eigenvalue from above",
)

#: Random pencils among which some false bound is found.
MISJUDGED = 400 if AT_NIGHT else 120

sizes = st.fractions(min_value=F(1, 1000), max_value=1000, max_denominator=1000)
whole = st.integers(-20, 20)


@pytest.fixture
def near_singular(monkeypatch):
    """The benchmark that holds what is proved of nearly singular pencils against rationals."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("near_singular")


# --- nearly singular pencils ------------------------------------------------------------------------------------------


def test_no_bound_of_a_nearly_singular_pencil_is_false(near_singular):
    made, false = near_singular.count(20_000 if AT_NIGHT else 400)
    assert false == {}
    assert min(made[kind] for kind in KINDS) >= 20


def test_without_the_radius_some_bounds_of_nearly_singular_pencils_are_false(near_singular, monkeypatch):
    with_radius = near_singular.Case.enclosed
    without = lambda case, exactly: Enclosed.exactly(with_radius(case, exactly).middle)
    monkeypatch.setattr(near_singular.Case, "enclosed", without)
    _, false = near_singular.count(MISJUDGED)
    assert min(false[kind] for kind in KINDS) > 0


def test_elimination_in_doubles_alone_calls_some_nearly_singular_pencils_definite_that_are_not(
    near_singular, monkeypatch
):
    monkeypatch.setattr(
        near_singular, "positive_definite", lambda matrix, order: Elimination(matrix, order=order).plain is not None
    )
    _, false = near_singular.count(MISJUDGED)
    assert false["definite"] > 0


def test_the_exact_pivots_tell_a_definite_matrix_from_an_indefinite_and_a_singular_one(near_singular):
    definite = near_singular.definite
    assert definite([[2, 1], [1, 2]])
    assert not definite([[1, 2], [2, 1]])
    assert not definite([[1, 1], [1, 1]])
    assert not definite([[0, 1], [1, 0]])
    assert near_singular.pivots([[-2, 1, 0], [1, 1, 0], [0, 0, 0]]) == [-1, 1, 0]


def test_the_exact_pivots_are_ratios_of_minors(near_singular):
    """The determinants are those of another library."""
    draw, singular = random.Random(1), 0
    for _ in range(200 if AT_NIGHT else 100):
        K = near_singular.Case.drawn(draw).K
        minors = [1] + [int(fmpz_mat([row[:k] for row in K[:k]]).det()) for k in range(1, len(K) + 1)]
        signs = [
            np.sign(float(F(m, before)))
            for before, m in pairwise(minors[: minors.index(0) + 1 if 0 in minors else None])
        ]
        assert near_singular.pivots(K) == signs
        singular += not minors[-1]
    assert 10 < singular < 90


def test_a_double_beside_an_eigenvalue_that_is_known_exactly_decides_which_claim_is_true(near_singular):
    draw, known = random.Random(2), 0
    for _ in range(400 if AT_NIGHT else 200):
        case = near_singular.Case.drawn(draw)
        above = lambda steps, of=case: near_singular.definite(
            near_singular.combined(of.side, of.A, -of.side, of.times(near_singular.moved(of.shift, -of.side * steps)))
        )
        if above(1) and not above(0):  # the least or the largest eigenvalue lies at lambda, or within one double of it
            known += int(fmpz_mat(case.K).det()) == 0
            assert not above(-1)
    assert known > 25


# --- ends that are rounded outwards --------------------------------------------------------------------------------


@given(st.floats(1e-100, 1e100))
def test_the_inverse_and_the_root_of_a_double_lie_between_their_ends(x):
    low, high = inverse((x, x))
    assert F(low) * F(x) < 1 < F(high) * F(x)
    low, high = root((x, x))
    assert F(low) ** 2 < F(x) < F(high) ** 2


def test_an_end_that_is_not_known_stays_so():
    assert inverse((None, 2.0)) == (math.nextafter(0.5, 0), None)
    assert root((4.0, None)) == (math.nextafter(2, 0), None)


@given(
    st.lists(st.lists(sizes, min_size=3, max_size=3), min_size=3, max_size=3), st.lists(whole, min_size=3, max_size=3)
)
def test_a_form_lies_between_its_ends_for_dense_and_sparse_matrices(rows, x):
    exactly = np.array(rows, dtype=object)
    dense = Enclosed.rounded(exactly)
    sparse = Enclosed(middle=sp.csc_array(dense.middle), radius=sp.csc_array(dense.radius))
    vector = [F(entry) / 7 for entry in map(float, x)]
    x = np.array(list(map(float, vector)))
    vector = fractions(x)
    truth = vector @ exactly @ vector
    for matrix in (dense, sparse):
        low, high = matrix.form(x)
        assert F(low) < truth < F(high)


# --- what is proved is proved where it can be ------------------------------------------------------------------------


@pytest.mark.parametrize("make", [np.array, sp.csc_array])
def test_a_definite_matrix_is_proved_to_be_so_up_to_its_radius_and_no_further(make):
    A = np.array([[2.0, 1.0], [1.0, 2.0]])
    for radius, proved in ((0.0, True), (0.4, True), (0.6, False)):
        matrix = Enclosed(middle=make(A), radius=make(np.full((2, 2), radius)))
        assert positive_definite(matrix) == proved


@pytest.mark.parametrize("n", [3, 60])
@pytest.mark.parametrize("make", [np.array, sp.csc_array])
def test_the_schur_complement_of_a_chain_of_springs_lies_between_close_bounds(n, make):
    chain = 2 * np.eye(n + 1) - np.eye(n + 1, k=1) - np.eye(n + 1, k=-1)
    chain[n, n] = 1  # held at one end, seen from the other: stiffness 1/(n + 1)
    eliminated = Elimination(Enclosed.exactly(make(chain)), np.array([n]))
    low, high = eliminated.bound(1)[0, 0], eliminated.bound(-1)[0, 0]
    assert F(low) < F(1, n + 1) < F(high)
    assert high - low < 1e-14 * n**2


def test_a_pencil_without_a_definite_second_matrix_has_no_bounds():
    ones, minus = Enclosed.exactly(np.eye(2)), Enclosed.exactly(-np.eye(2))
    assert enclose_largest((ones, minus)) == (None, None)


@pytest.mark.parametrize("make", [np.array, sp.csc_array])
def test_the_largest_eigenvalue_of_a_string_lies_between_bounds_that_differ_by_rounding(make):
    n = 40
    string = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    truth = 4 * math.sin(math.pi * n / (2 * (n + 1))) ** 2
    X, Y = Enclosed.exactly(make(string)), Enclosed.exactly(make(np.eye(n)))
    low, high = enclose_largest((X, Y), guess=truth)
    assert low < truth * (1 + 1e-15)
    assert truth * (1 - 1e-15) < high
    assert high / low - 1 < 1e-12


# --- element matrices -------------------------------------------------------------------------------------------------


def assembled(mesh, local, d):
    """The sum of exact element matrices."""
    size = d * len(mesh.points)
    matrix = np.zeros((size, size), dtype=object) + F(0)
    for nodes, entries in zip(mesh.cells, local, strict=True):
        unknowns = (d * nodes[:, None] + np.arange(d)).ravel()
        matrix[np.ix_(unknowns, unknowns)] += entries.reshape(len(unknowns), -1)
    return matrix


def within(found, truth):
    """Whether the truth lies within the radius, entry by entry, and the radius is that of rounding."""
    middle, radius = (fractions(part.toarray()) for part in (found.middle, found.radius))
    assert (abs(truth - middle) <= radius).all()
    assert (radius <= 1e-14 * abs(truth).max()).all()


@fewer(6)
@given(sizes, sizes, sizes, st.fractions(0, F(49, 100), max_denominator=100), sizes)
def test_matrices_of_a_rectangle_are_the_exact_ones_within_their_radius(width, height, young, poisson, length):
    mesh, material = rectangle((F(0), width), (-height, F(0)), (2, 3)), plane_strain(young, poisson)
    within(exact.stiffness(mesh, material), assembled(mesh, element.stiffness(mesh, material), 2))
    scalar = element.laplace(mesh) + element.mass(mesh) / length**2
    both = np.einsum("cij,pq->cipjq", scalar, np.eye(2, dtype=int))
    within(exact.gram(mesh, length), assembled(mesh, both, 2))


@given(sizes, sizes)
def test_matrices_of_a_bar_are_the_exact_ones_within_their_radius(width, young):
    mesh = interval((F(0), width), 5)
    within(exact.stiffness(mesh, bar(young)), assembled(mesh, element.stiffness(mesh, bar(young)), 1))


def test_a_mesh_of_doubles_means_the_doubles():
    mesh = rectangle((0.0, 1.0), (0.0, 0.3), (3, 2))
    meant = Shapes.of(fractions(mesh.points), mesh.cells)
    material = plane_strain(F(3), F(1, 3))
    local = element.stiffness(meant, material)[meant.of_cell]
    within(exact.stiffness(mesh, material), assembled(mesh, local, 2))

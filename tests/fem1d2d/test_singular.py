"""Matrices of which no factor exists in doubles, and how condensation treats the ones that are only semidefinite."""

import numpy as np
import pytest
import scipy.sparse as sp

from fem1d2d import Condensation, Lifted, MeshError, Uncoupled, solver

SEMIDEFINITE = sp.csc_array(np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]]))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", [Condensation, Lifted])
def test_a_pivot_of_zero_is_an_error_of_the_mesh_and_no_warning(kind):
    with pytest.raises(MeshError, match="singular in doubles"):
        solver(SEMIDEFINITE)
    with pytest.raises(MeshError, match="singular in doubles"):
        kind(SEMIDEFINITE, np.array([2])).times(np.ones(1))


@pytest.mark.parametrize("unit", [1e-14, 1.0, 1e14])
def test_the_schur_complement_of_a_semidefinite_matrix_has_its_digits_in_every_unit(unit):
    """A chain of springs that nothing holds: between its ends it is one spring, of 1/(1/k_1 + 1/k_2 + ..)."""
    k = np.array([1.0, 2.0, 4.0, 8.0]) * unit
    matrix = np.diag(np.append(k, 0) + np.append(0, k)) - np.diag(k, 1) - np.diag(k, -1)
    body = Condensation(sp.csc_array(matrix), np.array([0, 4]), singular=True)
    spring = 1 / (1 / k).sum()
    assert np.abs(body.schur - spring * np.array([[1.0, -1.0], [-1.0, 1.0]])).max() <= 1e-14 * unit


def test_components_of_the_same_pattern_and_other_entries_are_condensed_apart():
    soft, stiff = np.array([[2.0, -1.0], [-1.0, 2.0]]), np.array([[8.0, -4.0], [-4.0, 3.0]])
    matrix = sp.csc_array(np.kron(soft, np.diag([1.0, 0.0])) + np.kron(stiff, np.diag([0.0, 1.0])))
    found = Uncoupled(matrix, np.array([2, 3]), np.array([0, 1, 0, 1])).schur
    assert np.abs(found - np.diag([1.5, 1.0])).max() < 1e-15


@pytest.mark.parametrize("many", [0, 1000])
def test_a_matrix_whose_pivots_had_to_be_exchanged_is_no_definite_one(monkeypatch, many):
    """Cells of very different size: the second one is lost beside the first in doubles, and a pivot is 0."""
    monkeypatch.setattr(Condensation, "MANY", many)
    matrix = sp.csc_array(np.array([[1e20, -1e20, 0.0], [-1e20, 1e20 + 1, -1.0], [0.0, -1.0, 2.0]]))
    load = np.ones(3)
    for asked in (lambda body: body.response(load), lambda body: body.schur, lambda body: body.condense(load)):
        with pytest.raises(MeshError, match="singular in doubles"):
            asked(Condensation(matrix, np.array([2]), np.arange(3)))

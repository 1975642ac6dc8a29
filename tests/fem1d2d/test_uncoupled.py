"""What is factorised together and what apart: components that nothing couples, a load with its Schur complement."""

import numpy as np
import pytest
import scipy.sparse as sp
from condensed_cases import EPS, norm
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer, held_bodies

from fem1d2d import Condensation, Uncoupled, gram, plane_strain, rectangle, stiffness


@pytest.fixture
def factorisations(monkeypatch):
    """How many there have been, as a list of their sizes."""
    sizes = []

    def counted(matrix, **options):
        sizes.append(matrix.shape[0])
        return sp.linalg.splu(matrix, **options)

    monkeypatch.setattr("fem1d2d.condense.splu", counted)
    return sizes


@fewer(4, at_night=1)
@given(held_bodies(3), st.integers(0, 2**16))
def test_a_norm_is_condensed_and_solved_component_by_component(body, seed):
    """Whatever components the supports hold."""
    mesh, _, free = body
    H = gram(mesh)[free][:, free].tocsc()
    n, random = len(free), np.random.default_rng(seed)
    interface, load = random.permutation(n)[: (n + 1) // 2], random.standard_normal((n, 2))
    parts, whole = Uncoupled(H, interface, free % mesh.dimension), Condensation(H, interface)
    assert norm(parts.schur - whole.schur) <= n * EPS * norm(H.toarray()) * (1 + norm(whole.lift) ** 2)
    assert np.array_equal(parts.schur, parts.schur.T)
    other = Uncoupled(H, interface, free % mesh.dimension)
    for right in (load, load[:, 0]):
        x = other.solver()(right)
        assert norm(H @ x - right) <= n * EPS * (norm(H.toarray()) * norm(x) + norm(right))
    assert np.array_equal(other.schur, parts.schur)


def test_components_of_the_same_matrix_share_one_factorisation_of_half_the_size(factorisations):
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (8, 4))
    H, component = gram(mesh), np.arange(2 * len(mesh.points)) % 2
    top = 2 * np.unique(mesh.sides["top"])
    norms = Uncoupled(H, np.concatenate([top, top + 1]), component)
    norms.solver()
    assert norms.schur.shape == (18, 18)
    assert factorisations == [len(mesh.points)]
    held = np.delete(np.arange(len(component)), 0)  # one component at one node: the matrices differ
    Uncoupled(H[held][:, held].tocsc(), np.array([5, 6]), component[held]).solver()
    assert sorted(factorisations[1:]) == [len(mesh.points) - 1, len(mesh.points)]


def test_a_load_and_the_schur_complement_are_condensed_by_one_factorisation(factorisations):
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (8, 4))
    free = np.flatnonzero(np.repeat(mesh.points[:, 1] > 0, 2))
    A = stiffness(mesh, plane_strain(1.0, 0.3))[free][:, free].tocsc()
    interface, load = np.arange(7, len(free), 8), np.arange(1.0, len(free) + 1)
    body, known = Condensation(A, interface), Condensation(A, interface)
    felt = body.condense(load)
    assert body.schur.shape == (len(interface),) * 2
    assert len(factorisations) == 1
    assert norm(body.schur - known.schur) <= 64 * EPS * norm(body.schur)
    assert norm(felt - known.condense(load)) <= 64 * EPS * norm(load) * (1 + norm(known.lift))

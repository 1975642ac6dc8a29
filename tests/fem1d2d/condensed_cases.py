"""Matrices with an interface onto which they are condensed, drawn by construction."""

import fem_oracle
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import strategies as st
from strategies import held_bodies

from fem1d2d import Condensation, Lifted, gram, stiffness

EPS = np.finfo(float).eps


class Products(Condensation):
    """As of an interface with many unknowns."""

    MANY = 0


#: In sparse matrices, with few or many unknowns on the interface, and in the dense ones of a body of few unknowns.
either = pytest.mark.parametrize("kind", [Condensation, Products, Lifted])


def norm(A):
    return float(np.linalg.norm(np.asarray(A, dtype=float), 2)) if A.size else 0.0


@st.composite
def definite(draw, most=6):
    """Integer matrices G'G + I, as rationals and as floats, and an ordered interface."""
    n = draw(st.integers(1, most))
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    G = np.where(random.random((n, n)) < 0.6, random.integers(-4, 5, (n, n)), 0)
    A = G.T @ G + np.eye(n, dtype=int)
    interface = random.permutation(n)[: draw(st.integers(1, n))]
    return fem_oracle.exactly(A), sp.csc_array(A.astype(float)), interface


@st.composite
def condensed_bodies(draw, most=3):
    """The stiffness or Gram matrix of a held body, and an ordered interface of one to all unknowns."""
    mesh, material, free = draw(held_bodies(most))
    matrix = draw(st.sampled_from([stiffness(mesh, material), gram(mesh)]))
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    return matrix[free][:, free].tocsc(), random.permutation(len(free))[: draw(st.integers(1, len(free)))]

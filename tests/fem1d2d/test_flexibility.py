"""Displacements under a load and under forces on the interface, which one factorisation gives."""

import fem_oracle
import numpy as np
from condensed_cases import EPS, condensed_bodies, definite, either, norm
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer

from fem1d2d import solver


@either
@given(definite(), st.integers(0, 2**16))
def test_the_response_is_the_inverse_by_elimination_in_rationals(kind, case, seed):
    A, floats, interface = case
    n, b = len(A), len(interface)
    random = np.random.default_rng(seed)
    load, force = random.integers(-9, 10, n), random.integers(-9, 10, b)
    found = kind(floats, interface).response(load.astype(float))
    columns = fem_oracle.zeros(n, b)
    columns[interface, np.arange(b)] = 1
    inverse, loaded = fem_oracle.solve(A, columns), fem_oracle.solve(A, fem_oracle.exactly(load[:, None]))[:, 0]
    slack = n * EPS * np.linalg.cond(A.astype(float))
    assert norm(fem_oracle.exactly(found.flexibility) - inverse[interface]) <= slack * norm(inverse)
    assert np.array_equal(found.flexibility, found.flexibility.T)
    assert norm(fem_oracle.exactly(found.loaded) - loaded) <= slack * norm(inverse) * (1 + norm(load)) * n
    moved = fem_oracle.exactly(found.field(force.astype(float)))
    assert norm(moved - inverse @ force) <= slack * norm(inverse) * (1 + norm(force))


@either
@fewer(4, at_night=1)
@given(condensed_bodies(), st.integers(0, 2**16))
def test_the_response_of_a_body_is_its_schur_complement_inverted_and_its_solves(kind, case, seed):
    matrix, interface = case
    random = np.random.default_rng(seed)
    load, force = random.standard_normal(matrix.shape[0]), random.standard_normal(len(interface))
    found, solve = kind(matrix, interface).response(load), solver(matrix)
    forces = np.zeros(len(load))
    forces[interface] = force
    slack = len(load) * EPS * np.linalg.cond(matrix.toarray())
    assert norm(found.flexibility @ kind(matrix, interface).schur - np.eye(len(force))) <= slack
    for one, other in ((found.loaded, solve(load)), (found.field(force), solve(forces))):
        assert norm(one - other) <= slack * norm(other)
    assert norm(found.flexibility @ force - found.field(force)[interface]) <= slack * norm(solve(forces))

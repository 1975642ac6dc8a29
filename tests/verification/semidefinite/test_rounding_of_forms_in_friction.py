"""The bound of rounding in the forms with friction, a transfer and nearly singular bodies, against exact rationals."""

import math

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from strategies import AT_NIGHT

import verification as vf
from verification.semidefinite import trace_forms
from verification.semidefinite.trace_forms import TraceForms

#: Nodes of the Neumann grid where the grids differ, and of the contact grid.
N, n = 3, 4


def rational(x):
    return fmpq(*float(x).as_integer_ratio())


def exact(matrix):
    return fmpq_mat(*matrix.shape, [rational(x) for x in np.ravel(matrix)])


def array(matrix):
    return np.array(matrix.entries(), dtype=object).reshape(matrix.nrows(), matrix.ncols())


def spread_over(random, size, smallest):
    """A symmetric matrix of doubles with eigenvalues from 1 down to the smallest."""
    turn = np.linalg.qr(random.standard_normal((size, size)))[0]
    matrix = turn @ np.diag(np.geomspace(1.0, smallest, size)) @ turn.T
    return (matrix + matrix.T) / 2


def two_bodies(seed, smallest, apart, of_neumann=None):
    """Random bodies, whose grids differ where ``apart``, and coordinates in which their matrices are of size 1."""
    random = np.random.default_rng(seed)
    nodes = N if apart else n
    S_1, S_2 = spread_over(random, 2 * n, smallest), spread_over(random, 2 * nodes, of_neumann or smallest)
    P = random.dirichlet(np.ones(nodes), size=n)
    P[:, 0] += 1 - P.sum(axis=1)
    weights, kernel = random.uniform(0.3, 1.7, n), random.uniform(0.0, 1.0, (n, nodes))
    matrices = {"S1": S_1, "S2": S_2, "kernel": kernel, "transfer": P if apart else None}
    pair = vf.build(**matrices, x=np.arange(float(n)), weights=weights, friction="0.3")
    near = tuple(np.linalg.inv(np.linalg.cholesky(S)).T for S in (pair.neumann.schur, pair.contact.schur))
    multipliers = tuple(random.uniform(0.1, 3.0, n) * random.choice([-1, 1], n) for _ in range(9))
    return pair, near, multipliers


def in_rationals(pair, k, near, multipliers, square, cross, step, weight):
    """The form of :meth:`TraceForms.with_multipliers`, condition by condition, from the matrices of the pair."""
    contact, neumann = pair.contact.grid, pair.neumann.grid
    S_1, S_2, kernel = (array(exact(m)) for m in (pair.contact.schur, pair.neumann.schur, pair.interface.kernel))
    P = array(exact(pair.interface.transfer))
    zeros = np.full((2 * n, neumann.size), fmpq(0), dtype=object)
    both = zeros.copy()
    both[contact.tangential, neumann.tangential] = both[contact.normal, neumann.normal] = P
    eye = array(exact(np.eye(2 * n)))
    d = np.hstack([array(exact(np.eye(neumann.size))), zeros.T])
    c = np.hstack([zeros, eye])
    g, force = S_2 @ d, S_1 @ c
    p, jump = both.T @ force, -(both @ d + c)
    zeta = kernel @ g[neumann.normal]
    press, gap = force[contact.normal], jump[contact.normal]
    shear, slip = force[contact.tangential], jump[contact.tangential]
    wk = [rational(k) * rational(w) for w in contact.weights]
    one = [fmpq(1)] * n
    families = [(press, gap, one), (shear, slip, one), (zeta, zeta, wk), (slip, slip, wk), (zeta, slip, wk)]
    families += [(gap, gap, one), (press, press, one), (shear, shear, one)]
    form = rational(square) * d.T @ g - rational(cross) * d.T @ p
    for values, (a, b, times) in zip(multipliers, families, strict=False):
        form = form - a.T @ (np.array([rational(v) * t for v, t in zip(values, times, strict=True)])[:, None] * b)
    columns = [array(exact(one)) for one in near]
    if step is not None:
        row = rational(step[0]) * p + rational(step[1]) * g
        form = np.block([[S_2 / rational(weight), row], [row.T, form]])
        columns = [columns[0] * rational(math.sqrt(weight)), *columns]
    ends, size = np.cumsum([0, *(len(one) for one in columns)]), len(form)
    turn = np.full((size, size), fmpq(0), dtype=object)
    for start, end, one in zip(ends, ends[1:], columns, strict=False):
        turn[start:end, start:end] = one
    return turn.T @ ((form + form.T) / fmpq(2)) @ turn


def is_definite(matrix):
    """True if a symmetric matrix of rationals is positive definite: all pivots are positive."""
    matrix = matrix.copy()
    for i in range(len(matrix)):
        if not matrix[i, i] > 0:
            return False
        matrix[i + 1 :, i + 1 :] -= np.outer(matrix[i + 1 :, i], matrix[i, i + 1 :]) / matrix[i, i]
    return True


#: Steps (a, b) and weights, smaller and larger than 1.
STEPS = [(None, 1.0), ((0.7, 0.3), 1.0), ((1.0, -1.0), 1 / 7), ((1.0, -1.0), 1.3), ((1.0, -1.0), 3e4)]
CASES = pytest.mark.parametrize("apart", [False, True])


@CASES
@pytest.mark.parametrize("smallest", [1e-2, 1e-9])
@pytest.mark.parametrize(("step", "weight"), STEPS)
def test_the_exact_form_lies_within_the_bound_of_rounding(monkeypatch, apart, smallest, step, weight):
    seen = []
    monkeypatch.setattr(trace_forms, "positive_definite", lambda enclosed: seen.append(enclosed) or True)
    for seed in range(3 if AT_NIGHT else 1):
        pair, near, multipliers = two_bodies(seed, smallest, apart)
        k = float(pair.friction)
        traces = TraceForms(pair, k, S_1=pair.contact.schur, carries=slice(0, 2 * n), near=near)
        chosen = multipliers[:8]  # the ninth is weighed by a root, which no rational is
        definite = traces.with_multipliers(chosen, cross=0.7, step=step)
        assert definite(1.9, weight) if step else definite(1.9)
        found = seen.pop()
        error = np.abs(array(exact(found.middle)) - in_rationals(pair, k, near, chosen, 1.9, 0.7, step, weight))
        assert (error <= array(exact(found.radius))).all()


@CASES
@pytest.mark.parametrize("seed", range(12 if AT_NIGHT else 4))
def test_whatever_is_accepted_nearest_to_singular_is_positive_definite_in_rationals(apart, seed):
    pair, near, _ = two_bodies(seed, 1e-9, apart, of_neumann=0.5)
    k = float(pair.friction)
    traces = TraceForms(pair, k, S_1=pair.contact.schur, carries=slice(0, 2 * n), near=near)
    chosen = tuple(np.full(n, value) for value in (9.0, 9.0, -0.1, -0.1))
    definite = traces.with_multipliers(chosen, cross=1.0, step=(0.7, 0.3))
    low, high = 0.0, 1e6
    assert definite(high)
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (low, middle) if definite(middle) else (middle, high)
    at = lambda square: in_rationals(pair, k, near, chosen, square, 1.0, (0.7, 0.3), 1.0)
    assert is_definite(at(high))

"""The bound of rounding in the forms with friction, a transfer and nearly singular bodies, against exact rationals."""

import numpy as np
import pytest
from rational_forms import exact, form_of, is_definite, rational, seen_from
from strategies import AT_NIGHT

import verification as vf
from verification.semidefinite import trace_forms
from verification.semidefinite.trace_forms import TraceForms

#: Nodes of the Neumann grid where the grids differ, and of the contact grid.
N, n = 3, 4


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
    interface, wk = pair.interface, exact(pair.contact.grid.weights) * rational(k)
    joint = {"wk": wk, "kernel": interface.kernel, "P": interface.transfer}
    given = {"cross": cross, "step": step, "weight": weight}
    form = form_of(pair.contact.schur, pair.neumann.schur, multipliers, square, **given, **joint)
    return seen_from(near, form, step, weight)


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
        error = np.abs(exact(found.middle) - in_rationals(pair, k, near, chosen, 1.9, 0.7, step, weight))
        assert (error <= exact(found.radius)).all()


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

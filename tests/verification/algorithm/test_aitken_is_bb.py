"""Aitken's factor is the second step length of Barzilai and Borwein, in the inner product of the norm (5.21).

Between two iterates let s be the change of g and y the change of ``g - T g``: the factor is ``<s, y>/<y, y>``.  Without
friction ``g - T g`` is the gradient of the energy E(u_2) in this inner product (``test_gradient_step.py``).
"""

from itertools import islice, pairwise, takewhile

import numpy as np
import pytest
from chain_problems import case

import verification as vf
from verification.algorithm.relaxation import Aitken, Metric, inner

SEEDS = range(7)

#: Residuals below this share of the first are rounding.
ARRIVED = 1e-8


def aitken(pair, first=0.3, count=14):
    """Iterates of a run with Aitken's rule, until it arrives, and the factors that it took."""
    states = list(islice(vf.iterate(pair, rule="aitken", theta=first), count))
    states = list(takewhile(lambda state: state.residual > ARRIVED * states[0].residual, states))
    residuals = [state.image - state.g for state in states]
    steps = [after.g - before.g for before, after in pairwise(states)]
    return states, [inner(pair, s, r) / inner(pair, r, r) for s, r in zip(steps, residuals, strict=False)]


@pytest.mark.parametrize("friction", [0, "0.3"])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_factor_of_aitken_is_the_second_step_length_of_barzilai_and_borwein(seed, friction):
    """An identity of the rule: it holds with friction and across changes of contact."""
    pair = case(seed, friction)[0]
    states, taken = aitken(pair)
    assert len(taken) > 3
    assert taken[0] == pytest.approx(0.3)
    for before, after, factor in zip(states, states[1:], taken[1:], strict=False):
        s, y = after.g - before.g, (after.g - after.image) - (before.g - before.image)
        assert factor == pytest.approx(inner(pair, s, y) / inner(pair, y, y), rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_without_friction_the_factors_lie_between_1_over_1_plus_rho_n_and_1_in_contact_too(seed):
    """E is 1-strongly convex and (1 + rho_N)-smooth: <s, y> >= |s|^2 and <s, y> >= |y|^2/(1 + rho_N)."""
    pair, measured, *_ = case(seed, 0)
    _, taken = aitken(pair)
    least = 1 / (1 + measured.rho_normal.value)
    assert all(least * (1 - 1e-6) <= factor <= 1 + 1e-6 for factor in taken[1:])


@pytest.mark.parametrize("seed", SEEDS)
def test_in_a_tied_coupling_the_second_step_lengths_are_the_first_ones_of_a_scaled_gradient(seed):
    """On a quadratic the second is the first for the errors times the root of the Hessian: the theorems are on that.

    Modes of 1 + H, with H = S_n^-1 S_c, are orthonormal in (5.21); each is a number in a diagonal gradient method.
    """
    pair = case(seed, 0)[0]
    S_c, metric = pair.contact.schur, Metric.of(pair)
    root = pair.neumann.root
    H = root.T @ pair.neumann.flexibility(S_c @ pair.neumann.inverse @ root)
    curved, modes = np.linalg.eigh(np.eye(len(H)) + (H + H.T) / 2)
    g = root @ np.random.default_rng(seed).standard_normal(len(H))
    step, load = Aitken().on_vectors(0.2, metric), pair.contact.load
    image = lambda force: load - S_c @ pair.neumann.flexibility(force)
    at = modes.T @ metric.coordinates(g - image(g)) * np.sqrt(curved)  # the gradient, scaled
    factor = 0.2
    for _ in range(8):
        following = step(g, image(g))
        r = image(g) - g
        assert inner(pair, following - g, r) / inner(pair, r, r) == pytest.approx(factor, rel=1e-5)
        g = following
        factor, at = (at @ at) / (at @ (curved * at)), (1 - factor * curved) * at

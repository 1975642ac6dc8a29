"""An error of the slip from which an increment starts: the factor of the theorem bounds it, and stick keeps it."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from problem_list import changed
from scipy.linalg import eigh

import verification as vf
from verification.interface.assembly import discretise
from verification.monolithic import contact_system
from verification.testing.strategies import SEEDS

BODIES = {
    "one grid": {},
    "grids that differ": {"body2": {"cells": [7, 2]}},
    "mirror images": {
        "body1": {"x": ["0.4", "1.6"], "cells": [6, 2], "young": 20000}, "body2": {"cells": [6, 2], "young": 20000}
    },
}  # fmt: skip


def largest(A, B):
    return eigh(A, B, eigvals_only=True)[-1]


def measured(bodies):
    """W, the norm K as a matrix, kappa and mu."""
    system, w = contact_system(bodies), bodies.interface.contact.weights
    t, W = system.t, system.W
    K, K0 = np.linalg.inv(W)[:t, :t], np.linalg.inv(W[:t, :t])
    felt = np.zeros_like(W)
    felt[t:, t:] = system.friction.T @ (system.friction / w[:, None])
    kappa = np.sqrt(largest(felt, W) * largest(np.diag(w), K0))
    return W, K, kappa, np.sqrt(largest(K, K0))


@pytest.mark.parametrize("name", BODIES)
@given(data=st.data())
def test_an_error_of_slip_grows_by_the_factor_of_the_theorem_at_most(name, data):
    k = data.draw(st.sampled_from(["0", "0.05", "0.1", "0.2"]))
    size, top = data.draw(st.sampled_from([1e-5, 1e-4, 1e-3, 1e-2])), data.draw(st.sampled_from(["0", "0.002", "0.01"]))
    problem = vf.Problem.from_dict(changed(changed(**BODIES[name]), contact={"friction": k}))
    bodies = discretise(problem)
    W, K, kappa, mu = measured(bodies)
    assume(kappa < 1)
    random = np.random.default_rng(data.draw(SEEDS))
    base = size * random.normal(size=len(K))
    slips = base, base + data.draw(st.sampled_from([1e-6, 1e-3, 1.0])) * size * random.normal(size=len(K))
    loaded = problem.with_keys({"body2.prescribed.top": [top, "-0.01"]})
    found = [vf.solve(bodies.under(loaded, slip)) for slip in slips]
    norm = lambda vector, matrix: float(np.sqrt(max(vector @ matrix @ vector, 0.0)))
    before = norm(slips[0] - slips[1], K)
    force = norm(found[0].force - found[1].force, W)
    after = norm(found[0].contact.slip - found[1].contact.slip, K)
    rounding = 1e-9 * (norm(found[0].contact.slip, K) + norm(slips[0], K) + norm(found[0].force, W))
    assert force <= before / np.sqrt(1 - kappa**2) + rounding
    assert after <= mu * before / np.sqrt(1 - kappa**2) + rounding


def test_mirror_images_have_no_coupling_and_other_bodies_some():
    factors = {name: measured(discretise(vf.Problem.from_dict(changed(**BODIES[name]))))[3] for name in BODIES}
    assert factors["one grid"] > 1.01
    assert 1 - 1e-9 <= factors["mirror images"] < factors["one grid"]


def test_where_all_nodes_stick_an_error_of_slip_stays_as_it_is():
    problem = vf.Problem.from_dict(changed(contact={"friction": "5"}))
    bodies = discretise(problem)
    random = np.random.default_rng(0)
    slips = [1e-6 * random.normal(size=7) for _ in range(2)]
    found = [vf.solve(bodies.under(problem, slip)).contact for slip in slips]
    assert all(each.pattern["stick"] == 7 for each in found)
    assert np.abs((found[0].slip - found[1].slip) - (slips[0] - slips[1])).max() <= 1e-12

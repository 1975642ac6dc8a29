"""An error of the slip from which an increment starts: the factors of the theorem bound it, and stick keeps it."""

import itertools
import math
from functools import cache

import numpy as np
import pytest
import strategies
from hypothesis import assume, given
from hypothesis import strategies as st
from problem_list import changed
from scipy.linalg import eigh

import verification as vf
from verification.algorithm.monolithic import contact_system
from verification.interface.assembly import discretise
from verification.semidefinite import interior_point, model
from verification.semidefinite.slip_errors import STATES, SlipErrors
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


@cache
def bounded(name, k):
    return SlipErrors(vf.Problem.from_dict(changed(changed(**BODIES[name]), contact={"friction": k})))


@pytest.mark.parametrize("name", BODIES)
@strategies.fewer(4)
@given(data=st.data())
def test_an_error_of_slip_grows_by_the_factor_of_the_theorem_at_most(name, data):
    k = data.draw(st.sampled_from(["0", "0.05", "0.1", "0.2", "0.3"]))
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
    if k != "0":
        assert after <= bounded(name, k).bound * before + rounding


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


# --- bounds by multipliers, and pairs ---------------------------------------------------------------------------------


@pytest.mark.parametrize("k", ["0.02", "0.3"])
@pytest.mark.parametrize("name", BODIES)
def test_a_pair_attains_the_factor_found_and_lies_below_the_bound_which_is_not_above_the_closed_one(name, k):
    errors = bounded(name, k)
    _, _, kappa, mu = measured(
        discretise(vf.Problem.from_dict(changed(changed(**BODIES[name]), contact={"friction": k})))
    )
    assert (errors.kappa, errors.mu) == pytest.approx((kappa, mu), rel=1e-9)
    assert errors.closed == pytest.approx(mu / np.sqrt(1 - kappa**2), rel=1e-9)
    found = errors.search(np.random.default_rng(0))
    size = lambda vector: math.sqrt(vector @ errors.K @ vector)
    ends = [errors.end(found.jump, slip) for slip in found.slips]
    assert size(ends[0] - ends[1]) / size(found.slips[0] - found.slips[1]) == pytest.approx(found.factor, rel=1e-6)
    assert 1 - 1e-9 <= found.factor <= errors.bound <= errors.closed
    if name != "mirror images":
        assert found.factor > 1.0005
        assert errors.bound - 1 < 0.2 * (errors.closed - 1)


def test_the_search_finds_nearly_the_largest_factor_of_all_patterns():
    narrow = {"body1": {"x": ["0.6", "1.4"], "cells": [4, 2]}, "body2": {"x": ["0.6", "1.4"], "cells": [4, 2]}}
    errors = SlipErrors(vf.Problem.from_dict(changed(**narrow, contact={"radius": "0.3"})))
    every = np.array(list(itertools.product(range(len(STATES)), repeat=errors.n)))
    factors = errors.factors(np.moveaxis(STATES[every], 2, 1))
    found = errors.search(np.random.default_rng(1), starts=6).factor
    assert 1 + 0.9 * (factors.max() - 1) <= found <= factors.max() * (1 + 1e-12)
    assert factors.max() <= errors.bound


@pytest.mark.parametrize("name", ["one grid", "grids that differ"])
def test_the_multipliers_make_the_form_of_the_theorem_nearly_singular_and_definite(name):
    bodies = discretise(vf.Problem.from_dict(changed(**BODIES[name])))
    (W, K, *_), friction = measured(bodies), contact_system(bodies).friction
    found, n = interior_point.solve(bounded(name, "0.2").program()), len(K)
    nu, tau, a, c = np.split(found.y, 4)
    assert (found.y >= 0).all()
    assert (4 * a * c >= tau**2).all()
    size = 1 / np.diag(W).mean()  # of a stiffness

    def form(s, d, square):
        force = -np.linalg.solve(W, d)
        y, b = d[:n] - s, friction @ force[n:]
        brackets = nu * force[n:] * d[n:] + tau * force[:n] * y + a * b**2 + c * y**2
        return (square * s @ K @ s - d[:n] @ K @ d[:n] - brackets.sum()) / size

    def least(square):
        value = lambda x: form(x[:n], x[n:], square)
        units = np.eye(3 * n)
        mixed = np.array([[value(u + v) - value(u) - value(v) for u in units] for v in units]) / 2
        return np.linalg.eigvalsh(mixed)[0]

    assert least(found.s) > -1e-9
    assert least(found.s * (1 - 1e-4)) < -1e-7


def test_the_program_has_the_value_that_a_conic_solver_finds():
    program = bounded("one grid", "0.2").program()
    assert model.solve(program).s == pytest.approx(interior_point.solve(program).s, rel=1e-6)


def test_where_pressure_causes_no_slip_an_error_hardly_grows_by_the_bound():
    assert bounded("mirror images", "0.3").bound < 1 + 1e-5
    assert bounded("mirror images", "0.3").closed > 1.1


def test_beyond_kappa_1_there_is_no_bound_and_held_nodes_or_no_friction_are_refused():
    assert bounded("one grid", "1").bound == math.inf
    rollers = {"bottom": [0, 0], "left": [0, "free"]}
    for tables in (
        {"contact": {"friction": "0"}},
        {"body2": {"prescribed": {"top": ["free", "-0.01"]}}},
        {
            "body1": {"x": ["0.4", "1.6"], "cells": [6, 2], "fixed": [], "prescribed": rollers},
            "body2": {"prescribed": {"top": [0, "-0.01"], "left": [0, "free"]}},
        },
    ):
        with pytest.raises(ValueError, match="needed friction and 1 to 100 free contact nodes"):
            SlipErrors(vf.Problem.from_dict(changed(**tables)))

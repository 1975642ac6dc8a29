"""What holds where nothing opens or slips: theta = 2/(2 + rho_min + rho), its rate, and when it is advised."""

from fractions import Fraction as F

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problem_list import changed, plates
from scipy.linalg import eigh
from strategies import contact_problems, fewer, log_uniform

import verification as vf
from ndtheory.energy_norms import predicted_factor, predicted_rate, predicted_theta, tied_factor, tied_rate, tied_theta
from verification.interface import assembly

spectra = st.tuples(log_uniform(-6, 6), log_uniform(-6, 6)).map(sorted)


# --- the formula ------------------------------------------------------------------------------------------------------


@given(spectra, st.integers(1, 400))
def test_no_theta_has_a_smaller_factor_on_a_tied_interface(ends, hundredth):
    low, high = ends
    best = tied_theta(low, high)
    assert tied_factor(best, low, high) == tied_rate(low, high)
    assert tied_factor(best * F(hundredth, 100), low, high) >= tied_rate(low, high)


@given(spectra, st.fractions(0, 1))
def test_the_factor_of_every_mode_is_at_most_that_of_an_end(ends, share):
    low, high = ends
    mode = low + share * (high - low)
    for theta in (tied_theta(low, high), predicted_theta(high)):
        assert abs(1 - theta * (1 + mode)) <= tied_factor(theta, low, high)


@given(spectra)
def test_where_something_opens_the_tied_theta_contracts_all_the_same_without_friction(ends):
    low, high = ends
    theta = tied_theta(low, high)
    assert theta < 2 / (1 + high)
    assert predicted_factor(theta, high) == (low + high) / (2 + low + high) < 1
    assert predicted_rate(high) <= predicted_factor(theta, high)  # so it is paid for
    assert tied_rate(low, high) <= predicted_rate(high)


@given(spectra)
def test_a_tied_interface_prefers_the_same_role_as_contact_does(ends):
    """The eigenvalues of the other role are the reciprocals."""
    low, high = ends
    tied = tied_rate(low, high) - tied_rate(1 / high, 1 / low)
    contact = predicted_rate(high) - predicted_rate(1 / low)
    assert (tied > 0) == (low * high > 1 and low < high)
    assert (contact > 0) == (low * high > 1)


# --- runs ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("neumann_body", [1, 2])
def test_a_bonded_iteration_never_takes_longer_steps_than_the_tied_rate_and_comes_to_it(neumann_body):
    problem = vf.Problem.from_dict(plates(iteration={"neumann_body": neumann_body}))
    pair, role = vf.build(problem), vf.advise(problem).roles[0]
    S_c, S_n = pair.contact.schur, pair.neumann.schur
    values, modes = eigh(S_c, S_n)
    assert (role.rho_min.value, role.rho_tied.value) == pytest.approx((values[0], values[-1]), rel=1e-9)
    every, ends = modes.sum(axis=1), modes[:, 0] + modes[:, -1]
    ratios = {}
    for name, start in (("every", every), ("ends", ends)):
        error, lengths = S_n @ start, []
        for _ in range(40):
            lengths.append(float(np.sqrt(error @ np.linalg.solve(S_n, error))))
            answer = -S_c @ np.linalg.solve(S_n, error)  # steps I and II, as differences
            error = role.theta_tied * answer + (1 - role.theta_tied) * error
        ratios[name] = np.array(lengths[1:]) / lengths[:-1]
    assert ratios["every"].max() <= role.rate_tied * (1 + 1e-9)
    assert ratios["every"][-1] >= 0.99 * role.rate_tied
    assert ratios["ends"] == pytest.approx(role.rate_tied, rel=1e-9)


@pytest.mark.parametrize("young", [(70000, 20000), (20000, 70000)], ids=str)
@pytest.mark.parametrize("neumann_body", [1, 2])
def test_contact_that_stays_closed_and_sticks_converges_at_the_tied_rate(neumann_body, young):
    moduli = {"body1": {"young": young[0]}, "body2": {"young": young[1]}}
    data = changed(**moduli, contact={"friction": 3}, iteration={"neumann_body": neumann_body, "max_iterations": 2000})
    problem = vf.Problem.from_dict(data)
    role = vf.advise(problem).roles[0]
    tied, plain = (vf.run(problem, theta=f"{theta:.12f}") for theta in (role.theta_tied, role.theta_predicted))
    assert tied.table()["stick"][3:] == [7] * (tied.evaluations - 3)
    assert tied.observed_rate.value <= role.rate_tied * (1 + 1e-3)
    assert tied.iterations <= plain.iterations
    if (neumann_body, young) == (2, (70000, 20000)):  # the bad role
        assert 3 * tied.iterations < plain.iterations


# --- the advice ------------------------------------------------------------------------------------------------------


def test_tied_advice_is_that_of_both_ends_of_the_spectrum():
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)))
    found, plain = vf.advise(problem, tied=True), vf.advise(problem)
    measured = vf.measure(problem)
    low, high = measured.rho_min.value, measured.rho_max.value
    best = found.best
    assert (best.theta_tied, best.rate_tied) == pytest.approx((2 / (2 + low + high), (high - low) / (2 + low + high)))
    assert best.theta_tied * 0.999 < found.theta <= best.theta_tied < plain.theta
    assert found.to_dict()["tied"] is True
    assert plain.to_dict()["tied"] is False
    assert [role.to_dict() for role in found.roles] == [role.to_dict() for role in plain.roles]
    assert "if nothing opens or slips" in found.quote


def test_without_friction_the_tied_spectrum_is_that_of_both_components():
    """A frictionless interface slides: its rho_normal is no rho of a tied one."""
    problem = vf.example("signorini")
    measured, role = vf.measure(problem), vf.advise(problem).roles[0]
    assert role.rho.value == measured.rho_normal.value < measured.rho_max.value == role.rho_tied.value
    assert role.theta_tied == pytest.approx(2 / (2 + measured.rho_min.value + measured.rho_max.value))


@pytest.mark.parametrize("seed", range(5))
def test_matrices_have_both_ends_too(seed):
    random = np.random.default_rng(seed)
    A, B = (M @ M.T + 0.1 * np.eye(6) for M in random.normal(size=(2, 6, 6)))
    found = vf.advise_matrices(A, B, tied=True)
    for role, pencil in zip(found.roles, ((A, B), (B, A)), strict=True):
        values = eigh(*pencil, eigvals_only=True)
        assert (role.rho_min.value, role.rho_tied.value) == pytest.approx((values[0], values[-1]), rel=1e-9)
    assert found.neumann_body == vf.advise_matrices(A, B).neumann_body


@pytest.mark.parametrize("friction", [0, "0.2"])
def test_beyond_interface_matrices_the_tied_numbers_are_the_same(monkeypatch, friction):
    problem = vf.Problem.from_dict(plates(contact={"friction": friction}))
    dense = vf.advise(problem)
    monkeypatch.setattr(assembly, "MOST_CONTACT_NODES", 5)
    large = vf.advise(problem, tied=True)
    for one, other in zip(large.roles, dense.roles, strict=True):
        assert (one.theta_tied, one.rate_tied) == pytest.approx((other.theta_tied, other.rate_tied), rel=1e-8)
    plain = vf.advise(problem).roles[0]
    assert (plain.theta_tied is None) == (friction == 0)
    assert friction or "ask for tied" in plain.to_dict()["reason"]["theta_tied"]


def test_a_body_that_contact_alone_holds_has_0_as_its_softest_mode():
    loose = vf.Problem.from_dict(changed(body2={"prescribed": {"top": ["free", "-0.01"]}}))
    role = vf.advise(loose).best
    assert role.rho_min.value == pytest.approx(0, abs=1e-9)
    assert role.theta_tied == pytest.approx(role.theta_predicted, rel=1e-9)


def test_exchanging_equal_bodies_makes_no_difference():
    same = {"x": ["0.4", "1.6"], "cells": [6, 2], "young": 70000}
    for neumann_body in (1, 2):
        data = changed(body1=same, body2={"young": 70000}, iteration={"neumann_body": neumann_body})
        found = vf.advise(vf.Problem.from_dict(data))
        assert found.no_difference
        assert found.neumann_body == neumann_body  # the file keeps its own
        assert "the same with the roles exchanged." in found.quote
    assert not vf.advise(vf.example("section6").changed(cells=((10, 2), (6, 2)))).no_difference


@pytest.mark.parametrize("rho", [30, 333, 1001, 1999, 12887.5577, 98765.4])
def test_a_theta_to_paste_is_rounded_to_the_safe_side(rho):
    """To three figures nearest, 2/(2 + 1001) would be 0.002 > 2/(1 + 1001) and diverge."""
    role = np.diag([rho, 1.0])
    theta = vf.advise_matrices(role, role[::-1, ::-1]).theta
    best = vf.advise_matrices(role, role[::-1, ::-1]).best.theta_predicted
    assert 0.999 * best < theta <= best
    assert F(theta) * (1 + F(rho)) < 2


# --- runs of other codes ---------------------------------------------------------------------------------------------


@given(st.lists(log_uniform(-2, 2), min_size=1, max_size=6), st.integers(5, 100))
def test_a_tied_run_that_grows_tells_rho_and_gets_a_theta_that_converges(modes, hundredth):
    theta, rho = F(hundredth, 100), max(modes)
    ratio = max(abs(1 - theta * (1 + mode)) for mode in modes)
    found = vf.advise_run(theta, ratio, tied=True) if ratio else None
    if found is None or ratio <= F(12, 10):
        return
    assert {reading.kind for reading in found.readings} == {"mode-high"}
    assert found.best.rho.value == pytest.approx(float(rho), rel=1e-9)
    assert F(found.theta) * (1 + rho) < 2


@pytest.mark.parametrize("ratio", ["1", "0.97", "1.02", "0.5", "0.9"])
def test_a_tied_run_that_does_not_grow_beyond_doubt_leaves_the_run_to_make(ratio):
    plain, found = (vf.advise_run("0.1", ratio, tied=tied) for tied in (False, True))
    assert found.next.theta == plain.next.theta
    assert found.theta == plain.theta
    assert "opens" not in f"{found.next.why} {[reading.says for reading in found.readings]}"
    assert {reading.kind for reading in found.readings} <= {"mode-high", "mode-low"}


@fewer(5)
@given(contact_problems())
def test_the_tied_theta_of_any_problem_lies_below_the_predicted_one_with_friction(data):
    try:
        roles = vf.advise(vf.Problem.from_dict(data)).roles
    except vf.ProblemError:
        return
    for role in roles:
        if role.theta_tied is not None and role.rho == role.rho_tied:
            assert role.theta_tied <= role.theta_predicted
            assert role.rate_tied <= role.rate_predicted

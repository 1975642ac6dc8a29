"""One solve with each body a step, one product for the certificate: and the step is the one that is written out."""

import pickle
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problem_list import PROBLEMS, SHEARED, plates
from sample_runs import SAMPLES, by_name
from strategies import AT_NIGHT
from threadpoolctl import threadpool_info, threadpool_limits

import verification as vf
from verification.algorithm.fixed_point import RENEWED, FixedPointMap, iterate_at, iterates
from verification.algorithm.rates import noise
from verification.algorithm.relaxation import Constant
from verification.contact import ContactError, active_set
from verification.contact.active_set import ActiveSet, Pattern
from verification.contact.kkt import KKTCertificate
from verification.dense import Cholesky, times, worst
from verification.interface import body
from verification.interface.body import Condensed
from verification.machine.threads import one_thread
from verification.registry import RULES

EPS = np.finfo(float).eps

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


@cache
def pair_named(name, swapped=False):
    pair = vf.build(vf.Problem.from_dict(PROBLEMS[name]))
    return pair.swapped() if swapped else pair


@cache
def unlike():
    """Contact nodes 4 and 6, a transfer between them."""
    random = np.random.default_rng(5)
    P = random.uniform(0, 1, (4, 6))
    A, B = random.normal(size=(8, 8)), random.normal(size=(12, 12))
    return vf.build(
        S1=A @ A.T + 4 * np.eye(8),
        S2=20 * (B @ B.T + 6 * np.eye(12)),
        load1=random.normal(size=8),
        load2=random.normal(size=12),
        x=np.linspace(0, 1, 4),
        kernel=random.uniform(0, 1, (4, 6)),
        transfer=P / P.sum(axis=1, keepdims=True),
        friction="0.2",
    )


def sheared(**iteration):
    """Section 6, 13 contact nodes, pushed sideways so that nodes slip."""
    return vf.build(vf.Problem.from_dict(plates(body2={"prescribed": SHEARED}, iteration=iteration)))


def counted(monkeypatch, owner, name):
    """The calls of a method or a class from here on."""
    calls, original = [], getattr(owner, name)
    monkeypatch.setattr(owner, name, lambda *args, **named: calls.append(args) or original(*args, **named))
    return calls


# --- the step is the one that is written out --------------------------------------------------------------------------


def pairs():
    """By day every other problem with its roles exchanged."""
    for i, name in enumerate(SAMPLES):
        for swapped in (False, True) if AT_NIGHT else (i % 2 == 1,):
            yield pytest.param(partial(pair_named, name, swapped), id=f"{name}{', roles exchanged' * swapped}")
    yield pytest.param(unlike, id="grids that differ")


@pytest.mark.parametrize("made", list(pairs()))
def test_the_displacement_that_follows_is_the_one_solved_for_g(made):
    """(I) by its sum against (I) solved, in the energy norm: 35 units in the last place were seen."""
    pair = made()
    T, S2 = FixedPointMap(pair), pair.neumann.schur
    for theta in (0.02, 0.1) if AT_NIGHT else (0.02,):
        for state in islice(iterates(T, Constant().begin(pair, theta, None)), 100):
            u = T.displacement(state.g)
            off, moved = state.displacement - u, u - pair.neumann.known
            assert np.sqrt(off @ S2 @ off) <= 100 * EPS * np.sqrt(moved @ S2 @ moved)


@pytest.mark.parametrize("made", list(pairs()))
def test_T_at_the_displacement_that_follows_is_T_to_the_noise_that_rates_are_judged_by(made):
    """The noise of an iterate is that of one evaluation: the sums before it add nothing that it does not cover."""
    pair = made()
    T, theta, checked = FixedPointMap(pair), 0.05, 0
    for state in islice(iterates(T, Constant().begin(pair, theta, None)), 80):
        solved = iterate_at(T, state.g)
        if solved.contact.pattern == state.contact.pattern:
            assert pair.neumann.dual_norm(solved.image - state.image) <= noise(pair, state)
            checked += 1
    assert checked > 40


@pytest.mark.parametrize("made", list(pairs()))
def test_residual_and_size_are_norms_of_what_the_iterate_shows(made):
    """From g = 0 to residuals of 1e-9, each against a solve of its own."""
    pair = made()
    for state in islice(iterates(FixedPointMap(pair), Constant().begin(pair, 0.1, None)), 60):
        if state.relative_residual > 1e-9:
            off = state.image - state.g
            expected = np.sqrt(off @ pair.neumann.inverse @ off)
            assert state.residual == pytest.approx(expected, rel=1e-9)
        expected = np.sqrt(max(state.image @ pair.neumann.inverse @ state.image, 0.0))
        assert state.size == pytest.approx(expected, rel=1e-9, abs=1e-12 * state.scale)


@by_name
def test_every_step_keeps_a_certificate_of_its_own(name):
    """Its KKT residuals are those that the whole matrix, the force and the displacement of the iterate give."""
    pair = pair_named(name)
    for state in islice(vf.iterate(pair), 2 * RENEWED):
        obstacle = state.displacement + np.concatenate([np.zeros(pair.contact.grid.t), pair.interface.gap])
        q = pair.contact.load - pair.contact.schur @ obstacle
        solved, bound = state.contact, pair.bound(state.g)
        assert solved.kkt.residual <= 1e-11
        if pair.contact.free.all():
            found = KKTCertificate(pair.contact.schur).measure(q, bound, solved.v, solved.force)
            assert found.residual <= 1e-11
            assert abs(found.residual - solved.kkt.residual) <= 1e-13


@pytest.mark.parametrize("part", [0, 1], ids=["v", "force"])
def test_what_the_active_set_gets_wrong_is_not_certified(part, monkeypatch):
    """The certificate multiplies by the whole matrix itself: no product of the solver enters it."""
    solve = ActiveSet.solve

    def wrong(self, q, bound, start, hint=None):
        found = solve(self, q, bound, start, hint)
        return tuple(x * (1 + 1e-9) if i == part else x for i, x in enumerate(found))

    pair = sheared()
    next(vf.iterate(pair, solver="active-set"))
    monkeypatch.setattr(ActiveSet, "solve", wrong)
    with pytest.raises(ContactError, match="KKT residual"):
        list(islice(vf.iterate(pair, solver="active-set"), 3))


def test_what_an_iterate_is_does_not_depend_on_what_was_asked_before():
    """One map for two runs in turn, and T evaluated elsewhere between their steps: digit by digit the same."""
    pair = sheared()
    alone = [state.g for state in islice(iterates(FixedPointMap(pair), Constant().begin(pair, 0.3, None)), 40)]
    T = FixedPointMap(pair)
    beside = iterates(T, Constant().begin(pair, 0.7, None), start=alone[3])
    for g, state in zip(alone, iterates(T, Constant().begin(pair, 0.3, None)), strict=False):
        assert np.array_equal(state.g, g)
        next(beside)
        T(2 * g)


def test_an_iterate_pickles_with_all_it_shows():
    state = list(islice(vf.iterate(sheared()), 5))[-1]
    again = pickle.loads(pickle.dumps(state))
    assert np.array_equal(again.displacement, state.displacement)
    assert again.contact.kkt == state.contact.kkt
    assert again.contact.pattern == state.contact.pattern
    assert not again.displacement.flags.writeable


# --- what a step takes ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1, 2, RENEWED, RENEWED + 1, 3 * RENEWED])
def test_a_step_takes_one_solve_with_the_neumann_body(steps, monkeypatch):
    """Beside them: (I) for the first g, the displacement without contact, and one for each time (I) is solved anew."""
    pair = sheared()
    calls = counted(monkeypatch, Condensed, "flexibility")
    assert len(list(islice(iterates(FixedPointMap(pair), Constant().begin(pair, 0.3, None)), steps))) == steps
    assert len(calls) == steps + 2 + (steps - 1) // RENEWED


@pytest.mark.parametrize("rule", sorted(set(RULES) - {"constant"}))
def test_after_any_other_rule_the_first_step_is_solved_for_g_itself(rule):
    pair = sheared()
    T = FixedPointMap(pair)
    for state in islice(vf.iterate(pair, rule=rule), 12):
        assert np.array_equal(state.displacement, T.displacement(state.g))


def test_the_moving_block_is_factorised_only_where_the_pattern_changes(monkeypatch):
    """A run at its solution: the first step finds the pattern, no later one factorises."""
    run = vf.run(sheared())
    patterns = {state.contact.pattern for state in run.iterates}
    assert len(patterns) > 1
    calls = counted(monkeypatch, active_set, "Cholesky")
    T, start = FixedPointMap(run.pair), run.last.g
    states = iterates(T, Constant().begin(run.pair, 0.3, None), start)
    next(states)
    found = len(calls)
    assert found
    assert all(state.contact.pattern == run.last.contact.pattern for state in islice(states, 30))
    assert len(calls) == found
    T(np.zeros_like(start))
    assert len(calls) > found


def test_no_digit_depends_on_the_pattern_that_is_tried_first():
    """Where both settle; also the direction of a node without friction, which nothing mends, is that of the start."""
    random, settled = np.random.default_rng(3), 0
    A = random.normal(size=(8, 8))
    S = A @ A.T + np.eye(8)
    solver = ActiveSet(S, np.ones(8, dtype=bool), 4)
    draw = lambda: Pattern(touching=random.random(4) < 0.5, sliding=random.integers(-1, 2, 4).astype(np.int8))
    for _ in range(200):
        q, bound, start = random.normal(size=8), random.choice([0.0, 0.3, 1.0], 4), draw()
        alone, hinted = solver.solve(q, bound, start), solver.solve(q, bound, start, draw())
        if alone is not None and hinted is not None:
            settled += 1
            assert alone[2] == hinted[2]
            assert np.array_equal(alone[0], hinted[0])
            assert np.array_equal(alone[1], hinted[1])
    assert settled > 150


def test_the_kept_system_is_that_of_the_pattern_it_is_asked_for():
    """To and fro between two patterns: each answer is that of a solver that kept nothing."""
    random = np.random.default_rng(1)
    A = random.normal(size=(8, 8))
    S, free = A @ A.T + np.eye(8), np.ones(8, dtype=bool)
    used = ActiveSet(S, free, 4)
    for _ in range(50):
        q, bound = random.normal(size=8), random.uniform(0, 1, 4)
        fresh = ActiveSet(S, free, 4).solve(q, bound, Pattern.sticking(4, 4))
        kept = used.solve(q, bound, Pattern.sticking(4, 4))
        assert np.array_equal(kept[0], fresh[0])
        assert np.array_equal(kept[1], fresh[1])
        assert kept[2] == fresh[2]


# --- products and solves ----------------------------------------------------------------------------------------------


def symmetric(random, size):
    A = random.normal(size=(size, size + 2))
    return A @ A.T


@given(random=seeds, size=st.integers(1, 9), fortran=st.booleans())
def test_the_product_of_a_symmetric_matrix_is_the_general_one(random, size, fortran):
    S, v = symmetric(random, size), random.normal(size=size)
    S = (np.asfortranarray if fortran else np.ascontiguousarray)((S + S.T) / 2)
    S.setflags(write=False)
    assert np.abs(times(S, v) - S @ v).max() <= 4 * size * EPS * (np.abs(S) @ np.abs(v)).max()


@given(random=seeds, size=st.integers(1, 9), share=st.sampled_from([0, 0.5, 1]), columns=st.integers(0, 3))
def test_a_solve_on_some_rows_leaves_the_others_at_zero(random, size, share, columns):
    S = symmetric(random, size)
    right = random.normal(size=(size, columns) if columns else size)
    given_right = right.copy()
    rows = np.flatnonzero(random.random(size) < share)
    found = Cholesky(S, rows).solve(right)
    expected = np.zeros_like(right)
    expected[rows] = np.linalg.solve(S[np.ix_(rows, rows)], right[rows])
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max(initial=0.0))
    assert np.array_equal(right, given_right)


@pytest.mark.parametrize(("last", "error"), [(-1.0, np.linalg.LinAlgError), (np.nan, ValueError)])
def test_a_matrix_that_is_indefinite_or_no_number_on_the_rows_is_refused(last, error):
    S = np.diag([1.0, 2.0, last])
    assert Cholesky(S, np.arange(2)).solve(np.ones(3)) == pytest.approx([1, 0.5, 0])
    with pytest.raises(error):
        Cholesky(S, np.arange(1, 3))


def test_the_largest_of_numbers_one_of_which_is_none_is_none():
    assert worst(np.array([-3.0, -1.0])) == 0.0
    assert worst(np.zeros(0)) == 0.0
    assert worst(np.array([1.0, 2.5])) == 2.5
    assert np.isnan(worst(np.array([1.0, np.nan, 3.0])))


def threads():
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_one_thread_gives_back_what_was_set():
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with one_thread():
            assert set(threads()) == {1}
            with one_thread():
                assert set(threads()) == {1}
            assert set(threads()) == {1}
        assert threads() == before
        with pytest.raises(KeyError), one_thread():
            raise KeyError
        assert threads() == before


# --- a pair beside another shares what is condensed -------------------------------------------------------------------

CHANGES = {
    "friction": {"friction": "0.35"},
    "no friction": {"friction": 0},
    "theta": {"theta": "0.4"},
    "law": {"law": "local"},
    "radius": {"radius": "0.4"},
    "roles": {"neumann_body": 2},
    "gap": {"gap": "0.001"},
    "E of body 1": {"young": (50000, None)},
    "both E": {"young": (4 * 70000, 10000)},
    "E, roles and friction": {"young": (None, 90000), "neumann_body": 2, "friction": "0.1"},
}


def factorisations(monkeypatch):
    monkeypatch.setattr(body, "FEW", 0)
    return counted(monkeypatch, body, "Condensation")


@pytest.mark.parametrize("values", CHANGES.values(), ids=CHANGES)
def test_other_values_cost_no_condensation_and_the_pair_is_that_of_the_file(values, monkeypatch):
    """Body force, tractions and prescribed displacements among the loads: a modulus scales the last alone."""
    loads = {"body_force": [3, -5], "traction": {"left": [7, 0]}, "prescribed": {"top": ["0.006", "-0.015"]}}
    problem = vf.Problem.from_dict(plates(body2=loads, iteration={"tolerance": "1e-9"}))
    pair, file = vf.build(problem), vf.build(problem.changed(**values))
    calls = factorisations(monkeypatch)
    other = pair.changed(**values)
    run = vf.run(other)
    assert calls == []
    assert other.problem == file.problem
    assert (other.neumann_body, other.friction, other.settings) == (file.neumann_body, file.friction, file.settings)
    assert other.interface.law == file.interface.law
    for one, two in ((other.contact, file.contact), (other.neumann, file.neumann)):
        assert one.upward == two.upward
        for name in ("schur", "load", "known"):
            expected = getattr(two, name)
            assert np.abs(getattr(one, name) - expected).max() <= 1e-13 * np.abs(expected).max()
    again = vf.run(file)
    assert run.iterations == again.iterations
    assert np.abs(run.last.g - again.last.g).max() <= 1e-11 * np.abs(again.last.g).max()
    assert all(
        np.abs(one - two).max() <= 1e-11 * np.abs(two).max()
        for one, two in zip(run.displacements, again.displacements, strict=True)
    )


@pytest.mark.parametrize(
    ("values", "anew"),
    [
        ({"poisson": ("0.2", None)}, 1),
        ({"poisson": ("0.2", "0.2")}, 2),
        ({"cells": ((40, 3), (24, 3))}, 2),
        ({"cells": ((20, 4), None), "young": (None, 100)}, 1),
    ],
)
def test_a_body_of_another_matrix_is_condensed_anew(values, anew, monkeypatch):
    pair, file = sheared(), vf.build(sheared().problem.changed(**values))
    calls = factorisations(monkeypatch)
    other = pair.changed(**values)
    assert len(calls) == anew
    for one, two in ((other.contact, file.contact), (other.neumann, file.neumann)):
        assert np.abs(one.schur - two.schur).max() <= 1e-13 * np.abs(two.schur).max()


def test_what_does_not_change_is_the_same_object():
    pair = sheared()
    other = pair.changed(friction="0.1", theta="0.3")
    assert other.contact is pair.contact
    assert other.neumann is pair.neumann
    other = pair.changed(young=(None, 10))
    assert other.body1 is pair.body1
    assert other.body2 is not pair.body2


def test_bars_share_too_and_their_stiffness_is_E_over_L():
    pair = pair_named("bars")
    other = pair.changed(young=(9, 5))
    assert (other.body1.schur[0, 0], other.body2.schur[0, 0]) == pytest.approx((9, 2.5), rel=1e-13)


def test_a_law_of_its_own_stays():
    @dataclass(frozen=True)
    class Flat(vf.Law):
        name = "flat"
        words = "flat"

        def operator(self, interface):
            return np.full((interface.contact.n, interface.neumann.n), 0.7)

    pair = vf.build(sheared().problem, law=Flat())
    assert pair.changed(friction="0.1").interface.law == Flat()
    assert pair.changed(law="local").interface.law != Flat()


def test_matrices_have_no_values_to_change():
    with pytest.raises(ValueError, match="made from matrices"):
        unlike().changed(friction="0.1")


def test_bad_values_are_refused_as_those_of_the_file_are():
    with pytest.raises(ValueError, match=r"body1\.young"):
        sheared().changed(young=(-1, None))

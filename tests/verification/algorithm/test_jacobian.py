"""T near a force: its affine piece against differences of T, the norm of the piece, and two bars."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import strategies
from chain_problems import step_II
from hypothesis import assume, given
from hypothesis import strategies as st
from pieces import Evaluated, along_a_run, assert_affine, at_solution, forces, held, seeds
from problem_list import PROBLEMS, bars
from sample_runs import by_name

import verification as vf
from verification.algorithm.affine_piece import Piece, piece_of
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.linearisation import NotLinear, linearise
from verification.interface.pair import pair_from


@strategies.fewer(1)
@given(data=strategies.contact_problems(), random=seeds)
def test_the_derivatives_of_a_piece_are_differences_of_T_over_a_step_inside_it(data, random):
    pair = pair_from(vf.Problem.from_dict(data))
    assume(assert_affine(pair, forces(pair, random), random))


@pytest.mark.parametrize("count", [0, 1, 5] if strategies.AT_NIGHT else [0, 5])
@by_name
def test_T_is_affine_around_the_iterates_of_a_run(name, count):
    """With the local law, with contact nodes held, at a kernel that sees single nodes, for bars."""
    pair = pair_from(vf.Problem.from_dict(PROBLEMS[name]))
    g, random = along_a_run(pair, count), np.random.default_rng(count)
    assert assert_affine(pair, g, random) or count == 0  # 0 itself lies on an edge: no friction bound is smooth there


def with_pattern(piece: Piece, **changes: np.ndarray) -> Piece:
    return replace(piece, pattern=replace(piece.pattern, **changes))


MUTANTS: dict[str, Callable[[Piece], Piece]] = {
    "a constant friction bound": lambda piece: replace(piece, sign=0 * piece.sign),
    "the other sign of S sigma_N": lambda piece: replace(piece, sign=-piece.sign),
    "sliding the other way": lambda piece: with_pattern(piece, sliding=-piece.pattern.sliding),
    "sticking": lambda piece: with_pattern(piece, sliding=0 * piece.pattern.sliding),
    "one node less in touch": lambda piece: with_pattern(
        piece, touching=piece.pattern.touching & (piece.pair.contact.grid.x > 0.5)
    ),
}


@pytest.mark.parametrize("mutant", MUTANTS)
def test_the_derivative_on_another_piece_is_found_out(mutant):
    pair = pair_from(vf.Problem.from_dict(PROBLEMS["sheared until it slips"]))
    g, random = along_a_run(pair, 5), np.random.default_rng(0)
    assert assert_affine(pair, g, random)
    with pytest.raises(AssertionError):
        assert_affine(pair, g, random, MUTANTS[mutant])


def test_no_friction_acts_where_the_contact_body_is_held():
    """The support carries any shear there, and the trace space has no such component."""
    pair = held(neumann=False)
    g = along_a_run(pair, 4)
    assert assert_affine(pair, g, np.random.default_rng(0))
    piece = piece_of(pair, g, step_II(pair, g).pattern)
    assert piece.pattern.sliding[0] == 0
    assert not piece.force[0].any()
    assert not piece.jump[0].any()


def test_a_held_node_of_the_contact_body_is_where_its_support_holds_it_and_carries_no_shear():
    pair = held(neumann=False)
    slipped = np.linspace(3e-3, 0, pair.contact.grid.t)
    pair = replace(pair, interface=replace(pair.interface, slipped=slipped))  # after an increment
    u, contact = FixedPointMap(pair)(along_a_run(pair, 4))
    (held_row,) = np.flatnonzero(~pair.contact.free)
    trace = pair.interface.carry(u) + pair.offset + contact.v
    assert abs(pair.offset[held_row]) == slipped[held_row] > 0
    assert trace[held_row] == pytest.approx(pair.contact.known[held_row], abs=1e-15)
    assert contact.force[held_row] == 0
    assert contact.pattern.sliding[held_row] == 0


def test_the_scale_of_a_state_is_the_larger_size_of_a_force_and_of_its_image():
    pair = held(neumann=True)
    g = 1e-9 * along_a_run(pair, 4)
    norm = pair.neumann.dual_norm
    for least in ({}, {"least": 0.0}, {"least": 1e3}):
        state = iterate_at(FixedPointMap(pair), g, **least)
        wanted = max(norm(state.g), norm(state.image), least.get("least", 0.0))
        assert state.scale == pytest.approx(wanted, rel=1e-9)
    weak = pair_from(vf.Problem.from_dict(bars(body2={"prescribed": {"right": "-1e-9"}})))
    state = iterate_at(FixedPointMap(weak), np.zeros(1))
    assert state.scale == pytest.approx(weak.neumann.dual_norm(state.image))
    assert 0 < state.scale < 1e-3


def test_nodes_on_which_contact_forces_act_are_never_still():
    """Their normal force may pass 0; open nodes out of reach keep theirs."""
    pair = pair_from(vf.Problem.from_dict(PROBLEMS["sheared until it slips"]))
    g = along_a_run(pair, 5)
    pattern = step_II(pair, g).pattern
    zero = np.zeros(len(g))
    touching = np.ones_like(pattern.touching)
    assert not piece_of(pair, zero, replace(pattern, touching=touching)).still.any()
    assert piece_of(pair, zero, replace(pattern, touching=~touching)).still.all()


def test_a_force_on_a_held_node_of_the_neumann_body_moves_nothing():
    pair = held(neumann=True)
    g = along_a_run(pair, 4)
    assert assert_affine(pair, g, np.random.default_rng(0))
    piece = piece_of(pair, g, step_II(pair, g).pattern)
    assert not piece.force[:, 0].any()
    assert not piece.jump[:, 0].any()
    assert piece.basis.shape == (len(g), len(g) - 1)


# --- the norm of a piece ----------------------------------------------------------------------------------------------


@strategies.fewer(2)
@given(data=strategies.contact_problems(), random=seeds, theta=st.floats(0.01, 0.99))
def test_J_theta_is_theta_times_the_derivative_and_1_minus_theta_times_the_identity(data, random, theta):
    """In coordinates in which (5.21) is Euclidean, and |J| is its largest ratio, attained by two forces."""
    pair = pair_from(vf.Problem.from_dict(data))
    state = Evaluated(pair)(forces(pair, random))
    piece, norm = piece_of(pair, state.g, state.contact.pattern), pair.neumann.dual_norm
    J, basis = piece.relaxed(theta), piece.basis
    size = 1 + np.abs(J).max()  # of the two terms of theta K + (1 - theta), whose sum may be all but 0
    near, rounding = 1e-9 * size, 1e-13 * size
    for y in random.standard_normal((5, basis.shape[1])):
        d = basis @ y
        assert norm(d) == pytest.approx(np.linalg.norm(y), rel=1e-9)
        moved = theta * piece.force @ d + (1 - theta) * d
        assert norm(moved - basis @ (J @ y)) <= near * norm(d)
        assert norm(moved) <= (piece.factor(theta) * (1 + 1e-9) + rounding) * norm(d)
    if basis.shape[1]:
        worst = basis @ np.linalg.svd(J)[2][0]
        moved = theta * piece.force @ worst + (1 - theta) * worst
        assert norm(moved) == pytest.approx(piece.factor(theta), rel=1e-9, abs=rounding)


# --- two bars ---------------------------------------------------------------------------------------------------------


@given(data=strategies.bar_problems(), theta=st.floats(0.01, 0.99))
def test_between_two_bars_the_derivative_is_minus_rho_in_contact_and_0_apart(data, theta):
    """In contact the force vanishes after a step of g*/rho; |J| = rho(J) = |1 - theta - theta rho|."""
    pair = pair_from(vf.Problem.from_dict(data))
    rho = pair.contact.schur[0, 0] / pair.neumann.schur[0, 0]
    state = at_solution(pair)
    assume(state is not None)  # the loads may be equal to the last digit, and T g mere rounding
    piece = piece_of(pair, state.g, state.contact.pattern)
    if state.contact.pattern.touching[0]:
        assert piece.force[0, 0] == pytest.approx(-rho, rel=1e-12)
        assert piece.jump[0, 0] == 0
        factor = abs(1 - theta - theta * rho)
    else:
        assert piece.force[0, 0] == 0
        assert piece.jump[0, 0] == pytest.approx(-1 / pair.neumann.schur[0, 0], rel=1e-12)
        factor = 1 - theta
    assert piece.factor(theta) == pytest.approx(factor, rel=1e-9, abs=1e-12)
    assert piece.bound.shape == (0, 1)
    pressed = state.g[0] > 1e-6 * (abs(pair.contact.load[0]) + rho * abs(pair.neumann.load[0]))
    if pressed:
        linear = linearise(pair, state, theta)
        assert linear.norm == pytest.approx(linear.radius, rel=1e-12)
        assert linear.radius == pytest.approx(factor, rel=1e-9, abs=1e-12)
        assert linear.margin == pytest.approx(1 / rho, rel=1e-6)


def test_bars_that_just_touch_are_not_linearised():
    data = bars((1, 1), (2, 1), (1, 1), body2={"prescribed": {"right": 0}})
    pair = pair_from(vf.Problem.from_dict(data))
    with pytest.raises(NotLinear, match="the node at x = 1 is about to change its state"):
        linearise(pair, Evaluated(pair)(np.zeros(1)), 0.5)

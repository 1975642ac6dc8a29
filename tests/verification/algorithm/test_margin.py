"""How far an affine piece of T reaches: to the nearest change of a contact state, and no further."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import strategies
from chain_problems import case, with_loads
from hypothesis import assume, given
from hypothesis import strategies as st
from pieces import Evaluated, assert_affine, at_solution, held
from problem_list import PROBLEMS, blocks
from sample_runs import by_name

import verification as vf
from verification.algorithm.affine_piece import Piece, piece_of
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, linearise
from verification.contact.active_set import Pattern
from verification.interface.pair import ContactPair, pair_from


def nearest_change(T: Evaluated, state: Iterate, piece: Piece) -> tuple[float, np.ndarray]:
    """How far the next change is in the norm (5.21), and the step to it, from differences of what T decides on.

    Every inequality is affine on the piece: its distance is its slack over the norm of its gradient.
    """
    pair, size = T.pair, T.pair.neumann.dual_norm(state.g)
    rows = []
    for column in piece.basis.T:
        step = size * column
        step[pair.contact.grid.normal][piece.still] = 0.0
        length = T.reach(state, step)
        assert length > 0
        ahead, behind = (T.slack(T(state.g + sign * length * step), piece) for sign in (1, -1))
        rows.append((ahead - behind) / (2 * length * size))
    gradients = np.array(rows).T
    sizes = np.linalg.norm(gradients, axis=1)
    slack = T.slack(state, piece)
    distances = np.full(len(slack), np.inf)
    moving = sizes > 1e-9 * sizes.max(initial=0.0)
    distances[moving] = slack[moving] / sizes[moving]
    least = int(np.argmin(distances))
    step = -piece.basis @ gradients[least] * (distances[least] / sizes[least])
    step[pair.contact.grid.normal][piece.still] = 0.0
    return float(distances[least]), step


def assert_margin(pair: ContactPair, random: np.random.Generator) -> bool:
    """Nothing changes within the margin, in any direction; in the worst one, just beyond it, something does.

    Returns whether there is a solution at which T is smooth.
    """
    state, T = at_solution(pair), Evaluated(pair)
    if state is None:
        return False
    try:
        linear = linearise(pair, state, 0.5)
    except NotLinear:
        return False
    piece, norm = piece_of(pair, state.g, state.contact.pattern), pair.neumann.dual_norm
    margin = linear.margin * norm(state.g)
    if margin < 1e-6 * norm(state.g) or not np.isfinite(margin):
        return False
    distance, step = nearest_change(T, state, piece)
    assert margin == pytest.approx(distance, rel=1e-5)
    assert norm(step) == pytest.approx(margin, rel=1e-5)
    for share in (0.5, 1 - 1e-4):
        for _ in range(3):
            d = piece.basis @ random.standard_normal(piece.basis.shape[1])
            d[pair.contact.grid.normal][piece.still] = 0.0
            assert T.same(state.g + share * margin * d / norm(d), state)
        assert T.same(state.g + share * step, state)
        assert T.same(state.g - share * step, state)
    assert not T.same(state.g + (1 + 1e-4) * step, state)
    return True


@strategies.fewer(4)
@given(seed=st.integers(0, 2**32 - 1))
def test_within_the_margin_no_node_changes_its_state_and_just_beyond_it_one_does(seed):
    pair, _, _, random = case(seed)
    assume(assert_margin(pair, random))


@by_name
def test_the_margin_is_that_of_the_sample_problems_too(name):
    """With the local law, with contact nodes held, for bars."""
    assert assert_margin(pair_from(vf.Problem.from_dict(PROBLEMS[name])), np.random.default_rng(0))


# --- solutions that were chosen ---------------------------------------------------------------------------------------


def with_solution(pair: ContactPair, g: np.ndarray, v: np.ndarray) -> ContactPair:
    """The same bodies under loads whose solution has the contact forces g and the jump v."""
    return with_loads(pair, g, v, g)


def chosen(pair: ContactPair, touching: list[bool], sliding: list[int], random: np.random.Generator) -> tuple[Any, Any]:
    """Contact forces and a jump with a pattern, every inequality strict."""
    t, n = pair.contact.grid.t, pair.contact.grid.n
    pressure = np.where(touching, random.uniform(0.5, 1, n), 0.0)
    bound = pair.bound(np.concatenate([np.zeros(t), pressure]))
    shear = np.where(np.array(sliding) != 0, sliding, random.uniform(-0.5, 0.5, t)) * bound
    g = np.concatenate([shear, pressure])
    length = np.linalg.norm(g) / np.linalg.norm(pair.contact.schur, 2)
    slide, gap = np.array(sliding) * random.uniform(0.5, 1, t), np.where(touching, 0.0, -random.uniform(0.5, 1, n))
    return g, length * np.concatenate([slide, gap])


def four_nodes(**contact: Any) -> ContactPair:
    contact = {"friction": "1/2", "radius": "3/2"} | contact
    data = blocks(3, (1, 2), ((3, 2), (3, 1)), body2={"prescribed": None, "fixed": ["top"]}, contact=contact)
    return pair_from(vf.Problem.from_dict(data))


PATTERN = ([True, True, True, False], [0, 1, -1, 1])


def test_a_chosen_solution_is_the_one_that_is_linearised():
    pair, random = four_nodes(), np.random.default_rng(1)
    g, v = chosen(pair, *PATTERN, random)
    state = at_solution(with_solution(pair, g, v))
    assert np.allclose(state.g, g, rtol=0, atol=1e-12)
    assert np.allclose(state.contact.v, v, rtol=0, atol=1e-12)
    assert state.contact.pattern == Pattern(touching=np.array(PATTERN[0]), sliding=np.array(PATTERN[1], dtype=np.int8))
    assert assert_margin(with_solution(pair, g, v), random)


#: What is at its end, at which node, and the component that is put there.
DEGENERATE = {
    "a node that touches without pressing": (0, "g_N"),
    "a node about to touch": (3, "v_N"),
    "a node that sticks at its friction bound": (0, "g_T"),
    "a node that slides by nothing": (1, "v_T"),
}


@pytest.mark.parametrize("end", DEGENERATE)
@pytest.mark.parametrize("rest", [0.0, 1e-3, 1e-1])
def test_at_an_end_of_step_II_linearisation_does_not_apply_and_near_it_the_margin_is_proportional(end, rest):
    pair, random = four_nodes(), np.random.default_rng(1)
    node, component = DEGENERATE[end]
    t = pair.contact.grid.t
    g, v = chosen(pair, *PATTERN, random)
    if component == "g_N":
        g[t + node] *= rest
        bound = pair.bound(g)  # it has changed with the pressure
        g[:t] = np.where(np.array(PATTERN[1]) != 0, PATTERN[1], 0.0) * bound
    elif component == "g_T":
        g[node] = (1 - rest) * pair.bound(g)[node]
    else:
        v[node + (t if component == "v_N" else 0)] *= rest
    pair = with_solution(pair, g, v)
    if rest:
        linear, smaller = linearise(pair, at_solution(pair), 0.5), rest < 0.01
        assert linear.margin < (2e-3 if smaller else 2e-1)
        assert assert_margin(pair, random)
        return
    with pytest.raises(NotLinear, match=f"the node at x = {pair.contact.grid.x[node]:g} is about to change its state"):
        linearise(pair, Evaluated(pair)(g), 0.5)


@pytest.mark.parametrize("sliding", [0, 1])
def test_a_node_that_the_neumann_body_holds_has_a_margin_like_any_other(sliding):
    """About to slide, or to slide back, it is the next one to change."""
    pair, random = held(neumann=True), np.random.default_rng(2)
    g, v = chosen(pair, [True] * pair.contact.grid.n, [sliding] + [0] * (pair.contact.grid.n - 1), random)
    if sliding:
        v[0] *= 1e-3
    else:
        g[0] = 0.999 * pair.bound(g)[0]
    assert assert_margin(with_solution(pair, g, v), random)


def test_a_node_that_the_contact_body_holds_has_a_margin_like_any_other():
    assert assert_margin(held(neumann=False), np.random.default_rng(2))


# --- nodes out of reach -----------------------------------------------------------------------------------------------


def test_a_node_out_of_reach_of_any_contact_force_stays_still_and_T_is_affine_beside_it():
    """Open, under a kernel that sees no other node: its friction bound is 0, where |S sigma_N| has an edge.

    T_theta keeps its g_N at 0; on the forces that do so T is affine, and off them it is not.
    """
    pair, random = four_nodes(radius="1/2"), np.random.default_rng(3)
    g, v = chosen(pair, [True, True, True, False], [0, 0, 1, 1], random)
    pair = with_solution(pair, g, v)
    state, t = at_solution(pair), pair.contact.grid.t
    piece = piece_of(pair, state.g, state.contact.pattern)
    assert list(piece.still) == [False, False, False, True]
    assert list(piece.sign) == [1, 1, 1, 0]
    assert piece.basis.shape == (2 * pair.contact.grid.n, 2 * pair.contact.grid.n - 1)
    assert np.abs(piece.basis[pair.contact.grid.normal][3]).max() < 1e-15 * np.abs(piece.basis).max()
    gram = piece.basis.T @ pair.neumann.flexibility(piece.basis)
    assert np.allclose(gram, np.eye(len(gram)), rtol=0, atol=1e-12)
    assert assert_affine(pair, state.g, random)
    assert assert_margin(pair, random)
    off = np.zeros(len(g))
    off[t + 3] = 1e-3 * np.abs(g).max()
    T = Evaluated(pair)
    ahead, behind = (T(state.g + sign * off).image[3] for sign in (1, -1))
    assert ahead * behind > 0  # friction answers either way: no derivative


def test_a_node_of_a_wide_kernel_is_never_still():
    pair, random = four_nodes(), np.random.default_rng(3)
    pair = with_solution(pair, *chosen(pair, [True, True, True, False], [0, 0, 1, 1], random))
    state = at_solution(pair)
    piece = piece_of(pair, state.g, state.contact.pattern)
    assert not piece.still.any()
    assert piece.basis is pair.neumann.root

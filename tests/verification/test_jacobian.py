"""T near a force: its affine piece against differences of T, the norm of the piece, and how far it reaches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import pytest
import strategies
from chain_problems import case, step_II, with_loads
from hypothesis import assume, given
from hypothesis import strategies as st
from problem_list import FOLLOWED, bars, blocks

import verification as vf
from verification.algorithm.affine_piece import Piece, piece_of
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, linearise
from verification.contact import ContactError
from verification.contact.active_set import Pattern
from verification.interface.assembly import ContactPair, build

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


class Evaluated:
    """T at forces, with all that the piece around one of them decides on."""

    def __init__(self, pair: ContactPair) -> None:
        self.pair, self.t = pair, pair.contact.grid.t

    def __call__(self, g: np.ndarray) -> Iterate:
        try:
            return iterate_at(FixedPointMap(self.pair, "active-set"), g)
        except ContactError:
            return iterate_at(FixedPointMap(self.pair, "cvxpy"), g)

    def stress(self, g: np.ndarray) -> np.ndarray:
        """S sigma_N; none without a law of friction, or where nothing rubs."""
        if self.pair.interface.kernel is None or not self.pair.friction:
            return np.zeros(0)
        return self.pair.interface.kernel @ g[self.t :]

    def same(self, g: np.ndarray, state: Iterate) -> bool:
        """Whether g lies on the piece of a state; where no friction can act, the direction of slip does not matter."""
        sign, one, two = np.sign(self.stress(state.g)), self(g).contact.pattern, state.contact.pattern
        rubs = self.pair.bound(state.g) != 0
        return (
            np.array_equal(np.sign(self.stress(g)), sign)
            and np.array_equal(one.touching, two.touching)
            and np.array_equal(one.sliding[rubs], two.sliding[rubs])
        )

    def reach(self, state: Iterate, step: np.ndarray) -> float:
        """The largest 2^-i for which the piece of a state contains both ends of a step; 0 beyond i = 20.

        The piece is convex: then it contains all between.
        """
        for i in range(21):
            if self.same(state.g + step / 2**i, state) and self.same(state.g - step / 2**i, state):
                return 0.5**i
        return 0.0

    def slack(self, state: Iterate, piece: Piece) -> np.ndarray:
        """How far each inequality of step II, and each sign of S sigma_N, is from its end."""
        v, force, sliding, t = state.contact.v, state.contact.force, piece.pattern.sliding, self.t
        bound = self.pair.bound(state.g)
        rubs, slips = piece.sign != 0, (sliding != 0)
        touching = np.where(piece.pattern.touching, force[t:], -v[t:])
        if not rubs.any():
            return touching
        sticks = np.concatenate([(bound - force[:t])[rubs & ~slips], (bound + force[:t])[rubs & ~slips]])
        return np.concatenate(
            [touching, (sliding * v[:t])[rubs & slips], sticks, (piece.sign * self.stress(state.g))[rubs]]
        )


def forces(pair: ContactPair, random: np.random.Generator) -> np.ndarray:
    """A random force of the size of the loads."""
    size = max(pair.neumann.dual_norm(side.load) for side in (pair.neumann, pair.contact)) or 1.0
    force = pair.neumann.root @ random.standard_normal(pair.neumann.root.shape[1])
    return 10 ** random.uniform(-1, 1) * size * force / pair.neumann.dual_norm(force)


def along_a_run(pair: ContactPair, count: int) -> np.ndarray:
    """The force after some steps from 0, with a theta of 0.3."""
    *_, state = islice(vf.iterate(pair, theta=0.3), count + 1)
    return state.g


def assert_affine(
    pair: ContactPair,
    g: np.ndarray,
    random: np.random.Generator,
    change: Callable[[Piece], Piece] = lambda piece: piece,
) -> bool:
    """T' d, and the derivatives of the jump and of the friction bound, are differences over a step of any length.

    Returns whether the piece was large enough for a step.
    """
    T = Evaluated(pair)
    state = T(g)
    piece = change(piece_of(pair, state.g, state.contact.pattern))
    norm, basis = pair.neumann.dual_norm, piece.basis
    size = norm(g) or norm(state.image) or 1.0
    d = basis @ random.standard_normal(basis.shape[1])
    d[pair.contact.grid.normal][piece.still] = 0.0  # to the last digit
    d *= size / norm(d)
    length = T.reach(state, d)
    if length < 1e-4:
        return False
    step = length * d
    ahead, behind = T(g + step), T(g - step)
    bound = pair.bound
    # rounding: some units in the last place of all that is added up, over the length of the step
    u = np.abs(pair.contact.stiffness) @ (np.abs(state.displacement) + np.abs(state.contact.v))
    terms = u + np.abs(pair.contact.load) + np.abs(g)
    rounding = 1e-14 * np.linalg.norm(terms) / length
    flexible = np.linalg.norm(pair.contact.inverse, 2)
    for derivative, difference, error in (
        (piece.force @ d, (ahead.image - behind.image) / (2 * length), rounding),
        (piece.jump @ d, (ahead.contact.v - behind.contact.v) / (2 * length), rounding * flexible),
        (piece.bound @ d, (bound(g + step) - bound(g - step)) / (2 * length), rounding),
    ):
        assert np.linalg.norm(derivative - difference) <= 1e-9 * np.linalg.norm(derivative) + error
    return True


@strategies.fewer(1)
@given(data=strategies.contact_problems(), random=seeds)
def test_the_derivatives_of_a_piece_are_differences_of_T_over_a_step_inside_it(data, random):
    pair = build(vf.Problem.from_dict(data))
    assume(assert_affine(pair, forces(pair, random), random))


@pytest.mark.parametrize("count", [0, 1, 5])
@pytest.mark.parametrize("name", FOLLOWED)
def test_T_is_affine_around_the_iterates_of_a_run(name, count):
    """With the local law, with contact nodes held, at a kernel that sees single nodes, for bars."""
    pair = build(vf.Problem.from_dict(FOLLOWED[name]))
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
    pair = build(vf.Problem.from_dict(FOLLOWED["sheared until it slips"]))
    g, random = along_a_run(pair, 5), np.random.default_rng(0)
    assert assert_affine(pair, g, random)
    with pytest.raises(AssertionError):
        assert_affine(pair, g, random, MUTANTS[mutant])


def held(neumann: bool) -> ContactPair:
    """The lower body on rollers at a side that ends at Gamma_c; it has the Neumann problem or the contact problem."""
    data = blocks(
        body1={"prescribed": {"left": [0, "free"]}},
        body2={"prescribed": {"top": ["1/50", "-1/50"]}},
        contact={"friction": "1/2", "radius": "1/3"},
        iteration={"neumann_body": 1 if neumann else 2},
    )
    pair = build(vf.Problem.from_dict(data))
    assert not pair.body1.free[0]
    return pair


def test_friction_on_a_held_node_of_the_contact_body_follows_its_slip():
    """The slip is that of the Neumann body alone; the force ``w k |S sigma_N|`` against it."""
    pair = held(neumann=False)
    g = along_a_run(pair, 4)
    assert assert_affine(pair, g, np.random.default_rng(0))
    piece = piece_of(pair, g, step_II(pair, g).pattern)
    assert piece.pattern.sliding[0] != 0
    assert np.array_equal(piece.force[0], piece.pattern.sliding[0] * piece.bound[0])
    assert np.array_equal(piece.jump[0], -pair.neumann.inverse[0])


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
    pair = build(vf.Problem.from_dict(data))
    state = Evaluated(pair)(forces(pair, random))
    piece, norm = piece_of(pair, state.g, state.contact.pattern), pair.neumann.dual_norm
    J, basis = piece.relaxed(theta), piece.basis
    near = 1e-9 * (1 + np.abs(J).max())
    for y in random.standard_normal((5, basis.shape[1])):
        d = basis @ y
        assert norm(d) == pytest.approx(np.linalg.norm(y), rel=1e-9)
        moved = theta * piece.force @ d + (1 - theta) * d
        assert norm(moved - basis @ (J @ y)) <= near * norm(d)
        assert norm(moved) <= piece.factor(theta) * norm(d) * (1 + 1e-9)
    if basis.shape[1]:
        worst = basis @ np.linalg.svd(J)[2][0]
        moved = theta * piece.force @ worst + (1 - theta) * worst
        assert norm(moved) == pytest.approx(piece.factor(theta), rel=1e-9)


# --- how far a piece reaches ------------------------------------------------------------------------------------------


def at_solution(pair: ContactPair) -> Iterate | None:
    """T at its fixed point, to rounding; None where no rule finds it."""
    for relaxation in ("newton", "anderson", "aitken"):
        settings = replace(pair.settings, tolerance=1e-13, relaxation=relaxation, max_iterations=100)
        found = vf.run(replace(pair, settings=settings), theta="1/3")
        if found.converged:
            return found.last
    return None


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


@strategies.fewer(2)
@given(seed=st.integers(0, 2**32 - 1))
def test_within_the_margin_no_node_changes_its_state_and_just_beyond_it_one_does(seed):
    pair, _, _, random = case(seed)
    assume(assert_margin(pair, random))


@pytest.mark.parametrize("name", FOLLOWED)
def test_the_margin_is_that_of_the_sample_problems_too(name):
    """With the local law, with contact nodes held, for bars."""
    assert assert_margin(build(vf.Problem.from_dict(FOLLOWED[name])), np.random.default_rng(0))


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
    length = np.linalg.norm(g) / np.linalg.norm(pair.contact.stiffness, 2)
    slide, gap = np.array(sliding) * random.uniform(0.5, 1, t), np.where(touching, 0.0, -random.uniform(0.5, 1, n))
    return g, length * np.concatenate([slide, gap])


def four_nodes(**contact: Any) -> ContactPair:
    contact = {"friction": "1/2", "radius": "3/2"} | contact
    data = blocks(3, (1, 2), ((3, 2), (3, 1)), body2={"prescribed": None, "fixed": ["top"]}, contact=contact)
    return build(vf.Problem.from_dict(data))


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


# --- two bars ---------------------------------------------------------------------------------------------------------


@given(data=strategies.bar_problems(), theta=st.floats(0.01, 0.99))
def test_between_two_bars_the_derivative_is_minus_rho_in_contact_and_0_apart(data, theta):
    """In contact the force vanishes after a step of g*/rho; |J| = rho(J) = |1 - theta - theta rho|."""
    pair = build(vf.Problem.from_dict(data))
    rho = pair.contact.stiffness[0, 0] / pair.neumann.stiffness[0, 0]
    state = at_solution(pair)
    assume(state is not None)  # the loads may be equal to the last digit, and T g mere rounding
    piece = piece_of(pair, state.g, state.contact.pattern)
    if state.contact.pattern.touching[0]:
        assert piece.force[0, 0] == pytest.approx(-rho, rel=1e-12)
        assert piece.jump[0, 0] == 0
        factor = abs(1 - theta - theta * rho)
    else:
        assert piece.force[0, 0] == 0
        assert piece.jump[0, 0] == pytest.approx(-1 / pair.neumann.stiffness[0, 0], rel=1e-12)
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
    pair = build(vf.Problem.from_dict(data))
    with pytest.raises(NotLinear, match="the node at x = 1 is about to change its state"):
        linearise(pair, Evaluated(pair)(np.zeros(1)), 0.5)

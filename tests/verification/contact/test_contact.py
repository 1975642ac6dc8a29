"""Step II on its own: one body, a friction bound, an obstacle; solved, certified, and solved again by enumeration."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
import strategies
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.linalg import block_diag

from verification.contact import KKT, TOLERANCE, ContactError, ContactStep
from verification.contact.active_set import ActiveSet, Pattern, Systems
from verification.contact.kkt import KKTCertificate

CONDITIONS = ("equilibrium", "non_penetration", "compression", "complementarity", "bound", "slip")

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def everywhere(S: np.ndarray) -> np.ndarray:
    return np.ones(len(S), dtype=bool)


def random_program(
    random: np.random.Generator, most: int = 7, condition: float = 1e4
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """S, q and the bounds: units of stiffness 1e-3 to 1e12, of force 1e-6 to 1e6, a third of the bounds zero."""
    n = int(random.integers(1, most + 1))
    t = n if random.random() < 0.85 else 0
    size = n + t
    axes = np.linalg.qr(random.standard_normal((size, size)))[0]
    S = (axes * 10 ** random.uniform(-np.log10(condition), 0, size)) @ axes.T
    if random.random() < 0.5:
        A = random.standard_normal((size, size + 2))
        S = A @ A.T
    S = (S + S.T) / 2 * 10 ** random.uniform(-3, 12)
    q = random.standard_normal(size) * 10 ** random.uniform(-6, 6)
    bound = np.abs(random.standard_normal(t)) * np.abs(q).max() * 10 ** random.uniform(-2, 1)
    bound[random.random(t) < 1 / 3] = 0
    return S, q, bound


def energy(S: np.ndarray, q: np.ndarray, bound: np.ndarray, v: np.ndarray) -> float:
    """What step II minimises over ``v_N <= 0``."""
    return float(v @ S @ v / 2 - q @ v + bound @ np.abs(v[: len(bound)]))


def violations(
    S: np.ndarray, q: np.ndarray, bound: np.ndarray, v: np.ndarray, force: np.ndarray, slack: float = 1e-10
) -> list[str]:
    """The conditions (2.4), (2.6) and equilibrium in plain words, each relative to the largest force."""
    t = len(bound)
    largest = max(np.abs(q).max(), np.abs(S @ v).max(), bound.max(initial=0.0)) or 1.0
    reach = largest / np.diag(S).max()
    f, w, limit = force / largest, v / reach, bound / largest
    found = []
    if np.abs(S @ v + force - q).max() > slack * largest:
        found.append("equilibrium")
    for j in range(len(v) - t):
        gap, pressure = -w[t + j], f[t + j]
        if gap < -slack or pressure < -slack or (gap > slack and pressure > slack):
            found.append(f"Signorini at {j}")
    for j in range(t):
        slips = abs(w[j]) > slack
        if abs(f[j]) > limit[j] + slack or (slips and abs(f[j] - limit[j] * np.sign(w[j])) > slack):
            found.append(f"Coulomb at {j}")
    return found


# --- thousands of programs --------------------------------------------------------------------------------------------


@given(random=seeds)
def test_the_active_set_closes_on_the_minimiser_or_says_that_it_does_not(random):
    """Thirty programs an example. A guess may cycle (once in 4000): then the convex program takes over."""
    for _ in range(30):
        S, q, bound = random_program(random)
        step = ContactStep(S, everywhere(S), len(bound), "active-set")
        try:
            found = step.solve(q, bound)
        except ContactError:
            step = ContactStep(S, everywhere(S), len(bound), "auto")
            found = step.solve(q, bound)
            assert found.solver == "cvxpy"
        assert found.kkt == KKTCertificate(S).measure(q, bound, found.v, found.force)
        assert found.kkt.residual <= TOLERANCE
        assert violations(S, q, bound, found.v, found.force) == []
        least = energy(S, q, bound, found.v)
        rounding = 1e-11 * (np.abs(found.v) @ np.abs(S) @ np.abs(found.v) + np.abs(q) @ np.abs(found.v))
        for _ in range(3):
            other = found.v + random.standard_normal(len(q)) * np.abs(q).max() / np.diag(S).max()
            other[len(bound) :] = np.minimum(other[len(bound) :], 0)
            assert least <= energy(S, q, bound, other) + rounding


def beside_a_large_force(
    S: np.ndarray, q: np.ndarray, bound: np.ndarray, times: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same program and one node more that it does not feel, with so much larger loads and no friction."""
    t, size = len(bound), len(q)
    order = [*range(t), size, *range(t, size), size + 1]  # tangential components first
    larger = np.diag(np.concatenate([np.zeros(size), np.full(2, np.diag(S).max())]))
    larger[:size, :size] = S
    load = np.concatenate([q, np.full(2, times * np.abs(q).max())])
    return larger[np.ix_(order, order)], load[order], np.append(bound, 0.0)


@pytest.mark.parametrize("solver", ["active-set", "auto"])
@pytest.mark.parametrize(("seed", "which"), [(21, 24), (45, 2), (65, 17), (103, 1)])
def test_signs_that_turn_for_ever_below_the_tolerance_do_not_keep_a_step_from_its_certificate(seed, which, solver):
    """Programs on which the active set goes round and round, made a 1e-12 part of a larger one.

    The convex program does not resolve so small a part either, but each of the guesses meets all conditions to 1e-11 of
    the largest force.  Drawn problems have such parts where friction is some 1e-14.
    """
    random = np.random.default_rng(seed)
    *_, program = (random_program(random) for _ in range(which + 1))
    with pytest.raises(ContactError):
        ContactStep(program[0], everywhere(program[0]), len(program[2]), "active-set").solve(*program[1:])
    S, q, bound = beside_a_large_force(*program, 1e12)
    found = ContactStep(S, everywhere(S), len(bound), solver).solve(q, bound)
    assert found.kkt == KKTCertificate(S).measure(q, bound, found.v, found.force)
    assert found.kkt.residual <= TOLERANCE


def test_the_active_set_rarely_gives_up_on_random_matrices():
    random, outcomes = np.random.default_rng(11), Counter()
    count = 4000 if strategies.AT_NIGHT else 1000
    for _ in range(count):
        S, q, bound = random_program(random)
        try:
            ContactStep(S, everywhere(S), len(bound), "active-set").solve(q, bound)
            outcomes["closed"] += 1
        except ContactError:
            outcomes["gave up"] += 1
    assert outcomes["gave up"] <= count / 1000


@strategies.fewer(2)
@given(random=seeds)
def test_a_step_that_remembers_solves_as_one_that_does_not(random):
    """The next guess starts from the last pattern: q and the bounds move on, the answer is that of a fresh start."""
    S, q, bound = random_program(random)
    used = ContactStep(S, everywhere(S), len(bound), "active-set")
    for _ in range(10):
        fresh = ContactStep(S, everywhere(S), len(bound), "active-set")
        try:
            one, two = used.solve(q, bound), fresh.solve(q, bound)
        except ContactError:
            pass
        else:
            largest = max(np.abs(q).max(), np.abs(two.force).max())
            assert np.abs(one.force - two.force).max() <= 1e-9 * largest
            assert np.abs(one.v - two.v).max() <= 1e-9 * max(np.abs(two.v).max(), largest / np.diag(S).max())
        q = q + random.standard_normal(len(q)) * np.abs(q).max() / 3
        bound = bound * random.uniform(0, 2, len(bound))


@given(random=seeds, stress=st.integers(-20, 20), length=st.integers(-20, 20))
@example(random=np.random.default_rng(2), stress=20, length=0)  # a node that opens and touches again
@example(random=np.random.default_rng(5), stress=20, length=0)
def test_units_do_not_change_a_digit(random, stress, length):
    """Powers of 4 are exact in every sum, product and root: forces and slips come out multiplied, digit by digit."""
    S, q, bound = random_program(random)
    a, b = 4.0**stress, 4.0**length
    try:
        here = ContactStep(S, everywhere(S), len(bound), "active-set").solve(q, bound)
    except ContactError:
        return
    there = ContactStep(a * S, everywhere(S), len(bound), "active-set").solve(a * b * q, a * b * bound)
    assert np.array_equal(there.force, a * b * here.force)
    assert np.array_equal(there.v, b * here.v)
    assert there.pattern == here.pattern


@pytest.mark.parametrize("seed", range(12))
def test_the_convex_program_and_the_active_set_find_the_same_minimiser(seed):
    S, q, bound = random_program(np.random.default_rng(seed))
    one, two = (ContactStep(S, everywhere(S), len(bound), name).solve(q, bound) for name in ("cvxpy", "active-set"))
    assert (one.solver, two.solver) == ("cvxpy", "active-set")
    assert np.allclose(one.v, two.v, rtol=1e-9, atol=1e-12 * np.abs(two.v).max())
    assert np.allclose(one.force, two.force, rtol=1e-9, atol=1e-12 * np.abs(q).max())


@given(
    stiffness=st.floats(-6, 12).map(lambda e: 10**e),
    q=st.builds(lambda sign, e: sign * 10**e, st.sampled_from([-1, 0, 1]), st.floats(-6, 6)),
)
def test_one_bar_opens_under_a_pull_and_passes_a_push_on(stiffness, q):
    found = ContactStep(np.array([[stiffness]]), np.array([True]), 0, "active-set").solve(np.array([q]), np.zeros(0))
    assert found.v[0] == pytest.approx(min(q / stiffness, 0), rel=1e-14)
    assert found.force[0] == pytest.approx(max(q, 0), rel=1e-14, abs=1e-15 * abs(q))


@pytest.mark.parametrize("guess", [-1, 0, 1])
@pytest.mark.parametrize(("pull", "slip"), [(0.5, 0.0), (-0.5, 0.0), (2.0, 1.0), (-2.0, -1.0)])
def test_a_slip_of_the_wrong_sign_goes_to_stick_before_it_turns_round(guess, pull, slip):
    """One node of stiffness 1 under a bound of 1: going straight to the opposite slip would cycle where it sticks."""
    start = Pattern(touching=np.array([True]), sliding=np.array([guess], dtype=np.int8))
    free = np.ones(2, dtype=bool)
    found = ActiveSet(np.eye(2), free, 1).solve(np.array([pull, 3.0]), np.array([1.0]), start)
    assert found is not None
    v, force, pattern = found
    assert (v[0], force[0]) == (slip, pull - slip)
    assert pattern.sliding[0] == np.sign(slip)


@given(random=seeds)
def test_a_held_node_does_not_move_and_asks_for_no_equilibrium(random):
    """Its rows are zero in S; what the obstacle leaves there in q is the support's affair."""
    S, q, bound = random_program(random)
    free = everywhere(S)
    free[: len(bound)] = random.random(len(bound)) < 0.6
    S[~free], S[:, ~free] = 0, 0
    rows = np.flatnonzero(free)
    kept = rows[rows < len(bound)]
    try:
        whole = ContactStep(S, free, len(bound), "active-set").solve(q, bound)
        part = ContactStep(S[np.ix_(rows, rows)], free[rows], len(kept), "active-set").solve(q[rows], bound[kept])
    except ContactError:
        return
    assert (whole.v[~free] == 0).all()
    assert np.allclose(whole.v[rows], part.v, rtol=1e-9, atol=1e-11 * np.abs(part.v).max(initial=0))


@pytest.mark.parametrize(("size", "turns"), [(1e-11, True), (1e-15, False)])
@pytest.mark.parametrize("kind", ["pulls", "penetrates", "is pushed beyond its bound", "slips against its friction"])
def test_a_sign_counts_far_below_the_tolerance_of_the_certificate_and_not_within_rounding(kind, size, turns):
    """Two nodes without coupling, the first one pressed with 1; the second one is wrong by ``size``."""
    touching, sliding, tangential, normal = True, 0, 0.0, 1.0
    if kind == "pulls":
        normal = -size
    elif kind == "penetrates":
        touching, normal = False, size
    elif kind == "is pushed beyond its bound":
        tangential = 1 + size
    else:
        sliding, tangential = 1, 1 - size
    start = Pattern(touching=np.array([True, touching]), sliding=np.array([0, sliding], dtype=np.int8))
    q = np.array([0.0, tangential, 1.0, normal])
    _, _, pattern = ActiveSet(np.eye(4), np.ones(4, dtype=bool), 2).solve(q, np.ones(2), start)
    assert (pattern != start) == turns


def test_a_held_node_does_not_slide_however_hard_its_support_pushes():
    """The support takes the force, which no friction bounds."""
    free = np.array([False, True, True, True])
    start = Pattern.sticking(2, 2)
    v, force, pattern = ActiveSet(np.diag([0.0, 1, 1, 1]), free, 2).solve(np.array([5.0, 3, 1, 1]), np.ones(2), start)
    assert pattern.sliding.tolist() == [0, 1]
    assert force.tolist() == [5, 1, 1, 1]
    assert v.tolist() == [0, 2, 0, 0]


def test_a_node_above_its_bound_that_has_not_moved_slides_the_way_it_is_pushed():
    pattern = Pattern.of(np.array([0.0, 0, 0.5, 0, 0, 0]), np.array([2.0, -2, -2, 1, 1, 1]), np.ones(3), 1.0)
    assert pattern.sliding.tolist() == [1, -1, 1]


def test_a_pattern_equals_the_patterns_of_the_same_states_and_nothing_else():
    pattern = Pattern.sticking(2, 2)
    assert pattern == Pattern.sticking(2, 2)
    assert pattern != Pattern(touching=pattern.touching, sliding=np.array([0, 1], dtype=np.int8))
    assert pattern != pattern.key


@pytest.mark.parametrize("way", [-1, 1])
def test_where_the_bound_is_zero_both_ways_to_slide_are_right_and_the_guess_stays(way):
    """Its friction is 0 either way; to stick would be wrong."""
    start = Pattern(touching=np.array([True]), sliding=np.array([way], dtype=np.int8))
    asked = []
    systems = Systems(np.eye(2), np.ones(2, dtype=bool))
    solver = ActiveSet(np.eye(2), np.ones(2, dtype=bool), 1, systems=asking(systems, asked))
    v, force, pattern = solver.solve(np.array([2.0, 3.0]), np.zeros(1), start)
    assert (v[0], force[0]) == (2, 0)
    assert asked == [pattern] == [start]


def asking(systems: Systems, asked: list[Pattern]) -> Systems:
    """The same systems; each pattern that is asked for is noted."""
    of = systems.of
    systems.of = lambda pattern: asked.append(pattern) or of(pattern)
    return systems


# --- by enumeration, in rationals -------------------------------------------------------------------------------------


def solved(S: list[list[Fraction]], right: list[Fraction]) -> list[Fraction]:
    """Gauss without pivoting: S is positive definite."""
    rows = [[*line, r] for line, r in zip(S, right, strict=True)]
    for i, pivot in enumerate(rows):
        for line in rows[i + 1 :]:
            factor = line[i] / pivot[i]
            line[i:] = [a - factor * b for a, b in zip(line[i:], pivot[i:], strict=True)]
    v: list[Fraction] = []
    for i in reversed(range(len(rows))):
        known = sum((a * b for a, b in zip(rows[i][i + 1 : -1], v, strict=True)), Fraction(0))
        v.insert(0, (rows[i][-1] - known) / rows[i][i])
    return v


def enumerate_patterns(S: np.ndarray, q: np.ndarray, bound: np.ndarray) -> set[tuple[Fraction, ...]]:
    """(v, force) of every pattern that keeps all conditions, exactly: stick or slip either way, touch or open."""
    t, size = len(bound), len(q)
    found = set()
    for slips in product((0, -1, 1), repeat=t):
        for touches in product((True, False), repeat=size - t):
            rows = [i for i in range(t) if slips[i]] + [t + i for i in range(size - t) if not touches[i]]
            right = [Fraction(int(q[i])) - (int(bound[i]) * slips[i] if i < t else 0) for i in rows]
            v = [Fraction(0)] * size
            for i, value in zip(
                rows, solved([[Fraction(int(S[i, j])) for j in rows] for i in rows], right), strict=True
            ):
                v[i] = value
            force = [int(q[i]) - sum((int(S[i, j]) * v[j] for j in rows), Fraction(0)) for i in range(size)]
            signorini = all(v[i] <= 0 <= force[i] and v[i] * force[i] == 0 for i in range(t, size))
            coulomb = all(abs(force[i]) <= bound[i] and force[i] * v[i] == bound[i] * abs(v[i]) for i in range(t))
            if signorini and coulomb:
                found.add((*v, *force))
    return found


@st.composite
def integer_programs(draw):
    """Up to three nodes with small whole numbers, so that forces and slips often vanish exactly."""
    n = draw(st.integers(1, 3))
    t = draw(st.sampled_from([0, n]))
    size, digits = n + t, lambda low, high, count: st.lists(st.integers(low, high), min_size=count, max_size=count)
    A = np.array(draw(digits(-2, 2, size * size))).reshape(size, size)
    S = A.T @ A + np.eye(size, dtype=int)
    return S, np.array(draw(digits(-4, 4, size))), np.array(draw(digits(0, 3, t)), dtype=int)


@strategies.fewer(1)
@given(program=integer_programs())
def test_up_to_three_nodes_the_active_set_finds_what_all_patterns_together_allow(program):
    """Exactly one pair (v, force), however many patterns describe it."""
    S, q, bound = program
    allowed = enumerate_patterns(S, q, bound)
    assert len(allowed) == 1
    exact = np.array([float(value) for value in allowed.pop()])
    matrices = S.astype(float), everywhere(S), len(bound)
    found = ContactStep(*matrices, "active-set").solve(q.astype(float), bound.astype(float))
    assert np.allclose(np.concatenate([found.v, found.force]), exact, rtol=0, atol=1e-12)


# --- the certificate --------------------------------------------------------------------------------------------------


def made_up(random: np.random.Generator, n: int = 4) -> dict[str, np.ndarray]:
    """A solved program with every state: v and the forces are chosen, q follows. Forces and bounds are near 1.

    Nodes 0 and 1 stick and slip under pressure, 2 and 3 are open, 2 without friction on it.
    """
    A = random.standard_normal((2 * n, 2 * n + 2))
    S = A @ A.T
    bound = np.array([1.0, 1.5, 0.0, 0.5])
    v = np.array([0.0, -0.7, 0.3, 0.2, 0.0, 0.0, -0.4, -1.1])
    force = np.array([random.uniform(-0.9, 0.9), -1.5, 0.0, 0.5, 1.0, 2.0, 0.0, 0.0])
    return {"S": S, "q": S @ v + force, "bound": bound, "v": v, "force": force}


def largest_force(case: dict[str, np.ndarray]) -> float:
    return max(np.abs(case["q"]).max(), np.abs(case["S"] @ case["v"]).max(), case["bound"].max())


def broken(case: dict[str, np.ndarray], condition: str, size: float) -> dict[str, np.ndarray]:
    """Break one condition by `size` and no other: where v or a force changes, q follows to keep equilibrium."""
    v, force, q = case["v"].copy(), case["force"].copy(), case["q"].copy()
    if condition == "equilibrium":
        q[0] += size
    elif condition == "non_penetration":
        v[6] = size  # an open node
    elif condition == "compression":
        force[4] = -size  # a touching node pulls
    elif condition == "complementarity":
        force[6] = size  # an open node presses
    elif condition == "bound":
        force[0] = 1 + size  # a sticking node
    elif condition == "slip":
        force[1] += size  # a slipping node below its bound
    if condition != "equilibrium":
        q = case["S"] @ v + force
    return case | {"v": v, "force": force, "q": q}


def certify(S, **rest):
    return KKTCertificate(S).measure(**rest)


def test_a_solved_program_is_certified():
    for seed in range(20):
        assert certify(**made_up(np.random.default_rng(seed))).residual < 1e-14


@pytest.mark.parametrize("condition", CONDITIONS)
@given(random=seeds, exponent=st.floats(-10, -2), unit=st.sampled_from([1e-9, 1.0, 1e12]))
def test_each_broken_condition_is_seen_in_its_own_size_and_no_other_is(condition, random, exponent, unit):
    case = made_up(random)
    size = 10**exponent * largest_force(case)
    wrong = broken(case, condition, size)
    wrong |= {name: unit * wrong[name] for name in ("S", "q", "bound", "force")}
    found = certify(**wrong)
    forces = largest_force(wrong) / unit
    expected = size * np.diag(case["S"]).max() / forces if condition == "non_penetration" else size / forces
    assert getattr(found, condition) == pytest.approx(expected, rel=1e-3, abs=1e-14)
    assert found.residual > TOLERANCE
    for other in set(CONDITIONS) - {condition}:
        assert getattr(found, other) < 1e-14


@pytest.mark.parametrize(
    ("node", "shear"), [(1, 1.5), (3, -0.5), (2, 0.3)], ids=["pushes on", "pushes on an open node", "without a bound"]
)
def test_friction_that_helps_the_slip_or_exceeds_nothing_is_seen(node, shear):
    case = made_up(np.random.default_rng(0))
    force = case["force"].copy()
    force[node] = shear
    found = certify(**case | {"force": force, "q": case["S"] @ case["v"] + force})
    assert found.slip > TOLERANCE


def test_the_residual_is_the_largest_of_all_conditions():
    for condition in CONDITIONS:
        assert KKT(**{name: 0.5 if name == condition else 0.1 for name in CONDITIONS}).residual == 0.5


def test_no_number_is_certified_where_one_is_not_a_number():
    case = made_up(np.random.default_rng(0))
    for name in ("v", "force", "q"):
        for i in range(len(case[name])):
            values = case[name].copy()
            values[i] = np.nan
            assert not certify(**case | {name: values}).residual <= TOLERANCE


@pytest.mark.parametrize("n", [200, 400])
def test_a_slip_zone_that_grows_by_a_few_nodes_at_a_time_is_followed_to_its_end(n):
    """A string under a load that falls along it: what a node lets go its neighbours take up."""
    string, load = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1), np.linspace(1.5, 0, n)
    step = ContactStep(block_diag(string, np.eye(n)), np.ones(2 * n, dtype=bool), n, "active-set")
    found = step.solve(np.concatenate([load, np.ones(n)]), np.full(n, 0.5))
    assert found.pattern.sliding.all()
    assert found.v[:n] == pytest.approx(np.linalg.solve(string, load - 0.5), abs=1e-9)

"""The statements on meshes of the continuum page: drawn states against the eigenvalues of the Jacobian there."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problem_list import blocks, changed
from sticking import Sticking, condensed, fixed_point
from strategies import AT_NIGHT

import verification as vf
from verification.interface.pair import ContactPair, pair_from

DRAWS = 300 if AT_NIGHT else 12


def bodies(random: np.random.Generator, friction: str) -> ContactPair:
    """Two blocks of drawn heights, materials, roles and radius of the kernel, with 9 contact nodes."""
    heights = tuple(map(str, random.choice(["1/8", "1/4", "1/2", "1"], 2)))
    rows = [max(1, int(8 * Fraction(height))) for height in heights]
    data = blocks(
        heights=heights,
        cells=((8, rows[0]), (8, rows[1])),
        young=(1, int(random.integers(1, 8))),
        poisson=tuple(map(str, random.choice(["0", "0.2", "0.3", "0.4"], 2))),
        contact={"friction": friction, "radius": str(random.choice(["1/8", "1/4", "1/2", "1", "2"]))},
        iteration={"neumann_body": int(random.integers(1, 3))},
    )
    return pair_from(vf.Problem.from_dict(data))


@cache
def drawn(seed: int, friction: str, others: str) -> Sticking:
    """A fixed point at which a drawn piece of Gamma_c sticks, with drawn states of the other nodes.

    Parameters
    ----------
    seed : int
    friction : str
    others : {'open', 'slide', 'stick', 'any'}
        What the other nodes do: they are open and slide where friction can act, or touch, too; they stick where
        friction can act, open or not; anything.
    """
    random = np.random.default_rng(seed)
    pair = bodies(random, friction)
    n = pair.contact.grid.n
    first = int(random.integers(0, n - 1))
    A = np.zeros(n, dtype=bool)
    A[first : int(random.integers(first + 1, n)) + 1] = True
    touching, sliding = A | (random.random(n) < 0.5), np.where(A, 0, random.choice([-1, 1], n))
    if others == "open":
        touching = A
    if others == "stick":
        sliding[:] = 0
    if others == "any":
        sliding[random.random(n) < 0.5] = 0
    if not pair.rubs:
        sliding[:] = 1
    return fixed_point(pair, A, touching, sliding.astype(np.int8), random)


Statement = Callable[[Sticking], float]


def fails(statement: Statement, friction: str, others: str) -> list[Sticking]:
    """The drawn states at which no eigenvalue of -T' has a real part as large as a statement says.

    A theta with ``2/(1 + said) < theta < 2/(1 + seen)`` is excluded by the statement there, and contracts nearby.
    """
    states = [drawn(seed, friction, others) for seed in range(DRAWS)]
    return [state for state in states if state.beta[0] < statement(state) * (1 - 1e-9)]


# --- without friction, and where nothing slides -----------------------------------------------------------------------


def rho_of_A(state: Sticking) -> float:
    """An eigenvalue of J is at most ``1 - theta (1 + rho_A)``; without friction rho_A is that of normal traces."""
    return state.rho_A


@pytest.mark.parametrize(("friction", "others"), [("0", "any"), ("0", "open"), ("1", "stick"), ("1/5", "stick")])
def test_where_friction_does_not_vary_with_g_every_eigenvalue_is_real_and_one_is_as_large_as_rho_A(friction, others):
    assert fails(rho_of_A, friction, others) == []
    for seed in range(5):
        state = drawn(seed, friction, others)
        assert np.abs(np.linalg.eigvals(state.piece.jacobian).imag).max() <= 1e-7 * state.beta[0]
        assert np.abs(state.F).max() <= 1e-9 * state.beta[0]


LARGER: dict[str, tuple[Statement, str, str]] = {
    "one percent more": (lambda state: 1.01 * state.rho_A, "0", "open"),
    "one percent more, with friction": (lambda state: 1.01 * state.rho_A, "1", "stick"),
    "both components of the trace without friction": (lambda s: s.largest(np.tile(s.A, 2)), "0", "any"),
    "the whole of Gamma_c": (lambda s: s.largest(np.ones_like(s.g, dtype=bool)), "1", "stick"),
    "traces on A that are 0 elsewhere": (
        lambda s: float(np.linalg.eigvals(np.linalg.solve(s.pair.neumann.schur, rows_of_A(s))).real.max()),
        "1",
        "open",
    ),
}


def rows_of_A(state: Sticking) -> np.ndarray:
    """The stiffness of the contact body on A, not condensed."""
    return np.where(np.outer(state.prescribed, state.prescribed), state.pair.contact.schur, 0.0)


@pytest.mark.parametrize("name", LARGER)
def test_a_statement_that_claims_more_is_found_out(name):
    assert fails(*LARGER[name])


# --- with friction that varies with g ---------------------------------------------------------------------------------


def test_with_open_nodes_that_slide_the_statement_with_rho_A_is_false():
    """What this page once said for any friction: the derivative would be ``(1 - theta) - theta P``."""
    assert fails(rho_of_A, "1", "open")


def constants(state: Sticking) -> tuple[float, float, float]:
    """``C_t1``, ``C_t2``, ``sqrt(rho)`` of the mesh."""
    return *state.Ct, state.largest(np.ones_like(state.g, dtype=bool)) ** 0.5


def size_of_F(state: Sticking) -> float:
    """f of the page: at least the Frobenius norm of F."""
    first, second, root = constants(state)
    largest = float(np.linalg.eigvalsh(state.P)[-1])
    least = min(first * root, second + first * largest**0.5)
    return float(state.pair.friction) * state.kernel_size * least


def many_modes(f: Callable[[Sticking], float]) -> Statement:
    """``max over N of p_N - f sqrt(2/N)``, with the N-th eigenvalue p_N for A alone."""

    def statement(state: Sticking) -> float:
        carried = state.pair.neumann.flexibility(state.pair.neumann.root)
        p = np.linalg.eigvalsh(carried.T @ condensed(state.pair.contact.schur, state.prescribed) @ carried)[::-1]
        return float((p - f(state) * np.sqrt(2 / np.arange(1, len(p) + 1))).max())

    return statement


@pytest.mark.parametrize("others", ["open", "slide", "any"])
@pytest.mark.parametrize("friction", ["1", "1/5"])
def test_whatever_slides_the_eigenvalues_stay_near_those_of_P_as_kahan_says_and_F_has_its_bound(friction, others):
    assert fails(many_modes(size_of_F), friction, others) == []
    for seed in range(DRAWS):
        state = drawn(seed, friction, others)
        size, p = float(np.linalg.norm(state.F)), np.linalg.eigvalsh(state.P)[::-1]
        assert size <= size_of_F(state) * (1 + 1e-9)
        assert ((p - state.beta) ** 2).sum() <= 2 * size**2 + 1e-12 * p[0] ** 2


SMALLER: dict[str, Callable[[Sticking], float]] = {
    "the square of friction": lambda s: float(s.pair.friction) * size_of_F(s),
    "no root of rho": lambda s: size_of_F(s) / max(1.0, constants(s)[2]),
}


@pytest.mark.parametrize("name", SMALLER)
def test_a_smaller_bound_of_what_sliding_adds_is_found_out(name):
    states = [drawn(seed, "1/5", "open") for seed in range(DRAWS)]
    assert any(np.linalg.norm(state.F) > SMALLER[name](state) for state in states)


def test_sigma_is_the_frobenius_norm_of_S_and_C_s_its_largest_singular_value():
    state = drawn(0, "1", "open")
    pair, n = state.pair, state.pair.neumann.grid.n
    S = np.sqrt(pair.contact.grid.weights)[:, None] * pair.interface.kernel @ pair.neumann.root[n:]
    assert state.kernel_size == pytest.approx(np.linalg.norm(S), rel=1e-9)
    assert vf.measure(pair).C_s_energy.value == pytest.approx(np.linalg.norm(S, 2), rel=1e-9)


@given(n=st.integers(1, 6), seed=st.integers(0, 2**32 - 1))
def test_eigenvalues_of_a_symmetric_matrix_and_of_any_other_differ_as_kahan_says(n, seed):
    random = np.random.default_rng(seed)
    A, C = random.standard_normal((2, n, n)) * 10 ** random.uniform(-2, 2, (2, 1, 1))
    alpha, beta = np.linalg.eigvalsh(A + A.T), np.sort(np.linalg.eigvals(A + A.T + C).real)
    size = np.linalg.norm(C)
    assert np.linalg.norm(alpha - beta) <= 2**0.5 * size * (1 + 1e-9) + 1e-6 * np.linalg.norm(A)


def test_the_root_of_2_in_kahan_s_theorem_is_attained():
    A, C = np.array([[0.0, 1], [1, 0]]), np.array([[0.0, 0], [-1, 0]])
    assert np.linalg.eigvals(A + C) == pytest.approx([0, 0])
    assert np.linalg.norm(np.linalg.eigvalsh(A)) == pytest.approx(2**0.5 * np.linalg.norm(C))


def test_that_sliding_adds_nothing_is_found_out():
    assert fails(many_modes(lambda _: 0.0), "1", "open")


# --- meshes that get finer --------------------------------------------------------------------------------------------

#: A thick Neumann body below a thin contact body: a wave as long as A, not a short one, has the largest ratio.
LONG_WAVE = changed(
    body1={"y": [-1, 0], "cells": [40, 20]},
    body2={"y": [0, "0.1"], "cells": [24, 2]},
    contact={"friction": 1, "radius": "1.3"},
)


def refined(data: Any, halvings: int) -> ContactPair:
    return pair_from(vf.Problem.from_dict(data).refined(halvings))


def sticking_on(pair: ContactPair, lo: float, hi: float, random: np.random.Generator, way: int = 0) -> Sticking:
    """A part of Gamma_c sticks, the rest is open and slides, one way or drawn ways."""
    x = pair.contact.grid.x
    A = (x > lo - 1e-9) & (x < hi + 1e-9)
    sliding = np.where(A, 0, way or random.choice([-1, 1], len(x)))
    return fixed_point(pair, A, A, sliding.astype(np.int8), random)


@pytest.mark.parametrize("halvings", [0, 1, *([2, 3] if AT_NIGHT else [])])
def test_a_theta_above_the_number_of_rho_A_converges_to_a_stick_patch_on_meshes_however_fine(halvings):
    """k = 1, r = 1.3, on 25, 49, at night 97 and 193 contact nodes: no theta above 2/(1 + rho_A) should attract."""
    random, theta = np.random.default_rng(0), 0.69
    state = sticking_on(refined(LONG_WAVE, halvings), 0.4, 0.8, random, way=-1)
    assert 0.669 < 2 / (1 + state.rho_A) < 0.678 < theta
    assert state.least(theta) > -0.96
    last, largest = state.run(theta, 400, random)
    assert last < 1e-4
    assert largest < 20


#: Section 6 with equal moduli: half-planes have the ratio 1.8, and no longer wave has a larger one.
SHORT_WAVES = changed(
    body1={"young": 20000, "cells": [40, 6]}, body2={"cells": [24, 6]}, contact={"friction": 1, "radius": "1.3"}
)


@pytest.mark.parametrize("halvings", [0, 1, *([2, 3] if AT_NIGHT else [])])
def test_above_the_number_of_the_half_planes_no_stick_patch_attracts_whatever_slides(halvings):
    """Each mesh excludes a little less than 2/2.8, from friction 1 and a kernel that reaches all of Gamma_c."""
    pair, random = refined(SHORT_WAVES, halvings), np.random.default_rng(halvings)
    least = []
    for _ in range(3):
        lo = random.uniform(0.4, 1.3)
        state = sticking_on(pair, lo, random.uniform(lo + 0.2, 1.6), random)
        least.append(state.beta[0])
        assert state.least(2 / (1 + 1.55)) < -1
        assert state.run(0.8, 80, random)[0] > 1
    assert 1.55 < min(least) < max(least) < 1.8


def test_the_ratio_of_a_stick_patch_rises_to_that_of_half_planes():
    ratios = [sticking_on(refined(SHORT_WAVES, h), 0.7, 1.3, np.random.default_rng(0)).rho_A for h in (0, 1, 2)]
    assert 1.64 < ratios[0] < ratios[1] < ratios[2] < 1.8
    assert 1.8 - ratios[2] < 0.3 * (1.8 - ratios[0])


# --- cells that differ: the number of the cells in place of the one of half-planes ------------------------------------

#: Half-planes have the ratio 6.3; the contact body's cells are 1.5 and 3 times as high as wide, the others square.
TALL_CELLS = {
    6.8958510: changed(
        body1={"young": 20000, "cells": [40, 6]}, body2={"young": 70000, "cells": [24, 4]},
        contact={"friction": 1, "radius": "1.3"},
    ),
    11.1118871: changed(
        body1={"young": 20000, "cells": [40, 6]}, body2={"young": 70000, "cells": [24, 2]},
        contact={"friction": 1, "radius": "1.3"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("limit", TALL_CELLS)
@pytest.mark.parametrize("halvings", [0, 1, 2] if AT_NIGHT else [0])
def test_above_the_number_of_the_cells_no_stick_patch_attracts_whatever_slides(limit, halvings):
    """At theta = 2/(1 + mu), where half-planes with 6.3 < mu say nothing yet."""
    assert vf.measure(refined(TALL_CELLS[limit], 0)).rho_cells.value == pytest.approx(limit, rel=1e-6)
    pair, random = refined(TALL_CELLS[limit], halvings), np.random.default_rng(halvings)
    mu = (6.3 + limit) / 2
    for _ in range(3):
        lo = random.uniform(0.4, 1.2)
        state = sticking_on(pair, lo, random.uniform(lo + 0.3, 1.6), random)
        assert mu < state.beta[0] < limit
        assert state.least(2 / (1 + mu)) < -1
        assert state.run(2 / (1 + mu) * 1.1, 60, random)[0] > 1


def test_a_number_above_that_of_the_cells_is_found_out_on_fine_meshes():
    limit = max(TALL_CELLS)
    states = [sticking_on(refined(TALL_CELLS[limit], h), 0.8, 1.2, np.random.default_rng(0)) for h in (0, 1)]
    assert all(state.beta[0] < limit for state in states)
    assert states[0].beta[0] < states[1].beta[0]
    assert states[1].beta[0] > 0.995 * limit


def test_many_separate_waves_have_ratios_near_that_of_the_cells():
    """The step of the proof: p_N for A is above mu for each N on fine meshes."""
    limit, counts = max(TALL_CELLS), []
    for halvings in (0, 1):
        state = sticking_on(refined(TALL_CELLS[limit], halvings), 0.8, 1.2, np.random.default_rng(0))
        carried = state.pair.neumann.flexibility(state.pair.neumann.root)
        p = np.linalg.eigvalsh(carried.T @ condensed(state.pair.contact.schur, state.prescribed) @ carried)
        counts.append(int((p > 0.95 * limit).sum()))
    assert 1 <= counts[0] < counts[1]


@pytest.mark.parametrize("friction", ["1", "1/10", "1/100", "1/1000"])
def test_for_small_friction_the_number_of_rho_A_is_wrong_by_a_share_of_k(friction):
    data = LONG_WAVE | {"contact": LONG_WAVE["contact"] | {"friction": friction}}
    changes = []
    for way in (-1, 1):
        state = sticking_on(refined(data, 0), 0.4, 0.8, np.random.default_rng(0), way=way)
        changes.append((state.beta[0] - state.rho_A) / float(Fraction(friction)))
        assert abs(changes[-1]) <= 2**0.5 * size_of_F(state) / float(Fraction(friction))
    assert -0.16 < changes[0] < -0.11
    assert 0.1 < changes[1] < 0.12

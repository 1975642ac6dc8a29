"""What each inequality of Section 5 gives away: against eigenvalues of dense pencils, and against pairs of forces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property
from math import log10, sqrt
from typing import Any

import numpy as np
import pytest
import strategies
from chain_problems import case, state_of, step_II, with_loads
from dense_oracle import DensePair, symmetric, top
from hypothesis import example, given
from hypothesis import strategies as st
from problem_list import PROBLEMS, loaded_bars
from scipy.linalg import eigh

import verification as vf
from ndtheory import PRINTED, REPAIRED, bounds
from verification.algorithm.affine_piece import Piece
from verification.bounds.losses import Losses
from verification.constants import Measured, measure
from verification.interface.pair import ContactPair, pair_from
from verification.ledger.differences import uniform_piece
from verification.semidefinite.losses import locate
from verification.semidefinite.neighbours import squared
from verification.semidefinite.pattern_search import FoundFactor, worst_piece

#: Labels whose worst pair is an eigenvector; of the others it is searched.
EIGENVALUES = ("(5.18)", "(5.19)", "(5.22)", "(5.23)", "(5.29)")
SEARCHED = ("(5.11)", "(5.16)", "(5.30)", "(5.38)")


seeds = st.integers(0, 2**32 - 1)


@dataclass(frozen=True, kw_only=True)
class Sides:
    """Both sides of each inequality for two forces, from what moves: g, p, d_1, d_2 and the friction term F."""

    g: np.ndarray
    p: np.ndarray
    d_1: np.ndarray
    d_2: np.ndarray
    F: float


class Case:
    """A problem, what is measured of it, and the norms of Section 5 from dense matrices of their own."""

    def __init__(self, pair: ContactPair, measured: Measured) -> None:
        self.pair, self.measured = pair, measured
        dense = DensePair.of(pair)
        one, two = dense.contact, dense.neumann
        self.S_1, self.N_1 = one.S, one.N
        self.S_2, self.N_2 = two.S, two.N
        self.flexibility, self.dual = np.linalg.inv(two.S), np.linalg.inv(two.E)
        constants = measured.constants()
        self.m, self.M, self.C_R, self.C_K = (
            float(v) for v in (constants.m, constants.M, constants.C_R, constants.C_K)
        )

    @cached_property
    def losses(self) -> Losses:
        return locate(self.pair, self.measured)

    @cached_property
    def links(self) -> dict[str, float]:
        return {loss.label: loss.decades for loss in self.losses.links}

    @cached_property
    def X(self) -> float:
        """(5.11)."""
        return (self.M * self.C_R + self.C_K + sqrt(self.C_K * self.m)) / self.m

    def P(self, edition: Any) -> float:
        """(5.30), over the norm squared."""
        return bounds.P(self.C_K, edition.coercivity(self.m), self.M, self.C_R, edition.unit(self.m))

    def decades(self, label: str, sides: Sides) -> float:
        """``log10(right/left)``; infinite where the left side vanishes."""
        m, M, A = self.m, self.M, self.M * self.C_R
        size = lambda v, gram: sqrt(max(float(v @ gram @ v), 0.0))
        norm, dual = size(sides.g, self.flexibility), size(sides.g, self.dual)
        norm_T, dual_T = size(sides.p, self.flexibility), size(sides.p, self.dual)
        size_1, size_2 = size(sides.d_1, self.N_1), size(sides.d_2, self.N_2)
        C_T = A / m * self.X
        left, right = {
            "(5.11)": (size_1, self.X * size_2),
            "(5.16)": (dual_T, C_T * dual),
            "(5.18)": (dual_T, A * size_1),
            "(5.19)": (size_2, dual / m),
            "(5.22)": (norm, dual / sqrt(m)),
            "(5.23)": (dual, M / sqrt(m) * norm),
            "(5.29)": (norm_T**2, (A / m) ** 2 * float(sides.d_1 @ self.S_1 @ sides.d_1)),
            "(5.30)": (sides.F, self.P(REPAIRED) * norm**2),
            "(5.38)": (norm_T**2, (C_T * M / m) ** 2 * norm**2),
        }[label]
        return log10(right / left) if left > 0 else np.inf

    def between(self, psi: np.ndarray, other: np.ndarray, pair: ContactPair | None = None) -> Sides:
        """Two forces pushed through steps I and II."""
        pair, t = pair or self.pair, self.pair.contact.grid.t
        one, two = step_II(pair, psi), step_II(pair, other)
        d_2 = self.flexibility @ (psi - other)
        F = 0.0
        if pair.interface.kernel is not None:
            stress = np.abs(pair.interface.kernel @ psi[t:]) - np.abs(pair.interface.kernel @ other[t:])
            k = float(pair.friction)
            F = -float(k * pair.contact.grid.weights @ (stress * (np.abs(one.v[:t]) - np.abs(two.v[:t])))) if t else 0.0
        return Sides(g=psi - other, p=one.force - two.force, d_1=d_2 + one.v - two.v, d_2=d_2, F=F)

    # --- on one piece, both sides are quadratic forms in g

    def forms(self, label: str, piece: Piece) -> tuple[np.ndarray, np.ndarray]:
        """What is compared, left over right, without the constants."""
        t, square = self.pair.contact.grid.t, lambda rows, gram: symmetric(rows.T @ gram @ rows)
        d_1 = self.flexibility + piece.jump
        size_1, size_2 = square(d_1, self.N_1), square(self.flexibility, self.N_2)
        if label == "(5.11)":
            return size_1, size_2
        if label == "(5.16)":
            return square(piece.force, self.dual), self.dual
        if label == "(5.38)":
            return square(piece.force, self.flexibility), self.flexibility
        return symmetric(-piece.bound.T @ (piece.pattern.sliding[:, None] * piece.jump[:t])), self.flexibility

    def search(self, label: str, starts: int = 2) -> FoundFactor:
        """As the losses are searched."""
        over = self.forms(label, uniform_piece(self.pair, touching=False, sliding=1))[1]  # of every piece
        factors = {
            "(5.11)": lambda found: squared(found.d_1, self.N_1),
            "(5.16)": lambda found: squared(found.force, self.dual),
            "(5.38)": lambda found: squared(found.force, self.flexibility),
        }.get(label, lambda found: found.friction)
        random = np.random.default_rng(0)
        return worst_piece(self.pair, factors, gram=over, random=random, starts=starts)

    def realised(self, label: str, piece: Piece, random: np.random.Generator) -> Sides:
        """Two forces in the worst direction of a piece, for loads that bring it about."""
        n, t = self.pair.contact.grid.n, self.pair.contact.grid.t
        g = np.concatenate([random.uniform(-1, 1, t), random.uniform(0.5, 1, n)])
        pair = with_loads(self.pair, g, *state_of(self.pair, piece.pattern, g, random))
        stress = lambda g: 1.0 if pair.interface.kernel is None else float((pair.interface.kernel @ g[t:]).min())
        inside = lambda g: step_II(pair, g).pattern == piece.pattern and stress(g) > 0
        worst = eigh(*self.forms(label, piece))[1][:, -1]
        step = worst * np.linalg.norm(g) / np.linalg.norm(worst)
        assert inside(g)
        while not (inside(g + step) and inside(g - step)):
            step = step / 2
        return self.between(g + step, g - step, pair)


def case_of(seed: int, friction: Any = None) -> Case:
    pair, measured, _, _ = case(seed, friction)
    return Case(pair, measured)


@cache
def rubbing(seed: int) -> Case:
    """At friction 1/2, for the tests that ask for the same seeds: its losses are located once."""
    return case_of(seed, "1/2")


def random_sides(case: Case, random: np.random.Generator) -> Sides:
    """Two forces from a tenth to ten times the loads: apart, or close together."""
    neumann, root = case.pair.neumann, case.pair.neumann.root
    size = max(neumann.dual_norm(side.load) for side in (neumann, case.pair.contact)) or 1.0
    a, b = (root @ random.standard_normal(root.shape[1]) * size * 10 ** random.uniform(-1, 1) for _ in range(2))
    return case.between(a, a + b / 100 if random.integers(2) else b)


# --- each inequality by itself ----------------------------------------------------------------------------------------


@strategies.fewer(4)
@given(data=strategies.contact_problems())
def test_a_link_without_T_gives_away_what_the_eigenvalue_of_a_dense_pencil_says(data):
    pair = pair_from(vf.Problem.from_dict(data))
    case = Case(pair, measure(pair))
    m, M, A = case.m, case.M, case.M * case.C_R
    reaction = lambda gram: symmetric(case.S_1 @ gram @ case.S_1)
    trace = symmetric(case.flexibility @ case.N_2 @ case.flexibility)
    expected = {
        "(5.18)": log10(A / sqrt(top(reaction(case.dual), case.N_1)[0])),
        "(5.19)": log10(1 / m / sqrt(top(trace, case.dual)[0])),
        "(5.22)": log10(1 / sqrt(m) / sqrt(top(case.flexibility, case.dual)[0])),
        "(5.23)": log10(M / sqrt(m) / sqrt(top(case.dual, case.flexibility)[0])),
        "(5.29)": log10((A / m) ** 2 / top(reaction(case.flexibility), case.S_1)[0]),
    }
    for label in EIGENVALUES:
        assert case.links[label] == pytest.approx(expected[label], abs=1e-7)
    assert [loss.label for loss in case.losses.links if not loss.searched] == list(EIGENVALUES)


@pytest.mark.parametrize("seed", range(6 if strategies.AT_NIGHT else 3))
def test_two_forces_attain_the_links_without_T(seed):
    """(5.19), (5.22), (5.23) by the worst psi - psi~; (5.18), (5.29) while all nodes stick: w^1 moves with w^2."""
    found, random = rubbing(seed), np.random.default_rng(seed)
    neumann = found.pair.neumann
    trace = symmetric(found.flexibility @ found.N_2 @ found.flexibility)
    pencils = {
        "(5.19)": (trace, found.dual),
        "(5.22)": (found.flexibility, found.dual),
        "(5.23)": (found.dual, found.flexibility),
    }
    for label, pencil in pencils.items():
        d = top(*pencil)[1]
        g = neumann.root @ random.standard_normal(len(d))
        step = d * neumann.dual_norm(g) / neumann.dual_norm(d)
        assert found.decades(label, found.between(g + step, g)) == pytest.approx(found.links[label], abs=1e-6)
    for label, gram, against in (("(5.18)", found.dual, found.N_1), ("(5.29)", found.flexibility, found.S_1)):
        d_1 = top(symmetric(found.S_1 @ gram @ found.S_1), against)[1]
        sides = Sides(g=found.S_2 @ d_1, p=-found.S_1 @ d_1, d_1=d_1, d_2=d_1, F=0.0)
        assert found.decades(label, sides) == pytest.approx(found.links[label], abs=1e-9)


@strategies.fewer(10, at_night=5)
@given(seed=seeds)
def test_no_two_forces_come_closer_to_equality_in_a_link_without_T(seed):
    found, random = case_of(seed), np.random.default_rng(seed)
    for _ in range(4):
        sides = random_sides(found, random)
        for label in EIGENVALUES:
            assert found.decades(label, sides) >= found.links[label] - 1e-6


@pytest.mark.parametrize("label", SEARCHED)
def test_two_forces_attain_a_searched_link_for_suitable_loads(label):
    """The piece that the search finds, with its own forms from dense matrices."""
    for seed in range(6 if strategies.AT_NIGHT else 3):
        found = rubbing(seed)
        sides = found.realised(label, found.search(label).piece, np.random.default_rng(seed))
        assert found.decades(label, sides) == pytest.approx(found.links[label], abs=1e-5)


def test_the_search_comes_closer_to_equality_than_random_forces():
    """Forces on different pieces included."""
    for seed in range(12 if strategies.AT_NIGHT else 3):
        found, random = case_of(seed), np.random.default_rng(seed)
        for _ in range(8):
            sides = random_sides(found, random)
            for label in set(SEARCHED) & set(found.links):
                assert found.decades(label, sides) >= found.links[label] - 1e-6


# --- the chains -------------------------------------------------------------------------------------------------------


@strategies.fewer(5)
@given(seed=seeds, k=st.sampled_from([None, "1/100", "1/2", "1"]))
@example(seed=110666, k="1/100")  # neighbours were found worse that are not, by rounding: the search took another way
def test_both_chains_add_up_and_no_link_gives_away_less_than_nothing(seed, k):
    """From the largest ``|||T psi - T psi~||| / |||psi - psi~|||`` found to the root of (5.38).

    From the largest friction term found to (5.30) repaired, and from there to what is printed.
    """
    found = case_of(seed, k)
    losses = found.losses
    for loss in (*losses.links, *losses.friction, *losses.lipschitz):
        if "lost" not in loss.label:  # no inequality: the printed bound is the smaller one where m < 1
            assert loss.decades > -1e-12
    largest = sqrt(found.search("(5.38)").value)
    bound = found.M * found.C_R * found.X * found.M / found.m**2
    total = sum(loss.decades for loss in losses.lipschitz)
    assert total == pytest.approx(log10(bound / largest), abs=1e-7)
    assert total == pytest.approx(found.links["(5.38)"] / 2, abs=1e-7)
    assert bound == pytest.approx(sqrt(bounds.Q(found.C_K, found.m, found.M, found.C_R)), rel=1e-9)
    assert [loss.label for loss in losses.lipschitz] == ["(5.22)", "(5.18)", "(5.11)", "(5.19)", "(5.23)"]
    if not losses.friction:
        assert found.C_K == 0
        return
    *proof, printed = losses.friction
    assert [loss.label for loss in proof] == ["(5.13)", "(5.11)", "(5.19)", "(5.23)"]
    total = sum(loss.decades for loss in proof)
    assert total == pytest.approx(log10(found.P(REPAIRED) / found.search("(5.30)").value), abs=1e-7)
    assert total == pytest.approx(found.links["(5.30)"], abs=1e-7)
    assert printed.decades == pytest.approx(log10(found.P(PRINTED) / found.P(REPAIRED)), abs=1e-9)


def in_unit(pair: ContactPair, factor: Fraction) -> ContactPair:
    """Moduli times a factor."""
    stiffer = lambda body: replace(body, young=body.young * factor)
    problem = pair.problem
    return pair_from(replace(problem, body1=stiffer(problem.body1), body2=stiffer(problem.body2)))


@pytest.mark.parametrize("factor", [Fraction(10) ** 6, Fraction(10) ** -6], ids=["10^6", "10^-6"])
def test_what_an_inequality_gives_away_knows_no_unit_of_stress_but_for_the_printed_one(factor):
    for seed in range(4 if strategies.AT_NIGHT else 2):
        here = rubbing(seed)
        other = in_unit(here.pair, factor)
        there = Case(other, measure(other))
        for one, two in zip(here.losses.links, there.losses.links, strict=True):
            assert (one.label, one.searched) == (two.label, two.searched)
            assert two.decades == pytest.approx(one.decades, abs=1e-6)
        for one, two in zip(here.losses.friction[:-1], there.losses.friction[:-1], strict=True):
            assert two.decades == pytest.approx(one.decades, abs=1e-6)
        for found in (here, there):  # the printed bound is the smaller one where m is small
            assert found.m < 1 or found.losses.friction[-1].decades >= -1e-12


# --- what has no losses -----------------------------------------------------------------------------------------------


def test_without_friction_nothing_is_lost_on_friction():
    found = case_of(3, friction=0)
    assert found.losses.friction == ()
    assert "(5.30)" not in found.links
    assert set(found.links) == {*EIGENVALUES, *SEARCHED} - {"(5.30)"}


def test_between_two_bars_only_the_constants_lose():
    """T is ``-rho`` times g: every quotient in closed form, and d_1 = d_2 in contact."""
    pair = pair_from(vf.Problem.from_dict(loaded_bars((1, 2), (3, 2), "0.2")))
    found = Case(pair, measure(pair))
    rho = float(found.S_1[0, 0] / found.S_2[0, 0])
    C_T = found.M * found.C_R / found.m * found.X
    assert found.links["(5.38)"] == pytest.approx(2 * log10(C_T * found.M / found.m / rho), abs=1e-9)
    assert found.links["(5.29)"] == pytest.approx(log10((found.M * found.C_R / found.m) ** 2 / rho), abs=1e-9)
    assert found.links["(5.11)"] == pytest.approx(log10(found.X * sqrt(found.N_2[0, 0] / found.N_1[0, 0])), abs=1e-9)


def test_where_a_contact_node_is_held_no_losses_are_located():
    pair = pair_from(vf.Problem.from_dict(PROBLEMS["contact nodes held tangentially"]))
    assert locate(pair, measure(pair)) is None

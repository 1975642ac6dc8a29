"""One problem after another, from what a run shows to what the theorem proves: each number at most the next.

Observed step ratio, spectral radius and norm of the Jacobian at the solution, largest norm over contact patterns,
semidefinite bound, theorem in energy norms, repaired theorem.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
import strategies
from chain_problems import case, energy, every_piece, run_of, state_of, step_II, with_loads
from hypothesis import settings

from ndtheory import REPAIRED, bounds, energy_norms, evaluate
from verification.algorithm.affine_piece import Piece
from verification.algorithm.rates import largest_step_ratio
from verification.constants import Measured
from verification.interface.pair import ContactPair
from verification.machine.threads import one_thread
from verification.semidefinite.multipliers import QuadraticForms
from verification.semidefinite.pattern_search import largest_factor

#: Random problems, the same ones each time, and the batches that they are tried in: each costs a semidefinite program
#: and a search.
most = settings.default.max_examples
COUNT, BATCHES = (10, 1) if most <= strategies.EVERY_DAY else (most, 2)

#: Both sides are eigenvalues.
RELATIVE = 1e-9

#: A lower and an upper bound of one number have found it where they differ by less.
TIGHT = 0.01


def energy_factor(measured: Measured, theta: float, **changes: float) -> float:
    """q(theta), also where it is 1 or more; with other values of rho, kappa_1, kappa_2 where they are given."""
    values = dict(zip(("rho", "kappa_1", "kappa_2"), energy(measured), strict=True)) | changes
    return float(np.sqrt(1 - energy_norms.one_minus_square(theta, *(float(v) for v in values.values()))))


def repaired_factor(measured: Measured, theta: float) -> float:
    """K(theta), also where it is 1 or more."""
    constants = measured.constants()
    m, M, C_R, x = (float(v) for v in (constants.m, constants.M, constants.C_R, constants.C_K))
    D, Q, P = bounds.D(x, m, M, C_R, m), bounds.Q(x, m, M, C_R), bounds.P(x, m, M, C_R, m)
    return float(np.sqrt(1 - min(bounds.one_minus_h1(theta, D, Q), bounds.one_minus_h2(theta, P))))


# --- pairs of forces --------------------------------------------------------------------------------------------------


def quotient(pair: ContactPair, theta: float, g: np.ndarray, other: np.ndarray) -> float:
    """``|||T_theta g - T_theta g~||| / |||g - g~|||``."""
    d, p = g - other, pair.interface.carry_back(step_II(pair, g).force - step_II(pair, other).force)
    norm = pair.neumann.dual_norm
    return norm(theta * p + (1 - theta) * d) / norm(d)


def largest_quotient(pair: ContactPair, theta: float, g: np.ndarray, random: np.random.Generator) -> float:
    """Of random pairs around a force: a tenth of its size away, as far as it is large, and ten times as far."""
    neumann = pair.neumann
    loads = neumann.load, pair.interface.carry_back(pair.contact.load)
    size = neumann.dual_norm(g) or max(map(neumann.dual_norm, loads)) or 1.0
    forces = neumann.root @ random.standard_normal((neumann.root.shape[1], 6))
    pairs = zip((0.1, 0.1, 1.0, 1.0, 10.0, 10.0), forces.T, strict=True)
    a, b, c, d, e, f = (g + length * size * force / neumann.dual_norm(force) for length, force in pairs)
    return max(quotient(pair, theta, *two) for two in ((a, b), (c, d), (e, f), (b, e)))


def attained(piece: Piece, theta: float, random: np.random.Generator) -> float:
    """The quotient of two forces inside a piece, in its worst direction, for loads that bring the piece about."""
    pair, n, t = piece.pair, piece.pair.neumann.grid.n, piece.pair.neumann.grid.t
    g = np.concatenate([random.uniform(-1, 1, t), random.uniform(0.5, 1, n)])  # S sigma_N > 0: S has no entry < 0
    pair = with_loads(pair, g, *state_of(pair, piece.pattern, g, random))
    kernel = pair.interface.kernel
    felt = None if kernel is None else kernel[kernel.any(axis=1)]  # out of reach of all Neumann nodes nothing rubs
    stress = lambda g: 1.0 if felt is None else float((felt @ g[t:]).min(initial=np.inf))
    rubs = piece.sign != 0  # a node with the bound 0 may slide either way
    same = lambda one, other: (
        np.array_equal(one.touching, other.touching) and np.array_equal(one.sliding[rubs], other.sliding[rubs])
    )
    inside = lambda g: same(step_II(pair, g).pattern, piece.pattern) and stress(g) > 0
    if not inside(g):  # friction so slight that rounding decides between stick and slip
        assert 0 < pair.friction < 1e-6
        return float("nan")
    step = pair.neumann.root @ np.linalg.svd(piece.relaxed(theta))[2][0] * pair.neumann.dual_norm(g)
    while not (inside(g + step) and inside(g - step)):
        step = step / 2
    return quotient(pair, theta, g + step, g - step)


# --- the chain --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Chain:
    """The numbers of one problem; nan where there is none: a run without steps, a solution that is not smooth.

    `search` is a lower bound of the least Lipschitz constant for all loads, found by a search over contact patterns,
    and `attained` what two forces make of it.  `lmi` is what the semidefinite bound proves, on the safe side of the
    eigenvalue `evaluated` that its multipliers have in doubles: other numbers lie below the one, it below others by the
    other.
    """

    step: float
    quotient: float
    excited: float
    radius: float
    norm: float
    attained: float
    search: float
    lmi: float
    evaluated: float
    energy: float
    repaired: float

    @property
    def links(self) -> dict[str, tuple[float, float]]:
        """A number and its bound."""
        names = [
            ("excited", "radius"),
            ("radius", "norm"),
            ("norm", "lmi"),
            ("step", "lmi"),
            ("quotient", "lmi"),
            ("attained", "lmi"),
            ("search", "lmi"),
            ("evaluated", "lmi"),
            ("evaluated", "energy"),
            ("energy", "repaired"),
        ]
        return {f"{a} <= {b}": (getattr(self, a), getattr(self, b)) for a, b in names}

    @property
    def broken(self) -> dict[str, tuple[float, float]]:
        """Links that do not hold."""
        return {name: (a, b) for name, (a, b) in self.links.items() if a > b * (1 + RELATIVE)}

    @property
    def tight(self) -> bool:
        """Whether the semidefinite bound has found the least Lipschitz constant."""
        return self.lmi <= (1 + TIGHT) * self.search


def chain_of(pair: ContactPair, measured: Measured, theta: float, random: np.random.Generator) -> Chain:
    """All numbers of a problem at one theta."""
    with one_thread():
        done, found = run_of(pair, measured, theta), largest_factor(pair, theta, random=random)
        ratio, linear = largest_step_ratio(pair, done.iterates), done.linearised
        shown = largest_quotient(pair, theta, done.last.g, random), attained(found.piece, theta, random)
        proved = QuadraticForms(pair, measured).factor(theta)
    return Chain(
        step=np.nan if ratio is None else ratio.lo,
        quotient=shown[0],
        excited=np.nan if linear is None or linear.excited is None else linear.excited,
        radius=np.nan if linear is None else linear.radius,
        norm=np.nan if linear is None else linear.norm,
        attained=shown[1],
        search=found.value,
        lmi=proved.value,
        evaluated=proved.evaluated,
        energy=energy_factor(measured, theta),
        repaired=repaired_factor(measured, theta),
    )


SETTINGS = {"tolerance": 1e-10, "max_iterations": 200}


def allowed(seed: int) -> tuple[ContactPair, Measured, float, np.random.Generator]:
    """A random problem with a friction and a theta for which the repaired theorem proves a factor below 1."""
    pair, measured, _, random = case(seed, **SETTINGS)
    k = random.uniform(0, 0.99) * evaluate(REPAIRED, measured.constants()).C2.value
    measured = measured.with_friction(k)
    low, high = evaluate(REPAIRED, measured.constants()).interval
    return rubbing(pair, k), measured, low + random.uniform(0.01, 0.99) * (high - low), random


def rubbing(pair: ContactPair, k: float) -> ContactPair:
    """The same bodies at another friction."""
    return pair.at(friction=Fraction(k))


@pytest.mark.parametrize("batch", range(BATCHES))
def test_each_number_is_at_most_the_next_and_the_semidefinite_edition_mostly_the_least_of_the_bounds(batch):
    """The worst piece of the search is attained by two forces, so the least Lipschitz constant lies above it.

    Of the first 300 problems the semidefinite bound lies within 1 % of it in 72 %; of the 150 for which it proves a
    factor below 1, in 88 %.
    """
    chains = {seed: chain_of(*case(seed, **SETTINGS)) for seed in range(batch, COUNT, BATCHES)}
    assert {seed: c.broken for seed, c in chains.items() if c.broken} == {}
    assert {seed: c for seed, c in chains.items() if not abs(c.attained / c.search - 1) < 1e-6} == {}
    assert np.mean([np.isfinite(c.radius) for c in chains.values()]) > 0.9  # T is smooth at most solutions
    assert np.mean([np.isfinite(c.excited) for c in chains.values()]) > 0.4  # and reached
    assert np.mean([c.tight for c in chains.values()]) > 0.65
    assert np.mean([c.tight for c in chains.values() if c.lmi < 1]) > 0.7
    assert np.mean([c.lmi > c.evaluated * (1 + RELATIVE) for c in chains.values()]) < 0.05  # what rounding costs


def test_the_chain_holds_on_grids_that_differ_too():
    """Of the first 200 problems the semidefinite bound lies within 1 % of the least Lipschitz constant in 72 %."""
    chains = {seed: chain_of(*case(seed, matching=False, **SETTINGS)) for seed in range(5 if BATCHES == 1 else 200)}
    assert {seed: c.broken for seed, c in chains.items() if c.broken} == {}
    assert {seed: c for seed, c in chains.items() if not abs(c.attained / c.search - 1) < 1e-6} == {}
    assert np.mean([np.isfinite(c.radius) for c in chains.values()]) > 0.9
    assert np.mean([c.tight for c in chains.values()]) > 0.6


def test_where_the_repaired_edition_proves_a_factor_every_other_number_is_below_it():
    """1 - K may be 1e-9: the last link is compared by what it leaves of 1."""
    for seed in range(max(3, COUNT // 8)):
        pair, measured, theta, random = allowed(seed)
        found = chain_of(pair, measured, theta, random)
        left = evaluate(REPAIRED, measured.constants(), theta).one_minus_factor.value
        assert 0 < left < 1
        assert found.broken == {}
        assert found.repaired == pytest.approx(1 - left, rel=1e-12)
        assert 1 - found.energy >= left * (1 - RELATIVE) - 1e-15


#: Bounds that would be smaller.
MUTANTS: dict[str, Callable[[Measured, float], float]] = {
    "without friction": lambda m, theta: energy_factor(m, theta, kappa_1=0, kappa_2=0),
    "without kappa_1": lambda m, theta: energy_factor(m, theta, kappa_1=0),
    "without kappa_2": lambda m, theta: energy_factor(m, theta, kappa_2=0),
    "with rho_normal": lambda m, theta: energy_factor(m, theta, rho=m.rho_normal.value),
}


def test_a_smaller_bound_is_found_out():
    """By the search, in some of 60 problems; q itself never.  By day no more are tried than that takes."""
    above = dict.fromkeys(MUTANTS, 0)
    for seed in range(60):
        pair, measured, theta, random = case(seed)
        found = largest_factor(pair, theta, random=random, starts=2).value
        assert found <= energy_factor(measured, theta) * (1 + RELATIVE)
        for mutant, bound in MUTANTS.items():
            above[mutant] += found > 1.001 * bound(measured, theta)
        if min(above.values()) > 0 and not strategies.AT_NIGHT:
            break
    assert min(above.values()) > 0, above


def test_the_search_finds_nearly_the_largest_norm_of_all_contact_patterns():
    """All 6^n of them for up to three nodes: they decide the least Lipschitz constant, as T is continuous."""
    ratios = []
    for seed in range(80 if strategies.AT_NIGHT else 50):
        pair, measured, theta, random = case(seed)
        if pair.contact.grid.n <= 3:
            most = max(piece.factor(theta) for piece in every_piece(pair))
            ratios.append(largest_factor(pair, theta, random=random).value / most)
            assert most <= QuadraticForms(pair, measured).factor(theta).value * (1 + RELATIVE)
    assert len(ratios) > 10
    assert max(ratios) < 1 + RELATIVE
    assert min(ratios) > 0.95
    assert np.mean(np.array(ratios) > 1 - RELATIVE) > 0.8


# --- little friction --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.4, 1.0, 1.3])
def test_without_friction_q_is_attained_on_both_branches(share):
    """While all nodes are open below ``2/(2 + rho_N)``, while all touch above: by two forces, for suitable loads."""
    for seed in range(12 if strategies.AT_NIGHT else 3):
        pair, measured, _, random = case(seed, friction=0)
        theta = min(share * 2 / (2 + measured.rho_normal.value), 0.97)
        bound = energy_factor(measured, theta)
        *_, closed = (closed for closed in every_piece(pair) if closed.pattern.touching.all())
        *_, apart = (piece for piece in every_piece(pair) if not piece.pattern.touching.any())
        assert apart.factor(theta) == pytest.approx(1 - theta, rel=1e-9)
        worst = apart if theta <= 2 / (2 + measured.rho_normal.value) else closed
        assert attained(worst, theta, random) == pytest.approx(bound, rel=1e-8)
        assert largest_factor(pair, theta, random=random).value == pytest.approx(bound, rel=RELATIVE)
        # where both branches meet the block of d_1 in the optimal form is singular, which costs half the digits
        assert QuadraticForms(pair, measured).factor(theta).value == pytest.approx(bound, rel=1e-7)


@pytest.mark.parametrize(("k", "within"), [("1/1000", 0.9), ("1/1000000", 1.0)])
def test_with_little_friction_q_jumps_to_rho_and_is_nearly_attained(k, within):
    """All nodes that stick give ``|1 - theta - theta rho|``, all open ones 1 - theta, for any k > 0.

    q is within 2 % of the larger one as k goes to 0; at k = 0.001 kappa_1 may still be 0.2.
    """
    close = []
    for seed in range(16 if strategies.AT_NIGHT else 4):
        for share in (0.4, 0.9, 1.2):
            pair, measured, _, random = case(seed, friction=k)
            rho = measured.rho_max.value
            theta = min(share * 2 / (2 + rho), 0.97)
            found = largest_factor(pair, theta, random=random, starts=2).value
            assert found >= max(1 - theta, abs(1 - theta - theta * rho)) * (1 - RELATIVE)
            close.append(energy_factor(measured, theta) <= 1.02 * found)
    assert np.mean(close) >= within

"""Without friction step III is a gradient step, held against the energy of problems with contact conditions.

``E(u_2)`` is evaluated from whole solutions of step II: the least energy of body 1 over its admissible displacements.
"""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from chain_problems import case, step_II, with_loads
from scipy.linalg import eigh

from verification.algorithm.fixed_point import FixedPointMap
from verification.constants import measure

SEEDS = range(6)

#: Relative to the energies: what two solutions of step II leave.
ROUNDING = 1e-9


def frictionless(seed):
    """A pair without friction, its rho_N, and a generator; every third one has a gap."""
    pair, _, _, random = case(seed, 0)
    gap = np.full(pair.contact.grid.n, 0.002 if seed % 3 == 0 else 0.0)
    pair = replace(pair, interface=replace(pair.interface, gap=gap), problem=None)
    return pair, measure(pair).rho_normal.value, random


def energy(pair, g):
    """E at ``u_2 = S_2^-1 (g + l_2)``, ``g - T g``, and the nodes that touch."""
    u, solution = FixedPointMap(pair, "active-set")(g)
    one = u + solution.v
    one[pair.contact.grid.normal] += pair.interface.gap
    two = u - pair.neumann.known
    value = two @ pair.neumann.schur @ two / 2 - pair.neumann.load @ two
    value += one @ pair.contact.schur @ one / 2 - pair.contact.load @ one
    return value, g - solution.force, solution.pattern.touching


def forces(pair, random, count=8):
    """Forces of the size of the loads, every second one pressing."""
    size = max(pair.neumann.dual_norm(side.load) for side in (pair.neumann, pair.contact)) or 1.0
    root = pair.neumann.root
    for i in range(count):
        g = root @ random.standard_normal(root.shape[1]) * size
        if i % 2:
            g[pair.contact.grid.normal] = np.abs(g[pair.contact.grid.normal])
        yield g


@pytest.mark.parametrize("seed", SEEDS)
def test_the_energy_lies_between_two_parabolas_over_its_tangent(seed):
    """1-strongly convex and (1 + rho_N)-smooth; and the image of a force is cocoercive."""
    pair, rho, random = frictionless(seed)
    points = [(g, *energy(pair, g)) for g in forces(pair, random)]
    touched = np.concatenate([touching for *_, touching in points])
    assert touched.any()
    assert not touched.all()
    bends = []
    for g, value, slope, _ in points:
        for other, there, slope_there, _ in points:
            if other is g:
                continue
            d = pair.neumann.flexibility(other - g)
            square = d @ pair.neumann.schur @ d
            above = there - value - slope @ d
            slack = ROUNDING * (abs(value) + abs(there) + square)
            assert square / 2 - slack <= above <= (1 + rho) * square / 2 + slack
            p = (other - slope_there) - (g - slope)
            assert -(p @ d) >= pair.neumann.dual_norm(p) ** 2 / rho - slack
            bends.append(2 * above / square)
    assert max(bends) > 1 + 0.1 * min(rho, 1.0)  # contact bends it


@pytest.mark.parametrize("seed", SEEDS)
def test_the_slope_of_the_energy_is_the_force_less_its_image(seed):
    """By central differences of E along random directions of u_2."""
    pair, _, random = frictionless(seed)
    for g in forces(pair, random, 3):
        _, slope, _ = energy(pair, g)
        step = pair.neumann.root @ random.standard_normal(pair.neumann.root.shape[1])
        step *= 1e-4 * pair.neumann.dual_norm(g) / pair.neumann.dual_norm(step)
        ends = [energy(pair, g + sign * step)[0] for sign in (1, -1)]
        d = pair.neumann.flexibility(step)
        scale = pair.neumann.dual_norm(step) * pair.neumann.dual_norm(g)
        assert (ends[0] - ends[1]) / 2 == pytest.approx(slope @ d, abs=1e-3 * scale)
        assert (ends[0] - ends[1]) / 2 != pytest.approx(-slope @ d, abs=1e-3 * scale)


def factors(pair, random, theta):
    """What T_theta does to two pairs of forces: all nodes open; all touching, in the worst direction."""
    n, t = pair.contact.grid.n, pair.contact.grid.t
    one, two = pair.contact.schur, pair.neumann.schur
    condensed = [s[t:, t:] - s[t:, :t] @ np.linalg.solve(s[:t, :t], s[:t, t:]) for s in (one, two)]
    worst = eigh(*condensed)[1][:, -1]
    step = np.concatenate([np.zeros(t), condensed[1] @ worst])
    g = np.concatenate([random.uniform(-1, 1, t), random.uniform(0.5, 1, n)])
    step *= 1e-4 / np.abs(step).max()
    length = np.linalg.norm(g) / np.linalg.norm(one, 2)
    slide = random.uniform(0.5, 1, t) * length
    open_, pressed = np.full(n, -length), np.zeros(n)
    for v_N, c_N in ((open_, np.zeros(n)), (pressed, np.ones(n))):
        held = with_loads(pair, g, np.concatenate([slide, v_N]), np.concatenate([np.zeros(t), c_N]))
        images = [step_II(held, g + sign * step).force for sign in (1, -1)]
        moved = 2 * (1 - theta) * step + theta * (images[0] - images[1])
        yield pair.neumann.dual_norm(moved) / pair.neumann.dual_norm(2 * step)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_theta_has_a_smaller_factor_than_2_over_2_plus_rho_N(seed):
    """Both branches are attained for suitable loads, so the factor of a theta is at least the larger of the two."""
    pair, rho, random = frictionless(seed)
    best = 2 / (2 + rho)
    assert max(factors(pair, random, best)) == pytest.approx(rho / (2 + rho), rel=1e-6)
    for share in (Fraction(1, 2), Fraction(9, 10), Fraction(11, 10), Fraction(3, 2)):
        theta = float(share) * best
        found = list(factors(pair, random, theta))
        assert found == pytest.approx([abs(1 - theta), abs(1 - theta - theta * rho)], rel=1e-6, abs=1e-9)
        assert 1 - max(found) < 0.95 * best  # 1 - rho/(2 + rho) is best

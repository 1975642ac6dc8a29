"""Rates of made-up series of residuals, and the noise of a pair of numbers: closed forms."""

from dataclasses import dataclass, field, replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from verification.algorithm.rates import CLEAR_OF_NOISE, Noise, largest_step_ratio, rate_at_the_end, rate_of
from verification.interface.interface import Interface
from verification.interface.join import Mortar


@pytest.mark.parametrize("share", [0.5, -0.9])
@pytest.mark.parametrize("steps", range(2, 60))
def test_a_mode_that_alternates_does_not_enter_the_rate(steps, share):
    """``q^n (1 + s (-1)^n)``: over an even number of steps the second factor is the same at both ends."""
    residuals = [0.5**n * (1 + share * (-1) ** n) for n in range(steps + 1)]
    found = rate_at_the_end(residuals, [0.0] * (steps + 1), 0)
    assert found.value == pytest.approx(0.5, rel=1e-12)
    assert found.end - found.begin == max(2, 2 * (steps // 8))


def test_the_interval_holds_the_quarter_before_with_the_noise_of_its_ends():
    residuals = [0.5**n for n in range(5)] + [0.5**4 * 0.75**n for n in (1, 2)] + [0.5**4 * 0.75**2 * 0.25]
    floors = [2.0**-20 * (n + 1) for n in range(8)]
    found = rate_at_the_end(residuals, floors, 0)
    r, f = ([Fraction(value) for value in values] for values in (residuals, floors))
    over = lambda i, j, sign: float((r[j] + sign * f[j]) / (r[i] - sign * f[i])) ** (1 / (j - i))
    assert (found.begin, found.end) == (5, 7)
    assert found.value == pytest.approx(over(5, 7, 0), rel=1e-14)
    assert found.lo == pytest.approx(min(over(5, 7, -1), over(3, 5, -1)), rel=1e-14)
    assert found.hi == pytest.approx(max(over(5, 7, 1), over(3, 5, 1)), rel=1e-14)
    few = [8.0, 8.0, 8.0, 1.0, 0.5, 0.25, 0.125]  # three steps in the last pattern: one is left before the last two
    found = rate_at_the_end(few, [0.0] * 7, 3)
    assert (found.lo, found.value, found.hi) == (0.5, 0.5, 0.5)
    slower = [0.75**n for n in range(6)] + [0.75**5 * 0.5**n for n in (1, 2)]
    found = rate_at_the_end(slower, [0.0] * 8, 0)
    assert (found.lo, found.value, found.hi) == (pytest.approx(0.5), pytest.approx(0.5), pytest.approx(0.75))


def test_nothing_counts_before_the_last_change_of_pattern_or_after_a_residual_near_its_noise():
    residuals = [0.9**n for n in range(21)] + [0.9**20 * 0.5**n for n in range(1, 10)]
    floors = [1e-30] * 30
    patterns = ["a"] * 20 + ["b"] * 10
    found = rate_of(residuals, floors, patterns)
    assert (found.begin, found.end, found.value) == (27, 29, pytest.approx(0.5, rel=1e-14))
    assert found.hi == pytest.approx(0.5, rel=1e-14)
    assert rate_of(residuals, floors, ["a"] * 5 + ["b"] * 5 + ["a"] * 20).begin == 25
    noisy = floors.copy()
    noisy[10] = residuals[10] / CLEAR_OF_NOISE
    found = rate_of(residuals, noisy, patterns)
    assert (found.end, found.value) == (9, pytest.approx(0.9, rel=1e-14))
    noisy[10] *= 0.999
    assert rate_of(residuals, noisy, patterns).end == 29
    noisy[2] = 1.0
    assert rate_of(residuals, noisy, patterns) is None


# --- the noise --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Factor:
    """Carries by a factor."""

    join: Mortar
    slipped: np.ndarray = field(default_factory=lambda: np.zeros(0))
    moduli, carry, carry_back = Interface.moduli, Interface.carry, Interface.carry_back


def pair(S_1, S_2, l_1, l_2, transfer):
    """Two bodies with one unknown each, joined by a factor."""
    number = lambda value: np.array([[float(value)]])
    interface = Factor(join=Mortar(nodal=number(transfer)))
    return SimpleNamespace(
        interface=interface,
        contact=SimpleNamespace(schur=number(S_1), load=number(l_1)[0]),
        neumann=SimpleNamespace(schur=number(S_2), inverse=number(1 / S_2), load=number(l_2)[0]),
    )


SIZES = {"g": 1.0, "u": 2.0, "S_1": 4.0, "S_2": 0.5, "l_1": 8.0, "l_2": 16.0, "transfer": 2.0}


@pytest.mark.parametrize("negative", [(), *((name,) for name in SIZES)])
@pytest.mark.parametrize("zero", [(), ("g",), ("u",), ("l_1",), ("l_2",)])
def test_the_noise_has_every_term_whatever_its_sign(negative, zero):
    """``u' = |u| + (S_2 |u| + |g| + |l_2|)/S_2`` enters ``|g| + P (S_1 P u' + |l_1|)``, in the norm of ``1/S_2``."""
    size = {name: 0.0 if name in zero else value for name, value in SIZES.items()}
    signed = {name: -value if name in negative else value for name, value in size.items()}
    bodies = pair(*(signed[name] for name in ("S_1", "S_2", "l_1", "l_2", "transfer")))
    (found,) = Noise(bodies).of(np.array([[signed["g"]]]), np.array([[signed["u"]]]))
    g, u, S_1, S_2, l_1, l_2, P = (Fraction(size[name]) for name in ("g", "u", "S_1", "S_2", "l_1", "l_2", "transfer"))
    added = g + P * (S_1 * P * (u + u + (g + l_2) / S_2) + l_1)
    assert found == pytest.approx(float(4 * Fraction(2) ** -52 * added) * float(1 / S_2) ** 0.5, rel=1e-15, abs=0)


def test_the_noise_of_an_increment_has_the_force_of_the_slip_so_far():
    bodies = pair(4, 1, 8, 0, 1)
    bodies.interface = replace(bodies.interface, slipped=np.array([-3.0]))
    (found,) = Noise(bodies).of(np.zeros((1, 1)), np.zeros((1, 1)))
    assert found == pytest.approx(4 * 2.0**-52 * (4 * 3 + 8), rel=1e-15, abs=0)


# --- the largest step -------------------------------------------------------------------------------------------------

#: A pair whose noise at a state is 4 eps |g|.
PLAIN = pair(1, 1, 0, 0, 1)
PLAIN.contact.schur[:] = 0
PLAIN.neumann.schur[:] = 0


def states(residuals, noises):
    of = lambda r, noise: SimpleNamespace(residual=r, g=np.array([noise * 2.0**50]), displacement=np.zeros(1))
    return [of(*each) for each in zip(residuals, noises, strict=True)]


def test_a_step_has_the_noise_of_both_its_ends_and_none_begins_near_it():
    found = largest_step_ratio(PLAIN, states([1.0, 0.25, 0.125, 0.5], [2.0**-9, 2.0**-10, 2.0**-9, 2.0**-4]))
    assert (found.value, found.steps) == (0.5, 2)  # 0.125 is not 100 times its noise
    assert found.lo == pytest.approx(
        float((Fraction(1, 8) - Fraction(1, 2**9)) / (Fraction(1, 4) + Fraction(1, 2**10)))
    )
    assert found.hi == pytest.approx(
        float((Fraction(1, 8) + Fraction(1, 2**9)) / (Fraction(1, 4) - Fraction(1, 2**10)))
    )
    assert largest_step_ratio(PLAIN, states([1.0, 2.0**-9], [2.0**-9, 2.0**-8])).lo == 0
    near = largest_step_ratio(PLAIN, states([1.0, 0.5, 0.375], [2.0**-40, 2.0**-20, 2.0**-20]))
    assert (near.value, near.steps) == (0.75, 2)
    assert largest_step_ratio(PLAIN, states([1.0, 0.5], [2.0**-5] * 2)) is None
    lost = largest_step_ratio(PLAIN, states([1.0, 3.0, float("inf")], [2.0**-50] * 3))
    assert lost.value == 3

"""Section 5, inequality by inequality, with the measured constants of the mesh: exact there, so nothing may fail.

|||psi||| is (5.21), ||psi||' the dual norm of V^2, both from dense matrices of their own. Body "1" is the one that
solves step II and body "2" the one of step I, whatever their numbers in the file.
"""

from __future__ import annotations

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from section_5 import (
    EPS,
    FROM_5_34,
    INEQUALITIES,
    PAIRS,
    RELATIVE,
    Case,
    TwoForces,
    assert_all_hold,
    case_at_friction,
    directions,
    draw_pair,
    frictions,
    plates,
    ratio,
    ratios,
    seeds,
    thetas_for,
)

from ndtheory import EDITIONS, evaluate


@pytest.mark.parametrize("kind", PAIRS)
@strategies.fewer(8, at_night=2)
@given(data=strategies.contact_problems(), share=frictions, random=seeds)
def test_section_5_holds_for_two_forces(kind, data, share, random):
    case = case_at_friction(data, share)
    for _ in range(3):
        forces = draw_pair(case, kind, random)
        for theta in thetas_for(case, random):
            assert_all_hold(ratios(case, forces, theta))


@strategies.fewer(3, at_night=1)
@given(
    data=strategies.contact_problems(),
    share=st.sampled_from([0.0, 0.1, 0.5, 0.9, 0.99]),
    where=st.floats(0.01, 0.99),
    random=seeds,
)
def test_T_theta_contracts_by_the_proved_factor_wherever_it_is_proved(data, share, where, random):
    """K(theta) of Proposition 5.6, for k below C_2 and theta in the interval; the printed edition where m >= 1."""
    case = case_at_friction(data, share)
    for edition in EDITIONS:
        constants = case.measured.constants()
        interval = evaluate(edition, constants).interval
        if edition.proved(constants.m) and interval is not None:
            theta = interval[0] + where * (min(interval[1], 1.0) - interval[0])
            factor = evaluate(edition, constants, theta).factor
            for kind in ("any", "pressing", "pulling"):
                forces = draw_pair(case, kind, random)
                seen = forces.relaxed(theta) - forces.rounding["force"]
                # m, M, C_R and C_K are floats: h1 and h2 are then right to RELATIVE, beside 1 - K
                assert seen <= forces.norm * (factor.value + RELATIVE * (1 - factor.value) + 4 * EPS)


#: On the second the search comes closest to every inequality.
SEARCHED = {
    "stiff and huge units": lambda: plates(young=(50_000_000_000, 1_000_000_000), contact={"friction": "1/2"}),
    "nearly no slope": lambda: plates(heights=("1/10", "1/10"), poisson=("-0.5", "-0.5"), norm={"length": 100}),
}
if strategies.AT_NIGHT:
    SEARCHED |= {
        "thin on thick": lambda: plates(heights=("1/50", "1")),
        "thick on thin": lambda: plates(heights=("2", "1/30"), young=(1, 40), contact={"friction": 1}),
        "columns": lambda: plates(heights=("5", "3"), cells=((2, 5), (2, 3)), contact={"friction": 2}),
    }


def climb(case: Case, name: str, theta: float, random: np.random.Generator, steps: int) -> TwoForces:
    """Improve left/right of one inequality by random steps, long ones first."""
    worth = lambda forces: ratio(name, case.constants, forces, theta)
    psi, other = (case.scale * directions(case, random) for _ in range(2))
    best = TwoForces(case, psi, other)
    for i in range(steps):
        length = case.scale * 10 ** random.uniform(-2 * i / steps - 1, 0)
        psi_, other_ = psi + length * directions(case, random), other + length * directions(case, random)
        found = TwoForces(case, psi_, other_)
        if worth(found) > worth(best):
            best, psi, other = found, psi_, other_
    return best


@pytest.mark.parametrize("body", SEARCHED)
@pytest.mark.parametrize("name", INEQUALITIES)
def test_no_search_for_a_bad_pair_breaks_section_5(name, body):
    case, random = SEARCHED[body](), np.random.default_rng(5)
    thetas = (0.6, case.constants.C0 / 2)
    for theta in thetas if name in FROM_5_34 else thetas[:1]:
        found = climb(case, name, theta, random, 60 if strategies.AT_NIGHT else 25)
        for at in thetas:
            assert_all_hold(ratios(case, found, at))

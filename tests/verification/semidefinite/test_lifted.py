"""A contact body that can be lifted rigidly: the semidefinite bound with one lambda for all nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from problem_list import changed, small

import verification as vf
from verification.interface.body import NO_MOTIONS
from verification.semidefinite import model
from verification.semidefinite.lipschitz import enclose
from verification.semidefinite.multipliers import QuadraticForms

LIFTED = small(
    body2={"prescribed": {"left": [0, "free"]}, "traction": {"top": [0, -3000]}},
    contact={"interval": ["0.6", "1.6"]},
    iteration={"theta": "0.5"},
)


def lifted(k: str) -> vf.ContactPair:
    """A pair whose contact body can be lifted rigidly, and not slid."""
    return vf.build(vf.Problem.from_dict(changed(LIFTED, contact={"friction": k})))


@pytest.mark.parametrize("k", ["0.01", "0.2"])
def test_the_semidefinite_bound_of_a_body_that_can_be_lifted_is_the_limit_of_ever_softer_springs(k: str) -> None:
    """The springs leave each node a multiplier of its own, and so a smaller bound: by the root of their stiffness."""
    pair, theta = lifted(k), 0.4
    measured, contact, less = vf.measure(pair), pair.contact, []
    found = QuadraticForms(pair, measured).factor(theta)
    for softness in (1e-4, 1e-6, 1e-8):
        spring = softness * np.diag(contact.schur).max()
        held = replace(contact, schur=contact.schur + spring * contact.motions @ contact.motions.T, motions=NO_MOTIONS)
        less.append(found.value - QuadraticForms(replace(pair, contact=held), measured).factor(theta).value)
    assert 0 < less[2] < less[1] / 5 < less[0] / 10 < 1e-4
    assert found.proposed == pytest.approx(QuadraticForms(pair, measured, solver=model.solve).factor(theta).value, 1e-6)


@pytest.mark.parametrize("k", ["0.1", "0.3"])
def test_the_semidefinite_bound_of_a_body_that_can_be_lifted_is_near_the_largest_factor_found(k: str) -> None:
    pair = lifted(k)
    found = enclose(pair, QuadraticForms(pair, vf.measure(pair)), 0.3, gap=1e-2, programs=40)
    assert found.lower <= found.upper.value <= found.whole.value
    assert found.upper.value < 1.03 * found.lower


def test_as_friction_vanishes_the_semidefinite_bound_tends_to_that_without() -> None:
    factor = lambda k: QuadraticForms(lifted(k), vf.measure(lifted(k))).factor(0.3).value
    smooth = factor("0")
    assert [factor(k) - smooth < 2 * float(k) for k in ("0.001", "0.000001")] == [True, True]
    assert factor("0.000001") >= smooth


def test_what_can_be_lifted_has_no_certificate_and_a_comparison_with_proofs_says_so() -> None:
    pair = lifted("0.01")
    found = vf.compare(pair.problem, verified=True, bounds="lmi").bounds["lmi"].detail
    assert not found.certified
    assert "can be lifted rigidly" in found.not_proved


def test_without_friction_the_semidefinite_bound_of_a_lifted_body_is_that_in_energy_norms_which_is_attained() -> None:
    """At g = 0, p = 0, and at the mode of rho_N with all nodes closed, every product of (2.4) is 0."""
    found = vf.compare(vf.Problem.from_dict(changed(LIFTED, contact={"friction": 0})))
    pair, theta, t = found.run.pair, found.bounds["energy"].theta, found.run.pair.contact.grid.t
    assert pair.contact.lifts
    assert found.bounds["lmi"].detail.lipschitz.value == pytest.approx(found.bounds["energy"].factor.value, rel=1e-9)
    S1, S2, normal = pair.contact.schur, pair.neumann.schur, pair.contact.grid.normal
    S1_normal = S1[t:, t:] - S1[t:, :t] @ np.linalg.solve(S1[:t, :t], S1[:t, t:])
    values, modes = scipy.linalg.eigh(S1_normal, np.linalg.inv(pair.neumann.inverse[normal, normal]))
    d = pair.neumann.inverse[:, normal] @ np.linalg.solve(pair.neumann.inverse[normal, normal], modes[:, -1])
    p = np.r_[np.zeros(t), -S1_normal @ d[normal]]
    assert np.abs(p + values[-1] * S2 @ d).max() <= 1e-9 * np.abs(p).max()
    attained = max(1 - theta, abs(1 - theta - theta * values[-1]))
    assert found.bounds["energy"].factor.value == pytest.approx(attained, rel=1e-9)

"""What a coupling scheme does with theta: serial and parallel, forces and displacements, and steps in time."""

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from problem_list import plates
from scipy.linalg import block_diag, eigh
from strategies import log_uniform

import verification as vf
from fem1d2d import Condensation, gram
from ndtheory.energy_norms import predicted_theta


@dataclass(frozen=True)
class Tied:
    """Two bodies on four interface unknowns, their loads."""

    S_c: np.ndarray
    S_n: np.ndarray
    l_c: np.ndarray
    l_n: np.ndarray

    def displacement(self, g):
        return np.linalg.solve(self.S_n, g + self.l_n)

    def force(self, u):
        return self.l_c - self.S_c @ u


@pytest.fixture
def tied():
    random = np.random.default_rng(3)
    S_c, S_n = (A @ A.T + np.eye(4) for A in random.normal(size=(2, 4, 4)))
    return Tied(S_c, S_n, *random.normal(size=(2, 4)))


def test_serial_coupling_that_relaxes_displacements_is_the_one_that_relaxes_forces(tied):
    theta = vf.advise_matrices(tied.S_c, tied.S_n).roles[0].theta_predicted
    g = np.zeros(4)
    u = tied.displacement(g)
    for _ in range(30):
        assert np.allclose(tied.displacement(g), u, rtol=0, atol=1e-10)
        g = theta * tied.force(tied.displacement(g)) + (1 - theta) * g
        u = theta * tied.displacement(tied.force(u)) + (1 - theta) * u


def test_parallel_coupling_multiplies_a_mode_by_another_number(tied):
    values = eigh(tied.S_c, tied.S_n, eigvals_only=True)
    theta = float(predicted_theta(values[-1]))
    zero = np.zeros((4, 4))
    jacobi = np.block([[zero, np.linalg.inv(tied.S_n)], [-tied.S_c, zero]])  # of displacements and forces
    step = (1 - theta) * block_diag(np.eye(4), np.eye(4)) + theta * jacobi
    expected = abs(1 - theta + 1j * theta * np.sqrt(values))
    found = np.sort(abs(np.linalg.eigvals(step)))
    assert found == pytest.approx(np.sort([*expected, *expected]), rel=1e-9)
    assert found[-1] > values[-1] / (2 + values[-1])  # slower than in serial coupling


@given(log_uniform(-3, 3))
def test_the_best_factor_of_parallel_coupling_is_1_over_1_plus_rho(rho):
    rho = float(rho)
    square = lambda theta: (1 - theta) ** 2 + theta**2 * rho
    assert square(1 / (1 + rho)) == pytest.approx(rho / (1 + rho))
    assert min(square(t / (1 + rho)) for t in np.linspace(0.1, 2, 39)) >= square(1 / (1 + rho)) * (1 - 1e-12)


# --- steps in time ---------------------------------------------------------------------------------------------------

#: Aluminium below, lead above, in t/mm^3; the moduli and the rest in mm, s and MPa.
DENSITY = {"body1": 2.7e-9, "body2": 11.3e-9}


def lumped(body):
    """The masses of the unknowns: two Gram matrices of the H1 norm differ by the mass."""
    consistent = (gram(body.mesh, 1.0) - gram(body.mesh, 2.0)) / (1 - 1 / 4)
    return DENSITY[body.name] * consistent.sum(axis=1)[body.positions]


@pytest.fixture(scope="module")
def metals():
    moduli = {"body1": {"young": 70000, "poisson": "0.33"}, "body2": {"young": 16000, "poisson": "0.44"}}
    pair = vf.build(vf.Problem.from_dict(plates(**moduli)))
    return pair.body1.mesh_body, pair.body2.mesh_body


def dynamic(body, dt, c=4):
    A = body.stiffness + c / dt**2 * sp.diags_array(lumped(body))
    return Condensation(sp.csc_array(A), body.interface).schur


def test_the_lumped_masses_are_those_of_the_plates(metals):
    for body, width in zip(metals, (2.0, 1.2), strict=True):
        # the unknowns of a clamped side are left out: half a layer of three
        assert lumped(body).sum() / 2 == pytest.approx(DENSITY[body.name] * width * 0.3 * 5 / 6, rel=1e-9)


def test_for_long_steps_the_roles_are_those_of_statics_and_for_short_ones_they_are_exchanged(metals):
    statics = vf.advise_matrices(*(body.elastic.schur for body in metals))
    found = {dt: vf.advise_matrices(*(dynamic(body, dt) for body in metals)) for dt in (1e-3, 1e-7, 3e-8, 1e-9)}
    assert [advice.neumann_body for advice in found.values()] == [1, 1, 2, 2]
    assert statics.neumann_body == 1
    for one, other in zip(found[1e-3].roles, statics.roles, strict=True):
        assert one.rho.value == pytest.approx(other.rho.value, rel=1e-5)


def test_as_the_step_tends_to_0_rho_tends_to_the_largest_ratio_of_interface_masses(metals):
    mass = {body.name: lumped(body)[body.interface] for body in metals}
    limit = {1: (mass["body2"] / mass["body1"]).max(), 2: (mass["body1"] / mass["body2"]).max()}
    off = []
    for dt in (1e-8, 1e-9, 1e-10):
        roles = vf.advise_matrices(*(dynamic(body, dt) for body in metals)).roles
        off.append(max(abs(role.rho.value / limit[role.neumann_body] - 1) for role in roles))
    assert off[2] < 1e-4
    assert off[1] < off[0] / 30  # as dt^2


@pytest.mark.parametrize("dt", [1e-3, 1e-7, 1e-9])
def test_a_tied_step_in_time_converges_at_the_rate_of_the_dynamic_matrices(metals, dt):
    S1, S2 = (dynamic(body, dt) for body in metals)
    found = vf.advise_matrices(S1, S2, tied=True)
    S_c, S_n = (S2, S1) if found.neumann_body == 1 else (S1, S2)
    theta, rate = found.best.theta_tied, found.best.rate_tied
    error = np.arange(1.0, len(S1) + 1)
    for _ in range(20):
        after = error - theta * (error + S_c @ np.linalg.solve(S_n, error))
        lengths = [np.sqrt(g @ np.linalg.solve(S_n, g)) for g in (error, after)]
        assert lengths[1] <= rate * lengths[0] * (1 + 1e-9)
        error = after

"""Plane stress: a thin plate, whose law in the plane is that of plane strain for other moduli."""

from __future__ import annotations

import json
from fractions import Fraction as F

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problem_list import small
from strategies import AT_NIGHT

import verification as vf
from fem1d2d import Mesh, largest_strains, plane_strain, plane_stress, rectangle, stiffness, stresses
from fem1d2d.element import stiffness as element_stiffness
from ndtheory.moduli import Moduli, half_planes
from verification.certificate.claims import describe
from verification.certificate.continuum import certify_continuum, two_rectangles
from verification.certificate.contraction import certify, check_again
from verification.sections.setting import setting
from verification.show.layout import text
from verification.testing.strategies import decimals

ratios = st.integers(-49, 50).map(lambda i: F(i, 100))


def of_plates(**changes):
    return vf.Problem.from_dict(small() | {"plane": "stress"}).changed(**changes)


def substituted(problem):
    """The problem of plane strain with the moduli of the same law, by hand."""
    bodies = (problem.body1, problem.body2)
    young = [b.young * (1 + 2 * b.poisson) / (1 + b.poisson) ** 2 for b in bodies]
    poisson = [b.poisson / (1 + b.poisson) for b in bodies]
    return problem.with_keys({"plane": "strain"}).changed(young=young, poisson=poisson)


def by_voigt(points, young, nu):
    """The element matrix from the compliance of a plate: strain = C stress in (xx, yy, 2 xy), sigma_zz = 0."""
    compliance = np.array([[1, -nu, 0], [-nu, 1, 0], [0, 0, 2 * (1 + nu)]]) / young
    edges = np.array([points[1] - points[0], points[2] - points[0]])
    slopes = np.linalg.solve(edges, [[-1, 1, 0], [-1, 0, 1]])  # gradients of the three hats as columns
    B = np.zeros((3, 6))
    B[0, 0::2], B[1, 1::2] = slopes
    B[2, 0::2], B[2, 1::2] = slopes[::-1]
    return abs(np.linalg.det(edges)) / 2 * B.T @ np.linalg.solve(compliance, B)


@given(ratios, decimals(-2, 5), st.integers(0, 2**32 - 1))
def test_the_element_matrix_is_that_of_the_compliance_of_a_plate(nu, young, seed):
    points = np.array([[0.0, 0], [1, 0], [0, 1]]) + 0.2 * np.random.default_rng(seed).uniform(-1, 1, (3, 2))
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2]]), sides={})
    found = element_stiffness(mesh, plane_stress(float(young), float(nu))).reshape(6, 6)
    expected = by_voigt(points, float(young), float(nu))
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-12 * np.abs(expected).max())


@given(ratios, decimals(-2, 5))
def test_plane_stress_is_plane_strain_with_other_moduli_exactly(nu, young):
    plate = plane_stress(young, nu)
    other = plane_strain(young * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu))
    assert (plate.lame_lambda, plate.lame_mu) == (other.lame_lambda, other.lame_mu)
    kappa = Moduli(young=young, poisson=nu, plane="stress").kappa
    assert kappa == 3 - 4 * nu / (1 + nu)


@given(ratios, st.integers(0, 2**32 - 1))
def test_a_plate_under_a_plane_stress_has_the_strains_of_the_body_in_space(nu, seed):
    young, nu = 3.0, float(nu)
    sigma = np.zeros((3, 3))
    sigma[:2, :2] = np.random.default_rng(seed).uniform(-1, 1, (2, 2))
    sigma[:2, :2] += sigma[:2, :2].T
    strain = ((1 + nu) * sigma - nu * np.trace(sigma) * np.eye(3)) / young  # Hooke's law in space
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 1))
    u, plate = mesh.points @ strain[:2, :2], plane_stress(young, nu)
    assert stresses(mesh, plate, u) == pytest.approx(np.broadcast_to(sigma, (4, 3, 3)), abs=1e-12)
    assert largest_strains(mesh, u, plate) == pytest.approx(np.abs(np.linalg.eigvalsh(strain)).max(), rel=1e-9)


def test_a_plate_pulled_at_one_end_lengthens_as_a_bar():
    mesh = rectangle((0.0, 4.0), (0.0, 1.0), (4, 2))
    A = stiffness(mesh, plane_stress(5.0, 0.3))
    u = mesh.points * [1 / 5, -0.3 / 5]  # sigma_xx = 1
    force = (A @ u.ravel()).reshape(-1, 2)
    inside = (mesh.points[:, 0] > 0) & (mesh.points[:, 0] < 4)
    assert np.abs(force[inside]).max() < 1e-12
    assert force[mesh.points[:, 0] == 4].sum(axis=0) == pytest.approx([1, 0], abs=1e-12)


# --- problems ---------------------------------------------------------------------------------------------------------


def test_a_problem_of_plates_has_the_numbers_of_its_substitution():
    problem = of_plates()
    other = substituted(problem)
    names = ("m", "M", "C_R", "C_K", "rho_max", "rho_normal", "kappa_1", "kappa_2")
    for verified, more in ((False, ("rho_cells", "rho_normal_cells")), (True, ())):
        measured, expected = (vf.measure(each, verified=verified) for each in (problem, other))
        for name in (*names, *more):
            assert getattr(measured, name).value == pytest.approx(getattr(expected, name).value, rel=1e-9), name
    run, expected = vf.run(problem), vf.run(other)
    assert run.contact.pressure == pytest.approx(expected.contact.pressure, rel=1e-7)
    assert vf.solve(problem).contact.shear == pytest.approx(vf.solve(other).contact.shear, rel=1e-9)
    assert describe(problem) == describe(other)
    assert vf.measure(problem).rho_max.value != vf.measure(problem.with_keys({"plane": "strain"})).rho_max.value


def test_plates_and_bodies_of_plane_strain_have_different_digests_and_the_default_has_none():
    problem = of_plates()
    strain = problem.with_keys({"plane": "strain"})
    assert problem.digest != strain.digest
    assert strain.digest == vf.Problem.from_dict(small()).digest
    assert vf.Problem.from_dict(json.loads(json.dumps(problem.to_dict()))) == problem
    assert problem.swapped().refined(1).plane == "stress"


def test_a_certificate_of_plates_is_about_their_substitution():
    problem = of_plates()
    document = json.loads(certify(problem).to_json())
    found = check_again(document, problem)
    assert found.accepted
    assert found.same
    assert not check_again(document, problem.with_keys({"plane": "strain"})).same


def test_the_continuum_has_the_constants_of_plates():
    """They are those of the rectangles, which are the same for the substitution; the certificate itself by night."""
    problem = vf.example("section6").with_keys({"plane": "stress"})
    model = two_rectangles(problem)
    assert model == two_rectangles(substituted(problem))
    moduli = [Moduli(young=b.young, poisson=b.poisson, plane="stress") for b in (problem.body2, problem.body1)]
    assert half_planes(model.contact.body, model.neumann.body) == half_planes(*moduli)
    if AT_NIGHT:
        found = certify_continuum(problem).rho_least
        assert found.value == pytest.approx(float(half_planes(*moduli).high))


def test_nearly_incompressible_plates_give_no_warning_and_incompressible_ones_are_accepted():
    thick = vf.Problem.from_dict(small()).changed(poisson=("0.49", "0.49"))
    assert any("linear triangles" in warning for warning in vf.build(thick).warnings)
    for nu in ("0.49", "0.5"):
        plates = of_plates(poisson=(nu, nu))
        assert not any("linear triangles" in warning for warning in vf.build(plates).warnings)
    assert vf.run(plates).converged


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"plane": "axisymmetric"}, 'plane = "axisymmetric": bodies of revolution'),
        ({"plane": "thin"}, 'plane = "thin": needed one of "strain", "stress"'),
        ({"plane": "stress", "body1.poisson": "-0.5"}, "body1.poisson = -0.5: needed a number with -0.5 < nu <= 0.5"),
        ({"plane": "strain", "body2.poisson": "0.5"}, "body2.poisson = 0.5: needed a number with -1 < nu < 0.5"),
    ],
)
def test_other_models_are_refused_in_one_line(keys, said):
    with pytest.raises(vf.ProblemError) as refused:
        vf.Problem.from_dict(small()).with_keys(keys)
    line = str(refused.value)
    assert said in line.replace("-1/2", "-0.5").replace("1/2", "0.5")
    assert "\n" not in line


def test_bars_have_no_plane():
    with pytest.raises(vf.ProblemError, match="plane: a bar has none"):
        vf.example("two-bars").with_keys({"plane": "stress"})


def test_the_screen_names_plane_stress():
    plates = of_plates()
    assert "plane stress" in text((setting(plates, None, 7),))
    assert "plane stress" not in text((setting(plates.with_keys({"plane": "strain"}), None, 7),))

"""Lame parameters against the textbook's inverse formulas and against a bar under tension."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from strategies import numbers

from fem1d2d import Material, bar, element, interval, plane_strain, rectangle, stiffness
from fem1d2d.proofs import exact

youngs = numbers(Fraction(1, 6), 100, 6)
poissons = numbers(Fraction(-19, 20), Fraction(9, 20), 20)


@given(youngs, poissons)
def test_a_bar_under_tension_recovers_young_and_poisson(young, poisson):
    material = plane_strain(young, poisson)
    strain = np.diag([Fraction(1), -poisson, -poisson])  # three-dimensional, uniaxial stress
    stress = material.lame_lambda * np.trace(strain) * np.eye(3, dtype=int) + 2 * material.lame_mu * strain
    assert np.array_equal(stress, np.diag([young, 0, 0]))


@given(youngs, poissons)
def test_lame_parameters_have_the_unit_of_stress(young, poisson):
    once, thrice = plane_strain(young, poisson), plane_strain(3 * young, poisson)
    assert (thrice.lame_lambda, thrice.lame_mu) == (3 * once.lame_lambda, 3 * once.lame_mu)


@given(youngs, poissons)
def test_continuity_is_the_largest_eigenvalue_of_hooke_s_law_on_symmetric_strains(young, poisson):
    """Pure shear costs 2 mu, a dilation in d dimensions 2 mu + d lambda; in one dimension there is no shear."""
    material = plane_strain(young, poisson)
    shear, dilation = 2 * material.lame_mu, 2 * material.lame_mu + 2 * material.lame_lambda
    assert material.continuity(2) == max(shear, dilation)
    hooke = material.lame_lambda * np.outer([1, 1, 0], [1, 1, 0]) + shear * np.eye(3, dtype=int)  # xx, yy, sqrt(2) xy
    assert float(material.continuity(2)) == pytest.approx(np.linalg.eigvalsh(hooke.astype(float)).max(), rel=1e-14)


@given(youngs)
def test_the_continuity_of_a_bar_is_young(young):
    assert bar(young).continuity(1) == young


@given(youngs)
def test_a_bar_carries_stress_young_times_strain(young):
    assert (bar(young).lame_lambda, bar(young).lame_mu) == (young, 0)


@pytest.mark.parametrize("young", [0.0, -1.0, float("nan"), Fraction(0)])
@pytest.mark.parametrize("law", [bar, lambda young: plane_strain(young, 0.3)])
def test_a_young_modulus_that_is_not_positive_is_refused(law, young):
    with pytest.raises(ValueError, match=f"Young modulus {young}: a positive number is needed"):
        law(young)


@pytest.mark.parametrize("poisson", [-1.0, 0.5, 0.7, float("nan"), Fraction(1, 2), Fraction(-1)])
def test_a_poisson_ratio_outside_minus_one_to_one_half_is_refused(poisson):
    with pytest.raises(ValueError, match=f"Poisson ratio {poisson}: a number with -1 < nu < 0.5 is needed"):
        plane_strain(1.0, poisson)


@pytest.mark.parametrize("poisson", [-0.9999, 0.4999, Fraction(-9999, 10000), Fraction(4999, 10000)])
def test_poisson_ratios_next_to_the_ends_are_accepted(poisson):
    material = plane_strain(1.0, poisson)
    assert material.lame_mu > 0
    assert 3 * material.lame_lambda + 2 * material.lame_mu > 0


# --- one material for each cell ---


def test_two_materials_in_series_lengthen_like_two_springs():
    mesh = interval((0.0, 3.0), 3)
    steel, rubber = bar(8.0), bar(2.0)
    material = Material.of_cells([steel, rubber], np.array([0, 1, 1]))
    matrix = stiffness(mesh, material).toarray()[1:, 1:]
    assert np.linalg.solve(matrix, [0.0, 0.0, 1.0])[-1] == pytest.approx(1 / 8 + 2 / 2, rel=1e-14)


def test_a_body_of_two_materials_is_the_sum_of_its_parts():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (4, 3))
    kinds = [plane_strain(7.0, 0.3), plane_strain(0.1, 0.45)]
    which = (mesh.points[mesh.cells].mean(axis=1)[:, 0] > 1).astype(int)
    whole = Material.of_cells(kinds, which)
    single = element.stiffness(mesh, whole)
    for kind, material in enumerate(kinds):
        assert np.array_equal(single[which == kind], element.stiffness(mesh, material)[which == kind])
    assert whole.continuity(2) == max(material.continuity(2) for material in kinds)


def test_exact_matrices_of_two_materials_enclose_those_in_doubles():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (4, 3))
    kinds = [plane_strain(Fraction(7), Fraction(3, 10)), plane_strain(Fraction(1, 10), Fraction(9, 20))]
    which = np.arange(len(mesh.cells)) % 2
    enclosed = exact.stiffness(mesh, Material.of_cells(kinds, which))
    plain = [plane_strain(7.0, 0.3), plane_strain(0.1, 0.45)]
    floats = stiffness(mesh, Material.of_cells(plain, which))
    assert abs(enclosed.middle - floats).max() <= 1e-14 * abs(floats).max()
    mixed = stiffness(mesh, Material.of_cells(plain[::-1], which))
    assert abs(enclosed.middle - mixed).max() > 0.1 * abs(floats).max()


def test_bodies_of_several_materials_are_as_stiff_as_each_other_only_where_they_are_the_same():
    kinds = [plane_strain(7.0, 0.3), plane_strain(0.1, 0.45)]
    one, other = (Material.of_cells(kinds, np.array(which)) for which in ([0, 1, 1], [0, 1, 0]))
    assert one.over(one) == 1.0
    assert one.over(other) is one.over(kinds[0]) is None
    assert plane_strain(14.0, 0.3).over(kinds[0]) == 2.0

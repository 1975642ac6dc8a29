"""Lame parameters against the textbook's inverse formulas and against a bar under tension."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from strategies import numbers

from fem1d2d import bar, plane_strain

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

"""Element matrices against a second derivation, in exact rationals and in floats."""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer, in_floats, lines, materials, numbers, plane_meshes, triangles, vectors

from fem1d2d import Material, Mesh, bar, element
from fem1d2d.mesh import measures


def matrices(elements):
    """Element tensors (c, n, d, n, d) as a list of square matrices."""
    size = int(np.sqrt(elements[0].size))
    return list(elements.reshape(len(elements), size, size))


def corners(mesh):
    return [mesh.points[cell] for cell in mesh.cells]


simplices = st.one_of(triangles(), lines(most=2))


@given(simplices)
def test_signed_measures_are_determinants_of_vertex_coordinates(mesh):
    assert measures(mesh.points, mesh.cells).tolist() == [fem_oracle.hats(p)[1] for p in corners(mesh)]


@given(simplices)
def test_the_volume_of_a_shape_function_is_its_row_of_the_mass_as_hat_functions_sum_to_one(mesh):
    one = element.element_of(mesh)
    assert (element.Element.volumes(one, mesh) == one.volumes(mesh)).all()


@given(simplices)
def test_hat_functions_are_one_at_their_vertex_and_zero_at_the_others(mesh):
    for p, gradients in zip(corners(mesh), element.gradients(mesh), strict=True):
        n = len(p)
        centroid = p.sum(axis=0) / n
        assert ((p - centroid) @ gradients.T + Fraction(1, n) == np.eye(n, dtype=int)).all()


@given(simplices, materials())
def test_stiffness_is_the_strain_displacement_form_in_rationals(mesh, material):
    expected = [fem_oracle.element_stiffness(p, material) for p in corners(mesh)]
    assert np.array_equal(matrices(element.stiffness(mesh, material)), expected)


@given(simplices)
def test_mass_integrates_products_of_barycentric_coordinates(mesh):
    assert np.array_equal(element.mass(mesh), [fem_oracle.element_mass(p) for p in corners(mesh)])


@given(simplices)
def test_laplace_integrates_products_of_gradients(mesh):
    assert np.array_equal(element.laplace(mesh), [fem_oracle.element_laplace(p) for p in corners(mesh)])


@given(lines(most=1), numbers(Fraction(1, 4), 8, 12))
def test_a_bar_element_is_a_spring_of_stiffness_young_over_length(mesh, young):
    spring = young / (mesh.points[1, 0] - mesh.points[0, 0])
    assert matrices(element.stiffness(mesh, bar(young)))[0].tolist() == [[spring, -spring], [-spring, spring]]


@fewer(3, at_night=1)
@given(plane_meshes(exact=True), materials(binary=True))
def test_stiffness_in_floats_is_the_rational_one_to_the_bit_where_areas_are_powers_of_two(mesh, material):
    floats = Material(lame_lambda=float(material.lame_lambda), lame_mu=float(material.lame_mu))
    computed = element.stiffness(in_floats(mesh), floats)
    assert computed.dtype == float
    expected = [fem_oracle.element_stiffness(p, material) for p in corners(mesh)]
    assert np.array_equal(matrices(fem_oracle.exactly(computed)), expected)


@fewer(3, at_night=1)
@given(plane_meshes(exact=True))
def test_mass_and_laplace_in_floats_are_the_rational_ones_rounded_once_where_areas_are_powers_of_two(mesh):
    floats = in_floats(mesh)
    assert np.array_equal(element.mass(floats), [fem_oracle.element_mass(p).astype(float) for p in corners(mesh)])
    assert np.array_equal(element.laplace(floats), [fem_oracle.element_laplace(p).astype(float) for p in corners(mesh)])


@given(st.one_of(triangles(denominator=16), lines(denominator=16)), materials(binary=True))
def test_elements_in_floats_are_within_a_few_roundings_of_the_rational_ones(mesh, material):
    floats = Material(lame_lambda=float(material.lame_lambda), lame_mu=float(material.lame_mu))
    computed = (element.stiffness(in_floats(mesh), floats), element.laplace(in_floats(mesh)))
    derivations = (lambda p: fem_oracle.element_stiffness(p, material), fem_oracle.element_laplace)
    for elements, derive in zip(computed, derivations, strict=True):
        for matrix, p in zip(matrices(elements), corners(mesh), strict=True):
            assert fem_oracle.is_rounded(matrix, derive(p), roundings=8)


@given(triangles(), materials(), st.integers(1, 2))
def test_turning_the_vertices_of_a_triangle_turns_its_matrices(mesh, material, turn):
    order = np.roll(np.arange(3), turn)
    turned = Mesh(points=mesh.points, cells=mesh.cells[:, order], sides={})
    stiffness, again = element.stiffness(mesh, material), element.stiffness(turned, material)
    assert np.array_equal(again, stiffness[:, order][:, :, :, order])


@given(triangles(), materials(), vectors(denominator=12), vectors(denominator=12))
def test_the_energy_of_a_linear_displacement_is_area_times_its_strain_energy(mesh, material, row1, row2):
    G = np.array([row1, row2])
    eps, area = (G + G.T) / 2, fem_oracle.hats(mesh.points)[1]
    u = (mesh.points @ G.T).ravel()
    energy = u @ matrices(element.stiffness(mesh, material))[0] @ u
    assert energy == area * (material.lame_lambda * np.trace(eps) ** 2 + 2 * material.lame_mu * (eps * eps).sum())


@given(triangles(), materials(), vectors(size=6))
def test_energy_is_at_most_the_larger_of_two_mu_and_two_mu_plus_two_lambda_times_the_gradient_norm(mesh, material, u):
    bound = 2 * max(material.lame_mu, material.lame_mu + material.lame_lambda)
    gradients = sum(u[p::2] @ element.laplace(mesh)[0] @ u[p::2] for p in range(2))
    assert u @ matrices(element.stiffness(mesh, material))[0] @ u <= bound * gradients


@pytest.mark.parametrize("poisson", [Fraction(1, 3), Fraction(-1, 3), Fraction(0)])
def test_the_bound_on_the_energy_is_attained_by_a_dilation_or_a_pure_shear(poisson):
    material = Material(lame_lambda=poisson, lame_mu=Fraction(1))
    points = np.array([[0, 0], [2, 0], [1, 3]], dtype=object) * Fraction(1)
    mesh = Mesh(points=points, cells=np.array([[0, 1, 2]]), sides={})
    u = points * np.array([1, 1 if poisson > 0 else -1])
    gradients = sum(u[:, p] @ element.laplace(mesh)[0] @ u[:, p] for p in range(2))
    energy = u.ravel() @ matrices(element.stiffness(mesh, material))[0] @ u.ravel()
    assert energy == 2 * max(1, 1 + poisson) * gradients

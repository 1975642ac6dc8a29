"""Global matrices and loads: patch tests, norms of polynomials, scaling laws."""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import (
    fewer,
    in_floats,
    lines,
    materials,
    meshes,
    numbers,
    plane_meshes,
    powers_of_two,
    renumbered,
    vectors,
)

from fem1d2d import Material, Mesh, bar, body_load, element, gram, interval, rectangle, stiffness
from fem1d2d.assembly import facet_weights
from fem1d2d.mesh import measures


def dense(mesh, elements):
    """Element tensors (c, n, d, n, d), summed in rationals by the definition."""
    c, n, d = elements.shape[:3]
    return fem_oracle.assemble(mesh, elements.reshape(c, n * d, n * d), d)


def floats_of(material):
    return Material(lame_lambda=float(material.lame_lambda), lame_mu=float(material.lame_mu))


def linear(mesh, G, shift):
    """Nodal values of u(x) = G x + shift."""
    return (mesh.points @ G.T + shift).ravel()


def size(mesh):
    """Length or area of the mesh."""
    return sum(fem_oracle.hats(mesh.points[cell])[1] for cell in mesh.cells)


# --- assembly in floats -----------------------------------------------------------------------------------------------


@fewer(3, at_night=1)
@given(meshes(), materials(binary=True))
def test_the_stiffness_matrix_is_the_rational_one_up_to_summation(mesh, material):
    exact = fem_oracle.stiffness(mesh, material)
    assert fem_oracle.is_rounded(stiffness(in_floats(mesh), floats_of(material)), exact, roundings=8)
    assert fem_oracle.is_rounded(stiffness(mesh, material), exact, roundings=4)


@fewer(2)
@given(plane_meshes(exact=True), materials(binary=True))
def test_the_stiffness_matrix_is_exact_to_the_bit_where_areas_are_powers_of_two(mesh, material):
    computed = stiffness(in_floats(mesh), floats_of(material)).toarray()
    assert np.array_equal(fem_oracle.exactly(computed), fem_oracle.stiffness(mesh, material))


@fewer(2)
@given(meshes(), powers_of_two())
def test_the_gram_matrix_is_the_rational_one_up_to_summation(mesh, length):
    exact = fem_oracle.gram(mesh, length)
    assert fem_oracle.is_rounded(gram(in_floats(mesh), float(length)), exact, roundings=8)
    assert fem_oracle.is_rounded(gram(mesh, length), exact, roundings=4)


def test_the_paper_s_norm_has_length_one():
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 3))
    assert (gram(mesh) != gram(mesh, 1.0)).nnz == 0


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), Fraction(0)])
def test_a_norm_of_no_length_is_refused(length):
    with pytest.raises(ValueError, match=f"length {length}: a positive number is needed"):
        gram(interval((0.0, 1.0), 1), length)


# --- patch tests, in rationals ----------------------------------------------------------------------------------------


@fewer(6, at_night=2)
@given(plane_meshes(), materials(), vectors(), vectors(), vectors())
def test_linear_displacements_have_their_exact_energy(mesh, material, row1, row2, shift):
    G = np.array([row1, row2])
    eps, u = (G + G.T) / 2, linear(mesh, G, shift)
    density = material.lame_lambda * np.trace(eps) ** 2 + 2 * material.lame_mu * (eps * eps).sum()
    assert u @ dense(mesh, element.stiffness(mesh, material)) @ u == density * size(mesh)


@given(lines(), numbers(Fraction(1, 4), 9), numbers(-4, 4), numbers(-4, 4))
def test_a_bar_stretched_linearly_has_its_exact_energy(mesh, young, slope, shift):
    u = mesh.points[:, 0] * slope + shift
    assert u @ dense(mesh, element.stiffness(mesh, bar(young))) @ u == young * slope**2 * size(mesh)


@fewer(3, at_night=1)
@given(plane_meshes(), materials(), vectors(), numbers(-4, 4))
def test_rigid_motions_cost_no_energy_and_meet_no_force(mesh, material, shift, turn):
    spin = np.array([[0, -turn], [turn, 0]], dtype=object)
    assert not (dense(mesh, element.stiffness(mesh, material)) @ linear(mesh, spin, shift)).any()


@fewer(6, at_night=2)
@given(plane_meshes(), materials(), vectors(), vectors())
def test_a_constant_stress_meets_forces_only_on_the_boundary_where_they_are_its_tractions(mesh, material, row1, row2):
    G = np.array([row1, row2])
    eps = (G + G.T) / 2
    stress = material.lame_lambda * np.trace(eps) * np.eye(2, dtype=int) + 2 * material.lame_mu * eps
    forces = fem_oracle.zeros(*mesh.points.shape)
    for cell in mesh.cells:  # an edge inside is passed once each way and cancels
        for a, b in zip(cell, np.roll(cell, -1), strict=True):
            tangent = mesh.points[b] - mesh.points[a]
            forces[[a, b]] += stress @ np.array([tangent[1], -tangent[0]]) / 2
    assert np.array_equal((dense(mesh, element.stiffness(mesh, material)) @ linear(mesh, G, 0)).reshape(-1, 2), forces)
    inside = np.setdiff1d(np.arange(len(mesh.points)), mesh.boundary)
    assert not forces[inside].any()


@fewer(3, at_night=1)
@given(meshes(), numbers(Fraction(1, 4), 3, 12), st.data())
def test_the_norm_of_a_constant_is_its_mean_square_over_length_squared(mesh, length, data):
    c = data.draw(vectors(size=mesh.dimension))
    scalar = fem_oracle.assemble(mesh, element.laplace(mesh) + element.mass(mesh) / length**2, 1)
    norm = sum(x**2 for x in c) * scalar.sum()
    assert norm == sum(x**2 for x in c) * size(mesh) / length**2


@given(
    numbers(-2, 2, 12), numbers(Fraction(1, 4), 3, 12), numbers(-2, 2, 12), numbers(Fraction(1, 4), 3, 12),
    st.tuples(st.integers(1, 2), st.integers(1, 2)), vectors(size=3), numbers(Fraction(1, 4), 3, 12),
)  # fmt: skip
def test_the_norm_of_a_linear_function_on_a_rectangle_is_its_integral(a, width, b, height, cells, v, length):
    mesh = rectangle((a, a + width), (b, b + height), cells)
    nodal = v[0] + mesh.points @ v[1:]
    middle = v[0] + v[1] * (a + width / 2) + v[2] * (b + height / 2)
    square = middle**2 + (v[1] * width) ** 2 / 12 + (v[2] * height) ** 2 / 12  # mean of v^2
    expected = width * height * (square / length**2 + v[1] ** 2 + v[2] ** 2)
    scalar = fem_oracle.assemble(mesh, element.laplace(mesh) + element.mass(mesh) / length**2, 1)
    assert nodal @ scalar @ nodal == expected


@given(lines(), vectors(size=2), numbers(Fraction(1, 4), 3, 12))
def test_the_norm_of_a_linear_function_on_a_line_is_its_integral(mesh, v, length):
    a, b = mesh.points[0, 0], mesh.points[-1, 0]
    cubes = (v[0] + v[1] * b) ** 3 - (v[0] + v[1] * a) ** 3
    square = cubes / (3 * v[1]) if v[1] else v[0] ** 2 * (b - a)
    nodal = v[0] + v[1] * mesh.points[:, 0]
    scalar = fem_oracle.assemble(mesh, element.laplace(mesh) + element.mass(mesh) / length**2, 1)
    assert nodal @ scalar @ nodal == square / length**2 + v[1] ** 2 * (b - a)


# --- laws -------------------------------------------------------------------------------------------------------------


def moved(mesh, Q, shift=0, reverse=False):
    cells = mesh.cells[:, ::-1] if reverse else mesh.cells
    return Mesh(points=mesh.points @ Q.T + shift, cells=cells, sides=mesh.sides)


@fewer(3, at_night=1)
@given(meshes(), materials(binary=True), powers_of_two(), powers_of_two(), powers_of_two())
def test_stretching_the_unit_of_length_by_s_multiplies_both_matrices_by_s_to_the_d_minus_2(mesh, material, s, c, L):
    mesh, d = in_floats(mesh), mesh.dimension
    stretched = Mesh(points=mesh.points * float(s), cells=mesh.cells, sides=mesh.sides)
    factor = float(s) ** (d - 2)
    laws = (
        floats_of(material),
        Material(lame_lambda=float(material.lame_lambda * c), lame_mu=float(material.lame_mu * c)),
    )
    A, scaled = stiffness(mesh, laws[0]).toarray(), stiffness(stretched, laws[1]).toarray()
    assert np.array_equal(scaled, factor * float(c) * A)
    H, scaled = gram(mesh, float(L)).toarray(), gram(stretched, float(L * s)).toarray()
    assert np.array_equal(scaled, factor * H)


@fewer(6, at_night=2)
@given(plane_meshes(exact=True), materials(binary=True), st.randoms(use_true_random=False))
def test_renumbering_nodes_permutes_both_matrices(mesh, material, random):
    order = np.array(random.sample(range(len(mesh.points)), len(mesh.points)))
    again, law = renumbered(in_floats(mesh), order), floats_of(material)
    unknowns = (2 * order[:, None] + np.arange(2)).ravel()
    A = stiffness(in_floats(mesh), law).toarray()
    assert np.array_equal(stiffness(again, law).toarray(), A[np.ix_(unknowns, unknowns)])
    H = fem_oracle.gram(mesh)[np.ix_(unknowns, unknowns)]
    assert fem_oracle.is_rounded(gram(again), H, roundings=8)


@fewer(3, at_night=1)
@given(meshes(), st.randoms(use_true_random=False))
def test_the_order_of_the_cells_does_not_matter(mesh, random):
    cells = mesh.cells[random.sample(range(len(mesh.cells)), len(mesh.cells))]
    again = Mesh(points=mesh.points.astype(float), cells=cells, sides=mesh.sides)
    assert fem_oracle.is_rounded(gram(again), fem_oracle.gram(mesh), roundings=8)


TURNS = [np.array(q, dtype=object) / Fraction(r) for q, r in [([[3, -4], [4, 3]], 5), ([[5, 12], [-12, 5]], 13)]]


@fewer(6, at_night=2)
@given(plane_meshes(), materials(), st.sampled_from(TURNS), vectors(), st.booleans(), st.randoms(use_true_random=False))
def test_energy_and_norm_do_not_change_when_body_and_displacement_turn_shift_or_reflect(
    mesh, material, Q, shift, mirror, random
):
    Q = Q @ np.array([[-1, 0], [0, 1]], dtype=object) if mirror else Q
    turned = moved(mesh, Q, shift, reverse=mirror)
    u = fem_oracle.exactly(np.array([random.randint(-9, 9) for _ in range(mesh.points.size)])).reshape(-1, 2)
    energy = lambda mesh, u: u.ravel() @ dense(mesh, element.stiffness(mesh, material)) @ u.ravel()
    assert energy(turned, u @ Q.T) == energy(mesh, u)
    scalar = lambda mesh: fem_oracle.assemble(mesh, element.laplace(mesh) + element.mass(mesh), 1)
    assert np.array_equal(scalar(turned), scalar(mesh))


@given(lines(), numbers(Fraction(1, 4), 9))
def test_a_reflected_bar_has_the_same_matrices(mesh, young):
    mirrored = Mesh(points=-mesh.points, cells=mesh.cells[:, ::-1], sides=mesh.sides)
    for matrix in (lambda m: element.stiffness(m, bar(young)), element.laplace, element.mass):
        again = [e[::-1, ::-1] for e in matrix(mirrored).reshape(-1, 2, 2)]
        assert np.array_equal(again, matrix(mesh).reshape(-1, 2, 2))


# --- loads ------------------------------------------------------------------------------------------------------------


def work(load, u):
    return fem_oracle.exactly(load).ravel() @ u


@fewer(3, at_night=1)
@given(plane_meshes(exact=True), vectors(), vectors(), vectors(), vectors())
def test_a_body_force_works_on_a_linear_displacement_as_on_the_centroid(mesh, force, row1, row2, shift):
    G, areas = np.array([row1, row2]), measures(mesh.points, mesh.cells)
    centroid = (areas[:, None] * mesh.points[mesh.cells].sum(axis=1)).sum(axis=0) / (3 * areas.sum())
    load = body_load(in_floats(mesh), force.astype(float))
    assert load.shape == mesh.points.shape
    expected = areas.sum() * force @ (G @ centroid + shift)
    magnitude = areas.sum() * np.abs(force).sum() * (np.abs(linear(mesh, G, shift)).max() + 1)
    assert abs(work(load, linear(mesh, G, shift)) - expected) <= 8 * fem_oracle.EPS * magnitude


@given(lines(denominator=16), numbers(-4, 4), vectors(size=2))
def test_a_body_force_on_a_bar_is_half_a_cell_at_each_of_its_nodes(mesh, force, v):
    load = body_load(in_floats(mesh), [float(force)])
    a, b = mesh.points[0, 0], mesh.points[-1, 0]
    assert work(load, v[0] + v[1] * mesh.points[:, 0]) == force * (b - a) * (v[0] + v[1] * (a + b) / 2)


@given(st.integers(1, 4), st.integers(1, 4), powers_of_two(), vectors())
def test_the_total_of_a_body_force_is_force_times_area(nx, ny, width, force):
    mesh = rectangle((0.0, float(3 * width * nx)), (1.0, 1.0 + ny), (nx, ny))
    assert np.array_equal(body_load(mesh, force.astype(float)).sum(axis=0), (force * 3 * width * nx * ny).astype(float))


def side_load(mesh, facets, traction):
    return facet_weights(mesh, facets)[:, None] * np.asarray(traction)


@fewer(3, at_night=1)
@given(st.integers(1, 4), st.integers(1, 4), powers_of_two(), vectors(), vectors(size=2))
def test_a_traction_on_a_side_works_on_a_linear_displacement_as_at_its_middle(nx, ny, width, force, v):
    mesh = rectangle((Fraction(0), width * nx), (Fraction(0), Fraction(ny)), (nx, ny))
    ends = {"left": (0, ny), "right": (0, ny), "bottom": (0, width * nx), "top": (0, width * nx)}
    for side, (a, b) in ends.items():
        load = side_load(in_floats(mesh), mesh.sides[side], force.astype(float))
        along = mesh.points[:, 1] if side in ("left", "right") else mesh.points[:, 0]
        nodal = (v[0] + v[1] * along)[:, None] * np.ones(2, dtype=int)
        assert work(load, nodal.ravel()) == force.sum() * (b - a) * (v[0] + v[1] * (a + b) / 2)
        away = np.setdiff1d(np.arange(len(mesh.points)), mesh.sides[side])
        assert not load[away].any()


def test_the_length_of_a_slanted_facet_is_pythagorean():
    mesh = Mesh(points=np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]), cells=np.array([[0, 1, 2]]), sides={})
    assert side_load(mesh, np.array([[2, 1]]), [2.0, 0.0]).tolist() == [[0, 0], [5, 0], [5, 0]]


def test_in_one_dimension_a_facet_is_a_point_that_takes_the_whole_force():
    mesh = interval((0.0, 3.0), 3)
    assert side_load(mesh, mesh.sides["right"], [7.0]).tolist() == [[0], [0], [0], [7]]


@given(st.integers(1, 4), numbers(-1, 5), numbers(-1, 5), st.booleans(), vectors(size=2))
def test_the_weights_between_two_positions_integrate_linear_functions_over_what_lies_there(n, one, other, turned, v):
    mesh = rectangle((0.0, 4.0), (0.0, 1.0), (n, 1))
    facets = mesh.sides["top"][:, :: -1 if turned else 1]
    low, high = (min(max(end, Fraction(0)), Fraction(4)) for end in (min(one, other), max(one, other)))
    found = facet_weights(mesh, facets, between=(float(one), float(other))) @ (v[0] + v[1] * mesh.points[:, 0])
    expected = float((high - low) * (v[0] + v[1] * (low + high) / 2))
    assert found == pytest.approx(expected, rel=0, abs=1e-13)


@fewer(3, at_night=1)
@given(plane_meshes())
def test_no_facets_carry_no_load(mesh):
    assert not side_load(in_floats(mesh), np.empty((0, 2), dtype=int), [1.0, 1.0]).any()


@fewer(3, at_night=1)
@given(plane_meshes())
def test_the_weights_of_the_sides_add_up_to_those_of_the_boundary(mesh):
    mesh = in_floats(mesh)
    apart = sum(facet_weights(mesh, facets) for facets in mesh.sides.values())
    together = facet_weights(mesh, mesh.boundary)
    np.testing.assert_allclose(apart, together, rtol=4 * np.finfo(float).eps)
    inside = np.setdiff1d(np.arange(len(mesh.points)), mesh.boundary)
    assert not together[inside].any()

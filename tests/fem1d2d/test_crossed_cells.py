"""Rectangles whose cells are split by both diagonals, and layers of such cells."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem1d2d import Condensation, Mesh, MeshError, plane_strain, rectangle, solver, stiffness, supports
from fem1d2d.layers import FacingLayers, Layer
from fem1d2d.mesh import crossed, measures, rectangle_points


@pytest.mark.parametrize("cells", [(1, 1), (3, 2), (2, 5)])
def test_four_triangles_of_one_area_fill_each_cell_and_sides_are_those_of_the_grid(cells):
    plain, both = (rectangle((0.0, 3.0), (-1.0, 0.5), cells, split) for split in ("alternating", "both"))
    count = cells[0] * cells[1]
    assert (len(both.cells), len(both.points)) == (4 * count, len(plain.points) + count)
    assert measures(both.points, both.cells) == pytest.approx(np.full(4 * count, 4.5 / count / 4))
    assert crossed(both)
    assert {name: side.tolist() for name, side in both.sides.items()} == {
        name: side.tolist() for name, side in plain.sides.items()
    }


def test_nodes_are_exact_for_fractions():
    ends = ((Fraction(0), Fraction(1)), (Fraction(-1, 3), Fraction(2, 7)))
    exact = rectangle_points(*ends, (3, 2), "both")
    assert exact[-1].tolist() == [Fraction(5, 6), Fraction(2, 7) - (Fraction(2, 7) + Fraction(1, 3)) / 4]
    floats = rectangle_points(*(tuple(map(float, pair)) for pair in ends), (3, 2), "both")
    assert floats == pytest.approx(exact.astype(float), abs=1e-15)


@given(st.floats(0.2, 5), st.floats(-0.5, 0.49), st.floats(0.01, 3.1))
def test_a_layer_of_such_cells_is_the_mesh_with_its_middles_eliminated(aspect, nu, phase):
    """A wave on one row of cells, with the matrices of a rectangle of two columns: the same row at both ends."""
    law = plane_strain(1.0, nu)
    row = Layer(material=law, aspect=aspect, diagonals="both").row(np.array([phase]), 1)[0]
    mesh = rectangle((0.0, aspect), (0.0, 1.0), (1, 1), "both")
    corners = [1, 3, 0, 2]  # upper left and right, lower left and right
    unknowns = np.array([2 * node + i for node in corners for i in (0, 1)])
    cell = Condensation(stiffness(mesh, law).tocsc(), unknowns, singular=True).schur
    turn = np.kron(np.eye(2), np.kron([[1.0], [np.exp(1j * phase)]], np.eye(2)))
    assert row == pytest.approx(turn.conj().T @ cell @ turn, abs=1e-12 * np.abs(cell).max())


def test_long_waves_on_a_half_plane_have_the_stiffness_of_the_continuum_and_no_period_is_needed():
    """``2 G xi`` and ``2 G xi / kappa``, with no doubling of columns."""
    layer = Layer(material=plane_strain(2.6, 0.3), aspect=1.0, diagonals="both")
    values = np.linalg.eigvalsh(layer.surface(np.array([0.001]), 1))[0]
    assert values == pytest.approx([2 * 0.001 / 1.8, 2 * 0.001], rel=1e-3)
    assert layer.period == 1
    with pytest.raises(MeshError, match="multiple of 2"):
        FacingLayers(contact=Layer(material=layer.material, aspect=1.0), neumann=layer, columns=(1, 1))


@pytest.mark.parametrize(("nu", "alternating"), [(0.4, 1.599), (0.45, 2.037), (0.49, 2.690)])
def test_near_incompressible_cells_that_both_diagonals_split_add_little_where_one_diagonal_adds_much(nu, alternating):
    """Equal bodies, square cells: rho* of alternating diagonals is that of a table; kappa is 3 - 4 nu."""
    largest = {}
    for split, columns in (("alternating", 2), ("both", 1)):
        layer = Layer(material=plane_strain(1.0, nu), aspect=1.0, diagonals=split)
        facing = FacingLayers(contact=layer, neumann=layer, columns=(columns, columns))
        largest[split] = facing.ratios(np.linspace(0.02, np.pi * columns, 200)[:-1])[0].max()
    assert largest["alternating"] == pytest.approx(alternating, rel=2e-3)
    assert largest["both"] < largest["alternating"]
    assert largest["both"] >= (3 - 4 * nu) * (1 - 1e-3)


def test_cells_far_from_parallelograms_lock_if_their_middle_is_the_mean_of_the_corners():
    """Nodes inside moved by up to a quarter of a cell; the figures of the page on mesh files."""
    flat = rectangle((0.0, 1.0), (0.0, 1.0), (8, 8), "both")
    points, (_, corners) = flat.points.copy(), flat.quadrilaterals
    inside = np.flatnonzero(((points[:81] > 0) & (points[:81] < 1)).all(axis=1))
    points[inside] += (np.random.default_rng(0).random((len(inside), 2)) * 2 - 1) / 32
    a, b, c, d = points[corners].transpose(1, 0, 2)
    twice = lambda u, v: u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    crossing = a + (c - a) * (twice(b - a, d - b) / twice(c - a, d - b))[:, None]

    def work(middles, nu):
        mesh = Mesh(points=np.vstack([points[:81], middles]), cells=flat.cells, sides=flat.sides)
        assert crossed(mesh)
        free = ~supports(mesh, {"bottom": (0, 0)}).held.ravel()
        top = np.unique(mesh.sides["top"])
        load = np.zeros(mesh.points.shape)
        load[top] = np.column_stack([np.ones(9), np.sin(3 * mesh.points[top, 0]) / 2]) / 9
        A, f = stiffness(mesh, plane_strain(2 * (1 + nu), nu))[free][:, free].tocsc(), load.ravel()[free]
        return f @ solver(A)(f)

    lost = [1 - work(points[corners].mean(axis=1), nu) / work(crossing, nu) for nu in (0.4, 0.499, 0.4999)]
    assert lost == pytest.approx([0.0001, 0.032, 0.108], abs=1e-3)


@pytest.mark.parametrize("aspect", [0.0, -1.0, np.nan, np.inf])
def test_cells_without_a_positive_finite_aspect_are_refused(aspect):
    with pytest.raises(MeshError, match=f"aspect {aspect}: a positive number is needed"):
        Layer(material=plane_strain(1.0, 0.3), aspect=aspect)

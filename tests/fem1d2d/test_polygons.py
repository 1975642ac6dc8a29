"""Meshes of polygons, and an element of one's own on them: bilinear quadrilaterals."""

import numpy as np
import pytest

from fem1d2d import (
    Condensation,
    Material,
    Mesh,
    MeshError,
    body_load,
    gram,
    plane_strain,
    rectangle,
    rigid_motions,
    stiffness,
)
from fem1d2d.element import ELEMENTS, Element
from fem1d2d.mesh import measures


class Bilinear(Element):
    """Q1 on quadrilaterals, by the Gauss rule with 2 x 2 points."""

    CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])

    def points(self, mesh):
        return [(size, g) for size, g, _ in self.gauss_points(mesh)]

    def mass(self, mesh):
        return sum(size[:, None, None] * np.outer(values, values) for size, _, values in self.gauss_points(mesh))

    def gauss_points(self, mesh):
        p = mesh.points[mesh.cells].astype(float)
        for s, t in self.CORNERS / np.sqrt(3):
            x, y = self.CORNERS.T
            values = (1 + s * x) * (1 + t * y) / 4
            slopes = np.stack([x * (1 + t * y), y * (1 + s * x)], axis=-1) / 4
            jacobian = np.einsum("cip,iq->cpq", p, slopes)
            yield np.linalg.det(jacobian), slopes @ np.linalg.inv(jacobian), values


@pytest.fixture
def bilinear(monkeypatch):
    monkeypatch.setitem(ELEMENTS, (2, 4), Bilinear())


def quadrilaterals(nx, ny, moved=0.0):
    """The unit square in quadrilaterals, inner nodes moved at random by up to a part of a cell."""
    points = rectangle((0.0, 1.0), (0.0, 1.0), (nx, ny)).points.copy()
    node = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    inner = node[1:-1, 1:-1].ravel()
    points[inner] += moved * np.random.default_rng(0).uniform(-1, 1, (len(inner), 2)) / max(nx, ny)
    cells = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    bottom, top = (np.column_stack([line[:-1], line[1:]]) for line in (node[:, 0], node[:, -1]))
    return Mesh(points=points, cells=cells, sides={"bottom": bottom, "top": top})


def test_the_areas_of_quadrilaterals_and_of_a_pentagon_are_those_of_the_shoelace_formula():
    mesh = quadrilaterals(3, 4, moved=0.3)
    assert measures(mesh.points, mesh.cells).sum() == pytest.approx(1, rel=1e-14)
    angles = 2 * np.pi * np.arange(5) / 5
    pentagon = Mesh(points=np.column_stack([np.cos(angles), np.sin(angles)]), cells=np.array([range(5)]), sides={})
    assert measures(pentagon.points, pentagon.cells) == pytest.approx(5 / 2 * np.sin(2 * np.pi / 5))
    assert len(pentagon.boundary) == 5


def test_the_boundary_of_quadrilaterals_keeps_the_body_on_its_left():
    mesh = quadrilaterals(2, 3)
    assert len(mesh.boundary) == 10
    p = mesh.points[mesh.boundary]
    assert (p[:, 0, 0] * p[:, 1, 1] - p[:, 1, 0] * p[:, 0, 1]).sum() / 2 == pytest.approx(1)  # Green's formula


@pytest.mark.parametrize(
    ("points", "why"),
    [([(0, 0), (2, 0), (0.5, 0.5), (0, 2)], "not convex"), ([(0, 0), (0, 1), (1, 1), (1, 0)], "no positive area")],
)
def test_a_polygon_that_is_not_convex_or_turns_clockwise_is_refused(points, why):
    with pytest.raises(MeshError, match=f"cell 0 .*{why}"):
        Mesh(points=np.array(points, dtype=float), cells=np.array([[0, 1, 2, 3]]), sides={})


def test_cells_without_an_element_are_refused_by_their_number_of_nodes():
    for matrix in (lambda mesh: stiffness(mesh, plane_strain(1.0, 0.3)), gram):
        with pytest.raises(MeshError, match="cells of 4 nodes: there are elements of 3"):
            matrix(quadrilaterals(1, 1))


def test_quadrilaterals_share_edges_so_that_a_mesh_of_them_moves_as_one_piece():
    mesh = quadrilaterals(2, 2)
    assert rigid_motions(mesh, np.zeros(mesh.points.shape, dtype=bool)).shape == (9, 2, 3)


@pytest.mark.parametrize("moved", [0.0, 0.3])
def test_bilinear_quadrilaterals_pass_the_patch_test(bilinear, moved):
    """An affine displacement has the energy of its strain, is in equilibrium inside, and rigid motions have none."""
    mesh, material = quadrilaterals(4, 3, moved), Material(lame_lambda=1.5, lame_mu=0.7)
    A = stiffness(mesh, material).toarray()
    gradient = np.array([[0.3, -0.2], [0.5, 0.4]])
    u = (mesh.points @ gradient.T).ravel()
    strain = (gradient + gradient.T) / 2
    energy = 1.5 * np.trace(strain) ** 2 + 2 * 0.7 * (strain**2).sum()
    assert u @ A @ u == pytest.approx(energy, rel=1e-13)
    inner = np.setdiff1d(np.arange(len(mesh.points)), mesh.boundary)
    assert (A @ u).reshape(-1, 2)[inner] == pytest.approx(0, abs=1e-13)
    spin = (mesh.points @ np.array([[0, -1], [1, 0]]).T).ravel()
    assert A @ spin == pytest.approx(0, abs=1e-13)
    assert u @ gram(mesh, 1e9) @ u == pytest.approx((gradient**2).sum(), rel=1e-12)
    assert body_load(mesh, (2.0, -3.0)).sum(axis=0) == pytest.approx([2.0, -3.0])
    assert np.linalg.eigvalsh(A)[:3] == pytest.approx(0, abs=1e-12)
    assert np.linalg.eigvalsh(A)[3] > 1e-3


def test_a_block_of_quadrilaterals_under_even_pressure_has_the_stiffness_of_its_closed_form(bilinear):
    """Pressed evenly between rollers: force (lambda + 2 mu) per unit of strain."""
    mesh, material = quadrilaterals(4, 3, 0.2), plane_strain(2.0, 0.25)
    A = stiffness(mesh, material)
    on_top = np.unique(mesh.sides["top"])
    bottom = np.unique(mesh.sides["bottom"])
    ends = np.flatnonzero((mesh.points[:, 0] == 0) | (mesh.points[:, 0] == 1))
    held = np.union1d(2 * bottom + 1, 2 * ends)
    free = np.setdiff1d(np.arange(A.shape[0]), held)
    top = np.flatnonzero(np.isin(free, 2 * on_top + 1))
    schur = Condensation(A[free][:, free].tocsc(), top).schur
    modulus = material.lame_lambda + 2 * material.lame_mu
    assert schur.sum() == pytest.approx(modulus, rel=1e-13)

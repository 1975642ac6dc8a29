"""Layers on periodic meshes: the criterion node by node, by the waves of their cells, and by all wave numbers."""

from dataclasses import replace

import numpy as np
import pytest
from periodic import SECTION_6, drawn, surface
from strategies import AT_NIGHT

import verification as vf
from fem1d2d import plane_strain
from fem1d2d.layers import FacingLayers, Layer
from verification.free_norm import cells, norm
from verification.free_norm.cells import CellCircles
from verification.free_norm.norm import FreeNorm
from verification.free_norm.search import Search

#: Layers that are drawn.
DRAWS = 200 if AT_NIGHT else 2

#: How far apart two factors may be that are known up to two shares of themselves.
APART = norm.NEAR + cells.NEAR + 1e-3


def by_cells(mesh, friction, *, phases=None):
    return CellCircles(mesh.cells, mesh.radius / mesh.width, friction, phases)


@pytest.mark.parametrize(
    ("columns", "rows", "cell", "poisson"), [(6, 3, (1.0, 1.0), 0.3), (8, 4, (0.5, 0.2), 0.0), (4, 1, (0.3, 1.0), 0.45)]
)
def test_the_stiffness_of_a_periodic_layer_is_that_of_its_cells_at_each_phase(columns, rows, cell, poisson):
    material = plane_strain(2.0, poisson)
    found = surface(material, columns, rows, cell)
    layer = Layer(material=material, aspect=cell[0] / cell[1], rising=rows % 2 == 1, rows=rows)
    waves = columns // 2  # of two columns each
    phases = 2 * np.pi * np.arange(waves) / waves
    by_node = found.reshape(2, columns, 2, columns).transpose(1, 0, 3, 2).reshape(2 * columns, 2 * columns)
    basis = np.kron(np.exp(1j * np.outer(np.arange(waves), phases)) / np.sqrt(waves), np.eye(4))
    expected = np.zeros((waves, 4, waves, 4), dtype=complex)
    expected[np.arange(waves), :, np.arange(waves)] = layer.surface(phases, 2)
    np.testing.assert_allclose(
        basis.conj().T @ by_node @ basis, expected.reshape(2 * columns, -1), atol=1e-12 * np.abs(found).max()
    )


@pytest.mark.parametrize("cells_in_radius", [1, 2, 5, 17])
def test_the_periodic_hat_multiplies_waves_as_the_endless_sum_does(cells_in_radius):
    mesh = replace(SECTION_6, radius=cells_in_radius * SECTION_6.width)
    n, h = mesh.columns, mesh.width
    half = np.pi * np.arange(1, n) / n  # xi h / 2
    smooth = (np.sin(cells_in_radius * half) / (cells_in_radius * np.sin(half))) ** 2
    found = np.fft.fft(mesh.kernel[:, 0])
    np.testing.assert_allclose(h * found, [1.0, *smooth], atol=1e-12)
    np.testing.assert_allclose(mesh.kernel, [np.roll(mesh.kernel[0], i) for i in range(n)])


@pytest.mark.parametrize("seed", range(DRAWS))
def test_multipliers_node_by_node_prove_what_those_of_the_cells_do(seed):
    mesh, k, theta = drawn(seed)
    pair = mesh.pair(k)
    node_by_node = FreeNorm(pair, vf.measure(pair)).factor(theta)
    repeated = by_cells(mesh, k, phases=mesh.phases).factor(theta)
    every_period = by_cells(mesh, k).factor(theta)
    if node_by_node is None or repeated is None:
        found = repeated if node_by_node is None else node_by_node.factor
        assert found is None or found > 1 - APART
        return
    assert node_by_node.factor == pytest.approx(repeated, rel=APART)
    assert every_period is None or repeated <= every_period * (1 + APART)


@pytest.mark.parametrize("seed", range(1000, 1000 + DRAWS))
def test_fine_cells_have_the_factor_of_the_layers_unless_their_shortest_waves_are_stiffer(seed):
    """A piece whose nodes all stick multiplies each wave by 1 - theta (1 + ratio of the stiffnesses)."""
    mesh, k, theta = drawn(seed)
    for fine in (mesh, mesh.swapped):
        least = min(fine.radius, fine.contact.depth, fine.neumann.depth)
        fine = replace(fine, columns=2 * round(20 / least))
        found, expected = by_cells(fine, k).factor(theta), Search(fine.layers).factor(theta, k)
        rho = float(fine.cells.ratios(np.geomspace(1e-3, np.pi, 60))[0].max())
        stuck = theta * (1 + rho) - 1
        assert found is None or stuck <= found * (1 + cells.NEAR)
        if expected is not None and expected < 0.95 and stuck < 0.8 * expected:
            assert found == pytest.approx(expected, rel=1e-2)


@pytest.mark.parametrize(("k", "theta"), [(0.2, 0.7), *[(0.9, 0.6), (1.6, 0.4)] * AT_NIGHT])
def test_the_cells_of_section_6_tend_to_the_factor_of_its_layers_from_below(k, theta):
    """Not so the coarsest, whose width is the radius of the hat."""
    limit = Search(SECTION_6.layers).factor(theta, k)
    found = [by_cells(replace(SECTION_6, columns=n), k).factor(theta) for n in (6, 12, 24, 48)]
    assert found[1] < found[2] < found[3] < limit < found[0]
    gaps = limit - np.array(found[1:])
    assert (gaps[1:] < gaps[:-1] / 2).all()


def test_cells_whose_shortest_waves_are_stiffer_diverge_where_layers_contract():
    """nu = 0.45: linear triangles are far too stiff at short waves, however fine the mesh is."""
    mesh, k, _ = drawn(10)
    theta = 0.67
    assert Search(mesh.layers).factor(theta, k) < 0.73
    for columns in (10, 40):
        fine = replace(mesh, columns=columns)
        assert by_cells(fine, k).factor(theta) is None
        assert theta * (1 + float(fine.cells.ratios(fine.phases[1:])[0].max())) - 1 > 1.3


def test_less_contact_on_the_same_mesh_is_proved_by_no_larger_factor():
    mesh, k, theta = replace(SECTION_6, columns=12), 0.9, 0.6
    whole = by_cells(mesh, k).factor(theta)
    pair = mesh.pair(k)
    chosen = np.array([0, 1, 2, 3, 5, 8, 9])
    both = np.concatenate([chosen, mesh.columns + chosen])
    S1, S2 = (np.linalg.inv(np.linalg.inv(S)[np.ix_(both, both)]) for S in (pair.contact.schur, pair.neumann.schur))
    part = vf.build(
        S1=S1, S2=S2, x=mesh.width * chosen, weights=np.full(len(chosen), mesh.width),
        kernel=mesh.kernel[np.ix_(chosen, chosen)], friction=k,
    )  # fmt: skip
    assert FreeNorm(part, vf.measure(part)).factor(theta).factor <= whole * (1 + APART)


@pytest.mark.parametrize("halvings", [0, *[1, 2] * AT_NIGHT])
def test_bodies_of_section_6_contract_by_nearly_the_factor_of_their_cells(halvings):
    """An observation: nothing is proved of bodies with ends."""
    pair = vf.build(vf.example("section6").refined(halvings))
    found = FreeNorm(pair, vf.measure(pair)).factor(0.7).factor
    mesh = replace(SECTION_6, columns=12 * 2**halvings)
    assert found == pytest.approx(by_cells(mesh, 0.2).factor(0.7), rel=6e-3)


def test_layers_that_are_not_clamped_or_whose_columns_differ_are_refused():
    layer = SECTION_6.cells.contact
    for layers in (
        FacingLayers(contact=layer, neumann=replace(layer, rows=None)),
        FacingLayers(contact=layer, neumann=layer, columns=(2, 4)),
        FacingLayers(contact=layer, neumann=layer, offset=0.5),
    ):
        with pytest.raises(ValueError, match="columns of cells that face each other, and clamped"):
            CellCircles(layers, 2.0, 0.2)

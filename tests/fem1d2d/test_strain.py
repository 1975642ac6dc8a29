"""Principal strains and stresses of cells."""

import numpy as np
import pytest

from fem1d2d import Material, bar, interval, largest_strains, plane_strain, rectangle, stresses, von_mises


@pytest.mark.parametrize("seed", range(5))
def test_an_affine_displacement_has_the_eigenvalues_of_its_symmetric_gradient(seed):
    gradient = np.random.default_rng(seed).normal(size=(2, 2))
    mesh = rectangle((0.0, 2.0), (-1.0, 0.0), (5, 3))
    strains = largest_strains(mesh, mesh.points @ gradient.T + [3, 4])
    assert strains == pytest.approx(np.abs(np.linalg.eigvalsh((gradient + gradient.T) / 2)).max(), rel=1e-12)


def test_a_small_rotation_strains_nothing():
    mesh = rectangle((0.0, 2.0), (-1.0, 0.0), (5, 3))
    assert largest_strains(mesh, mesh.points @ [[0, 1e-3], [-1e-3, 0]]).max() <= 1e-17


def test_the_strain_of_a_bar_is_its_change_of_length_in_each_cell():
    mesh = interval((0.0, 1.0), 4)
    assert largest_strains(mesh, np.array([[0.0], [0.1], [0.1], [0.05], [0.0]])) == pytest.approx([0.4, 0, 0.2, 0.2])


@pytest.mark.parametrize("seed", range(5))
def test_stresses_give_back_the_strains_by_the_compliance(seed):
    """``eps = ((1 + nu) sigma - nu tr(sigma) I) / E`` with E and nu, which Lame's parameters do not enter."""
    rng = np.random.default_rng(seed)
    gradient, young, nu = rng.normal(size=(2, 2)), rng.uniform(1, 9), rng.uniform(-0.5, 0.45)
    mesh = rectangle((0.0, 2.0), (-1.0, 0.0), (5, 3))
    strain = np.zeros((3, 3))
    strain[:2, :2] = (gradient + gradient.T) / 2
    for stress in stresses(mesh, plane_strain(young, nu), mesh.points @ gradient.T + [3, 4]):
        assert ((1 + nu) * stress - nu * np.trace(stress) * np.eye(3)) / young == pytest.approx(strain, abs=1e-11)


def test_each_cell_has_the_stress_of_its_own_material():
    mesh, gradient = rectangle((0.0, 2.0), (-1.0, 0.0), (2, 1)), np.array([[0.1, 0.2], [0.3, -0.4]])
    both, which = (plane_strain(2.0, 0.25), plane_strain(3.0, 0.4)), np.arange(len(mesh.cells)) % 2
    found, *alone = (
        stresses(mesh, material, mesh.points @ gradient.T) for material in (Material.of_cells(both, which), *both)
    )
    assert found == pytest.approx(np.array([alone[one][cell] for cell, one in enumerate(which)]), rel=1e-12)


def test_a_bar_has_the_stress_of_each_cell_and_no_other():
    mesh = interval((0.0, 1.0), 4)
    found = stresses(mesh, bar(10.0), np.array([[0.0], [0.1], [0.1], [0.05], [0.0]]))
    assert found[:, 0, 0] == pytest.approx([4, 0, -2, -2])
    assert np.abs(found).sum() == pytest.approx(8)


def test_von_mises_is_that_of_principal_stresses_and_of_pure_shear():
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    one, two, three = principal = np.array([5.0, -2.0, 1.0])
    shear = np.array([[0, 2.0, 0], [2.0, 0, 0], [0, 0, 0]])
    expected = np.sqrt(((one - two) ** 2 + (two - three) ** 2 + (three - one) ** 2) / 2), 2 * np.sqrt(3)
    assert von_mises(np.array([turn * principal @ turn.T, shear])) == pytest.approx(expected, rel=1e-12)

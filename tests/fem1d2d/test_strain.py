"""Principal strains of cells."""

import numpy as np
import pytest

from fem1d2d import interval, largest_strains, rectangle


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

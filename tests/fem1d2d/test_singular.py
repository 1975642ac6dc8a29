"""Matrices of which no factor exists in doubles, and how condensation treats the ones that are only semidefinite."""

import numpy as np
import pytest
import scipy.sparse as sp

from fem1d2d import Condensation, Lifted, MeshError, solver

SEMIDEFINITE = sp.csc_array(np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]]))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", [Condensation, Lifted])
def test_a_pivot_of_zero_is_an_error_of_the_mesh_and_no_warning(kind):
    with pytest.raises(MeshError, match="singular in doubles"):
        solver(SEMIDEFINITE)
    with pytest.raises(MeshError, match="singular in doubles"):
        kind(SEMIDEFINITE, np.array([2])).times(np.ones(1))

"""Both ends of the spectrum and C_t1 beside other ways to them: which body, which grid, which motions."""

import numpy as np
import pytest
from problem_list import blocks, changed, plates
from scipy.linalg import eigh

import verification as vf
from verification.interface import assembly

UNEQUAL = blocks(cells=((24, 4), (24, 2)), young=(3, 1), poisson=("0.3", "0.1"), heights=(1, "0.5"))
#: Held along x at two heights, so that only lifting is left.
LIFTED = {
    "parts": {"high": {"side": "left", "y": ["0.1", "0.3"]}},
    "prescribed": {"top": [0, "free"], "high": [0, "free"]},
    "body_force": [0, -9000],
}


@pytest.mark.parametrize("neumann", [1, 2])
def test_without_interface_matrices_the_ends_are_those_of_the_same_roles(neumann, monkeypatch):
    problem = vf.Problem.from_dict(changed(UNEQUAL, iteration={"neumann_body": neumann}))
    dense = vf.measure(problem)
    monkeypatch.setattr(assembly, "MOST_CONTACT_NODES", 20)
    solved = vf.measure(problem)
    assert solved.C_t1 is None
    assert dense.rho_min.value < 0.9 * dense.rho_max.value
    for name in ("rho_min", "rho_max", "rho_normal"):
        assert getattr(solved, name).value == pytest.approx(getattr(dense, name).value, rel=1e-9)


@pytest.mark.parametrize("cells", [(5, 9), (9, 5)])
@pytest.mark.parametrize("neumann", [1, 2])
def test_the_least_eigenvalue_is_0_exactly_where_the_contact_grid_is_coarser(cells, neumann):
    problem = blocks(cells=((cells[0], 2), (cells[1], 2)), iteration={"neumann_body": neumann})
    pair = vf.build(vf.Problem.from_dict(problem))
    found = vf.measure(pair).rho_min.value
    P = pair.interface.transfer
    carried = pair.interface.carry_form(pair.contact.schur)
    least = eigh(carried, pair.neumann.schur, eigvals_only=True)[0]
    if P.shape[0] < P.shape[1]:
        assert found == 0
        assert abs(least) < 1e-12
    else:
        assert found == pytest.approx(least, rel=1e-9)
        assert found > 1e-3


@pytest.mark.parametrize("number", [1e-9, 1, 1e9])
def test_motions_that_do_not_slide_do_not_enter_the_tangential_constant(number):
    """C_t1^2 is the largest eigenvalue of B_T S^+, S^+ the pseudo-inverse: the same in every unit of stress."""
    young = [f"{float(E) * number!r}" for E in (70000, 20000)]
    data = plates(body1={"young": young[0]}, body2=LIFTED | {"young": young[1]}, iteration={"neumann_body": 1})
    pair = vf.build(vf.Problem.from_dict(data))
    assert pair.contact.loose
    assert not pair.contact.slides
    free, grid = pair.contact.free, pair.contact.grid
    S = pair.contact.schur[np.ix_(free, free)]
    root = np.sqrt(np.concatenate([grid.weights, 0 * grid.weights])[free])
    expected = np.linalg.eigvalsh(root[:, None] * np.linalg.pinv(S, rcond=1e-12, hermitian=True) * root)[-1]
    assert vf.measure(pair).C_t1.value == pytest.approx(np.sqrt(expected), rel=1e-8)

"""A body of few unknowns is condensed in dense matrices: what is known of it is what sparse ones give."""

import numpy as np
import pytest
from hypothesis import given
from problem_list import blocks
from strategies import fewer

import verification as vf
from ndtheory import Number
from verification.interface import body
from verification.testing.strategies import problems

#: Its upper body may slide, and is pressed down by a traction alone.
LOOSE = blocks(body2={"prescribed": None, "traction": {"top": [0, -3000]}}, iteration={"neumann_body": 1})


def known(problem, few):
    """Matrices, loads and displacements of both bodies, and the constants, where few unknowns are so many.

    Beside each array the size of what is added up to it: loads inside a body may cancel on Gamma_c.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(body, "FEW", few)
        pair = vf.build(problem)
        sides = (pair.contact, pair.neumann)
        assert [side.mesh_body.few for side in sides] == [few > 0] * 2
        arrays = [(side.schur, 0.0) for side in sides]
        arrays += [(side.load, np.abs(side.mesh_body.load).sum()) for side in sides]
        arrays += [(side.mesh_body.displacement(np.arange(1.0, side.grid.size + 1)), 0.0) for side in sides]
        values = vf.measure(pair)
    return arrays, {name: x.value for name, x in vars(values).items() if isinstance(x, Number)}


def agree(problem):
    (dense, constants), (sparse, others) = known(problem, 10**6), known(problem, 0)
    for (one, _), (other, added) in zip(dense, sparse, strict=True):
        assert np.abs(one - other).max() <= 1e-10 * np.abs(other).max() + 64 * np.finfo(float).eps * added
    assert {"m", "M", "rho_max"} <= set(constants)
    assert constants == pytest.approx(others, rel=1e-8)


@fewer(2)
@given(problems())
def test_of_a_problem_with_supports_and_loads_of_any_kind(problem):
    agree(problem)


def test_of_a_body_that_contact_alone_holds():
    agree(vf.Problem.from_dict(LOOSE))

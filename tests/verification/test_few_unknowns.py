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
    """Matrices, loads and displacements of both bodies, and the constants, where few unknowns are so many."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(body, "FEW", few)
        pair = vf.build(problem)
        sides = (pair.contact, pair.neumann)
        assert [side.mesh_body.few for side in sides] == [few > 0] * 2
        arrays = [array for side in sides for array in (side.schur, side.load)]
        arrays += [side.mesh_body.displacement(np.arange(1.0, side.grid.size + 1)) for side in sides]
        values = vf.measure(pair)
    return arrays, {name: x.value for name, x in vars(values).items() if isinstance(x, Number)}


def agree(problem):
    (dense, constants), (sparse, others) = known(problem, 10**6), known(problem, 0)
    for one, other in zip(dense, sparse, strict=True):
        assert np.abs(one - other).max() <= 1e-10 * np.abs(other).max()
    assert {"m", "M", "rho_max"} <= set(constants)
    assert constants == pytest.approx(others, rel=1e-8)


@fewer(2)
@given(problems())
def test_of_a_problem_with_supports_and_loads_of_any_kind(problem):
    agree(problem)


def test_of_a_body_that_contact_alone_holds():
    agree(vf.Problem.from_dict(LOOSE))

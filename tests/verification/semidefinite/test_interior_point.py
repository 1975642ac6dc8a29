"""The interior-point method for the semidefinite bound, held to cvxpy's model of it and to weak duality."""

from dataclasses import replace
from functools import cache
from itertools import count, islice

import numpy as np
import pytest
from chain_problems import case
from scipy.linalg import block_diag
from strategies import AT_NIGHT

import verification as vf
from verification.semidefinite import LMIError, interior_point, model
from verification.semidefinite.interior_point import Optimum, Program, Stop
from verification.semidefinite.multipliers import QuadraticForms

SEEDS = list(islice((seed for seed in count() if case(seed)[0].contact.grid.n <= 4), 10 if AT_NIGHT else 5))


def programs_of(pair, measured, theta, signs=0) -> list[Program]:
    """Those of the factor (with or without signs), the friction number and the largest theta."""
    asked: list[Program] = []

    def solve(program: Program) -> Optimum:
        asked.append(program)
        return interior_point.solve(program)

    forms = QuadraticForms(pair, measured, solver=solve)
    forms.on(replace(forms.everywhere, signs=signs + forms.everywhere.signs), theta)
    forms.friction_number()
    forms.largest_theta()
    return asked


@cache
def first_program(seed: int) -> Program:
    pair, measured, theta, _ = case(seed)
    return programs_of(pair, measured, theta)[0]


def matrix(program: Program, s: float, y: np.ndarray) -> np.ndarray:
    products = program.left.T @ (y[:, None] * program.right)
    whole = program.fixed + s * program.free - (products + products.T) / 2
    return block_diag(*(whole[block, block] for block in program.blocks))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_conic_solver_finds_the_same_value(seed):
    pair, measured, theta, random = case(seed)
    signs = random.choice([-1, 0, 1], size=pair.contact.grid.t).astype(np.int8) if pair.friction else 0
    for program in programs_of(pair, measured, theta, signs):
        if program.stop.enough == -np.inf:
            own, other = interior_point.solve(program), model.solve(program)
            assert own.converged
            assert own.s == pytest.approx(other.s, rel=1e-5, abs=1e-6)


def test_a_first_order_solver_finds_the_same_value_at_13_contact_nodes():
    pair = vf.build(vf.example("section6").changed(cells=((20, 3), (12, 3))))
    *_, program = programs_of(pair, vf.measure(pair), 0.7)[:1]
    other = model.solve(program, solver="SCS", eps=1e-5, max_iters=20_000)
    assert interior_point.solve(program).s == pytest.approx(other.s, rel=1e-4)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_it_ends_with_is_feasible_and_no_multipliers_do_better(seed):
    """For moments X with ``<free, X> = 1`` that the products of no multiplier can exceed, ``s >= -<fixed, X>``."""
    program = first_program(seed)
    found = interior_point.solve(program)
    assert found.converged
    assert found.steps < 30
    np.linalg.cholesky(matrix(program, found.s, found.y))
    assert (found.y > 0).all()
    if len(program.cones):
        tau, a, b = found.y[program.cones].T
        assert (4 * a * b > tau**2).all()
    X = found.moments
    assert np.linalg.eigvalsh(X)[0] > -1e-12
    assert np.vdot(program.free, X) == pytest.approx(1, abs=1e-6)
    assert -np.vdot(program.fixed, X) == pytest.approx(found.s, rel=1e-5, abs=1e-6)
    products = np.einsum("ij,ij->i", program.left @ X, program.right)
    alone = np.setdiff1d(np.arange(len(products)), program.cones)
    assert (products[alone] >= -1e-6 * np.abs(X).max()).all()


@pytest.mark.parametrize("seed", SEEDS[:4])
def test_a_change_of_scale_of_the_rows_changes_nothing_but_the_multipliers(seed):
    program, random = first_program(seed), case(seed)[3]
    scale = np.exp2(random.integers(-20, 20, size=len(program.y)))
    if len(program.cones):
        scale[program.cones[:, 1:]] = scale[program.cones[:, :1]]
    found = interior_point.solve(program)
    other = interior_point.solve(replace(program, left=program.left * scale[:, None], y=program.y / scale))
    assert other.s == pytest.approx(found.s, rel=1e-6)
    assert other.y * scale == pytest.approx(found.y, rel=1e-3, abs=1e-3 * np.abs(found.y).max())


def test_it_ends_at_any_value_below_what_is_enough():
    program = first_program(SEEDS[0])
    least = interior_point.solve(program)
    early = interior_point.solve(replace(program, stop=Stop(enough=(least.s + program.s) / 2)))
    assert early.steps < least.steps
    assert least.s < early.s < (least.s + program.s) / 2
    np.linalg.cholesky(matrix(program, early.s, early.y))


def test_a_start_that_is_not_inside_is_refused():
    program = first_program(SEEDS[0])
    with pytest.raises(LMIError, match="no multipliers to start from"):
        interior_point.solve(replace(program, s=interior_point.solve(program).s - 1e-3, y=program.y))

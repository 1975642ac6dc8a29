"""The bound of rounding in the forms of the semidefinite bound, against exact rational arithmetic."""

import math
from fractions import Fraction

import numpy as np
import pytest
from problem_list import small

import verification as vf
from verification.semidefinite import trace_forms
from verification.semidefinite.trace_forms import TraceForms


def exact(matrix):
    return np.vectorize(Fraction, otypes=[object])(matrix)


def block(parts):
    """A block diagonal matrix of rationals."""
    size = sum(len(part) for part in parts)
    found, at = np.full((size, size), Fraction(0), dtype=object), 0
    for part in parts:
        found[at : at + len(part), at : at + len(part)] = part
        at += len(part)
    return found


def in_rationals(pair, S_1, near, multipliers, step, weight):
    """``2 |g|^2 - 2 <g, p> - weight |a p + b g|^2 - press gap``, behind S_2 / weight where there is a step.

    Without friction and between grids that match every matrix that enters is exact.
    """
    grid, S_2, S_1 = pair.contact.grid, exact(pair.neumann.schur), exact(S_1)
    size, m = len(S_2), len(S_1)
    zero = lambda rows, columns: np.full((rows, columns), Fraction(0), dtype=object)
    pressed, moved = zero(size, m), zero(size, m)
    pressed[grid.normal], moved[grid.normal] = S_1, exact(np.eye(m))
    g, p = np.hstack([S_2, zero(size, m)]), np.hstack([zero(size, size), pressed])
    jump = -np.hstack([exact(np.eye(size)), moved])
    form = zero(size + m, size + m)
    form[:size] -= 2 * p
    form -= p[grid.normal].T @ (exact(multipliers)[:, None] * jump[grid.normal])
    form[:size, :size] += 2 * S_2
    near = [exact(columns) for columns in near]
    if step is not None:
        row = Fraction(step[0]) * p + Fraction(step[1]) * g
        form = np.block([[S_2 / Fraction(weight), row], [row.T, form]])
        near = [near[0] * Fraction(math.sqrt(weight)), *near]
    form = (form + form.T) / 2
    columns = block(near)
    return columns.T @ form @ columns


@pytest.mark.parametrize("young", [("7e4", "2e4"), ("1", "1e7")])
@pytest.mark.parametrize(("step", "weight"), [(None, 1.0), ((1.0, -1.0), 1.0), ((1.0, -1.0), 1 / 7)])
def test_the_exact_form_lies_within_the_bound_of_rounding(monkeypatch, young, weight, step):
    tables = small(contact={"friction": 0}, body1={"cells": [10, 1]}, body2={"cells": [6, 1]})
    pair = vf.build(vf.Problem.from_dict(tables).changed(young=young))
    assert pair.interface.one_grid
    normal = pair.contact.grid.normal
    S_1 = np.linalg.inv(pair.contact.inverse[normal, normal])
    S_1 = (S_1 + S_1.T) / 2
    near = pair.neumann.flexibility(pair.neumann.root), np.linalg.inv(np.linalg.cholesky(S_1)).T
    traces = TraceForms(pair, 0.0, S_1=S_1, carries=normal, near=near)
    seen = []
    monkeypatch.setattr(trace_forms, "positive_definite", lambda enclosed: seen.append(enclosed) or True)
    multipliers = np.random.default_rng(4).uniform(0.1, 3.0, size=pair.contact.grid.n)
    definite = traces.with_multipliers((multipliers,), cross=2.0, step=step)
    assert definite(2.0, weight) if step else definite(2.0)
    [found] = seen
    error = np.abs(exact(found.middle) - in_rationals(pair, S_1, near, multipliers, step, weight))
    assert (error <= exact(found.radius)).all()
    assert error.any()
    assert found.radius.max() <= 1e-9 * np.abs(found.middle).max()  # a bound that says something

"""The bound of rounding in the forms of the semidefinite bound, against exact rational arithmetic."""

import numpy as np
import pytest
from problem_list import small
from rational_forms import exact, form_of, seen_from

import verification as vf
from verification.semidefinite import trace_forms
from verification.semidefinite.trace_forms import TraceForms


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
    form = form_of(S_1, pair.neumann.schur, (multipliers,), 2.0, cross=2.0, step=step, weight=weight)
    error = np.abs(exact(found.middle) - seen_from(near, form, step, weight))
    assert (error <= exact(found.radius)).all()
    assert error.any()
    assert found.radius.max() <= 1e-9 * np.abs(found.middle).max()  # a bound that says something

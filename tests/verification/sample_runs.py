"""The sample problems run to their limits, each once in a process."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
from problem_list import APART, PROBLEMS, changed
from strategies import AT_NIGHT

import verification as vf
from verification.algorithm.runs import Run

#: By day one problem of each kind: laws, kernels, grips, gaps, units, bars, what sticks, slips and opens.
BY_DAY = (
    "section 6", "without friction", "all stick", "sheared until it slips", "local law", "kernel narrower than a cell",
    "initial gap, lifted on one side", "soft unit of stress", "thin layer", "auxetic", "held by a side",
    "contact nodes held tangentially", "half of a symmetric model", "bars with a gap",
)  # fmt: skip
SAMPLES = tuple(PROBLEMS) if AT_NIGHT else BY_DAY

by_name = pytest.mark.parametrize("name", SAMPLES)


def problem(data: Mapping[str, Any], **iteration: Any) -> vf.Problem:
    return vf.Problem.from_dict(changed(data, iteration=iteration))


@cache
def converged(name: str, swapped: bool = False) -> Run:
    """Run a sample problem to 1e-12; with swapped roles at a theta that suits them."""
    given = problem((PROBLEMS | APART)[name], tolerance="1e-12", max_iterations=3000)
    if swapped:
        given = given.swapped()
        rho = vf.measure(given).rho_max
        given = given.with_theta(1.8 / (2 + (40 if rho is None else rho.value)))
    run = vf.run(given, solver="active-set")
    assert run.outcome == "converged"
    return run


def relative(found: Any, expected: Any) -> float:
    """Largest difference over largest value."""
    found, expected = np.asarray(found), np.asarray(expected)
    size = np.abs(expected).max(initial=0.0)
    return float(np.abs(found - expected).max(initial=0.0) / (size or 1.0))

"""The iteration beside the global method: what the tests of both share."""

from __future__ import annotations

import numpy as np

from verification.algorithm.monolithic import Solution
from verification.algorithm.runs import Run


def assert_same(run: Run, solution: Solution) -> None:
    """The fields along Gamma_c and the displacements of a run that has converged are those of the solution."""
    assert run.contact.status == solution.contact.status
    stress, length = solution.contact.pressure.max(), max(np.abs(u).max() for u in solution.displacements)
    for name, scale in (("pressure", stress), ("shear", stress), ("gap", length), ("slip", length)):
        assert np.abs(getattr(run.contact, name) - getattr(solution.contact, name)).max() <= 1e-8 * scale, name
    for ours, theirs in zip(run.displacements, solution.displacements, strict=True):
        assert np.abs(ours - theirs).max() <= 1e-8 * length

"""Step II as a convex program: cvxpy's model, Clarabel's solution."""

from __future__ import annotations

import warnings

import cvxpy as cp
import numpy as np
from scipy.linalg import cholesky

from fem1d2d.mesh import Bools, Floats

#: Clarabel's defaults leave errors of 1e-4 in the energy; asking for more than this may end "almost solved" far off.
TOLERANCE = 1e-10

#: Seconds that one program may take, as Clarabel answers no Ctrl-C: some ten times what the largest one needs.
SECONDS = 60.0


class ContactModel:
    """The program, compiled once; only q and the bound change from step to step (DPP).

    Everything is scaled by the stiffness so that the solver sees numbers near one in any unit.

    ``S`` has the shape (t + n, t + n), and ``tangential`` is t.  Components that are not ``free`` are not variables:
    their v is a datum.  ``motions`` is the number of rigid motions that only contact holds, the dimension of the kernel
    of S.
    """

    def __init__(self, S: Floats, free: Bools, tangential: int, motions: int = 0) -> None:
        rows = np.flatnonzero(free)
        self._rows = rows
        self._stiffness = float(np.diag(S).max())
        block = S[np.ix_(rows, rows)] / self._stiffness
        if motions:
            values, vectors = np.linalg.eigh(block)
            factor = np.sqrt(np.maximum(values[motions:], 0.0))[:, None] * vectors[:, motions:].T
        else:
            factor = cholesky(block)
        slides, presses = np.flatnonzero(rows < tangential), np.flatnonzero(rows >= tangential)
        self._v = cp.Variable(len(rows))
        self._q = cp.Parameter(len(rows))
        self._slides = rows[slides]
        energy = 0.5 * cp.sum_squares(factor @ self._v) - self._q @ self._v
        if len(slides):
            self._bound = cp.Parameter(len(slides), nonneg=True)
            energy += self._bound @ cp.abs(self._v[slides])
        self._problem = cp.Problem(cp.Minimize(energy), [self._v[presses] <= 0])

    def solve(self, q: Floats, bound: Floats) -> Floats | None:
        """Return an approximate v on all components, 0 where held, shape (t + n,); None without an answer in time."""
        forces = float(np.abs(q[self._rows]).max(initial=0.0))
        v = np.zeros_like(q)
        if forces == 0.0:
            return v
        self._q.value = q[self._rows] / forces
        if len(self._slides):
            self._bound.value = bound[self._slides] / forces
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # "may be inaccurate": the KKT certificate decides
            try:
                self._problem.solve(
                    solver=cp.CLARABEL,
                    tol_gap_abs=TOLERANCE,
                    tol_gap_rel=TOLERANCE,
                    tol_feas=TOLERANCE,
                    max_iter=200,
                    time_limit=SECONDS,
                )
            except cp.SolverError:
                return None
        if self._v.value is None or self._problem.solver_stats.solve_time > SECONDS:
            return None
        v[self._rows] = self._v.value * (forces / self._stiffness)
        return v

"""cvxpy's model of the semidefinite bound: the program as the theorem states it, for a conic solver to answer."""

from __future__ import annotations

import warnings
from typing import Any

import cvxpy as cp
import numpy as np

from verification.machine.threads import one_thread
from verification.semidefinite import LMIError
from verification.semidefinite.interior_point import Optimum, Program


def solve(program: Program, *, solver: str = cp.CLARABEL, **options: Any) -> Optimum:
    """The answer of a conic solver of cvxpy, by its name there; its work grows with the sixth power of the rows.

    LMIError where the solver gave up.
    """
    s, size = cp.Variable(), np.linalg.norm(program.left, axis=1) * np.linalg.norm(program.right, axis=1)
    size = size if program.tie is None else size @ program.tie
    size = np.where(size > 0, size, 1.0)  # the solver sees numbers near one in any unit
    y = cp.Variable(len(size), nonneg=True)
    products = program.left[:, :, None] * program.right[:, None, :]
    products = (products + products.transpose(0, 2, 1)).reshape(len(products), -1).T
    products = (products if program.tie is None else products @ program.tie) / (2 * size)
    rows = len(program.fixed)
    flat: Any = program.fixed.ravel() + s * program.free.ravel() - products @ y
    whole = cp.reshape(flat, (rows, rows), order="C")
    definite = [whole[block, block] >> 0 for block in program.blocks]
    limited = np.flatnonzero(np.isfinite(program.most))
    constraints = [*definite, y[limited] <= (program.most * size)[limited]]
    for tau, a, b in program.cones:
        ratio = np.sqrt(size[a] * size[b]) / size[tau]
        constraints.append(cp.SOC(y[a] + y[b], cp.hstack([ratio * y[tau], y[a] - y[b]])))
    if program.highest is None:
        problem = cp.Problem(cp.Minimize(s), constraints)
    else:
        problem = cp.Problem(cp.Maximize(s), [*constraints, s <= program.highest])
    with warnings.catch_warnings(), one_thread():
        warnings.simplefilter("ignore")  # "may be inaccurate": the check of the form decides
        try:
            problem.solve(solver=solver, **options)
        except cp.SolverError:
            raise LMIError(f"{solver} failed") from None
    if s.value is None:
        raise LMIError(f"{solver} ended {problem.status}")
    moments = np.zeros_like(program.fixed)
    for block, constraint in zip(program.blocks, definite, strict=True):
        moments[block, block] = constraint.dual_value
    return Optimum(
        s=float(s.value),
        y=np.maximum(np.asarray(y.value), 0.0) / size,
        moments=moments,
        steps=int(problem.solver_stats.num_iters or 0),
        converged=problem.status == cp.OPTIMAL,
    )

"""The program behind the semidefinite bound: cvxpy's model, the multipliers that a solver proposes."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import cvxpy as cp
import numpy as np
import scs
from cvxpy.reductions.solvers.conic_solvers.scs_conif import dims_to_solver_dict

from fem1d2d.mesh import Floats
from verification.interrupts import undisturbed
from verification.threads import one_thread

#: Rows of the form up to which Clarabel is as fast as SCS, which takes over where Clarabel fails; its work grows with
#: the sixth power of them.
SMALL = 40

#: Accuracy asked of SCS; the certificate decides what is reported.
TOLERANCE = 1e-4

Weights = tuple[Floats, ...]


class LMIError(RuntimeError):
    """The solver proposed no multipliers that certify anything."""


class Program:
    """``fixed + s free - conditions`` positive semidefinite, in s and the multipliers, as cvxpy sees it.

    Parameters
    ----------
    families : sequence of pairs of arrays
        The rows a_j, b_j of the products ``(a_j x) (b_j x)`` that each family of multipliers weighs, node by node.
    nodewise : bool
        A multiplier of its own for every node, or one for all.
    """

    def __init__(self, families: Sequence[tuple[Floats, Floats]], *, nodewise: bool) -> None:
        self._families = families
        lengths = [np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1) for a, b in families]
        if not nodewise:
            lengths = [np.full_like(scale, scale.mean()) for scale in lengths]
        # The solver sees numbers near one in any unit.  A node that no force reaches has the product 0 and no scale.
        self._scales = [np.where(scale > 0, scale, scale.mean() or 1.0) for scale in lengths]
        self._nodewise = nodewise
        self._variables = [cp.Variable(len(s) if nodewise else 1, nonneg=True) for s in lengths]

    def solve(self, fixed: Floats, free: Floats, *, maximise: bool = False) -> tuple[float, tuple[Floats, ...]]:
        """The least s (or the largest, at most 1), and multipliers with ``4 a b >= tau^2``.

        Raises
        ------
        LMIError
        """
        s = cp.Variable()
        total: Any = fixed.ravel() + s * free.ravel()
        for variable, scale, (a, b) in zip(self._variables, self._scales, self._families, strict=True):
            forms = a[:, :, None] * b[:, None, :]
            forms = (forms + forms.transpose(0, 2, 1)).reshape(len(scale), -1).T / (2 * scale)
            total = total - (forms if self._nodewise else forms.sum(axis=1, keepdims=True)) @ variable
        size = len(fixed)
        constraints = [cp.reshape(total, (size, size), order="C") >> 0]
        if len(self._variables) > 1:
            tau, a, b = self._variables[1:]
            ratio = np.sqrt(self._scales[2] * self._scales[3]) / self._scales[1]
            for j in range(tau.size):
                constraints.append(cp.SOC(a[j] + b[j], cp.hstack([ratio[j] * tau[j], a[j] - b[j]])))
        problem = (
            cp.Problem(cp.Maximize(s), [*constraints, s <= 1]) if maximise else cp.Problem(cp.Minimize(s), constraints)
        )
        first_order: dict[str, Any] = {"solver": cp.SCS, "eps": TOLERANCE, "max_iters": 20_000}
        second = first_order | {"max_iters": 1000}  # it converges in some 150 where a solution exists
        solvers = [{"solver": cp.CLARABEL}, second] if size <= SMALL else [first_order]
        why = []
        with warnings.catch_warnings(), one_thread():
            warnings.simplefilter("ignore")  # "may be inaccurate": the check of the form decides
            for options in solvers:
                try:
                    _solve(problem, **options)
                except cp.SolverError:
                    why.append(f"{options['solver']} failed")
                    continue
                if s.value is not None:
                    break
                why.append(f"{options['solver']} ended {problem.status}")
            else:
                raise LMIError(f"the solver gave up: {', '.join(why)}")
        values = [np.maximum(np.asarray(v.value), 0.0) / z for v, z in zip(self._variables, self._scales, strict=True)]
        return float(s.value), tuple(values)


def _solve(problem: cp.Problem, *, solver: str, **options: Any) -> None:
    """``problem.solve``, from which Ctrl-C returns: cvxpy takes an SCS that was interrupted for one that failed."""
    data, chain, inverse = problem.get_problem_data(solver, solver_opts=options)
    found = _by_scs(data, **options) if solver == cp.SCS else chain.solve_via_data(problem, data, solver_opts=options)
    problem.unpack_results(found, chain, inverse)


def _by_scs(data: Mapping[str, Any], *, eps: float, max_iters: int) -> Mapping[str, Any]:
    """Solve cvxpy's data for SCS.

    SCS puts a handler of its own in the place of Python's.  While it factorises that one drops Ctrl-C, which has to
    wait then; while it iterates it ends with a status, and with a word on stdout.

    Raises
    ------
    KeyboardInterrupt
    """
    matrices = {name: data[name] for name in ("P", "A", "b", "c") if name in data}
    with undisturbed():
        program = scs.SCS(
            matrices, dims_to_solver_dict(data["dims"]), verbose=False, eps_abs=eps, eps_rel=eps, max_iters=max_iters
        )
    with contextlib.redirect_stdout(io.StringIO()):
        found: Mapping[str, Any] = program.solve()
    if found["info"]["status_val"] == scs.SIGINT:
        raise KeyboardInterrupt
    return found

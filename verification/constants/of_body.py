"""m and M of one body (4.1): extremal eigenvalues of its stiffness matrix against the norm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fem1d2d import Eigenvalue, elimination_order, largest, largest_sparse, solver
from ndtheory import Number
from verification.interface.body import Body


@dataclass(frozen=True, kw_only=True)
class BodyConstants:
    """Coercivity m^a and continuity M^a of one body (4.1), unit stress, with the residuals of the eigenvalues.

    m^a is 0, exactly, where the body can move rigidly.

    ``residual_m``, ``residual_M`` are relative; the error of the eigenvalue is of the order of their square.
    """

    m: Number
    M: Number
    nodes: int
    residual_m: float
    residual_M: float

    def to_dict(self) -> dict[str, Any]:
        """The objects ``body1``, ``body2`` of the document."""
        return {"m": self.m.to_dict(), "M": self.M.to_dict(), "nodes": self.nodes}


def constants_of(body: Body, *, dense: bool = True) -> BodyConstants:
    """Measure m and M of a body.

    Parameters
    ----------
    body : Body
    dense : bool
        Whether the Schur complement of the norm is wanted too, which one factorisation gives with the solves; False
        where there are too many contact nodes for it.
    """
    A, H, loose = body.stiffness, body.gram_matrix, body.motions.shape[1] > 0
    if body.few:
        A, H = A.toarray(), H.toarray()
        return _of(body, None if loose else largest(H, A), largest(A, H))
    # the interface need not come last here, which saves fill, and with it time at each solve of Lanczos
    order = elimination_order(A, np.arange(0)) if dense else None
    solve_H = body.gram.solver() if dense else solver(H)
    # 1/m, so that products with A^-1 find it
    smallest = None if loose else largest_sparse(H, A, solver(A, order) if dense else body.solve)
    above = body.material.continuity(body.mesh.dimension)
    return _of(body, smallest, largest_sparse(A, H, solve_H, above=above, order=order))


def _of(body: Body, smallest: Eigenvalue | None, biggest: Eigenvalue) -> BodyConstants:
    """From the eigenvalues 1/m, None where m is 0, and M."""
    return BodyConstants(
        m=Number(value=0.0, lo=0.0, hi=0.0, level="exact") if smallest is None else Number.of_float(1 / smallest.value),
        M=Number.of_float(biggest.value),
        nodes=len(body.mesh.points),
        residual_m=0.0 if smallest is None else smallest.residual / smallest.value,
        residual_M=biggest.residual / biggest.value,
    )

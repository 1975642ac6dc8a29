"""The other side of the benchmark: step II as one would write it in an afternoon.

It shares with the project only the assembled matrices; every step builds the program of the contact body anew in cvxpy
from the sparse stiffness matrix.
"""

from __future__ import annotations

import cvxpy as cp
import numpy as np

from verification.interface.pair import ContactPair


def contact_step(pair: ContactPair, u: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Nodal forces on the other body for its displacement u and a friction bound; the contact body is body 1."""
    body = pair.contact.body
    unknowns = body.elastic.matrix.shape[0]
    w = cp.Variable(unknowns)
    phi = w[body.elastic.interface]
    n = pair.contact.grid.n
    energy = 0.5 * cp.quad_form(w, cp.psd_wrap(body.elastic.matrix)) - body.load @ w
    friction = bound @ cp.abs(phi[:n] - u[:n])
    problem = cp.Problem(cp.Minimize(energy + friction), [phi[n:] <= u[n:] + pair.interface.gap])
    problem.solve(solver=cp.CLARABEL)
    trace = w.value[body.elastic.interface]
    return pair.contact.load - pair.contact.schur @ trace

"""Whether step II has a minimiser where contact alone holds the contact body.

The energy is convex and quadratic, with friction piecewise linear, on a polyhedron.  So it has a minimiser if and only
if it does not fall for ever, and that only rigid motions can bring about: with the loads l, the friction bounds beta
and every rigid motion z that does not penetrate (z_N <= 0), a minimiser exists if and only if

    l' z <= sum_j beta_j |z_T,j| .
"""

from __future__ import annotations

import numpy as np

from fem1d2d.mesh import Floats
from verification.contact.kkt import TOLERANCE


def way_out(motions: Floats, q: Floats, bound: Floats) -> str:
    """How the loads move a body that contact alone holds; empty where contact and friction can hold it.

    Parameters
    ----------
    motions : array, shape (t + n, k)
        Orthonormal traces of the rigid motions; normal components along n.
    q : array, shape (t + n,)
        The loads, but for forces that do no work in them.
    bound : array, shape (t,)
        Friction bounds.
    """
    if not motions.shape[1]:
        return ""
    if _work(motions, q, bound, sliding=True):
        return f"along Gamma_c, where friction holds {float(bound.sum()):.3g} at most"
    return "off" if _work(motions, q, bound, sliding=False) else ""


def _work(motions: Floats, q: Floats, bound: Floats, *, sliding: bool) -> bool:
    """Whether the loads do more work in some motion than friction takes; in motions along Gamma_c alone if asked."""
    from scipy.optimize import linprog  # it takes long to come, and is hardly ever needed

    t, k = len(bound), motions.shape[1]
    size = max(float(np.abs(q).max()), float(bound.max(initial=0.0)))
    if size == 0.0:
        return False
    slip, normal, one = motions[:t], motions[t:], np.eye(t)
    moves = np.hstack([normal, np.zeros((len(normal), t))])
    rubs = np.block([[slip, -one], [-slip, -one]])
    kept = {"A_ub": rubs, "b_ub": np.zeros(len(rubs)), "A_eq": moves, "b_eq": np.zeros(len(moves))}
    if not sliding:
        kept = {"A_ub": np.vstack([rubs, moves]), "b_ub": np.zeros(len(rubs) + len(moves))}
    found = linprog(
        np.concatenate([-(motions.T @ q), bound]) / size, bounds=[(-1, 1)] * k + [(0, None)] * t, method="highs", **kept
    )
    return bool(found.status == 0 and found.fun < -TOLERANCE)

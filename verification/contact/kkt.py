"""The KKT conditions of step II, checked one by one."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats

#: A solution of step II is accepted below this relative residual.
TOLERANCE = 1e-11


@dataclass(frozen=True, kw_only=True)
class KKT:
    """Largest relative violation of each condition.

    Forces are relative to the largest force, lengths to that force over the stiffness.

    Attributes
    ----------
    equilibrium : float
        ``S v + force = q``.
    non_penetration, compression, complementarity : float
        ``v_N <= 0``, ``force_N >= 0``, ``force_N v_N = 0`` (2.4).
    bound, slip : float
        ``|force_T| <= bound`` and ``force_T v_T = bound |v_T|`` (2.6).
    """

    equilibrium: float
    non_penetration: float
    compression: float
    complementarity: float
    bound: float
    slip: float

    @property
    def residual(self) -> float:
        """The largest of them."""
        return float(max(getattr(self, field.name) for field in fields(self)))


def certify(
    S: Floats, q: Floats, bound: Floats, v: Floats, force: Floats, free: NDArray[np.bool_] | None = None
) -> KKT:
    """Measure how far (v, force) is from solving step II.

    A complementarity pair is measured by the smaller of its two relative terms, the distance to the nearer branch.

    Parameters
    ----------
    S : array, shape (t + n, t + n)
        Stiffness; t tangential components (0 in 1D) and then n normal ones.
    q, v, force : array, shape (t + n,)
    bound : array, shape (t,)
        Friction bound on nodal forces, >= 0.
    free : bool array, shape (t + n,), optional
        Components that are unknown; equilibrium is asked of them alone.
    """
    t = len(bound)
    elastic = S @ v
    forces = max(
        float(np.abs(q).max(initial=0.0)), float(np.abs(elastic).max(initial=0.0)), float(bound.max(initial=0.0))
    )
    if forces == 0.0:
        forces = 1.0
    lengths = forces / float(np.diag(S).max())
    v_T, v_N, f_T, f_N = v[:t] / lengths, v[t:] / lengths, force[:t] / forces, force[t:] / forces
    limit = bound / forces
    off = np.abs(elastic + force - q) / forces
    worst = lambda values: float(np.max(values, initial=0.0))
    return KKT(
        equilibrium=worst(off if free is None else off[free]),
        non_penetration=worst(v_N),
        compression=worst(-f_N),
        complementarity=worst(np.minimum(np.abs(v_N), np.abs(f_N))),
        bound=worst(np.abs(f_T) - limit),
        slip=worst(np.minimum(np.abs(v_T), np.abs(f_T - limit * np.sign(v_T)))),
    )

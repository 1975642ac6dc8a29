"""The KKT conditions of step II, checked one by one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem1d2d.mesh import Bools, Floats
from verification.dense import times, worst

#: A solution of step II is accepted below this relative residual.
TOLERANCE = 1e-11


@dataclass(frozen=True, kw_only=True)
class KKT:
    """Largest relative violation of each condition.

    Forces are relative to the largest force, lengths to that force over the stiffness.

    ``equilibrium`` is ``S v + force = q``; ``non_penetration``, ``compression`` and ``complementarity`` are ``v_N <=
    0``, ``force_N >= 0``, ``force_N v_N = 0`` (2.4); ``bound`` and ``slip`` are ``|force_T| <= bound`` and ``force_T
    v_T = bound |v_T|`` (2.6).
    """

    equilibrium: float
    non_penetration: float
    compression: float
    complementarity: float
    bound: float
    slip: float

    @property
    def residual(self) -> float:
        """The largest of them; NaN where one is NaN."""
        lengths = self.non_penetration, self.complementarity, self.slip
        return worst(np.array([self.equilibrium, self.compression, self.bound, *lengths]))


class KKTCertificate:
    """The KKT conditions of step II for one contact body.

    A complementarity pair is measured by the smaller of its two relative terms, the distance to the nearer branch.

    ``S``, shape (t + n, t + n), is symmetric, t tangential components (0 in 1D) and then n normal ones; equilibrium is
    checked only on the ``free`` components.
    """

    def __init__(self, S: Floats, free: Bools | None = None) -> None:
        self._S, self._stiffness = S, float(np.diag(S).max())
        self._held = None if free is None or free.all() else ~free

    def measure(self, q: Floats, bound: Floats, v: Floats, force: Floats) -> KKT:
        """Measure how far (v, force) is from solving step II.

        Parameters
        ----------
        q, v, force : array, shape (t + n,)
        bound : array, shape (t,)
            Friction bound on nodal forces, >= 0.
        """
        t = len(bound)
        elastic = times(self._S, v)
        off = np.abs(elastic + force - q)
        if self._held is not None:
            off[self._held] = 0.0
        stretch, size = self._stiffness * v, np.abs(force)  # both are forces
        length = np.abs(stretch)
        forces = max(worst(np.abs(q)), worst(np.abs(elastic)), worst(bound)) or 1.0
        return KKT(
            equilibrium=worst(off) / forces,
            non_penetration=worst(stretch[t:]) / forces,
            compression=worst(-force[t:]) / forces,
            complementarity=worst(np.minimum(length[t:], size[t:])) / forces,
            bound=worst(size[:t] - bound) / forces,
            slip=worst(np.minimum(length[:t], np.abs(force[:t] - bound * np.sign(v[:t])))) / forces,
        )

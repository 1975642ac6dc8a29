"""Factor once, then everything on the interface: Schur complement, lift, condensed loads."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fem1d2d.mesh import Floats, Ints

#: Right-hand sides solved at once; more of them leave the cache.
BLOCK = 16


class Condensation:
    """A symmetric positive definite matrix seen from some of its unknowns, the interface B; I is the rest.

    ``lift = -A_II^-1 A_IB`` extends interface values with least energy, ``schur = A_BB + A_BI lift`` is that energy:
    ``phi' schur phi = min { v' A v : v_B = phi }``.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)
    interface : int array, shape (b,)
        Positions of B, in the order wanted on the interface.
    """

    def __init__(self, matrix: sp.csc_array, interface: Ints) -> None:
        self.matrix = matrix
        self.interface = interface
        inside = np.ones(matrix.shape[0], dtype=bool)
        inside[interface] = False
        self.inside: Ints = np.flatnonzero(inside)
        self._columns = matrix[:, interface]
        self._solve_inside = solver(matrix[self.inside][:, self.inside])

    @cached_property
    def lift(self) -> Floats:
        """``-A_II^-1 A_IB``, shape (n - b, b): dense, and large where the body is."""
        lift: Floats = -self._solve_inside(self._columns[self.inside].toarray())
        lift.setflags(write=False)
        return lift

    @cached_property
    def schur(self) -> Floats:
        """``A_BB + A_BI lift``, shape (b, b), a few columns at a time where the lift itself was not asked for."""
        schur: Floats = self._columns[self.interface].toarray()
        coupling = self._columns[self.inside]
        if "lift" in self.__dict__:
            schur += coupling.T @ self.lift
        else:
            for i in range(0, schur.shape[1], BLOCK):
                schur[:, i : i + BLOCK] -= coupling.T @ self._solve_inside(coupling[:, i : i + BLOCK].toarray())
        schur = (schur + schur.T) / 2
        schur.setflags(write=False)
        return schur

    def condense(self, load: Floats) -> Floats:
        """The load as the interface feels it: ``load_B + lift' load_I``, shape (b,)."""
        return np.asarray(load[self.interface] + self.lift.T @ load[self.inside])

    def extend(self, trace: Floats, load: Floats | None = None) -> Floats:
        """Values on all unknowns with the given interface values, in equilibrium with ``load`` inside, shape (n,)."""
        full = np.empty(self.matrix.shape[0])
        full[self.interface] = trace
        full[self.inside] = self.lift @ trace
        if load is not None:
            full[self.inside] += self._solve_inside(load[self.inside])
        return full


def solver(matrix: sp.csc_array) -> Callable[[Floats], Floats]:
    """Factorise a symmetric positive definite matrix once.

    Returns
    -------
    callable
        ``b -> matrix^-1 b`` for one column, shape (n,), or several, shape (n, k).
    """
    if matrix.shape[0] == 0:
        return lambda right: right
    options = {"SymmetricMode": True}
    factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)

    def solve(right: Floats) -> Floats:
        if right.ndim == 1:
            return np.asarray(factor.solve(right))
        if right.shape[1] == 0:
            return right
        blocks = range(0, right.shape[1], BLOCK)
        return np.concatenate([factor.solve(right[:, i : i + BLOCK]) for i in blocks], axis=1)

    return solve

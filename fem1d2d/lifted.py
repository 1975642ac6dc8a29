"""Condensation of a body of few unknowns: dense matrices, and everything from the lift."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lu_factor, lu_solve

from fem1d2d.condense import Condensation, symmetric
from fem1d2d.mesh import Floats, Ints

#: Up to so many unknowns dense matrices cost less than sparse ones: a tenth at 100, as much at 270.
FEW = 200


class Lifted(Condensation):
    """A condensation in dense matrices, by the formulas that define it, with the lift R of :class:`Condensation`.

    Parameters
    ----------
    matrix, interface, singular
        As for :class:`Condensation`.

    Examples
    --------
    >>> Lifted(sp.csc_array(np.array([[2.0, -1.0], [-1.0, 2.0]])), np.array([1])).schur
    array([[1.5]])
    """

    def __init__(self, matrix: sp.csc_array, interface: Ints, *, singular: bool = False) -> None:
        super().__init__(matrix, interface, interface[:0], singular=singular)  # nothing here asks for an order
        self._dense: Floats = matrix.toarray()

    def _block(self, rows: Ints, columns: Ints) -> Any:
        return self._dense[np.ix_(rows, columns)]

    @cached_property
    def _solve_inside(self) -> Callable[[Floats], Floats]:
        return _solver(self._block(self.inside, self.inside))

    @cached_property
    def lift(self) -> Floats:
        """``-A_II^-1 A_IB``, shape (n - b, b)."""
        lift = -self._solve_inside(self._coupling)
        lift.setflags(write=False)
        return lift

    @cached_property
    def schur(self) -> Floats:
        """``A_BB + A_BI lift``, shape (b, b)."""
        return symmetric(self._on_interface + self._coupling.T @ self.lift)

    def solver(self) -> Callable[[Floats], Floats]:
        """As :meth:`Condensation.solver`."""
        self._needs_definite()
        return _solver(self._dense)

    def on_lifts(self, form: sp.csc_array) -> Floats:
        """``R' X R``, shape (b, b): a symmetric form X on all unknowns, evaluated at lifted interface values."""
        fields = np.zeros((len(self._dense), len(self.interface)))
        fields[self.interface] = np.eye(len(self.interface))
        fields[self.inside] = self.lift
        return symmetric(fields.T @ (form @ fields))

    def condense(self, load: Floats) -> Floats:
        """As :meth:`Condensation.condense`."""
        return np.asarray(load[self.interface] + self.lift.T @ load[self.inside])


def _solver(matrix: Floats) -> Callable[[Floats], Floats]:
    """``right -> matrix^-1 right``, factorised once."""
    if len(matrix) == 0:
        return lambda right: right
    factor = lu_factor(matrix, check_finite=False)
    return lambda right: np.asarray(lu_solve(factor, right, check_finite=False))

"""The contact nodes of one body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem1d2d import trapezoid
from fem1d2d.mesh import Floats
from verification.value import Value


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Grid(Value):
    """The contact nodes of one body, from left to right, with the trapezoid rule on them.

    An interface vector on it lists all tangential components first, then all normal ones.

    Attributes
    ----------
    x : array, shape (n,)
        Positions along Gamma_c, unit of length; in 1D the one point.
    weights : array, shape (n,)
        w_j of the trapezoid rule, unit of length; 1 in 1D.
    dimension : {1, 2}
    """

    x: Floats
    weights: Floats
    dimension: Literal[1, 2] = 2

    @property
    def summary(self) -> str:
        return f"{self.n} nodes from {self.x[0]:g} to {self.x[-1]:g}" if self.n else "no nodes"

    @classmethod
    def on(cls, x: Floats, dimension: Literal[1, 2] = 2) -> Grid:
        """The grid of these nodes with trapezoid weights."""
        return cls(x=x, weights=trapezoid(x), dimension=dimension)

    def equals(self, other: Grid) -> bool:
        """Whether it is the same grid."""
        return all(map(np.array_equal, (self.x, self.weights), (other.x, other.weights)))

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.x)

    @property
    def t(self) -> int:
        """Number of tangential components: n in two dimensions, 0 in one."""
        return self.n * (self.dimension - 1)

    @property
    def size(self) -> int:
        """Number of components of an interface vector."""
        return self.n * self.dimension

    @property
    def tangential(self) -> slice:
        """Tangential components of an interface vector; empty in 1D."""
        return slice(0, self.t)

    @property
    def normal(self) -> slice:
        """Normal components of an interface vector."""
        return slice(self.t, self.size)

    def turn(self, vectors: Floats) -> Floats:
        """Interface vectors, or columns of them, with the normal components turned round (its own inverse)."""
        turned = vectors.copy()
        turned[self.normal] *= -1.0
        return turned

    def turn_form(self, matrix: Floats) -> Floats:
        """The same for a symmetric matrix on interface vectors."""
        return self.turn(self.turn(matrix).T)

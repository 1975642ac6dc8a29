"""T near a state: the affine piece of a contact pattern, its Jacobian, and how far it reaches.

T is piecewise affine.  While each node keeps what it does (sticks, slips one way, is open) and S sigma_N keeps its
sign, steps I and II are linear systems, and the derivatives of their results by g are matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, null_space

from fem1d2d.mesh import Floats
from verification.contact.active_set import Pattern
from verification.interface.pair import Pair


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """An affine piece of T.

    Attributes
    ----------
    pair : Pair
    pattern : Pattern
        What each contact node does.
    sign : int array, shape (t,)
        Signs of S sigma_N at the nodes; 0 where the friction bound is 0.
    still : bool array, shape (n,)
        Open nodes whose g_N is 0 and stays so; see ``basis``.
    """

    pair: Pair
    pattern: Pattern
    sign: NDArray[np.int8]
    still: NDArray[np.bool_]

    @cached_property
    def bound(self) -> Floats:
        """Derivative of the friction bound ``w_j k |(S sigma_N)_j|`` by g, shape (t, 2 n)."""
        pair = self.pair
        result = np.zeros((len(self.sign), pair.normal.stop))
        friction = float(pair.problem.contact.friction)
        if friction and pair.regularisation is not None:
            result[:, pair.normal] = (friction * pair.weights * self.sign)[:, None] * pair.regularisation
        return result

    @cached_property
    def jump(self) -> Floats:
        """Derivative of v (slip and minus the gap) by g, shape (2 n, 2 n): 0 where a node sticks or touches."""
        contact, t = self.pair.contact, self.pair.tangential.stop
        moves = np.concatenate([self.pattern.sliding != 0, ~self.pattern.touching])
        rows = np.flatnonzero(moves & contact.body.unknown)
        result = np.zeros_like(contact.stiffness)
        if len(rows):
            load = -contact.stiffness @ self.pair.neumann.inverse
            load[:t] -= self.pattern.sliding[:, None] * self.bound
            factor = cho_factor(contact.stiffness[np.ix_(rows, rows)], check_finite=False)
            result[rows] = cho_solve(factor, load[rows], check_finite=False)
        held = np.flatnonzero(~contact.body.unknown)
        result[held] = -self.pair.neumann.inverse[held]
        return result

    @cached_property
    def force(self) -> Floats:
        """The Jacobian T' of T, shape (2 n, 2 n)."""
        t, sliding = self.pair.tangential.stop, self.pattern.sliding
        result = -self.pair.contact.stiffness @ (self.pair.neumann.inverse + self.jump)
        slides = np.flatnonzero(sliding)
        result[slides] = sliding[slides, None] * self.bound[slides]
        result[t:][~self.pattern.touching] = 0.0
        return result

    @cached_property
    def basis(self) -> Floats:
        """Orthonormal forces in the norm (5.21), as columns, that span the changes of g the piece speaks of.

        A node out of reach of any contact force has the friction bound ``w k |S sigma_N| = 0``, which is not smooth.
        But T_theta keeps ``g_N = 0`` at the open nodes around it, and on that subspace T is affine.
        """
        root = self.pair.neumann.root
        if not self.still.any():
            return root
        kept = null_space(root[self.pair.normal][self.still])
        return np.asarray(root @ kept)

    def relaxed(self, theta: float) -> Floats:
        """The Jacobian J of T_theta in the coordinates of ``basis``: there (5.21) is the Euclidean norm."""
        J = self.basis.T @ self.pair.neumann.flexibility(self.force @ self.basis)
        return np.asarray(theta * J + (1 - theta) * np.eye(len(J)))

    def factor(self, theta: float) -> float:
        """``|J|``: the Lipschitz constant of T_theta on this piece in the norm (5.21)."""
        return float(np.linalg.norm(self.relaxed(theta), 2))


def piece_of(pair: Pair, g: Floats, pattern: Pattern) -> Piece:
    """The affine piece around g, whose contact pattern is known."""
    t = pair.tangential.stop
    sign, still = np.zeros(t, dtype=np.int8), np.zeros(pair.n, dtype=bool)
    if t and pair.regularisation is not None and pair.problem.contact.friction:
        sign = np.sign(pair.regularisation @ g[pair.normal]).astype(np.int8)
        if not sign.all():
            still = ~pattern.touching & (g[pair.normal] == 0)
    return Piece(pair=pair, pattern=pattern, sign=sign, still=still)

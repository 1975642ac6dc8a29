"""T near an iterate: the affine piece of a contact pattern, and its Jacobian there.

T is piecewise affine.  While each node keeps its state (sticks, slips one way, is open) and S sigma_N keeps its sign,
steps I and II are linear systems, and the derivatives of their results by g are matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space, schur

from fem1d2d.mesh import Bools, Floats, Ints
from verification.contact.active_set import Pattern, Signs
from verification.dense import STILL, Cholesky, vanishing
from verification.interface.pair import ContactPair
from verification.value import Value, freeze


@dataclass(frozen=True, kw_only=True, eq=False)
class Changes:
    """The conditions that hold on an affine piece.

    First every contact node keeps touching or stays open; then, in this order, slipping nodes keep their direction,
    sticking nodes stay below their bound on either side, and S sigma_N keeps its sign.

    ``speed`` is the largest change of each condition for a change of g of size 1 in the norm (5.21), ``nodes`` its
    contact node; ``slips``, ``sticks`` and ``rubs`` are the contact nodes that slip, that stick, and both, where
    friction can act.
    """

    speed: Floats
    nodes: Ints
    slips: Ints
    sticks: Ints
    rubs: Ints


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Piece(Value):
    """An affine piece of T.

    ``pattern`` has the state of each contact node; ``sign``, shape (t,), the signs of S sigma_N, 0 where the friction
    bound is 0; ``still``, shape (n,), is True at open nodes whose g_N is 0 and stays so, see ``basis``.
    """

    pair: ContactPair
    pattern: Pattern
    sign: Signs
    still: Bools

    @property
    def summary(self) -> str:
        return f"{int(self.pattern.touching.sum())} of {len(self.pattern.touching)} nodes touch"

    @cached_property
    def bound(self) -> Floats:
        """Derivative of the friction bound ``w_j k |(S sigma_N)_j|`` by g, shape (t, 2 n)."""
        pair = self.pair
        contact, neumann, kernel = pair.contact.grid, pair.neumann.grid, pair.interface.kernel
        result = np.zeros((len(self.sign), neumann.size))
        if pair.rubs and kernel is not None:
            result[:, neumann.normal] = (float(pair.friction) * contact.weights * self.sign)[:, None] * kernel
        return freeze(result)

    @cached_property
    def _carried(self) -> Floats:
        """Derivative by g of the trace of the Neumann body, on the contact grid."""
        return self.pair.interface.carry(self.pair.neumann.inverse)

    @cached_property
    def jump(self) -> Floats:
        """Derivative of v (slip and minus the gap) by g, shape (2 n, 2 n): 0 where a node sticks or touches."""
        contact, t, carried = self.pair.contact, self.pair.contact.grid.t, self._carried
        rows = np.flatnonzero(self.pattern.moves & contact.free)
        result = np.zeros(carried.shape)
        if len(rows):
            load = -contact.schur @ carried
            load[:t] -= self.pattern.sliding[:, None] * self.bound
            result[rows] = Cholesky(contact.schur, rows, contact.motions).solve(load)[rows]
        held = np.flatnonzero(~contact.free)
        result[held] = -carried[held]
        return freeze(result)

    @property
    def balanced(self) -> bool:
        """True if friction on this piece does no work in a rigid motion that it leaves free.

        Otherwise T is not affine here: a change of the bound sets the contact body in motion, or stops it.
        """
        free = vanishing(self.pair.contact.motions, np.flatnonzero(~self.pattern.moves))
        work = free[: len(self.sign)].T @ (self.pattern.sliding[:, None] * self.bound) if free.size else free
        return float(np.abs(work).max(initial=0.0)) <= STILL * float(np.abs(self.bound).max(initial=0.0))

    @cached_property
    def reaction(self) -> Floats:
        """Derivative of the nodal forces on the contact grid by g, shape (2 n, 2 n)."""
        t, sliding = self.pair.contact.grid.t, self.pattern.sliding
        result = -self.pair.contact.schur @ (self._carried + self.jump)
        slides = np.flatnonzero(sliding)
        result[slides] = sliding[slides, None] * self.bound[slides]
        result[t:][~self.pattern.touching] = 0.0
        return freeze(result)

    @property
    def force(self) -> Floats:
        """The Jacobian T' of T, shape (2 n, 2 n) on the Neumann grid."""
        return self.pair.interface.carry_back(self.reaction)

    @cached_property
    def basis(self) -> Floats:
        """Orthonormal forces in the norm (5.21), as columns: they span the changes of g on which T is affine.

        A node out of reach of any contact force has the friction bound ``w k |S sigma_N| = 0``, which is not smooth.
        But T_theta keeps ``g_N = 0`` at the open nodes around it, and on that subspace T is affine.
        """
        root = self.pair.neumann.root
        if not self.still.any():
            return root
        kept = null_space(root[self.pair.neumann.grid.normal][self.still])
        return freeze(root @ kept)

    @cached_property
    def jacobian(self) -> Floats:
        """T' in the coordinates of ``basis``: there (5.21) is the Euclidean norm."""
        return freeze(self.basis.T @ self.pair.neumann.flexibility(self.force @ self.basis))

    def relaxed(self, theta: float) -> Floats:
        """Return the Jacobian J of T_theta in those coordinates."""
        return np.asarray(theta * self.jacobian + (1 - theta) * np.eye(len(self.jacobian)))

    @cached_property
    def modes(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """A Schur form of the transpose of ``jacobian`` and its vectors, which serve the J of every theta."""
        form, vectors = schur(self.jacobian.T, output="complex")
        return freeze((np.asfortranarray(form), np.asfortranarray(vectors)))

    @cached_property
    def changes(self) -> Changes:
        """The speed with which each condition of the piece can approach its end."""
        contact, neumann = self.pair.contact.grid, self.pair.neumann.grid
        t, touching, basis, kernel = contact.t, self.pattern.touching, self.basis, self.pair.interface.kernel
        jump, reaction = self.jump @ basis, self.reaction @ basis
        rows, nodes = [np.where(touching[:, None], reaction[t:], -jump[t:])], [np.arange(contact.n)]
        slips = sticks = rubs = np.zeros(0, dtype=np.intp)
        if self.sign.any() and kernel is not None:
            bound, sliding = self.bound @ basis, self.pattern.sliding
            rubs = np.flatnonzero(np.where(self.pair.contact.free[:t], self.sign, 0))
            slips, sticks = rubs[sliding[rubs] != 0], rubs[sliding[rubs] == 0]
            rows += [sliding[slips, None] * jump[slips], bound[sticks] - reaction[sticks]]
            rows += [bound[sticks] + reaction[sticks], self.sign[rubs, None] * (kernel[rubs] @ basis[neumann.normal])]
            nodes += [slips, sticks, sticks, rubs]
        speed: Floats = np.linalg.norm(np.vstack(rows), axis=1)
        return Changes(speed=speed, nodes=np.concatenate(nodes), slips=slips, sticks=sticks, rubs=rubs)

    def factor(self, theta: float) -> float:
        """Return ``|J|``: the Lipschitz constant of T_theta on this piece in the norm (5.21)."""
        return float(np.linalg.norm(self.relaxed(theta), 2))


def piece_of(pair: ContactPair, g: Floats, pattern: Pattern) -> Piece:
    """Return the affine piece around g, whose contact pattern is known."""
    sign, still = signs_of(pair, g, pattern)
    return Piece(pair=pair, pattern=pattern, sign=sign, still=still)


def signs_of(pair: ContactPair, g: Floats, pattern: Pattern) -> tuple[Signs, Bools]:
    """Return ``sign`` and ``still`` of that piece."""
    neumann = pair.neumann.grid
    sign, still = np.zeros(pair.contact.grid.t, dtype=np.int8), np.zeros(neumann.n, dtype=bool)
    if pair.rubs:
        sign = np.sign(pair.interface.stress(g)).astype(np.int8)
        if not sign.all():
            still = ~pair.interface.pressed(pattern.touching) & (g[neumann.normal] == 0)
    return sign, still

"""Affine pieces of T side by side: what they make of a change of force, and which neighbour has a larger form.

Of each component of the trace d and of ``f = S_1 d`` step II gives one and asks for the other: f where the jump is
free, d where it is not.  One matrix, the principal pivot transform of S_1, takes what is given to what is asked for,
and a node that changes its mind adds one direction for each of its components to the answers.  So a quadratic form of
the answers changes by few ranks from a piece to its neighbours, and which of them have a larger one follows from the
inertia of small matrices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Bools, Floats
from verification.algorithm.affine_piece import Piece
from verification.contact.active_set import Pattern, Signs
from verification.dense import pinned, symmetric, vanishing
from verification.interface.body import Condensed
from verification.interface.pair import ContactPair

#: An eigenvalue is close to a level that is nearer to it than this share of the largest eigenvalue.
NEAR = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Patterns:
    """States of the contact nodes on several pieces: ``touching``, shape (c, n), and ``sliding``, shape (c, t)."""

    touching: Bools
    sliding: Signs


@dataclass(frozen=True, kw_only=True, eq=False)
class Responses:
    """Answers of T to changes of force: to one on several pieces, or to several on one; a row each.

    ``g``, shape (c, 2 n), are the changes of the force on the Neumann grid, ``d_1`` and ``reaction`` the changes of
    traces and forces on the contact grid, ``jump`` the changes of v.
    """

    pair: ContactPair
    g: Floats
    d_1: Floats
    jump: Floats
    reaction: Floats

    @property
    def force(self) -> Floats:
        """The changes of T g, shape (c, 2 n)."""
        return self.pair.interface.carry_back(self.reaction.T).T

    @property
    def friction(self) -> tuple[Floats, Floats]:
        """Two factors of the friction term of (5.12), shape (c, t)."""
        t = self.pair.contact.grid.t
        return -self.reaction[:, :t], self.jump[:, :t]


#: Two factors, shape (c, m), of a quadratic form of the changes of force: its values are their products, row by row.
Factors = Callable[[Responses], tuple[Floats, Floats]]


def squared(rows: Floats, gram: Floats) -> tuple[Floats, Floats]:
    """The factors of ``v' gram v`` of each row."""
    return rows @ gram, rows


def values(factors: tuple[Floats, Floats]) -> Floats:
    """The values of a form, shape (c,)."""
    return np.asarray(np.einsum("ij,ij->i", *factors))


def form_of(factors: tuple[Floats, Floats]) -> Floats:
    """The matrix of a form from its factors for a basis of forces."""
    return symmetric(factors[0] @ factors[1].T)


def answers(piece: Piece, root: Floats | None = None) -> Responses:
    """Answers of T on one piece to the columns of a root, a row each; by default of L, whose length is 1 in (5.21)."""
    pair = piece.pair
    root = pair.neumann.root if root is None else root
    jump = piece.jump @ root
    carried = pair.interface.carry(pair.neumann.inverse @ root)
    return Responses(pair=pair, g=root.T, d_1=(carried + jump).T, jump=jump.T, reaction=(piece.reaction @ root).T)


def responses(pair: ContactPair, g: Floats, patterns: Patterns, sign: Signs) -> Responses:
    """Answers of T to a change of force g, shape (2 n,), on several pieces; ``sign`` is the one of S sigma_N."""
    contact, t = pair.contact, pair.contact.grid.t
    carried = pair.interface.carry(pair.neumann.flexibility(g))
    rubbing = np.zeros((len(patterns.sliding), len(carried)))
    rubbing[:, :t] = patterns.sliding * _bound(pair, g[:, None], sign)[:, 0]
    moves = _moves(pair, patterns)
    systems = contact.schur * (moves[:, :, None] & moves[:, None, :])
    diagonal = np.einsum("cii->ci", systems)
    diagonal[~moves] = 1.0
    if contact.loose:  # motions that a pattern leaves free are pinned, without effect on its reaction
        for system, still in zip(systems, ~moves, strict=True):
            free = vanishing(contact.motions, np.flatnonzero(still))
            system += float(np.diag(contact.schur).max()) * free @ free.T
    load = np.where(moves, -contact.schur @ carried - rubbing, 0.0)
    jump = np.asarray(np.linalg.solve(systems, load[..., None])[..., 0], dtype=float)
    jump[:, ~contact.free] = -carried[~contact.free]
    gs, d_1 = np.repeat(g[None], len(jump), axis=0), carried + jump
    return Responses(pair=pair, g=gs, d_1=d_1, jump=jump, reaction=-d_1 @ contact.schur)


class Neighbours:
    """A quadratic form on the pieces of patterns that differ from one at one node each, or at p nodes.

    ``node``, shape (c,) or (c, p), are these nodes, ``sign``, shape (t,), is the sign of S sigma_N, ``factors`` the
    form.
    """

    def __init__(
        self,
        pair: ContactPair,
        pattern: Pattern,
        patterns: Patterns,
        node: NDArray[np.intp],
        sign: Signs,
        factors: Factors,
    ) -> None:
        self._node = node = node.reshape(len(node), -1)
        self._pair, self._pattern, self._sign, self._factors = pair, pattern, sign, factors
        contact, row = pair.contact, np.arange(len(node))[:, None]
        nodes, of = np.unique(node, axis=0, return_inverse=True)
        components = np.arange(0, contact.grid.size, contact.grid.n)
        each = (nodes[:, :, None] + components).reshape(len(nodes), -1)
        self._at, self._tangential = each[of], slice(0, None, len(components))  # the components of the nodes
        here = Patterns(touching=pattern.touching[None], sliding=pattern.sliding[None])
        self._moves, self._moved = _moves(pair, here)[0], _moves(pair, patterns)[row, self._at]
        self._slides = patterns.sliding[row, node] if contact.grid.t else np.zeros(node.shape, dtype=np.int8)
        self._swapped = self._moved != self._moves[self._at]
        self._transform = transform = _exchanged(contact, self._moves)
        block = transform[self._at[:, :, None], self._at[:, None, :]]
        self._systems = np.where(self._swapped[..., None], block, np.eye(each.shape[1]))
        self._unknown = np.zeros(len(node), dtype=bool)
        if contact.loose:  # a pattern that leaves a motion free has a separate answer
            self._unknown |= _leave_free(contact, ~self._moves[None])[0] | _leave_free(contact, ~_moves(pair, patterns))
            self._systems[self._unknown] = np.eye(each.shape[1])
        # what a unit of each component adds to the answers
        size = contact.grid.size
        none = np.zeros((pair.neumann.grid.size, size))
        self._left, self._right = self._made(none, np.zeros((size, size)), np.eye(size), transform)
        squares = self._left[each] @ np.swapaxes(self._right[each], 1, 2)
        self._squares = ((squares + np.swapaxes(squares, 1, 2)) / 2)[of]

    def _made(self, forces: Floats, carried: Floats, inputs: Floats, answers: Floats) -> tuple[Floats, Floats]:
        """The factors of the form where step II takes columns of inputs to answers.

        ``carried`` are the traces of the Neumann body under the forces, on the contact grid.
        """
        d, f = np.where(self._moves[:, None], [answers, inputs], [inputs, answers])
        return self._factors(Responses(pair=self._pair, g=forces.T, d_1=d.T, jump=(d - carried).T, reaction=-f.T))

    def _changes(self, forces: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
        """Change of the answers when nodes switch state, for columns of forces, shape (c, k, m), and of the form.

        The third are the factors on the pattern itself, shape (m, ..).
        """
        pair, at = self._pair, self._at
        carried, bound = pair.interface.carry(pair.neumann.inverse @ forces), _bound(pair, forces, self._sign)
        held = np.where(pair.contact.free[:, None], carried, 0.0)
        given = np.where(self._moves[:, None], 0.0, held)
        wanted = np.where(self._moved[..., None], 0.0, held[at])
        if t := len(bound):
            given[:t] -= self._pattern.sliding[:, None] * bound
            tangential = self._tangential
            wanted[:, tangential] -= (self._slides * self._moved[:, tangential])[..., None] * bound[self._node]
        asked = self._transform @ given
        change = np.linalg.solve(self._systems, wanted - np.where(self._swapped[..., None], asked[at], given[at]))
        one, two = self._made(forces, carried, given, asked)
        return change, ((self._left @ two.T + self._right @ one.T) / 2)[at], (one, two)

    def values(self, g: Floats) -> Floats:
        """The form at one change of the force, shape (c,); ``-inf`` where it would have to be worked out separately."""
        change, mixed, here = self._changes(g[:, None])
        added = change * (2 * mixed + self._squares @ change)
        return np.where(self._unknown, -np.inf, values(here) + added.sum(axis=(1, 2)))

    def exceed(self, level: float, eigenvalues: Floats, eigenvectors: Floats) -> Bools:
        """True for neighbours whose largest eigenvalue is above a level, or may be; borderline cases fall either way.

        On a neighbour the form is ``form + W K W'``, and it has as many eigenvalues above the level as
        ``K^-1 - W' (level - form)^-1 W`` has negative ones beyond those of K; proof in ``docs/energy.md``.  Modes whose
        eigenvalue is close to the level are not eliminated: to divide by what is left would cost all digits.  The
        eigenvalues of the form on the pattern itself, against any form whose value is to be 1, are below the level; the
        eigenvectors, changes of the force as columns, have length 1 in that form.
        """
        if not level > eigenvalues[-1]:  # the form is 0 on the pattern itself
            return np.ones(len(self._node), dtype=bool)
        change, mixed, _ = self._changes(eigenvectors)
        k, added, left = change.shape[1], np.concatenate([change, mixed], axis=1), level - eigenvalues
        near = left < NEAR * np.abs(eigenvalues).max()
        far, close = added[..., ~near] / left[~near], added[..., near]
        inner = -far @ np.swapaxes(added[..., ~near], 1, 2)
        inner[:, :k, k:] += np.eye(k)
        inner[:, k:, :k] += np.eye(k)
        inner[:, k:, k:] -= self._squares
        beside = np.broadcast_to(np.diag(left[near]), (len(inner), near.sum(), near.sum()))
        small = np.concatenate(
            [np.concatenate([inner, close], axis=2), np.concatenate([np.swapaxes(close, 1, 2), beside], axis=2)], axis=1
        )
        for _ in range(2):  # rows of any unit
            scale = 1 / np.sqrt(np.abs(small).max(axis=2, keepdims=True) + np.finfo(float).tiny)
            small = scale * small * np.swapaxes(scale, 1, 2)
        return np.asarray((np.linalg.eigvalsh(small) < 0).sum(axis=1) > k) | self._unknown


def _bound(pair: ContactPair, forces: Floats, sign: Signs) -> Floats:
    """Changes of the friction bound by columns of forces, shape (t, m)."""
    t = pair.contact.grid.t
    if not pair.rubs:
        return np.zeros((t, forces.shape[1]))
    size = float(pair.friction) * pair.contact.grid.weights * sign
    return np.asarray(size[:, None] * pair.interface.stress(forces))


def _moves(pair: ContactPair, patterns: Patterns) -> Bools:
    """True where step II leaves the jump free, shape (c, 2 n)."""
    return np.concatenate([patterns.sliding != 0, ~patterns.touching], axis=1) & pair.contact.free


def _leave_free(contact: Condensed, still: Bools) -> Bools:
    """True if a rigid motion of the body leaves all ``still`` components where they are, shape (c,)."""
    return np.array([vanishing(contact.motions, np.flatnonzero(row)).shape[1] > 0 for row in still])


def _exchanged(contact: Condensed, moves: Bools) -> Floats:
    """The principal pivot transform of S_1: with ``f = S_1 d`` it takes f where moves and d elsewhere to the others.

    Motions that are left free are pinned.
    """
    S, free, fixed = contact.schur, np.flatnonzero(moves), np.flatnonzero(~moves)
    inverse = np.linalg.inv(pinned(S, free, contact.motions) if contact.loose else S[np.ix_(free, free)])
    across = inverse @ S[np.ix_(free, fixed)]
    result = np.empty_like(S)
    result[np.ix_(free, free)], result[np.ix_(free, fixed)] = inverse, -across
    result[np.ix_(fixed, free)] = across.T
    result[np.ix_(fixed, fixed)] = S[np.ix_(fixed, fixed)] - S[np.ix_(fixed, free)] @ across
    return result

"""A search over contact patterns: the largest one-step factor that any loads can bring about.

The constants of the theorem do not know the loads, so its bounds hold for all of them at once.  Choose a g for which
S sigma_N vanishes at no node that any force reaches; any pattern, except that a node whose friction bound is 0 does not
stick; v and the reaction with that pattern; and the loads that equilibrium then asks for.  On that piece T is affine,
and ``|J|`` is attained by two forces.  The largest ``|J|`` found is a lower bound of the Lipschitz constant.

One g is enough, whatever the rank of S: with other signs of S sigma_N a piece has the J of the one on which the same
nodes slide the other way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.linalg.lapack import dpotrf

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece
from verification.contact.active_set import Pattern
from verification.dense import vanishing
from verification.interface.pair import ContactPair
from verification.threads import one_thread

#: A sum of forces that cancels up to this share of their sizes may be 0.
CANCELLED = 1e-6

#: Digits by which values are told apart: the way uphill is the same however a processor rounds.
DIGITS = 9

#: Candidates that are evaluated in full where no estimate promises anything.
TRIED = 30

Form = Callable[[Piece], Floats]


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """A piece that a search came to.

    Attributes
    ----------
    value : float
        The largest value of the quadratic form on it.
    piece : Piece
    worst : array
        Where the form takes it.
    """

    value: float
    piece: Piece
    worst: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Responses:
    """What T makes of one change of force on several pieces; one row each.

    Attributes
    ----------
    pair : ContactPair
    g : array, shape (2 n,)
        The change of the force on the Neumann grid.
    jump : array, shape (c, 2 n)
        That of v.
    reaction : array, shape (c, 2 n)
        That of the forces on the contact grid.
    """

    pair: ContactPair
    g: Floats
    jump: Floats
    reaction: Floats

    @property
    def force(self) -> Floats:
        """The change of T g, shape (c, 2 n)."""
        return self.pair.interface.carry_back(self.reaction.T).T

    @property
    def d_1(self) -> Floats:
        """The change of the trace of the contact body, shape (c, 2 n)."""
        return self.pair.interface.carry(self.pair.neumann.flexibility(self.g)) + self.jump

    @property
    def friction(self) -> Floats:
        """The friction term of (5.12), shape (c,)."""
        t = self.pair.contact.grid.t
        return -np.asarray(np.einsum("ij,ij->i", self.reaction[:, :t], self.jump[:, :t]))


def signs(pair: ContactPair) -> NDArray[np.int8]:
    """Signs that S sigma_N has for some forces, shape (t,): 0 only where a row of S vanishes, or without friction."""
    kernel = pair.interface.kernel
    if not pair.rubs or kernel is None:
        return np.zeros(pair.contact.grid.t, dtype=np.int8)
    pressed = np.ones(kernel.shape[1])
    reached = np.any(kernel != 0, axis=1)
    if np.any(np.abs(kernel @ pressed)[reached] <= CANCELLED * np.abs(kernel).sum(axis=1)[reached]):
        # no row is orthogonal to it but by accident
        pressed = np.random.default_rng(0).uniform(1, 2, size=len(pressed))
    return np.asarray(np.where(reached, np.sign(kernel @ pressed), 0), dtype=np.int8)


Quick = Callable[[Responses], Floats]


class Search:
    """The affine pieces of T, and the way uphill among them to a large value of a quadratic form.

    Parameters
    ----------
    pair : ContactPair
        The bodies; their loads do not matter, as each piece occurs for suitable ones.
    form : callable
        Piece -> symmetric matrix, in y with ``g = L y`` (:attr:`verification.interface.body.Condensed.root`).
    against : array, optional
        The form whose value is 1: the identity, the norm (5.21), by default.
    quick : callable, optional
        Responses -> the values of the form there, shape (c,).  With it all pieces next to the best are estimated at
        once, by the change of force that is worst on the best one.
    """

    def __init__(
        self, pair: ContactPair, form: Form, *, against: Floats | None = None, quick: Quick | None = None
    ) -> None:
        self.pair, self._form, self._against, self._quick = pair, form, against, quick
        tangential = (0, 1, -1) if pair.rubs else (1,)  # without friction every node slides
        self.states = [(touching, slide) for touching in (True, False) for slide in tangential]
        self.sign, self._still = signs(pair), np.zeros(pair.neumann.grid.n, dtype=bool)
        self._visited: dict[tuple[bytes, bytes], Found] = {}  # ways up meet
        self._below: dict[tuple[bytes, bytes], float] = {}  # a level that the value of a piece does not exceed
        self._reached = np.ones(pair.contact.grid.n, dtype=bool)
        self._reached[: len(self.sign)] = (self.sign != 0) | (not pair.rubs)

    def extremes(self) -> list[tuple[NDArray[np.bool_], NDArray[np.int8]]]:
        """Two patterns: all nodes stick that can, all are open and slide one way."""
        n, t = self.pair.contact.grid.n, self.pair.contact.grid.t
        stick = 0 if self.pair.rubs else 1
        what = ((True, stick), (False, self.states[-1][1]))
        return [(np.full(n, touching), np.full(t, slides, dtype=np.int8)) for touching, slides in what]

    def found(self, touching: NDArray[np.bool_], sliding: NDArray[np.int8]) -> Found:
        """The piece of a pattern, but that a node without a friction bound slides."""
        found = self.above(-np.inf, touching, sliding)
        assert found is not None
        return found

    def above(self, level: float, touching: NDArray[np.bool_], sliding: NDArray[np.int8]) -> Found | None:
        """The same; None where its value is not above a level.

        A Cholesky factorisation decides that in a fraction of the time that the eigenvalues take.
        """
        sliding = np.where(self._reached[: len(sliding)] | (sliding != 0), sliding, 1).astype(np.int8)
        pattern = Pattern(touching=np.asarray(touching, dtype=bool), sliding=sliding)
        visited = pattern.touching.tobytes(), sliding.tobytes()
        if visited not in self._visited:
            if level >= self._below.get(visited, np.inf):
                return None
            piece = Piece(pair=self.pair, pattern=pattern, sign=self.sign, still=self._still)
            form = self._form(piece)
            if level > -np.inf:
                against = np.eye(len(form)) if self._against is None else self._against
                if dpotrf(level * against - form)[1] == 0:
                    self._below[visited] = level
                    return None
            values, vectors = eigh(form, self._against, check_finite=False)
            self._visited[visited] = Found(value=float(values[-1]), piece=piece, worst=vectors[:, -1])
        found = self._visited[visited]
        return found if found.value > level else None

    def climb(self, best: Found) -> Found:
        """The best piece on the way up: what one node does is changed, or several do, as long as that helps."""
        better: Found | None = best
        while better is not None:
            best = better
            level = best.value + 10.0**-DIGITS * abs(best.value)
            tried = (self.above(level, *pattern) for pattern in self._tried(best))
            better = next((found for found in tried if found is not None), None)
        return best

    def _tried(self, best: Found) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.int8]]]:
        """Patterns that may be better, the most promising first."""
        touching, sliding, node = self._neighbours(best.piece.pattern)
        if self._quick is None:
            yield from zip(touching, sliding, strict=True)
            return
        g = self.pair.neumann.root @ best.worst
        rounded = lambda found: np.round(self._quick(found) / (abs(best.value) or 1.0), DIGITS)
        values = rounded(beside(self.pair, g, best.piece.pattern, touching, sliding, node, self.sign))
        order = np.argsort(-values, kind="stable")
        helps = order[values[order] > np.round(best.value / (abs(best.value) or 1.0), DIGITS)]
        each = helps[np.sort(np.unique(node[helps], return_index=True)[1])]  # what helps most at each node
        if len(each) > 1:
            several = [each[:count] for count in _halves(len(each))]
            touches = np.repeat(best.piece.pattern.touching[None], len(several), axis=0)
            slides = np.repeat(best.piece.pattern.sliding[None], len(several), axis=0)
            for row, chosen in enumerate(several):
                touches[row, node[chosen]] = touching[chosen, node[chosen]]
                slides[row, node[chosen]] = sliding[chosen, node[chosen]]
            most = int(np.argmax(rounded(responses(self.pair, g, touches, slides, self.sign))))
            yield touches[most], slides[most]
        yield from zip(touching[order[:TRIED]], sliding[order[:TRIED]], strict=True)

    def _neighbours(self, pattern: Pattern) -> tuple[NDArray[np.bool_], NDArray[np.int8], NDArray[np.intp]]:
        """The patterns that differ at one node, and which."""
        touches, slides = (np.array(column) for column in zip(*self.states, strict=True))
        slides = np.where((slides != 0) | self._reached[:, None], slides, 1)
        differs = touches != pattern.touching[:, None]
        if len(pattern.sliding):
            differs |= slides != pattern.sliding[:, None]
        node, state = np.nonzero(differs)
        touching = np.repeat(pattern.touching[None], len(node), axis=0)
        sliding = np.repeat(pattern.sliding[None], len(node), axis=0)
        touching[np.arange(len(node)), node] = touches[state]
        if len(pattern.sliding):
            sliding[np.arange(len(node)), node] = slides[node, state]
        return touching, sliding, node


def responses(
    pair: ContactPair, g: Floats, touching: NDArray[np.bool_], sliding: NDArray[np.int8], sign: NDArray[np.int8]
) -> Responses:
    """What T makes of a change of force on the pieces of several patterns; :class:`Piece` has the same by all forces.

    Parameters
    ----------
    pair : ContactPair
    g : array, shape (2 n,)
    touching : bool array, shape (c, n)
    sliding : int array, shape (c, t)
    sign : int array, shape (t,)
        Of S sigma_N.
    """
    contact = pair.contact
    carried, rubbing = _given(pair, g, sliding, sign)
    moves = _moves(pair, touching, sliding)
    systems = contact.stiffness * (moves[:, :, None] & moves[:, None, :])
    diagonal = np.einsum("cii->ci", systems)
    diagonal[~moves] = 1.0
    if contact.loose:  # motions that a pattern leaves free are pinned: its reaction does not know of them
        for system, still in zip(systems, ~moves, strict=True):
            free = vanishing(contact.motions, np.flatnonzero(still))
            system += float(np.diag(contact.stiffness).max()) * free @ free.T
    load = np.where(moves, -contact.stiffness @ carried - rubbing, 0.0)
    jump = np.asarray(np.linalg.solve(systems, load[..., None])[..., 0], dtype=float)
    jump[:, ~contact.free] = -carried[~contact.free]
    return _responses(pair, g, jump, -(carried + jump) @ contact.stiffness, rubbing, touching, sliding)


def beside(
    pair: ContactPair,
    g: Floats,
    pattern: Pattern,
    touching: NDArray[np.bool_],
    sliding: NDArray[np.int8],
    node: NDArray[np.intp],
    sign: NDArray[np.int8],
) -> Responses:
    """The same on the pieces of patterns that differ from one at one node each.

    Of each component of the trace d and of ``f = S_1 d`` step II gives one and asks for the other: f where the jump is
    free, d where it is not.  One matrix, the principal pivot transform of S_1, takes what is given to what is asked
    for, and a node that changes its mind leaves a system of its own components alone.

    Parameters
    ----------
    pair, g, touching, sliding, sign
        As in :func:`responses`.
    pattern : Pattern
        The one that they differ from.
    node : int array, shape (c,)
        Where.
    """
    contact, size = pair.contact, pair.contact.grid.size
    carried, rubbing = _given(pair, g, np.vstack([pattern.sliding, sliding]), sign)
    moves = _moves(pair, np.vstack([pattern.touching, touching]), np.vstack([pattern.sliding, sliding]))
    given = np.where(moves, -rubbing, np.where(contact.free, carried, 0.0))
    transform = _exchanged(contact.stiffness, moves[0])
    asked = transform @ given[0]
    at = node[:, None] + np.arange(0, size, contact.grid.n)  # the components of the node
    row = np.arange(len(node))[:, None]
    swapped = moves[1:][row, at] != moves[0][at]
    systems = np.where(swapped[..., None], transform[at[:, :, None], at[:, None, :]], np.eye(at.shape[1]))
    change = np.linalg.solve(systems, (given[1:][row, at] - np.where(swapped, asked[at], given[0][at]))[..., None])
    answers = asked + np.einsum("ck,cki->ci", change[..., 0], transform.T[at])
    inputs = np.repeat(given[:1], len(node), axis=0)
    inputs[row, at] += change[..., 0]
    d, f = np.where(moves[0], answers, inputs), np.where(moves[0], inputs, answers)
    return _responses(pair, g, d - carried, -f, rubbing[1:], touching, sliding)


def _given(pair: ContactPair, g: Floats, sliding: NDArray[np.int8], sign: NDArray[np.int8]) -> tuple[Floats, Floats]:
    """The trace of the Neumann body on the contact grid, shape (2 n,), and the friction forces, shape (c, 2 n)."""
    carried = pair.interface.carry(pair.neumann.flexibility(g))
    rubbing = np.zeros((len(sliding), len(carried)))
    if pair.rubs:
        bound = float(pair.friction) * pair.contact.grid.weights * sign * pair.interface.stress(g)
        rubbing[:, : pair.contact.grid.t] = sliding * bound
    return carried, rubbing


def _moves(pair: ContactPair, touching: NDArray[np.bool_], sliding: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Where step II leaves the jump free, shape (c, 2 n)."""
    return np.concatenate([sliding != 0, ~touching], axis=1) & pair.contact.free


def _responses(
    pair: ContactPair,
    g: Floats,
    jump: Floats,
    reaction: Floats,
    rubbing: Floats,
    touching: NDArray[np.bool_],
    sliding: NDArray[np.int8],
) -> Responses:
    """Responses whose friction forces and open nodes are exact."""
    t = pair.contact.grid.t
    reaction[:, :t] = np.where(sliding != 0, rubbing[:, :t], reaction[:, :t])
    reaction[:, t:][~touching] = 0.0
    return Responses(pair=pair, g=g, jump=jump, reaction=reaction)


def _exchanged(S: Floats, moves: NDArray[np.bool_]) -> Floats:
    """The principal pivot transform of S: with ``f = S d`` it takes f where moves and d elsewhere to the others."""
    free, fixed = np.flatnonzero(moves), np.flatnonzero(~moves)
    inverse = np.linalg.inv(S[np.ix_(free, free)])
    across = inverse @ S[np.ix_(free, fixed)]
    result = np.empty_like(S)
    result[np.ix_(free, free)], result[np.ix_(free, fixed)] = inverse, -across
    result[np.ix_(fixed, free)] = across.T
    result[np.ix_(fixed, fixed)] = S[np.ix_(fixed, fixed)] - S[np.ix_(fixed, free)] @ across
    return result


def size(vectors: Floats, gram: Floats) -> Floats:
    """``v' gram v`` of each row."""
    return np.asarray(np.einsum("ci,ci->c", vectors @ gram, vectors))


def worst_piece(
    pair: ContactPair,
    form: Form,
    *,
    random: np.random.Generator,
    against: Floats | None = None,
    quick: Quick | None = None,
    starts: int = 4,
) -> Found:
    """Search the affine pieces of T for the largest value of a quadratic form.

    Parameters
    ----------
    pair, form, against, quick
        As in :class:`Search`.
    random : Generator
    starts : int
        The starts are: all nodes stick that can, all are open and slide one way, and random patterns.
    """
    return _from_starts(Search(pair, form, against=against, quick=quick), random=random, starts=starts)


def _from_starts(search: Search, *, random: np.random.Generator, starts: int) -> Found:
    n, t = search.pair.contact.grid.n, search.pair.contact.grid.t
    patterns = search.extremes()
    for _ in range(max(starts - len(patterns), 0)):
        chosen = [search.states[i] for i in random.integers(len(search.states), size=n)]
        touching, sliding = (np.array(column) for column in zip(*chosen, strict=True))
        patterns.append((touching, sliding[:t]))
    with one_thread():
        return max((search.climb(search.found(*pattern)) for pattern in patterns[:starts]), key=lambda best: best.value)


def factor_search(pair: ContactPair, theta: float) -> Search:
    """The search for the largest ``|J|^2`` of T_theta in the norm (5.21)."""

    def form(piece: Piece) -> Floats:
        J = piece.relaxed(theta)
        return J.T @ J

    def quick(responses: Responses) -> Floats:
        step = theta * responses.force + (1 - theta) * responses.g
        return size(step, pair.neumann.inverse)

    return Search(pair, form, quick=quick)


def largest_factor(pair: ContactPair, theta: float, *, random: np.random.Generator, starts: int = 4) -> Found:
    """The largest ``|J|`` of T_theta over contact patterns, in the norm (5.21): attained by two forces."""
    found = _from_starts(factor_search(pair, theta), random=random, starts=starts)
    return replace(found, value=found.piece.factor(theta))


def _halves(count: int) -> list[int]:
    """count, half of it, a quarter, .., 2."""
    return [count >> k for k in range(count.bit_length()) if count >> k > 1]

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

#: Entries of the systems that are solved at once.
AT_ONCE = 2_000_000

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
        sliding = np.where(self._reached[: len(sliding)] | (sliding != 0), sliding, 1).astype(np.int8)
        pattern = Pattern(touching=np.asarray(touching, dtype=bool), sliding=sliding)
        visited = pattern.touching.tobytes(), sliding.tobytes()
        if visited not in self._visited:
            self._visited[visited] = self._evaluated(pattern)
        return self._visited[visited]

    def _evaluated(self, pattern: Pattern) -> Found:
        piece = Piece(pair=self.pair, pattern=pattern, sign=self.sign, still=self._still)
        form = self._form(piece)
        values, vectors = eigh(form, self._against, check_finite=False)
        return Found(value=float(values[-1]), piece=piece, worst=vectors[:, -1])

    def climb(self, best: Found) -> Found:
        """The best piece on the way up: what one node does is changed, or several do, as long as that helps."""
        better: Found | None = best
        while better is not None:
            best = better
            better = next(
                (found for found in self._tried(best) if found.value > best.value + 10.0**-DIGITS * abs(best.value)),
                None,
            )
        return best

    def _tried(self, best: Found) -> Iterator[Found]:
        """Pieces that may be better, the most promising first."""
        touching, sliding, node = self._neighbours(best.piece.pattern)
        if self._quick is None:
            yield from (self.found(*pattern) for pattern in zip(touching, sliding, strict=True))
            return
        g = self.pair.neumann.root @ best.worst
        rounded = lambda values: np.round(values / (abs(best.value) or 1.0), DIGITS)
        values = rounded(self._estimates(g, touching, sliding))
        order = np.argsort(-values, kind="stable")
        helps = order[values[order] > rounded(best.value)]
        each = helps[np.sort(np.unique(node[helps], return_index=True)[1])]  # what helps most at each node
        if len(each) > 1:
            several = [each[:count] for count in _halves(len(each))]
            touches = np.repeat(best.piece.pattern.touching[None], len(several), axis=0)
            slides = np.repeat(best.piece.pattern.sliding[None], len(several), axis=0)
            for row, chosen in enumerate(several):
                touches[row, node[chosen]] = touching[chosen, node[chosen]]
                slides[row, node[chosen]] = sliding[chosen, node[chosen]]
            most = int(np.argmax(rounded(self._estimates(g, touches, slides))))
            yield self.found(touches[most], slides[most])
        yield from (self.found(touching[i], sliding[i]) for i in order[:TRIED])

    def _neighbours(self, pattern: Pattern) -> tuple[NDArray[np.bool_], NDArray[np.int8], NDArray[np.intp]]:
        """The patterns that differ at one node, and which."""
        t = len(pattern.sliding)
        touching, sliding, node = [], [], []
        for j in range(len(pattern.touching)):
            for touches, slides in self.states:
                touch, slide = pattern.touching.copy(), pattern.sliding.copy()
                touch[j], slide[j : j + 1] = touches, slides if slides or self._reached[j] else 1
                if touch[j] != pattern.touching[j] or (j < t and slide[j] != pattern.sliding[j]):
                    touching.append(touch)
                    sliding.append(slide)
                    node.append(j)
        return np.array(touching), np.array(sliding), np.array(node)

    def _estimates(self, g: Floats, touching: NDArray[np.bool_], sliding: NDArray[np.int8]) -> Floats:
        """The values of the form at one change of force on the pieces of patterns: lower bounds of the largest ones."""
        assert self._quick is not None
        step = max(AT_ONCE // len(g) ** 2, 1)
        parts = [
            self._quick(responses(self.pair, g, touching[i : i + step], sliding[i : i + step], self.sign))
            for i in range(0, len(touching), step)
        ]
        return np.concatenate(parts)


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
    contact, t = pair.contact, pair.contact.grid.t
    carried = pair.interface.carry(pair.neumann.flexibility(g))
    bound = np.zeros(t)
    if pair.rubs:
        bound = float(pair.friction) * pair.contact.grid.weights * sign * pair.interface.stress(g)
    rubbing = np.zeros((len(touching), len(carried)))
    rubbing[:, :t] = sliding * bound
    moves = np.concatenate([sliding != 0, ~touching], axis=1) & contact.free
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
    reaction = -(carried + jump) @ contact.stiffness
    reaction[:, :t] = np.where(sliding != 0, rubbing[:, :t], reaction[:, :t])
    reaction[:, t:][~touching] = 0.0
    return Responses(pair=pair, g=g, jump=jump, reaction=reaction)


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

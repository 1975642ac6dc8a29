"""A search over contact patterns: the largest one-step factor that any loads can bring about.

The constants of the theorem do not know the loads, so its bounds hold for all of them at once.  Choose a g for which
S sigma_N vanishes at no node that any force reaches; any pattern, except that a node whose friction bound is 0 does not
stick; v and the reaction with that pattern; and the loads that equilibrium then asks for.  On that piece T is affine,
and ``|J|`` is attained by two forces.  The largest ``|J|`` found is a lower bound of the Lipschitz constant.

One g is enough, whatever the rank of S: with other signs of S sigma_N a piece has the J of the one on which the same
nodes slide the other way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, eigh, eigvalsh, solve_triangular
from scipy.linalg.lapack import dpotrf

from fem1d2d.mesh import Bools, Floats
from verification.algorithm.affine_piece import Piece
from verification.algorithm.rates import ForceNorm
from verification.contact.active_set import Pattern, Signs
from verification.interface.pair import ContactPair
from verification.machine.threads import one_thread
from verification.semidefinite.neighbours import (
    Factors,
    Neighbours,
    Patterns,
    Responses,
    answers,
    form_of,
    responses,
    squared,
    values,
)

#: A sum of forces that cancels up to this share of their sizes may be 0.
CANCELLED = 1e-6

#: Digits in which values differ: the way uphill is the same however a processor rounds.
DIGITS = 9


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundFactor:
    """A piece that a search came to: ``form`` in y there, its largest ``value``, and ``worst``, the force with it."""

    value: float
    piece: Piece
    worst: Floats
    form: Floats

    @cached_property
    def size(self) -> float:
        """The largest modulus of an eigenvalue: rounding is a share of it."""
        if dpotrf(self.form + self.value * np.eye(len(self.form)))[1] == 0:  # no eigenvalue is below -value
            return self.value
        return float(np.abs(eigvalsh(self.form)).max())


def signs(pair: ContactPair) -> Signs:
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


class Search:
    """The affine pieces of T, and the way uphill among them to a large value of a quadratic form.

    The loads of ``pair`` do not matter, as each piece occurs for suitable ones.

    ``factors`` are of the form (:data:`verification.semidefinite.neighbours.Factors`).  Its values are for changes of
    force with ``g' gram g = 1``, by default of length 1 in the norm (5.21).
    """

    def __init__(self, pair: ContactPair, factors: Factors, *, gram: Floats | None = None) -> None:
        self.pair, self._factors, root = pair, factors, pair.neumann.root
        if gram is not None:
            root = solve_triangular(cholesky(root.T @ gram @ root, lower=True), root.T, lower=True).T
        self._root = root
        tangential = (0, 1, -1) if pair.rubs else (1,)  # without friction every node slides
        self.states = [(touching, slide) for touching in (True, False) for slide in tangential]
        self.sign, self._still = signs(pair), np.zeros(pair.neumann.grid.n, dtype=bool)
        self._visited: dict[bytes, FoundFactor] = {}  # ways up meet
        self._below: dict[bytes, float] = {}  # a level that the value of a piece does not exceed
        self._reached = np.ones(pair.contact.grid.n, dtype=bool)
        self._reached[: len(self.sign)] = (self.sign != 0) | (not pair.rubs)

    def extremes(self) -> list[tuple[Bools, Signs]]:
        """Two patterns: all nodes stick that can, all are open and slide one way."""
        n, t = self.pair.contact.grid.n, self.pair.contact.grid.t
        stick = 0 if self.pair.rubs else 1
        what = ((True, stick), (False, self.states[-1][1]))
        return [(np.full(n, touching), np.full(t, slides, dtype=np.int8)) for touching, slides in what]

    def random_pattern(self, random: np.random.Generator) -> tuple[Bools, Signs]:
        """A random pattern."""
        chosen = [self.states[i] for i in random.integers(len(self.states), size=self.pair.contact.grid.n)]
        touching, sliding = (np.array(column) for column in zip(*chosen, strict=True))
        return touching, sliding[: self.pair.contact.grid.t]

    def piece(self, touching: Bools, sliding: Signs) -> Piece:
        """The piece of a pattern, but that a node without a friction bound slides."""
        sliding = np.where(self._reached[: len(sliding)] | (sliding != 0), sliding, 1).astype(np.int8)
        pattern = Pattern(touching=np.asarray(touching, dtype=bool), sliding=sliding)
        return Piece(pair=self.pair, pattern=pattern, sign=self.sign, still=self._still)

    def found(self, touching: Bools, sliding: Signs) -> FoundFactor:
        """The largest value of the form on the piece of a pattern."""
        found = self.above(-np.inf, touching, sliding)
        assert found is not None
        return found

    def above(self, level: float, touching: Bools, sliding: Signs) -> FoundFactor | None:
        """The same; None where its value is not above a level.

        A Cholesky factorisation decides that in a fraction of the time that the eigenvalues take.
        """
        piece = self.piece(touching, sliding)
        visited = piece.pattern.key
        if visited not in self._visited:
            if level >= self._below.get(visited, np.inf):
                return None
            form = form_of(self._factors(answers(piece, self._root)))
            if level > -np.inf and dpotrf(level * np.eye(len(form)) - form)[1] == 0:
                self._below[visited] = level
                return None
            top, vectors = eigh(form, subset_by_index=[len(form) - 1] * 2, check_finite=False)
            if not len(top):  # LAPACK finds none where many eigenvalues are the largest one
                top, vectors = eigh(form, check_finite=False)
            self._visited[visited] = FoundFactor(
                value=float(top[-1]), piece=piece, worst=self._root @ vectors[:, -1], form=form
            )
        known = self._visited[visited]
        return known if known.value > level else None

    def climb(self, best: FoundFactor, *, side_by_side: bool = False) -> FoundFactor:
        """The best piece on the way up: what one node does is changed, or several do, as long as that helps.

        Where no node helps any more, ``side_by_side`` changes two neighbours together, as where a border between nodes
        that slide to either side moves.
        """
        better: FoundFactor | None = best
        while better is not None:
            best = better
            level = best.value + 10.0**-DIGITS * best.size
            patterns = self._tried(best, level)
            if side_by_side:
                patterns = chain(patterns, self._tried_side_by_side(best, level))
            tried = (self.above(level, *pattern) for pattern in patterns)
            better = next((found for found in tried if found is not None), None)
        return best

    def _tried(self, best: FoundFactor, level: float) -> Iterator[tuple[Bools, Signs]]:
        """Patterns that may be better, the most promising first: by the change of force that is worst on the best."""
        patterns, node = self.neighbours(best.piece.pattern)
        beside = Neighbours(self.pair, best.piece.pattern, patterns, node, self.sign, self._factors)
        size = best.size or 1.0
        promised = np.round(beside.values(best.worst) / size, DIGITS)
        order = np.argsort(-promised, kind="stable")
        helps = order[promised[order] > np.round(best.value / size, DIGITS)]
        several = _several(best.piece.pattern, patterns, node, helps)
        if len(several.touching):
            made = responses(self.pair, best.worst, several, self.sign)
            most = int(np.argmax(np.round(values(self._factors(made)) / size, DIGITS)))
            yield several.touching[most], several.sliding[most]
        yield from ((patterns.touching[i], patterns.sliding[i]) for i in helps)
        exceeds = order[self._exceed(beside, level, best)[order]]
        several = _several(best.piece.pattern, patterns, node, exceeds)
        yield from zip(several.touching, several.sliding, strict=True)
        yield from ((patterns.touching[i], patterns.sliding[i]) for i in exceeds)

    def _tried_side_by_side(self, best: FoundFactor, level: float) -> Iterator[tuple[Bools, Signs]]:
        """Patterns that differ at two nodes side by side and are better up to rounding, the most promising first."""
        patterns, node = _side_by_side(best.piece.pattern, *self.neighbours(best.piece.pattern))
        if not len(node):  # a single contact node
            return
        beside = Neighbours(self.pair, best.piece.pattern, patterns, node, self.sign, self._factors)
        exceeds = np.flatnonzero(self._exceed(beside, level, best))
        promised = np.round(beside.values(best.worst)[exceeds] / (best.size or 1.0), DIGITS)
        for i in exceeds[np.argsort(-promised, kind="stable")]:
            yield patterns.touching[i], patterns.sliding[i]

    def _exceed(self, beside: Neighbours, level: float, best: FoundFactor) -> Bools:
        eigenvalues, vectors = eigh(best.form, check_finite=False)
        return beside.exceed(level, eigenvalues, self._root @ vectors)

    def neighbours(self, pattern: Pattern) -> tuple[Patterns, NDArray[np.intp]]:
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
        return Patterns(touching=touching, sliding=sliding), node


def worst_piece(
    pair: ContactPair, factors: Factors, *, random: np.random.Generator, gram: Floats | None = None, starts: int = 4
) -> FoundFactor:
    """Search the affine pieces of T for the largest value of a quadratic form; parameters as in :class:`Search`.

    The starts are: all nodes stick that can, all are open and slide one way, and random patterns.
    """
    return _from_starts(Search(pair, factors, gram=gram), random=random, starts=starts)


def _from_starts(search: Search, *, random: np.random.Generator, starts: int) -> FoundFactor:
    patterns = search.extremes()
    patterns += [search.random_pattern(random) for _ in range(starts - len(patterns))]
    with one_thread():
        return max((search.climb(search.found(*pattern)) for pattern in patterns[:starts]), key=lambda best: best.value)


def factor_search(pair: ContactPair, theta: float, norm: ForceNorm | None = None) -> Search:
    """The search for the largest ``|J|^2`` of T_theta in the norm (5.21), or in another one."""
    gram = pair.neumann.inverse if norm is None else norm.matrix

    def factors(found: Responses) -> tuple[Floats, Floats]:
        return squared(theta * found.force + (1 - theta) * found.g, gram)

    return Search(pair, factors, gram=None if norm is None else gram)


def largest_factor(
    pair: ContactPair, theta: float, *, random: np.random.Generator, starts: int = 4, norm: ForceNorm | None = None
) -> FoundFactor:
    """The largest ``|J|`` of T_theta over contact patterns, in the norm (5.21) or another: attained by two forces."""
    search = factor_search(pair, theta, norm)
    found = _from_starts(search, random=random, starts=starts)
    with one_thread():
        found = search.climb(found, side_by_side=True)
    return replace(found, value=found.piece.factor(theta) if norm is None else math.sqrt(max(found.value, 0.0)))


def _several(pattern: Pattern, patterns: Patterns, node: NDArray[np.intp], helps: NDArray[np.intp]) -> Patterns:
    """A pattern changed at all nodes where something helps, at half of them, a quarter, .., two: what helps most."""
    each = helps[np.sort(np.unique(node[helps], return_index=True)[1])]
    counts = [len(each) >> k for k in range(len(each).bit_length()) if len(each) >> k > 1]
    touching = np.repeat(pattern.touching[None], len(counts), axis=0)
    sliding = np.repeat(pattern.sliding[None], len(counts), axis=0)
    for row, count in enumerate(counts):
        chosen = each[:count]
        touching[row, node[chosen]] = patterns.touching[chosen, node[chosen]]
        sliding[row, node[chosen]] = patterns.sliding[chosen, node[chosen]]
    return Patterns(touching=touching, sliding=sliding)


def _side_by_side(pattern: Pattern, patterns: Patterns, node: NDArray[np.intp]) -> tuple[Patterns, NDArray[np.intp]]:
    """A pattern changed at two nodes side by side, as others change it at one each, and these nodes, shape (c, 2)."""
    first, second = np.nonzero(node[:, None] + 1 == node)
    touching, sliding = patterns.touching[first], patterns.sliding[first]
    row, at = np.arange(len(second)), node[second]
    touching[row, at] = patterns.touching[second, at]
    if len(pattern.sliding):
        sliding[row, at] = patterns.sliding[second, at]
    return Patterns(touching=touching, sliding=sliding), np.stack([node[first], at], axis=1)

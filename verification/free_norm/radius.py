"""The largest spectral radius of a piece of T_theta: no norm contracts by less.

T_theta is piecewise affine.  Inside a piece it takes a change of force d to ``J d``, so a norm in which it contracts by
q has ``|J| <= q``, and the spectral radius of J is at most q.  A norm that serves all loads has ``|J_m .. J_1| <= q^m``
for any m pieces, whichever loads each of them needs, so that ``radius(J_m .. J_1)^(1/m) <= q``.

Which pieces have an interior for some loads?  All that :mod:`verification.semidefinite.pattern_search` visits.  There
one g has ``S sigma_N != 0`` at every node that a force reaches, and every condition of a pattern can hold with room to
spare: slip and gap of size 1, a pressure, a shear of 0 where a node sticks; a node without a friction bound slides.
Equilibrium then gives the loads.  The rank of S does not matter: with other signs of S sigma_N a piece has the J of the
one on which the same nodes slide the other way.  Where only contact holds the contact body, a piece counts if friction
on it does no work in the motions that it leaves free; otherwise T is affine on no open set of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import accumulate, chain

import numpy as np
from scipy.linalg import eig

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece
from verification.contact.active_set import Pattern
from verification.interface.pair import ContactPair
from verification.machine.threads import one_thread
from verification.semidefinite.neighbours import responses
from verification.semidefinite.pattern_search import DIGITS, Search, factor_search

#: Spectral radii that a search evaluates, and random starts, at most.
EVALUATIONS, RANDOM = 300, 24

#: Neighbours that are evaluated before a climb ends, the most promising ones.
TRIED = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundRadius:
    """Pieces of T_theta and the spectral radius of the product of their Jacobians.

    ``value`` is ``radius(J_m .. J_1)^(1/m)``, in doubles: no norm in which T_theta contracts under all loads has less.
    ``pieces`` are in the order of the steps, m of them; ``evaluations`` counts the spectral radii that the search had
    evaluated by then.
    """

    value: float
    pieces: tuple[Piece, ...]
    evaluations: int


class Climb:
    """The way uphill to a large spectral radius, by what one node does on one of the pieces."""

    def __init__(self, pair: ContactPair, theta: float, evaluations: int) -> None:
        self.search, self.theta, self.left = factor_search(pair, theta), theta, evaluations
        self._used, self._known = 0, dict[tuple[Pattern, ...], float]()

    def at(self, *pieces: Piece) -> FoundRadius:
        """The spectral radius of some pieces; 0 where T is not affine on one of them."""
        patterns = tuple(piece.pattern for piece in pieces)
        if patterns not in self._known:
            self.left, self._used = self.left - 1, self._used + 1
            product = self._products(pieces)[-1] if all(piece.balanced for piece in pieces) else np.zeros((1, 1))
            self._known[patterns] = radius(product) ** (1 / len(pieces))
        return FoundRadius(value=self._known[patterns], pieces=pieces, evaluations=self._used)

    def up(self, best: FoundRadius) -> FoundRadius:
        """The best on the way up, while evaluations are left."""
        better: FoundRadius | None = best
        while better is not None:
            best, level = better, better.value + 10.0**-DIGITS
            better = next((found for found in self._beside(best) if found.value > level), None)
        return best

    def highest(self, starts: Iterable[tuple[Piece, ...]]) -> FoundRadius:
        """The best that is found from some starts, while evaluations are left."""
        tried = (self.up(self.at(*pieces)) for pieces in starts)
        best = next(iter(tried))
        while self.left > 0 and (found := next(tried, None)) is not None:
            best = max(best, found, key=lambda found: found.value)
        return best

    def _products(self, pieces: tuple[Piece, ...]) -> list[Floats]:
        """The Jacobians of the first piece, the first two, .., all of them."""
        steps = (piece.relaxed(self.theta) for piece in pieces)
        return list(accumulate(steps, lambda taken, step: step @ taken))

    def _beside(self, best: FoundRadius) -> Iterator[FoundRadius]:
        """Neighbours, the most promising first: by the dominant eigenvalue, to first order in the change of J."""
        pair, pieces = self.search.pair, best.pieces
        products = self._products(pieces)
        values, left, right = eig(products[-1], left=True)
        most = int(np.argmax(np.round(np.abs(values) / (best.value ** len(pieces) or 1.0), DIGITS)))
        row, column = left[:, most].conj(), right[:, most]
        options, promised = [], []
        for place in reversed(range(len(pieces))):
            y = products[place - 1] @ column if place else column
            patterns, _ = self.search.neighbours(pieces[place].pattern)
            g, dual = pair.neumann.root @ y, pair.neumann.inverse @ (pair.neumann.root @ row)
            parts = ((unit, part) for unit, part in ((1, g.real), (1j, g.imag)) if part.any())
            force = sum(unit * responses(pair, part, patterns, self.search.sign).force for unit, part in parts)
            made = self.theta * force @ dual + (1 - self.theta) * (row @ y)
            options += [(place, *states) for states in zip(patterns.touching, patterns.sliding, strict=True)]
            promised.append(np.abs(made))
            row = row @ pieces[place].relaxed(self.theta)
        each = np.concatenate(promised)
        for i in np.argsort(-np.round(each / (each.max(initial=0.0) or 1.0), DIGITS), kind="stable")[:TRIED]:
            if self.left <= 0:
                return
            place, touching, sliding = options[i]
            yield self.at(*pieces[:place], self.search.piece(touching, sliding), *pieces[place + 1 :])


def largest_radius(pair: ContactPair, theta: float, *, evaluations: int = EVALUATIONS, length: int = 1) -> FoundRadius:
    """Search the pieces of T_theta for a large spectral radius: no norm contracts by less under all loads.

    The starts are: all nodes stick that can; all are open but one, and slide one way; the pieces to which climbs of
    ``|J|`` lead; and random patterns, always the same.  A larger radius may exist.

    At most so many ``evaluations`` of spectral radii are made for one piece, and again for several, which are
    ``length``.

    Examples
    --------
    >>> from verification import build, example
    >>> found = largest_radius(build(example("section6-60")), 0.7)
    >>> 0.300 < found.value < 0.339, len(found.pieces)
    (True, 1)
    """
    climb = Climb(pair, theta, evaluations)
    with one_thread():
        best = climb.highest(_starts(climb))
        if length > 1:
            climb.left += evaluations
            random = np.random.default_rng(0)
            cycles = (_random(climb.search, random, length) for _ in range(RANDOM))
            best = climb.highest(chain([best.pieces * length], cycles))
    return best


def _starts(climb: Climb) -> Iterator[tuple[Piece, ...]]:
    search = climb.search
    stick, (none, slide) = search.extremes()
    yield (search.piece(*stick),)
    touched = (search.piece(np.arange(len(none)) == node, slide) for node in range(min(len(none), climb.left)))
    yield max((climb.at(piece) for piece in touched), key=lambda found: found.value).pieces
    for pattern in search.extremes():
        yield (search.climb(search.found(*pattern)).piece,)
    random = np.random.default_rng(0)
    for _ in range(RANDOM):
        yield _random(search, random, 1)


def _random(search: Search, random: np.random.Generator, length: int) -> tuple[Piece, ...]:
    return tuple(search.piece(*search.random_pattern(random)) for _ in range(length))


def radius(J: Floats) -> float:
    """The spectral radius of a matrix."""
    return float(np.abs(np.linalg.eigvals(J)).max())

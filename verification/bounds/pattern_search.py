"""A search over contact patterns: the largest one-step factor that any loads can bring about.

The constants of the theorem do not know the loads, so its bounds hold for all of them at once.  Choose a g for which
S sigma_N vanishes at no node that any force reaches; any pattern, except that a node whose friction bound is 0 does not
stick; v and the reaction with that pattern; and the loads that equilibrium then asks for.  On that piece T is affine,
and ``|J|`` is attained by two forces.  The largest ``|J|`` found is a lower bound of the Lipschitz constant.

One g is enough, whatever the rank of S: with other signs of S sigma_N a piece has the J of the one on which the same
nodes slide the other way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verification.algorithm.affine_piece import Piece
from verification.contact.active_set import Pattern
from verification.interface.pair import ContactPair
from verification.threads import one_thread

#: A sum of forces that cancels up to this share of their sizes may be 0.
CANCELLED = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """The best piece of a search.

    Attributes
    ----------
    value : float
    piece : Piece
    """

    value: float
    piece: Piece


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


def worst_piece(
    pair: ContactPair, measure: Callable[[Piece], float], *, random: np.random.Generator, starts: int = 4
) -> Found:
    """Search the affine pieces of T for the largest value of a function.

    From each start what one node does at a time is changed, as long as that helps.

    Parameters
    ----------
    pair : ContactPair
        The bodies; their loads do not matter, as each piece occurs for suitable ones.
    measure : callable
        Piece -> value.
    random : Generator
    starts : int
        The starts are: all nodes stick that can, all are open and slide one way, and random patterns.
    """
    n, t, rubs = pair.contact.grid.n, pair.contact.grid.t, pair.rubs
    tangential = (0, 1, -1) if rubs else (1,)  # without friction every node slides
    states = [(touching, slide) for touching in (True, False) for slide in tangential]
    sign, still = signs(pair), np.zeros(pair.neumann.grid.n, dtype=bool)
    reached = np.ones(n, dtype=bool)  # a node without a friction bound does not stick
    reached[:t] = (sign != 0) | (not rubs)
    sticks = np.array([slide == 0 for _, slide in states])
    admissible = lambda state: np.where(sticks[state] & ~reached, state + 1, state)  # slides instead

    def piece(state: np.ndarray) -> Piece:
        pattern = Pattern(
            touching=np.array([states[i][0] for i in state], dtype=bool),
            sliding=np.array([states[i][1] for i in state], dtype=np.int8)[:t],
        )
        return Piece(pair=pair, pattern=pattern, sign=sign, still=still)

    def climb(state: np.ndarray) -> Found:
        best = Found(value=measure(piece(state)), piece=piece(state))
        improved = True
        while improved:
            improved = False
            for j in random.permutation(n):
                for other in range(len(states)):
                    if other == state[j] or (sticks[other] and not reached[j]):
                        continue
                    trial = state.copy()
                    trial[j] = other
                    candidate = piece(trial)
                    value = measure(candidate)
                    if value > best.value * (1 + 1e-12):
                        best, state, improved = Found(value=value, piece=candidate), trial, True
        return best

    first = [np.zeros(n, dtype=int), np.full(n, len(states) - 1)]
    others = [random.integers(len(states), size=n) for _ in range(max(starts - len(first), 0))]
    with one_thread():
        return max((climb(admissible(state)) for state in [*first, *others][:starts]), key=lambda found: found.value)


def largest_factor(pair: ContactPair, theta: float, *, random: np.random.Generator, starts: int = 4) -> Found:
    """The largest ``|J|`` of T_theta over contact patterns, in the norm (5.21): attained by two forces."""
    return worst_piece(pair, lambda piece: piece.factor(theta), random=random, starts=starts)

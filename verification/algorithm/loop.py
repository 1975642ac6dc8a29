"""The one loop: states of an iteration one by one, up to the one at which a test ends it, with an outcome.

Runs, couplings of two solvers, methods on a spectrum and the rows of a sweep bring only their states.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from enum import StrEnum
from typing import NamedTuple, TypeVar

import numpy as np

from fem1d2d.mesh import Floats

S = TypeVar("S")

#: A run without a new least residual over so many steps has stalled.
PATIENCE = 50

#: A residual grown by this factor over the first one has diverged.
RUNAWAY = 1e8


class Outcome(StrEnum):
    """The outcome of an iteration: a text, with words for sentences.

    ``words`` are the outcome in a sentence, ``seen`` says what was seen at the end, and ``why`` no number of steps to a
    solution follows, as a format that takes the ``steps``.

    Examples
    --------
    >>> Outcome("limit").words, Outcome.LIMIT == "limit", Outcome.LIMIT
    ('not converged', True, 'limit')
    """

    words: str
    seen: str
    why: str

    CONVERGED = "converged"
    STALLED = "stalled", "stalled", "stalled", f"no new least residual over {PATIENCE} steps"
    LIMIT = "limit", "not converged", "still falling when stopped", "not converged in {steps} steps"
    DIVERGED = "diverged", "diverged", "diverged", f"the residual grew by more than {RUNAWAY:g}"
    INTERRUPTED = "interrupted"

    def __new__(cls, name: str, words: str = "", seen: str = "", why: str = "") -> Outcome:
        one = str.__new__(cls, name)
        one._value_, one.words, one.seen, one.why = name, words or name, seen or name, why
        return one

    __repr__ = str.__repr__

    @property
    def unfinished(self) -> str:
        """The words for the values at the end of a run that did not converge; empty where it did."""
        return "" if self is Outcome.CONVERGED else "last iterate, not a solution"


class Ending:
    """The test that ends an iteration, from its residuals one by one.

    Parameters
    ----------
    tolerance : float
        The iteration has converged at a residual of at most so many times its scale.
    most : int
        The most steps.
    patience : float
        Steps without a new least residual after which it has stalled.
    runaway : float
        The factor over the first residual beyond which it has diverged.
    growing : int
        Steps one after the other in which a residual beyond that has grown, too, if it has diverged.
    """

    def __init__(
        self, tolerance: float, most: int, *, patience: float = PATIENCE, runaway: float = RUNAWAY, growing: int = 0
    ) -> None:
        self._tolerance, self._most = tolerance, most
        self._patience, self._runaway, self._least_growth = patience, runaway, growing
        self._least = self._first = self._last = math.inf
        self._grown = 0
        #: Steps that were taken, and those of them since the least residual.
        self.steps, self.since = -1, 0

    def at(self, residual: float, scale: float, arrived: Callable[[], bool] = lambda: True) -> Outcome | None:
        """Return the outcome if the iteration ends at a next state of these numbers, else None.

        ``arrived`` is called where the residual meets the tolerance; a state for which it returns False does not solve
        the problem.
        """
        self.steps += 1
        if self.steps == 0:
            self._first = residual
        self._least, self.since = (residual, 0) if residual < self._least else (self._least, self.since + 1)
        self._grown = self._grown + 1 if residual > self._last else 0
        self._last = residual
        if residual <= self._tolerance * scale < math.inf and arrived():
            return Outcome.CONVERGED
        return self.given_up(residual)

    def given_up(self, residual: float) -> Outcome | None:
        """Return the outcome if the iteration ends here without convergence, else None."""
        if not math.isfinite(residual) or (
            residual > self._runaway * self._first and self._grown >= self._least_growth
        ):
            return Outcome.DIVERGED
        if self.since >= self._patience:
            return Outcome.STALLED
        return Outcome.LIMIT if self.steps >= self._most else None


def follow(states: Iterable[S], ended: Callable[[S], Outcome | None], seen: list[S]) -> Outcome:
    """Follow states, which do not end, to the first at which ``ended`` has an outcome; each is put into ``seen``."""
    for state in states:
        seen.append(state)
        outcome = ended(state)
        if outcome is not None:
            return outcome
    raise ValueError("needed states without end")


class Evaluation(NamedTuple):
    """An evaluation of T of which only vectors are known; norms are Euclidean."""

    g: Floats
    image: Floats
    residual: float
    scale: float


def evaluations(
    T: Callable[[Floats], Floats], step: Callable[[Floats, Floats], Floats], g: Floats
) -> Iterator[Evaluation]:
    """Yield the evaluations of T at the vectors of a rule, from g on, without end."""
    while True:
        image = T(g)
        yield Evaluation(g, image, float(np.linalg.norm(image - g)), float(np.linalg.norm(image)))
        g = step(g, image)

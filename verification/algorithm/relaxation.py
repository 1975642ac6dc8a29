"""Relaxation rules, which choose the next g: a constant theta and its alternatives.

A rule gets the iterates one by one and returns the next g at which T is evaluated.  Only the constant factor is
covered by the theorem; momentum has a proved rate without friction; the others have none.  Inner products are those of
the norm (5.21), so that no rule depends on the units.  Rules that need only g and T g work on the vectors of any
coupling as well, there with the inner product of these vectors.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import ClassVar, final

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import piece_of
from verification.algorithm.iterate import Iterate
from verification.contact.active_set import SLACK
from verification.interface.pair import ContactPair
from verification.registry import RULES

#: Number of earlier steps that Anderson mixing uses.
DEPTH = 10

#: Number of earlier steps that IQN-ILS uses.
REMEMBERED = 40

#: A change of an earlier step in time counts if this share of it is independent of newer ones.
FILTER = 1e-2

#: A step of IQN-ILS below this share of its residual is none: no coupling of use has an eigenvalue as large.
STILL = 1e-11

#: Columns of the least-squares problem of Anderson mixing are dropped below this share of the largest.
RANK = 1e-8

#: The line search of the Newton rule shortens a step by a factor in this range, and gives up below the last length.
SHORTEST, LONGEST, TOO_SHORT = 0.1, 0.7, 1e-2

#: A rule within one run: from an iterate to the next g.
Step = Callable[[Iterate], Floats]

#: A rule within one run of any coupling: from g and T g to the next g, all of one shape (n,).
VectorStep = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class Metric:
    """The inner product by which a rule measures vectors: ``<a, b> = coordinates(a)' coordinates(b)``.

    ``inner`` takes two vectors to their inner product, ``coordinates`` a vector, or columns of vectors, to coordinates
    in an orthonormal basis.
    """

    inner: Callable[[Floats, Floats], float]
    coordinates: Callable[[Floats], Floats]

    @classmethod
    def of(cls, pair: ContactPair) -> Metric:
        """The norm (5.21) of a pair."""
        neumann = pair.neumann
        return cls(lambda a, b: inner(pair, a, b), lambda columns: neumann.root.T @ neumann.flexibility(columns))


#: The inner product of vectors of which nothing else is known; by functions that can be pickled.
EUCLIDEAN = Metric(np.dot, np.asarray)


class Rule(ABC):
    """A relaxation rule: a description without memory, which begins any number of runs.

    A user's own rule derives from it, and is handed to :func:`verification.run` as ``rule=``.

    Attributes
    ----------
    name : str
    words : str
        Its name in a sentence.
    needs_rho : bool
        True if :meth:`begin` needs rho, which is measured then.
    takes_theta : bool
        True if a given theta is used.  A rule without it needs rho, and :meth:`own_step` takes the place of theta.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    needs_rho: ClassVar[bool] = False
    takes_theta: ClassVar[bool] = True

    @abstractmethod
    def begin(self, pair: ContactPair, theta: float, rho: float | None) -> Step:
        """Begin a run.

        Parameters
        ----------
        pair : ContactPair
            The bodies; :func:`inner` is the inner product of the norm (5.21).
        theta : float
            The constant factor, or the first one.
        rho : float or None
            rho_normal without friction, else rho; None unless ``needs_rho``.

        Returns
        -------
        callable
            From an iterate to the g at which T is evaluated next; called with the iterates of one run, in order.
            A :class:`Relaxation` where (III) has one factor: its steps take one solve with the Neumann body less.
        """

    def on_vectors(self, theta: float, metric: Metric = EUCLIDEAN) -> VectorStep:
        """Begin a run of a coupling of which only g and T g are known.

        Raises
        ------
        ValueError
            The rule needs more than these vectors.
        """
        raise ValueError(f"relaxation {self.name!r} needs both bodies: needed a rule that works on vectors")

    def own_step(self, rho: float) -> float | None:
        """Return the step length that takes the place of theta; None where the rule takes the given theta."""
        return None

    def proved_rate(self, rho: float) -> float | None:
        """Return the proved rate of the rule where the theorem covers it; None without one."""
        return None

    def outside(self, friction: Fraction) -> str:
        """Return why no theorem covers this rule; empty where one does."""
        return f"the {self.name} relaxation: the theorem is about a constant theta"


def inner(pair: ContactPair, a: Floats, b: Floats) -> float:
    """Return the inner product of the norm (5.21)."""
    return float(a @ pair.neumann.flexibility(b))


@final
@dataclass(frozen=True)
class Relaxation:
    """(III) with one factor, which any linear function of g, as its displacement, follows too."""

    theta: float

    def __call__(self, iterate: Iterate) -> Floats:
        return self.mixed(iterate.g, iterate.image)

    def mixed(self, g: Floats, image: Floats) -> Floats:
        """Return the next g."""
        return self.theta * image + (1 - self.theta) * g


@dataclass(frozen=True)
class Constant(Rule):
    """(III): ``g <- theta T g + (1 - theta) g``."""

    name = "constant"
    words = "constant relaxation"

    def begin(self, pair: ContactPair, theta: float, rho: float | None) -> Step:
        return Relaxation(theta)

    def on_vectors(self, theta: float, metric: Metric = EUCLIDEAN) -> VectorStep:
        return Relaxation(theta).mixed

    def outside(self, friction: Fraction) -> str:
        return ""


class OfVectors(Rule):
    """A rule that needs only g, T g and an inner product."""

    @abstractmethod
    def on_vectors(self, theta: float, metric: Metric = EUCLIDEAN) -> VectorStep:
        """Begin a run of a coupling of which only g and T g are known."""

    def begin(self, pair: ContactPair, theta: float, rho: float | None) -> Step:
        following = self.on_vectors(theta, Metric.of(pair))
        return lambda iterate: following(iterate.g, iterate.image)


@dataclass(frozen=True)
class Aitken(OfVectors):
    """Aitken's factor ``theta <- -theta <r', r - r'> / |r - r'|^2`` from the last two residuals ``r = T g - g``.

    With the changes s of g and y of ``g - T g`` it is ``<s, y>/<y, y>``, the second step length of Barzilai and Borwein
    (1988).  Without friction y is a change of gradients in the inner product of (5.21).
    """

    name = "aitken"
    words = "Aitken relaxation"

    def on_vectors(self, theta: float, metric: Metric = EUCLIDEAN) -> VectorStep:
        return AitkenStep(theta, metric)


@dataclass
class AitkenStep:
    """Aitken's factor, and the residual of the step before."""

    theta: float
    metric: Metric
    last: Floats | None = None

    def __call__(self, g: Floats, image: Floats) -> Floats:
        r = image - g
        if self.last is not None:
            change = r - self.last
            size = self.metric.inner(change, change)
            if size > 0:
                self.theta *= -self.metric.inner(self.last, change) / size
        self.last = r
        return g + self.theta * r


@dataclass(frozen=True)
class Anderson(OfVectors):
    """Anderson mixing: the combination of the last g whose residuals have the least sum, relaxed by theta."""

    name = "anderson"
    words = "Anderson mixing"

    def on_vectors(self, theta: float, metric: Metric = EUCLIDEAN) -> VectorStep:
        return AndersonStep(theta, metric)


@dataclass
class AndersonStep:
    """The last g with their residuals."""

    theta: float
    metric: Metric
    gs: deque[Floats] = field(default_factory=lambda: deque(maxlen=DEPTH + 1))
    rs: deque[Floats] = field(default_factory=lambda: deque(maxlen=DEPTH + 1))

    def __call__(self, g: Floats, image: Floats) -> Floats:
        r = image - g
        self.gs.append(g)
        self.rs.append(r)
        following: Floats = g + self.theta * r
        if len(self.gs) > 1:
            coordinates = self.metric.coordinates(np.column_stack(self.rs))
            changes = np.diff(coordinates, axis=1)
            shares = np.linalg.lstsq(changes, coordinates[:, -1], rcond=RANK)[0]
            moved = np.diff(np.column_stack(self.gs), axis=1) + self.theta * np.diff(np.column_stack(self.rs), axis=1)
            following -= moved @ shares
        return following


@dataclass(frozen=True)
class InverseLeastSquares(OfVectors):
    """IQN-ILS of Degroote, Bathe and Vierendeels (2009): T g corrected by the changes of T g seen so far.

    The next g is ``T g - W c``, where V and W are the last changes of ``r = T g - g`` and of T g, and c minimises
    ``|r - V c|``.  It is Anderson mixing with the factor 1 and a longer memory, except for its first step, which has
    only the factor theta.
    """

    name = "iqn-ils"
    words = "IQN-ILS"

    def on_vectors(self, theta: float, metric: Metric = EUCLIDEAN) -> VectorStep:
        return InverseStep(theta, metric)


@dataclass
class InverseStep:
    """The last changes of r and of T g, in pairs, those of ``earlier`` steps in time, and the last r and T g."""

    theta: float
    metric: Metric
    changes: deque[tuple[Floats, Floats]] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    last: tuple[Floats, Floats] | None = None
    earlier: tuple[deque[tuple[Floats, Floats]], ...] = ()

    def next_step(self, reuse: int) -> InverseStep:
        """The rule in the next step in time, with the changes of the last steps, the newest ones first."""
        return InverseStep(self.theta, self.metric, earlier=(self.changes, *self.earlier)[:reuse])

    def __call__(self, g: Floats, image: Floats) -> Floats:
        r = self.metric.coordinates(image - g)
        if self.last is not None and (size := float(np.linalg.norm(r - self.last[0]))) > 0:
            # each as long as any other
            self.changes.append(((r - self.last[0]) / size, (image - self.last[1]) / size))
        self.last = r, image
        known = [*reversed(self.changes), *(filtered(self.changes, self.earlier) if self.earlier else ())]
        if not known:
            return g + self.theta * (image - g)
        V, W = (np.column_stack(columns) for columns in zip(*known, strict=True))
        following = np.asarray(image - W @ np.linalg.lstsq(V, r, rcond=RANK)[0])
        if np.linalg.norm(following - g) > STILL * np.linalg.norm(image - g):
            return following
        self.changes.clear()  # they are of other pieces of T: the rule would stay here for ever
        self.earlier = ()
        return g + self.theta * (image - g)


def filtered(
    changes: Iterable[tuple[Floats, Floats]], earlier: Sequence[Iterable[tuple[Floats, Floats]]]
) -> list[tuple[Floats, Floats]]:
    """The changes of earlier steps, the newest first, that show a direction of r which no newer one has shown."""
    kept, basis = list[tuple[Floats, Floats]](), list[Floats]()
    for own, pairs in ((True, changes), *((False, of) for of in earlier)):
        for v, w in reversed([*pairs]):
            rest = v - sum((q * (q @ v) for q in basis), np.zeros_like(v))
            size = float(np.linalg.norm(rest))
            if size > FILTER or own:
                basis += [rest / size] if size > 0 else []
                kept += [] if own else [(v, w)]
    return kept


@dataclass(frozen=True)
class Newton(Rule):
    """``g <- g + (1 - T')^-1 (T g - g)`` with T' on the affine piece of g, and a line search on the residual.

    A step that does not lessen the residual is shortened to where the chord between both residuals comes closest to 0;
    each trial costs an evaluation of T.  Where that fails, one step with theta leads to another piece.
    """

    name = "newton"
    words = "Newton relaxation"

    def begin(self, pair: ContactPair, theta: float, rho: float | None) -> Step:
        start: Iterate | None = None
        direction: Floats = np.zeros(0)
        length = 1.0

        def step(iterate: Iterate) -> Floats:
            nonlocal start, direction, length
            if start is None or iterate.residual < start.residual:
                start, direction, length = iterate, self._direction(pair, iterate, theta), 1.0
                return start.g + direction
            r = start.image - start.g
            change = iterate.image - iterate.g - r
            size = inner(pair, change, change)
            share = -inner(pair, r, change) / size if 0 < size < math.inf else SHORTEST
            length *= min(max(share, SHORTEST), LONGEST)
            if length < TOO_SHORT:
                following: Floats = start.g + theta * r
                start = None
                return following
            return start.g + length * direction

        return step

    @staticmethod
    def _direction(pair: ContactPair, iterate: Iterate, theta: float) -> Floats:
        r = iterate.image - iterate.g
        piece = piece_of(pair, iterate.g, iterate.contact.pattern)
        if piece.sign.any():  # a step from where a node is open leads to S sigma_N = 0 there, with the sign of rounding
            stress = np.abs(pair.interface.stress(iterate.g))
            piece = replace(piece, sign=np.where(stress > SLACK * stress.max(), piece.sign, 0).astype(np.int8))
        T = piece.force
        try:
            return np.asarray(np.linalg.solve(np.eye(len(r)) - T, r), dtype=float)
        except np.linalg.LinAlgError:  # the solution on this piece is not isolated
            return theta * r


@dataclass(frozen=True)
class Momentum(Rule):
    """The triple momentum method of Van Scoy, Freeman and Lynch (2018), with ``mu = 1`` and ``L = 1 + rho``.

    Without friction T - 1 is minus the gradient of an energy that is 1-strongly convex and (1 + rho)-smooth in the norm
    (5.21), so its proved rate ``p = 1 - 1/sqrt(1 + rho)`` holds.
    """

    name = "momentum"
    words = "triple momentum method"
    needs_rho = True
    takes_theta = False

    def begin(self, pair: ContactPair, theta: float, rho: float | None) -> Step:
        if rho is None:
            raise ValueError("momentum needs rho")
        p = momentum_rate(rho)
        length, beta, gamma = momentum_step(rho), p**2 / (2 - p), p**2 / ((1 + p) * (2 - p))
        last: tuple[Floats, Floats] | None = None

        def step(iterate: Iterate) -> Floats:
            nonlocal last
            xi, before = last or (iterate.g, iterate.g)
            following = xi + beta * (xi - before) + length * (iterate.image - iterate.g)
            last = following, xi
            return following + gamma * (following - xi)

        return step

    def own_step(self, rho: float) -> float:
        return momentum_step(rho)

    def proved_rate(self, rho: float) -> float:
        return momentum_rate(rho)

    def outside(self, friction: Fraction) -> str:
        return "momentum with friction: its rate is proved for k = 0 alone" if friction else ""


def momentum_rate(rho: float) -> float:
    """Return ``1 - 1/sqrt(1 + rho)``, the proved rate of the triple momentum method without friction.

    >>> momentum_rate(3.0)
    0.5
    """
    return 1 - 1 / math.sqrt(1 + rho)


def momentum_step(rho: float) -> float:
    """Return the length of its gradient step, which takes the place of theta."""
    return (1 + momentum_rate(rho)) / (1 + rho)


RULES.provide(Constant(), Aitken(), Anderson(), InverseLeastSquares(), Newton(), Momentum())


def rule_of(rule: Rule | str | type) -> Rule:
    """Return a rule, or the one of a name.

    Raises
    ------
    ValueError
        No rule has that name; a rule without a name or words; a class in place of its object.
    """
    if isinstance(rule, Rule):
        missing = [key for key in ("name", "words") if not hasattr(rule, key)]
        if missing:
            raise ValueError(f"rule {type(rule).__name__}: {missing[0]} is missing: needed a text")
        return rule
    if isinstance(rule, type):
        raise ValueError(f"rule {rule.__name__}: needed an object of this class, as {rule.__name__}()")
    if rule not in RULES:
        raise ValueError(f"relaxation {rule!r}: needed one of {', '.join(RULES)}, or a rule")
    found: Rule = RULES[rule]
    return found

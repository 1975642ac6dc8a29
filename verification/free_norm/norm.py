"""Factors, thetas and frictions in a norm that the proof may choose, on a mesh.

A search finds the border of what multipliers prove (:mod:`verification.free_norm.circle`).  Every number is then
checked with the norm itself: the quadratic form of the theorem is positive definite, with a bound on rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigvalsh, solve_triangular

from fem1d2d.mesh import Floats
from ndtheory.continuum.circle import disk
from verification.algorithm.rates import ForceNorm
from verification.constants import Measured
from verification.dense import symmetric
from verification.free_norm.circle import ABOVE, Circle, Circles
from verification.free_norm.radius import radius
from verification.free_norm.search import best_up_to
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.semidefinite import LMIError
from verification.semidefinite.conditions import times
from verification.semidefinite.interior_point import Weights
from verification.semidefinite.multipliers import QuadraticForms, on_the_safe_side
from verification.semidefinite.pattern_search import factor_search

#: How closely a border is known, relatively: of factors and of thetas, and of frictions.
NEAR, NEAR_FRICTION = 4e-3, 1e-2

#: Further inside by these shares of the border, one after the other, until a norm is found.
INSIDE = (0.0, 1e-3, 5e-3, 2e-2)

#: Programs for a border, at most; and how far inside and beyond its estimate they look, as a share of NEAR.
MOST, ASIDE = 30, 0.4

#: Frictions above this times the first one are not sought.
LARGEST = 2**12

#: The theta that stands for every small one: smaller ones contract as well.
SMALL = 0.01

#: Next to 0 and to 1 a factor is known up to NEAR times this share of theta.
COARSE = 0.05

#: The least circle beside 1 - theta that is tried.
LEAST = 1e-3

#: How closely the best theta is sought, and the factors of those beside it.
THETA, ROUGH = 2e-2, 1e-2


@dataclass(frozen=True, kw_only=True, eq=False)
class Proved:
    """A factor of one step in a norm.

    ``theta`` and ``factor`` are checked: the form is positive definite, rounding included; ``multipliers`` are as
    :class:`verification.semidefinite.multipliers.Certified` has them.
    """

    theta: float
    factor: float
    norm: ForceNorm
    multipliers: Weights


class FreeNorm:
    """Contraction of a pair of bodies in a free norm, up to a friction; parameters as for :class:`QuadraticForms`.

    Examples
    --------
    >>> from verification import build, example, measure
    >>> pair = build(example("section6-60"))
    >>> found = FreeNorm(pair, measure(pair)).factor(0.7)
    >>> 0.30 < found.factor < 0.35 < QuadraticForms(pair, measure(pair)).factor(0.7).value
    True
    """

    def __init__(self, pair: ContactPair, measured: Measured, *, friction: float | None = None) -> None:
        self.pair = pair if friction is None else pair.at(friction=friction)
        self.forms = QuadraticForms(pair, measured, friction=friction)
        self._circles = Circles(self.forms)

    @one_thread()
    def factor(self, theta: float, near: float = NEAR) -> Proved | None:
        """The least factor of T_theta in any norm that is found, 0 < theta < 1; None where none below 1 is."""
        search = factor_search(self.pair, theta)
        stuck = search.piece(*search.extremes()[0]).relaxed(theta)
        low, high = max(radius(stuck), 1 - theta), 1.0
        low += LEAST * (1 - low)
        energy = None
        with suppress(LMIError):
            energy = self.forms.factor(theta)
            high = min(energy.value, 1.0)
        high = high if low < high else 1.0
        at = lambda q: self._circles.find(disk(theta, q))
        border = _border(at, high, low, lambda q: near * max(min(q, 1 - q), COARSE * theta)) or (high, at(high))
        found: Proved | None = None
        known = (1 + near) * border[0]
        for proof in filter(None, (self._inside(theta, border, share, at) for share in INSIDE)):
            found = proof if found is None or proof.factor < found.factor else found
            if found.factor <= known:  # a norm may prove less than its circle promised
                break
        if energy is not None and energy.value < 1 and (found is None or energy.value <= max(known, found.factor)):
            size = 1 + ABOVE  # nothing is gained, as without friction
            return self._proof(theta, size * np.eye(self.forms.size), times(size, energy.multipliers)) or found
        return found

    @one_thread()
    def largest_theta(self) -> Proved | None:
        """A theta up to which every one contracts, as large as is found: with 1 as its factor; None without one."""
        at = lambda theta: self._circles.find(disk(theta, 1.0))
        found = at(1.0)
        border = (1.0, found) if found is not None else _border(at, 0.0, 1.0, lambda theta: NEAR * theta)
        if border is None:
            return None
        thetas = (border[0] * (1 - share) for share in INSIDE)
        proofs = (
            self._at_most(theta, 1.0, border[1] if theta == border[0] else at(theta), factor=1.0) for theta in thetas
        )
        return next(filter(None, proofs), None)

    def every_small_theta(self) -> Proved | None:
        """The proof that every theta up to SMALL contracts; None where none is found."""
        with one_thread():
            return self._at_most(SMALL, 1.0, self._circles.find(disk(SMALL, 1.0)), factor=1.0)

    def best_theta(self, largest: float) -> Proved | None:
        """The proof for the theta whose factor is least, below the largest one that contracts."""
        factor = lambda theta: 1.0 if (proof := self.factor(theta, ROUGH)) is None else proof.factor
        return self.factor(best_up_to(largest, factor, THETA))

    def _inside(
        self, theta: float, border: tuple[float, Circle | None], share: float, at: Callable[[float], Circle | None]
    ) -> Proved | None:
        """The proof of a factor further from 0 than its border by a share of what is left to 1."""
        q = border[0] + share * (1 - border[0])
        return self._at_most(theta, q, at(q) if share else border[1])

    def _at_most(self, theta: float, q: float, circle: Circle | None, factor: float | None = None) -> Proved | None:
        """The proof of a factor, the least one by default, from a circle of q."""
        found = None if circle is None else self._circles.norm(theta, q, circle)
        return None if found is None else self._proof(theta, *found, factor=factor)

    def _proof(self, theta: float, norm: Floats, multipliers: Weights, factor: float | None = None) -> Proved | None:
        """The proof by a norm, in coordinates in which (5.21) is Euclidean, and its multipliers.

        Of a factor, or of the least one below 1 by default.
        """
        back = solve_triangular(self.pair.neumann.root, np.eye(len(norm)), lower=True)
        Q = symmetric(back.T @ norm @ back)
        holds = self.forms.traces.in_norm(Q, multipliers, step=(theta, 1 - theta))
        if factor is None:
            square = self._least_square(theta, norm, multipliers)
            safe = None if square is None else on_the_safe_side(square, holds)
            if safe is None or not safe < 1:
                return None
            factor = math.nextafter(math.sqrt(safe), math.inf)
        elif not holds(factor**2):
            return None
        of_forces = ForceNorm(matrix=Q, condition=float(np.linalg.cond(norm)))
        return Proved(theta=theta, factor=factor, norm=of_forces, multipliers=multipliers)

    def _least_square(self, theta: float, norm: Floats, multipliers: Weights) -> float | None:
        """The least q^2 for which the form is positive semidefinite in doubles; None where there is none."""
        forms, N = self.forms, self.forms.size
        step = theta * forms.p + (1 - theta) * forms.g
        taken = step.T @ norm @ step + forms.conditions(multipliers)
        try:
            inner = cho_solve(cho_factor(-taken[N:, N:]), taken[N:, :N])
        except np.linalg.LinAlgError:
            return None
        return float(eigvalsh(taken[:N, :N] + taken[:N, N:] @ inner, norm)[-1])


def friction_threshold(
    pair: ContactPair, measured: Measured, start: float, *, progress: Progress = silent
) -> tuple[float, Proved]:
    """A friction up to which every small theta contracts in a free norm, close to the largest found, and the proof.

    ``start`` is a friction to begin with, as the threshold in energy norms.

    Raises
    ------
    LMIError
        None is found.
    """

    def at(k: float) -> Circle | None:
        progress(f"free norm: friction threshold, k = {k:.3g} is tried", None)
        with one_thread():
            return Circles(QuadraticForms(pair, measured, friction=k)).find(disk(SMALL, 1.0))

    low, high = 0.0, start
    while at(high) is not None:
        low, high = high, 2 * high
        if high > LARGEST * start:
            raise LMIError(f"no friction up to {low:.3g} is found at which small thetas do not contract")
    border = _border(at, low, high, lambda k: NEAR_FRICTION * k)
    for share in INSIDE:
        k = (low if border is None else border[0]) * (1 - share)
        if k and (proof := FreeNorm(pair, measured, friction=k).every_small_theta()) is not None:
            return k, proof
    raise LMIError("no friction is found at which small thetas contract")


def _border(
    at: Callable[[float], Circle | None], inside: float, outside: float, near: Callable[[float], float]
) -> tuple[float, Circle] | None:
    """The value nearest to the border of where something is found, between one inside and one outside.

    Close to the border margins grow like the square of the distance, so their roots point to it.  ``near`` is how
    closely it must be known at a value.  None where nothing is found but ``inside``, at which nothing is looked for.
    """
    best: tuple[float, Circle] | None = None
    seen: list[tuple[float, float]] = []
    value = (inside + outside) / 2
    for _ in range(MOST):
        found = at(value)
        if found is None:
            outside = value
        else:
            inside, best = value, (value, found)
            seen.append((value, math.sqrt(max(found.margin, 0.0))))
        width, known = outside - inside, near(outside if best is None else inside)
        if abs(width) <= known:
            break
        value = inside + width / 2
        if len(seen) > 1 and (slope := seen[-1][1] - seen[-2][1]):
            guess = seen[-1][0] - seen[-1][1] * (seen[-1][0] - seen[-2][0]) / slope
            aside = math.copysign(ASIDE * known, width)
            guess += -aside if abs(guess - inside) > known else aside
            if 0 < (guess - inside) / width < 1:
                value = guess
    return best

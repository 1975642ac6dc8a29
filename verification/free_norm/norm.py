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
from scipy.optimize import minimize_scalar

from fem1d2d.mesh import Floats
from ndtheory.continuum.circle import disk
from verification.constants import Measured
from verification.free_norm.circle import Circle, Circles
from verification.free_norm.radius import radius
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.semidefinite.interior_point import LMIError, Weights
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

#: The least circle beside 1 - theta that is tried.
LEAST = 1e-3

#: How closely the best theta is sought, and the factors of those beside it.
THETA, ROUGH = 1e-2, 1e-2


@dataclass(frozen=True, kw_only=True, eq=False)
class Proved:
    """A factor of one step in a norm.

    Attributes
    ----------
    theta, factor : float
        Checked: the form is positive definite, rounding included.
    Q : array, shape (N, N)
        ``|g|_Q^2 = g' Q g``, never below the norm (5.21).
    condition : float
        The largest ``|g|_Q^2/|||g|||^2``, the least being 1.
    multipliers : tuple of arrays
        As :class:`verification.semidefinite.multipliers.Certified` has them.
    """

    theta: float
    factor: float
    Q: Floats
    condition: float
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
        self.pair, self.forms = pair, QuadraticForms(pair, measured, friction=friction)
        self._circles = Circles(self.forms)

    @one_thread()
    def factor(self, theta: float, near: float = NEAR) -> Proved | None:
        """The least factor of T_theta in any norm that is found, 0 < theta < 1; None where none below 1 is."""
        low, high = max(self._stuck(theta), 1 - theta), 1.0
        low += LEAST * (1 - low)
        with suppress(LMIError):
            high = min(self.forms.factor(theta).value, 1.0)
        high = high if low < high else 1.0
        return self._proved(theta, _border(lambda q: self._circles.find(disk(theta, q)), high, low, near), high)

    @one_thread()
    def largest_theta(self) -> Proved | None:
        """A theta up to which every one contracts, as large as is found: with 1 as its factor; None without one."""
        at = lambda theta: self._circles.find(disk(theta, 1.0))
        found = at(1.0)
        border = (1.0, found) if found is not None else _border(at, 0.0, 1.0, NEAR)
        for share in INSIDE:
            if border is None or border[1] is None:
                return None
            theta = border[0] * (1 - share)
            if (proof := self._checked(theta, 1.0, border[1] if not share else at(theta))) is not None:
                return proof
        return None

    def every_small_theta(self) -> Proved | None:
        """The proof that every theta up to SMALL contracts; None where none is found."""
        with one_thread():
            return self._checked(SMALL, 1.0, self._circles.find(disk(SMALL, 1.0)))

    def best_theta(self, largest: float) -> Proved | None:
        """The proof for the theta whose factor is least, below the largest one that contracts."""

        def factor(theta: float) -> float:
            found = self.factor(theta, ROUGH)
            return 1.0 if found is None else found.factor

        found = minimize_scalar(factor, bounds=(0.0, largest), method="bounded", options={"xatol": THETA})
        return self.factor(round(float(found.x), 3))

    def _stuck(self, theta: float) -> float:
        """The largest spectral radius of two pieces of T_theta, which no norm beats."""
        search = factor_search(self.pair, theta)
        radii = (radius(search.found(*pattern).piece.relaxed(theta)) for pattern in search.extremes())
        return max(radii) if self.forms.k == float(self.pair.friction) else 0.0

    def _proved(self, theta: float, border: tuple[float, Circle | None] | None, high: float) -> Proved | None:
        if border is None:
            border = high, self._circles.find(disk(theta, high))
        for share in INSIDE:
            q = border[0] * (1 + share)
            circle = border[1] if not share else self._circles.find(disk(theta, q))
            if q <= 1 and (proof := self._checked(theta, q, circle)) is not None:
                return proof
        return None

    def _checked(self, theta: float, q: float, circle: Circle | None) -> Proved | None:
        """The proof by the multipliers of a circle, its factor as small as they allow but for q = 1."""
        found = None if circle is None else self._circles.norm(theta, q, circle)
        if found is None:
            return None
        norm, multipliers = found
        back = solve_triangular(self.pair.neumann.root, np.eye(len(norm)), lower=True)
        Q = back.T @ norm @ back
        Q = (Q + Q.T) / 2
        holds = self.forms.traces.in_norm(Q, multipliers, step=(theta, 1 - theta))
        condition = float(np.linalg.cond(norm))
        if q == 1:
            proved = holds(1.0)
            return (
                Proved(theta=theta, factor=1.0, Q=Q, condition=condition, multipliers=multipliers) if proved else None
            )
        square = self._least_square(theta, norm, multipliers)
        safe = None if square is None else on_the_safe_side(square, holds)
        if safe is None or not safe < 1:
            return None
        factor = math.nextafter(math.sqrt(safe), math.inf)
        return Proved(theta=theta, factor=factor, Q=Q, condition=condition, multipliers=multipliers)

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


def friction_threshold(pair: ContactPair, measured: Measured, start: float, *, progress: Progress = silent) -> float:
    """A friction below which every small theta contracts in a free norm, close to the largest that is found.

    ``start`` is a friction to begin with, as that of the theorem in energy norms.

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
    border = _border(at, low, high, NEAR_FRICTION)
    for share in INSIDE:
        k = (low if border is None else border[0]) * (1 - share)
        if k and FreeNorm(pair, measured, friction=k).every_small_theta() is not None:
            return k
    raise LMIError("no friction is found at which small thetas contract")


def _border(
    at: Callable[[float], Circle | None], inside: float, outside: float, near: float
) -> tuple[float, Circle | None] | None:
    """The value nearest to the border of where something is found, between one inside and one outside.

    Close to the border margins grow like the square of the distance, so their roots point to it.  None where nothing
    is found but ``inside``, at which nothing is looked for.
    """
    best: tuple[float, Circle] | None = None
    seen: list[tuple[float, float]] = []
    value, size = (inside + outside) / 2, max(abs(inside), abs(outside))
    for _ in range(MOST):
        found = at(value)
        if found is None:
            outside = value
        else:
            inside, best = value, (value, found)
            seen.append((value, math.sqrt(max(found.margin, 0.0))))
        if best is not None:
            size = abs(best[0])
        width = outside - inside
        if abs(width) <= near * size:
            break
        value = inside + width / 2
        if len(seen) > 1 and (slope := seen[-1][1] - seen[-2][1]):
            guess = seen[-1][0] - seen[-1][1] * (seen[-1][0] - seen[-2][0]) / slope
            aside = math.copysign(ASIDE * near * size, width)
            guess += -aside if abs(guess - inside) > near * size else aside
            if 0 < (guess - inside) / width < 1:
                value = guess
    return best

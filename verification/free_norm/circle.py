"""The circle criterion on a mesh: T_theta contracts by q in some norm where a form of step II is definite.

Let g, p and v be the differences of two forces, of what step II makes of them, and of the jumps, and ``Sigma(g, p) >=
0`` the sum of the conditions of contact and friction with multipliers (:mod:`verification.semidefinite.multipliers`).
There is a Q > 0 for which::

    q^2 g' Q g - |theta p + (1 - theta) g|_Q^2 - Sigma(g, p)

is positive definite, if and only if ``M(h) = -Sigma(h p, p)`` is for every complex ``h = theta/(z - (1 - theta))``,
``|z| = q > 1 - theta``.  So Q is not in the programs for multipliers; an equation of Riccati gives it afterwards.  The
proof is in ``docs/free_norm.md``.

In traces d_1 of the contact body p and v are bounded, so that M(h) has the size of the multipliers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh, solve_discrete_are

from fem1d2d.mesh import Floats
from verification.semidefinite import LMIError
from verification.semidefinite.conditions import times
from verification.semidefinite.interior_point import Indices, Program, Stop, Weights, solve
from verification.semidefinite.multipliers import QuadraticForms

#: Points of a half circle at which M is looked at; those that a program begins with, and the most that it has.
LOOKS, KEPT, MOST = 17, 3, 6

#: The first ones, by the share of the ends that their real parts have.
LOOKED_AT = np.sin(np.linspace(0, np.pi / 2, LOOKS)) ** 2

#: A program has another point where M is smaller there than at its own points by this share.
BETWEEN = 0.2

#: A program ends once its value is known up to this share; one below NOTHING is 0.
STOP, NOTHING = Stop(accuracy=1e-2), 1e-6

#: The multipliers with which a program begins, times known ones, and tau beside a and b; lambda is at most 1.
START, INSIDE = 0.5, 0.9

#: Q is above 1 by this.
ABOVE = 1e-6

#: Rows shorter than this beside the longest one of their kind are 0.
ROUNDING = 1e-11

#: Shares of what M leaves that are taken away before Q is sought: the more, the better its condition.
SHARES = (0.5, 0.1, 0.01)

#: Both points of the real axis on a circle of h, as :func:`ndtheory.continuum.circle.disk` has them.
Ends = tuple[float, float]
Complex = Any  # an array of complex numbers


@dataclass(frozen=True, kw_only=True, eq=False)
class Circle:
    """A circle on which M is positive definite, with multipliers in the order of a program.

    ``margin`` is the least eigenvalue of M, by the points looked at, where lambda is at most 1; ``largest`` is the
    largest ``|h|``.
    """

    margin: float
    largest: float
    y: Floats


def everywhere(
    program: Callable[[list[Any]], Program], least: Callable[[Floats], tuple[float, Any]], at: list[Any], most: int
) -> tuple[Floats, float, list[Any]] | None:
    """Multipliers with which M > 0 at all points, its least eigenvalue there, and the few points of their program.

    The worst of all points is added to a program until it is so; None where there are no multipliers.
    """
    while len(at) < most:
        try:
            found = solve(program(at))
        except LMIError:
            return None
        if not found.s < -NOTHING:
            return None
        margin, where = least(found.y)
        if margin >= -BETWEEN * found.s:
            return found.y, margin, at
        at = [*at, where]
    return None


class Circles:
    """The programs for multipliers on circles, for one pair of bodies and one friction.

    Where the pair is its own mirror image, a node and its image have one multiplier, and M falls apart into two.
    """

    def __init__(self, forms: QuadraticForms) -> None:
        self.forms, N = forms, forms.size
        self._points = [0.0, 1.0]
        self._back = forms.p[:, N:]
        whole = forms.program(np.zeros_like(forms.free), forms.everywhere, forms.towards_zero)
        self._place = np.arange(len(whole.y))
        bases: tuple[Floats, ...] = (np.eye(self._back.shape[1]),)
        if forms.mirror is not None:
            whole, self._place = forms.mirror.halved(whole)
            bases = forms.mirror.parts
        alone = np.setdiff1d(np.arange(len(whole.y)), whole.cones)
        start, most = START * whole.y, np.full(len(whole.y), np.inf)
        most[alone] = 1.0
        start[whole.cones[:, 0]] *= INSIDE
        tie = np.eye(len(whole.y)) if whole.tie is None else whole.tie
        self._program = replace(whole, y=start, most=most, tie=np.vstack([tie, tie]), stop=STOP)
        t, count = len(whole.cones), len(whole.left)
        kinds = np.array([0, count - 3 * t, count - 2 * t, count - t] if t else [0])
        rows = [_reached(each, kinds) for each in (whole.left, whole.right)]
        self._parts = [[(r[:, :N] @ self._back @ basis, r[:, N:] @ basis) for r in rows] for basis in bases]

    def find(self, ends: Ends) -> Circle | None:
        """Multipliers for which M is positive definite on the circle with some ends; None where there are none."""
        found = everywhere(lambda at: self._on(ends, at), lambda y: self._least(ends, y), self._points, MOST)
        if found is None:
            return None
        y, margin, at = found
        self._points = at[:KEPT]  # circles nearby need the same
        return Circle(margin=margin, largest=max(map(abs, ends)), y=y)

    def norm(self, theta: float, q: float, circle: Circle) -> tuple[Floats, Weights] | None:
        """Q in coordinates in which (5.21) is Euclidean, and multipliers node by node, from a circle of theta and q.

        Q is above 1.  None where the equation has no solution in doubles.
        """
        N, back = self.forms.size, self._back
        of_g = 1 / (1 + (circle.largest * np.linalg.norm(back, 2)) ** 2)
        multipliers = self.forms.by_node(circle.y[self._place], self.forms.everywhere)
        sums = self.forms.conditions(multipliers)
        for share in SHARES:
            spare = np.concatenate([np.full(N, of_g), np.ones(back.shape[1])]) * share * circle.margin / 2
            F = -(sums + np.diag(spare)) / q**2
            still = (1 - theta) / q * np.eye(N)
            try:
                found = -solve_discrete_are(still, theta / q * back, F[:N, :N], F[N:, N:], s=F[:N, N:])
            except np.linalg.LinAlgError:
                continue
            least = float(eigvalsh(found)[0]) * (1 - ABOVE)
            if least > 0:
                return np.asarray(found + found.T) / (2 * least), times(1 / least, multipliers)
        return None

    def _on(self, ends: Ends, at: list[float]) -> Program:
        """The program that maximises the least eigenvalue of M at some points of a circle."""
        columns, sizes = [], []
        for h in (point(ends, u) for u in at):
            for both in self._parts:
                rows = [h * of_g + of_p for of_g, of_p in both]
                columns.append([real_rows(r) if h.imag else np.vstack([r.real, 0 * r.real]) for r in rows])
                sizes.append(columns[-1][0].shape[1])
        left, right = (np.hstack(list(rows)) for rows in zip(*columns, strict=True))
        edges = np.cumsum([0, *sizes])
        blocks = tuple(slice(a, b) for a, b in pairwise(edges.tolist()))
        size = len(left[0])
        program = replace(
            self._program, fixed=np.zeros((size, size)), free=np.eye(size), left=left, right=right, blocks=blocks
        )
        least = min(float(np.linalg.eigvalsh(form)[0]) for u in at for form in self._forms(point(ends, u), program.y))
        return replace(program, s=1 + abs(least) - least)

    def _forms(self, h: complex, y: Floats) -> Iterator[Complex]:
        """M(h) with some multipliers, in each part."""
        assert self._program.tie is not None
        by_row = (self._program.tie @ y)[: len(self._program.left)]
        for both in self._parts:
            a, b = (h * of_g + of_p for of_g, of_p in both)
            form = -a.conj().T @ (by_row[:, None] * b)
            yield (form + form.conj().T) / 2

    def _least(self, ends: Ends, y: Floats) -> tuple[float, float]:
        """The least eigenvalue of M among the points looked at, and where it is."""
        at = LOOKED_AT
        low, middle, high = (list(self._forms(point(ends, u), y)) for u in (0.0, 0.5, 1.0))
        values = np.full(len(at), np.inf)
        u = at[:, None, None]
        for a, m, b in zip(low, middle, high, strict=True):
            turn = 2 * m.imag  # the only part that is not linear in u
            form = (1 - u) * a.real + u * b.real + 1j * np.sqrt(u * (1 - u)) * turn
            values = np.minimum(values, np.linalg.eigvalsh(form)[:, 0])
        return float(values.min()), float(at[np.argmin(values)])


def point(ends: Ends, u: Any) -> Any:
    """The point h of the upper half of a circle whose real part divides its ends as u does, or several."""
    low, high = ends
    return low + u * (high - low) + 1j * (high - low) * np.sqrt(u * (1 - u))


def _reached(rows: Floats, kinds: Indices) -> Floats:
    """Rows, but 0 for those that only rounding keeps from it, as of a node at the end of a kernel.

    ``kinds`` are the first rows of each kind.
    """
    lengths = np.linalg.norm(rows, axis=1)
    longest = np.repeat(np.maximum.reduceat(lengths, kinds), np.diff([*kinds, len(rows)]))
    return np.asarray(np.where(lengths > ROUNDING * longest, 1.0, 0.0)[:, None] * rows)


def real_rows(rows: Complex) -> Floats:
    """Rows whose products, in pairs, are the real parts of those of complex rows."""
    return np.vstack([np.hstack([rows.real, -rows.imag]), np.hstack([rows.imag, rows.real])])

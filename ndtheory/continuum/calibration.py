r"""Lower bounds of the energy of a rectangle, proved by a field of symmetric tensors of order three.

A rectangle ``0 < x < l, 0 < y < 1`` with G = 1 is clamped at y = 0, and its side y = 1 carries Gamma_c.  Let M be a
field of tensors of order three, symmetric in all three indices, and let ``M w`` be the stress ``M_ijk w_k``.  Then::

    a(w) = int |e(w) - C^-1 M w|^2 + int R_jk w_j w_k + int over the boundary of n_i M_ijk w_j w_k,
    R_jk = -d_i M_ijk - (C^-1 M : M)_jk ,

because ``2 M w : e(w) = M_ijk d_i (w_j w_k)``.  So bounds of R in the body and of ``n M`` on its sides bound a(w).
Here ``M = N/y`` with N bilinear on each cell of a grid.  By Bernstein's coefficients, finitely many conditions on the
values of N at the nodes, all of them in rational numbers, prove (``docs/continuum.md``)::

    a(w) >= sum over the columns of  tau int w_T^2 over its part of y = 1  +  beta int q(w) over the column,
    q(w) = (kappa+1)/(kappa-1) w_x^2 + w_y^2 ,

for every w that vanishes at y = 0.  q is what a cut-off along x costs: ``(lambda + 2 G) w_x^2 + G w_y^2``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from ndtheory.continuum.intervals import Interval
from ndtheory.errors import HypothesisError

#: A symmetric tensor of order three, by the number of indices y: xxx, xxy, xyy, yyy.
Cubic = tuple[Fraction, Fraction, Fraction, Fraction]

#: A form in two variables: xx, xy, yy.
Form = tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A field N that proves its inequality; HypothesisError for one that does not.

    Attributes
    ----------
    kappa : Fraction
        Kolosov's constant, > 1.
    x, y : tuple of Fraction
        The lines of the grid, in thicknesses: x from 0 to the length of the body, y from 0 at the clamped side to 1.
    nodes : tuple of tuple of Cubic
        N at (x[i], y[j]) is ``nodes[i][j]``.
    tau, beta : tuple of Fraction
        The weights of each column of cells, >= 0.

    Examples
    --------
    One cell proves ``|w_T|^2 <= 20 a(w)`` on the whole side of a body of length 4:

    >>> zero, tenth = Fraction(0), Fraction(1, 10)
    >>> left, right = (-tenth, tenth, -tenth, 5 * tenth), (tenth, tenth, tenth, 5 * tenth)
    >>> grid = {"x": (zero, Fraction(4)), "y": (zero, Fraction(1)), "nodes": ((left, left), (right, right))}
    >>> proof = Calibration(kappa=Fraction(9, 5), **grid, tau=(Fraction(1, 20),), beta=(zero,))
    >>> proof.trace(zero, Fraction(4))
    Fraction(1, 20)
    """

    kappa: Fraction
    x: tuple[Fraction, ...]
    y: tuple[Fraction, ...]
    nodes: tuple[tuple[Cubic, ...], ...]
    tau: tuple[Fraction, ...]
    beta: tuple[Fraction, ...]

    def __post_init__(self) -> None:
        grown = len(self.x) > 1 and all(a < b for line in (self.x, self.y) for a, b in pairwise(line))
        if not (grown and self.x[0] == self.y[0] == 0 and self.y[-1] == 1 and self.kappa > 1):
            raise HypothesisError("calibration", "a grid", "lines that grow, x from 0, y from 0 to 1, and kappa > 1")
        shape = [len(line) for line in self.nodes] == [len(self.y)] * len(self.x)
        if not shape or {tuple(map(type, cubic)) for line in self.nodes for cubic in line} != {(Fraction,) * 4}:
            raise HypothesisError("calibration", "a field", "four rational numbers (Fraction) at each node of the grid")
        columns = len(self.x) - 1
        if not len(self.tau) == len(self.beta) == columns or min(*self.tau, *self.beta) < 0:
            raise HypothesisError("calibration", "its weights", f"numbers >= 0 for {columns} columns of cells")
        if not all(xx >= 0 and yy >= 0 and xx * yy >= xy * xy for xx, xy, yy in self._forms()):
            raise HypothesisError("calibration", "a field", "one that proves the inequality")

    def _forms(self) -> Iterator[Form]:
        """All forms that must be nonnegative: on the free sides, on the side of Gamma_c, inside each cell."""
        for first, last in zip(self.nodes[0], self.nodes[-1], strict=True):
            yield -first[0], -first[1], -first[2]
            yield last[0], last[1], last[2]
        for i, line in enumerate(self.nodes):
            _, along, mixed, across = line[-1]
            yield along - max(self.tau[max(i - 1, 0) : i + 1]), mixed, across
        for i in range(len(self.tau)):
            for j in range(len(self.y) - 1):
                for own in (i, i + 1):
                    yield from self._inside(i, j, own)

    def _inside(self, i: int, j: int, own: int) -> list[Form]:
        """The forms of Bernstein's coefficients of ``y^2 (R - beta q)`` on the side x[own] of a cell."""
        low, high = self.y[j], self.y[j + 1]
        width = self.x[i + 1] - self.x[i]
        left, right, lower, upper = self.nodes[i], self.nodes[i + 1], self.nodes[own][j], self.nodes[own][j + 1]
        rising = [(b - a) / (high - low) for a, b in zip(lower, upper, strict=True)]
        # the divergence of N in the pairs xx, xy, yy at both ends of the side, between which it is linear
        below = [(right[j][p] - left[j][p]) / width + rising[p + 1] for p in range(3)]
        above = [(right[j + 1][p] - left[j + 1][p]) / width + rising[p + 1] for p in range(3)]
        middle = tuple((a + b) / 2 for a, b in zip(lower, upper, strict=True))
        stretched = self.beta[i] * (self.kappa + 1) / (self.kappa - 1)
        found = []
        for value, square, divergence in (
            (lower, low * low, [low * d for d in below]),
            (middle, low * high, [(low * b + high * a) / 2 for a, b in zip(below, above, strict=True)]),
            (upper, high * high, [high * d for d in above]),
        ):
            xx, xy, yy = (value[p + 1] - divergence[p] for p in range(3))
            of_x, of_y = (value[0], value[1], value[2]), (value[1], value[2], value[3])
            found.append(
                (
                    xx - self._energy(of_x, of_x) - square * stretched,
                    xy - self._energy(of_x, of_y),
                    yy - self._energy(of_y, of_y) - square * self.beta[i],
                )
            )
        return found

    def _energy(self, s: Sequence[Fraction], t: Sequence[Fraction]) -> Fraction:
        """``C^-1 s : t`` of two stresses (xx, xy, yy) for G = 1."""
        trace = (3 - self.kappa) / 4 * (s[0] + s[2]) * (t[0] + t[2])
        return (s[0] * t[0] + 2 * s[1] * t[1] + s[2] * t[2] - trace) / 2

    def trace(self, lo: Fraction, hi: Fraction) -> Fraction:
        """The least tau of the columns between two numbers: ``a(w) >= tau int w_T^2`` over that part of y = 1."""
        return min(tau for tau, (a, b) in zip(self.tau, pairwise(self.x), strict=True) if a < hi and b > lo)

    def reach(self, lo: Fraction, hi: Fraction) -> Interval:
        """``int sqrt(beta) dx`` over the columns between two numbers, at least; see :func:`loss`."""
        columns = zip(self.beta, pairwise(self.x), strict=True)
        parts = [(b - a) * Interval.of(beta).sqrt() for beta, (a, b) in columns if lo <= a and b <= hi]
        return sum(parts, Interval.of(0))


def loss(reach: Interval) -> Fraction:
    """An upper bound of ``1/sinh^2(s)`` for the lower end s > 0 of an interval: eps of the cut-off tanh.

    Let ``s(x)`` be the integral of sqrt(beta) from a free side and s its value at Gamma_c.  For lifts v

        a(chi v) <= (1 + 1/sinh^2 s) a(v),   chi = tanh(s(x))/tanh(s) beside Gamma_c, and 1 on Gamma_c.

    Examples
    --------
    >>> round(float(loss(Interval.of(1))), 6), round(float(loss(Interval.of(Fraction(1, 10)))), 3)
    (0.724062, 99.667)
    """
    grown = Interval(reach.lo, reach.lo).exp()
    return Fraction((4 / (grown - 1 / grown).square()).hi)

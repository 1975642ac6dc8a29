"""Calibrations of a rectangle with large weights, found by a conic solver; :mod:`ndtheory.continuum.calibration` checks
them.

The conditions on the values of the field at the nodes are linear matrix inequalities: by Schur's complement
``A - N C^-1 N >= 0`` says that the matrix of A, N and C is positive semidefinite.  The solver works in doubles, so that
its answer is a proposal.  Each condition has a little room, which rounding to rational numbers uses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise

import clarabel
import numpy as np
from scipy import sparse

from ndtheory.continuum.calibration import Calibration, Cubic
from ndtheory.errors import HypothesisError
from verification.machine.threads import one_thread

#: Lines of the grid between the clamped side and Gamma_c: finer towards Gamma_c, where the fields turn fastest.
DEPTHS = tuple(Fraction(n, 100) for n in (0, 30, 55, 75, 88, 95, 100))

#: Length of the shortest cells beside ends of the body and of Gamma_c, in thicknesses, and how fast cells grow there.
SHORTEST, GROWTH = 0.05, 1.5

#: Room in each condition, tried one after the other: the solver often stops at 1e-6.
ROOMS = (1e-6, 1e-5, 1e-4)

#: From here on kappa - 1, by which the solver divides, has digits enough in doubles.
NEAR = Fraction(1, 10**6)

#: Binary digits after the point of a number of the field.
DIGITS = 32

#: A linear form in the unknowns: coefficients by index.
Terms = Mapping[int, float]

#: A field at the nodes, and the weights tau and beta of the columns.
Proposal = tuple[tuple[tuple[Cubic, ...], ...], tuple[Fraction, ...], tuple[Fraction, ...]]


def lines(points: Sequence[Fraction]) -> list[Fraction]:
    """The lines of a grid through some points, finer towards each of them.

    Examples
    --------
    >>> [round(float(x), 2) for x in lines([Fraction(0), Fraction(1)])]
    [0.0, 0.04, 0.09, 0.18, 0.31, 0.5, 0.69, 0.82, 0.91, 0.96, 1.0]
    """
    found = [points[0]]
    for lo, hi in pairwise(points):
        half, ends = float(hi - lo) / 2, [0.0]
        step = max(SHORTEST, half / 2**10)  # what rounding leaves apart
        while ends[-1] < half * (1 - 1e-9):  # rounding must not add a cell
            ends.append(ends[-1] + step)
            step *= GROWTH
        shares = [Fraction(round(end / ends[-1] * 2**15), 2**16) for end in ends]
        found += [lo + (hi - lo) * share for share in shares[1:]]
        found += [hi - (hi - lo) * share for share in shares[-2::-1]]
    return found


@lru_cache(maxsize=32)
def for_traces(length: Fraction, lo: Fraction, hi: Fraction, kappa: Fraction) -> Calibration | None:
    """A calibration with a large tau on Gamma_c, the part from lo to hi; lengths in thicknesses.

    None if the solver found no field that passes the check.
    """
    x = lines(sorted({Fraction(0), lo, hi, length}))
    columns = [i for i, a in enumerate(x[:-1]) if lo <= a < hi]
    return _first(x, kappa, lambda program: program.tracing(columns))


@lru_cache(maxsize=32)
def for_cut_off(length: Fraction, lo: Fraction, hi: Fraction, kappa: Fraction) -> Calibration | None:
    """A calibration with a large reach of both parts beside Gamma_c, 0 < lo < hi < length; None as above."""
    x = lines([Fraction(0), lo, hi, length])
    sides = [[i for i, a in enumerate(x[:-1]) if there(a)] for there in (lo.__gt__, hi.__le__)]
    return _first(x, kappa, lambda program: program.reaching(sides))


def _first(x: list[Fraction], kappa: Fraction, found: Callable[[_Program], Proposal]) -> Calibration | None:
    """The calibration with the least room that passes the check; None for kappa near 1, where doubles lose it."""
    if kappa < 1 + NEAR:
        return None
    for room in ROOMS:
        nodes, tau, beta = found(_Program(x, float(kappa), room))
        try:
            return Calibration(kappa=kappa, x=tuple(x), y=DEPTHS, nodes=nodes, tau=tau, beta=beta)
        except HypothesisError:
            continue
    return None


class _Program:
    """The conditions on N at the nodes of a grid and on weights; the unknowns are numbered, four for each node."""

    def __init__(self, x: Sequence[Fraction], kappa: float, room: float) -> None:
        self.x, self.y = [float(at) for at in x], [float(at) for at in DEPTHS]
        self.room = room
        self.stretched = (kappa + 1) / (kappa - 1)
        share = (3 - kappa) / 8  # of the square of the trace in C^-1, for the stresses (xx, xy, yy)
        self.root = np.linalg.cholesky(np.array([[0.5 - share, 0, -share], [0, 1, 0], [-share, 0, 0.5 - share]]))
        self.unknowns = 4 * len(self.x) * len(self.y)
        self.entries: list[tuple[int, int, float]] = []
        self.right: list[float] = []
        self.cones: list[object] = []

    def node(self, i: int, j: int, component: int) -> int:
        return 4 * (i * len(self.y) + j) + component

    def new(self) -> int:
        self.unknowns += 1
        return self.unknowns - 1

    def row(self, terms: Terms, constant: float) -> None:
        """One more slack: a linear form plus a constant."""
        self.entries += [(len(self.right), at, -value) for at, value in terms.items()]
        self.right.append(constant)

    def definite(self, matrix: Sequence[Sequence[Terms]], constant: Sequence[float]) -> None:
        """A symmetric matrix of linear forms, plus a diagonal one, is positive semidefinite."""
        for c in range(len(constant)):
            for r in range(c + 1):
                scale = 1.0 if r == c else math.sqrt(2)
                self.row({at: scale * v for at, v in matrix[r][c].items()}, constant[c] if r == c else 0.0)
        self.cones.append(clarabel.PSDTriangleConeT(len(constant)))

    def field(self, tau: Mapping[int, int], beta: Mapping[int, int]) -> None:
        """All conditions of a calibration, with weights of columns by their unknowns."""
        last, top, tight = len(self.x) - 1, len(self.y) - 1, (-self.room, -self.room)
        for j in range(top + 1):
            for i, sign in ((0, -1.0), (last, 1.0)):
                xx, xy, yy = ({self.node(i, j, p): sign} for p in range(3))
                self.definite([[xx, xy], [xy, yy]], tight)
        for i in range(last + 1):
            xx, xy, yy = ({self.node(i, top, p): 1.0} for p in (1, 2, 3))
            weights = {tau[column] for column in (i - 1, i) if column in tau}
            self.definite([[xx | dict.fromkeys(weights, -1.0), xy], [xy, yy]], tight)
        for i in range(last):
            for j in range(top):
                for own in (i, i + 1):
                    self.cell(i, j, own, beta.get(i))

    def cell(self, i: int, j: int, own: int, beta: int | None) -> None:
        """The conditions of Bernstein's coefficients on one side of a cell."""
        low, high, width = self.y[j], self.y[j + 1], self.x[i + 1] - self.x[i]
        for share, square, parts in (
            (0.0, low * low, (low, 0.0)),
            (0.5, low * high, (high / 2, low / 2)),
            (1.0, high * high, (0.0, high)),
        ):
            value = [{self.node(own, j, p): 1 - share, self.node(own, j + 1, p): share} for p in range(4)]
            forms = []
            for p in range(3):
                terms = dict(value[p + 1])
                for end, part in zip((j, j + 1), parts, strict=True):  # minus y times the divergence
                    rise = part / (high - low)
                    for at, more in (
                        (self.node(i + 1, end, p), -part / width),
                        (self.node(i, end, p), part / width),
                        (self.node(own, j + 1, p + 1), -rise),
                        (self.node(own, j, p + 1), rise),
                    ):
                        terms[at] = terms.get(at, 0.0) + more
                if beta is not None and p != 1:
                    terms[beta] = -square * (self.stretched if p == 0 else 1.0)
                forms.append(terms)
            xx, xy, yy = forms
            stresses = [[_sum(self.root[:, c], value[s : s + 3]) for c in range(3)] for s in (0, 1)]
            free: list[Terms] = [{}, {}, {}]
            rows = [[xx, xy, *stresses[0]], [xy, yy, *stresses[1]], *[[{}, {}, *free]] * 3]
            self.definite(rows, (-self.room, -self.room, 1.0, 1.0, 1.0))

    def tracing(self, columns: Iterable[int]) -> Proposal:
        """The field of largest tau on some columns."""
        tau = self.new()
        self.field(dict.fromkeys(columns, tau), {})
        return self.solved(tau, dict.fromkeys(columns, tau), {})

    def reaching(self, sides: Sequence[Iterable[int]]) -> Proposal:
        """The field with the largest lesser reach of two sides."""
        beta = {i: self.new() for side in sides for i in side}
        root = {i: self.new() for i in beta}
        least = self.new()
        self.field({}, beta)
        for i in beta:  # root^2 <= beta, as |(beta - 1, 2 root)| <= beta + 1
            self.row({beta[i]: 1.0}, 1.0)
            self.row({beta[i]: 1.0}, -1.0)
            self.row({root[i]: 2.0}, 0.0)
            self.cones.append(clarabel.SecondOrderConeT(3))
        for side in sides:
            self.row({root[i]: self.x[i + 1] - self.x[i] for i in side} | {least: -1.0}, 0.0)
        self.cones.append(clarabel.NonnegativeConeT(len(sides)))
        return self.solved(least, {}, beta)

    def solved(self, goal: int, tau: Mapping[int, int], beta: Mapping[int, int]) -> Proposal:
        """The solution at which one unknown is largest, in rational numbers; zeros where the solver failed."""
        rows, columns, values = zip(*self.entries, strict=True)
        matrix = sparse.csc_matrix((values, (rows, columns)), (len(self.right), self.unknowns))
        linear = np.zeros(self.unknowns)
        linear[goal] = -1.0
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        none = sparse.csc_matrix((self.unknowns, self.unknowns))
        with one_thread():
            solver = clarabel.DefaultSolver(none, linear, matrix, np.array(self.right), self.cones, settings)
            found = np.array(solver.solve().x)
        if not np.isfinite(found).all():
            found = np.zeros(self.unknowns)
        exact = [Fraction(math.floor(value * 2**DIGITS), 2**DIGITS) for value in found]
        cubics = [
            (exact[at], exact[at + 1], exact[at + 2], exact[at + 3]) for at in range(0, self.node(len(self.x), 0, 0), 4)
        ]
        deep, cells = len(self.y), range(len(self.x) - 1)
        nodes = tuple(tuple(cubics[i * deep : (i + 1) * deep]) for i in range(len(self.x)))
        weights = [
            tuple(max(exact[at[i]], Fraction(0)) if i in at else Fraction(0) for i in cells) for at in (tau, beta)
        ]
        return nodes, weights[0], weights[1]


def _sum(factors: Iterable[float], forms: Sequence[Terms]) -> Terms:
    total: dict[int, float] = {}
    for factor, form in zip(factors, forms, strict=True):
        for at, value in form.items():
            total[at] = total.get(at, 0.0) + float(factor) * value
    return total

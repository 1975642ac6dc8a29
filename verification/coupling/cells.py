"""Cells that make rho smaller: both bodies in cells of one shape, whose diagonals mirror each other across Gamma_c.

For nu up to about 1/3 short waves of such cells add nothing to rho, whatever their shape; for a larger nu, of plane
strain, they do unless the cells are wider than high.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from ndtheory import Number
from ndtheory.keys import Part, says
from verification.constants.cells import NAMES, OfCells, rho_of_cells
from verification.problem import Problem

#: Cells are suggested where rho of the file's own is larger by this share of rho of theirs.
GAIN = 0.05

#: Suggested meshes have at most this many times the cells of the file.
MOST_GROWTH = 2

#: Other cells must make rho smaller by this share to be preferred to those found first.
SAME = 0.001

#: Above this nu of plane strain cells that are wider than high are tried, with so many times the rows.
NARROW = Fraction(1, 3)
WIDE = (2, 4)

Counts = tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class Suggested(Part):
    """Cells for both bodies, columns and rows of each, and rho of them; or why none are suggested.

    ``of_file`` and ``found`` have rho of the file's cells and of the suggested ones in the file's roles, of which the
    normal one decides if ``normal``.  ``poisson`` is the larger nu of both bodies, of plane strain with the same law in
    the plane.
    """

    of_file: OfCells
    normal: bool
    poisson: Fraction = Fraction(0)
    cells: tuple[Counts, Counts] | None = None
    found: OfCells | None = None
    why: str = ""

    @property
    @says("`cells` of each body: columns and rows")
    def body1(self) -> tuple[int, ...]:
        return self.cells[0] if self.cells else ()

    @property
    @says("`cells` of each body: columns and rows")
    def body2(self) -> tuple[int, ...]:
        return self.cells[1] if self.cells else ()

    @property
    @says("the two numbers with these cells", unit="1", type="Number")
    def rho_cells(self) -> Number | None:
        return self.found.numbers.get(NAMES[False]) if self.found else None

    @property
    @says("the two numbers with these cells", unit="1", type="Number")
    def rho_normal_cells(self) -> Number | None:
        return self.found.numbers.get(NAMES[True]) if self.found else None

    def value(self, of: OfCells) -> Number:
        """The one of the two numbers that decides."""
        return of.numbers[NAMES[self.normal]]


def no_cells(why: str) -> Suggested:
    """Nothing at all, and why."""
    return Suggested(of_file=OfCells(numbers={}, why=why), normal=False, why=why)


def suggest(problem: Problem, rho: Number, *, normal: bool) -> Suggested:
    """Cells with a smaller rho on fine meshes.

    ``rho`` is of the file's mesh, and of normal components if ``normal``, as without friction unless the interface is
    tied.  Where it is larger than rho of the cells, long waves or the ends of Gamma_c decide, and other cells change
    little.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> tall = example("section6").changed(cells=((40, 6), (24, 3)))
    >>> found = suggest(tall, Number.of_float(0.6), normal=False)
    >>> found.cells, [round(found.value(of).value, 4) for of in (found.of_file, found.found)]
    (((40, 6), (24, 6)), [0.6728, 0.5143])
    """
    own = rho_of_cells(problem)
    if not own.numbers:
        return no_cells(own.why)
    poisson = max(body.moduli.poisson for body in (problem.body1, problem.body2))
    none = Suggested(of_file=own, normal=normal, poisson=poisson)
    value = none.value(own).value
    if rho.value > (1 + GAIN) * value:
        return replace(none, why="rho is larger than rho of the cells: long waves or the ends of Gamma_c decide")
    if problem.body1.parts or problem.body2.parts:
        return replace(none, why="parts of sides need nodes at their ends")
    why = f"rho is at most {100 * GAIN:.0f} % larger than with cells of one shape that mirror each other"
    best = replace(none, why=why)
    least = value / (1 + GAIN)
    rows = (1, *WIDE) if poisson > NARROW else (1,)
    for cells in dict.fromkeys(cells for times in rows for cells in _of_one_shape(problem, times)):
        found = rho_of_cells(problem.changed(cells=cells))
        if found.numbers and none.value(found).value < least:
            best, least = replace(none, cells=cells, found=found), none.value(found).value * (1 - SAME)
    return best


def _of_one_shape(problem: Problem, times: int) -> Iterator[tuple[Counts, Counts]]:
    """Cells of one shape with common nodes, as near to those of one body or the other as these nodes allow.

    With so many times the rows.
    """
    counts, widths, heights, left = [], [], [], []
    for body in (problem.body1, problem.body2):
        assert body.x is not None
        assert body.y is not None
        assert body.cells is not None
        counts.append(body.cells)
        widths.append(body.x[1] - body.x[0])
        heights.append(body.y[1] - body.y[0])
        left.append(body.x[0])
    apart = left[1] - left[0]
    common = _divisor(*widths, apart, *(end - left[0] for end in problem.contact.interval or ()))
    most = MOST_GROWTH * sum(n * m for n, m in counts)
    for (columns, _), width in zip(counts, widths, strict=True):
        a = common / max(1, round(common * columns / width))
        for (_, own), height in zip(counts, heights, strict=True):
            rows = round(times * heights[0] * own / height)
            rows = max(1, rows + (rows + int(apart / a)) % 2)  # the diagonals of this mesh mirror, too
            found = (int(widths[0] / a), rows), (int(widths[1] / a), max(1, round(heights[1] * rows / heights[0])))
            if sum(n * m for n, m in found) <= most:
                yield found


def _divisor(*lengths: Fraction) -> Fraction:
    """The largest length that divides all."""
    whole = math.lcm(*(length.denominator for length in lengths))
    return Fraction(math.gcd(*(int(length * whole) for length in lengths)), whole)

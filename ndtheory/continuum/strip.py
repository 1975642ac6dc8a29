r"""An elastic strip clamped on one side: its stiffness at each wave number, and bounds for all wave numbers.

The strip ``0 < y < d`` is clamped at y = 0.  Surface displacements ``(i T, N) e^(i xi x)`` at y = d, T along and N
across the surface, cost for each wave number the energy ``G xi`` times a quadratic form in (T, N) with

    TT, NN = (kappa + 1) (kappa sinh 2x -+ 2x) / (2 D),   NT = (kappa (kappa - 1) sinh^2 x - 2 x^2) / D,
    D = kappa^2 sinh^2 x - x^2,   x = xi d,

where kappa is Kolosov's constant.  For a body on the other side of the surface NT has the other sign.  As x grows the
form tends to the form of a half-plane, with the eigenvalues 2 and 2/kappa.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise

from ndtheory.continuum.intervals import Interval, sinc
from ndtheory.moduli import Moduli
from ndtheory.scalar import Scalar

#: Wave numbers from one to another, or to infinity.
Part = tuple[Fraction, Fraction | None]

#: Relative width at which the search for a supremum over all wave numbers ends.
WIDTH = Decimal("3e-4")

#: A little more than 1/3.
THIRD = Decimal("0.33334")

#: Parts that a search may have; hundreds are usual.
MOST_PARTS = 100_000


class Unproved(ArithmeticError):
    """A search among intervals ended without an answer."""


def symbols(
    kappa: Scalar, sinh_double: Scalar, square: Scalar, x: Scalar, x_square: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """TT, NN and NT of the strip, over ``G xi``, of kappa > 1, ``sinh 2x``, ``sinh^2 x``, x and ``x^2``.

    Any common factor of the last four arguments cancels.

    Examples
    --------
    >>> symbols(2, Fraction(1, 2), Fraction(1, 4), 0, 0)  # x -> infinity, over e^2x: the half-plane
    (Fraction(3, 2), Fraction(3, 2), Fraction(1, 2))
    """
    determinant = kappa**2 * square - x_square
    along = (kappa + 1) * (kappa * sinh_double - 2 * x) / (2 * determinant)
    across = (kappa + 1) * (kappa * sinh_double + 2 * x) / (2 * determinant)
    return along, across, (kappa * (kappa - 1) * square - 2 * x_square) / determinant


@dataclass(frozen=True, kw_only=True)
class Strip:
    """A strip clamped on one side.

    ``body`` is not incompressible, kappa > 1; ``thickness`` is d > 0, a length.
    """

    body: Moduli
    thickness: Fraction

    def form(self, part: Part) -> tuple[Interval, ...]:
        """TT, NN and NT enclosed for all wave numbers of a part, unit stress/length.

        ValueError for a part without end: use :meth:`over_wave_number`.

        Examples
        --------
        >>> strip = Strip(body=Moduli(young="2.6", poisson="0.3"), thickness=Fraction(1))  # G = 1, kappa = 9/5
        >>> [round(float(value.hi), 4) for value in strip.form((Fraction(0), Fraction(0)))]  # G/d, (lambda + 2 mu)/d, 0
        [1.0, 3.5, -0.0]
        """
        lo, hi = part
        if hi is None:
            raise ValueError(f"wave numbers from {lo} to infinity: the form is not bounded there")
        x = Interval.between(lo * self.thickness, hi * self.thickness)
        double, ratio = _sinh_over(2 * x), _sinh_over(x)  # sinh(2x)/(2x) and sinh(x)/x
        along, across, mixed = symbols(self.body.kappa, 2 * double, ratio.square(), Interval.of(1), Interval.of(1))
        scale = self.body.shear / self.thickness
        return along * scale, across * scale, x * mixed * scale

    def over_wave_number(self, part: Part) -> tuple[Interval, ...]:
        """The same over xi, unit stress, for xi d >= 1 (else ValueError): far sharper on a long or endless part.

        Examples
        --------
        >>> strip = Strip(body=Moduli(young="2.6", poisson="0.3"), thickness=Fraction(1))
        >>> [round(float(value.hi), 4) for value in strip.over_wave_number((Fraction(30), None))]  # 14/9, 14/9, 4/9
        [1.5556, 1.5556, 0.4444]
        """
        x, end = part[0] * self.thickness, None if part[1] is None else part[1] * self.thickness
        if not x >= 1:
            raise ValueError(f"from x = {x} on: needed x >= 1, where x e^-2x and x^2 e^-2x begin to fall")
        decays = [Interval.of(-2 * at).exp() for at in ((x,) if end is None else (x, end))]
        # e^-2x, x e^-2x and x^2 e^-2x, at both ends
        falling = [[power * decays[0] for power in (1, x, x * x)]]
        falling.append([Interval.of(0)] * 3 if end is None else [power * decays[1] for power in (1, end, end * end)])
        decay, first, second = (Interval(b.lo, a.hi) for a, b in zip(*falling, strict=True))
        doubled, square = (1 - decay.square()) / 2, (1 - decay).square() / 4  # sinh 2x and sinh^2 x, over e^2x
        found = symbols(self.body.kappa, doubled, square, first, second)
        return tuple(value * self.body.shear for value in found)


def _sinh_over(x: Interval) -> Interval:
    """``sinh(x)/x``, which grows from 1."""
    # as operations on a bare Decimal round to the nearest
    ends = [Interval(end, end) for end in ((x.lo,) if x.lo == x.hi else (x.lo, x.hi))]
    grown = [end.exp() for end in ends]
    values = [(e - 1 / e) / (2 * end) if end.hi else Interval.of(1) for end, e in zip(ends, grown, strict=True)]
    return Interval(max(values[0].lo, Decimal(1)), max(values[-1].hi, Decimal(1)))


def smooth(part: Part, radius: Fraction) -> Interval:
    """``sinc^4(r xi/2)``, the square of the hat kernel's Fourier transform, enclosed on a part with or without end."""
    lo, hi = part
    turn = 6 / radius  # r xi/2 = 3, just before the first zero of sinc at pi
    if lo >= turn:  # |sinc t| <= 1/t
        return Interval(Decimal(0), Interval.of(16 / (radius * lo) ** 4).hi)
    first = sinc(Interval.of(lo * radius / 2))
    if hi is None or hi > turn:  # |sinc t| <= 1/t <= 1/3 from there on
        return Interval(Decimal(0), max(first.hi, THIRD)).square().square()
    last = first if hi == lo else sinc(Interval.of(hi * radius / 2))
    return Interval(last.lo, first.hi).square().square()


def times_smooth(part: Part, radius: Fraction) -> Interval:
    """xi times :func:`smooth`, enclosed on a part with or without end that begins above 0."""
    lo, hi = part
    if hi is None or lo * radius >= 6:  # |sinc t| <= 1/t, and xi/xi^4 falls
        return Interval(Decimal(0), Interval.of(16 / (radius**4 * lo**3)).hi)
    return Interval.between(lo, hi) * smooth(part, radius)


def largest_smoothed(strip: Strip, radius: Fraction) -> Interval:
    """The supremum over xi of ``S_NN(xi) sinc^4(r xi/2)``, unit stress/length, enclosed.

    ``sinc^2(r xi/2)`` is the Fourier transform of the hat kernel of radius r.  Intervals of wave numbers are halved,
    the one with the largest upper bound first, until some value reaches this bound up to ``WIDTH``.

    Examples
    --------
    >>> strip = Strip(body=Moduli(young=70000, poisson="0.3"), thickness=Fraction(3, 10))
    >>> found = largest_smoothed(strip, Fraction(1, 10))
    >>> round(found.lo.sqrt(), 1), round(found.hi.sqrt(), 1)
    (Decimal('659.8'), Decimal('659.9'))
    """
    long = 1 / strip.thickness

    def upper(part: Part) -> Decimal:
        if part[0] >= long:
            return (strip.over_wave_number(part)[1] * times_smooth(part, radius)).hi
        return (strip.form(part)[1] * smooth(part, radius)).hi

    def value(wave_number: Fraction) -> Decimal:
        part = (wave_number, wave_number)
        return (strip.form(part)[1] * smooth(part, radius)).lo

    least = Decimal(0)
    heap = [(upper(part).copy_negate(), i, part) for i, part in enumerate(line(1 / strip.thickness, 6 / radius))]
    heapq.heapify(heap)
    for count in range(len(heap), MOST_PARTS):
        negative, _, part = heapq.heappop(heap)
        bound = negative.copy_negate()  # a minus sign would round
        least = max(least, value(_middle(part)))
        if bound <= least * (1 + WIDTH):
            return Interval(least, bound)
        for i, half in enumerate(_halves(part)):
            heapq.heappush(heap, (upper(half).copy_negate(), 2 * count + i, half))
    raise Unproved(f"no supremum of S_NN up to {float(WIDTH)} in {MOST_PARTS} parts of the wave numbers")


def largest_ratio_of_strips(contact: Strip, neumann: Strip) -> Fraction:
    """An upper bound of the largest eigenvalue of the contact strip's form against the Neumann strip's, for every xi.

    A number t is a bound if ``t S_n - S_c``, S_c as seen from the other side, is positive definite for every xi: if
    both diagonal entries are positive and their product exceeds the square of the other entry.  That is shown on
    intervals of wave numbers which are halved until it holds.  The first t that is tried is 1/4096 above the largest
    value seen.

    Examples
    --------
    >>> hard, soft = Moduli(young=70000, poisson="0.3"), Moduli(young=20000, poisson="0.3")
    >>> strips = (Strip(body=body, thickness=Fraction(3, 10)) for body in (soft, hard))
    >>> round(float(largest_ratio_of_strips(*strips)), 4)  # the half-planes have 18/35 = 0.5143
    0.5144
    """
    pair = (contact, neumann)
    parts = _points(line(*(1 / strip.thickness for strip in pair)))
    seen = max(_eigenvalue(*(strip.form(part) for strip in pair)) for part in parts)
    for power in range(12, 0, -1):
        ratio = Fraction(seen) * (1 + Fraction(1, 2**power))
        if _dominates(ratio, pair):
            return ratio
    raise Unproved("no bound of S_c by S_n was found")


def _eigenvalue(contact: tuple[Interval, ...], neumann: tuple[Interval, ...]) -> float:
    """The largest eigenvalue in doubles, for a first guess."""
    (a, c, b), (p, r, q) = ([float(entry.lo) for entry in form] for form in (contact, neumann))
    determinant, trace = p * r - q * q, a * r + c * p + 2 * b * q
    return (trace + math.sqrt(max(trace**2 - 4 * determinant * (a * c - b * b), 0.0))) / (2 * determinant)


def _dominates(ratio: Fraction, pair: tuple[Strip, Strip]) -> bool:
    sizes = [1 / strip.thickness for strip in pair]

    def holds(part: Part) -> bool:
        (a, c, b), (p, r, q) = (s.over_wave_number(part) if part[0] >= max(sizes) else s.form(part) for s in pair)
        along, across, mixed = ratio * p - a, ratio * r - c, ratio * q + b  # on the other side NT changes its sign
        return along.lo > 0 and across.lo > 0 and (along * across - mixed.square()).lo > 0

    return everywhere(holds, sizes, shortest=Fraction(1, 2**16))


def everywhere(holds: Callable[[Part], bool], sizes: Sequence[Fraction], *, shortest: Fraction) -> bool:
    """True if something is shown to hold on parts that cover all wave numbers: each is halved until it does.

    A part is halved, too, where its enclosure divides by an interval that contains 0.  False where it is not shown at
    some wave numbers, or MOST_PARTS of them leave it open, or one that is as short as a share of its first end,
    or that lies far beyond all sizes.
    """
    parts = line(*sizes)
    with suppress(ZeroDivisionError):
        if not all(map(holds, _points(parts))):
            return False
    for _ in range(MOST_PARTS):
        if not parts:
            return True
        part = parts.pop()
        with suppress(ZeroDivisionError):
            if holds(part):
                continue
        lo, hi = part
        if lo > 2**12 * max(sizes) if hi is None else hi - lo <= (lo or min(sizes)) * shortest:
            return False
        parts.extend(_halves(part))
    return False


def line(*sizes: Fraction) -> list[Part]:
    """All wave numbers in parts, from 0 to far below the smallest of some sizes, then to the double of each."""
    ends = [min(sizes) / 64]
    while ends[-1] < 16 * max(sizes):
        ends.append(2 * ends[-1])
    return [(Fraction(0), ends[0]), *pairwise(ends), (ends[-1], None)]


def _middle(part: Part) -> Fraction:
    lo, hi = part
    return 2 * lo if hi is None else (lo + hi) / 2


def _halves(part: Part) -> tuple[Part, Part]:
    lo, hi = part
    return (lo, _middle(part)), (_middle(part), hi)


def _points(line: list[Part]) -> list[Part]:
    """Some wave numbers, as parts without length."""
    return [(x, x) for lo, hi in line if lo and hi for j in range(16) for x in [lo + (hi - lo) * j / 16]]

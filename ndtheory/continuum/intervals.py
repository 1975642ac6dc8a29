"""Interval arithmetic with decimals: every operation rounds outward, so that a result encloses the exact one.

The operations of :mod:`decimal` are correctly rounded.  Sums, products and quotients are rounded down for the lower end
and up for the upper one; ``exp`` and ``sqrt``, which round to the nearest decimal, are moved by one unit of the last
place.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import MAX_EMAX as LARGEST_EXPONENT
from decimal import MIN_EMIN as SMALLEST_EXPONENT
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal, DivisionByZero, InvalidOperation, Overflow
from fractions import Fraction
from typing import Any

#: Decimal digits of an end.
DIGITS = 40

_traps = [InvalidOperation, DivisionByZero, Overflow]
_down = Context(DIGITS, ROUND_FLOOR, SMALLEST_EXPONENT, LARGEST_EXPONENT, traps=_traps)
_up = Context(DIGITS, ROUND_CEILING, SMALLEST_EXPONENT, LARGEST_EXPONENT, traps=_traps)


@dataclass(frozen=True, slots=True)
class Interval:
    """The real numbers from ``lo`` to ``hi``.

    Examples
    --------
    >>> third = Interval.of(Fraction(1, 3))
    >>> Fraction(third.lo) < Fraction(1, 3) < Fraction(third.hi)
    True
    >>> x = Interval.between(-1, 2)
    >>> x * x, x.square()
    (Interval(lo=Decimal('-2'), hi=Decimal('4')), Interval(lo=Decimal('0'), hi=Decimal('4')))
    """

    lo: Decimal
    hi: Decimal

    @classmethod
    def of(cls, value: Any) -> Interval:
        """The smallest enclosure of an exact number: int, Fraction, Decimal."""
        return value if isinstance(value, Interval) else cls(_rounded(value, _down), _rounded(value, _up))

    @classmethod
    def between(cls, lo: Any, hi: Any) -> Interval:
        """The enclosure of all numbers between two exact ones; ValueError unless lo <= hi."""
        if not lo <= hi:
            raise ValueError(f"interval from {lo} to {hi}: the first end must be the smaller one")
        return cls(_rounded(lo, _down), _rounded(hi, _up))

    def __add__(self, other: Any) -> Interval:
        o = other if isinstance(other, Interval) else Interval.of(other)
        return Interval(_down.add(self.lo, o.lo), _up.add(self.hi, o.hi))

    def __neg__(self) -> Interval:
        return Interval(self.hi.copy_negate(), self.lo.copy_negate())

    def __sub__(self, other: Any) -> Interval:
        o = other if isinstance(other, Interval) else Interval.of(other)
        return Interval(_down.subtract(self.lo, o.hi), _up.subtract(self.hi, o.lo))

    def __rsub__(self, other: Any) -> Interval:
        return Interval.of(other) - self

    def __mul__(self, other: Any) -> Interval:
        o = other if isinstance(other, Interval) else Interval.of(other)
        if not self.lo.is_signed():  # the signs of the other ends decide
            lo, hi = (self.hi if o.lo.is_signed() else self.lo), (self.lo if o.hi.is_signed() else self.hi)
            return Interval(_down.multiply(lo, o.lo), _up.multiply(hi, o.hi))
        if self.hi.is_signed():
            return -(-self * o)
        if o.lo.is_signed() == o.hi.is_signed():
            return o * self
        pairs = [(self.lo, o.hi), (self.hi, o.lo)], [(self.lo, o.lo), (self.hi, o.hi)]
        return Interval(min(_down.multiply(*ends) for ends in pairs[0]), max(_up.multiply(*ends) for ends in pairs[1]))

    def __truediv__(self, other: Any) -> Interval:
        o = Interval.of(other)
        if o.lo <= 0 <= o.hi:
            raise ZeroDivisionError(f"division by an interval that contains 0: [{o.lo}, {o.hi}]")
        return self * Interval(_down.divide(Decimal(1), o.hi), _up.divide(Decimal(1), o.lo))

    def __rtruediv__(self, other: Any) -> Interval:
        return Interval.of(other) / self

    __radd__, __rmul__ = __add__, __mul__

    def square(self) -> Interval:
        """The squares of its numbers; sharper than a product where it contains 0."""
        size = self.modulus()
        return size * size

    def __pow__(self, exponent: Any) -> Interval:
        """``x**2`` and ``x**0.5``, as formulas write them for numbers of any type."""
        if exponent not in (2, 0.5):
            raise ValueError(f"interval to the power {exponent}: needed 2 or 0.5")
        return self.square() if exponent == 2 else self.sqrt()

    def modulus(self) -> Interval:
        """The moduli of its numbers."""
        if self.lo >= 0:
            return self
        return -self if self.hi <= 0 else Interval(Decimal(0), max(self.lo.copy_negate(), self.hi))

    def exp(self) -> Interval:
        """Exponential function; it increases, so that the ends suffice."""
        lo = _down.exp(self.lo)  # correctly rounded to the nearest, whatever the context
        hi = lo if self.hi == self.lo else _down.exp(self.hi)
        return Interval(_down.next_minus(lo), _up.next_plus(hi))

    def sqrt(self) -> Interval:
        """The square root of numbers >= 0."""
        lo = max(_down.next_minus(_down.sqrt(self.lo)), Decimal(0))
        return Interval(lo, _up.next_plus(_up.sqrt(self.hi)))


def _rounded(value: Any, context: Context) -> Decimal:
    if isinstance(value, (Decimal, int)):
        return context.create_decimal(value)
    exact = value if isinstance(value, Fraction) else Fraction(value)
    return context.divide(Decimal(exact.numerator), Decimal(exact.denominator))


def sinc(t: Interval) -> Interval:
    """``sin(t)/t`` for numbers in [0, 3], where it falls; 1 at 0.

    The terms ``t^2j/(2j+1)!`` alternate in sign and fall from the second on, as ``t^2 <= 9 < 4 * 5``, so that two
    partial sums one after the other enclose the function.

    Examples
    --------
    >>> value = sinc(Interval.of(1))
    >>> round(value.lo, 12), value.hi - value.lo < Decimal("1e-30")
    (Decimal('0.841470984808'), True)
    """
    if not 0 <= t.lo <= t.hi <= 3:
        raise ValueError(f"sinc on [{t.lo}, {t.hi}]: needed numbers between 0 and 3")
    if t.hi - t.lo <= _NARROW:
        return _sinc(t)
    return Interval(_sinc(Interval(t.hi, t.hi)).lo, _sinc(Interval(t.lo, t.lo)).hi)


def _sinc(t: Interval) -> Interval:
    square = t.square()
    term = total = Interval.of(1)
    for j, ratio in enumerate(_RATIOS, start=1):
        term = term * square * ratio
        before, total = total, (total + -term if j % 2 else total + term)
        if term.hi < _SMALL:
            break
    return Interval(min(before.lo, total.lo), max(before.hi, total.hi))


#: Each term of the series over ``t^2`` times the one before: 25 of them reach all digits at t = 3.
_RATIOS = [Interval.of(Fraction(1, 2 * j * (2 * j + 1))) for j in range(1, 26)]

#: Up to this length of an interval one evaluation encloses a function well.
_NARROW = Decimal(10) ** (4 - DIGITS)

#: A term that adds no digit to sinc, which is at least 0.04 up to t = 3.
_SMALL = Decimal(10) ** -(DIGITS + 2)

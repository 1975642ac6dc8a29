"""Scalars: exact reading, one square root for all of them, and numbers that carry their level of proof."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Context, Decimal, InvalidOperation, localcontext
from fractions import Fraction
from typing import Any, Literal

Level = Literal["exact", "verified", "guaranteed", "float"]

#: Decimal digits carried while a bound is evaluated.  With constants spread over 1e-12..1e12 the worst cancellation
#: (C6 just below C1) costs some 75 digits, so the double that comes out is right in its last place.
DIGITS = 200

#: Sizes accepted from a user; beyond them a double overflows.
LARGEST_EXPONENT = 300
LARGEST, SMALLEST = Fraction(10**LARGEST_EXPONENT), Fraction(1, 10**LARGEST_EXPONENT)


@dataclass(frozen=True, kw_only=True)
class Number:
    """A value with what is known of it.

    Attributes
    ----------
    value : float
        The nearest double.
    lo, hi : float or None
        An enclosure, or None where there is none (always at level ``float``).
    level : {'exact', 'verified', 'guaranteed', 'float'}
        How the value was obtained; a derived value has the weakest level of its inputs.

    Examples
    --------
    >>> Number.of_float(0.5).to_dict()
    {'value': 0.5, 'lo': None, 'hi': None, 'level': 'float'}
    """

    value: float
    lo: float | None = None
    hi: float | None = None
    level: Level = "float"

    @classmethod
    def of_float(cls, value: Any) -> Number:
        """Round any real scalar to a double; nothing is claimed about the error."""
        return cls(value=float(value))

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of the interface."""
        return {"value": self.value, "lo": self.lo, "hi": self.hi, "level": self.level}


def exact(value: Any) -> Fraction:
    """Read a number exactly as it was written.

    Parameters
    ----------
    value : int, float, str, Decimal or Fraction
        ``"1/3"``, ``"0.4"`` and ``0.4`` are one third and twice two fifths: a float means its shortest decimal.

    Raises
    ------
    ValueError
        Not a finite number, or an exponent beyond ``LARGEST_EXPONENT``.

    Examples
    --------
    >>> exact("1/3"), exact(0.4), exact("2.5e-3")
    (Fraction(1, 3), Fraction(2, 5), Fraction(1, 400))
    """
    if isinstance(value, bool):
        raise ValueError(f"{value} is a truth value, not a number")
    if isinstance(value, Fraction):
        return value
    if isinstance(value, int) and value.bit_length() > 1000:
        raise ValueError(f"an integer of {value.bit_length()} bits is not of ordinary size")
    text = str(value).strip()
    if "_" in text or not text.isascii():
        raise ValueError(f"{text!r} is not a number")
    numerator, slash, denominator = text.partition("/")
    try:
        parts = [Decimal(numerator), Decimal(denominator)] if slash else [Decimal(text)]
    except InvalidOperation:
        raise ValueError(f"{text!r} is not a number") from None
    if not all(part.is_finite() and abs(part.adjusted()) <= LARGEST_EXPONENT for part in parts):
        raise ValueError(f"{text!r} is not a finite number of ordinary size")
    if slash and parts[1] == 0:
        raise ValueError(f"{text!r} divides by zero")
    result = Fraction(parts[0]) / Fraction(parts[1]) if slash else Fraction(parts[0])
    if result and not SMALLEST <= abs(result) <= LARGEST:
        raise ValueError(f"{text!r} is not of ordinary size")
    return result


@contextmanager
def working_precision(digits: int = DIGITS) -> Iterator[None]:
    """Decimal arithmetic with ``digits`` digits inside the block."""
    with localcontext(Context(prec=digits)):
        yield


def decimal(value: Fraction) -> Decimal:
    """A rational in the current decimal precision."""
    return Decimal(value.numerator) / Decimal(value.denominator)


def sqrt(x: Any) -> Any:
    """The square root in the arithmetic of its argument.

    float, int, Decimal, a Fraction that is a square, and anything with a rational power (sympy, mpmath).

    Raises
    ------
    ValueError
        A negative number, or a Fraction whose root is irrational (a float would hide that).

    Examples
    --------
    >>> sqrt(2.25), sqrt(Fraction(9, 4)), sqrt(Decimal("2.25"))
    (1.5, Fraction(3, 2), Decimal('1.5'))
    """
    if isinstance(x, (int, float, Decimal, Fraction)) and x < 0:
        raise ValueError(f"sqrt({x}): a number >= 0 is needed")
    if isinstance(x, Decimal):
        return x.sqrt()
    if isinstance(x, Fraction):
        root = Fraction(math.isqrt(x.numerator), math.isqrt(x.denominator))
        if root * root != x:
            raise ValueError(f"sqrt({x}) is irrational")
        return root
    if isinstance(x, (int, float)):
        return math.sqrt(x)
    if hasattr(x, "is_Rational"):  # a sympy expression: 0.5 would turn it into a float
        return x ** Fraction(1, 2)
    return x**0.5

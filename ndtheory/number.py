"""Numbers: exact reading, and numbers that carry their level of proof."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal, InvalidOperation, localcontext
from fractions import Fraction
from typing import ClassVar, Literal, TypeAlias, get_args

from ndtheory.keys import Part, key
from ndtheory.scalar import Scalar

#: What a user may write where a number is read exactly, see :func:`exact`.
Numeric: TypeAlias = int | float | str | Fraction | Decimal

Level = Literal["exact", "verified", "guaranteed", "float"]

#: From the strongest to the weakest.
LEVELS: tuple[Level, ...] = get_args(Level)

#: Decimal digits carried while a bound is evaluated.  With constants spread over 1e-12..1e12 the worst cancellation
#: (C6 just below C1) costs some 75 digits, so the double that comes out is right in its last place.
DIGITS = 200

#: Relative outward move of an end of an enclosure evaluated with ``DIGITS`` digits: far above its rounding (an end
#: where more cancels is omitted, see ``DIGITS``) and far below the last place of a double.
SLACK = Decimal(10) ** -60

#: Sizes accepted from a user; beyond them a double overflows.
LARGEST_EXPONENT = 300
LARGEST, SMALLEST = Fraction(10**LARGEST_EXPONENT), Fraction(1, 10**LARGEST_EXPONENT)

#: The same in words.
OF_SIZE = f"of a size between 1e-{LARGEST_EXPONENT} and 1e{LARGEST_EXPONENT}"


def typed(value: object) -> str:
    """A value as a user would type it: a number in 12 digits, or a fraction that is not a decimal.

    A double next to a whole number keeps all its digits, which say on which side it is.
    """
    if isinstance(value, int) and value.bit_length() > 1000:
        return f"an integer of {value.bit_length()} bits"
    if isinstance(value, Fraction):
        n, d = value.as_integer_ratio()
        if max(abs(n), d) < 10**15 and (d == 1 or 10 ** d.bit_length() % d):  # or no decimal
            return str(value)
        return str(Context(prec=12).create_decimal(decimal(value)).normalize()).lower()
    text, short = str(value), f"{value:.12g}" if isinstance(value, float) else ""
    return short if "." in short and len(text) > 14 else text


class UnusualSize(ValueError):
    """A finite number larger than LARGEST, or smaller than SMALLEST and not 0; ``near`` is the nearest accepted one."""

    def __init__(self, text: str, near: Fraction) -> None:
        super().__init__(f"{text} is not a number of ordinary size")
        self.near = near


def weakest(levels: Iterable[Level]) -> Level:
    """The level of what is derived from numbers of these levels; ``exact`` where there are none.

    Examples
    --------
    >>> weakest(["exact", "guaranteed", "verified"])
    'guaranteed'
    """
    return max(levels, key=LEVELS.index, default="exact")


def below(x: Fraction | Decimal) -> float:
    """The largest double that is at most a rational or a decimal."""
    nearest = float(x)
    return nearest if nearest <= x else math.nextafter(nearest, -math.inf)


def above(x: Fraction | Decimal) -> float:
    """The smallest double that is at least a rational or a decimal."""
    nearest = float(x)
    return nearest if nearest >= x else math.nextafter(nearest, math.inf)


def directed(x: float | Decimal | Fraction, digits: int, *, up: bool) -> Decimal:
    """A number in a few significant figures, not below it (``up``) or not above it.

    Examples
    --------
    >>> directed(Fraction(2, 3), 3, up=True), directed(-2 / 3, 3, up=True)
    (Decimal('0.667'), Decimal('-0.666'))
    """
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    if isinstance(x, Fraction):
        return context.divide(Decimal(x.numerator), Decimal(x.denominator))
    return context.create_decimal(Decimal(x))


@dataclass(frozen=True, kw_only=True)
class Number(Part):
    """A value with its enclosure and level of proof.

    The true number is at least ``lo``, at most ``hi``.  Only one may be known; at level ``float`` none is, at the other
    levels at least one.  The level is the origin of the enclosure, from the strongest: the double is the number;
    arithmetic that bounds all its rounding errors; such arithmetic and a proved estimate of the rest; none.  A derived
    number has the weakest level of its inputs (:func:`weakest`), and ``float`` where a rounding error was not bounded.

    Raises
    ------
    ValueError
        Not ``lo <= value <= hi``, or ends that the level does not allow.

    Examples
    --------
    >>> Number.of_float(0.5).to_dict()
    {'value': 0.5, 'lo': None, 'hi': None, 'level': 'float'}
    """

    part: ClassVar[str] = "Number"

    value: float = key("the nearest double", unit="")
    lo: float | None = key("an enclosure", unit="", null="at level `float`", why=None, default=None)
    hi: float | None = key("an enclosure", unit="", null="at level `float`", why=None, default=None)
    level: Level = key(
        "`exact`, `verified`, `guaranteed` or `float`: what is claimed about the enclosure; for a `float` nothing is",
        default="float",
    )

    def __post_init__(self) -> None:
        if self.level == "float" and self.lo is None and self.hi is None:
            return
        ends = [end for end in (self.lo, self.hi) if end is not None]
        if self.level not in LEVELS:
            raise ValueError(f"level = {self.level}: needed one of {', '.join(LEVELS)}")
        if (self.level == "float") != (not ends):
            raise ValueError(f"level {self.level} with lo = {self.lo}, hi = {self.hi}: ends belong to any but float")
        if self.level == "exact" and any(end != self.value for end in ends):
            raise ValueError(f"level exact with lo = {self.lo}, hi = {self.hi}: needed {self.value} itself")
        lo, hi = (self.value if end is None else end for end in (self.lo, self.hi))
        if not (lo <= self.value <= hi and all(map(math.isfinite, (lo, self.value, hi)))):
            raise ValueError(f"value = {self.value}: needed lo = {self.lo} <= value <= hi = {self.hi}, all finite")

    @classmethod
    def of_float(cls, value: Scalar) -> Number:
        """Round any real scalar to a double; nothing is claimed about the error."""
        return cls(value=float(value))

    @classmethod
    def within(cls, value: float, lo: float | None, hi: float | None, level: Level) -> Number:
        """A value that is moved to an end it lies beyond; one end may be unknown."""
        value = value if lo is None else max(value, lo)
        return cls(value=value if hi is None else min(value, hi), lo=lo, hi=hi, level=level)

    @classmethod
    def enclosed(cls, value: Scalar, lo: Scalar, hi: Scalar, level: Level) -> Number:
        """Round a rational or decimal to the nearest double and its ends outward.

        The level ``exact`` remains if the double is the number, and becomes ``verified`` otherwise.

        Examples
        --------
        >>> Number.enclosed(Fraction(1, 4), Fraction(1, 4), Fraction(1, 4), "exact").level
        'exact'
        >>> third = Number.enclosed(Fraction(1, 3), Fraction(1, 3), Fraction(1, 3), "exact")
        >>> third.level, third.lo < Fraction(1, 3) < third.hi
        ('verified', True)
        """
        lo, nearest, hi = below(lo), float(value), above(hi)
        if not (math.isfinite(lo) and math.isfinite(hi)):
            return cls(value=nearest)
        return cls(value=nearest, lo=lo, hi=hi, level=level if lo == hi else weakest([level, "verified"]))


def exact(value: Numeric) -> Fraction:
    """Read a number exactly as it was written; a float means its shortest decimal, so that 0.4 is two fifths.

    Raises
    ------
    ValueError
        Not a finite number.
    UnusualSize
        A finite one beyond ``LARGEST`` or ``SMALLEST``.

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
        raise UnusualSize(f"an integer of {value.bit_length()} bits", LARGEST if value > 0 else -LARGEST)
    text = str(value).strip()
    if "_" in text or not text.isascii():
        raise ValueError(f"{text!r} is not a number")
    try:
        parts = [Decimal(part) for part in text.split("/", maxsplit=1)]
    except InvalidOperation:
        raise ValueError(f"{text!r} is not a number") from None
    if not all(part.is_finite() for part in parts):
        raise ValueError(f"{text!r} is not a finite number")
    if 0 in parts[1:]:
        raise ValueError(f"{text!r} divides by zero")
    exponents = [part.adjusted() for part in parts]
    near = LARGEST if exponents[0] > sum(exponents[1:]) else SMALLEST
    near *= math.prod(-1 if part < 0 else 1 for part in parts)
    if not all(abs(exponent) <= LARGEST_EXPONENT for exponent in exponents):
        raise UnusualSize(repr(text), near)
    result = Fraction(parts[0]) / Fraction(parts[-1] if len(parts) > 1 else 1)
    if result and not SMALLEST <= abs(result) <= LARGEST:
        raise UnusualSize(repr(text), near)
    return result


@contextmanager
def working_precision(digits: int = DIGITS) -> Iterator[None]:
    """Decimal arithmetic with ``digits`` digits inside the block."""
    with localcontext(Context(prec=digits)):
        yield


def rounded(value: Decimal | None, ends: Sequence[Decimal | None], level: Level) -> Number | None:
    """A result of ``DIGITS`` digits as a Number, inside :func:`working_precision`.

    ``ends`` are the same result at both ends of an enclosure in which it is monotone, in any order.  The Number has no
    enclosure if one of them is missing, or smaller than ``SLACK`` but not 0: it may be pure rounding error.  None
    remains None.
    """
    if value is None:
        return None
    known = sorted(end for end in ends if end is not None and (end == 0 or abs(end) > SLACK))
    if not known or len(known) < len(ends) or level == "float":
        return Number.of_float(value)
    lo, hi = known[0], known[-1]
    return Number.enclosed(value, lo - abs(lo) * SLACK, hi + abs(hi) * SLACK, level)


def decimal(value: Fraction) -> Decimal:
    """A rational in the current decimal precision."""
    return Decimal(value.numerator) / Decimal(value.denominator)

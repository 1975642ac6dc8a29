"""Numbers as they are read: in a few figures, with the mark of their level, their ends rounded to the safe side."""

from __future__ import annotations

from collections.abc import Mapping

from ndtheory import Number
from ndtheory.number import Level, directed
from verification.show.parts import Cell, Quantity

#: Marks of the levels, beside numbers and in tables; a number in doubles has none.
MARKS: Mapping[Level, str] = {"exact": "e", "verified": "v", "guaranteed": "g", "float": ""}

#: The meaning of the mark of a number that is proved on a mesh; ``docs/glossary.md`` explains all marks.
LEGEND = (
    "v (verified): proved for the exact data of the file on this mesh, and rounded to the safe side; what has no mark"
    " is computed in doubles"
)

#: Shown in place of a missing number.
NONE = "-"


def figures(value: float | Number | None, digits: int = 3, unit: str = "") -> Cell:
    """A number in a few significant figures; a dash where there is none.

    >>> print(figures(0.26725), figures(1.7e-7), figures(None))
    0.267 1.70e-07 -
    """
    if value is None:
        return NONE
    number, level = (value.value, value.level) if isinstance(value, Number) else (value, "float")
    if number == 0:
        text = "0"
    elif not 1e-3 <= abs(number) < 1e5:
        text = f"{number:.{digits - 1}e}"
    else:
        text = f"{number:#.{digits}g}".rstrip(".")
    return Quantity(number, text, unit, level)


def near_one(value: float, digits: int = 4, rest: float | None = None) -> Quantity:
    """A rate; near 1 as its distance from 1, which ``rest`` may hold with more digits.

    >>> print(near_one(0.30709), near_one(1 - 1.5e-5), near_one(1 + 1.5e-5), near_one(1.0, rest=2e-21))
    0.3071 1 - 1.5e-05 1 + 1.5e-05 1 - 2e-21
    """
    rest = 1 - value if rest is None else rest
    near = f"1 {'-' if rest > 0 else '+'} {abs(rest):.{digits - 2}g}"
    return Quantity(value, near if 0 < abs(rest) < 1e-3 else f"{value:.{digits}g}")


def count(number: int | None, before: str = "") -> Cell:
    """A count; a dash where it is not known."""
    return NONE if number is None else Quantity(number, f"{before}{number}")


def rounded(x: float, digits: int, *, up: bool) -> str:
    """A number in a few significant figures, rounded upwards or downwards.

    >>> rounded(2 / 3, 3, up=True), rounded(2 / 3, 3, up=False)
    ('0.667', '0.666')
    """
    return f"{directed(x, digits, up=up):.{digits}g}" if x else "0"


def marked(text: str, level: Level) -> str:
    """A text with the mark of a level.

    >>> marked("0.667", "verified"), marked("0.667", "float")
    ('0.667 v', '0.667')
    """
    return f"{text} {MARKS[level]}".rstrip()


def at_least(number: Number | None) -> Cell:
    """A lower bound, rounded down: the lower end of the enclosure, if there is one.

    >>> print(at_least(Number(value=0.2, lo=0.19999, hi=0.20001, level="verified")), at_least(Number.of_float(0.2)))
    0.199 v 0.200
    """
    return figures(number, 3) if number is None or number.lo is None else _end(number, number.lo, up=False)


def at_most(number: Number | None) -> Cell:
    """An upper bound, rounded up: the upper end of the enclosure, if there is one.

    >>> print(at_most(Number(value=0.2, lo=0.19999, hi=0.20001, level="verified")), at_most(None))
    0.201 v -
    """
    return figures(number, 3) if number is None or number.hi is None else _end(number, number.hi, up=True)


def _end(number: Number, end: float, *, up: bool) -> Quantity:
    return Quantity(end, marked(rounded(end, 3, up=up), number.level), level=number.level)


def between(number: Number | None, digits: int = 12, unit: str = "") -> tuple[Cell, Cell]:
    """The ends of an enclosure, each rounded away from the number; a dash where there is none.

    >>> print(*between(Number(value=1 / 3, lo=0.333, hi=1 / 3, level="verified"), 4))
    0.3330 0.3334
    """
    if number is None:
        return NONE, NONE
    low, high = (
        NONE if end is None else Quantity(end, rounded(end, digits, up=up), unit, number.level)
        for end, up in ((number.lo, False), (number.hi, True))
    )
    return low, high


def interval(ends: tuple[float, float] | None, level: Level) -> Cell:
    """An open interval; its ends are rounded inward where the property of its numbers is proved."""
    if ends is None:
        return NONE
    text = f"({ends[0]:.3g}, {figures(ends[1])})"
    if level != "float":
        text = f"({rounded(ends[0], 3, up=True)}, {rounded(ends[1], 3, up=False)})"
    return Quantity(ends, marked(text, level), level=level)


def factor(value: Number | None, one_minus: Number | None) -> Cell:
    """A factor; near 1 and below as its distance from 1.

    >>> print(factor(Number.of_float(1 - 2e-11), Number.of_float(2e-11)))
    1 - 2.0e-11
    >>> print(factor(Number.of_float(1 - 2e-11), Number(value=2e-11, lo=1.99e-11, hi=2.01e-11, level="verified")))
    1 - 1.9e-11 v
    """
    if value is None or one_minus is None:
        return NONE
    if not 0 < one_minus.value < 1e-3:
        return at_most(value)
    if one_minus.lo is None:
        return Quantity(value.value, f"1 - {one_minus.value:.1e}")
    text = marked(f"1 - {rounded(one_minus.lo, 2, up=False)}", one_minus.level)
    return Quantity(value.value if value.hi is None else value.hi, text, level=one_minus.level)

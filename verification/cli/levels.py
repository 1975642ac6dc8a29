"""Numbers on screens with the mark of their level, their ends rounded to the safe side."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

from ndtheory import Number
from ndtheory.number import Level
from verification.cli.console import figures

#: Marks of the levels, beside numbers and in tables; a number in doubles has none.
MARKS: Mapping[Level, str] = {"exact": "e", "verified": "v", "guaranteed": "g", "float": ""}

#: What the mark of a number that is proved on a mesh means; see ``docs/glossary.md`` for all of them.
LEGEND = (
    "v (verified): proved for the exact data of the file on this mesh, and rounded to the safe side; what has no mark"
    " is computed in doubles"
)


def rounded(x: float, digits: int, *, up: bool) -> str:
    """A number in a few significant figures, rounded upwards or downwards.

    >>> rounded(2 / 3, 3, up=True), rounded(2 / 3, 3, up=False)
    ('0.667', '0.666')
    """
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return f"{context.create_decimal(Decimal(x)):.{digits}g}" if x else "0"


def marked(text: str, level: Level) -> str:
    """A number with the mark of its level.

    >>> marked("0.667", "verified"), marked("0.667", "float")
    ('0.667 v', '0.667')
    """
    return f"{text} {MARKS[level]}".rstrip()


def at_least(number: Number | None, digits: int = 3) -> str:
    """A number of which it matters that it is no smaller: its lower end rounded downwards, where it has one.

    >>> at_least(Number(value=0.2, lo=0.19999, hi=0.20001, level="verified")), at_least(Number.of_float(0.2))
    ('0.199 v', '0.200')
    """
    if number is None or number.lo is None:
        return figures(number, digits)
    return marked(rounded(number.lo, digits, up=False), number.level)


def at_most(number: Number | None, digits: int = 3) -> str:
    """A number of which it matters that it is no larger: its upper end rounded upwards, where it has one.

    >>> at_most(Number(value=0.2, lo=0.19999, hi=0.20001, level="verified")), at_most(None)
    ('0.201 v', '-')
    """
    if number is None or number.hi is None:
        return figures(number, digits)
    return marked(rounded(number.hi, digits, up=True), number.level)


def between(number: Number | None, digits: int = 12) -> tuple[str, str]:
    """The ends of an enclosure, each rounded away from the number; a dash where there is none.

    >>> between(Number(value=1 / 3, lo=0.333, hi=1 / 3, level="verified"), 4)
    ('0.3330', '0.3334')
    """
    ends = (None, None) if number is None else (number.lo, number.hi)
    low, high = ("-" if x is None else rounded(x, digits, up=up) for x, up in zip(ends, (False, True), strict=True))
    return low, high


def factor(value: Number | None, one_minus: Number | None) -> str:
    """A contraction factor; near 1 as its distance from 1.

    >>> factor(Number.of_float(1 - 2e-11), Number.of_float(2e-11))
    '1 - 2.0e-11'
    >>> factor(Number.of_float(1 - 2e-11), Number(value=2e-11, lo=1.99e-11, hi=2.01e-11, level="verified"))
    '1 - 1.9e-11 v'
    """
    if value is None or one_minus is None:
        return "-"
    if not one_minus.value < 1e-3:
        return at_most(value)
    if one_minus.lo is None:
        return f"1 - {one_minus.value:.1e}"
    return marked(f"1 - {rounded(one_minus.lo, 2, up=False)}", one_minus.level)

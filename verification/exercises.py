"""Check answers to exercises of the course, against what ``docs/builder/exercises.py`` has computed and recorded."""

from __future__ import annotations

import json
import math
import re
from fractions import Fraction
from importlib.resources import files
from typing import Any, get_args

import numpy as np

from ndtheory.number import exact
from ndtheory.texts import nearest
from verification.bounds.verdicts import RunVerdict

#: Relative difference of a number that counts as right: three digits, as pages print them.
THREE_DIGITS = 0.005

VERDICTS = get_args(RunVerdict)


def check(exercise: str, answer: Any) -> str:
    """Check the answer to an exercise of the course: ``right``, what is missing, or a hint for a usual mistake.

    Parameters
    ----------
    exercise : str
        Page and number, as they are below the exercise.
    answer : number, str or sequence of them
        What the line below the exercise lists, in its order; numbers to three digits, or ``"2/3"``, or ``"pi/2"``.

    Returns
    -------
    str
        A hint explains all parts of the answer that are not right. If the exercise has no check, or the answer another
        number of parts or no numbers, the text says what is needed.

    Examples
    --------
    >>> check("two_bars.2", ["1/3", "3/4", "6/7", "3/2"]), check("two_bars.3", 0.611)
    ('right', 'Not yet. Did you forget a square?')
    >>> check("two_bars.2", [0.33, 0.75, 0.86, 1.5])
    'Right as far as it goes; give three digits.'
    """
    known = json.loads((files("verification") / "data" / "exercises.json").read_text("utf-8"))
    exercise = str(exercise)
    if exercise not in known:
        near = [name for name in known if name.startswith(exercise[:-1])] or nearest(exercise, known) or known
        return f"{exercise} has no check; these exercises have one: {', '.join(near)}"
    asks, right, wrong = known[exercise].values()
    given = np.array(answer, dtype=object).ravel()
    if len(given) != len(right):
        return f"{exercise}: needed {asks}, {len(right)} in all; received {answer!r}"
    try:
        off = [n for n, part in enumerate(given) if not _same(part, right[n])]
        hints = [hint for hint, numbers in wrong.items() if all(_same(given[n], numbers[n]) for n in off)]
        shuffled = all(any(_same(part, of) for part in given) for of in right)
    except ValueError as error:
        return str(error)
    if not off:
        return "right"
    if not hints and (digits := min(_rounded(given[n], right[n]) for n in off)):  # one digit shows nothing
        return "Right as far as it goes; give three digits." if digits > 1 else "Give three digits."
    if shuffled:
        hints += [f"These are the right answers in another order; needed {asks}."]
    return " ".join([f"Not yet{f', number {off[0] + 1}' * (len(right) > 1)}.", *hints[:1]])


def _same(part: Any, of: Any) -> bool:
    if not isinstance(of, str):
        return math.isclose(_number(part), of, rel_tol=THREE_DIGITS)
    if (word := str(part).strip().upper()) not in VERDICTS:
        raise ValueError(f"{part!r} is not a verdict; needed some of {', '.join(VERDICTS)}")
    return word == of


def _number(part: Any) -> Fraction:
    """A number exactly as it was typed; with pi as a factor too, as ``"3*pi/4"``."""
    text = str(part)
    rational = re.sub(r" *\* *pi\b", "", re.sub(r"^ *pi\b", "1*pi", text), count=1)
    try:
        return exact(rational) * Fraction(1 if rational == text else math.pi)
    except ValueError as error:
        raise ValueError(f"{error}; needed a number such as 1.571, '2/3' or 'pi/2'") from None


def _rounded(part: Any, of: Any) -> int:
    """Significant digits of a number if it is another one, rounded to the digits that are given; else 0."""
    text = of if isinstance(of, str) else f"{of:.{len(str(part).partition('.')[2])}f}"
    return 0 if text == of or _number(part) != exact(text) else len(text.replace(".", "").lstrip("-0"))

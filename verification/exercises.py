"""Check answers to exercises of the course, against what ``docs/builder/exercises.py`` has computed and recorded."""

from __future__ import annotations

import json
import math
from importlib.resources import files
from typing import Any

import numpy as np

from ndtheory.number import exact

#: Relative difference of a number that counts as right: three digits, as pages print them.
THREE_DIGITS = 0.005


def check(exercise: str, answer: Any) -> str:
    """Check the answer to an exercise of the course: ``right``, what is missing, or a hint for a usual mistake.

    Parameters
    ----------
    exercise : str
        Page and number, as they are below the exercise.
    answer : number, str or sequence of them
        What the line below the exercise lists, in its order; numbers to three digits, or fractions as ``"2/3"``.

    Returns
    -------
    str
        A hint explains all parts of the answer that are not right.

    Raises
    ------
    ValueError
        The exercise has no check (the message lists those that have one), or the answer has another number of parts.

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
        raise ValueError(f"{exercise} has no check; these exercises have one: {', '.join(known)}")
    asks, right, wrong = known[exercise].values()
    given = np.array(answer, dtype=object).ravel()
    if len(given) != len(right):
        raise ValueError(f"{exercise}: needed {asks}, {len(right)} in all; received {answer!r}")
    off = [n for n, part in enumerate(given) if not _same(part, right[n])]
    if not off:
        return "right"
    hints = [hint for hint, numbers in wrong.items() if all(_same(given[n], numbers[n]) for n in off)]
    if not hints and all(_rounded(given[n], right[n]) for n in off):
        return "Right as far as it goes; give three digits."
    if all(any(_same(part, of) for part in given) for of in right):
        hints += [f"These are the right answers in another order; needed {asks}."]
    return " ".join([f"Not yet{f', number {off[0] + 1}' * (len(right) > 1)}.", *hints[:1]])


def _same(part: Any, of: Any) -> bool:
    if isinstance(of, str):
        return str(part).strip().upper() == of
    try:
        return math.isclose(exact(part), of, rel_tol=THREE_DIGITS)
    except ValueError as error:
        raise ValueError(f"{error}; needed a number such as 1.571 or '2/3'") from None


def _rounded(part: Any, of: Any) -> bool:
    """True if a number is another one rounded to the digits that are given."""
    digits = len(str(part).partition(".")[2])
    return not isinstance(of, str) and 0 != exact(part) == exact(f"{of:.{digits}f}")

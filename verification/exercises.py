"""Check answers to exercises of the course, against what ``docs/builder/exercises.py`` has computed and recorded."""

from __future__ import annotations

import json
import math
from importlib.resources import files
from typing import Any

import numpy as np

from ndtheory.number import exact
from ndtheory.texts import did_you_mean

#: Relative difference of a number that counts as right: three digits, as pages print them.
THREE_DIGITS = 0.005


def check(exercise: str, answer: Any) -> str:
    """Check the answer to an exercise of the course: ``right``, or a hint for the first part that is not.

    Parameters
    ----------
    exercise : str
        Page and number, as they are below the exercise.
    answer : number, str or sequence of them
        What the line below the exercise lists, in its order; numbers to three digits, or fractions as ``"2/3"``.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        The exercise is unknown (the message lists all), or the answer has another number of parts.

    Examples
    --------
    >>> check("two_bars.2", ["1/3", "3/4", "6/7", "3/2"]), check("two_bars.3", 0.611)
    ('right', 'Not yet. Did you forget a square?')
    """
    known = json.loads((files("verification") / "data" / "exercises.json").read_text("utf-8"))
    exercise = str(exercise)
    if exercise not in known:
        raise ValueError(f"no exercise {exercise!r}; there are {', '.join(known)}{did_you_mean(exercise, known)}")
    right = known[exercise]["right"]
    given = np.array(answer, dtype=object).ravel()
    if len(given) != len(right):
        raise ValueError(f"{exercise}: needed {known[exercise]['asks']}, {len(right)} in all; received {answer!r}")
    for n, part in enumerate(given):
        if not _same(part, right[n]):
            hints = [hint for hint, wrong in known[exercise]["wrong"].items() if _same(part, wrong[n])]
            return " ".join(["Not yet." if len(right) == 1 else f"Not yet, number {n + 1}.", *hints[:1]])
    return "right"


def _same(part: Any, of: Any) -> bool:
    if isinstance(of, str):
        return str(part).strip().lower() == of.lower()
    return math.isclose(exact(part), of, rel_tol=THREE_DIGITS)

"""Errors of the theory: a hypothesis that does not hold."""

from __future__ import annotations

from fractions import Fraction

from ndtheory.number import decimal, typed
from ndtheory.texts import printable

#: Most characters of a value that a message repeats.
LONGEST = 100


class HypothesisError(ValueError):
    """A hypothesis of the theorem fails.

    Parameters
    ----------
    key : str
        The constant concerned, in the paper's notation (``"C_R"``).
    value : object
        The value received.
    needed : str
        The hypothesis, stated positively.
    """

    def __init__(self, key: str, value: object, needed: str) -> None:
        text = typed(value)
        if isinstance(value, (float, Fraction)) and text in needed.split():  # 12 digits do not tell it from a limit
            text = str(value if isinstance(value, float) else decimal(value))
        text = printable(text)  # one line, whatever was received
        text = text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."
        super().__init__(f"{key} = {text}: needed {needed}")
        self.key = key
        self.value = value
        self.needed = needed

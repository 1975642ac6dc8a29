"""Texts from outside: without characters that steer a terminal or break a line, and the name that was meant."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

#: Most characters of a word that are compared with names.
LONGEST_WORD = 100

#: Characters that no text may have: those of control, half surrogate pairs, separators of lines and paragraphs,
#: overrides of the direction of writing, and the two of the first 65,536 that XML excludes.
CONTROL = re.compile("[\u0000-\u001f\u007f-\u009f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def clean(text: str) -> bool:
    """True if a text has no character of control.

    >>> clean("Section 6, \N{GREEK SMALL LETTER MU}m"), clean("Section" + chr(27) + "[2J")
    (True, False)
    """
    return CONTROL.search(text) is None


def printable(text: str) -> str:
    r"""A text on one line: characters of control as the escapes of a Python text, others that print nothing as spaces.

    >>> print(printable("a" + chr(27) + "b" + chr(10) + "c" + chr(0x202E)))
    a\x1bb\nc\u202e
    """
    escaped = CONTROL.sub(lambda found: ascii(found[0])[1:-1], text)
    return escaped if escaped.isprintable() else "".join(c if c.isprintable() else " " for c in escaped)


def nearest(word: str, names: Iterable[str], most: int = 1) -> list[str]:
    """The names that resemble a word, the most similar first, at most so many; upper and lower case are the same.

    >>> nearest("Sektion6", ["two-bars", "section6", "section6-60"])
    ['section6']
    """
    folded = {name.casefold(): name for name in names}
    return [folded[near] for near in difflib.get_close_matches(word[:LONGEST_WORD].casefold(), folded, n=most)]


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """Suggestion to append to an error message; empty where no name resembles it.

    >>> did_you_mean("sectoin6", ["two-bars", "section6"])
    "; did you mean 'section6'?"
    """
    return "".join(f"; did you mean {near!r}?" for near in nearest(word, names))

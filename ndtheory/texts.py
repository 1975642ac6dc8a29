"""Texts from outside, without the characters that steer a terminal, break a line or make an XML file invalid."""

from __future__ import annotations

import re

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

"""Tables as CSV of which a spreadsheet takes no cell for a formula."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

from ndtheory.texts import printable

#: What a formula begins with, also in the wide forms that spreadsheets accept.
FORMULA = "=+\\-@\uff1d\uff0b\uff0d\uff20"

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"

#: A cell that begins like a formula, unless it is a number.
_IN_CELL = re.compile(rf"(?=\s*[{FORMULA}])(?!{_NUMBER}$)")

#: The same behind a comma or a semicolon of a line of words, where brackets may close behind the number.
_IN_LINE = re.compile(rf"([,;][\s\"']*)(?!{_NUMBER}[\s\"'\]}}]*(?:[,;]|$))([{FORMULA}])")


def as_csv(head: Sequence[str], columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table under lines of words that begin with ``#``.

    Parameters
    ----------
    head : sequence of str
        Lines of words, or of TOML, which stay TOML of the same values.
    columns : sequence of str
    rows : iterable of sequences
        None is written as an empty cell.  A text that a spreadsheet would take for a formula follows an apostrophe.

    Examples
    --------
    >>> print(as_csv(["a table"], ["x", "says"], [(-1.5e-3, "=1+1"), (None, "-2")]), end="")
    # a table
    x,says
    -0.0015,'=1+1
    ,-2
    """
    written = io.StringIO()
    for line in head:
        written.write(f"# {_line(line)}".rstrip() + "\n")
    table = csv.writer(written, lineterminator="\n")
    table.writerow(map(_cell, columns))
    table.writerows(map(_cell, row) for row in rows)
    return written.getvalue()


def _cell(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    text = printable(value)
    return "'" + text if _IN_CELL.match(text) else text


def _line(text: str) -> str:
    r"""A line of words; what would begin a formula behind a separator is written as an escape, as TOML has them.

    >>> print(_line('title = "a,=1"'), _line("x = [0, -0.3]"))
    title = "a,\u003d1" x = [0, -0.3]
    """
    return _IN_LINE.sub(lambda found: f"{found[1]}\\u{ord(found[2]):04x}", printable(text))

"""Tables as CSV, in which a spreadsheet takes no cell for a formula."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

from ndtheory.texts import printable

#: First characters of formulas, also in the wide forms that spreadsheets accept.
FORMULA = "=+\\-@\uff1d\uff0b\uff0d\uff20"

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"

#: A cell that begins like a formula, unless it is a number.
_IN_CELL = re.compile(rf"(?=\s*[{FORMULA}])(?!{_NUMBER}$)")

#: The same behind a comma or a semicolon of a line of words: behind a number brackets may close, and then comes the
#: same separator or the end (with semicolons between the cells, the cell of ``;-1,`` is ``-1,`` and no number; behind a
#: quote the cell may go on in the next line).
_IN_LINE = re.compile(rf"(([,;])(?:\s*(?!{_NUMBER}[\s\]}}]*(?:\2|$))|[\s\"']*[\"'][\s\"']*))([{FORMULA}])")


def as_csv(head: Sequence[str], columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Write a table under lines of words that begin with ``#``.

    A line of the head may be TOML: it stays TOML of the same values.  None is written as an empty cell; a text that a
    spreadsheet would take for a formula follows an apostrophe.

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
    r"""Write a line of words; what would begin a formula behind a separator is escaped as in TOML.

    >>> print(_line('title = "a,=1"'), _line("x = [0, -0.3]"))
    title = "a,\u003d1" x = [0, -0.3]
    """
    return _IN_LINE.sub(lambda found: f"{found[1]}\\u{ord(found[3]):04x}", printable(text))

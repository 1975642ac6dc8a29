"""Nested dictionaries as TOML text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from ndtheory.texts import CONTROL

#: What a basic string of TOML cannot hold as it is, or should not, and the short escapes.
ESCAPED = re.compile(rf'(?![\ud800-\udfff])(?:{CONTROL.pattern}|["\\])')  # TOML has no halves of surrogate pairs
SHORT = {"\b": r"\b", "\t": r"\t", "\n": r"\n", "\f": r"\f", "\r": r"\r", '"': r"\"", "\\": r"\\"}


def document(data: Mapping[str, Any]) -> str:
    """A dictionary as TOML: its dictionaries as tables, those within them inline.

    Parameters
    ----------
    data : mapping
        With texts for keys, and texts, numbers, truth values, lists and dictionaries for values.

    Examples
    --------
    >>> print(document({"title": "bars", "body": {"x": [0, 0.1], "prescribed": {"right": "1/3"}}}), end="")
    title = "bars"
    <BLANKLINE>
    [body]
    x = [0, 0.1]
    prescribed = { right = "1/3" }
    """
    tables = {name: value for name, value in data.items() if isinstance(value, Mapping)}
    blocks = [_lines({name: value for name, value in data.items() if name not in tables})]
    blocks += [f"[{key(name)}]\n{_lines(table)}" for name, table in tables.items()]
    return "\n".join(block for block in blocks if block)


def _lines(table: Mapping[str, Any]) -> str:
    return "".join(f"{key(name)} = {value(v)}\n" for name, v in table.items())


def key(name: str) -> str:
    """A key, in quotes where it needs them.

    >>> key("young"), key("left side")
    ('young', '"left side"')
    """
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else string(name)


def string(text: str) -> str:
    r"""A basic string.

    >>> print(string('E in "MPa"'))
    "E in \"MPa\""
    """
    return '"' + ESCAPED.sub(lambda found: SHORT.get(found[0], f"\\u{ord(found[0]):04x}"), text) + '"'


def value(given: Any) -> str:
    """A value on one line.

    Raises
    ------
    TypeError
        None and what else TOML does not know.
    """
    if isinstance(given, bool):
        return str(given).lower()
    if isinstance(given, (int, float)):
        return repr(given)
    if isinstance(given, str):
        return string(given)
    if isinstance(given, (list, tuple)):
        return f"[{', '.join(map(value, given))}]"
    if isinstance(given, Mapping):
        inside = ", ".join(f"{key(name)} = {value(v)}" for name, v in given.items())
        return f"{{ {inside} }}" if inside else "{}"
    raise TypeError(f"{type(given).__name__} is no value of TOML")

"""The tables of keys: those of documents, of which the schemas are made, and those of the problem file."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ndtheory import keys
from verification.problem.entries import EMPTY, REQUIRED, Entries, Entry, entries
from verification.problem.specs import BodySpec, ContactSpec, IterationSpec, ProblemSpec, StepSpec
from verification.problem.writing import plain, value
from verification.schemas import INCLUDED, TYPES, Row, tables

#: Words in types that are not names of parts.
WORDS = {*TYPES, "object", "null"}


def shown(kind: str) -> str:
    """A type with the names of parts in bold."""
    outer = re.match("(object, or )?((list|map) of )*", kind)[0]
    last = kind.removeprefix(outer)
    return kind if last.removesuffix(" or null") in WORDS else f"{outer}**{last}**"


def line(row: Row) -> str:
    """A row as a line of a table in Markdown."""
    if row.keys[0].startswith(INCLUDED):
        return f"| {INCLUDED}**{row.keys[0].removeprefix(INCLUDED)}** | | | {row.meaning} |"
    keys = ", ".join(f"`{key}`" for key in row.keys)
    return f"| {keys} | {shown(row.type)} | {row.unit} | {row.meaning} |"


def table(name: str) -> str:
    """The table of a document or of a part, in Markdown."""
    return "\n".join(["| key | type | unit | meaning |", "|---|---|---|---|", *map(line, tables()[name])])


#: The tables of the problem file as the page on it names them.
FILE = {
    "problem file": ProblemSpec,
    "[body1]": BodySpec,
    "[contact]": ContactSpec,
    "[iteration]": IterationSpec,
    "[[step]]": StepSpec,
}


def file_table(name: str) -> str:
    """A table of the problem file, in Markdown; each row has a place of its own."""
    rows = [
        f'| <span id="{anchor(full_name(name, key))}"></span>`{key}` | {unit} | {meaning} | {default} |'
        for key, unit, meaning, default in file_rows(name)
    ]
    return "\n".join(["| key | unit | meaning | default |", "|---|---|---|---|", *rows])


def full_name(table: str, key: str) -> str:
    """A key with its table, as ``--set`` takes it."""
    return key if table == "problem file" else f"{table.strip('[]')}.{key}"


def anchor(full: str) -> str:
    """The place of a key on the page on problem files."""
    return f"key-{full.replace('.', '-').replace('_', '-')}"


def file_rows(name: str) -> Iterator[tuple[str, str, str, str]]:
    """The rows of a table of the problem file: key, unit, meaning and default."""
    return _rows(FILE[name])


def _rows(cls: type, above: str = "", default: str = "") -> Iterator[tuple[str, str, str, str]]:
    for name, one in entries(cls).items():
        if not (one.read or one.reader or one.shown):  # it has another table
            continue
        key = keys.keys(cls)[name]
        inside = key.table or keys.named_type(keys.annotation(cls, name))[1]
        if isinstance(inside, type) and issubclass(inside, Entries) and name != "parts":
            yield from _rows(inside, f"{above}{name}.", one.shown)
        else:
            yield f"{above}{name}", str(key.unit or ""), str(key.says), str(default or _default(one))


def _default(one: Entry) -> str:
    """The default of a key in words."""
    if one.shown or one.default in (REQUIRED, EMPTY, None, (), {}) or callable(one.default):
        return one.shown
    return f"`{value(plain(one.default))}`"

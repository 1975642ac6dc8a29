"""The tables of the page on documents, from those of which the schemas are made."""

from __future__ import annotations

import re

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

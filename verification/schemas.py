"""The keys of every document as tables, and as JSON Schemas (draft 2020-12).

The tables are made from the keys of the classes of results (:mod:`ndtheory.keys`).  The page on documents shows them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from ndtheory import keys
from ndtheory.keys import INCLUDED, Row
from ndtheory.texts import did_you_mean
from verification import registry
from verification.document import Document

JsonSchema = dict[str, Any]

#: The types of the tables as those of JSON; the other types are made of these, or are parts.
TYPES: dict[str, JsonSchema] = {
    "text": {"type": "string"},
    "truth": {"type": "boolean"},
    "integer": {"type": "integer"},
    "number": {"type": "number"},
    "exact": {"type": ["number", "string"]},
    "vector": {"type": ["number", "string", "array"], "items": {"type": ["number", "string"]}},
    "free": {"type": ["array", "boolean", "number", "object", "string"]},
}

#: The words between two types, of a part and of a list of parts.
EITHER = ", or list of "

#: A reference of the site: its role, its text where it has one, its target.
_REFERENCE = re.compile(r"\{(\w+)\}`(?:([^`<]+) <[^`>]+>|([^`]+))`")


@cache
def tables() -> dict[str, tuple[Row, ...]]:
    """Return the rows of each table, by the schema of a document or the name of a part."""
    for table in ("documents", "bounds"):  # whose parts are the keys
        registry.load(table, "")
    written = [each for each in subclasses(Document) if keys.keys(each) and vars(each).get("schema")]
    classes = {", ".join(filter(None, (each.schema, each.kind))): each for each in written}
    parts = {part: each for each in subclasses(keys.Part) if (part := vars(each).get("part"))}
    made = {
        name: header(cls) + ((included(cls.part),) if cls.part else keys.rows(cls)) for name, cls in classes.items()
    }
    return made | {name: keys.rows(cls) for name, cls in parts.items()}


def header(cls: type[Document]) -> tuple[Row, ...]:
    """Return the rows with which the table of a document begins: it has a problem where its class declares one."""
    base, hint = keys.written(cls, "problem")
    says, absent = "what the result is about", "where that is not a problem file" if "None" in str(hint) else None
    problem = (Row(keys=("problem",), type="Problem", says=says, absent=absent),) if base is not Document else ()
    kind = (Row(keys=("kind",), type="text", says=f"`{cls.kind}`"),) if cls.kind else ()
    return (included("Header"), *problem, *kind)


def included(part: str) -> Row:
    """Return the row that includes all keys of a part."""
    return Row(keys=(INCLUDED + part,))


def subclasses(cls: Any) -> Iterator[Any]:
    """Yield the classes that derive from one, of this program."""
    for each in cls.__subclasses__():
        if each.__module__.startswith(("verification.", "ndtheory.")):
            yield each
        yield from subclasses(each)


def rows(table: str) -> Iterator[tuple[str, str, Row]]:
    """Yield each key of a table with those it includes: the table that has its row, the key, the row."""
    for row in tables()[table]:
        if row.keys[0].startswith(INCLUDED):
            yield from rows(row.keys[0].removeprefix(INCLUDED))
        else:
            for key in row.keys:
                yield table, key, row


def names() -> list[str]:
    """Return the names of the documents, as ``schema`` takes them."""
    return list(dict.fromkeys(_name(table) for table in tables() if table.startswith("ndtheory.")))


def schema(name: str) -> JsonSchema:
    """The JSON Schema of a document, which allows further keys.

    The unit of a value is under ``x-unit``, where 1 means a pure number.

    Parameters
    ----------
    name : str
        Name of the document, such as ``run``, or what the document has under ``schema``, such as ``ndtheory.run/1``.

    Returns
    -------
    dict
        Without references to other files.

    Raises
    ------
    ValueError
        The name is unknown; the message lists the known ones.

    Examples
    --------
    >>> found = schema("bounds")
    >>> found["properties"]["schema"]["const"]
    'ndtheory.bounds/1'
    >>> found["properties"]["inputs"]["properties"]["m"]
    {'type': ['number', 'null'], 'description': 'as given; null where only `--rho` was', 'x-unit': 'stress'}
    """
    kinds = [table for table in tables() if table.startswith("ndtheory.") and name in (_name(table), _schema(table))]
    if not kinds:
        raise ValueError(
            f"no schema {str(name)[:60]!r}; there are {', '.join(names())}{did_you_mean(str(name), names())}"
        )
    documents = [_document(table) for table in kinds]
    found = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:{_schema(kinds[0]).replace('.', ':').replace('/', ':')}",
        "title": _schema(kinds[0]),
        **(documents[0] if len(documents) == 1 else {"type": "object", "oneOf": documents}),
    }
    parts: JsonSchema = {}
    missing = _parts(found)
    while missing:
        parts |= {part: _object(part) for part in missing}
        missing = _parts(parts) - set(parts)
    return {**found, "$defs": {part.replace(" ", "_"): parts[part] for part in sorted(parts)}}


def _schema(table: str) -> str:
    return table.partition(", ")[0]


def _name(table: str) -> str:
    return _schema(table).removeprefix("ndtheory.").partition("/")[0]


def _parts(found: Any) -> set[str]:
    """Return the names of the parts to which a schema refers."""
    if isinstance(found, dict):
        reference = found.get("$ref")
        here = {reference.removeprefix("#/$defs/").replace("_", " ")} if isinstance(reference, str) else set()
        return here.union(*map(_parts, found.values()))
    return set().union(*map(_parts, found)) if isinstance(found, list) else set()


def _document(table: str) -> JsonSchema:
    """Return the schema of a document of one kind."""
    found = _object(table)
    found["properties"]["schema"]["const"], _, kind = table.partition(", ")
    if kind:
        found["properties"]["kind"]["const"] = kind
    return found


def _object(table: str) -> JsonSchema:
    """Return the schema of an object with the keys of a table."""
    objects = {"": _empty()}

    def add(path: str, value: JsonSchema, *, required: bool) -> None:
        above, _, key = path.rpartition(".")
        if above not in objects:  # it has no row, only keys
            objects[above] = _empty()
            add(above, objects[above], required=True)
        if key == "*":
            objects[above]["additionalProperties"] = value
        else:
            objects[above]["properties"][key] = value
            if required:
                objects[above]["required"].append(key)

    for _, key, row in rows(table):
        value = objects[key] = _empty()
        if row.type.endswith("object"):
            for _ in range(row.type.count("list of ")):
                value = {"type": "array", "items": value}
        else:
            value = _value(row.type)
        value = value if row.null is None else _or_null(value)
        value |= {"description": _plain(row.meaning)} if row.meaning else {}
        value |= {"x-unit": row.unit} if row.unit else {}
        add(key, value, required=row.absent is None)
    return objects[""]


def _empty() -> JsonSchema:
    return {"type": "object", "properties": {}, "required": []}


def _value(kind: str) -> JsonSchema:
    """Return the schema of a value by the type in its row."""
    one, either, listed = kind.partition(EITHER)
    if either:
        return {"anyOf": [_value(one), {"type": "array", "items": _value(listed)}]}
    outer, _, inner = kind.partition(" of ")
    if outer == "list":
        return {"type": "array", "items": _value(inner)}
    if outer == "map":
        return {"type": "object", "additionalProperties": _value(inner)}
    if kind.endswith(" or null"):
        return _or_null(_value(kind.removesuffix(" or null")))
    return dict(TYPES[kind]) if kind in TYPES else {"$ref": f"#/$defs/{kind.replace(' ', '_')}"}


def _or_null(value: JsonSchema) -> JsonSchema:
    """Return a schema after null has been allowed in it; an object may still get keys."""
    if "type" not in value:
        return {"anyOf": [value, {"type": "null"}]}
    value["type"] = [*(value["type"] if isinstance(value["type"], list) else [value["type"]]), "null"]
    return value


def _plain(text: str) -> str:
    """Return a meaning without the references of the site."""
    return _REFERENCE.sub(lambda m: m[2] or (f"the page {m[3]}" if m[1] == "doc" else m[3]), text)

"""Keys of documents, each said once: beside the field or the property of a result that has the value.

The document of a result, the reason beside each key that is null, the table of its keys and its JSON Schema follow.

>>> @dataclass(frozen=True, kw_only=True)
... class Plan(Part):
...     asked: int = key("number of rows of the grid", unit="1")
...     stored: int | None = key("rows that the store has", unit="1", null="without a store")
...
...     @property
...     @says("rows that would be made", unit="1")
...     def left(self) -> int:
...         return self.asked - (self.stored or 0)
>>> Plan(asked=3, stored=None).to_dict()
{'asked': 3, 'stored': None, 'left': 3, 'reason': {'stored': 'without a store'}}
>>> [row.keys + (row.type,) for row in rows(Plan)]
[('asked', 'integer'), ('stored', 'integer'), ('left', 'integer'), ('reason', 'map of text')]
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, replace
from fractions import Fraction
from functools import cache
from itertools import count
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")

#: The types of Python as those of the tables; a class of parts is named, or an object with keys of its own.
TYPES = {bool: "truth", int: "integer", float: "number", str: "text", Path: "text", Fraction: "exact", Any: "free"}

#: The value of a key that is left out although its value could also be null.
ABSENT: Any = object()

_order = count()


@dataclass(frozen=True, kw_only=True)
class Key:
    """A key of a document.

    Attributes
    ----------
    says, unit : str
        Its meaning and its unit; empty where there is none.
    null, absent : str or None
        When the value is null, and when the key is left out; None for never.
    why : str or function of the result
        The reason beside a null; the result's own ``reason`` by this name goes first, ``null`` comes last.
    name : str
        Its name, with dots for objects inside, where that is not the name of the field.
    of : function, optional
        From the value of the field to the value of the key.
    type : str
        Its type, where that does not follow from the annotation.
    table : type, optional
        The class that has the keys inside, where the annotation does not say.
    spread : bool
        True if the value is a part whose keys stand among those of the result.
    """

    says: str = ""
    unit: str = ""
    null: str | None = None
    absent: str | None = None
    why: str | Callable[[Any], str] = ""
    name: str = ""
    of: Callable[[Any], Any] | None = None
    type: str = ""
    table: Any = None
    spread: bool = False
    order: int = field(default_factory=lambda: next(_order))

    def reason(self, result: Any, name: str) -> str:
        """Why the value is null."""
        own: str | None = getattr(result, "reason", {}).get(name)
        if own is not None:
            return own
        return self.why(result) if callable(self.why) else self.why or self.null or ""


def _once(compute: Callable[[type], T]) -> Callable[[type], T]:
    """A function of a class that keeps its answers."""
    return cache(compute)


def key(says: str = "", *, default: Any = MISSING, default_factory: Any = MISSING, **more: Any) -> Any:
    """A field of a result that is a key of its document; arguments as of :class:`Key`."""
    return field(default=default, default_factory=default_factory, metadata={"key": Key(says=says, **more)})


def says(says: str = "", **more: Any) -> Callable[[F], F]:
    """Make a property a key: this decorator stands below ``@property``; arguments as of :class:`Key`."""

    def mark(function: F) -> F:
        vars(function)["key"] = Key(says=says, **more)
        return function

    return mark


class Part:
    """A part of documents.  Its table has the name ``part``; without one its keys stand in the tables that have it."""

    part: ClassVar[str] = ""

    def to_dict(self) -> dict[str, Any]:
        """The part as plain dictionaries, lists and numbers."""
        return document(self)


@_once
def keys(cls: type) -> dict[str, Key]:
    """The keys of a class by the names of its fields and properties, in the order in which they are written."""
    found: dict[str, Key] = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            function = getattr(value, "fget", None) or getattr(value, "func", None)
            if mark := getattr(function, "key", None):
                found[name] = mark
        for name, each in vars(base).get("__dataclass_fields__", {}).items():
            if "key" in each.metadata:
                found[name] = each.metadata["key"]
    return dict(sorted(found.items(), key=lambda item: item[1].order))


def document(result: Any) -> dict[str, Any]:
    """The values of a result by key, and beside those that may be null the reason of each that is."""
    found: dict[str, Any] = {}
    explained = _explained(type(result))
    for above in explained:
        _inside(found, above).setdefault("reason", {})
    for attribute, one in keys(type(result)).items():
        value = getattr(result, attribute)
        value = value if one.of is None or value is None or value is ABSENT else one.of(value)
        if value is ABSENT or (value is None and one.absent is not None and one.null is None):
            continue
        if one.spread:
            found |= plain(value)
            continue
        name = one.name or attribute
        above, _, last = name.rpartition(".")
        inside = _inside(found, above)
        inside[last] = plain(value)
        if inside[last] is None and one.null is not None:
            inside["reason"][last] = one.reason(result, name)
    for above in explained:  # it comes last
        inside = _inside(found, above)
        inside["reason"] = inside.pop("reason")
    if "" in explained:
        found["reason"] = dict(getattr(result, "reason", {})) | found["reason"]
    return found


def _inside(found: dict[str, Any], above: str) -> dict[str, Any]:
    for name in above.split(".") if above else ():
        found = found.setdefault(name, {})
    return found


@_once
def _explained(cls: type) -> tuple[str, ...]:
    """The objects of a document that have reasons: those with a key that may be null, unless it has its own."""
    names = {one.name or attribute: one for attribute, one in keys(cls).items()}
    found = dict.fromkeys(name.rpartition(".")[0] for name, one in names.items() if one.null is not None)
    return tuple(above for above in found if f"{above}.reason".lstrip(".") not in names)


def plain(value: Any) -> Any:
    """A value as documents have it."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(each) for each in value]
    if hasattr(value, "tolist"):  # an array, or a number of numpy
        return value.tolist()
    return str(value)


# --- tables -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, slots=True)
class Row:
    """A row of a table: keys that share a type and a meaning.

    Attributes
    ----------
    keys : tuple of str
        Paths with dots, in which ``*`` stands for any name; or one that names an included part.
    type, unit, says : str
        Type, unit and meaning; empty where there is none.
    null, absent : str or None
        When the value is null, and when the key is left out; None for never.
    """

    keys: tuple[str, ...]
    type: str = ""
    unit: str = ""
    says: str = ""
    null: str | None = None
    absent: str | None = None

    @property
    def meaning(self) -> str:
        """The meaning in words, with when the value is null and when the key is left out."""
        conditional = [
            f"{word} {when}" for word, when in (("null", self.null), ("left out", self.absent)) if when is not None
        ]
        return "; ".join([self.says, *conditional] if self.says else conditional)


#: What a row begins with that includes a part.
INCLUDED = "all keys of "


def rows(cls: type) -> tuple[Row, ...]:
    """The rows of the table of a class; keys with one meaning that follow each other share a row."""
    found: list[Row] = []
    for row in _rows(cls):
        last = found[-1] if found else row
        if found and row.says and replace(last, keys=()) == replace(row, keys=()):
            found[-1] = replace(last, keys=last.keys + row.keys)
        else:
            found.append(row)
    return tuple(found)


def _rows(cls: type) -> Iterator[Row]:
    for attribute, one in keys(cls).items():
        inside = None if getattr(one.table, "part", "") else one.table
        kind, inside = (one.type, inside) if one.type else named_type(annotation(cls, attribute))
        name = one.name or attribute
        if one.spread:
            yield from _rows(inside) if inside else (Row(keys=(INCLUDED + kind,)),)
            continue
        yield Row(keys=(name,), type=kind, unit=one.unit, says=one.says, null=one.null, absent=one.absent)
        for row in _rows(inside) if inside else ():
            below = f"{name}.*" if kind.startswith("map") else name
            yield replace(row, keys=tuple(f"{below}.{each}" for each in row.keys))
    for above in _explained(cls):
        yield Row(keys=(f"{above}.reason".lstrip("."),), type="map of text", says="why a key is null")


def annotation(cls: type, attribute: str) -> Any:
    """The type of a field or property; names that its module imports for types alone are not known."""
    for base in cls.__mro__:
        value = vars(base).get(attribute)
        function = getattr(value, "fget", None) or getattr(value, "func", None)
        written = vars(base).get("__annotations__", {}).get(attribute)
        written = function.__annotations__["return"] if function else written
        if written is not None:
            known = {**vars(sys.modules[base.__module__]), **vars(base)}
            return eval(written, known) if isinstance(written, str) else written
    raise AttributeError(f"{cls.__name__}.{attribute} has no type")


def named_type(hint: Any) -> tuple[str, type | None]:
    """The type of an annotation in the words of the tables, and the class whose keys follow, if it has no name."""
    origin, inside = get_origin(hint), get_args(hint)
    if origin in (UnionType, Union):
        return named_type(next(each for each in inside if each is not NoneType))
    if origin is Literal:
        return "text", None
    if origin in (tuple, list) or (origin is not None and issubclass(origin, Mapping)):
        member = inside[1] if origin not in (tuple, list) else inside[0]
        kind, below = named_type(member)
        kind = f"{kind} or null" if NoneType in get_args(member) else kind
        return f"{'list' if origin in (tuple, list) else 'map'} of {kind}", below
    if getattr(hint, "__name__", "") == "ndarray" or getattr(origin, "__name__", "") == "ndarray":
        return "list of number", None
    if isinstance(hint, type) and issubclass(hint, Part):
        return (hint.part, None) if hint.part else ("object", hint)
    return TYPES.get(hint, "free"), None


def parts(cls: type) -> dict[str, type]:
    """The classes of the named parts that the table of a class refers to, by their names, also those inside them."""
    found: dict[str, type] = {}
    for attribute, one in keys(cls).items():
        for each in _classes(one.table if one.type else annotation(cls, attribute)):
            if each.part not in found:
                found |= {each.part: each} if each.part else {}
                found |= {name: one for name, one in parts(each).items() if name not in found}
    return found


def _classes(hint: Any) -> Iterator[type[Part]]:
    if isinstance(hint, type) and issubclass(hint, Part):
        yield hint
    for inside in get_args(hint):
        yield from _classes(inside)

"""Keys of documents, each said once: beside the field or the property of a result that has the value.

The document of a result, the reason beside each key that is null, the table of its keys and its JSON Schema follow.

>>> @dataclass(frozen=True, kw_only=True)
... class Plan(Part):
...     asked: int = key("number of rows of the grid")
...     stored: int | None = key("rows that the store has", null="without a store")
...
...     @property
...     @says("rows that would be made")
...     def left(self) -> int:
...         return self.asked - (self.stored or 0)
>>> Plan(asked=3, stored=None).to_dict()
{'asked': 3, 'stored': None, 'left': 3, 'reason': {'stored': 'without a store'}}
>>> [row.keys + (row.type,) for row in rows(Plan)]
[('asked', 'integer'), ('stored', 'integer'), ('left', 'integer'), ('reason', 'map of text')]
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, replace
from fractions import Fraction
from functools import cache
from itertools import count
from pathlib import Path
from types import NoneType, SimpleNamespace, UnionType
from typing import Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin, get_type_hints, overload

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")

#: Names of types of Python in the tables; a class of parts is named, or is an object whose keys follow.
TYPES = {bool: "truth", int: "integer", float: "number", str: "text", Path: "text", Fraction: "exact", Any: "free"}

#: The types that have a unit.
NUMBERS = {"integer", "number", "Number"}

#: The value of a key that is left out although its value could also be null.
ABSENT: Any = object()

_order = count()


@dataclass(frozen=True, kw_only=True)
class Key:
    """A key of a document.

    Attributes
    ----------
    says : str
        Its meaning.
    unit : str or None
        Its unit; by default numbers are pure, of the unit 1.
    null, absent : str or None
        When the value is null, and when the key is left out; None for never.
    why : str or function of the result, or None
        The reason beside a null; the result's own ``reason`` by this name goes first, ``null`` comes last.  None where
        no reason is given beside it.
    name : str
        Its name, with dots for objects inside, where that is not the name of the field.
    of : function, optional
        From the value of the field to the value of the key.
    type : str
        Its type, where that does not follow from the annotation.
    table : type, optional
        The class that has the keys inside, where the annotation does not say.
    spread : bool
        True if the value is a part whose keys are keys of the result.
    inside : dict of Key, optional
        The keys of a dictionary, or of each one in a list, with their types.
    """

    says: str = ""
    unit: str | None = None
    null: str | None = None
    absent: str | None = None
    why: str | Callable[[Any], str] | None = ""
    name: str = ""
    of: Callable[[Any], Any] | None = None
    type: str = ""
    table: Any = None
    spread: bool = False
    inside: Mapping[str, Key] = field(default_factory=dict)
    order: int = field(default_factory=lambda: next(_order))

    def reason(self, result: Any, name: str) -> str:
        """Why the value is null."""
        own: str | None = getattr(result, "reason", {}).get(name)
        if own is not None:
            return own
        return self.why(result) if callable(self.why) else self.why or self.null or ""

    @property
    def explained(self) -> bool:
        """True if a reason is given beside a null."""
        return self.null is not None and self.why is not None

    def row(self, name: str, kind: str) -> Row:
        """Its row in a table."""
        unit = self.unit if self.unit is not None else "1" if NUMBERS & {*kind.split()} else ""
        return Row(keys=(name,), type=kind, unit=unit, says=self.says, null=self.null, absent=self.absent)


def _once(compute: Callable[[type], T]) -> Callable[[type], T]:
    """A function of a class that keeps its answers."""
    return cache(compute)


def key(says: str = "", *, default: Any = MISSING, default_factory: Any = MISSING, **more: Any) -> Any:
    """A field of a result that is a key of its document; arguments as of :class:`Key`."""
    return field(default=default, default_factory=default_factory, metadata={"key": Key(says=says, **more)})


def says(says: str = "", **more: Any) -> Callable[[F], F]:
    """Make a property a key: this decorator stands below ``@property``; arguments as of :class:`Key`.

    Without a meaning the first paragraph of the docstring is the meaning.
    """

    def mark(function: F) -> F:
        summary = " ".join((function.__doc__ or "").partition("\n\n")[0].split()).replace("``", "`").rstrip(".")
        return _marked(function, Key(says=says or summary[:1].lower() + summary[1:], **more))

    return mark


def _marked(function: F, one: Key) -> F:
    vars(function)["key"] = one
    return function


@overload
def derived(says: str, of: Callable[[Any], Any], hint: type[T], **more: Any) -> T: ...
@overload
def derived(says: str, of: Callable[[Any], Any], hint: Any = str, **more: Any) -> Any: ...
def derived(says: str, of: Callable[[Any], Any], hint: Any = str, **more: Any) -> Any:
    """A property of a type that only looks a value up in parts of a result, as a key; arguments as of :class:`Key`."""
    of.__annotations__["return"] = hint
    return property(_marked(of, Key(says=says, **more)), doc=says)


class Part:
    """A part of documents.  Its table is called ``part``; without one its keys are in the tables that have it."""

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
            reasons = found.get("reason", {})
            found |= plain(value)
            if reasons:
                found["reason"] = reasons | found["reason"]
            continue
        name = one.name or attribute
        above, _, last = name.rpartition(".")
        inside = _inside(found, above)
        inside[last] = plain(value)
        if inside[last] is None and one.explained and above in explained:
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
    found = dict.fromkeys(name.rpartition(".")[0] for name, one in names.items() if one.explained)
    return tuple(above for above in found if f"{above}.reason".lstrip(".") not in names)


def plain(value: Any) -> Any:
    """A value as documents have it; a number that is not finite is null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if hasattr(value, "content"):  # a document inside another one
        return value.content()
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(each) for each in value]
    if hasattr(value, "tolist"):  # an array, or a number of numpy
        return plain(value.tolist())
    return str(value)


# --- tables -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, slots=True)
class Row:
    """A row of a table: keys that share a type and a meaning.

    ``keys`` are paths with dots, in which ``*`` stands for any name, or one that names an included part.  ``type``,
    ``unit`` and ``says``, its meaning, are empty where there is none; ``null`` and ``absent`` say when the value is
    null, and when the key is left out, None for never.
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
        if one.inside and not one.type:
            kind = "list of object" if kind.startswith("list") else "object"
        if one.spread:
            yield from _rows(inside) if inside else (Row(keys=(INCLUDED + kind,), says=one.says),)
            continue
        if inside and kind.startswith("map of "):  # its members have a row, and it has one where it may be missing
            if one.null is not None or one.absent is not None:
                yield replace(one.row(name, "object"), says="")
            name, kind, one = f"{name}.*", kind.removeprefix("map of "), replace(one, null=None, absent=None)
        yield one.row(name, kind)
        yield from (each.row(f"{name}.{below}", each.type) for below, each in one.inside.items())
        for row in _rows(inside) if inside else ():
            yield replace(row, keys=tuple(f"{name}.{each}" for each in row.keys))
    among = [annotation(cls, attribute) for attribute, one in keys(cls).items() if one.spread]
    for above in set(_explained(cls)).difference(*map(_explained, among)):  # these bring their own row
        yield Row(keys=(f"{above}.reason".lstrip("."),), type="map of text", says="why a key is null")


def annotation(cls: type, attribute: str) -> Any:
    """The type of a field or property; names that its module imports for types alone are not known."""
    base, text = written(cls, attribute)
    known = {**vars(sys.modules[base.__module__]), **vars(base)}
    return get_type_hints(SimpleNamespace(__annotations__={attribute: text}), known)[attribute]


def written(cls: type, attribute: str) -> tuple[type, Any]:
    """The class that has a field or property, and its type as it is written there."""
    for base in cls.__mro__:
        value = vars(base).get(attribute)
        function = getattr(value, "fget", None) or getattr(value, "func", None)
        text = function.__annotations__["return"] if function else vars(base).get("__annotations__", {}).get(attribute)
        if text is not None:
            return base, text
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
    return TYPES.get(hint, "text" if isinstance(hint, type) and issubclass(hint, str) else "free"), None

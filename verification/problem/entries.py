"""Keys of the problem file, each said once: beside the field that has its value.

:func:`entry` makes a field of a class of :class:`Entries` a key of one of the file's tables.  Reading, writing, the
digest of a problem, what ``changed`` takes, the names in errors, the JSON document with its schema, and the page on
problem files follow.

>>> @dataclass(frozen=True, kw_only=True)
... class Spring(Entries):
...     stiffness: int = entry("force per length", read=int, unit="stress")
...     turns: int = entry("number of windings", read=int, default=5, later=True)
>>> spring = Spring(**read_entries(Spring, TomlTable({"stiffness": 3}, "my.toml", "spring")))
>>> spring.to_dict(), spring.tables(counting=True)
({'stiffness': 3, 'turns': 5}, {'stiffness': 3})
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field
from fractions import Fraction
from typing import Any, TypeVar

from ndtheory import keys
from verification.problem.tables import TomlTable
from verification.problem.writing import plain

T = TypeVar("T")
K = TypeVar("K")
V = TypeVar("V")

#: The default of a key that the file must have; the default of a table that may be missing and is then read as empty.
REQUIRED: Any = object()
EMPTY: Any = object()


class ReadOnly(Mapping[K, V]):
    """An immutable mapping that a frozen dataclass can hold; equal ones iterate alike, in the order of the keys.

    >>> ReadOnly({"top": 1, "left": 2})
    {'left': 2, 'top': 1}
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[K, V] | Iterable[tuple[K, V]] = ()) -> None:
        self._values: dict[K, V] = dict(sorted(dict(values).items()))

    def __getitem__(self, key: K) -> V:
        return self._values[key]

    def __iter__(self) -> Iterator[K]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return hash(tuple(self._values.items()))

    def __repr__(self) -> str:
        return repr(self._values)


class At:
    """The place of a key: its table, the values read there before it, and what the tables around it say."""

    def __init__(self, table: TomlTable, around: Mapping[str, Any]) -> None:
        self.table, self.name = table, ""
        self.found: dict[str, Any] = {}
        self._around = around

    def __getitem__(self, name: str) -> Any:
        return self.found[name] if name in self.found else self._around[name]

    def inside(self, value: Any) -> TomlTable:
        """Return the value of the key that is read as a table."""
        return self.table.within(self.name, value)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """The reading and the writing of a key.

    Attributes
    ----------
    read : function, optional
        It reads a value; ``reader`` takes the place too, as :class:`At`.  Without both, the key is read by who knows
        the whole file.
    default : object or function of At
        The value of a missing key; in words where it is ``shown``.
    only : function of At
        True where the key applies, False where it is unknown, or a text that refuses it.
    initial : object
        The value where the key does not apply, and of the field.
    write : function of the object, optional
        The value as it is read; None for none.
    counts : function
        What of the written value enters a digest; None for nothing.
    later : bool
        True if the key came after the first release: it enters a digest only where it differs from its default.
    name : str
        The key, where it is not the name of the field.
    """

    read: Callable[[Any], Any] | None = None
    reader: Callable[[Any, At], Any] | None = None
    default: Any = REQUIRED
    shown: str = ""
    only: Callable[[At], bool | str] = lambda at: True
    initial: Any = REQUIRED
    write: Callable[[Any], Any] | None = None
    counts: Callable[[Any], Any] = lambda value: value
    later: bool = False
    name: str = ""


def entry(
    says: str = "", read: Callable[[Any], Any] | None = None, default: Any = REQUIRED, unit: str = "", **more: Any
) -> Any:
    """A field that is a key of the problem file: arguments as of :class:`Entry` and of :class:`ndtheory.keys.Key`.

    Without ``initial`` a default other than a function is also the value where the key does not apply.
    """
    initial = more.pop("initial", REQUIRED if default is EMPTY or callable(default) else default)
    own = {name: more.pop(name) for name in [*more] if name in Entry.__dataclass_fields__ and name != "name"}
    one = Entry(read=read, default=default, initial=initial, name=more.get("name", ""), **own)
    if not (initial or initial == 0):
        more.setdefault("absent", "where there is none")
    metadata = {"key": keys.Key(says=says, unit=unit, **more), "entry": one}
    return field(default=MISSING if initial is REQUIRED else initial, metadata=metadata)


class Entries(keys.Part):
    """A table of the problem file; the mappings in it are read-only."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, Mapping):
                object.__setattr__(self, name, ReadOnly(value))

    def tables(self, *, counting: bool = False) -> dict[str, Any]:
        """Return the keys with the values that their readers return, or only what of them enters a digest.

        A key without a value (no interval, no radius, no sides) is left out.
        """
        found: dict[str, Any] = {}
        for name, one in entries(type(self)).items():
            value = getattr(self, name) if one.write is None else one.write(self)
            if counting:
                value = None if one.later and value == one.default else one.counts(value)
            value = _inside(value, counting)
            if isinstance(value, Spread):
                found |= {name: each for name, each in value.items() if each != {}}
            elif value not in (None, (), {}):
                found[one.name or name] = value
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the table as plain dictionaries, lists and numbers."""
        written: dict[str, Any] = plain(self.tables())
        return written


class Spread(dict[str, Any]):
    """Several keys of a table, from one field."""


def _inside(value: Any, counting: bool) -> Any:
    if isinstance(value, Entries):
        return value.tables(counting=counting)
    if isinstance(value, Mapping):
        kind = Spread if isinstance(value, Spread) else dict
        return kind((name, _inside(each, counting)) for name, each in value.items())
    if not isinstance(value, tuple):
        return value
    each = tuple("free" if v is None else _inside(v, counting) for v in value)
    return each[0] if len(value) == 1 and isinstance(value[0], Fraction | None) else each  # a vector of a bar


def entries(cls: Any) -> dict[str, Entry]:
    """The keys of a table by the names of its fields, in the order in which they are read and written."""
    fields: Mapping[str, Any] = cls.__dataclass_fields__
    marked = {name: fields[name].metadata for name in keys.keys(cls) if name in fields}
    return {name: metadata["entry"] for name, metadata in marked.items() if "entry" in metadata}


def names(cls: type) -> list[str]:
    """The keys of a table as the file has them."""
    return [one.name or name for name, one in entries(cls).items()]


def _placed(reader: Callable[[Any, At], Any], at: At) -> Callable[[Any], Any]:
    return lambda value: reader(value, at)


def read_entries(cls: type, table: TomlTable, **around: Any) -> dict[str, Any]:
    """Read the keys of a table, by the fields of its class; ``around`` has what the tables around it say.

    Raises
    ------
    ProblemError
    """
    at = At(table, around)
    for name, one in entries(cls).items():
        read = one.read if one.reader is None else _placed(one.reader, at)
        if read is None:
            continue
        at.name, applies = one.name or name, one.only(at)
        if isinstance(applies, str) and at.name in table:
            raise table.refuse(at.name, None, applies)
        if applies is not True:
            at.found[name] = one.initial
            continue
        default = one.default(at) if callable(one.default) else one.default
        if default is EMPTY and at.name not in table:
            default = read({})
        at.found[name] = table.take(at.name, read, *(() if default in (REQUIRED, EMPTY) else (default,)))
    return at.found


def read_table(cls: type[T], table: TomlTable, **around: Any) -> T:
    """Return a table with the keys of a class, and no other."""
    found = cls(**read_entries(cls, table, **around))
    table.close()
    return found

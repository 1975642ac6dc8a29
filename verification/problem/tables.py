"""Typed reading of tables: every key is read once; an error is one line with file, key, value and what is needed."""

from __future__ import annotations

import re
import stat
from collections.abc import Callable, Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from string import digits
from typing import Any, TypeVar

from ndtheory import exact
from ndtheory.number import UnusualSize, typed
from ndtheory.texts import CONTROL, did_you_mean, nearest, printable

V = TypeVar("V")
_MISSING: Any = object()

#: Numbers of a problem file lie between these sizes or are 0; beyond them products of a few overflow a double.
SMALLEST, LARGEST = Fraction(1, 10**30), Fraction(10**30)

#: Most characters of a value that a message repeats.
LONGEST = 60

#: Most characters of a path that a message repeats.
LONGEST_PATH = 600

#: An empty key in a message.
QUOTED = '""'


class ProblemError(ValueError):
    """A problem that cannot be used.

    Parameters
    ----------
    file : str
        The problem file, or ``<dict>``.
    key : str
        Dotted path of the key, empty where the error is about the whole file.
    value : object
        The value received; None where there is none.
    needed : str
        What was needed, stated positively.
    """

    def __init__(self, file: str, key: str, value: object, needed: str) -> None:
        received = "" if value is None else f" = {show(plain(value))}"
        where = file if len(file) <= LONGEST_PATH else "..." + file[3 - LONGEST_PATH :]  # its end names the file
        message = ": ".join(part for part in (where, f"{short(key)}{received}", short(needed, 400)) if part)
        super().__init__(printable(message))  # one line, whatever was received
        self.file = file
        self.key = key
        self.value = value
        self.needed = needed


class Unfit(Exception):
    """A value that a reading function refuses; the message says what is needed."""


def short(text: str, most: int = 100) -> str:
    """Shorten a text to so many characters, leaving out its end.

    >>> short("a" * 200, 10)
    'aaaaaaa...'
    """
    return text if len(text) <= most else text[: most - 3] + "..."


def unreadable(path: Path, most: int) -> str | None:
    """Return why a path is not a regular file of at most ``most`` bytes, or None where it is.

    Call it before opening a file: a pipe or a device may have no end.
    """
    try:
        found = path.stat()
    except FileNotFoundError:
        return "no such file"
    except (OSError, ValueError) as error:
        return f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if stat.S_ISDIR(found.st_mode):
        return "a file is needed, this is a folder"
    if not stat.S_ISREG(found.st_mode):
        return "a regular file is needed, this is a pipe or a device; write its content to a file first"
    if found.st_size > most:
        return f"a file of at most {most / 1e6:g} MB is needed, this one has {found.st_size / 1e6:.0f} MB"
    return None


def show(value: object) -> str:
    """Write a value on one short line, as a problem file writes it."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, str):
        text = repr(value).replace("'", '"')
    elif value is None:  # a component
        text = '"free"'
    elif isinstance(value, Path):  # its end names the file
        name = str(value)
        return show(name if len(name) < LONGEST - 2 else "..." + name[5 - LONGEST :])
    elif isinstance(value, Mapping):
        text = "{" + ", ".join(f"{key} = {show(v)}" for key, v in value.items()) + "}"
    elif isinstance(value, (list, tuple)):
        text = "[" + ", ".join(map(show, value)) + "]"
    else:
        text = typed(value)
    return short(" ".join(text.split()), LONGEST)


def number(
    needed: str = "a number", holds: Callable[[Fraction], bool] = lambda v: True, least: Fraction = SMALLEST
) -> Callable[[Any], Fraction]:
    """Return a reader of exact numbers, 0 or at least ``least`` in size: 0.4, 4e-1 or "2/5"; never true, NaN, infinity.

    The condition must hold for the number and for the double it becomes.
    """

    def read(value: Any) -> Fraction:
        if isinstance(value, bool) or not isinstance(value, (int, float, str, Decimal, Fraction)):
            raise Unfit(f"needed {needed}")
        of_size = f"needed {needed}, of a size between {float(least):g} and {float(LARGEST):g}"
        try:
            result = exact(value)
        except UnusualSize as error:
            raise Unfit(of_size if holds(error.near) else f"needed {needed}") from None
        except ValueError:
            unit = isinstance(value, str) and NUMBER_AND_UNIT.fullmatch(value)
            raise Unfit(f"needed {needed}" + NO_UNIT * bool(unit)) from None
        if result and not least <= abs(result) <= LARGEST:
            raise Unfit(of_size)
        if not (holds(result) and holds(Fraction(float(result)))):
            raise Unfit(f"needed {needed}")
        return result

    return read


#: A number with a unit behind it, as 70 GPa; what begins with e or x at once belongs to the number.
NUMBER_AND_UNIT = re.compile(r"\s*[-+]?[\d.][\d.,/]*(?:[eE][-+]?\d+)?(?:\s+|(?![eExX]))[^\W\d_].*")

#: The end of an error about such a text.
NO_UNIT = ", without a unit"

positive = number("a number > 0", lambda v: v > 0)
non_negative = number("a number >= 0", lambda v: v >= 0)


def integer(needed: str, least: int) -> Callable[[Any], int]:
    """Return a reader of whole numbers: not 12.0 and not true."""

    def read(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < least or value.bit_length() > 1000:
            raise Unfit(f"needed {needed}")
        return value

    return read


def text(value: Any) -> str:
    """Read a string."""
    if not isinstance(value, str):
        raise Unfit("needed a text in quotes")
    return value


def label(value: Any) -> str:
    """Read a string that terminals and files can show: no control characters, no half of a surrogate pair."""
    try:
        text(value).encode()
    except UnicodeEncodeError:
        raise Unfit("needed a text of whole characters, this one has half a surrogate pair") from None
    if found := CONTROL.search(value):
        raise Unfit(f"needed a text without control characters, this one has {found[0]!a}")
    return str(value)


def choice(*allowed: Any) -> Callable[[Any], Any]:
    """Return a reader of one of a few values."""

    def read(value: Any) -> Any:
        if type(value) not in {type(v) for v in allowed} or value not in allowed:  # 1 is not true and not 1.0
            meant = did_you_mean(value, [v for v in allowed if isinstance(v, str)]) if isinstance(value, str) else ""
            raise Unfit("needed one of " + ", ".join(show(v) for v in allowed) + meant)
        return value

    return read


def several(read: Callable[[Any], V], count: int, needed: str) -> Callable[[Any], tuple[V, ...]]:
    """Return a reader of lists of exactly ``count`` values."""

    def read_all(value: Any) -> tuple[V, ...]:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise Unfit(f"needed {needed}")
        return tuple(read(v) for v in value)

    return read_all


def ends(value: Any) -> tuple[Fraction, Fraction]:
    """Read ``[a, b]`` with a < b."""
    needed = "two numbers [a, b] with a < b"
    a, b = several(number(needed), 2, needed)(value)
    if not float(a) < float(b):
        raise Unfit(f"needed {needed}")
    return a, b


def plain(value: Any) -> Any:
    """Return a sequence as a list, inside it too, and an array or a number of numpy as lists and numbers of Python."""
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value.tolist() if hasattr(value, "tolist") else value


class TomlTable:
    """A table of which every key is taken once; any key left over is an error.

    Parameters
    ----------
    path : str
        Dotted path of the table, empty at the top.
    """

    def __init__(self, data: Mapping[str, Any], file: str, path: str = "") -> None:
        self._data = dict(data)
        self._file = file
        self._path = path
        self._known: list[str] = []
        self._free: list[str] = []  # names that only this file has, as those of sides
        self._below: list[TomlTable] = []  # the tables in it

    def key(self, name: str) -> str:
        """Return the dotted path of a key in this table, an empty one in quotes."""
        return f"{self._path}.{name or QUOTED}" if self._path else name or QUOTED

    def refuse(self, name: str, value: Any, needed: str) -> ProblemError:
        """Return the error for a key of this table."""
        return ProblemError(self._file, self.key(name), value, needed)

    def __contains__(self, name: str) -> bool:
        return name in self._data

    def get(self, name: str) -> Any:
        """Return the value of a key as it is, None where there is none; the key is still to be taken."""
        return self._data.get(name)

    def take(self, name: str, read: Callable[[Any], V], default: Any = _MISSING) -> V:
        """Read a key; a missing one takes its default or raises ProblemError, as a value does that does not fit."""
        self._known.append(name)
        value = self._data.pop(name, _MISSING)
        if value is _MISSING:
            if default is _MISSING:
                meant = "".join(f"; is it {self.key(near)}?" for near in nearest(name, map(str, self._data)))
                raise self.refuse(name, None, f"this key is missing{meant}")
            result: V = default
            return result
        try:
            return read(plain(value))
        except Unfit as error:
            raise self.refuse(name, value, str(error)) from None

    def within(self, name: str, value: Any) -> TomlTable:
        """Return the value of a key as a table."""
        if not isinstance(value, Mapping):
            raise Unfit("needed a table")
        table = TomlTable(value, self._file, self.key(name))
        self._below.append(table)
        return table

    def table(self, name: str, *, required: bool = False) -> TomlTable:
        """Read a sub-table; a missing one is empty unless required."""
        missing = () if required else (self.within(name, {}),)
        return self.take(name, lambda value: self.within(name, value), *missing)

    def names(self) -> Iterable[str]:
        """Return the keys not taken yet."""
        self._free += map(str, self._data)
        return list(self._data)

    def close(self) -> None:
        """Raise ProblemError for a key that was not taken, naming it and the nearest known one."""
        for name, value in self._data.items():
            # body3 does not misspell body2: names that differ only in their number are meant as they are
            others = [known for known in self._known if known.rstrip(digits) != str(name).rstrip(digits)]
            near = nearest(str(name), others)
            tables = [table for table in self._below if "[" not in table._path]  # `--set` reaches no member of a list
            exact = [table.key(name) for table in tables if name in table._known and name not in table._free]
            meant = exact or near
            known = (
                f"did you mean {' or '.join(map(repr, meant))}?" if meant else f"known here: {', '.join(self._known)}"
            )
            what = "table" if isinstance(value, Mapping) else "key"
            raise self.refuse(str(name), None, f"unknown {what}; {known}")

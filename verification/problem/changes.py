"""Problems made from problems: keys of the problem file with other values, read by the readers of the file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import Any

from verification.problem.reading import read_problem
from verification.problem.specs import ProblemSpec
from verification.problem.tables import QUOTED, ProblemError
from verification.problem.vocabulary import Vocabulary
from verification.problem.writing import tables

#: A key by its tables and its name.
Key = tuple[str, ...]

#: Stands where a value would, while a key is read.
_HERE = "value"


def with_values(problem: ProblemSpec, values: Iterable[tuple[Key, Any]], words: Vocabulary) -> ProblemSpec:
    """The problem with some keys of its file set, one after the other.

    A rule that takes its step from rho, set without a theta, comes with ``auto``.

    Raises
    ------
    ProblemError
    """
    data, given = tables(problem), dict(values)
    if not words.takes_theta(given.get(("iteration", "relaxation"))):
        given = {("iteration", "theta"): "auto"} | given
    for key, value in given.items():
        *parents, name = key
        table = data
        for depth, parent in enumerate(parents, 1):
            table = table.setdefault(parent, {})
            if not isinstance(table, dict):
                needed = f"unknown key; {'.'.join(key[:depth])} is no table"
                raise ProblemError(problem.source, ".".join(key), None, needed)
        table[name] = value
    return read_problem(data, problem.source, words)


def given(values: Mapping[Key, Any], pairs: Mapping[str, Any], source: str) -> list[tuple[Key, Any]]:
    """The keys that have a value, also those of both bodies by pairs of values; None leaves a key as it is.

    Raises
    ------
    ProblemError
    """
    found = {key: value for key, value in values.items() if value is not None}
    for name, pair in pairs.items():
        if pair is None:
            continue
        if not isinstance(pair, (list, tuple)) or len(pair) != 2:
            needed = "needed two values, for body 1 and body 2 (None leaves a body as it is)"
            raise ProblemError(source, name, pair, needed)
        found |= {(f"body{i}", name): value for i, value in enumerate(pair, 1) if value is not None}
    return list(found.items())


def typed(values: Mapping[str, Any], source: str) -> list[tuple[Key, Any]]:
    """Dotted keys and TOML values as they are typed.

    Raises
    ------
    ProblemError
    """
    return [(_key(name, source), _value(name, value, source)) for name, value in values.items()]


def _key(name: str, source: str) -> Key:
    """``body2.prescribed.top`` by its parts; TOML reads it, so that a part may be quoted."""
    refused = ProblemError(source, name or QUOTED, None, "needed the name of a key, as contact.friction")
    try:
        found: Any = tomllib.loads(f'{name} = "{_HERE}"') if name.isprintable() else None
    except (tomllib.TOMLDecodeError, RecursionError):
        raise refused from None
    parts = []
    while isinstance(found, dict) and len(found) == 1:
        [(part, found)] = found.items()
        parts.append(part)
    if found != _HERE or not parts:
        raise refused
    return tuple(parts)


def _value(name: str, value: Any, source: str) -> Any:
    """A TOML value; a text that is none and opens none is meant as it stands."""
    if not isinstance(value, str):
        return value
    if not value.strip():
        raise ProblemError(source, name, value, 'needed a value (an empty text is "")')
    try:
        found = tomllib.loads(f"{_HERE} = {value}", parse_float=Decimal)
        if len(found) == 1:
            return found[_HERE]
    except (ValueError, ArithmeticError, RecursionError):
        pass
    if value.lstrip()[0] in "\"'[{":
        raise ProblemError(source, name, value, "this is not a TOML value: a bracket, brace or quotation mark is wrong")
    return value

"""A problem as the dictionary of its file, exactly, and a dictionary as TOML text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

from ndtheory import exact
from ndtheory.number import LARGEST_EXPONENT
from ndtheory.texts import CONTROL
from verification.problem.specs import BodySpec, ContactSpec, Loads, MeshFile, ProblemSpec, StepSpec

#: Integers up to this size are doubles: readers of JSON agree on them.
LARGEST_INTEGER = 2**53

#: What a basic string of TOML cannot hold as it is, or should not, and the short escapes.
ESCAPED = re.compile(rf'(?![\ud800-\udfff])(?:{CONTROL.pattern}|["\\])')  # TOML has no halves of surrogate pairs
SHORT = {"\b": r"\b", "\t": r"\t", "\n": r"\n", "\f": r"\f", "\r": r"\r", '"': r"\"", "\\": r"\\"}


def tables(problem: ProblemSpec) -> dict[str, Any]:
    """Return the keys of the problem file with the values that their readers return.

    They come in the order of the built-in files.  A key without a value (no interval, no radius, no sides) is left out.
    """
    return {
        "title": problem.title,
        "dimension": problem.dimension,
        **({"plane": problem.plane} if problem.dimension == 2 else {}),
        "units": dict(problem.units),
        **{f"body{i}": _body(body) for i, body in problem.bodies.items()},
        "contact": _contacts(problem.contact),
        "iteration": _iteration(problem),
        "norm": {"length": problem.length},
        **({"step": tuple(_step(step, problem.dimension == 1) for step in problem.steps)} if problem.steps else {}),
    }


def _body(body: BodySpec) -> dict[str, Any]:
    bar = body.shape == "interval"
    written: dict[str, Any] = {
        "shape": None if body.mesh else body.shape,
        "mesh": body.mesh,
        "x": body.x,
        "y": body.y,
        "cells": body.cells[0] if bar and body.cells else body.cells,
    }
    if not body.rigid:
        written |= {
            "young": {name: E for name, (E, _) in body.materials.items()} or body.young,
            "poisson": {name: nu for name, (_, nu) in body.materials.items()} or (None if bar else body.poisson),
            "parts": {name: {"side": part.side, part.axis: part.ends} for name, part in body.parts.items()},
            "fixed": body.fixed,
            **_loads(body, bar),
        }
    return _present(written)


def _loads(loads: BodySpec | Loads, bar: bool) -> dict[str, Any]:
    force = loads.body_force
    return {
        "prescribed": {side: _vector(values, bar) for side, values in loads.prescribed.items()},
        "traction": {side: _vector(values, bar) for side, values in loads.traction.items()},
        "body_force": None if force is None else _vector(force, bar),
    }


def _step(step: StepSpec, bar: bool) -> dict[str, Any]:
    bodies = {name: _present(_loads(loads, bar)) for name, loads in (("body1", step.body1), ("body2", step.body2))}
    return _present({"name": step.name, "increments": step.increments, **bodies})


def _contacts(contact: ContactSpec) -> Any:
    if not contact.lines:
        return _contact(contact)
    return tuple({"bodies": line.bodies, **_contact(line.contact)} for line in contact.lines)


def _iteration(problem: ProblemSpec) -> dict[str, Any]:
    body, given = problem.iteration.neumann_body, vars(problem.iteration)
    if not problem.contact.lines:
        return {"neumann_body": body} | given
    rest = {key: value for key, value in given.items() if key != "neumann_body"}
    return {"neumann_bodies": problem.numbers(body)} | rest


def _contact(contact: ContactSpec) -> dict[str, Any]:
    written = vars(contact) | {"profile": None, "lines": None}
    if contact.profile is not None and contact.friction:
        written["friction"] = contact.profile.table(contact.friction)
    return _present(written)


def _vector(values: tuple[Fraction | None, ...], bar: bool) -> Any:
    """List the components of a vector, None as ``free``; of a bar there is only one, and it stays a number."""
    named = tuple("free" if v is None else v for v in values)
    return named[0] if bar else named


def _present(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if value not in (None, (), {})}


def plain(value: Any) -> Any:
    """Convert to the types that JSON and TOML have: dictionaries, lists, numbers, texts."""
    if isinstance(value, Mapping):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    if isinstance(value, MeshFile):
        return {"path": str(value.path), "sha256": value.sha256}
    return written_number(value) if isinstance(value, Fraction) else value


def written_number(value: Fraction) -> int | float | str:
    """Write a rational as a number where the decimal printed for it is exact, else as a fraction in a text.

    >>> written_number(Fraction(1, 10)), written_number(Fraction(1, 3)), written_number(Fraction(70000))
    (0.1, '1/3', 70000)
    """
    if value.denominator == 1 and abs(value) <= LARGEST_INTEGER:
        return int(value)
    nearest = float(value)
    if exact(nearest) == value:
        return nearest
    # Decimal: Python turns no integer of thousands of digits into a text
    numerator, denominator = Decimal(value.numerator), Decimal(value.denominator)
    shift = min(numerator.adjusted(), denominator.adjusted())
    if max(numerator.adjusted(), denominator.adjusted()) <= LARGEST_EXPONENT:  # what is read back as it stands
        return f"{numerator}/{denominator}"
    return f"{numerator}e-{shift}/{denominator}e-{shift}"


def toml(data: Mapping[str, Any]) -> str:
    """Write a dictionary as TOML: its dictionaries as tables, lists of them as arrays of tables, those within inline.

    The keys are texts; the values are texts, numbers, truth values, lists and dictionaries.

    >>> print(toml({"title": "bars", "body": {"x": [0, 0.1], "prescribed": {"right": "1/3"}}}), end="")
    title = "bars"
    <BLANKLINE>
    [body]
    x = [0, 0.1]
    prescribed = { right = "1/3" }
    """
    tables = {name: value for name, value in data.items() if isinstance(value, Mapping)}
    several = lambda given: isinstance(given, list) and given and all(isinstance(each, Mapping) for each in given)
    arrays = {name: value for name, value in data.items() if several(value)}
    blocks = [_lines({name: value for name, value in data.items() if name not in {*tables, *arrays}})]
    blocks += [f"[{key(name)}]\n{_lines(table)}" for name, table in tables.items()]
    blocks += [f"[[{key(name)}]]\n{_lines(table)}" for name, array in arrays.items() for table in array]
    return "\n".join(block for block in blocks if block)


def _lines(table: Mapping[str, Any]) -> str:
    return "".join(f"{key(name)} = {value(v)}\n" for name, v in table.items())


def key(name: str) -> str:
    """Write a key, in quotes where it needs them.

    >>> key("young"), key("left side")
    ('young', '"left side"')
    """
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else string(name)


def string(text: str) -> str:
    r"""Write a basic string of TOML.

    >>> print(string('E in "MPa"'))
    "E in \"MPa\""
    """
    return '"' + ESCAPED.sub(lambda found: SHORT.get(found[0], f"\\u{ord(found[0]):04x}"), text) + '"'


def value(given: Any) -> str:
    """Write a value on one line.

    Raises
    ------
    TypeError
        For None and any other type without a form in TOML.
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

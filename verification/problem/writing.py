"""The values of a problem as JSON has them, exactly, and a dictionary as TOML text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

from ndtheory import exact, keys
from ndtheory.number import LARGEST_EXPONENT
from ndtheory.texts import CONTROL

#: Integers up to this size are doubles: readers of JSON agree on them.
LARGEST_INTEGER = 2**53

#: What a basic string of TOML cannot hold as it is, or should not, and the short escapes.
ESCAPED = re.compile(rf'(?![\ud800-\udfff])(?:{CONTROL.pattern}|["\\])')  # TOML has no halves of surrogate pairs
SHORT = {"\b": r"\b", "\t": r"\t", "\n": r"\n", "\f": r"\f", "\r": r"\r", '"': r"\"", "\\": r"\\"}


def plain(value: Any) -> Any:
    """Convert to the types that JSON and TOML have: dictionaries, lists, numbers, texts."""
    if isinstance(value, Mapping):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    if isinstance(value, keys.Part):
        return value.to_dict()
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
    raise TypeError(f"{type(given).__name__} is not a TOML value")

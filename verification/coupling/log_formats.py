"""The formats of logs that are known by their signs; ``log_formats.toml`` beside this module has them as data."""

from __future__ import annotations

import re
import tomllib
from importlib.resources import files
from typing import Any

from verification.coupling.log_lines import ColumnsForm, Form
from verification.registry import LOG_FORMATS


def value_of(name: str, value: Any) -> Any:
    """The value of an attribute: patterns are compiled, the alternatives of one that is a list; lists are tuples."""
    if name in ("line", "residuals", "accelerator"):
        return re.compile("|".join(value) if isinstance(value, list) else value)
    return (
        tuple(tuple(each) if isinstance(each, list) else each for each in value) if isinstance(value, list) else value
    )


for kind, formats in tomllib.loads(
    files("verification.coupling").joinpath("log_formats.toml").read_text("utf-8")
).items():
    for entry in formats:
        made = Form if kind == "lines" else ColumnsForm
        LOG_FORMATS.provide(made(**{name: value_of(name, value) for name, value in entry.items()}))

"""The built-in problems."""

from __future__ import annotations

import tomllib
from decimal import Decimal
from importlib import resources

from verification.problem.specification import Problem


def examples() -> dict[str, str]:
    """The built-in problem files by name, as text."""
    files = resources.files("verification") / "data"
    return {
        entry.name.removesuffix(".toml"): entry.read_text("utf-8")
        for entry in sorted(files.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".toml")
    }


def example(name: str) -> Problem:
    """A built-in problem.

    Parameters
    ----------
    name : str
        As ``ndtheory example`` lists them.

    Returns
    -------
    Problem

    Raises
    ------
    ValueError
        An unknown name; the message lists the known ones.

    Examples
    --------
    >>> example("section6").title
    'Section 6, centred'
    """
    available = examples()
    if name not in available:
        raise ValueError(f"no example {name!r}; there are {', '.join(available)}")
    return Problem.from_dict(tomllib.loads(available[name], parse_float=Decimal))

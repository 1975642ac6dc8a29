"""Problem files: TOML, read exactly."""

from __future__ import annotations

import tomllib
from decimal import Decimal
from pathlib import Path
from typing import Any

from verification.problem.specification import Problem
from verification.problem.tables import ProblemError, unreadable

#: Largest size of a problem file.
MOST_BYTES = 1_000_000


def load(path: Path | str) -> Problem:
    """Read a problem file; decimals are read exactly.

    Parameters
    ----------
    path : path

    Returns
    -------
    Problem

    Raises
    ------
    ProblemError
        Not a file, not readable, not TOML, or a value that does not fit.

    Examples
    --------
    >>> load("nowhere.toml")
    Traceback (most recent call last):
        ...
    verification.problem.tables.ProblemError: nowhere.toml: no such file
    """
    data = read_file(path)
    if "grid" in data and "body1" not in data:
        needed = f"needed a problem file, this is the file of a sweep; type ndtheory sweep {path}"
        raise ProblemError(str(path), "", None, needed)
    return Problem.from_dict(data, str(path))


def read_file(path: Path | str) -> dict[str, Any]:
    """The tables of a TOML file; decimals are read exactly.

    Raises
    ------
    ProblemError
        No such file, not readable, not TOML.
    """
    path = Path(path)
    name = str(path)
    why = unreadable(path, MOST_BYTES)
    if why:
        raise ProblemError(name, "", None, why)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ProblemError(name, "", None, f"cannot be read: {error.strerror}") from None
    if not content.strip():
        raise ProblemError(name, "", None, "the file is empty; `ndtheory example` prints one to start from")
    try:
        data = tomllib.loads(content.decode("utf-8-sig"), parse_float=Decimal)
    except UnicodeDecodeError:
        raise ProblemError(name, "", None, "a TOML text file is needed, this is not UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError, ArithmeticError, ValueError) as error:
        raise ProblemError(
            name, "", None, f"not TOML: {' '.join(str(error).split()) or type(error).__name__}"
        ) from None
    return data

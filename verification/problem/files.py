"""Problem files: TOML, read exactly."""

from __future__ import annotations

import re
import tomllib
from decimal import Decimal
from pathlib import Path
from typing import Any

from verification.problem.examples import instead_of
from verification.problem.specification import Problem
from verification.problem.tables import LARGEST, ProblemError, short, unreadable

#: Largest size of a problem file.
MOST_BYTES = 1_000_000

#: Python reads no whole number of so many digits, and no decimal with an exponent of so many.
LONG = re.compile(r"[\d_]{4301}|[eE][-+]?[\d_]{18}")


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
        The path is not a readable TOML file, or a value in it does not fit.

    Examples
    --------
    >>> load("nowhere.toml")
    Traceback (most recent call last):
        ...
    verification.problem.tables.ProblemError: nowhere.toml: no such file
    """
    if not isinstance(path, (str, Path)):
        raise ProblemError(
            "", "", None, f"needed a problem, a pair or the path of a file, received {short(repr(path))}"
        )
    data = read_file(path)
    if "grid" in data and "body1" not in data:
        needed = f"needed a problem file, this is the file of a sweep; type ndtheory sweep {path}"
        raise ProblemError(str(path), "", None, needed)
    return Problem.from_dict(data, str(path))


def read_file(path: Path | str) -> dict[str, Any]:
    """Read the tables of a TOML file; decimals are read exactly.

    Raises
    ------
    ProblemError
        No such file, not readable, not TOML.
    """
    path = Path(path)
    refused = lambda why: ProblemError(str(path), "", None, why)
    if why := unreadable(path, MOST_BYTES):
        raise refused(why + instead_of(str(path)))
    try:
        content = path.read_bytes()
        wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))  # `ndtheory example > my.toml` in a PowerShell writes so
        text = content.decode("utf-16" if wide else "utf-8-sig")
        if not text.strip():
            raise refused("the file is empty; `ndtheory example` prints one to start from")
        return tomllib.loads(text, parse_float=Decimal)
    except OSError as error:
        raise refused(f"cannot be read: {error.strerror}") from None
    except ProblemError:  # a ValueError, as errors of TOML are
        raise
    except UnicodeDecodeError:
        raise refused("a TOML text file is needed, this is not UTF-8 text") from None
    except tomllib.TOMLDecodeError as error:
        raise refused(f"not TOML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise refused("not TOML: its tables or lists are too deep") from None
    except (ArithmeticError, ValueError):  # of int and Decimal
        line = next((n for n, line in enumerate(text.splitlines(), 1) if LONG.search(line)), None)
        where = "" if line is None else f"line {line}: "
        raise refused(
            f"{where}a number has too many digits: needed numbers of a size up to {float(LARGEST):g}"
        ) from None

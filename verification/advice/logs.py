"""Reading the convergence log of another code: residuals by field and time window.

Three forms are read: ``precice-<participant>-convergence.log`` of preCICE, what Kratos CoSimulation prints with an
``echo_level`` of 3 or more for its convergence criteria, and plain columns of numbers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from verification.advice.kratos_log import SIGNS, read_kratos
from verification.advice.log import RUN_AGAIN, Log
from verification.advice.log_table import LogTable
from verification.problem.tables import ProblemError, unreadable

#: Largest log that is read; a million lines of preCICE with four fields have 80 MB.
MOST_BYTES = 500_000_000


def read_log(path: Path) -> Log:
    """The residuals in a log.

    Raises
    ------
    ProblemError
        No such log, one that is damaged other than in its last line, or one whose relaxation was not constant.
    """
    why = unreadable(path, MOST_BYTES)
    if why:
        raise ProblemError(str(path), "", None, why)
    text = _text(path)
    if not text.strip():
        raise ProblemError(str(path), "", None, "needed residuals, this file is empty")
    log = read_kratos(path, text) if any(word in text for word in SIGNS) else LogTable(path, text).log()
    if not any(np.isfinite(window).any() for column in log.columns for window in column.windows):
        raise ProblemError(str(path), "", None, "needed residuals, every number of its columns is inf or nan")
    _check_quasi_newton(path)
    return log


def _text(path: Path) -> str:
    """The text of a file in whichever encoding; lines end with one line feed."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ProblemError(str(path), "", None, f"cannot be read: {error.strerror}") from None
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not wide and b"\0" in data:
        raise ProblemError(str(path), "", None, "needed a log as text, this file is binary")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # numbers are the same in each of its relatives
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _check_quasi_newton(path: Path) -> None:
    """Refuse a log of preCICE beside which the log of iteration counts tells of quasi-Newton columns."""
    beside = path.with_name(path.name.replace("-convergence.log", "-iterations.log"))
    if beside == path or unreadable(beside, MOST_BYTES):
        return
    lines = [line.split() for line in _text(beside).split("\n")]
    names = lines[0] if lines else []
    if "QNColumns" not in names:
        return
    i = names.index("QNColumns")
    for number, words in enumerate(lines[1:], 2):
        if len(words) == len(names) and words[i].isdigit() and int(words[i]) > 0:
            needed = f"QNColumns = {words[i]} tells of a quasi-Newton rule: {RUN_AGAIN}"
            raise ProblemError(f"{beside}, line {number}", "", None, needed)

"""The residuals that Kratos CoSimulation prints."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from verification.advice.log import LOOKED_AT, RUN_AGAIN, Column, Log, number, rounding
from verification.problem.tables import ProblemError, short

#: What such a log has; the second one before its colours are taken out.
SIGNS = ("abs-norm =", "abs_norm =", "abs_norm\x1b", "Coupling iteration:")

_ANSI = re.compile(r"\x1b\[[0-9;]*m")
_LINE = re.compile(
    r"Coupling iteration:\s*(?P<iteration>\d+)\s*/"
    r"|Convergence for \"(?P<field>[^\"]+)\""
    r"|abs[-_]norm\s*=\s*(?P<residual>[^\s|]+)"
    r"|relaxation[^\d=]*factor\s*=\s*(?P<theta>[^\s,]+)"
)
_WORDS = ("abs-norm", "abs_norm", "Coupling iteration", "Convergence for", "factor")
_NOT_CONSTANT = ("Aitken", "aitken", "Anderson", "anderson", "MVQN", "mvqn", "IBQN", "ibqn", "IQN", "iqn")


def read_kratos(path: Path, text: str) -> Log:
    """The residuals that Kratos CoSimulation prints; its absolute norm is that of the residual over a constant."""
    text = _ANSI.sub("", text)
    other = next((word for word in _NOT_CONSTANT if word in text), None)
    if other is not None:
        line = text.count("\n", 0, text.index(other)) + 1
        raise ProblemError(f"{path}, line {line}", "", None, f"{other} changes the relaxation: {RUN_AGAIN}")
    windows: dict[str, list[list[float]]] = {}
    written: dict[str, list[str]] = {}
    thetas: set[str] = set()
    field, before = "residual", 0
    fresh: set[str] = set()  # fields that have begun the window
    for line, match in _matches(text):
        if match["iteration"]:
            if int(match["iteration"]) <= before:
                fresh.clear()
            before = int(match["iteration"])
        elif match["field"]:
            field = match["field"].strip()
        elif match["theta"]:
            thetas.add(match["theta"])
        else:
            word = match["residual"]
            try:
                value = number(word)
            except ValueError:
                raise ProblemError(
                    f"{path}, line {line}", "", None, f"received {short(word, 40)!r}, needed a number"
                ) from None
            if value < 0:
                raise ProblemError(f"{path}, line {line}", "", None, f"received {word!r}, needed a residual >= 0")
            if field not in fresh:
                fresh.add(field)
                windows.setdefault(field, []).append([])
            windows[field][-1].append(value)
            written.setdefault(field, []).append(word)
    if not windows:
        needed = "needed residuals: set echo_level to 3 or more in the convergence criteria"
        raise ProblemError(str(path), "", None, needed)
    if len(thetas) > 1:
        some = ", ".join(sorted(thetas)[:2])
        needed = f"the relaxation factor takes {len(thetas)} values, as {some}: {RUN_AGAIN}"
        raise ProblemError(str(path), "", None, needed)
    columns = tuple(
        Column(
            name=f"abs-norm of {name}",
            residual="absolute",
            windows=tuple(map(np.array, found)),
            digits=rounding(written[name][:LOOKED_AT])[0],
            decimals=rounding(written[name][:LOOKED_AT])[1],
        )
        for name, found in windows.items()
    )
    return Log(path=path, form="Kratos CoSimulation", columns=columns)  # it prints one figure of a constant theta


def _matches(text: str) -> Iterator[tuple[int, re.Match[str]]]:
    for line, content in enumerate(text.split("\n"), 1):
        if any(word in content for word in _WORDS):  # the others are many, and searched slowly
            for match in _LINE.finditer(content):
                yield line, match

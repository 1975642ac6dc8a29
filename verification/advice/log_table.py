"""Logs as columns of numbers: those of preCICE, and plain ones."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from fem1d2d.mesh import Floats
from verification.advice.log import LOOKED_AT, RUN_AGAIN, Column, Log, Residual, number, rounding
from verification.problem.tables import ProblemError, short

_COMMENT = ("#", "%", "!", "//")
_PRECICE = re.compile(r"Res(\w*)\(.+\)")
_RESIDUAL = re.compile(r"res|norm|err|abs|rel|drop")
_WINDOWS = {"timewindow", "window", "timestep", "time", "increment", "loadstep"}
_ITERATIONS = {"iteration", "iter", "it", "couplingiteration", "k", "n", "step"}
_THETAS = {"theta", "omega", "relaxation", "relaxationfactor", "alpha"}
_OTHERS = {"convergence", "converged", "totaliterations", "limit", "tolerance", "tol", "abstol", "reltol"}


def _bare(name: str) -> str:
    return re.sub(r"[^a-z]", "", name.lower())


def _kind(name: str) -> Residual:
    """Which residual a column holds, by its name; of preCICE all are relative but ``ResAbs`` and ``ResDrop``."""
    precice = _PRECICE.fullmatch(name)
    word = (precice[1] if precice else name).lower()
    if precice:
        return "absolute" if word == "abs" else "drop" if word == "drop" else "relative"
    if "drop" in word or "initial" in word:
        return "drop"
    return "relative" if "rel" in word else "absolute" if "abs" in word else "assumed"


class LogTable:
    """Columns of numbers, with names in their first line or without."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = text.split("\n")
        self.complete = text.endswith("\n")
        while self.lines and not self.lines[-1].strip():
            self.lines.pop()
        self.notes: list[str] = []
        self.names: list[str] | None = None
        self.comment = ""
        self.again: list[int] = []
        self.numbers: list[int] = []
        self.separator = self._separator()

    def refuse(self, line: int, needed: str, value: str | None = None) -> NoReturn:
        received = "" if value is None else f"received {short(value, 40)!r}, "
        raise ProblemError(f"{self.path}, line {line}", "", None, f"{received}{needed}")

    def _separator(self) -> str | None:
        """What stands between numbers: a semicolon, a comma, or space."""
        for line in self.lines:
            words = re.split(r"[;,\s]+", line.strip().strip(";,"))
            try:
                for word in words:
                    number(word)
            except ValueError:
                continue
            return ";" if ";" in line else "," if "," in line else None
        return None

    def split(self, line: str) -> list[str]:
        if self.separator is None:
            return line.split()
        words = line.replace(",", ".").split(";") if self.separator == ";" else line.split(",")
        words = [word.strip() for word in words]
        return words[:-1] if words and not words[-1] else words

    def _rows(self) -> Floats:
        """The numbers, a row a line; the last line may be cut off."""
        rows: list[list[float]] = []
        width, last = 0, len(self.lines)
        block, line = np.empty((0, 0)), 0
        while line < last:
            line += 1
            words = self.split(self.lines[line - 1])
            if not words:
                continue
            if words[0].startswith(_COMMENT):
                if not self.numbers:
                    self.comment = self.lines[line - 1].strip().lstrip("#%!/ ")
                continue
            row = self._row(line, words, width)
            if row is None:
                continue
            if len(row) != (width or len(self.names or row)):
                if line == last and len(row) < width:
                    self.notes.append(f"line {line}, the last one, is not whole and was left out")
                    break
                self.refuse(line, f"needed {width or len(self.names or row)} numbers in a line, received {len(row)}")
            if not width:
                width = len(row)
                block = self._block(line - 1, width)
                if len(block):
                    self.numbers = list(range(line, line + len(block)))
                    line += len(block) - 1
                    continue
            rows.append(row)
            self.numbers.append(line)
        if not self.numbers:
            raise ProblemError(str(self.path), "", None, "needed residuals, there is no line of numbers in it")
        data = np.concatenate([block.reshape(-1, width), np.reshape(rows, (-1, width))])
        if not self.complete and len(data) > 1 and self.numbers[-1] == last:
            end, before = (self.split(self.lines[line - 1])[-1] for line in (last, self.numbers[-2]))
            if len(end) < len(before):
                self.notes.append(f"line {last}, the last one, may end in the midst of a number and was left out")
                self.numbers.pop()
                return data[:-1]
        return data

    def _block(self, start: int, width: int) -> Floats:
        """All lines but the last one at once, which is fast; none where one of them is anything but numbers."""
        lines = self.lines[start:-1]
        try:
            if len(lines) < 2 or self.separator == ";":
                return np.empty((0, width))
            block = np.loadtxt(lines, delimiter=self.separator, comments=None, ndmin=2)
        except ValueError:
            return np.empty((0, width))
        return block if block.shape == (len(lines), width) else np.empty((0, width))

    def _row(self, line: int, words: list[str], width: int) -> list[float] | None:
        """A row that is not all plain numbers; None for a line of names or a last line that was cut off."""
        row = []
        for word in words:
            try:
                row.append(number(word))
            except ValueError:
                bare = [name.strip("\"'") for name in words]
                if self.names is None and not self.numbers:
                    self.names = bare
                elif bare == self.names:  # another run, written behind the first
                    self.again.append(len(self.numbers))
                elif line == len(self.lines) and len(words) <= (width or len(words)):
                    self.notes.append(f"line {line}, the last one, is not whole and was left out")
                else:
                    self.refuse(line, "needed a number", word)
                return None
        return row

    def log(self) -> Log:
        """The log that the table is."""
        data = self._rows()
        names = self.names or self._commented(data.shape[1])
        iteration, window, theta, residuals = self._roles(names, data.shape[1])
        starts = self._starts(data, iteration, window)
        digits = self._digits()
        columns = []
        for i in residuals:
            wrong = np.flatnonzero(data[:, i] < 0)
            if wrong.size:
                self.refuse(self.numbers[wrong[0]], f"needed a residual >= 0 in {names[i]}", f"{data[wrong[0], i]:g}")
            split = tuple(np.split(data[:, i], starts))
            columns.append(
                Column(
                    name=names[i], residual=_kind(names[i]), windows=split, digits=digits[i][0], decimals=digits[i][1]
                )
            )
        return Log(
            path=self.path,
            form="preCICE" if any(_PRECICE.fullmatch(name) for name in names) else "columns",
            columns=tuple(columns),
            theta=None if theta is None else self._theta(data[:, theta]),
            notes=tuple(self.notes),
        )

    def _commented(self, width: int) -> list[str]:
        """Names from a comment before the numbers; one column needs none."""
        names = self.split(self.comment)
        if len(names) == width:
            return names
        if width == 1:
            return ["residual"]
        raise ProblemError(str(self.path), "", None, f"needed a line with the names of its {width} columns above them")

    def _roles(self, names: Sequence[str], width: int) -> tuple[int | None, int | None, int | None, list[int]]:
        """Which columns are the iteration, the window, the relaxation factor, and residuals."""
        if len(names) != width:
            self.refuse(self.numbers[0], f"needed {len(names)} numbers, one for each name, received {width}")
        bare = [_bare(name) for name in names]
        if "qncolumns" in bare or {"totaliterations", "convergence"} <= set(bare):
            needed = "this is the log of iteration counts: needed precice-<participant>-convergence.log beside it"
            raise ProblemError(str(self.path), "", None, needed)
        first = lambda known: next((i for i, name in enumerate(bare) if name in known), None)
        iteration, window, theta = first(_ITERATIONS), first(_WINDOWS), first(_THETAS)
        rest = [i for i in range(width) if i not in (iteration, window, theta) and bare[i] not in _OTHERS]
        residuals = [i for i in rest if _RESIDUAL.search(bare[i])]
        if not residuals and len(rest) == 1:
            residuals = rest
        if not residuals:
            found = short(", ".join(names), 120)
            raise ProblemError(
                str(self.path), "", None, f"columns {found}: needed one whose name has res, norm, abs or rel in it"
            )
        return iteration, window, theta, residuals

    def _starts(self, data: Floats, iteration: int | None, window: int | None) -> list[int]:
        """The rows at which a time window begins, the first one apart."""
        begins = np.zeros(len(data), dtype=bool)
        begins[self.again] = True
        if window is not None:
            begins[1:] |= data[1:, window] != data[:-1, window]
        if iteration is not None:
            counts = data[:, iteration]
            wrong = np.flatnonzero(~np.isfinite(counts))
            if wrong.size:
                self.refuse(self.numbers[wrong[0]], "needed the number of the iteration", f"{counts[wrong[0]]:g}")
            begins[1:] |= counts[1:] <= counts[:-1]
            missing = np.flatnonzero(~begins[1:] & (counts[1:] != counts[:-1] + 1)) + 1
            if missing.size:
                i = missing[0]
                self.refuse(
                    self.numbers[i], f"needed iteration {counts[i - 1] + 1:g}: every iteration counts", f"{counts[i]:g}"
                )
        begins[0] = False
        return [int(i) for i in np.flatnonzero(begins)]

    def _theta(self, values: Floats) -> float:
        """The relaxation factor that the log itself names."""
        changes = np.flatnonzero(values != values[0])
        if changes.size or not math.isfinite(values[0]):
            i = changes[0] if changes.size else 0
            self.refuse(
                self.numbers[i], f"the relaxation factor changes from {values[0]:g} to {values[i]:g}: {RUN_AGAIN}"
            )
        return float(values[0])

    def _digits(self) -> list[tuple[float, float]]:
        """The rounding of the numbers of each column."""
        ends = (
            self.numbers if len(self.numbers) <= 2 * LOOKED_AT else self.numbers[:LOOKED_AT] + self.numbers[-LOOKED_AT:]
        )
        return [rounding(words) for words in zip(*(self.split(self.lines[line - 1]) for line in ends), strict=True)]

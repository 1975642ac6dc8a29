"""Residuals in the convergence log of another code, by field and time window.

Three forms are read: ``precice-<participant>-convergence.log`` of preCICE, the output of Kratos CoSimulation with an
``echo_level`` of 3 or more for its convergence criteria, and plain columns of numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Literal

import numpy as np

from fem1d2d.mesh import Floats
from verification.problem.tables import ProblemError, short, unreadable

#: Largest log that is read; a million lines of preCICE with four fields have 80 MB.
MOST_BYTES = 500_000_000

#: So many lines at both ends of a log show how many digits its numbers have.
LOOKED_AT = 200

#: Advice for a log whose relaxation was not constant.
RUN_AGAIN = "run again with constant relaxation: where it changes, the ratios of residuals say nothing about rho"

Residual = Literal["absolute", "relative", "drop", "assumed"]


@dataclass(frozen=True, kw_only=True)
class Column:
    """The residuals of one field.

    Attributes
    ----------
    name : str
    residual : {'absolute', 'relative', 'drop', 'assumed'}
        ``|T x - x|``; the same over ``|T x|``; over the first one of its window, so that it has the ratios of the
        absolute residual; taken as absolute because nothing says otherwise.
    windows : tuple of array
        The residuals of each time window in their order.
    digits, decimals : float
        Rounding of a number relative to its size, as its digits have it; rounding of a number that is written with a
        fixed number of decimals, else 0.
    """

    name: str
    residual: Residual
    windows: tuple[Floats, ...]
    digits: float
    decimals: float


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log as it was read.

    Attributes
    ----------
    theta : float or None
        The relaxation factor that the log itself names.
    theta_rounding : float
        Rounding of theta as it is written there; 0 if it has all its digits.
    notes : tuple of str
        About lines that were left out.
    """

    path: Path
    form: Literal["preCICE", "Kratos CoSimulation", "columns"]
    columns: tuple[Column, ...]
    theta: float | None = None
    theta_rounding: float = 0.0
    notes: tuple[str, ...] = ()


def read_log(path: Path) -> Log:
    """Read the residuals in a log.

    Raises
    ------
    ProblemError
        No such log, one that is damaged other than in its last line, or one whose relaxation was not constant.
    """
    why = unreadable(path, MOST_BYTES)
    if why:
        raise _refused(path, why)
    text = _text(path)
    if not text.strip():
        raise _refused(path, "needed residuals, this file is empty")
    log = _read_kratos(path, text) if any(word in text for word in KRATOS) else _LogTable(path, text).log()
    if not any(np.isfinite(window).any() for column in log.columns for window in column.windows):
        raise _refused(path, "needed residuals, every number of its columns is inf or nan")
    _check_quasi_newton(path)
    return log


def _refused(path: Path, needed: str, line: int = 0, received: str | None = None) -> ProblemError:
    given = "" if received is None else f"received {short(received, 40)!r}, "
    return ProblemError(f"{path}, line {line}" if line else str(path), "", None, given + needed)


def _text(path: Path) -> str:
    """The text of a file in whichever encoding; lines end with one line feed."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _refused(path, f"cannot be read: {error.strerror}") from None
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not wide and b"\0" in data:
        raise _refused(path, "needed a log as text, this file is binary")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # numbers are the same in each of its relatives
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _check_quasi_newton(path: Path) -> None:
    """Refuse a log of preCICE if the log of iteration counts beside it has quasi-Newton columns."""
    beside = path.with_name(path.name.replace("-convergence.log", "-iterations.log"))
    if beside == path or unreadable(beside, MOST_BYTES):
        return
    names, *lines = (line.split() for line in _text(beside).split("\n"))
    if "QNColumns" not in names:
        return
    i = names.index("QNColumns")
    for line, words in enumerate(lines, 2):
        if len(words) == len(names) and words[i].isdigit() and int(words[i]) > 0:
            raise _refused(beside, f"QNColumns = {words[i]} tells of a quasi-Newton rule: {RUN_AGAIN}", line)


def _number(word: str) -> float:
    """A number as C, Fortran or Python writes it."""
    try:
        return float(word)
    except ValueError:
        plain = word.lower()
        if plain.lstrip("+-").startswith(("nan", "1.#ind", "1.#qnan")):
            return math.nan
        if plain.lstrip("+-").startswith("1.#inf"):
            return math.inf
        return float(plain.replace("d", "e"))


def _rounding(words: Sequence[str]) -> dict[str, float]:
    """Rounding of numbers as they are written, in the attributes of :class:`Column`.

    >>> _rounding(["1.234e-05", "1.2e-06"]), _rounding(["0.0012", "0.2"])
    ({'digits': 0.0005, 'decimals': 0.0}, {'digits': 0.0, 'decimals': 5e-05})
    """
    numbers = [word.lower().replace("d", "e").partition("e") for word in words if "n" not in word.lower()]
    decimals = [len(figures.partition(".")[2]) for figures, _, _ in numbers]
    scientific = [places for places, (_, exponent, _) in zip(decimals, numbers, strict=True) if exponent]
    if scientific:
        return {"digits": 0.5 * 10.0 ** -max(scientific), "decimals": 0.0}
    return {"digits": 0.0, "decimals": 0.5 * 10.0 ** -max(decimals, default=0)}


# --- Kratos -----------------------------------------------------------------------------------------------------------

#: Signs of a log of Kratos; the third one before its colours are taken out.
KRATOS = ("abs-norm =", "abs_norm =", "abs_norm\x1b", "Coupling iteration:")

_ANSI = re.compile(r"\x1b\[[0-9;]*m")
_LINE = re.compile(
    r"Coupling iteration:\s*(?P<iteration>\d+)\s*/"
    r"|Convergence for \"(?P<field>[^\"]+)\""
    r"|abs[-_]norm\s*=\s*(?P<residual>[^\s|]+)(?=[\s|])"  # a last line may be cut off in a number
    r"|relaxation[^\d=]*factor\s*=\s*(?P<theta>[^\s,]+)(?=[\s,])"
)
_WORDS = ("abs-norm", "abs_norm", "Coupling iteration", "Convergence for", "factor")

#: The name with which an accelerator begins a line, but that of constant relaxation; a path may have any of the words.
_NOT_CONSTANT = re.compile(
    r"^(?:\[WARNING\] )?(?!ConstantRelaxation)(\w*(?:Aitken|Anderson|MVQN|IBQN|IQN|ConvergenceAccelerator)\w*)\s*:",
    re.IGNORECASE | re.MULTILINE,
)


def _read_kratos(path: Path, text: str) -> Log:
    """The residuals that Kratos CoSimulation prints; its absolute norm is the norm of the residual over a constant.

    With an ``echo_level`` below 4 accelerators do not name themselves, and any is taken for constant relaxation.
    """
    text = _ANSI.sub("", text)
    other = _NOT_CONSTANT.search(text)
    if other is not None:
        raise _refused(path, f"{other[1]} changes the relaxation: {RUN_AGAIN}", text.count("\n", 0, other.start()) + 1)
    windows: dict[str, list[list[float]]] = {}
    written: dict[str, list[str]] = {}
    thetas: set[str] = set()  # Kratos 10 writes one figure
    field, before = "residual", 0
    fresh: set[str] = set()  # fields that have begun the window
    for line, match in _matches(text):
        if match["iteration"]:
            if int(match["iteration"]) <= before:
                fresh.clear()
            before = int(match["iteration"])
        elif match["field"]:
            field = match["field"].strip()
        else:
            word = match["theta"] or match["residual"]
            try:
                value = _number(word)
            except ValueError:
                raise _refused(path, "needed a number", line, word) from None
            if match["theta"]:
                thetas.add(word)
                continue
            if value < 0:
                raise _refused(path, "needed a residual >= 0", line, word)
            if field not in fresh:
                fresh.add(field)
                windows.setdefault(field, []).append([])
            windows[field][-1].append(value)
            written.setdefault(field, []).append(word)
    if not windows:
        raise _refused(path, "needed residuals: set echo_level to 3 or more in the convergence criteria")
    if len(thetas) > 1:
        some = ", ".join(sorted(thetas)[:2])
        raise _refused(path, f"the relaxation factor takes {len(thetas)} values, as {some}: {RUN_AGAIN}")
    columns = tuple(
        Column(
            name=f"abs-norm of {name}",
            residual="absolute",
            windows=tuple(map(np.array, found)),
            **_rounding(written[name][:LOOKED_AT]),
        )
        for name, found in windows.items()
    )
    if not thetas:
        return Log(path=path, form="Kratos CoSimulation", columns=columns)
    theta, rounding = _number(min(thetas)), _rounding([min(thetas)])
    off = rounding["digits"] * theta + rounding["decimals"]
    return Log(path=path, form="Kratos CoSimulation", columns=columns, theta=theta, theta_rounding=off)


def _matches(text: str) -> Iterator[tuple[int, re.Match[str]]]:
    for line, content in enumerate(StringIO(text), 1):
        if any(word in content for word in _WORDS):  # the others are many, and searched slowly
            for match in _LINE.finditer(content):
                yield line, match


# --- columns of numbers -----------------------------------------------------------------------------------------------

_COMMENT = ("#", "%", "!", "//")
_PRECICE = re.compile(r"Res(\w*)\(.+\)")
_RESIDUAL = re.compile(r"res|norm|err|abs|rel|drop")
_WINDOWS = {"timewindow", "window", "timestep", "time", "increment", "loadstep"}
_ITERATIONS = {"iteration", "iter", "it", "couplingiteration", "k", "n", "step"}
_THETAS = {"theta", "omega", "relaxation", "relaxationfactor", "alpha"}
_OTHERS = {"convergence", "converged", "totaliterations", "limit", "tolerance", "tol", "abstol", "reltol"}


def _kind(name: str) -> Residual:
    """The residual that a column holds, by its name; of preCICE all are relative but ``ResAbs`` and ``ResDrop``."""
    precice = _PRECICE.fullmatch(name)
    word = (precice[1] if precice else name).lower()
    if precice:
        return "absolute" if word == "abs" else "drop" if word == "drop" else "relative"
    if "drop" in word or "initial" in word:
        return "drop"
    return "relative" if "rel" in word else "absolute" if "abs" in word else "assumed"


class _LogTable:
    """Columns of numbers, with names in their first line or without: of preCICE, and plain ones."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = text.rstrip().split("\n")
        self.complete = text.endswith("\n")
        self.notes: list[str] = []
        self.names: list[str] | None = None
        self.comment = ""  # the last one before the numbers
        self.again: list[int] = []  # rows at which the names were written once more
        self.numbers: list[int] = []  # the line of each row
        self.separator = self._separator()

    def _separator(self) -> str | None:
        """The sign between numbers: a semicolon, a comma, or None for space."""
        for line in self.lines:
            try:
                for word in re.split(r"[;,\s]+", line.strip().strip(";,")):
                    _number(word)
            except ValueError:
                continue
            return ";" if ";" in line else "," if "," in line else None
        return None

    def _split(self, line: str) -> list[str]:
        if self.separator is None:
            return line.split()
        words = line.replace(",", ".").split(";") if self.separator == ";" else line.split(",")
        words = [word.strip() for word in words]
        return words[:-1] if words and not words[-1] else words

    def log(self) -> Log:
        """The log that the table is."""
        data = self._rows()
        names = self.names or self._commented(data.shape[1])
        iteration, window, theta, residuals = self._roles(names, data.shape[1])
        starts = self._starts(data, iteration, window)
        ends = self.numbers
        if len(ends) > 2 * LOOKED_AT:
            ends = ends[:LOOKED_AT] + ends[-LOOKED_AT:]
        words = list(zip(*(self._split(self.lines[line - 1]) for line in ends), strict=True))
        columns = []
        for i in residuals:
            wrong = np.flatnonzero(data[:, i] < 0)
            if wrong.size:
                received = f"{data[wrong[0], i]:g}"
                raise _refused(self.path, f"needed a residual >= 0 in {names[i]}", self.numbers[wrong[0]], received)
            split = tuple(np.split(data[:, i], starts))
            columns.append(Column(name=names[i], residual=_kind(names[i]), windows=split, **_rounding(words[i])))
        return Log(
            path=self.path,
            form="preCICE" if any(_PRECICE.fullmatch(name) for name in names) else "columns",
            columns=tuple(columns),
            theta=None if theta is None else self._theta(data[:, theta]),
            notes=tuple(self.notes),
        )

    def _rows(self) -> Floats:
        """The numbers, a row a line; the last line may be cut off."""
        rows: list[list[float]] = []
        width, last = 0, len(self.lines)
        block, line = np.empty((0, 0)), 0
        while line < last:
            line += 1
            words = self._split(self.lines[line - 1])
            if not words:
                continue
            if words[0].startswith(_COMMENT):
                if not self.numbers:
                    self.comment = self.lines[line - 1].strip().lstrip("#%!/ ")
                continue
            row = self._row(line, words, width)
            if row is None:
                continue
            wanted = width or len(self.names or row)
            if len(row) != wanted:
                if line == last and len(row) < width:
                    self.notes.append(f"line {line}, the last one, is not whole and was left out")
                    break
                raise _refused(self.path, f"needed {wanted} numbers in a line, received {len(row)}", line)
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
            raise _refused(self.path, "needed residuals, it has no line of numbers")
        data = np.concatenate([block.reshape(-1, width), np.reshape(rows, (-1, width))])
        if not self.complete and len(data) > 1 and self.numbers[-1] == last:
            end, before = (self._split(self.lines[line - 1])[-1] for line in (last, self.numbers[-2]))
            if len(end) < len(before):
                self.notes.append(f"line {last}, the last one, may end in the midst of a number and was left out")
                self.numbers.pop()
                return data[:-1]
        return data

    def _block(self, start: int, width: int) -> Floats:
        """All lines but the last one at once, which is fast; none where one of them is anything but numbers."""
        lines, block = self.lines[start:-1], np.empty((0, width))
        if len(lines) > 1 and self.separator != ";":
            with suppress(ValueError):
                block = np.loadtxt(lines, delimiter=self.separator, comments=None, ndmin=2)
        return block if block.shape == (len(lines), width) else np.empty((0, width))

    def _row(self, line: int, words: list[str], width: int) -> list[float] | None:
        """A row that is not all plain numbers; None for a line of names or a last line that was cut off."""
        row = []
        for word in words:
            try:
                row.append(_number(word))
            except ValueError:
                bare = [name.strip("\"'") for name in words]
                if self.names is None and not self.numbers:
                    self.names = bare
                elif bare == self.names:  # another run, written behind the first
                    self.again.append(len(self.numbers))
                elif line == len(self.lines) and len(words) <= (width or len(words)):
                    self.notes.append(f"line {line}, the last one, is not whole and was left out")
                else:
                    raise _refused(self.path, "needed a number", line, word) from None
                return None
        return row

    def _commented(self, width: int) -> list[str]:
        """Names from a comment before the numbers; one column needs none."""
        names = self._split(self.comment)
        if len(names) == width:
            return names
        if width == 1:
            return ["residual"]
        raise _refused(self.path, f"needed a line with the names of its {width} columns above them")

    def _roles(self, names: Sequence[str], width: int) -> tuple[int | None, int | None, int | None, list[int]]:
        """The columns with the iteration, the window, the relaxation factor, and residuals."""
        if len(names) != width:
            needed = f"needed {len(names)} numbers, one for each name, received {width}"
            raise _refused(self.path, needed, self.numbers[0])
        bare = [re.sub(r"[^a-z]", "", name.lower()) for name in names]
        if "qncolumns" in bare or {"totaliterations", "convergence"} <= set(bare):
            needed = "this is the log of iteration counts: needed precice-<participant>-convergence.log beside it"
            raise _refused(self.path, needed)
        first = lambda known: next((i for i, name in enumerate(bare) if name in known), None)
        iteration, window, theta = first(_ITERATIONS), first(_WINDOWS), first(_THETAS)
        rest = [i for i in range(width) if i not in (iteration, window, theta) and bare[i] not in _OTHERS]
        residuals = [i for i in rest if _RESIDUAL.search(bare[i])]
        if not residuals and len(rest) == 1:
            residuals = rest
        if not residuals:
            found = short(", ".join(names), 120)
            raise _refused(self.path, f"columns {found}: needed one whose name has res, norm, abs or rel in it")
        return iteration, window, theta, residuals

    def _starts(self, data: Floats, iteration: int | None, window: int | None) -> list[int]:
        """The rows at which a time window begins, without the first one."""
        begins = np.zeros(len(data), dtype=bool)
        begins[self.again] = True
        if window is not None:
            begins[1:] |= data[1:, window] != data[:-1, window]
        if iteration is not None:
            counts = data[:, iteration]
            wrong = np.flatnonzero(~np.isfinite(counts))
            if wrong.size:
                i = wrong[0]
                raise _refused(self.path, "needed the number of the iteration", self.numbers[i], f"{counts[i]:g}")
            begins[1:] |= counts[1:] <= counts[:-1]
            missing = np.flatnonzero(~begins[1:] & (counts[1:] != counts[:-1] + 1)) + 1
            if missing.size:
                i = missing[0]
                needed = f"needed iteration {counts[i - 1] + 1:g}: every iteration counts"
                raise _refused(self.path, needed, self.numbers[i], f"{counts[i]:g}")
        begins[0] = False
        return [int(i) for i in np.flatnonzero(begins)]

    def _theta(self, values: Floats) -> float:
        """The relaxation factor that the log itself names."""
        changes = np.flatnonzero(values != values[0])
        if changes.size or not math.isfinite(values[0]):
            i = changes[0] if changes.size else 0
            changed = f"the relaxation factor changes from {values[0]:g} to {values[i]:g}: {RUN_AGAIN}"
            raise _refused(self.path, changed, self.numbers[i])
        return float(values[0])

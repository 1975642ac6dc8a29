"""Residuals in the convergence log of another code, by field and time window.

Two kinds are read: columns of numbers, as ``precice-<participant>-convergence.log`` of preCICE, and what codes print
line by line (:mod:`verification.coupling.log_lines`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from io import StringIO
from itertools import pairwise
from pathlib import Path

import numpy as np

from fem1d2d.mesh import Floats, Ints
from verification.coupling.log_lines import ColumnsForm, Form, Residual, columns_of, form_of, form_of_pattern, to_try
from verification.machine.interrupts import in_time
from verification.problem.tables import ProblemError, short, unreadable

#: Largest log that is read; a million lines of preCICE with four fields have 80 MB.
MOST_BYTES = 500_000_000

#: Seconds of processor time for a pattern that a user gave: repeats inside repeats may take for ever.  Others take some
#: 2 s for ten million characters.
SECONDS, SECONDS_PER_CHARACTER = 10, 1e-6

#: The largest decimal logarithm of a residual.
HIGHEST = 30

#: So many lines at both ends of a log show how many digits its numbers have.
LOOKED_AT = 200

#: Advice for a log whose relaxation was not constant.
RUN_AGAIN = "run again with constant relaxation: where it changes, the ratios of residuals say nothing about rho"


@dataclass(frozen=True, kw_only=True)
class Column:
    """The residuals of one field, of each time window in their order.

    They are absolute, ``|T x - x|``; relative, over ``|T x|``; previous, over ``|x|``; a drop, over the first or the
    largest one of the window, so that it has the ratios of the absolute one; or assumed to be absolute.  ``digits`` is
    the rounding relative to the size of a number, ``decimals`` that of numbers with a fixed number of decimals, else 0.
    """

    name: str
    residual: Residual
    windows: tuple[Floats, ...]
    digits: float
    decimals: float


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log as it was read.

    ``theta`` is the relaxation factor that the log itself names, ``theta_rounding`` its rounding as it is written, and
    ``accelerator`` the rule that it names where that is not constant relaxation.  ``factors`` has, of each window, the
    factor after each residual of the first column, nan where none is named; ``counts`` the iterations of each window,
    of a log that has no residuals; ``notes`` are about lines that were left out.
    """

    path: Path
    form: str
    columns: tuple[Column, ...]
    theta: float | None = None
    theta_rounding: float = 0.0
    accelerator: str | None = None
    factors: tuple[Floats, ...] = ()
    counts: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def needs_theta(self) -> bool:
        """True if the relaxation was constant and the log does not name its factor, or names it in few digits."""
        return self.accelerator is None and (self.theta is None or self.theta_rounding > 1e-3 * self.theta)


def read_log(path: Path, pattern: str | None = None, *, name: str | None = None, log10: bool = False) -> Log:
    """Read the residuals in a log, by its form, by the name of a format, or by a regular expression.

    With ``log10`` its numbers are decimal logarithms.  ProblemError where there is no such log, or one that is damaged
    other than in its last line; ValueError for a pattern that is none, and where there is no such format.
    """
    form = None if pattern is None else form_of_pattern(pattern)
    why = unreadable(path, MOST_BYTES)
    if why:
        raise _refused(path, why)
    text = _ANSI.sub("", _text(path))
    if not text.strip():
        raise _refused(path, "needed residuals, this file is empty")
    if _PROBLEM.search(text):
        raise _refused(path, f"needed a log, this is a problem file: ndtheory advise {path}")
    seconds = SECONDS + int(SECONDS_PER_CHARACTER * len(text))
    form = form or form_of(text, name)
    if form is not None and form.refused:
        raise _refused(path, form.refused)
    try:
        with in_time(seconds) if pattern is not None else nullcontext():
            log = _table(path, text, log10) if form is None else _read_lines(path, text, form, log10)
    except TimeoutError:
        needed = f"searching it takes more than {seconds} s of processor time: needed no repeats inside repeats"
        raise _refused(path, f"{needed} (--pattern)") from None
    if log.columns and not any(np.isfinite(window).any() for column in log.columns for window in column.windows):
        raise _refused(path, "needed residuals, every number of its columns is inf or nan")
    return replace(log, accelerator=log.accelerator or _quasi_newton_beside(path))


def _table(path: Path, text: str, log10: bool) -> Log:
    """Columns of numbers; a refusal of other logs says what may be tried."""
    try:
        return _LogTable(path, text, log10).log()
    except ProblemError as error:
        more = to_try(text)
        raise ProblemError(error.file, error.key, error.value, f"{error.needed}{'; ' * bool(more)}{more}") from None


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


def _quasi_newton_beside(path: Path) -> str | None:
    """The name of the rule if the log of iteration counts of preCICE beside a log has quasi-Newton columns."""
    beside = path.with_name(path.name.replace("-convergence.log", "-iterations.log"))
    if beside == path or unreadable(beside, MOST_BYTES):
        return None
    with suppress(ProblemError):  # a log of constant relaxation has these counts, too
        return _LogTable(beside, _text(beside)).log().accelerator
    return None


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


def _power(path: Path, value: float) -> float:
    """The number of a decimal logarithm."""
    if value > HIGHEST:
        raise _refused(path, f"needed decimal logarithms (--log10), received {value:g}")
    return float(10.0**value)


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


# --- lines ------------------------------------------------------------------------------------------------------------

_PROBLEM = re.compile(r"^\s*(?:\[\s*body1\b|body1\s*[.=])", re.MULTILINE)
_ANSI = re.compile(r"\x1b\[[0-9;]*m")


def _read_lines(path: Path, text: str, form: Form, log10: bool) -> Log:
    """The residuals that a code prints line by line.

    With an ``echo_level`` below 4 accelerators of Kratos do not name themselves, and any is taken for constant
    relaxation.
    """
    other = None if form.accelerator is None else form.accelerator.search(text)
    found = _Lines(path, form.once, log10)
    for line, content in enumerate(StringIO(text), 1):
        if not form.words or any(word in content for word in form.words):  # the others are many, and searched slowly
            for match in form.line.finditer(content):
                found.add(line, match)
    if not found.windows:
        raise _refused(path, form.needed)
    first = next(iter(found.windows.values()))
    windows = {name: _last_of(series) if form.again else series for name, series in found.windows.items()}
    factors = () if form.again else found.aligned([len(window) for window in first])
    accelerator = None if other is None else form.renamed.get(other[1], other[1])
    notes = (form.warns,) * bool(form.warns)
    values = found.factors
    if accelerator is None and form.every_step and len(values) + len(first) < sum(map(len, first)):
        accelerator = "quasi-Newton"  # which prints no factor
    if accelerator is None and len(set(values)) > 1:
        if not found.omega:
            some = ", ".join(sorted(set(values))[:2])
            raise _refused(path, f"the relaxation factor takes {len(set(values))} values, as {some}: {RUN_AGAIN}")
        accelerator = "Aitken"
    columns = tuple(
        Column(
            name=form.label.format(name),
            residual=form.kind_of(name),
            windows=tuple(map(np.array, series)),
            **_rounding(found.written[name][:LOOKED_AT]),
        )
        for name, series in windows.items()
    )
    if accelerator is not None or not values:
        return Log(path=path, form=form.name, columns=columns, notes=notes, accelerator=accelerator, factors=factors)
    theta, rounding = _number(values[0]), _rounding(values[:1])
    off = (rounding["digits"] * theta + rounding["decimals"]) * form.rounded
    return Log(path=path, form=form.name, columns=columns, theta=theta, theta_rounding=off, notes=notes)


class _Lines:
    """Residuals by field and window, and factors, as lines are read."""

    def __init__(self, path: Path, once: bool, log10: bool) -> None:
        self.path, self.once, self.log10 = path, once, log10
        self.waits = not once
        self.windows: dict[str, list[list[float]]] = {}
        self.written: dict[str, list[str]] = {}
        self.factors: list[str] = []  # Kratos 10 writes one figure of a constant one
        self.omega = False
        self.after: list[dict[int, list[float]]] = [{}]  # of each window, by the number of residuals before
        self.field, self.before = "residual", 0.0
        self.fresh: set[str] = set()  # fields that have begun the window

    def add(self, line: int, match: re.Match[str]) -> None:
        """Take what a match has: the factor last, as it comes after the residual."""
        found = match.groupdict() or {"residual": match[1]}
        self.waits = self.waits and (not self.once or any(found.values()))
        if found.get("iteration"):
            iteration = self._value(line, found["iteration"], int)
            if self.fresh and iteration <= self.before:
                self.fresh.clear()
                self.after.append({})
            self.before, self.waits = iteration, True
        if found.get("field"):
            self.field = found["field"].strip()
        if self.waits and (word := found.get("residual")):
            value = self._value(line, word)
            value, self.waits = _power(self.path, value) if self.log10 else value, not self.once
            if value < 0:
                raise _refused(self.path, "needed a residual >= 0", line, word)
            if self.field not in self.fresh:
                self.fresh.add(self.field)
                self.windows.setdefault(self.field, []).append([])
            self.windows[self.field][-1].append(value)
            self.written.setdefault(self.field, []).append(word)
        for name in ("theta", "omega"):
            if word := found.get(name):
                self.omega = self.omega or name == "omega"
                self.factors.append(word)
                self.after[-1].setdefault(self._steps, []).append(self._value(line, word))

    @property
    def _steps(self) -> int:
        """Number of residuals of the first field in this window."""
        first = next(iter(self.windows), "")
        return len(self.windows[first][-1]) if first in self.fresh else 0

    def _value(self, line: int, word: str, of: Callable[[float], float] = float) -> float:
        try:
            return of(_number(word))
        except (ValueError, OverflowError):  # int of nan, or of inf
            raise _refused(self.path, "needed a number", line, word) from None

    def aligned(self, lengths: Sequence[int]) -> tuple[Floats, ...]:
        """The factor after each residual, nan where there is none; nothing where an iteration has several."""
        if any(len(values) > 1 for window in self.after for values in window.values()) or not self.factors:
            return ()
        pairs = zip(lengths, self.after, strict=False)  # a last window may have no residual yet
        return tuple(np.array([after.get(n + 1, [math.nan])[0] for n in range(length)]) for length, after in pairs)


def _last_of(blocks: list[list[float]]) -> list[list[float]]:
    """Blocks without those that the next one repeats and continues."""
    return [block for block, after in pairwise([*blocks, []]) if after[: len(block)] != block]


# --- columns of numbers -----------------------------------------------------------------------------------------------

_COMMENT = ("#", "%", "!", "//")
_PRECICE = re.compile(r"[Rr]es(\w*)\(.+\)")
_QUASI_NEWTON = ("QNColumns", "DeletedColumns", "deleted_Columns")  # of preCICE 3, 2 and 1
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
        return "absolute" if word == "abs" else "drop" if word == "drop" else "relative"  # "norm" of versions 1 and 2.0
    if "drop" in word or "initial" in word:
        return "drop"
    return "relative" if "rel" in word else "absolute" if "abs" in word else "assumed"


class _LogTable:
    """Columns of numbers, with names in their first line or without: of preCICE, and plain ones."""

    def __init__(self, path: Path, text: str, log10: bool = False) -> None:
        self.path, self.log10 = path, log10
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
        return words if words[-1] else words[:-1]

    def log(self) -> Log:
        """The log that the table is."""
        data = self._rows()
        names = self.names or self._commented(data.shape[1])
        found = next((name for name in _QUASI_NEWTON if name in names), None)
        if found is not None and "Iterations" in names and len(names) == data.shape[1]:
            counts, modes = (data[:, names.index(name)] for name in ("Iterations", found))
            if modes.max() > 0 and np.isfinite([counts, modes]).all():
                return Log(
                    path=self.path,
                    form="preCICE",
                    columns=(),
                    accelerator=f"quasi-Newton, up to {int(modes.max())} columns",
                    counts=tuple(int(count) for count in counts),
                )
        table = columns_of(names)
        if table is None:
            iteration, window, theta, residuals = self._roles(names, data.shape[1])
        else:
            residuals = [i for i, name in enumerate(names) if table.residuals.fullmatch(name)]
            self.log10 |= table.log10
        for i in residuals:
            if self.log10:
                data[:, i] = [_power(self.path, value) for value in data[:, i]]
            for row in np.flatnonzero(data[:, i] < 0)[:1]:
                received = f"{data[row, i]:g}"
                raise _refused(self.path, f"needed a residual >= 0 in {names[i]}", self.numbers[row], received)
        if table is not None:
            return self._of_table(table, names, data, residuals)
        starts = self._starts(data, np.arange(len(data)), iteration, window)
        ends = self.numbers[:LOOKED_AT] + self.numbers[-LOOKED_AT:]
        words = list(zip(*(self._split(self.lines[line - 1]) for line in ends), strict=True))
        columns = []
        for i in residuals:
            split = tuple(np.split(data[:, i], starts))
            columns.append(Column(name=names[i], residual=_kind(names[i]), windows=split, **_rounding(words[i])))
        factors = np.empty(0) if theta is None else data[:, theta]
        changes = theta is not None and "omega" in names[theta].lower() and bool((factors != factors[0]).any())
        return Log(
            path=self.path,
            form="preCICE" if any(_PRECICE.fullmatch(name) for name in names) else "columns",
            columns=tuple(columns),
            theta=None if theta is None or changes else self._theta(factors),
            accelerator="Aitken" if changes else None,
            factors=tuple(np.split(factors, starts)) if changes else (),
            notes=tuple(self.notes),
        )

    def _of_table(self, table: ColumnsForm, names: Sequence[str], data: Floats, residuals: Sequence[int]) -> Log:
        """The log of a format of columns that is known by their names."""
        counted = np.flatnonzero(data[:, names.index(table.only)] == 1) if table.only else np.arange(len(data))
        fields = data[counted, names.index(table.split)] if table.split else np.zeros(len(counted))
        columns = []
        for which in np.unique(fields):
            rows = counted[fields == which]
            starts = self._starts(data, rows, names.index(table.iteration), None)
            for i in residuals:
                windows = tuple(np.split(data[rows, i], starts))
                of = f"{names[i]}, {table.split} {which:g}" if table.split else names[i]
                columns.append(Column(name=of, residual=table.residual, windows=windows, digits=1e-8, decimals=0.0))
        if not columns:
            raise _refused(self.path, table.refused)
        notes = (*self.notes, *[table.warns] * bool(table.warns))
        return Log(path=self.path, form=table.name, columns=tuple(columns), notes=notes)

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

    def _starts(self, data: Floats, rows: Ints, iteration: int | None, window: int | None) -> list[int]:
        """The places in some rows at which a time window begins, without the first one."""
        data, begins = data[rows], np.isin(rows, self.again)
        if window is not None:
            new = data[1:, window] != data[:-1, window]
            elapsed = new.all() and iteration is not None and (np.diff(data[:, iteration]) == 1).all()
            begins[1:] |= new & (not elapsed)  # a time that passes while iterations are counted
        if iteration is not None:
            counts = data[:, iteration]
            for i in np.flatnonzero(~np.isfinite(counts))[:1]:
                raise _refused(self.path, "needed the number of the iteration", self.numbers[rows[i]], f"{counts[i]:g}")
            begins[1:] |= counts[1:] <= counts[:-1]
            for i in np.flatnonzero(~begins[1:] & (counts[1:] != counts[:-1] + 1))[:1] + 1:
                needed = f"needed iteration {counts[i - 1] + 1:g}: every iteration counts"
                raise _refused(self.path, needed, self.numbers[rows[i]], f"{counts[i]:g}")
        begins[:1] = False
        return [int(i) for i in np.flatnonzero(begins)]

    def _theta(self, values: Floats) -> float:
        """The relaxation factor that the log itself names."""
        for i in np.flatnonzero((values != values[0]) | ~np.isfinite(values))[:1]:
            changed = f"the relaxation factor changes from {values[0]:g} to {values[i]:g}: {RUN_AGAIN}"
            raise _refused(self.path, changed, self.numbers[i])
        return float(values[0])

"""The store of a sweep: rows in an SQLite file, which outlive the process and the release that made them.

One process holds the file and is its only writer.  It writes ahead into a log beside the file, one transaction for the
rows that come together: whatever ends the process, the file holds every transaction that was begun and ended, and none
in part.  A power cut may cost the last of them, as SQLite does not wait for the disk after each.

The key of a row is its problem, its values, how it is solved, and the number of the numerics.  A row that another
version of this library has made is the row that this one would make, unless :data:`NUMERICS` was raised in between.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import json
import sqlite3
import sys
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ndtheory import __version__
from ndtheory.keys import key, says
from ndtheory.texts import clean
from verification.algorithm.relaxation import rule_of
from verification.document import Document
from verification.interface.friction import GivenOperator
from verification.interface.interface import Law
from verification.interface.pair import UNITS, ContactPair
from verification.machine.interrupts import undisturbed
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.registry import LAWS, RULES
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import COLUMNS, ERROR, Row, problem_of

#: The solver of step II in a row: the active set, and the model where that does not settle.
SOLVER = "auto"

#: Raised by every change of a digit of a row, and only by these: 2 since a residual is compared with present forces, 3
#: since a node that is held tangentially has no friction, and the normal between two lines is the mean of both, 4 since
#: steps on one affine piece are taken together again, 5 since large interface matrices are condensed in another
#: order, 6 since a quadrilateral of a mesh file is cut where its diagonals cross.
NUMERICS = 6

#: Settings and arrays (name in the key: attribute) that always enter the key of a pair; a later setting enters where it
#: differs from its default, a later array where there is one, so that keys stay.
SETTINGS = ("theta", "relaxation", "tolerance", "max_iterations")
ARRAYS = {"stiffness": "schur", "load": "load", "known": "known", "free": "free", "motions": "motions"}

#: Why a rule or a law of a user's own has no key.
NEEDED = "needed a {} of this library, as nothing tells two versions of another one apart; or no store"

#: Bytes of a key: at a million rows two of them agree by chance once in 1e26 stores.
LENGTH = 16

#: The application id of a store, which distinguishes it from other files of SQLite: "ndth".
APPLICATION = 0x6E647468

#: Number of the layout of the tables.
FORMAT = 1

TABLES = """
CREATE TABLE studies (id INTEGER PRIMARY KEY, identity TEXT UNIQUE NOT NULL, version TEXT NOT NULL, problem TEXT);
CREATE TABLE rows (key BLOB PRIMARY KEY, study INTEGER NOT NULL, outcome TEXT, row TEXT NOT NULL, crc INTEGER NOT NULL);
"""

#: Seconds to wait for a process that is about to let go of a store.
PATIENCE = 2.0

#: The message for a file that SQLite reads, but with changed content.
DAMAGED = "the file is damaged; it is left as it is: needed another name (--store), or move the file away"

#: Beginnings of messages in which SQLite repeats text of a damaged file, which may be anything.
REPEATS = ("malformed database schema", "Could not decode to UTF-8")

#: Messages of SQLite in the words of a user; any other message is repeated.
WORDS = {
    "database is locked": "another sweep is at work on it: needed another store (--store), or wait until that one ends",
    "database or disk is full": "the disk is full: needed room on it",
    "disk I/O error": "the disk does not take it: needed room on it, or another place (--store)",
    "attempt to write a readonly database": "it may only be read: needed another place (--store)",
    "unable to open database file": "needed a folder that exists and can be written to (--store)",
    "file is not a database": "not a store of this program: needed another name (--store)",
    "database disk image is malformed": DAMAGED,
}


class StoreError(ProblemError):
    """A store that cannot be opened, read or written."""


# --- keys -------------------------------------------------------------------------------------------------------------


def keys(start: Problem | ContactPair, grid: SweepGrid) -> list[bytes]:
    """Return the key of each row of a grid, in the order of its rows.

    Numbers count exactly, mesh files and matrices by their content.

    Raises
    ------
    ProblemError
        A user's own relaxation rule or law of friction, of which nothing distinguishes two versions.

    Examples
    --------
    >>> bars = Problem.from_dict({"dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": -0.1}}})
    >>> of_theta = lambda *theta: keys(bars, SweepGrid.of({"theta": theta}))
    >>> of_theta("1/3", 0.5)[1] == of_theta("1/2")[0] != of_theta("1/3")[0]
    True
    """
    return _keys(_shared(start), grid, start.source)


def _keys(shared: Mapping[str, Any], grid: SweepGrid, source: str) -> list[bytes]:
    axes = [[f"{name}={_text(name, v, source)};".encode() for v in values] for name, values in grid.axes.items()]
    start, found = hashlib.sha256(json.dumps(shared).encode("ascii")), []
    for values in itertools.product(*axes):
        one = start.copy()
        one.update(b"".join(values))
        found.append(one.digest()[:LENGTH])
    return found


def _shared(start: Problem | ContactPair) -> dict[str, Any]:
    """The data that rows of a sweep have in common, as far as a digit of them can depend on it."""
    of: dict[str, Any] = {"problem": start.digest} if isinstance(start, Problem) else _of_pair(start)
    return {"numerics": NUMERICS, "solver": SOLVER, "of": json.dumps(of, sort_keys=True)}


def _text(name: str, value: Any, source: str) -> str:
    if name == "rule":
        rule = rule_of(value)
        if RULES.get(rule.name) != rule:
            raise ProblemError(source, "rule", rule.name, NEEDED.format("rule"))
        return rule.name
    if isinstance(value, tuple):
        return ",".join(map(exactly, value))
    return exactly(value) if isinstance(value, Fraction) else str(value)


def exactly(value: Fraction) -> str:
    """Write a rational as a text, of whatever length.

    >>> exactly(Fraction(1, 10))
    '1/a'
    """
    return f"{value.numerator:x}/{value.denominator:x}"


def _of_pair(pair: ContactPair) -> dict[str, Any]:
    """Describe a pair by its matrices, bit by bit, and by everything else on which a run of it depends."""
    default, interface = type(pair.settings)(), pair.interface
    settings = {
        name: value
        for name, value in vars(pair.settings).items()
        if name in SETTINGS or value != getattr(default, name)
    }
    arrays: dict[str, Any] = {"gap": interface.gap, "transfer": None if interface.one_grid else interface.transfer}
    arrays |= {} if interface.join.alike else {"on_traces": interface.carry(np.eye(interface.neumann.size))}
    arrays |= {"slipped": interface.slipped} if interface.slipped.any() else {}
    for name, side in (("contact", pair.contact), ("neumann", pair.neumann)):
        arrays |= {f"{name}.{part}": getattr(side, attribute) for part, attribute in ARRAYS.items()}
        arrays |= {f"{name}.x": side.grid.x, f"{name}.weights": side.grid.weights}
    profile = interface.profile
    varies = {} if profile is None else {"profile": [[*map(exactly, column)] for column in vars(profile).values()]}
    return varies | {
        "matrices": {name: None if array is None else _content(array) for name, array in arrays.items()},
        "upward": [pair.contact.upward, pair.neumann.upward],
        "dimension": pair.contact.grid.dimension,
        "law": None if interface.law is None else _law(interface.law, pair.source),
        "friction": exactly(pair.friction),
        "neumann_body": pair.neumann_body,
        "settings": {name: str(value) for name, value in settings.items()},
        "problem": None if pair.problem is None else pair.problem.digest,
    }


def _content(array: Any) -> str:
    plain = np.ascontiguousarray(array)
    return f"{plain.dtype.str} {plain.shape} {hashlib.sha256(plain.tobytes()).hexdigest()}"


def _law(law: Law, source: str) -> dict[str, str]:
    if isinstance(law, GivenOperator):
        return {"name": law.name, "words": law.words, "outside": law.outside, "matrix": _content(law.matrix)}
    if type(law) not in LAWS.values():
        raise ProblemError(source, "law", type(law).__name__, NEEDED.format("law"))
    default = {name: field.default for name, field in getattr(type(law), "__dataclass_fields__", {}).items()}
    given = {name: str(value) for name, value in vars(law).items() if value != default.get(name, MISSING)}
    return {"name": law.name} | given


# --- the file ---------------------------------------------------------------------------------------------------------


class Store:
    """The rows of a sweep in a file that only this process holds; a context that lets go of it at its end.

    The file is created if it does not exist.  With ``fresh`` all rows count as missing, and are replaced once they are
    made again; with ``retry`` the rows do that ended in an error.

    ``rows`` are there, by their places in the grid; ``plan`` has their number, and how many rows are not used; ``kept``
    counts those that were added.

    Raises
    ------
    StoreError
        The file is not a store, is damaged, cannot be written, or another process holds it.
    ProblemError
        A law or a rule that no store can distinguish from another one.
    """

    def __init__(
        self, path: Path, start: Problem | ContactPair, grid: SweepGrid, *, fresh: bool = False, retry: bool = False
    ) -> None:
        self.path, self.kept = path, 0
        self.rows: dict[int, Row] = {}
        shared = _shared(start)
        self._keys = _keys(shared, grid, start.source)
        if path.exists() and not path.is_file():
            raise StoreError(str(path), "", None, "needed the name of a file for the store (--store)")
        with self._told():
            self._file = sqlite3.connect(path, timeout=PATIENCE, isolation_level=None)
        try:
            with self._told():
                self._open()
                damaged = self._read(fresh, retry)
                others: Counter[str] = Counter()
                made = self._file.execute("SELECT version, identity FROM studies").fetchall()
                for numerics in range(1, NUMERICS):
                    other = shared | {"numerics": numerics}
                    if any(_identity(version, other) == identity for version, identity in made):
                        others.update(self._count(_keys(other, grid, start.source)))
                self._study = self._begin(shared, problem_of(start))
        except BaseException:
            self._file.close()
            raise
        errors = sum(row["outcome"] == ERROR for row in self.rows.values())
        found = {"stored": len(self.rows), "damaged": damaged, "errors": errors, "others": dict(others)}
        self.plan = replace(_nothing_stored(start, grid, path), **found)

    def _open(self) -> None:
        run = self._file.execute
        run("PRAGMA locking_mode = EXCLUSIVE")  # held until it is closed, or the process ends
        number = run("PRAGMA application_id").fetchone()[0]
        form = run("PRAGMA user_version").fetchone()[0]
        new = number == 0 and run("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0
        if not new and number != APPLICATION:
            raise sqlite3.DatabaseError("file is not a database")
        tables = [table.strip() for table in TABLES.split(";") if table.strip()]  # as SQLite keeps them
        # an index changes no answer
        there = run("SELECT sql FROM sqlite_master WHERE type != 'index' ORDER BY sql").fetchall()
        if not new and form == FORMAT and there != sorted((table,) for table in tables):
            raise sqlite3.DatabaseError("file is not a database")
        if not new and form != FORMAT:
            needed = f"a store of format {form}, made by another version: this one reads format {FORMAT} (--store)"
            raise StoreError(str(self.path), "", None, needed)
        run("PRAGMA journal_mode = WAL")
        run("PRAGMA synchronous = NORMAL")
        run("PRAGMA temp_store = MEMORY")
        with self._transaction():
            if new:
                run(f"PRAGMA application_id = {APPLICATION}")
                run(f"PRAGMA user_version = {FORMAT}")
                for table in tables:
                    run(table)
        run("CREATE TEMP TABLE wanted (place INTEGER PRIMARY KEY, key BLOB NOT NULL)")

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *error: object) -> None:
        """Let go of the file, and leave one plain file that can be read where nothing can be written."""
        with undisturbed():
            with contextlib.suppress(sqlite3.Error):  # a full disk: the log stays beside the file
                self._file.execute("PRAGMA journal_mode = DELETE")
            self._file.close()

    def _read(self, fresh: bool, retry: bool) -> int:
        """Read the rows; return the number of those whose checksum or columns are wrong, which count as missing."""
        damaged = 0
        with self._wanted(self._keys):
            for place, key, outcome, text, crc in self._file.execute(
                "SELECT place, rows.key, outcome, CAST(row AS BLOB), crc"
                " FROM temp.wanted JOIN rows ON rows.key = wanted.key"
            ):
                row = _row(key, outcome, text, crc)
                if row is None:
                    damaged += 1
                elif not (fresh or (retry and outcome == ERROR)):
                    self.rows[place] = row
        return damaged

    def _count(self, keys: Sequence[bytes]) -> dict[str, int]:
        """Count the keys that have a row, by the version of this library that made it."""
        with self._wanted(keys):
            found = self._file.execute(
                "SELECT version, count(*) FROM temp.wanted JOIN rows ON rows.key = wanted.key"
                " JOIN studies ON studies.id = rows.study GROUP BY version ORDER BY version"
            )
            return dict(found.fetchall())

    def _begin(self, shared: dict[str, Any], problem: Problem | None) -> int:
        """Return the number of a study, the origin of rows, with the problem as its file has it."""
        study = _identity(__version__, shared)
        text = None if problem is None else json.dumps(problem.to_dict())
        with self._transaction():
            self._file.execute(
                "INSERT OR IGNORE INTO studies (identity, version, problem) VALUES (?, ?, ?)",
                [study, __version__, text],
            )
        return int(self._file.execute("SELECT id FROM studies WHERE identity = ?", [study]).fetchone()[0])

    def add(self, rows: Sequence[tuple[int, Row]]) -> None:
        """Keep rows by their places in the grid, all of them or none; may raise StoreError."""
        values = []
        for place, row in rows:
            key, text = self._keys[place], json.dumps(row, separators=(",", ":")).encode("ascii")
            values.append((key, self._study, row["outcome"], text, _crc(key, text)))
        with self._told(), self._transaction():
            self._file.executemany(
                "INSERT OR REPLACE INTO rows (key, study, outcome, row, crc) VALUES (?, ?, ?, CAST(? AS TEXT), ?)",
                values,
            )
        self.kept += len(rows)

    @contextlib.contextmanager
    def _wanted(self, keys: Sequence[bytes]) -> Iterator[None]:
        self._file.execute("DELETE FROM temp.wanted")
        self._file.execute("BEGIN")
        try:
            self._file.executemany("INSERT INTO temp.wanted VALUES (?, ?)", enumerate(keys))
            yield
        finally:
            self._file.execute("COMMIT")

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        with undisturbed():
            self._file.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._file.execute("COMMIT")
            except BaseException:
                if self._file.in_transaction:  # some errors have ended it
                    self._file.execute("ROLLBACK")
                raise

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Turn errors of SQLite into StoreError, with a message in words."""
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:  # what SQLite says of a damaged file may be no text
            said = str(error)
            damaged = isinstance(error, UnicodeDecodeError) or said.startswith(REPEATS)
            words = DAMAGED if damaged else WORDS.get(said, said)
            if self.kept:
                words += (
                    f"; the {self.kept} rows that it took before are in it, and the same command goes on from there"
                )
            raise StoreError(str(self.path), "", None, words) from None


def _identity(version: str, shared: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps({"made by": version} | shared).encode("ascii")).hexdigest()


def _row(key: object, outcome: object, text: object, crc: object) -> Row | None:
    """Return the row of a key; None if this program did not write it."""
    if not (isinstance(key, bytes) and isinstance(text, bytes) and crc == _crc(key, text)):
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or found.keys() != COLUMNS.keys() or found["outcome"] != outcome or not outcome:
        return None
    return found if all(value is None or _fits(name, value) for name, value in found.items()) else None


def _fits(name: str, value: Any) -> bool:
    kind = COLUMNS[name].type
    if kind == "text":
        return isinstance(value, str) and clean(value)
    if isinstance(value, bool) or not isinstance(value, int if kind == "integer" else (int, float)):
        return False
    return abs(value) <= sys.float_info.max  # not NaN


def _crc(key: bytes, text: bytes) -> int:
    return zlib.crc32(text, zlib.crc32(key))


# --- what a sweep would make ------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, repr=False)
class Plan(Document):
    """Numbers of rows that a sweep would make and use."""

    schema: ClassVar[str] = "ndtheory.sweep-plan/1"

    asked: int = key("number of rows of the grid", unit="1")
    stored: int = key("rows that the store has and that would not be made again; 0 with `--fresh`", unit="1")
    damaged: int = key("rows that the store has damaged", unit="1")
    errors: int = key(
        "stored rows that ended in an error; 0 with `--retry`, as those are made again", default=0, unit="1"
    )
    others: Mapping[str, int] = key(
        "rows of this grid that were made with other numerics, by the version of this library; they are not used",
        default_factory=dict,
        name="other_versions",
        type="free",
        unit="1",
    )
    store: Path | None = key("the file of the store", null="where rows are not kept")
    units: Mapping[str, str] = field(default_factory=lambda: UNITS)
    problem: Problem | None = None

    @property
    @says("rows that would be made", unit="1")
    def left(self) -> int:
        """Number of rows that would be made."""
        return self.asked - self.stored

    @property
    def summary(self) -> str:
        return f"{self.asked} runs, {self.stored} of them are there, {self.left} are left"

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about rows of the store that are not used, or ended in an error."""
        other = "are of version {} with other numerics; they are not used, and stay"
        counts = [(count, other.format(version)) for version, count in self.others.items()]
        counts += [(self.damaged, "are damaged: they are made again")]
        counts += [(self.errors, "ended in an error and stay as they are; --retry makes them again")]
        return tuple(f"{self.store}: {count} of these rows {words}" for count, words in counts if count)


def _nothing_stored(start: Problem | ContactPair, grid: SweepGrid, store: Path | None) -> Plan:
    units, problem = start.units or UNITS, problem_of(start)
    return Plan(asked=len(grid), stored=0, damaged=0, store=store, units=units, problem=problem)


def plan(
    start: Problem | ContactPair,
    grid: SweepGrid,
    store: Path | None = None,
    *,
    fresh: bool = False,
    retry: bool = False,
) -> Plan:
    """Count the rows that a sweep would make; nothing is run, no store is made, and a sweep has the same errors."""
    if store is None or not store.exists():
        return _nothing_stored(start, grid, store)
    with Store(store, start, grid, fresh=fresh, retry=retry) as kept:
        return kept.plan

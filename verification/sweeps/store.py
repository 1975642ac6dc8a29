"""The store of a sweep: rows in an SQLite file, which outlive the process that made them.

One process holds the file and is its only writer.  It writes ahead into a log beside the file, one transaction for the
rows that come together: whatever ends the process, the file holds every transaction that was begun and ended, and none
in part.  A power cut may cost the last of them, as SQLite does not wait for the disk after each.
"""

from __future__ import annotations

import contextlib
import json
import sqlite3
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from ndtheory import __version__
from ndtheory.keys import key, says
from verification.document import Document
from verification.interface.pair import UNITS, ContactPair
from verification.machine.interrupts import undisturbed
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.grid import SweepGrid
from verification.sweeps.identity import Identity
from verification.sweeps.row import ERROR, FAILED, Row, is_row, renamed

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


@dataclass(frozen=True, kw_only=True)
class Known:
    """The rows that a store has for some keys.

    Attributes
    ----------
    rows : dict from the number of a key to its row as :func:`written` has it
    failed : int
        Number of them without a run.
    errors : int
        Number of those that ended in an error.
    damaged : int
        Number of rows whose checksum or columns are wrong; they count as missing.
    """

    rows: dict[int, bytes] = field(default_factory=dict)
    failed: int = 0
    errors: int = 0
    damaged: int = 0

    def __or__(self, other: Known) -> Known:
        """Join the rows and add the other numbers."""
        return Known(
            rows=self.rows | other.rows,
            failed=self.failed + other.failed,
            errors=self.errors + other.errors,
            damaged=self.damaged + other.damaged,
        )


class Store:
    """Rows by their keys, in a file that only this process holds; it is created if it does not exist.

    Raises
    ------
    StoreError
        The file is not a store, is damaged, cannot be written, or another process holds it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.kept = 0
        if path.exists() and not path.is_file():
            raise StoreError(str(path), "", None, "needed the name of a file for the store (--store)")
        with self._told():
            self._file = sqlite3.connect(path, timeout=PATIENCE, isolation_level=None)
        try:
            with self._told():
                self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        run = self._file.execute
        run("PRAGMA locking_mode = EXCLUSIVE")  # held until it is closed, or the process ends
        number = run("PRAGMA application_id").fetchone()[0]
        form = run("PRAGMA user_version").fetchone()[0]
        new = number == 0 and run("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0
        if not new and number != APPLICATION:
            raise sqlite3.DatabaseError("file is not a database")
        if not new and form == FORMAT and self._schema() != sorted(_tables()):
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
                for table in _tables():
                    run(table)
        run("CREATE TEMP TABLE wanted (number INTEGER PRIMARY KEY, key BLOB NOT NULL)")

    def _schema(self) -> list[str]:
        """Return the statements that make the tables, views and triggers of the file; an index changes no answer."""
        return sorted(row[0] for row in self._file.execute("SELECT sql FROM sqlite_master WHERE type != 'index'"))

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file, and leave one plain file that can be read where nothing can be written."""
        with undisturbed():
            with contextlib.suppress(sqlite3.Error):  # a full disk: the log stays beside the file
                self._file.execute("PRAGMA journal_mode = DELETE")
            self._file.close()

    def known(self, keys: Mapping[int, bytes], again: Callable[[str], bool] = lambda outcome: False) -> Known:
        """Return the rows of some keys, given by the numbers of the rows.

        Rows whose outcome is one for which ``again`` returns True count as missing.
        """
        found: dict[int, bytes] = {}
        damaged = failed = errors = 0
        with self._told(), self._wanted(keys):
            for number, key, outcome, text, crc in self._file.execute(
                "SELECT number, rows.key, outcome, CAST(row AS BLOB), crc"
                " FROM temp.wanted JOIN rows ON rows.key = wanted.key"
            ):
                row = _read(key, outcome, text, crc)
                if row is None:
                    damaged += 1
                elif not again(outcome):
                    found[number] = row
                    failed += outcome in FAILED
                    errors += outcome == ERROR
        return Known(rows=found, failed=failed, errors=errors, damaged=damaged)

    def count(self, keys: Mapping[int, bytes]) -> dict[str, int]:
        """Count the keys that have a row, by the version of this library that made it."""
        with self._told(), self._wanted(keys):
            rows = self._file.execute(
                "SELECT version, count(*) FROM temp.wanted JOIN rows ON rows.key = wanted.key"
                " JOIN studies ON studies.id = rows.study GROUP BY version ORDER BY version"
            )
            return {str(version): int(count) for version, count in rows}

    def studies(self) -> dict[str, str]:
        """Return the studies of this store, with the version of this library that made each."""
        with self._told():
            rows = self._file.execute("SELECT identity, version FROM studies ORDER BY version").fetchall()
        return {str(identity): str(version) for identity, version in rows}

    def begin(self, identity: Identity, problem: Problem | None) -> int:
        """Return the number of a study, the origin of rows, with the problem as its file has it."""
        written = None if problem is None else json.dumps(problem.to_dict())
        with self._told(), self._transaction():
            self._file.execute(
                "INSERT OR IGNORE INTO studies (identity, version, problem) VALUES (?, ?, ?)",
                [study := identity.study(__version__), __version__, written],
            )
            row = self._file.execute("SELECT id FROM studies WHERE identity = ?", [study]).fetchone()
        return int(row[0])

    def add(self, study: int, rows: Sequence[tuple[bytes, Row]]) -> None:
        """Keep rows, all of them or none; a row that is there already is replaced."""
        values = [(key, study, row["outcome"], text := written(row), _crc(key, text)) for key, row in rows]
        with self._told(), self._transaction():
            self._file.executemany(
                "INSERT OR REPLACE INTO rows (key, study, outcome, row, crc) VALUES (?, ?, ?, CAST(? AS TEXT), ?)",
                values,
            )
        self.kept += len(rows)

    @contextlib.contextmanager
    def _wanted(self, keys: Mapping[int, bytes]) -> Iterator[None]:
        self._file.execute("DELETE FROM temp.wanted")
        self._file.execute("BEGIN")
        try:
            self._file.executemany("INSERT INTO temp.wanted VALUES (?, ?)", keys.items())
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


def _tables() -> list[str]:
    """Return the statements that make the tables, as SQLite keeps them."""
    return [table.strip() for table in TABLES.split(";") if table.strip()]


def written(row: Row) -> bytes:
    """Write a row as text that reads back to the last digit."""
    return json.dumps(row, separators=(",", ":")).encode("ascii")


def _read(key: object, outcome: object, text: object, crc: object) -> bytes | None:
    """Return the row of a key, its columns with their present names; None if this program did not write it."""
    if not (isinstance(key, bytes) and isinstance(text, bytes) and crc == _crc(key, text)):
        return None
    try:
        there = json.loads(text)
    except (ValueError, RecursionError):
        return None
    found = renamed(there)
    if not is_row(found) or found["outcome"] != outcome:
        return None
    return text if found is there else written(found)


def _crc(key: bytes, text: bytes) -> int:
    return zlib.crc32(text, zlib.crc32(key))


class Kept:
    """A store for the time of one sweep; a context that lets go of the file at its end.

    With ``fresh`` all rows count as missing, and are replaced once they are made again; with ``retry`` the rows do
    that ended in an error.  The file is created if it does not exist.

    Raises
    ------
    ProblemError
        A law or a rule that no store can distinguish from another one.
    StoreError
    """

    def __init__(
        self, path: Path, start: Problem | ContactPair, grid: SweepGrid, *, fresh: bool = False, retry: bool = False
    ) -> None:
        identity = Identity.read(start)
        self._keys = identity.keys(grid)
        self._store = Store(path)
        try:
            again = lambda outcome: fresh or (retry and outcome == ERROR)
            self.known = Known()
            for form in self._forms(identity):
                keys = self._keys if form == identity else form.keys(grid)
                missing = {i: key for i, key in enumerate(keys) if i not in self.known.rows}
                self.known |= self._store.known(missing, again)
            #: The rows of this sweep that were made under other numerics, by the version of this library.
            self.others = Counter[str]()
            for numerics in range(1, identity.numerics):
                for form in self._forms(identity.before(numerics)):
                    self.others.update(self._store.count(dict(enumerate(form.keys(grid)))))
            self._study = self._store.begin(identity, start if isinstance(start, Problem) else start.problem)
        except BaseException:
            self._store.close()
            raise

    def _forms(self, identity: Identity) -> list[Identity]:
        """Return the forms of an identity under which the store has rows: the present one, and those of 0.1.0."""
        studies = self._store.studies()
        versions = dict.fromkeys(studies.values())
        forms = [identity, *(identity.before(identity.numerics, version) for version in versions)]
        return [form for form in forms if any(form.study(version) in studies for version in versions)]

    def __enter__(self) -> Kept:
        return self

    def __exit__(self, *error: object) -> None:
        self._store.close()

    def add(self, rows: Sequence[tuple[int, Row]]) -> None:
        """Keep rows by their places in the grid; may raise StoreError."""
        self._store.add(self._study, [(self._keys[i], row) for i, row in rows])

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about rows that are there and not used, or ended in an error."""
        return notes(self._store.path, self.others, self.known.damaged, self.known.errors)


def notes(path: Path, others: Mapping[str, int], damaged: int, errors: int) -> tuple[str, ...]:
    """Return sentences about rows of a store that are not used, or may not be wanted."""
    found = [
        f"{path}: {count} of these rows are of version {version} with other numerics; they are not used, and stay"
        for version, count in others.items()
    ]
    if damaged:
        found.append(f"{path}: {damaged} of these rows are damaged: they are made again")
    if errors:
        found.append(f"{path}: {errors} of these rows ended in an error and stay as they are; --retry makes them again")
    return tuple(found)


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
        """Sentences about rows of the store that would not be used, or ended in an error."""
        return () if self.store is None else notes(self.store, self.others, self.damaged, self.errors)


def plan(
    start: Problem | ContactPair,
    grid: SweepGrid,
    store: Path | None = None,
    *,
    fresh: bool = False,
    retry: bool = False,
) -> Plan:
    """Count the rows that a sweep would make; nothing is run, no store is made, and a sweep has the same errors."""
    known, others = Known(), Counter[str]()
    if store is not None and store.exists():
        with Kept(store, start, grid, fresh=fresh, retry=retry) as kept:
            known, others = kept.known, kept.others
    return Plan(
        asked=len(grid),
        stored=len(known.rows),
        damaged=known.damaged,
        errors=known.errors,
        others=others,
        store=store,
        units=start.units if start.units else UNITS,
        problem=start if isinstance(start, Problem) else start.problem,
    )

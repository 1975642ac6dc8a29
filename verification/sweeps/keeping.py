"""The rows of one sweep in a store: those that are there, those that are not used, and new ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from verification.document import Document
from verification.interface.pair import UNITS, ContactPair
from verification.problem.specification import Problem
from verification.sweeps.grid import SweepGrid
from verification.sweeps.identity import Identity
from verification.sweeps.row import ERROR, Row
from verification.sweeps.store import Known, Store


class Kept:
    """A store for the time of one sweep; a context that lets go of the file at its end.

    Parameters
    ----------
    path : Path
        Created if it does not exist.
    fresh : bool
        Whether all rows count as missing; they are replaced once they are made again.
    retry : bool
        Whether rows that ended in an error do.

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
            self.others: dict[str, int] = {}
            for numerics in range(1, identity.numerics):
                for form in self._forms(identity.before(numerics)):
                    for version, count in self._store.count(dict(enumerate(form.keys(grid)))).items():
                        self.others[version] = self.others.get(version, 0) + count
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
    """Numbers of rows that a sweep would make and use.

    Attributes
    ----------
    asked : int
        Number of rows of the grid.
    stored : int
        Number of them that the store has and that would not be made again.
    damaged : int
        Number of further rows that it has damaged.
    errors : int
        Number of the stored rows that ended in an error.
    others : mapping from a version of this library to a number
        Rows of this sweep that were made under other numerics: they are not used.
    store : Path or None
        The store of the rows.
    """

    schema: ClassVar[str] = "ndtheory.sweep-plan/1"

    asked: int
    stored: int
    damaged: int
    store: Path | None
    errors: int = 0
    others: Mapping[str, int] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=lambda: UNITS)
    problem: Problem | None = None

    @property
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

    def content(self) -> dict[str, Any]:
        return {
            "asked": self.asked,
            "stored": self.stored,
            "left": self.left,
            "damaged": self.damaged,
            "errors": self.errors,
            "other_versions": dict(self.others),
            "store": None if self.store is None else str(self.store),
        }


def plan(
    start: Problem | ContactPair,
    grid: SweepGrid,
    store: Path | None = None,
    *,
    fresh: bool = False,
    retry: bool = False,
) -> Plan:
    """Count the rows that a sweep would make; nothing is run, no store is made, and a sweep has the same errors."""
    known, others = Known(), dict[str, int]()
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

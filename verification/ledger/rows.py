"""Statement -> evidence -> verdict."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

from ndtheory.keys import Part, key, says
from ndtheory.statements import Statement, recorded, statements
from verification.document import Document
from verification.ledger.evidence import METHODS, Evidence, Level, Method, Verdict, settle

#: A statement cannot be proved from one of these.
NO_GROUND = ("REFUTED", "INCONCLUSIVE")


@dataclass(frozen=True, kw_only=True)
class Finding(Part):
    """A statement with its evidence and its verdict."""

    statement: Statement = key(spread=True)
    verdict: Verdict = key("the verdict; {doc}`generated/ledger` says what each means")
    recorded: str | None = key("the recorded verdict", null="where none is", why=None)
    method: Method | None = key("which kind of evidence decided", null="where none did", why=None)
    evidence: tuple[Evidence, ...] = key("strongest first")

    @property
    def changed(self) -> bool:
        """True if the verdict differs from the recorded one."""
        return self.verdict != self.recorded


@dataclass(frozen=True, kw_only=True, repr=False)
class Ledger(Document):
    """Findings in the order of the paper."""

    schema: ClassVar[str] = "ndtheory.ledger/1"

    units: Mapping[str, str]
    level: Level = key("`quick` or `full`: how many problems were drawn")
    rows: tuple[Finding, ...] = key("in the order of the paper", name="statements")

    @property
    def whole(self) -> bool:
        """True if every statement is there."""
        return len(self.rows) == len(statements())

    @property
    def changed(self) -> tuple[Finding, ...]:
        """The rows whose verdict differs from the recorded one."""
        return tuple(row for row in self.rows if row.changed)

    @property
    def summary(self) -> str:
        return ", ".join(f"{count} {verdict}" for verdict, count in self.counts.items())

    @property
    @says("how many statements have each verdict")
    def counts(self) -> dict[str, int]:
        verdicts = [row.verdict for row in self.rows]
        return {verdict: verdicts.count(verdict) for verdict in dict.fromkeys(verdicts)}


def verify(
    ids: str | Collection[str] = (),
    *,
    level: Level = "quick",
    watch: Callable[[str, float], None] = lambda what, share: None,
) -> Ledger:
    """Check statements and settle their verdicts.

    Parameters
    ----------
    ids : str or collection of str
        All by default.
    level : {'quick', 'full'}
        How many problems the discrete evidence takes.
    watch : callable
        Receives what is checked and the share of it that is done.

    Returns
    -------
    Ledger

    Raises
    ------
    ValueError
        An id is unknown, or the level.

    Examples
    --------
    >>> [row.verdict for row in verify(["C1", "5.42"]).rows]
    ['PROVED', 'REPAIRED']
    """
    known = statements()
    asked = [ids] if isinstance(ids, str) else list(ids)
    for id in asked:
        if id not in known:
            raise ValueError(f"{id!r}: no such statement")
    if level not in ("quick", "full"):
        raise ValueError(f"level {level!r}: needed 'quick' or 'full'")
    chosen = [s for s in known.values() if not asked or s.id in asked]
    wanted = {s.id for s in chosen}
    evidence: dict[str, list[Evidence]] = {id: [] for id in wanted}
    from verification.ledger.sources import SOURCES  # sympy and scipy come with it; records are read without

    for source, gather in SOURCES.items():
        found = gather(wanted, level, partial(watch, source))
        for id, entries in found.items():
            evidence.setdefault(id, []).extend(entries)
    rows = []
    for s in chosen:
        own = s.kind == "own"  # not printed anywhere
        seen = [replace(e, of="repaired") if own and e.holds else e for e in evidence[s.id]]
        entries = sorted([*seen, *_read(s, seen)], key=lambda e: METHODS.index(e.method))
        verdict, method = settle(entries)
        rows.append(
            Finding(statement=s, evidence=tuple(entries), verdict=verdict, method=method, recorded=recorded().get(s.id))
        )
    return Ledger(rows=tuple(_grounded(rows)), level=level, units={"length": "any", "stress": "any"})


def _read(statement: Statement, found: Sequence[Evidence]) -> list[Evidence]:
    """Evidence by reading: the grounds of a definition, and a gap with its repair where nothing else shows it."""
    entry = lambda of, holds, text: Evidence(method="reading", of=of, holds=holds, text=text)
    entries = (
        [entry("repaired" if statement.fault else "printed", True, statement.reading)] if statement.reading else []
    )
    if statement.fault:
        if all(e.holds is not False for e in found if e.of != "repaired" and e.method != "dimension"):
            entries.append(entry("step", False, statement.wrong))
        if statement.repair and not any(e.of == "repaired" and e.method == "symbolic" for e in found):
            entries.append(entry("repaired", True, statement.proof))
    return entries


def _grounded(rows: Sequence[Finding]) -> list[Finding]:
    """Nothing is proved from a statement that is refuted or undecided (as recorded, where it was not checked now)."""
    result = {row.statement.id: row for row in rows}
    verdicts: dict[str, str] = recorded() | {id: row.verdict for id, row in result.items()}
    while True:
        fallen = {
            id: [ground for ground in row.statement.leans_on if verdicts.get(ground) in NO_GROUND]
            for id, row in result.items()
            if row.verdict in ("PROVED", "REPAIRED")
        }
        fallen = {id: grounds for id, grounds in fallen.items() if grounds}
        if not fallen:
            return list(result.values())
        for id, grounds in fallen.items():
            text = f"it uses {', '.join(f'{ground} ({verdicts[ground]})' for ground in grounds)}"
            missing = Evidence(method="reading", of="step", holds=None, text=text)
            row = result[id]
            result[id] = replace(row, evidence=(*row.evidence, missing), verdict="INCONCLUSIVE", method="reading")
        verdicts |= dict.fromkeys(fallen, "INCONCLUSIVE")

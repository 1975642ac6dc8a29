"""The ledger: what stands and what is wrong, or each row that was asked for."""

from __future__ import annotations

from collections.abc import Iterator

from verification.ledger.rows import Ledger, Row
from verification.ledger.sheets import FAULTS, OUTCOME, WORDS
from verification.sections.numbers import count
from verification.sections.parts import Facts, Next, Note, Section, Sections, closing, table
from verification.sections.tex import plain


def sections(found: Ledger) -> Sections:
    """The sections: of all rows together where every statement is there, else of each."""
    return _summary(found) if found.whole else _rows(found)


def _summary(found: Ledger) -> Sections:
    about = "Bayada, Sabil, Sassi (2008), statement by statement"
    verdicts = [(verdict, count(rows), WORDS[verdict]) for verdict, rows in found.counts().items()]
    faults = {
        name.lower(): [row.statement.id for row in found.rows if row.statement.fault == fault]
        for fault, name in FAULTS.items()
    }
    sections = [
        Section(id="setting", parts=(Facts(about, (f"{len(found.rows)} rows", found.level)),)),
        Section(id="stands", title="WHAT STANDS?", parts=(table(("verdict", "rows", "means"), verdicts, right=[1]),)),
        Section(
            id="wrong",
            title="WHAT IS WRONG IN THE PAPER?",
            parts=tuple(Note(f"{name}: {', '.join(ids)}") for name, ids in faults.items() if ids),
        ),
    ]
    if found.changed:
        changed = [(row.statement.id, row.recorded or "-", row.verdict) for row in found.changed]
        lines = table(("statement", "recorded", "now"), changed)
        sections.append(Section(id="changed", title="WHAT HAS CHANGED?", parts=(lines,)))
    claims = "that a numerical row is proved, or a proof beyond what it leans on"
    return (*sections, closing(claims, then="ndtheory verify 5.30"))


def _rows(found: Ledger) -> Sections:
    grounds = list(dict.fromkeys(id for row in found.rows for id in row.statement.leans_on))
    then = Next((" ".join(["ndtheory verify", *grounds[:4]]),))
    return (*map(_row, found.rows), closing("", then=then))


def _row(row: Row) -> Section:
    s = row.statement
    changed = f" (recorded: {row.recorded or '-'})" if row.changed else ""
    return Section(id=s.id, title=f"{s.id}  {plain(s.title)}: {row.verdict}{changed}", parts=tuple(_said(row)))


def _said(row: Row) -> Iterator[Note]:
    s = row.statement
    yield Note(plain(s.claims))
    if s.fault:
        yield Note(f"{s.fault}: {plain(s.wrong)}")
    if s.repair:
        yield Note(f"repaired: {plain(s.repair)}")
        yield Note(f"because: {plain(s.proof)}")
    if s.leans_on:
        yield Note(f"leans on {', '.join(s.leans_on)}")
    for e in row.evidence:
        yield Note(f"{e.method}, {e.of}: {OUTCOME[e.holds]}.  {plain(e.text)}")
        if at := e.data.get("counterexample"):
            yield Note("at " + ", ".join(f"{name} = {value}" for name, value in at.items()), 4)
    if s.note:
        yield Note(plain(s.note))

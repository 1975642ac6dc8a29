"""The ledger: what stands and what is wrong, or each row that was asked for."""

from __future__ import annotations

from collections.abc import Iterator

from verification.ledger.rows import Ledger, Row
from verification.ledger.sheets import FAULTS, OUTCOME, WORDS
from verification.sections.numbers import count
from verification.sections.parts import Facts, Note, Section, Sections, closing, of, section, table
from verification.sections.tex import plain


@of.register
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
    wrong = [f"{name}: {', '.join(ids)}" for name, ids in faults.items() if ids]
    sections = [
        section("setting", "", Facts(about, (f"{len(found.rows)} rows", found.level))),
        section("stands", "WHAT STANDS?", table(("verdict", "rows", "means"), verdicts, right=[1])),
        section("wrong", "WHAT IS WRONG IN THE PAPER?", *wrong),
    ]
    if found.changed:
        changed = [(row.statement.id, row.recorded or "-", row.verdict) for row in found.changed]
        sections.append(section("changed", "WHAT HAS CHANGED?", table(("statement", "recorded", "now"), changed)))
    claims = "that a numerical row is proved, or a proof beyond what it leans on"
    return (*sections, closing(claims, then="ndtheory verify 5.30"))


def _rows(found: Ledger) -> Sections:
    grounds = list(dict.fromkeys(id for row in found.rows for id in row.statement.leans_on))
    return (*map(_row, found.rows), closing("", then=" ".join(["ndtheory verify", *grounds[:4]])))


def _row(row: Row) -> Section:
    s = row.statement
    changed = f" (recorded: {row.recorded or '-'})" if row.changed else ""
    return section(s.id, f"{s.id}  {plain(s.title)}: {row.verdict}{changed}", *_said(row))


def _said(row: Row) -> Iterator[Note | str]:
    s = row.statement
    yield plain(s.claims)
    if s.fault:
        yield f"{s.fault}: {plain(s.wrong)}"
    if s.repair:
        yield f"repaired: {plain(s.repair)}"
        yield f"because: {plain(s.proof)}"
    if s.leans_on:
        yield f"leans on {', '.join(s.leans_on)}"
    for e in row.evidence:
        yield f"{e.method}, {e.of}: {OUTCOME[e.holds]}.  {plain(e.text)}"
        if at := e.data.get("counterexample"):
            yield Note("at " + ", ".join(f"{name} = {value}" for name, value in at.items()), 4)
    if s.note:
        yield plain(s.note)

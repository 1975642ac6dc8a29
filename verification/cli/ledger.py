"""The command verify."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ndtheory.statements import statements
from ndtheory.texts import nearest
from verification.cli.console import Interrupted, complain, deliver, heading, note, say, stages, table
from verification.cli.options import FOLDER, JSON, OneOf
from verification.cli.tex import plain

if TYPE_CHECKING:
    from verification.ledger import Ledger, Row


@click.command()
@click.argument("ids", nargs=-1, metavar="[ID]...")
@click.option(
    "--level",
    type=OneOf(["quick", "full"]),
    default="quick",
    show_default=True,
    help="How many problems the discrete evidence takes: within a minute, or within twenty.",
)
@FOLDER
@JSON
def verify(ids: tuple[str, ...], level: Any, folder: Path | None, as_json: bool) -> int:
    """Check every numbered statement of the paper, or those named by ID.

    Each gets a verdict that was earned: by exact arithmetic, on random problems, by reading, or as a definition; the
    units of both sides are compared too.  Exit status 1 if one differs from its recorded verdict.  -o writes the ledger
    as JSON and Markdown, and of all statements the errata sheet.

    \b
    Examples:
      ndtheory verify
      ndtheory verify 5.30 prop-5.6 C5
      ndtheory verify --level full -o ledger
    """
    chosen = [one for id in ids for one in _named(id)]
    from verification.ledger import verify as check
    from verification.output.folder import Folder

    target = None if folder is None else Folder(folder, "verify")
    try:
        with stages() as watch:
            found = check(chosen, level=level, watch=watch)
    except KeyboardInterrupt:
        complain("interrupted before every check was done: no verdict is reached")
        raise Interrupted from None
    write = None if target is None else lambda: target.write_ledger(found)
    deliver(found, lambda: _rows(found) if ids else _summary(found), as_json, write, folder)
    return 1 if found.changed else 0


def _named(id: str) -> list[str]:
    """The statement of that id, or its parts: ``prop-5.6`` is four."""
    known = statements()
    parts = [id] if id in known else [other for other in known if id and other.startswith(f"{id}.")]
    if not parts:
        near = nearest(id, known, most=3) or list(known)[:3]
        context = click.get_current_context()
        from verification.problem.tables import short

        raise click.UsageError(f"{short(id)!r}: no such statement; needed one like {', '.join(near)}", context)
    return parts


def _summary(found: Ledger) -> None:
    from verification.ledger.sheets import FAULTS, WORDS

    say(f"Bayada, Sabil, Sassi (2008), statement by statement | {len(found.rows)} rows | {found.level}")
    heading("WHAT STANDS?")
    table([["verdict", "rows", "means"], *([v, str(n), WORDS[v]] for v, n in found.counts().items())], right=[1])
    heading("WHAT IS WRONG IN THE PAPER?")
    for fault, name in FAULTS.items():
        rows = [row for row in found.rows if row.statement.fault == fault]
        if rows:
            note(f"{name.lower()}: {', '.join(row.statement.id for row in rows)}", "  ")
    if found.changed:
        heading("WHAT HAS CHANGED?")
        changed = [[row.statement.id, row.recorded or "-", row.verdict] for row in found.changed]
        table([["statement", "recorded", "now"], *changed])
    say()
    say("Not claimed: that a numerical row is proved, or a proof beyond what it leans on.")
    say("Next: ndtheory verify 5.30")


def _rows(found: Ledger) -> None:
    for row in found.rows:
        _row(row)
    grounds = list(dict.fromkeys(id for row in found.rows for id in row.statement.leans_on))
    say()
    say(" ".join(["Next: ndtheory verify", *grounds[:4]]))


def _row(row: Row) -> None:
    s = row.statement
    changed = f" (recorded: {row.recorded or '-'})" if row.changed else ""
    heading(f"{s.id}  {plain(s.title)}: {row.verdict}{changed}")
    note(plain(s.claims), "  ")
    if s.fault:
        note(f"{s.fault}: {plain(s.wrong)}", "  ")
    if s.repair:
        note(f"repaired: {plain(s.repair)}", "  ")
        note(f"because: {plain(s.proof)}", "  ")
    if s.leans_on:
        note(f"leans on {', '.join(s.leans_on)}", "  ")
    for e in row.evidence:
        holds = {True: "holds", False: "fails", None: "undecided"}[e.holds]
        note(f"{e.method}, {e.of}: {holds}.  {plain(e.text)}", "  ")
        at = e.data.get("counterexample")
        if at:
            note("at " + ", ".join(f"{name} = {value}" for name, value in at.items()), "    ")
    if s.note:
        note(plain(s.note), "  ")

"""The commands on the paper: verify its statements, reproduce its figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from ndtheory.statements import proof_of, statements
from ndtheory.texts import nearest
from verification.cli.console import complain, deliver, long_stages, say, stages
from verification.cli.forms import cli
from verification.cli.options import FOLDER, JOBS, JSON, STORE, OneOf, one_file, writer
from verification.machine.interrupts import term_interrupts


@cli.command()
@click.argument("ids", nargs=-1, metavar="[ID]...")
@click.option(
    "--level",
    type=OneOf(["quick", "full"]),
    help="Number of problems for the discrete evidence: quick takes a minute, full twenty.  [default: quick]",
)
@one_file(".svg", words="Draw the map of the proof into this file", names=("--map",))
@FOLDER
@JSON
def verify(ids: tuple[str, ...], level: Any, target: Path | None, folder: Path | None, as_json: bool) -> int:
    """Check every numbered statement of the paper, or those named.

    Each verdict rests on exact arithmetic, on random problems, on reading the text, or on a definition; the units of
    both sides are compared.
    Exit status 1 if a verdict differs from the recorded one.  -o writes the ledger as JSON and Markdown and, if all
    statements are checked, the errata sheet.

    --map draws each ID, or all statements, below the statements that its proof uses.  An edge is as wide as the powers
    of ten that its step loses for the built-in problem section6.  With only IDs beside it, --map checks no statement
    and shows the recorded verdicts.  With --level, -o or --json it checks the statements and shows their verdicts.

    \b
    Examples:
      ndtheory verify
      ndtheory verify 5.30 prop-5.6 C5
      ndtheory verify --level full -o ledger
      ndtheory verify thm-5.9 --map proof.svg
    """
    chosen = [one for id in ids for one in _named(id)]
    if target is not None and not (level or folder or as_json):
        say(_draw(target, chosen, {}))
        return 0
    from verification.ledger import verify as check
    from verification.ledger.sections import sections

    write = writer(folder, "verify")
    try:
        with stages() as watch:
            found = check(chosen, level=level or "quick", watch=watch)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted before every check was done: no verdict is reached") from None
    deliver(found, sections, as_json, write, folder)
    if target is not None:
        drawn = _draw(target, chosen, {row.statement.id: row.verdict for row in found.rows})
        if not as_json:
            complain(drawn)
    return 1 if found.changed else 0


def _draw(target: Path, ids: list[str], found: Mapping[str, str]) -> str:
    """Write the map of some statements, or of all, with verdicts over the recorded ones; return what is in it."""
    from ndtheory.statements import recorded
    from verification import build, example, measure
    from verification.figures import draw_map
    from verification.output.files import write_into
    from verification.semidefinite.losses import locate

    problem, verdicts = example("section6"), recorded() | dict(found)
    with stages() as watch:
        pair = build(problem)
        losses = locate(pair, measure(pair), progress=watch)
        of = f"{problem.title}, in {problem.units['stress']}"
        text = draw_map(ids, losses=losses, of=of, verdicts=verdicts)
        write_into(target, lambda path: path.write_text(text, encoding="utf-8"))
    shown = [verdicts.get(id, "INCONCLUSIVE") for id in proof_of(ids or statements())]
    counts = ", ".join(f"{shown.count(verdict)} {verdict}" for verdict in dict.fromkeys(shown))
    source = f"{len(found)} as found now, others as recorded" if found else "with their recorded verdicts"
    return f"{target}: a map of {len(shown)} statements, {source}: {counts}"


def _named(id: str) -> list[str]:
    """The statement of that id, or its parts: ``prop-5.6`` is four."""
    known = statements()
    parts = [id] if id in known else [other for other in known if id and other.startswith(f"{id}.")]
    if not parts:
        near = nearest(id, known, most=3)
        meant = f"similar: {', '.join(near)}" if near else "`ndtheory verify` lists all"
        from verification.problem.tables import short

        raise click.UsageError(f"{short(id)!r}: no such statement; {meant}")
    return parts


NAMES = ("fig5", "fig10", "fig11", "fig12", "all")


@cli.command()
@click.argument("figure", type=OneOf(NAMES))
@JOBS
@STORE
@FOLDER
@JSON
def reproduce(figure: str, jobs: int | None, store: Path | None, folder: Path | None, as_json: bool) -> None:
    """Run the experiment behind a figure of Section 6 again.

    The result is compared with the paper.  The text leaves open where the upper body sits (2 x 0.3 mm and 1.2 x 0.3 mm,
    E in MPa) and whether its top may slide, and it names the roles of the bodies in two ways.  Choices that depart from
    the text, such as half models and exchanged moduli, are tried too.  Every combination gets a verdict; the nearest
    one is named.  All figures take about 90 seconds of one processor.

    -o writes the figures, and the rows behind each as CSV.  Each row is kept as soon as it is made, in rows.sqlite or
    in the file of --store.  After an interruption the same command continues from there.

    \b
    Examples:
      ndtheory reproduce fig5
      ndtheory reproduce all --jobs 2 -o section6
    """
    from verification.reproduce import FIGURES, READINGS
    from verification.reproduce import reproduce as run_again
    from verification.reproduce.experiments import size_of
    from verification.reproduce.sections import sections

    write = writer(folder, "reproduce")
    names = FIGURES if figure == "all" else (figure,)
    kept = None if figure == "fig5" else store or (folder and folder / "rows.sqlite")  # figure 5 is solved anew
    complain(f"{len(READINGS) * sum(map(size_of, names))} rows; all figures take about 90 s of one processor")
    try:
        with long_stages() as tell, term_interrupts():
            found = run_again(names, jobs=jobs or -1, store=kept, progress=tell)
    except KeyboardInterrupt:
        there = kept and f"its rows are in {kept}, and the same command goes on from there"
        raise KeyboardInterrupt(f"interrupted: {there or '-o keeps rows of figures 10 to 12'}") from None
    deliver(found, sections, as_json, write, folder)

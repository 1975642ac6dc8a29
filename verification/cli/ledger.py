"""The commands on the paper: verify its statements, reproduce its figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ndtheory.statements import statements
from ndtheory.texts import nearest
from verification.cli.console import Interrupted, complain, deliver, stages
from verification.cli.options import FOLDER, JOBS, JSON, STORE, OneOf


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

    Each verdict rests on exact arithmetic, random problems, reading or definition; units of both sides are compared.
    Exit status 1 if a verdict differs from the recorded one.  -o writes the ledger as JSON and Markdown and, if all
    statements are checked, the errata sheet.

    \b
    Examples:
      ndtheory verify
      ndtheory verify 5.30 prop-5.6 C5
      ndtheory verify --level full -o ledger
    """
    chosen = [one for id in ids for one in _named(id)]
    from verification.ledger import verify as check
    from verification.output.folder import Folder
    from verification.sections.ledger import sections

    write = None if folder is None else Folder(folder, "verify").write
    try:
        with stages() as watch:
            found = check(chosen, level=level, watch=watch)
    except KeyboardInterrupt:
        complain("interrupted before every check was done: no verdict is reached")
        raise Interrupted from None
    deliver(found, sections, as_json, write, folder)
    return 1 if found.changed else 0


def _named(id: str) -> list[str]:
    """The statement of that id, or its parts: ``prop-5.6`` is four."""
    known = statements()
    parts = [id] if id in known else [other for other in known if id and other.startswith(f"{id}.")]
    if not parts:
        near = nearest(id, known, most=3) or list(known)[:3]
        context = click.get_current_context()
        from verification.problem.tables import short

        raise click.UsageError(f"{short(id)!r}: no such statement; similar: {', '.join(near)}", context)
    return parts


NAMES = ("fig5", "fig10", "fig11", "fig12", "all")


@click.command()
@click.argument("figure", type=OneOf(NAMES))
@JOBS
@STORE
@FOLDER
@JSON
def reproduce(figure: str, jobs: int | None, store: Path | None, folder: Path | None, as_json: bool) -> None:
    """Run the experiment behind a figure of Section 6, and compare it with the paper.

    The text leaves open where the upper body sits (2 x 0.3 mm and 1.2 x 0.3 mm, E in MPa), whether its top may slide,
    and names the roles of the bodies in two ways.  Half models and exchanged moduli, which depart from the text, are
    tried too.  Every combination gets its verdict, and the one that comes nearest is named.  -o writes the rows behind
    each figure as CSV, and the figures.  With --store runs are kept: figures 10 to 12 are then drawn again without one.

    \b
    Examples:
      ndtheory reproduce fig5
      ndtheory reproduce all --jobs 2 -o section6
    """
    from verification.output.folder import Folder
    from verification.reproduce import FIGURES
    from verification.reproduce import reproduce as run_again
    from verification.sections.reproduction import sections

    write = None if folder is None else Folder(folder, "reproduce").write
    with stages() as tell:
        found = run_again(FIGURES if figure == "all" else (figure,), jobs=jobs or -1, store=store, progress=tell)
    deliver(found, sections, as_json, write, folder)

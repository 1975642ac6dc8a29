"""The command reproduce: the figures of Section 6, run again."""

from __future__ import annotations

from pathlib import Path

import click

from verification.cli.console import deliver, stages
from verification.cli.options import FOLDER, JOBS, JSON, STORE, OneOf

NAMES = ("fig5", "fig10", "fig11", "fig12", "all")


@click.command()
@click.argument("figure", type=OneOf(NAMES))
@JOBS
@STORE
@FOLDER
@JSON
def reproduce(figure: str, jobs: int | None, store: Path | None, folder: Path | None, as_json: bool) -> None:
    """Run the experiment behind a figure of Section 6, beside what the paper says of it.

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

    target = None if folder is None else Folder(folder, "reproduce")
    with stages() as tell:
        found = run_again(FIGURES if figure == "all" else (figure,), jobs=jobs or -1, store=store, progress=tell)
    write = None if target is None else lambda: target.write_reproduction(found)
    deliver(found, sections, as_json, write, folder)

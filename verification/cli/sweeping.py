"""The command sweep: a problem over a grid of values."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from verification.cli.console import Interrupted, complain, deliver, stages
from verification.cli.problems import FILE, FOLDER, JSON


@click.command()
@FILE
@click.option(
    "--jobs", type=click.IntRange(1), metavar="N", help="How many processes run at once; one for each core by default."
)
@FOLDER
@JSON
def sweep(file: Path, jobs: int | None, folder: Path | None, as_json: bool) -> None:
    """Run a problem at every point of a grid, and write a CSV file of one row a run.

    FILE names the problem, beside it or built in, and the values of each axis: theta, friction, radius (length of the
    file), young (pairs E1, E2, stress of the file), neumann_body, refine (halvings of the mesh), law, rule.  The rows
    go to NAME.csv beside FILE, or into DIR.  Exit 0 also where runs failed: their rows say why.

    \b
    Example of FILE:
      problem = "section6"
      [grid]
      theta = { start = 0.05, stop = 0.95, step = 0.05 }
      friction = [0.1, 0.2, 0.4]
      young = [[7.0e4, 2.0e4], [2.0e4, 7.0e4]]
    \b
    Example:
      ndtheory sweep grid.toml --jobs 2
    """
    from verification.cli.sweep_screen import sweep as show
    from verification.output.folder import check_ours, staged
    from verification.problem.tables import ProblemError
    from verification.sweeps.sweep import sweep_grid
    from verification.sweeps.sweep_file import read_sweep

    problem, grid = read_sweep(file)
    room = file.parent if folder is None else folder
    target = room / f"{file.stem}.csv"
    try:
        room.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=room).close()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ProblemError(str(room), "", None, f"needed a folder to write to (-o): {why}") from None
    check_ours(target)
    with stages() as tell:
        found = sweep_grid(problem, grid, jobs=jobs or -1, progress=tell)

    def write() -> None:
        with staged(room, shown=target) as place:
            (place / target.name).write_text(found.to_csv(), encoding="utf-8")

    deliver(found, lambda: show(found, target), as_json, write, target)
    if found.interrupted:
        complain(f"{found.reason['rows']}: those are in {target}")
        raise Interrupted

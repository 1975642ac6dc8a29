"""The commands on many runs: sweep, a problem over a grid of values, and region, the plane of theta and k."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from verification.cli.console import complain, deliver, long_stages, stages, warn
from verification.cli.forms import cli
from verification.cli.options import BOUNDS, FILE, FOLDER, JOBS, JSON, PATH, STORE, SWAP, Typed, of_a_file, one_file
from verification.cli.problems import load
from verification.machine.interrupts import term_interrupts

if TYPE_CHECKING:
    from verification.sweeps.sweep import Sweep


#: The beginning of a log of a sweep, and its largest size.
LOG = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d runs: \d+ done, ")
MOST_LOG_BYTES = 1_000_000_000


def _axes(context: click.Context, parameter: click.Parameter, given: tuple[str, ...]) -> list[tuple[str, ...]]:
    from verification.sweeps.row import GIVEN, RESULTS

    plots = [tuple(part.strip() for part in words.split(",")) for words in given]
    for words, names in zip(given, plots, strict=True):
        unknown = [name for name in names if name not in (*GIVEN, *RESULTS)]
        if unknown or len(names) not in (2, 3):
            needed = f"needed X,Y or X,Y,CURVES with columns of {', '.join((*GIVEN, *RESULTS))}"
            raise click.BadParameter(f"{words}: {needed}")
    return plots


@cli.command()
@FILE
@JOBS
@click.option("--dask", metavar="ADDRESS", help="Run on the workers of this dask scheduler, such as tcp://host:8786.")
@STORE
@click.option("--fresh", is_flag=True, help="Make all rows again, those in the store too.")
@click.option("--retry", is_flag=True, help="Make those rows of the store again that ended in an error.")
@click.option("--dry-run", is_flag=True, help="Print the number of runs, and how many the store has; run nothing.")
@click.option("--export", type=PATH, metavar="DIR", help="Write NAME.csv and NAME.nc (netCDF) into DIR.")
@click.option(
    "--plot", "plots", multiple=True, callback=_axes, metavar="X,Y[,CURVES]", help="Draw column Y over X as SVG."
)
@click.option("--log", type=PATH, metavar="LOG", help="Append lines about progress to this file.")
@FOLDER
@JSON
def sweep(
    file: Path,
    jobs: int | None,
    dask: str | None,
    store: Path | None,
    fresh: bool,
    retry: bool,
    dry_run: bool,
    export: Path | None,
    plots: list[tuple[str, ...]],
    log: Path | None,
    folder: Path | None,
    as_json: bool,
) -> None:
    """Run a problem at every point of a grid, into a CSV file.

    FILE names the problem, beside it or built in, and the values of each axis: theta, friction, radius (length of the
    file), young (pairs E1, E2, stress of the file), neumann_body, refine (halvings of the mesh), law, rule.  One row
    for each run goes to NAME.csv beside FILE, or into DIR.  Exit 0 also where runs failed: their rows say why.

    Each row is kept in NAME.sqlite beside NAME.csv and is not made again.  After Ctrl-C or a crash the same command
    continues.  A row that ended in an error stays, too, until --retry or --fresh.

    \b
    Example of FILE:
      problem = "section6"
      [grid]
      theta = { start = 0.05, stop = 0.95, step = 0.05 }
      friction = [0.1, 0.2, 0.4]
      young = [[7.0e4, 2.0e4], [2.0e4, 7.0e4]]

    \b
    Examples:
      ndtheory sweep grid.toml --jobs 2
      ndtheory sweep grid.toml --dry-run
      ndtheory sweep grid.toml --plot theta,iterations,friction --export results
    """
    from verification.extras import require
    from verification.output.files import check_folder, check_ours
    from verification.sweeps import sections as shown
    from verification.sweeps.grid import read_sweep
    from verification.sweeps.store import plan
    from verification.sweeps.sweep import sweep_grid
    from verification.sweeps.workers import work_of

    if dask is not None and jobs is not None:
        raise click.ClickException("needed either --jobs, for this machine, or --dask, for a cluster")
    for option in (name for name, given in (("--export", export), ("--dask", dask)) if given is not None):
        require(option)
    problem, grid = read_sweep(file)
    room = file.parent if folder is None else folder
    target, kept = room / f"{file.stem}.csv", store or room / f"{file.stem}.sqlite"
    if dry_run:
        planned = plan(problem, grid, kept, fresh=fresh, retry=retry)
        deliver(planned, shown.plan, as_json)
        warn(planned.notes, "", wide=True)
        return
    targets = _targets(file.stem, target, plots, export)
    if log is not None:
        _check_log(log, [kept, *targets])
    for one in targets:
        check_folder(one.parent, " (--export)" if one.parent == export else " (-o)")
        check_ours(one)
    with long_stages(log) as tell, term_interrupts():
        work = work_of(jobs or -1, dask)
        found = sweep_grid(problem, grid, work=work, store=kept, fresh=fresh, retry=retry, progress=tell)
    warn(found.notes, "", wide=True)
    if found.stored:
        complain(f"{kept}: {found.stored} of {found.asked} rows were there")
    sections, typing = partial(shown.sections, target=target), Typed(file=Path(problem.source)).command
    deliver(found, sections, as_json, partial(_write, targets=targets), target, typing=typing)
    if found.interrupted:
        raise KeyboardInterrupt(f"{found.reason['rows']}: those are in {target}; the same command goes on from there")


def _targets(
    stem: str, target: Path, plots: list[tuple[str, ...]], export: Path | None
) -> dict[Path, Callable[[Sweep, Path], None]]:
    """The files to write, each with the function that writes it."""

    def csv(found: Sweep, path: Path) -> None:
        path.write_text(found.to_csv(), encoding="utf-8")

    def picture(names: tuple[str, ...]) -> Callable[[Sweep, Path], None]:
        from verification.figures import save

        return lambda found, path: save(found.plot(*names), path)

    targets: dict[Path, Callable[[Sweep, Path], None]] = {target: csv}
    targets |= {target.parent / f"{'-'.join((stem, *names))}.svg": picture(names) for names in plots}
    if export is not None:
        from verification.sweeps.export import write_dataset

        targets |= {export / f"{stem}.csv": csv, export / f"{stem}.nc": write_dataset}
    return targets


def _write(found: Sweep, targets: dict[Path, Callable[[Sweep, Path], None]]) -> None:
    """Write each file; a figure that cannot be drawn is reported, and the others are written."""
    from verification.output.files import write_into
    from verification.problem import ProblemError

    for path, write in targets.items():
        try:
            write_into(path, partial(write, found))
        except ValueError as error:
            if path.suffix != ".svg" or isinstance(error, ProblemError):
                raise
            complain(f"{path} is not drawn: {error}")


def _check_log(log: Path, others: Sequence[Path]) -> None:
    """Raise ProblemError for a log that is neither new, nor empty, nor written by this command."""
    from verification.problem import ProblemError

    needed = ""
    if not log.parent.is_dir():
        needed = "a name in a folder that exists"
    elif log.absolute() in [other.absolute() for other in others]:
        needed = "a separate file for the log"
    elif log.exists() and not _is_log(log):
        needed = "a new file, an empty one or a log of a sweep; this file is left as it is"
    if needed:
        raise ProblemError(str(log), "", None, f"needed {needed} (--log)")


def _is_log(path: Path) -> bool:
    from verification.problem.tables import unreadable

    if unreadable(path, MOST_LOG_BYTES):
        return False
    with path.open("rb") as there:
        first = there.readline(200)
    return not first or bool(LOG.match(first))


@cli.command()
@of_a_file(SWAP)
@one_file(".svg", ".png", words="File to draw", required=True)
@BOUNDS
@STORE
@JSON
def region(typed: Typed, target: Path, bounds: tuple[str, ...] | None, store: Path | None, as_json: bool) -> None:
    """Draw over theta and k where each bound proves contraction.

    The regions belong to the bounds for the bodies of FILE; points show how runs end.  Both axes are logarithmic;
    theta and k have no unit.

    \b
    Example:
      ndtheory region my.toml -o plane.svg
      ndtheory region my.toml --set body2.young=7e4 -o stiff.svg
      ndtheory region my.toml --bounds energy,lyapunov -o plane.svg
    """
    from verification import figures
    from verification.output.files import write_into
    from verification.sweeps.region import chart
    from verification.sweeps.sections import plane as sections

    problem = load(typed)
    with stages() as tell:
        plane = chart(problem, bounds=bounds, store=store, progress=tell)
    deliver(plane, lambda found: sections(found, target), as_json)
    with stages() as tell:
        tell("drawing", None)
        write_into(target, lambda path: figures.save(figures.draw_region(plane), path))
    if plane.interrupted:
        raise KeyboardInterrupt(f"{plane.reason['points']}: what was computed is drawn")

"""The command region: where contraction is proved, drawn."""

from __future__ import annotations

from pathlib import Path

import click

from verification.cli.console import Interrupted, complain, deliver, stages
from verification.cli.options import FILE, JSON, SET, STORE, SWAP, check_place, one_file
from verification.cli.problems import load_problem


@click.command()
@FILE
@SET
@SWAP
@one_file(".svg", ".png", words="File to draw", required=True)
@STORE
@JSON
def region(file: Path, keys: dict[str, str], swap: bool, target: Path, store: Path | None, as_json: bool) -> None:
    """Draw the plane of theta and k: where one step is proved to contract, and what runs do there.

    Both axes are logarithmic; theta and k have no unit.  The regions are those of all bounds for the bodies of FILE;
    the points are runs, coloured by outcome.

    \b
    Example:
      ndtheory region my.toml -o plane.svg
      ndtheory region my.toml --set body2.young=7e4 -o stiff.svg
    """
    from verification import figures
    from verification.bounds.region import chart
    from verification.output.files import staged
    from verification.sections.sweep import plane as sections

    problem = load_problem(file, keys, swap=swap)
    check_place(target)
    with stages() as tell:
        plane = chart(problem, store=store, progress=tell)
    deliver(plane, lambda found: sections(found, target), as_json)
    with stages() as tell, staged(target.parent, shown=target) as room:
        tell("drawing", None)
        figures.save(figures.draw_region(plane), room / target.name)
    if plane.interrupted:
        complain(f"{plane.reason['points']}: what was computed is drawn")
        raise Interrupted

"""``ndtheory explore``: a page that moves about one problem."""

from __future__ import annotations

from pathlib import Path

from verification.cli.console import deliver, stages
from verification.cli.forms import cli
from verification.cli.options import JSON, SWAP, Typed, of_a_file, one_file
from verification.cli.problems import load


@cli.command()
@of_a_file(SWAP)
@one_file(".html", words="Page to write", required=True)
@JSON
def explore(typed: Typed, target: Path, as_json: bool) -> None:
    """Write a page of FILE with sliders for theta and friction.

    The page is one HTML file that needs no network.  It shows both bodies step by step, the residual, and the plane of
    theta and friction; each position of a slider is a run that was made, with a constant theta.

    Of a problem with [[step]] tables it shows the loading history, increment by increment, at several frictions: the
    bodies, the shear against the friction bound, and what sticks, slips and is open.

    \b
    Example:
      ndtheory explore my.toml -o page.html
    """
    from verification.exploration import page
    from verification.exploration.sections import sections
    from verification.output.files import writing

    problem = load(typed)
    with stages() as tell:
        found = page.explore(problem, progress=tell)
    write = writing(target, lambda shown, path: path.write_text(shown.page(), encoding="utf-8"))
    deliver(found, lambda shown: sections(shown, target), as_json, write, target)

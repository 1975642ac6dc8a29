"""``ndtheory march``: a loading history."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from verification.cli.console import complain, deliver, stages
from verification.cli.forms import cli
from verification.cli.options import FOLDER, JSON, RUN, OneOf, Typed, of_a_file, writer
from verification.cli.problems import complain_of, load

if TYPE_CHECKING:
    from verification.algorithm.history import Increment


@cli.command()
@of_a_file(*RUN)
@click.option(
    "--method",
    type=OneOf(["iteration", "monolithic"]),
    default="iteration",
    show_default=True,
    help="Compute by the iteration, or as a check by the global method.",
)
@FOLDER
@JSON
def march(typed: Typed, solver: Any, method: Any, folder: Path | None, as_json: bool) -> int:
    """Follow the loading history of FILE, increment by increment.

    The [[step]] tables of FILE have the loads.  Friction measures slip from the end of the last increment, so that it
    depends on the path.  Exit 0 if every increment was computed, 1 if one did not converge, 130 after Ctrl-C;
    what was computed is shown and written.

    \b
    Example:
      ndtheory march my.toml -o results
      ndtheory march my.toml --method monolithic --json
    """
    problem = load(typed)
    from verification.algorithm import history
    from verification.algorithm.runs import Run
    from verification.sections.history import sections

    write = writer(folder, "march")
    with stages() as tell:

        def watch(increment: Increment, planned: int) -> None:
            steps = "" if increment.iterations is None else f", {increment.iterations} steps"
            tell(f"step {increment.step} ({increment.name}){steps}", increment.time / len(problem.steps))

        tell("measuring the constants", None)
        found = history.march(problem, method=method, solver=solver, watch=watch)
        tell("linearising", None)
        try:
            found = found.linearise() if found.converged else found
        except KeyboardInterrupt:  # costs no increment
            found = replace(found, interrupted=True)
    typing = replace(typed, folder=folder).command
    deliver(found, sections, as_json, write, folder, typing=typing, warnings=found.warnings)
    if found.ended or found.interrupted:
        complain(f"{found.ended or 'interrupted after the last increment'}: what was computed is kept")
    last = found.increments[-1].result
    if found.interrupted:
        return 130
    if isinstance(last, Run):
        complain_of(last, typed.swap)
    return 0 if found.converged and not found.proved_violated else 1

"""The command reproduce: the figures of Section 6, run again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from verification.cli.console import deliver, heading, note, say, stages, table
from verification.cli.options import FOLDER, JOBS, JSON, STORE, OneOf

if TYPE_CHECKING:
    from verification.reproduce import Reproduction
    from verification.reproduce.experiments import Outcome, Result

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

    target = None if folder is None else Folder(folder, "reproduce")
    with stages() as tell:
        found = run_again(FIGURES if figure == "all" else (figure,), jobs=jobs or -1, store=store, progress=tell)
    write = None if target is None else lambda: target.write_reproduction(found)
    deliver(found, lambda: show(found), as_json, write, folder)


def show(found: Reproduction) -> None:
    """The screen of ``reproduce``."""
    say("Section 6 of the paper, run again on its meshes; non-local law, r = 0.1 mm")
    for result in found.results:
        _figure(result)
    if len(found.results) > 1:
        heading("WHICH READING COMES NEAREST TO ALL?")
        note(f"{found.closest.name}: {found.reproduced(found.closest)} of {len(found.results)} reproduced", "  ")
    say()
    say("Not claimed: that the authors ran one of these readings.")
    say("Next: ndtheory sweep --help")


def _figure(result: Result) -> None:
    from verification.reproduce.claims import CLAIMS

    claim = CLAIMS[result.figure]
    heading(f"{result.figure.upper()}: {result.verdict.upper()}")
    note(f"the paper: {claim.says}", "  ")
    note(f"reproduced means: {claim.criterion}", "  ")
    of_text = [outcome for outcome in result.outcomes if not outcome.reading.departs]
    shown = of_text + ([] if result.closest in of_text else [result.closest])
    rows = [["reading", "", "what it shows"]]
    rows += [[_short(outcome), _word(outcome), _says(outcome)] for outcome in shown]
    table(rows)
    held = sum(bool(outcome.holds) for outcome in result.outcomes)
    refused = sum(outcome.holds is None for outcome in result.outcomes)
    note(f"reproduced in {held} of {len(result.outcomes)} readings, {refused} of which are refused", "  ")
    note(f"nearest: {result.closest.reading.name}", "  ")
    if held:
        names = [outcome.reading for outcome in result.outcomes if outcome.holds]
        assumed = "; ".join(", ".join([*reading.assumes, *reading.departs]) for reading in names[:3])
        note(f"under the assumption that {assumed}", "  ")


def _short(outcome: Outcome) -> str:
    reading = outcome.reading
    parts = [
        reading.position.split()[0],
        reading.top.split()[0],
        "" if reading.moved == "whole top" else reading.moved.removeprefix("left "),
        "" if reading.neumann_body == 1 else "roles of Section 3",
        "" if reading.moduli == "as printed" else "moduli exchanged",
    ]
    return ", ".join(filter(None, parts))


def _word(outcome: Outcome) -> str:
    return {True: "yes", False: "no", None: "refused"}[outcome.holds]


def _says(outcome: Outcome) -> str:
    from verification.reproduce.claims import zones

    if outcome.holds is None:
        return outcome.reason
    if outcome.contact is not None:
        return ", ".join(f"{state} to {high:.2f}" for state, _, high in zones(outcome.contact))
    found = []
    for curve in outcome.curves:
        at = curve.steps.get(0.6)
        best = "none arrives" if not curve.best else f"{curve.best[0]:g}: {curve.fewest}"
        found.append(f"{best} (0.6: {'-' if at is None else at})")
    return "best theta: steps " + "; ".join(found)

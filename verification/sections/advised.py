"""What every advice has: roles, a run to make next, lines to paste."""

from __future__ import annotations

from verification.advice.readings import NextRun
from verification.sections.parts import Block, Note, Section


def which_body(*notes: Note) -> Section:
    """Who gets the Neumann problem."""
    return Section(id="body", title="WHICH BODY GETS THE NEUMANN PROBLEM?", parts=notes)


def next_run(made: NextRun) -> Section:
    """The run to make next."""
    return Section(id="next", title="WHICH RUN NEXT?", parts=(Note(f"theta = {made.theta:g}: {made.why}"),))


def pasted(neumann_body: int | None, theta: float | None, *notes: str) -> Section:
    """The lines for a problem file and for a coupling configuration."""
    lines = [] if neumann_body is None else [f"neumann_body = {neumann_body}"]
    lines.append(f"theta = {theta:g}")
    lines.append(f'<acceleration:constant><relaxation value="{theta:g}" /></acceleration:constant>')
    return Section(id="paste", title="TO PASTE", parts=(Block(tuple(lines), 2), *map(Note, notes)))

"""What every advice has: roles, a run to make next, lines to paste."""

from __future__ import annotations

from verification.advice.readings import NextRun
from verification.sections.parts import Block, Section, section


def which_body(*notes: str) -> Section:
    """Who gets the Neumann problem."""
    return section("body", "WHICH BODY GETS THE NEUMANN PROBLEM?", *notes)


def next_run(made: NextRun) -> Section:
    """The run to make next."""
    return section("next", "WHICH RUN NEXT?", f"theta = {made.theta:g}: {made.why}")


def pasted(neumann_body: int | None, theta: float | None, *notes: str) -> Section:
    """The lines for a problem file and for a coupling configuration."""
    lines = [] if neumann_body is None else [f"neumann_body = {neumann_body}"]
    lines.append(f"theta = {theta:g}")
    lines.append(f'<acceleration:constant><relaxation value="{theta:g}" /></acceleration:constant>')
    return section("paste", "TO PASTE", Block(tuple(lines), 2), *notes)

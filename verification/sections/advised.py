"""Sections that advice of several origins shares: matrices, roles, a run to make next, lines to paste."""

from __future__ import annotations

from verification.advice.readings import NextRun
from verification.advice.sides import SeenMatrices
from verification.sections.numbers import figures
from verification.sections.parts import Block, Section, section


def which_body(*notes: str) -> Section:
    """The body that gets the Neumann problem."""
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


def given(seen: SeenMatrices) -> Section:
    """The matrices that were given."""
    of = [f"S{body}: {one.rows} unknowns" for body, one in ((1, seen.S1), (2, seen.S2))]
    if seen.transfer is not None and seen.neumann_body is not None:
        rows, columns = seen.transfer
        of.append(f"P: {rows} x {columns}, from body {seen.neumann_body} to body {3 - seen.neumann_body}")
    said = ["; ".join(of)]
    if seen.ordering is None:
        said.append("Ordering: any, so long as both have the same.")
    else:
        said.append(f"Ordering assumed: {seen.ordering}.")
    said += [f"Note: {words}." for words in seen.notes]
    for found in seen.lanczos:
        ends = f"rho {figures(found.rho, 6)}, residual {found.residual:.1e}"
        least = f"least {figures(found.rho_min)}, residual {found.residual_min:.1e}"
        said.append(f"Lanczos, Neumann body {found.neumann_body}: {ends}; {least}; steps: {found.steps}.")
    if seen.lanczos:
        said.append("An eigenvalue lies within each residual; rho is at least what was found, not proved to be it.")
    return section("given", "WHAT WAS GIVEN?", *said)

"""Runs on a grid of theta and friction in both roles, or loading histories."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

from verification import registry
from verification.exploration.film import FilmedRun
from verification.exploration.page import Exploration
from verification.problem.specs import PLACES
from verification.show.numbers import NONE, count, figures, near_one
from verification.show.parts import Cell, Facts, Section, Sections, closing, section, table


@registry.sections.register
def sections(found: Exploration, target: Path | None = None) -> Sections:
    """The sections: for each role and friction the theta with the fewest steps; ``target`` is the page."""
    then = "" if target is None else f"open {quote(str(target))}"
    if found.histories:
        return _histories(found, then)
    rows: list[tuple[Cell, ...]] = []
    for each in found.films:
        body = each.pair.neumann_body
        for line in each.lines:
            rows.append((f"{body} ({PLACES[body]})", figures(line[0].friction, 2), *_best(line)))
    head = ("Neumann body", "k", "theta", "steps", "rate", "converged")
    caption = "For each role and friction the theta with the fewest steps, and how many of the thetas converged."
    grid = f"{len(found.thetas)} thetas, {len(found.frictions)} frictions"
    closing_words = "that a theta between two of the grid behaves like them"
    parts: list[Section] = [
        section("setting", "", Facts(found.problem.title, (grid, "constant theta"))),
        section("runs", "WHICH THETA TAKES THE FEWEST STEPS?", table(head, rows), caption=caption),
    ]
    if found.why_one_role:
        parts.append(section("roles", "", f"The roles cannot be exchanged: {found.why_one_role}"))
    return (*parts, closing(closing_words, then=then))


def _histories(found: Exploration, then: str) -> Sections:
    """The sections where the problem has steps."""
    rows = []
    for history in found.histories:
        run = history.increments[0].run
        assert run is not None
        done = f"{len(history.increments)} of {history.planned}"
        steps = sum(each.iterations or 0 for each in history.increments)
        rows.append(
            (figures(float(run.pair.friction), 2), done, count(steps), figures(history.content()["dissipated"]))
        )
    head = ("k", "increments", "steps", "friction")
    unit = f"{found.units['stress']} {found.units['length']}{'^2' if found.problem.dimension == 2 else ''}"
    caption = f"For each friction the increments that were computed, their steps, and the work of friction in {unit}."
    facts = (f"{len(rows)} frictions", f"theta = {float(found.thetas[0]):.4g}")
    return (
        section("setting", "", Facts(found.problem.title, facts)),
        section("histories", "WHAT HAPPENED AT EACH FRICTION?", table(head, rows), caption=caption),
        closing("that a friction between two of them behaves like them", then=then),
    )


def _best(line: tuple[FilmedRun, ...]) -> tuple[Cell, ...]:
    arrived = [each for each in line if each.outcome == "converged" and each.iterations is not None]
    of_all = f"{len(arrived)} of {len(line)}"
    if not arrived:
        return (NONE, NONE, NONE, of_all)
    best = min(arrived, key=lambda each: (each.iterations, each.theta))
    rate = NONE if best.rate is None else near_one(best.rate)
    return (figures(best.theta), count(best.iterations), rate, of_all)

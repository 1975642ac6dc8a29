"""Bounds of the factor of one step: as a table, and as the calculator shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ndtheory import Bounds, EnergyBounds
from ndtheory.statements import quote
from verification import registry
from verification.bounds.bound import BoundResult, bounded
from verification.bounds.table import Calculated
from verification.show.numbers import LEGEND, NONE, at_least, factor, figures, interval, marked
from verification.show.parts import (
    Cell,
    Facts,
    Note,
    Quantity,
    Section,
    Sections,
    Shown,
    Table,
    closing,
    section,
    table,
)

#: The constants of Section 5 that follow from those that are given.
DERIVED = ("C_T", "C0", "C1", "C2", "C3", "C4", "C5", "C6")

#: The caption of the table of bounds.
CAPTION = (
    "Each bound that follows from the constants: the friction k below which every small theta, and some theta, "
    "contracts; the theta allowed at the friction of this problem; the largest factor by which one step of this run "
    "multiplies the error."
)


def bounds(rows: Sequence[BoundResult], unit: str) -> list[Shown | str]:
    """The bounds that were computed, with remarks; ``unit`` names the unit of stress, as "MPa"."""
    results = [row for row in rows if row.worked_out]
    if not results:
        return []
    found = [row if row.proved else row.in_doubles() for row in results]
    friction, theta = bounded(found), next((row.theta for row in found if row.theta is not None), None)
    at = [] if theta is None else [f"theta = {theta:.4g}"]
    lines = []
    for row in found:
        line = [row.name, *_allowed(row), interval(row.interval, row.interval_level)]
        line.append(factor(row.factor, row.one_minus_factor))
        lines.append((*line, *("no conclusion" if row.factor is None else marked("contracts", row.level) for _ in at)))
    heads = (
        ("", "every small", "some", "", "", *("" for _ in at)),
        ("bound", f"theta: {friction}<", f"theta: {friction}<", "theta allowed", "factor", *at),
    )
    notes = [words for row in results for words in registry.BOUNDS[row.name].remarks(row, unit)]
    if any(row.friction.on == "multiple" for row in found):
        notes.append("x given: times the friction that was given")
    notes += [LEGEND] * any(row.marked for row in found)
    return [Table(heads, tuple(lines)), *notes]


def _allowed(row: BoundResult) -> list[Cell]:
    """The two thresholds on friction."""
    friction = row.friction
    if friction.on == "any":
        return ["any k", "any k"]
    every = at_least(friction.every)  # where every small theta contracts some theta does
    cells = [every, every if friction.some is None else at_least(friction.some)]
    if friction.on != "multiple":
        return cells
    return [
        Quantity(cell.value, f"{cell} x given", "x given", cell.level) if isinstance(cell, Quantity) else cell
        for cell in cells
    ]


def contracts(rows: Sequence[BoundResult], unit: str, why: str = "") -> Section:
    """The bounds that follow from the constants, or why there is none."""
    parts = bounds(rows, unit) or [f"no bound applies: {why}"]
    return section("bounds", "DOES ONE STEP CONTRACT?", *parts, caption=CAPTION)


@registry.sections.register
def sections(found: Calculated) -> Sections:
    """The sections of the calculator."""
    facts = []
    if (given := found.constants) is not None:
        values = ", ".join(f"{key} = {figures(float(getattr(given, key)))}" for key in ("m", "M", "C_R", "C_K"))
        facts.append(values + ("" if given.k is None else f" (k = {figures(float(given.k))})"))
        if found.no_sum:
            facts.append(found.no_sum)
    if (energy := found.energy) is not None:
        keys = ("rho", "kappa_1", "kappa_2")
        facts.append(", ".join(f"{key} = {figures(float(getattr(energy, key)))}" for key in keys))
    details = {name: result.detail for name, result in found.results.items()}
    section_5 = {name: detail for name, detail in details.items() if isinstance(detail, Bounds)}
    unproved = not all(detail.proved for detail in section_5.values())
    ids = [id for id, given in (("thm-5.9", found.constants), ("x-energy", found.energy)) if given is not None]
    return (
        section("setting", "", *map(Facts, facts)),
        contracts(list(found.results.values()), "the unit of --m"),
        *([_derived(section_5)] if section_5 else []),
        *thetas(details.values()),
        closing("", *([Note(on_the_printed_proof(), 0)] if unproved else []), then=f"ndtheory verify {' '.join(ids)}"),
    )


def _derived(found: dict[str, Bounds]) -> Section:
    on = next(iter(found.values())).threshold_on
    rows = []
    for name in DERIVED:
        unit = f"on {on}" if name in ("C2", "C3", "C4", "C5") else "1"
        rows.append((name, *(figures(getattr(b, name), 6, unit) for b in found.values()), unit))
    lines = table(("", *found, "unit"), rows, right=range(1, len(found) + 1))
    return section("derived", "THE CONSTANTS OF SECTION 5", lines)


def thetas(details: Iterable[object]) -> Sections:
    """The theta with the least proved factor, and the predicted one."""
    found = []
    for energy in details:
        if not isinstance(energy, EnergyBounds):
            continue
        theta, least = figures(energy.theta_proved), figures(energy.factor_proved)
        why = "q >= 1 for every theta: no conclusion" if energy.theta_proved is None else "least proved factor"
        rest = "proved too: there is no friction" if energy.friction_multiple is None else "2/(2 + rho), not a bound"
        predicted = ("predicted", figures(energy.theta_predicted), figures(energy.rate_predicted), rest)
        proved = ("proved", theta, NONE if energy.theta_proved is None else least, why)
        lines = table(("", "theta", "per step", ""), (proved, predicted))
        caption = "The theta with the least proved factor per step, and the one that rho suggests."
        found.append(section("thetas", "WHICH THETA?", lines, caption=caption))
    return tuple(found)


def on_the_printed_proof() -> str:
    """Sentences of screens and reports on the printed proof where m < 1."""
    rescued = "x-printed-rescued"
    return (
        f"The printed proof needs m >= 1: it rests on (5.30), whose verdict in the ledger is {quote('5.30')}."
        f"  {quote(rescued, 'title')}, for M >= 2 m, by another estimate, whose verdict is {quote(rescued)}."
        f"  See: ndtheory verify 5.30 {rescued}"
    )

"""The plane of theta and k."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

from verification.bounds.region import MOST_STEPS, Plane
from verification.bounds.table import named
from verification.sections.numbers import figures
from verification.sections.parts import Facts, Sections, closing, of, section, table


@of.register
def sections(found: Plane, target: Path | None = None) -> Sections:
    """The sections; ``target`` is where the figure is drawn."""
    rows = []
    notes: list[str] = []
    for name, region in found.regions.items():
        if region.k:
            highest = figures(max(hi for _, hi in region.theta))
            rows.append((name, figures(region.every), figures(region.some), highest))
            notes += named(name).remarks(None, found.units["stress"])
    notes += [f"{name}: {reason}" for name, reason in found.reason.items()]
    lines = table(("bound", "every small theta: k <", "some theta: k <", "theta at most"), rows)
    outcomes = [point.outcome for point in found.points]
    words = {"limit": f"still falling when stopped after {MOST_STEPS} steps"}
    runs = [", ".join(f"{outcomes.count(name)} {words.get(name, name)}" for name in dict.fromkeys(outcomes))]
    strongest = max((p.k for p in found.points if p.outcome == "converged"), default=None)
    if strongest is not None:
        runs.append(f"the largest friction with a run that converged: k = {strongest:g}")
    return (
        section("setting", "", Facts(found.title)),
        section("regions", "WHERE IS ONE STEP PROVED TO CONTRACT?", lines, *notes),
        section("runs", "WHAT DID RUNS DO?", *runs),
        closing(
            "non-convergence outside a region, or anything on the continuum",
            then="" if target is None else f"open {quote(str(target))}",
        ),
    )

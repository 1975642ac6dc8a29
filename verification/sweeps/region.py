"""The (theta, k) plane: where each bound proves contraction, and what runs do there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from ndtheory.keys import Part, key
from verification.algorithm.loop import Outcome
from verification.bounds.bound import NotComputed, Region, Subject
from verification.bounds.table import chosen
from verification.constants import Measured, measure
from verification.constants.measured import SLIDES
from verification.contact import ContactError
from verification.document import Document
from verification.interface.pair import ContactPair, pair_from
from verification.machine.interrupts import INTERRUPTED
from verification.machine.progress import Progress, silent
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.registry import BOUNDS, LAWS
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import Row
from verification.sweeps.sweep import sweep_grid

#: Where runs are started, and how long they may take.
THETAS = tuple(float(f"{v:.3g}") for v in np.geomspace(0.04, 0.97, 9))
FRICTIONS = tuple(float(f"{v:.3g}") for v in np.geomspace(0.01, 5, 7))
MOST_STEPS = 300


@dataclass(frozen=True, kw_only=True)
class Point(Part):
    """Outcome of a run."""

    theta: float = key("where in the plane")
    k: float = key("where in the plane")
    outcome: Outcome = key("as in **Run**", type="text")
    iterations: int = key()
    coupled_residual: float | None = key("as in **Run**", null="without a force", why=None)


@dataclass(frozen=True, kw_only=True, repr=False)
class Plane(Document):
    """Regions by bound, and runs."""

    schema: ClassVar[str] = "ndtheory.region/1"

    title: str = key("title of the problem")
    regions: Mapping[str, Region] = key("where a bound proves contraction, by the name of the bound")
    points: tuple[Point, ...] = key("the runs")
    reason: Mapping[str, str] = key("why a bound has no region, or points are missing")
    units: Mapping[str, str]
    problem: Problem

    @property
    def summary(self) -> str:
        return f"{self.title}, regions of {', '.join(self.regions)}; {len(self.points)} runs"

    @property
    def interrupted(self) -> bool:
        """True if Ctrl-C left something out."""
        return "points" in self.reason


def chart(
    problem: Problem,
    *,
    bounds: Sequence[str] | str | None = None,
    store: Path | None = None,
    progress: Progress = silent,
) -> Plane:
    """Trace the regions of bounds for a problem's bodies, and run a grid of theta and k.

    ``bounds`` are names as :func:`verification.compare` takes them, all but those on request by default.
    ``store`` is a file that keeps the runs, and has those that were made before.

    Raises
    ------
    ProblemError
        A problem outside the theorem, or without a law of friction; a store that cannot be used.
    ContactError
        A run has no certificate of step II.
    KeyboardInterrupt
        Before the first region was traced; later it leaves out what was still to come.
    """
    asked = chosen(bounds)
    progress("tracing the regions", None)
    pair = pair_from(problem)
    measured = measure(pair)
    check_plane(pair, measured)
    subject = Subject.of(pair, measured)
    regions: dict[str, Region] = {}
    reason = dict.fromkeys((*asked, "points"), INTERRUPTED)
    points: list[Point] = []
    limited = replace(pair.settings, relaxation="constant", max_iterations=MOST_STEPS)
    grid = SweepGrid.of({"theta": THETAS, "friction": FRICTIONS})
    try:
        for bound in map(BOUNDS.__getitem__, asked):
            try:
                regions[bound.name] = bound.region(subject, progress=progress)
                del reason[bound.name]
            except NotComputed as error:
                reason[bound.name] = str(error)
        found = sweep_grid(replace(pair, settings=limited), grid, store=store, progress=progress)
        points = [_point(row) for row in found.rows]
        if found.interrupted:
            reason["points"] = f"interrupted after {len(points)} of {len(grid)} runs"
        else:
            del reason["points"]
    except KeyboardInterrupt:
        if not regions:
            raise
        reason["points"] = f"interrupted after 0 of {len(grid)} runs"
    return Plane(
        title=problem.title, regions=regions, points=tuple(points), reason=reason, units=problem.units, problem=problem
    )


def check_plane(pair: ContactPair, measured: Measured) -> None:
    """Raise ProblemError for a pair without a plane of theta and k: outside the theorem, or without a law of friction.

    The pair is made from a problem.
    """
    problem = pair.problem
    assert problem is not None  # only a problem has a plane
    law = problem.contact.law
    if LAWS[law].outside:
        raise ProblemError(problem.source, "contact.law", law, 'no region is proved for it; needed "nonlocal"')
    if pair.outside:
        raise ProblemError(problem.source, "contact", None, f"no region is proved: {pair.outside[0]}")
    if pair.contact.slides:
        body = f"body{problem.numbers(pair.contact_body)[0]}"
        raise ProblemError(problem.source, body, None, f"no region is proved: C_t1 is {SLIDES}")
    if measured.constants() is None and measured.energy_constants() is None:
        raise ProblemError(problem.source, "contact", None, measured.why_no_constants)
    if measured.friction_threshold is None or measured.friction_limit is None:
        raise ProblemError(
            problem.source, "contact.radius", None, "needed a law of friction, with its radius, to vary k"
        )


def _point(row: Row) -> Point:
    """Outcome of a run, from its row in a sweep; ContactError where step II did not reach its certificate."""
    if row["steps"] is None:
        raise ContactError(row["reason"])
    return Point(
        theta=row["theta"],
        k=row["friction"],
        outcome=Outcome(row["outcome"]),
        iterations=row["steps"],
        coupled_residual=row["coupled_residual"],
    )

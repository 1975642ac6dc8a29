"""The (theta, k) plane: where each edition proves contraction, and what runs do there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ndtheory import EDITIONS, Constants, evaluate, evaluate_sharp
from verification.algorithm.runs import Outcome, run
from verification.bounds.table import LARGEST
from verification.constants import Measured, measure
from verification.document import Document
from verification.interface.assembly import build
from verification.interface.pair import ContactPair
from verification.interrupts import INTERRUPTED
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.progress import Progress, silent

#: How many friction values trace the border of a region, and of that of the semidefinite edition.
TRACED, TRACED_LMI = 60, 8

#: Where runs are started, and how long they may take.
THETAS = tuple(float(f"{v:.3g}") for v in np.geomspace(0.04, 0.97, 9))
FRICTIONS = tuple(float(f"{v:.3g}") for v in np.geomspace(0.01, 5, 7))
MOST_STEPS = 300


@dataclass(frozen=True, kw_only=True)
class Region:
    """Where one edition proves contraction.

    Attributes
    ----------
    k : tuple of float
        Friction, increasing; below the first value the region does not shrink.
    theta : tuple of pairs of float
        Contraction for lo < theta < hi.
    every : float
        Friction below which every small theta contracts.
    some : float or None
        Friction below which some theta contracts; None where that was not worked out.
    """

    k: tuple[float, ...]
    theta: tuple[tuple[float, float], ...]
    every: float
    some: float | None


@dataclass(frozen=True, kw_only=True)
class Point:
    """What a run did."""

    theta: float
    k: float
    outcome: Outcome
    iterations: int


@dataclass(frozen=True, kw_only=True)
class Plane(Document):
    """Regions by edition, and runs.

    Attributes
    ----------
    title : str
    regions : mapping from edition to Region
    points : tuple of Point
    reason : mapping
        Why an edition has no region; ``points`` where Ctrl-C left some out.
    """

    schema: ClassVar[str] = "ndtheory.region/1"

    title: str
    regions: Mapping[str, Region]
    points: tuple[Point, ...]
    reason: Mapping[str, str]
    units: Mapping[str, str]

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C left something out."""
        return "points" in self.reason

    def content(self) -> dict[str, Any]:
        return {
            "title": self.title,
            "regions": {
                name: {
                    "k": list(region.k),
                    "theta": [list(ends) for ends in region.theta],
                    "every_small_theta": region.every,
                    "some_theta": region.some,
                }
                for name, region in self.regions.items()
            },
            "points": [vars(point) for point in self.points],
            "reason": dict(self.reason),
        }


def chart(problem: Problem, *, progress: Progress = silent) -> Plane:
    """Trace the regions of all editions for a problem's bodies, and run a grid of theta and k.

    Parameters
    ----------
    problem : Problem
    progress : callable
        Told what is being done.

    Raises
    ------
    ProblemError
        A problem outside the theorem, or without a law of friction.
    KeyboardInterrupt
        Before the regions of the theorem were traced; later it leaves out what was still to come.
    """
    progress("tracing the regions", None)
    pair = build(problem)
    if problem.contact.law == "local":
        raise ProblemError(problem.source, "contact.law", "local", 'no region is proved of it; needed "nonlocal"')
    if pair.outside:
        raise ProblemError(problem.source, "contact", None, f"no region is proved: {pair.outside[0]}")
    measured = measure(pair)
    constants, sharp, limit = measured.constants(), measured.friction_threshold, measured.friction_limit
    regions: dict[str, Region] = {}
    reason: dict[str, str] = {}
    if constants is None:
        raise ProblemError(problem.source, "contact", None, next(iter(measured.reason.values())))
    if sharp is None or limit is None:
        raise ProblemError(problem.source, "contact.radius", None, "needed a law of friction to vary k")
    for edition in EDITIONS:
        of = evaluate(edition, constants)
        if of.C2 is not None and of.C4 is not None:
            interval = lambda k, e=edition: evaluate(e, _at(measured, k)).interval
            regions[edition.name] = _trace(interval, every=of.C4.value, some=of.C2.value)
    regions["sharp"] = _trace(lambda k: _sharp_interval(measured.with_friction(k)), every=sharp.value, some=limit.value)
    points: list[Point] = []
    cells = [(theta, k) for k in FRICTIONS for theta in THETAS]
    reason |= dict.fromkeys(("lmi", "points"), INTERRUPTED)
    try:
        traced, why = _semidefinite(pair, measured, sharp.value, progress)
        if traced is None:
            reason["lmi"] = why
        else:
            regions["lmi"] = traced
            del reason["lmi"]
        for point in _points(pair, cells, progress):
            points.append(point)
        del reason["points"]
    except KeyboardInterrupt:
        reason["points"] = f"interrupted after {len(points)} of {len(cells)} runs"
    return Plane(title=problem.title, regions=regions, points=tuple(points), reason=reason, units=problem.units)


def _points(pair: ContactPair, cells: Sequence[tuple[float, float]], progress: Progress) -> Iterator[Point]:
    """What runs do at each theta and k."""
    for i, (theta, k) in enumerate(cells):
        progress(f"runs: theta = {theta:g}, k = {k:g}", i / len(cells))
        finished = run(_rubbing(pair, k), theta=theta)
        if finished.interrupted:
            raise KeyboardInterrupt
        yield Point(theta=theta, k=k, outcome=finished.outcome, iterations=finished.iterations)


def _rubbing(pair: ContactPair, k: float) -> ContactPair:
    """The same bodies at another friction, for runs of a limited length with a constant theta."""
    settings = replace(pair.settings, relaxation="constant", max_iterations=MOST_STEPS)
    return replace(pair.at(friction=k), settings=settings)


def _sharp_interval(measured: Measured) -> tuple[float, float] | None:
    constants = measured.energy_constants()
    return None if constants is None else evaluate_sharp(constants).interval


def _trace(interval: Callable[[float], tuple[float, float] | None], *, every: float, some: float) -> Region:
    """Follow the border of a region up to the last friction that allows some theta, closer where it ends."""
    ks = [some * (1 - 10.0**exponent) for exponent in np.linspace(-0.05, -6, TRACED // 2)]
    ks = sorted({*np.geomspace(some * 1e-3, some * 0.1, TRACED - TRACED // 2), *ks})
    found = [(float(k), interval(float(k))) for k in ks]
    kept = [(k, ends) for k, ends in found if ends is not None]
    return Region(k=tuple(k for k, _ in kept), theta=tuple(ends for _, ends in kept), every=every, some=some)


def _at(measured: Measured, k: float) -> Constants:
    constants = measured.with_friction(k).constants()
    assert constants is not None
    return constants


def _semidefinite(pair: ContactPair, measured: Measured, start: float, progress: Progress) -> tuple[Region | None, str]:
    from verification.bounds.program import LMIError
    from verification.bounds.semidefinite import SemidefiniteEdition, friction_threshold

    if pair.contact.grid.n > LARGEST:
        return None, f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}"
    try:
        last = friction_threshold(pair, measured, start, progress=progress)
        kept = []
        for i, k in enumerate(np.append(np.geomspace(last * 1e-2, last * 0.9, TRACED_LMI - 1), last)):
            progress(f"semidefinite edition: largest theta at k = {k:.3g}", i / TRACED_LMI)
            found = SemidefiniteEdition(pair, measured, friction=float(k)).largest_theta()
            if found is not None:
                kept.append((float(k), (0.0, found.value)))
    except LMIError as error:
        return None, str(error)
    return Region(k=tuple(k for k, _ in kept), theta=tuple(ends for _, ends in kept), every=last, some=None), ""

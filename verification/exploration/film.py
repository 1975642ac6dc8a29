"""Runs on a grid of theta and friction in one role, with the steps that a page shows, packed as bytes."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from ndtheory.keys import Part, derived, key, says
from verification.algorithm.history import History
from verification.algorithm.runs import Run, run
from verification.bounds.bound import Bound, NotComputed, Region, Subject
from verification.constants import Measured
from verification.contact import ContactError
from verification.interface.body import Body
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress
from verification.problem.tables import ProblemError
from verification.registry import BOUNDS
from verification.sweeps.region import check_plane

#: The bodies are drawn until the relative residual is below this: later steps look the same at the size of a page.
VISIBLE = 1e-3

#: Number of first steps at which they are all drawn, and of steps of one run at most.
FIRST, MOST = 10, 20

#: Number of last steps that are drawn where the residual stays visible, as in a cycle.
LAST = 6

#: Bodies are not drawn at steps in which a displacement is larger than this multiple of the largest one of the
#: problem's own run: they leave the picture.
FARTHEST = 10.0

#: Numbers of a lift that are stored of the whole mesh; of a larger one only the boundary is drawn.
MOST_NUMBERS = 150_000

#: The states of contact nodes as they are packed.
STATES = ("stick", "slip", "open")


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmedRun(Part):
    """One run as a page shows it.

    ``residuals`` are relative, of every step; at ``steps`` the bodies are drawn, and at ``left_out`` more they would
    be, but leave the picture.  By step ``frames``, shape (steps, bytes), have displacements along Gamma_c of body 1 and
    of body 2, pressure and shear at the contact nodes, each in 127ths of its size, and the states of these nodes;
    ``sizes`` the largest displacement and the largest stress.  ``factors`` are what each bound proves for one step;
    None where it has no conclusion, and of a history.
    """

    theta: float = key()
    friction: float = key()
    outcome: str = key("as in **Run**; or the reason for a missing run, or why a history ended early")
    iterations: int | None = key("of a history the sum over all increments", null="without a run", why=None)
    rate: float | None = key(
        "observed rate as in **Run**", null="where too few steps show it, and of a history", why=None
    )
    residuals: tuple[float, ...]
    steps: tuple[int, ...]
    left_out: int
    frames: NDArray[np.int8]
    sizes: tuple[tuple[float, float], ...]
    factors: dict[str, float | None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Film(Part):
    """Runs of one pair on a grid.

    ``pair`` has these roles and the problem's friction; ``lines`` are runs by friction, then theta; ``regions``
    belong to the bounds that follow from the constants.
    """

    pair: ContactPair
    measured: Measured
    lines: tuple[tuple[FilmedRun, ...], ...]
    regions: dict[str, Region]
    why_no_region: str

    neumann_body = derived("1 or 2", lambda film: film.pair.neumann_body, int, unit="")

    @property
    @says("a run for each friction and theta; of a problem with steps a loading history for each friction")
    def runs(self) -> list[FilmedRun]:
        return [each for line in self.lines for each in line]


def film(
    pair: ContactPair,
    measured: Measured,
    thetas: Sequence[Fraction],
    frictions: Sequence[Fraction],
    farthest: float,
    progress: Progress,
) -> Film:
    """Run every theta at every friction with constant relaxation, and evaluate the bounds there.

    The bodies are not drawn at a step in which a displacement is larger than ``farthest``.
    """
    calculated = [bound for bound in BOUNDS.values() if bound.calculated]
    regions: dict[str, Region] = {}
    runs, why = [], ""
    for i, k in enumerate(frictions):
        progress(f"running {len(thetas)} thetas at k = {float(k):.3g}", i / len(frictions))
        there = pair.at(friction=k)
        # bounds take a double
        try:
            subject = None if there.outside else Subject.of(there, measured.with_friction(float(k)))
        except ValueError:  # a constant is infinite: no bound applies
            subject = None
        line = []
        for theta in thetas:
            factors = {bound.name: None if subject is None else _factor(bound, subject, theta) for bound in calculated}
            line.append(_shown(there, theta, farthest, factors))
        runs.append(tuple(line))
    try:
        check_plane(pair, measured)
        regions = {bound.name: bound.region(Subject.of(pair, measured)) for bound in calculated}
    except (ProblemError, NotComputed) as error:
        why = str(error)
    return Film(pair=pair, measured=measured, lines=tuple(runs), regions=regions, why_no_region=why)


def _factor(bound: Bound, subject: Subject, theta: Fraction) -> float | None:
    found = bound.evaluate(subject, theta)
    return found.factor.value if found.proved and found.factor is not None else None


def _shown(pair: ContactPair, theta: Fraction, farthest: float, factors: dict[str, float | None]) -> FilmedRun:
    at: dict[str, Any] = {"theta": float(theta), "friction": float(pair.friction), "factors": factors}
    try:
        made = run(pair, theta=theta, rule="constant")
    except ContactError as error:
        at |= {"outcome": str(error), "iterations": None, "rate": None, "steps": (), "residuals": ()}
        return FilmedRun(**at, left_out=0, frames=np.zeros((0, 0), np.int8), sizes=())
    candidates = {step: _frame(made, step) for step in steps_shown(made.history)}
    near = {step: each for step, each in candidates.items() if each[1][0] <= farthest or not step}
    return FilmedRun(
        **at,
        outcome=made.outcome,
        iterations=made.iterations,
        rate=None if made.observed_rate is None else made.observed_rate.value,
        residuals=tuple(made.history),
        steps=tuple(near),
        left_out=len(candidates) - len(near),
        frames=np.stack([frame for frame, _ in near.values()]),
        sizes=tuple(size for _, size in near.values()),
    )


def past(history: History) -> FilmedRun:
    """A loading history as a run of a film: each increment is a step, with its relative residual."""
    runs = [each.run for each in history.increments if each.run is not None]
    shown = [_frame(each, len(each.iterates) - 1) for each in runs]
    return FilmedRun(
        theta=float(runs[0].theta),
        friction=float(runs[0].pair.friction),
        outcome=history.ended or "converged",
        iterations=sum(each.iterations for each in runs),
        rate=None,
        residuals=tuple(each.last.relative_residual for each in runs),
        steps=tuple(range(1, len(runs) + 1)),
        left_out=0,
        frames=np.stack([frame for frame, _ in shown]),
        sizes=tuple(size for _, size in shown),
        factors=dict.fromkeys(history.bounds),
    )


def told(history: History) -> dict[str, Any]:
    """The numbers of a loading history beside its frames, as columns with an entry for each increment."""
    table = history.table()
    return {
        **{name: table[name] for name in ("time", "name", "iterations", "normal", "tangential")},
        "dissipated": np.cumsum(table["dissipated"]).tolist(),
        "along": history.driven[1].tolist(),
        **{name: [_short(row) for row in history.fields[name]] for name in ("pressure", "shear", "bound", "slip")},
        "status": [each.contact.status for each in history.increments],
    }


def steps_shown(history: Sequence[float]) -> list[int]:
    """The steps at which bodies are drawn: the first ones, ever fewer while the residual is visible, the last one.

    Where it stays visible, the last ones, among which a cycle shows.

    >>> steps_shown([1, 0.1, 1e-2, 1e-4, 1e-6, 1e-9]), steps_shown([0.5] * 40)[-7:]
    ([0, 1, 2, 3, 5], [33, 34, 35, 36, 37, 38, 39])
    """
    last = len(history) - 1
    visible = next((i for i, residual in enumerate(history) if residual <= VISIBLE), last)
    later = np.geomspace(FIRST, visible, MOST - FIRST) if visible > FIRST else np.zeros(0)
    cycle = range(max(last - LAST, 0), last) if visible == last else ()
    return sorted({*range(min(visible, FIRST) + 1), *(int(step) for step in later), *cycle, last})


def packed(found: Film) -> dict[str, Any]:
    """The runs of a film as data of a page: numbers of each run, and all frames as one text in base 64."""
    every = found.runs
    firsts = iter(np.cumsum([0, *(len(each.steps) for each in every)]).tolist())
    rounded = lambda value, digits: None if value is None or not np.isfinite(value) else float(f"{value:.{digits}g}")
    runs = [
        [
            {
                "outcome": each.outcome,
                "steps": each.iterations,
                "rate": rounded(each.rate, 4),
                "shown": each.steps,
                "leftOut": each.left_out,
                "residuals": [rounded(value, 3) for value in each.residuals],
                "factors": [rounded(value, 6) for value in each.factors.values()],
                "first": next(firsts),
            }
            for each in line
        ]
        for line in found.lines
    ]
    frames = np.concatenate([each.frames.ravel() for each in every])
    return {
        "runs": runs,
        "scales": [[rounded(size, 4) for size in sizes] for each in every for sizes in each.sizes],
        "frames": _text(frames),
    }


def _frame(finished: Run, step: int) -> tuple[NDArray[np.int8], tuple[float, float]]:
    """One step as bytes, and the sizes of its displacements and stresses."""
    iterate = finished.iterates[step]
    moved, fields = np.concatenate(finished.traces_at(iterate)), finished.contact_at(iterate)
    stress = np.concatenate([fields.pressure, fields.shear])
    states = np.array([STATES.index(name) for name in fields.status], dtype=np.int8)
    sizes = float(np.abs(moved).max()), float(np.abs(stress).max())
    return np.concatenate([_bytes(moved, sizes[0], 127), _bytes(stress, sizes[1], 127), states]), sizes


def _bytes(values: Floats, size: float, most: int) -> NDArray[Any]:
    kind = np.int8 if most < 128 else np.int16
    return np.asarray(np.rint(values * (most / size)) if size else np.zeros(len(values))).astype(kind)


def _text(values: NDArray[Any]) -> str:
    return b64encode(values.astype(values.dtype.newbyteorder("<")).tobytes()).decode()


def _short(values: Floats, digits: int = 5) -> list[float]:
    return [float(f"{x:.{digits}g}") for x in values]


def drawn(body: Body, *later: Body) -> dict[str, Any]:
    """A body for a page: points, cells or boundary, and the affine map from its trace on Gamma_c to displacements.

    The finite elements give the map; it is rounded to 16 bits: ``u = still + size * lift @ trace / 32767``.  The same
    body under other loads has an entry of ``later`` in place of ``still``.
    """
    components = len(body.unknown)
    whole = body.mesh.points.size * components <= MOST_NUMBERS
    cells = body.mesh.cells if whole else body.mesh.boundary
    nodes, corners = np.unique(cells, return_inverse=True)
    still = body.displacement(np.zeros(components))[nodes].ravel()
    lift = np.stack([body.displacement(row)[nodes].ravel() - still for row in np.eye(components)], axis=1)
    size = float(np.abs(lift).max())
    return {
        "points": _short(body.mesh.points[nodes].ravel(), 6),
        "cells": corners.reshape(cells.shape).tolist(),
        "still": _short(still),
        "later": [_short(each.displacement(np.zeros(components))[nodes].ravel()) for each in later],
        "size": size,
        "lift": _text(_bytes(lift.ravel(), size, 32767)),
        "contact": np.searchsorted(nodes, body.nodes).tolist(),
    }

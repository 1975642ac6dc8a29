"""A sweep: rows over a grid, on one or several cores."""

from __future__ import annotations

import csv
import io
import signal
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import __version__
from verification.document import Document
from verification.interface.files import read_interface
from verification.interface.pair import UNITS, ContactPair
from verification.problem.reading import load
from verification.problem.specification import Problem
from verification.progress import Progress, silent
from verification.sweeps.bodies import Bodies
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import Row, row

if TYPE_CHECKING:
    from verification.figures import Figure

#: Rows that a worker takes at once, at most: what it returns together is what progress tells of.
MOST_AT_ONCE = 32


@dataclass(frozen=True, kw_only=True, repr=False)
class Sweep(Document):
    """Runs over a grid.

    Attributes
    ----------
    rows : tuple of dict
        One for each run, in the order of :meth:`verification.sweeps.grid.SweepGrid.rows`.
    asked : int
        How many rows the grid has; Ctrl-C may have left some out.
    axes : tuple of str
        The columns that vary.
    """

    schema: ClassVar[str] = "ndtheory.sweep/1"

    rows: tuple[Row, ...]
    asked: int
    axes: tuple[str, ...]
    units: Mapping[str, str]
    problem: Problem | None = None

    @property
    def summary(self) -> str:
        converged = sum(each["outcome"] == "converged" for each in self.rows)
        title = "matrices" if self.problem is None else self.problem.title
        return f"{title}, {len(self.rows)} runs over {', '.join(self.axes) or 'nothing'}, {converged} converged"

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C left rows out."""
        return len(self.rows) < self.asked

    @property
    def reason(self) -> dict[str, str]:
        """Why rows are missing."""
        return {"rows": f"interrupted after {len(self.rows)} of {self.asked} rows"} if self.interrupted else {}

    def table(self) -> dict[str, list[Any]]:
        """The rows as plain columns: ``pandas.DataFrame(sweep.table())`` reads it."""
        return {name: [each[name] for each in self.rows] for name in self.columns}

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns."""
        return tuple(self.rows[0])

    def values(self, columns: Sequence[str]) -> dict[tuple[Any, ...], list[Row]]:
        """The rows by their values in some columns."""
        found: dict[tuple[Any, ...], list[Row]] = {}
        for each in self.rows:
            found.setdefault(tuple(each[name] for name in columns), []).append(each)
        return found

    def plot(self, x: str = "theta", y: str = "iterations", curves: str | None = None) -> Figure:
        """One column over another, one curve for each value of a third.

        Raises
        ------
        ValueError
            A column that there is not, or without numbers.
        """
        from verification.figures import draw_sweep

        return draw_sweep(self, x, y, curves)

    def to_csv(self) -> str:
        """The rows as CSV, under lines that begin with ``#`` and hold version, units and the problem as TOML.

        ``pandas.read_csv(name, comment="#")`` reads it; what is None is empty.
        """
        written = io.StringIO()
        units = ", ".join(f"{name} in {unit}" for name, unit in self.units.items())
        head = [f"ndtheory {__version__}: sweep, {units}"]
        head += [f"interrupted after {len(self.rows)} of {self.asked} rows"] * self.interrupted
        head += [] if self.problem is None else self.problem.to_toml().splitlines()
        for line in head:
            written.write(f"# {''.join(c if c.isprintable() else ' ' for c in line)}".rstrip() + "\n")
        table = csv.DictWriter(written, self.columns, lineterminator="\n")
        table.writeheader()
        table.writerows(self.rows)
        return written.getvalue()

    def content(self) -> dict[str, Any]:
        return {
            "axes": list(self.axes),
            "asked": self.asked,
            "rows": [dict(each) for each in self.rows],
            "reason": self.reason,
        }


def sweep(
    problem: Problem | ContactPair | Path | str,
    *,
    theta: Sequence[Any] | None = None,
    friction: Sequence[Any] | None = None,
    young: Sequence[Any] | None = None,
    neumann_body: Sequence[int] | None = None,
    refine: Sequence[int] | None = None,
    law: Sequence[str] | None = None,
    radius: Sequence[Any] | None = None,
    rule: Sequence[Any] | None = None,
    jobs: int = 1,
    progress: Progress = silent,
) -> Sweep:
    """Run a problem at every point of a grid: the product of the lists that are given.

    Parameters
    ----------
    problem : Problem, ContactPair or path
        What is not varied is as it has it.
    theta : list of number or 'auto', optional
    friction : list of number, optional
    young : list of pairs, optional
        ``(E1, E2)``, stress.
    neumann_body : list of {1, 2}, optional
    refine : list of int, optional
        Halvings of the problem's mesh.
    law : list of str, optional
    radius : list of number, optional
        Of the kernel of S, length.
    rule : list of Rule or str, optional
    jobs : int
        Processes; 0 or less counts back from all cores, -1 is all.
    progress : callable
        Told how many rows are done.

    Returns
    -------
    Sweep

    Raises
    ------
    ProblemError
        A value that fits no problem.  A run that fails is a row that says why.
    KeyboardInterrupt
        Before the first row; later the sweep holds the rows that are done.

    Examples
    --------
    >>> bars = {"dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": -0.1}}}
    >>> found = sweep(Problem.from_dict(bars), theta=["1/3", 0.5])
    >>> [(round(row["theta"], 3), row["iterations"], round(row["rho"], 12)) for row in found.rows]
    [(0.333, 1, 2.0), (0.5, 30, 2.0)]
    """
    start: Problem | ContactPair
    if isinstance(problem, (Problem, ContactPair)):
        start = problem
    else:
        start = read_interface(Path(problem)) if Path(problem).suffix == ".npz" else load(problem)
    of = start.source if start.source else "<dict>"
    axes = {"theta": theta, "friction": friction, "young": young, "neumann_body": neumann_body, "refine": refine}
    grid = SweepGrid.of(axes | {"law": law, "radius": radius, "rule": rule}, of)
    return sweep_grid(start, grid, jobs=jobs, progress=progress)


def sweep_grid(start: Problem | ContactPair, grid: SweepGrid, *, jobs: int = 1, progress: Progress = silent) -> Sweep:
    """As :func:`sweep`, over a grid that is read already."""
    wanted = list(grid.rows())
    done: dict[int, Row] = {}
    work = _alone if jobs == 1 else _together
    begun = time.monotonic()
    try:
        progress(f"runs: 0 of {len(wanted)} rows", 0.0)
        for index, found in work(start, wanted, jobs):
            done[index] = found
            left = (time.monotonic() - begun) * (len(wanted) / len(done) - 1)
            progress(f"runs: {len(done)} of {len(wanted)} rows, {_duration(left)} left", len(done) / len(wanted))
    except KeyboardInterrupt:
        if not done:
            raise
    axes = tuple(name for axis in grid.axes for name in (("young1", "young2") if axis == "young" else (axis,)))
    return Sweep(
        rows=tuple(done[i] for i in sorted(done)),
        asked=len(wanted),
        axes=axes,
        units=start.units if start.units else UNITS,
        problem=start if isinstance(start, Problem) else start.problem,
    )


def _duration(seconds: float) -> str:
    """An estimate of a time.

    >>> _duration(4.2), _duration(80), _duration(8000)
    ('about 4 s', 'about 1 min', 'about 2.2 h')
    """
    if seconds < 60:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60:.0f} min" if seconds < 3600 else f"about {seconds / 3600:.1f} h"


def _alone(start: Problem | ContactPair, wanted: Sequence[Row], jobs: int) -> Iterator[tuple[int, Row]]:
    bodies = Bodies(start)
    for index, values in enumerate(wanted):
        yield index, row(start, values, bodies)


@dataclass(frozen=True, kw_only=True)
class _Start:
    """What a sweep varies, known to a worker by the name of the sweep."""

    name: str
    start: Any = field(compare=False)


@lru_cache(maxsize=1)
def _bodies(start: _Start) -> Bodies:
    """What the rows of a worker share."""
    return Bodies(start.start)


def _some(start: _Start, some: Sequence[tuple[int, Row]]) -> list[tuple[int, Row]]:
    """Rows in a worker, which leaves Ctrl-C to its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    bodies = _bodies(start)
    return [(index, row(start.start, values, bodies)) for index, values in some]


def _together(start: Problem | ContactPair, wanted: Sequence[Row], jobs: int) -> Iterator[tuple[int, Row]]:
    from joblib import Parallel, delayed, effective_n_jobs, parallel_config

    named = _Start(name=uuid.uuid4().hex, start=start)
    at_once = max(1, min(MOST_AT_ONCE, len(wanted) // (4 * effective_n_jobs(jobs))))
    pieces = _pieces(list(enumerate(wanted)), at_once)
    with parallel_config(backend="loky", inner_max_num_threads=1):
        results = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)(
            delayed(_some)(named, piece) for piece in pieces
        )
        try:
            for rows in results:
                yield from rows
        except BaseException:
            _stop()
            raise


def _stop() -> None:
    """End the workers at once: what they compute is not wanted any more."""
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor().shutdown(wait=True, kill_workers=True)


def _pieces(rows: Sequence[tuple[int, Row]], at_once: int) -> Iterator[Sequence[tuple[int, Row]]]:
    """Rows that stand together and have one mesh, so many at once."""
    first = 0
    for last in range(1, len(rows) + 1):
        mesh: Callable[[int], Any] = lambda i: rows[i][1].get("refine")
        if last == len(rows) or last - first == at_once or mesh(last) != mesh(first):
            yield rows[first:last]
            first = last

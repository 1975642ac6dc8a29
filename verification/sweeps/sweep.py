"""A sweep: rows over a grid, on one or several cores."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import __version__
from ndtheory.keys import key, says
from verification.document import Document
from verification.interface.files import read_interface
from verification.interface.pair import UNITS, ContactPair
from verification.machine.progress import Progress, silent
from verification.problem.files import load
from verification.problem.specification import Problem
from verification.spreadsheet import as_csv
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import COLUMNS, FAILED, Row, problem_of
from verification.sweeps.store import Store
from verification.sweeps.workers import Work, work_of

if TYPE_CHECKING:
    from verification.document import Figure


@dataclass(frozen=True, kw_only=True, repr=False)
class Sweep(Document):
    """Runs over a grid.

    Attributes
    ----------
    grid, places : SweepGrid, tuple of int
        The grid of all rows, and the place of each row among them; Ctrl-C may have left some out.
    stored : int
        Number of rows that a store had already.
    notes : tuple of str
        Sentences about rows of the store that were not used, or that ended in an error.
    """

    schema: ClassVar[str] = "ndtheory.sweep/1"

    axes: tuple[str, ...] = key("the columns that vary")
    asked: int = key("how many rows the grid has")
    rows: tuple[Row, ...] = key("one run each, theta changing fastest", type="list of object", inside=COLUMNS)
    units: Mapping[str, str]
    grid: SweepGrid
    places: tuple[int, ...]
    stored: int = 0
    notes: tuple[str, ...] = ()
    problem: Problem | None = None

    @property
    def summary(self) -> str:
        converged = sum(each["outcome"] == "converged" for each in self.rows)
        title = "matrices" if self.problem is None else self.problem.title
        return f"{title}, {len(self.rows)} runs over {', '.join(self.axes) or 'nothing'}, {converged} converged"

    @property
    def interrupted(self) -> bool:
        """True if Ctrl-C left rows out."""
        return len(self.rows) < self.asked

    @property
    @says("why rows are missing")
    def reason(self) -> dict[str, str]:
        return {"rows": f"interrupted after {len(self.rows)} of {self.asked} rows"} if self.interrupted else {}

    def table(self) -> dict[str, list[Any]]:
        """Return the rows as columns: ``pandas.DataFrame(sweep.table())`` reads it."""
        return {name: [each[name] for each in self.rows] for name in self.columns}

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns."""
        return tuple(self.rows[0])

    def values(self, columns: Sequence[str]) -> dict[tuple[Any, ...], list[Row]]:
        """Group the rows by their values in some columns."""
        found: dict[tuple[Any, ...], list[Row]] = {}
        for each in self.rows:
            found.setdefault(tuple(each[name] for name in columns), []).append(each)
        return found

    def plot(self, x: str = "theta", y: str = "iterations", curves: str | None = None) -> Figure:
        """Draw one column over another, with one colour for each value of a third.

        Raises
        ------
        ValueError
            A column that does not exist, or has no numbers.
        """
        return self.drawn(x=x, y=y, curves=curves)

    def to_csv(self) -> str:
        """Return the rows as CSV, under lines that begin with ``#`` and hold version, units and the problem as TOML.

        ``pandas.read_csv(name, comment="#")`` reads it; None is an empty cell.
        """
        units = ", ".join(f"{name} in {unit}" for name, unit in self.units.items())
        head = [f"ndtheory {__version__}: sweep, {units}"]
        head += [f"interrupted after {len(self.rows)} of {self.asked} rows"] * self.interrupted
        head += [] if self.problem is None else self.problem.to_toml().splitlines()
        return as_csv(head, self.columns, ([each[name] for name in self.columns] for each in self.rows))


def duration(seconds: float) -> str:
    """Write an estimate of a time.

    >>> duration(4.2), duration(80), duration(8000)
    ('about 4 s', 'about 1 min', 'about 2.2 h')
    """
    if seconds < 60:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60:.0f} min" if seconds < 3600 else f"about {seconds / 3600:.1f} h"


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
    store: Path | str | None = None,
    fresh: bool = False,
    retry: bool = False,
    dask: str | None = None,
    progress: Progress = silent,
) -> Sweep:
    """Run a problem at every point of a grid: the product of the lists that are given.

    Parameters
    ----------
    problem : Problem, ContactPair or path
        Source of the values that are not varied.
    theta : list of number or 'auto', optional
        Relaxation factors, 0 < theta < 1.
    friction : list of number, optional
        Friction coefficients, at least 0.
    young : list of pairs, optional
        ``(E1, E2)``, stress.
    neumann_body : list of {1, 2}, optional
    refine : list of int, optional
        Halvings of the problem's mesh.
    law : list of str, optional
        Friction laws by name: 'nonlocal', 'local', 'local-contact'.
    radius : list of number, optional
        Radius of the kernel of S, length.
    rule : list of Rule or str, optional
        Relaxation rules, or their names as a problem file has them.
    jobs : int
        Processes; 0 or less counts back from all cores, -1 is all.
    store : path, optional
        File of finished rows, reused where it exists and created where it does not.
    fresh : bool
        True to make rows again that the store has.
    retry : bool
        True to make rows again that ended in an error, whose reason may have passed.
    dask : str, optional
        The address of a dask scheduler, whose workers make the rows; ``jobs`` is not used then.
    progress : callable
        Called with the number of rows that are done.

    Returns
    -------
    Sweep
        ``rows`` has a dictionary for each run.

    Raises
    ------
    ProblemError
        A value that fits no problem.  A run that fails is a row that says why.
    StoreError, NoWorkers
        The store does not take a row; no worker is left.  Both are problem errors, and the store keeps what it has.
    KeyboardInterrupt
        Before the first row; later the sweep holds the rows that are done.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(2, 1))
    >>> found = sweep(bars, theta=["1/3", 0.5])
    >>> [(round(row["theta"], 3), row["iterations"], round(row["rho"], 12)) for row in found.rows]
    [(0.333, 1, 2.0), (0.5, 32, 2.0)]
    """
    if isinstance(problem, (Problem, ContactPair)):
        start = problem
    elif Path(str(problem)).suffix == ".npz":
        start = read_interface(Path(problem))
    else:
        start = load(problem)
    axes = {"theta": theta, "friction": friction, "young": young, "neumann_body": neumann_body, "refine": refine}
    grid = SweepGrid.of(axes | {"law": law, "radius": radius, "rule": rule}, start.source)
    place = None if store is None else Path(store)
    return sweep_grid(start, grid, work=work_of(jobs, dask), store=place, fresh=fresh, retry=retry, progress=progress)


def sweep_grid(
    start: Problem | ContactPair,
    grid: SweepGrid,
    *,
    work: Work | None = None,
    store: Path | None = None,
    fresh: bool = False,
    retry: bool = False,
    progress: Progress = silent,
) -> Sweep:
    """Run :func:`sweep` over a grid that is read already; ``work`` makes the rows, as :func:`work_of` returns it."""
    wanted, begun = list(grid.rows()), time.monotonic()
    done: dict[int, Row] = {}
    stored = failed = 0

    def tell(rows: Iterable[tuple[int, Row]]) -> None:
        """Take in rows, and report how far the sweep is, with the share that is done."""
        nonlocal failed
        for place, row in rows:
            done[place] = row
            failed += row["outcome"] in FAILED
        left, made = len(wanted) - len(done), len(done) - stored
        says = f"runs: {len(done)} done, {failed} failed, {left} left"
        if made:
            says += f", {duration((time.monotonic() - begun) * left / made)} to go"
        progress(says, len(done) / len(wanted))

    with contextlib.ExitStack() as stack:
        kept = None if store is None else stack.enter_context(Store(store, start, grid, fresh=fresh, retry=retry))
        there = {} if kept is None else kept.rows
        stored = len(there)
        todo = [(i, values) for i, values in enumerate(wanted) if i not in there]
        try:
            tell(there.items())
            for rows in stack.enter_context(contextlib.closing((work or work_of(1))(start, todo))):
                if kept is not None:
                    kept.add(rows)
                tell(rows)
        except KeyboardInterrupt:
            if not done:
                raise
    axes = tuple(name for axis in grid.axes for name in (("young1", "young2") if axis == "young" else (axis,)))
    places = tuple(sorted(done))
    return Sweep(
        rows=tuple(done[i] for i in places),
        asked=len(wanted),
        axes=axes,
        grid=grid,
        places=places,
        stored=stored,
        notes=() if kept is None else kept.plan.notes,
        units=start.units or UNITS,
        problem=problem_of(start),
    )

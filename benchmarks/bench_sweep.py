"""A sweep with its store, its progress and its dispatch beside its rows alone; and a store of a million rows.

The rows alone are the calls of `row`, one after the other in one process with shared bodies.  The sweep does the same
work in two processes, keeps each row in a store and tells of each piece.  Wall time and the share of both processors
depend on what else the machine does: the load is printed beside them.

python benchmarks/bench_sweep.py [--full] [--largest ROWS]
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from recording import Record, Row, options, report
from timing import clock, timed

import verification as vf
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import SharedBodies, row
from verification.sweeps.store import Store
from verification.sweeps.sweep import sweep_grid
from verification.sweeps.workers import work_of

#: Rows of a sweep on the mesh of 190 nodes along both bodies; more with --full.
ROWS, MORE = (1_000,), (10_000,)

#: Rows of a store, and of the sweep that is opened on it.
MANY, MORE_MANY, RESUMED = (100_000,), (1_000_000,), 100_000

JOBS = 2


def grid(rows: int) -> SweepGrid:
    """So many rows of theta and friction, a hundred theta for each friction."""
    frictions = rows // 100
    thetas = [Fraction(i, 101) for i in range(1, 101)]
    return SweepGrid.of({"theta": thetas, "friction": [Fraction(i, frictions) for i in range(1, frictions + 1)]})


def alone(start: vf.Problem, asked: SweepGrid) -> list[dict[str, Any]]:
    """The rows and nothing else."""
    bodies = SharedBodies(start)
    return [row(start, values, bodies) for values in asked.rows()]


def swept(start: vf.Problem, asked: SweepGrid, told: Callable[[str, float | None], None]) -> vf.Sweep:
    """The sweep in two processes with a store."""
    with tempfile.TemporaryDirectory() as folder:
        return sweep_grid(start, asked, work=work_of(JOBS), store=Path(folder) / "rows.sqlite", progress=told)


def overhead(rows: int) -> Row:
    """CPU seconds of the whole sweep, workers too, beside those of its rows."""
    from joblib.externals.loky import get_reusable_executor

    start, asked, lines = vf.example("section6-190"), grid(rows), []
    swept(start, grid(100), lambda what, share: None)  # imports
    get_reusable_executor().shutdown(wait=True)
    begun, wall = clock(), time.perf_counter()
    found = swept(start, asked, lambda what, share: lines.append(what))
    wall = time.perf_counter() - wall
    get_reusable_executor().shutdown(wait=True)  # workers count once they have ended
    ours = clock() - begun
    other, rows_alone = timed(lambda: alone(start, asked))
    assert list(found.rows) == rows_alone
    load = os.getloadavg()[0]
    busy = ours / wall / JOBS
    print(f"{rows} rows: {wall:.1f} s of wall time, both processors {busy:.0%} busy, load {load:.1f}", file=sys.stderr)
    return Row(size=rows, ours=ours, other=other, ratio=ours / other, rounds=1)


def opened(rows: int) -> Row:
    """Opening a store and finding what is left of a sweep, beside reading the rows that are there."""
    start = vf.example("section6")
    made = row(start, {"theta": Fraction(1, 2)})
    asked = SweepGrid.of({"theta": [Fraction(i, RESUMED + 1) for i in range(1, RESUMED + 1)]})
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "rows.sqlite"
        for i in range(rows // RESUMED):  # one row of the sweep itself is left; the others are of other problems
            study = start.changed(friction=Fraction(i, 7)) if i else start
            with Store(place, study, asked) as store:
                for first in range(0, RESUMED, 10_000):
                    store.add([(n, made) for n in range(first, min(first + 10_000, RESUMED - (not i)))])

        def resumed() -> int:
            with Store(place, start, asked) as store:
                return len(store.rows)

        begun = time.perf_counter()
        ours, found = timed(resumed)
        wall = time.perf_counter() - begun
        assert found == RESUMED - 1
        size = place.stat().st_size / 1e6
    print(f"{rows} rows of a store, {size:.0f} MB: {wall:.2f} s of wall time to open and resume", file=sys.stderr)
    return Row(size=rows, ours=ours, other=None, ratio=None, rounds=1)


def main() -> None:
    given = options(__doc__).parse_args()
    sizes = [n for n in (*ROWS, *(MORE if given.full else ())) if n <= given.largest]
    many = [n for n in (*MANY, *(MORE_MANY if given.full else ())) if n <= given.largest]
    report(
        Record(
            name="sweep",
            place=60,
            title="A sweep with store, progress and dispatch",
            ours="the sweep in two processes, each row kept in a store",
            other="its rows alone, one after the other",
            peer="rows alone",
            rows=tuple(map(overhead, sizes)),
            size="rows, 190 nodes",
            wanted="less than 1.2 times the rows alone",
        ),
        given.record,
    )
    report(
        Record(
            name="sweep_store",
            place=61,
            title="Opening a store and finding what is left",
            ours=f"a sweep of {RESUMED:,} rows of which one is left",
            rows=tuple(map(opened, many)),
            size="rows of the store",
            wanted="less than 2 s at 1,000,000 rows, one of the long sizes",
        ),
        given.record,
    )


if __name__ == "__main__":
    main()

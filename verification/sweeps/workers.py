"""Workers that make the rows of a sweep: this process, several on this machine, or the workers of a cluster."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice
from multiprocessing import Pipe
from typing import Any

from fem1d2d import mesh_files
from ndtheory import __version__
from verification.interface.pair import ContactPair
from verification.machine.interrupts import CAN_WAIT, begin_child, undisturbed
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.row import Row, SharedBodies, row

#: Rows by their places in the grid.
Placed = list[tuple[int, Row]]

#: From a problem or a pair and the values of rows by their places to the rows, some at a time and in any order.
Work = Callable[[Problem | ContactPair, Sequence[tuple[int, Row]]], Generator[Placed, None, None]]

#: Rows that a worker takes at once, at most, and the seconds they should take: a process that is killed loses no more
#: than what its workers have not handed over.
MOST_AT_ONCE, SECONDS = 32, 0.25

#: Largest number of processes for each core of this machine: more of them fill the memory and make no row sooner.
MOST_FOR_A_CORE = 4

#: Batches that wait for each process or thread of a worker, so that it need not wait.
AHEAD = 2

#: Seconds that the executor has to take the batches that it was given, before it is ended without that.
LATEST = 1.0

#: The environment in which the libraries that multiply matrices use one thread in each process.
ONE_THREAD = dict.fromkeys(mesh_files.ONE_THREAD, "1")


class NoWorkers(ProblemError):
    """No worker is left that could make the rows."""

    def __init__(self, where: str, why: str) -> None:
        super().__init__(where, "", None, f"{why}; with a store the same command goes on from the rows that were done")


def alone(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
    """Make the rows in this process, one after the other."""
    if why := unusable(start):
        raise ProblemError(start.source, "mesh", None, why)
    bodies = SharedBodies(start)
    for index, values in wanted:
        yield [(index, row(start, values, bodies))]


@dataclass(frozen=True, kw_only=True)
class Origin:
    """The problem or pair of a sweep, under a name by which a worker recognises it."""

    name: str
    start: Any = field(compare=False)

    @classmethod
    def of(cls, start: Problem | ContactPair) -> Origin:
        """Return the origin of a new sweep."""
        return cls(name=uuid.uuid4().hex, start=start)


@dataclass(frozen=True, kw_only=True)
class Handed:
    """The rows that a worker hands over.

    Attributes
    ----------
    seconds : float
        Time to make them.
    version : str
        Of the library there.
    unusable : str
        Why the worker can make no row of this problem; empty where it can.
    """

    rows: Placed
    seconds: float = 0.0
    version: str = __version__
    unusable: str = ""


#: Rows share condensed bodies and the setting of BLAS: a process makes one at a time, whatever threads it has.
_one_at_a_time = threading.Lock()


@lru_cache(maxsize=1)
def _bodies(origin: Origin) -> SharedBodies:
    """Shared bodies of the rows of a worker."""
    return SharedBodies(origin.start)


def unusable(start: Problem | ContactPair) -> str:
    """Return why a mesh file of a problem cannot be used here, whatever the row; empty where all can."""
    bodies = (start.body1, start.body2) if isinstance(start, Problem) else ()
    return "; ".join(f"{body.mesh.path}: {why}" for body in bodies if body.mesh and (why := body.mesh.unusable()))


@lru_cache(maxsize=1)
def _unusable(origin: Origin) -> str:
    return unusable(origin.start)


def some(origin: Origin, batch: Sequence[tuple[int, Row]]) -> Handed:
    """Make some rows in a worker."""
    with _one_at_a_time:
        begun = time.monotonic()
        if why := _unusable(origin):
            return Handed(rows=[], unusable=why)
        bodies = _bodies(origin)
        rows = [(index, row(origin.start, values, bodies)) for index, values in batch]
        return Handed(rows=rows, seconds=time.monotonic() - begun)


@lru_cache(maxsize=1)
def _life() -> tuple[Any, Any]:
    """Return both ends of a pipe on which nothing is sent: the reading end meets its end when this process does."""
    return Pipe(duplex=False)


def processes(jobs: int, rows: int) -> int:
    """Return the number of processes for some rows that are still to be made: at most one a row, and 4 a core.

    ``jobs`` is the number asked for; 0 or less counts back from all cores.
    """
    from joblib import cpu_count, effective_n_jobs

    return min(int(effective_n_jobs(jobs)), rows, MOST_FOR_A_CORE * int(cpu_count()))


def together(jobs: int) -> Work:
    """Return workers in processes of this machine, by joblib's executor; 0 or fewer jobs count back from all cores."""

    def work(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
        from joblib.executor import get_memmapping_executor
        from joblib.externals.loky.process_executor import BrokenProcessPool

        if not wanted:
            return
        count = processes(jobs, len(wanted))
        origin, batches = Origin.of(start), Batches(wanted, count)
        source, ahead = iter(batches), AHEAD * count
        executor = None
        waiting: set[Future[Handed]] = set()
        try:
            if CAN_WAIT:
                _start_trackers()
            with undisturbed():  # it ends once they are started: what starts meanwhile inherits that Ctrl-C waits
                executor = get_memmapping_executor(
                    count, initializer=begin_child, initargs=(_life()[0],), env=ONE_THREAD
                )
                waiting = {executor.submit(some, origin, batch) for batch in islice(source, ahead)}
            while waiting:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    yield batches.taken(future.result())
                with undisturbed():  # what is submitted is known here
                    waiting |= {executor.submit(some, origin, batch) for batch in islice(source, ahead - len(waiting))}
        except BrokenProcessPool:
            _stop(executor, waiting)
            raise NoWorkers("--jobs", "a process was killed, perhaps as memory ran out: needed fewer jobs") from None
        except BaseException:
            _stop(executor, waiting)
            raise

    return work


def _start_trackers() -> None:
    """Start the processes that clean up after the others: a starting one lets held-back signals through."""
    from multiprocessing import resource_tracker as of_python

    from joblib.externals.loky.backend import resource_tracker as of_joblib

    for tracker in (of_joblib, of_python):
        tracker.ensure_running()


def _stop(executor: Any, waiting: Collection[Future[Handed]]) -> None:
    """End the processes at once: their results are not wanted any more.

    The executor's thread looks up every batch that it was given, also one that it dropped when it had to end, and then
    shows a traceback.  So it must end only once it has put all of them into its queue, which holds `AHEAD` for each
    process.
    """
    if executor is None:
        return
    with undisturbed():
        latest = time.monotonic() + LATEST
        while not all(future.running() or future.done() for future in waiting) and time.monotonic() < latest:
            time.sleep(0.001)
        executor.terminate(kill_workers=True)


class Batches:
    """Neighbouring rows on one mesh, as many at once as take a moment for one of the workers."""

    def __init__(self, wanted: Sequence[tuple[int, Row]], workers: int) -> None:
        self._wanted = wanted
        self._most = max(1, min(MOST_AT_ONCE, len(wanted) // (4 * workers)))
        self._at_once = 1
        self._rows, self._seconds = 0.0, 0.0

    def __iter__(self) -> Iterator[Sequence[tuple[int, Row]]]:
        first, wanted = 0, self._wanted
        while first < len(wanted):
            mesh, last = wanted[first][1].get("refine"), first + 1
            while last < min(first + self._at_once, len(wanted)) and wanted[last][1].get("refine") == mesh:
                last += 1
            yield wanted[first:last]
            first = last

    def taken(self, handed: Handed) -> Placed:
        """Return the rows that a worker hands over; their time decides the size of the next batches.

        Raises
        ------
        NoWorkers
            The worker has another version of this library, or cannot read a mesh file.
        """
        if handed.version != __version__:
            raise NoWorkers("worker", f"it has version {handed.version} of ndtheory: needed {__version__}, as here")
        if handed.unusable:
            raise NoWorkers("worker", f"it cannot read {handed.unusable}")
        # the last batches count most: another mesh takes another time
        self._rows, self._seconds = self._rows / 2 + len(handed.rows), self._seconds / 2 + handed.seconds
        self._at_once = max(1, min(self._most, int(SECONDS * self._rows / max(self._seconds, 1e-9))))
        return handed.rows

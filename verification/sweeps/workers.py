"""Who makes the rows of a sweep: this process, several ones on this machine, or the workers of a cluster."""

from __future__ import annotations

import os
import signal
import threading
import time
import uuid
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from ndtheory import __version__
from verification.interface.pair import ContactPair
from verification.interrupts import undisturbed
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.bodies import Bodies
from verification.sweeps.row import Row, row

#: Rows by their places in the grid.
Placed = list[tuple[int, Row]]

#: From a problem or a pair and the values of rows by their places to the rows, some at a time and in any order.
Work = Callable[[Problem | ContactPair, Sequence[tuple[int, Row]]], Generator[Placed, None, None]]

#: Rows that a worker takes at once, at most, and the seconds they should take: a process that is killed loses no more
#: than what its workers have not handed over.
MOST_AT_ONCE, SECONDS = 32, 0.25


class Stopped(ProblemError):
    """No worker is left that could make the rows.

    Parameters
    ----------
    where : str
    why : str
        What happened.
    """

    def __init__(self, where: str, why: str) -> None:
        super().__init__(where, "", None, f"{why}; with a store the same command goes on from the rows that were done")


def work_of(jobs: int, dask: str | None = None) -> Work:
    """Who makes rows: the workers of a dask scheduler, this process for one job, else processes of this machine."""
    if dask is not None:
        from verification.sweeps.cluster import on_cluster  # it sends what stands here

        return on_cluster(dask)
    return alone if jobs == 1 else together(jobs)


def alone(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
    """In this process, one after the other."""
    if why := unusable(start):
        raise ProblemError(start.source, "mesh", None, why)
    bodies = Bodies(start)
    for index, values in wanted:
        yield [(index, row(start, values, bodies))]


@dataclass(frozen=True, kw_only=True)
class Origin:
    """What a sweep varies, known to a worker by the name of the sweep."""

    name: str
    start: Any = field(compare=False)

    @classmethod
    def of(cls, start: Problem | ContactPair) -> Origin:
        """That of a new sweep."""
        return cls(name=uuid.uuid4().hex, start=start)


@dataclass(frozen=True, kw_only=True)
class Handed:
    """What a worker hands over.

    Attributes
    ----------
    rows : list
    seconds : float
        How long they took.
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
def _bodies(origin: Origin) -> Bodies:
    """What the rows of a worker share."""
    return Bodies(origin.start)


def unusable(start: Problem | ContactPair) -> str:
    """Why a mesh file of a problem cannot be used here, which is no property of its rows; empty where all can."""
    bodies = (start.body1, start.body2) if isinstance(start, Problem) else ()
    return "; ".join(f"{body.mesh.path}: {why}" for body in bodies if body.mesh and (why := body.mesh.unusable()))


@lru_cache(maxsize=1)
def _unusable(origin: Origin) -> str:
    return unusable(origin.start)


def some(origin: Origin, piece: Sequence[tuple[int, Row]]) -> Handed:
    """Rows in a worker."""
    with _one_at_a_time:
        begun = time.monotonic()
        if why := _unusable(origin):
            return Handed(rows=[], unusable=why)
        bodies = _bodies(origin)
        rows = [(index, row(origin.start, values, bodies)) for index, values in piece]
        return Handed(rows=rows, seconds=time.monotonic() - begun)


def _begun() -> int:
    """The first task of a process, which tells its number; it lasts until another process can take the next one."""
    time.sleep(0.01)
    return os.getpid()


def _quietly(origin: Origin, piece: Sequence[tuple[int, Row]]) -> Handed:
    """Rows in a process of this machine, which leaves Ctrl-C to its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return some(origin, piece)


def together(jobs: int) -> Work:
    """In processes of this machine, by joblib; 0 or less counts back from all cores."""

    def work(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
        from multiprocessing import resource_tracker as of_python

        from joblib import Parallel, delayed, effective_n_jobs, parallel_config
        from joblib.externals.loky.backend import resource_tracker as of_joblib
        from joblib.externals.loky.process_executor import BrokenProcessPool

        if not wanted:
            return
        origin, pieces = Origin.of(start), Pieces(wanted, effective_n_jobs(jobs))
        for tracker in (of_joblib, of_python):  # where one starts, it lets signals through that are held back
            tracker.ensure_running()
        with parallel_config(backend="loky", inner_max_num_threads=1):
            with undisturbed():
                # Ctrl-C on a terminal reaches all processes: those that start here do not see it, and are all up
                # before one may be ended, for one that starts when its parent ends says so at length
                count, up = effective_n_jobs(jobs), set[int]()
                while len(up) < count:
                    up.update(Parallel(n_jobs=jobs, batch_size=1)(delayed(_begun)() for _ in range(count)))
            try:
                found = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)(
                    delayed(_quietly)(origin, piece) for piece in pieces
                )
                for handed in found:
                    yield pieces.taken(handed)
            except BrokenProcessPool:
                _stop()
                raise Stopped("--jobs", "a process was killed, perhaps as memory ran out: needed fewer jobs") from None
            except BaseException:
                _stop()
                raise

    return work


def _stop() -> None:
    """End the workers at once: what they compute is not wanted any more."""
    from joblib.externals.loky import get_reusable_executor

    with undisturbed():
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


class Pieces:
    """Rows that stand together and have one mesh, as many at once as take a moment.

    Parameters
    ----------
    wanted : sequence
        Values of rows by their places.
    workers : int
    """

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
        """The rows that a worker hands over, whose time says how many the next pieces have.

        Raises
        ------
        Stopped
            The worker has another version of this library, or cannot read a mesh file.
        """
        if handed.version != __version__:
            raise Stopped("worker", f"it has version {handed.version} of ndtheory: needed {__version__}, as here")
        if handed.unusable:
            raise Stopped("worker", f"it cannot read {handed.unusable}")
        # the last pieces count most: another mesh takes another time
        self._rows, self._seconds = self._rows / 2 + len(handed.rows), self._seconds / 2 + handed.seconds
        self._at_once = max(1, min(self._most, int(SECONDS * self._rows / max(self._seconds, 1e-9))))
        return handed.rows

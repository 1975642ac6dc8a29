"""Workers that make the rows of a sweep: this process, several on this machine, or workers of dask."""

from __future__ import annotations

import contextlib
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice
from multiprocessing import Pipe
from typing import Any

from fem1d2d import mesh_files
from ndtheory import __version__
from verification.extras import require
from verification.interface.pair import ContactPair
from verification.machine.interrupts import CAN_WAIT, begin_child, undisturbed
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.row import Row, SharedBodies, lost, row

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

#: Seconds to wait for a scheduler.
PATIENCE = 10

#: The environment in which the libraries that multiply matrices use one thread in each process.
ONE_THREAD = dict.fromkeys(mesh_files.ONE_THREAD, "1")


class NoWorkers(ProblemError):
    """No worker is left that could make the rows."""

    def __init__(self, where: str, why: str) -> None:
        super().__init__(where, "", None, f"{why}; with a store the same command goes on from the rows that were done")


def work_of(jobs: int, dask: str | None = None) -> Work:
    """Choose who makes rows: the workers of a dask scheduler, this process for one job, else processes here."""
    return on_cluster(dask) if dask is not None else alone if jobs == 1 else together(jobs)


def alone(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
    """Make the rows in this process, one after the other."""
    if why := unusable(start):
        raise ProblemError(start.source, "mesh", None, why)
    bodies = SharedBodies(start)
    for index, values in wanted:
        yield [(index, row(start, values, bodies))]


@dataclass(frozen=True, kw_only=True)
class Origin:
    """The problem or pair of a sweep, under a name by which a worker recognises it, and the version of this library."""

    start: Problem | ContactPair = field(compare=False)
    name: str = field(default_factory=lambda: uuid.uuid4().hex)
    version: str = __version__


#: What a worker hands over: its rows and the seconds they took, or why it can make none of this problem.
Handed = tuple[Placed, float] | str

#: Rows share condensed bodies and the setting of BLAS: a process makes one at a time, whatever threads it has.
_one_at_a_time = threading.Lock()


@lru_cache(maxsize=1)
def _begun(origin: Origin) -> SharedBodies | str:
    """Return the shared bodies of the rows of a worker, or why it can make none."""
    if origin.version != __version__:
        return f"it has version {__version__} of ndtheory: needed {origin.version}, as here"
    why = unusable(origin.start)
    return f"it cannot read {why}" if why else SharedBodies(origin.start)


def unusable(start: Problem | ContactPair) -> str:
    """Return why a mesh file of a problem cannot be used here, whatever the row; empty where all can."""
    bodies = start.bodies.values() if isinstance(start, Problem) else ()
    return "; ".join(f"{body.mesh.path}: {why}" for body in bodies if body.mesh and (why := body.mesh.unusable()))


def some(origin: Origin, batch: Sequence[tuple[int, Row]]) -> Handed:
    """Make some rows in a worker."""
    with _one_at_a_time:
        begun, bodies = time.monotonic(), _begun(origin)
        if isinstance(bodies, str):
            return bodies
        return [(index, row(origin.start, values, bodies)) for index, values in batch], time.monotonic() - begun


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
        if isinstance(handed, str):
            raise NoWorkers("worker", handed)
        rows, seconds = handed
        # the last batches count most: another mesh takes another time
        self._rows, self._seconds = self._rows / 2 + len(rows), self._seconds / 2 + seconds
        self._at_once = max(1, min(self._most, int(SECONDS * self._rows / max(self._seconds, 1e-9))))
        return rows


# --- processes of this machine ----------------------------------------------------------------------------------------


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
        origin, batches = Origin(start=start), Batches(wanted, count)
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


def _stop(executor: Any, waiting: set[Future[Handed]]) -> None:
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


# --- dask -------------------------------------------------------------------------------------------------------------


def on_cluster(address: str) -> Work:
    """Return workers of the dask scheduler at an address.

    A worker condenses the bodies of a mesh once.  The batches of a worker that dies go to another one.  The scheduler
    gives up a batch that was on four workers when they died, even if it only waited there behind another one.  The
    rows of such batches are tried again one at a time, once nothing else runs; one that is given up then says so.

    Raises
    ------
    ProblemError
        No dask here, or no scheduler there.
    """
    require("--dask")

    def work(start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]]) -> Generator[Placed, None, None]:
        from distributed import Client

        if not wanted:
            return
        _ask(address)
        with undisturbed():
            client = Client(address, timeout=PATIENCE, set_as_default=False)
        try:
            yield from _rows(client, start, wanted, address)
        finally:
            with undisturbed(), contextlib.suppress(Exception):  # the scheduler may have gone
                client.close(timeout=2)

    return work


def _ask(address: str) -> None:
    """Raise ProblemError if no scheduler answers: a client that finds none prints many lines."""
    import asyncio

    from distributed.comm.core import connect

    async def knock() -> None:
        comm = await connect(address, timeout=PATIENCE)
        await comm.close()

    def ask() -> None:
        try:
            asyncio.run(knock())
        except Exception as error:  # of the address, of the network or of TLS: each has its own
            wrong.append(error)

    wrong: list[Exception] = []
    asking = threading.Thread(target=ask, daemon=True)  # a notebook has a loop in its own thread already
    asking.start()
    asking.join()
    if wrong:
        needed = "needed the address of a dask scheduler that answers, such as tcp://host:8786"
        raise ProblemError("--dask", "address", address, f"{needed} ({wrong[0]})")


def _rows(
    client: Any, start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]], address: str
) -> Generator[Placed, None, None]:
    from distributed import KilledWorker, as_completed
    from distributed.comm.core import CommClosedError

    threads = max(1, sum(client.ncores().values()))
    batches = Batches(wanted, threads)
    source = iter(batches)
    # a future, so that a pair of large matrices goes to each worker once, and is made again where a worker dies
    origin = client.submit(_same, Origin(start=start), pure=False)
    sent: dict[str, Sequence[tuple[int, Row]]] = {}
    crowded: set[str] = set()  # of what is sent, all that was not alone all the time
    suspects: deque[tuple[int, Row]] = deque()

    def submit(batch: Sequence[tuple[int, Row]]) -> Any:
        future = client.submit(some, origin, batch, pure=False)
        if sent:
            crowded.update((*sent, future.key))
        sent[future.key] = batch
        return future

    try:
        coming = as_completed((submit(batch) for batch in islice(source, AHEAD * threads)), loop=client.loop)
        for future in coming:
            batch, lone = sent.pop(future.key), future.key not in crowded
            crowded.discard(future.key)
            if future.status not in ("finished", "error"):
                raise NoWorkers(address, "the scheduler has gone")
            error = future.exception()
            if isinstance(error, KilledWorker) and not (lone and len(batch) == 1):
                suspects.extend(batch)
            elif isinstance(error, KilledWorker):
                index, values = batch[0]
                yield [(index, lost(start, values, "the workers that ran it were killed, perhaps as memory ran out"))]
            elif error is not None:
                raise NoWorkers(address, f"a worker cannot make rows: {type(error).__name__}: {error}")
            else:
                yield batches.taken(future.result())
            for batch in islice(source, 1):
                coming.add(submit(batch))
            if suspects and not sent:
                coming.add(submit([suspects.popleft()]))
    except (CommClosedError, TimeoutError) as error:
        raise NoWorkers(address, f"the scheduler has gone ({error})") from None


def _same(origin: Origin) -> Origin:
    return origin

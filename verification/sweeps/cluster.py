"""The rows of a sweep on the workers of a dask scheduler."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections import deque
from collections.abc import Generator, Sequence
from itertools import islice
from typing import Any

from verification.extras import require
from verification.interface.pair import ContactPair
from verification.machine.interrupts import undisturbed
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.row import Row, lost
from verification.sweeps.workers import AHEAD, Batches, NoWorkers, Origin, Placed, Work, some

#: Seconds to wait for a scheduler.
PATIENCE = 10


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
        with contextlib.ExitStack() as stack:
            with undisturbed():
                client = Client(address, timeout=PATIENCE, set_as_default=False)
            stack.callback(_close, client)
            yield from _rows(client, start, wanted, address)

    return work


def _ask(address: str) -> None:
    """Raise ProblemError if no scheduler answers: a client that finds none prints many lines."""
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
        needed = "needed the address of a dask scheduler that answers, as tcp://host:8786"
        raise ProblemError("--dask", "address", address, f"{needed} ({wrong[0]})")


def _close(client: Any) -> None:
    with undisturbed(), contextlib.suppress(Exception):  # the scheduler may have gone
        client.close(timeout=2)


def _rows(
    client: Any, start: Problem | ContactPair, wanted: Sequence[tuple[int, Row]], address: str
) -> Generator[Placed, None, None]:
    from distributed import KilledWorker, as_completed
    from distributed.comm.core import CommClosedError

    threads = max(1, sum(client.ncores().values()))
    batches = Batches(wanted, threads)
    source = iter(batches)
    # a future, so that a pair of large matrices goes to each worker once, and is made again where a worker dies
    origin = client.submit(_same, Origin.of(start), pure=False)
    sent: dict[str, Sequence[tuple[int, Row]]] = {}
    together: set[str] = set()  # of what is sent, all that was not alone all the time
    suspects: deque[tuple[int, Row]] = deque()

    def submit(batch: Sequence[tuple[int, Row]]) -> Any:
        future = client.submit(some, origin, batch, pure=False)
        if sent:
            together.update((*sent, future.key))
        sent[future.key] = batch
        return future

    try:
        coming = as_completed((submit(batch) for batch in islice(source, AHEAD * threads)), loop=client.loop)
        for future in coming:
            batch, alone = sent.pop(future.key), future.key not in together
            together.discard(future.key)
            if future.status not in ("finished", "error"):
                raise NoWorkers(address, "the scheduler has gone")
            error = future.exception()
            if isinstance(error, KilledWorker) and not (alone and len(batch) == 1):
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

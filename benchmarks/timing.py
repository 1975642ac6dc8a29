"""CPU time of two sides in turn, in one process, on one BLAS thread."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from typing import Any

from threadpoolctl import threadpool_limits

#: What both sides needed in one round; None where the other side is not measured.
Pair = tuple[float, float | None]


def clock() -> float:
    """CPU seconds of this process so far and of the processes it has started and waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of a call, on one BLAS thread, and what it returned."""
    with threadpool_limits(1, user_api="blas"):
        begin = clock()
        found = call()
        return clock() - begin, found


def in_turn(
    ours: Callable[[], object], other: Callable[[], object] | None, *, rounds: int, calls: int = 1, warm: bool = True
) -> list[Pair]:
    """CPU seconds of one call of each side, round by round.

    Parameters
    ----------
    ours, other : callable
        The two sides; None leaves out the other.
    rounds : int
    calls : int
        So many calls in a row are timed as one, for calls that are shorter than the clock is fine.
    warm : bool
        Whether a first round, which pays for imports and caches, goes untimed.
    """

    def several(call: Callable[[], object]) -> None:
        for _ in range(calls):
            call()

    def one(call: Callable[[], object] | None) -> float | None:
        return None if call is None else timed(lambda: several(call))[0] / calls

    pairs = [(one(ours), one(other)) for _ in range(rounds + warm)]
    return pairs[warm:]


def peak() -> float:
    """The largest memory of this process so far, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)

"""One BLAS thread: interface matrices are small, and digits repeat however many cores there are."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

#: Guards the two below.  The thread that holds it may take it again, as the handler of a signal does.
_lock = threading.RLock()

#: One entry for each caller inside :func:`one_thread`.
_inside: set[object] = set()

#: The numbers of threads that the last one to leave sets again, by library.
_before: dict[Any, int] = {}


@cache
def libraries() -> tuple[list[Any], list[Any]]:
    """Return the BLAS libraries with one number of threads for the process, and those with one a Python thread."""
    from threadpoolctl import ThreadpoolController  # the calculator starts without it

    found = ThreadpoolController().select(user_api="blas").lib_controllers
    apart = [library for library in found if getattr(library, "threading_layer", "") == "openmp"]
    return [library for library in found if library not in apart], apart


def _set(numbers: Sequence[tuple[Any, int]]) -> None:
    """Set numbers of threads from any thread.

    Newer versions of threadpoolctl obey the first thread that sets a number, and ignore all others while it lives.
    """
    owned = {type(library) for library, _ in numbers if hasattr(library, "clear_controlling_thread")}
    for kind in owned:
        kind.clear_controlling_thread(force=True)
    for library, threads in numbers:
        library.set_num_threads(threads)
    for kind in owned:
        kind.clear_controlling_thread(force=True)


@contextmanager
def one_thread() -> Iterator[None]:
    """Return a context in which BLAS uses one thread; the former numbers return after it.

    Most libraries have one number of threads for the whole process: it stays 1 until the last of all threads that are
    in such a context has left.  A number that other code sets meanwhile counts until the next such context is entered,
    and is the one that returns.  Libraries that are loaded after the first such context are not limited.

    On matrices of a few hundred rows a second BLAS thread costs more than it gains, ten times more on a busy machine.
    """
    shared, apart = libraries()
    token = object()
    own = [(library, threads) for library in apart if (threads := library.num_threads) != 1]
    try:
        _set([(library, 1) for library, _ in own])
        with _lock:
            _inside.add(token)
            several = {library: threads for library in shared if (threads := library.num_threads) != 1}
            _before.update(several)  # others may have set a number while a context is open
            _set([(library, 1) for library in several])
        yield
    finally:
        with _lock:
            _inside.discard(token)
            if not _inside:
                _set(list(_before.items()))
                _before.clear()
        _set(own)

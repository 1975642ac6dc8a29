"""One BLAS thread: interface matrices are small, and digits repeat however many cores there are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any


@cache
def _libraries() -> list[Any]:
    from threadpoolctl import ThreadpoolController  # the calculator starts without it

    return list(ThreadpoolController().select(user_api="blas").lib_controllers)


@contextmanager
def one_thread() -> Iterator[None]:
    """A context in which BLAS uses one thread; what was set before returns after it.

    On matrices of a few hundred rows a second thread costs more than it gives, ten times more on a busy machine.
    """
    several = [(library, threads) for library in _libraries() if (threads := library.num_threads) != 1]
    try:
        for library, _ in several:
            library.set_num_threads(1)
        yield
    finally:
        for library, threads in several:
            library.set_num_threads(threads)

"""One BLAS thread: interface matrices are small, and digits repeat however many cores there are."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any


@cache
def _controller() -> Any:
    from threadpoolctl import ThreadpoolController  # the calculator starts without it

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[Any]:
    """A context in which BLAS uses one thread; what was set before returns after it.

    On matrices of a few hundred rows a second thread costs more than it gives, ten times more on a busy machine.
    """
    context: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return context

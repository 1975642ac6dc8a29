"""Ctrl-C while something runs that must not see it."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator

#: Why something is missing that was not worked out after Ctrl-C.
INTERRUPTED = "interrupted before it was worked out"


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """A context in which Ctrl-C waits: it is raised at the end.

    A signal that is blocked reaches no handler, Python's or another one.  No other thread may take it instead: the
    command keeps BLAS from starting any.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

"""Ctrl-C that waits while it would do harm, and processes that end with the one that started them."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from multiprocessing.connection import Connection

#: The reason for a part that is missing after Ctrl-C.
INTERRUPTED = "interrupted before it was worked out"


#: True if a signal can be held back; not on Windows.
CAN_WAIT = hasattr(signal, "pthread_sigmask")


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """Return a context in which Ctrl-C waits: it is raised at the end.

    A signal that is blocked reaches no handler, Python's or another one.  No other thread may take it instead: the
    command keeps BLAS from starting any.
    """
    if not CAN_WAIT:
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def begin_child(life: Connection) -> None:
    """Begin a process that works for another one: it leaves Ctrl-C to its parent, and ends when that does.

    ``life`` is the reading end of a pipe on which nothing is sent.  Only the parent has the other end, which is closed
    however the parent ends, by SIGKILL too.  The module imports no arrays: the parent may end while they are imported.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def end_with_parent() -> None:
        with contextlib.suppress(EOFError, OSError):
            life.recv_bytes()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()

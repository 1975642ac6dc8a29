"""Ctrl-C that waits while it would do harm, and processes that end with the one that started them."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # each command starts with this module
    from multiprocessing.connection import Connection

#: The reason for a part that is missing after Ctrl-C.
INTERRUPTED = "interrupted before it was worked out"

#: Seconds without an answer after which a second Ctrl-C is one: some programs that start others pass each one on twice.
UNANSWERED = 0.3

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


@contextlib.contextmanager
def cleaned_up() -> Iterator[None]:
    """Return a context that SIGTERM or SIGHUP ends by an exception, as for its cleaning up, and then the process.

    Elsewhere than in the main thread, or where a program has its own handler, they keep what they do.
    """
    names = ("SIGTERM", "SIGHUP")  # Windows lacks the second one
    ends = [number for name in names if (number := getattr(signal, name, None)) is not None]
    ours = threading.current_thread() is threading.main_thread()
    ends = [number for number in ends if ours and signal.getsignal(number) is signal.SIG_DFL]
    ended_by: list[int] = []

    def leave(number: int, frame: FrameType | None) -> None:
        ended_by.append(number)
        raise _Ended

    for number in ends:
        signal.signal(number, leave)
    try:
        yield
    finally:
        for number in ends:
            signal.signal(number, signal.SIG_DFL)
        for number in ended_by:
            signal.raise_signal(number)


class _Ended(BaseException):
    """SIGTERM or SIGHUP."""


@contextlib.contextmanager
def term_interrupts() -> Iterator[None]:
    """Return a context in which SIGTERM is Ctrl-C, as batch systems send it before the time of a job is over.

    Only in the main thread, and where a program has no handler.
    """
    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL

    def leave(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    if ours:
        signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextlib.contextmanager
def in_time(seconds: float) -> Iterator[None]:
    """Return a context that a TimeoutError ends after so many seconds of processor time.

    Only in the main thread, and not on Windows.  Code of C must look for signals, as the module ``re`` does.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


@contextlib.contextmanager
def second_ends(end: Callable[[], None]) -> Iterator[Callable[[], object]]:
    """Return a context in which ``end`` is called at once by a second Ctrl-C, if nothing has answered the first.

    Python calls no handler while a library computes.  But it notes each signal in a pipe at once, and a thread reads
    that pipe wherever the library lets other threads run, as SuperLU and Clarabel do.

    Yields
    ------
    answered
        To be called by the handler of Ctrl-C.
    """
    if not CAN_WAIT:
        yield lambda: None
        return
    reader, writer = os.pipe()
    os.set_blocking(writer, False)

    def watch() -> None:
        asked: float | None = None
        while noted := os.read(reader, 1):
            if noted == b"\0":
                asked = None
            elif noted[0] == signal.SIGINT:
                asked = asked or time.monotonic()
                if time.monotonic() - asked > UNANSWERED:
                    end()
        os.close(reader)

    with undisturbed():  # the thread itself takes no signal from the main one
        threading.Thread(target=watch, daemon=True).start()
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    try:
        yield lambda: os.write(writer, b"\0")
    finally:
        signal.set_wakeup_fd(before)
        os.close(writer)


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

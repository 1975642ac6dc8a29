"""The modules that have commands, and what every error becomes: one line and an exit status."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from types import FrameType

import click

import ndtheory
from ndtheory import HypothesisError
from ndtheory.texts import printable
from verification.cli import (  # noqa: F401  each adds its commands
    advising,
    calculator,
    certifying,
    documents,
    drafting,
    exploring,
    layers,
    ledger,
    marching,
    problems,
    sweeping,
)
from verification.cli.console import INTERRUPTED, Lost, begin, complain, gone, interruption, lost
from verification.cli.forms import cli
from verification.machine.interrupts import second_ends

#: Exit statuses of the interface beside that of Ctrl-C.  A crash is none of them.
DONE, BAD_INPUT, CRASH = 0, 2, 70

#: Done, but the reader of stdout left before the answer came: as the shell reports programs that SIGPIPE ends.
UNREAD = 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit status.

    2 bad input (one line), 1 a run that did not converge or a proved claim violated, 3 inconclusive, 130 Ctrl-C, and
    never 0 if stdout did not take the answer.
    Without arguments the process's are taken; Ctrl-C is then ignored once the command has ended.
    """
    ours = arguments is None
    try:
        if ours:
            # one thread, which blocks a signal for all: see `undisturbed`; matrices here are too small for more anyway
            os.environ |= {"OPENBLAS_NUM_THREADS": "1", "VECLIB_MAXIMUM_THREADS": "1"}
            begin()
        with _interrupts(last=ours) as seen:
            return _answered(_run(arguments, seen))
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED


@contextlib.contextmanager
def _interrupts(last: bool) -> Iterator[list[int]]:
    """Record each Ctrl-C, also one that a library swallows; with ``last`` none interrupts anything afterwards.

    With ``last`` a second Ctrl-C ends the process while a library keeps the first one waiting.
    """
    seen: list[int] = []
    first_thread = threading.current_thread() is threading.main_thread()
    if not first_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield seen
        return

    def note(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        answered()
        raise KeyboardInterrupt

    with second_ends(_end_at_once) if last else contextlib.nullcontext(lambda: None) as answered:
        try:
            signal.signal(signal.SIGINT, note)
            yield seen
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN if last else signal.default_int_handler)


def _end_at_once() -> None:
    """End the process though the main thread computes: nothing is kept that is not shown or stored yet."""
    with contextlib.suppress(OSError):  # no stream: the main thread may be writing to it
        os.write(2, b"interrupted twice: ended at once\n")
    os._exit(INTERRUPTED)


def _run(arguments: Sequence[str] | None, seen: Sequence[int]) -> int:
    """Run the command and turn every error into an exit status."""
    if foreign := ndtheory.foreign_verification():
        complain(foreign)
        return BAD_INPUT
    out = sys.stdout
    try:
        status = cli.main(
            args=None if arguments is None else list(arguments), prog_name="ndtheory", standalone_mode=False
        )
    except click.exceptions.NoArgsIsHelpError as error:
        for line in error.ctx.get_help().splitlines():
            complain(line)
        return BAD_INPUT
    except click.UsageError as error:
        from verification.problem.tables import short

        where, said = error.ctx.command_path if error.ctx else "ndtheory", error.format_message()
        if type(error) is click.BadParameter and error.param is not None:
            said = f"{error.param.opts[0]} = {error.message}"
        complain(f"{where}: {short(printable(' '.join(said.split())), 600)}")
        return BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        complain(interruption())
        return INTERRUPTED
    except Lost:
        return DONE
    except SystemExit as error:  # click exits for shells that complete, and where nobody reads the help
        if sys.stdout is not out:  # it has replaced a stream whose pipe broke
            return _answered(DONE, BrokenPipeError())
        return error.code if isinstance(error.code, int) else DONE
    except Exception as error:
        if seen:  # an import that is interrupted fails in any way
            complain(interruption())
            return INTERRUPTED
        return _explain(error)
    status = status if isinstance(status, int) else DONE
    if seen and status != INTERRUPTED:
        complain(interruption())
        return INTERRUPTED
    return status


def _answered(status: int, error: OSError | None = None) -> int:
    """The exit status of a command, which is never 0 if the answer could not be written."""
    error = lost(error)
    if error is None:
        return status
    if gone(error):
        return status or UNREAD
    complain(f"ndtheory: stdout: {error.strerror}")
    return status or BAD_INPUT


def _tracker() -> str:
    """The address at which faults are reported, where the metadata have one."""
    from importlib.metadata import PackageNotFoundError, metadata

    urls: dict[str, str] = {}
    with contextlib.suppress(PackageNotFoundError):  # not installed
        urls.update(line.partition(", ")[::2] for line in metadata("ndtheory").get_all("Project-URL") or [])
    return urls.get("Issues", "the issue tracker of the repository that this copy came from")


def _explain(error: Exception) -> int:
    """Bad input in one line; anything else is a bug and says so."""
    from fem1d2d import MeshError  # numpy: only now
    from verification.problem.tables import ProblemError

    if isinstance(error, OSError):
        complain(f"ndtheory: {error.filename or 'output'}: {error.strerror}")
    elif isinstance(error, MemoryError):
        complain("ndtheory: the problem does not fit into memory; needed fewer cells")
    elif isinstance(error, (ProblemError, HypothesisError, MeshError, click.ClickException)):
        complain(f"ndtheory: {error}")
    else:
        for line in "".join(traceback.format_exception(error)).splitlines():
            complain(line)
        complain(
            "ndtheory: this is a bug; please report it, with the lines above, the command and its files, at "
            + _tracker()
        )
        return CRASH
    return BAD_INPUT

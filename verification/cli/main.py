"""The command group, and what every error becomes: one line and an exit status."""

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
from verification.cli import (
    advising,
    calculator,
    certifying,
    documents,
    exploring,
    ledger,
    marching,
    problems,
    sweeping,
)
from verification.cli.console import (
    NOTHING,
    SHOWN,
    Interrupted,
    Lost,
    complain,
    gone,
    interruptible,
    interruption,
    lost,
    reported,
    steady,
)
from verification.cli.forms import AdviseGroup, Commands
from verification.machine.interrupts import second_ends

#: Exit statuses of the interface.  A crash is none of them.
DONE, BAD_INPUT, INTERRUPTED, CRASH = 0, 2, 130, 70

#: Done, but the reader of stdout left before the answer came: as the shell reports programs that SIGPIPE ends.
UNREAD = 141


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 80})
@click.version_option(ndtheory.__version__, prog_name="ndtheory", message="%(prog)s %(version)s")
def cli() -> None:
    """The convergence theorem of Bayada, Sabil and Sassi for Neumann-Dirichlet contact iterations.

    Bounds, measured constants, the iteration itself, and one verdict for each bound.

    \b
    ndtheory demo                     the Section 6 model, end to end
    ndtheory example section6 > my.toml
    ndtheory compare my.toml          the same for a problem of your own
    ndtheory advise my.toml           which body first, which theta
    ndtheory verify                   every statement of the paper, checked
    """


for command in (
    calculator.bounds,
    problems.example,
    problems.demo,
    problems.constants,
    problems.run,
    problems.solve,
    marching.march,
    problems.compare,
    exploring.explore,
    advising.advise,
    sweeping.region,
    sweeping.sweep,
    certifying.certify,
    ledger.reproduce,
    ledger.verify,
    documents.schema,
):
    for form in command.forms().values() if isinstance(command, AdviseGroup) else [command]:
        assert form.callback is not None
        form.callback = interruptible(reported(form.callback))
    cli.add_command(command)


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
        with steady(last=ours), _interrupts(last=ours) as seen:
            return _answered(_run(arguments, seen))
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED


@contextlib.contextmanager
def _interrupts(last: bool) -> Iterator[list[int]]:
    """Record each Ctrl-C, also one that a library swallows; with ``last`` none interrupts anything afterwards.

    With ``last`` a second Ctrl-C ends the process while a library keeps the first one waiting.

    Python drops what is raised in a finaliser: an alarm raises such a Ctrl-C again.  An extension module that is
    interrupted while it is imported raises an ImportError, or drops it: an alarm looks again until the import is over.
    """
    seen: list[int] = []
    first_thread = threading.current_thread() is threading.main_thread()
    if not first_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield seen
        return

    def note(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        answered()
        if alarm and _importing(frame):
            signal.setitimer(signal.ITIMER_REAL, 0.01)
        else:
            raise KeyboardInterrupt

    def again(dropped: sys.UnraisableHookArgs) -> None:
        if issubclass(dropped.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, 0.01)  # the finaliser has ended by then
        else:
            hook(dropped)

    alarm = hasattr(signal, "setitimer")  # not on Windows
    hook = sys.unraisablehook
    with second_ends(_end_at_once) if last else contextlib.nullcontext(lambda: None) as answered:
        try:
            signal.signal(signal.SIGINT, note)
            if alarm:
                before = signal.signal(signal.SIGALRM, note)
                sys.unraisablehook = again
            yield seen
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN if last else signal.default_int_handler)
            sys.unraisablehook = hook
            if alarm:
                signal.setitimer(signal.ITIMER_REAL, 0)
                signal.signal(signal.SIGALRM, before)


def _end_at_once() -> None:
    """End the process though the main thread computes: nothing is kept that is not shown or stored yet."""
    with contextlib.suppress(OSError):  # no stream: the main thread may be writing to it
        os.write(2, b"interrupted twice: ended at once\n")
    os._exit(INTERRUPTED)


def _importing(frame: FrameType | None) -> bool:
    """True if a module is being imported on this stack."""
    while frame is not None and frame.f_code.co_filename != "<frozen importlib._bootstrap>":
        frame = frame.f_back
    return frame is not None


def _run(arguments: Sequence[str] | None, seen: Sequence[int]) -> int:
    """Run the command and turn every error into an exit status."""
    if foreign := ndtheory.foreign_verification():
        complain(foreign)
        return BAD_INPUT
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

        where = error.ctx.command_path if error.ctx else "ndtheory"
        complain(f"{where}: {short(printable(' '.join(error.format_message().split())), 600)}")
        return BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        complain(NOTHING)
        return INTERRUPTED
    except Interrupted:
        return INTERRUPTED
    except Lost:
        return DONE
    except SystemExit as error:  # click exits for shells that complete, and where any pipe breaks: not stdout's
        if isinstance(error.__context__, OSError):
            return _explain(error.__context__)
        return error.code if isinstance(error.code, int) else DONE
    except Exception as error:
        if seen:
            complain(interruption())
            return INTERRUPTED
        return _explain(error)
    status = status if isinstance(status, int) else DONE
    if seen and status != INTERRUPTED:
        complain(SHOWN)
        return INTERRUPTED
    return status


def _answered(status: int) -> int:
    """The exit status of a command, which is never 0 if the answer could not be written."""
    error = lost()
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
    from verification.problem.tables import ProblemError

    if isinstance(error, (ProblemError, HypothesisError, click.ClickException)):
        complain(f"ndtheory: {error}")
        return BAD_INPUT
    if isinstance(error, OSError):
        complain(f"ndtheory: {error.filename or 'output'}: {error.strerror}")
        return BAD_INPUT
    if isinstance(error, MemoryError):
        complain("ndtheory: the problem does not fit into memory; needed fewer cells")
        return BAD_INPUT
    from fem1d2d import MeshError  # numpy: only now

    if isinstance(error, MeshError):
        complain(f"ndtheory: {error}")
        return BAD_INPUT
    for line in traceback.format_exc().splitlines():
        complain(line)
    complain(
        f"ndtheory: this is a bug; please report it, with the lines above, the command and its files, at {_tracker()}"
    )
    return CRASH

"""One console for all output and progress: results to stdout, everything else to stderr; commands without a result."""

from __future__ import annotations

import contextlib
import errno
import functools
import io
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TextIO, TypeVar

import click

from ndtheory.keys import key
from ndtheory.texts import printable
from verification.document import Document
from verification.machine.interrupts import undisturbed
from verification.machine.progress import Progress, silent
from verification.show.layout import Typing, folded, lines, nothing_typed
from verification.show.parts import Sections

if TYPE_CHECKING:
    from pathlib import Path

    from rich.progress import Progress as Live

    from verification.algorithm.iterate import Iterate
    from verification.problem.specification import Problem

D = TypeVar("D", bound=Document)


#: The exit status after Ctrl-C.
INTERRUPTED = 130


class Lost(Exception):
    """The rest of a result is not worth computing: nobody can read it."""


def gone(error: OSError) -> bool:
    """Return True if an error says that nobody reads stdout: writing to a closed pipe is another error on Windows."""
    no_pipe = os.name == "nt" and (error.errno, error.filename) == (errno.EINVAL, None)
    return no_pipe or isinstance(error, BrokenPipeError)


@dataclass(kw_only=True)
class _Stdout:
    """The stream of results while others write to stderr, what became of it, and the live line that makes room."""

    stream: TextIO | None = None
    error: OSError | None = None
    kept: bool = False
    said: bool = False
    live: Live | None = None


_stdout = _Stdout()


def begin() -> None:
    """Make the streams of this process safe to write to: closed ones lead to the null device, and keep their numbers
    from files.

    Characters beyond the encoding are written as escapes.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
        elif stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
            if name == "stdout":
                _stdout.error = OSError(errno.EBADF, os.strerror(errno.EBADF))


def spend(stream: TextIO) -> OSError | None:
    """Write out what a stream holds; where it cannot be written, it is dropped, and the error is returned.

    Python would write it again when it ends, fail, and return another status.
    """
    try:
        stream.flush()
    except OSError as error:
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            stream.flush()
        return error
    return None


def lost(error: OSError | None = None) -> OSError | None:
    """The error by which a part of the result was lost; None if there was none, or nobody reads what files have."""
    spend(sys.stderr)
    _stdout.error = spend(sys.stdout) or _stdout.error or error
    error, _stdout.error = _stdout.error, None
    unread = error is not None and (gone(error) or error.errno == errno.EBADF)  # closed
    return None if _stdout.kept and unread else error


def say(text: str, *, bold: bool = False) -> None:
    """Print lines of the result, control characters as escapes."""
    text = "\n".join(map(printable, text.split("\n")))
    _stdout.said = True
    stream = _stdout.stream or sys.stdout
    try:
        click.echo(click.style(text, bold=True) if bold else text, file=stream)
    except OSError as error:
        _stdout.error = _stdout.error or error
        spend(stream)


def show(sections: Sections, typing: Typing = nothing_typed, after: str = "") -> None:
    """Print sections after the one with that id."""
    for line, title in lines(sections, "terminal", typing=typing, after=after):
        say(line, bold=title)


def one_by_one(*, needed: bool = False) -> Callable[[Sections], None]:
    """A function that shows sections as soon as they are known, those of one id as one; ``needed`` as in ``part``."""
    last = ""

    def tell(sections: Sections) -> None:
        nonlocal last
        with part(needed=needed):
            show(sections, after=last)
        last = sections[-1].id

    return tell


@contextlib.contextmanager
def part(*, needed: bool = False) -> Iterator[None]:
    """Show a part of a result without interruption, while the rest is still being computed.

    If it cannot be written, Lost is raised, unless the rest is ``needed``, as for files or the exit status.
    """
    with undisturbed():
        if _stdout.live is not None:
            _stdout.live.stop()
        yield
        if _stdout.error is not None and not needed:
            raise Lost
        if _stdout.live is not None:
            _stdout.live.start()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Let only results reach stdout: what else is written there goes to stderr."""
    _stdout.stream, _stdout.said, _stdout.kept = sys.stdout, False, False
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        _stdout.stream = None


def interruption() -> str:
    """The message on a Ctrl-C that ended the command, before or after part of its result was shown."""
    said = "what was computed is shown above"
    return f"interrupted; {said}" if _stdout.said else "interrupted before anything was computed"


def complain(text: str) -> None:
    """Print an error, a warning or a note to stderr, control characters as escapes."""
    try:
        click.echo(printable(text), err=True)
    except OSError:
        spend(sys.stderr)


def warn(warnings: Sequence[str], lead: str = "warning: ", *, wide: bool = False) -> None:
    """Report sentences, each on one line where it is ``wide``, or folded to the width of a screen."""
    for words in (lead + warning for warning in warnings):
        for line in [words] if wide else folded(words, 0):
            complain(line)


def as_figure(found: Document, path: Path) -> None:
    """Write the main figure of a result."""
    from verification.figures import save

    save(found.plot(), path)


def deliver(
    document: D,
    sections: Callable[[D], Sections],
    as_json: bool,
    write: Callable[[D], None] | None = None,
    folder: Path | None = None,
    *,
    typing: Typing = nothing_typed,
    warnings: Sequence[str] = (),
    after: str = "",
) -> None:
    """Show a result and its warnings, then write its files: an error while writing loses no result.

    ``as_json`` shows the document instead of its sections.  ``write`` writes into ``folder``, if given; ``typing``
    completes the command to type next; ``after`` is as in ``lines``.
    """
    text = document.to_json() if as_json else ""
    with part(needed=True):
        if as_json:
            say(text)
        else:
            show(sections(document), typing, after)
    warn(warnings, wide=as_json)
    if write is None:
        return
    try:
        with stages() as tell:
            tell(f"drawing and writing {folder}", None)
            write(document)
        _stdout.kept = True
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted while {folder} was written; the result is shown above") from None
    if not as_json:
        complain(f"written: {folder}")


@contextlib.contextmanager
def stages() -> Iterator[Progress]:
    """A live line on a terminal's stderr: the current stage, its share that is done, the time."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Live

    columns = (TextColumn("{task.description}", markup=False), BarColumn(bar_width=20), TimeElapsedColumn())
    with contextlib.ExitStack() as stack:
        with undisturbed():  # its thread takes no signal from the main one
            live = stack.enter_context(Live(*columns, console=Console(stderr=True), transient=True))
        _stdout.live = live
        stack.callback(setattr, _stdout, "live", None)
        task = live.add_task("", total=None)

        def tell(what: str, share: float | None) -> None:
            total = None if share is None else 1.0
            what = printable(what)
            live.update(task, description=what, total=total, completed=share or 0.0, refresh=not share)  # at a start

        yield tell


@contextlib.contextmanager
def long_stages(log: Path | None = None) -> Iterator[Progress]:
    """The stages of a long command: a live line on a terminal, lines with the time in a log and on another stderr."""
    with contextlib.ExitStack() as stack:
        tellers = [stack.enter_context(stages())]
        if log is not None:
            stream = stack.enter_context(log.open("a", encoding="utf-8"))

            def write(line: str) -> None:
                with contextlib.suppress(OSError):  # a full disk: the rows matter more
                    stream.write(printable(line) + "\n")
                    stream.flush()

            tellers.append(every(IN_LOG, write, at_once=True))
        elif not sys.stderr.isatty():
            tellers.append(every(ON_STDERR, complain))

        def tell(what: str, share: float | None) -> None:
            for each in tellers:
                each(what, share)

        yield tell


def every(
    seconds: float, write: Callable[[str], None], *, at_once: bool = False, clock: Callable[[], float] = time.monotonic
) -> Progress:
    """Progress as lines, at most one in so many seconds; with ``at_once`` the first and the last one too."""
    last = clock() - seconds if at_once else clock()

    def tell(what: str, share: float | None) -> None:
        nonlocal last
        now = clock()
        if now - last >= seconds or (at_once and share == 1):
            last = now
            write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} {what}")

    return tell


@contextlib.contextmanager
def progress(tell: Progress, tolerance: float) -> Iterator[Callable[[Iterate], None]]:
    """Report how far the residual has fallen towards its tolerance."""

    def watch(iterate: Iterate) -> None:
        residual = iterate.relative_residual
        fallen = math.log(residual) / math.log(tolerance) if 0 < residual < 1 else 0.0
        tell(f"iterating: step {iterate.iteration}, residual {residual:.2e}", min(fallen, 1.0))

    yield watch


#: Seconds between two lines about progress, in a log and on an stderr that is not a terminal.
IN_LOG, ON_STDERR = 10, 60

#: The key of the problem in the context of a command.
PROBLEM = "ndtheory.problem"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Failure(Document):
    """The document of a command that ends without a result: a solver failed, or nothing was proved."""

    schema: ClassVar[str] = "ndtheory.failure/1"

    command: str = key("name of the command")
    outcome: str = key("`error`: a solver found no solution; `not proved`: contraction may hold or not")
    file: str | None = key(
        "the file that the command was given", null="where it was given none", why="the command was given none"
    )
    error: str = key("what happened")
    problem: Problem | None

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return {"length": "any", "stress": "any"} if self.problem is None else self.problem.units


def remember(problem: Problem) -> Problem:
    """Keep the problem of a command for the document of a failure."""
    context = click.get_current_context(silent=True)
    if context is not None:
        context.meta[PROBLEM] = problem
    return problem


def fail(error: Exception, outcome: str = "error", lead: str = "") -> int:
    """Report in one line, after ``lead``, why the current command has no result; its document with --json; return 1."""
    context = click.get_current_context()
    problem: Problem | None = context.meta.get(PROBLEM)
    given = context.params.get("file")
    file = None if given is None else str(given)
    complain(": ".join(part for part in ("ndtheory", file, lead, str(error)) if part))
    if context.params.get("as_json"):
        command = context.command_path.partition(" ")[2]
        found = Failure(command=command, outcome=outcome, file=file, error=str(error), problem=problem)
        say(found.to_json())
    return 1


def guarded(command: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a command: only its result reaches stdout; Ctrl-C is one line, and so is a solver that fails.

    An error of usage names the command.
    """

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> Any:
        with alone():
            try:
                return command(*args, **options)
            except KeyboardInterrupt as error:
                complain(str(error) or interruption())
                return INTERRUPTED
            except click.UsageError as error:
                error.ctx = error.ctx or click.get_current_context()
                raise
            except RuntimeError as error:
                from verification.algorithm.monolithic import SolveError
                from verification.contact import ContactError  # numpy: only now

                if not isinstance(error, (ContactError, SolveError)):
                    raise
                return fail(error)

    return run

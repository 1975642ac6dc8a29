"""One console for all output and progress: results to stdout, everything else to stderr; commands without a result."""

from __future__ import annotations

import contextlib
import errno
import functools
import io
import math
import os
import select
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, TextIO, TypeVar

import click

from ndtheory.keys import key
from ndtheory.texts import printable
from verification.document import Document
from verification.machine.interrupts import undisturbed
from verification.machine.progress import Progress, silent
from verification.show.layout import Typing, lines, nothing_typed
from verification.show.parts import Sections

if TYPE_CHECKING:
    from pathlib import Path

    from rich.progress import Progress as Live

    from verification.algorithm.iterate import Iterate
    from verification.problem.specification import Problem

D = TypeVar("D", bound=Document)


class Lost(Exception):
    """The rest of a result is not worth computing: nobody can read it."""


def gone(error: OSError) -> bool:
    """Return True if an error says that nobody reads stdout: writing to a closed pipe is another error on Windows."""
    no_pipe = os.name == "nt" and (error.errno, error.filename) == (errno.EINVAL, None)
    return no_pipe or isinstance(error, BrokenPipeError)


class Interrupted(Exception):
    """Ctrl-C, which a line on stderr has reported already."""


#: Messages of a command that Ctrl-C ended before and after part of its result was shown.
NOTHING, SHOWN = "interrupted before anything was computed", "interrupted; what was computed is shown above"


@dataclass(kw_only=True)
class _Stdout:
    """The stream of results, its state, and the live line that makes room for them."""

    stream: TextIO | None = None
    errors: list[OSError] = field(default_factory=list)
    kept: bool = False
    live: Live | None = None
    said: bool = False


_stdout = _Stdout()


class _Output(io.RawIOBase):
    """Bytes to a file that never fails: the first error is kept, and nothing is written after it.

    Text that cannot be written would stay in the buffer of its stream, and fail again when Python ends: then the exit
    status is Python's, whatever the command returned.
    """

    def __init__(self, number: int, errors: list[OSError], closefd: bool) -> None:
        self._file = open(number, "wb", buffering=0, closefd=closefd)  # noqa: SIM115
        self._errors = errors

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return self._file.isatty()

    def fileno(self) -> int:
        return self._file.fileno()

    def close(self) -> None:
        self._file.close()
        super().close()

    def write(self, data: Any) -> int:
        try:
            if not self._errors:
                while (written := self._file.write(data)) is None:  # a pipe that does not block, and is full
                    select.select([], [self], [])
                return written
        except OSError as error:
            self._errors.append(error)
        return len(data)


def _text(number: int, like: TextIO | None, errors: list[OSError], closefd: bool = False) -> TextIO:
    """A stream of text to a file by its number; characters beyond the encoding are written as escapes."""
    encoding = "utf-8" if like is None else like.encoding
    buffer = io.BufferedWriter(_Output(number, errors, closefd))
    return io.TextIOWrapper(buffer, encoding=encoding, errors="backslashreplace", line_buffering=True)


@contextlib.contextmanager
def steady(*, last: bool) -> Iterator[None]:
    """Return a context in which writing to stdout and stderr never fails; with ``last`` they stay so to the end.

    No file that is opened meanwhile gets the number of a standard stream that is closed.
    """
    while (number := os.open(os.devnull, os.O_RDONLY)) <= 2:
        os.set_inheritable(number, True)  # as the numbers of standard streams are
    os.close(number)
    _stdout.errors.clear()
    _stdout.kept = False
    before = sys.stdout, sys.stderr
    for name, number, errors in (("stdout", 1, _stdout.errors), ("stderr", 2, [])):
        stream: TextIO | None = getattr(sys, name)
        if stream is None or isinstance(stream, io.TextIOWrapper):
            with contextlib.suppress(ValueError):  # a stream that writes to no file
                setattr(sys, name, _text(number if stream is None else stream.fileno(), stream, errors))
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        if not last:
            sys.stdout, sys.stderr = before


def lost() -> OSError | None:
    """The error by which a part of the result was lost; None if there was none, or nobody reads what files have."""
    sys.stdout.flush()
    unread = lambda error: gone(error) or error.errno == errno.EBADF  # closed
    return next((error for error in _stdout.errors if not (_stdout.kept and unread(error))), None)


def say(text: str, *, bold: bool = False) -> None:
    """Print lines of the result, control characters as escapes."""
    text = "\n".join(map(printable, text.split("\n")))
    _stdout.said = True
    click.echo(click.style(text, bold=True) if bold else text, file=_stdout.stream)


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
        if _stdout.errors and not needed:
            raise Lost
        if _stdout.live is not None:
            _stdout.live.start()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Let only results reach stdout: what else is written there, by a C library too, goes to stderr."""
    out, _stdout.said = sys.stdout, False
    try:
        number = out.fileno()
    except (OSError, ValueError):  # no file: what no C library can reach
        number = None
    with contextlib.ExitStack() as stack:
        if number is not None:
            out.flush()
            _stdout.stream = _text(os.dup(number), out, _stdout.errors, closefd=True)
            stack.callback(_restore, _stdout.stream, number)
            os.dup2(2, number)
        else:
            _stdout.stream = out
        stack.callback(setattr, _stdout, "stream", None)
        stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        yield


def _restore(stream: TextIO, number: int) -> None:
    """End a diversion of a file number: what C libraries still hold back leaves by the way it was written for."""
    import ctypes

    with contextlib.suppress(OSError, TypeError, AttributeError):  # Windows
        ctypes.CDLL(None).fflush(None)
    stream.flush()
    os.dup2(stream.fileno(), number)
    stream.close()


def interruptible(command: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a command: only its result reaches stdout, and it ends with one line after Ctrl-C."""

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> Any:
        with alone():
            try:
                return command(*args, **options)
            except KeyboardInterrupt:
                complain(interruption())
                raise Interrupted from None

    return run


def interruption() -> str:
    """The message on a Ctrl-C that ended the command."""
    return SHOWN if _stdout.said else NOTHING


def complain(text: str) -> None:
    """Print an error, a warning or a note to stderr, control characters as escapes."""
    click.echo(printable(text), err=True)


def deliver(
    document: D,
    sections: Callable[[D], Sections],
    as_json: bool,
    write: Callable[[D], None] | None = None,
    folder: Path | None = None,
    *,
    typing: Typing = nothing_typed,
) -> None:
    """Show a result, then write its files: an error while writing loses no result.

    ``as_json`` shows the document instead of its sections.  ``write`` writes into ``folder``, if given; ``typing``
    completes the command to type next.
    """
    text = document.to_json() if as_json else ""
    with part(needed=True):
        if as_json:
            say(text)
        else:
            show(sections(document), typing)
    if write is None:
        return
    try:
        with stages() as tell:
            tell(f"drawing and writing {folder}", None)
            write(document)
        _stdout.kept = True
    except KeyboardInterrupt:
        complain(f"interrupted while {folder} was written; the result is shown above")
        raise Interrupted from None
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
def progress(tell: Progress, tolerance: float) -> Iterator[Callable[[Iterate], None]]:
    """Report how far the residual has fallen towards its tolerance."""

    def watch(iterate: Iterate) -> None:
        residual = iterate.relative_residual
        fallen = math.log(residual) / math.log(tolerance) if 0 < residual < 1 else 0.0
        tell(f"iterating: step {iterate.iteration}, residual {residual:.2e}", min(fallen, 1.0))

    yield watch


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


def reported(command: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a command: a failure of a solver is reported with the file, and as a document."""

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> Any:
        try:
            return command(*args, **options)
        except RuntimeError as error:
            if not solver_failed(error):
                raise
            return fail(error)

    return run


def solver_failed(error: RuntimeError) -> bool:
    """True for errors of the solvers of step II and of the global method."""
    from verification.algorithm.monolithic import SolveError
    from verification.contact import ContactError  # numpy: only now

    return isinstance(error, (ContactError, SolveError))

"""One console for all output and progress: results to stdout, everything else to stderr."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

import click

from ndtheory.texts import printable
from verification.interrupts import undisturbed
from verification.progress import Progress, silent
from verification.sections.layout import Typing, lines, nothing_typed
from verification.sections.parts import Sections

if TYPE_CHECKING:
    from pathlib import Path

    from rich.progress import Progress as Live

    from verification.algorithm.iterate import Iterate
    from verification.document import Document

D = TypeVar("D", bound="Document")


class ReaderGone(Exception):
    """Nobody reads stdout any more."""


class Interrupted(Exception):
    """Ctrl-C, of which a line has told already."""


#: What a command says that Ctrl-C ended before and after something of its result was shown.
NOTHING, SHOWN = "interrupted before anything was computed", "interrupted; what was computed is shown above"


@dataclass(kw_only=True)
class _Stdout:
    """The stream of results, its state, and the live line that makes room for them."""

    stream: TextIO | None = None
    unread: bool = False
    live: Live | None = None
    said: bool = False


_stdout = _Stdout()


def say(text: str, *, bold: bool = False) -> None:
    """Lines of the result; characters of control but the ends of lines are shown as escapes.

    Raises
    ------
    ReaderGone
        The other end of a pipe was closed.
    """
    if _stdout.unread:
        return
    text = "\n".join(map(printable, text.split("\n")))
    _stdout.said = True
    try:
        click.echo(click.style(text, bold=True) if bold else text, file=_stdout.stream)
    except BrokenPipeError:
        raise ReaderGone from None


def show(sections: Sections, typing: Typing = nothing_typed, after: str = "") -> None:
    """Sections, after the one with that id.

    Raises
    ------
    ReaderGone
    """
    for line, title in lines(sections, "terminal", typing=typing, after=after):
        say(line, bold=title)


def one_by_one(*, needed: bool = False) -> Callable[[Sections], None]:
    """A function that shows sections as soon as they are known, those of one id as one.

    Parameters
    ----------
    needed : bool
        As of :func:`part`, and so are the errors.
    """
    last = ""

    def tell(sections: Sections) -> None:
        nonlocal last
        with part(needed=needed):
            show(sections, after=last)
        last = sections[-1].id

    return tell


@contextlib.contextmanager
def part(*, needed: bool = False) -> Iterator[None]:
    """Show a part of a result whole, while the rest is still worked out.

    Parameters
    ----------
    needed : bool
        Whether the rest is wanted even where nobody reads it, as for files.

    Raises
    ------
    ReaderGone
        Nobody reads stdout, and the rest is not needed.
    """
    with undisturbed():
        if _stdout.live is not None:
            _stdout.live.stop()
        try:
            yield
        except ReaderGone:
            if not needed:
                raise
            _stdout.unread = True
        if _stdout.live is not None:
            _stdout.live.start()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Let results alone reach stdout: what else is written there, by a C library too, goes to stderr."""
    out, _stdout.said = sys.stdout, False
    try:
        number = None if out is None else out.fileno()
    except (OSError, ValueError):  # no file: what no C library can reach
        number = None
    with contextlib.ExitStack() as stack:
        if number is not None:
            out.flush()
            _stdout.stream = open(os.dup(number), "w", encoding=out.encoding, errors=out.errors)  # noqa: SIM115
            stack.callback(_restore, _stdout.stream, number)
            os.dup2(_elsewhere(stack), number)
        else:
            _stdout.stream = out
        stack.callback(setattr, _stdout, "stream", None)
        stack.callback(setattr, _stdout, "unread", False)
        stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        yield


def _elsewhere(stack: contextlib.ExitStack) -> int:
    """The file number of stderr, or of nothing where it is closed."""
    try:
        os.fstat(2)
    except OSError:
        return stack.enter_context(open(os.devnull, "w")).fileno()
    return 2


def _restore(stream: TextIO, number: int) -> None:
    """End a diversion of a file number: what C libraries still hold back leaves by the way it was written for."""
    import ctypes

    with contextlib.suppress(OSError, TypeError, AttributeError):  # Windows
        ctypes.CDLL(None).fflush(None)
    with contextlib.suppress(OSError):  # a reader that has gone, a disk that is full: told already
        stream.flush()
    os.dup2(stream.fileno(), number)
    with contextlib.suppress(OSError):
        stream.close()


def interruptible(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command whose result alone reaches stdout, and that ends with one line after Ctrl-C."""

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
    """What to say of a Ctrl-C that ended the command."""
    return SHOWN if _stdout.said else NOTHING


def complain(text: str) -> None:
    """A line about the result, as errors, warnings and notes are; characters of control are shown as escapes."""
    with contextlib.suppress(OSError):  # nowhere to complain to
        click.echo(printable(text), err=True)


def deliver(
    document: D,
    sections: Callable[[D], Sections],
    as_json: bool,
    write: Callable[[], None] | None = None,
    folder: Path | None = None,
    *,
    typing: Typing = nothing_typed,
) -> None:
    """Show first, then write: what goes wrong while writing costs no result.

    Parameters
    ----------
    document : Document
    sections : callable
        Gives what is shown of it; ``as_json`` shows the document itself.
    write, folder : callable and path, optional
        What writes, and where.
    typing : callable, optional
        Completes the command to type next.

    Raises
    ------
    ReaderGone, Interrupted
    """
    text = document.to_json() if as_json else ""
    with part(needed=write is not None):
        if as_json:
            say(text)
        else:
            show(sections(document), typing)
    if write is None:
        return
    try:
        with stages() as tell:
            tell(f"drawing and writing {folder}", None)
            write()
    except KeyboardInterrupt:
        complain(f"interrupted while {folder} was written; the result is shown above")
        raise Interrupted from None
    if not as_json:
        complain(f"written: {folder}")


@contextlib.contextmanager
def stages() -> Iterator[Progress]:
    """A live line on a terminal's stderr: what is being done, the share of it that is done, the time it takes."""
    if sys.stderr is None or not sys.stderr.isatty():
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
    """Tell how far the residual has fallen towards its tolerance."""

    def watch(iterate: Iterate) -> None:
        residual = iterate.relative_residual
        fallen = math.log(residual) / math.log(tolerance) if 0 < residual < 1 else 0.0
        tell(f"iterating: step {iterate.iteration}, residual {residual:.2e}", min(fallen, 1.0))

    yield watch

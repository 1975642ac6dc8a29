"""One console for all output and progress: results to stdout, everything else to stderr."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TextIO

import click

from ndtheory import Number
from ndtheory.texts import printable
from verification.interrupts import undisturbed
from verification.progress import Progress, silent

if TYPE_CHECKING:
    from pathlib import Path

    from rich.progress import Progress as Live

    from verification.algorithm.iterate import Iterate
    from verification.document import Document

WIDTH = 80


class ReaderGone(Exception):
    """Nobody reads stdout any more."""


class Interrupted(Exception):
    """Ctrl-C, of which a line has told already."""


#: What a command says that Ctrl-C ended before and after something of its result was shown.
NOTHING, SHOWN = "interrupted before anything was computed", "interrupted; what was computed is shown above"


@dataclass(frozen=True, kw_only=True)
class Part:
    """What one call says of a result, before it is laid out for a screen.

    Attributes
    ----------
    kind : {'heading', 'line', 'note', 'table'}
    text : str
        Of all but a table, without the signs that make it bold.
    head : tuple of str
        The head of a table, one text for each column.
    rows : tuple of tuple of str
        The other rows of a table.
    """

    kind: Literal["heading", "line", "note", "table"]
    text: str = ""
    head: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


@dataclass(kw_only=True)
class _Voice:
    """Where results go, the live line that makes room for them, and whether one was shown."""

    stream: TextIO | None = None
    lines: list[str] | None = None
    parts: list[Part] | None = None
    live: Live | None = None
    said: bool = False


_ON_STDOUT = _Voice()

#: The voice of a thread.  Most write to stdout; a thread that collects a result has a separate one.
_voice: ContextVar[_Voice] = ContextVar("voice", default=_ON_STDOUT)


@contextlib.contextmanager
def _collecting(voice: _Voice) -> Iterator[None]:
    """A context in which this thread alone speaks with another voice."""
    token = _voice.set(voice)
    try:
        yield
    finally:
        _voice.reset(token)


@contextlib.contextmanager
def heard() -> Iterator[list[str]]:
    """Collect the lines of a result instead of writing them to stdout; without the signs that make a text bold."""
    lines: list[str] = []
    with _collecting(_Voice(lines=lines)):
        yield lines


@contextlib.contextmanager
def parted() -> Iterator[list[Part]]:
    """Collect the parts of a result instead of writing them to stdout, for another layout than that of a screen."""
    parts: list[Part] = []
    with _collecting(_Voice(parts=parts)):
        yield parts


def say(text: str = "", *, bold: bool = False, lines: bool = False) -> None:
    """A line of the result; characters of control are shown as escapes.

    Parameters
    ----------
    text : str
    bold : bool
    lines : bool
        True for a text of several lines: a document, a file, a block to paste.

    Raises
    ------
    ReaderGone
        The other end of a pipe was closed.
    """
    text = "\n".join(map(printable, text.split("\n"))) if lines else printable(text)
    voice = _voice.get()
    if voice.parts is not None:
        if text:
            voice.parts.append(Part(kind="line", text=text))
        return
    if voice.lines is not None:
        voice.lines.append(text)
        return
    voice.said = True
    try:
        click.echo(click.style(text, bold=True) if bold else text, file=voice.stream)
    except BrokenPipeError:
        raise ReaderGone from None


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
    voice = _voice.get()
    with undisturbed():
        if voice.live is not None:
            voice.live.stop()
        try:
            yield
        except ReaderGone:
            if not needed:
                raise
            voice.lines = []
        if voice.live is not None:
            voice.live.start()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Let results alone reach stdout: what else is written there, by a C library too, goes to stderr."""
    voice = _voice.get()
    out, voice.said = sys.stdout, False
    try:
        number = None if out is None else out.fileno()
    except (OSError, ValueError):  # no file: what no C library can reach
        number = None
    with contextlib.ExitStack() as stack:
        if number is not None:
            out.flush()
            voice.stream = open(os.dup(number), "w", encoding=out.encoding, errors=out.errors)  # noqa: SIM115
            stack.callback(_restore, voice.stream, number)
            os.dup2(_elsewhere(stack), number)
        else:
            voice.stream = out
        stack.callback(setattr, voice, "stream", None)
        stack.callback(setattr, voice, "lines", None)
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
    return SHOWN if _voice.get().said else NOTHING


def complain(text: str) -> None:
    """A line about the result, as errors, warnings and notes are; characters of control are shown as escapes."""
    with contextlib.suppress(OSError):  # nowhere to complain to
        click.echo(printable(text), err=True)


def deliver(
    document: Document,
    screen: Callable[[], None],
    as_json: bool,
    write: Callable[[], None] | None = None,
    folder: Path | None = None,
) -> None:
    """Show first, then write: what goes wrong while writing costs no result."""
    text = document.to_json() if as_json else ""
    with part(needed=write is not None):
        if as_json:
            say(text, lines=True)
        else:
            screen()
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


def heading(question: str) -> None:
    """The question that the lines below answer."""
    question = printable(question)
    if (parts := _voice.get().parts) is not None:
        parts.append(Part(kind="heading", text=question))
        return
    say()
    for line in textwrap.wrap(question, WIDTH, subsequent_indent="  "):
        say(line, bold=True)


def note(text: str, indent: str = "") -> None:
    """A sentence of the result, folded at the width of the screen."""
    text = printable(text)
    if (parts := _voice.get().parts) is not None:
        parts.append(Part(kind="note", text=text))
        return
    folded = textwrap.TextWrapper(WIDTH, indent, indent + "  ", break_on_hyphens=False)
    for line in folded.wrap(text):
        say(line)


def table(rows: Sequence[Sequence[str]], *, right: Sequence[int] = (), heads: int = 1) -> None:
    """Columns two spaces apart; ``right`` names columns aligned to the right, the first ``heads`` rows are the head.

    The last column is folded where it does not fit on the screen.
    """
    rows = [[printable(cell) for cell in row] for row in rows]
    if (parts := _voice.get().parts) is not None:
        head = tuple(" ".join(cell for cell in column if cell) for column in zip(*rows[:heads], strict=True))
        parts.append(Part(kind="table", head=head, rows=tuple(tuple(row) for row in rows[heads:])))
        return
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        cells = [
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        start = "".join(f"  {cell}" for cell in cells[:-1]) + "  "
        room = max(WIDTH - len(start), WIDTH // 8)
        for line in textwrap.wrap(cells[-1], room, drop_whitespace=-1 not in right) or [""]:
            say((start + line).rstrip())
            start = " " * len(start)


def figures(value: float | Number | None, digits: int = 3) -> str:
    """A number in a few significant figures; a dash where there is none.

    >>> figures(0.26725), figures(1.7e-7), figures(None)
    ('0.267', '1.70e-07', '-')
    """
    number = value.value if isinstance(value, Number) else value
    if number is None:
        return "-"
    if number == 0:
        return "0"
    if not 1e-3 <= abs(number) < 1e5:
        return f"{number:.{digits - 1}e}"
    return f"{number:#.{digits}g}".rstrip(".")


def near_one(value: float) -> str:
    """A rate; near 1 as its distance from 1.

    >>> near_one(0.30709), near_one(1 - 1.5e-5)
    ('0.3071', '1 - 1.5e-05')
    """
    return f"1 - {1 - value:.2g}" if 0 < 1 - value < 1e-3 else f"{value:.4g}"


@contextlib.contextmanager
def stages() -> Iterator[Progress]:
    """A live line on a terminal's stderr: what is being done, the share of it that is done, the time it takes."""
    voice = _voice.get()
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
        voice.live = live
        stack.callback(setattr, voice, "live", None)
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

"""One console for all output and progress: results to stdout, everything else to stderr."""

from __future__ import annotations

import contextlib
import math
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

from ndtheory import Number

if TYPE_CHECKING:
    from pathlib import Path

    from verification.document import Document
    from verification.state import State

WIDTH = 80


class ReaderGone(Exception):
    """Nobody reads stdout any more."""


class Interrupted(Exception):
    """Ctrl-C after the result was shown."""


def say(text: str = "") -> None:
    """A line of the result.

    Raises
    ------
    ReaderGone
        The other end of a pipe was closed.
    """
    try:
        click.echo(text)
    except BrokenPipeError:
        raise ReaderGone from None


def printable(text: str) -> str:
    """A text from outside on one line, without what could steer a terminal.

    >>> printable("a" + chr(27) + "b" + chr(10) + "c")
    'a b c'
    """
    return "".join(c if c.isprintable() else " " for c in text)


def complain(text: str) -> None:
    """A line about the result: errors, warnings, notes."""
    with contextlib.suppress(OSError):  # nowhere to complain to
        click.echo(text, err=True)


def deliver(
    document: Document, screen: Callable[[], None], write: Callable[[], None] | None, folder: Path | None, as_json: bool
) -> None:
    """Show first, then write: what goes wrong while writing costs no result."""
    if as_json:
        say(document.to_json())
    else:
        screen()
    if write is None:
        return
    try:
        write()
    except KeyboardInterrupt:
        complain(f"interrupted while {folder} was written; the result is shown above")
        raise Interrupted from None
    if not as_json:
        complain(f"written: {folder}")


def heading(question: str) -> None:
    """The question that the lines below answer."""
    say()
    for line in textwrap.wrap(question, WIDTH, subsequent_indent="  "):
        say(click.style(line, bold=True))


def note(text: str, indent: str = "") -> None:
    """A sentence of the result, folded at the width of the screen."""
    folded = textwrap.TextWrapper(WIDTH, indent, indent + "  ", break_on_hyphens=False)
    for line in folded.wrap(text):
        say(line)


def table(rows: Sequence[Sequence[str]], *, right: Sequence[int] = ()) -> None:
    """Columns two spaces apart, the first row a head; ``right`` names columns aligned to the right.

    The last column is folded where it does not fit on the screen.
    """
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


def factor(value: Number | None, one_minus: Number | None) -> str:
    """A contraction factor; near 1 as its distance from 1.

    >>> factor(Number.of_float(1 - 2e-11), Number.of_float(2e-11))
    '1 - 2.0e-11'
    """
    if value is None or one_minus is None:
        return "-"
    return f"1 - {one_minus.value:.1e}" if one_minus.value < 1e-3 else figures(value)


@contextlib.contextmanager
def bar(title: str) -> Iterator[Callable[[float], None]]:
    """A live bar on a terminal's stderr: the share that is done."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda share: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as live:
        task = live.add_task(title, total=1.0)
        yield lambda share: live.update(task, completed=share)


@contextlib.contextmanager
def stages() -> Iterator[Callable[[str, float], None]]:
    """A live bar on a terminal's stderr: what is being done, and the share of it that is done."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda what, share: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as live:
        task = live.add_task("", total=1.0)
        yield lambda what, share: live.update(task, description=what, completed=share)


@contextlib.contextmanager
def progress(title: str, tolerance: float) -> Iterator[Callable[[State], None]]:
    """A live line on a terminal's stderr: how far the residual has fallen towards its tolerance."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda state: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns: list[Any] = [TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}")]
    with Progress(*columns, console=Console(stderr=True), transient=True) as live:
        task = live.add_task(title, total=-math.log10(tolerance), note="")

        def watch(state: State) -> None:
            residual = state.relative_residual
            fallen = -math.log10(residual) if 0 < residual < 1 else 0.0
            live.update(task, completed=fallen, note=f"step {state.iteration}, residual {residual:.2e}")

        yield watch

"""Sections as lines of text: 80 columns, a blank line before each title."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator

from verification.show.parts import Block, Facts, Labelled, Next, Note, Place, Section, Shown, Table, shown

WIDTH = 80

#: Where the text of a labelled line begins, after its indent.
LABEL = 20

#: A function from a command to the words to type; empty if there are none.
Typing = Callable[[Next], str]


def nothing_typed(part: Next) -> str:
    """The words of a command where no problem was typed."""
    return "" if part.problem else " ".join(part.words)


def lines(
    sections: Iterable[Section], place: Place, *, typing: Typing = nothing_typed, after: str = ""
) -> Iterator[tuple[str, bool]]:
    """Lines, each with True if it is a title, for a terminal or a notebook.

    ``typing`` completes a command by what was typed; ``after`` is the id of the section shown before these.
    """
    for section in shown(sections, place):
        if section.id != after:
            if after:
                yield "", False
            title = textwrap.wrap(section.title, WIDTH, subsequent_indent="  ")
            yield from ((line, True) for line in title)
        after = section.id
        for part in section.parts:
            yield from ((line, False) for line in _lines(part, typing))


def text(sections: Iterable[Section]) -> str:
    """The text of a notebook view."""
    return "\n".join(line for line, _ in lines(sections, "notebook"))


def _lines(part: Shown, typing: Typing) -> Iterable[str]:
    match part:
        case Facts(about, facts):
            return folded(" | ".join(filter(None, (about, *facts))), 0)
        case Note(words, indent, lead):
            return folded(f"{lead} {words}".lstrip(), indent)
        case Labelled(label, words):
            return folded(f"{label:{LABEL}}{words}", 2)
        case Table():
            return _columns(part)
        case Block(block, indent):
            return [" " * indent + line for line in block]
        case Next():
            words = typing(part)
            return [f"Next: {words}"] if words else []
    raise TypeError(f"{type(part).__name__} has no layout")


def folded(words: str, indent: int) -> list[str]:
    """Lines of the width of a screen; all but the first are indented by two more columns."""
    return textwrap.wrap(
        words, WIDTH, initial_indent=" " * indent, subsequent_indent=" " * (indent + 2), break_on_hyphens=False
    )


def _columns(table: Table) -> Iterator[str]:
    """Columns two spaces apart; the last one is folded where it does not fit."""
    rows = [[str(cell) for cell in row] for row in (*table.heads, *table.rows)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        *cells, last = (
            cell.rjust(width) if i in table.right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        start = "".join(f"  {cell}" for cell in cells) + "  "
        for line in textwrap.wrap(last, max(WIDTH - len(start), WIDTH // 8)) or [""]:
            yield (start + line).rstrip()
            start = " " * len(start)

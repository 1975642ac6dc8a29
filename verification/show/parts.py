"""The parts by which a result is shown: sections of typed parts, without the width, colours and tags of a place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from ndtheory.number import Level
from ndtheory.texts import printable

#: Where a result is shown.
Place = Literal["terminal", "notebook", "report"]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """Base of all parts; control characters in their texts become escapes.

    ``only`` names the one place where the part is needed; None if it is shown in all places.
    """

    only: Place | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _clean(getattr(self, each.name)))


def _clean(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_clean, value))
    return printable(value) if isinstance(value, str) else value


@dataclass(frozen=True)
class Quantity(Shown):
    """A number, or the ends of an interval, as computed; a rounded text with the mark of its level; its unit, if
    any."""

    value: float | tuple[float, float]
    text: str
    unit: str = ""
    level: Level = "float"

    def __str__(self) -> str:
        return self.text


#: A cell of a table: words or a number.
Cell = str | Quantity


@dataclass(frozen=True)
class Facts(Shown):
    """One line: a title, empty if the title is above, and facts."""

    about: str
    facts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Note(Shown):
    """A sentence, indented by some columns of a terminal; the words before it, ``lead``, stand out."""

    text: str
    indent: int = 2
    lead: str = ""


@dataclass(frozen=True)
class Labelled(Shown):
    """A text with a label."""

    label: str
    text: str


@dataclass(frozen=True)
class Table(Shown):
    """A table: the lines of its head, its rows, and which columns are aligned to the right."""

    heads: tuple[tuple[str, ...], ...]
    rows: tuple[tuple[Cell, ...], ...]
    right: tuple[int, ...] = ()

    @property
    def head(self) -> tuple[str, ...]:
        """The head in one line."""
        return tuple(" ".join(filter(None, column)) for column in zip(*self.heads, strict=True))


def table(head: Iterable[str], rows: Iterable[Iterable[Cell]], *, right: Iterable[int] = ()) -> Table:
    """A table whose head is one line."""
    return Table((tuple(head),), tuple(map(tuple, rows)), tuple(right))


@dataclass(frozen=True)
class Block(Shown):
    """Lines that stay as they are, to paste."""

    lines: tuple[str, ...]
    indent: int = 0


@dataclass(frozen=True)
class Next(Shown):
    """A command to type next: a text, or a command and its options.

    With ``problem`` it is about the problem that was typed, with ``iteration`` also its theta, relaxation and roles;
    with ``exchanged`` it exchanges the roles.  ``written`` replaces a command with -o whose files are there already.
    """

    words: tuple[str, ...]
    problem: bool = False
    iteration: bool = False
    exchanged: bool = False
    written: tuple[str, ...] = ()
    only: Place | None = field(default="terminal", kw_only=True, repr=False)


def following(*words: str, iteration: bool = False, exchanged: bool = False, written: tuple[str, ...] = ()) -> Next:
    """A command for the problem that was typed."""
    return Next(words, problem=True, iteration=iteration, exchanged=exchanged, written=written)


@dataclass(frozen=True)
class Section(Shown):
    """Parts below one title, the question that they answer; the title is empty before and after all questions.

    A section with the id of the one before continues it.  ``caption`` explains its table; ``pictures`` are the names of
    the figures below it in a report, with their captions.
    """

    id: str
    title: str
    parts: tuple[Shown, ...]
    caption: str = ""
    pictures: tuple[tuple[str, str], ...] = ()


Sections = tuple[Section, ...]


def section(
    id: str, title: str, *parts: Shown | str, caption: str = "", pictures: tuple[tuple[str, str], ...] = ()
) -> Section:
    """A section; a text among its parts is a sentence."""
    made = tuple(Note(part) if isinstance(part, str) else part for part in parts)
    return Section(id, title, made, caption, pictures)


def closing(claims: str, *notes: Note, then: Next | str = "") -> Section:
    """The end of a result: other notes, what is not claimed, and the command to type next."""
    last = [Note(f"Not claimed: {claims}.", 0)] if claims else []
    command = [Next((then,)) if isinstance(then, str) else then] if then else []
    return section("limits", "", *notes, *last, *command)


def outside_the_theorem(reason: str) -> Note:
    """A reason why a problem lies outside the theorem."""
    return Note(f"{reason}.", 0, "Outside the theorem:")


def shown(sections: Iterable[Section], place: Place) -> Sections:
    """The sections of one place, those that continue each other put together."""
    found: list[Section] = []
    for each in sections:
        parts = tuple(part for part in each.parts if part.only in (None, place))
        if each.only not in (None, place) or not (parts or each.title):
            continue
        if found and found[-1].id == each.id:
            found[-1] = replace(found[-1], parts=found[-1].parts + parts)
        else:
            found.append(replace(each, parts=parts))
    return tuple(found)

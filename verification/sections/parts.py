"""What a result is shown by: sections of typed parts, without the width, the colours and the tags of a place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from ndtheory.number import Level
from ndtheory.texts import printable

#: Where a result is shown.
Place = Literal["terminal", "notebook", "report"]


def _clean(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_clean, value))
    return printable(value) if isinstance(value, str) else value


@dataclass(frozen=True, kw_only=True)
class Shown:
    """Base of all that is shown: in its texts, characters of control are escapes.

    Attributes
    ----------
    only : {'terminal', 'notebook', 'report'} or None
        The one place where it is needed; None where it is in all of them.
    """

    only: Place | None = None

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _clean(getattr(self, each.name)))


@dataclass(frozen=True)
class Quantity(Shown):
    """A number in a table or a sentence.

    Attributes
    ----------
    value : float or pair of float
        The number, as it was computed; a pair for an interval.
    text : str
        The number as it is read: rounded, with the mark of its level.
    unit : str
        Empty for a pure number.
    level : {'exact', 'verified', 'guaranteed', 'float'}
    """

    value: float | tuple[float, float]
    text: str
    unit: str = ""
    level: Level = "float"

    def __str__(self) -> str:
        return self.text


#: What stands in a table: words or a number.
Cell = str | Quantity


@dataclass(frozen=True)
class Facts(Shown):
    """What is shown, and facts about it, in one line.

    Attributes
    ----------
    about : str
        A title; empty where the facts are about what stands above.
    facts : tuple of str
    """

    about: str
    facts: tuple[str, ...]


@dataclass(frozen=True)
class Note(Shown):
    """A sentence.

    Attributes
    ----------
    text : str
    indent : int
        In columns of a terminal.
    lead : str
        Words before it that stand out.
    """

    text: str
    indent: int = 2
    lead: str = ""


@dataclass(frozen=True)
class Labelled(Shown):
    """A text and what it is about."""

    label: str
    text: str


@dataclass(frozen=True)
class Table(Shown):
    """A table.

    Attributes
    ----------
    heads : tuple of tuple of str
        The lines of the head; the texts of one column belong together.
    rows : tuple of tuple of str or Quantity
    right : tuple of int
        Columns that are aligned to the right.
    """

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
    """Lines that stay as they are: to paste."""

    lines: tuple[str, ...]
    indent: int = 0


@dataclass(frozen=True)
class Next(Shown):
    """The command to type next.

    Attributes
    ----------
    words : tuple of str
        The command with its options, or a text.
    problem : bool
        Whether the problem that was typed belongs after the first word.
    iteration : bool
        Whether the theta, the relaxation and the roles that were typed do, too.
    """

    words: tuple[str, ...]
    problem: bool = False
    iteration: bool = False
    only: Place | None = field(default="terminal", kw_only=True)


def following(*words: str, iteration: bool = False) -> Next:
    """A command for the problem that was typed."""
    return Next(words, problem=True, iteration=iteration)


@dataclass(frozen=True)
class Picture(Shown):
    """A figure of the written report, and what it shows."""

    name: str
    caption: str


@dataclass(frozen=True, kw_only=True)
class Section(Shown):
    """Parts below one title.

    Attributes
    ----------
    id : str
        Its name among the sections of a result.  A section with the id of the one before continues it.
    title : str
        The question that it answers; empty for what stands before and after all questions.
    parts : tuple of Shown
    caption : str
        What its table shows.
    pictures : tuple of Picture
        What stands below its parts, where there are figures.
    """

    id: str
    title: str = ""
    parts: tuple[Shown, ...] = ()
    caption: str = ""
    pictures: tuple[Picture, ...] = ()


Sections = tuple[Section, ...]


def shown(sections: Iterable[Section], place: Place) -> Sections:
    """The sections of one place, those that continue each other put together."""
    found: list[Section] = []
    for section in sections:
        parts = tuple(part for part in section.parts if part.only in (None, place))
        if section.only not in (None, place) or not (parts or section.title):
            continue
        if found and found[-1].id == section.id:
            found[-1] = replace(found[-1], parts=found[-1].parts + parts)
        else:
            found.append(replace(section, parts=parts))
    return tuple(found)


def closing(claims: str, *notes: Note, then: Next | str = "") -> Section:
    """The end of a result: what it does not say, after other notes, and what to type next."""
    last = [Note(f"Not claimed: {claims}.", 0)] if claims else []
    following = [Next((then,)) if isinstance(then, str) else then] if then else []
    return Section(id="limits", parts=(*notes, *last, *following))

"""Times and prerequisites of the pages of the course, from the heads of the pages, and the map drawn from them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path

import yaml

TITLE = re.compile(r"^# (.*)$", re.MULTILINE)
HEAD = re.compile(r"\A---\n(.*?)^---$", re.DOTALL | re.MULTILINE)
EXERCISE = re.compile(r"\{admonition\} Exercise (\d: .*?)\n.*?\((\d+)\s+min\)", re.DOTALL)
GALLERY = re.compile(r"^```\{gallery\}\n(.*?)^```$", re.DOTALL | re.MULTILINE)

#: Where a page shows what it needs and how long it takes.
MARK = "{{ needs }}"

WIDTH, ROW, BOX, GAP, SLOT = 340, 72, 46, 10, 12  # the map, in units of 1/340 of its width


@dataclass(frozen=True, kw_only=True)
class Page:
    """A page of the course.

    Attributes
    ----------
    name : str
        From the folder of the sources, without ``.md``.
    title : str
    minutes : int
        To read it, without the exercises.
    needs : mapping
        Pages to read before -> what this page takes from them, or None.
    besides : str or None
        What a reader needs that no page has.
    exercises : tuple of (str, int)
        Number and title, and minutes.
    """

    name: str
    title: str
    minutes: int
    needs: Mapping[str, str | None]
    besides: str | None
    exercises: tuple[tuple[str, int], ...]

    @property
    def label(self) -> str:
        """A short name."""
        return re.sub(r"(\d)", r" \1", self.name.rsplit("/", 1)[-1].replace("_", " ")).capitalize()

    def sentence(self) -> str:
        """What it needs and how long it takes, in MyST Markdown.

        Examples
        --------
        >>> page = Page(name="b", title="", minutes=20, needs={"a": "the V", "examples/c": None}, besides=None,
        ...             exercises=(("1: x", 5), ("2: y", 10)))
        >>> page.sentence()
        'Needs {doc}`/a` for the V and {doc}`/examples/c`. 20 minutes, and 15 for the exercises.'
        """
        needs = [f"{{doc}}`/{name}`{f' for {what}' if what else ''}" for name, what in self.needs.items()]
        total = sum(minutes for _, minutes in self.exercises)
        return (
            f"Needs {' and '.join([*needs, *filter(None, [self.besides])])}. "
            f"{self.minutes} minutes, and {total} for the exercises."
        )


def read(name: str, text: str) -> Page | None:
    """A page from its source; None where its head has no times.

    Raises
    ------
    ValueError
        An exercise without its minutes.
    """
    head = HEAD.match(text)
    course = yaml.safe_load(head[1]).get("course") if head else None
    if course is None:
        return None
    exercises = tuple((found, int(minutes)) for found, minutes in EXERCISE.findall(text))
    if len(exercises) != text.count("{admonition} Exercise"):
        raise ValueError(f"{name}.md: needed the minutes of each exercise, as (10 min)")
    return Page(
        name=name,
        title=TITLE.findall(text)[0],
        minutes=course["minutes"],
        needs=course.get("needs") or {},
        besides=course.get("besides"),
        exercises=exercises,
    )


def pages(docs: Path) -> dict[str, Page]:
    """The pages of the course by name: chapter 0, then those of the gallery of examples in its order.

    Raises
    ------
    ValueError
        A page without times.
    """
    listed = "".join(GALLERY.findall((docs / "examples" / "index.md").read_text("utf-8"))).split()
    found = {}
    for name in ("chapter0", *listed):
        page = read(name, (docs / f"{name}.md").read_text("utf-8"))
        if page is None:
            raise ValueError(f"{name}.md: needed `course:` with minutes and needs in its head")
        found[name] = page
    return found


def levels(needs: Mapping[str, Mapping[str, str | None]]) -> dict[str, int]:
    """For each page the number of pages on the longest way to it.

    Raises
    ------
    ValueError
        Pages that need each other, or a page that is none.

    Examples
    --------
    >>> levels({"a": {}, "b": {"a": None}, "c": {"a": None, "b": None}})
    {'a': 0, 'b': 1, 'c': 2}
    """
    found: dict[str, int] = {}
    while len(found) < len(needs):
        ready = [name for name in needs if name not in found and all(need in found for need in needs[name])]
        if not ready:
            raise ValueError(f"needed prerequisites without a circle, received {sorted(set(needs) - set(found))}")
        found |= {name: 1 + max((found[need] for need in needs[name]), default=-1) for name in ready}
    return found


def direct(needs: Mapping[str, Mapping[str, str | None]]) -> list[tuple[str, str]]:
    """The pairs (page, page that needs it) of which no other pairs follow.

    Examples
    --------
    >>> direct({"a": {}, "b": {"a": None}, "c": {"a": None, "b": None}})
    [('a', 'b'), ('b', 'c')]
    """

    def behind(name: str) -> set[str]:
        return set(needs[name]).union(*(behind(need) for need in needs[name]))

    return [
        (need, name)
        for name in needs
        for need in needs[name]
        if not any(need in behind(other) for other in needs[name])
    ]


Key = tuple[str, str, int]  # a page, and its row; or a slot: where its arrow ends, where it begins, its row


def places(needs: Mapping[str, Mapping[str, str | None]]) -> dict[Key, tuple[float, float, float]]:
    """Middle, top and width of each box, and of the slots through which long arrows pass.

    Each row has the boxes of one level, ordered by the mean place of what leads to them; a box begins nowhere ("").
    """
    level = levels(needs)
    rows: dict[int, list[tuple[Key, list[Key]]]] = {at: [] for at in level.values()}
    leading: dict[str, list[Key]] = {name: [] for name in needs}
    for start, end in direct(needs):
        way = arrow(start, end, level)
        leading[end].append(way[-2])
        for before, slot in pairwise(way[:-1]):
            rows[slot[2]].append((slot, [before]))
    for name, at in level.items():
        rows[at].append(((name, "", at), leading[name]))
    found: dict[Key, tuple[float, float, float]] = {}
    for at in sorted(rows):
        mean = {key: sum(found[one][0] for one in before) / max(1, len(before)) for key, before in rows[at]}
        row = sorted(mean, key=lambda key: (mean[key], key[1] != ""))
        boxes = sum(not start for _, start, _ in row)
        free = WIDTH - SLOT * (len(row) - boxes) - GAP * (len(row) - 1)
        width = min(free / boxes, 0.45 * WIDTH)
        left = (free - width * boxes) / 2
        for key in row:
            own = SLOT if key[1] else width
            found[key] = (left + own / 2, at * ROW + 1, own)
            left += own + GAP
    return found


def arrow(start: str, end: str, level: Mapping[str, int]) -> list[Key]:
    """The boxes at both ends of an arrow, and the slots between."""
    slots = [(end, start, at) for at in range(level[start] + 1, level[end])]
    return [(start, "", level[start]), *slots, (end, "", level[end])]


def svg(course: Mapping[str, Page], address: Callable[[str], str]) -> str:
    """The map: a box for each page, an arrow from each page to those that need it.

    Parameters
    ----------
    course : mapping
        As :func:`pages` returns it.
    address : callable
        From the name of a page to where a click on its box leads.
    """
    needs = {name: page.needs for name, page in course.items()}
    at, level = places(needs), levels(needs)
    parts = []
    for start, end in direct(needs):
        (x, y), *slots, (to, top) = [at[key][:2] for key in arrow(start, end, level)]
        way = [(x, y + BOX), *(point for a, b in slots for point in ((a, b), (a, b + BOX))), (to, top - 1)]
        bends = "".join(
            f"C{a:.1f},{(b + d) / 2:.1f} {c:.1f},{(b + d) / 2:.1f} {c:.1f},{d:.1f}" for (a, b), (c, d) in pairwise(way)
        )
        parts.append(f'<path class="arrow" d="M{x:.1f},{y + BOX:.1f}{bends}" marker-end="url(#course-tip)"/>')
    for number, (name, page) in enumerate(course.items()):
        x, y, width = at[name, "", level[name]]
        total = sum(minutes for _, minutes in page.exercises)
        lines = _lines(f"{number}. {page.label}" if number else page.label, int(width / 6))
        top = y + BOX / 2 - 6.5 * len(lines) + 4
        text = "".join(
            f'<text x="{x:.1f}" y="{top + 13 * i:.1f}">{escape(line)}</text>' for i, line in enumerate(lines)
        )
        text += f'<text x="{x:.1f}" y="{top + 13 * len(lines):.1f}" class="minutes">{page.minutes} + {total} min</text>'
        box = f'<rect x="{x - width / 2:.1f}" y="{y:.1f}" width="{width:.1f}" height="{BOX}" rx="5"/>'
        parts.append(f'<a href="{escape(address(name))}"><title>{escape(page.title)}</title>{box}{text}</a>')
    height = (max(level.values()) + 1) * ROW - ROW + BOX + 2
    size = 'viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6" markerHeight="6"'
    marker = f'<marker id="course-tip" {size} orient="auto"><path d="M0,0L8,4L0,8z"/></marker>'
    label = "Map of the course: an arrow leads from a page to each page that needs it"
    return (
        f'<svg class="course" viewBox="-1 0 {WIDTH + 2} {height}" role="group" aria-label="{label}">'
        f"<defs>{marker}</defs>{''.join(parts)}</svg>"
    )


def _lines(text: str, widest: int) -> list[str]:
    """Words in lines of at most so many characters."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > widest:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines

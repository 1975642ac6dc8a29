"""Habits of prose that stop a reader: how many places have each, which may only become fewer.

A place is not always wrong.  ``python tests/test_prose.py`` lists the places; a number of :data:`MOST` that is larger
than what is found is lowered.
"""

import io
import re
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("ndtheory", "fem1d2d", "verification")

#: Habit -> what shows it.  Code neither knows nor speaks, and a docstring begins with a noun or an imperative.
HABITS = {
    "code that knows or speaks": (
        r"\bknows? (?:no|nothing|of|only)\b|\bspeaks? (?:of|only)\b|\b(?:is|are) told (?:of|from|apart)\b"
    ),
    "a chain of that of": r"\b(?:that|those) of (?:an?|the|its|their|which|what)\b",
    "alone at the end": r"\balone(?=[.,;:)]|$)",
    "of its own": r"\bof (?:its|their|one's|your) own\b",
    "stands for is": r"\bstands? (?:once|in the|there|beside|behind|on the)\b|\bheld against\b",
    "dear": r"\b(?:dear|dearer)\b|\bgives? away\b|\bbut for\b",
    "a sentence without its head": r"(?:^|[.:;] )Who (?:does|do|has|wants|needs)\b",
}

#: In docstrings only.
OPENING = "a docstring that begins with what or whether"
OPENS = re.compile(r"(?:What|Whether|Who|Whose|Where|When|Which|How|Of|That)\b")

#: At most so many places have it.
MOST = {
    "code that knows or speaks": 5,
    "a chain of that of": 2,
    "alone at the end": 1,
    "of its own": 2,
    "stands for is": 0,
    "dear": 1,
    "a sentence without its head": 0,
    "a docstring that begins with what or whether": 0,
}


class Found(NamedTuple):
    """A place."""

    habit: str
    place: str
    text: str


def prose(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a page outside its code."""
    fence = ""
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(`{3,}|~{3,})", line)
        if mark and (not fence or mark[1] == fence):
            fence = "" if fence else mark[1]
        elif not fence and not line.startswith("    "):
            yield number, line


def words(source: str) -> Iterator[tuple[int, str, bool]]:
    """The lines of comments, docstrings and messages of a module; whether one begins a docstring."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string, False
        elif token.type == tokenize.STRING:
            long = token.string.startswith(('"""', 'r"""'))
            for n, line in enumerate(token.string.splitlines()):
                yield token.start[0] + n, line.removeprefix("r").removeprefix('"""'), long and n == 0


def in_page(name: str, text: str) -> list[Found]:
    """Places in a page of Markdown."""
    return [
        Found(habit, f"{name}:{number}", line.strip())
        for number, line in prose(text)
        for habit, pattern in HABITS.items()
        if re.search(pattern, line)
    ]


def in_module(name: str, source: str) -> list[Found]:
    """Places in a module of Python; it is not read closely where its lines, of code too, have none."""
    found = []
    lines = source.replace('"""', "\n")
    if not re.search(rf'r?"""{OPENS.pattern}', source) and not any(re.search(p, lines, re.M) for p in HABITS.values()):
        return found
    for number, line, opens in words(source):
        place = f"{name}:{number}"
        found += [Found(habit, place, line.strip()) for habit, pattern in HABITS.items() if re.search(pattern, line)]
        if opens and OPENS.match(line):
            found.append(Found(OPENING, place, line.strip()))
    return found


def everywhere() -> list[Found]:
    """Places in the pages and packages."""
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
    pages += sorted((ROOT / "docs" / "examples").glob("*.md"))
    modules = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    read = lambda path: (path.relative_to(ROOT).as_posix(), path.read_text("utf-8"))
    return [
        *(found for path in pages for found in in_page(*read(path))),
        *(found for path in modules for found in in_module(*read(path))),
    ]


def test_no_habit_grows():
    counts = Counter(found.habit for found in everywhere())
    assert {habit: counts[habit] for habit in (*HABITS, OPENING)} == MOST, "python tests/test_prose.py lists the places"


@pytest.mark.parametrize(
    ("habit", "line"),
    [
        ("code that knows or speaks", "This module knows nothing of meshes."),
        ("a chain of that of", "The norm is that of the lift."),
        ("alone at the end", "It needs numpy alone."),
        ("of its own", "It has a page of its own."),
        ("stands for is", "The reason stands beside it."),
        ("dear", "A third solve is dear."),
        ("a sentence without its head", "It ends. Who wants more reads on."),
    ],
)
def test_a_planted_habit_is_found_in_prose_and_in_comments_only(habit, line):
    assert [found.habit for found in in_page("page.md", line)] == [habit]
    assert [found.habit for found in in_module("a.py", f"x = 1  # {line}\n")] == [habit]
    assert in_page("page.md", f"```python\n{line}\n```\n") == []
    assert in_module("a.py", 'def of(that):\n    """Sum of two numbers."""\n') == []


def test_a_docstring_that_begins_with_whether_is_found():
    source = 'def closed(x):\n    """Whether x is closed."""\n    return "Whether"\n'
    assert [found.place for found in in_module("a.py", source)] == ["a.py:2"]


if __name__ == "__main__":
    for found in everywhere():
        print(f"{found.place}: {found.habit}: {found.text[:100]}")

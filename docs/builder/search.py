"""The search of the site: entries for keys, commands, options, names, equations and terms, with a line of meaning each.

What counts how much, and words that no page has, are in ``search.toml``; ``docs/search.js`` orders the results.
"""

from __future__ import annotations

import json
import re
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click

import verification as vf
from builder import api, commands, documents, equations
from ndtheory.statements import statements
from verification.cli.main import cli
from verification.ledger.sections import plain

HERE = Path(__file__).parent

#: The script of the search page, which is written into ``generated/search``, a static folder.
FILE = "search_order.js"


class Entry(NamedTuple):
    """A result of the search beside the pages: its name, its page and place there, its meaning, its kind."""

    name: str
    place: str
    meaning: str
    kind: str


def words(text: str) -> str:
    """A text of Markdown or of a docstring without its marks."""
    text = plain(re.sub(r"\\[lr]vert *", "|", text))
    return " ".join(re.sub(r"\{\w+\}`|`", "", re.sub(r"(?<=\w)<(?= )", " <", text)).split())


def keys() -> Iterator[Entry]:
    """The keys of a problem file."""
    for table in documents.FILE:
        for name, _, meaning, _ in documents.file_rows(table):
            full = documents.full_name(table, name)
            yield Entry(full, f"problem_file#{documents.anchor(full)}", words(meaning), "key")


def typed() -> Iterator[Entry]:
    """The commands and their options; one that has the same help in several is one entry, which leads to the first."""
    found: dict[tuple[str, str], list[str]] = {}
    for full, command, _ in commands.commands(cli, "ndtheory"):
        yield Entry(full, _of_command(full), words(command.get_short_help_str(200)), "command")
        for option in command.params:
            if isinstance(option, click.Option) and not option.hidden:
                found.setdefault((option.opts[-1], option.help or ""), []).append(full)
    for (name, said), having in found.items():
        yield Entry(name, _of_command(having[0]), f"{', '.join(having)}: {words(said)}", "option")


def _of_command(full: str) -> str:
    return f"generated/commands#{full.replace(' ', '-')}"


def names() -> Iterator[Entry]:
    """The public names of ``verification``."""
    for name in vf.__all__:
        one = getattr(vf, name)
        kind = "class" if isinstance(one, type) else "function"
        place = f"generated/api/{one.__module__}#{api.place(one)}"
        yield Entry(f"vf.{name}", place, words(api.summary(one)), kind)


def numbered() -> Iterator[Entry]:
    """The numbered equations of the paper."""
    for one in statements().values():
        if one.label.startswith("("):
            yield Entry(one.label, f"generated/equations#{equations.anchor(one)}", words(one.title), "equation")


#: A term of the glossary and the first sentence about it.
TERM = re.compile(r"^(\w.*)\n  ((?:.|\n  )+?(?:\.(?=\s)|(?=\n\n)))", re.MULTILINE)


def terms(glossary: str) -> Iterator[Entry]:
    """The terms of the glossary, as its page has them between the marks of the directive."""
    for block in re.findall(r"^```\{glossary\}\n(.*?)^```", glossary, re.DOTALL | re.MULTILINE):
        for name, meaning in TERM.findall(block):
            anchor = re.sub(r"[^A-Za-z0-9_]+", "-", f"term-{name}").strip("-")
            yield Entry(name, f"glossary#{anchor}", words(meaning), "term")


def entries(source: Path) -> list[Entry]:
    """All of them."""
    glossary = (source / "glossary.md").read_text("utf-8")
    return [*keys(), *typed(), *names(), *numbered(), *terms(glossary)]


#: The title of a page, cells and directives, the beginnings of other blocks that are no text, and links and emphasis.
TITLE = re.compile(r"^# .*\n", re.MULTILINE)
FENCED = re.compile(r"^(```+|:::+).*?^\1$", re.DOTALL | re.MULTILINE)
NO_TEXT = re.compile(r"[:%|({#<!$-]|\*\{\{")
MARKS = re.compile(r"\{[\w:]+\}`(?:([^`<]+?) ?<[^`]*>|([^`]*))`|\[([^\]]+)\]\([^)]*\)|\*")
PAGE = re.compile(r"\{doc\}`([^`<]+)`")
WORK = re.compile(r"\{cite:?t?\}`(\w+?)(\d+)`")

#: Characters of an excerpt, which ends with a word.
EXCERPT = 200


def _named(path: Path) -> str:
    """The text of a page, with the titles of other pages and the authors of works in place of their names."""

    def title(page: re.Match[str]) -> str:
        other = (path.parent / page[1]).with_suffix(".md")
        found = TITLE.search(other.read_text("utf-8")) if other.exists() else None
        return found[0][2:].strip() if found else page[0]

    text = PAGE.sub(title, path.read_text("utf-8"))
    return WORK.sub(lambda work: " ".join([*re.findall("[A-Z][a-z]+", work[1]), work[2]]), text)


def excerpts(source: Path) -> dict[str, str]:
    """The beginning of each page that is written by hand: from disk a browser fetches no page to find a better one."""
    found = {}
    for path in sorted(source.rglob("*.md")):
        name = path.relative_to(source).with_suffix("").as_posix()
        below = TITLE.split(_named(path), maxsplit=1)[1:]
        blocks = (
            re.split(r"\n{2,}", FENCED.sub("", below[0]).strip())
            if below and not name.startswith(("_build", "generated"))
            else []
        )
        text = next((block for block in blocks if not NO_TEXT.match(block)), "")
        text = words(MARKS.sub(r"\1\2\3", text))
        if text:
            found[name] = textwrap.shorten(text, EXCERPT, placeholder=" ...")
    return found


def script(source: Path) -> str:
    """The script of the search page: the data, then what orders by them."""
    table = tomllib.loads((HERE / "search.toml").read_text("utf-8"))
    data = json.dumps({**table, "entries": entries(source), "excerpts": excerpts(source)}, ensure_ascii=False)
    return f"const SEARCH = {data};\n{(source / 'search.js').read_text('utf-8')}"


def write(source: Path) -> None:
    """Write the script of the search page."""
    folder = source / "generated" / "search"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / FILE).write_text(script(source), encoding="utf-8")

"""The index of equations: each numbered statement with its verdict, its code, its tests and the pages that use it.

Nothing in it is kept by hand: places are found by the number as it is written, ``(5.30)`` in prose and docstrings,
``"5.30"`` in tables of checks.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from ndtheory.statements import Statement, statements
from verification.ledger import quote

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("fem1d2d", "ndtheory", "verification")

#: Made from the ledger itself, so that every number stands there; and this index.
GENERATED = "generated"

#: Of more places the first ones are shown.
SHOWN = 8


#: Where a number between quotation marks is that of a statement, and not a number.
TABLES = re.compile("ledger|symbolic|inequalit|large_friction")


def written(statement: Statement, quoted: bool = True) -> re.Pattern[str]:
    """How a text names a statement; between quotation marks too, where these hold ids.

    Examples
    --------
    >>> pattern = written(statements()["5.30"])
    >>> [bool(pattern.search(text)) for text in ("by (5.30)", "'5.30'", "(5.3)", "5.301")]
    [True, True, False, False]
    >>> bool(written(statements()["prop-5.6.1"]).search("Proposition 5.6"))
    True
    """
    id = re.escape(statement.id)
    forms = [rf"`{id}(?: \w+)?`"]
    if quoted:
        forms.append(rf"[\"']{id}[\"']")
    if re.fullmatch(r"\d\.\d+", statement.id):
        forms.append(rf"\({id}\)")
    named = re.match(r"(prop|lemma|rem|thm)-(\d\.\d+)", statement.id)
    if named:
        word = {"prop": "Proposition", "lemma": "Lemma", "rem": "Remark", "thm": "Theorem"}[named[1]]
        forms.append(rf"{word} {re.escape(named[2])}(?!\d)")
    return re.compile("|".join(forms))


#: All that may name a statement: most of a text need not be searched for each of them.
MENTIONS = re.compile(r"""\(\d\.\d+\)|["'][\w.-]+["']|`[^`\n]+`|(?:Proposition|Lemma|Remark|Theorem) \d\.\d+""")


def mentions(text: str) -> str:
    """What in a text may name a statement.

    Examples
    --------
    >>> mentions("by (5.30) and Lemma 5.2, of course")
    '(5.30)\\nLemma 5.2'
    """
    return "\n".join(dict.fromkeys(MENTIONS.findall(text)))


def definitions(path: Path) -> Iterator[tuple[str, str]]:
    """Name and source of each function and class at the top of a module; an empty name for what is left."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for node in ast.parse(text).body:
        source = "\n".join(lines[node.lineno - 1 : node.end_lineno])
        yield getattr(node, "name", ""), source


@cache
def code() -> list[tuple[str, str]]:
    """Dotted name of everything in the packages, with what its source mentions."""
    found = []
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            found += [(f"{module}.{name}" if name else module, mentions(source)) for name, source in definitions(path)]
    return found


@cache
def tests() -> list[tuple[str, str]]:
    """``file::test`` of every test of the packages, with what it and the table above it mention."""
    found = []
    paths = [path for part in PACKAGES for path in (ROOT / "tests" / part).rglob("test_*.py")]
    for path in sorted(paths):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines()
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                first = min([node.lineno, *(mark.lineno for mark in node.decorator_list)])
                source = "\n".join(lines[first - 1 : node.end_lineno])
                found.append((f"{path.relative_to(ROOT / 'tests')}::{node.name}", mentions(source)))
    return found


def pages() -> list[tuple[str, str]]:
    """Name of every page that is written by hand, with what it mentions."""
    docs = ROOT / "docs"
    found = [path.relative_to(docs) for path in sorted(docs.rglob("*.md"))]
    kept = [path for path in found if path.parts[0] not in (GENERATED, "_build")]
    return [(str(path.with_suffix("")), mentions((docs / path).read_text(encoding="utf-8"))) for path in kept]


def places(statement: Statement, texts: list[tuple[str, str]]) -> list[str]:
    """The names of the texts that name a statement, each once."""
    anywhere, in_tables = written(statement, quoted=False), written(statement)
    number = re.search(r"\d\.\d+|$", statement.id)[0] or statement.id  # in all that names it
    named = (
        name for name, text in texts if number in text and (in_tables if TABLES.search(name) else anywhere).search(text)
    )
    return list(dict.fromkeys(named))


def anchor(statement: Statement) -> str:
    """The id of its heading in the index.

    Examples
    --------
    >>> anchor(statements()["5.30"])
    'statement-5-30'
    """
    return "statement-" + re.sub("[^a-z0-9]+", "-", statement.id.lower())


def _listed(found: list[str], form: str) -> str:
    shown = [form.format(name) for name in found[:SHOWN]]
    rest = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    return ", ".join(shown) + rest if shown else "-"


def page() -> str:
    """The index in MyST Markdown."""
    of_code, of_tests, of_pages = code(), tests(), pages()
    lines = [
        "# Index of equations",
        "",
        "Each numbered statement of the paper, and each fact of ours: what the {doc}`ledger <ledger>` says of it, where"
        " it is computed, what tests it, and the pages that use it. It is made from the sources at every build.",
        "",
    ]
    for statement in statements().values():
        lines += [
            f"({anchor(statement)})=",
            f"## {statement.label}: {statement.title}",
            "",
            f"Verdict: [{quote(statement.id)}](ledger.md).",
            "",
            f"- Code: {_listed(places(statement, of_code), '{{py:obj}}`{0}`')}",
            f"- Tests: {_listed(places(statement, of_tests), '`{0}`')}",
            f"- Pages: {_listed(places(statement, of_pages), '{{doc}}`/{0}`')}",
            "",
        ]
    return "\n".join(lines)

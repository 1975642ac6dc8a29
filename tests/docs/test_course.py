"""The pages of the course keep its rules: exercises with folded solutions, pictures in words, notebooks that run."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from ndtheory.statements import recorded
from verification.ledger import quote
from verification.ledger.sheets import WORDS

DOCS = Path(__file__).parents[2] / "docs"
CELL = re.compile(r"^```\{code-cell\} ipython3\n(.*?)^```$", re.DOTALL | re.MULTILINE)
HEADER = re.compile(r"\A(?:---\n(?P<block>.*?)^---\n|(?P<tags>:tags: [^\n]*\n))", re.DOTALL | re.MULTILINE)
EXERCISE = re.compile(r"^::::\{admonition\} Exercise \d: [^\n]+\n:class: exercise\n(.*?)^::::$", re.DOTALL | re.M)
SOLUTION = re.compile(r"^:::\{dropdown\} Solution\n(.*?)^:::$", re.DOTALL | re.MULTILINE)
TERM = re.compile(r"\{term\}`(?:[^`<]*<([^>`]*)>|([^`<]*))`")

#: Pages of the course are those with exercises.
PAGES = [
    page
    for page in sorted(DOCS.glob("**/*.md"))
    if not {"_build", "generated"} & set(page.parts) and "## Exercises" in page.read_text("utf-8")
]
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)

WIDEST = 83


@dataclass(frozen=True, kw_only=True)
class Cell:
    """A code cell of a page: what stands above its code, and the code without magic commands."""

    header: str
    code: str

    @property
    def hidden(self) -> bool:
        return "remove-cell" in self.header


def cells(text: str) -> list[Cell]:
    found = []
    for source in CELL.findall(text):
        header = HEADER.match(source)
        code = source[header.end() :] if header else source
        kept = "\n".join(line for line in code.splitlines() if not line.startswith("%"))
        found.append(Cell(header=header[0] if header else "", code=kept))
    return found


def visible(text: str) -> list[Cell]:
    return [cell for cell in cells(text) if not cell.hidden]


def undrawn(text: str) -> list[str]:
    """Visible cells that end in a figure and lack its caption, name or description."""
    figures = [cell for cell in visible(text) if cell.code.rstrip().endswith("\nfigure")]
    return [cell.code for cell in figures if not all(f"{key}: " in cell.header for key in ("caption", "name", "alt"))]


@each_page
def test_a_page_has_three_exercises_with_folded_solutions(page):
    exercises = EXERCISE.findall(page.read_text("utf-8"))
    assert len(exercises) == 3
    for exercise in exercises:
        assert re.search(r"\(\d+ min\)", exercise)
        (solution,) = SOLUTION.findall(exercise)
        assert "```" not in solution  # code in a solution would not be run


@each_page
def test_a_page_asks_a_question_and_takes_a_wrong_turn(page):
    text = page.read_text("utf-8")
    assert re.search(r"^# .*\?$", text, re.MULTILINE)
    assert "\n## A wrong turn\n" in text


@each_page
def test_a_picture_of_the_course_has_a_caption_and_is_told_in_words(page):
    assert undrawn(page.read_text("utf-8")) == []


@each_page
def test_no_visible_cell_of_a_page_needs_the_site(page):
    assert [cell.code for cell in visible(page.read_text("utf-8")) if "glue" in cell.code] == []


@each_page
def test_code_of_the_course_stays_in_its_column(page):
    lines = [line for cell in visible(page.read_text("utf-8")) for line in cell.code.splitlines()]
    assert [line for line in lines if len(line) > WIDEST] == []


@each_page
def test_every_number_of_the_text_is_computed_and_every_computed_one_is_shown(page):
    """A name may be put together, as in ``glue(f"rho-{role}", ..)``: its braces stand for any text."""
    text = page.read_text("utf-8")
    hidden = "\n".join(cell.code for cell in cells(text) if cell.hidden)
    names = re.findall(r"""(f?)["']([\w{}-]+)["']""", hidden)
    patterns = [
        re.compile(re.sub(r"\\?\{.*?\\?\}", ".+", re.escape(name)) if f else re.escape(name)) for f, name in names
    ]
    shown = set(re.findall(r"\{glue:text\}`([^`:]+)", text))
    assert set(re.findall(r"""glue\(\s*["']([^"']+)["']""", text)) <= shown
    assert [name for name in shown if not any(pattern.fullmatch(name) for pattern in patterns)] == []


def defined(glossary: str) -> set[str]:
    """The terms of a glossary: lines of its blocks that are not indented."""
    blocks = re.findall(r"^```\{glossary\}\n(.*?)^```$", glossary, re.DOTALL | re.MULTILINE)
    return {line for block in blocks for line in block.splitlines() if line and not line.startswith(" ")}


def test_every_term_that_a_page_uses_is_in_the_glossary():
    terms = defined((DOCS / "glossary.md").read_text("utf-8"))
    used = {(page.stem, given or plain) for page in PAGES for given, plain in TERM.findall(page.read_text("utf-8"))}
    assert used
    assert [(page, term) for page, term in sorted(used) if term not in terms] == []


def test_the_glossary_lists_all_its_terms_in_alphabetical_order():
    text = (DOCS / "glossary.md").read_text("utf-8")
    listed = re.findall(r"\{term\}`([^`]+)`", text.partition("\n## ")[0])
    assert listed == sorted(defined(text), key=str.lower)


def test_the_glossary_defines_each_verdict_of_the_ledger_as_the_ledger_does():
    entry = (DOCS / "glossary.md").read_text("utf-8").partition("\nverdict\n")[2].partition("\n\nno conclusion\n")[0]
    assert dict(re.findall(r"^  - ([A-Z]+): (.*)\.$", entry, re.MULTILINE)) == WORDS


@pytest.fixture(scope="module")
def notebooks(builder):
    return builder.notebooks


@each_page
def test_the_notebook_of_a_page_says_what_the_page_says_without_its_solutions(page, notebooks):
    text = re.sub(r"\A---\n.*?^---$", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    text = CELL.sub("", text)
    values = dict.fromkeys(re.findall(r"\{glue:text\}`([^`:]+)", text), "7")
    told = notebooks.plain(text, values, lambda role, target, title: title or f"[{target}]")
    assert re.findall(r"\{[a-z:]+\}`", told) == []
    for quoted in re.findall(r"\{(?:verdict|ledger)\}`([^`]+)`", SOLUTION.sub("", text)):
        assert quote(*quoted.split()) in told
    for widget in re.findall(r"\{widget\} (\w+)", text):
        assert f"On the site a picture to move is here: [{widget}]." in told
    assert "Solution" not in told
    for solution in SOLUTION.findall(text):
        first = max(re.split(r"[`{}$\n]", solution), key=len)
        assert first not in told


def test_the_first_cell_of_a_notebook_is_that_of_its_page(notebooks):
    """The text says 'in the first cell'; the cell that only the site needs is left out."""

    def cell(kind, source, *tags):
        return {"cell_type": kind, "source": source, "metadata": {"tags": list(tags)}}

    of_page = [
        cell("markdown", "# A page"),
        cell("code", "glue('x', 1)", "remove-cell"),
        cell("code", "x = 1"),
        cell("code", "x"),
    ]
    title, first, second = notebooks.portable({"cells": of_page}, {}, str)["cells"]
    assert title["source"] == "# A page"
    assert "%matplotlib inline" in first["source"].splitlines()
    assert first["source"].endswith("\nx = 1")
    assert second["source"] == "x"


def test_what_breaks_a_rule_is_found():
    page = (
        "```{code-cell} ipython3\n:tags: [remove-cell]\nfrom myst_nb import glue\nx = 1\n```\n\n"
        "```{code-cell} ipython3\ny = [x + z for z in (1, 2)]\nfigure = y\nfigure\n```\n"
    )
    assert undrawn(page) == ["y = [x + z for z in (1, 2)]\nfigure = y\nfigure"]
    told = "---\nmystnb:\n  figure:\n    caption: A\n    name: fig-a\n  image:\n    alt: b\n---\nfigure = 1\nfigure\n"
    (cell,) = cells(f"```{{code-cell}} ipython3\n{told}```\n")
    assert cell.code == "figure = 1\nfigure"
    assert undrawn(f"```{{code-cell}} ipython3\n{told}```\n") == []
    assert defined("```{glossary}\nrate\n  A number.\n\nstick, slip\n  States.\n```\n") == {"rate", "stick, slip"}


def test_each_word_of_the_ledger_has_an_example_in_chapter_0_that_bears_it():
    """The table explains one word a row, in the order of the ledger's own table; no statement bears the sixth word."""
    page = (DOCS / "chapter0.md").read_text("utf-8")
    rows = re.findall(r"^\| \{verdict\}`([^`]+)` \|", page, re.MULTILINE)
    borne = [word for word in WORDS if word in recorded().values()]
    assert [quote(id) for id in rows] == borne
    (unborne,) = set(WORDS) - set(borne)
    assert WORDS[unborne].startswith("wrong as printed, and no repaired form")
    assert "one of five words" in page
    assert "A sixth word is kept for what is wrong as printed without a known repaired form" in page


def order() -> list[str]:
    """The pages of the course in the order of its list."""
    listed = re.search(
        r"```\{toctree\}\n:hidden:\n\n(.*?)```", (DOCS / "examples" / "index.md").read_text("utf-8"), re.DOTALL
    )
    return listed[1].split()


def test_each_page_of_the_course_ends_with_the_one_after_it_and_the_last_one_says_so():
    for page, following in zip(order(), [*order()[1:], None], strict=True):
        ending = (DOCS / "examples" / f"{page}.md").read_text("utf-8").rstrip().splitlines()[-1]
        assert ("last page" in ending) == (following is None), page
        if following is not None:
            assert "next" in ending.lower(), page
            assert re.search(rf"\{{doc\}}`(?:[^`<]*<)?{following}>?`|\]\({following}\.md\)", ending), page

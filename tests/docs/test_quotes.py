"""Pages, screens and reports quote the ledger instead of repeating it, and use one word for one thing."""

import re
from pathlib import Path

import pytest
from processes import sites

from ndtheory import statements as record
from ndtheory.statements import statements
from verification.ledger import quote
from verification.ledger.sections import plain
from verification.sections.bounds import on_the_printed_proof

ROOT = Path(__file__).parents[2]
PAGES = [*sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs" / "examples").glob("*.md")), ROOT / "README.md"]
ROLE = re.compile(r"\{(verdict|ledger)\}`([^`]*)`")
CONF = """
import runpy

given = runpy.run_path({conf!r})
project, extensions = "roles", ["myst_parser"]
myst_enable_extensions = given["myst_enable_extensions"]


def setup(app):
    for name in ("verdict", "ledger"):
        app.add_role(name, given["FromLedger"]())
"""


def quoted(page):
    """(id, what) of every role on a page."""
    for role, text in ROLE.findall(page.read_text("utf-8")):
        yield tuple(text.split()) if role == "ledger" else (text, "verdict")


def test_a_verdict_and_a_text_are_quoted_as_they_stand():
    assert quote("5.12") == record.recorded()["5.12"]
    assert quote("5.30", "wrong") == statements()["5.30"].wrong


@pytest.mark.parametrize("asked", [("5.99",), ("",), ("5.12", "wrong"), ("5.12", "leans_on"), ("5.12", "id")])
def test_what_the_ledger_has_not_cannot_be_quoted(asked):
    with pytest.raises(ValueError, match=r"no such statement|needed 'verdict'"):
        quote(*asked)


def test_every_quotation_on_a_page_is_one():
    found = [asked for page in PAGES for asked in quoted(page)]
    assert {("5.30", "verdict"), ("5.30", "wrong"), ("x-printed-rescued", "verdict")} <= set(found)
    assert all(quote(*asked) for asked in found)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_page_types_a_verdict_of_the_ledger(page):
    text = re.sub(r"```.*?```", "", ROLE.sub("", page.read_text("utf-8")), flags=re.DOTALL)
    assert re.findall(r"\b(?:PROVED|REPAIRED|REFUTED|NUMERICAL|ASSUMED)\b", text) == []


def test_the_closing_note_of_the_screens_follows_the_record(monkeypatch):
    note = on_the_printed_proof()
    assert quote("5.30") in note
    assert quote("x-printed-rescued") in note
    assert quote("x-printed-rescued", "title") in note
    changed = record.recorded() | {"5.30": "NUMERICAL", "x-printed-rescued": "INCONCLUSIVE"}
    monkeypatch.setattr(record, "recorded", lambda: changed)
    assert on_the_printed_proof() == note.replace("REPAIRED", "NUMERICAL").replace("PROVED", "INCONCLUSIVE")


def sentences(text):
    return re.split(r"(?<=[.:;?])\s|\n\n|\|", text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_only_a_check_or_a_hypothesis_fails_on_a_page(page):
    """An iteration stalls or diverges, an inequality is false (the notation page says so)."""
    text = re.sub(r"```\{keys\}[^`]*```|`[^`\n]*`", "", page.read_text("utf-8"))  # names of modules and documents
    told = [s for s in sentences(text) if re.search(r"\bfail", s, re.IGNORECASE)]
    assert [s for s in told if not re.search(r"\bcheck|hypothes", s, re.IGNORECASE)] == []


def test_only_a_check_fails_in_a_statement():
    texts = [(s.id, (s.title, s.claims, s.wrong, s.repair, s.proof, s.note)) for s in statements().values()]
    told = [(id, s) for id, given in texts for text in given for s in sentences(plain(text))]
    assert [(id, s) for id, s in told if re.search(r"\b(?:fail|diverg|stall)", s)] == []


def test_an_unknown_quotation_fails_the_build_of_the_site(site_tools, tmp_path):
    pages = {
        "known": "{verdict}`5.30`: {ledger}`5.30 wrong`",
        "unknown": "{verdict}`5.99`",
        "none": "{ledger}`5.12 wrong`",
    }
    for name, page in pages.items():
        folder = tmp_path / name
        (folder / "generated").mkdir(parents=True)
        (folder / "generated" / "ledger.md").write_text("# The ledger\n", encoding="utf-8")
        (folder / "conf.py").write_text(CONF.format(conf=str(ROOT / "docs" / "conf.py")), encoding="utf-8")
        text = f"# A page\n\n{page}\n\n```{{toctree}}\ngenerated/ledger\n```\n"
        (folder / "index.md").write_text(text, encoding="utf-8")
    said = {line.split()[0]: line for line in sites(*(tmp_path / name for name in pages)).splitlines()}
    assert said["known"] == "known 0"
    for name in ("unknown", "none"):
        assert said[name].startswith(f"{name} 2 "), said
        assert "index, line 3" in said[name]
    assert quote("5.30") in (tmp_path / "known" / "built" / "index.html").read_text("utf-8")

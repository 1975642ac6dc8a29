"""The written report: the words and digits of the screen, on any screen, asking nobody else."""

import html
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import cycle
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import pytest
from browser import chromium, needs_browser
from problem_list import small
from small_result import ONE_STEP, problem
from strategies import AT_NIGHT

import verification as vf
from verification import figures
from verification.bounds.verdicts import RunVerdict
from verification.output.folder import Folder
from verification.output.report import report
from verification.sections.bounds import on_the_printed_proof, thetas
from verification.sections.comparison import NAMES, WORDS
from verification.show.layout import text

ROOT = Path(__file__).parents[3]

#: Titles that could leave their place in a file.
TITLES = {
    "markup, template, unknown formula": "</title><script>alert(1)</script><img src=http://example.org/x> "
    r"{{ 7 * 7 }} {% raw %} $\text{kN}$ and $\frac$",
    "one dollar": "costs 5 $ and 3 $",
}
if AT_NIGHT:
    TITLES |= {
        "entities": "a < b & c > d \"quoted\" 'twice'",
        "formula": r"modulus ratio $E_1/E_2 = \frac{7}{2}$",
        "another script": "\u63a5\u89e6 \u03bc",
        "long": "long title " * 60,
        "empty": "",
    }


class Reader(HTMLParser):
    """Text, and every attribute by which a page could ask for something."""

    def __init__(self):
        super().__init__()
        self.text, self.heading, self.asked, self.tags, self.styles = "", "", [], [], ""
        self.cells, self.terms = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.asked += [value for key, value in attributes if key in ("src", "href", "xlink:href", "srcset", "data")]
        self.styles += "".join(value or "" for key, value in attributes if key in ("style", "clip-path", "fill"))

    def handle_data(self, data):
        if self.tags and self.tags[-1] == "style":
            self.styles += data
        if self.tags and self.tags[-1] == "h1" and not self.heading:
            self.heading = data
        if self.tags and self.tags[-1] == "td" and data.strip():
            self.cells.append(data)
        if self.tags and self.tags[-1] == "dt" and data.strip():
            self.terms.append(data)
        self.text += data


def read(folder: Path) -> Reader:
    """A report, its powers and indices as on the screen."""
    reader, page = Reader(), (folder / "report.html").read_text("utf-8")
    for tag, typed in (("sup", "^"), ("sub", "_")):
        page = re.sub(rf"<{tag}>(.*?)</{tag}>", rf"{typed}\1", page)
    reader.feed(page)
    return reader


def test_the_report_asks_no_other_file_and_no_other_host(written):
    page = read(written)
    assert [asked for asked in page.asked if not asked.startswith("#")] == []
    assert not {"script", "link", "iframe", "img", "object", "embed", "base"} & set(page.tags)
    assert "@import" not in page.styles
    assert [url for url in re.findall(r"url\(([^)]*)\)", page.styles) if not url.startswith("#")] == []


def test_the_report_holds_its_figures_and_every_verdict_with_its_reason(comparison, written):
    page = read(written)
    assert page.tags.count("svg") == 4
    for name, judgement in comparison.verdicts.items():
        assert f"{NAMES.get(name, name)}\n" in page.text
        assert WORDS[judgement.verdict] in page.text
        assert judgement.reason in page.text
    assert "Relative residual without relaxation at the end" in page.text
    assert "Not claimed" in page.text
    for unit in ("MPa", "mm"):
        assert unit in page.text


def test_the_report_says_of_the_printed_proof_what_is_recorded(written):
    assert on_the_printed_proof() in read(written).text


def screen(comparison) -> str:
    """What three commands show of a comparison."""
    found = (*comparison.sections(), *thetas([comparison.bounds["energy"].detail]), *comparison.measured.sections())
    return text(found)


def test_the_report_has_the_words_and_the_digits_of_the_screen(comparison, written):
    page, shown = read(written), screen(comparison).replace("Gamma_c", "Γ_c")
    missing = set(shown.lower().split()) - set(page.text.lower().split())
    assert missing <= {"|"}  # between the title and what follows
    cells = "\n".join(page.cells)
    assert "consistent" in cells
    assert set(cells.split()) <= set(shown.split())


def test_powers_are_raised_and_no_text_of_the_page_is_typed_as_in_a_program(written):
    page = re.sub("<!--.*?-->", "", (written / "report.html").read_text("utf-8"))  # the texts of the figures, as typed
    assert "10<sup>" in page
    assert "Γ<sub>c</sub>" in page
    assert re.findall(r"\d\^|Gamma_|\|\|\|", page) == []


def test_every_table_and_figure_of_the_report_has_a_caption(written):
    page = read(written)
    assert page.tags.count("table") == page.tags.count("caption") == 6
    assert page.tags.count("figure") == page.tags.count("figcaption") == page.tags.count("svg") == 4


def test_the_report_explains_every_verdict_and_words_that_the_glossary_has(written):
    terms, verdicts = set(read(written).terms), {WORDS[name] for name in get_args(RunVerdict)}
    glossary = re.findall(r"^(\S.*)\n  \S", (ROOT / "docs" / "glossary.md").read_text("utf-8"), re.MULTILINE)
    assert verdicts | {"edition", "energy", "lmi", "decade", "rho"} <= terms
    assert terms - verdicts <= set(glossary)


@pytest.fixture(scope="module")
def phone():
    """A browser as wide as a phone."""
    with chromium() as driver:
        driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride", {"width": 375, "height": 700, "deviceScaleFactor": 2, "mobile": True}
        )
        yield driver


@needs_browser
def test_no_cell_of_the_report_leaves_the_screen_of_a_phone(phone, comparison, written):
    phone.get((written / "report.html").as_uri())
    assert phone.execute_script("return document.documentElement.scrollWidth") <= 375
    cells = phone.execute_script(
        "return [...document.querySelectorAll('tbody th, tbody td')].map(cell => {"
        "const box = cell.getBoundingClientRect(); return [cell.innerText, box.left, box.right, cell.scrollWidth]})"
    )
    assert {WORDS[judgement.verdict] for judgement in comparison.verdicts.values()} <= {text for text, *_ in cells}
    assert [cell for cell in cells if cell[1] < 0 or cell[2] > 375 or cell[1] + cell[3] > 375.5] == []


def test_every_name_in_the_report_is_given_once(written):
    names = re.findall(r'\bid="([^"]*)"', (written / "report.html").read_text("utf-8"))
    assert sorted(name for name in set(names) if names.count(name) > 1) == []


def page_and_figures(folder: Path, comparison) -> str:
    """The report and both figures, whose files must be well-formed; returns the report."""
    for name, figure in (
        ("bodies", figures.draw_bodies(comparison.run)),
        ("residuals", figures.draw_residuals(comparison.run, comparison.computed)),
    ):
        figures.save(figure, folder / f"{name}.svg")
        ElementTree.parse(folder / f"{name}.svg")
    texts = {name: (folder / f"{name}.svg").read_text("utf-8") for name in ("bodies", "residuals")}
    return report(comparison, texts)


def of_another_run(comparison, problem):
    """Titles and units come with the run; bounds and losses, which cost twenty times as much, stay."""
    return replace(comparison, run=vf.run(problem))


BARS = {
    "dimension": 1,
    "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 1, "fixed": ["left"]},
    "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 2, "prescribed": {"right": "-0.1"}},
}


@pytest.mark.parametrize(
    "data", [BARS, small(body2={"prescribed": {"top": ["free", "-0.015"]}})], ids=["bars", "a sliding top"]
)
def test_a_problem_to_which_not_every_bound_applies_has_a_report_too(tmp_path, data):
    comparison = vf.compare(vf.Problem.from_dict(data))
    page = page_and_figures(tmp_path, comparison)
    assert all(WORDS[judgement.verdict] in page for judgement in comparison.verdicts.values())


#: Units of length and of stress that could do the same, beside each title one pair.
UNITS = [("$\\bad{$", "<b>m</b>"), ("\u00b5m", "in$^2$")]


@pytest.mark.parametrize(("title", "units"), list(zip(TITLES.values(), cycle(UNITS))), ids=TITLES)
def test_titles_and_units_stay_text_in_every_file(comparison, tmp_path, title, units):
    made = problem(title=title, units=dict(zip(("length", "stress"), units, strict=True)), iteration=ONE_STEP)
    page = Reader()
    page.feed(page_and_figures(tmp_path, of_another_run(comparison, made)))
    assert not {"script", "img", "b"} & set(page.tags)
    assert page.heading.strip() == (title.strip() if title.isprintable() else page.heading.strip())
    assert all(character.isprintable() or character == "\n" for character in page.heading)
    for unit in units:
        assert page.text.count(unit) >= 2


def test_every_warning_of_the_run_stands_in_the_report(tmp_path):
    problem = vf.example("two-bars")
    compared = vf.compare(problem, bounds=["energy"])
    assert any("strain" in warning for warning in compared.run.warnings)
    Folder(tmp_path, "compare").write(compared)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert all(html.escape(warning) in page for warning in compared.run.warnings)
    quiet = vf.compare(problem.with_keys({"body2.prescribed.right": "[-0.0001]"}), bounds=["energy"])
    assert quiet.run.warnings == []
    assert [section.id for section in quiet.sections()].count("setting") == 1

"""The paper on the software agrees with CITATION.cff, with the screen of the first run, and with the journal's form."""

import re
import tomllib
from pathlib import Path

import pytest

from verification.output.files import MARKS

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "joss"
PAPER = (FOLDER / "paper.md").read_text("utf-8")
HEAD, TEXT = PAPER.split("---\n", 2)[1:]
CFF = (ROOT / "CITATION.cff").read_text("utf-8")


def bibliography(path: Path) -> dict[str, dict[str, str]]:
    """Key -> field -> value of each entry."""
    entries = re.findall(r"(?ms)^@\w+\{(\w+),\n(.*?)^\}", path.read_text("utf-8"))
    return {key: dict(re.findall(r"(?m)^ *(\w+) *= *\{(.*)\},?$", fields)) for key, fields in entries}


BIBLIOGRAPHY = bibliography(FOLDER / "paper.bib")


def test_the_paper_has_fewer_than_1000_words_and_every_section_in_its_order():
    assert 250 < len(TEXT.split()) < 1000
    sections = (
        "Summary, Statement of need, State of the field, Software design, Research impact statement, Acknowledgements,"
        " References"
    )
    assert re.findall(r"(?m)^# (.*)$", TEXT) == sections.split(", ")


def test_each_work_is_cited_and_each_citation_has_a_work():
    assert set(re.findall(r"@(\w+)", TEXT)) == set(BIBLIOGRAPHY)
    assert [key for key, entry in BIBLIOGRAPHY.items() if not {"doi", "howpublished"} & set(entry)] == []


@pytest.mark.parametrize(
    ("here", "there"), [("BayadaSabilSassi2008", "BayadaSabilSassi2008"), ("Goujaud2024", "GoujaudEtAl2024")]
)
def test_a_work_that_the_site_cites_too_has_the_same_data(here, there):
    site = bibliography(ROOT / "docs" / "references.bib")[there]
    assert BIBLIOGRAPHY[here] == site


def test_name_authors_and_work_are_those_of_the_citation_and_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    authors = re.findall(r"(?m)^  - name: (.*)$", HEAD.partition("affiliations:")[0])
    assert authors == [author["name"] for author in project["authors"]]
    assert authors == re.findall(r'(?m)^  - name: "(.*)"$', CFF)
    assert re.search(r"(?m)^title: '(\w+):", HEAD)[1] == re.search(r'(?m)^title: "(\w+):', CFF)[1] == project["name"]
    assert BIBLIOGRAPHY["BayadaSabilSassi2008"]["doi"] == re.search(r"(?m)^    doi: (.*)$", CFF)[1]
    assert project["urls"]["Paper"] == f"https://doi.org/{BIBLIOGRAPHY['BayadaSabilSassi2008']['doi']}"


def test_the_numbers_of_the_paper_are_those_of_the_screen_that_is_explained():
    screen = (ROOT / "docs" / "first_run.md").read_text("utf-8").partition("## All numbers")[2]
    for bound, shown in [
        ("printed", r"1.9 \cdot 10^{-21}"), ("repaired", r"1.7 \cdot 10^{-7}"), ("energy", "0.334"), ("lmi", "0.867"),
    ]:  # fmt: skip
        value = float(re.search(rf"(?m)^ +{bound} +\S+ +([\d.e-]+) ", screen)[1])
        digits = re.sub(r" \\cdot 10\^\{(-\d+)\}", r"e\1", shown)
        assert float(digits) == pytest.approx(value, rel=0.01)
        assert f"${shown}$" in TEXT or shown in TEXT
    assert re.search(r"reach a factor of [\d.]+, ([\d.]+) % less", screen)[1] in TEXT
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    assert [
        count for count in re.findall(r"(\d+)\nstatements|and (\d+) of our", TEXT) if f"{''.join(count)} " not in readme
    ] == []


def test_the_figure_was_drawn_by_the_library_and_stands_beside_the_paper():
    [name] = re.findall(r"\]\((.*\.png)\)", TEXT)
    assert MARKS[".png"] in (FOLDER / name).read_bytes()

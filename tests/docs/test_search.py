"""The search of the site: an entry for each key, command, option and public name; the first results of forty queries.

Run on a built site: ``PYTHONPATH=tests python tests/docs/test_search.py docs/_build/html`` prints what is wrong and
exits with 1.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import tomllib
from pathlib import Path

import click
import pytest
from browser import BROWSER, DRIVER, chromium, needs_browser

import verification as vf
from verification.cli.main import cli

DOCS = Path(__file__).parents[2] / "docs"

#: What users type, and the beginning of the place that comes first.
QUERIES = {
    "mesh file gmsh": "mesh_files",
    "plane stress": "problem_file",
    "prescribed": "problem_file",
    "units": "problem_file",
    "theta auto": "problem_file",
    "traction": "problem_file",
    "friction coefficient vary": "problem_file#friction",
    "which solver dirichlet": "examples/which_side",
    "does not converge": "does_not_converge",
    "--swap-roles": "generated/commands",
    "added mass FSI": "coupling_waves",
    "advise_vectors": "generated/api/verification.coupling.from_vectors",
    "hysteresis": "loading_history",
    "heat conjugate transfer": "coupling_waves",
    "relaxation diverges": "coupling",
    "aitken": "coupling",
    "cite": "cite",
    "preCICE": "coupling",
    "convergence log": "couplings_table",
    "windows install": "install",
    "schur complement": "glossary#term-Schur-complement",
    "dask cluster": "examples/sweeps",
    "certificate": "glossary#term-certificate",
    "gap": "glossary#term-gap",
    "IQN-ILS": "coupling",
    "pip install": "install",
    "penetration warning": "problem_file",
    "rigid body motion": "problem_file",
    "abaqus inp": "mesh_files",
    "three bodies": "problem_file",
    "optimal relaxation factor": "coupling",
    "couple my own solvers in python": "coupling_scripts",
    "parameter study": "examples/sweeps",
    "--json": "generated/commands",
    "cylinder on a plane": "gallery#gallery-hertz",
    "gravity": "problem_file",
    "max_iterations": "problem_file",
    "stalled": "does_not_converge",
    "vf.march": "generated/api/verification.algorithm.history",
    "teach a course": "lecturers",
    "what is rho": "glossary",
    "stiffness ratio": "glossary#term-rho",
    "which theta": "coupling",
    "nearly incompressible": "problem_file",
}

#: Finds the places of the results of a query, the first one first.
FOUND = "return Search._performSearch(...Search._parseQuery(arguments[0])).map(r => r[0] + r[2]).reverse()"

SCRIPT = re.compile(r"const SEARCH = (.*);\n")


def data(script: Path) -> dict:
    """The tables in the script of the search page."""
    return json.loads(SCRIPT.match(script.read_text("utf-8"))[1])


def lost_places(site: Path) -> list[str]:
    """Lines ``search: place`` for entries and words that lead to no page, or to no place on it."""
    tables, found, ids = data(site / "_static" / "search_order.js"), [], {}
    for place in dict.fromkeys([place for _, place, _, _ in tables["entries"]] + list(tables["words"])):
        name, _, anchor = place.partition("#")
        page = site / f"{name}.html"
        if name not in ids and page.is_file():
            ids[name] = set(re.findall(r'\bid="([^"]+)"', page.read_text("utf-8")))
        if name not in ids or (anchor and anchor not in ids[name]):
            found.append(f"search: {place} is no place of the site")
    return found


def misled(site: Path) -> list[str]:
    """Lines ``query: first result`` for queries whose first result is another one."""
    with chromium() as browser:
        browser.get((site / "search.html").as_uri())
        first = {query: (browser.execute_script(FOUND, query) or ["nothing"])[0] for query in QUERIES}
    return [
        f"search: {query!r} finds {first[query]}" for query, place in QUERIES.items() if not fits(first[query], place)
    ]


def fits(found: str, place: str) -> bool:
    """True for the page of that name, or for places on it that begin so."""
    return found.startswith(place) if "#" in place else found.partition("#")[0] == place


def test_each_key_command_option_and_name_is_an_entry_with_a_meaning(builder):
    found = builder.search.entries(DOCS)
    of = lambda kind: [entry.name for entry in found if entry.kind == kind]
    rows = [key for table in builder.documents.FILE for key, *_ in builder.documents.file_rows(table)]
    assert len(of("key")) == len(set(of("key"))) == len(rows)
    commands = list(builder.commands.commands(cli, "ndtheory"))
    assert of("command") == [typed for typed, _, _ in commands]
    options = [one for _, command, _ in commands for one in command.params if isinstance(one, click.Option)]
    assert set(of("option")) == {option.opts[-1] for option in options if not option.hidden}
    assert sorted(of("function") + of("class")) == sorted(f"vf.{name}" for name in vf.__all__)
    assert [entry for entry in found if not entry.meaning or re.search(r"[`$\\]|\{\w+\}", entry.meaning)] == []
    assert "(5.30)" in of("equation")
    listed = re.findall(r"\{term\}`([^`]+)`", (DOCS / "glossary.md").read_text("utf-8").partition("## ")[0])
    assert sorted(of("term")) == sorted(" ".join(term.split()) for term in listed)


def test_each_page_has_an_excerpt_of_text_for_a_site_that_is_read_from_disk(builder):
    found = builder.search.excerpts(DOCS)
    assert {"index", "coupling", "first_run", "examples/which_side", "api/index"} <= set(found)
    assert not any(name.startswith(("_build", "generated")) for name in found)
    assert max(map(len, found.values())) <= 200
    assert sum(map(len, found.values())) < 20_000
    assert [name for name, text in found.items() if re.search(r"[`*]|\{\w+\}|\]\(|DOES IT", text)] == []
    assert found["references"].startswith("The paper under study is Bayada Sabil Sassi 2008; equation")
    assert found["energy"].startswith("The proof of The theorem, proved again on a mesh measures")
    assert found["examples/prediction"].startswith(
        "Before a run a bound guarantees that each step reduces the error by"
    )


def test_the_tables_of_the_search_name_pages_and_kinds_that_exist(builder):
    tables = tomllib.loads((DOCS / "builder" / "search.toml").read_text("utf-8"))
    made = ["generated/commands", "generated/api/ndtheory", "generated/errata"]
    pages = [*made, *(str(path.relative_to(DOCS).with_suffix("")) for path in DOCS.rglob("*.md"))]
    assert [start for start in tables["pages"] if not any(page.startswith(start) for page in pages)] == []
    assert [place for place in tables["words"] if place.partition("#")[0] not in pages] == []
    assert set(tables["kinds"]) == {entry.kind for entry in builder.search.entries(DOCS)}


def test_the_meaning_of_a_key_is_read_without_marks(builder):
    text = r"the {term}`Neumann body`, $0 < \theta < 1$; $\lvert v\rvert^2$ of `a`, see ``b``"
    assert builder.search.words(text) == "the Neumann body, 0 < theta < 1; |v|^2 of a, see b"


@pytest.mark.parametrize("anchor", ["there", "gone"])
def test_a_lost_place_of_an_entry_is_found(tmp_path, anchor):
    tables = {"entries": [["key", f"page#{anchor}", "a meaning", "key"]], "words": {"page": ["word"], "none": ["word"]}}
    (tmp_path / "_static").mkdir()
    (tmp_path / "_static" / "search_order.js").write_text(f"const SEARCH = {json.dumps(tables)};\n", "utf-8")
    (tmp_path / "page.html").write_text('<p id="there">', "utf-8")
    lost = ["search: none is no place of the site"]
    assert (
        lost_places(tmp_path) == ([f"search: page#{anchor} is no place of the site"] if anchor == "gone" else []) + lost
    )


#: A site of four pages: its index as Sphinx writes it, and tables for its search.
INDEX = {
    "docnames": ["file", "glossary", "theory", "waves"],
    "filenames": ["file.md", "glossary.md", "theory.md", "waves.md"],
    "titles": ["The file", "Glossary", "The theory", "Waves"],
    "alltitles": {
        "The file": [[0, None]],
        "Plane stress": [[0, "plane-stress"]],
        "Glossary": [[1, None]],
        "The theory": [[2, None]],
        "Waves": [[3, None]],
    },
    "terms": {"stress": [0, 1, 2, 3], "plane": [0, 2], "load": [0, 2], "norm": [2, 3], "heat": 3},
    "titleterms": {"file": 0, "stress": 0, "plane": 0, "glossari": 1, "theori": 2, "wave": 3},
    "indexentries": {},
    "objects": {"ours.module": [[2, 0, 1, "", "norm"]]},
    "objnames": {"0": ["py", "function", "Python function"]},
}
TABLES = {
    "pages": {"": 1, "theory": 0.5},
    "kinds": {"key": 1.3, "option": 0.8, "term": 1.4},
    "words": {"waves": ["hysteresis"], "theory": ["does not converge"], "file#key-load": ["gravity"]},
    "excerpts": {"waves": "How waves carry stress."},
    "entries": [
        ["body.load", "file#key-load", "force on a side", "key"],
        ["contact.gap", "file#key-gap", "distance of the surfaces", "key"],
        ["gap", "glossary#term-gap", "distance of the bodies", "term"],
        ["--load", "file#run", "run: loads of a file", "option"],
    ],
}
STUBS = """const DOCUMENTATION_OPTIONS = {BUILDER: "html", FILE_SUFFIX: ".html", LINK_SUFFIX: ".html",
  SHOW_SEARCH_SUMMARY: true};
const SPHINX_HIGHLIGHT_ENABLED = false, _ = text => text, Documentation = {gettext: _, ngettext: _};
const _ready = start => document.addEventListener("DOMContentLoaded", start);
const stopwords = new Set(["the", "what", "is", "it", "not", "does"]);
const Stemmer = class { stemWord(word) { return word.replace(/y$/, "i"); } };
"""


@pytest.fixture
def searched(driver, tmp_path):
    """The places that a query on a small site shows, in their order, and their texts."""
    sphinx = pytest.importorskip("sphinx", reason="the tools of the site are not installed: make docs")
    shutil.copy(Path(sphinx.__file__).parent / "themes" / "basic" / "static" / "searchtools.js", tmp_path)
    order = f"const SEARCH = {json.dumps(TABLES)};\n{(DOCS / 'search.js').read_text('utf-8')}"
    (tmp_path / "order.js").write_text(order, "utf-8")
    (tmp_path / "search.html").write_text(
        f'<!doctype html><meta charset="utf-8"><script>{STUBS}</script><script src="searchtools.js"></script>'
        f'<script defer src="order.js"></script><div id="search-results"></div><p id="search-progress"></p>'
        f"<script>Search.setIndex({json.dumps(INDEX)})</script>",
        "utf-8",
    )

    from selenium.webdriver.support.ui import WebDriverWait

    def shown(query: str) -> list[tuple[str, str]]:
        driver.get(f"{(tmp_path / 'search.html').as_uri()}?q={query}")
        done = "return document.querySelector('#search-results h2').innerText === 'Search Results'"
        WebDriverWait(driver, 60).until(lambda page: page.execute_script(done))
        links = "return [...document.querySelectorAll('li')].map(e => [e.querySelector('a').href, e.innerText])"
        found = driver.execute_script(links)
        assert driver.get_log("browser") == []  # from disk no page is fetched for a summary
        return [(link.rpartition("/")[2], text) for link, text in found]

    return shown


@needs_browser
@pytest.mark.parametrize(
    ("query", "first"),
    [
        ("plane stress", "file.html#plane-stress"),  # a section with both words
        ("stress norm", "waves.html"),  # both words, and the page counts more than the theory
        ("stress plane norm", "file.html#plane-stress"),  # two words out of three, in a heading
        ("plane stress 3.13", "file.html#plane-stress"),  # numbers count little: the index has none
        ("hysteresis", "waves.html"),  # a word that no page has
        ("it doesn't converge", "theory.html"),  # a negation
        ("gravity", "file.html#key-load"),  # a word for an entry
        ("load", "file.html#key-load"),
        ("--load", "file.html#run"),  # an option as it is typed
        ("gap", "glossary.html#term-gap"),  # a term of the glossary comes before a key
        ("contact.gap", "file.html#key-gap"),
        ("wav", "waves.html"),  # the beginning of a word
    ],
)
def test_the_first_result_has_the_words_of_the_query(searched, query, first):
    assert searched(query)[0][0] == first


@needs_browser
def test_an_entry_shows_its_kind_and_meaning_and_objects_come_last(searched):
    assert ("file.html#key-load", "body.load (key: force on a side)") in searched("load")
    assert searched("hysteresis")[0] == ("waves.html", "Waves (How waves carry stress.)")  # the page itself, from disk
    assert [place for place, _ in searched("norm")] == ["waves.html", "theory.html", "theory.html#ours.module.norm"]


@needs_browser
def test_a_query_without_results_shows_none(searched):
    assert searched("what is the") == searched("plasticity") == []


if __name__ == "__main__":
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "search.html").exists():
        sys.exit("usage: PYTHONPATH=tests python tests/docs/test_search.py DIRECTORY, the directory of a built site")
    site = Path(sys.argv[1]).resolve()
    wrong = lost_places(site)
    if BROWSER and DRIVER:
        wrong += misled(site)
        print("\n".join(wrong) or f"each of {len(QUERIES)} queries finds its page, and every entry has its place")
    else:
        print("\n".join([*wrong, "no Chromium here: what queries find was not looked at"]))
    sys.exit(bool(wrong))

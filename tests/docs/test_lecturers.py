"""The pages for lecturers and for those who cite, and the head of the README, say what is so."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from pathlib import Path

import ndtheory
from verification.cli import main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
LECTURERS = (ROOT / "docs" / "lecturers.md").read_text("utf-8")
CITE = (ROOT / "docs" / "cite.md").read_text("utf-8")


def plan() -> dict[str, int]:
    """The minutes of each row of the plan, by the first page it names."""
    rows = re.findall(r"^\| (\d+) \| \{doc\}`(?:examples/)?(\w+)`", LECTURERS, re.MULTILINE)
    return {page: int(minutes) for minutes, page in rows}


def test_the_plan_for_a_lecture_adds_up_to_90_minutes() -> None:
    assert sum(plan().values()) == 90
    assert len(plan()) == 10


def test_the_plan_is_a_table_whose_rows_are_stacked_on_a_phone() -> None:
    inside = re.search(r"^:::\{container\} keys plan\n(.*?)^:::$", LECTURERS, re.DOTALL | re.MULTILINE)
    assert inside is not None
    assert inside[1].count("\n|") == len(plan()) + 1
    assert "div.keys.plan td" in (ROOT / "docs" / "site.css").read_text("utf-8")


def test_the_short_plan_adds_up_to_45_minutes() -> None:
    short = re.search(r"With 45 minutes, take (.*)", LECTURERS)
    assert short is not None
    assert sum(plan()[page] for page in re.findall(r"\{doc\}`(?:examples/)?(\w+)`", short[1])) == 45


def exercises() -> dict[str, list[int]]:
    """The minutes of the exercises of each page that has some, by the page."""
    found = {}
    for page in (ROOT / "docs").glob("**/*.md"):
        text = page.read_text("utf-8")
        if "_build" not in page.parts and "## Exercises" in text:
            minutes = re.findall(r"\{admonition\} Exercise \d: .*?\((\d+)\s+min\)", text, re.DOTALL)
            found[page.relative_to(ROOT / "docs").with_suffix("").as_posix()] = [int(each) for each in minutes]
    return found


def test_the_exercise_class_adds_up_to_45_minutes() -> None:
    told = re.search(r"For a class of 45 minutes(.*?)\n\n", LECTURERS, re.DOTALL)
    assert told is not None
    taken = re.findall(r"exercises? (\d)(?: and (\d))? of\s+\{doc\}`([\w/]+)`", told[1])
    assert len(taken) == told[1].count("{doc}")
    minutes = exercises()
    assert sum(minutes[page][int(n) - 1] for *numbers, page in taken for n in numbers if n) == 45


def test_the_table_of_exercises_has_all_pages_with_exercises_and_is_shown_as_a_table(builder) -> None:
    cell = re.search(r"```\{code-cell\} ipython3\n(.*?)^```", LECTURERS, re.DOTALL | re.MULTILINE)
    assert cell is not None
    assert "for page in course.pages(Path()).values()" in cell[1]
    listed = {name: [n for _, n in page.exercises] for name, page in builder.course.pages(ROOT / "docs").items()}
    assert listed == exercises()
    assert re.search(r"^mystnb:\n  markdown_format: myst$", cell[1], re.MULTILINE)  # CommonMark has no tables


def test_the_run_of_the_lecture_converges_where_lmi_alone_speaks(tmp_path, monkeypatch, capsys) -> None:
    first, second = re.findall(r"^ndtheory (.*)$", LECTURERS.replace("\\\n  ", ""), re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    command, _, file = first.partition(" > ")
    assert main(command.split()) == 0
    Path(file).write_text(capsys.readouterr().out, "utf-8")
    assert main([*shlex.split(second), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["verdicts"]
    assert said["energy"] == said["repaired"] == said["printed"] == "HYPOTHESES_NOT_MET"
    assert said["lmi"] == said["linearised"] == "CONSISTENT"


def test_the_plan_shows_every_widget_of_the_page_of_widgets_and_each_where_its_page_is_read() -> None:
    gathered = re.findall(r"\{widget\} (\w+)", (ROOT / "docs" / "widgets.md").read_text("utf-8"))
    shown = []
    for row in re.findall(r"^\| \d+ \| .*", LECTURERS, re.MULTILINE):
        pages = [(ROOT / "docs" / f"{page}.md").read_text("utf-8") for page in re.findall(r"\{doc\}`([\w/]+)`", row)]
        on_pages = {name for page in pages for name in re.findall(r"\{widget\} (\w+)", page)}
        shown += (here := re.findall(r"\*\*widget\*\* \*(\w+)\*", row))
        assert set(here) <= on_pages
    assert set(gathered) <= set(shown)
    assert len(shown) == len(set(shown))


def test_the_entry_to_cite_names_this_version() -> None:
    assert f"version = {{{ndtheory.__version__}}}" in CITE
    assert f"version: {ndtheory.__version__}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_the_facts_at_the_head_of_the_readme_are_those_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    facts = re.search(r"^\*(Python .*)\*$", README, re.MULTILINE)
    assert facts is not None
    pythons, licence, typed, status, _ = facts[1].split(" | ")
    classifiers = project["classifiers"]
    versions = [c.rsplit(" ", 1)[1] for c in classifiers if re.search(r":: 3\.\d+$", c)]
    assert pythons == f"Python {', '.join(versions)}"
    assert licence == project["license"]
    assert (typed == "with type hints") == ("Typing :: Typed" in classifiers)
    assert any(c.startswith("Development Status") and c.endswith(status.split(": ")[1]) for c in classifiers)


def test_the_installation_in_the_readme_names_files_and_commands_that_exist() -> None:
    first = README.partition("## Install and try it")[2].partition("Either way")[0]
    commands = [line.strip() for line in first.splitlines() if line.startswith("    ")]
    assert commands[0] == "make demo"
    assert re.search(r"^demo:", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert (ROOT / "requirements.lock").exists()
    assert all(line.startswith(("make", "python -m venv", ".venv/bin/")) for line in commands)

"""The parts of the nightly tests: each file of tests is in one of them, and what passes is noted."""

import re
import runpy
import subprocess
import tomllib
from datetime import date
from pathlib import Path
from types import SimpleNamespace

import pytest
from processes import environment

ROOT = Path(__file__).parents[1]
nightly = SimpleNamespace(**runpy.run_path(str(ROOT / ".ci/nightly.py")))


def rows(root):
    """The notes of each part."""
    text = (root / nightly.NOTES).read_text("utf-8")
    return dict(re.findall(r"(?m)^\| ([a-z-]+) \| ?(.*) \|$", text.partition("|---|")[2]))


def test_each_file_of_tests_is_in_one_part():
    files = nightly.files(ROOT)
    assert "tests/test_nightly.py" in files
    assert len(files) > 100
    parts = {file: [part for part in nightly.PARTS if nightly.matches(part, file)] for file in files}
    assert {file: some for file, some in parts.items() if len(some) != 1} == {}
    assert [part for part in nightly.PARTS if part != "mutants" and not nightly.arguments(ROOT, part)] == []


def test_each_folder_that_pytest_collects_is_in_one_part():
    paths = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]["ini_options"]["testpaths"]
    given = [name for part in nightly.PARTS for name in nightly.arguments(ROOT, part)]
    assert sorted(name for name in given if not name.startswith("tests/")) == sorted(set(paths) - {"tests"})


def test_the_workflow_runs_every_part_and_the_notes_have_a_row_of_each():
    workflow = (ROOT / ".github/workflows/nightly.yml").read_text("utf-8")
    [matrix] = re.findall(r"part: \[(.*)\]", workflow)
    assert matrix.split(", ") == list(rows(ROOT)) == list(nightly.PARTS)
    assert "make nightly PART=${{ matrix.part }}" in workflow
    assert ".ci/nightly.py $(PART)" in (ROOT / "Makefile").read_text("utf-8")


@pytest.fixture
def project(tmp_path):
    """A repository with two parts of tests and notes of them."""
    for name in ("cli", "docs"):
        (tmp_path / "tests" / name).mkdir(parents=True)
        (tmp_path / "tests" / name / "test_one.py").write_text("")
    (tmp_path / nightly.NOTES).write_text("|---|\n| cli | | | |\n| docs | 7 | 2020-01-01 | 0123456789 |\n")
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "all"]):
        subprocess.run([*git, *words], cwd=tmp_path, check=True, env=environment())
    return tmp_path


def test_what_passes_on_a_commit_is_noted_with_it(project):
    asked = []
    assert nightly.main(["cli"], project, lambda root, given: not asked.append(given)) == 0
    assert asked == [["tests/cli/test_one.py"]]
    head = subprocess.check_output(["git", "rev-parse", "HEAD"], cwd=project, text=True, env=environment())
    assert rows(project) == {"cli": f"1 | {date.today()} | {head[:10]}", "docs": "7 | 2020-01-01 | 0123456789"}
    assert nightly.main(["docs"], project, lambda root, given: True) == 0  # a note is no change
    assert rows(project)["docs"] == f"1 | {date.today()} | {head[:10]}"


@pytest.mark.parametrize("when", ["before", "while"])
def test_what_passes_on_a_changed_tree_is_not_noted(project, when, capsys):
    change = lambda: (project / "tests/cli/test_one.py").write_text("assert True")
    before = rows(project)
    if when == "before":
        change()
    assert nightly.main(["cli"], project, lambda root, given: when == "before" or change() > 0) == 0
    assert rows(project) == before
    assert "not noted" in capsys.readouterr().out


def test_a_part_that_fails_is_not_noted_and_the_others_are_run(project, capsys):
    before = rows(project)
    assert nightly.main([], project, lambda root, given: "tests/docs/test_one.py" in given) == 1
    assert (rows(project)["cli"], rows(project)["docs"][:2]) == (before["cli"], "1 ")
    out = capsys.readouterr().out
    assert "part cli FAILED" in out
    assert "part docs passed" in out
    assert "part theory has no tests" in out


def test_an_unknown_part_is_one_line(capsys):
    assert nightly.main(["cli", "nonsense"]) == 2
    assert capsys.readouterr().err.startswith("nonsense: no part; needed some of theory, ")


@pytest.mark.parametrize(("profile", "passes"), [("nightly", True), ("dev", False)])
def test_tests_are_run_in_the_nightly_profile(tmp_path, monkeypatch, profile, passes):
    code = (
        f"import os, sys; sys.exit([os.environ['HYPOTHESIS_PROFILE'], *sys.argv[1:]] != ['{profile}', 'test_one.py'])"
    )
    assert nightly.COMMAND[:2] == ("-m", "pytest")
    monkeypatch.setitem(nightly.tested.__globals__, "COMMAND", ("-c", code))
    assert nightly.tested(tmp_path, ["test_one.py"]) is passes

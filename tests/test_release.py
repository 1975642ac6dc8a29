"""The release check: each fault that can be read is found, and the files of this commit agree with each other."""

import datetime
import doctest
import importlib.util
import subprocess
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parents[1]
SPEC = importlib.util.spec_from_file_location("release_check", ROOT / ".ci" / "release_check.py")
CHECK = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(CHECK)
TODAY = datetime.date(2026, 11, 30)
LOG = "# Changelog\n\nText.\n\n## [0.2.0] - 2026-11-30\n\n### Added\n\n- A.\n\n## [0.1.0] - 2026-11-01\n\n- B.\n"


def texts(**others):
    """Files that all have version 0.2.0, but for some of them."""
    lines = {
        "ndtheory/__init__.py": '__version__ = "{}"',
        "verification/__init__.py": '__version__ = "{}"',
        "CITATION.cff": "cff-version: 1.2.0\nversion: {}",
        "docs/cite.md": "  version = {{{}}},",
        "docs/install.md": "`pip install ndtheory-{}-py3-none-any.whl`",
    }
    return {name: line.format(others.get(name, "0.2.0")) for name, line in lines.items()}


def test_the_examples_of_its_functions_hold():
    found = doctest.testmod(CHECK)
    assert (found.failed, found.attempted > 0) == (0, True)


def test_files_of_one_version_agree():
    assert set(texts()) == set(CHECK.VERSIONS)
    assert list(CHECK.versions(texts())) == []


@pytest.mark.parametrize("name", CHECK.VERSIONS)
@pytest.mark.parametrize("other", ["0.1.9", "0.2.0.dev1", ""])
def test_each_file_that_has_another_version_or_none_is_found(name, other):
    found = list(CHECK.versions(texts(**{name: other})))
    assert found != []
    assert all(line.split(":")[0] in CHECK.VERSIONS for line in found)


def test_a_version_twice_in_a_file_is_found():
    twice = texts() | {"CITATION.cff": "version: 0.2.0\nversion: 0.2.0"}
    assert list(CHECK.versions(twice)) == ["CITATION.cff: 2 versions"]


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("", "", None),
        ("[0.2.0] - 2026-11-30", "[Unreleased]", "the first section is [Unreleased]"),
        ("[0.2.0] - 2026-11-30", "[0.2.0]", "the first section is [0.2.0]"),
        ("[0.2.0] - 2026-11-30", "[0.3.0] - 2026-11-30", "the first section is [0.3.0]"),
        ("2026-11-30", "2026-11-31", "2026-11-31 is no date"),
        ("2026-11-30", "2026-12-01", "is in the future"),
        ("- A.", "Nothing.", "nothing is listed"),
        (LOG, "", "the first section is missing"),
    ],
)
def test_a_changelog_without_a_dated_section_for_this_version_is_found(old, new, found):
    lines = list(CHECK.changelog(LOG.replace(old, new) if old else LOG, "0.2.0", TODAY))
    assert len(lines) == (found is not None)
    assert found is None or found in lines[0]


def test_the_day_of_the_citation_is_that_of_the_changelog_once_there_is_one():
    assert list(CHECK.citation("date-released: 2026-11-30\n", LOG)) == []
    assert list(CHECK.citation("date-released: '2026-11-30'\n", LOG)) == []
    assert list(CHECK.citation("date-released: 2026-11-01\n", LOG)) != []
    assert list(CHECK.citation("version: 0.2.0\n", LOG)) == [
        "CITATION.cff: date-released is missing, needed 2026-11-30"
    ]
    assert list(CHECK.citation("", "## [Unreleased]\n")) == []


def test_addresses_that_are_not_set_are_found():
    assert list(CHECK.urls({"urls": dict.fromkeys(CHECK.NEEDED_URLS, "https://example.org")})) == []
    assert len(list(CHECK.urls({}))) == len(CHECK.NEEDED_URLS)


def test_a_commit_needs_its_tag_and_a_clean_tree():
    assert list(CHECK.tag("0.2.0", "v0.2.0\nother\n", "")) == []
    assert list(CHECK.tag("0.2.0", "v0.2.0.1\n", "")) == ["git: this commit has no tag v0.2.0"]
    assert list(CHECK.tag("0.2.0", "v0.2.0\n", " M README.md\n")) == ["git: the tree is not this commit: README.md"]


def test_the_files_of_this_commit_agree_with_each_other():
    log, cff = ((ROOT / name).read_text("utf-8") for name in ("CHANGELOG.md", "CITATION.cff"))
    assert list(CHECK.versions({name: (ROOT / name).read_text("utf-8") for name in CHECK.VERSIONS})) == []
    assert list(CHECK.citation(cff, log)) == []


def test_what_is_left_to_set_before_a_release_is_in_the_list_of_contributing():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    left = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("## A release")[2]
    assert [line for line in CHECK.urls(project) if f"`{line.rpartition(' ')[2]}`" not in left] == []


def test_the_makefile_runs_it_and_a_fault_is_its_exit_status(monkeypatch, capsys):
    assert "\nrelease-check: $(VENV)/.docs\n\t$(BIN)/python .ci/release_check.py\n" in (ROOT / "Makefile").read_text(
        "utf-8"
    )
    monkeypatch.setattr(subprocess, "run", lambda *args, **options: SimpleNamespace(stdout=" M a\n", returncode=0))
    monkeypatch.setattr("sys.argv", ["release_check.py", "--quick"])
    assert CHECK.main() == 1
    assert "git: the tree is not this commit: a" in capsys.readouterr().out.splitlines()

"""No safeguard of a proof in doubles can be taken away without a test that fails; looked at by night."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from processes import environment
from safeguards.plan import MUTANTS, TESTS, Mutant, mutants
from strategies import AT_NIGHT

ROOT = Path(__file__).parents[2]


def test_each_mutant_changes_one_place():
    for mutant in mutants():
        assert (ROOT / mutant.module).read_text("utf-8").count(mutant.before) == 1, mutant.name
        assert mutant.before != mutant.after
    assert set(MUTANTS) == set(TESTS)


def shares() -> dict[str, tuple[int, int, int]]:
    """Safeguards of each module and of all: how many, how many a test defends, how many another one covers."""
    found = {}
    for name in (*MUTANTS, "all"):
        listed = [mutant for mutant in mutants() if name in (mutant.module, "all")]
        covered = sum(bool(mutant.covered) for mutant in listed)
        found[name] = len(listed), len(listed) - covered, covered
    return found


def test_the_page_on_proved_constants_shows_the_share_that_is_defended():
    text = (ROOT / "docs" / "verified.md").read_text("utf-8")
    rows = (
        text.split("| module | safeguards | defended | covered |\n|---|---|---|---|\n")[1].split("\n\n")[0].splitlines()
    )
    cells = [[cell.strip(" `") for cell in row.strip("|").split("|")] for row in rows]
    assert {name: tuple(map(int, counts)) for name, *counts in cells} == shares()


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The packages and the tests, to be changed."""
    folder = tmp_path_factory.mktemp("mutants")
    skipped = shutil.ignore_patterns("__pycache__", ".*")
    for name in ("fem1d2d", "ndtheory", "verification", "tests"):
        shutil.copytree(ROOT / name, folder / name, ignore=skipped)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def passes(folder: Path, tests: tuple[str, ...]) -> bool:
    """True if these tests pass on this copy, each with the same drawn cases."""
    env = environment(HYPOTHESIS_PROFILE="ci", PYTHONPATH=str(folder), PYTHONDONTWRITEBYTECODE="1")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", *tests]
    ended = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert ended.returncode in (0, 1), ended.stdout + ended.stderr
    return ended.returncode == 0


@pytest.mark.skipif(not AT_NIGHT, reason="a run of tests for each mutant: by night")
@pytest.mark.parametrize("module", MUTANTS)
def test_the_tests_of_a_module_pass_without_a_mutant(copy, module):
    assert passes(copy, TESTS[module])


@pytest.mark.skipif(not AT_NIGHT, reason="a run of tests for each mutant: by night")
@pytest.mark.parametrize("mutant", [each for each in mutants() if not each.covered], ids=lambda mutant: mutant.name)
def test_a_safeguard_that_is_taken_away_is_missed(copy, mutant: Mutant):
    path = copy / mutant.module
    text = path.read_text("utf-8")
    try:
        path.write_text(text.replace(mutant.before, mutant.after), "utf-8")
        assert not passes(copy, TESTS[mutant.module])
    finally:
        path.write_text(text, "utf-8")

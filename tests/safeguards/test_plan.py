"""No safeguard of a proof in doubles can be taken away without a test that fails; looked at by night."""

from __future__ import annotations

import pytest
from safeguards.drawn import ROOT, copied, status
from safeguards.plan import MUTANTS, TESTS, Mutant, mutants
from strategies import AT_NIGHT


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
    """The project, to be changed."""
    return copied(tmp_path_factory.mktemp("mutants"))


@pytest.mark.skipif(not AT_NIGHT, reason="a run of tests for each mutant: by night")
@pytest.mark.parametrize("module", MUTANTS)
def test_the_tests_of_a_module_pass_without_a_mutant(copy, module):
    assert status(copy, TESTS[module]) == 0


@pytest.mark.skipif(not AT_NIGHT, reason="a run of tests for each mutant: by night")
@pytest.mark.parametrize("mutant", [each for each in mutants() if not each.covered], ids=lambda mutant: mutant.name)
def test_a_safeguard_that_is_taken_away_is_missed(copy, mutant: Mutant):
    path = copy / mutant.module
    text = path.read_text("utf-8")
    try:
        path.write_text(text.replace(mutant.before, mutant.after), "utf-8")
        assert status(copy, TESTS[mutant.module]) == 1
    finally:
        path.write_text(text, "utf-8")

"""The page on what to do if it does not converge has a row for each outcome, in the words that the program prints."""

import re

import pytest

import verification as vf
from verification.algorithm.loop import Outcome


def test_each_outcome_but_convergence_has_a_row_with_the_words_of_the_library(builder):
    rows = [row.split(" | ") for row in builder.remedies.table().splitlines()[2:]]
    said = [re.fullmatch(r"\| `(.*)`", first)[1] for first, _, _ in rows]
    for outcome in {*Outcome} - {Outcome.CONVERGED}:
        assert any(words.startswith(outcome.words) for words in said)
    assert (
        re.search(r"--(?!-)", re.sub(r"`[^`]*`", "", builder.remedies.table().partition("\n|---|---|---|\n")[2]))
        is None
    )
    run = vf.run(vf.example("two-bars"), theta="0.6")
    why, _, advice = run.remedy.sentence().partition("; ")
    numbers = lambda text: re.sub(r"[\d.]+", "0", text)
    (row,) = [row for row in rows if numbers(row[0]) == f"| `{numbers(why)}`"]
    assert row[1].partition(" ")[0] == advice.partition(" ")[0] == "try"


def test_a_case_that_converges_is_refused(builder, monkeypatch):
    monkeypatch.setattr(builder.remedies, "CASES", (*builder.remedies.CASES, ({}, "")))
    with pytest.raises(ValueError, match="needed a run that does not converge"):
        builder.remedies.table()


def test_an_outcome_without_a_case_is_refused(builder, monkeypatch):
    monkeypatch.setattr(builder.remedies, "CASES", builder.remedies.CASES[:-1])
    with pytest.raises(ValueError, match="there is none for diverged"):
        builder.remedies.table()

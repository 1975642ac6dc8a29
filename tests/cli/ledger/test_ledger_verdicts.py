"""Verdicts against the recorded ones, and what a premise that fails does to those that lean on it."""

import json
from dataclasses import replace

import pytest
from ledger_calls import RAW, READ, STATEMENTS, one_line, wide

from verification import ledger
from verification.ledger import Evidence, rows


@pytest.fixture
def found(monkeypatch):
    """``found({"5.18": False})``: all that is found is exact, and what a statement claims holds unless it is named."""

    def use(holds):
        def gather(ids, level, watch):
            return {
                id: [Evidence(method="symbolic", of="printed", holds=holds.get(id, True), text="decided")] for id in ids
            }

        monkeypatch.setattr("verification.ledger.sources.SOURCES", {"exact arithmetic": gather})

    return use


@pytest.fixture
def record(monkeypatch):
    """Other recorded verdicts."""
    recorded = rows.recorded()

    def use(changes=None, *, empty=False):
        verdicts = ({} if empty else recorded) | (changes or {})
        monkeypatch.setattr(rows, "recorded", lambda: verdicts)

    return use


def leaning_on(id):
    """Every statement whose proof uses this one, directly or not."""
    reached = {id}
    while more := {s.id for s in STATEMENTS.values() if reached & set(s.leans_on)} - reached:
        reached |= more
    return reached - {id}


# --- the recorded verdicts ---


@pytest.mark.parametrize("options", [[], ["--json"]], ids=["screen", "json"])
def test_a_verdict_that_differs_from_the_recorded_one_gives_1_and_is_named(call, record, options):
    record({READ: "NUMERICAL"})
    answer = call("verify", READ, *options)
    assert (answer.status, answer.err) == (1, "")
    if options:
        (row,) = answer.document["statements"]
        assert (row["id"], row["verdict"], row["recorded"]) == (READ, "ASSUMED", "NUMERICAL")
    else:
        assert f"{READ}  " in answer.out
        assert "ASSUMED (recorded: NUMERICAL)" in one_line(answer.out)


def test_one_changed_row_among_many_is_named_by_the_summary(call, kept):
    kept(lambda row: replace(row, recorded="NUMERICAL") if row.statement.id == "5.30" else row)
    answer = call("verify")
    assert answer.status == 1
    section = answer.out.partition("WHAT HAS CHANGED?\n")[2].partition("\n\n")[0].splitlines()
    assert [line.split() for line in section] == [["statement", "recorded", "now"], ["5.30", "NUMERICAL", "REPAIRED"]]
    assert wide(answer) == []


def test_a_change_that_was_not_asked_for_is_none(call, record):
    record({"5.30": "NUMERICAL"})
    assert call("verify", READ).status == 0


def test_a_verdict_that_was_never_recorded_is_a_change_and_no_none(call, record):
    record(empty=True)
    answer = call("verify", READ)
    assert answer.status == 1
    assert RAW.findall(answer.out) == []


def test_bad_input_wins_over_a_changed_row(call, record, tmp_path):
    record({READ: "NUMERICAL"})
    (tmp_path / "ledger.md").write_text("mine", encoding="utf-8")
    assert call("verify", READ, "-o", tmp_path).complaint


def test_a_changed_row_is_written_all_the_same(call, record, tmp_path):
    record({READ: "NUMERICAL"})
    assert call("verify", READ, "-o", tmp_path).status == 1
    assert json.loads((tmp_path / "ledger.json").read_text("utf-8"))["statements"][0]["recorded"] == "NUMERICAL"


def test_the_calculator_says_of_the_printed_proof_what_is_recorded(call, monkeypatch):
    small_m = ["bounds", "--m", "1/2", "--M", "2", "--CR", "1", "--CK", "1/100"]
    assert f"whose verdict in the ledger is {rows.recorded()['5.30']}" in one_line(call(*small_m).out)
    other = rows.recorded() | {"5.30": "NUMERICAL"}
    monkeypatch.setattr("ndtheory.statements.recorded", lambda: other)
    answer = call(*small_m)
    assert "whose verdict in the ledger is NUMERICAL" in one_line(answer.out)
    assert wide(answer) == []
    assert "in the ledger" not in call("bounds", "--m", "2", "--M", "4", "--CR", "1", "--CK", "1/100").out


# --- premises ---


def test_whatever_leans_on_a_refuted_statement_is_inconclusive(found):
    found({"5.18": False})
    verdicts = {row.statement.id: row.verdict for row in ledger.verify().rows}
    assert verdicts["5.18"] == "REFUTED"
    direct = [s.id for s in STATEMENTS.values() if "5.18" in s.leans_on]
    assert direct
    assert {verdicts[id] for id in direct} == {"INCONCLUSIVE"}
    found({})
    before = {row.statement.id: row.verdict for row in ledger.verify().rows}
    changed = {id for id, verdict in verdicts.items() if verdict != before[id]}
    assert {"5.18", *direct} <= changed <= {"5.18", *leaning_on("5.18")}


@pytest.mark.parametrize("premise", ["5.18", "4.3", "5.12"])
@pytest.mark.parametrize("holds", [False, None], ids=["refuted", "undecided"])
def test_nothing_is_proved_from_what_is_inconclusive_for_want_of_a_premise(found, premise, holds):
    found({premise: holds})
    verdicts = {row.statement.id: row.verdict for row in ledger.verify().rows}
    assert verdicts[premise] == ("REFUTED" if holds is False else "INCONCLUSIVE")
    assert [id for id in leaning_on(premise) if verdicts[id] != "INCONCLUSIVE"] == []


@pytest.mark.parametrize("verdict", ["REFUTED", "INCONCLUSIVE"])
def test_a_premise_that_was_not_checked_now_counts_as_recorded(call, found, record, verdict):
    found({})
    record({"5.18": verdict})
    answer = call("verify", "5.29")
    assert answer.status == 1
    screen = one_line(answer.out)
    assert "INCONCLUSIVE (recorded: " in screen
    assert f"reading: undecided. it uses 5.18 ({verdict})" in screen
    (row,) = call("verify", "5.29", "--json").document["statements"]
    assert (row["verdict"], row["method"]) == ("INCONCLUSIVE", "reading")
    assert row["evidence"][-1]["holds"] is None


def test_a_premise_that_is_checked_now_counts_as_found_and_not_as_recorded(found, record):
    found({})
    record({"5.18": "REFUTED"})
    assert {row.verdict for row in ledger.verify(["5.18", "5.29"]).rows} <= {"PROVED", "REPAIRED"}

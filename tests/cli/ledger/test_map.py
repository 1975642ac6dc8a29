"""`verify --map`: a picture of what leans on what, from recorded verdicts unless a check is asked for."""

from dataclasses import replace
from xml.etree import ElementTree

import pytest
from ledger_calls import EXACT, READ, STATEMENTS

import verification as vf
from ndtheory.statements import proof_of
from verification import ledger
from verification.semidefinite import losses


@pytest.fixture
def unchecked(monkeypatch):
    """Nothing may be checked."""

    def refuse(*arguments, **options):
        raise AssertionError("a statement was checked")

    monkeypatch.setattr(ledger, "verify", refuse)


def shown(path):
    return {node.get("data-id") for node in ElementTree.parse(path).iter() if node.get("data-id")}


def words(path):
    return " ".join(node.text or "" for node in ElementTree.parse(path).iter() if node.tag.endswith("}text"))


def test_a_map_of_some_statements_shows_what_they_lean_on_and_checks_nothing(call, unchecked, tmp_path):
    target = tmp_path / "proof.svg"
    answer = call("verify", "5.30", "C1", "--map", target)
    assert (answer.status, answer.err) == (0, "")
    assert shown(target) == set(proof_of(["5.30", "C1"]))
    assert [path.name for path in tmp_path.iterdir()] == ["proof.svg"]
    verdicts = [STATEMENTS[id].verdict for id in shown(target)]
    assert answer.out.startswith(f"{target}: a map of {len(verdicts)} statements, with their recorded verdicts: ")
    for verdict in set(verdicts):
        assert f"{verdicts.count(verdict)} {verdict}" in answer.out


def test_a_map_without_ids_shows_every_statement(call, unchecked, tmp_path):
    assert call("verify", "--map", tmp_path / "all.svg").status == 0
    assert shown(tmp_path / "all.svg") == set(STATEMENTS)


def test_parts_of_an_id_are_drawn_together(call, unchecked, tmp_path):
    assert call("verify", "prop-5.6", "--map", tmp_path / "four.svg").status == 0
    asked = [n for n in ElementTree.parse(tmp_path / "four.svg").iter() if n.get("class") == "node asked"]
    assert {node.get("data-id") for node in asked} == {f"prop-5.6.{i}" for i in range(1, 5)}


def test_the_legend_names_the_problem_its_unit_and_the_losses(call, unchecked, tmp_path):
    assert call("verify", "5.31", "--map", tmp_path / "map.svg").status == 0
    text = words(tmp_path / "map.svg")
    pair = vf.build(vf.example("section6"))
    found = losses.locate(pair, vf.measure(pair))
    assert "Section 6" in text
    assert "in MPa" in text
    for loss in (*found.friction, *found.lipschitz):
        assert f"{loss.label} {loss.decades:.1f}" in text


def test_a_map_is_written_again_over_itself_and_over_nothing_else(call, unchecked, tmp_path):
    target = tmp_path / "map.svg"
    assert call("verify", READ, "--map", target).status == 0
    first = target.read_bytes()
    assert call("verify", READ, "--map", target).status == 0
    assert target.read_bytes() == first
    target.write_text("<svg/>", encoding="utf-8")
    assert (
        "not written by this program; needed another folder or name (--map)"
        in call("verify", READ, "--map", target).complaint
    )
    assert target.read_text("utf-8") == "<svg/>"


@pytest.mark.parametrize(
    ("name", "needed"),
    [("map.png", "needed a name ending in .svg"), ("none/map.svg", "in a folder that exists (--map)")],
)
def test_a_name_that_no_map_can_have_is_refused(call, unchecked, tmp_path, name, needed):
    assert needed in call("verify", READ, "--map", tmp_path / name).complaint
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("extra", [["--level", "quick"], ["--json"], ["-o", "ledger"]])
def test_with_another_option_the_statements_are_checked_too(call, tmp_path, monkeypatch, extra):
    monkeypatch.chdir(tmp_path)
    alone = call("verify", EXACT, *extra)
    both = call("verify", EXACT, *extra, "--map", "map.svg")
    assert (both.status, both.out) == (alone.status, alone.out)
    drawn = f"map.svg: a map of {len(proof_of([EXACT]))} statements, 1 as found now, others as recorded: "
    assert (drawn in both.err) == (extra != ["--json"])
    assert shown(tmp_path / "map.svg") == set(proof_of([EXACT]))


def test_a_map_shows_the_verdict_that_was_found(call, kept, whole, tmp_path):
    kept(lambda row: replace(row, verdict="REFUTED") if row.statement.id == "5.12" else row)
    answer = call("verify", "5.12", "--level", "quick", "--map", tmp_path / "map.svg")
    assert answer.status == 1
    titles = {n.get("data-id"): n[0].text for n in ElementTree.parse(tmp_path / "map.svg").iter() if n.get("data-id")}
    assert titles["5.12"].endswith(": REFUTED")
    assert titles["2.3"].endswith(f": {STATEMENTS['2.3'].verdict}")

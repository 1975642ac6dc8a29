"""certify: a certificate is written and checked again, and bad input ends in one line."""

import json
import re

import pytest
from complaints import assert_names
from problem_list import SMALL, edited

import verification as vf
from ndtheory import __version__


@pytest.fixture
def written(call, tmp_path):
    """A problem file and its certificate."""
    file, target = tmp_path / "small.toml", tmp_path / "certificate.json"
    file.write_text(SMALL, encoding="utf-8")
    return file, target, call("certify", file, "-o", target)


def test_a_certificate_is_written_checked_and_held_against_its_problem(call, written):
    file, target, answer = written
    assert answer.status == 0
    assert "it contracts" in " ".join(answer.out.split())
    assert f"Next: ndtheory certify --check {target}" in answer.out
    document = json.loads(target.read_text(encoding="utf-8"))
    assert (document["schema"], document["version"], document["kind"]) == (
        "ndtheory.certificate/1",
        __version__,
        "contraction",
    )
    again = call("certify", file, "--json").document
    assert again["claim"] == document["claim"]
    alone, held = call("certify", "--check", target), call("certify", "--check", target, file)
    assert (alone.status, held.status) == (0, 0)
    assert "ACCEPTED" in alone.out
    assert "not compared" in alone.out
    assert f"Thebodiesarethoseof{file}" in "".join(held.out.split())  # a long path is folded
    shown = (answer.out + alone.out).replace(str(target), "certificate.json")
    assert max(map(len, shown.splitlines())) <= 80


def test_exact_divides_the_pieces_and_shows_the_proved_factor_beside_the_attained_one(call, tmp_path):
    file, target = tmp_path / "section6.toml", tmp_path / "tree.json"
    file.write_text(call("example", "section6-60").out, encoding="utf-8")
    answer = call("certify", file, "--theta", "0.7", "--exact", "-o", target)
    assert answer.status == 0
    said = " ".join(answer.out.split())
    for words in ("at most, for all loads", "divided into 2 sets"):
        assert words in said
    proved, attained = map(float, re.search(r"Proved factor ([0-9.]+), attained ([0-9.]+) by", said).groups())
    assert 0.5098 < attained < proved < 1.001 * attained
    assert call("certify", "--check", target).status == 0
    tree = json.loads(target.read_text(encoding="utf-8"))["claim"]["multipliers"]
    assert (tree["divided"], len(tree["cases"])) == ("signs", 2)


def test_a_certificate_of_other_bodies_or_of_a_false_claim_ends_with_1(call, written):
    file, target, _ = written
    assert call("certify", "--check", target, file, "--swap-roles").status == 1
    assert call("certify", "--check", target, file, "--set", "body1.young=7.1e4").status == 1
    assert "received no FILE" in call("certify", "--check", target, "--set", "body1.young=7.1e4").complaint
    document = json.loads(target.read_text(encoding="utf-8"))
    document["claim"]["factor"] = "1/10"
    target.write_text(json.dumps(document), encoding="utf-8")
    answer = call("certify", "--check", target)
    assert answer.status == 1
    assert "REFUSED" in answer.out
    assert call("certify", "--check", target, "--json").document["accepted"] is False


def test_where_contraction_is_not_proved_a_line_says_so_and_nothing_is_written(call, tmp_path):
    file, target = tmp_path / "rough.toml", tmp_path / "certificate.json"
    file.write_text(edited(SMALL, {"contact.friction": "5"}), encoding="utf-8")
    answer = call("certify", file, "-o", target)
    assert (answer.status, answer.out) == (1, "")
    assert_names(answer.err.splitlines()[-1], str(file), "no certificate", "k = 5")
    assert not target.exists()
    same = call("certify", file, "-o", target, "--json")
    document = same.document
    assert (same.status, same.err) == (1, answer.err)
    assert (document["schema"], document["command"], document["file"]) == ("ndtheory.failure/1", "certify", str(file))
    assert (document["outcome"], document["problem"]) == ("not proved", vf.load(file).to_dict())
    assert "k = 5" in document["error"]
    assert not target.exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], ["FILE", "--check"]),
        (["--check", "small.toml"], ["small.toml: needed a certificate, a JSON document as"]),
        (["--check", "none.json"], ["none.json"]),
        (["--check", "list.json"], ["list.json", "schema"]),
        (["--check", "empty.json"], ["empty.json", "contraction", "discrete"]),
        (["--check", "list.json", "--theta", "0.5"], ["--theta", "--check"]),
        (["--check", "list.json", "--continuum"], ["--continuum", "--check"]),
        (["small.toml", "--continuum", "--edition", "lmi"], ["--edition", "--continuum"]),
        (["small.toml", "--exact", "--edition", "lmi"], ["--exact", "--edition"]),
        (["--continuum"], ["FILE"]),
        (["small.toml", "--continuum", "-o", "proof.txt"], ["proof.txt", ".json"]),
        (["small.toml", "-o", "nowhere/proof.json"], ["nowhere/proof.json", "folder"]),
        (["small.toml", "-o", "list.json"], ["list.json", "not written by this program"]),
        (["small.toml", "--theta", "2"], ["theta", "2"]),
        (["bars.toml"], ["dimension", "plane"]),
        (["local.toml"], ["contact", "local"]),
        (["small.toml", "--edition", "printed"], ["--edition", "printed"]),
    ],
)
def test_bad_input_ends_in_one_line(arguments, said, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    local = edited(SMALL, {"contact.law": '"local"', "contact.radius": None})
    (tmp_path / "local.toml").write_text(local, encoding="utf-8")
    (tmp_path / "list.json").write_text("[]", encoding="utf-8")
    (tmp_path / "empty.json").write_text('{"schema": "ndtheory.certificate/1"}', encoding="utf-8")
    (tmp_path / "bars.toml").write_text(call("example", "two-bars").out, encoding="utf-8")
    assert_names(call("certify", *arguments).complaint, *said)

"""The ledger as a command: its help, what it refuses, and which rows it gives."""

import os
import shlex

import pytest
from ledger_calls import NAMED, READ, SOME, STATEMENTS, WHOLE, one_line, wide

from verification import ledger


@pytest.fixture
def never(monkeypatch):
    """Nothing may be computed."""

    def check(*arguments, **options):
        raise AssertionError("computed")

    monkeypatch.setattr(ledger, "verify", check)


# --- help ---


def test_the_help_names_the_statuses_and_has_an_example_for_one_id_and_for_all(call):
    answer = call("verify", "--help")
    assert (answer.status, answer.err) == (0, "")
    examples = answer.out.partition("Examples:\n")[2].partition("\n\n")[0].splitlines()
    assert "ndtheory verify" in [line.strip() for line in examples]
    ids = [id for line in examples for id in shlex.split(line)[2:] if not id.startswith("-")]
    assert {"5.30"} <= set(ids)
    named = {id for id in ids if any(known == id or known.startswith(f"{id}.") for known in STATEMENTS)}
    assert set(ids) - named <= {"full", "ledger", "proof.svg"}
    assert "Exit status 1" in one_line(answer.out)
    assert all(option in answer.out for option in ("--level", "-o, --output", "--json"))
    assert wide(answer) == []
    assert call("verify", "-h") == answer


def test_the_list_of_commands_names_it(call):
    assert "\n  verify " in call("--help").out


# --- what is refused ---


@pytest.mark.parametrize(
    "id",
    [
        *["", " ", "5.99", "5.30 ", " 5.30", "(5.30)", "5,30", "5.30,5.31", "*", "all", "0", "x-", "C_7", "5.3\n0"],
        *["5.30\x1b[31m", "\N{GREEK SMALL LETTER THETA}", "\udcff", "%s", "../2.1", "5." + "3" * 5000],
    ],
    ids=ascii,
)
def test_an_unknown_id_is_refused_in_one_line_before_anything_is_computed(call, never, id):
    complaint = call("verify", id).complaint
    assert complaint.startswith("ndtheory verify: ")
    assert repr(id) in complaint or (len(id) > 1000 and repr(id)[:60] in complaint)
    assert len(complaint) < 500
    assert complaint.isprintable()
    _, _, offered = complaint.partition("similar: ")
    assert set(offered.split(", ")) <= set(STATEMENTS) if offered else complaint.endswith("`ndtheory verify` lists all")
    assert call("verify", id, "--json").complaint == complaint


@pytest.mark.parametrize("arguments", [["5.30", "5.99"], ["5.99", "5.30"], ["5.30", ""], ["5.30", "5.30", "5.99"]])
def test_one_unknown_id_among_known_ones_is_refused(call, never, arguments):
    assert repr("" if "" in arguments else "5.99") in call("verify", *arguments).complaint


@pytest.mark.parametrize(
    ("id", "meant"),
    [
        *[("c0", "C0"), ("c5", "C5"), ("C_k", "C_K"), ("H1", "h1"), ("LEMMA-5.3", "lemma-5.3"), ("A-B", "a-b")],
        *[("Prop-5.6.1", "prop-5.6.1"), ("X-HOMOGENEITY", "x-homogeneity"), ("5.30.", "5.30"), ("Eq-5.30", "5.30")],
    ],
)
def test_an_id_in_odd_case_is_refused_with_the_id_that_was_meant(call, never, id, meant):
    assert meant in call("verify", id).complaint.partition("similar: ")[2].split(", ")


def test_case_tells_no_two_ids_apart_that_a_reader_could_confuse():
    assert len({id.casefold() for id in STATEMENTS}) == len(STATEMENTS)


def test_the_name_of_a_statement_in_parts_stands_for_all_of_them(call, kept):
    screen = call("verify", "prop-5.6").out
    assert [line.split()[0] for line in screen.splitlines() if line.startswith("prop-5.6")] == [
        f"prop-5.6.{i}" for i in (1, 2, 3, 4)
    ]


def test_every_id_that_the_interface_names_is_known():
    assert {id for id in NAMED if id not in STATEMENTS and f"{id}.1" not in STATEMENTS} == set()


@pytest.mark.parametrize("level", ["", "Quick", "FULL", "fast", "1", "5.30"])
def test_a_level_that_is_none_is_refused_by_name(call, never, level):
    said = f"ndtheory verify: --level = {level}: needed one of quick, full"
    assert call("verify", "--level", level).complaint.startswith(said)


@pytest.mark.parametrize("option", ["--LEVEL", "--refine", "--theta", "--jsn"])
def test_an_option_that_is_none_is_refused_by_name(call, never, option):
    assert option in call("verify", "5.30", option).complaint


@pytest.mark.parametrize("folder", ["taken", "taken/ledger", "missing/../taken", ""])
def test_an_output_folder_that_cannot_be_one_is_refused_before_anything_is_computed(
    call, never, tmp_path, monkeypatch, folder
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "missing").mkdir()
    (tmp_path / "taken").write_text("a file", encoding="utf-8")
    assert "folder" in call("verify", READ, "-o", folder).complaint
    assert (tmp_path / "taken").read_text("utf-8") == "a file"


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a folder in which nobody can write")
def test_a_folder_in_which_nobody_can_write_is_refused_before_anything_is_computed(call, never):
    assert "/proc/self" in call("verify", READ, "-o", "/proc/self").complaint


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused_before_anything_is_computed(call, never, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    assert "locked" in call("verify", READ, "-o", tmp_path / "locked").complaint


@pytest.mark.parametrize("name", sorted(WHOLE))
@pytest.mark.parametrize("content", ["", "# My own notes\n", '{"schema": "another/1"}\n'])
def test_the_file_of_somebody_else_is_refused_by_name_and_left_alone(call, never, tmp_path, name, content):
    (tmp_path / name).write_text(content, encoding="utf-8")
    assert name in call("verify", "-o", tmp_path).complaint
    assert (tmp_path / name).read_text("utf-8") == content
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", sorted(WHOLE))
def test_a_folder_in_the_place_of_a_file_is_refused_by_name(call, never, tmp_path, name):
    (tmp_path / name).mkdir()
    assert name in call("verify", "-o", tmp_path).complaint


# --- which rows ---


def test_an_id_twice_is_checked_and_shown_once(call):
    once = call("verify", READ)
    assert once.status == 0
    assert call("verify", READ, READ) == once
    assert len(call("verify", READ, READ, "--json").document["statements"]) == 1


def test_rows_come_in_the_order_of_the_paper_however_they_are_typed(call, kept):
    answer = call("verify", *reversed(SOME), "--json").document
    assert [s["id"] for s in answer["statements"]] == [id for id in STATEMENTS if id in SOME]
    assert call("verify", *SOME, "--json").document == answer


def test_every_statement_has_one_row_and_none_has_changed(whole):
    assert [row.statement.id for row in whole.ledger.rows] == list(STATEMENTS)
    assert [row.statement.id for row in whole.ledger.changed] == []
    assert whole.ledger.whole


def test_what_is_told_on_the_way_is_a_share_that_grows_within_each_stage(whole):
    assert len({what for what, share in whole.told}) >= 2
    for what in {what for what, share in whole.told}:
        shares = [share for told, share in whole.told if told == what]
        assert all(0 <= share <= 1 for share in shares)
        assert shares == sorted(shares)

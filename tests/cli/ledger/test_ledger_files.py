"""What a ledger leaves in a folder: its document, its page, its errata and its verdicts."""

import json
import re

from ledger_calls import EXACT, RAW, READ, STATEMENTS, WHOLE

from verification.ledger import rows


def test_a_whole_ledger_leaves_four_files_and_says_where(call, kept, tmp_path):
    answer = call("verify", "-o", tmp_path / "new" / "ledger")
    assert answer.status == 0
    assert {path.name for path in (tmp_path / "new" / "ledger").iterdir()} == WHOLE
    assert answer.err == f"written: {tmp_path / 'new' / 'ledger'}\n"


def test_a_ledger_is_written_again_over_its_own_files(call, kept, tmp_path):
    assert call("verify", "-o", tmp_path).status == 0
    first = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert call("verify", "-o", tmp_path).status == 0
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == first


def test_some_rows_leave_the_ledger_and_no_errata(call, tmp_path):
    assert call("verify", READ, EXACT, "-o", tmp_path).status == 0
    assert {path.name for path in tmp_path.iterdir()} == {"ledger.json", "ledger.md"}
    assert all(f"`{id}`. " in (tmp_path / "ledger.md").read_text("utf-8") for id in (READ, EXACT))


def test_no_errata_of_another_ledger_stay_beside_some_rows(call, kept, tmp_path):
    """As no waterfall of an earlier run stays beside a comparison that has none."""
    assert call("verify", "-o", tmp_path).status == 0
    assert call("verify", READ, "-o", tmp_path).status == 0
    assert {path.name for path in tmp_path.iterdir()} == {"ledger.json", "ledger.md"}


def test_the_written_document_is_that_of_stdout(call, kept, tmp_path):
    answer = call("verify", "-o", tmp_path, "--json")
    assert answer.err == ""
    assert (tmp_path / "ledger.json").read_text("utf-8") == answer.out


def test_the_written_verdicts_are_the_recorded_ones(call, kept, tmp_path):
    call("verify", "-o", tmp_path)
    assert json.loads((tmp_path / "verdicts.json").read_text("utf-8"))["verdicts"] == rows.recorded()


def test_the_page_has_every_statement_with_its_verdict_and_evidence(call, kept, whole, tmp_path):
    call("verify", "-o", tmp_path)
    page = (tmp_path / "ledger.md").read_text("utf-8")
    entries = re.split(r"(?m)^### ", page)[1:]
    assert len(entries) == len(STATEMENTS)
    for row, entry in zip(whole.ledger.rows, entries, strict=True):
        assert f"\n`{row.statement.id}`. " in entry
        assert entry.splitlines()[0].endswith(f": {row.verdict}")
        assert len(re.findall(r"(?m)^- \*", entry)) == len(row.evidence)
        for e in row.evidence:
            for name, value in e.data.get("counterexample", {}).items():
                assert f"`{name} = {value}`" in entry


def test_the_sheets_show_no_raw_value_and_no_open_formula(call, kept, tmp_path):
    call("verify", "-o", tmp_path)
    for name in ("ledger.md", "errata.md"):
        text = (tmp_path / name).read_text("utf-8")
        assert RAW.findall(re.sub(r"\$[^$]*\$", "", text)) == []
        assert [line for line in text.splitlines() if line.count("$") % 2 or line.count("`") % 2] == []
        assert text.endswith("<!-- ndtheory verify -->\n")
        assert re.findall(r"(?m)[ \t]+$|\*\*Repaired:\*\*\s+\*\*|\*Read:\*\s*$", text) == []


def test_the_errata_name_every_fault_of_the_paper(call, kept, tmp_path):
    call("verify", "-o", tmp_path)
    errata = (tmp_path / "errata.md").read_text("utf-8")
    own = [s for s in STATEMENTS.values() if s.fault and not s.same_as]
    inherited = [s for s in STATEMENTS.values() if s.fault and s.same_as]
    assert errata.count("\n- **") == len(own)
    assert [s.id for s in own if f"- **{s.label}.** {s.wrong}" not in errata] == []
    assert [s.id for s in inherited if s.label not in errata.partition("The same fault in")[2]] == []


def test_the_page_and_the_screens_do_not_claim_what_a_row_has_not(call, kept, tmp_path):
    """Each repair is proved, say the errata: so each entry that has one is REPAIRED, and one without says so."""
    call("verify", "-o", tmp_path)
    ledger_rows = json.loads((tmp_path / "ledger.json").read_text("utf-8"))["statements"]
    assert [s["id"] for s in ledger_rows if s.get("repair") and s["verdict"] != "REPAIRED"] == []
    assert [s["id"] for s in ledger_rows if "fault" in s and not s["repair"] and s["verdict"] == "REPAIRED"] == []

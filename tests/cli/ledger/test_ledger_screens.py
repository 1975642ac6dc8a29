"""The screens of the ledger: 80 columns, no raw value, and formulas that keep their meaning."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import pytest
from ledger_calls import EXACT, RAW, STATEMENTS, TEXTS, VERDICTS, one_line, wide

from verification.ledger.sections import plain

# --- screens ---


@pytest.mark.parametrize("id", STATEMENTS)
def test_the_screen_of_a_statement_fits_80_columns_changed_or_not_and_shows_no_raw_value(call, kept, id):
    answer = call("verify", id)
    assert (answer.status, answer.err) == (0, "")
    assert wide(answer) == []
    assert RAW.findall(answer.out) == []
    assert not set("\\$") & set(answer.out)
    assert answer.out.splitlines()[0].startswith(f"{id}  ")
    # no label stands without its text
    assert re.findall(r"(?m)^ +(?:repaired|because|uses):?$", answer.out) == []
    kept(lambda row: replace(row, recorded="REPAIRED" if row.verdict == "INCONCLUSIVE" else "INCONCLUSIVE"))
    answer = call("verify", id)
    assert answer.status == 1
    assert "recorded: " in one_line(answer.out)
    assert wide(answer) == []


@pytest.mark.parametrize("ids", [(), ("5.30",)], ids=["summary", "row"])
def test_the_screen_says_where_verdicts_are_defined(call, kept, ids):
    assert "What each verdict means: docs/glossary.md, under verdict." in call("verify", *ids).out


def test_the_screen_of_figure_10_says_that_only_a_reading_which_departs_from_the_text_shows_it(call, kept):
    assert "holds only in readings that depart from the text" in one_line(call("verify", "fig-10").out)


def test_the_screen_shows_what_is_claimed_what_is_wrong_and_what_was_found(call, kept, whole):
    screen = one_line(call("verify", "5.30").out)
    row = next(row for row in whole.ledger.rows if row.statement.id == "5.30")
    s = row.statement
    for text in (s.title, s.claims, s.wrong, s.repair, s.proof, *(e.text for e in row.evidence)):
        assert one_line(plain(text)) in screen
    assert f"uses {', '.join(s.leans_on)}" in screen
    assert screen.count("kappa = 10000") == 1


@pytest.mark.parametrize("id", [EXACT, "5.30", "2.1", "sec-6.3"])
def test_the_screen_of_a_statement_ends_with_what_to_type_next(call, kept, id):
    lines = call("verify", id).out.splitlines()
    assert lines[-1].startswith("Next: ndtheory ")
    assert call(*shlex.split(lines[-1])[2:]).status == 0


def test_the_summary_is_one_screen_that_counts_every_row(call, kept, whole):
    answer = call("verify")
    lines = answer.out.splitlines()
    assert (answer.status, answer.err) == (0, "")
    assert wide(answer) == []
    assert len(lines) <= 40
    assert RAW.findall(answer.out) == []
    assert [line for line in lines if line.isupper() and line.endswith("?")] == [
        "HOW MANY STATEMENTS HOLD?",
        "WHAT IS WRONG IN THE PAPER?",
    ]
    counts = {line.split()[0]: int(line.split()[1]) for line in lines if line[2:].split(" ")[0] in VERDICTS}
    assert counts == whole.ledger.counts
    assert sum(counts.values()) == len(STATEMENTS)


def test_the_summary_names_every_faulty_statement_once(call, kept):
    section = call("verify").out.partition("WHAT IS WRONG IN THE PAPER?\n")[2].partition("\n\n")[0]
    named = [id for part in re.split(r"(?m)^  (?=\w)", section)[1:] for id in part.partition(":")[2].split()]
    assert sorted(id.rstrip(",") for id in named) == sorted(s.id for s in STATEMENTS.values() if s.fault)


def test_the_last_line_of_the_summary_is_a_command_that_is_accepted(call, kept):
    last = call("verify").out.splitlines()[-1]
    assert last.startswith("Next: ndtheory verify ")
    assert call(*shlex.split(last)[2:]).status == 0


def test_the_level_reaches_the_checks_and_the_screen(call, kept):
    assert call("verify").out.splitlines()[0].endswith("| quick")
    assert call("verify", "--level", "full").out.splitlines()[0].endswith("| full")
    assert call("verify", "--level", "full", "--json").document["level"] == "full"


# --- formulas on a terminal ---


@pytest.mark.parametrize(
    "wrong",
    [
        *(r"[\\${}]", r"\b(?:frac|arrow|leftarrow|rightarrow|tilde|mathrm|cdot|ldots)\b"),  # TeX that is left
        r",\)|\(\)|\(,",  # an argument that was lost
    ],
)
def test_no_text_of_a_statement_is_garbled_on_a_terminal(wrong):
    texts = {(id, name): plain(getattr(STATEMENTS[id], name)) for id in STATEMENTS for name in TEXTS}
    assert {key: text for key, text in texts.items() if re.search(wrong, text)} == {}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (r"$m^{3/2}$", r"$\frac{m^3}{2}$"),
        (r"$\frac{a+b}{2m}d$", r"$\frac{a+b}{2md}$"),
        (r"$\frac{C_KC_T}{MC_R}$", r"$\frac{C_KC_T}{M}C_R$"),
        (r"$\frac{C_K}{m^2}(a+b)$", r"$\frac{C_K}{m^2(a+b)}$"),
        (r"$\frac{x+\sqrt m y}{m}$", r"$x+\sqrt m ym$"),
        (r"$\frac{a+\frac{b}{c}}{d}$", r"$a+\frac{b}{c}d$"),
    ],
)
def test_two_formulas_that_differ_are_not_shown_alike(one, other):
    assert re.sub(r"\s", "", plain(one)) != re.sub(r"\s", "", plain(other))


@pytest.mark.parametrize(
    ("tex", "shown"),
    [
        (r"$\sqrt{\frac{C_K}{m}}$", "sqrt(C_K/m)"),
        (r"$u \leftarrow u - v$", "u <- u - v"),
        (r"$v \mapsto v_T$", "v -> v_T"),
        (r"$\theta \le \frac12$", "theta <= 1/2"),
        (r"$\langle g, v\rangle$", "<g, v>"),
        (r"plain words, (5.30).", "plain words, (5.30)."),
        ("", ""),
    ],
)
def test_a_formula_keeps_its_meaning_on_a_terminal(tex, shown):
    assert plain(tex) == shown


@pytest.mark.parametrize(
    ("figure", "options", "kept"),
    [("fig10", ["-o", "out"], "out/rows.sqlite"), ("fig10", [], None), ("fig5", ["-o", "out"], None)],
)
def test_an_interrupted_reproduction_says_where_its_rows_are(call, monkeypatch, tmp_path, figure, options, kept):
    """Figure 5 has no runs whose rows could be kept."""

    def interrupted(*names, store, **more):
        assert store == (None if kept is None else Path(kept))
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("verification.reproduce.reproduce", interrupted)
    answer = call("reproduce", figure, *options)
    there = f"its rows are in {kept}, and the same command goes on from there"
    ended = f"interrupted: {there if kept else '-o keeps rows of figures 10 to 12'}"
    assert (answer.status, answer.err.splitlines()[-1]) == (130, ended)

"""The ledger as a command: what it refuses, its screens, its document, its files, and the verdicts it will not give."""

import json
import math
import os
import re
import shlex
import signal
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction

import pytest
from processes import ended

import ndtheory
from ndtheory.statements import statements
from verification import ledger
from verification.cli.tex import plain
from verification.ledger import Evidence, rows
from verification.ledger.evidence import settle

STATEMENTS = statements()

VERDICTS = {"PROVED", "REPAIRED", "REFUTED", "NUMERICAL", "ASSUMED", "INCONCLUSIVE"}
METHODS = {"symbolic", "dimension", "discrete", "reading"}
OF = {"printed", "step", "repaired"}
KEYS = {"id", "label", "kind", "title", "verdict", "method", "evidence", "note"}
WHOLE = {"ledger.json", "ledger.md", "errata.md", "verdicts.json"}
TEXTS = ["title", "claims", "wrong", "repair", "proof", "reading", "note", "label"]

#: Ids whose evidence costs next to nothing: read, computed exactly, seen at solutions.
READ, EXACT, SEEN = "5.9", "x-homogeneity", "2.4"

#: One of every source of evidence, and what leans on what.
SOME = [READ, "C5", EXACT, "5.30", SEEN, "fig-5"]

#: Ids that the interface names.
NAMED = [
    "2.1",
    "prop-5.6.2",
    "lemma-5.3",
    "thm-5.9",
    "C5",
    "case-2-1",
    "rem-5.10",
    "fig-10",
    "sec-6.2",
    "x-homogeneity",
]

#: What a screen or a sheet shows where a program forgot to write a text.
RAW = re.compile(r"\bNone\b|Fraction\(|\bnan\b|\binf\b|[=:] (?:True|False)\b(?!,)|[\[{]'|array\(|float64")

HEAVY = ["numpy", "scipy", "matplotlib", "cvxpy", "clarabel", "rich", "sympy"]

CALL = "import sys; from verification.cli import main; sys.exit(main())"


@dataclass(frozen=True)
class Whole:
    """A whole ledger, and what was told while it was made."""

    ledger: ledger.Ledger
    told: list[tuple[str, float]]


@pytest.fixture(scope="module")
def whole():
    told = []
    return Whole(ledger.verify(watch=lambda what, share: told.append((what, share))), told)


@pytest.fixture
def kept(whole, monkeypatch):
    """The command on the rows of the whole ledger, computed once; ``kept(change)`` puts other rows in their place."""

    def use(change=lambda row: row):
        def answer(ids=(), *, level="quick", watch=None):
            chosen = tuple(change(row) for row in whole.ledger.rows if not ids or row.statement.id in ids)
            return replace(whole.ledger, rows=chosen, level=level)

        monkeypatch.setattr(ledger, "verify", answer)

    use()
    return use


@pytest.fixture
def never(monkeypatch):
    """Nothing may be computed."""

    def check(*arguments, **options):
        raise AssertionError("computed")

    monkeypatch.setattr(ledger, "verify", check)


@pytest.fixture
def found(monkeypatch):
    """``found({"5.11": False})``: all that is found is exact, and what a statement claims holds unless it is named."""

    def use(holds):
        def gather(ids, level, watch):
            return {
                id: [Evidence(method="symbolic", of="printed", holds=holds.get(id, True), text="decided")] for id in ids
            }

        monkeypatch.setattr(rows, "_sources", lambda: {"exact arithmetic": gather})

    return use


@pytest.fixture
def record(monkeypatch):
    """Other recorded verdicts."""
    recorded = rows.recorded()

    def use(changes=None, *, empty=False):
        verdicts = ({} if empty else recorded) | (changes or {})
        monkeypatch.setattr(rows, "recorded", lambda: verdicts)

    return use


def start(*arguments, code=CALL, environment=None, **streams):
    """The command in a fresh interpreter."""
    return ended(code, *arguments, env=os.environ | (environment or {}), **streams)


def leaning_on(id):
    """Every statement whose proof uses this one, directly or not."""
    reached = {id}
    while more := {s.id for s in STATEMENTS.values() if reached & set(s.leans_on)} - reached:
        reached |= more
    return reached - {id}


def wide(answer):
    return [line for line in answer.out.splitlines() if len(line) > 80]


def one_line(text):
    """A paragraph of the screen, unfolded."""
    return " ".join(text.split())


# --- help ---


def test_the_help_names_the_statuses_and_has_an_example_for_one_id_and_for_all(call):
    answer = call("verify", "--help")
    assert (answer.status, answer.err) == (0, "")
    examples = answer.out.partition("Examples:\n")[2].partition("\n\n")[0].splitlines()
    assert "ndtheory verify" in [line.strip() for line in examples]
    ids = [id for line in examples for id in shlex.split(line)[2:] if not id.startswith("-")]
    assert {"5.30"} <= set(ids)
    named = {id for id in ids if any(known == id or known.startswith(f"{id}.") for known in STATEMENTS)}
    assert set(ids) - named <= {"full", "ledger"}
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
    offered = complaint.partition("needed one like ")[2].split(", ")
    assert offered
    assert set(offered) <= set(STATEMENTS)
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
    assert meant in call("verify", id).complaint.partition("needed one like ")[2].split(", ")


def test_case_tells_no_two_ids_apart_that_a_reader_could_confuse():
    assert len({id.casefold() for id in STATEMENTS}) == len(STATEMENTS)


def test_the_name_of_a_statement_in_parts_stands_for_all_of_them(call, kept):
    screen = call("verify", "prop-5.6").out
    assert [line.split()[0] for line in screen.splitlines() if line.startswith("prop-5.6")] == [
        f"prop-5.6.{i}" for i in (1, 2, 3, 4)
    ]


@pytest.mark.parametrize("id", NAMED)
def test_every_id_that_the_interface_names_is_known(call, kept, id):
    answer = call("verify", id)
    assert (answer.status, answer.err) == (0, "")


@pytest.mark.parametrize("level", ["", "Quick", "FULL", "fast", "1", "5.30"])
def test_a_level_that_is_none_is_refused_by_name(call, never, level):
    complaint = call("verify", "--level", level).complaint
    assert all(word in complaint for word in ("--level", repr(level), "quick", "full"))


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


# --- screens ---


@pytest.mark.parametrize("id", STATEMENTS)
def test_the_screen_of_a_statement_fits_80_columns_and_shows_no_raw_value(call, kept, id):
    answer = call("verify", id)
    assert (answer.status, answer.err) == (0, "")
    assert wide(answer) == []
    assert RAW.findall(answer.out) == []
    assert not set("\\$") & set(answer.out)
    assert answer.out.splitlines()[1].startswith(f"{id}  ")


@pytest.mark.parametrize("id", STATEMENTS)
def test_the_screen_of_a_changed_statement_fits_80_columns(call, kept, id):
    kept(lambda row: replace(row, recorded="REPAIRED" if row.verdict == "INCONCLUSIVE" else "INCONCLUSIVE"))
    answer = call("verify", id)
    assert answer.status == 1
    assert "recorded: " in one_line(answer.out)
    assert wide(answer) == []


def test_the_screen_shows_what_is_claimed_what_is_wrong_and_what_was_found(call, kept, whole):
    screen = one_line(call("verify", "5.30").out)
    row = next(row for row in whole.ledger.rows if row.statement.id == "5.30")
    s = row.statement
    for text in (s.title, s.claims, s.wrong, s.repair, s.proof, *(e.text for e in row.evidence)):
        assert one_line(plain(text)) in screen
    assert f"leans on {', '.join(s.leans_on)}" in screen
    assert screen.count("kappa = 10000") == 1


@pytest.mark.parametrize("id", [s.id for s in STATEMENTS.values() if s.fault])
def test_no_label_on_the_screen_of_a_fault_stands_without_its_text(call, kept, id):
    assert re.findall(r"(?m)^ +(?:repaired|because|leans on):?$", call("verify", id).out) == []


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
        "WHAT STANDS?",
        "WHAT IS WRONG IN THE PAPER?",
    ]
    counts = {line.split()[0]: int(line.split()[1]) for line in lines if line[2:].split(" ")[0] in VERDICTS}
    assert counts == whole.ledger.counts()
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


@pytest.mark.parametrize("id", STATEMENTS)
def test_no_text_of_a_statement_leaves_tex_on_a_terminal(id):
    for text in (plain(getattr(STATEMENTS[id], name)) for name in TEXTS):
        assert re.findall(r"[\\${}]", text) == []
        assert re.findall(r"\b(?:frac|arrow|leftarrow|rightarrow|tilde|mathrm|cdot|ldots)\b", text) == [], text


@pytest.mark.parametrize("id", STATEMENTS)
def test_no_text_of_a_statement_loses_an_argument_on_a_terminal(id):
    for text in (plain(getattr(STATEMENTS[id], name)) for name in TEXTS):
        assert re.findall(r",\)|\(\)|\(,", text) == [], text


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


# --- the document ---


@pytest.fixture(scope="module")
def document(whole):
    def refuse(name):
        raise AssertionError(f"{name} in a JSON document")

    return json.loads(whole.ledger.to_json(), parse_constant=refuse)


def plain_numbers(part):
    """Every number below a part of a document."""
    if isinstance(part, dict):
        part = list(part.values())
    if isinstance(part, list):
        for value in part:
            yield from plain_numbers(value)
    elif isinstance(part, (int, float)) and not isinstance(part, bool):
        yield part


def unexplained(part, explained=frozenset(), path=""):
    """Paths of nulls for which no object on the way names a reason; an undecided `holds` has its text."""
    if isinstance(part, dict):
        explained = explained | set(part.get("reason") or {})
        for key, value in part.items():
            undecided = key == "holds" and part.get("text")
            if value is None and key not in explained and not undecided:
                yield f"{path}.{key}"
            yield from unexplained(value, explained, f"{path}.{key}")
    elif isinstance(part, list):
        for i, value in enumerate(part):
            yield from unexplained(value, explained, f"{path}[{i}]")


def test_json_puts_one_document_on_stdout_and_nothing_on_stderr(call, kept, document):
    answer = call("verify", "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document == document


def test_the_document_names_its_schema_version_units_level_and_counts(document):
    assert document["schema"] == "ndtheory.ledger/1"
    assert document["version"] == ndtheory.__version__
    assert isinstance(document["units"], dict)
    assert document["level"] == "quick"
    verdicts = [s["verdict"] for s in document["statements"]]
    assert document["counts"] == {verdict: verdicts.count(verdict) for verdict in set(verdicts)}


def test_every_statement_of_the_document_has_the_keys_of_the_interface(document):
    assert [s["id"] for s in document["statements"]] == list(STATEMENTS)
    for s in document["statements"]:
        assert set(s) >= KEYS
        assert all(isinstance(s[key], str) for key in KEYS - {"evidence"})
        assert all(s[key] for key in KEYS - {"note"})
        assert s["verdict"] in VERDICTS
        assert s["method"] in METHODS
        assert set(s["leans_on"]) <= set(STATEMENTS)
        assert ("fault" in s) == bool(STATEMENTS[s["id"]].fault)


def test_every_piece_of_evidence_has_a_method_an_object_an_outcome_and_a_text(document):
    for s in document["statements"]:
        assert s["evidence"]
        for e in s["evidence"]:
            assert {"method", "of", "holds", "text"} <= set(e) <= {"method", "of", "holds", "text", "data"}
            assert e["method"] in METHODS
            assert e["of"] in OF
            assert e["holds"] in (True, False, None)
            assert e["text"].strip()
            assert RAW.findall(e["text"]) == []


def test_the_evidence_of_a_statement_comes_strongest_first_and_holds_what_decided(document):
    order = ["symbolic", "dimension", "discrete", "reading"]
    for s in document["statements"]:
        places = [order.index(e["method"]) for e in s["evidence"]]
        assert places == sorted(places)
        assert s["method"] in {e["method"] for e in s["evidence"]}


def test_floating_point_proves_nothing(document):
    for s in document["statements"]:
        exact = [e for e in s["evidence"] if e["method"] == "symbolic" and e["holds"]]
        if s["verdict"] == "PROVED":
            assert s["method"] == "symbolic"
            assert exact
            assert all(e["holds"] for e in s["evidence"])
        if s["verdict"] == "NUMERICAL":
            assert not exact
        if s["verdict"] in ("REPAIRED", "REFUTED"):
            assert any(e["holds"] is False and e["of"] != "repaired" for e in s["evidence"])


def test_no_verdict_rests_on_units(whole):
    for row in whole.ledger.rows:
        assert settle([e for e in row.evidence if e.method != "dimension"]) == (row.verdict, row.method)


def test_every_number_of_the_document_is_finite(document):
    numbers = list(plain_numbers(document))
    assert numbers
    assert all(map(math.isfinite, numbers))


def test_a_null_has_a_reason_beside_it(document):
    assert list(unexplained(document)) == []


def test_an_exact_counterexample_is_made_of_rationals(document):
    refuted = 0
    for s in document["statements"]:
        for e in s["evidence"]:
            at = e.get("data", {}).get("counterexample")
            assert at is None or (e["method"] == "symbolic" and e["holds"] is False and at)
            if at is not None:
                refuted += bool(at)  # numbers alone need no point: the text names them
                assert all(isinstance(value, str) and str(Fraction(value)) == value for value in at.values())
    assert refuted


def test_the_counterexample_to_5_30_is_one(document):
    row = next(s for s in document["statements"] if s["id"] == "5.30")
    (at,) = (
        e["data"]["counterexample"]
        for e in row["evidence"]
        if e["method"] == "symbolic" and e["of"] == "printed" and not e["holds"]
    )
    e, kappa, m = (Fraction(at[name]) for name in ("e", "kappa", "lambda"))
    M, C_R, C_K = 2 * m, 1, kappa * m
    bound = C_K / m**2 * (M * C_R + C_K + Fraction(math.isqrt(int(C_K * m))) + 1) * M**2 / m * e**2
    assert C_K * m == math.isqrt(int(C_K * m)) ** 2
    assert kappa**2 * e**2 > bound


def test_random_evidence_says_its_seed_and_how_much_was_tried(document):
    random = 0
    for s in document["statements"]:
        for e in s["evidence"]:
            data = e.get("data", {})
            assert (e["method"] != "discrete") or data
            if {"cases", "pairs"} & set(data):
                random += 1
                assert isinstance(data["seed"], int)
                assert all(data[key] > 0 for key in {"cases", "pairs"} & set(data))
                assert data["problems"]
    assert random


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
    monkeypatch.setattr("verification.ledger.record.recorded", lambda: other)
    answer = call(*small_m)
    assert "whose verdict in the ledger is NUMERICAL" in one_line(answer.out)
    assert wide(answer) == []
    assert "in the ledger" not in call("bounds", "--m", "2", "--M", "4", "--CR", "1", "--CK", "1/100").out


# --- premises ---


def test_whatever_leans_on_a_refuted_statement_is_inconclusive(found):
    found({"5.11": False})
    verdicts = {row.statement.id: row.verdict for row in ledger.verify().rows}
    assert verdicts["5.11"] == "REFUTED"
    direct = [s.id for s in STATEMENTS.values() if "5.11" in s.leans_on]
    assert direct
    assert {verdicts[id] for id in direct} == {"INCONCLUSIVE"}
    found({})
    before = {row.statement.id: row.verdict for row in ledger.verify().rows}
    changed = {id for id, verdict in verdicts.items() if verdict != before[id]}
    assert {"5.11", *direct} <= changed <= {"5.11", *leaning_on("5.11")}


@pytest.mark.parametrize("premise", ["5.11", "4.3", "5.12"])
@pytest.mark.parametrize("holds", [False, None], ids=["refuted", "undecided"])
def test_nothing_is_proved_from_what_is_inconclusive_for_want_of_a_premise(found, premise, holds):
    found({premise: holds})
    verdicts = {row.statement.id: row.verdict for row in ledger.verify().rows}
    assert verdicts[premise] == ("REFUTED" if holds is False else "INCONCLUSIVE")
    assert [id for id in leaning_on(premise) if verdicts[id] != "INCONCLUSIVE"] == []


@pytest.mark.parametrize("verdict", ["REFUTED", "INCONCLUSIVE"])
def test_a_premise_that_was_not_checked_now_counts_as_recorded(call, found, record, verdict):
    found({})
    record({"5.11": verdict})
    answer = call("verify", "prop-5.4")
    assert answer.status == 1
    screen = one_line(answer.out)
    assert "INCONCLUSIVE (recorded: " in screen
    assert f"reading, step: undecided. it leans on 5.11 ({verdict})" in screen
    (row,) = call("verify", "prop-5.4", "--json").document["statements"]
    assert (row["verdict"], row["method"]) == ("INCONCLUSIVE", "reading")
    assert row["evidence"][-1]["holds"] is None


def test_a_premise_that_is_checked_now_counts_as_found_and_not_as_recorded(found, record):
    found({})
    record({"5.11": "REFUTED"})
    assert {row.verdict for row in ledger.verify(["5.11", "prop-5.4"]).rows} <= {"PROVED", "REPAIRED"}


# --- what is written ---


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


# --- the same again ---


def test_two_runs_on_the_same_rows_are_equal_to_the_bit():
    ids = [READ, EXACT, SEEN]
    assert ledger.verify(ids) == ledger.verify(ids[::-1])


def test_a_few_rows_alone_in_another_process_are_those_of_the_whole(document):
    """Another order of hashes, and nothing computed before."""
    answer = start("verify", *SOME, "--json", environment={"PYTHONHASHSEED": "7"})
    assert (answer.returncode, answer.stderr) == (0, "")
    expected = [s for s in document["statements"] if s["id"] in SOME]
    assert json.loads(answer.stdout)["statements"] == expected


# --- signals, pipes ---


@pytest.fixture
def told(monkeypatch):
    """``told(action)``: act on what is being done."""

    def arrange(action):
        @contextmanager
        def stages():
            yield action

        monkeypatch.setattr("verification.cli.ledger.stages", stages)

    return arrange


INTERRUPT = """
    import os, signal, sys
    from contextlib import contextmanager
    from verification.cli import ledger, main

    @contextmanager
    def stages():
        yield lambda what, share: os.kill(os.getpid(), signal.SIGINT) if what == "solutions" else None

    ledger.stages = stages
    sys.exit(main())
"""


def test_ctrl_c_in_the_middle_ends_the_process_with_130_and_one_line(tmp_path):
    answer = start("verify", EXACT, SEEN, "-o", str(tmp_path), code=INTERRUPT)
    assert answer.returncode == 130
    assert len(answer.stderr.split("\n")) <= 3
    assert re.fullmatch("interrupted .+", answer.stderr.strip())  # one line, below the ^C of the terminal
    assert [path.suffix for path in tmp_path.iterdir() if path.name not in WHOLE] == []


def test_ctrl_c_in_the_middle_does_not_say_that_nothing_was_computed(call, told):
    def interrupt(what, share):
        if what == "solutions":
            raise KeyboardInterrupt

    told(interrupt)
    answer = call("verify", EXACT, SEEN)
    assert answer.status == 130
    assert re.fullmatch("interrupted .+", answer.err.strip())
    assert "before anything was computed" not in answer.err


@pytest.mark.parametrize("options", [[], ["--json"]], ids=["screen", "json"])
def test_ctrl_c_while_files_are_written_keeps_the_result_that_was_shown(call, kept, tmp_path, monkeypatch, options):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("verification.output.folder.Folder.write_ledger", interrupt)
    answer = call("verify", READ, "-o", tmp_path, *options)
    assert answer.status == 130
    assert answer.err == f"interrupted while {tmp_path} was written; the result is shown above\n"
    assert READ in answer.out


@pytest.mark.parametrize("arguments", [[READ], [READ, "--json"], ["--help"]], ids=" ".join)
def test_a_reader_that_goes_away_is_no_crash(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    answer = start("verify", *arguments, stdout=writer)
    os.close(writer)
    assert answer.stderr == ""
    assert answer.returncode in (0, 128 + signal.SIGPIPE)


def test_an_unknown_id_needs_no_arrays():
    code = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); " + CALL
    answer = start("verify", "5.99", code=code)
    assert answer.returncode == 2
    assert [name for name in HEAVY if name in answer.stderr.split()] == []

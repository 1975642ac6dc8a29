"""Every command: its screen, its help, its options, and the line that says what to type next."""

import re
import shlex
import tomllib
from typing import get_args

import pytest

import ndtheory
from verification import comparison, registry
from verification.bounds.verdicts import RunVerdict
from verification.cli.problems import examples
from verification.registry import BOUNDS
from verification.show.layout import lines as shown

COMMANDS = ["example", "demo", "bounds", "constants", "run", "solve", "compare", "advise", "certify", "region"]
COMMANDS += ["sweep", "reproduce", "verify"]
ADVISE = ["explore", "advise matrices", "advise run", "advise moduli"]
CONSTANTS = ["--m", "3084", "--M", "153229", "--CR", "1.70", "--CK", "1e-8"]

#: Exit status of (run, compare) on each built-in problem; `inside` ends at its limit, which compare does not mind.
BUILT_IN = {"inside": (1, 0), "section6": (0, 0), "section6-190": (0, 0), "signorini": (0, 0), "two-bars": (0, 0)}

ELSEWHERE = {"section6-60", "section6-666", "section6-2482", "chain", "history", "jaws", "stack"}  # in other files

HEADINGS = {
    "constants": ["WHICH CONSTANTS DOES THE THEOREM USE?"],
    "run": ["WHAT HAPPENED"],
    "solve": ["WHAT IS THE SOLUTION?"],
    "compare": [
        "DOES IT CONVERGE, AND HOW FAST?",
        "DOES ONE STEP CONTRACT?",
        "WHAT HAPPENED",
        "WHAT DO SEMIDEFINITE PROGRAMS PROVE OF ONE STEP?",
        "DOES THE RUN AGREE WITH THE BOUND?",
    ],
    "bounds": ["DOES ONE STEP CONTRACT?", "THE CONSTANTS OF SECTION 5"],
    "advise": [
        "WHICH BODY GETS THE NEUMANN PROBLEM?",
        *("WHICH THETA?", "WHICH METHOD?"),
        "HOW MUCH FRICTION DOES THE ENERGY BOUND ALLOW?",
        "TO PASTE",
    ],
}

#: Edits whose screens hold what others do not: reasons, rates next to 1, other rules.
TOLD = [
    *["without friction", "held tangentially", "local law", "soft upper body"],
    *[{"iteration.theta": '"auto"', "contact.friction": "3"}, {"iteration.relaxation": '"newton"'}],
    {"iteration.relaxation": '"momentum"'},
]


@pytest.fixture
def built_in(write, tmp_path, monkeypatch):
    """``built_in(name)``: a built-in problem in the current folder, its file."""
    monkeypatch.chdir(tmp_path)
    return lambda name: write(name=f"{name}.toml", text=examples()[name]).name


# --- help ---


def test_the_command_alone_shows_its_help_and_asks_for_a_command(call):
    answer = call()
    assert (answer.status, answer.out) == (2, "")
    assert all(f"\n  {name} " in answer.err for name in COMMANDS)


@pytest.mark.parametrize("command", [*COMMANDS, *ADVISE])
def test_every_help_has_an_example_explains_every_option_and_fits_the_screen(call, command):
    answer = call(*command.split(), "--help")
    assert (answer.status, answer.err) == (0, "")
    assert f"  ndtheory {command} " in answer.out.partition("Example")[2]
    assert max(map(len, answer.out.splitlines())) <= 80
    assert call(*command.split(), "-h") == answer
    options = answer.out.partition("Options:\n")[2]
    entries = re.split(r"^  (?=-)", options, flags=re.M)[1:]
    assert entries
    assert [entry for entry in entries if not re.search(r"(?m)(^ {20,}|  )[A-Z]\w* .*\w", entry)] == []


def test_the_version_is_that_of_the_theory(call):
    assert call("--version").out == f"ndtheory {ndtheory.__version__}\n"


# --- example ---


def test_the_list_of_examples_gives_each_a_title(call):
    screen = call("example").out
    for name, text in examples().items():
        assert f"  {name} " in screen
        assert tomllib.loads(text)["title"] in screen


@pytest.mark.parametrize("name", BUILT_IN)
def test_an_example_is_printed_ready_to_redirect(call, name):
    answer = call("example", name)
    assert (answer.status, answer.out, answer.err) == (0, examples()[name].rstrip() + "\n", "")


def test_every_built_in_problem_has_its_expected_status():
    assert {*BUILT_IN, *ELSEWHERE} == set(examples())


# --- screens ---


@pytest.mark.parametrize(
    ("command", "name"),
    [
        *(("compare", name) for name in BUILT_IN),
        *[("run", "inside"), ("run", "two-bars"), ("solve", "signorini"), ("constants", "section6-190")],
    ],
)
def test_a_built_in_problem_ends_as_expected_on_one_screen(call, built_in, monkeypatch, command, name):
    compare, kept = comparison.compare, []
    monkeypatch.setattr(comparison, "compare", lambda *given, **more: kept.append(compare(*given, **more)) or kept[0])
    answer = call(command, built_in(name), *(["--full"] if command == "compare" else []))
    assert answer.status == dict(zip(("run", "compare"), BUILT_IN[name], strict=True)).get(command, 0)
    lines = answer.out.splitlines()
    assert lines[0].startswith(tomllib.loads(examples()[name])["title"])
    assert [line for line in lines if line in HEADINGS[command]] == HEADINGS[command]
    assert [lines[i - 1] for i, line in enumerate(lines) if i and line in HEADINGS[command]] == [""] * len(
        HEADINGS[command]
    )
    assert lines[-1].startswith("Next: ndtheory ")
    assert len(lines) <= 46
    assert [line for line in lines if len(line) > 80] == []
    assert not {*get_args(RunVerdict)} & set(re.findall(r"\w+", answer.out))  # the names of documents
    for result in kept:
        short = [line for line, _ in shown(registry.screen(result), "terminal")]
        assert len(short) <= 15
        assert {"Not claimed: anything about the continuum, or the local Coulomb law.", *lines[:2]} < set(short)
        judged = [line for line in lines if line.startswith(tuple(f"  {name} " for name in BOUNDS))]
        assert judged
        for bound in result.bounds:
            assert [line for line in short if re.search(rf"\b{bound}\b", line)]
        words = " ".join(" ".join(short).split())
        for bound, judged in result.verdicts.items():  # a reason belongs to the bound before it
            assert f", {bound}: " not in words
            assert f" {bound}: " not in words or f" {bound}: {judged.reason}" in words


@pytest.mark.parametrize("name", ["section6-190", "signorini", "two-bars"])
def test_advice_on_a_built_in_problem_fits_one_screen(call, built_in, name):
    answer = call("advise", built_in(name))
    lines = answer.out.splitlines()
    assert (answer.status, answer.err) == (0, "")
    assert lines[0]  # no empty line first
    asked = [head for head in HEADINGS["advise"] if "FRICTION" not in head or name not in ("signorini", "two-bars")]
    assert [line for line in lines if line in HEADINGS["advise"]] == asked
    assert lines[-1].startswith("Next: ndtheory run ")
    assert len(lines) <= 46
    assert [line for line in lines if len(line) > 80] == []


@pytest.mark.parametrize(
    ("command", "edits"),
    [
        *(("compare", edits) for edits in TOLD),
        *(("run", edits) for edits in ("wrong roles", "stiff upper body", *TOLD[-3:])),
        *[("constants", "soft upper body"), ("advise", "local law"), ("advise", "soft upper body"), ("solve", "apart")],
    ],
    ids=str,
)
def test_whatever_a_screen_has_to_tell_fits_into_80_columns_and_what_to_type_next_is_accepted(
    call, write, monkeypatch, tmp_path, command, edits
):
    monkeypatch.chdir(tmp_path)
    write(edits)
    lines = call(command, "problem.toml").out.splitlines()
    assert [line for line in lines if len(line) > 80] == []
    following = lines[-1].removeprefix("Next: ndtheory ")
    assert call(*shlex.split(following)).status != 2


def test_the_calculator_answers_on_one_screen(call):
    answer = call("bounds", *CONSTANTS, "--theta", "1e-4")
    lines = answer.out.splitlines()
    assert (answer.status, answer.err) == (0, "")
    assert [line for line in lines if line in HEADINGS["bounds"]] == HEADINGS["bounds"]
    assert lines[-1].startswith("Next: ndtheory ")
    assert max(map(len, lines)) <= 80


def test_no_conclusion_is_no_error_and_a_factor_near_one_shows_its_distance_from_one(call):
    printed, repaired = (
        line
        for line in call("bounds", *CONSTANTS, "--theta", "1e-4").out.splitlines()
        if line.startswith(("  printed ", "  repaired "))
    )
    assert printed.endswith("no conclusion")
    assert "1 - 1.0e-04" in repaired
    assert repaired.endswith("contracts")


def test_stresses_carry_the_unit_of_the_file(call, write):
    screen = call("compare", write({"units.stress": '"ksi"', "units.length": '"in"'}), "--full").out
    assert "E 70000 / 20000 ksi" in screen
    assert "ksi in (per unit thickness)" in screen
    assert "r = 0.3 in" in screen


def test_what_to_type_next_can_be_pasted_where_the_file_name_has_a_space(call, write):
    file = write(name="my problem.toml")
    following = call("constants", file).out.splitlines()[-1].removeprefix("Next: ndtheory ")
    assert shlex.split(following) == ["compare", str(file)]


def test_the_width_of_the_terminal_does_not_change_a_result(call, write, monkeypatch):
    file = write()
    expected = call("compare", file)
    for columns in ("1", "500", "x"):
        monkeypatch.setenv("COLUMNS", columns)
        assert call("compare", file) == expected


@pytest.mark.parametrize("title", ["a\\u001b[2Jb", "a\\nNext: b"])
def test_a_title_cannot_take_over_the_screen(call, write, title):
    complaint = call("run", write({"title": f'"{title}"'})).complaint
    assert complaint.isprintable()
    assert "title = " in complaint
    assert "needed a text without control characters" in complaint


# --- options ---


def test_m_and_M_are_two_options(call):
    inputs = call("bounds", "--M", "4", "--m", "2", "--CR", "1", "--CK", "0", "--json").document["inputs"]
    assert (inputs["m"], inputs["M"]) == (2, 4)


@pytest.mark.parametrize(
    ("exact", "value"), [("1/4", 0.25), ("25e-2", 0.25), ("0.25", 0.25), (" 1/4 ", 0.25), ("1/3", 1 / 3)]
)
def test_rationals_are_accepted_wherever_a_number_is(call, write, exact, value):
    given = ["--M", "4", "--CR", "5/4", "--Cs", "1/2", "--Ctr", "3/7", "--k", "1/1000", "--json"]
    bounds = call("bounds", "--m", exact, "--theta", exact, *given).document
    assert bounds["inputs"]["m"] == bounds["inputs"]["theta"] == value
    assert call("run", write(), "--theta", exact, "--json").document["theta"] == value


def test_thresholds_are_on_k_where_C_s_and_C_tr_are_known_and_on_C_K_otherwise(call):
    given = ["bounds", "--m", "1", "--M", "2", "--CR", "1", "--json"]
    on_k = call(*given, "--k", "1/100", "--Cs", "1/2", "--Ctr", "1/4").document["editions"]["repaired"]
    on_C_K = call(*given, "--CK", "1/800").document["editions"]["repaired"]
    assert (on_k["threshold_on"], on_C_K["threshold_on"]) == ("k", "C_K")
    assert on_k["C2"]["value"] == pytest.approx(8 * on_C_K["C2"]["value"], rel=1e-15)
    assert on_k["C_T"] == on_C_K["C_T"]


@pytest.mark.parametrize(
    ("given", "status"),
    [
        ("--m 3084 --M 153229 --CR 1.7 --CK 1e-8 --theta 1e-4", 0),
        ("--m 3084 --M 153229 --CR 1.7 --CK 1e-8 --theta 1e-4 --edition repaired", 0),
        ("--m 3084 --M 153229 --CR 1.7 --CK 1e-8 --theta 1e-4 --edition printed", 1),  # C_K above C2
        ("--m 3084 --M 153229 --CR 1.7 --CK 1e-8 --theta 1/2", 1),  # theta above C1
        ("--m 1/2 --M 1 --CR 1 --CK 0 --theta 1/100 --edition printed", 1),  # the printed proof needs m >= 1
        ("--m 1 --M 1 --CR 1 --CK 0 --theta 1/100 --edition printed", 0),
        ("--rho 3 --theta 0.49", 0),  # 2/(1 + rho) = 1/2
        ("--rho 3 --theta 0.5", 1),
        ("--rho 1 --kappa1 2 --kappa2 1 --theta 0.1", 1),  # kappa_2 + kappa_1^2/4 = 2
        ("--m 3084 --M 153229 --CR 1.7 --CK 0 --theta 1/2 --rho 1", 0),  # one bound proves it
        ("--m 3084 --M 153229 --CR 1.7 --CK 0 --theta 1e-10 --rho 1e20", 0),
    ],
)
def test_check_asks_for_a_proved_contraction(call, given, status):
    assert call("bounds", *given.split()).status == 0
    assert call("bounds", *given.split(), "--check").status == status
    assert call("bounds", *given.split(), "--check", "--json").status == status


@pytest.mark.parametrize("edition", ["printed", "repaired", "both"])
def test_an_edition_is_shown_alone(call, edition):
    shown = [
        line.split()[0]
        for line in call("bounds", *CONSTANTS, "--edition", edition).out.splitlines()
        if line.startswith(("  printed ", "  repaired "))
    ]
    assert shown == (["printed", "repaired"] if edition == "both" else [edition])


@pytest.mark.parametrize(("command", "neumann_body"), [("run", 2), ("compare", 1)])
def test_swapped_roles_are_those_of_a_file_with_the_other_neumann_body(call, write, command, neumann_body):
    file = write({"iteration.neumann_body": str(neumann_body), "iteration.max_iterations": "5"}, "a.toml")
    other = write({"iteration.neumann_body": str(3 - neumann_body), "iteration.max_iterations": "5"}, "b.toml")
    swapped = call(command, file, "--swap-roles", "--json").document
    assert (swapped if command == "run" else swapped["run"])["neumann_body"] == 3 - neumann_body
    assert swapped == call(command, other, "--json").document


def test_theta_on_the_command_line_stands_over_that_of_the_file(call, write):
    from_file = call("run", write({"iteration.theta": "0.55"}, "a.toml"), "--json").document
    assert call("run", write(name="b.toml"), "--theta", "0.55", "--json").document == from_file


@pytest.mark.parametrize("edits", [None, "local law"])
def test_every_solver_finds_the_same_pressure(call, write, edits):
    few = ["run", write(edits), "--theta", "0.1", "--set", "iteration.max_iterations=15"]
    documents = {
        solver: call(*few, "--solver", solver, "--json").document for solver in ("auto", "cvxpy", "active-set")
    }
    expected = documents["auto"]["contact"]["pressure"]
    for document in documents.values():
        assert document["contact"]["pressure"] == pytest.approx(expected, rel=1e-9, abs=1e-9 * max(expected))
        assert document["contact"]["state"] == documents["auto"]["contact"]["state"]
        assert sum(document["solves"].values()) == document["evaluations"]
        assert document["kkt_residual"] < 1e-11
    assert documents["active-set"]["solves"]["cvxpy"] == 0
    assert documents["cvxpy"]["solves"]["active_set"] == 0


def test_refine_adds_one_column_for_each_halving_where_m_falls_and_M_rises_towards_the_continuum(call, write):
    file = write()
    coarse, *_, fine = levels = call("constants", file, "--refine", 2, "--json").document["levels"]
    assert [level["body1"]["nodes"] for level in levels] == [(10 * 2**i + 1) * (2 * 2**i + 1) for i in range(3)]
    row = next(line for line in call("constants", file, "--refine", 2).out.splitlines() if "C_R" in line)
    assert len(row.split()) == 4
    assert fine["m"]["value"] < coarse["m"]["value"]
    assert fine["M"]["value"] > coarse["M"]["value"]


# --- what goes where ---


@pytest.mark.parametrize("command", ["solve", "compare"])
def test_warnings_go_to_stderr_and_leave_the_document_alone(call, write, command):
    answer = call(command, write({"contact.radius": "0.1"}), "--json")
    assert "contact.radius = 0.1 is below the mesh width 0.2" in answer.err
    assert answer.document


@pytest.mark.parametrize(("radius", "cells"), [("0.2", "[10, 2]|[6, 2]"), ("0.1", "[20, 2]|[12, 2]")])
def test_a_radius_of_one_cell_is_not_below_the_mesh_width(call, write, radius, cells):
    lower, upper = cells.split("|")
    file = write({"contact.radius": radius, "body1.cells": lower, "body2.cells": upper})
    assert call("run", file).err == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ["example", "--json"],
        ["example", "two-bars", "--json"],
        ["advise", "run", "--theta", "0.1", "--ratio", "1.4", "--json"],
        ["demo", "-o", "FOLDER", "--json"],
    ],
    ids=lambda a: " ".join(a[:1]),
)
def test_json_puts_one_document_on_stdout_and_its_warnings_alone_on_stderr(call, quick, tmp_path, arguments):
    answer = call(*(tmp_path / "demo" if argument == "FOLDER" else argument for argument in arguments))
    warned = "".join(f"warning: {words}\n" for words in (answer.document.get("run") or {}).get("warnings", ()))
    assert (answer.status, answer.err) == (0, warned)
    assert {"schema", "version", "units"} <= set(answer.document)


@pytest.mark.parametrize("command", ["solve", "compare"])
def test_a_gamma_c_that_is_too_short_is_warned_of_and_ends_no_command(call, write, command):
    answer = call(command, write({"contact.interval": "[0.6, 1.4]"}), "--json")
    (warning,) = answer.err.splitlines()
    assert answer.status == 0
    assert warning.startswith("warning: outside Gamma_c the bodies overlap, by 0.0")
    run = answer.document if command != "compare" else answer.document["run"]
    assert warning == f"warning: {run['warnings'][0]}"
    assert run["checks"]["penetration_outside"] > 0.005


def test_the_demo_compares_section_6_and_leaves_problem_report_figures_and_json(call, quick, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = call("demo")
    folder = tmp_path / "ndtheory-demo"
    assert answer.status == 0
    strained, written = answer.err.splitlines()
    assert strained.startswith("warning: the largest principal strain is 5.8 %")
    assert written == "written: ndtheory-demo"
    assert {path.name for path in folder.iterdir()} == {
        *{"problem.toml", "report.html", "contact.csv", "history.csv", "interface.npz", "compare.json"},
        *{"body1.vtu", "body2.vtu", "sides.csv"},
        *(
            f"{figure}.{ending}"
            for figure in ("bodies", "residuals", "ruler", "waterfall")
            for ending in ("svg", "png")
        ),
    }
    assert (folder / "problem.toml").read_text(encoding="utf-8") == examples()["section6"]
    assert call("demo") == answer  # over its own files
    (folder / "problem.toml").write_text("edited", encoding="utf-8")
    assert "problem.toml" in call("demo").complaint
    assert (folder / "problem.toml").read_text(encoding="utf-8") == "edited"


@pytest.mark.parametrize("command", ["solve", "compare"])
def test_the_written_document_is_that_of_stdout(call, quick, write, tmp_path, command):
    answer = call(command, write(), "-o", tmp_path / "results", "--json")
    assert (tmp_path / "results" / f"{command}.json").read_text(encoding="utf-8") == answer.out


def test_two_thresholds_on_friction_have_two_names_and_the_printed_one_its_unit(call, write):
    """Every small theta, some theta: on the screens of compare and of the calculator."""
    calculator = ["bounds", "--m", "1", "--M", "2", "--CR", "3/2", "--CK", "1/400", "--theta", "1/10"]
    for arguments, on, unit in ((["compare", write(), "--full"], "k", "MPa"), (calculator, "C_K", "the unit of --m")):
        lines = call(*arguments).out.splitlines()
        head = next(i for i, line in enumerate(lines) if "every small" in line)
        assert lines[head].split() == ["every", "small", "some"]
        assert lines[head + 1].count(f"theta: {on}<") == 2
        assert any(line.startswith("  printed: its numbers are for stresses in " + unit) for line in lines)
    small = call("compare", write(), "--json").document
    assert small["energy"]["friction_threshold"]["value"] < small["energy"]["friction_limit"]["value"]


def test_what_each_estimate_gives_away_is_told_from_what_is_only_the_unit(call, write):
    """Moduli in Pa instead of MPa change the one and not the other."""
    lost: dict[str, dict[bool, float]] = {}
    for stress, factor in (("MPa", 1), ("Pa", 10**6)):
        edits = {"units.stress": f'"{stress}"', "body1.young": f"{7e4 * factor:g}", "body2.young": f"{2e4 * factor:g}"}
        losses = call("compare", write(edits), "--json").document["losses"]["friction"]
        lost[stress] = {loss["only_unit"]: 0.0 for loss in losses}
        for loss in losses:
            lost[stress][loss["only_unit"]] += loss["decades"]
    assert lost["MPa"][False] == pytest.approx(lost["Pa"][False], rel=1e-6)
    assert lost["Pa"][True] > lost["MPa"][True] + 10

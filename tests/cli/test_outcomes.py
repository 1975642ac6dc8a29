"""How a command ends: exit statuses and which of them wins, Ctrl-C, and what a run that did not converge advises."""

import errno
import re
import shlex
import signal
from dataclasses import replace
from email.message import Message

import pytest

import verification
from verification import comparison, figures
from verification.algorithm.monolithic import SolveError
from verification.bounds import verdicts
from verification.bounds.verdicts import Judgement
from verification.cli.problems import examples
from verification.contact import ContactError
from verification.sections.comparison import NAMES, WORDS

DONE, NOT_MET, BAD_INPUT, INCONCLUSIVE, INTERRUPTED, CRASH = 0, 1, 2, 3, 130, 70

ENDS = [
    ("run", None, DONE, "converged"),
    ("compare", None, DONE, "converged"),
    ("run", "inside the theorem", NOT_MET, "limit"),
    ("compare", "inside the theorem", DONE, "limit"),  # it judges steps, not the end
    ("run", "wrong roles", NOT_MET, "stalled"),
    ("compare", "wrong roles", NOT_MET, "stalled"),
    ("run", "stiff upper body", NOT_MET, "diverged"),
    ("compare", "stiff upper body", NOT_MET, "diverged"),
    ("run", "unloaded", DONE, "converged"),
    ("compare", "inside, unloaded", DONE, "converged"),  # no step to judge
    ("compare", "all but apart", INCONCLUSIVE, "converged"),  # forces as small as rounding
    ("run", "apart", DONE, "converged"),
    ("compare", "apart", DONE, "converged"),
]


@pytest.mark.parametrize(("command", "edits", "status", "outcome"), ENDS)
def test_a_command_ends_with_its_status_in_words_and_as_a_document(call, write, command, edits, status, outcome):
    file = write(edits)
    answer = call(command, file, "--json")
    run = answer.document["run"] if command == "compare" else answer.document
    assert (run["outcome"], answer.status) == (outcome, status)
    screen = call(command, file)
    assert screen.status == status
    ended = "not converged" if outcome == "limit" else outcome
    line = rf"^  observed +{ended} after " if command == "compare" else rf"^  observed .* {ended}$"
    assert re.search(line, screen.out, flags=re.M)
    assert [line for line in screen.out.splitlines() if len(line) > 80 and str(file) not in line] == []
    assert answer.err.split() == screen.err.split()


@pytest.mark.parametrize(
    ("judged", "edits", "status"),
    [
        ({"printed": "CONSISTENT", "repaired": "CONSISTENT"}, None, DONE),
        ({"printed": "HYPOTHESES_NOT_MET", "repaired": "INCONCLUSIVE"}, None, INCONCLUSIVE),
        ({"printed": "CONSISTENT", "repaired": "VIOLATED"}, None, NOT_MET),
        ({"printed": "INCONCLUSIVE", "repaired": "VIOLATED"}, None, NOT_MET),
        ({"printed": "HYPOTHESES_NOT_MET", "repaired": "INCONCLUSIVE"}, "wrong roles", NOT_MET),
        ({"printed": "VIOLATED", "repaired": "CONSISTENT"}, None, DONE),  # a finding
        ({"printed": "VIOLATED", "repaired": "INCONCLUSIVE"}, None, INCONCLUSIVE),
        ({"repaired": "CONSISTENT", "energy": "VIOLATED", "lmi": "CONSISTENT"}, None, NOT_MET),
        ({"repaired": "CONSISTENT", "energy": "CONSISTENT", "lmi": "VIOLATED"}, None, NOT_MET),
        ({"energy": "CONSISTENT", "lmi": "INCONCLUSIVE"}, None, INCONCLUSIVE),
        ({"energy": "INCONCLUSIVE", "lmi": "VIOLATED"}, None, NOT_MET),
        ({"energy": "CONSISTENT", "linearised": "VIOLATED"}, None, DONE),  # a prediction, no claim
    ],
    ids=lambda v: " ".join(v.values()) if isinstance(v, dict) else str(v),
)
def test_the_worst_verdict_decides(call, write, monkeypatch, judged, edits, status):
    made = {name: Judgement(verdict=verdict, reason="made up") for name, verdict in judged.items()}
    compare = comparison.compare
    monkeypatch.setattr(comparison, "compare", lambda *args, **kw: replace(compare(*args, **kw), verdicts=made))
    answer = call("compare", write(edits), "--full")
    assert answer.status == status
    for name, verdict in judged.items():
        assert re.search(rf"^  {NAMES.get(name, name)} +{WORDS[verdict]} +made up$", answer.out, flags=re.M)


def test_bad_input_wins_over_everything(call, write, monkeypatch):
    monkeypatch.setattr(comparison, "compare", None)
    assert call("compare", write("wrong roles"), "--theta", "2").complaint


@pytest.mark.parametrize(
    ("command", "error"),
    [("run", RuntimeError("made up")), ("compare", ValueError("made up")), ("constants", ZeroDivisionError())],
)
def test_a_crash_says_that_it_is_one_and_is_no_status_of_the_interface(call, write, monkeypatch, command, error):
    def fail(problem, law=None):
        raise error

    monkeypatch.setattr("verification.interface.pair.pair_from", fail)
    answer = call(command, write())
    assert answer.status == CRASH
    assert answer.out == ""
    assert "Traceback" in answer.err
    says = "ndtheory: this is a bug; please report it, with the lines above, the command and its files, at "
    assert answer.err.splitlines()[-1] == says + "the issue tracker of the repository that this copy came from"


@pytest.mark.parametrize("before", [[], ["no address"]])
def test_a_crash_names_the_tracker_of_the_metadata(call, write, monkeypatch, before):
    metadata = Message()
    for line in [*before, "Issues, https://x.example/issues"]:
        metadata["Project-URL"] = line
    monkeypatch.setattr("importlib.metadata.metadata", lambda name: metadata)
    monkeypatch.setattr("verification.interface.pair.pair_from", lambda problem, law=None: 1 / 0)
    assert call("run", write()).err.endswith(" at https://x.example/issues\n")


@pytest.mark.parametrize(
    ("command", "solver", "error"),
    [
        ("run", "contact.step.ContactStep", ContactError("no certificate")),
        ("compare", "contact.step.ContactStep", ContactError("no certificate")),
        ("solve", "algorithm.monolithic.ContactSystem", SolveError("no certificate")),
    ],
    ids=["run", "compare", "solve"],
)
def test_a_solver_that_fails_is_told_in_one_line(call, write, monkeypatch, command, solver, error):
    def fail(*args, **kw):
        raise error

    monkeypatch.setattr(f"verification.{solver}.solve", fail)
    file = write()
    answer = call(command, file)
    assert answer.status == NOT_MET
    assert ("DOES ONE STEP CONTRACT?" in answer.out) == (command == "compare")  # which was known before
    assert "WHAT HAPPENED" not in answer.out
    assert answer.err == f"ndtheory: {file}: no certificate\n"
    same = call(command, file, "--set", "contact.friction=0.3", "--json")
    assert (same.status, same.err) == (NOT_MET, answer.err)
    document = same.document
    assert (document["schema"], document["version"]) == ("ndtheory.failure/1", verification.__version__)
    assert (document["command"], document["outcome"], document["file"]) == (command, "error", str(file))
    assert document["error"] == "no certificate"
    assert document["problem"] == verification.load(file).with_keys({"contact.friction": "0.3"}).to_dict()


# --- Ctrl-C ---


@pytest.fixture
def endless(write):
    """A problem that takes its time: theta is tiny."""
    return write({"iteration.theta": "1e-4", "iteration.max_iterations": "100000"})


@pytest.mark.parametrize(("command", "states"), [("run", 1), ("compare", 2), ("compare", 40)])
def test_ctrl_c_keeps_what_was_computed_and_says_so(call, quick, endless, after, tmp_path, command, states):
    after(states, lambda: signal.raise_signal(signal.SIGINT))
    answer = call(command, endless, "-o", tmp_path / "results", "--json")
    run = answer.document["run"] if command == "compare" else answer.document
    assert (answer.status, run["outcome"], run["evaluations"]) == (INTERRUPTED, "interrupted", states)
    assert answer.err == f"interrupted after {states} evaluations of T: what was computed is kept\n"
    assert (tmp_path / "results" / f"{command}.json").read_text("utf-8") == answer.out


@pytest.mark.parametrize("command", ["run", "compare"])
def test_ctrl_c_leaves_a_screen(call, endless, after, command):
    after(3, lambda: signal.raise_signal(signal.SIGINT))
    answer = call(command, endless)
    assert answer.status == INTERRUPTED
    assert re.search(r"^  observed .*interrupted( after \d+ steps\b.*)?$", answer.out, flags=re.M)


@pytest.mark.parametrize("judged", ["VIOLATED", "INCONCLUSIVE"])
def test_ctrl_c_wins_over_a_verdict(call, endless, after, monkeypatch, judged):
    monkeypatch.setattr(verdicts, "judge", lambda *args: Judgement(verdict=judged, reason="made up"))
    after(3, lambda: signal.raise_signal(signal.SIGINT))
    assert call("compare", endless).status == INTERRUPTED


@pytest.mark.parametrize("command", ["run", "compare", "constants"])
def test_ctrl_c_before_anything_was_computed_says_so(call, write, monkeypatch, command):
    def interrupt(problem, **options):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("verification.interface.pair.pair_from", interrupt)
    answer = call(command, write())
    assert (answer.status, answer.out) == (INTERRUPTED, "")
    assert answer.err.strip() == "interrupted before anything was computed"


@pytest.mark.parametrize("command", ["run", "compare"])
def test_ctrl_c_while_files_are_written_still_shows_what_was_computed(
    call, quick, write, tmp_path, monkeypatch, command
):
    monkeypatch.setattr(figures, "save", lambda figure, path: signal.raise_signal(signal.SIGINT))
    answer = call(command, write(), "-o", tmp_path / "results")
    assert answer.status == INTERRUPTED
    assert "  observed  " in answer.out
    assert "before anything was computed" not in answer.err
    names = {path.name for path in (tmp_path / "results").iterdir()}
    assert f"{command}.json" in names
    assert not any(name.startswith("tmp") for name in names)


@pytest.mark.parametrize("command", ["run", "compare"])
def test_a_folder_with_a_file_of_somebody_else_costs_no_result(call, quick, write, tmp_path, command):
    (tmp_path / "bodies.png").write_bytes(b"my own")
    answer = call(command, write(), "-o", tmp_path)
    assert answer.status == BAD_INPUT
    assert answer.out == "" or "  observed  " in answer.out
    assert {path.name for path in tmp_path.iterdir()} == {"problem.toml", "bodies.png"}


@pytest.mark.parametrize("command", ["run", "compare"])
def test_a_disk_that_fills_up_is_told_in_one_line_and_costs_no_result(
    call, quick, write, tmp_path, monkeypatch, command
):
    def fill(figure, path):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(figures, "save", fill)
    answer = call(command, write(), "-o", tmp_path / "results")
    assert answer.status == BAD_INPUT
    assert "Traceback" not in answer.err
    assert "No space left on device" in answer.err
    assert "  observed  " in answer.out


# --- advice ---


def advised(line: str) -> list[list[str]]:
    """Options that a sentence proposes: a theta for these roles, one for the other roles."""
    swapped = re.search(r"--swap-roles with --theta ([\d.e-]+)", line)
    own = re.search(r"try --theta ([\d.e-]+)", line)
    return ([["--theta", own[1]]] if own else []) + ([["--swap-roles", "--theta", swapped[1]]] if swapped else [])


def test_a_stalled_run_ends_early_and_the_theta_it_advises_converges(call, write):
    bars = write(text=examples()["two-bars"])
    answer = call("run", bars, "--theta", "0.6", "--json")
    assert (answer.status, answer.document["outcome"]) == (NOT_MET, "stalled")
    assert answer.document["evaluations"] < 100
    assert answer.err.count("\n") == 1
    options = advised(answer.err)
    assert len(options) == 2
    for advice in options:
        assert call("run", bars, *advice).status == DONE


@pytest.mark.parametrize(("command", "edits"), [("run", "wrong roles"), ("compare", "stiff upper body")])
def test_what_a_run_advises_is_accepted(call, write, command, edits):
    file = write(edits)
    answer = call(command, file)
    assert answer.status == NOT_MET
    assert advised(answer.err)
    for advice in advised(answer.err):
        assert call("run", file, *advice).status != BAD_INPUT


def test_a_run_with_swapped_roles_advises_options_that_converge(call, write):
    file = write()
    answer = call("run", file, "--swap-roles", "--theta", "0.6")
    assert answer.status == NOT_MET
    if advised(answer.err):
        assert DONE in [call("run", file, *advice).status for advice in advised(answer.err)]
    assert "or --swap-roles" not in answer.err  # these roles are the swapped ones


def test_a_run_that_reached_its_limit_advises_to_raise_it(call, write):
    for command in ("run", "compare"):
        answer = call(command, write("inside the theorem"))
        assert "max_iterations" in answer.err
        assert answer.err.count("\n") == 1
        assert answer.out.splitlines()[-1].startswith("Next: ndtheory run ")


@pytest.mark.parametrize("theta", ["0.6", "0.8"])
def test_a_tolerance_below_rounding_is_not_blamed_on_theta(call, write, theta):
    answer = call("run", write("below rounding"), "--theta", theta)
    assert answer.status == NOT_MET
    assert "tolerance" in answer.err
    assert "does not contract" not in answer.err


def test_a_theta_too_small_to_move_anything_is_not_advised_to_shrink(call, write):
    answer = call("run", write(), "--theta", "1e-20")
    assert answer.status == NOT_MET
    assert "smaller theta" not in answer.err


@pytest.mark.parametrize("command", ["run", "solve"])
def test_bodies_that_never_meet_have_no_contact_force_and_a_solution_that_says_so(call, write, command):
    answer = call(command, write("apart"), "--json")
    found, (line,) = answer.document, answer.err.splitlines()
    assert answer.status == DONE
    assert found["pattern"] == {"stick": 0, "slip": 0, "open": 7}
    assert found["force"]["normal"] == 0
    assert found.get("converged", True)
    assert found.get("iterations", 0) < 10
    assert line == f"warning: {found['warnings'][-1]}"
    assert "nothing touches: the bodies stay apart along Gamma_c, by at least 0.085 mm" in line
    assert "7 open: nothing touches" in call(command, write("apart")).out
    assert "nothing touches" not in str(call(command, write()))


def test_where_nothing_touches_the_forces_of_two_solvers_do_not_differ(call, write):
    answer = call("compare", write("apart"), "--json")
    assert answer.document["cvxpy"]["largest_difference"] < 1e-4


#: Runs that do not converge, with a word of what stderr says and of what is typed next.
UNFINISHED = {
    "wrong roles": (("stalled", "try --theta"), "--theta"),
    "stiff upper body": (("diverged", "try --theta"), "--theta"),
    "below rounding": (("fell to rounding",), "iteration.tolerance"),
    "inside the theorem": (("max_iterations was reached",), "--theta"),
}


@pytest.mark.parametrize("edits", UNFINISHED)
def test_a_run_that_did_not_converge_shows_no_solution_and_next_what_stderr_advises(call, write, edits):
    file, (said, change) = write(edits), UNFINISHED[edits]
    answer = call("run", file, "--theta", "1/1000") if edits == "inside the theorem" else call("run", file)
    assert answer.status == NOT_MET
    assert all(words in answer.err for words in said)
    head = re.search(r"^  Last iterate, not a solution: \d+ stick, \d+ slip, \d+ open", answer.out, flags=re.M)
    assert head.end() < answer.out.index("  force ")
    assert "  nodes " not in answer.out
    following = shlex.split(answer.out.splitlines()[-1].removeprefix("Next: ndtheory "))
    assert following[:2] == ["run", str(file)]
    assert change in " ".join(following)
    assert following.count("--theta") < 2
    for options in advised(answer.err)[:1]:
        assert following[2:] == options
    assert call(*following).status == (NOT_MET if edits == "stiff upper body" else DONE)
    assert "Last iterate" not in call("run", write()).out


def test_a_run_that_needs_a_little_longer_is_continued_next(call, write):
    answer = call("run", write({"iteration.max_iterations": "12"}))
    assert "max_iterations was reached" in answer.err
    following = answer.out.splitlines()[-1].removeprefix("Next: ndtheory ")
    assert call(*shlex.split(following)).status == DONE


def test_a_rule_that_takes_its_own_step_is_replaced_next(call, write):
    edits = {"contact.friction": "0", "iteration.relaxation": '"momentum"', "iteration.max_iterations": "1"}
    answer = call("run", write(edits | {"iteration.theta": None}))
    following = shlex.split(answer.out.splitlines()[-1].removeprefix("Next: ndtheory "))
    assert following[2:4] == ["--relaxation", "constant"]
    assert call(*following).status == NOT_MET


def test_a_remedy_is_no_division_by_zero_where_one_grid_is_coarser(call, write):
    file = write(text=examples()["section6-190"])
    answer = call("run", file, "--swap-roles", "--theta", "0.6")
    assert answer.status == NOT_MET
    better = re.search(r"try --theta (0\.\d+) .*, or without --swap-roles with --theta (0\.\d+)$", answer.err)
    assert call("run", file, "--swap-roles", "--theta", better[1]).status == DONE
    assert call("run", file, "--theta", better[2]).status == DONE


def test_a_remedy_names_no_roles_that_are_refused(call, write):
    rolling = {"body2.prescribed": '{ top = ["free", -0.015] }', "iteration.neumann_body": "1", "body2.young": "1e7"}
    file = write(rolling | {"iteration.theta": "0.9"})
    assert call("run", file, "--swap-roles").status == BAD_INPUT
    answer = call("run", file)
    assert answer.status == NOT_MET
    assert "does not contract here; try --theta 0." in answer.err
    assert "--swap-roles" not in answer.err


@pytest.mark.parametrize("edits", [{"iteration.relaxation": '"aitken"'}, "local law"], ids=["aitken", "local law"])
def test_the_answer_allows_no_theta_where_no_bound_applies(call, write, edits):
    out = call("compare", write(edits), "--bounds", "energy", "--full").out
    answer = out[out.index("DOES IT CONVERGE") : out.index("DOES ONE STEP CONTRACT?")]
    assert re.search(r"^  bound +none: ", answer, flags=re.M)
    assert "allows" not in answer


def test_the_answer_names_the_thetas_allowed_where_that_of_the_run_is_not(call, write):
    out = call("compare", write(), "--bounds", "energy", "--theta", "0.999", "--full").out
    bound = re.search(r"^  bound +(.*none.*)$", out, flags=re.M)[1]
    (allowed,) = re.findall(r"the energy bound allows (.*)$", out, flags=re.M)
    assert bound == f"from constants: none, theta is outside {allowed}"

"""`advise run`: what the screen shows of the logs of other codes, and what it refuses."""

import numpy as np
import pytest
from advice_calls import fits, pasted
from coupling_logs import MODES, linear_run, precice, written

import verification as vf


@pytest.fixture
def log(tmp_path):
    """``log(0.45)``: the file of a run with this theta, and the options that name it."""

    def of(theta, modes=MODES, windows=1, steps=90, name=None):
        absolute, relative = linear_run(modes, theta, steps)
        columns = {"ResRel(Solid-Mesh:Displacement)": relative, "ResAbs(Solid-Mesh:Force)": absolute}
        path = precice(tmp_path / (name or f"precice-Solid-{theta}-convergence.log"), [columns] * windows)
        return ["--log", path, "--theta", theta]

    return of


CALLS = {
    "one that shows rho": [0.45],
    "one that leaves readings": [0.3],
    "one that diverges": [0.7],
    "two that decide": [0.3, 0.45],
    "two that leave a run": [0.1, 0.7],
    "three": [0.1, 0.7, 0.9],
}


def test_a_pattern_with_repeats_inside_repeats_is_refused_after_some_time(call, tmp_path, monkeypatch):
    monkeypatch.setattr("verification.coupling.log_files.SECONDS", 0.2)
    log = written(tmp_path / "solver.out", "a" * 80 + "\n")
    complaint = call("advise", "run", "--log", log, "--theta", "0.5", "--pattern", "(?:a+)+b (.*)").complaint
    assert complaint.startswith(f"ndtheory: {log}: searching it takes more than 0.2 s of processor time: needed no rep")
    written(log, "b 0.1\nb 0.01\nb 0.001\nb 1e-4\n")
    assert call("advise", "run", "--log", log, "--theta", "0.5", "--pattern", "(?:a*)b (.*)").status == 0


@pytest.mark.parametrize("name", CALLS)
def test_the_screen_of_logs_fits_80_columns_and_46_lines_and_says_what_it_assumes(call, log, name):
    words = [word for theta in CALLS[name] for word in log(theta)]
    answer, document = call("advise", "run", *words), call("advise", "run", *words, "--json").document
    assert (answer.status, answer.err) == (0, "")
    lines = answer.out.splitlines()
    fits(lines)
    flat = " ".join(answer.out.split())
    assert "Assumed: theta constant in each run" in flat
    assert "Not claimed: a bound of rho with friction" in flat
    assert f"theta = {document['next']['theta']:g}: {document['next']['why']}" in flat
    for side in ("lo", "hi"):
        if document["interval"][side]:
            assert f"given {document['interval'][side]['assumes']}" in flat
    shown = [line.split()[0] for line in lines if line.startswith(("  mode-", "  level", "  open", "  plateau"))]
    assert shown == [reading["kind"] for reading in document["readings"]]
    if document["roles"]:
        assert pasted(answer.out) == f"{document['next']['theta']:g}"
        assert "WHICH BODY" not in answer.out
        assert lines[-1] == "Next: your coupling, with the lines above"
    else:
        assert "TO PASTE" not in answer.out


def test_logs_that_contradict_each_other_are_told_on_the_screen(call, log):
    answer = call("advise", "run", *log(0.3, (1, 9), name="a.log"), *log(0.45, (0.5, 3), name="b.log"))
    assert answer.status == 0
    assert "CONTRADICTION: " in answer.out
    assert "TO PASTE" not in answer.out
    assert len(answer.out.splitlines()) <= 46


def test_each_theta_belongs_to_the_log_of_its_place(call, log):
    one, two = log(0.3), log(0.45)
    mixed = ["--theta", 0.3, "--theta", 0.45, "--log", one[1], "--log", two[1]]
    assert call("advise", "run", *one, *two, "--json").out == call("advise", "run", *mixed, "--json").out


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["--log", "LOG"], "--theta = None: needed the relaxation factor of"),
        (["--log", "LOG", "--theta", "0.5", "--pattern", "("], "--pattern = (: needed a regular expression"),
        (["--theta", "0.5", "--ratio", "0.9", "--pattern", "(x)"], "--pattern without --log"),
        (["--ratio", "0.9"], "received 0 --theta with 0 --log and 1 --ratio"),
        (["--log", "LOG", "--log", "LOG", "--theta", "0.5"], "received 1 --theta with 2 --log"),
        (["--log", "LOG", "--theta", "0.5", "--theta", "0.4"], "received 2 --theta with 1 --log"),
        (["--theta", "0.5", "--theta", "0.4", "--ratio", "1.4"], "received 2 --theta with 0 --log and 1 --ratio"),
        (["--theta", "0.5"], "neither --log nor --ratio"),
        (["--log", "LOG", "--theta", "0.5", "--ratio", "0.9"], "--log with --ratio"),
        (["--log", "LOG", "--theta", "0.5", "--S1", "a.npz"], "--S1 is an option of ndtheory advise matrices"),
        (["--log", "LOG", "--theta", "2"], "--theta = 2: needed"),
        (["--log", "missing.log", "--theta", "0.5"], "missing.log: no such file"),
        (["--log", "FOLDER", "--theta", "0.5"], "folder"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_call_with_logs_that_lacks_or_mixes_something_is_refused(call, log, tmp_path, words, fragment):
    places = {"LOG": str(log(0.45)[1]), "FOLDER": str(tmp_path)}
    assert fragment in call("advise", "run", *(places.get(word, word) for word in words)).complaint


def test_a_broken_log_is_one_line_and_no_log_can_steer_the_terminal(call, tmp_path):
    path = written(tmp_path / "a.log", "it res\n1 1.0\n2 \x1b[2Jx\n3 0.5\n")
    complaint = call("advise", "run", "--log", path, "--theta", "0.5").complaint
    assert f"{path}, line 3: received" in complaint
    assert "\x1b" not in complaint
    written(path, "it res\x1b[2J\n" + "".join(f"{n} {0.8**n:.8e}\n" for n in range(40)))
    assert "\x1b[2J" not in call("advise", "run", "--log", path, "--theta", "0.45").out


# --- friction --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["--log", "LOG", "--theta", "0.45"], ["--theta", "0.45", "--ratio", "0.8"]], ids=str)
def test_the_first_line_says_what_is_assumed_and_friction_takes_the_theta_away(call, log, words):
    words = [str(log(0.45)[1]) if word == "LOG" else word for word in words]
    plain, document = call("advise", "run", *words), call("advise", "run", *words, "--json").document
    assert plain.out.startswith("Assumed: no friction, or a tied interface. With friction add --friction.\n")
    assert (document["theta"] is None) == (words[0] == "--log")  # one log leaves the softest mode open
    assert document["assumes"] == "no friction, or a tied interface"
    assert document["friction_bounds"] is None
    found = call("advise", "run", "--friction", *words, "--json").document
    assert found == call("advise", "run", *words, "--friction", "--json").document
    assert (found["roles"], found["theta"], found["quote"]) == ([], None, None)
    assert found["friction_bounds"]["image"] > 0
    assert all(one["rho"]["lo"] is one["rho"]["value"] is None for one in found["readings"])
    answer = call("advise", "run", "--friction", *words)
    assert answer.out.startswith("Assumed: there is friction")
    assert "TO PASTE" not in answer.out
    assert "WHAT IS PROVED OR ESTIMATED WITH FRICTION?" in answer.out
    fits(answer.out.splitlines())
    assert call("advise", "run", *words, "--tied").out.startswith("Assumed: nothing opens or slips.\n\n")


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        ("run --theta 0.1 --ratio 1.4 --friction 0.2", "received 0.2: needed options only"),
        ("run --theta 0.1 --ratio 1.4 --friction --tied", "tied with friction: needed one of them"),
        ("matrices --S1 a.npz --S2 b.npz --friction", "'--friction' requires an argument"),
        (
            "matrices --S1 a.npz --friction --S2 b.npz",
            "--friction = --S2: needed a number >= 0, such as --friction 0.2",
        ),
        ("moduli --young 7,2 --poisson 0.3,0.3 --friction", "an option of ndtheory advise matrices and"),
    ],
)
def test_friction_that_does_not_fit_is_refused(call, words, fragment):
    assert fragment in call("advise", *words.split()).complaint


def test_a_snippet_for_runs_with_friction_is_refused_with_the_run_to_make(call):
    answer = call("advise", "run", "--theta", "0.45", "--ratio", "0.8", "--friction", "--snippets", "preCICE")
    assert "with friction no run decides theta" in answer.err
    assert "WHICH RUN NEXT?" in answer.out


def test_a_run_to_keep_is_no_run_to_make(call, tmp_path):
    path = written(tmp_path / "a.log", "it res\n1 1.0\n2 1e-9\n")
    answer = call("advise", "run", "--log", path, "--theta", "0.3")
    assert "theta = 0.3: keep it: the run converges within 2 iterations" in answer.out
    assert answer.out.endswith("Next: no run; keep theta = 0.3\n")


def test_the_screen_of_an_aitken_log_shows_both_ends_as_estimates_and_pastes_when_tied(call, tmp_path):
    rows, residual, factor = ["it,res,omega"], [1 + mode for mode in MODES], 0.5
    for n in range(1, 14):
        rows.append(f"{n},{sum(r * r for r in residual) ** 0.5:.9g},{factor:.9g}")
        moved = [(1 + mode) * r for mode, r in zip(MODES, residual, strict=True)]
        after = sum(r * m for r, m in zip(residual, moved, strict=True)) / sum(m * m for m in moved)
        residual, factor = [r - factor * m for r, m in zip(residual, moved, strict=True)], after
    path = written(tmp_path / "a.csv", "\n".join(rows) + "\n")
    for tied in ([], ["--tied"]):
        answer = call("advise", "run", "--log", path, *tied)
        lines, flat = answer.out.splitlines(), " ".join(answer.out.split())
        assert (answer.status, answer.err) == (0, "")
        fits(lines)
        assert "Aitken's factors, 12 of 13: lambda from 0." in flat
        assert "estimates" in flat
        assert ("TO PASTE" in answer.out) == bool(tied)
        document = call("advise", "run", "--log", path, *tied, "--json").document
        assert document["accelerated"][0]["factors"]["high"] == pytest.approx(3, rel=0.05)
        assert document["interval"]["lo"] is None


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["run", "precice-A-convergence.log"], ["precice-A-convergence.log", "after --log"]),
        (["precice-A-convergence.log"], ["ndtheory advise run --log precice-A-convergence.log --theta X"]),
        (["run", "--log", "precice-A-convergence.log"], ["--theta = None", "name it", "Aitken", "iterations.log"]),
    ],
)
def test_a_log_given_in_another_way_gets_the_call_that_reads_it(call, tmp_path, monkeypatch, words, parts):
    monkeypatch.chdir(tmp_path)
    precice(tmp_path / "precice-A-convergence.log", [{"ResAbs(M:F)": [0.8**n for n in range(9)]}])
    complaint = call("advise", *words).complaint
    assert [part for part in parts if part not in complaint] == []


def test_a_log_that_decides_nothing_leads_to_vectors(call, tmp_path):
    log = precice(tmp_path / "a.log", [{"ResAbs(M:F)": [0.8**n for n in range(9)]}])
    said = " ".join(call("advise", "run", "--log", log, "--theta", "0.3").out.split())
    assert "A few vectors of a run decide more than its log: ndtheory advise vectors --help." in said
    assert "Or begin with 16 rows of absolute residuals with theta = 1" in said
    again = " ".join(call("advise", "run", "--log", log, "--theta", "1").out.split())
    assert "Or begin" not in again


# --- logs of both participants' data, and logs of runs that were not constant ----------------------------------------


def both_columns(theta, modes, steps=60):
    """Relative residuals of the relaxed forces and of the displacements that answer them, which are not relaxed."""
    eigenvalues, load = np.array(modes, float), np.arange(1.0, len(modes) + 1)
    x, before, forces, displacements = np.zeros(len(modes)), np.zeros(len(modes)), [], []
    for n in range(steps):
        image = load - eigenvalues * x
        forces.append(float(np.linalg.norm(image - x) / np.linalg.norm(image)))
        displacements.append(float(np.linalg.norm(x - before) / np.linalg.norm(x)) if n else 1.0)
        before, x = x, x + theta * (image - x)
    return {"ResRel(M:Displacement)": displacements, "ResRel(M:Force)": forces}


@pytest.mark.parametrize("modes", [(0.1, 1.0, 6.0), (0.5, 20.0)])
@pytest.mark.parametrize("left_out", [None, "ResRel(M:Force)", "ResRel(M:Displacement)"])
def test_a_tied_run_that_diverges_shows_rho_in_either_column(call, tmp_path, modes, left_out):
    columns = {name: values for name, values in both_columns(0.5, modes).items() if name != left_out}
    file = precice(tmp_path / "a.log", [columns])
    found = call("advise", "run", "--log", file, "--theta", "0.5", "--tied", "--json").document
    if modes[-1] > 6 and left_out == "ResRel(M:Force)":  # it may be relaxed, too: then rho is at least 1/(P - 1)
        assert found["interval"]["lo"]["value"] == pytest.approx(0.5 * 21 - 1, rel=0.01)
    else:
        assert found["interval"]["lo"]["value"] == pytest.approx(modes[-1], rel=0.01)
    assert "leave out tied" not in found["next"]["why"]


def test_a_log_that_rises_and_falls_as_with_aitken_keeps_no_theta(call, tmp_path):
    """Residuals of Aitken with first factor 0.5 on eigenvalues 0.1 to 6, where a constant 0.5 diverges."""
    eigenvalues, residuals = np.linspace(0.1, 6.0, 20), []
    coupling, x = vf.Coupling(rule="aitken", theta=0.5), np.zeros(20)
    for _ in range(25):
        image = np.arange(1.0, 21.0) - eigenvalues * x
        residuals.append(float(np.linalg.norm(image - x) / np.linalg.norm(image)))
        x = coupling.next(x, image)
    file = precice(tmp_path / "a.log", [{"ResRel(M:Force)": residuals}])
    answer = call("advise", "run", "--log", file, "--theta", "0.5")
    said = " ".join(answer.out.split())
    assert "this residual rises and falls as with Aitken or quasi-Newton" in said
    assert "keep" not in said


def test_thetas_are_for_the_logs_that_need_one(call, log, tmp_path):
    path = precice(tmp_path / "precice-Fluid-convergence.log", [{"ResRel(M:F)": [0.5**n for n in range(16)]}])
    iterations = tmp_path / "precice-Fluid-iterations.log"
    iterations.write_text("TimeWindow TotalIterations Iterations Convergence QNColumns\n1 16 16 1 14\n", "utf-8")
    one, name, _, theta = log(0.45)
    found = call("advise", "run", "--log", path, one, name, "--theta", theta, "--json").document
    assert [seen["theta"] for seen in found["logs"]] == [0.45]
    assert len(found["accelerated"]) == 1


@pytest.mark.parametrize("first", ["names its factor", "names Aitken"])
@pytest.mark.parametrize("digits", ["0.1637", "0.2"])
def test_the_call_that_the_last_line_asks_for_is_taken(call, tmp_path, first, digits):
    lines = {"names its factor": "factor (fixed): 0.5", "names Aitken": "factor (Aitken): 0.1{0}"}

    def log(name, line):
        steps = [
            f"Time = 1, iteration: {k}\nCurrent fsi under-relaxation {line.format(k)}\n"
            f"Current fsi relative residual norm: {0.7**k:.6g}\n"
            for k in range(1, 30)
        ]
        return written(tmp_path / name, "".join(steps))

    logs = ["--log", log("log.one", lines[first]), "--log", log("log.two", f"factor (fixed): {digits}")]
    found = call("advise", "run", *logs, "--theta", digits, "--json").document
    assert [seen["theta"] for seen in found["logs"]][-1] == float(digits)


def test_windows_that_end_where_they_were_largest_ask_for_a_smaller_theta(call, tmp_path):
    grows = [0.02 * 1.3**n for n in range(10)]
    file = precice(tmp_path / "a.log", [{"ResAbs(M:Force)": grows}] * 3)
    found = call("advise", "run", "--log", file, "--theta", "0.5", "--json").document
    assert found["next"]["theta"] == 0.25

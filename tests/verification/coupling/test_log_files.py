"""Convergence logs of other codes: every form they are written in is read, and a broken one is refused in one line."""

import math
from pathlib import Path

import pytest
from coupling_logs import MODES, kinds, kratos, linear_run, precice, tied_run, written
from strategies import AT_NIGHT

import verification as vf
from ndtheory import HypothesisError
from verification.coupling.from_logs import advise_logs
from verification.coupling.log_files import read_log
from verification.problem import ProblemError


def of(tmp_path, theta, name="run.log", steps=120):
    absolute, _ = linear_run(MODES, theta, steps)
    return precice(tmp_path / name, [{"ResAbs(Solid-Mesh:Force)": absolute}]), repr(theta)


def test_a_log_of_precice_is_read_by_window_and_field(tmp_path):
    absolute, relative = linear_run(MODES, 0.45, 30)
    first = {"ResRel(M:Displacement)": [math.inf, *relative[1:]], "ResAbs(M:Force)": absolute, "ResDrop(M:T)": absolute}
    second = {name: values[:20] for name, values in first.items()}
    log = read_log(precice(tmp_path / "precice-Solid-convergence.log", [first, second]))
    assert log.form == "preCICE"
    assert [column.residual for column in log.columns] == ["relative", "absolute", "drop"]
    assert [[len(window) for window in column.windows] for column in log.columns] == [[30, 20]] * 3
    assert log.columns[0].windows[0][0] == math.inf
    assert log.columns[1].windows[1] == pytest.approx(absolute[:20], rel=1e-8)


@pytest.mark.parametrize(
    ("name", "residual"),
    [
        ("ResAbs(Force,Mesh)", "absolute"),
        ("ResRel(Mesh:Force)", "relative"),
        ("ResDrop(Force)", "drop"),
        ("ResNorm(Pressure)", "relative"),  # before preCICE 2 any measure had this name, the relative one by default
        ("abs_norm", "absolute"),
        ("rel_residual", "relative"),
        ("residual", "assumed"),
    ],
)
def test_absolute_and_relative_residuals_are_told_apart_by_their_name(tmp_path, name, residual):
    log = written(tmp_path / "a.log", f"iteration {name}\n1 1.0\n2 0.5\n3 0.25\n")
    (column,) = read_log(log).columns
    assert (column.name, column.residual) == (name, residual)


PLAIN = [repr(0.8**n) for n in range(40)]


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(PLAIN) + "\n",
        "\r\n".join(PLAIN) + "\r\n",
        "\r".join(PLAIN) + "\r",
        "# residuals of a run\n\n" + "\n".join(PLAIN) + "\n",
        "inf\nnan\n" + "\n".join(PLAIN) + "\n",
        "1.#INF\n-nan(ind)\n" + "\n".join(PLAIN) + "\n",
        "\n".join(value.replace("e", "D") for value in PLAIN) + "\n",
        "iter,residual\n" + "".join(f"{n},{value}\n" for n, value in enumerate(PLAIN)),
        '"it";"residual"\n' + "".join(f"{n};{value.replace('.', ',')}\n" for n, value in enumerate(PLAIN)),
        "# it residual\n" + "".join(f"{n}\t{value}\n" for n, value in enumerate(PLAIN)),
        "it residual theta\n" + "".join(f"{n} {value} 0.45\n" for n, value in enumerate(PLAIN)),
    ],
    ids=["lf", "crlf", "cr", "comment", "inf", "windows inf", "fortran", "csv", "comma", "named in a comment", "theta"],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_plain_columns_are_read_however_they_are_written(tmp_path, text, encoding):
    found = advise_logs([(written(tmp_path / "é.txt", text, encoding), "0.45")])
    assert kinds(found) == ["mode-high"]
    assert found.readings[0].value == pytest.approx(3, rel=1e-6)
    assert found.logs[0].columns[0].residual == "assumed"


def test_what_kratos_prints_is_read_by_window_and_label(tmp_path):
    absolute, _ = linear_run(MODES, 0.45, 40)
    window = {"solid.force": absolute, "solid.disp": [v / 100 for v in absolute]}
    log = read_log(kratos(tmp_path / "screen.txt", [window, window]))
    assert log.form == "Kratos CoSimulation"
    assert [column.name for column in log.columns] == ["abs-norm of solid.force", "abs-norm of solid.disp"]
    assert [[len(one) for one in column.windows] for column in log.columns] == [[40, 40]] * 2
    found = advise_logs([(log.path, "0.45")])
    assert found.readings[0].value == pytest.approx(3, rel=0.02)  # three figures


#: Logs of Kratos 10.4.4, without what it prints of models: the plates of Section 6 with 13 contact nodes, tied, body 2
#: as Neumann body, theta or the first factor 0.11.
REAL = Path(__file__).parents[1] / "kratos_logs"


def test_the_residuals_in_a_log_of_kratos_are_those_of_this_project():
    (column,) = read_log(REAL / "constant.log").columns
    (window,) = column.windows
    assert (column.name, len(window)) == ("abs-norm of Body2.force", 28)
    pair = vf.build(vf.example("section6").changed(cells=((20, 3), (12, 3)), neumann_body=2))
    own, _ = tied_run(pair, 0.11, len(window))
    scaled = math.sqrt(pair.neumann.grid.size) * window
    assert scaled == pytest.approx(own, rel=column.digits)  # three figures are written


def test_the_factor_in_a_log_of_kratos_has_one_figure_and_a_theta_must_agree_with_it():
    log = read_log(REAL / "constant.log")
    assert (log.theta, log.theta_rounding) == (0.1, 0.05)
    found = advise_logs([(log.path, "0.11")], tied=True)
    high = next(reading for reading in found.readings if reading.kind == "mode-high")
    assert high.value == pytest.approx(13.5354, rel=0.03)  # of the matrices
    with pytest.raises(ProblemError, match=r"names a relaxation factor of 0\.1: needed the same theta, received 0\.3"):
        advise_logs([(log.path, "0.3")], tied=True)


def test_a_log_of_kratos_that_was_cut_off_in_a_number_ends_with_the_number_before(tmp_path):
    whole = (REAL / "constant.log").read_text("utf-8")
    cut = whole.rindex("e-", 0, whole.rindex("abs-tol"))
    (window,) = read_log(written(tmp_path / "cut.log", whole[: cut + 2])).columns[0].windows
    assert len(window) == 27


@pytest.mark.parametrize("cut", [1, 5, 9, 14, 20])
def test_a_last_line_that_was_cut_off_costs_one_step_and_is_told(tmp_path, cut):
    log, theta = of(tmp_path, 0.45, steps=40)
    whole = advise_logs([(log, theta)])
    written(log, log.read_text("utf-8")[:-cut])
    found = advise_logs([(log, theta)])
    assert found.readings[0].value == pytest.approx(whole.readings[0].value, rel=1e-6)
    assert (found.logs[0].notes != ()) == (cut > 1)  # without its line feed alone the line is whole


ITERATIONS = "  TimeWindow  TotalIterations  Iterations  Convergence  QNColumns  DeletedQNColumns  DroppedQNColumns\n"
SU2 = '"Time_Iter","Outer_Iter","bgs[P][0]"\n'
ELMER = "! solver  ss/ns  timestep  coupled  nonlin  norm  change\n"

BROKEN = {
    "nothing": ("", "this file is empty"),
    "no numbers": ("residuals follow\nsoon\n", "no line of numbers"),
    "binary": (b"\x7fELF\x00\x01", "binary"),
    "a word": ("res\n1.0\n0.5\nfailed\n0.2\n", "line 4: received 'failed', needed a number"),
    "a short line": ("it res\n1 1.0\n2\n3 0.2\n", "line 3: needed 2 numbers"),
    "a long line": ("it res\n1 1.0\n2 0.5 7\n3 0.2\n", "line 3: needed 2 numbers"),
    "a gap": ("Iteration ResAbs(F)\n1 1.0\n2 0.5\n4 0.2\n", "line 4: received '4', needed iteration 3"),
    "an iteration nan": ("Iteration ResAbs(F)\n1 1.0\nnan 0.5\n3 0.2\n", "line 3: received 'nan'"),
    "negative": ("1.0\n0.5\n-0.2\n0.1\n", "line 3: received '-0.2', needed a residual >= 0"),
    "all inf": ("inf\nnan\n", "every number"),
    "unnamed columns": ("1 2\n3 4\n", "names of its 2 columns"),
    "no residual": ("force disp\n1 2\n3 4\n", "columns force, disp"),
    "counts of iterations": (ITERATIONS + "1 4 4 1 0 0 0\n", "convergence.log"),
    "a count that is nan": (ITERATIONS + "1 4 nan 1 3 0 0\n", "convergence.log"),
    "inf columns": (ITERATIONS + "1 4 4 1 inf 0 0\n", "convergence.log"),
    "blank lines, then words": ("\n" * 50 + "the residual is small\nand smaller\n", "no line of numbers"),
    "SU2, 10^400": (SU2 + "0,0,400.0\n0,1,399.0\n", "needed decimal logarithms"),
    "SU2, each tenth iteration": (
        SU2 + "0,0,-1.0\n0,10,-3.0\n0,20,-5.0\n",
        "line 3: received '10', needed iteration 1",
    ),
    "Elmer, negative": (
        ELMER + "1 1 1 1 1 1.7 0.2\n1 1 1 2 1 1.7 -0.1\n",
        "line 3: received '-0.1', needed a residual",
    ),
    "Elmer, no steady state": (ELMER + "1 2 1 1 1 1.7 0.2\n1 2 1 2 1 1.7 0.1\n", "with 1 in the column ss/ns"),
    "kratos is silent": ("GaussSeidelStrong: Coupling iteration: 1 / 10\n", "echo_level"),
    "kratos, a word": ("Coupling iteration: 1 / 9\n abs-norm = x1 | abs-tol\n", "line 2: received 'x1', needed a nu"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_log_is_refused_in_one_line_that_names_where(tmp_path, name):
    text, fragment = BROKEN[name]
    log = written(tmp_path / "broken.log", text)
    with pytest.raises(ProblemError) as error:
        advise_logs([(log, "0.5")])
    line = str(error.value)
    assert line.startswith(str(log))
    assert fragment in line
    assert "\n" not in line


@pytest.mark.parametrize("word", ["nan", "inf"])
def test_a_pattern_that_finds_no_number_of_an_iteration_is_refused_in_one_line(tmp_path, word):
    log = written(tmp_path / "a.log", f"it 1 res 1.0\nit {word} res 0.5\n")
    with pytest.raises(ProblemError, match=f"line 2: received '{word}', needed a number"):
        advise_logs([(log, "0.5")], pattern=r"it (?P<iteration>\S+) res (?P<residual>\S+)")


def test_a_factor_that_changes_by_no_rule_that_is_named_is_refused(tmp_path):
    refused = lambda: pytest.raises(ProblemError, match=r"constant relaxation|same theta")
    changing = written(tmp_path / "a.csv", "it,res,theta\n1,1.0,0.5\n2,0.5,0.6\n3,0.2,0.5\n")
    with refused():
        advise_logs([(changing, "0.5")])
    constant = written(tmp_path / "b.csv", "it,res,omega\n" + "".join(f"{n},{0.8**n},0.5\n" for n in range(40)))
    with refused():
        advise_logs([(constant, "0.4")])
    assert advise_logs([(constant, "0.5")]).readings
    absolute, _ = linear_run(MODES, 0.45, 40)
    with refused():
        advise_logs([(kratos(tmp_path / "k.log", [{"f": absolute}], lambda k: f"{0.1 + k / 100}"), "0.45")])
    aitken = kratos(tmp_path / "k.log", [{"f": absolute}])
    aitken.write_text(aitken.read_text("utf-8") + "AitkenConvergenceAccelerator: reset\n", "utf-8")
    assert advise_logs([(aitken, "0.45")]).theta is None


def test_quasi_newton_is_recognised_by_the_log_of_iteration_counts_beside(tmp_path):
    log, theta = of(tmp_path, 0.45, name="precice-Solid-convergence.log")
    beside = written(tmp_path / "precice-Solid-iterations.log", ITERATIONS + "1 40 40 1 0 0 0\n")
    assert advise_logs([(log, theta)]).readings  # constant relaxation has the column, too
    written(beside, ITERATIONS + "1 40 40 1 0 0 0\n2 44 4 1 3 0 0\n")
    found = advise_logs([(log, theta)])
    assert (found.roles, found.accelerated[0].accelerator) == ((), "quasi-Newton, up to 3 columns")


@pytest.mark.parametrize("theta", ["-1", "nan", "x"])
def test_a_theta_outside_its_range_is_refused(tmp_path, theta):
    log, _ = of(tmp_path, 0.45)
    with pytest.raises(HypothesisError, match="0 < theta <= 1"):
        advise_logs([(log, theta)])
    with pytest.raises(ValueError, match="one log"):
        advise_logs([])


def test_a_long_log_is_read_whole(tmp_path):
    """Twenty thousand lines by day, a million at night."""
    windows = 20000 if AT_NIGHT else 400
    absolute, relative = linear_run(MODES, 0.45, 50)
    log = precice(tmp_path / "a.log", [{"ResAbs(M:F)": absolute, "ResRel(M:F)": relative}] * windows)
    found = advise_logs([(log, "0.45")])
    assert found.logs[0].columns[0].windows == windows
    assert found.readings[0].value == pytest.approx(3, rel=1e-6)

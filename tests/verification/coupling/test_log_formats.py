"""The formats of logs: each is known by itself, and gives the advice of the same numbers in columns."""

import re

import numpy as np
import pytest
from coupling_logs import linear_run, written

import verification as vf
from verification.coupling.log_files import read_log
from verification.coupling.log_lines import Form, columns_of, form_of, to_try
from verification.problem.tables import ProblemError
from verification.registry import LOG_FORMATS

READ = [form for form in LOG_FORMATS.values() if not (isinstance(form, Form) and form.refused)]
LINES = [form for form in READ if isinstance(form, Form)]

#: Residuals of two time windows.
WINDOWS = tuple(linear_run((0.2, 0.5, 1.1, 3.0), 0.45, 30)[0][start:] for start in (0, 4))

#: What each program prints for iteration n of window w with residual r, and what begins a window.
PRINTS = {
    "Kratos CoSimulation": ("", 'Coupling iteration: {n} / 50\nConvergence for "F": no | abs-norm = {r:.9e} | a\n'),
    "preCICE output": (
        "",
        "it {n} (max: 50), time-window {w} (max: 2), t 0, Dt 1\n"
        'absolute convergence measure: two-norm diff of data "F" = {r:.9e}, limit = 4.00e-02, conv = false\n',
    ),
    "FOAM-FSI": (
        "",
        "Time = 0.{w}, iteration = {n}, level = 0\n"
        "relative convergence measure: two-norm diff = {r:.9e}, limit = 0.1, suffices = false, conv = false\n"
        "Fixed relaxation post processing with factor 0.45\n",
    ),
    "solids4foam": (
        "",
        "Time = 0.{w}, iteration: {n}\nCurrent fsi under-relaxation factor (fixed): 0.45\n"
        "FSI relative residual1 norm for interface 0: {r:.9e}\nFSI residual2 norm for interface 0: 1\n",
    ),
    "solids4foam heat": ("", "Time = 0.{w}, iteration: {n}\nCHT relative residual norm for interface 0: {r:.9e}\n"),
    "Norma.jl": ("", "Criterion [{n}] |ΔU| = {r:.9e} : |ΔU|/|U| = 3.1e-01 : conv = NO\n"),
    "CoCoNuT": ("Iteration       Norm residual\n", "{n:<16d}{r:<28.17e}\n"),
    "OpenMDAO": ("=\n", "NL: NLBGS {n} ; {r:.9g} 0.5\n"),
    "Elmer": (
        "",
        "SolveEquations:  Coupled system iteration:            {n}\n"
        "ComputeChange: NS (ITER=1) (NRM,RELC): (  1.7  0.5 ) :: a\n"
        "ComputeChange: SS (ITER={n}) (NRM,RELC): (  1.7  {r:.9e} ) :: a\n",
    ),
    "GEOS": (
        "",
        "  Iteration {n}: reservoir\n    ( R ) = ( 7.50e-01 )\n  Iteration {n}: outer-loop convergence check\n"
        "  ( Rflow ) = ( 1.00e-03 )  ( Rsolid ) = ( 1.00e-03 )  ( R ) = ( {r:.9e} )\n",
    ),
}


def printed(name, windows):
    head, lines = PRINTS[name]
    each = ((w, n, r) for w, series in enumerate(windows, 1) for n, r in enumerate(series, 1))
    return "".join(head * (n == 1) + lines.format(w=w, n=n, r=r) for w, n, r in each)


@pytest.mark.parametrize("form", READ, ids=lambda form: form.name)
def test_the_example_of_a_format_is_known_by_itself_and_by_its_name(tmp_path, form):
    path = written(tmp_path / "a.log", form.example)
    found = read_log(path)
    assert found.form == form.name
    assert found.columns
    assert all(np.isfinite(window).all() for column in found.columns for window in column.windows)
    assert read_log(path, name=form.name).form == form.name
    assert form.program
    if isinstance(form, Form) and "factor" in form.example:
        assert found.theta is not None


@pytest.mark.parametrize("form", LINES, ids=lambda form: form.name)
def test_no_sign_of_a_format_is_in_the_example_of_another_one(form):
    others = (other.example for other in LOG_FORMATS.values() if other is not form)
    assert not [sign for example in others for sign in form.signs if sign in example]


@pytest.mark.parametrize("name", PRINTS)
def test_what_a_program_prints_is_read_window_by_window(tmp_path, name):
    (column,) = read_log(written(tmp_path / "a.log", printed(name, WINDOWS))).columns
    assert [len(window) for window in column.windows] == [len(series) for series in WINDOWS]
    np.testing.assert_allclose(np.concatenate(column.windows), np.concatenate(WINDOWS), rtol=1e-8)


@pytest.mark.parametrize("name", [name for name in PRINTS if LOG_FORMATS[name].residual == "absolute"])
def test_the_advice_is_that_of_the_same_numbers_in_columns(tmp_path, name):
    series = linear_run((0.2, 0.5, 1.1, 3.0), 0.45, 60)[0]
    log = written(tmp_path / "a.log", printed(name, [series]))
    plain = written(tmp_path / "b.txt", "".join(f"{value:.9e}\n" for value in series))
    found, expected = (vf.advise_logs([(path, "0.45")], tied=True) for path in (log, plain))
    assert found.next.theta == expected.next.theta
    assert [one.kind for one in found.readings] == [one.kind for one in expected.readings]


def test_columns_of_su2_are_logarithms_of_outer_iterations(tmp_path):
    rows = [f"{w},{n},{np.log10(r)},-9.0" for w, series in enumerate(WINDOWS) for n, r in enumerate(series)]
    text = '"Time_Iter","Outer_Iter","bgs[P][0]","rms[P][0]"\n' + "\n".join(rows) + "\n"
    (column,) = read_log(written(tmp_path / "history.csv", text)).columns
    np.testing.assert_allclose(np.concatenate(column.windows), np.concatenate(WINDOWS), rtol=1e-9)
    without = written(tmp_path / "rms.csv", text.replace("bgs[P][0]", "rms[U][0]"))
    with pytest.raises(ProblemError, match="own solver"):
        read_log(without)


def test_logarithms_are_taken_back_where_that_is_asked_for(tmp_path):
    logs = [f"{np.log10(value):.12f}" for value in WINDOWS[0]]
    columns = written(tmp_path / "a.txt", "residual\n" + "\n".join(logs) + "\n")
    lines = written(tmp_path / "b.txt", "".join(f"step log res: {value}\n" for value in logs))
    for found in (read_log(columns, log10=True), read_log(lines, r"log res: (\S+)", log10=True)):
        np.testing.assert_allclose(found.columns[0].windows[0], WINDOWS[0], rtol=1e-10)
    with pytest.raises(ProblemError, match="residual >= 0"):
        read_log(columns)
    with pytest.raises(ProblemError, match="needed decimal logarithms"):
        read_log(written(tmp_path / "c.txt", "residual\n80.0\n64.0\n"), log10=True)


@pytest.mark.parametrize(("name", "line", "accelerator"), [
    ("FOAM-FSI", "Aitken post processing with factor {}", "Aitken"),
    ("solids4foam", "Current fsi under-relaxation factor (Aitken) of wall: {}", "Aitken"),
    ("solids4foam", "Modes before clean-up (wall): 2, modes after clean-up (wall): 2", "IQN-ILS"),
    ("CoCoNuT", " The coupled solver CoupledSolverIQNI has the following components:", "IQNI"),
])  # fmt: skip
def test_other_relaxation_is_told_by_its_name(tmp_path, name, line, accelerator):
    text = printed(name, WINDOWS[:1]) + "".join(f"{line.format(0.4 + n / 100)}\n" for n in range(3))
    assert read_log(written(tmp_path / "a.log", text)).accelerator == accelerator


@pytest.mark.parametrize("kind", ["Secant initialization", "Steffensen half-step    "])
def test_moose_reads_no_solve_of_its_own_and_knows_its_accelerators(tmp_path, kind):
    text, known = "", []
    for n, r in enumerate([4.0, 2.0, 1.0]):
        known.append(f"{n:2d} {kind} |R| = {r:e}\n")
        text += " 0 Nonlinear |R| = 3.000000e+00\n" + "".join(known)
    found = read_log(written(tmp_path / "a.log", " 0 Steffensen initialization |R| = 4.0\n" * ("St" in kind) + text))
    assert found.columns[0].windows[-1].tolist() == [4.0, 2.0, 1.0]
    assert found.accelerator == kind.split()[0]


@pytest.mark.parametrize("names", [("QNColumns",), ("DeletedColumns",), ("avgConvRate(0)", "deleted_Columns")])
def test_quasi_newton_of_each_version_of_precice_is_known_by_its_counts(tmp_path, names):
    head = f"Timesteps Total_Iterations Iterations Convergence {' '.join(names)}\n"
    rows = "".join(f"{w} {4 * w} 4 1 {'0.5 ' * (len(names) - 1)}{w}\n" for w in (1, 2, 3))
    written(tmp_path / "precice-A-iterations.log", head + rows)
    beside = written(tmp_path / "precice-A-convergence.log", "Timestep Iteration resNorm(0)\n1 1 0.5\n1 2 0.1\n")
    assert "quasi-Newton" in read_log(beside).accelerator


def test_residuals_of_linear_solvers_are_refused_but_in_logs_that_have_those_of_a_coupling_too(tmp_path):
    form = LOG_FORMATS["OpenFOAM regions"]
    with pytest.raises(ProblemError, match="linear solver"):
        read_log(written(tmp_path / "a.log", form.example))
    text = "".join(form.example + part for part in re.split(r"(?=Time)", printed("solids4foam", WINDOWS[:1])))
    assert read_log(written(tmp_path / "b.log", text)).form == "solids4foam"


@pytest.mark.parametrize("line", [
    "Step {n} sub 2: interface residual L2 = {r:.3e} (tol 1e-3)",
    "[fsi] coupling error ({n}): {r:.6f} m/s",
    "k={n} change of T: {r:.4e}",
])  # fmt: skip
def test_a_log_that_no_format_fits_gets_a_pattern_that_reads_it(tmp_path, line):
    text = "begin\n" + "".join(line.format(n=n, r=r) + "\n" for n, r in enumerate(WINDOWS[0][:9]))
    path = written(tmp_path / "a.log", text)
    with pytest.raises(ProblemError, match="to try: --pattern") as told:
        read_log(path)
    pattern = re.search(r"--pattern '(.*)'", str(told.value))[1]
    (column,) = read_log(path, pattern).columns
    np.testing.assert_allclose(column.windows[0], WINDOWS[0][:9], rtol=1e-3)


def test_the_nearest_format_is_named():
    assert "Kratos" in to_try('Convergence of "Force": Converged : no | abs-norm : 1.25 | abs_tol : 1e-9\n' * 3)
    assert "Kratos" in to_try("Coupling iteration no 1 / 20\n" * 3)  # the first line of its example
    assert to_try("1 2.0 3.0\n" * 5) == ""
    assert form_of("nothing") is None
    assert columns_of(["residual"]) is None

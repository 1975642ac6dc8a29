"""`sweep`: its file, its screen, its table and what ends it."""

import csv
import importlib.util
import os
import re
import signal
from fractions import Fraction

import pytest
from complaints import assert_names
from processes import ended
from strategies import AT_NIGHT

import verification as vf
from verification.cli.console import every
from verification.sweeps import workers
from verification.sweeps.grid import read_sweep
from verification.sweeps.store import plan

GRID = "theta = [0.4, 0.6]\nfriction = [0.1, 0.2]"


@pytest.fixture
def sweep_file(write, tmp_path):
    """Write a problem and a sweep file; returns the path of the latter."""

    def written(grid=GRID, problem='problem = "problem.toml"', name="grid.toml"):
        write()
        path = tmp_path / name
        path.write_text(f"{problem}\n[grid]\n{grid}\n", encoding="utf-8")
        return path

    return written


def test_a_sweep_is_shown_and_written_beside_its_file(call, sweep_file, tmp_path):
    answer = call("sweep", sweep_file(), "--jobs", 1)
    assert (answer.status, answer.err) == (0, f"written: {tmp_path / 'grid.csv'}\n")
    assert "WHICH THETA TAKES THE FEWEST STEPS?" in answer.out
    assert max(map(len, answer.out.splitlines()[:-1])) <= 80  # the last line has a path
    text = (tmp_path / "grid.csv").read_text("utf-8")
    read = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    expected = vf.sweep(tmp_path / "problem.toml", theta=["0.4", "0.6"], friction=["0.1", "0.2"]).rows
    assert [(float(one["theta"]), int(one["iterations"])) for one in read] == [
        (each["theta"], each["iterations"]) for each in expected
    ]
    assert call("sweep", sweep_file(), "--jobs", 1).status == 0  # its own file may go
    folder = tmp_path / "results"
    assert call("sweep", sweep_file(), "--jobs", 1, "-o", folder, "--json").document["asked"] == 4
    assert (folder / "grid.csv").read_text("utf-8") == text


def test_a_range_has_both_ends_exactly(sweep_file):
    _, grid = read_sweep(
        sweep_file("theta = { start = 0.05, stop = 0.95, step = 0.05 }\nrefine = { start = 0, stop = 2, step = 1 }")
    )
    assert grid.axes["theta"] == tuple(Fraction(i, 20) for i in range(1, 20))
    assert grid.axes["refine"] == (0, 1, 2)


def test_a_file_comes_before_a_built_in_problem_of_its_name(sweep_file, write):
    path = sweep_file(problem='problem = "section6"')
    assert read_sweep(path)[0] == vf.example("section6")
    write(name="section6")
    assert read_sweep(path)[0] == vf.load(path.parent / "problem.toml")


@pytest.mark.parametrize(
    ("grid", "problem", "fragments"),
    [
        (GRID, 'problem = "nowhere"', ["grid.toml", 'problem = "nowhere"', "section6"]),
        (GRID, "problem = 3", ["grid.toml", "problem = 3", "text"]),
        (GRID, "", ["grid.toml", "problem", "missing"]),
        (GRID, 'problem = "section6"\nproblems = 1', ["grid.toml", "problems", "unknown"]),
        (GRID, 'problem = "."', ["folder"]),
        ("", 'problem = "section6"', ["grid.toml", "grid", "at least one axis"]),
        ("theta = [0.4", 'problem = "section6"', ["grid.toml", "not TOML"]),
        ("theta = 0.4", 'problem = "section6"', ["grid.theta = 0.4", "a list"]),
        ("thetas = [0.4]", 'problem = "section6"', ["grid.thetas", "unknown axis"]),
        ("young = [7e4]", 'problem = "section6"', ["grid.young", "two numbers"]),
        ("theta = { start = 0.1, stop = 0.9 }", 'problem = "section6"', ["grid.theta.step", "missing"]),
        ("theta = { start = 0.1, stop = 0.9, step = 0.3 }", 'problem = "section6"', ["grid.theta", "both ends"]),
        ("theta = { start = 0.1, stop = 0.9, step = 0 }", 'problem = "section6"', ["grid.theta.step", "> 0"]),
        ("friction = { start = 0, stop = 1, step = 1e-9 }", 'problem = "section6"', ["grid.friction", "at most"]),
        ("theta = { start = 0.1, stop = 0.2, step = 0.1, by = 1 }", 'problem = "section6"', ["grid.theta.by"]),
    ],
    ids=str,
)
def test_a_bad_sweep_file_is_one_line(call, sweep_file, tmp_path, grid, problem, fragments):
    complaint = call("sweep", sweep_file(grid, problem)).complaint
    assert [fragment for fragment in fragments if fragment not in complaint] == []
    assert not (tmp_path / "grid.csv").exists()


def test_a_table_of_somebody_else_stays(call, sweep_file, tmp_path, monkeypatch):
    (tmp_path / "grid.csv").write_text("mine")
    monkeypatch.setattr(workers, "row", None)
    assert "not written by this program" in call("sweep", sweep_file()).complaint
    assert (tmp_path / "grid.csv").read_text() == "mine"


@pytest.fixture
def interrupted(monkeypatch):
    """``interrupted(n)``: Ctrl-C while row n is made; returns the list of the values of rows that are begun."""

    def arrange(last):
        row, seen = workers.row, []

        def counted(*args):
            seen.append(args[1])
            if len(seen) == last:
                signal.raise_signal(signal.SIGINT)
            return row(*args)

        monkeypatch.setattr(workers, "row", counted)
        return seen

    return arrange


@pytest.mark.parametrize("last", [1, 3])
def test_ctrl_c_writes_the_rows_that_are_done(call, sweep_file, tmp_path, interrupted, last):
    seen = interrupted(last)
    answer = call("sweep", sweep_file(), "--jobs", 1, "--json")
    assert answer.status == 130
    assert len(seen) == last
    if last == 1:
        assert (answer.out, (tmp_path / "grid.csv").exists()) == ("", False)
        return
    assert f"interrupted after {last - 1} of 4 rows" in answer.err
    assert answer.out.count('"schema"') == 1
    rows = [line for line in (tmp_path / "grid.csv").read_text("utf-8").splitlines() if not line.startswith("#")]
    assert len(rows) == last


# --- the store ---


@pytest.mark.parametrize(("store", "options"), [("grid.sqlite", ()), ("rows.db", ("--store", "rows.db"))])
def test_a_second_call_runs_nothing_and_says_so(call, sweep_file, tmp_path, monkeypatch, store, options):
    monkeypatch.chdir(tmp_path)
    first = call("sweep", sweep_file(), "--jobs", 1, *options)
    text = (tmp_path / "grid.csv").read_text("utf-8")
    assert [path.name for path in tmp_path.iterdir() if path.suffix in (".sqlite", ".db")] == [store]
    monkeypatch.setattr(workers, "row", None)
    again = call("sweep", sweep_file(), "--jobs", 1, *options)
    assert (again.status, again.out) == (0, first.out)
    assert again.err.splitlines()[0].endswith(f"{store}: 4 of 4 rows were there")
    assert (tmp_path / "grid.csv").read_text("utf-8") == text


def test_after_ctrl_c_the_same_command_goes_on(call, sweep_file, tmp_path, interrupted, monkeypatch):
    seen = interrupted(3)
    answer = call("sweep", sweep_file(), "--jobs", 1)
    assert answer.status == 130
    assert answer.err.splitlines()[-1].startswith("interrupted after 2 of 4 rows: those are in ")
    assert answer.err.endswith("; the same command goes on from there\n")
    assert call("sweep", sweep_file(), "--jobs", 1).status == 0
    assert len(seen) == 5
    assert seen[2] == seen[3]
    monkeypatch.undo()
    text = (tmp_path / "grid.csv").read_text("utf-8")
    assert call("sweep", sweep_file(), "--jobs", 1, "--fresh").status == 0
    assert (tmp_path / "grid.csv").read_text("utf-8") == text


def test_a_dry_run_counts_and_runs_nothing(call, sweep_file, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(workers, "row", None)
        answer = call("sweep", sweep_file(), "--dry-run")
        assert (answer.status, answer.err) == (0, "")
        assert "4 runs" in answer.out
        assert "0 are in the store, 4 are left; nothing was run" in answer.out
        assert list(tmp_path.glob("grid.*")) == [tmp_path / "grid.toml"]
    call("sweep", sweep_file(GRID.replace("0.1, 0.2", "0.1")), "--jobs", 1)
    document = call("sweep", sweep_file(), "--dry-run", "--json").document
    assert [document[name] for name in ("asked", "stored", "left")] == [4, 2, 2]
    assert document["store"] == str(tmp_path / "grid.sqlite")
    assert call("sweep", sweep_file(), "--dry-run", "--fresh", "--json").document["left"] == 4


def test_rows_that_ended_in_an_error_stay_until_retry(call, sweep_file, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("verification.sweeps.row.course", lambda *given: 1 / 0)
        assert call("sweep", sweep_file(), "--jobs", 1).status == 0
    answer = call("sweep", sweep_file(), "--jobs", 1)
    assert "4 of these rows ended in an error and stay as they are; --retry makes them again" in answer.err
    assert "4 error" in answer.out
    assert call("sweep", sweep_file(), "--dry-run", "--retry", "--json").document["left"] == 4
    answer = call("sweep", sweep_file(), "--jobs", 1, "--retry")
    assert ("error" in answer.err, "4 converged" in answer.out) == (False, True)


@pytest.mark.parametrize(
    ("options", "fragments"),
    [
        (["--store", "."], ["needed the name of a file for the store"]),
        (["--store", "nowhere/rows.sqlite"], ["nowhere", "needed a folder that exists"]),
        (["--store", "grid.toml"], ["grid.toml", "not a store of this program"]),
        (["--plot", "theta"], ["--plot", "X,Y or X,Y,CURVES"]),
        (["--plot", "theta,nonsense"], ["--plot", "iterations_paper"]),
        (["--log", "nowhere/log"], ["nowhere/log", "--log"]),
        (["--export", "grid.toml"], ["grid.toml", "needed a folder to write to (--export)"]),
        (["--dask", "nonsense", "--jobs", "2"], ["either --jobs", "or --dask"]),
    ],
    ids=str,
)
def test_what_serves_for_no_sweep_is_one_line(call, sweep_file, tmp_path, monkeypatch, options, fragments):
    path = sweep_file()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workers, "row", None)
    before = path.read_bytes()
    complaint = call("sweep", path, *options).complaint
    assert [fragment for fragment in fragments if fragment not in complaint] == []
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("options", "module", "extra"),
    [
        (("--dask", "tcp://host:8786"), "distributed", "cluster"),
        (("--export", "results"), "xarray", "dataset"),
        (("--export", "results"), "netCDF4", "dataset"),
    ],
)
def test_without_its_extra_an_option_is_refused_before_anything_runs(
    call, sweep_file, tmp_path, monkeypatch, options, module, extra
):
    find = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == module else find(name))
    monkeypatch.setattr(workers, "row", None)
    monkeypatch.chdir(tmp_path)
    path = sweep_file()
    before = sorted(tmp_path.iterdir())
    assert_names(call("sweep", path, *options).complaint, options[0], module, f"pip install 'ndtheory[{extra}]'")
    assert sorted(tmp_path.iterdir()) == before


#: The command in a process group that gets Ctrl-C so many seconds after the workers were asked for, as on a terminal.
#: The thread that feeds them comes late by so many seconds, the first argument, and pieces of work come one by one.
INTERRUPTED = """
    import os, signal, sys, threading, time
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command sets it before numpy comes: threads would take the signal
    import joblib.executor
    from joblib.externals.loky.process_executor import _ExecutorManagerThread as Manager
    from verification.cli import main

    late, look = float(sys.argv.pop(1)), Manager.wait_result_broken_or_wakeup
    Manager.wait_result_broken_or_wakeup = lambda manager: (look(manager), time.sleep(late))[0]
    call = joblib.executor.get_memmapping_executor
    waits = [float(sys.argv.pop(1))]

    def called(*args, **named):
        if waits:
            threading.Timer(waits.pop(), os.killpg, (0, signal.SIGINT)).start()
        executor = call(*args, **named)
        submit = executor.submit
        executor.submit = lambda *piece: (submit(*piece), time.sleep(late / 10))[0]
        return executor

    joblib.executor.get_memmapping_executor = called
    sys.exit(main())
"""


@pytest.mark.parametrize(
    ("late", "wait"),
    [
        (0.5, 0.02),
        (0.0, 1.2),
        *[(late, wait) for late in (0.0, 0.5) for wait in (0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 2.5, 3.0)]
        * AT_NIGHT,
    ],
)
def test_ctrl_c_on_a_terminal_is_one_line_whatever_the_workers_do(sweep_file, tmp_path, late, wait):
    path = sweep_file("theta = { start = 0.01, stop = 0.99, step = 0.01 }\nfriction = [0.1, 0.2, 0.3, 0.4, 0.5]")
    answer = ended(INTERRUPTED, late, wait, "sweep", path, "--jobs", 2)
    assert "Traceback" not in answer.stderr
    if answer.returncode == 0:  # too late
        return
    assert answer.returncode == 130
    *_, last = answer.stderr.splitlines()
    if not answer.stdout:
        assert last == "interrupted before anything was computed"
        return
    count = int(re.match(r"interrupted after (\d+) of 495 rows", last)[1])
    assert plan(*read_sweep(path), tmp_path / "grid.sqlite").stored == count


# --- plots, exports, progress ---


def test_plots_are_drawn_beside_the_table(call, sweep_file, tmp_path):
    options = ("--plot", "theta,iterations", "--plot", "friction,rho,theta", "--plot", "theta,law")
    answer = call("sweep", sweep_file(), "--jobs", 1, *options)
    assert answer.status == 0
    assert sorted(path.name for path in tmp_path.glob("*.svg")) == [
        "grid-friction-rho-theta.svg",
        "grid-theta-iterations.svg",
    ]
    assert b"relaxation factor theta" in (tmp_path / "grid-theta-iterations.svg").read_bytes()
    assert "grid-theta-law.svg is not drawn: no row has a number for law" in answer.err


def test_names_that_are_no_utf_8_are_written_and_exported(call, sweep_file, tmp_path):
    pytest.importorskip("netCDF4")
    name, folder = (os.fsdecode(text) for text in (b"gr\xff", b"ex\xfe"))
    try:
        path = sweep_file().rename(tmp_path / f"{name}.toml")
    except OSError:
        pytest.skip("a file system that needs names in UTF-8")
    options = {"--export": tmp_path / folder, "--plot": "theta,iterations", "--log": tmp_path / f"{name}.log"}
    assert call("sweep", path, "--jobs", 1, *(word for option in options.items() for word in option)).status == 0
    assert sorted(each.name for each in (tmp_path / folder).iterdir()) == [f"{name}.csv", f"{name}.nc"]
    assert (tmp_path / folder / f"{name}.nc").read_bytes()[1:4] == b"HDF"
    assert (tmp_path / f"{name}-theta-iterations.svg").is_file()


def test_a_log_has_lines_about_rows_done_failed_and_left(call, sweep_file, tmp_path):
    grid = "theta = [0.4, 0.6]\nrefine = [0, 8]"
    assert call("sweep", sweep_file(grid), "--jobs", 1, "--log", tmp_path / "log").status == 0
    first, *_, last = (tmp_path / "log").read_text("utf-8").splitlines()
    when = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d "
    assert re.fullmatch(when + "runs: 0 done, 0 failed, 4 left", first)
    assert re.fullmatch(when + "runs: 4 done, 2 failed, 0 left, about 0 s to go", last)


@pytest.mark.parametrize("content", [b"", None])
def test_a_new_log_an_empty_one_and_one_of_a_sweep_are_continued(call, sweep_file, tmp_path, content):
    log = tmp_path / "log"
    if content is not None:
        log.write_bytes(content)
    for _ in range(2):
        assert call("sweep", sweep_file(), "--jobs", 1, "--log", log).status == 0
    lines = log.read_text("utf-8").splitlines()
    assert [line.split(" ", 2)[2] for line in lines if " 4 left" in line] == ["runs: 0 done, 0 failed, 4 left"]
    assert lines[-1].endswith("runs: 4 done, 0 failed, 0 left")


@pytest.mark.parametrize("name", ["problem.toml", "grid.toml", "notes", "binary", "folder", "grid.csv", "grid.sqlite"])
def test_a_log_is_appended_to_no_other_file_and_nothing_is_changed(call, sweep_file, tmp_path, monkeypatch, name):
    path = sweep_file()
    (tmp_path / "notes").write_text("2026-01-01 10:00:00 mine\n", encoding="utf-8")
    (tmp_path / "binary").write_bytes(bytes(range(256)))
    (tmp_path / "folder").mkdir()
    before = {file: file.is_file() and file.read_bytes() for file in tmp_path.iterdir()}
    monkeypatch.setattr(workers, "row", None)
    complaint = call("sweep", path, "--jobs", 1, "--log", tmp_path / name).complaint
    assert f"{tmp_path / name}: " in complaint
    assert "(--log)" in complaint
    assert {file: file.is_file() and file.read_bytes() for file in tmp_path.iterdir()} == before


def test_lines_about_progress_keep_their_distance():
    now, lines = 0.0, []
    tell = every(10, lines.append, at_once=True, clock=lambda: now)
    later = every(10, lines.append, clock=lambda: now)
    for now in range(25):
        tell(f"{now} done", now / 24)
        later(f"later {now}", now / 24)
    assert [line.split(" ", 2)[2] for line in lines] == [
        *("0 done", "10 done", "later 10", "20 done", "later 20", "24 done")
    ]

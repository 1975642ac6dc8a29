"""`sweep`: its file, its screen, its table and what ends it."""

import csv
import signal
from fractions import Fraction

import pytest

import verification as vf
from verification.sweeps import sweep
from verification.sweeps.sweep_file import read_sweep

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
        ("theta = [2]", 'problem = "section6"', ["grid.theta = 2", "0 < theta < 1"]),
        ("thetas = [0.4]", 'problem = "section6"', ["grid.thetas", "unknown axis"]),
        ("young = [7e4]", 'problem = "section6"', ["grid.young", "two numbers"]),
        ("theta = { start = 0.1, stop = 0.9 }", 'problem = "section6"', ["grid.theta.step", "missing"]),
        ("theta = { start = 0.1, stop = 0.9, step = 0.3 }", 'problem = "section6"', ["grid.theta", "both ends"]),
        ("theta = { start = 0.9, stop = 0.1, step = 0.1 }", 'problem = "section6"', ["grid.theta", "both ends"]),
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
    monkeypatch.setattr(sweep, "row", None)
    assert "not written by this program" in call("sweep", sweep_file()).complaint
    assert (tmp_path / "grid.csv").read_text() == "mine"


@pytest.mark.parametrize("last", [1, 3])
def test_ctrl_c_writes_the_rows_that_are_done(call, sweep_file, tmp_path, monkeypatch, last):
    row, seen = sweep.row, []

    def interrupted(*args):
        seen.append(1)
        if len(seen) == last:
            signal.raise_signal(signal.SIGINT)
        return row(*args)

    monkeypatch.setattr(sweep, "row", interrupted)
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

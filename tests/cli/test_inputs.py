"""``ndtheory example --inputs``: a file for each command that reads one, computed when it is written."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import verification as vf
from verification.coupling.log_files import read_log
from verification.output.inputs import INPUTS

ROOT = Path(__file__).parents[2]


@pytest.fixture
def inputs(call, tmp_path):
    answer = call("example", "--inputs", tmp_path)
    assert (answer.status, answer.err) == (0, "")
    assert [str(tmp_path / name) in answer.out for name in INPUTS] == [True] * len(INPUTS)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(INPUTS)
    return tmp_path


def test_matrices_vectors_and_the_log_are_those_of_the_problem_beside_them(inputs):
    pair = vf.build(vf.load(inputs / "my.toml"))
    for name, side in zip(("S1", "S2"), pair.along_y, strict=True):
        assert np.array_equal(np.load(inputs / f"{name}.npy"), side.schur)
    made = vf.run(vf.load(inputs / "my.toml").changed(friction=0), theta="0.5")
    X, TX = np.load(inputs / "X.npy"), np.load(inputs / "TX.npy")
    assert np.allclose(X[1:], X[:-1] + 0.5 * (TX[:-1] - X[:-1]), rtol=0, atol=1e-12 * np.abs(TX).max())
    assert np.array_equal(X[-1], made.last.g)
    assert np.array_equal(TX[-1], made.last.image)
    [column] = read_log(inputs / "convergence.log").columns
    assert np.allclose(column.windows[0], [each.relative_residual for each in made.iterates], rtol=1e-8)


def test_the_problems_are_built_in_and_one_of_them_has_a_loading_history(inputs, call):
    for file, name in (("my.toml", "section6"), ("history.toml", "history")):
        assert (inputs / file).read_text("utf-8") == call("example", name).out
    assert [step.name for step in vf.example("history").steps] == ["press", "push", "back"]
    increments = call("march", inputs / "history.toml", "--json").document["increments"]
    assert {each["outcome"] for each in increments} == {"converged"}
    assert "4 runs" in call("sweep", inputs / "grid.toml", "--dry-run").out


@pytest.mark.usefixtures("meshes_read_here")
def test_the_mesh_is_of_the_same_plates_and_its_draft_becomes_their_problem(inputs, call):
    drafted = call("draft", inputs / "model.msh").out
    (inputs / "draft.toml").write_text(re.sub("(?m)^# (?=fixed|prescribed)", "", drafted), "utf-8")
    moduli = {"body1.young": "7e4", "body2.young": "2e4", "contact.radius": "0.1", "iteration.neumann_body": "1"}
    pair = vf.build(vf.load(inputs / "draft.toml").with_keys(moduli))
    for name, side in zip(("S1", "S2"), pair.along_y, strict=True):
        there = np.load(inputs / f"{name}.npy")
        assert np.allclose(side.schur, there, rtol=0, atol=1e-9 * abs(there).max())


def test_they_are_written_again_but_over_no_file_with_another_content(inputs, call):
    assert call("example", "--inputs", inputs, "--json").document["written"].keys() == {
        str(inputs / name) for name in INPUTS
    }
    (inputs / "my.toml").write_text("mine", "utf-8")
    assert call("example", "--inputs", inputs).complaint.startswith(f"ndtheory: {inputs / 'my.toml'}: ")
    assert (inputs / "my.toml").read_text("utf-8") == "mine"
    assert "--inputs" in call("example", "section6", "--inputs", inputs).complaint


@pytest.mark.parametrize("command", ["compare", "advise", "sweep", "march"])
def test_the_name_of_a_built_in_problem_in_place_of_a_file_leads_to_example(call, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    assert call(command, "section6").complaint == (
        "ndtheory: section6: no such file; type ndtheory example section6 > section6.toml for the built-in problem"
    )
    assert call(command, "folder/section6").complaint.endswith("no such file")


def test_each_file_that_the_list_of_commands_in_readme_reads_was_written_before():
    """The commands themselves are run from a wheel, by night: see test_packaging."""
    packages = runpy.run_path(str(ROOT / ".ci" / "packages.py"))
    lines = packages["listed"]((ROOT / "README.md").read_text("utf-8"))
    assert lines[0] == "ndtheory example --inputs ."
    written = set(INPUTS)
    assert "ndtheory draft model.msh > draft.toml" in lines
    for line in lines:
        command, *targets = re.split(r" > | -o ", line)
        read = set(re.findall(r"[\w-]+\.(?:toml|npy|npz|mtx|msh|log)\b", command))
        assert read <= written, line
        written |= set(targets)

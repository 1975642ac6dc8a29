"""``ndtheory march``: the screen, the document, the files, and what ends it early."""

import csv
import json
import re
import signal
import xml.etree.ElementTree as ET
from typing import get_args

import meshio
import pytest
from histories import PATH, pressed_and_sheared

import verification as vf
from verification.algorithm import history
from verification.bounds.verdicts import RunVerdict
from verification.output import files


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("march") / "my.toml"
    file.write_text(vf.Problem.from_dict(pressed_and_sheared()).to_toml())
    return file


@pytest.fixture(scope="module")
def written(path):
    from verification.cli import main

    folder = path.parent / "results"
    assert main(["march", str(path), "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def document(written):
    return json.loads((written / "history.json").read_text())


@pytest.fixture(scope="module")
def monolithic(path):
    return vf.march(path, method="monolithic")


@pytest.fixture
def short(tmp_path):
    """Two increments of the same history."""
    data = pressed_and_sheared({"press": (2, [0, "-0.01"])})
    (file := tmp_path / "short.toml").write_text(vf.Problem.from_dict(data).to_toml())
    return file


def test_the_screen_has_a_row_for_each_step_and_what_the_theorem_says(call, path):
    answer = call("march", path)
    assert answer.status == 0
    for number, name in enumerate(PATH, 1):
        assert f"  {number} {name} " in answer.out
    assert "WHAT DOES THE THEOREM SAY OF EACH INCREMENT?" in answer.out
    assert "energy" in answer.out
    assert "at most" in answer.out
    assert max(len(line) for line in answer.out.splitlines() if str(path) not in line) <= 80
    assert "0/0/7" in answer.out
    assert re.search(r"  energy  .*\d consistent", answer.out)
    assert not {*get_args(RunVerdict)} & set(re.findall(r"\w+", answer.out))


def test_both_methods_give_the_same_forces(call, path, document):
    one, two = document, call("march", path, "--method", "monolithic", "--json").document
    assert (one["method"], two["method"]) == ("iteration", "monolithic")
    for a, b in zip(one["increments"], two["increments"], strict=True):
        assert a["force"]["normal"] == pytest.approx(b["force"]["normal"], rel=1e-7, abs=1e-6)
    assert two["increments"][0]["iterations"] is None
    assert "iterations" in two["increments"][0]["reason"]


@pytest.mark.parametrize("words", [["--theta", "0.6"], ["--relaxation", "newton"]])
def test_another_theta_or_rule_gives_the_same_forces_in_other_steps(call, path, document, words):
    one, two = document, call("march", path, "--json", *words).document
    assert [i["iterations"] for i in one["increments"]] != [i["iterations"] for i in two["increments"]]
    for a, b in zip(one["increments"], two["increments"], strict=True):
        assert a["force"]["normal"] == pytest.approx(b["force"]["normal"], rel=1e-6, abs=1e-6)


def test_the_folder_holds_tables_views_and_a_series_for_paraview(path, written):
    names = {file.name for file in written.iterdir()}
    assert names >= {"history.json", "history.csv", "contact.csv", "body1.pvd", "body2.pvd", "loop.svg", "states.png"}
    assert json.loads((written / "history.json").read_text())["schema"] == "ndtheory.history/1"
    for name, rows in (("history.csv", 30), ("contact.csv", 30 * 7)):
        lines = [line for line in (written / name).read_text().splitlines() if not line.startswith("#")]
        assert len(list(csv.DictReader(lines))) == rows
    sets = ET.parse(written / "body2.pvd").getroot().findall(".//DataSet")
    assert [float(each.get("timestep")) for each in sets][-1] == 5
    field = meshio.read(written / sets[10].get("file"))
    top = field.points[:, 1] == field.points[:, 1].max()
    assert field.point_data["displacement"][top, 0] == pytest.approx(0.004, rel=1e-12)
    assert vf.load(written / "problem.toml") == vf.load(path)


def test_a_shorter_history_leaves_no_field_of_a_longer_one(call, short, quick, tmp_path):
    folder, text = tmp_path / "results", short.read_text()
    for increments in (3, 2):
        short.write_text(text.replace("increments = 2", f"increments = {increments}"))
        assert call("march", short, "-o", folder).status == 0
        assert len(list(folder.glob("body1-*.vtu"))) == increments


def test_a_field_of_another_program_is_not_overwritten(call, path, tmp_path):
    (tmp_path / "body1-0002.vtu").write_text("mine")
    answer = call("march", path, "-o", tmp_path)
    assert (answer.status, answer.out) == (2, "")
    assert "not written by this program" in answer.err
    assert (tmp_path / "body1-0002.vtu").read_text() == "mine"
    assert files.files_of("run", tmp_path) == files.FILES["run"]


@pytest.mark.parametrize(
    ("edit", "needed"),
    [
        ({"step": []}, "step: needed [[step]] tables"),
        ({"step": [{"increments": -1}]}, "step[1].increments = -1: needed a whole number >= 1"),
    ],
)
def test_bad_input_is_one_line(call, tmp_path, edit, needed):
    data = vf.Problem.from_dict(pressed_and_sheared()).to_dict() | edit
    from verification.problem.writing import toml

    (file := tmp_path / "bad.toml").write_text(toml(data))
    answer = call("march", file)
    assert (answer.status, answer.out) == (2, "")
    assert needed in answer.err
    assert len(answer.err.splitlines()) == 1


def test_a_run_that_does_not_converge_exits_with_1_and_says_what_to_try(call, path):
    answer = call("march", path, "--set", "iteration.max_iterations=2", "--json")
    assert answer.status == 1
    assert answer.document["ended"]
    assert "max_iterations" in answer.err
    screen = call("march", path, "--set", "iteration.max_iterations=2").out
    assert screen.index("Not whole:") < screen.index("Last iterate, not a solution:")
    following = screen.splitlines()[-1].removeprefix("Next: ndtheory ")
    assert following.startswith(f"march {path} --set iteration.max_iterations=")
    assert following.count("iteration.max_iterations") == 1
    assert call(*following.split()).status != 2


def test_ctrl_c_shows_and_writes_the_increments_that_are_done(call, path, quick, tmp_path, monkeypatch):
    begin, seen = history.run_from, []

    def run(*given):
        seen.append(given)
        if len(seen) == 8:
            signal.raise_signal(signal.SIGINT)
        return begin(*given)

    monkeypatch.setattr(history, "run_from", run)
    answer = call("march", path, "-o", tmp_path / "kept", "--json")
    assert answer.status == 130
    assert len(answer.document["increments"]) == 7
    assert "interrupted after increment 7 of 30" in answer.err
    assert json.loads((tmp_path / "kept" / "history.json").read_text()) == answer.document


def test_ctrl_c_after_the_last_increment_keeps_all_of_them(call, short, monkeypatch):
    def linearise(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(vf.History, "linearise", linearise)
    answer = call("march", short, "--json")
    assert answer.status == 130
    assert len(answer.document["increments"]) == 2
    assert "interrupted after the last increment" in answer.err


def test_every_view_is_drawn_of_the_global_method_too_and_an_unknown_one_is_refused(monolithic):
    assert monolithic.plot("loop").axes
    assert monolithic.plot("states").axes
    with pytest.raises(ValueError, match="loop, states, shear"):
        monolithic.plot("loops")


def test_shear_is_drawn_at_the_times_asked_for(monolithic):
    figure = monolithic.plot("shear", times=[1, 2.5])
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["time 1, step press", "time 2.5, step back"]

"""Contact problems with answers from elsewhere: Hertz, a ramp, a press fit, a flat punch, half a model."""

import json
import os
from importlib import import_module
from pathlib import Path

import pytest
from mesh_writer import read_here

import verification as vf
from fem1d2d import mesh_files

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
RECORD = json.loads((BENCHMARKS / "records" / "advice" / "gallery.json").read_text("utf-8"))["rows"]
NIGHT = os.environ.get("HYPOTHESIS_PROFILE") == "nightly"

#: What the coarsest meshes may miss more than the finest ones.
COARSE = 4


@pytest.fixture
def gallery(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("gallery").GALLERY


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch):
    """No process for each mesh file."""
    monkeypatch.setattr(mesh_files, "read_in_process", read_here)


@pytest.mark.parametrize("row", RECORD, ids=lambda row: row["name"])
def test_a_problem_of_the_gallery_has_the_answer_from_elsewhere(gallery, row, tmp_path):
    entry = gallery[row["name"]]
    for cells, recorded in list(zip(row["cells"], row["errors"], strict=True))[: len(row["cells"]) if NIGHT else 1]:
        problem = entry.make(tmp_path, cells)
        error = entry.error(problem, vf.solve(problem).contact)
        assert error == pytest.approx(recorded, rel=1e-3, abs=1e-6)
        assert error <= entry.allowed * (1 if cells == row["cells"][-1] else COARSE)


def test_the_record_has_every_problem_and_its_finest_mesh_is_as_close_as_it_must_be(gallery):
    assert [row["name"] for row in RECORD] == list(gallery)
    for row in RECORD:
        assert row["errors"][-1] <= gallery[row["name"]].allowed


def test_a_false_answer_would_be_noticed(gallery, tmp_path):
    """With exchanged moduli a press fit has another pressure."""
    entry = gallery["press-fit"]
    problem = entry.make(tmp_path, 12)
    assert entry.error(problem.changed(young=(1e5, 2e5)), vf.solve(problem).contact) > 10 * entry.allowed

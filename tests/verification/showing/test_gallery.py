"""Contact problems with answers from elsewhere: Hertz, a ramp, a press fit, a flat punch, half a model."""

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from mesh_writer import write_gmsh22
from strategies import AT_NIGHT

import verification as vf
from verification.interface.assembly import discretise

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
RECORD = json.loads((BENCHMARKS / "records" / "advice" / "gallery.json").read_text("utf-8"))["rows"]

#: What the coarsest meshes may miss more than the finest ones.
COARSE = 4


@pytest.fixture
def gallery(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("gallery").GALLERY


@pytest.mark.parametrize("row", RECORD, ids=lambda row: row["name"])
def test_a_problem_of_the_gallery_has_the_answer_from_elsewhere(gallery, row, tmp_path):
    entry = gallery[row["name"]]
    for cells, recorded in list(zip(row["cells"], row["errors"], strict=True))[: len(row["cells"]) if AT_NIGHT else 1]:
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


def delaunay(path, corners):
    """Irregular nodes inside, and of each quadrilateral the diagonal that Delaunay's triangulation has."""
    points, node = corners.copy(), np.arange(corners[..., 0].size).reshape(corners.shape[:2])
    wide, high = np.diff(corners[..., 0], axis=0)[:, 1:-1], np.diff(corners[..., 1], axis=1)[1:-1]
    room = np.minimum(np.minimum(wide[:-1], wide[1:]), np.minimum(high[:, :-1], high[:, 1:]))
    points[1:-1, 1:-1] += room[..., None] * np.random.default_rng(0).uniform(-0.25, 0.25, (*room.shape, 2))
    ends = [node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]]
    a, b, c, d = ((points[..., 0] + 1j * points[..., 1]).ravel()[end] for end in ends)
    first = (((a - b) / (c - b) * (c - d) / (a - d)).imag >= 0)[..., None]  # opposite angles of at most 180 degrees
    a, b, c, d = ends
    of = lambda *three: np.stack(three, axis=-1)
    cells = np.concatenate([np.where(first, of(a, b, c), of(a, b, d)), np.where(first, of(a, c, d), of(b, c, d))])
    lines = {"left": node[0], "right": node[-1], "bottom": node[:, 0], "top": node[:, -1]}
    sides = {name: np.column_stack([line[:-1], line[1:]]) for name, line in lines.items()}
    write_gmsh22(path, points.reshape(-1, 2), cells.reshape(-1, 3), sides)


def test_near_nu_of_one_half_hertz_is_off_and_warned_of_unless_cells_are_split_by_both_diagonals(
    gallery, monkeypatch, tmp_path
):
    entry, cells = gallery["cylinder-on-plane-2"], 24 if AT_NIGHT else 6
    monkeypatch.setattr("gallery.POISSON", 0.475)
    errors, warned = [], []
    for write in (None, delaunay):
        if write:
            monkeypatch.setattr("gallery.write_mesh", write)
        problem = entry.make(tmp_path, cells)
        warned.append("body1.poisson = 0.475" in " ".join(discretise(problem).warnings))
        errors.append(entry.error(problem, vf.solve(problem).contact))
    assert warned == [False, True]
    assert errors[0] < 0.01 < 0.1 < errors[1]

"""Cells of rectangles that both diagonals split: the same as quadrilaterals of a mesh file, in every result."""

import json
import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from mesh_writer import write_gmsh22
from problem_list import blocks, changed

import verification as vf
from fem1d2d import rectangle

BOTH = {"body1": {"split": "both"}, "body2": {"split": "both"}}
SHAPE = ("shape", "x", "y", "cells", "split")


def quadrilaterals(path, x, y, cells):
    """A rectangle of quadrilaterals as a Gmsh file."""
    xs, ys = (np.linspace(*map(float, ends), n + 1) for ends, n in zip((x, y), cells, strict=True))
    points = np.array([[a, b, 0.0] for a in xs for b in ys])
    node = np.arange(len(points)).reshape(len(xs), len(ys))
    cells = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], -1).reshape(-1, 4)
    lines = {"left": node[0], "right": node[-1], "bottom": node[:, 0], "top": node[:, -1]}
    rows = [np.column_stack([line[:-1], line[1:]]) for line in lines.values()]
    tags = [np.full(len(of), i + 1) for i, of in enumerate((*rows, cells))]
    names = {name: np.array([i + 1, 1]) for i, name in enumerate(lines)} | {"body": np.array([5, 2])}
    file = meshio.Mesh(
        points,
        [*(("line", of) for of in rows), ("quad", cells)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=names,
    )
    meshio.write(path, file, "gmsh22", binary=False)
    return str(path)


@pytest.fixture
def two(tmp_path):
    """A problem by rectangles, and the same one by files of quadrilaterals."""
    rubs = {"contact": {"friction": "1/20", "radius": "3/4"}, "iteration": {"neumann_body": 1, "theta": "0.3"}}
    data = changed(blocks(young=(3, 1), **rubs), **BOTH)
    files = {**data}
    for name in ("body1", "body2"):
        body = data[name]
        mesh = quadrilaterals(tmp_path / f"{name}.msh", body["x"], body["y"], body["cells"])
        files[name] = {key: value for key, value in body.items() if key not in SHAPE} | {"mesh": mesh}
    return [vf.Problem.from_dict(each) for each in (data, files)]


def test_a_mesh_file_of_quadrilaterals_has_the_numbers_of_the_rectangle(two):
    drawn, read = map(vf.run, two)
    assert drawn.converged
    assert drawn.iterations == read.iterations
    for name in ("normal", "tangential"):
        assert read.contact.force[name] == pytest.approx(drawn.contact.force[name], rel=1e-12, abs=1e-15)
    one, other = (vf.measure(problem) for problem in two)
    assert other.rho_max.value == pytest.approx(one.rho_max.value, rel=1e-12)
    assert "triangles cut from 8 quadrilaterals" in str(read.sections())


def test_constants_in_intervals_and_certificates_take_these_cells(two):
    proved = vf.measure(two[0], verified=True)
    assert proved.rho_max.level == "verified"
    assert proved.rho_max.lo <= vf.measure(two[0]).rho_max.value <= proved.rho_max.hi
    certificate = vf.certify(two[0], theta="3/10")
    assert vf.check_again(json.loads(certificate.to_json()), two[0]).accepted


def test_the_key_is_written_and_enters_a_digest_only_where_it_is_not_the_default(two):
    data = blocks()
    plain = vf.Problem.from_dict(data)
    assert vf.Problem.from_dict(changed(data, body1={"split": "alternating"})).digest == plain.digest != two[0].digest
    assert vf.Problem.from_dict(two[0].to_dict()).digest == two[0].digest
    assert two[0].refined(1).body1.split == "both"
    with pytest.raises(vf.ProblemError, match=r'body1.split = "diagonal": needed one of "alternating", "both"'):
        vf.Problem.from_dict(changed(data, body1={"split": "diagonal"}))


def test_rho_of_these_cells_is_seen_on_meshes_near_incompressibility():
    """Square cells of one material, nu = 0.45: alternating diagonals have short waves that decide, these hardly."""
    data = changed(blocks(young=(1, 1), poisson=("0.45", "0.45"), cells=((8, 8), (8, 8))))
    plain, both = (vf.measure(vf.Problem.from_dict(each)) for each in (data, changed(data, **BOTH)))
    assert plain.rho_cells.value == pytest.approx(2.0367, rel=1e-4)
    assert both.rho_cells.value == pytest.approx(1.3072, rel=1e-4)


def test_hertz_near_incompressibility_is_warned_of_on_one_diagonal_only():
    data = changed(blocks(poisson=("0.47", "0.47")))
    said, silent = (vf.build(vf.Problem.from_dict(each)).warnings for each in (data, changed(data, **BOTH)))
    assert any('split = "both" of a rectangle' in words for words in said)
    assert not any("near 1/2" in words for words in silent)


def diagonals_in_one_direction(path, x, y, cells, rising):
    """A rectangle of triangles whose diagonals are parallel, as a Gmsh file."""
    flat = rectangle(x, y, cells)
    node = np.arange(len(flat.points)).reshape(cells[0] + 1, cells[1] + 1)
    a, b, c, d = node[:-1, :-1].ravel(), node[1:, :-1].ravel(), node[1:, 1:].ravel(), node[:-1, 1:].ravel()
    halves = ((a, b, c), (a, c, d)) if rising else ((a, b, d), (b, c, d))
    write_gmsh22(path, flat.points, np.vstack([np.column_stack(half) for half in halves]), flat.sides)
    return {"mesh": str(path)}


def test_rho_of_section_6_by_the_diagonals_of_its_cells_is_what_the_first_page_says(tmp_path):
    page = (Path(__file__).parents[3] / "docs" / "first_run.md").read_text("utf-8")
    told = re.search(r"kind of cells: (0\.\d+) .*?(0\.\d+) .*?(0\.\d+) .*?(0\.\d+)\s", page, re.DOTALL)
    model = vf.example("section6")
    files = []
    for risings in ((True, True), (True, False)):
        data = model.to_dict()
        for name, rising in zip(("body1", "body2"), risings, strict=True):
            of = data[name]
            ends = [tuple(float(end) for end in of[axis]) for axis in "xy"]
            file = diagonals_in_one_direction(tmp_path / f"{name}{rising}.msh", *ends, of["cells"], rising)
            data[name] = {key: value for key, value in of.items() if key not in SHAPE} | file
        files.append(vf.Problem.from_dict(data))
    problems = [model, vf.Problem.from_dict(changed(model.to_dict(), **BOTH)), *files]
    assert told.groups() == tuple(f"{vf.measure(each).rho_max.value:.3f}" for each in problems)

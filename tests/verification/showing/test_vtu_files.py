"""The fields as VTU files: what meshio reads is what was computed, and uniform stress is that of the closed form."""

import math

import meshio
import numpy as np
import pytest
from problem_list import bars, changed

import verification as vf
from fem1d2d import stresses
from verification.output.fields import write_fields

#: A column on rollers, free on its right, whose top is pressed down by DOWN; the state in it is uniform.
YOUNG, NU, DOWN, HEIGHT = 50000.0, 0.3, 0.004, 0.8
COLUMN = {"shape": "rectangle", "x": [0, 1], "poisson": "0.3", "young": 50000}
ROLLERS = {"left": [0, "free"]}
PRESSED = {
    "units": {"length": "mm", "stress": "MPa"},
    "body1": {**COLUMN, "y": ["-0.5", 0], "cells": [4, 3], "prescribed": {**ROLLERS, "bottom": ["free", 0]}},
    "body2": {**COLUMN, "y": [0, "0.3"], "cells": [4, 2], "prescribed": {**ROLLERS, "top": ["free", "-0.004"]}},
    "contact": {"friction": 0},
    "iteration": {"theta": "0.5"},
}


def read(result, folder):
    write_fields(result, folder)
    return [meshio.read(folder / f"body{i}.vtu") for i in (1, 2) if (folder / f"body{i}.vtu").exists()]


@pytest.mark.parametrize("solve", [vf.run, vf.solve])
def test_a_column_under_uniform_pressure_has_the_stresses_of_the_closed_form(tmp_path, solve):
    """Plane strain with free sides: sigma_yy = E/(1 - nu^2) eps_yy, sigma_zz = nu sigma_yy, no other component."""
    yy = -YOUNG / (1 - NU**2) * DOWN / HEIGHT
    expected = np.array([0, yy, NU * yy, 0, 0, 0])
    for found in read(solve(vf.Problem.from_dict(PRESSED)), tmp_path):
        (stress,), (mises,) = found.cell_data["stress"], found.cell_data["von_mises"]
        assert stress == pytest.approx(np.tile(expected, (len(stress), 1)), abs=1e-6 * abs(yy))
        assert mises == pytest.approx(np.full(len(mises), abs(yy) * math.sqrt(1 - NU + NU**2)), rel=1e-6)
        sideways = -NU / (1 - NU) * -DOWN / HEIGHT * found.points[:, 0]
        assert found.point_data["displacement"][:, 0] == pytest.approx(sideways, abs=1e-8)


@pytest.mark.parametrize("solve", [vf.run, vf.solve])
def test_points_cells_and_displacements_come_back_as_they_were(tmp_path, solve):
    result = solve(vf.Problem.from_dict(changed()))
    found = read(result, tmp_path)
    for body, u, again in zip(result.bodies.elastic, result.displacements, found, strict=True):
        assert np.array_equal(again.points[:, :2], body.mesh.points)
        assert np.array_equal(again.cells_dict["triangle"], body.mesh.cells)
        assert np.array_equal(again.point_data["displacement"][:, :2], u)
        assert not again.points[:, 2].any()
        assert again.point_data["displacement"].shape == again.points.shape
        xx, yy, zz, xy, yz, xz = again.cell_data["stress"][0].T
        squares = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2 + 6 * (xy**2 + yz**2 + xz**2)
        assert again.cell_data["von_mises"][0] == pytest.approx(np.sqrt(squares / 2), rel=1e-12)


def test_bars_have_lines_and_one_stress(tmp_path):
    result = vf.solve(vf.Problem.from_dict(bars()))
    for found in read(result, tmp_path):
        stress = found.cell_data["stress"][0]
        assert stress[:, 0] == pytest.approx(np.full(len(stress), -result.contact.pressure[0]), rel=1e-9)
        assert not stress[:, 1:].any()
        assert found.cell_data["von_mises"][0] == pytest.approx(-stress[:, 0])
        assert "line" in found.cells_dict


def test_an_obstacle_has_no_file(tmp_path):
    rigid = {**changed(), "body1": {"shape": "rigid"}}
    assert len(read(vf.solve(vf.Problem.from_dict(rigid)), tmp_path)) == 1
    assert not (tmp_path / "body1.vtu").exists()


def test_a_file_names_its_units_and_is_the_same_every_time(tmp_path):
    problem = vf.Problem.from_dict(PRESSED | {"units": {"length": "---> mm", "stress": "MPa"}})
    first, second = tmp_path / "a", tmp_path / "b"
    for folder in (first, second):
        folder.mkdir()
        write_fields(vf.solve(problem), folder)
    assert (first / "body1.vtu").read_bytes() == (second / "body1.vtu").read_bytes()
    assert (first / "body1.vtu").read_text("utf-8").splitlines()[1].endswith("lengths in -> mm, stresses in MPa -->")
    assert len(meshio.read(first / "body1.vtu").points) == 20


def test_quadrilaterals_are_written_without_the_nodes_that_split_them(tmp_path):
    """The stress of each is the mean of its four triangles, equal in size; its corners run anticlockwise."""
    data = changed(body1={"split": "both"}, body2={"split": "both"})
    result = vf.solve(vf.Problem.from_dict(data))
    for body, u, found in zip(result.bodies.elastic, result.displacements, read(result, tmp_path), strict=True):
        quads = found.cells_dict["quad"]
        assert set(found.cells_dict) == {"quad"}
        assert len(found.points) == len(body.mesh.points) - len(quads)
        corners = found.points[quads][..., :2]
        turned = np.roll(corners, -1, axis=1)
        areas = (corners[..., 0] * turned[..., 1] - corners[..., 1] * turned[..., 0]).sum(axis=1) / 2
        assert areas == pytest.approx(np.full(len(quads), areas[0]))
        assert areas.sum() == pytest.approx(np.prod(np.ptp(found.points[:, :2], axis=0)))
        mean = stresses(body.mesh, body.material, u).reshape(-1, 4, 3, 3).mean(axis=1)
        assert found.cell_data["stress"][0][:, [0, 1, 3]] == pytest.approx(mean[:, [0, 1, 0], [0, 1, 1]], rel=1e-12)
        assert np.array_equal(found.point_data["displacement"][:, :2], u[: len(found.points)])


def test_a_mesh_of_triangles_and_quadrilaterals_keeps_both(tmp_path):
    points = np.array([[0, -1], [1, -1], [2, -1], [0, 0], [1, 0], [2, 0]], dtype=float)
    cells = [("line", [[0, 1], [1, 2]]), ("triangle", [[0, 1, 4], [0, 4, 3]]), ("quad", [[1, 2, 5, 4]])]
    tags = [np.array([1, 1]), np.array([9, 9]), np.array([9])]
    names = {"bottom": np.array([1, 1]), "all": np.array([9, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    flat = np.column_stack([points, np.zeros(6)])
    mesh = meshio.Mesh(flat, cells, cell_data=data, field_data=names)
    meshio.write(tmp_path / "mixed.msh", mesh, file_format="gmsh22", binary=False)
    body = {"mesh": str(tmp_path / "mixed.msh"), "young": 2, "poisson": 0, "fixed": ["bottom"]}
    found = vf.solve(vf.Problem.from_dict({**changed(), "body1": body}))
    lower = read(found, tmp_path)[0]
    assert {kind: len(cells) for kind, cells in lower.cells_dict.items()} == {"triangle": 2, "quad": 1}
    assert lower.points[:, :2] == pytest.approx(points)
    assert lower.cells_dict["quad"].tolist() == [[1, 2, 5, 4]]

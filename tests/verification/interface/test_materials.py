"""Materials by named surfaces of a mesh file: stacked layers, what does not fit, and what is written."""

from fractions import Fraction

import meshio
import numpy as np
import pytest

import verification as vf
from fem1d2d import rectangle
from verification.certificate.contraction import certify
from verification.interface.assembly import discretise


def layered(path, y, cells=(4, 4), names=("steel", "rubber")):
    """A rectangle 2 long whose lower half is one named surface, its upper half another one."""
    mesh = rectangle((0.0, 2.0), y, cells)
    upper = mesh.points[mesh.cells].mean(axis=1)[:, 1] > sum(y) / 2
    lines = np.concatenate([mesh.sides["bottom"], mesh.sides["top"]])
    tags = [np.repeat([1, 2], cells[0]), np.where(upper, 4, 3)]
    names = dict(zip((*names, "bottom", "top"), ((3, 2), (4, 2), (1, 1), (2, 1)), strict=True))
    written = meshio.Mesh(
        np.pad(mesh.points, ((0, 0), (0, 1))),
        [("line", lines), ("triangle", mesh.cells)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array(tag) for name, tag in names.items()},
    )
    meshio.write(path, written, file_format="gmsh22", binary=False)
    return str(path)


def pressed(tmp_path, young, poisson="0.0", **more):
    """A layered body on a flat rectangle, both pressed uniformly: no friction, no cross strain at Poisson's ratio 0."""
    body1 = {"shape": "rectangle", "x": [0, 2], "y": [-1, 0], "cells": [4, 2], "young": 3, "poisson": "0.0"}
    body2 = {"mesh": layered(tmp_path / "body.msh", (0.0, 1.0)), "young": young, "poisson": poisson}
    data = {"body1": body1 | {"fixed": ["bottom"]}, "body2": body2 | {"prescribed": {"top": [0, "-0.01"]}} | more}
    return data | {"contact": {"surface": ["top", "bottom"]}}


def test_layers_press_like_springs_in_series(tmp_path):
    problem = vf.Problem.from_dict(pressed(tmp_path, {"steel": 8, "rubber": 2}))
    found = vf.solve(problem)
    pressure = 0.01 / (1 / 3 + 0.5 / 8 + 0.5 / 2)
    assert found.contact.pressure == pytest.approx(np.full(5, pressure), rel=1e-11)
    run = vf.run(problem, theta="auto")
    assert run.converged
    assert run.last.contact.force[5:] == pytest.approx(found.force[5:], rel=1e-8)


def test_a_poisson_ratio_of_each_surface_reaches_its_cells(tmp_path):
    moduli = {"steel": (Fraction(8), Fraction(3, 10)), "rubber": (Fraction(2), Fraction(2, 5))}
    tables = ({"steel": 8, "rubber": 2}, {"steel": "0.3", "rubber": "0.4"})
    problem = vf.Problem.from_dict(pressed(tmp_path, *tables))
    assert problem.body2.materials == moduli
    assert (problem.body2.young, problem.body2.poisson) == (8, Fraction(2, 5))
    body = discretise(problem).body2
    mu = {name: float(E / (2 * (1 + nu))) for name, (E, nu) in moduli.items()}
    upper = body.mesh.points[body.mesh.cells].mean(axis=1)[:, 1] > 0.5
    assert body.material.lame_mu == pytest.approx(np.where(upper, mu["rubber"], mu["steel"]), rel=1e-15)
    one = vf.Problem.from_dict(pressed(tmp_path, 5, {"steel": "0.3", "rubber": "0.4"})).body2.materials
    assert one == {"steel": (5, Fraction(3, 10)), "rubber": (5, Fraction(2, 5))}


def test_equal_materials_are_one_material(tmp_path):
    several = pressed(tmp_path, {"steel": 2, "rubber": 2}, "0.3")
    one = several | {"body2": several["body2"] | {"young": 2, "mesh": layered(tmp_path / "one.msh", (0.0, 1.0))}}
    mesh = (
        (tmp_path / "one.msh")
        .read_text()
        .replace('2 4 "rubber"\n', "")
        .replace("$PhysicalNames\n4", "$PhysicalNames\n3")
    )
    (tmp_path / "one.msh").write_text(mesh.replace(" 2 2 4 4 ", " 2 2 3 3 "))
    assert np.array_equal(
        vf.build(vf.Problem.from_dict(several)).neumann.schur, vf.build(vf.Problem.from_dict(one)).neumann.schur
    )


def test_a_problem_with_materials_is_written_and_changed(tmp_path):
    problem = vf.Problem.from_dict(pressed(tmp_path, {"steel": 8, "rubber": 2}, "0.3"))
    assert vf.Problem.from_dict(problem.to_dict()) == problem
    assert problem.to_dict()["body2"]["young"] == {"rubber": 2, "steel": 8}
    stiffer = problem.with_keys({"body2.young.rubber": 4})
    assert stiffer.body2.materials["rubber"] == (4, Fraction(3, 10))
    assert stiffer.digest != problem.digest
    assert problem.changed(young=(None, 5)).body2.materials["steel"][0] == 5
    pair = vf.build(problem)
    again, other = pair.changed(theta="1/3"), pair.changed(young=(None, 5))
    assert again.neumann.schur is pair.neumann.schur
    assert np.array_equal(other.neumann.schur, vf.build(other.problem).neumann.schur)


def test_verified_constants_of_several_materials_hold_those_of_doubles(tmp_path):
    problem = vf.Problem.from_dict(pressed(tmp_path, {"steel": 8, "rubber": 2}, "0.3"))
    proved, found = vf.measure(problem, verified=True), vf.measure(problem)
    assert proved.rho_max.lo <= found.rho_max.value <= proved.rho_max.hi
    assert proved.rho_max.hi - proved.rho_max.lo < 1e-6 * found.rho_max.value


@pytest.mark.parametrize(
    ("young", "poisson", "key", "needed"),
    [
        ({"steel": 8, "gum": 2}, "0.3", "body2.young", "no surface 'gum'; named surfaces: "),
        ({"steel": 8}, "0.3", "body2.young", "16 of 32 cells lie in none of the surfaces steel"),
        (8, "0.3", "body2.mesh", "needed one material: its triangles are split"),
        ({"steel": 8, "rubber": 0}, "0.3", "body2.young.rubber", "a number > 0"),
        ({"steel": 8, "rubber": 2}, {"steel": "0.3"}, "body2.poisson", "the same surfaces as young has"),
        ({"steel": 8, "rubber": 2}, {"steel": "0.3", "rubber": "0.5"}, "body2.poisson.rubber", "nu < 0.5"),
        ({"steel": 1e20, "rubber": 1e-20}, "0.3", "body2.young", "within 1e"),
        ({}, "0.3", "body2.young", "a number > 0"),
    ],
    ids=str,
)
def test_materials_that_do_not_fit_are_refused_in_one_line(tmp_path, young, poisson, key, needed):
    with pytest.raises(vf.ProblemError) as caught:
        vf.build(vf.Problem.from_dict(pressed(tmp_path, young, poisson)))
    assert caught.value.key == key
    assert needed in caught.value.needed
    assert str(caught.value).isprintable()


def test_a_rectangle_has_no_surfaces_and_a_certificate_one_material(tmp_path):
    data = pressed(tmp_path, {"steel": 8, "rubber": 2}, "0.3")
    with pytest.raises(vf.ProblemError, match="only a mesh file has named surfaces"):
        vf.Problem.from_dict(data | {"body1": data["body1"] | {"young": {"steel": 8}}})
    with pytest.raises(vf.ProblemError, match="modulus within 1e\\+30 times"):
        vf.Problem.from_dict(data | {"body1": data["body1"] | {"young": "1e-30"}})
    with pytest.raises(vf.ProblemError, match=r"body2\.young = .*bodies of one material each"):
        certify(vf.Problem.from_dict(data))

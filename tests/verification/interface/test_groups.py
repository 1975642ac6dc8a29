"""Bodies that are named surfaces of one mesh file."""

from pathlib import Path

import meshio
import numpy as np
import pytest
from problem_list import blocks

import verification as vf
from fem1d2d import MeshError, from_file, mesh_files
from verification.cli import main


def one_file(path, *, merged):
    """Two blocks of 4 x 2 quadrilaterals on each other and the line between them, where their nodes may be one."""
    blocks_of, points, lines, start = [], [], {}, 0
    for name, low in (("lower", -1.0), ("upper", 0.0)):
        xs, ys = np.linspace(0, 1, 5), low + np.linspace(0, 1, 3)
        node = start + np.arange(15).reshape(5, 3)
        points += [[a, b, 0.0] for a in xs for b in ys]
        lines |= {f"{name} left": node[0], f"{name} bottom": node[:, 0], f"{name} top": node[:, -1]}
        blocks_of.append(np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], -1).reshape(-1, 4))
        start += 15
    points, rows = np.array(points), {}
    for name, line in lines.items():
        rows[name] = np.column_stack([line[:-1], line[1:]])
    if merged:
        points, number = np.unique(points, axis=0, return_inverse=True)
        blocks_of, rows = [number[of] for of in blocks_of], {name: number[of] for name, of in rows.items()}
        del rows["upper bottom"]  # it is the top of the lower one
    kinds = [*(("line", of) for of in rows.values()), *(("quad", of) for of in blocks_of)]
    tags = [np.full(len(of), i + 1) for i, (_, of) in enumerate(kinds)]
    names = {name: np.array([i + 1, 1]) for i, name in enumerate(rows)}
    names |= {name: np.array([len(rows) + 1 + i, 2]) for i, name in enumerate(("lower", "upper"))}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(path, meshio.Mesh(points, kinds, cell_data=data, field_data=names), "gmsh22", binary=False)
    return str(path)


@pytest.mark.parametrize("merged", [False, True])
def test_two_bodies_of_one_file_are_those_of_two_rectangles(merged, tmp_path):
    rubs = {"contact": {"friction": "1/20", "radius": "3/4"}, "iteration": {"neumann_body": 1, "theta": "0.3"}}
    data = blocks(young=(3, 1), body1={"split": "both"}, body2={"split": "both"}, **rubs)
    mesh = one_file(tmp_path / "both.msh", merged=merged)
    moduli = [{key: body[key] for key in ("young", "poisson")} for body in (data["body1"], data["body2"])]
    lower = {"mesh": mesh, "group": "lower", "fixed": ["lower bottom"], **moduli[0]}
    upper = {"mesh": mesh, "group": ["upper"], "prescribed": {"upper top": [0, "-1/50"]}, **moduli[1]}
    problem = vf.Problem.from_dict({**data, "body1": lower, "body2": upper})
    drawn, read = vf.run(vf.Problem.from_dict(data)), vf.run(problem)
    assert read.iterations == drawn.iterations
    assert read.contact.force["normal"] == pytest.approx(drawn.contact.force["normal"], rel=1e-12)
    assert "triangles cut from the file's 16 quadrilaterals" in str(read.sections())
    assert vf.Problem.from_dict(problem.to_dict()).digest == problem.digest
    with pytest.raises(
        vf.ProblemError, match=r"mesh = .*: no surface 'wing'; needed names of surfaces .*: lower, upper"
    ):
        vf.run(vf.Problem.from_dict({**data, "body1": lower | {"group": ["lower", "wing"]}, "body2": upper}))


def test_of_the_sides_of_a_file_those_parts_are_left_that_lie_on_the_outline(tmp_path):
    mesh = one_file(tmp_path / "both.msh", merged=True)
    lower, upper, both = (from_file(mesh, group=group) for group in (["lower"], ["upper"], ["upper", "lower"]))
    assert set(lower.sides) == {"lower left", "lower bottom", "lower top"}
    assert set(upper.sides) == {"lower top", "upper left", "upper top"}
    assert lower.surfaces["lower"].tolist() == list(range(32))
    assert len(both.cells) == 64
    assert set(both.sides) == {"lower left", "lower bottom", "upper left", "upper top"}
    with pytest.raises(MeshError, match="no surface 'lower left'"):
        from_file(mesh, group=["lower left"])


def test_a_body_of_a_file_with_very_many_nodes_keeps_its_sides(tmp_path):
    """Files have numbers of 32 bits, which are too small for the number of an edge."""
    mesh = meshio.read(one_file(tmp_path / "both.msh", merged=False))
    far = np.vstack([np.zeros((60_000, 3)), mesh.points])  # points that no cell uses are left out
    cells = [(block.type, block.data + 60_000) for block in mesh.cells]
    moved = meshio.Mesh(far, cells, cell_data=mesh.cell_data, field_data=mesh.field_data)
    meshio.write(tmp_path / "many.msh", moved, "gmsh22", binary=False)
    found = from_file(tmp_path / "many.msh", group=["upper"])
    assert {name: len(facets) for name, facets in found.sides.items()} == {
        "upper left": 2,
        "upper bottom": 4,
        "upper top": 4,
    }


def test_a_surface_of_the_file_keeps_its_name_beside_the_pieces_of_another_one(tmp_path):
    read = mesh_files.contents(Path(one_file(tmp_path / "both.msh", merged=False)))
    surfaces = {"all": np.arange(64), "all.1": np.arange(32, 64)}
    found = mesh_files.with_pieces(mesh_files.Read(*read[:4], surfaces, *read[5:])).surfaces
    assert {name: len(of) for name, of in found.items()} == {"all": 64, "all.1": 32, "all.2": 32}
    assert found["all.1"].tolist() == found["all.2"].tolist() == list(range(32, 64))


@pytest.mark.parametrize(
    ("group", "needed"), [([], "a name of a surface"), (3, "a name of a surface"), (["a", "a"], "each surface once")]
)
def test_a_group_that_is_none_is_refused(group, needed, tmp_path):
    data = blocks()
    body = {"mesh": one_file(tmp_path / "both.msh", merged=False), "young": 1, "poisson": 0, "group": group}
    with pytest.raises(vf.ProblemError, match=rf"body1.group = .*: needed {needed}"):
        vf.Problem.from_dict({**data, "body1": body | {"fixed": ["lower bottom"]}})


@pytest.mark.parametrize("several", [False, True])
def test_surfaces_that_no_body_takes_are_named_in_a_warning(several, tmp_path):
    mesh = one_file(tmp_path / "both.msh", merged=False)
    data = blocks()
    lower = {"mesh": mesh, "young": 3, "poisson": "0.3", "fixed": ["lower bottom"]}
    two = {"mesh": mesh, "group": "upper", "young": 2, "poisson": "0.3", "prescribed": {"upper top": [0, "-1/50"]}}
    above = {"shape": "rectangle", "x": [0, 1], "y": [0, 1], "cells": [4, 2], "young": 2, "poisson": "0.3"}
    above |= {"prescribed": {"top": [0, "-1/50"]}}
    touch = {"bodies": [1, 2], "surface": ["lower top", "bottom"]}
    contact = {"contact": [touch]} if several else {}
    alone = vf.solve(vf.Problem.from_dict({**data, **contact, "body1": lower | {"group": "lower"}, "body2": above}))
    assert "no body takes upper of both.msh: these cells are left out" in alone.warnings
    assert "triangles cut from the file's 16 quadrilaterals" in str(alone.sections())
    both = vf.solve(vf.Problem.from_dict({**data, "body1": lower | {"group": "lower"}, "body2": two}))
    assert not [line for line in both.warnings if "left out" in line]


def test_commands_say_what_was_cut(tmp_path, capsys):
    mesh = one_file(tmp_path / "both.msh", merged=False)
    lower = {"mesh": mesh, "young": 3, "poisson": "0.3", "group": "lower", "fixed": ["lower bottom"]}
    data = blocks(body2={"prescribed": {"top": [0, "-1/50"]}}) | {"body1": lower}
    data |= {"step": [{"body2": {"prescribed": {"top": [0, "-1/50"]}}}]}
    (tmp_path / "my.toml").write_text(vf.Problem.from_dict(data).to_toml(), "utf-8")
    for command in ("constants", "march", "compare"):
        main([command, str(tmp_path / "my.toml"), "--set", "iteration.neumann_body=1", "--set", "iteration.theta=auto"])
        assert "triangles cut from the file's 16 quadrilaterals" in " ".join(capsys.readouterr().out.split())

"""Bodies in several pieces, of which one hangs on nothing."""

from pathlib import Path

import meshio
import numpy as np
import pytest
from mesh_writer import write_gmsh22
from problem_list import blocks, changed

import verification as vf
from fem1d2d import rectangle


def test_what_hangs_on_a_hinge_where_no_contact_node_feels_it_is_refused_by_the_iteration(tmp_path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 1, 0], [2, 2, 0]], dtype=float)
    lines, triangles = np.array([[3, 2], [2, 1]]), np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5]])
    tags = [np.array([1, 2]), np.array([9, 9, 9])]
    named = {"top": np.array([1, 1]), "right": np.array([2, 1]), "body": np.array([9, 2])}
    mesh = meshio.Mesh(
        points,
        [("line", lines), ("triangle", triangles)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=named,
    )
    meshio.write(tmp_path / "flag.msh", mesh, file_format="gmsh22", binary=False)
    upper = {"mesh": str(tmp_path / "flag.msh"), "young": 1, "poisson": 0, "prescribed": {"top": [0, "-0.01"]}}
    flag = blocks(iteration={"neumann_body": 1}, contact={"interval": [0, 1]}) | {"body2": upper}
    for call in (vf.run, vf.advise):
        with pytest.raises(vf.ProblemError, match=r"body2: the piece at x = 1 to 2 and y = 1 to 2 can move rigidly"):
            call(vf.Problem.from_dict(flag))


def two_pieces(path: Path, lift: float = 0.0) -> str:
    """A block below y = lift with the sides ``top0``, .., and one above it, with a gap between, ``top1``, ..."""
    parts = [rectangle((0.0, 1.0), (y + lift, y + 1 + lift), (4, 2)) for y in (-1.0, 0.125)]
    n, sides = len(parts[0].points), {}
    for i, part in enumerate(parts):
        sides |= {f"{side}{i}": facets + i * n for side, facets in part.sides.items()}
    cells = np.concatenate([part.cells + i * n for i, part in enumerate(parts)])
    write_gmsh22(path, np.concatenate([part.points for part in parts]), cells, sides)
    return str(path)


def test_a_piece_that_neither_supports_nor_contact_hold_is_refused_by_its_place_whatever_is_asked_for(tmp_path) -> None:
    two = {"mesh": two_pieces(tmp_path / "two.msh"), "young": 3, "poisson": "0.3"}
    plain = {"dimension": 2, "contact": {"surface": ["top0", "bottom1"]}}
    lower, upper = two | {"fixed": ["bottom0"]}, two | {"prescribed": {"top1": [0, "-0.15"]}}
    held = {"body1": two | {"fixed": ["bottom0", "top1"]}, "body2": two | {"fixed": ["bottom0", "top1"]}}
    assert vf.solve(vf.Problem.from_dict(plain | held)).force == pytest.approx(0)
    for call, neumann, loose, where in (
        (vf.solve, 2, {"body1": lower, "body2": upper}, "body1: the piece at x = 0 to 1 and y = 0.125 to 1.125"),
        (vf.run, 1, {"body1": lower}, "body1: the piece at x = 0 to 1 and y = 0.125 to 1.125"),
        (vf.advise, 1, {"body2": upper}, "body2: the piece at x = 0 to 1 and y = -1 to 0"),
    ):
        problem_ = vf.Problem.from_dict(plain | held | loose | {"iteration": {"neumann_body": neumann}})
        with pytest.raises(vf.ProblemError, match=f"{where} can move rigidly"):
            call(problem_)


def test_a_piece_of_one_of_three_bodies_is_refused_by_the_name_of_its_body(tmp_path) -> None:
    stack = changed(vf.example("stack").to_dict(), body2={"x": [0, 1]}, body3={"x": [0, 1]})
    lower = {"mesh": two_pieces(tmp_path / "two.msh", lift=-1.125), "young": 3, "poisson": "0.3", "fixed": ["bottom1"]}
    stack["contact"][0]["surface"] = ["top1", "bottom"]
    with pytest.raises(vf.ProblemError, match=r"body1: the piece at x = 0 to 1 and y = -2.125 to -1.125 can move"):
        vf.solve(vf.Problem.from_dict(stack | {"body1": lower}))

"""Whole surfaces are named: the part of contact is found, the rest is cut off and reported."""

import numpy as np
import pytest
from mesh_writer import write_gmsh22
from problem_list import blocks

import verification as vf
from fem1d2d import rectangle


def disc(path, centre, radius, cells, turn=0.0, top=0.9, **more):
    """A disc in rings of triangles; the part of its circle above ``top`` of the radius has its own name."""
    rings, angles = 6, turn + 2 * np.pi * np.arange(cells) / cells
    r = radius * np.arange(1, rings + 1) / rings
    points = np.vstack([[[0, 0]], *(s * np.column_stack([np.cos(angles), np.sin(angles)]) for s in r)])
    node = 1 + np.arange(rings * cells).reshape(rings, cells)
    after = np.roll(node, -1, axis=1)
    triangles = [np.column_stack([np.zeros(cells, int), node[0], after[0]])]
    for i in range(rings - 1):
        triangles += [
            np.column_stack([node[i], node[i + 1], after[i + 1]]),
            np.column_stack([node[i], after[i + 1], after[i]]),
        ]
    edges = np.column_stack([node[-1], after[-1]])
    upper = edges[(points[edges].mean(axis=1)[:, 1] > top * radius)]
    rest = edges[(points[edges].mean(axis=1)[:, 1] <= top * radius)]
    write_gmsh22(
        path, points + centre, np.concatenate(triangles), {"top": upper, "rest": rest} if len(upper) else {"rest": rest}
    )
    return {"mesh": str(path), "young": 2, "poisson": "0.3", **more}


BLOCK = {"shape": "rectangle", "x": [-2, 2], "y": [-1, 0], "cells": [40, 8], "young": 5, "poisson": "0.3"}
BLOCK |= {"fixed": ["bottom"]}


def on_block(folder, surface, turn=0.0, **more):
    """A disc that is pressed on a block by its upper part."""
    above = disc(folder / f"disc{turn}.msh", (0, 1), 1, 48, turn, prescribed={"top": [0, "-0.02"]})
    return vf.Problem.from_dict(
        {"body1": BLOCK, "body2": above, "contact": {"surface": surface}, "iteration": {"neumann_body": 1}} | more
    )


def test_of_a_whole_circle_the_part_that_faces_a_block_is_in_contact(tmp_path):
    found = vf.solve(on_block(tmp_path, ["top", "rest"]))
    assert found.contact.pressure.max() > 0
    lowest = np.argmax(found.contact.pressure)
    assert found.contact.x[lowest] == pytest.approx(0, abs=1e-9)
    assert found.contact.y[lowest] == pytest.approx(0, abs=1e-9)
    assert found.contact.force["normal"] > 0
    checks = found.checks
    assert 0 < checks.cut_length < 2 * np.pi
    assert checks.cut_depth == 0
    assert found.to_dict()["checks"]["cut_length"] == checks.cut_length
    part = {"body1": BLOCK | {"parts": {"middle": {"side": "top", "x": [-1, 1]}}}}
    short = vf.solve(on_block(tmp_path, ["middle", "rest"], **part))
    assert short.contact.force["normal"] == pytest.approx(found.contact.force["normal"], rel=1e-3)


def test_nodes_of_a_side_beyond_its_part_in_contact_that_would_touch_are_reported(tmp_path):
    """Only a part of the block is named: beside it the disc goes down into the block."""
    part = {"body1": BLOCK | {"parts": {"middle": {"side": "top", "x": [-1, "0.1"]}}}}
    problem = on_block(tmp_path, ["middle", "rest"], **part).with_keys({"body2.prescribed.top": "[0, -0.1]"})
    found = vf.solve(problem)
    assert found.checks.cut_depth == found.checks.penetration_outside > 0.01
    assert any("nodes of a named side would touch" in line for line in found.warnings)
    whole = vf.solve(problem.with_keys({"contact.surface": '["top", "rest"]'}))
    assert whole.checks.cut_depth == 0


def test_whole_boundaries_of_two_blocks_are_cut_at_their_corners(tmp_path):
    """One name for all four sides of each: what faces the other body is the top of one and the bottom of the other."""
    meshes = {}
    for name, y in (("low", (-1.0, 0.0)), ("high", (0.0, 1.0))):
        flat = rectangle((0.0, 1.0), y, (4, 4))
        held = "bottom" if name == "low" else "top"
        sides = {held: flat.sides[held], "skin": np.concatenate([f for s, f in flat.sides.items() if s != held])}
        write_gmsh22(tmp_path / f"{name}.msh", flat.points, flat.cells, sides)
        meshes[name] = {"mesh": str(tmp_path / f"{name}.msh"), "young": 2, "poisson": "0.3"}
    data = {
        "body1": meshes["low"] | {"fixed": ["bottom"]},
        "body2": meshes["high"] | {"prescribed": {"top": ["0.001", "-1/50"]}},
        "contact": {"surface": ["skin", "skin"], "friction": "0.2", "radius": "0.5"},
        "iteration": {"theta": "0.4"},
    }
    drawn = blocks(cells=((4, 4), (4, 4)), young=(2, 2), body2={"prescribed": {"top": ["0.001", "-1/50"]}})
    drawn |= {"contact": data["contact"] | {"surface": ["top", "bottom"]}, "iteration": data["iteration"]}
    found, other = vf.solve(vf.Problem.from_dict(data)), vf.solve(vf.Problem.from_dict(drawn))
    assert found.contact.pressure == pytest.approx(other.contact.pressure, rel=1e-9)
    assert found.checks.cut_length == pytest.approx(2)
    assert vf.run(vf.Problem.from_dict(data)).iterations == vf.run(vf.Problem.from_dict(drawn)).iterations


def test_a_side_that_faces_the_other_body_around_a_corner_is_refused_with_the_place(tmp_path):
    """A block in a corner of a floor and a wall, each surface with one name."""
    points = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [0, 1]], dtype=float)
    triangles = np.array([[0, 1, 4], [0, 4, 5], [1, 2, 4], [2, 3, 4]])
    sides = {"base": np.array([[0, 1]]), "corner": np.array([[3, 4], [4, 5]])}
    write_gmsh22(tmp_path / "corner.msh", points, triangles, sides)
    flat = rectangle((0.5, 2.0), (1.0, 2.0), (6, 4))
    skin = {"top": flat.sides["top"], "skin": np.concatenate([flat.sides["bottom"], flat.sides["right"]])}
    write_gmsh22(tmp_path / "block.msh", flat.points, flat.cells, skin)
    moduli = {"young": 2, "poisson": "0.3"}
    data = {
        "body1": {"mesh": str(tmp_path / "corner.msh"), "fixed": ["base"], **moduli},
        "body2": {"mesh": str(tmp_path / "block.msh"), "prescribed": {"top": [0, "-0.01"]}, **moduli},
        "contact": {"surface": ["corner", "skin"]},
        "iteration": {"neumann_body": 1},
    }
    with pytest.raises(
        vf.ProblemError, match=r"faces both sides of a corner: .*side 'skin' at \(2, 1\) has 90 degrees"
    ):
        vf.solve(vf.Problem.from_dict(data))


def test_a_closed_line_in_a_closed_one_has_no_ends(tmp_path):
    """A disc in a ring that it fills."""
    angles, cells = 1 + 2 * np.pi * np.arange(24) / 24, 24
    ring = [r * np.column_stack([np.cos(angles), np.sin(angles)]) for r in (1.0, 1.5, 2.0)]
    node = np.arange(3 * cells).reshape(3, cells)
    after = np.roll(node, -1, axis=1)
    triangles = [
        np.column_stack(corners)
        for i in range(2)
        for corners in ((node[i], node[i + 1], after[i + 1]), (node[i], after[i + 1], after[i]))
    ]
    edges = {name: np.column_stack([node[i], after[i]]) for name, i in (("bore", 0), ("rim", 2))}
    write_gmsh22(tmp_path / "ring.msh", np.vstack(ring), np.concatenate(triangles), edges)
    pin = disc(tmp_path / "pin.msh", (0, 0), 1, 24, turn=1, top=2)
    data = {
        "body1": {"mesh": str(tmp_path / "ring.msh"), "young": 2, "poisson": "0.3", "fixed": ["rim"]},
        "body2": pin,
        "contact": {"surface": ["bore", "rest"]},
    }
    with pytest.raises(vf.ProblemError, match=r"cross near .*both lines are closed: needed parts with two ends"):
        vf.solve(vf.Problem.from_dict(data | {"iteration": {"neumann_body": 2}}))


def test_sides_that_are_parts_from_corner_to_corner_are_not_cut():
    data = blocks() | {"contact": {"surface": ["top", "bottom"]}}
    named, not_named = (vf.solve(vf.Problem.from_dict(one)).checks for one in (data, blocks()))
    assert (named.cut_length, named.cut_depth) == (0, 0)
    assert (not_named.cut_length, not_named.cut_depth) == (None, None)
    assert not_named.to_dict()["reason"]["cut_length"] == "no side is named"


# --- supports at the ends of whole sides ------------------------------------------------------------------------------


def held(folder, neumann_body=1, **above):
    """The disc, held by the part of its circle that ends where the rest begins, which is named as a whole."""
    rest = disc(folder / "held.msh", (0, 1), 1, 48, top=-0.5, prescribed={"top": [0, "-0.02"]})
    return vf.Problem.from_dict(
        {
            "body1": BLOCK,
            "body2": rest | above,
            "contact": {"surface": ["top", "rest"]},
            "iteration": {"neumann_body": neumann_body},
        }
    )


@pytest.mark.parametrize("neumann_body", [1, 2])
def test_an_end_of_a_whole_side_that_a_support_holds_apart_from_the_other_side_is_cut_off(neumann_body, tmp_path):
    found = vf.solve(held(tmp_path, neumann_body))
    part = vf.solve(
        held(tmp_path, neumann_body, parts={"low": {"side": "rest", "x": ["-0.75", "0.75"]}}).with_keys(
            {"contact.surface": '["top", "low"]'}
        )
    )
    assert found.contact.pressure.max() == pytest.approx(part.contact.pressure.max(), rel=1e-9)
    assert found.checks.cut_depth == 0
    assert not found.warnings


def test_a_support_at_a_node_that_touches_is_refused_with_its_place_and_the_remedy():
    """The left side of the upper block is moved, whose lower end lies on the lower block."""
    above = {"prescribed": {"top": [0, "-1/50"], "left": ["free", "-1/50"]}}
    data = blocks(body2=above, contact={"surface": ["top", "bottom"]})
    with pytest.raises(vf.ProblemError) as refused:
        vf.solve(vf.Problem.from_dict(data))
    said = "side 'left' holds the one at (0, 0); leave it free, or let Gamma_c end before it, by a part of the side"
    assert str(refused.value).endswith(said)


def test_a_body_held_all_along_the_contact_is_told_to_be_an_obstacle():
    for surface, held in ((["top", "bottom"], {"fixed": ["bottom", "top"]}), (None, {"fixed": ["top"]})):
        contact = {"surface": surface} if surface else {}
        data = blocks(body1={**held}, contact=contact)
        with pytest.raises(vf.ProblemError, match=r'is an obstacle: body1\.shape = "rigid" in place of its mesh'):
            vf.solve(vf.Problem.from_dict(data))


# --- refusals name what helps -----------------------------------------------------------------------------------------


def test_a_side_of_one_edge_that_is_not_faced_as_a_whole_is_refused_with_the_roles_that_work():
    """The lower block has one cell along a line that the upper one covers in part."""
    data = blocks(body1={"x": [-1, 2], "cells": [1, 2]}, contact={"surface": ["top", "bottom"]})
    data["iteration"] = {"neumann_body": 2}
    problem = vf.Problem.from_dict(data)
    with pytest.raises(vf.ProblemError, match="it is found with exchanged roles: let body 1 have the Neumann problem"):
        vf.solve(problem)
    assert vf.solve(problem.changed(neumann_body=1)).contact.force["normal"] > 0


@pytest.mark.parametrize(
    ("keys", "remedy"),
    [
        ({"body2.x": "[5, 6]"}, "contact.surface names sides that face each other in any direction"),
        ({"body2.y": "[-0.5, 0.5]"}, "draw them apart, or set contact.gap (only with two bodies)"),
        ({"contact.interval": "[0.1, 1]"}, "contact.surface instead cuts whole sides to whole edges"),
        ({"body2.traction.bottom": "[0, 1]"}, "point_load gives one to its nodes"),
    ],
)
def test_a_refusal_names_its_remedy(keys, remedy):
    problem = vf.Problem.from_dict(blocks()).with_keys(keys)
    with pytest.raises(vf.ProblemError) as refused:
        vf.solve(problem)
    assert remedy in str(refused.value)

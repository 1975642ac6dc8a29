"""Where two bodies meet: the gap on grids that differ, wherever the bodies lie, and what is no Gamma_c."""

from fractions import Fraction

import numpy as np
import pytest
from mesh_writer import write_gmsh22
from problem_list import SECTION_6, bars, changed

import verification as vf
from fem1d2d import rectangle

pytestmark = pytest.mark.usefixtures("meshes_read_here")


LOW = {"shape": "rectangle", "x": [0, 4], "cells": [8, 2], "young": 3, "poisson": "0.3", "fixed": ["bottom"]}
HIGH = {"shape": "rectangle", "x": [0, 4], "cells": [4, 2], "young": 2, "poisson": "0.3"}
PUSHED = {"prescribed": {"top": [0, "-1/50"]}}


def blocks(level, low=(), high=(), **tables):
    """Two blocks that touch at a level, of 8 and of 4 cells."""
    y = lambda *ends: [str(Fraction(level) + end) for end in ends]
    body1 = LOW | {"y": y(-1, 0)} | dict(low)
    return changed({"body1": body1, "body2": HIGH | {"y": y(0, 1)} | PUSHED | dict(high)}, **tables)


def pair_of(data):
    return vf.build(vf.Problem.from_dict(data))


def gap_of(data):
    return pair_of(data).interface.gap


@pytest.mark.parametrize("roles", [1, 2])
@pytest.mark.parametrize("level", [0, "5", "-7/3", "1000"])
@pytest.mark.parametrize("gap", ["0", "1/8"])
def test_flat_bodies_on_grids_that_differ_have_the_gap_of_the_file_wherever_they_lie(level, gap, roles):
    pair = pair_of(blocks(level, contact={"gap": gap}, iteration={"neumann_body": roles}))
    assert not pair.interface.one_grid
    assert pair.interface.contact.n == (9 if roles == 2 else 5)
    assert np.array_equal(pair.interface.gap, np.full(pair.interface.contact.n, float(Fraction(gap))))
    moved, here = (vf.solve(vf.Problem.from_dict(blocks(y, contact={"gap": "1/100"}))) for y in (level, 0))
    assert moved.contact.force["normal"] == pytest.approx(here.contact.force["normal"], rel=1e-7)


def curved(path, level, heights, *, upper, name="curved.msh"):
    """A body from x = 0 to 4 whose line on Gamma_c has these heights above a level, at equal steps."""
    mesh = rectangle((0.0, 4.0), (0.0, 1.0), (len(heights) - 1, 2))
    points = mesh.points.copy()
    line = np.interp(points[:, 0], np.linspace(0, 4, len(heights)), heights)
    share = 1 - points[:, 1] if upper else points[:, 1]
    points[:, 1] += share * line + float(Fraction(level)) - (0 if upper else 1)
    write_gmsh22(path / name, points, mesh.cells, mesh.sides)
    return {"mesh": str(path / name), "shape": None, "x": None, "y": None, "cells": None}


@pytest.mark.parametrize("level", [0, "5", "-7/3"])
def test_a_line_that_is_straight_between_the_contact_nodes_leaves_its_height_as_the_gap(tmp_path, level):
    """The body above is curved, with half as many nodes: at each contact node its line has the mean of two heights."""
    heights = [0.5, 0.125, 0, 0.25, 0.75]
    data = blocks(level, high=curved(tmp_path, level, heights, upper=True), contact={"interval": [0, 4]})
    data["body2"] = {key: value for key, value in data["body2"].items() if value is not None}
    gap = gap_of(changed(data, iteration={"neumann_body": 2}))
    assert gap == pytest.approx(np.interp(np.linspace(0, 4, 9), np.arange(5), heights), abs=1e-12)
    assert gap[4] == 0


@pytest.mark.parametrize("level", [0, "5"])
def test_the_curve_of_the_body_below_counts_downwards(tmp_path, level):
    heights = [-0.5, -0.125, 0, -0.25, -0.75]
    data = blocks(level, low=curved(tmp_path, level, heights, upper=False), high={"cells": [8, 2]})
    data["body1"] = {key: value for key, value in data["body1"].items() if value is not None}
    gap = gap_of(changed(data, contact={"interval": [0, 4]}, iteration={"neumann_body": 1}))
    assert gap == pytest.approx(-np.interp(np.linspace(0, 4, 9), np.arange(5), heights), abs=1e-12)


def test_heights_that_differ_by_rounding_are_one(tmp_path):
    heights = [0, 1e-12, 0, 2e-12, 0]
    data = blocks(0, high=curved(tmp_path, 0, heights, upper=True), contact={"interval": [0, 4], "gap": "1/8"})
    data["body2"] = {key: value for key, value in data["body2"].items() if value is not None}
    assert set(gap_of(changed(data, iteration={"neumann_body": 2}))) == {0.125}


@pytest.mark.parametrize("roles", [1, 2])
def test_a_constant_pressure_on_either_grid_is_the_same_force(roles):
    pair = pair_of(
        blocks("5", high={"x": ["0.5", "3.25"]}, low={"x": ["0.5", "3.25"]}, iteration={"neumann_body": roles})
    )
    weights = pair.interface.neumann.weights
    x = pair.interface.neumann.x
    hats = np.concatenate([np.diff(x) / 2, [0]]) + np.concatenate([[0], np.diff(x) / 2])
    assert weights == pytest.approx(hats, rel=1e-12)


@pytest.mark.parametrize("roles", [1, 2])
@pytest.mark.parametrize("apart", [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)])
def test_ends_that_differ_by_rounding_are_one_end(apart, roles):
    """Either body may reach further than the other, at either end."""
    ends = [str(end + Fraction(off, 10**10)) for end, off in zip((1, 3), apart, strict=True)]
    pair = pair_of(blocks("5", low={"x": [1, 3]}, high={"x": ends}, iteration={"neumann_body": roles}))
    rows = pair.interface.transfer.sum(axis=1)
    assert rows == pytest.approx(np.ones(len(rows)), rel=1e-12)


NAMED = {"contact": {"surface": ["top", "bottom"]}}


@pytest.mark.parametrize("tables", [{}, NAMED], ids=["along x", "named sides"])
@pytest.mark.parametrize("cells", [4, 8])
@pytest.mark.parametrize("roles", [1, 2])
def test_blocks_drawn_into_each_other_have_their_depth_as_a_negative_gap_to_which_the_gap_of_the_file_is_added(
    roles, cells, tables
):
    for depth, gap in (("1/32", "0"), ("1/32", "1/64"), ("1/32", "1/8"), ("-1/4", "1/8")):
        high = {"y": [str(-Fraction(depth)), "1"], "cells": [cells, 2]}
        data = changed(blocks(0, high=high, contact={"gap": gap}, iteration={"neumann_body": roles}), **tables)
        assert set(gap_of(data)) == {float(Fraction(gap) - Fraction(depth))}


@pytest.mark.parametrize("tables", [{}, NAMED], ids=["along x", "named sides"])
def test_bodies_may_overlap_by_a_twentieth_of_the_smaller_height(tables):
    drawn = lambda depth: changed(blocks(0, high={"y": [f"-{depth}", f"{2 - float(depth)}"]}), **tables)
    assert set(gap_of(drawn("0.0499"))) == {-0.0499}
    with pytest.raises(vf.ProblemError, match="needed an overlap of at most 5 %"):
        gap_of(drawn("0.0501"))


# --- obstacles --------------------------------------------------------------------------------------------------------

RIGID = {"shape": "rigid"}


@pytest.mark.parametrize("level", [0, "5", "-7/3"])
@pytest.mark.parametrize("elastic", [1, 2])
def test_an_obstacle_touches_with_the_face_that_looks_at_the_body(level, elastic):
    """A block of height 1 pressed by 1/50 between two walls: the modulus is ``E (1 - nu)/((1 + nu)(1 - 2 nu))``."""
    y, pushed = Fraction(level), "bottom" if elastic == 1 else "top"
    free, down = {"left": [0, "free"], "right": [0, "free"]}, ["free", "1/50" if elastic == 1 else "-1/50"]
    ends = [y - 1, y] if elastic == 1 else [y, y + 1]
    block = HIGH | {"y": [str(end) for end in ends], "prescribed": free | {pushed: down}}
    far = [y, y + 2] if elastic == 1 else [y - 2, y]
    for rigid in (RIGID, RIGID | {"x": [-1, 9], "y": [str(end) for end in far]}):
        given = {f"body{elastic}": block, f"body{3 - elastic}": rigid, "contact": {"friction": 0}}
        found = vf.solve(vf.Problem.from_dict(given)).contact
        assert found.pressure == pytest.approx(np.full(5, 2 * 0.7 / (1.3 * 0.4) / 50), rel=1e-9)


@pytest.mark.parametrize("level", [0, "5"])
@pytest.mark.parametrize("elastic", [1, 2])
def test_an_obstacle_of_any_height_touches_the_nearest_point_of_a_curve(tmp_path, level, elastic):
    """Without a load the gap stays the height of the curve."""
    heights = [0.5, 0.125, 0, 0.25, 0.75]
    signed = heights if elastic == 2 else [-height for height in heights]
    block = {key: value for key, value in curved(tmp_path, level, signed, upper=elastic == 2).items() if value}
    block |= {"young": 2, "poisson": "0.3", "fixed": ["top" if elastic == 2 else "bottom"]}
    given = {f"body{elastic}": block, f"body{3 - elastic}": RIGID, "contact": {"friction": 0, "interval": [0, 4]}}
    assert vf.solve(vf.Problem.from_dict(given)).contact.gap == pytest.approx(heights, abs=1e-12)


# --- what is no Gamma_c -----------------------------------------------------------------------------------------------

REFUSED = {
    "beside each other": ({"body2": {"x": [3, 4]}}, "do not meet|do not lie opposite"),
    "touching at a corner": ({"body2": {"x": [2, 3]}}, "do not meet|do not lie opposite"),
    "an interval beyond the body above": ({"contact": {"interval": ["0.4", "1.8"]}}, "inside the overlap"),
    "an interval before the body above": ({"contact": {"interval": ["0.2", "1.6"]}}, "inside the overlap"),
    "ends between the nodes of the contact body": (
        {"contact": {"interval": ["0.5", "1.5"]}},
        "must begin and end at nodes of the contact body",
    ),
    "a first end between nodes": ({"contact": {"interval": ["0.5", "1.6"]}}, "must begin and end at nodes"),
    "a last end between nodes": ({"contact": {"interval": ["0.4", "1.5"]}}, "must begin and end at nodes"),
    "too many nodes": ({"body1": {"cells": [3360, 1]}, "body2": {"cells": [3, 1]}}, "at most 2000 contact nodes"),
    "a kernel that reaches no node": (
        {"body1": {"cells": [9, 2]}, "contact": {"radius": "0.001"}},
        "reaches no node of the Neumann grid",
    ),
    "drawn deep in each other": ({"body2": {"y": ["-0.1", "0.2"]}}, "do not meet|overlap"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_gamma_c_is_refused(name):
    tables, words = REFUSED[name]
    with pytest.raises(vf.ProblemError, match=words):
        pair_of(changed(SECTION_6, **tables))


def test_a_surface_with_a_hole_is_refused(tmp_path):
    mesh = rectangle((0.4, 1.6), (0.0, 0.3), (6, 2))
    centre = mesh.points[mesh.cells].mean(axis=1)
    kept = mesh.cells[~((abs(centre[:, 0] - 1.1) < 0.1) & (centre[:, 1] < 0.15))]
    write_gmsh22(tmp_path / "notched.msh", mesh.points, kept, {"top": mesh.sides["top"]})
    body2 = {"mesh": str(tmp_path / "notched.msh"), "shape": None, "x": None, "y": None, "cells": None}
    with pytest.raises(vf.ProblemError, match=r"no surface between x = 1 and 1\.2"):
        pair_of(changed(SECTION_6, body2=body2, iteration={"neumann_body": 2}))


@pytest.mark.parametrize("gap", ["0", "1/8"])
def test_bars_meet_where_they_lie(gap):
    assert gap_of(bars(start=7, contact={"gap": gap})) == [float(Fraction(gap))]

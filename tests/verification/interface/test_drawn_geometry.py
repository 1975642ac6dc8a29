"""The gap between bodies as they are drawn, and lines that are too steep for vertical normals."""

import numpy as np
import pytest
from mesh_writer import write_curved
from problem_list import PROBLEMS, SECTION_6, bars, changed

import verification as vf
from verification.interface.files import write_interface

FLAT = {"shape": "rectangle", "x": ["-0.3", "0.3"], "y": ["-0.2", 0], "cells": [60, 20]}
STEEL = {"young": 70000, "poisson": "0.3"}


def circle(radius, upwards=1.0):
    return lambda x: upwards * (radius - np.sqrt(radius**2 - x**2))


def lower(path, line=None, x=None):
    """The body below: flat, or under a line."""
    grid = np.linspace(-0.3, 0.3, 61) if x is None else x
    shape = FLAT if line is None else {"mesh": write_curved(path / "low.msh", grid, lambda x: 0 * x - 0.2, line)}
    return {**shape, **STEEL, "fixed": ["bottom"]}


def upper(path, line, x=None, down="-0.004"):
    grid = np.linspace(-0.2, 0.2, 41) if x is None else x
    mesh = write_curved(path / "high.msh", grid, line, lambda x: 0 * x + 0.2)
    return {"mesh": mesh, **STEEL, "prescribed": {"top": [0, down]}}


def problem(body1, body2, **contact):
    given = {"interval": ["-0.1", "0.1"], "friction": 0} | contact
    return vf.Problem.from_dict({"body1": body1, "body2": body2, "contact": given, "iteration": {"theta": "0.5"}})


# --- the gap ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("roles", [1, 2])
@pytest.mark.parametrize("name", ["section 6", "initial gap, lifted on one side", "bars with a gap"])
def test_bodies_drawn_apart_are_those_with_a_gap_that_touch(name, roles):
    data = changed(PROBLEMS[name], iteration={"neumann_body": roles})
    gap = vf.Problem.from_dict(data).contact.gap
    axis = "x" if data.get("dimension") == 1 else "y"
    low, high = data["body2"][axis]
    apart = vf.Problem.from_dict(changed(data, body2={axis: [f"{float(low) + 0.002}", f"{float(high) + 0.002}"]}))
    touching = vf.Problem.from_dict(changed(data, contact={"gap": f"{float(gap) + 0.002}"}))
    assert vf.build(apart).interface.gap == pytest.approx(vf.build(touching).interface.gap, rel=1e-12)
    for found, expected in ((vf.solve(apart), vf.solve(touching)), (vf.run(apart), vf.run(touching))):
        scale = np.abs(expected.contact.pressure).max()
        assert np.abs(found.contact.pressure - expected.contact.pressure).max() <= 1e-9 * scale
        assert found.checks.largest_strain == pytest.approx(expected.checks.largest_strain, rel=1e-9)
        assert found.checks.penetration_outside == expected.checks.penetration_outside


def test_bodies_drawn_too_far_apart_to_meet_have_no_force():
    far = vf.Problem.from_dict(changed(body2={"y": ["0.1", "0.4"]}, contact={"gap": "0.05"}))
    assert vf.build(far).interface.gap == pytest.approx(0.15)
    assert vf.solve(far).contact.force["normal"] == 0 == vf.run(far).contact.force["normal"]


def test_a_distance_that_differs_from_0_by_rounding_is_0():
    touching = vf.build(vf.Problem.from_dict(changed(body2={"y": ["1e-11", "0.3"]})))
    assert not touching.interface.gap.any()


@pytest.mark.parametrize("depth", [0.004, 0.009])
def test_bodies_drawn_into_each_other_are_pressed_by_their_overlap(depth):
    """A body drawn lower by d and pushed less by d is the same body."""
    overlap = changed(body2={"y": [f"{-depth}", f"{0.3 - depth}"], "prescribed": {"top": [0, f"{depth - 0.015}"]}})
    overlapping, pressed = vf.Problem.from_dict(overlap), vf.Problem.from_dict(SECTION_6)
    for found, expected in ((vf.solve(overlapping), vf.solve(pressed)), (vf.run(overlapping), vf.run(pressed))):
        assert found.contact.pressure == pytest.approx(expected.contact.pressure, rel=1e-7)
        assert f"the initial gap is {-depth:.4g} at x = 0.4: the bodies overlap" in found.warnings[0]
    assert not any("overlap" in words for words in vf.solve(pressed).warnings)


def test_an_overlap_goes_through_an_interface_file(tmp_path):
    pair = vf.build(vf.Problem.from_dict(changed(body2={"y": ["-0.005", "0.295"]})))
    write_interface(pair, tmp_path / "interface.npz")
    again = vf.build(tmp_path / "interface.npz")
    assert again.interface.gap == pytest.approx(-0.005)
    assert vf.run(again).history == vf.run(pair).history
    assert again.warnings == pair.warnings


def test_bars_may_overlap_by_a_little():
    pressed = vf.solve(vf.Problem.from_dict(bars())).contact.pressure[0]
    moved = bars(body2={"x": ["0.99", "2.99"], "prescribed": {"right": "-0.09"}})
    assert vf.solve(vf.Problem.from_dict(moved)).contact.pressure[0] == pytest.approx(pressed, rel=1e-12)


def test_a_disc_needs_no_node_at_its_lowest_point(tmp_path):
    """Its lowest nodes lie half a cell to the left and to the right of it, 1.3e-5 above the plane."""
    beside = problem(lower(tmp_path), upper(tmp_path, circle(1.0), np.linspace(-0.2, 0.2, 40)))
    assert 0 < vf.build(beside).interface.gap.min() < 2e-5
    force = vf.solve(beside).contact.force["normal"]
    assert vf.run(beside).contact.force["normal"] == pytest.approx(force, rel=1e-6)
    at_it = problem(lower(tmp_path), upper(tmp_path, circle(1.0)))
    assert force == pytest.approx(vf.solve(at_it).contact.force["normal"], rel=0.005)


def test_the_gap_between_curved_bodies_is_their_distance_at_each_node_plus_the_constant(tmp_path):
    low, high = circle(20.0, -1.0), lambda x: 0.001 + circle(1.0)(x)
    pair = vf.build(problem(lower(tmp_path, low), upper(tmp_path, high), gap="0.002"))
    x = pair.interface.contact.x
    assert pair.interface.gap == pytest.approx(0.002 + high(x) - low(x), abs=1e-12)


@pytest.mark.parametrize("upwards", [-1.0, 1.0], ids=["convex", "groove"])
@pytest.mark.parametrize("nodes", [33, 41, 57])
def test_two_curved_bodies_meet_whatever_their_grids(tmp_path, upwards, nodes):
    """A shallow crown or groove under a disc: their chords come as near as the square of a cell."""
    bodies = lower(tmp_path, circle(20.0, upwards)), upper(tmp_path, circle(1.0), np.linspace(-0.2, 0.2, nodes))
    pair = vf.build(problem(*bodies))
    assert abs(pair.interface.gap.min()) <= 2e-5
    assert vf.run(pair).contact.force["normal"] == pytest.approx(vf.solve(pair).contact.force["normal"], rel=1e-6)


# --- slopes -----------------------------------------------------------------------------------------------------------


def ramp(path, slope, neumann=2):
    """Two bodies that meet along a line with this slope, or an upper one on a flat lower one."""
    line = lambda x: slope * x
    return problem(lower(path, line), upper(path, line)).changed(neumann_body=neumann)


@pytest.mark.parametrize("neumann", [1, 2])
def test_bodies_on_a_ramp_are_refused_with_the_slope_and_its_place(tmp_path, neumann):
    contact = 3 - neumann
    words = rf"body{contact}\.mesh: body {contact} is the contact body, and its line has the slope -0\.3 from \("
    problem = ramp(tmp_path, -0.3, neumann)
    for door in (vf.build, vf.solve, vf.run, vf.measure):
        with pytest.raises(vf.ProblemError, match=words + rf".*0\.02.*body {neumann} is steep too"):
            door(problem)


def test_a_slope_of_002_is_allowed_and_more_is_refused(tmp_path):
    for slope in (0.02, -0.02):
        assert vf.solve(ramp(tmp_path, slope)).contact.force["normal"] > 0
        with pytest.raises(vf.ProblemError, match="slope"):
            vf.solve(ramp(tmp_path, 1.001 * slope))


def test_slopes_beyond_gamma_c_do_not_matter(tmp_path):
    bent = lambda x: -np.maximum(np.abs(x) - 0.1, 0) / 2
    assert vf.solve(problem(lower(tmp_path, bent), upper(tmp_path, circle(1.0)))).contact.force["normal"] > 0


def test_a_disc_on_a_plane_gets_the_neumann_problem_and_no_other_role(tmp_path):
    disc = problem(lower(tmp_path), upper(tmp_path, circle(1.0)))
    remedy = r"body 2 is the contact body.*body 1 is flat: .*\(iteration\.neumann_body = 2\)"
    with pytest.raises(vf.ProblemError, match=remedy):
        vf.run(disc.swapped())
    pair = vf.build(disc)
    assert pair.interface.one_grid
    with pytest.raises(vf.ProblemError, match=remedy):  # shares what is condensed, and finds no Gamma_c anew
        pair.swapped()
    advice = vf.advise(pair)
    assert advice.neumann_body == 2
    assert advice.roles[1].rho is None
    assert "slope" in advice.roles[1].reason["rho"]


def test_no_steep_body_is_advised_where_the_contact_body_has_no_nodes_at_the_ends(tmp_path):
    disc = problem(
        lower(tmp_path), upper(tmp_path, circle(1.0), np.linspace(-0.2, 0.2, 33)), interval=["-0.1125", "0.1"]
    )
    with pytest.raises(vf.ProblemError, match="must begin and end at nodes of the contact body, body 1") as refusal:
        vf.solve(disc)
    assert "let body 1 have the Neumann problem" not in str(refusal.value)


@pytest.mark.parametrize(("digits", "way"), [(6, 1), (5, -1)])
def test_an_interval_ends_at_the_node_that_its_printed_digits_mean(digits, way, tmp_path):
    """A message prints six digits of the position of a node, and takes them again."""
    low = {
        "mesh": write_curved(
            tmp_path / "low.msh", 59.44355364 * np.linspace(-1, 1, 41), lambda x: 0 * x - 9, lambda x: 0 * x
        )
    }
    up = {"mesh": write_curved(tmp_path / "up.msh", np.linspace(-80, 80, 31), lambda x: 0 * x, lambda x: 0 * x + 9)}
    end = 59.44355364 * 0.9  # a node of the contact body
    printed = round(end + way * 0.5 * 10.0 ** (1 - digits), digits - 2)
    data = {
        "body1": low | {"young": 1, "poisson": 0, "fixed": ["bottom"]},
        "body2": up | {"young": 1, "poisson": 0, "prescribed": {"top": [0, -0.1]}},
        "contact": {"interval": [-printed, printed]},
    }
    assert np.abs(vf.build(vf.Problem.from_dict(data)).contact.grid.x[[0, -1]]) == pytest.approx([end, end], rel=1e-9)
    data["contact"]["interval"] = [-end, end + 0.1]
    with pytest.raises(vf.ProblemError, match="must begin and end at nodes of the contact body"):
        vf.build(vf.Problem.from_dict(data))


def test_a_body_too_slender_for_tolerances_of_its_extent_is_refused_by_name():
    for length, height in ((1e-9, 0.4), (1.2, 3e10)):
        block = {"shape": "rectangle", "x": [0, length], "cells": [4, 2], "young": 1, "poisson": "0.3"}
        data = {
            "body1": block | {"y": [-height, 0], "fixed": ["bottom"]},
            "body2": block | {"y": [0, height], "prescribed": {"top": [0, -0.01 * height]}},
            "contact": {"surface": ["top", "bottom"]},
        }
        with pytest.raises(vf.ProblemError, match=r"body1: its extents are .*less slender"):
            vf.solve(vf.Problem.from_dict(data))

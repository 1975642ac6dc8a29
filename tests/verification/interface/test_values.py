"""Values at points and along sides, and forces at points: closed forms, reciprocity, laws of units and of bodies."""

import csv
from itertools import pairwise

import numpy as np
import pytest
from histories import pressed_and_sheared
from problem_list import bars, blocks, changed

import verification as vf
from fem1d2d import place, stresses
from verification.cli import main
from verification.interface.values import columns_of, values_on_sides

#: A column on rollers, free on its right, whose top is pressed down: E, nu, by how much, and its height.
E, NU, DOWN, HEIGHT = 50000.0, 0.3, 0.004, 0.8
OF_COLUMN = {"shape": "rectangle", "x": [0, 1], "poisson": "0.3", "young": 50000}
ROLLERS = {"left": [0, "free"]}
COLUMN = {
    "body1": {**OF_COLUMN, "y": ["-0.5", 0], "cells": [4, 3], "prescribed": {**ROLLERS, "bottom": ["free", 0]}},
    "body2": {**OF_COLUMN, "y": [0, "0.3"], "cells": [4, 2], "prescribed": {**ROLLERS, "top": ["free", "-0.004"]}},
    "iteration": {"theta": "0.5"},
}
POINTS = {1: {"low": ["0.3", "-0.41"], "edge": [1, "-0.2"]}, 2: {"mid": ["0.7", "0.15"], "foot": [0, 0]}}


def with_points(data, points=POINTS):
    return changed(data, **{f"body{i}": {"points": named} for i, named in points.items()})


@pytest.mark.parametrize("solve", [vf.run, vf.solve])
@pytest.mark.parametrize("split", ["alternating", "both"])
def test_a_pressed_column_has_the_displacements_and_stresses_of_the_closed_form(solve, split):
    data = changed(with_points(COLUMN), body1={"split": split}, body2={"split": split})
    found, yy = solve(vf.Problem.from_dict(data)), -E / (1 - NU**2) * DOWN / HEIGHT
    assert [(one.body, one.name) for one in found.points] == [(1, "edge"), (1, "low"), (2, "foot"), (2, "mid")]
    for one in found.points:
        exact = [NU / (1 - NU) * DOWN / HEIGHT * one.x, -DOWN / HEIGHT * (one.y + 0.5)]
        assert one.displacement == pytest.approx(exact, abs=1e-9)
        mises = abs(yy) * np.sqrt(1 - NU + NU**2)
        assert one.stress == pytest.approx({"xx": 0, "yy": yy, "xy": 0, "mises": mises}, abs=1e-5 * abs(yy))
    assert found.to_dict()["points"][1]["name"] == "low"
    assert "low (body 1)" in str(found.sections())


def test_displacements_by_forces_at_points_are_reciprocal():
    """Betti: the work of one force in the displacement of another one is that of the other in its displacement."""
    apart = blocks(young=(2, 5), body2={"prescribed": {"top": [0, 20]}})  # the bodies never meet
    places = [(["0.25", "-0.5"], [1, 0]), (["0.75", 0], [1, -2])]
    moved = []
    for at, force in places:
        load = {"point_load": [{"at": at, "force": force}], "points": {"a": places[0][0], "b": places[1][0]}}
        found = vf.solve(vf.Problem.from_dict(changed(apart, body1=load)))
        assert found.contact.apart
        moved.append({one.name: one.displacement for one in found.points})
    assert moved[0]["b"] @ np.array(places[1][1]) == pytest.approx(moved[1]["a"] @ np.array(places[0][1]), rel=1e-12)
    assert abs(moved[0]["b"]).max() > 1e-3


def test_a_bar_gives_way_to_a_force_at_a_point_as_a_spring_does():
    data = changed(bars(), body2={"prescribed": {"right": 1}})  # apart
    low, high = map(float, vf.Problem.from_dict(data).body1.x)
    middle = low + (high - low) / 4 * 2
    load = {"cells": 4, "point_load": [{"at": middle, "force": "0.1"}], "points": {"end": high, "there": middle}}
    found = vf.solve(vf.Problem.from_dict(changed(data, body1=load)))
    young = float(vf.Problem.from_dict(data).body1.young)
    for one in found.points:
        assert one.displacement == pytest.approx([0.1 * (middle - low) / young], rel=1e-12)
        assert one.to_dict()["y"] is None
    assert "uy" not in str(found.sections())
    assert "ux" in str(found.sections())


def test_forces_at_all_nodes_of_a_side_by_the_trapezoid_rule_are_a_traction():
    data = changed(body2={"prescribed": {"top": ["free", "-0.015"]}, "traction": {"right": ["-20", 0]}})
    ys = np.linspace(0, 0.3, 3)
    forces = [
        {"at": ["1.6", str(round(y, 12))], "force": [-20 * w, 0]} for y, w in zip(ys, (0.075, 0.15, 0.075), strict=True)
    ]
    one = vf.Problem.from_dict(data)
    other = vf.Problem.from_dict(changed(data, body2={"traction": None, "point_load": forces}))
    pressures = [vf.solve(problem).contact.pressure for problem in (one, other)]
    assert pressures[1] == pytest.approx(pressures[0], rel=1e-12)
    assert one.digest != other.digest


def test_values_do_not_depend_on_the_unit_of_length_or_on_where_the_bodies_lie():
    data = with_points(
        changed(body2={"point_load": [{"at": ["0.4", "0.15"], "force": [5, 1]}]}), {2: {"a": [1, "0.2"]}}
    )
    found = vf.solve(vf.Problem.from_dict(data)).points[0]
    other = vf.Problem.from_dict(data).to_dict()
    for name in ("body1", "body2"):
        body = other[name]
        for axis in "xy":
            body[axis] = [1000 * v + (2000 if axis == "x" else 0) for v in body[axis]]
    other["body2"] |= {
        "prescribed": {"top": [0, -15]},
        "point_load": [{"at": [2400, 150], "force": [5000, 1000]}],
        "points": {"a": [3000, 200]},
    }
    other["contact"]["radius"], other["norm"] = 200, {"length": 1000}
    there = vf.solve(vf.Problem.from_dict(other)).points[0]
    assert there.displacement == pytest.approx(1000 * found.displacement, rel=1e-9)
    assert there.stress == pytest.approx(found.stress, rel=1e-9)


def test_points_and_forces_belong_to_their_own_body_of_several():
    data = vf.example("stack").to_dict()
    middle = [sum(data["body3"][axis]) / 2 for axis in "xy"]
    data["body3"] |= {"points": {"mid": middle}, "point_load": [{"at": middle, "force": [0, 50]}]}
    without = vf.Problem.from_dict({**data, "body3": {**data["body3"], "point_load": []}})
    found, other = vf.solve(vf.Problem.from_dict(data)), vf.solve(without)
    assert [(one.body, one.name) for one in found.points] == [(3, "mid")]
    assert found.points[0].displacement[1] > other.points[0].displacement[1] + 1e-6
    assert vf.run(vf.Problem.from_dict(data)).points[0].displacement == pytest.approx(
        found.points[0].displacement, rel=1e-6
    )
    with pytest.raises(vf.ProblemError, match=r"body3\.points\.mid = .*needed a point of it: .* lies outside"):
        vf.solve(without.with_keys({"body3.points.mid": f"[{middle[0]}, -5]"}))


REFUSED = {
    "held": ({"at": [1, "0.3"], "force": [0, 1]}, r"body2\.point_load = \[1, 0.3\]: the node there is held"),
    "outside": ({"at": [1, 9], "force": [0, 1]}, r"body2\.point_load = \[1, 9\]: no node lies within half an edge"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_force_that_acts_on_no_node_or_is_lost_is_refused(name):
    load, message = REFUSED[name]
    with pytest.raises(vf.ProblemError, match=message):
        vf.solve(vf.Problem.from_dict(changed(body2={"point_load": [load]})))


WRONG = {
    "no list": ({"at": [1, 0], "force": [0, 1]}, r"point_load = .*needed a list of tables"),
    "no force": ([{"at": [1, 0]}], r"point_load\[1\]\.force: this key is missing"),
    "another key": ([{"at": [1, 0], "force": [1, 0], "on": 1}], r"point_load\[1\]\.on: unknown key"),
    "twice": ([{"at": [1, 0], "force": [1, 0]}] * 2, r"point_load\[2\]\.at = .*needed one force for each point"),
    "no point": ([{"at": 1, "force": [1, 0]}], r"point_load\[1\]\.at = 1: needed two numbers"),
}


@pytest.mark.parametrize("name", WRONG)
def test_point_loads_of_another_form_are_refused_by_their_key(name):
    given, message = WRONG[name]
    with pytest.raises(vf.ProblemError, match=r"body2\." + message):
        vf.Problem.from_dict(changed(body2={"point_load": given}))


def test_an_obstacle_has_no_points_and_no_forces():
    for key, value in (("points", {"a": [0, 0]}), ("point_load", [{"at": [0, 0], "force": [1, 0]}])):
        with pytest.raises(vf.ProblemError, match=rf"body1\.{key}.*: unknown (key|table)"):
            vf.Problem.from_dict({**changed(), "body1": {"shape": "rigid", key: value}})


def test_stresses_at_a_point_are_those_of_its_cell_component_by_component():
    data = changed(body2={"prescribed": {"top": ["0.006", "-0.015"]}, "points": {"a": ["0.62", "0.11"]}})
    found = vf.solve(vf.Problem.from_dict(data))
    body, [one] = found.bodies.body2, found.points
    cell = place(body.mesh, np.array([0.62, 0.11])).cells
    tensor = stresses(body.mesh, body.material, found.displacements[1])[cell].mean(axis=0)
    assert [one.stress[of] for of in ("xx", "yy", "xy")] == pytest.approx([tensor[0, 0], tensor[1, 1], tensor[0, 1]])
    assert abs(one.stress["xy"]) > 1
    assert list(columns_of([one])) == ["body", "name", "x", "y", "ux", "uy", "sxx", "syy", "sxy", "mises"]
    bar = vf.solve(vf.Problem.from_dict(changed(bars(), body1={"points": {"a": 0}})))
    assert list(columns_of(bar.points)) == ["body", "name", "x", "ux", "sxx", "mises"]
    assert columns_of(()) == {}


def test_points_change_no_number_and_no_digest():
    plain, named = vf.Problem.from_dict(changed()), vf.Problem.from_dict(with_points(changed(), {1: {"a": [1, 0]}}))
    assert named.digest == plain.digest
    assert named != plain
    assert vf.Problem.from_dict(named.to_dict()) == named
    assert "points" not in vf.run(plain).to_dict()


def test_a_history_has_the_points_of_each_increment_and_ends_as_its_twin_does(tmp_path, monkeypatch):
    data = with_points(pressed_and_sheared(), {1: {"a": [1, "-0.15"]}, 2: {"b": ["0.6", "0.1"]}})
    data["step"] = [*data["step"][:2], {"body2": {"point_load": [{"at": ["0.4", "0.15"], "force": [8, 0]}]}}]
    data["step"][2]["increments"] = 2
    problem = vf.Problem.from_dict(data)
    found, twin = vf.march(problem), vf.march(problem, method="monolithic")
    table, count = found.point_table(), len(found.increments)
    assert table["name"] == ["a", "b"] * count
    assert table["time"][::2] == [each.time for each in found.increments]
    for mine, other in zip(found.increments, twin.increments, strict=True):
        for one, same in zip(mine.points, other.points, strict=True):
            assert one.displacement == pytest.approx(same.displacement, abs=1e-9)
    document = found.to_dict()
    assert document["points"] == document["increments"][-1]["points"] != document["increments"][0]["points"]
    assert len(found.plot("points").axes) == 2
    with pytest.raises(ValueError, match=r"no points to draw: needed points = "):
        vf.march(vf.Problem.from_dict(pressed_and_sheared())).plot("points")
    pulled = [each.points[1].displacement[0] for each in found.increments[-3:]]
    assert pulled[2] - pulled[1] == pytest.approx(pulled[1] - pulled[0], rel=0.2)
    assert pulled[2] > pulled[0]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.toml").write_text(problem.to_toml(), "utf-8")
    assert main(["march", "my.toml", "-o", "out"]) == 0
    for name, rows in (("points", 2 * count), ("sides", count * len(values_on_sides(*sides_of(found))["side"]))):
        with open(f"out/{name}.csv", encoding="utf-8", newline="") as file:
            file.readline()
            assert len(list(csv.DictReader(file))) == rows
    assert (tmp_path / "out" / "points.svg").exists()


def sides_of(found):
    last = found.increments[-1].result
    return last.bodies, last.displacements


def test_values_along_the_sides_follow_each_other_and_are_those_at_their_points():
    data = changed(body1={"parts": {"edge": {"side": "left", "y": ["-0.3", 0]}}})
    found = vf.solve(vf.Problem.from_dict(data))
    table = values_on_sides(found.bodies, found.displacements)
    rows = [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]
    assert {(row["body"], row["side"]) for row in rows} >= {(1, "edge"), (2, "top")}
    for before, row in pairwise(rows):
        if row["s"]:
            step = np.hypot(row["x"] - before["x"], row["y"] - before["y"])
            assert row["s"] - before["s"] == pytest.approx(step, rel=1e-12)
    left = [row for row in rows if row["side"] == "edge"]
    assert [row["y"] for row in left] == pytest.approx([0, -0.15, -0.3])  # the body lies on the left
    some = {f"p{i}": [row["x"], row["y"]] for i, row in enumerate(rows[:9])}
    points = vf.solve(vf.Problem.from_dict(changed(data, body1={"points": some}))).points
    for one in points:
        row = rows[int(one.name[1:])]
        assert one.displacement == pytest.approx([row["ux"], row["uy"]], abs=1e-15)
        assert list(one.stress.values()) == pytest.approx([row[of] for of in ("sxx", "syy", "sxy", "mises")], rel=1e-9)


def test_a_run_that_diverged_has_no_values():
    stiff = {"young": 20000000, "points": {"a": [1, "0.1"]}}
    found = vf.run(vf.Problem.from_dict(changed(body2=stiff, iteration={"theta": "0.99"})))
    assert found.outcome == "diverged"
    assert "points" not in found.to_dict()

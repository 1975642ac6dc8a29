"""Surfaces outside Gamma_c that overlap, and large strains."""

import re
from dataclasses import replace

import numpy as np
import pytest
from mesh_writer import write_curved
from problem_list import APART, PROBLEMS, SECTION_6, bars, changed
from sample_runs import SAMPLES

import verification as vf
from verification.cli.problems import examples
from verification.interface import checks
from verification.interface.friction import Nonlocal

TOO_SHORT = changed(body1={"cells": [20, 3]}, body2={"cells": [12, 3]}, contact={"interval": ["0.7", "1.3"]})


def crossing(warnings):
    return [words for words in warnings if words.startswith("outside Gamma_c the bodies overlap")]


def strained(warnings):
    return [words for words in warnings if words.startswith("the largest principal strain is")]


def cylinder(path, half, lower=None, line=None):
    """A cylinder of radius 1 pressed on a plane: half the true contact is 0.06 wide, Gamma_c is 2 ``half`` wide."""
    low = line or (lambda x: 1 - np.sqrt(1 - x**2))
    mesh = write_curved(path / "cylinder.msh", np.linspace(-0.2, 0.2, 41), low, lambda x: 0 * x + 0.4)
    plane = {"shape": "rectangle", "x": ["-0.3", "0.3"], "y": ["-0.4", 0], "cells": [60, 40]}
    steel = {"young": 70000, "poisson": "0.3"}
    return vf.Problem.from_dict(
        {
            "body1": lower or {**plane, **steel, "fixed": ["bottom"]},
            "body2": {"mesh": mesh, **steel, "prescribed": {"top": [0, "-0.006"]}},
            "contact": {"interval": [f"-{half}", half], "friction": 0},
            "iteration": {"theta": "0.5"},
        }
    )


# --- Gamma_c too short ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted({*SAMPLES, *APART} - {"part of the top moved, so that it opens"}))
def test_no_node_lies_in_the_other_body_where_gamma_c_is_all_that_can_touch(name):
    found = vf.solve(vf.Problem.from_dict((PROBLEMS | APART)[name]))
    assert found.checks.penetration_outside in ((None,) if found.problem.dimension == 1 else (0.0,))
    assert found.checks.penetration_at is None
    assert crossing(found.warnings) == []


@pytest.mark.parametrize("name", sorted(set(examples()) - {"two-bars"}))
def test_the_built_in_problems_have_a_gamma_c_that_is_long_enough(name):
    assert vf.solve(vf.example(name)).checks.penetration_outside == 0


def test_section_6_with_half_of_gamma_c_is_warned_of_by_run_and_solve_in_both_roles():
    problem = vf.Problem.from_dict(TOO_SHORT)
    for found in (vf.solve(problem), vf.run(problem), vf.run(problem.swapped(), theta="0.2")):
        assert found.checks.penetration_outside == pytest.approx(0.0147, abs=1e-4)
        (words,) = crossing(found.warnings)
        assert re.search(r"by 0\.0147 mm at \((0\.4|1\.6), 0\): Gamma_c, from x = 0\.7 to 1\.3, is too short", words)


def test_the_depth_is_that_of_the_corner_under_the_surface():
    """The deformed surface is almost level, so that the depth is almost the distance along y."""
    found = vf.solve(vf.Problem.from_dict(TOO_SHORT))
    (below, above), (u1, u2) = found.bodies.elastic, found.displacements
    top = np.flatnonzero(np.abs(below.mesh.points[:, 1]) < 1e-12)
    top = top[np.argsort(below.mesh.points[top, 0])]
    surface = (below.mesh.points + u1)[top]
    corner = (above.mesh.points + u2)[np.argmin(np.abs(above.mesh.points - [0.4, 0]).sum(axis=1))]
    straight = np.interp(corner[0], *surface.T) - corner[1]
    assert 0.99 * straight <= found.checks.penetration_outside <= straight


@pytest.mark.parametrize("half", ["0.06", "0.1", "0.18"])
def test_a_cylinder_whose_contact_fits_into_gamma_c_is_not_warned_of(tmp_path, half):
    found = vf.solve(cylinder(tmp_path, half))
    assert crossing(found.warnings) == []
    assert found.contact.pressure.max() == pytest.approx(1366.2489, rel=1e-7)


@pytest.mark.parametrize(("half", "multiple", "share"), [("0.05", 1.8, 0.16), ("0.03", 3.6, 0.54)])
def test_a_cylinder_whose_contact_is_longer_than_gamma_c_is_warned_of(tmp_path, half, multiple, share):
    """The figures of the page: how many times as large the pressure is, and the depth on the scale of the threshold."""
    problem = cylinder(tmp_path, half)
    for found in (vf.solve(problem), vf.run(problem)):
        assert found.contact.pressure.max() / 1366.2489 == pytest.approx(multiple, abs=0.05)
        scale = found.checks.largest_strain * np.ptp(found.contact.x)
        assert found.checks.penetration_outside / scale == pytest.approx(share, abs=0.005)
        assert len(crossing(found.warnings)) == 1


def test_an_obstacle_is_a_body_without_end_or_with_its_own(tmp_path):
    def depth(half, **obstacle):
        return vf.solve(cylinder(tmp_path, half, {"shape": "rigid", **obstacle})).checks.penetration_outside

    assert depth("0.18") == depth("0.18", y=[-1, 0]) == depth("0.18", x=["-0.18", "0.18"]) == 0
    endless = depth("0.02")
    assert endless == depth("0.02", y=[-1, 0]) == depth("0.02", x=[-1, 1], y=[-1, 0]) > 1e-4
    assert 0 < depth("0.02", x=["-0.04", "0.04"]) <= endless
    assert depth("0.02", x=["-0.02", "0.02"]) == 0


def test_a_hook_beside_gamma_c_lies_in_the_other_body_where_its_tip_does(tmp_path):
    """The lower surface of body 2 comes down again beside Gamma_c: no convex outline holds it."""
    line = lambda x: np.interp(x, [-0.2, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2], [0.05, 0.05, 0, 0, 0.05, -0.02, 0.05])
    found = vf.solve(cylinder(tmp_path, "0.05", line=line).changed(gap="0.001")).checks
    assert found.penetration_at == pytest.approx((0.15, -0.02))
    assert 0.015 < found.penetration_outside < 0.03


@pytest.mark.parametrize("c", [1e-3, 1e3])
def test_in_another_unit_of_length_the_depth_is_that_many_times_as_large(c):
    scaled = {"contact": {"interval": [0.7 * c, 1.3 * c], "radius": 0.2 * c}}
    for name in ("body1", "body2"):
        scaled[name] = {axis: [float(end) * c for end in TOO_SHORT[name][axis]] for axis in "xy"}
    scaled["body2"]["prescribed"] = {"top": [0, -0.015 * c]}
    one, other = (vf.solve(vf.Problem.from_dict(data)) for data in (TOO_SHORT, changed(TOO_SHORT, **scaled)))
    assert other.checks.penetration_outside == pytest.approx(c * one.checks.penetration_outside, rel=1e-9)
    assert other.checks.largest_strain == pytest.approx(one.checks.largest_strain, rel=1e-9)
    assert len(crossing(other.warnings)) == len(crossing(one.warnings)) == 1


# --- strains ----------------------------------------------------------------------------------------------------------


def test_the_strain_of_bars_is_pressure_over_modulus():
    found = vf.solve(vf.Problem.from_dict(bars()))
    assert found.checks.largest_strain == pytest.approx(found.contact.pressure[0] / 2, rel=1e-12)
    assert found.checks.penetration_outside is None
    reason = found.to_dict()["checks"]["reason"]
    assert set(reason) == {"penetration_outside", "penetration_at", "cut_length", "cut_depth"}
    assert set(reason.values()) == {"bars meet at one point, which is Gamma_c"}


def test_a_strain_above_5_percent_is_warned_of_with_its_element():
    """An even pressure between rollers: the strain is that of plane strain."""
    for pushed in ("-0.0599", "-0.0601"):
        block = {"shape": "rectangle", "x": [0, 1], "cells": [3, 2], "young": 1, "poisson": 0}
        sides = {"left": [0, "free"]}
        problem = vf.Problem.from_dict(
            {
                "body1": {**block, "y": ["-0.6", 0], "prescribed": {**sides, "bottom": ["free", 0]}},
                "body2": {**block, "y": [0, "0.6"], "prescribed": {**sides, "top": ["free", pushed]}},
                "contact": {"friction": 0},
            }
        )
        found = vf.solve(problem)
        assert found.checks.largest_strain == pytest.approx(-float(pushed) / 1.2)
        words = strained(found.warnings)
        assert len(words) == (found.checks.largest_strain > checks.LARGE_STRAIN)
        assert not words or words[0].startswith("the largest principal strain is 5 % at (")


# --- documents --------------------------------------------------------------------------------------------------------


def test_matrices_and_runs_that_diverge_have_no_checks_and_say_why():
    pair = vf.build(vf.Problem.from_dict(SECTION_6))
    run = vf.run(replace(pair, problem=None))
    diverged = vf.run(pair.changed(friction=0, young=(70000, 7), theta="0.9", neumann_body=2))
    assert diverged.outcome == "diverged"
    for found, why in ((run, "made from matrices"), (diverged, "the run diverged")):
        said = found.to_dict()["checks"]
        assert said["penetration_outside"] is None is said["largest_strain"]
        assert all(why in said["reason"][name] for name in ("penetration_outside", "largest_strain"))


@pytest.mark.parametrize("stiffer", [1, 3, 11])
def test_run_and_solve_say_the_same_of_one_problem(stiffer):
    """Of mirror images the same one, in all units of stress."""
    problem = vf.Problem.from_dict(TOO_SHORT).changed(young=(70000 * stiffer, 20000 * stiffer))
    one, other = (found.to_dict()["checks"] for found in (vf.solve(problem), vf.run(problem)))
    assert one.keys() == other.keys()
    for name in ("penetration_outside", "largest_strain", "penetration_at", "strain_at"):
        assert one[name] == pytest.approx(other[name], rel=1e-6)
    assert one["penetration_at"] == [0.4, 0.0]


def test_runs_and_sweeps_check_nothing_before_they_are_asked(monkeypatch):
    monkeypatch.setattr(checks, "largest_strains", None)
    problem = vf.Problem.from_dict(SECTION_6)
    assert vf.run(problem).converged
    assert vf.solve(problem).contact.force["normal"] > 0
    assert [row["outcome"] for row in vf.sweep(problem, theta=["0.6", "0.7"]).rows] == ["converged"] * 2


def test_of_the_kernel_the_part_that_is_closed_is_looked_at():
    """Nodes that are fine where the bodies touch, and coarse beside it."""
    x, radius = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 1.0, 2.0]), 0.11
    pair = vf.build(S1=np.eye(14), S2=np.eye(14), x=x, law=Nonlocal(radius=radius), friction=0.2)
    said = lambda pressure: pair.interface.law.warnings_after(pair.interface, 0.2, pressure, pressure)
    (everywhere,) = said(np.ones(7))
    assert everywhere.startswith("contact.radius = 0.11 is below the mesh width 1: ")
    assert said(np.array([1.0, 1, 1, 1, 0, 0, 0])) == []
    wide = vf.build(S1=np.eye(14), S2=np.eye(14), x=np.arange(7) / 10, law=Nonlocal(radius=0.15), friction=0.2)
    said = lambda pressure: wide.interface.law.warnings_after(wide.interface, 0.2, pressure, pressure)
    assert said(np.ones(7)) == []
    (few,) = said(np.array([0.0, 0, 1, 1, 0, 0, 0]))
    assert "contact.radius = 0.15 is not small against the length 0.2 of the closed part of Gamma_c" in few
    one = vf.build(S1=np.eye(2), S2=np.eye(2), load2=np.array([0.0, -1]), x=np.zeros(1), law=Nonlocal(radius=1.0))
    assert vf.run(one.at(friction=0.2)).warnings == []  # of one node nothing can be said

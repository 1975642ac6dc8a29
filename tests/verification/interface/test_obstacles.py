"""Obstacles whose face is a line or an arc: closed forms, laws of turning and mirroring, refusals."""

import numpy as np
import pytest
from mesh_writer import rotation, write_curved, write_gmsh22

import verification as vf
from fem1d2d import rectangle
from verification.cli import main

WHEEL = {"centre": [0, 3], "radius": 3, "arc": [240, 300]}
BLOCK = {"shape": "rectangle", "x": [-2, 2], "y": [-2, 0], "cells": [80, 40], "split": "both", "young": 1000}
BLOCK |= {"poisson": "0.3", "prescribed": {"bottom": [0, "0.02"]}}


def pressed(face, block=BLOCK, **contact):
    """A block that is pressed up against an obstacle."""
    obstacle = {"shape": "rigid", "side": "face", **face}
    return vf.Problem.from_dict({"body1": block, "body2": obstacle, "contact": {"surface": ["top", "face"]} | contact})


def test_a_wheel_on_a_block_has_the_pressure_of_hertz():
    """The largest pressure follows from the force, which the bottom brings about; measured: 2.3e-4 of it."""
    found = vf.solve(pressed({"circle": WHEEL}))
    force, modulus = found.contact.force["normal"], 1000 / (1 - 0.3**2)
    assert found.contact.pressure.max() == pytest.approx(np.sqrt(force * modulus / (np.pi * 3)), rel=3e-4)
    half = 2 * np.sqrt(force * 3 / (np.pi * modulus))
    inner = np.abs(found.contact.s - 1.6) <= 0.8 * half
    slope, height = np.polyfit((found.contact.s[inner] - 1.6) ** 2, found.contact.pressure[inner] ** 2, 1)
    assert np.sqrt(-height / slope) == pytest.approx(half, rel=0.02)
    assert found.contact.pressure == pytest.approx(found.contact.pressure[::-1], rel=1e-9)
    assert found.checks.penetration_outside == 0


@pytest.mark.parametrize("face", [
    {"circle": {"centre": [0, 3], "radius": 3}},
    {"circle": {"centre": [0, 3], "radius": 3, "arc": [270, 670]}},
    {"line": [[3 * np.sin(a), 3 - 3 * np.cos(a)] for a in np.linspace(-0.5, 0.5, 41)]},
    {"line": [[3 * np.sin(a), 3 - 3 * np.cos(a)] for a in np.linspace(0.5, -0.5, 41)]},
])  # fmt: skip
def test_a_whole_circle_and_points_on_it_in_either_order_are_the_same_wheel(face):
    """A smooth curve through points 1.4 degrees apart; measured: 1.5e-5 of the pressure."""
    one, other = vf.solve(pressed({"circle": WHEEL})).contact, vf.solve(pressed(face)).contact
    assert other.pressure.max() == pytest.approx(one.pressure.max(), rel=3e-5)
    assert other.force["normal"] == pytest.approx(one.force["normal"], rel=3e-5)


def test_a_level_line_is_the_obstacle_with_an_interval():
    block = BLOCK | {"cells": [16, 8]}
    level = vf.solve(pressed({"line": [[-1, 0], [1, 0]]}, block, friction="0.2", radius="0.5"))
    other = {"body1": block, "body2": {"shape": "rigid", "x": [-1, 1], "y": [0, 1]}}
    drawn = vf.solve(
        vf.Problem.from_dict(other | {"contact": {"interval": [-1, 1], "friction": "0.2", "radius": "0.5"}})
    )
    assert level.contact.pressure == pytest.approx(drawn.contact.pressure, rel=1e-12)
    assert level.contact.shear == pytest.approx(drawn.contact.shear, abs=1e-9 * abs(drawn.contact.shear).max())


@pytest.mark.parametrize("angle", [0.7, np.pi])
def test_an_obstacle_that_is_turned_with_the_body_has_the_same_pressure(angle, tmp_path):
    turn = rotation(angle)
    flat = rectangle((-2.0, 2.0), (-2.0, 0.0), (16, 8))
    faces, found = [[a, a * a / 8] for a in np.linspace(-1, 1, 17)], []
    for i, by in enumerate((np.eye(2), turn)):
        write_gmsh22(tmp_path / f"{i}.msh", flat.points @ by, flat.cells, flat.sides)
        mesh = {"mesh": str(tmp_path / f"{i}.msh"), "young": 1000, "poisson": "0.3"}
        mesh["prescribed"] = {"bottom": (np.array([0.002, 0.02]) @ by).tolist()}
        face = {"line": (np.array(faces) @ by).tolist()}
        found.append(vf.solve(pressed(face, mesh, friction="0.3", radius="0.5")).contact)
    largest = found[0].pressure.max()
    assert found[1].pressure == pytest.approx(found[0].pressure, abs=1e-8 * largest)
    assert found[1].shear == pytest.approx(found[0].shear, abs=1e-8 * largest)
    assert largest > 0


def test_a_body_in_a_bowl_is_held_by_its_corners():
    bowl = {"shape": "rigid", "side": "bowl", "circle": {"centre": [0, 5], "radius": 5, "arc": [240, 300]}}
    above = {"shape": "rectangle", "x": [-1, 1], "y": ["0.102", 1], "cells": [20, 10], "young": 1000, "poisson": "0.3"}
    above["prescribed"] = {"top": [0, "-0.02"]}
    data = {"body1": bowl, "body2": above, "contact": {"surface": ["bowl", "bottom"]}}
    found = vf.solve(vf.Problem.from_dict(data))
    assert np.flatnonzero(found.contact.pressure).tolist() == [0, 20]
    assert found.contact.pressure[0] == pytest.approx(found.contact.pressure[-1], rel=1e-9)
    assert found.checks.penetration_outside == 0
    assert found.plot().axes


def test_a_wedge_that_ends_over_a_block_touches_beside_its_end_only():
    found = vf.solve(pressed({"line": [["-1.5", "0.3"], ["1.0", 0]]}))
    touching = np.flatnonzero(found.contact.pressure)
    assert found.contact.x[touching].min() > 0.8
    assert found.contact.x[touching].max() <= 1.0
    assert found.checks.penetration_outside >= 0
    assert found.plot().axes


@pytest.mark.parametrize("law", ["local", "nonlocal"])
@pytest.mark.parametrize("k", [0, "0.3"])
def test_a_run_against_an_obstacle_ends_where_solve_does(k, law):
    """Without friction T is constant, so that the error falls by 1 - theta in each step."""
    moved = BLOCK | {"cells": [40, 20], "prescribed": {"bottom": ["0.002", "0.02"]}}
    problem = pressed({"circle": WHEEL}, moved, friction=k, law=law, radius="0.4").with_theta("0.7")
    found, run = vf.solve(problem), vf.run(problem).linearise()
    assert run.converged
    largest = found.contact.pressure.max()
    assert run.contact.pressure == pytest.approx(found.contact.pressure, abs=1e-9 * largest)
    assert run.contact.shear == pytest.approx(found.contact.shear, abs=1e-7 * largest)
    assert run.displacements[1] is None
    assert run.displacements[0] == pytest.approx(found.displacements[0], abs=1e-9)
    assert run.linearised.rate == pytest.approx(0.3, abs=1e-9 if k == 0 else 0.05)
    assert run.checks.to_dict()["penetration_outside"] == 0
    assert run.plot("bodies").axes


def test_a_level_obstacle_below_has_the_neumann_problem_too(tmp_path, capsys):
    above = {"shape": "rectangle", "x": [0, 1], "y": [0, 1], "cells": [4, 4], "young": 1000, "poisson": "0.3"}
    above |= {"prescribed": {"top": ["0.002", "-0.01"]}}
    contact = {"interval": [0, 1], "friction": "0.3", "radius": "0.5"}
    data = {"body1": {"shape": "rigid"}, "body2": above, "contact": contact, "iteration": {"neumann_body": 1}}
    problem = vf.Problem.from_dict(data)
    found, run = vf.solve(problem).contact, vf.run(problem).contact
    assert run.pressure == pytest.approx(found.pressure, abs=1e-8 * found.pressure.max())
    assert run.slip == pytest.approx(found.slip, abs=1e-9)
    (tmp_path / "my.toml").write_text(problem.to_toml(), "utf-8")
    assert main(["run", str(tmp_path / "my.toml"), "-o", str(tmp_path / "out")]) == 0
    assert "Obstacle: lower body" in capsys.readouterr().out
    assert not (tmp_path / "out" / "interface.npz").exists()


def test_what_has_no_meaning_for_an_obstacle_is_refused():
    problem = pressed({"circle": WHEEL}, BLOCK | {"cells": [8, 4]})
    run = vf.run(problem)
    with pytest.raises(vf.ProblemError, match=r"iteration\.neumann_body = 1: needed 2: rho, .*, is infinite"):
        vf.run(problem.with_keys({"iteration.neumann_body": 1}))
    with pytest.raises(vf.ProblemError, match=r'iteration\.theta = "auto": needed a number'):
        vf.run(problem.with_keys({"iteration.theta": "auto"}))
    for ask in (vf.measure, vf.compare, vf.advise, vf.certify, vf.march):
        with pytest.raises(vf.ProblemError):
            ask(problem)
    for ask in (vf.measure, vf.compare, vf.advise):
        with pytest.raises(vf.ProblemError, match=r"body2\.shape = \"rigid\": needed an elastic body"):
            ask(run.pair)
    assert vf.run(run.pair).iterations == run.iterations


def test_a_run_against_an_obstacle_that_does_not_converge_names_a_theta_with_which_it_does():
    problem = pressed({"circle": WHEEL}, BLOCK | {"cells": [8, 4]}, friction="0.2", radius="0.5")
    problem = problem.changed(theta="1e-6", max_iterations=5)
    run = vf.run(problem)
    assert (run.outcome, run.remedy.key, run.remedy.exchanged) == ("limit", "iteration.theta", None)
    assert vf.run(problem.changed(theta=run.remedy.value, max_iterations=50)).converged
    assert [next(vf.iterate(given)).residual for given in (problem, run.pair)] == [run.iterates[0].residual] * 2


REFUSED = {
    "two faces": ({"line": [[0, 0], [1, 0]], "circle": WHEEL}, r"body2\.line: needed either line or circle"),
    "no name": ({"line": [[0, 0], [1, 0]], "side": ""}, r"body2\.side: this key is missing"),
    "another name": ({"line": [[0, 0], [1, 0]], "side": "rim"}, r"contact\.surface = .*body2 has the side 'rim' only"),
    "ends too": ({"line": [[0, 0], [1, 0]], "x": [0, 1]}, r"body2\.line: needed either x and y, or line or circle"),
    "one point": ({"line": [[0, 0]]}, r"body2\.line = .*needed a list of two points or more"),
    "a point twice": ({"line": [[0, 0], [0, 0], [1, 0]]}, r"body2\.line = .*points that differ"),
    "no radius": ({"circle": {"centre": [0, 0]}}, r"body2\.circle\.radius: this key is missing"),
    "a negative one": (
        {"circle": {"centre": [0, 0], "radius": -1}},
        r"body2\.circle\.radius = -1: needed a number > 0",
    ),
    "no face": ({}, r'body2\.shape = "rigid": needed line or circle, and side'),
}


@pytest.mark.parametrize("name", REFUSED)
def test_an_obstacle_without_one_named_face_is_refused_by_its_key(name):
    face, message = REFUSED[name]
    with pytest.raises(vf.ProblemError, match=message):
        pressed(face)


def test_a_face_that_the_contact_does_not_name_and_one_of_an_elastic_body_are_refused():
    face = {"shape": "rigid", "side": "face", "line": [[0, 0], [1, 0]]}
    with pytest.raises(
        vf.ProblemError, match=r"contact\.surface: this key is missing: needed it, with 'face' for body2"
    ):
        vf.Problem.from_dict({"body1": BLOCK, "body2": face})
    with pytest.raises(vf.ProblemError, match=r"body1\.line: unknown key"):
        pressed({"circle": WHEEL}, BLOCK | {"line": [[0, 0], [1, 0]]})


@pytest.mark.parametrize(("line", "message"), [
    ([[5, 1], [6, 1]], r"has no part that faces one as a whole edge"),
    ([[-1, 1], [0, 0], [1, 1]], r"faces another part too"),
    ([[-1, "-0.5"], [1, "-0.5"]], r"the bodies overlap"),
])  # fmt: skip
def test_a_face_that_no_edge_meets_once_is_refused(line, message):
    with pytest.raises(vf.ProblemError, match=message):
        vf.solve(pressed({"line": line}))


def test_a_file_with_an_obstacle_is_written_and_read_back_equal():
    for face in ({"circle": WHEEL}, {"line": [[0, "1/3"], [1, 0]]}):
        problem = pressed(face)
        assert vf.Problem.from_dict(problem.to_dict()) == problem
        assert problem.digest != pressed({"line": [[0, 0], [1, 0]]}).digest


def test_bodies_that_overlap_deeply_at_one_end_only_are_refused_with_that_place(tmp_path):
    """The top of the lower one rises from 0.018 below the other to 0.018 in it, 6 % of the height."""
    rising = lambda x: 0.018 * (x - 1)
    lower = {"mesh": write_curved(tmp_path / "low.msh", np.linspace(0, 2, 21), lambda x: 0 * x - 0.3, rising)}
    upper = {"shape": "rectangle", "x": [0, 2], "y": [0, "0.3"], "cells": [20, 3], "prescribed": {"top": [0, "-0.01"]}}
    moduli = {"young": 1000, "poisson": "0.3"}
    data = {"body1": lower | moduli | {"fixed": ["bottom"]}, "body2": upper | moduli, "contact": {"interval": [0, 2]}}
    with pytest.raises(vf.ProblemError, match=r"the bodies overlap: at x = 2 body 1 ends at y = 0\.018"):
        vf.solve(vf.Problem.from_dict(data))

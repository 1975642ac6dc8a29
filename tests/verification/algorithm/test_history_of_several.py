"""Loading histories of more than two bodies: the iteration against the global method, and laws that they share."""

import numpy as np
import pytest

import verification as vf


def stack(*steps, **bodies):
    """Three plates, the upper one of which is pressed down, and then led by steps."""
    data = vf.example("stack").to_dict()
    for name, keys in bodies.items():
        data[name] |= keys
    return vf.Problem.from_dict({**data, "step": list(steps)})


def led(x, y="-0.01", increments=1, **more):
    return {"increments": increments, "body3": {"prescribed": {"top": [x, y]}}, **more}


PATH = (led(0, increments=2), led("0.02", increments=4), led("-0.005", increments=3, body2={"body_force": [200, 0]}))


def test_the_iteration_follows_the_same_history_as_the_global_method():
    problem = stack(*PATH)
    found, twin = vf.march(problem), vf.march(problem, method="monolithic")
    assert found.converged
    assert len(found.increments) == len(twin.increments) == 9
    for mine, other in zip(found.increments, twin.increments, strict=True):
        largest = other.contact.pressure.max()
        assert mine.contact.pressure == pytest.approx(other.contact.pressure, abs=1e-7 * largest)
        assert mine.contact.shear == pytest.approx(other.contact.shear, abs=1e-7 * largest)
        assert mine.contact.slip == pytest.approx(other.contact.slip, abs=1e-9)
    assert max(abs(each.contact.slip).max() for each in twin.increments) > 1e-3


def test_friction_of_several_bodies_remembers_the_path():
    """The same loads at the end, with a way there and back: another state, though each contact is in equilibrium."""
    straight, there_and_back = (vf.march(stack(*path)) for path in ((led(0),), (led(0), led("0.02"), led(0))))
    one, other = (found.increments[-1].contact for found in (straight, there_and_back))
    assert abs(one.shear - other.shear).max() > 0.1 * abs(other.shear).max()
    for contact in (one, other):
        forces = [each["vector"] for each in contact.in_order().forces]
        assert np.subtract(*forces) == pytest.approx([0, 0], abs=1e-6 * abs(np.array(forces)).max())


def test_one_step_in_proportion_ends_where_solve_ends():
    problem = stack(led("0.002"), body3={"prescribed": {"top": ["0.002", "-0.01"]}})
    last, at_once = vf.march(problem).increments[-1].contact, vf.solve(problem).contact
    assert last.pressure == pytest.approx(at_once.pressure, abs=1e-7 * at_once.pressure.max())


def test_every_view_of_a_history_of_several_bodies_is_drawn_over_both_lines():
    found = vf.march(stack(*PATH[:2]))
    for view in ("loop", "states", "shear"):
        figure = found.plot(view)
        assert figure.axes
    label, values, axis = found.driven
    assert label == "displacement of top of body3 along x"
    assert (values[0], values[-1], axis) == (0, 0.02, 0)


def test_steps_name_every_body_and_are_written_as_they_were_read():
    problem = stack(*PATH)
    assert problem.steps[2].loads[2].body_force == (200, 0)
    assert vf.Problem.from_dict(problem.to_dict()) == problem
    assert problem.to_toml().count("[[step]]") == 3
    assert problem.refined(1).steps == problem.steps
    for wrong, key in (({"body4": {}}, r"step\[1\]\.body4"), ({"body2": {"young": 3}}, r"step\[1\]\.body2\.young")):
        with pytest.raises(vf.ProblemError, match=key):
            stack(wrong)


def test_a_figure_over_a_vertical_line_has_the_distance_along_it_on_its_axis():
    plate = {"shape": "rectangle", "y": [0, 1], "cells": [2, 4], "young": 2, "poisson": "0.3"}
    data = {
        "body1": {**plate, "x": [-1, 0], "fixed": ["left"]},
        "body2": {**plate, "x": [0, 1], "prescribed": {"right": ["-0.01", 0]}},
        "contact": {"surface": ["right", "left"], "friction": "0.1", "radius": "0.5"},
        "iteration": {"theta": "0.4"},
        "step": [{"body2": {"prescribed": {"right": ["-0.01", 0]}}}],
    }
    found = vf.march(vf.Problem.from_dict(data))
    low, high = found.plot("states").axes[0].get_xlim()
    assert low < 0
    assert high > 1

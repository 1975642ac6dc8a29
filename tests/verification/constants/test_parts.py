"""Parts of sides, named in the problem file."""

import numpy as np
import pytest
from problem_list import changed

import verification as vf
from verification.interface.assembly import discretise

PRESSED = changed(
    body2={
        "x": [0, "1.2"],
        "parts": {"pressed": {"side": "top", "x": [0, "0.8"]}},
        "prescribed": {"pressed": [0, "-0.015"]},
    }
)


def test_a_part_of_a_side_has_the_edges_between_its_ends():
    """Cells of 0.2: the part of the top up to 0.8 ends at a node, the one up to 0.79 at the node before."""
    for end, last in (("0.8", 0.8), ("0.79", 0.6), ("0.9", 0.8)):
        data = changed(PRESSED, body2={"parts": {"pressed": {"side": "top", "x": ["-1", end]}}})
        body = discretise(vf.Problem.from_dict(data)).body2
        held = body.mesh.points[body.known.held.any(axis=1)]
        assert held[:, 1].tolist() == [0.3] * len(held)
        assert held[:, 0] == pytest.approx(np.arange(0, last + 0.1, 0.2))
        assert len(body.mesh.sides["pressed"]) == len(held) - 1


def test_a_part_that_is_the_whole_side_is_the_side():
    whole = changed(PRESSED, body2={"parts": {"pressed": {"side": "top", "x": [0, "1.2"]}}})
    side = changed(PRESSED, body2={"parts": None, "prescribed": {"top": [0, "-0.015"]}})
    one, other = (vf.solve(vf.Problem.from_dict(data)) for data in (whole, side))
    assert np.array_equal(one.contact.pressure, other.contact.pressure)
    assert one.problem.digest != other.problem.digest


def test_parts_of_upright_sides_and_tractions_on_parts():
    """A traction on the right side between y = 0.1 and 0.3: its total is that of two cells of three."""
    parts = {"upper right": {"side": "right", "y": ["0.1", "0.3"]}}
    data = changed(body2={"cells": [6, 3], "parts": parts, "traction": {"upper right": [2, -3]}})
    with_it, without = (
        discretise(vf.Problem.from_dict(d)).body2 for d in (data, changed(data, body2={"traction": None}))
    )
    load = np.zeros(with_it.mesh.points.shape)
    load.ravel()[with_it.positions] = with_it.load - without.load
    on_top = with_it.known.held.any(axis=1)  # half of the uppermost edge's load acts on a node that is held
    assert load[~on_top].sum(axis=0) == pytest.approx([2 * 0.15, -3 * 0.15])


def test_a_problem_with_parts_is_written_and_read_back_and_knows_its_parts():
    problem = vf.Problem.from_dict(PRESSED)
    again = vf.Problem.from_dict(problem.to_dict())
    assert again == problem
    assert again.digest == problem.digest
    assert problem.changed(young=(1, 2)).body2.parts == problem.body2.parts
    moved = problem.with_keys({"body2.parts.pressed.x": "[0, 0.6]"})
    assert moved.digest != problem.digest


@pytest.mark.parametrize(
    ("parts", "key", "says"),
    [
        ({"pressed": {"side": "roof", "x": [0, 1]}}, "body2.parts.pressed.side", "needed one of"),
        ({"pressed": {"side": "top", "x": [1, 0]}}, "body2.parts.pressed.x", "a < b"),
        ({"pressed": {"side": "top"}}, "body2.parts.pressed.x", "missing"),
        ({"pressed": {"side": "top", "x": [0, 1], "y": [0, 1]}}, "body2.parts.pressed.x", ""),
        ({"pressed": {"side": "top", "x": [0, 1], "z": 1}}, "body2.parts.pressed.z", "unknown"),
        ({"pressed": "top"}, "body2.parts.pressed", "table"),
        ({"top": {"side": "top", "x": [0, 1]}}, "body2.parts.top", "no side has"),
        ({"pressed": {"side": "top", "x": ["0.65", "0.75"]}}, "body2.parts.pressed", "no edge of side 'top'"),
        ({"other": {"side": "top", "x": [0, 1]}}, "body2.prescribed.pressed", "unknown side; known here: left, right"),
    ],
)
def test_bad_parts_are_refused_by_key(parts, key, says):
    with pytest.raises(vf.ProblemError) as caught:
        vf.solve(vf.Problem.from_dict(changed(PRESSED, body2={"parts": parts})))
    assert caught.value.key == key
    assert says in str(caught.value)


def test_a_bar_has_no_parts():
    bars = vf.example("two-bars").to_dict()
    bars["body1"]["parts"] = {"end": {"side": "left", "x": [0, 1]}}
    with pytest.raises(vf.ProblemError, match=r"body1\.parts\.end.*point"):
        vf.Problem.from_dict(bars)

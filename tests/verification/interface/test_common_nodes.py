"""Several contacts of one body: they may share a side or a corner, but no node."""

import numpy as np
import pytest
from stacks import close, plate, stack, touch

import verification as vf

read = vf.Problem.from_dict


def test_two_contacts_of_one_body_have_no_common_node():
    corner = stack(
        body3=plate((1, 2), x=(4, 5), fixed=["right"]) | {"cells": [4, 8]},
        contact=[touch(1, 2), touch(2, 3, surface=["right", "left"])],
    )
    middle = plate((1, 2), "7e4", prescribed={"top": ["0.001", "-0.01"]}) | {"cells": [8, 4]}
    shared = r"contact\[2\]\.surface = .*two contacts share the node of body 2 at \(4, 1\): needed sides, or parts"
    with pytest.raises(vf.ProblemError, match=shared):
        vf.build(read(corner | {"body2": middle}))
    above = {"parts": {"flank": {"side": "right", "y": ["1.25", "1.75"]}}}  # an edge above the corner
    touching = [touch(1, 2), touch(2, 3, surface=["flank", "left"])]
    apart = read(corner | {"body2": middle | above, "contact": touching})
    run, found = vf.run(apart), vf.solve(apart)
    assert run.converged
    assert close(run.contact.pressure, found.contact.pressure)


def test_two_contacts_of_one_side_are_those_of_its_parts():
    """A beam on two supports: its bottom faces each of them with other nodes."""
    feet = {f"body{i}": plate((0, 1), x=x, fixed=["bottom"]) for i, x in ((1, (0, 1)), (3, (3, 4)))}
    beam = plate((1, 2), "7e4", prescribed={"top": ["0.001", "-0.01"]})
    parts = {"west": {"side": "bottom", "x": [0, 1]}, "east": {"side": "bottom", "x": [3, 4]}}
    found = []
    for sides in (("bottom", "bottom"), ("west", "east")):
        contact = [touch(one, 2, surface=["top", side]) for one, side in zip((1, 3), sides, strict=True)]
        problem = read({**feet, "body2": beam | {"parts": parts}, "contact": contact, "iteration": {"theta": "auto"}})
        found += [vf.run(problem).contact, vf.solve(problem).contact]
    for one in found[1:]:
        assert close(one.pressure, found[0].pressure)
    lines = np.array(found[0].interface)
    assert (lines[np.array(found[0].x) <= 1] == 0).all()
    assert (lines[np.array(found[0].x) >= 3] == 1).all()

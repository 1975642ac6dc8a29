"""The loading history of two boxes from mesh files against the global method, and against another code at night."""

import numpy as np
import pytest
from histories import PATH, pressed_and_sheared
from mesh_writer import write_curved
from strategies import AT_NIGHT

import verification as vf

#: Columns of the lower and of the upper box: grids that match, and two that meet only at the ends.
GRIDS = {
    "one grid": (np.linspace(0, 2, 21), np.linspace(0.4, 1.6, 13)),
    "grids that do not match": (
        np.concatenate([np.linspace(0, 0.4, 4), np.linspace(0.4, 1.6, 12)[1:], np.linspace(1.6, 2, 4)[1:]]),
        0.4 + 1.2 * (np.linspace(0, 1, 17) + 0.2 * np.sin(2 * np.pi * np.linspace(0, 1, 17)) / (2 * np.pi)),
    ),
}


def boxes(folder, name):
    """The files of both boxes, and the problem of press, shear to and fro, and lift."""
    line = lambda y: lambda x: np.full_like(x, y)
    files = [
        write_curved(folder / f"{which}.msh", x, line(low), line(high))
        for which, x, (low, high) in zip(("lower", "upper"), GRIDS[name], ((-0.3, 0.0), (0.0, 0.3)), strict=True)
    ]
    meshed = [{"mesh": file} | dict.fromkeys(("shape", "x", "y", "cells")) for file in files]
    data = pressed_and_sheared(body1=meshed[0], body2=meshed[1], iteration={"theta": "0.6"})
    return files, vf.Problem.from_dict(data)


def apart(one, two, *names):
    """The largest difference, relative to the largest value."""
    return max(np.abs(one[n] - two[n]).max() for n in names) / max(np.abs(two[n]).max() for n in names)


def test_meshed_boxes_whose_grids_do_not_match_have_the_history_of_the_global_method(tmp_path):
    _, problem = boxes(tmp_path, "grids that do not match")
    one, two = (vf.march(problem, method=method).fields for method in ("iteration", "monolithic"))
    assert apart(one, two, "pressure", "shear") <= 1e-8
    assert apart(one, two, "slip") <= 1e-8


@pytest.mark.skipif(not AT_NIGHT, reason="another code assembles and solves both bodies: by night")
@pytest.mark.parametrize("name", GRIDS)
def test_another_code_finds_the_same_history(tmp_path, name):
    from foreign_march import march

    files, problem = boxes(tmp_path, name)
    ends = np.array([[0, 0], *([float(v) for v in top] for _, top in PATH.values())])
    counts = [count for count, _ in PATH.values()]
    tops = [a + (b - a) * i / n for a, b, n in zip(ends, ends[1:], counts, strict=False) for i in range(1, n + 1)]
    other = march(files, tops, young=(70000, 20000), poisson=0.3, k=0.2, r=0.2)
    done = vf.march(problem)
    assert done.converged
    assert {state for each in done.increments for state in each.contact.status} == {"stick", "slip", "open"}
    assert apart(done.fields, other, "pressure", "shear") <= 1e-8
    assert apart(done.fields, other, "slip") <= 1e-8

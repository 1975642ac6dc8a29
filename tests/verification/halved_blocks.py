"""Two blocks of regular cells, and what the meshes themselves say of their halved surfaces."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np

import verification as vf


def blocks(*, offset: str = "0", cells=((16, 4), (8, 4)), **changes) -> vf.Problem:
    """A block of length 1 on one of length 2, moved along it; Neumann body 1."""
    lower = {"shape": "rectangle", "x": [-1, 1], "y": [-1, 0], "cells": list(cells[0]), "fixed": ["bottom"]}
    upper = {"shape": "rectangle", "x": [f"{F(offset) - F(1, 2)}", f"{F(offset) + F(1, 2)}"], "y": [0, 1]}
    upper |= {"cells": list(cells[1]), "prescribed": {"top": [0, "-0.01"]}}
    data = {
        "dimension": 2,
        "body1": lower,
        "body2": upper,
        "contact": {"friction": 0},
        "iteration": {"neumann_body": 1},
    }
    for key, values in changes.items():
        data[key] |= values
    for name in ("body1", "body2"):
        data[name] = {"young": 1, "poisson": "0.3"} | data[name]
    return vf.Problem.from_dict(data)


def halved_by_hand(problem: vf.Problem, halvings: int = 1) -> tuple[bool, bool]:
    """Whether the halved surfaces are one grid near its middle node, and mirror each other there: from the meshes."""
    pair = vf.build(problem.refined(halvings))
    slopes = []
    for body in (pair.body1.mesh_body, pair.body2.mesh_body):
        points, cells = body.mesh.points, body.mesh.cells
        on = np.isclose(points[:, 1], 0)
        found = {}
        for cell in cells[on[cells].sum(axis=1) == 2]:
            left, apex = points[cell[on[cell]], 0].min(), points[cell[~on[cell]], 0][0]
            found[round(left, 9)] = np.isclose(apex, left)  # the diagonal runs from the apex to the right end
        slopes.append(found)
    common = slopes[0].keys() & slopes[1].keys()
    return bool(common), all(slopes[0][x] == slopes[1][x] for x in common)

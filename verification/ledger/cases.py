"""Problems to test inequalities on: random ones with loads, and named ones on which a printed bound is false."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from verification.problem.specification import Problem

#: Heights over lengths: a thin layer to a column.
SHAPES = [Fraction(1, 20), Fraction(1, 6), Fraction(1, 3), Fraction(1), Fraction(2)]

CELL = Fraction(1, 5)


def three_digits(value: float) -> Fraction:
    """The number of three significant digits next to a value, exactly.

    Examples
    --------
    >>> three_digits(0.123456)
    Fraction(123, 1000)
    """
    return Fraction(f"{value:.3g}")


def problem(random: np.random.Generator, friction: Any = None, *, matching: bool = True, **iteration: Any) -> Problem:
    """Draw two rectangles, 2 to 9 contact nodes; one may jut out over the other on either side.

    E1/E2 from 1/50 to 50, either role, friction 0, 0.1, .., 1.  The lower body is clamped at its bottom, the top of
    the upper one is pushed and sheared, its sides carry tractions, and in one case of three there is a gap.

    Parameters
    ----------
    random : Generator
    friction : number, optional
        k in place of the one drawn.
    matching : bool
        Whether the grids are one.  Where they are not, the wider body has the Neumann problem: the other one has nodes
        at both ends of Gamma_c.
    **iteration
        Further keys of the table ``iteration``.
    """
    whole = lambda low, high: int(random.integers(low, high + 1))
    count = whole(1, 8)
    wider = whole(0, 1)  # which body juts out
    left, right = whole(0, 2), whole(0, 2)
    ends = {wider: (-left, count + right), 1 - wider: (0, count)}
    young = {0: Fraction(1000), 1: 1000 * three_digits(50 ** random.uniform(-1, 1))}
    bodies: list[dict[str, Any]] = []
    for i in (0, 1):
        x = [CELL * end for end in ends[i]]
        height = (x[1] - x[0]) * SHAPES[random.integers(len(SHAPES))]
        body: dict[str, Any] = {
            "shape": "rectangle",
            "x": x,
            "y": [-height, 0] if i == 0 else [0, height],
            "young": young[i],
        }
        body |= {"cells": [ends[i][1] - ends[i][0], whole(1, 3)], "poisson": ["0", "0.3", "0.45"][random.integers(3)]}
        bodies.append(body)
    bodies[0]["fixed"] = ["bottom"]
    slip, push = Fraction(whole(-20, 20), 1000), -Fraction(whole(1, 50), 1000)
    bodies[1]["prescribed"] = {"top": [slip * height, push * height]}
    bodies[1]["traction"] = {side: [whole(-20, 20), whole(-20, 20)] for side in ("left", "right")}
    drawn = Fraction(whole(0, 10), 10)
    radius = CELL * Fraction(3, 4) * whole(1, 3)
    gap = [0, 0, CELL / 100][random.integers(3)]
    neumann_body = whole(1, 2)
    if not matching:
        for body in bodies:
            body["cells"] = [whole(1, 9), body["cells"][1]]
        radius *= 3  # some Neumann node lies within it
        neumann_body = neumann_body if left == right == 0 else wider + 1
    return Problem.from_dict(
        {
            "body1": bodies[0],
            "body2": bodies[1],
            "contact": {"friction": drawn if friction is None else friction, "radius": radius, "gap": gap},
            "iteration": {"neumann_body": neumann_body, **iteration},
        }
    )


def _clamped_plate(thickness: str) -> Mapping[str, Any]:
    """A thin plate, clamped at one end, under a block: the tangential trace is larger in L2 than in H^1/2."""
    return {
        "body1": {
            "shape": "rectangle",
            "x": [0, 2],
            "y": [f"-{thickness}", 0],
            "cells": [10, 1],
            "young": 1,
            "poisson": 0,
            "fixed": ["left"],
        },
        "body2": {
            "shape": "rectangle",
            "x": ["0.2", 2],
            "y": [0, 1],
            "cells": [9, 2],
            "young": 1,
            "poisson": 0,
            "fixed": ["top"],
        },
        "contact": {"friction": 1, "radius": "0.5", "gap": 1},
    }


#: Problems on which a bound is false as printed, as the problem file reads them.  Loads do not matter: every pair of
#: forces in one piece of T occurs for suitable loads.
NAMED: Mapping[str, Mapping[str, Any]] = {
    **{f"plate of thickness {t} clamped at one end": _clamped_plate(t) for t in ("0.05", "0.02", "0.01")},
    # the bound (5.30) grows as k for m -> 0, its left side as k^2
    "layer of a ten-thousandth on a block": {
        "body1": {
            "shape": "rectangle",
            "x": [0, 1],
            "y": ["-0.125", 0],
            "cells": [2, 2],
            "young": 1,
            "poisson": 0,
            "fixed": ["bottom"],
        },
        "body2": {
            "shape": "rectangle",
            "x": [0, 1],
            "y": [0, "0.0001"],
            "cells": [2, 1],
            "young": 1,
            "poisson": 0,
            "prescribed": {"top": [-1, 0]},
        },
        "contact": {"friction": 1, "radius": "0.5", "gap": 1},
    },
}

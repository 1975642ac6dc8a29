"""The default contact step against rebuilding body 1 in cvxpy at every step, about 2500 nodes, both sides in turn.

python benchmarks/bench_step.py
"""

from __future__ import annotations

import time
from itertools import islice
from statistics import median

import numpy as np
from afternoon import contact_step

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap
from verification.interface.assembly import build

STEPS, ROUNDS = 15, 3


def problem() -> vf.Problem:
    """Section 6 with the roles of Section 3 (the contact body is body 1), about 2500 nodes, 61 of them on Gamma_c."""
    rectangle = {"shape": "rectangle", "poisson": 0.3}
    return vf.Problem.from_dict(
        {
            "body1": {**rectangle, "x": [0, 2], "y": [-0.3, 0], "cells": [100, 15], "young": 2.0e4,
                      "fixed": ["bottom"]},
            "body2": {
                **rectangle, "x": [0.4, 1.6], "y": [0, 0.3], "cells": [60, 15], "young": 7.0e4,
                "prescribed": {"top": [0, -0.015]},
            },
            "contact": {"friction": 0.2, "radius": 0.1},
            "iteration": {"theta": 0.6, "neumann_body": 2},
        }
    )  # fmt: skip


def main() -> None:
    pair = build(problem())
    T = FixedPointMap(pair)
    g = np.zeros(len(pair.neumann.load))
    T(g)  # the first step compiles the program
    states = list(islice(vf.iterate(pair), STEPS))
    ours, theirs, apart = [], [], 0.0
    for _ in range(ROUNDS):
        for state in states:
            begin = time.perf_counter()
            _, solution = T(state.g)
            middle = time.perf_counter()
            force = contact_step(pair, state.displacement, T.bound(state.g))
            end = time.perf_counter()
            ours.append(middle - begin)
            theirs.append(end - middle)
            apart = max(apart, float(np.abs(force - solution.force).max() / np.abs(solution.force).max()))
    nodes = len(pair.body1.body.mesh.points) + len(pair.body2.body.mesh.points)
    print(
        f"{nodes} nodes, {pair.contact.grid.n} on Gamma_c, {len(ours)} steps each in turn (steps I and II on our side)"
    )
    print(f"default step            {1e3 * median(ours):9.3f} ms median")
    print(f"body 1 rebuilt in cvxpy {1e3 * median(theirs):9.3f} ms median")
    ratio = median(a / b for a, b in zip(ours, theirs, strict=True))
    print(f"ratio                   {ratio:9.5f} median of pairs, wanted <= 0.1")
    print(f"largest difference of the forces {apart:.1e} (relative; the program's tolerance)")


if __name__ == "__main__":
    main()

"""One step of the iteration against the dense solves that it cannot do without, and against a rebuilt program.

The bare solves are one with the Cholesky factor of S2, one product with S1 and one solve with the factor of the block
of S1 that moves at the solution.  Both sides run in turn in one process, on one BLAS thread, and CPU time is measured.

The other table: the default contact step against rebuilding body 1 in cvxpy at every step, about 2500 nodes.

python benchmarks/bench_step.py [--largest NODES]
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from statistics import median

import numpy as np
from afternoon import contact_step
from scipy.linalg import cho_factor, cho_solve

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap
from verification.interface.assembly import build
from verification.interface.pair import ContactPair
from verification.threads import one_thread

STEPS, ROUNDS = 15, 3

#: Interface nodes with the ratio wanted at most; steps in a batch, and batches of each side in turn.
SIZES = {61: 5.0, 121: math.nan, 241: 2.0, 481: 1.5}
BATCH, BATCHES = 64, 25


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


def longer(nodes: int) -> vf.Problem:
    """The same bodies with so many nodes on Gamma_c."""
    base, per = problem(), (nodes - 1) // 12
    return replace(
        base, body1=replace(base.body1, cells=(20 * per, 15)), body2=replace(base.body2, cells=(12 * per, 15))
    )


def sides(pair: ContactPair) -> tuple[Callable[[], object], Callable[[], object]]:
    """One step of the iteration at the solution, and the bare solves there."""
    last = vf.run(pair).last
    moves = np.concatenate([last.contact.pattern.sliding != 0, ~last.contact.pattern.touching])
    rows = np.flatnonzero(moves)
    S1, S2, g = pair.contact.stiffness, cho_factor(pair.neumann.stiffness), np.array(last.g)
    block, right = cho_factor(S1[np.ix_(rows, rows)]), g[rows]
    steps = vf.iterate(pair, start=g)

    def bare() -> None:
        cho_solve(S2, g, check_finite=False)
        S1 @ g
        cho_solve(block, right, check_finite=False)

    return lambda: next(steps), bare


def seconds(once: Callable[[], object]) -> float:
    """CPU time of one call, over a batch."""
    begin = time.process_time()
    for _ in range(BATCH):
        once()
    return (time.process_time() - begin) / BATCH


def against_the_solves(largest: int) -> None:
    print("nodes on Gamma_c   step [us]   bare [us]   ratio   wanted   growth of the step, of the bare solves")
    before: tuple[int, float, float] | None = None
    for nodes, wanted in SIZES.items():
        if nodes > largest:
            break
        step, bare = sides(build(longer(nodes)))
        with one_thread():
            seconds(step), seconds(bare)
            pairs = [(seconds(step), seconds(bare)) for _ in range(BATCHES)]
        ours, theirs = (median(side) for side in zip(*pairs, strict=True))
        line = f"{nodes:16d}   {1e6 * ours:9.1f}   {1e6 * theirs:9.1f}   {median(a / b for a, b in pairs):5.2f}"
        line += "         " if math.isnan(wanted) else f"   <= {wanted:3.1f}"
        if before is not None:
            ratio = math.log(nodes / before[0])
            line += f"   n^{math.log(ours / before[1]) / ratio:4.2f}, n^{math.log(theirs / before[2]) / ratio:4.2f}"
        print(line, flush=True)
        before = nodes, ours, theirs


def against_the_program() -> None:
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
            force = contact_step(pair, state.displacement, pair.bound(state.g))
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


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--largest", type=int, default=max(SIZES), help="stop beyond so many nodes on Gamma_c")
    against_the_solves(parser.parse_args().largest)
    print()
    against_the_program()


if __name__ == "__main__":
    main()

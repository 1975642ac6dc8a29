"""One step of the iteration beside its bare dense solves, and beside a rebuilt program.

The bare solves are one with the Cholesky factor of S2, one product with S1 and one solve with the factor of the block
of S1 that moves at the solution, by the usual routines of scipy and numpy.

The other comparison: the default contact step beside rebuilding the program of body 1 in cvxpy at every step.

python benchmarks/bench_step.py [--full] [--largest NODES]
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice

import numpy as np
from afternoon import contact_step
from models import longer
from recording import Record, Row, options, report, row
from scipy.linalg import cho_factor, cho_solve
from timing import in_turn, timed

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap
from verification.interface.pair import ContactPair, pair_from

#: Interface nodes; more with --full.
SIZES, MORE = (61, 121, 241, 481), (961,)

#: Steps timed as one, and how often in turn.
BATCH, BATCHES = 64, 25

#: Steps from the start of the iteration that the program is rebuilt for.
STEPS = {61: 15, 121: 9, 241: 5}


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


def against_the_program(nodes: int, steps: int) -> Row:
    """Steps from the start of the iteration, by T and by the rebuilt program."""
    pair = pair_from(longer(nodes))
    T = FixedPointMap(pair)
    T(np.zeros(len(pair.neumann.load)))  # the first step compiles the program
    pairs, apart = [], 0.0
    for state in islice(vf.iterate(pair), steps):
        ours, (_, solution) = timed(lambda state=state: T(state.g))
        other, force = timed(lambda state=state: contact_step(pair, state.displacement, pair.bound(state.g)))
        pairs.append((ours, other))
        apart = max(apart, float(np.abs(force - solution.force).max() / np.abs(solution.force).max()))
    return row(nodes, pairs, apart)


def main() -> None:
    chosen = options(__doc__).parse_args()
    sizes = [nodes for nodes in SIZES + MORE * chosen.full if nodes <= chosen.largest]
    rows = []
    for nodes in sizes:
        ours, bare = sides(pair_from(longer(nodes)))
        rows.append(row(nodes, in_turn(ours, bare, rounds=BATCHES, calls=BATCH)))
    record = Record(
        name="step",
        place=1,
        title="One step of the iteration",
        ours="one step at the solution",
        other="its two dense solves and its product alone, by scipy's Cholesky factors and numpy",
        peer="bare solves",
        size="contact nodes",
        rows=tuple(rows),
        since=121,
        wanted="a ratio of at most 5 at 61 nodes, 2 at 241 and 1.5 at 481",
    )
    report(record, chosen.record)
    record = Record(
        name="step_rebuilt",
        place=2,
        title="One step beside a rebuilt program",
        ours="one step from the start of the iteration",
        other="the contact problem of body 1 written in cvxpy and handed to Clarabel, anew at every step",
        peer="rebuilt in cvxpy",
        size="contact nodes",
        rows=tuple(against_the_program(nodes, STEPS[nodes]) for nodes in sizes if nodes in STEPS),
        apart="largest difference of the forces, over the largest force",
        wanted="a ratio of at most 0.1",
    )
    report(record, chosen.record)


if __name__ == "__main__":
    main()

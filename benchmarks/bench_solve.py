"""The global method, assembly included, beside the factorisations in it.

python benchmarks/bench_solve.py [--full] [--largest UNKNOWNS]
"""

from __future__ import annotations

from models import scaled
from recording import Record, options, report, row
from timing import in_turn

import verification as vf
from fem1d2d import solver
from verification.interface.assembly import discretise

#: The cells of the benchmark problem are scaled by these; more with --full.
FACTORS, MORE = (0.5, 1.0, 2.0, 3.0, 4.56), (7.0, 10.0)


def main() -> None:
    chosen = options(__doc__).parse_args()
    rows = []
    for factor in FACTORS + MORE * chosen.full:
        problem = scaled(factor)
        bodies = discretise(problem)
        unknowns = sum(len(body.positions) for body in bodies.elastic)
        if unknowns > chosen.largest:
            break
        rounds = 9 if factor <= 1 else 3
        ours = lambda problem=problem: vf.solve(problem)
        bare = lambda bodies=bodies: [solver(body.stiffness) for body in bodies.elastic]
        rows.append(row(unknowns, in_turn(ours, bare, rounds=rounds)))
    record = Record(
        name="solve",
        place=5,
        title="Both bodies at once",
        ours="the global method, from the problem to the solution, assembly included",
        other="the sparse factorisations of the two stiffness matrices alone, which the method needs too",
        peer="factorisations",
        size="unknowns",
        rows=tuple(rows),
        since=4_000,
        wanted="at most 5 times the factorisations, growth below n^1.3",
    )
    report(record, chosen.record)


if __name__ == "__main__":
    main()

"""The global method, assembly included, beside the factorisations in it and beside an active set with scikit-fem.

python benchmarks/bench_solve.py [--full] [--largest UNKNOWNS]
"""

from __future__ import annotations

import numpy as np
from models import scaled
from recording import Record, options, report, row
from timing import in_turn

import verification as vf
from fem1d2d import solver
from fem1d2d.mesh import Floats
from verification.interface.assembly import TwoBodies, discretise

try:
    import active_set
except ModuleNotFoundError as missing:  # scikit-fem comes with the extras for tests and for the site
    if missing.name != "skfem":
        raise
    active_set = None

#: The cells of the benchmark problem are scaled by these; more with --full.
FACTORS, MORE = (0.5, 1.0, 2.0, 3.0, 4.56), (7.0, 10.0)

#: Up to so many unknowns the active set is measured: beyond it takes minutes.
LONGEST = 105_000


def normal_forces(bodies: TwoBodies) -> Floats:
    """Normal forces on Gamma_c by the global method."""
    return vf.solve(bodies).force[bodies.interface.contact.t :]


def main() -> None:
    chosen = options(__doc__).parse_args()
    rows, beside = [], []
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
        if active_set is not None and unknowns <= LONGEST:
            other = lambda bodies=bodies: active_set.forces(bodies)
            wanted = active_set.forces(bodies)
            apart = float(np.abs(normal_forces(bodies) - wanted).max() / wanted.max())
            beside.append(row(unknowns, in_turn(ours, other, rounds=rounds), apart))
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
    if active_set is None:
        print("scikit-fem is not installed: the active set is left out")
        return
    record = Record(
        name="solve_active_set",
        place=5,
        title="Both bodies at once: an active set with scikit-fem",
        ours="the global method, from the problem to the solution, assembly included",
        other="a primal-dual active set on both stiffness matrices, assembled by scikit-fem on the same meshes, which"
        " are made before; each step factorises the matrix once, with the same library and order as ours",
        peer="active set",
        size="unknowns",
        rows=tuple(beside),
        since=4_000,
        apart="largest difference of the normal forces, relative to the largest force",
    )
    report(record, chosen.record)


if __name__ == "__main__":
    main()

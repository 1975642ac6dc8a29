"""Other programs for the same tasks, side by side with ours: scikit-fem, SCS, Clarabel, scipy's eigensolver.

python benchmarks/bench_peers.py [--full] [--largest UNKNOWNS]
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np
from bench_lmi import program_of
from models import of_section_6, scaled
from recording import Record, options, report, row
from scipy.sparse.linalg import eigsh
from timing import in_turn

import verification as vf
from fem1d2d.mesh import Floats
from verification.constants.measuring import constants_of
from verification.interface.assembly import TwoBodies, discretise
from verification.interface.body import Body
from verification.semidefinite import interior_point, model

try:
    import active_set
except ModuleNotFoundError as missing:  # scikit-fem comes with the extras for tests and for the site
    if missing.name != "skfem":
        raise
    active_set = None

#: The cells of the benchmark problem are scaled by these, up to 99,280 unknowns, for the active set.
SCALES = (0.5, 1.0, 2.0, 3.0, 4.56)

#: The same for the eigensolver, and with --full.
OF_BODIES, MORE = (0.5, 1.0, 2.0), (3.0, 4.56)

#: Contact nodes of the programs, and rounds.
SIZES = {7: 9, 13: 9, 25: 9, 49: 5, 97: 3}

#: The conic solvers of cvxpy, the names of their records, their options and what these mean, and the contact nodes up
#: to which each is asked; the last with --full.
SOLVERS = {
    "SCS": ("bound_program", {"solver": "SCS", "eps": 1e-4, "max_iters": 20_000}, "tolerance 1e-4", 25, 49),
    "Clarabel": ("bound_program_clarabel", {"solver": "CLARABEL"}, "default settings", 13, 25),
}


def normal_forces(bodies: TwoBodies) -> Floats:
    """Normal forces on Gamma_c by the global method."""
    return vf.solve(bodies).force[bodies.interface.contact.t :]


def solutions(chosen: argparse.Namespace) -> None:
    """The global method beside a primal-dual active set."""
    if active_set is None:
        print("scikit-fem is not installed: the active set is left out")
        return
    rows = []
    for factor in SCALES:
        problem = scaled(factor)
        bodies = discretise(problem)
        unknowns = sum(len(body.positions) for body in bodies.elastic)
        if unknowns > chosen.largest:
            break
        wanted = active_set.forces(bodies)
        apart = float(np.abs(normal_forces(bodies) - wanted).max() / wanted.max())
        pairs = in_turn(partial(vf.solve, problem), partial(active_set.forces, bodies), rounds=9 if factor <= 1 else 3)
        rows.append(row(unknowns, pairs, apart))
    record = Record(
        name="solve_active_set",
        place=5,
        title="Both bodies at once: an active set with scikit-fem",
        ours="the global method, from the problem to the solution, assembly included",
        other="a primal-dual active set on both stiffness matrices, assembled by scikit-fem on the same meshes, which"
        " are made before; each step factorises the matrix once, with the same library and order as ours",
        peer="active set",
        size="unknowns",
        rows=tuple(rows),
        since=4_000,
        apart="largest difference of the normal forces, relative to the largest force",
    )
    report(record, chosen.record)


def programs(chosen: argparse.Namespace) -> None:
    """The interior-point method beside each conic solver."""
    made = {nodes: program_of(*of_section_6(nodes)) for nodes in SIZES if nodes <= chosen.largest}
    for name, (record_name, given, meant, most, most_full) in SOLVERS.items():
        rows = []
        for nodes, program in made.items():
            ours, other = partial(interior_point.solve, program), partial(model.solve, program, **given)
            asked = nodes <= (most_full if chosen.full else most)
            apart = abs(ours().s - other().s) if asked else None  # a first round too
            assert apart is None or apart < 1e-3
            rounds = SIZES[nodes] if not asked else 3 if nodes <= most else 1
            rows.append(row(nodes, in_turn(ours, other if asked else None, rounds=rounds, warm=not asked), apart))
        record = Record(
            name=record_name,
            place=6,
            title=f"One program of the semidefinite bound: {name}",
            ours="our interior-point method",
            other=f"the same program by cvxpy and {name}, {meant}",
            peer=f"cvxpy with {name}",
            size="contact nodes",
            rows=tuple(rows),
            apart="difference of q^2, the square of the factor",
            wanted="less than 0.1 s at 25 nodes and less than 3 s at 97",
        )
        report(record, chosen.record)


def by_scipy(body: Body) -> tuple[float, float]:
    """m and M of a body by ARPACK, which factorises what it inverts."""
    ends = ({"sigma": 0.0, "which": "LM"}, {"which": "LA"})
    m, M = (float(eigsh(body.stiffness, k=1, M=body.gram_matrix, return_eigenvectors=False, **end)[0]) for end in ends)
    return m, M


def eigenvalues(chosen: argparse.Namespace) -> None:
    """m and M of body 1 beside scipy's eigensolver."""
    rows = []
    for factor in OF_BODIES + MORE * chosen.full:
        problem = scaled(factor)
        fresh = lambda problem=problem: discretise(problem).elastic[0]  # a body keeps its factorisations
        body = fresh()
        if len(body.positions) > chosen.largest:
            break
        own, theirs = constants_of(body), by_scipy(body)
        apart = max(abs(a.value / b - 1) for a, b in zip((own.m, own.M), theirs, strict=True))
        bodies = iter([fresh() for _ in range(4)])
        pairs = in_turn(lambda bodies=bodies: constants_of(next(bodies)), partial(by_scipy, body), rounds=3)
        rows.append(row(len(body.positions), pairs, apart))
    record = Record(
        name="eigenvalues",
        place=4,
        title="m and M of a body: scipy's eigensolver",
        ours="the extremal eigenvalues of the stiffness matrix against the norm, with the Schur complement of the norm",
        other="`scipy.sparse.linalg.eigsh` (ARPACK) on the same matrices, inverted at 0 for m",
        peer="ARPACK",
        size="unknowns",
        rows=tuple(rows),
        apart="largest relative difference of m and M",
    )
    report(record, chosen.record)


def main() -> None:
    chosen = options(__doc__).parse_args()
    eigenvalues(chosen)
    solutions(chosen)
    programs(chosen)


if __name__ == "__main__":
    main()

"""The global method at about 2500 nodes, assembly included, and the share of its factorisations.

python benchmarks/bench_solve.py
"""

from __future__ import annotations

import time
from statistics import median

from bench_step import problem

import verification as vf
from fem1d2d import solver
from verification.interface.assembly import discretise

ROUNDS = 9


def main() -> None:
    vf.solve(problem())  # imports and warm-up
    whole, factorisations = [], []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        solution = vf.solve(problem())
        middle = time.perf_counter()
        for body in solution.bodies.elastic:
            solver(body.stiffness)  # the same factorisations once more, timed alone
        whole.append(middle - begin)
        factorisations.append(time.perf_counter() - middle)
    bodies = discretise(problem())
    nodes = sum(len(body.mesh.points) for body in bodies.elastic)
    print(f"{nodes} nodes, {bodies.interface.contact.n} on Gamma_c, {solution.linear_solves} linear systems on Gamma_c")
    print(f"whole solve        {median(whole):7.3f} s median of {ROUNDS}, wanted <= 0.5")
    print(f"in factorisations  {median(f / w for f, w in zip(factorisations, whole, strict=True)):7.3f} of it")


if __name__ == "__main__":
    main()

"""Set-up (assembly, factorisations, Schur complements, all constants) at 2500 nodes, and its growth.

python benchmarks/bench_setup.py [--largest UNKNOWNS]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from statistics import median

from bench_step import problem

import verification as vf
from verification.interface.assembly import build


def scaled(factor: float) -> vf.Problem:
    """The benchmark problem with its cells scaled, keeping the grids matching."""
    base = problem()
    rows = max(1, round(15 * factor))
    wide = lambda body, per: replace(body, cells=(per * max(1, round(20 * factor)), rows))
    return replace(base, body1=wide(base.body1, 5), body2=wide(base.body2, 3))


def once(p: vf.Problem) -> tuple[float, float, int, int]:
    """Seconds for the bodies and for the constants, unknowns, interface nodes."""
    begin = time.perf_counter()
    pair = build(p)
    middle = time.perf_counter()
    vf.measure(pair)
    end = time.perf_counter()
    return middle - begin, end - middle, len(pair.body1.body.free) + len(pair.body2.body.free), pair.contact.grid.n


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--largest", type=int, default=100_000, help="stop beyond so many unknowns")
    largest = parser.parse_args().largest
    once(scaled(1.0))  # imports and warm-up
    print("unknowns  interface   bodies  constants    total [s], median")
    for factor, rounds in ((0.5, 7), (1.0, 7), (2.0, 3), (3.0, 2), (4.5, 1)):
        runs = [once(scaled(factor)) for _ in range(rounds)]
        bodies, constants = median(r[0] for r in runs), median(r[1] for r in runs)
        unknowns, interface = runs[0][2:]
        print(f"{unknowns:8d}  {interface:9d}  {bodies:7.3f}  {constants:9.3f}  {bodies + constants:7.3f}", flush=True)
        if unknowns >= largest:
            break


if __name__ == "__main__":
    main()

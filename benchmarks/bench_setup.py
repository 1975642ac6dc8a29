"""Set-up (assembly, factorisations, Schur complements, all constants) at growing sizes, beside set-up by dense lifts.

python benchmarks/bench_setup.py [--largest UNKNOWNS] [--lifts UNKNOWNS]

Each size and path has a process of its own, because the peak of the memory belongs to the process.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from multiprocessing import get_context

import numpy as np
import scipy.sparse as sp
from bench_step import problem

import verification as vf
from fem1d2d import Condensation
from verification.interface import body
from verification.interface.assembly import build

#: Cells of the benchmark problem are scaled by these: 4,860 to 1,001,000 unknowns.
FACTORS = (1.0, 2.0, 3.0, 4.56, 7.0, 10.0, 14.43)

#: The growth is fitted to the sizes from here on: below, what does not grow counts.
FROM = 19_000

#: Constants that both paths must share.
NAMES = ("m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "rho_max", "rho_min", "rho_normal", "C_s_energy", "C_t1", "C_t2")


class ByLifts(Condensation):
    """Every interface matrix from the dense lift, one inner solve for each of its columns."""

    @cached_property
    def schur(self) -> np.ndarray:
        columns = self.matrix[:, self.interface]
        schur = columns[self.interface] + columns[self.inside].T @ self.lift
        return (schur + schur.T) / 2

    def on_lifts(self, form: sp.csc_array) -> np.ndarray:
        fields = np.zeros((form.shape[0], len(self.interface)))
        fields[self.interface] = np.eye(len(self.interface))
        fields[self.inside] = self.lift
        product = fields.T @ (form @ fields)
        return (product + product.T) / 2

    def condense(self, load: np.ndarray) -> np.ndarray:
        return load[self.interface] + self.lift.T @ load[self.inside]


def scaled(factor: float) -> vf.Problem:
    """The benchmark problem with its cells scaled, keeping the grids matching."""
    base = problem()
    rows = max(1, round(15 * factor))
    wide = lambda body, per: replace(body, cells=(per * max(1, round(20 * factor)), rows))
    return replace(base, body1=wide(base.body1, 5), body2=wide(base.body2, 3))


def once(factor: float, by_lifts: bool) -> tuple[int, int, float, float, float, dict[str, float]]:
    """Unknowns, interface nodes, CPU seconds for bodies and constants, peak in MB, and the constants."""
    if by_lifts:
        body.Condensation = ByLifts  # type: ignore[misc]
    p = scaled(factor)
    begin = time.process_time()
    pair = build(p)
    middle = time.process_time()
    measured = vf.measure(pair)
    end = time.process_time()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    unknowns = sum(len(b.free) for b in pair.on_meshes().elastic)
    values = {name: getattr(measured, name).value for name in NAMES}
    return unknowns, pair.contact.grid.n, middle - begin, end - middle, peak, values


def alone(function: Callable[..., tuple], *arguments: object) -> tuple:
    """What a function returns, from a new process."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, arguments)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--largest", type=int, default=105_000, help="stop beyond so many unknowns")
    parser.add_argument("--lifts", type=int, default=105_000, help="dense lifts up to so many unknowns")
    options = parser.parse_args()
    print("          inter-   bodies  constants    total    peak   by lifts    peak  largest")
    print("unknowns    face  [CPU s]    [CPU s]  [CPU s]    [MB]    [CPU s]    [MB]  difference")
    sizes, totals = [], []
    for factor in FACTORS:
        expected = 4806 * factor**2
        if expected > options.largest:
            break
        unknowns, interface, bodies, constants, peak, found = alone(once, factor, False)
        line = f"{unknowns:8d}  {interface:6d}  {bodies:7.2f}  {constants:9.2f}  {bodies + constants:7.2f}  {peak:6.0f}"
        if expected <= options.lifts:
            _, _, *seconds, memory, reference = alone(once, factor, True)
            apart = max(abs(found[name] / value - 1) for name, value in reference.items())
            line += f"  {sum(seconds):9.2f}  {memory:6.0f}  {apart:.0e}"
        print(line, flush=True)
        if unknowns >= FROM:
            sizes.append(unknowns)
            totals.append(bodies + constants)
    if len(sizes) > 1:
        exponent = np.polyfit(np.log(sizes), np.log(totals), 1)[0]
        print(f"total CPU grows like unknowns^{exponent:.2f} from {sizes[0]} unknowns on, wanted < 1.3")


if __name__ == "__main__":
    main()

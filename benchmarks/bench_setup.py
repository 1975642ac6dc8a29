"""Set-up (assembly, factorisations, Schur complements, all constants) at growing sizes, beside set-up by dense lifts.

And beside the factorisations of the stiffness matrices alone, which are the limit.

python benchmarks/bench_setup.py [--full] [--largest UNKNOWNS] [--lifts UNKNOWNS]

Each size and path has a process of its own, because the peak of the memory belongs to the process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from multiprocessing import get_context

import numpy as np
import scipy.sparse as sp
from models import scaled
from recording import Record, options, report, row
from timing import peak, timed

import verification as vf
from fem1d2d import Condensation, solver
from verification.interface import body
from verification.interface.pair import pair_from

#: Cells of the benchmark problem are scaled by these: 4,860 to 99,280 unknowns, and with --full to 1,001,000.
FACTORS, MORE = (1.0, 2.0, 3.0, 4.56), (7.0, 10.0, 14.43)

ROUNDS = 3

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


def once(factor: float, by_lifts: bool) -> tuple[int, float, float, dict[str, float], float]:
    """Unknowns, CPU seconds, peak in MB, the constants, and CPU seconds of the bare factorisations."""
    if by_lifts:
        body.Condensation = ByLifts  # type: ignore[misc]
    p = scaled(factor)

    def constants() -> tuple[vf.ContactPair, vf.Measured]:
        pair = pair_from(p)
        return pair, vf.measure(pair)

    seconds, (pair, measured) = timed(constants)
    bodies, memory = pair.on_meshes().elastic, peak()
    bare, _ = timed(lambda: [solver(b.stiffness) for b in bodies])
    values = {name: getattr(measured, name).value for name in NAMES}
    return sum(len(b.positions) for b in bodies), seconds, memory, values, bare


def alone(function: Callable[..., tuple], *arguments: object) -> tuple:
    """What a function returns, from a new process."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, arguments)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--lifts", type=int, default=105_000, help="dense lifts up to so many unknowns")
    chosen = parser.parse_args()
    times, peaks, bares = [], [], []
    for factor in FACTORS + MORE * chosen.full:
        expected = 4860 * factor**2
        if expected > chosen.largest:
            break
        rounds = ROUNDS if factor in FACTORS else 1  # the long ones once
        seconds, memory, beside, apart = [], [], [], None
        for _ in range(rounds):
            unknowns, ours, our_peak, found, bare = alone(once, factor, False)
            other, other_peak = None, None
            if expected <= chosen.lifts:
                _, other, other_peak, reference, _ = alone(once, factor, True)
                apart = max(abs(found[name] / value - 1) for name, value in reference.items())
            seconds.append((ours, other))
            memory.append((our_peak, other_peak))
            beside.append((ours, bare))
        times.append(row(unknowns, seconds, apart))
        peaks.append(row(unknowns, memory))
        bares.append(row(unknowns, beside))
    sides = {
        "ours": "assembly, Schur complements read off the sparse factors, all constants",
        "other": "the same with one inner solve for each interface unknown (dense lifts)",
        "peer": "dense lifts",
        "size": "unknowns",
        "since": FROM,
    }
    record = Record(
        name="setup",
        place=3,
        title="Set-up",
        rows=tuple(times),
        apart="largest relative difference of the constants",
        wanted="growth below n^1.3",
        **sides,
    )
    report(record, chosen.record)
    memory = Record(
        name="setup_memory",
        place=4,
        title="Set-up: memory",
        rows=tuple(peaks),
        quantity="peak memory",
        unit="MB",
        **sides,
    )
    report(memory, chosen.record)
    limit = Record(
        name="setup_limit",
        place=3,
        title="Set-up: its limit",
        ours=sides["ours"],
        other="the sparse factorisations of the two stiffness matrices alone, without which there is no set-up",
        peer="factorisations",
        size="unknowns",
        rows=tuple(bares),
        since=FROM,
    )
    report(limit, chosen.record)


if __name__ == "__main__":
    main()

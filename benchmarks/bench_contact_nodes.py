"""A run on a long Gamma_c, from the problem to its end: time and memory, up to what fits in ten minutes.

python benchmarks/bench_contact_nodes.py [--full] [--largest NODES]

The commands end at 2,000 contact nodes.  Here this limit is lifted, to see how far a run could go.  Each size has a
process of its own, because the peak of the memory belongs to the process.
"""

from __future__ import annotations

from bench_setup import alone
from models import problem
from recording import Record, options, report, row
from scipy.linalg import cho_factor
from timing import peak, timed

import verification as vf
from verification.interface import assembly
from verification.interface.pair import pair_from

#: Contact nodes, a multiple of 12 and one; more with --full.
SIZES, MORE = (241, 481, 961), (1993, 3001, 3997)


def once(nodes: int) -> tuple[float, float, float]:
    """CPU seconds of set-up and run, their peak in MB, and CPU seconds of the factors of both Schur complements."""
    assembly.MOST_CONTACT_NODES = nodes
    per = (nodes - 1) // 12
    wide = problem().changed(cells=((20 * per, 12), (12 * per, 12)))

    def whole() -> vf.Run:
        run = vf.run(pair_from(wide))
        assert run.converged
        return run

    seconds, run = timed(whole)
    memory = peak()
    bare, _ = timed(lambda: [cho_factor(side.schur) for side in (run.pair.contact, run.pair.neumann)])
    return seconds, memory, bare


def main() -> None:
    chosen = options(__doc__).parse_args()
    times, peaks = [], []
    for nodes in [nodes for nodes in SIZES + MORE * chosen.full if nodes <= chosen.largest]:
        seconds, memory, bare = alone(once, nodes)
        times.append(row(nodes, [(seconds, bare)]))
        peaks.append(row(nodes, [(memory, 16 * (2 * nodes) ** 2 / 1e6)]))
    sides = {
        "size": "contact nodes",
        "ours": "bodies of 12 rows of cells, their Schur complements, and a run to its end",
    }
    record = Record(
        name="contact_nodes",
        place=3,
        title="A run with many contact nodes",
        other="the Cholesky factors of both Schur complements, by scipy",
        peer="dense factors",
        rows=tuple(times),
        since=961,
        **sides,
    )
    report(record, chosen.record)
    record = Record(
        name="contact_nodes_memory",
        place=4,
        title="A run with many contact nodes: memory",
        other="two dense matrices of that size",
        peer="two matrices",
        rows=tuple(peaks),
        quantity="peak memory",
        unit="MB",
        **sides,
    )
    report(record, chosen.record)


if __name__ == "__main__":
    main()

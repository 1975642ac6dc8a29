"""Width and cost of proved bounds on the Section 6 model, as the rows of the table on the page on verified constants.

python benchmarks/verified_widths.py [--cells N ..]

N cells lie along the lower body (a multiple of 20).  Seconds are those of the processor, on one BLAS thread.
"""

from __future__ import annotations

import argparse
from time import process_time

import verification as vf
from verification.interface.build import pair_of

NAMES = ("m", "M", "rho_max", "C_R", "C_s", "C_t1", "kappa_1")


def row(cells: int) -> str:
    """Nodes, seconds of the plain constants and of both together, relative widths."""
    rest = 3 * cells // 20
    problem = vf.example("section6").changed(cells=((cells, rest), (3 * cells // 5, rest)))
    seconds = []
    for verified in (False, True):
        pair = pair_of(problem)  # anew: what is condensed is kept
        started = process_time()
        measured = vf.measure(pair, verified=verified)
        seconds.append(process_time() - started)
    widths = []
    for name in NAMES:
        number = getattr(measured, name)
        known = number.lo is not None and number.hi is not None
        widths.append(f"{(number.hi - number.lo) / number.value:.0e}" if known else "-")
    return f"| {measured.nodes} | {seconds[0]:.2g} | {seconds[1]:.2g} | " + " | ".join(widths) + " |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[40, 80, 160, 440])
    print("| nodes | plain s | verified s | " + " | ".join(NAMES) + " |", flush=True)
    for cells in parser.parse_args().cells:
        print(row(cells), flush=True)

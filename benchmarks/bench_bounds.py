"""How long `ndtheory bounds` takes over a bare interpreter, the two in turn.

python benchmarks/bench_bounds.py
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from statistics import median

ROUNDS = 15
NUMBERS = "--m 3084 --M 153229 --CR 1.70 --Cs 1.6e5 --Ctr 0.54 --k 0.2 --theta 0.7"


def seconds(*command: str) -> float:
    begin = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def main() -> None:
    ndtheory = str(Path(sys.executable).with_name("ndtheory"))
    command, bare = (ndtheory, "bounds", *NUMBERS.split()), (sys.executable, "-c", "pass")
    seconds(*command)
    pairs = [(seconds(*command), seconds(*bare)) for _ in range(ROUNDS)]
    print(f"ndtheory bounds   {1e3 * median(a for a, _ in pairs):6.1f} ms median of {ROUNDS}")
    print(f"bare interpreter  {1e3 * median(b for _, b in pairs):6.1f} ms")
    print(f"difference        {1e3 * median(a - b for a, b in pairs):6.1f} ms, wanted <= 150")


if __name__ == "__main__":
    main()

"""How long `ndtheory bounds` takes beside a bare interpreter.

python benchmarks/bench_bounds.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from recording import Record, options, report, row
from timing import in_turn

ROUNDS = 15
NUMBERS = "--m 3084 --M 153229 --CR 1.70 --Cs 1.6e5 --Ctr 0.54 --k 0.2 --theta 0.7"


def main() -> None:
    chosen = options(__doc__).parse_args()
    ndtheory = str(Path(sys.executable).with_name("ndtheory"))
    command, bare = (
        lambda words=words: subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        for words in ((ndtheory, "bounds", *NUMBERS.split()), (sys.executable, "-c", "pass"))
    )
    found = row(None, in_turn(command, bare, rounds=ROUNDS))
    record = Record(
        name="command",
        place=10,
        title="The bound calculator",
        ours="`ndtheory bounds`, from the command to its answer",
        other="a Python interpreter that starts and does nothing",
        peer="bare interpreter",
        rows=(found,),
        wanted="at most 150 ms more than the bare interpreter",
    )
    report(record, chosen.record)


if __name__ == "__main__":
    main()

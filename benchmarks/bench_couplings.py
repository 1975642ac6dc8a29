"""What the advice from logs, vectors and matrices costs in fifty couplings whose spectrum is known.

python benchmarks/bench_couplings.py [--full [--record FOLDER]]

The record is about all first thetas: without --full none is written, and one that is there stays.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from couplings import ADVICE, ARRIVED, ASKED_FOR, NOISE, Followed, advised, couplings, followed, others
from recording import options

from ndtheory import __version__

#: The theta of the first run; with --full others are tried, too.
FIRST, MORE = 0.5, (0.1, 0.3, 0.9, 0.99)

#: Records of another form than those of times have a folder of their own.
FOLDER = "advice"


def line(one: Followed) -> str:
    """A coupling for the terminal."""
    runs = " ".join(f"{theta:.3g}" for theta in one.runs)
    end = "advised" if one.decided else "next run"
    steps = "none" if one.steps is None else f"{one.steps}"
    return (
        f"  {one.name:45}  {one.least:8.3f} {one.largest:8.3f}  {runs:28}  "
        f"{end:8} {one.theta:.4g}: {steps} steps, fewest {one.fewest}"
    )


def main() -> None:
    chosen = options(__doc__).parse_args()
    kinds = [(coupling, False) for coupling in couplings()] + list(others())
    each = []
    for coupling, unseen in kinds:
        each.append(advised(coupling, unseen))
        print(f"  {coupling.name:45}  {each[-1].verdicts}  methods {each[-1].methods}: {each[-1].method}", flush=True)
    linear = [one for one in each if one.linear]
    for name in ADVICE:
        right = sum(one.verdicts[name] == "right" for one in linear)
        print(f"  {name}: {right} of {len(linear)} linear ones within 1.4 times the fewest steps")
    print(f"  methods: {sum(one.method_good for one in linear)} of {len(linear)} within 1.3 times the best")
    tried = {}
    for first in (FIRST, *MORE) if chosen.full else (FIRST,):
        print(f"first theta {first}")
        tried[first] = []
        with tempfile.TemporaryDirectory() as folder:
            for one in followed((coupling for coupling, _ in kinds), first, Path(folder)):
                tried[first].append(one)
                print(line(one), flush=True)
        good = sum(one.good for one in tried[first])
        print(f"  {good} of {len(tried[first])} within 1.4 times the fewest steps")
    if chosen.record is not None and not chosen.full:
        print("no record: it is about all first thetas, which --full runs")
    elif chosen.record is not None:
        document = {
            "schema": "ndtheory.couplings/1",
            "version": __version__,
            "date": datetime.now(UTC).date().isoformat(),
            "arrived": ARRIVED,
            "asked_for": ASKED_FOR,
            "noise": NOISE,
            "first": [
                {"theta": first, "couplings": [asdict(one) | {"good": one.good} for one in rows]}
                for first, rows in tried.items()
            ],
            "advice": [asdict(one) | {"verdicts": one.verdicts, "method_good": one.method_good} for one in each],
        }
        folder = chosen.record / FOLDER
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(document, indent=1, ensure_ascii=False)
        (folder / "couplings.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

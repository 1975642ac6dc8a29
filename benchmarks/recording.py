"""What the benchmarks have measured, as a table for the terminal and as JSON.

A record says what was measured and on which machine; `speed_page` makes a page of the site from the records.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import linear_regression, median
from typing import Any

import numpy as np
import scipy

from ndtheory import __version__

SCHEMA = "ndtheory.benchmark/1"


@dataclass(frozen=True, kw_only=True)
class Row:
    """Both sides at one size.

    Attributes
    ----------
    size : int or None
        None where the benchmark has no size.
    ours, other : float
        Medians over the rounds.
    ratio : float
        Ours over the other, the median of the rounds' ratios.
    rounds : int
    apart : float or None
        By how much the answers of the two sides differ, where both give one.
    """

    size: int | None
    ours: float
    other: float | None
    ratio: float | None
    rounds: int
    apart: float | None = None


def row(size: int | None, pairs: Sequence[tuple[float, float | None]], apart: float | None = None) -> Row:
    """The medians of what `timing.in_turn` has measured."""
    both = [(a, b) for a, b in pairs if b is not None]
    return Row(
        size=size,
        ours=median(a for a, _ in pairs),
        other=median(b for _, b in both) if both else None,
        ratio=median(a / b for a, b in both) if both else None,
        rounds=len(pairs),
        apart=apart,
    )


@dataclass(frozen=True, kw_only=True)
class Record:
    """One comparison at growing sizes.

    Attributes
    ----------
    name : str
        Of its file.
    place : int
        Among the others on the page.
    title, ours, other : str
        What is compared; the other side is a peer, the work at the core of ours, or a yardstick.  Empty where there is
        none: then the rows have none, either.
    peer : str
        The other side in one or two words.
    apart : str
        What the difference of the answers is measured in.
    size : str
        What the size counts.
    rows : tuple of Row
    since : int
        The growth is fitted from this size on: below, what does not grow counts.
    wanted : str
        What the project asks of itself.
    quantity, unit : str
    """

    name: str
    place: int
    title: str
    ours: str
    rows: tuple[Row, ...]
    other: str = ""
    peer: str = ""
    apart: str = ""
    size: str = ""
    since: int = 0
    wanted: str = ""
    quantity: str = "CPU time"
    unit: str = "s"

    def growth(self, side: str) -> float | None:
        """The exponent p of ``size**p``, fitted to ours or the other; None where fewer than two sizes are measured."""
        at = [(r.size, getattr(r, side)) for r in self.rows if r.size is not None and r.size >= self.since]
        points = [(math.log(size), math.log(value)) for size, value in at if value is not None]
        return linear_regression(*zip(*points, strict=True)).slope if len(points) > 1 else None


def machine() -> dict[str, object]:
    """What a reader must know of the machine to judge the numbers."""
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    return {
        "cpu": cpu(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "blas": f"{blas['name']} {blas['version']}",
        "blas_threads": 1,
    }


def cpu() -> str:
    """The name of the processor; `platform` knows it on few systems only."""
    if sys.platform == "darwin":
        return subprocess.check_output(["sysctl", "-n", "machdep.cpu.brand_string"], text=True).strip()
    told = Path("/proc/cpuinfo")
    lines = told.read_text("utf-8").splitlines() if told.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(iter(names), platform.processor() or platform.machine())


def document(record: Record) -> dict[str, Any]:
    """The record with its growth, the machine and the date, for a JSON file."""
    return {
        "schema": SCHEMA,
        **asdict(record),
        "growth": {side: record.growth(side) for side in ("ours", "other")},
        "version": __version__,
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine(),
    }


def shown(value: float | None, unit: str) -> str:
    """A measured value with its unit, seconds in one that brings them near one."""
    if unit == "s" and value is not None:
        scale, unit = next((s, u) for s, u in ((1, "s"), (1e-3, "ms"), (1e-6, "µs")) if value >= s or u == "µs")
        value /= scale
    return three(value) if value is None else f"{three(value)} {unit}"


def three(value: float | None) -> str:
    """Three significant digits, without an exponent; a dash for what was not measured."""
    if value is None:
        return "-"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}" if value > 0 else "0"


def table(record: Record) -> str:
    """The record for a terminal."""
    lines = [f"{record.title}: {record.quantity}", f"  ours:  {record.ours}"]
    if record.other:
        lines.append(f"  other: {record.other}")
    lines.append(f"  {record.size:>26}  {'ours':>9}  {'other':>9}  {'ours/other':>10}  {'rounds':>6}  {'apart':>7}")
    for r in record.rows:
        size, apart = "" if r.size is None else f"{r.size:,}", "" if r.apart is None else f"{r.apart:.0e}"
        sides = f"{shown(r.ours, record.unit):>9}  {shown(r.other, record.unit):>9}"
        lines.append(f"  {size:>26}  {sides}  {three(r.ratio):>10}  {r.rounds:6d}  {apart:>7}")
    grown = {side: record.growth(side) for side in ("ours", "other")}
    if told := [f"{side} n^{exponent:.2f}" for side, exponent in grown.items() if exponent is not None]:
        lines.append(f"  growth{f' from {record.since:,} on' if record.since else ''}: {', '.join(told)}")
    if record.wanted:
        lines.append(f"  wanted: {record.wanted}")
    return "\n".join(lines) + "\n"


def options(about: str | None) -> argparse.ArgumentParser:
    """The command line that all benchmarks share."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="the long sizes too")
    parser.add_argument("--largest", type=int, default=sys.maxsize, help="leave out the sizes beyond this one")
    parser.add_argument("--record", type=Path, metavar="FOLDER", help="write NAME.json into this folder too")
    return parser


def report(record: Record, folder: Path | None) -> None:
    """Print the table; into a folder, write the record, unless it has no rows."""
    print(table(record), flush=True)
    if folder is not None and record.rows:
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(document(record), indent=2, ensure_ascii=False)
        (folder / f"{record.name}.json").write_text(text + "\n", encoding="utf-8")

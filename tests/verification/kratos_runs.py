"""The runs of the page docs/kratos_run.md; as a script, with Kratos, this writes their logs anew."""

from __future__ import annotations

import re
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests"))

from kratos_models import PLATES, coupled  # noqa: E402

LOGS = ROOT / "docs" / "kratos"

#: What CoSimulation prints once in each iteration.
ITERATION = "Coupling iteration:"

#: Lines that a log keeps: the iteration, its residual, the factor, and how the run ended.
KEPT = re.compile(rf"{ITERATION}|Convergence for|abs-norm|Doing relaxation|ConvergenceAccelerator: |CONVERGENCE WAS")

#: The problem of each kind of interface; with friction the models are tied.
PROBLEMS = {"tied": PLATES, "contact": PLATES.changed(friction=0)}

RECORD = tomllib.loads((LOGS / "runs.toml").read_text("utf-8"))

#: Name of a run -> its interface and settings.
RUNS = {name: (kind, run) for kind in PROBLEMS for name, run in RECORD[kind].items()}


def printed(folder: Path, name: str, **members: Any) -> str:
    """What Kratos prints of a run of the page, in 50 iterations at most."""
    kind, run = RUNS[name]
    problem = PROBLEMS[kind].changed(neumann_body=run["neumann_body"])
    return coupled(folder, problem, run["theta"], run["method"], steps=25, **members)


def cut(text: str) -> str:
    """The lines of the iterations."""
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines() if KEPT.search(line))


if __name__ == "__main__":
    for name in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            (LOGS / f"{name}.log").write_text(cut(printed(Path(folder), name)), "utf-8")

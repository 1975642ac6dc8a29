"""What the command sweep shows: the best theta of each curve, or the runs where theta does not vary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from verification.cli.console import figures, heading, near_one, note, say, table
from verification.cli.typed import Typed
from verification.sweeps.keeping import Plan
from verification.sweeps.row import Row
from verification.sweeps.sweep import Sweep

#: Lines of a table on the screen; the file has them all.
MOST_LINES = 24

#: How columns are headed where there is little room.
HEADS = {"young1": "E1", "young2": "E2", "neumann_body": "Neumann", "friction": "k"}


def sweep(found: Sweep, target: Path | None = None) -> None:
    """The screen of ``sweep``."""
    title = "matrices" if found.problem is None else found.problem.title
    say(f"{title} | {len(found.rows)} of {found.asked} runs" if found.interrupted else f"{title} | {found.asked} runs")
    curves = [name for name in found.axes if name != "theta"]
    groups = found.values(curves)
    shown = [name for name in curves if len({each[name] for each in found.rows}) > 1]
    if "theta" in found.axes:
        heading("WHICH THETA TAKES THE FEWEST STEPS?")
        head = ["theta", "steps", "6.3", "rate", "rho", "converged"]
        lines = [[*(_short(rows[0][name]) for name in shown), *_best(rows)] for rows in groups.values()]
    else:
        heading("HOW MANY STEPS DOES EACH RUN TAKE?")
        head = ["theta", "steps", "6.3", "rate", "rho", "outcome"]
        lines = [[*(_short(each[name]) for name in shown), *_line(each), each["outcome"]] for each in found.rows]
    table([[*(HEADS.get(name, name) for name in shown), *head], *lines[:MOST_LINES]], right=range(len(shown) + 5))
    if len(lines) > MOST_LINES:
        say(f"  and {len(lines) - MOST_LINES} more lines")
    outcomes = [str(each["outcome"]) for each in found.rows]
    note(", ".join(f"{outcomes.count(name)} {name}" for name in dict.fromkeys(outcomes)), "  ")
    note("6.3: steps by the increment test of Section 6.3; steps: by the unrelaxed residual.", "  ")
    say()
    say("Not claimed: anything about a theta between those of the grid.")
    if target is not None and found.problem is not None and found.problem.source != "<dict>":
        Typed(file=Path(found.problem.source)).suggest("compare")
    elif target is not None:
        say("Next: ndtheory example")


def plan(found: Plan) -> None:
    """The screen of ``sweep --dry-run``."""
    title = "matrices" if found.problem is None else found.problem.title
    say(f"{title} | {found.asked} runs")
    say(f"  {found.stored} are in the store, {found.left} are left; nothing was run")


def _best(rows: list[Row]) -> list[str]:
    arrived = [each for each in rows if each["iterations"] is not None]
    best = min(arrived, key=lambda each: (each["iterations"], each["observed_rate"] or 1.0), default=None)
    count = f"{len(arrived)} of {len(rows)} thetas"
    if best is None:
        return ["-", "-", "-", "-", figures(rows[0]["rho"]), count]
    return [*_line(best), count]


def _line(each: Row) -> list[str]:
    rate = each["observed_rate"]
    counts = [each["iterations"], each["iterations_paper"]]
    shown = ["-" if count is None else str(count) for count in counts]
    return [_short(each["theta"]), *shown, "-" if rate is None else near_one(rate), figures(each["rho"])]


def _short(value: Any) -> str:
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)

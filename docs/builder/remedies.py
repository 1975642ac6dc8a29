"""The table of what to do after a run that did not converge, from small runs that end in each way."""

from __future__ import annotations

import re
from typing import Any

import verification as vf
from verification.algorithm.loop import Outcome
from verification.contact import ContactError

#: Section 6 on a coarse mesh: all runs of the table together take less than a second.
COARSE: dict[str, Any] = {"cells": ((10, 2), (6, 2)), "radius": "0.3"}

#: A body 1 so much softer that it must not read the forces.
SOFT: dict[str, Any] = {"young": (7, 70000), "friction": 0, "theta": "0.9"}

#: What to know of each ending, and a change of the problem that ends in this way.
CASES: tuple[tuple[dict[str, Any], str], ...] = (
    (
        {"max_iterations": 5},
        "The run is on its way. The last line of the screen has the whole command, with a number of steps that the"
        " rate seen so far needs. A better theta needs fewer: {doc}`coupling`.",
    ),
    (
        SOFT | {"max_iterations": 10},
        "Forces and displacements do not fit each other yet. Either theta is too large, so that nodes open and close in"
        " turn, or it is so small that the run has too few steps. The message has a theta that avoids both.",
    ),
    (
        {"neumann_body": 2, "theta": "0.9"},
        "Most often steps overshoot: they multiply some errors by $1 - \\theta(1 + \\rho)$, which is below $-1$. Take"
        " the theta of the message, or let the other body read the forces: {doc}`examples/which_side`. If a smaller"
        " theta stalls too, friction may be too large for the iteration: `ndtheory solve` needs none.",
    ),
    (
        {"tolerance": "1e-18"},
        "The run found the solution, up to the digits of its numbers. Set `iteration.tolerance` to the value in the"
        " line `Next`.",
    ),
    ({"theta": "1e-20"}, "Each step is smaller than the rounding of the forces."),
    (
        SOFT,
        "The same cause as for a theta that does not contract, but each step makes the error several times as large."
        " Most often the softer body reads the forces: exchange the roles. With the local law and much friction"
        " nothing bounds the forces: {doc}`local_law`.",
    ),
)


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


def _ended(changes: dict[str, Any], known: str) -> tuple[Outcome, str]:
    run = vf.run(vf.example("section6").changed(**COARSE | changes))
    if run.remedy is None:
        raise ValueError(f"{changes}: needed a run that does not converge")
    why, _, advice = run.remedy.sentence("--theta", "--swap-roles").partition("; ")
    advice = re.sub(r"--[a-z-]+(?: [\d.]+)?", r"`\g<0>`", advice)
    seen = f"{run.outcome.why[:1].upper()}{run.outcome.why[1:]}. " if "{" not in run.outcome.why else ""
    return run.outcome, f"| `{why}` | {advice} | {seen}{_cell(known)} |"


def _refused() -> str:
    """The row of a run that cannot take its first step: a load along Gamma_c on a body without supports."""
    file = vf.example("section6").changed(**COARSE).to_dict()
    file["body2"] |= {"prescribed": {}, "traction": {"top": [5.0, 0.1]}}
    try:
        vf.run(vf.Problem.from_dict(file))
    except ContactError as error:
        known = "Only contact holds this body, and the load overcomes it: {doc}`problem_file` says what it needs."
        return f"| `{error}` | add a support, a load that presses, or friction | {known} |"
    raise ValueError("needed a problem whose run cannot start")


def table() -> str:
    """The table in Markdown.

    Raises
    ------
    ValueError
        An outcome without a row, or a run that converges.
    """
    found = [_ended(changes, known) for changes, known in CASES]
    if missing := {*Outcome} - {Outcome.CONVERGED, Outcome.INTERRUPTED} - {outcome for outcome, _ in found}:
        raise ValueError(f"needed a run for each outcome, there is none for {', '.join(sorted(missing))}")
    kept = "Ctrl-C ended the run. The screen and the files have all that was computed."
    last = f"| `{Outcome.INTERRUPTED}` | start it again | {kept} |"
    return "\n".join(["| it prints | try | why |", "|---|---|---|", *(row for _, row in found), _refused(), last])

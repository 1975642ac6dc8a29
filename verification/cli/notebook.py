"""What a notebook and the written report show of a result: the screen of its command."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ndtheory import EnergyBounds
from verification.advice.roles import Advice
from verification.algorithm.runs import Run
from verification.bounds.region import Plane
from verification.certificate.continuum import ContinuumCertificate
from verification.certificate.contraction import Certificate, Checked
from verification.cli import certifying, screens
from verification.cli.advice_screen import advice
from verification.cli.calculator import thetas
from verification.cli.console import Part, heard, parted
from verification.cli.continuum_screen import show as continuum
from verification.cli.sweep_screen import sweep
from verification.comparison import Comparison
from verification.constants import Measured
from verification.monolithic import Solution
from verification.sweeps.sweep import Sweep

SCREENS: dict[type, Callable[[Any], None]] = {
    Measured: screens.constants,
    Run: screens.run,
    Solution: screens.solution,
    Comparison: screens.comparison,
    Advice: advice,
    Certificate: certifying.show,
    Checked: certifying.show_checked,
    ContinuumCertificate: continuum,
    Plane: screens.plane,
    Sweep: sweep,
}


def screen(result: Any) -> str:
    """The screen of the command that makes such a result; empty where there is none, as one of matrices alone."""
    show = SCREENS.get(type(result))
    if show is None or (result.problem is None and not isinstance(result, (Advice, Checked))):
        return ""
    with heard() as lines:
        show(result)
    return "\n".join(lines)


def report(result: Comparison) -> list[Part]:
    """The parts of the screen of ``compare``, and at its end those of two other commands: theta, and all constants."""
    with parted() as parts:
        screens.comparison(result)
        energy = result.bounds["energy"].detail
        if isinstance(energy, EnergyBounds):
            thetas(energy)
    with parted() as constants:
        screens.constants(result.measured)
    start = next(i for i, part in enumerate(constants) if part.kind == "heading")  # what is computed was said above
    return [*parts, *constants[start:]]

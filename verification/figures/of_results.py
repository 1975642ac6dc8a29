"""The main figure of each type of result, which its ``plot`` draws.

Another type of result gets its figure by ``draw.register``.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from matplotlib.figure import Figure

from ndtheory import EnergyConstants
from verification.advice.roles import Advice
from verification.algorithm.runs import Run
from verification.bounds.region import Plane
from verification.comparison import Comparison
from verification.constants import Measured
from verification.figures.bodies import draw_bodies
from verification.figures.factor import draw_factor
from verification.figures.region import draw_region
from verification.figures.reproduction import draw_reproduction
from verification.figures.residuals import draw_residuals
from verification.figures.sweep import draw_sweep
from verification.monolithic import Solution
from verification.reproduce.experiments import Reproduction
from verification.sweeps.sweep import Sweep


@singledispatch
def draw(result: Any, **options: Any) -> Figure:
    """Draw the main figure of a result with the options of its ``plot``; ValueError if there is nothing to draw."""
    raise ValueError(f"a {type(result).__name__} has no figure")


draw.register(Plane, draw_region)
draw.register(Reproduction, draw_reproduction)
draw.register(Run, draw_residuals)
draw.register(Solution, draw_bodies)
draw.register(Sweep, draw_sweep)


@draw.register
def _(result: Comparison) -> Figure:
    """The residuals beside what each bound proves of them."""
    return draw_residuals(result.run, result.computed)


@draw.register
def _(result: Measured) -> Figure:
    """The factor of one step over theta: predicted, and proved in energy norms."""
    energy = result.energy_constants()
    if energy is None:
        raise ValueError("the theorem in energy norms does not apply: " + result.why_no_energy)
    return draw_factor({"": energy})


@draw.register
def _(result: Advice) -> Figure:
    """The factor of one step over theta, for each assignment of the roles."""
    if not result.roles:
        raise ValueError("several readings are left: make the run that `next` names")
    if result.moduli is not None:
        raise ValueError("moduli bound rho from below only: no factor of a step follows")
    named = {f"Neumann body {role.neumann_body}" if role.neumann_body else "that run": role for role in result.roles}
    energy = {
        name: role.energy or EnergyConstants(rho=role.rho.value) for name, role in named.items() if role.rho is not None
    }
    return draw_factor(energy)

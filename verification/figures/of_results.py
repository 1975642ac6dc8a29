"""The main figure of each type of result, which its ``plot`` draws.

Another type of result gets its figure by ``draw.register``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch
from typing import Any

from matplotlib.figure import Figure

from ndtheory import EDITIONS, EnergyConstants
from verification.algorithm.history import History
from verification.algorithm.monolithic import Solution
from verification.algorithm.runs import Run
from verification.bounds.table import Calculated
from verification.comparison import Comparison
from verification.constants import Measured
from verification.coupling.roles import Advice
from verification.figures.bodies import draw_bodies
from verification.figures.factor import draw_factor
from verification.figures.history import draw_history
from verification.figures.region import draw_region
from verification.figures.reproduction import draw_reproduction
from verification.figures.residuals import draw_residuals
from verification.figures.squares import draw_squares
from verification.figures.sweep import draw_sweep
from verification.reproduce.experiments import Reproduction
from verification.sweeps.region import Plane
from verification.sweeps.sweep import Sweep


@singledispatch
def draw(result: Any, **options: Any) -> Figure:
    """Draw the main figure of a result with the options of its ``plot``; ValueError if there is nothing to draw."""
    raise ValueError(f"a {type(result).__name__} has no figure")


draw.register(History, draw_history)
draw.register(Plane, draw_region)
draw.register(Reproduction, draw_reproduction)
draw.register(Solution, draw_bodies)
draw.register(Sweep, draw_sweep)


@draw.register
def _(result: Run, view: str = "residuals", **options: Any) -> Figure:
    """The residuals, or the bodies with the options of their figure."""
    views: dict[str, Callable[..., Figure]] = {"residuals": draw_residuals, "bodies": draw_bodies}
    if view not in views:
        raise ValueError(f"{view!r}: needed one of {', '.join(views)}")
    return views[view](result, **options)


@draw.register
def _(result: Comparison) -> Figure:
    """The residuals beside what each bound proves of them."""
    return draw_residuals(result.run, result.computed)


@draw.register
def _(result: Calculated) -> Figure:
    """h_1 and h_2 over theta, of the editions that were asked for."""
    if result.constants is None:
        raise ValueError("h_1 and h_2 need the constants m, M, C_R and C_K")
    chosen = [edition for edition in EDITIONS if not result.results[edition.name].not_computed]
    return draw_squares(result.constants, chosen)


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
    named = {
        f"Neumann {result.words(role.neumann_body)}" if role.neumann_body else "that run": role for role in result.roles
    }
    energy = {
        name: role.energy or EnergyConstants(rho=role.rho.value) for name, role in named.items() if role.rho is not None
    }
    return draw_factor(energy)

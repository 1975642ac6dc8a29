"""The factor of one step over theta: predicted from rho, and proved with friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ndtheory import EnergyConstants, evaluate_energy
from ndtheory.energy_norms import predicted_factor
from verification.constants import Measured
from verification.coupling.advice import Advice
from verification.figures.style import BODIES, THETA, legend_beside, new_figure, styled
from verification.registry import draw

#: Thetas of a curve.
POINTS = 80


def draw_factor(roles: Mapping[str, EnergyConstants]) -> Figure:
    """Two curves for each assignment of the roles, by its label; the least proved factor is marked."""
    thetas = np.linspace(0.01, 0.99, POINTS)
    with styled():
        figure = new_figure(7.2, 3.4)
        ax = figure.subplots()
        for (label, energy), colour, marker in zip(roles.items(), BODIES, ("", "s"), strict=False):
            look: Any = {"color": colour, "marker": marker, "markevery": 8, "markersize": 3.5}
            name, rho = f"{label}: " if label else "", float(energy.at_work)
            predicted = [predicted_factor(theta, rho) for theta in thetas]
            ax.plot(thetas, predicted, "--", **look, label=f"{name}predicted, rho = {rho:.3g}")
            found = [evaluate_energy(energy, float(theta)).factor for theta in thetas]
            proved = [(theta, q.value) for theta, q in zip(thetas, found, strict=True) if q is not None]
            if proved:
                ax.plot(*zip(*proved, strict=True), "-", **look, label=f"{name}proved")
            best = evaluate_energy(energy)
            if best.theta_proved is not None and best.factor_proved is not None:
                ax.plot([best.theta_proved], [best.factor_proved.value], "o", color=colour, markersize=5)
        ax.axhline(1.0, color="0.4", linewidth=0.8, linestyle=":")
        ax.set(xlim=(0, 1), ylim=(0, 1.5), xlabel=THETA, ylabel="factor of one step")
        ax.set_title("How much one step changes the distance of two forces")
        legend_beside(ax)
    return figure


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
    if result.why_no_theta:
        raise ValueError(result.why_no_theta)
    known = {
        f"Neumann {result.evidence.words(role.neumann_body)}" if role.neumann_body else "that run": role
        for role in result.roles
    }
    energy = {
        name: role.energy or EnergyConstants(rho=role.rho.value) for name, role in known.items() if role.rho is not None
    }
    return draw_factor(energy)

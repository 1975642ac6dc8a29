"""The factor of one step over theta: predicted from rho, and proved with friction."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ndtheory import EnergyConstants, evaluate_energy
from ndtheory.energy_norms import predicted_factor
from verification.bounds.bound import Subject
from verification.comparison import Comparison
from verification.constants import Measured
from verification.coupling.advice import Advice
from verification.figures.style import BODIES, THETA, legend_beside, new_figure, plain, styled
from verification.registry import BOUNDS, draw

#: Thetas of a curve, and of one that needs a program at each.
POINTS, PROVED = 80, 19


def draw_factor(roles: Mapping[str, EnergyConstants], unproved: Collection[str] = ()) -> Figure:
    """Two curves for each assignment of the roles, by its label; the least proved factor is marked.

    Of ``unproved`` labels only rho is used, for the predicted curve.
    """
    thetas = np.linspace(0.01, 0.99, POINTS)
    with styled():
        figure = new_figure(7.2, 3.4)
        ax = figure.subplots()
        for (label, energy), colour, marker in zip(roles.items(), BODIES, ("", "s"), strict=False):
            look: Any = {"color": colour, "marker": marker, "markevery": 8, "markersize": 3.5}
            name, rho = f"{label}: " if label else "", float(energy.at_work)
            predicted = [predicted_factor(theta, rho) for theta in thetas]
            ax.plot(thetas, predicted, "--", **look, label=f"{name}predicted, rho = {rho:.3g}")
            if label in unproved:
                continue
            proved = [
                (theta, q.value) for theta in thetas if (q := evaluate_energy(energy, float(theta)).factor) is not None
            ]
            if proved:
                ax.plot(*zip(*proved, strict=True), "-", **look, label=f"{name}proved")
            best = evaluate_energy(energy)
            if best.theta_proved is not None and best.factor_proved is not None:
                ax.plot(best.theta_proved, best.factor_proved.value, "o", color=colour, markersize=5)
        _finish(ax, "How much one step changes the distance of two forces")
    return figure


def draw_proved(found: Comparison) -> Figure:
    """The factor of one step over theta by each bound that a comparison worked out, beside the prediction from rho.

    The free norm is not the norm of the other curves, and the rate of the run is one of many steps.
    """
    thetas = np.linspace(0.05, 0.95, PROVED).tolist()
    subject, rho = Subject.of(found.run.pair, found.measured), found.measured.rho_max
    with styled():
        figure = new_figure(7.2, 3.4)
        ax = figure.subplots()
        if rho is not None:
            predicted = [predicted_factor(theta, rho.value) for theta in thetas]
            ax.plot(thetas, predicted, "--", color="0.5", label=f"predicted, rho = {rho.value:.3g}")
        proved = () if found.run.pair.outside else (BOUNDS[result.name] for result in found.computed)
        for bound in (each for each in proved if not each.finding):
            factors = np.array(bound.curve(subject, thetas), dtype=float)  # None is not a number
            if not np.isnan(factors).all():
                ax.plot(thetas, factors, color=bound.colour, linestyle=bound.dashes, label=bound.words)
        if found.run.observed_rate is not None and found.run.converged:
            ax.plot(float(found.run.theta), found.run.observed_rate.value, "o", color="0.1", label="rate of the run")
        _finish(ax, f"{plain(found.run.pair.title)}: k = {float(found.run.pair.friction):g}")
    return figure


def _finish(ax: Any, title: str) -> None:
    ax.axhline(1.0, color="0.4", linewidth=0.8, linestyle=":")
    ax.set(xlim=(0, 1), ylim=(0, 1.5), xlabel=THETA, ylabel="factor of one step", title=title)
    legend_beside(ax)


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
    known = {
        f"Neumann {result.evidence.words(role.neumann_body)}" if role.neumann_body else "that run": role
        for role in result.roles
        if role.theta_predicted is not None
    }
    if result.why_no_theta or not known:
        raise ValueError(result.why_no_theta or result.best.reason["theta_predicted"])
    energy = {
        name: role.energy or EnergyConstants(rho=role.rho.value) for name, role in known.items() if role.rho is not None
    }
    return draw_factor(energy, [name for name, role in known.items() if role.theta_proved is None])

"""The first view of each widget as a picture, for readers without scripts and for paper."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ndtheory import energy_norms
from verification.figures import style


def cobweb(data: dict[str, float]) -> Figure:
    """T g = max(0, S1 moved - rho g), the iterates at theta = 0.4, and the two slopes over theta."""
    rho, theta = data["S1"] / data["S2"], 0.4
    figure = style.new_figure(7.2, 3.2)
    with style.styled():
        left, right = figure.subplots(1, 2)
        g = np.linspace(0, 0.32, 100)
        relaxed = lambda g: theta * np.maximum(0, data["S1"] * data["moved"] - rho * g) + (1 - theta) * g
        left.plot(g, relaxed(g), color=style.BODY1, label="one step")
        left.plot(g, g, color="0.6", linestyle="--", label="g")
        path = [0.0]
        for _ in range(12):
            path.append(float(relaxed(np.array(path[-1]))))
        corners = [(a, b) for a, c in pairwise(path) for b in (a, c)]
        left.plot(*zip(*corners, strict=True), color=style.BODY2, linewidth=1, label="iterates")
        left.set(xlabel="force g", ylabel="next force", title=f"theta = {theta:g}")
        left.legend()
        _v(right, rho)
        right.axvline(theta, color="0.6", linewidth=0.8)
    return figure


def _v(ax: Any, rho: float) -> None:
    thetas = np.linspace(0.001, 1, 200)
    ax.plot(thetas, np.abs(1 - thetas), color="0.4", linestyle=":", label="apart: |1 - theta|")
    ax.plot(thetas, np.abs(1 - thetas * (1 + rho)), color=style.BODY1, label="in contact: |1 - theta (1 + rho)|")
    ax.plot(
        [energy_norms.predicted_theta(rho)],
        [energy_norms.predicted_rate(rho)],
        "o",
        color=style.BODY2,
        label="2/(2 + rho)",
    )
    ax.axhline(1, color="0.7", linewidth=0.8)
    ax.set(xlabel="theta", ylabel="factor a step", ylim=(0, 2), title=f"rho = {rho:.3g}")
    ax.legend()


def plane(data: dict[str, float]) -> Figure:
    """The region that the theorem in energy norms proves, at E1/E2 = 3.5."""
    stiffer = 3.5
    rho = data["rho"] / stiffer
    kappa = np.array([np.sqrt(stiffer) * data["CsEnergy"] * data["Ct1"], data["CsEnergy"] * data["Ct2"]])
    frictions = np.linspace(0, 0.5, 300)[1:]
    found = [(k, energy_norms.contraction_interval(rho, *(k * kappa))) for k in frictions]
    known = [(k, *interval) for k, interval in found if interval is not None]
    figure = style.new_figure(5.2, 3.2)
    with style.styled():
        ax = figure.subplots()
        k, low, high = np.array(known).T
        ax.fill_betweenx(k, low, high, color=style.STATES["stick"], alpha=0.5, label="proved in energy norms")
        ax.plot([0.6], [0.2], "o", color="black", label="theta = 0.6, k = 0.2")
        ax.set(xlabel="theta", ylabel="friction k", xlim=(0, 1), ylim=(0, 0.5), title=f"E1/E2 = {stiffer:g}")
        ax.legend(loc="upper left")
    return figure


def spectrum(data: dict[str, Any]) -> Figure:
    """The eigenvalues of the first role under the V at theta = 0.6."""
    theta, role = 0.6, data["roles"][0]
    values = np.array(role["eigenvalues"])
    figure = style.new_figure(5.2, 3.2)
    with style.styled():
        ax = figure.subplots()
        line = np.linspace(0, 1.2 * values[-1], 200)
        ax.plot(line, np.abs(1 - theta * (1 + line)), color=style.BODY1, label="|1 - theta (1 + lambda)|")
        ax.plot(values, np.abs(1 - theta * (1 + values)), "|", color=style.BODY2, markersize=12, label="eigenvalues")
        ax.plot([0], [1 - theta], "o", color="0.4", label="an open node")
        ax.set(xlabel="lambda", ylabel="factor a step", title=f"Neumann body {role['neumann']}, theta = {theta:g}")
        ax.legend()
    return figure

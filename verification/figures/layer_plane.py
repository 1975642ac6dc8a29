"""The plane of theta and k for two layers: below each curve a step contracts by its factor, in both roles."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ndtheory.continuum.circle import disk
from verification.figures.style import BODIES, THETA, legend_beside, new_figure, styled
from verification.free_norm.search import Search
from verification.free_norm.two_layers import Layers
from verification.registry import draw

#: The factors of the curves, and points of each.
FACTORS, POINTS = (1.0, 0.8, 0.6, 0.4), 18


@draw.register
def draw_layer_plane(found: Layers) -> Figure:
    """One panel for each role; the problem's theta and friction are marked."""
    both = (found.layers, found.layers.swapped)
    with styled():
        figure = new_figure(7.2, 3.4)
        panels = figure.subplots(1, 2, sharey=True)
        for ax, role, layers, colour in zip(panels, found.roles, both, BODIES, strict=True):
            search = Search(layers)
            for q, style in zip(FACTORS, ("-", "--", "-.", ":"), strict=True):
                thetas = np.linspace(1 - q, 1, POINTS + 1)[1:]
                k = [max(search.allowed(disk(float(theta), q)).friction, 0.0) for theta in thetas]
                ax.plot(thetas, k, style, color=colour, label="contracts below" if q == 1 else f"by {q:g}")
            if role.theta is not None:
                ax.plot(role.theta, float(found.friction), "o", color="black", markersize=4)
            ax.set(xlim=(0, 1), xlabel=THETA, title=f"Neumann body {role.neumann}")
        panels[0].set(ylim=(0, None), ylabel="coefficient of friction k")
        legend_beside(panels[1])
    return figure

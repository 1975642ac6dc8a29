"""The (theta, k) plane, on logarithmic axes and enlarged: regions by bound, runs over them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from verification.algorithm.loop import Outcome
from verification.figures.style import OUTCOMES, THETA, ink, legend_beside, new_figure, plain, styled
from verification.registry import BOUNDS
from verification.registry import draw as main_figure
from verification.sweeps.region import Plane

#: The enlarged part ends this much above the largest friction of which something is proved.
ROOM = 1.3

#: Number of points of a border on logarithmic axes.
DENSE = 200


def draw_region(plane: Plane) -> Figure:
    """Regions in which contraction is proved, from the largest to the smallest, and the outcome of each run.

    Above, all of the plane on logarithmic axes; below, on linear ones, the part in which something is proved.
    Between two computed frictions the border is a straight line on linear axes.
    """
    ends = [hi for region in plane.regions.values() for _, hi in region.theta] or [1.0]
    frictions = [k for region in plane.regions.values() for k in region.k] or [point.k for point in plane.points]
    left, bottom = 10 ** (-2) * min(ends), 0.1 * min(frictions)
    varies = plane.problem.varies
    highest = max([*frictions, *(p.k for p in plane.points)])
    with styled():
        figure = new_figure(7.2, 7.2)
        whole, enlarged = figure.subplots(2, 1)
        whole.set(xscale="log", yscale="log")
        for ax in (whole, enlarged):
            _draw(ax, plane, left, bottom)
            ax.set(ylabel=f"{'largest ' * varies}coefficient of friction k")
        whole.set(xlim=(left, 1.3), ylim=(bottom, 2 * highest))
        enlarged.set(xlim=(0, 1), ylim=(0, ROOM * max(frictions)), xlabel=THETA)
        whole.set_title(f"{plain(plane.title)}: where one step is proved to contract")
        enlarged.set_title("enlarged, on linear axes; straight borders between computed frictions")
        legend_beside(whole)
    return figure


def _draw(ax: Axes, plane: Plane, left: float, bottom: float) -> None:
    for name, bound in reversed(list(BOUNDS.items())):
        region = plane.regions.get(name)
        if region is None or not region.k:
            continue
        # closer than computed: a line on linear axes is none on logarithmic ones
        k = np.unique([bottom, *region.k, *np.geomspace(region.k[0], region.k[-1], DENSE)])
        low, high = (np.interp(k, region.k, ends) for ends in zip(*region.theta, strict=True))
        unit = f" ({plain(plane.units['stress'])})" if bound.of_unit else ""
        fill = bound.fill or bound.colour
        look: dict[str, Any] = {"facecolor": fill, "edgecolor": ink(fill), "linewidth": 0, "hatch": bound.hatch}
        ax.fill_betweenx(k, np.maximum(low, left), high, label=f"{name}{unit}: k < {max(region.k):.2g}", **look)
    for name, (colour, marker) in OUTCOMES.items():
        outcome = Outcome(name)
        chosen = [point for point in plane.points if point.outcome == outcome]
        if chosen:
            x, y = [p.theta for p in chosen], [p.k for p in chosen]
            # a run that was still falling when it was stopped contradicts nothing: an empty marker
            face, edge = ("white", colour) if outcome is Outcome.LIMIT else (colour, "white")
            look = {"markerfacecolor": face, "markeredgecolor": edge, "markeredgewidth": 0.7, "markersize": 5}
            ax.plot(x, y, marker, **look, label=f"run {outcome.seen}")


main_figure.register(Plane, draw_region)

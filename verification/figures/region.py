"""The (theta, k) plane on logarithmic axes: regions by bound, runs over them."""

from __future__ import annotations

from matplotlib.figure import Figure

from verification.bounds.region import Plane
from verification.bounds.table import BOUNDS
from verification.figures.style import OUTCOMES, new_figure, plain, styled


def draw_region(plane: Plane) -> Figure:
    """Regions in which contraction is proved, from the largest to the smallest, and the outcome of each run."""
    ends = [hi for region in plane.regions.values() for _, hi in region.theta]
    frictions = [k for region in plane.regions.values() for k in region.k]
    left = 10 ** (-2) * min(ends)
    bottom = 0.1 * min(frictions)
    with styled():
        figure = new_figure(7.2, 4.6)
        ax = figure.subplots()
        ax.set_xscale("log")
        ax.set_yscale("log")
        for name, bound in reversed(list(BOUNDS.items())):
            region = plane.regions.get(name)
            if region is None or not region.k:
                continue
            k = [bottom, *region.k]
            low = [max(lo, left) for lo, _ in (region.theta[0], *region.theta)]
            high = [hi for _, hi in (region.theta[0], *region.theta)]
            unit = f" ({plane.units['stress']})" if name == "printed" else ""
            label = f"{name}{unit}: k < {max(region.k):.2g}"
            ax.fill_betweenx(k, low, high, color=bound.colour, alpha=0.55, linewidth=0, label=label, hatch=bound.hatch)
        for outcome, (colour, marker) in OUTCOMES.items():
            chosen = [point for point in plane.points if point.outcome == outcome]
            if chosen:
                x, y = [p.theta for p in chosen], [p.k for p in chosen]
                # a run that was still falling when it was stopped contradicts nothing: an empty marker
                fill, label = (
                    ("none", "run still falling when stopped") if outcome == "limit" else (None, f"run {outcome}")
                )
                ax.plot(x, y, marker, color=colour, markerfacecolor=fill, markersize=4, label=label)
        ax.set_xlim(left, 1.3)
        ax.set_ylim(bottom, 2 * max([*frictions, *(p.k for p in plane.points)]))
        ax.set_xlabel("relaxation factor theta")
        ax.set_ylabel("coefficient of friction k")
        ax.set_title(f"{plain(plane.title)}: where one step is proved to contract")
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure

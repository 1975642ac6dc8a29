"""The best theta over the ratio of the moduli: seen in runs, predicted, proved, and from only the moduli."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from verification.figures.style import BODY1, BODY2, THETA, new_figure, plain, styled

if TYPE_CHECKING:  # scipy.optimize, which no other figure needs, comes with it
    from verification.sweeps.best_theta import BestTheta

#: Colours and line styles of the thetas that follow from only the moduli, without a mesh.
OF_MODULI = (("0.35", ":"), ("0.35", (0, (6, 2, 1, 2))))

#: Each bound with friction: the attribute of BestTheta, its words, and how it is drawn.
PROVED = (
    ("energy", "proved with friction: energy norms", BODY1, "s-"),
    ("semidefinite", "proved with friction: semidefinite", BODY2, "D-"),
)

#: Labelled values of theta.
TICKS = (0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99)


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One assignment of the roles: results over the ratio of the moduli, with and without friction.

    ``moduli`` maps labels to thetas over the same ratio.
    """

    title: str
    with_friction: Mapping[float, BestTheta]
    without: Mapping[float, BestTheta]
    moduli: Mapping[str, Mapping[float, float]]


def draw_best_theta(panels: list[Panel], x: str) -> Figure:
    """Points are runs, broken lines predictions, solid lines proofs; a proof that ends has no theta beyond.

    theta is drawn by its odds theta/(1 - theta): ``2/(2 + rho)`` has the odds ``2/rho``, a straight line wherever rho
    is proportional to the ratio.  The text ``x`` says which ratio it is.
    """
    with styled():
        figure = new_figure(7.2, 5.2)
        grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for ax, panel in zip(grid, panels, strict=True):
            _draw(ax, panel)
            ax.set(xscale="log", xlabel=plain(x), title=plain(panel.title))
            ax.set(yscale="logit", ylim=(0.007, 0.996))
            ax.set_yticks(TICKS, [f"{theta:g}" for theta in TICKS])
            ax.set_yticks([], minor=True)
            ax.grid(color="0.9", linewidth=0.6)
        grid[0].set_ylabel(THETA)
        entries: dict[str, Artist] = {}
        for ax in grid:
            for line, label in zip(*ax.get_legend_handles_labels(), strict=True):
                entries[label] = line
        figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=2)
    return figure


def _draw(ax: Axes, panel: Panel) -> None:
    for (label, thetas), (colour, style) in zip(panel.moduli.items(), OF_MODULI, strict=False):
        ax.plot(*_points(thetas), linestyle=style, color=colour, linewidth=1.2, label=plain(label))
    free, rubbing = panel.without, panel.with_friction
    exact = {ratio: found.energy.theta for ratio, found in free.items() if found.energy}
    ax.plot(*_points(exact), "-", color="#2E86C1", linewidth=4, zorder=1.5, label="proved without friction")
    for name, label, colour, style in PROVED:
        proved = {ratio: getattr(found, name) for ratio, found in rubbing.items()}
        thetas = {ratio: least.theta for ratio, least in proved.items() if least}
        ax.plot(*_points(thetas), style, color=colour, markersize=3.5, label=label)
    predicted = {ratio: found.predicted for ratio, found in rubbing.items()}
    ax.plot(*_points(predicted), "--", color="#000000", label="predicted: 2/(2 + rho)")
    jacobian = {ratio: found.linearised.theta for ratio, found in rubbing.items() if found.linearised}
    ax.plot(*_points(jacobian), "-.", color="#CC79A7", label="predicted: Jacobian at the solution")
    seen = {ratio: found.seen for ratio, found in rubbing.items() if found.seen}
    for ratio, fewest in seen.items():
        # no bar on a side where fewer steps may lie beyond
        ends = fewest.below or fewest.low, fewest.above or fewest.high
        ax.plot([ratio, ratio], ends, color="#000000", linewidth=1.0, zorder=3)
    middle = {ratio: fewest.theta for ratio, fewest in seen.items()}
    ax.plot(*_points(middle), "ok", markerfacecolor="white", markersize=5, zorder=4, label="fewest steps in runs")


def _points(values: Mapping[float, float]) -> tuple[list[float], list[float]]:
    ratios = sorted(values)
    return ratios, [values[ratio] for ratio in ratios]

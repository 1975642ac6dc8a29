"""The residual history with the rates drawn beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from verification.algorithm.rates import noise
from verification.algorithm.runs import Run
from verification.bounds.bound import BoundResult
from verification.comparison import Comparison
from verification.figures.bodies import draw_bodies
from verification.figures.style import PRESSURE, legend_beside, mark_unfinished, new_figure, norm, plain, styled
from verification.registry import BOUNDS, draw


def draw_residuals(run: Run, bounds: Sequence[BoundResult] = ()) -> Figure:
    """Unrelaxed residual over evaluations of T, the observed rate, the noise floor and the factors of the bounds."""
    history = np.array(run.history)
    steps = np.arange(len(history))
    shown = np.isfinite(history) & (history > 0)
    with styled():
        figure = new_figure(7.2, 3.4)
        ax = figure.subplots()
        ax.semilogy(steps[shown], history[shown], "o-", color=PRESSURE, markersize=3, label=f"residual ({run.outcome})")
        rate = run.observed_rate
        if rate is not None and shown.any():
            middle = (rate.begin + rate.end) // 2
            line = history[middle] * rate.value ** (steps - middle)
            ax.semilogy(steps, line, "--", color="#D55E00", label=f"observed rate {rate.value:.4g}")
        for row in bounds:
            if row.factor is not None and shown.any() and not run.outside:
                least = 1.0 if row.norm is None else row.norm.condition**-0.5
                line = history[shown][0] / least * row.factor.value**steps
                bound = BOUNDS[row.name]
                ax.semilogy(steps, line, linestyle=bound.dashes, color=bound.colour, label=f"{row.name} bound")
        if run.last.scale > 0:
            floor = noise(run.pair, run.last) / run.last.scale
            ax.axhline(floor, color="0.55", linewidth=0.8, linestyle=":", label="rounding")
        ax.axhline(run.pair.settings.tolerance, color="0.2", linewidth=0.8, linestyle=":", label="tolerance")
        ax.set(xlabel="evaluations of T", ylabel=f"residual {norm('T g - g')}, relative to the forces")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set_title(f"{plain(run.pair.title)}: theta = {float(run.theta):g}")
        legend_beside(ax)
        if not run.converged:
            mark_unfinished(ax, run.outcome, run.unfinished)
    return figure


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

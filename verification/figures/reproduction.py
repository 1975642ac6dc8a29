"""Figures of Section 6, run again, in the readings that come nearest."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from verification.figures.style import THETA, legend_beside, mark_states, new_figure, styled
from verification.registry import draw as main_figure
from verification.reproduce.claims import PRINTED_THETA, ZONES
from verification.reproduce.experiments import Reproduction, Result

MARKERS = "osD^"
SHADES = ("#0072B2", "#D55E00", "#009E73", "#000000")


def draw_reproduction(found: Reproduction) -> Figure:
    """One panel for each figure: the paper's text in grey, and the runs in the nearest reading."""
    results = found.results
    with styled():
        figure = new_figure(7.2, 2.9 * len(results))
        for result, ax in zip(results, np.atleast_1d(figure.subplots(len(results), 1)), strict=True):
            (_zones if result.figure == "fig5" else _curves)(result, ax)
            ax.set_title(fill(f"{result.figure}, {result.verdict}; nearest: {result.closest.reading.name}", 72))
    return figure


def _zones(result: Result, ax: Any) -> None:
    contact = result.closest.contact
    if contact is None:
        return
    x = contact.x - contact.x[0]
    ax.plot(x, contact.pressure, color="0.3", linewidth=0.8)
    mark_states(ax, contact.status, x, contact.pressure)
    for _, end in ZONES[:-1]:
        ax.axvline(end, color="0.5", linestyle=":", label="printed ends of zones" if end == ZONES[0][1] else None)
    ax.set(xlabel=r"x from the left end of $\Gamma_c$ (mm)", ylabel="pressure (MPa)")
    legend_beside(ax)


def _curves(result: Result, ax: Any) -> None:
    ax.axvline(PRINTED_THETA, color="0.5", linestyle=":", label="printed best theta")
    for curve, marker, shade in zip(result.closest.curves, MARKERS, SHADES, strict=False):
        points = [(theta, n) for theta, n in curve.steps.items() if n is not None]
        if points:
            ax.plot(*zip(*points, strict=True), f"{marker}-", color=shade, markersize=3.5, label=curve.label)
    ax.set(xlim=(0, 1), yscale="log", xlabel=THETA, ylabel="steps, increment test")
    legend_beside(ax)


main_figure.register(Reproduction, draw_reproduction)

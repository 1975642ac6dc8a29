"""A loading history: force against displacement, states over position and time, shear against its bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from verification.algorithm.history import History
from verification.figures.style import (
    SHEAR,
    STATES,
    legend_beside,
    mark_states,
    mark_unfinished,
    new_figure,
    plain,
    styled,
)
from verification.registry import draw as main_figure

#: Colours of the states in a map; the orange of slip and the grey of open nodes look alike in grey print.
MAP = {"stick": STATES["stick"], "slip": STATES["slip"], "open": "#F4F4F4"}

#: Most times of a figure of shear, unless some are asked for.
MOST_TIMES = 4


def draw_history(history: History, view: str = "loop", **options: Any) -> Figure:
    """One view of a history: ``loop``, ``states``, or ``shear`` (with ``times``); ValueError for another word."""
    views: dict[str, Callable[..., Figure]] = {"loop": _loop, "states": _states, "shear": _shear}
    if view not in views:
        raise ValueError(f"{view!r}: needed one of {', '.join(views)}")
    with styled():
        figure = views[view](history, **options)
        if not history.converged and view != "shear":
            done = f"{len(history.increments)} of {history.planned} increments"
            mark_unfinished(figure.axes[0], done, history.unfinished and f"the last: {history.unfinished}")
    return figure


def _steps(history: History) -> Iterator[tuple[int, str, int, int]]:
    """Yield number and name of each step, and the number of increments before it and at its end."""
    end = 0
    for number, group in groupby(history.increments, key=lambda each: each.step):
        first, done = end, list(group)
        end += len(done)
        yield number, done[0].name, first, end


def _loop(history: History) -> Figure:
    label, along, axis = history.driven
    which = ("tangential", "normal")[axis]
    force = np.array([0.0, *(each.contact.force[which] for each in history.increments)])
    units = history.problem.units
    figure = new_figure(7.2, 3.6)
    ax = figure.subplots()
    ax.axhline(0, color="0.8", linewidth=0.8)
    last = history.increments[-1].step
    for number, name, first, end in _steps(history):
        look: Any = {"color": f"{0.65 * (number - 1) / max(last - 1, 1):.3f}", "markersize": 3}
        line, rows = f"{'os^Dvx*'[(number - 1) % 7]}-", slice(first, end + 1)
        ax.plot(along[rows], force[rows], line, label=f"{number} {plain(name)}", **look)
    ax.set_xlabel(f"{plain(label)} [{plain(units['length'])}]")
    unit = plain(units["stress"] + (f" {units['length']}" if history.problem.dimension == 2 else ""))
    ax.set_ylabel(f"{which} force{' on body 2' if axis == 0 else ''} [{unit}]")
    lost = sum(each.dissipated for each in history.increments)
    ax.set_title(f"{plain(history.problem.title)}: friction took {lost:.4g} per unit thickness")
    legend_beside(ax)
    return figure


def _states(history: History) -> Figure:
    x = history.increments[0].contact.x
    order = list(MAP)
    codes = np.array([[order.index(state) for state in each.contact.status] for each in history.increments])
    half = np.diff(x) / 2 if len(x) > 1 else np.array([0.5])
    edges = np.concatenate([[x[0] - half[0]], (x[:-1] + x[1:]) / 2, [x[-1] + half[-1]]])
    figure = new_figure(7.2, 4.2)
    ax = figure.subplots()
    rows = np.arange(len(codes) + 1) + 0.5
    colours = ListedColormap(list(MAP.values()))
    ax.pcolormesh(
        edges, rows, codes, cmap=colours, norm=BoundaryNorm(np.arange(-0.5, 3), 3), edgecolor="0.75", linewidth=0.2
    )
    for number, name, first, end in _steps(history):
        if number > 1:
            ax.axhline(first + 0.5, color="0.1", linewidth=1.0)
        ax.text(1.01, (first + 1 + end) / 2, plain(name), transform=ax.get_yaxis_transform(), va="center")
    position = f"position along $\\Gamma_c$ [{plain(history.problem.units['length'])}]"
    ax.set(xlabel=position, ylabel="increment", title=plain(history.problem.title))
    patches = [Patch(facecolor=colour, edgecolor="0.4", label=state) for state, colour in MAP.items()]
    figure.legend(handles=patches, loc="outside lower center", ncols=3)
    return figure


def _shear(history: History, times: Sequence[float] | None = None) -> Figure:
    every = np.array([each.time for each in history.increments])
    if times is None:
        chosen = [end - 1 for *_, end in _steps(history)][-MOST_TIMES:]
    else:
        chosen = [int(np.argmin(np.abs(every - time))) for time in times]
    figure = new_figure(7.2, 1.2 + 1.6 * len(chosen))
    axes = np.atleast_1d(figure.subplots(len(chosen), sharex=True, sharey=True))
    for ax, i in zip(axes, chosen, strict=True):
        contact = history.increments[i].contact
        look: Any = {"facecolor": "0.9", "edgecolor": "0.4", "linestyle": ":"}
        ax.fill_between(contact.x, -contact.bound, contact.bound, label="friction bound", **look)
        ax.plot(contact.x, contact.shear, "--", color=SHEAR, label="shear on body 2")
        mark_states(ax, contact.status, contact.x, contact.shear)
        ax.set_title(f"time {every[i]:g}, step {plain(history.increments[i].name)}")
        ax.set_ylabel(f"stress [{plain(history.problem.units['stress'])}]")
        legend_beside(ax)
    axes[-1].set_xlabel(f"position along $\\Gamma_c$ [{plain(history.problem.units['length'])}]")
    return figure


main_figure.register(History, draw_history)

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
from verification.interface.fields import ContactFields
from verification.registry import draw as main_figure

#: Colours of the states in a map; the orange of slip and the grey of open nodes look alike in grey print.
MAP = {"stick": STATES["stick"], "slip": STATES["slip"], "open": "#F4F4F4"}

#: Most times of a figure of shear, unless some are asked for.
MOST_TIMES = 4


def draw_history(history: History, view: str = "loop", **options: Any) -> Figure:
    """One view of a history: ``loop``, ``states``, ``points``, or ``shear`` (with ``times``).

    ValueError for another word, and for the points of a problem that names none.
    """
    views: dict[str, Callable[..., Figure]] = {"loop": _loop, "states": _states, "shear": _shear, "points": _points}
    if view not in views:
        raise ValueError(f"{view!r}: needed one of {', '.join(views)}")
    if view == "points" and not history.points:
        raise ValueError("no points to draw: needed points = { tip = [x, y] } in the table of a body")
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
    lines = [_along(history, each.contact) for each in history.increments]
    order, x = list(MAP), lines[0].x.copy()
    codes = np.array([[order.index(state) for state in line.status] for line in lines], dtype=float)
    between = np.flatnonzero(np.isnan(x))[:-1]  # lines of several bodies, one of which ends before the next begins
    codes[:, between] = np.nan
    x[between] = (x[between - 1] + x[between + 1]) / 2
    codes, x = codes[:, ~np.isnan(x)], x[~np.isnan(x)]
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


def _along(history: History, contact: ContactFields) -> ContactFields:
    """The fields over x, or over the distance s along named lines."""
    return contact.unrolled() if history.problem.named else contact


def _shear(history: History, times: Sequence[float] | None = None) -> Figure:
    every = np.array([each.time for each in history.increments])
    if times is None:
        chosen = [end - 1 for *_, end in _steps(history)][-MOST_TIMES:]
    else:
        chosen = [int(np.argmin(np.abs(every - time))) for time in times]
    figure = new_figure(7.2, 1.2 + 1.6 * len(chosen))
    axes = np.atleast_1d(figure.subplots(len(chosen), sharex=True, sharey=True))
    for ax, i in zip(axes, chosen, strict=True):
        contact = _along(history, history.increments[i].contact)
        look: Any = {"facecolor": "0.9", "edgecolor": "0.4", "linestyle": ":"}
        ax.fill_between(contact.x, -contact.bound, contact.bound, label="friction bound", **look)
        ax.plot(contact.x, contact.shear, "--", color=SHEAR, label="shear on body 2")
        mark_states(ax, contact.status, contact.x, contact.shear)
        ax.set_title(f"time {every[i]:g}, step {plain(history.increments[i].name)}")
        ax.set_ylabel(f"stress [{plain(history.problem.units['stress'])}]")
        legend_beside(ax)
    axes[-1].set_xlabel(f"position along $\\Gamma_c$ [{plain(history.problem.units['length'])}]")
    return figure


def _points(history: History) -> Figure:
    time = [0.0, *(each.time for each in history.increments)]
    table, count = history.point_table(), len(history.points)
    length = plain(history.problem.units["length"])
    axes = [name for name in ("ux", "uy") if name in table]
    figure = new_figure(7.2, 1.2 + 2.0 * len(axes))
    for i, (ax, name) in enumerate(zip(np.atleast_1d(figure.subplots(len(axes), sharex=True)), axes, strict=True)):
        for k, point in enumerate(history.points):
            look: Any = {"color": f"{0.65 * k / max(count - 1, 1):.3f}", "markersize": 3}
            label = f"{plain(point.name)} (body {point.body})"
            ax.plot(time, [0.0, *table[name][k::count]], f"{'os^Dvx*'[k % 7]}-", label=label, **look)
        ax.set_ylabel(f"{name[0]}$_{name[1]}$ [{length}]")
        if i == 0:
            ax.set_title(f"{plain(history.problem.title)}: displacement of the points")
            legend_beside(ax)
    ax.set_xlabel("time, in steps")
    return figure


main_figure.register(History, draw_history)

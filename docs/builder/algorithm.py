"""The picture of one step in README: ``python docs/builder/algorithm.py`` draws it from a run on a coarse mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import verification as vf
from fem1d2d.mesh import Floats
from verification.figures.style import BODIES, FILLS, STATES, new_figure, save, styled

#: Two blocks, of which the upper one is pushed down by the middle of its top; body 2 is the Neumann body.
BLOCK: dict[str, Any] = {"shape": "rectangle", "x": [0, "1.6"], "cells": [12, 5], "poisson": "0.3"}
PRESSED = {"parts": {"pressed": {"side": "top", "x": ["0.4", "1.2"]}}, "prescribed": {"pressed": [0, "-0.02"]}}
PROBLEM = {
    "body1": {**BLOCK, "y": ["-0.7", 0], "young": 50_000, "fixed": ["bottom"]},
    "body2": {**BLOCK, "y": [0, "0.7"], "young": 70_000, **PRESSED},
    "contact": {"friction": "0.3", "radius": "0.2"},
    "iteration": {"neumann_body": 2, "theta": "1/2"},
}

#: The step that is drawn: the forces have not settled yet.
STEP = 1

#: Enlargement of displacements, and the length of the largest arrow in mm.
SCALE, ARROW = 6.0, 0.3

NAME: dict[str, Any] = {"fontsize": 13, "ha": "center", "bbox": {"facecolor": "white", "linewidth": 0, "pad": 2}}


def drawn() -> Figure:
    """Step I, step II and the relaxation of one step, in the roles of Section 3."""
    run = vf.run(vf.Problem.from_dict(PROBLEM))
    step, grid = run.iterates[STEP], run.pair.neumann.grid
    g, image = step.g[grid.normal] / grid.weights, step.image[grid.normal] / grid.weights
    lower, upper = replace(run, iterates=run.iterates[: STEP + 1]).displacements
    unit = ARROW / max(g.max(), image.max())
    with styled():
        figure = new_figure(10.2, 3.5)
        push, press, mix = figure.subplots(1, 3)
        surface = _body(push, run, 2, upper)
        _arrows(push, surface - np.outer(unit * g, [0, 1]), surface)
        push.text(0.8, 0.3, "body 2", **NAME)
        push.text(0.8, surface[:, 1].min() - 0.3, "forces g", **NAME)
        _body(press, run, 1, lower)
        press.plot(*surface.T, color=BODIES[1], linewidth=4)
        _arrows(press, surface, surface + np.outer(unit * image, [0, 1]))
        press.text(0.8, -0.5, "body 1", **NAME)
        press.text(0.8, surface[:, 1].max() + 0.3, "forces T g", **NAME)
        push.set(ylim=(-0.52, 0.72))
        press.set(ylim=(-0.72, 0.52))
        for ax in (push, press):
            ax.set(xlim=(-0.1, 1.7), aspect="equal")
            ax.set_axis_off()
        _mixture(mix, grid.x, g, image, float(run.theta))
        titles = "1. Load body 2", "2. Press body 1 against it", "3. Mix old and new forces"
        for ax, title in zip((push, press, mix), titles, strict=True):
            ax.set_title(title, fontsize=14, weight="bold", loc="center")
        figure.supxlabel("Then step 1 again with the mixed forces, until T g = g.", fontsize=13)
    return figure


def _body(ax: Axes, run: vf.Run, number: int, u: Floats) -> Floats:
    """Draw a deformed body; returns its contact nodes as they are drawn."""
    body = run.bodies.elastic[number - 1]
    points = body.mesh.points + SCALE * u
    look = {"facecolor": FILLS[number - 1], "edgecolor": BODIES[number - 1], "linewidth": 0.6}
    ax.add_collection(PolyCollection(list(points[body.mesh.cells]), **look))
    return np.asarray(points[body.nodes])


def _arrows(ax: Axes, begin: Floats, end: Floats) -> None:
    """Forces on body 2, one at each contact node that carries one."""
    for start, stop in zip(begin, end, strict=True):
        if stop[1] > start[1]:
            look = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "linewidth": 1.3, "color": "black"}
            ax.annotate("", stop, start, arrowprops=look)


def _mixture(ax: Axes, x: Floats, g: Floats, image: Floats, theta: float) -> None:
    """The three forces over Gamma_c."""
    rows = (
        ("g", g, "o--", BODIES[1]),
        ("T g", image, "^-", "#000000"),
        ("(1 − θ) g + θ T g", (1 - theta) * g + theta * image, "s-", STATES["stick"]),
    )
    for name, values, style, colour in rows:
        ax.plot(x, values, style, color=colour, markersize=5, label=name)
    ax.legend(loc="lower center", fontsize=12)
    ax.set(xticks=[], yticks=[], box_aspect=0.69)
    ax.set_ylabel("pressure", fontsize=13)
    ax.set_xlabel("along the contact", fontsize=13)


if __name__ == "__main__":
    save(drawn(), Path(__file__).parents[1] / "algorithm.svg")

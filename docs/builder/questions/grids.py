"""Two grids that do not match: the pressure that three transfers make of a constant one, on finer and finer meshes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from fem1d2d import mortar

LABEL = "Pressure between two pressed blocks with three transfers, and how far it varies over the number of cells"

#: Each mesh of the page, this many times as fine.
FINER = (1, 2, 4, 10)

#: Heights of the blocks, Young's moduli, and how far they are pressed together.
LOWER, UPPER, PRESSED = (0.3, 7.0), (0.5, 2.0), 0.01


def nearest(x: Any, y: Any) -> Any:
    """The matrix that takes the value of the nearest of the nodes y."""
    return np.eye(len(y))[np.abs(x[:, None] - y).argmin(axis=1)]


def interpolated(x: Any, y: Any) -> Any:
    """The matrix of linear interpolation between the nodes y."""
    return np.array([np.interp(x, y, unit) for unit in np.eye(len(y))]).T


#: The transfers, by name, with their colours; the forces go back by the transpose.
TRANSFERS: dict[str, tuple[Callable[[Any, Any], Any], str]] = {
    "nearest node": (nearest, "red"),
    "interpolation": (interpolated, "orange"),
    "mortar": (mortar, "blue"),
}


def blocks(finer: int) -> vf.Problem:
    """Two blocks on rollers, with 8 cells along Gamma_c below and 6 above, this many times as fine."""
    block, rollers = {"shape": "rectangle", "x": [0, 1], "poisson": 0.3}, {"left": [0, "free"]}
    (deep, E1), (high, E2) = LOWER, UPPER
    below = {"y": [-deep, 0], "young": E1, "prescribed": rollers | {"bottom": ["free", 0]}, "cells": [8, 2]}
    above = {"y": [0, high], "young": E2, "prescribed": rollers | {"top": ["free", -PRESSED]}, "cells": [6, 3]}
    bodies = {"body1": block | below, "body2": block | above}
    for body in bodies.values():
        body["cells"] = [finer * n for n in body["cells"]]
    return vf.Problem.from_dict({**bodies, "contact": {"friction": 0}})


def pressure(pair: vf.ContactPair, P: Any) -> Any:
    """The pressure at the contact nodes over the exact one, all of them closed, with the transfer P."""
    bodies = pair.contact, pair.neumann
    F1, F2 = (body.inverse[body.grid.normal, body.grid.normal] for body in bodies)
    u1, u2 = (body.unloaded[body.grid.normal] for body in bodies)
    exact = PRESSED / ((1 - 0.3**2) * sum(height / E for height, E in (LOWER, UPPER)))
    return np.linalg.solve(F1 + P @ F2 @ P.T, u1 - P @ u2) / pair.interface.contact.weights / exact


@cache
def data() -> dict[str, Any]:
    """The pressures of each transfer on each mesh, and by how much each varies."""
    pairs = [vf.build(blocks(finer)) for finer in FINER]
    grids = [(pair.interface.contact.x, pair.interface.neumann.x) for pair in pairs]
    cells = [(len(x) - 1, len(y) - 1) for x, y in grids]
    found = {
        name: [pressure(pair, make(x, y)) for pair, (x, y) in zip(pairs, grids, strict=True)]
        for name, (make, _) in TRANSFERS.items()
    }
    varies = {name: [100 * float(np.ptp(one)) for one in of] for name, of in found.items()}
    coarse, fine = varies["nearest node"][0], varies["nearest node"][-1]
    right = f"{fine:.0f} percent"
    scenes = {}
    for i, (name, (_, colour)) in enumerate(TRANSFERS.items()):
        for j, (x, _) in enumerate(grids):
            p = found[name][j]
            kept = varies[name][j] < 1e-6
            scenes[(i, j)] = scene(
                f"{name.capitalize()}, {cells[j][0]} cells below and {cells[j][1]} above: "
                + (
                    "the pressure is constant."
                    if kept
                    else f"the pressure varies by {varies[name][j]:.1f} percent of the true one, largest less smallest."
                )
                + ("" if kept or not j else f" On {cells[0][0]} and {cells[0][1]} it was {varies[name][0]:.1f}."),
                [line(zip(x, p, strict=True), colour), dots(zip(x, p, strict=True), colour)],
                [
                    mark
                    for other, (_, shade) in TRANSFERS.items()
                    for mark in (
                        line(
                            [(c, v) for (c, _), v in zip(cells, varies[other], strict=True)],
                            shade,
                            dashed=other != name,
                        ),
                        dots([(c, v) for (c, _), v in zip(cells, varies[other], strict=True)], shade, hollow=True),
                        note(cells[1][0], varies[other][1] + 4, other, shade),
                    )
                ]
                + [dots([(cells[j][0], varies[name][j])], colour)],
                rows=[(f"{a:.3f}", f"{b:.4f}") for a, b in zip(x, p, strict=True)],
            )
    return widget(
        question=f"Each node of one grid takes the value of the nearest node of the other. On {cells[0][0]} and "
        f"{cells[0][1]} cells the pressure then varies by {coarse:.0f} percent of its true value, which is constant. "
        f"By how much does it vary on meshes that are {FINER[-1]} times as fine?",
        answers=[right, f"{coarse / np.sqrt(FINER[-1]):.0f} percent", f"{coarse / FINER[-1]:.0f} percent"],
        right=right,
        wrong={
            f"{coarse / np.sqrt(FINER[-1]):.0f} percent": "such errors do not average out.",
            f"{coarse / FINER[-1]:.0f} percent": "so it is with a consistent transfer, which this is not.",
        },
        why="a finer mesh does not help. On every mesh some nodes above take the force of two nodes below, and others "
        "that of one, so the error stays as large and only its waves become shorter. Choose another transfer and other "
        "meshes.",
        sliders=[
            slider("transfer", "transfer", TRANSFERS, 0),
            slider("mesh", "cells", [f"{a} and {b}" for a, b in cells], len(FINER) - 1),
        ],
        charts=[
            chart(
                r"Pressure along $\Gamma_c$",
                axis(r"position along $\Gamma_c$", -0.03, 1.03),
                axis("pressure, the exact one = 1", 0.6, 1.4),
                fixed=[line([(0, 1), (1, 1)], "grey", dashed=True), note(0, 1.35, "dashed: exact", "grey")],
                before=[
                    dots(zip(grids[0][0], found["nearest node"][0], strict=True), "red", hollow=True),
                    note(1, 1.35, "circles: nearest node", "red", anchor="end"),
                ],
            ),
            chart(
                "Variation of the pressure over the number of cells",
                axis(r"cells of the lower block along $\Gamma_c$", 0, 90),
                axis("variation of the pressure, percent", -4, 80),
            ),
        ],
        head=("position", "pressure, the exact one = 1"),
        scenes=scenes,
    )

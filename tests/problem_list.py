"""Named problems of many kinds as dictionaries of the problem file: both sides of a comparison solve them all."""

from __future__ import annotations

from typing import Any


def plates(**changes: Any) -> dict[str, Any]:
    """A small Section 6; keyword ``body1_young`` changes ``body1.young``, and so on."""
    problem: dict[str, Any] = {
        "body1": {
            "shape": "rectangle", "x": [0, 2], "y": ["-0.3", 0], "cells": [20, 3], "young": 70000, "poisson": "0.3",
            "fixed": ["bottom"],
        },
        "body2": {
            "shape": "rectangle", "x": ["0.4", "1.6"], "y": [0, "0.3"], "cells": [12, 3], "young": 20000,
            "poisson": "0.3", "prescribed": {"top": [0, "-0.015"]},
        },
        "contact": {"friction": "0.2", "radius": "0.2"},
        "iteration": {"neumann_body": 1, "theta": "0.7", "tolerance": 1e-12, "max_iterations": 3000},
    }  # fmt: skip
    for key, value in changes.items():
        table, name = key.split("_", 1)
        if value is None:
            problem[table].pop(name, None)
        else:
            problem[table][name] = value
    return problem


def bars(**changes: Any) -> dict[str, Any]:
    """Two bars."""
    problem: dict[str, Any] = {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, 1], "cells": 3, "young": 3, "fixed": ["left"]},
        "body2": {"shape": "interval", "x": [1, 3], "cells": 5, "young": 2, "prescribed": {"right": "-0.1"}},
        "contact": {},
        "iteration": {"neumann_body": 2, "theta": "0.3", "tolerance": 1e-12, "max_iterations": 3000},
    }
    for key, value in changes.items():
        table, name = key.split("_", 1)
        problem[table][name] = value
    return problem


PROBLEMS: dict[str, dict[str, Any]] = {
    "Section 6, centred": plates(),
    "local law": plates(contact_law="local", contact_radius=None),
    "no friction": plates(contact_friction=0),
    "much friction": plates(contact_friction="0.8"),
    "left edges aligned": plates(body2_x=[0, "1.2"]),
    "part of the top moved, so that it opens": plates(
        body2_prescribed={"left": ["0", "free"], "top": [0, "-0.01"]}, body2_x=[0, "1.2"],
        contact_interval=["0.1", "1.2"],
    ),
    "pushed sideways": plates(body2_prescribed={"top": ["0.01", "-0.01"]}, contact_friction="0.4"),
    "a gap that closes in part": plates(
        body2_prescribed={"top": ["0", "-0.02"]}, contact_gap="0.012", body2_body_force=[0, -3000]
    ),
    "a gap that never closes": plates(contact_gap="0.1"),
    "a bent plate": plates(
        body2_prescribed=None, body2_fixed=["left"], body2_traction={"right": [0, -40]},
        contact_interval=["0.8", "1.6"],
        contact_friction="0.3", body2_young=200000, body2_y=[0, "0.6"],
    ),
    "narrow below": plates(body1_x=["0.8", "1.2"], body1_cells=[4, 3]),
    "soft below": plates(body1_young=20000, body2_young=20000, iteration_theta="0.5"),
    "other units": plates(body1_young="7e-2", body2_young="2e-2"),
    "thin and long": plates(body1_y=["-0.1", 0], body1_cells=[20, 2], body2_y=[0, "0.05"], body2_cells=[12, 1]),
    "bars": bars(),
    "bars with a gap": bars(contact_gap="0.04"),
    "bars that part": bars(body2_prescribed={"right": "0.1"}),
    "bars under load": bars(body1_body_force=["0.2"], body2_prescribed={"right": "-0.01"}),
}  # fmt: skip

"""Problems that differ in everything the iteration may meet, each with a theta at which it converges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

LOWER = {"shape": "rectangle", "x": [0, 2], "y": ["-0.3", 0], "cells": [10, 2], "young": 70000, "poisson": "0.3"}
UPPER = {"shape": "rectangle", "x": ["0.4", "1.6"], "y": [0, "0.3"], "cells": [6, 2], "young": 20000, "poisson": "0.3"}
PRESSED = {"top": [0, "-0.015"]}
SHEARED = {"top": ["0.006", "-0.015"]}
SECTION_6 = {
    "body1": LOWER | {"fixed": ["bottom"]},
    "body2": UPPER | {"prescribed": PRESSED},
    "contact": {"friction": "0.2", "radius": "0.2"},
    "iteration": {"neumann_body": 1, "theta": "0.7"},
}


def changed(base: Mapping[str, Any] = SECTION_6, **tables: Mapping[str, Any]) -> dict[str, Any]:
    """The problem with some keys of some tables replaced."""
    return {**base, **{name: {**base.get(name, {}), **keys} for name, keys in tables.items()}}


def bars(length1: Any, length2: Any, young1: Any, young2: Any, theta: Any, **contact: Any) -> dict[str, Any]:
    """Two bars, the second pushed against the first, both with a body force."""
    one = {"shape": "interval", "x": [0, length1], "cells": 3, "young": young1, "fixed": ["left"], "body_force": "0.1"}
    two = {"shape": "interval", "x": [length1, length1 + length2], "cells": 2, "young": young2, "body_force": "-0.2"}
    pushed = {"prescribed": {"right": "-0.2"}}
    return {"dimension": 1, "body1": one, "body2": two | pushed, "contact": contact, "iteration": {"theta": theta}}


PROBLEMS: dict[str, dict[str, Any]] = {
    "section 6": SECTION_6,
    "roles of section 3": changed(
        body1={"young": 20000}, body2={"young": 70000}, iteration={"neumann_body": 2, "theta": "0.6"}
    ),
    "without friction": changed(contact={"friction": 0}),
    "all stick": changed(contact={"friction": 1}),
    "sheared until it slips": changed(body2={"prescribed": SHEARED}, contact={"friction": "0.1"}),
    "local law": changed(body2={"prescribed": SHEARED}, contact={"law": "local"}),
    "wide kernel": changed(body2={"prescribed": SHEARED}, contact={"radius": "1.2", "friction": "0.3"}),
    "kernel narrower than a cell": changed(contact={"radius": "0.05", "friction": "0.02"}),
    "initial gap, lifted on one side": changed(
        body2={"prescribed": {"top": [0, "-0.006"]}, "traction": {"right": [0, 9000]}}, contact={"gap": "0.005"}
    ),
    "soft unit of stress": changed(body1={"young": "0.07"}, body2={"young": "0.02"}),
    "hard unit of stress": changed(body1={"young": 7 * 10**10}, body2={"young": 2 * 10**10}),
    "thin layer": changed(
        body2={"y": [0, "0.02"], "prescribed": {"top": ["0.001", "-0.001"]}}, iteration={"theta": "0.3"}
    ),
    "narrow lower body": changed(
        body1={"x": ["0.8", "1.4"], "cells": [3, 2]}, body2={"prescribed": SHEARED}, iteration={"theta": "0.4"}
    ),
    "nearly incompressible": changed(body1={"poisson": "0.49"}, body2={"poisson": "0.45", "prescribed": SHEARED}),
    "auxetic": changed(body1={"poisson": "-0.5"}, body2={"poisson": "-0.4", "prescribed": SHEARED}),
    "held by a side": changed(
        body1={"fixed": ["left"], "body_force": [0, -30]},
        contact={"interval": ["0.4", "1.6"]},
        iteration={"theta": "0.7"},
    ),
    "on rollers": changed(
        body1={"fixed": [], "prescribed": {"bottom": ["free", 0], "left": [0, "free"]}}, body2={"prescribed": SHEARED}
    ),
    "contact nodes held tangentially": changed(
        body1={
            "x": ["0.4", "1.6"],
            "cells": [6, 2],
            "fixed": [],
            "prescribed": {"bottom": [0, 0], "left": [0, "free"]},
        },
        body2={"prescribed": SHEARED},
    ),
    "bars": bars(1, 2, 3, 2, "0.2"),
    "bars with a gap": bars(2, 1, 1, 4, "0.6", gap="0.05"),
}

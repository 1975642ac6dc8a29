"""The problems on which statements about whole displacement fields are tried."""

from __future__ import annotations

from typing import Any

import numpy as np

#: The relative residual at which their runs end.
TOLERANCE = 1e-13

LOWER = {"shape": "rectangle", "x": [0, 2], "y": ["-0.3", 0], "cells": [10, 2], "young": 7, "poisson": "0.3"}
UPPER = {"shape": "rectangle", "x": ["0.4", "1.6"], "y": [0, "0.3"], "cells": [6, 2], "young": 2, "poisson": "0.3"}
RUN = {"tolerance": TOLERANCE, "max_iterations": 3000}


def _plates(lower: Any = None, upper: Any = None, **tables: Any) -> dict[str, Any]:
    """Two plates, the upper one pressed down."""
    return {
        "body1": {**LOWER, "fixed": ["bottom"], **(lower or {})},
        "body2": {**UPPER, "prescribed": {"top": [0, "-0.015"]}, **(upper or {})},
        "contact": {"friction": "0.2", "radius": "0.2", **tables.get("contact", {})},
        "iteration": {"neumann_body": 1, "theta": "0.7", **RUN, **tables.get("iteration", {})},
    }


#: Both roles; nodes that stick, slip and are open; an initial gap; no friction; grids that differ; one dimension.
PROBLEMS: dict[str, dict[str, Any]] = {
    "pressed": _plates(),
    "sheared, body 2 Neumann": _plates(
        {"young": 2},
        {"young": 7, "prescribed": {"top": ["0.006", "-0.015"]}},
        contact={"friction": "0.1"},
        iteration={"neumann_body": 2, "theta": "0.6"},
    ),
    "much friction": _plates(upper={"prescribed": {"top": ["0.004", "-0.015"]}}, contact={"friction": "0.6"}),
    "open in part, with a gap": _plates(
        upper={"prescribed": {"top": [0, "-0.006"]}, "traction": {"right": [0, "0.9"]}}, contact={"gap": "0.005"}
    ),
    "bent over an edge, body 2 Neumann": _plates(
        {"fixed": ["left"], "body_force": [0, "-0.003"]},
        contact={"interval": ["0.4", "1.6"]},
        iteration={"neumann_body": 2, "theta": "0.7"},
    ),
    "without friction": _plates(contact={"friction": 0}),
    "sheared, a finer contact grid": _plates(
        upper={"cells": [9, 2], "prescribed": {"top": ["0.004", "-0.015"]}}, contact={"friction": "0.1"}
    ),
    "open in part, a finer Neumann grid": _plates(
        {"young": 2},
        {"young": 7, "cells": [11, 2], "prescribed": {"top": [0, "-0.006"]}, "traction": {"right": [0, "0.9"]}},
        iteration={"neumann_body": 2, "theta": "0.7"},
    ),
    "bars with a gap": {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, 2], "cells": 3, "young": 1, "fixed": ["left"], "body_force": "0.1"},
        "body2": {"shape": "interval", "x": [2, 3], "cells": 2, "young": 4, "prescribed": {"right": "-0.2"}},
        "contact": {"gap": "0.05"},
        "iteration": {"theta": "0.6", **RUN},
    },
}

SQUARE = {"shape": "rectangle", "cells": [3, 3], "poisson": 0, "young": 1}
#: Where Proposition 5.6 has an interval in which a run ends within some hundred steps.
CONVERGENT: dict[str, dict[str, Any]] = {
    "two bars": {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, 1], "cells": 6, "young": 2, "fixed": ["left"], "body_force": "0.1"},
        "body2": {"shape": "interval", "x": [1, 2], "cells": 6, "young": 2, "prescribed": {"right": "-0.1"}},
        "iteration": {**RUN},
    },
    "two short bars": {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, "0.5"], "cells": 4, "young": 1, "fixed": ["left"]},
        "body2": {"shape": "interval", "x": ["0.5", 1], "cells": 4, "young": 2, "prescribed": {"right": "-0.1"}},
        "contact": {"gap": "0.02"},
        "iteration": {**RUN},
    },
}
#: Plane bodies; :func:`verification.ledger.convergence.inside` gives them a friction below their C_2.
PLANE: dict[str, dict[str, Any]] = {
    "squares": {
        "body1": {**SQUARE, "x": [0, 1], "y": [-1, 0], "fixed": ["bottom"]},
        "body2": {**SQUARE, "x": [0, 1], "y": [0, 1], "prescribed": {"top": ["0.01", "-0.05"]}},
        "contact": {"friction": 0, "radius": "0.4"},
        "iteration": {**RUN},
    },
    "plates whose grids differ": _plates(
        {"young": 1}, {"young": 1, "cells": [7, 2], "prescribed": {"top": ["0.004", "-0.015"]}}, contact={"friction": 0}
    ),
}


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """Two plates with everything drawn at random; a third have grids that differ."""
    pick = lambda low, high: round(float(rng.uniform(low, high)), 3)
    lower: dict[str, Any] = {"young": round(10 ** rng.uniform(-1, 1), 3), "poisson": pick(-0.3, 0.45)}
    upper: dict[str, Any] = {"young": round(10 ** rng.uniform(-1, 1), 3), "poisson": pick(-0.3, 0.45)}
    upper["prescribed"] = {"top": [pick(-0.01, 0.01), pick(-0.02, -0.005)]}
    if rng.random() < 0.5:
        upper["traction"] = {"right": [0, pick(0, 0.3) * upper["young"]]}
    contact = {"friction": pick(0, 0.5), "radius": pick(0.2, 0.8), "gap": pick(0, 0.004)}
    iteration = {"neumann_body": int(rng.integers(1, 3)), "theta": "auto"}
    if rng.random() < 1 / 3:
        upper["cells"] = [int(rng.integers(3, 12)), 2]
    return _plates(lower, upper, contact=contact, iteration=iteration)

"""Problems of the ledger.

Inequalities are tested on random problems with loads and on named ones on which a printed bound is false, statements
about whole displacement fields on PROBLEMS.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import meshio
import numpy as np

import fem1d2d
from verification.problem.specification import Problem

#: Heights over lengths: a thin layer to a column.
SHAPES = [Fraction(1, 20), Fraction(1, 6), Fraction(1, 3), Fraction(1), Fraction(2)]

CELL = Fraction(1, 5)


def three_digits(value: float) -> Fraction:
    """The number of three significant digits next to a value, exactly.

    Examples
    --------
    >>> three_digits(0.123456)
    Fraction(123, 1000)
    """
    return Fraction(f"{value:.3g}")


def problem(random: np.random.Generator, friction: Any = None, *, matching: bool = True, **iteration: Any) -> Problem:
    """Draw two rectangles, 2 to 9 contact nodes; one may jut out over the other on either side.

    E1/E2 from 1/50 to 50, either role, friction 0, 0.1, .., 1 unless k is given.  The lower body is clamped at its
    bottom, the top of the upper one is pushed and sheared, its sides carry tractions, and in one case of three there is
    a gap.  Without ``matching`` the grids are drawn apart and the wider body has the Neumann problem: the other one has
    nodes at both ends of Gamma_c.  Further keywords are keys of the table ``iteration``.
    """
    whole = lambda low, high: int(random.integers(low, high + 1))
    count = whole(1, 8)
    wider = whole(0, 1)  # which body juts out
    left, right = whole(0, 2), whole(0, 2)
    ends = {wider: (-left, count + right), 1 - wider: (0, count)}
    young = {0: Fraction(1000), 1: 1000 * three_digits(50 ** random.uniform(-1, 1))}
    bodies: list[dict[str, Any]] = []
    for i in (0, 1):
        x = [CELL * end for end in ends[i]]
        height = (x[1] - x[0]) * SHAPES[random.integers(len(SHAPES))]
        cells, poisson = [ends[i][1] - ends[i][0], whole(1, 3)], ["0", "0.3", "0.45"][random.integers(3)]
        bodies.append(rectangle(x, [-height, 0] if i == 0 else [0, height], cells, young[i], poisson))
    bodies[0]["fixed"] = ["bottom"]
    slip, push = Fraction(whole(-20, 20), 1000), -Fraction(whole(1, 50), 1000)
    bodies[1]["prescribed"] = {"top": [slip * height, push * height]}
    bodies[1]["traction"] = {side: [whole(-20, 20), whole(-20, 20)] for side in ("left", "right")}
    drawn = Fraction(whole(0, 10), 10)
    radius = CELL * Fraction(3, 4) * whole(1, 3)
    gap = [0, 0, CELL / 100][random.integers(3)]
    neumann_body = whole(1, 2)
    if not matching:
        for body in bodies:
            body["cells"] = [whole(1, 9), body["cells"][1]]
        radius *= 3  # some Neumann node lies within it
        neumann_body = neumann_body if left == right == 0 else wider + 1
    return Problem.from_dict(
        {
            "body1": bodies[0],
            "body2": bodies[1],
            "contact": {"friction": drawn if friction is None else friction, "radius": radius, "gap": gap},
            "iteration": {"neumann_body": neumann_body, **iteration},
        }
    )


def rectangle(x: Any, y: Any, cells: Any, young: Any, poisson: Any, **more: Any) -> dict[str, Any]:
    """The table of a rectangle in a problem file."""
    return {"shape": "rectangle", "x": x, "y": y, "cells": cells, "young": young, "poisson": poisson, **more}


def _clamped_plate(thickness: str) -> Mapping[str, Any]:
    """A thin plate, clamped at one end, under a block: the tangential trace is larger in L2 than in H^1/2."""
    return {
        "body1": rectangle([0, 2], [f"-{thickness}", 0], [10, 1], 1, 0, fixed=["left"]),
        "body2": rectangle(["0.2", 2], [0, 1], [9, 2], 1, 0, fixed=["top"]),
        "contact": {"friction": 1, "radius": "0.5", "gap": 1},
    }


def _between_rollers(thickness: str) -> Mapping[str, Any]:
    """Two thin layers that are held at one end and may slide along rollers, so that neither can bend."""
    held = lambda side: {side: ["free", 0], "left": [0, 0]}
    return {
        "body1": rectangle([0, 2], [f"-{thickness}", 0], [4, 1], 1, 0, prescribed=held("bottom")),
        "body2": rectangle([0, 2], [0, thickness], [4, 1], 1, 0, prescribed=held("top")),
        "contact": {"interval": ["0.5", 2], "friction": 100, "radius": "0.5", "gap": 1},
    }


#: Problems on which a bound is false as printed, as the problem file reads them.  Loads do not matter: every pair of
#: forces in one piece of T occurs for suitable loads.
NAMED: Mapping[str, Mapping[str, Any]] = {
    **{f"plate of thickness {t} clamped at one end": _clamped_plate(t) for t in ("0.05", "0.02", "0.01")},
    # the bound (5.30) grows as k for m -> 0, its left side as k^2
    "layer of a ten-thousandth on a block": {
        "body1": rectangle([0, 1], ["-0.125", 0], [2, 2], 1, 0, fixed=["bottom"]),
        "body2": rectangle([0, 1], [0, "0.0001"], [2, 1], 1, 0, prescribed={"top": [-1, 0]}),
        "contact": {"friction": 1, "radius": "0.5", "gap": 1},
    },
}

#: The problems that are decided with enclosures: on the last one equal sides differ in doubles by more than ALLOWANCE.
ENCLOSED: Mapping[str, Mapping[str, Any]] = {
    **NAMED,
    # much friction: C_tr into L2 is 78, into H^1/2 it is 1
    "layers of a ten-thousandth between rollers": _between_rollers("0.0001"),
}


#: The relative residual at which their runs end.
TOLERANCE = 1e-13

LOWER = rectangle([0, 2], ["-0.3", 0], [10, 2], 7, "0.3")
UPPER = rectangle(["0.4", "1.6"], [0, "0.3"], [6, 2], 2, "0.3")
RUN = {"tolerance": TOLERANCE, "max_iterations": 3000}


def _plates(lower: Any = None, upper: Any = None, **tables: Any) -> dict[str, Any]:
    """Two plates, the upper one pressed down."""
    return {
        "body1": {**LOWER, "fixed": ["bottom"], **(lower or {})},
        "body2": {**UPPER, "prescribed": {"top": [0, "-0.015"]}, **(upper or {})},
        "contact": {"friction": "0.2", "radius": "0.2", **tables.get("contact", {})},
        "iteration": {"neumann_body": 1, "theta": "0.7", **RUN, **tables.get("iteration", {})},
    }


#: Both roles; nodes that stick, slip and are open; an initial gap; no friction; grids that differ; an upright line that
#: is named; one dimension.
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
    "side by side, grids that differ": {
        "body1": rectangle(["-0.3", 0], [0, "1.2"], [2, 6], 7, "0.3", fixed=["left"]),
        "body2": rectangle([0, "0.3"], [0, "1.2"], [2, 5], 2, "0.3", prescribed={"right": ["-0.015", "0.006"]}),
        "contact": {"surface": ["right", "left"], "friction": "0.1", "radius": "0.3"},
        "iteration": {"neumann_body": 1, "theta": "0.7", **RUN},
    },
    "bars with a gap": {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, 2], "cells": 3, "young": 1, "fixed": ["left"], "body_force": "0.1"},
        "body2": {"shape": "interval", "x": [2, 3], "cells": 2, "young": 4, "prescribed": {"right": "-0.2"}},
        "contact": {"gap": "0.05"},
        "iteration": {"theta": "0.6", **RUN},
    },
}

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
#: Plane bodies; :class:`verification.ledger.convergence.RunsOfLevel` gives them a friction below their C_2.
PLANE: dict[str, dict[str, Any]] = {
    "squares": {
        "body1": rectangle([0, 1], [-1, 0], [3, 3], 1, 0, fixed=["bottom"]),
        "body2": rectangle([0, 1], [0, 1], [3, 3], 1, 0, prescribed={"top": ["0.01", "-0.05"]}),
        "contact": {"friction": 0, "radius": "0.4"},
        "iteration": {**RUN},
    },
    "plates whose grids differ": _plates(
        {"young": 1}, {"young": 1, "cells": [7, 2], "prescribed": {"top": ["0.004", "-0.015"]}}, contact={"friction": 0}
    ),
}


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """Two plates with everything drawn at random; a third have grids that differ, a quarter meet on an upright line."""
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
    plates = _plates(lower, upper, contact=contact, iteration=iteration)
    return quarter_turn(plates, [UPPER["x"][0], UPPER["x"][1]]) if rng.random() < 1 / 4 else plates


#: Where each side goes by a quarter turn to the left.
TURNED = {"bottom": "right", "right": "top", "top": "left", "left": "bottom"}


def quarter_turn(plates: Mapping[str, Any], meet: Any) -> dict[str, Any]:
    """Two plates turned to the left by 90 degrees: body 2 lies left of body 1, and named sides meet on an upright line.

    ``meet`` are the ends of Gamma_c.  Diagonals of cells may run the other way.
    """
    turned = dict(plates)
    for name, side in (("body1", "left"), ("body2", "right")):
        body = dict(plates[name])
        (low, high), negative = body["y"], lambda v: -Fraction(v)
        body |= {"x": [negative(high), negative(low)], "y": body["x"], "cells": body["cells"][::-1]}
        if "fixed" in body:
            body["fixed"] = [TURNED[old] for old in body["fixed"]]
        for key in {"prescribed", "traction"} & body.keys():
            body[key] = {TURNED[old]: [negative(y), x] for old, (x, y) in body[key].items()}
        body["parts"] = {"facing": {"side": side, "y": meet}}
        turned[name] = body
    turned["contact"] = {**plates["contact"], "surface": ["facing", "facing"]}
    return turned


# --- bodies that meet along a slope or a curve, as mesh files

#: Ends in x of the contact body and of the Neumann body, which faces all of it, and the height of a body.
ENDS, LONGER, HEIGHT = (0.4, 1.6), (0.2, 1.8), 0.3


@cache
def _folder() -> TemporaryDirectory[str]:
    """A folder for mesh files, which is removed when the process ends."""
    return TemporaryDirectory(prefix="ndtheory-ledger-")


def curved(random: np.random.Generator) -> dict[str, Any]:
    """Two bodies along ``y = a x + b x^2`` with everything drawn at random; half of them are pressed in.

    Their grids along Gamma_c differ in most draws.
    """
    pick = lambda low, high: round(float(random.uniform(low, high)), 3)
    a, b = pick(-0.5, 0.5), [0.0, pick(-0.3, 0.3)][random.integers(2)]
    line = lambda x: a * x + b * x**2
    young = [round(10 ** random.uniform(-1, 1), 3) for _ in range(2)]
    apart = pick(-0.004, 0) if random.random() < 1 / 2 else pick(0, 0.004)
    neumann_body, both = int(random.integers(1, 3)), ((-HEIGHT, 0.0), (apart, HEIGHT + apart))
    bodies = [
        {"mesh": _written(LONGER if i == neumann_body else ENDS, y, int(random.integers(4, 9)), line)}
        | {"young": E, "poisson": pick(-0.3, 0.45)}
        for i, (y, E) in enumerate(zip(both, young, strict=True), 1)
    ]
    return {
        "body1": bodies[0] | {"fixed": ["bottom"]},
        "body2": bodies[1] | {"prescribed": {"top": [pick(-0.01, 0.01), pick(-0.02, -0.005)]}},
        "contact": {"surface": ["top", "bottom"], "friction": pick(0, 0.5), "radius": pick(0.3, 0.8)},
        "iteration": {"neumann_body": neumann_body, "theta": "auto"},
    }


def _written(x: tuple[float, float], y: tuple[float, float], columns: int, line: Any) -> str:
    """The mesh file of a plate, sheared upwards by the height of a line."""
    flat = fem1d2d.rectangle(x, y, (columns, 2))
    points = flat.points + np.column_stack([np.zeros(len(flat.points)), line(flat.points[:, 0])])
    path = Path(_folder().name) / f"{len(list(Path(_folder().name).iterdir()))}.msh"
    write(path, plate=replace(flat, points=points))
    return str(path)


def write(path: Path, **bodies: fem1d2d.Mesh) -> None:
    """Write bodies with the same names of sides as Gmsh does, bodies and sides as physical groups."""
    blocks, tags, number, first = list[Any](), list[Any](), dict[str, int](), 0
    for body, mesh in bodies.items():
        for name, cells in {**mesh.sides, body: mesh.cells}.items():
            blocks.append(("triangle" if name == body else "line", cells + first))
            tags.append(np.full(len(cells), number.setdefault(name, len(number) + 1)))
        first += len(mesh.points)
    written = meshio.Mesh(
        np.pad(np.concatenate([mesh.points for mesh in bodies.values()]), ((0, 0), (0, 1))),
        blocks,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array([tag, 1 + (name in bodies)]) for name, tag in number.items()},
    )
    meshio.write(path, written, file_format="gmsh22", binary=False)

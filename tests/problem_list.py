"""The problems of the tests, by name, and small builders of more: dictionaries of the problem file, and one file.

Numbers are whole or decimals in quotes, so that they are exact.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

LOWER = {"shape": "rectangle", "x": [0, 2], "y": ["-0.3", 0], "cells": [10, 2], "young": 70000, "poisson": "0.3"}
UPPER = {"shape": "rectangle", "x": ["0.4", "1.6"], "y": [0, "0.3"], "cells": [6, 2], "young": 20000, "poisson": "0.3"}
#: The Section 6 model on its coarsest mesh, with 7 contact nodes.
SECTION_6 = {
    "body1": LOWER | {"fixed": ["bottom"]},
    "body2": UPPER | {"prescribed": {"top": [0, "-0.015"]}},
    "contact": {"friction": "0.2", "radius": "0.2"},
    "iteration": {"neumann_body": 1, "theta": "0.7"},
}
SHEARED = {"top": ["0.006", "-0.015"]}


def changed(base: Mapping[str, Any] = SECTION_6, **tables: Mapping[str, Any]) -> dict[str, Any]:
    """The problem with some keys of some tables replaced, or taken out where they are None."""
    merged = {name: {**base.get(name, {}), **keys} for name, keys in tables.items()}
    return {**base, **{name: {k: v for k, v in table.items() if v is not None} for name, table in merged.items()}}


def small(**tables: Mapping[str, Any]) -> dict[str, Any]:
    """Section 6 on its coarsest mesh, the kernel wider than a cell by half."""
    return changed(changed(contact={"radius": "0.3"}), **tables)


def plates(**tables: Mapping[str, Any]) -> dict[str, Any]:
    """Section 6 with 13 contact nodes, iterated to rounding."""
    finer = changed(
        body1={"cells": [20, 3]}, body2={"cells": [12, 3]}, iteration={"tolerance": 1e-12, "max_iterations": 3000}
    )
    return changed(finer, **tables)


def blocks(
    width: Any = 1,
    heights: Sequence[Any] = (1, 1),
    cells: Sequence[Sequence[int]] = ((4, 2), (4, 2)),
    young: Sequence[Any] = (3, 2),
    poisson: Sequence[Any] = ("0.3", "0.3"),
    **tables: Any,
) -> dict[str, Any]:
    """Two rectangles of equal width, the lower one clamped below, the upper one pressed down at its top."""
    y = ([f"-{heights[0]}", 0], [0, heights[1]])
    body1, body2 = (
        {"shape": "rectangle", "x": [0, width], "y": y[i], "cells": list(cells[i])}
        | {"young": young[i], "poisson": poisson[i]}
        for i in range(2)
    )
    held = {"body1": body1 | {"fixed": ["bottom"]}, "body2": body2 | {"prescribed": {"top": [0, "-1/50"]}}}
    return changed(held, **tables)


def bars(
    lengths: Sequence[Any] = (1, 2),
    young: Sequence[Any] = (3, 2),
    cells: Sequence[int] = (3, 5),
    start: Any = 0,
    **tables: Mapping[str, Any],
) -> dict[str, Any]:
    """Two bars in a row, the first held at its left end, the second pushed at its right end."""
    ends = [start, start + lengths[0], start + lengths[0] + lengths[1]]
    one, two = ({"shape": "interval", "x": ends[i : i + 2], "cells": cells[i], "young": young[i]} for i in range(2))
    pushed = {"body1": one | {"fixed": ["left"]}, "body2": two | {"prescribed": {"right": "-0.1"}}}
    return changed({"dimension": 1, **pushed}, **tables)


def loaded_bars(lengths: Sequence[Any], young: Sequence[Any], theta: Any, **contact: Any) -> dict[str, Any]:
    """Two bars with body forces, the second pushed against the first."""
    one, two = {"body_force": "0.1"}, {"body_force": "-0.2", "prescribed": {"right": "-0.2"}}
    return bars(lengths, young, (3, 2), body1=one, body2=two, contact=contact, iteration={"theta": theta})


#: Coarse meshes, a theta for the role each names: all states, both laws, kernels wide and narrow, grips, units, bars.
PROBLEMS: dict[str, dict[str, Any]] = {
    "section 6": changed(),
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
        body1={"fixed": ["left"], "body_force": [0, -30]}, contact={"interval": ["0.4", "1.6"]}
    ),
    "on rollers": changed(
        body1={"fixed": [], "prescribed": {"bottom": ["free", 0], "left": [0, "free"]}}, body2={"prescribed": SHEARED}
    ),
    "contact nodes held tangentially": changed(
        body1={
            "x": ["0.4", "1.6"], "cells": [6, 2], "fixed": [], "prescribed": {"bottom": [0, 0], "left": [0, "free"]}
        },
        body2={"prescribed": SHEARED},
    ),
    "half of a symmetric model": changed(
        body1={"x": [0, "1.2"], "cells": [6, 2], "prescribed": {"left": [0, "free"]}},
        body2={"x": [0, "1.2"], "prescribed": {"top": [0, "-0.01"], "left": [0, "free"]}},
        iteration={"theta": "0.8"},
    ),
    "left edges aligned": changed(body2={"x": [0, "1.2"]}),
    "part of the top moved, so that it opens": changed(
        body2={"prescribed": {"left": ["0", "free"], "top": [0, "-0.01"]}, "x": [0, "1.2"]},
        contact={"interval": ["0.2", "1.2"]},
    ),
    "soft below": changed(body1={"young": 20000}, iteration={"theta": "0.5"}),
    "bars": loaded_bars((1, 2), (3, 2), "0.2"),
    "bars with a gap": loaded_bars((2, 1), (1, 4), "0.6", gap="0.05"),
}  # fmt: skip

#: The bodies do not touch at the limit: no force there to measure another by.
APART = {
    "a gap that never closes": changed(contact={"gap": "0.1"}),
    "bars that part": bars(body2={"prescribed": {"right": "0.1"}}),
}

#: `small` as a user may write it, every default in it.
SMALL = """\
title = "Small"
dimension = 2

[units]
length = "mm"
stress = "MPa"

[body1]
shape = "rectangle"
x = [0.0, 2.0]
y = [-0.3, 0.0]
cells = [10, 2]
young = 7.0e4
poisson = 0.3
fixed = ["bottom"]
body_force = [0.0, 0.0]

[body2]
shape = "rectangle"
x = [0.4, 1.6]
y = [0.0, 0.3]
cells = [6, 2]
young = 2.0e4
poisson = 0.3
prescribed = { top = [0.0, -0.015] }

[contact]
friction = 0.2
law = "nonlocal"
radius = 0.3

[iteration]
neumann_body = 1
theta = 0.7
tolerance = 1e-9
max_iterations = 500

[norm]
length = 1.0
"""


def put(text: str, key: str, value: str | None) -> str:
    """A problem file with one key set, added or, for None, taken out; a dotless key stands at the top."""
    table, _, name = key.rpartition(".")
    parts = re.split(r"^(?=\[)", text, flags=re.M)
    index = next((i for i, part in enumerate(parts) if part.startswith(f"[{table}]")), 0 if not table else len(parts))
    if index == len(parts):
        parts.append(f"[{table}]\n")
    lines = [line for line in parts[index].splitlines() if line.partition("=")[0].strip() != name]
    if value is not None:
        lines.insert(1 if table else 0, f"{name} = {value}")
    parts[index] = "\n".join(lines) + "\n"
    return "".join(parts)


def edited(text: str, edits: Mapping[str, str | None]) -> str:
    """A problem file with several keys put."""
    for key, value in edits.items():
        text = put(text, key, value)
    return text

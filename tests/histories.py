"""Loading histories for the tests: press, shear to and fro, lift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from problem_list import changed

#: A step: its increments, and where the top of the upper body is at its end.
Leg = tuple[int, Sequence[Any]]

#: Press, one and a quarter cycles of shear, lift.
PATH: Mapping[str, Leg] = {
    "press": (6, [0, "-0.01"]),
    "shear": (5, ["0.004", "-0.01"]),
    "back": (8, ["-0.004", "-0.01"]),
    "again": (8, ["0.004", "-0.01"]),
    "lift": (3, ["0.004", "0.001"]),
}

#: Two bodies whose grids differ, a local law, both roles.
VARIANTS: dict[str, dict[str, Any]] = {
    "one grid": {},
    "other roles": {
        "body1": {"young": 20000},
        "body2": {"young": 70000},
        "iteration": {"neumann_body": 2, "theta": "0.6"},
    },
    "grids that differ": {"body2": {"cells": [7, 2]}},
    "local law": {"contact": {"law": "local", "radius": None}},
    "local law of the contact grid": {"contact": {"law": "local-contact", "radius": None}},
    "gap": {"contact": {"gap": "0.001"}},
    "friction that varies": {"contact": {"friction": {"s": [0, "1.2"], "k": ["0.1", "0.3"]}}},
}


def steps(path: Mapping[str, Leg] = PATH, times: int = 1) -> list[dict[str, Any]]:
    """The tables ``[[step]]`` of a path, with so many times as many increments."""
    return [
        {"name": name, "increments": times * count, "body2": {"prescribed": {"top": list(top)}}}
        for name, (count, top) in path.items()
    ]


def pressed_and_sheared(path: Mapping[str, Leg] = PATH, times: int = 1, **tables: Any) -> dict[str, Any]:
    """The coarse Section 6 model with a history."""
    return changed(**tables) | {"step": steps(path, times)}

"""The problems that the benchmarks solve, at any size."""

from __future__ import annotations

from dataclasses import replace

import verification as vf


def problem() -> vf.Problem:
    """Section 6 with the roles of Section 3 (the contact body is body 1), about 2500 nodes, 61 of them on Gamma_c."""
    rectangle = {"shape": "rectangle", "poisson": 0.3}
    return vf.Problem.from_dict(
        {
            "body1": {**rectangle, "x": [0, 2], "y": [-0.3, 0], "cells": [100, 15], "young": 2.0e4,
                      "fixed": ["bottom"]},
            "body2": {
                **rectangle, "x": [0.4, 1.6], "y": [0, 0.3], "cells": [60, 15], "young": 7.0e4,
                "prescribed": {"top": [0, -0.015]},
            },
            "contact": {"friction": 0.2, "radius": 0.1},
            "iteration": {"theta": 0.6, "neumann_body": 2},
        }
    )  # fmt: skip


def longer(nodes: int) -> vf.Problem:
    """The same bodies with so many nodes on Gamma_c, 12 cells at a time, and as many rows of cells as before."""
    per = (nodes - 1) // 12
    return problem().changed(cells=((20 * per, 15), (12 * per, 15)))


def scaled(factor: float) -> vf.Problem:
    """The same bodies with all cells scaled; the grids keep matching."""
    base, rows = problem(), max(1, round(15 * factor))
    wide = lambda body, per: replace(body, cells=(per * max(1, round(20 * factor)), rows))
    return replace(base, body1=wide(base.body1, 5), body2=wide(base.body2, 3))


def of_section_6(nodes: int) -> tuple[vf.ContactPair, vf.Measured]:
    """The model with so many contact nodes, in the proportions of the built-in one, and its constants."""
    cells = nodes - 1
    rows = max(cells // 4, 1)
    pair = vf.build(vf.example("section6").changed(cells=((5 * cells // 3, rows), (cells, rows))))
    return pair, vf.measure(pair)

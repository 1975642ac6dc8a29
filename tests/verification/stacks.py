"""Plates on each other, for tests of more than two bodies."""

import numpy as np


def close(one, other, within=1e-8):
    return np.abs(np.subtract(one, other)).max() < within * np.abs(other).max()


def plate(y, young="2e4", cells=8, x=(0, 4), **more):
    body = {"shape": "rectangle", "x": list(x), "y": list(y), "cells": [cells, 2], "young": young, "poisson": "0.3"}
    return body | more


def touch(one, two, friction="0.3", **more):
    return {"bodies": [one, two], "surface": ["top", "bottom"], "friction": friction, "radius": 1} | more


def stack(cells=(8, 8, 8), frictions=("0.3", "0.2"), **more):
    """Three plates; the one in the middle floats."""
    return {
        "body1": plate((0, 1), cells=cells[0], fixed=["bottom"]),
        "body2": plate((1, 2), "7e4", cells=cells[1]),
        "body3": plate((2, 3), cells=cells[2], prescribed={"top": ["0.001", "-0.01"]}),
        "contact": [touch(1, 2, frictions[0]), touch(2, 3, frictions[1])],
        "iteration": {"theta": "auto"},
    } | more

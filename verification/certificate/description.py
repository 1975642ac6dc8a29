"""The discrete problem as a certificate holds it: bodies and what joins them, in rationals as texts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verification.interface.body import Body
from verification.interface.exact_bodies import ExactInterface, exact_points
from verification.interface.pair import ContactPair, pair_from
from verification.problem import Problem
from verification.problem.specs import BodySpec


def describe(problem: Problem, pair: ContactPair | None = None) -> dict[str, Any]:
    """The bodies of a plane problem and what joins them, in rationals as texts; see ``docs/json.md``.

    Coordinates of a mesh file are the doubles that were read from it.
    """
    pair = pair_from(problem) if pair is None else pair
    meshed = [side.mesh_body for side in (pair.body1, pair.body2)]
    points = [exact_points(spec, body) for spec, body in zip((problem.body1, problem.body2), meshed, strict=True)]
    along = [p[body.nodes, 0] for p, body in zip(points, meshed, strict=True)]
    joined = ExactInterface(pair, *(along if pair.contact_body == 1 else along[::-1]))
    rows = lambda matrix: None if matrix is None else [_texts(row) for row in matrix]
    return {
        "body1": _described(problem.body1, meshed[0], points[0]),
        "body2": _described(problem.body2, meshed[1], points[1]),
        "neumann_body": pair.neumann_body,
        "friction": str(pair.friction),
        "weights": _texts(joined.grid.weights),
        "kernel": rows(joined.exact_kernel if pair.friction else None),
        "transfer": rows(joined.exact_transfer),
    }


def same(one: Any, other: Any) -> bool:
    """True if two descriptions are about the same bodies.

    A key that is null counts as equal to one that is missing.  A later key is null at its default, as the transfer is
    on one grid, so that certificates written before are still about their bodies.

    >>> same({"transfer": None, "friction": "1/5"}, {"friction": "1/5"}), same({"friction": "1/5"}, {"friction": "0"})
    (True, False)
    """
    if not (isinstance(one, Mapping) and isinstance(other, Mapping)):
        return bool(one == other)
    return all(same(one.get(key), other.get(key)) for key in one.keys() | other.keys())


def _described(spec: BodySpec, body: Body, points: NDArray[Any]) -> dict[str, Any]:
    return {
        "points": [_texts(point) for point in points],
        "cells": body.mesh.cells.tolist(),
        "held": np.argwhere(body.known.known).tolist(),
        "surface": body.nodes.tolist(),
        "young": str(spec.young),
        "poisson": str(spec.poisson),
    }


def _texts(values: Iterable[Any]) -> list[str]:
    return [str(Fraction(value)) for value in values]

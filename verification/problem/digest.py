"""Digests of problems for stores, which outlive releases: a later key of the file changes no digest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from verification.problem.reading import read_problem
from verification.problem.specs import ProblemSpec
from verification.problem.tables import ProblemError
from verification.problem.vocabulary import vocabulary
from verification.problem.writing import plain, tables

_OF_A_BODY = (
    *("shape", "mesh", "x", "y", "cells", "young", "poisson", "parts", "fixed", "prescribed", "traction", "body_force"),
)

#: The keys of a digest that count whether they have their default or another value: those of 0.1.0.  This list never
#: grows: a key that comes later counts only where it says something, and digests of problems without it stay.
ALWAYS = {
    "dimension": (),
    "body1": _OF_A_BODY,
    "body2": _OF_A_BODY,
    "contact": ("interval", "friction", "law", "radius", "gap"),
    "iteration": ("neumann_body", "theta", "relaxation", "tolerance", "max_iterations"),
    "norm": ("length",),
}

#: What changes no number.
NEVER = ("title", "units")


def fingerprint(problem: ProblemSpec) -> str:
    """SHA-256 of what changes a number: all but title, labels of units, source and the places of mesh files.

    A key that is not among :data:`ALWAYS` is left out where the problem would be the same without it.
    """
    data = _without_defaults(problem, tables(problem))
    for name in NEVER:
        data.pop(name, None)
    for name in ("body1", "body2"):
        body = data[name]
        if "mesh" in body:
            body["mesh"] = body["mesh"].sha256
        if "fixed" in body:
            body["fixed"] = tuple(sorted(body["fixed"]))
    text = json.dumps(plain(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _without_defaults(problem: ProblemSpec, data: dict[str, Any]) -> dict[str, Any]:
    """The tables of a problem without later keys that have their default."""
    for name in [name for name in data if name not in (*ALWAYS, *NEVER)]:
        data = _shorter(problem, data, _without(data, name))
    for name, always in ALWAYS.items():
        for key in [key for key in data[name] if key not in always] if always else []:
            data = _shorter(problem, data, data | {name: _without(data[name], key)})
    return data


def _without(table: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key != name}


def _shorter(problem: ProblemSpec, data: dict[str, Any], less: dict[str, Any]) -> dict[str, Any]:
    """Fewer tables or keys of a problem, where it is the same without the others."""
    try:
        return less if tables(read_problem(less, problem.source, vocabulary())) == tables(problem) else data
    except ProblemError:  # the file must have them
        return data

"""A problem as the dictionary of its file, exactly."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

from ndtheory import exact
from ndtheory.number import LARGEST_EXPONENT
from verification.problem.meshes import MeshFile
from verification.problem.specs import BodySpec, ProblemSpec

#: Integers up to this size are doubles: readers of JSON agree on them.
LARGEST_INTEGER = 2**53


def tables(problem: ProblemSpec) -> dict[str, Any]:
    """The keys of the problem file with the values that their readers return.

    A key stands there where it has a value, its default or another; where there is none (no interval, no radius, no
    sides) it is left out.  Keys come in the order of the built-in files.
    """
    return {
        "title": problem.title,
        "dimension": problem.dimension,
        "units": dict(problem.units),
        "body1": _body(problem.body1),
        "body2": _body(problem.body2),
        "contact": _present(vars(problem.contact)),
        "iteration": {"neumann_body": problem.iteration.neumann_body} | vars(problem.iteration),
        "norm": {"length": problem.length},
    }


def _body(body: BodySpec) -> dict[str, Any]:
    bar = body.shape == "interval"
    vector = lambda values: _vector(values, bar)
    written: dict[str, Any] = {
        "shape": None if body.mesh else body.shape,
        "mesh": body.mesh,
        "x": body.x,
        "y": body.y,
        "cells": body.cells[0] if bar and body.cells else body.cells,
    }
    if not body.rigid:
        written |= {
            "young": body.young,
            "poisson": None if bar else body.poisson,
            "parts": {name: {"side": part.side, part.axis: part.ends} for name, part in body.parts.items()},
            "fixed": body.fixed,
            "prescribed": {side: vector(values) for side, values in body.prescribed.items()},
            "traction": {side: vector(values) for side, values in body.traction.items()},
            "body_force": vector(body.body_force),
        }
    return _present(written)


def _vector(values: tuple[Fraction | None, ...], bar: bool) -> Any:
    """A vector by components, of a bar its only one; None as the word for it."""
    named = tuple("free" if v is None else v for v in values)
    return named[0] if bar else named


def _present(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if value not in (None, (), {})}


def plain(value: Any) -> Any:
    """The same with what JSON and TOML know: dictionaries, lists, numbers, texts."""
    if isinstance(value, Mapping):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    if isinstance(value, MeshFile):
        return {"path": str(value.path), "sha256": value.sha256}
    return written_number(value) if isinstance(value, Fraction) else value


def written_number(value: Fraction) -> int | float | str:
    """A rational as a number where the decimal that is printed of it is exact, as a fraction in a text elsewhere.

    >>> written_number(Fraction(1, 10)), written_number(Fraction(1, 3)), written_number(Fraction(70000))
    (0.1, '1/3', 70000)
    """
    if value.denominator == 1 and abs(value) <= LARGEST_INTEGER:
        return int(value)
    nearest = float(value)
    if exact(nearest) == value:
        return nearest
    # Decimal: Python turns no integer of thousands of digits into a text
    numerator, denominator = Decimal(value.numerator), Decimal(value.denominator)
    shift = min(numerator.adjusted(), denominator.adjusted())
    if max(numerator.adjusted(), denominator.adjusted()) <= LARGEST_EXPONENT:  # what is read back as it stands
        return f"{numerator}/{denominator}"
    return f"{numerator}e-{shift}/{denominator}e-{shift}"

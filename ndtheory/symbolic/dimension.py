"""Units on both sides: an equation whose sides scale differently under a change of unit is wrong.

Stress and length are independent.  The norms are the project's: the norm of V^a contains the length L of the problem
file, so that it is a length, and a force per unit thickness times a displacement is an energy, stress times length^2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ndtheory.symbolic.engine import Relation

#: Exponents of stress and of length.
Dimension = tuple[Any, Any]

NONE: Dimension = (sp.Integer(0), sp.Integer(0))


class UnitsDiffer(Exception):
    """Two things were added or compared whose units differ; the message names both."""


def unit(dimension: Dimension) -> str:
    """A unit in words.

    >>> unit((sp.Integer(1), sp.Rational(-1, 2)))
    'stress length^(-1/2)'
    """
    power = lambda name, e: name if e == 1 else f"{name}^{e}" if e in (2, 3, 4) else f"{name}^({e})"
    return " ".join(power(name, e) for name, e in zip(("stress", "length"), dimension, strict=True) if e) or "a number"


def of(expression: Any, table: Mapping[str, Dimension]) -> Dimension:
    """The dimension of an expression; symbols that the table does not name are numbers.

    Raises
    ------
    UnitsDiffer
        A sum, a minimum or a maximum of things with different units.
    """
    expression = sp.sympify(expression)
    if expression.is_Symbol:
        return table.get(str(expression), NONE)
    if expression.is_Mul:
        parts = [of(factor, table) for factor in expression.args]
        return (sum(p[0] for p in parts), sum(p[1] for p in parts))
    if expression.is_Pow:
        base, exponent = of(expression.base, table), expression.exp
        return (base[0] * exponent, base[1] * exponent)
    if expression.is_Add or isinstance(expression, (sp.Min, sp.Max)):
        first, *others = sorted(expression.args, key=sp.default_sort_key)
        for other in others:
            _same(first, other, table)
        return of(first, table)
    return NONE


def _same(one: Any, other: Any, table: Mapping[str, Dimension]) -> None:
    first, second = of(one, table), of(other, table)
    if first != second and 0 not in (one, other):
        raise UnitsDiffer(f"{one} is {unit(first)}, {other} is {unit(second)}")


def consistent(relations: Relation | Sequence[Relation], table: Mapping[str, Dimension]) -> str | None:
    """None where all units agree, else what differs.

    Examples
    --------
    >>> m, x = sp.symbols("m x")
    >>> consistent(Relation(x, "<=", m * x + x), {"m": (1, 0), "x": (1, 0)})
    'x is stress, m*x is stress^2'
    """
    for relation in [relations] if isinstance(relations, Relation) else relations:
        try:
            _same(relation.left, relation.right, table)
        except UnitsDiffer as error:
            return str(error)
    return None

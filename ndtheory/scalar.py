"""Formulas over numbers of any type: one square root for all of them, and branches without an if."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any, TypeAlias

#: A number of any type to which formulas apply: float, Decimal, Fraction, a symbol, an interval.  They share no class.
Scalar: TypeAlias = Any


def sqrt(x: Scalar) -> Scalar:
    """The square root in the arithmetic of its argument.

    float, int, Decimal, a Fraction that is a square, and anything with a rational power (sympy, mpmath).

    Raises
    ------
    ValueError
        A negative number, or a Fraction whose root is irrational (a float would hide that).

    Examples
    --------
    >>> sqrt(2.25), sqrt(Fraction(9, 4)), sqrt(Decimal("2.25"))
    (1.5, Fraction(3, 2), Decimal('1.5'))
    """
    if isinstance(x, (int, float, Decimal, Fraction)) and x < 0:
        raise ValueError(f"sqrt({x}): a number >= 0 is needed")
    if isinstance(x, Decimal):
        return x.sqrt()
    if isinstance(x, Fraction):
        root = Fraction(math.isqrt(x.numerator), math.isqrt(x.denominator))
        if root * root != x:
            raise ValueError(f"sqrt({x}) is irrational")
        return root
    if isinstance(x, (int, float)):
        return math.sqrt(x)
    if hasattr(x, "is_Rational"):  # a sympy expression: 0.5 would turn it into a float
        return x ** Fraction(1, 2)
    return x**0.5


def where(condition: Scalar, a: Scalar, b: Scalar) -> Scalar:
    """``a`` where a condition holds, else ``b``: the branch of a formula, beside :func:`sqrt`.

    Formulas use no ``if`` on a scalar, so that they apply to scalars whose comparisons are not decided at once.  Such a
    comparison returns an object with a method ``where(a, b)``: for a scalar that records its operations it records the
    choice, for an interval or ball it returns the hull of both branches.  Conditions are joined by ``&``.

    Parameters
    ----------
    condition : bool, or an object with a method ``where(a, b)``
        Any other object (numpy, sympy) is converted to bool.
    a, b : scalar, or a function without arguments that returns one
        A function is called only where its branch is taken: it may divide by what vanishes in the other one.

    Examples
    --------
    >>> where(2 > 1, 5, lambda: 1 / 0)
    5
    """
    if condition is not True and condition is not False and hasattr(condition, "where"):
        return condition.where(*(branch() if callable(branch) else branch for branch in (a, b)))
    branch = a if condition else b
    return branch() if callable(branch) else branch


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """The smaller of two scalars."""
    return where(b < a, b, a)


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """The larger of two scalars."""
    return where(b > a, b, a)


def absolute(x: Scalar) -> Scalar:
    """The modulus of a scalar."""
    return where(x < 0, -x, x)

"""The numbers of a circle criterion at a friction: found in doubles by a search, and proved in intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, TypeVar

from ndtheory import Number
from ndtheory.continuum.circle import Multipliers, disk
from ndtheory.continuum.rectangle_circle import SMALL_THETAS
from ndtheory.number import above, below
from verification.free_norm.search import Search

M = TypeVar("M", bound=Multipliers)

#: By these shares factors are larger, and frictions and thetas smaller, until intervals decide.
MARGINS = (2e-4, 1e-3, 3e-3, 8e-3, 1.6e-2)

#: A further share of beta at which a proof is tried: at the largest one the form has a zero.
INSIDE = 0.98

#: From a value, a side and what holds there to a number, above which (side 1) or below which (-1) it holds.
Found = Callable[[float, int, Callable[[Fraction], bool]], Number]


def numbers(search: Search, k: Fraction, theta: Fraction | None, found: Found) -> dict[str, Any]:
    """``friction_threshold``, and ``theta_max``, ``theta_best``, ``factor_best``, ``factor`` where there are such.

    ``factor`` is the one at ``theta``, by default at the best theta.
    """

    def holds(ends: tuple[Fraction, Fraction], k: Fraction = k) -> bool:
        allowed = search.allowed((float(ends[0]), float(ends[1])))
        if allowed.friction <= k:
            return False
        inside = (replace(allowed.by, beta=share * allowed.by.beta) for share in (float(k) / allowed.friction, INSIDE))
        return any(search.criterion.contracts(ends, with_friction(by, k)) for by in inside)

    def factor(theta: Fraction, q: float) -> Number:
        return found(q, 1, lambda value: holds(disk(theta, value)))

    known: dict[str, Any] = {}
    if (largest := search.largest_theta(float(k))) is not None:
        known["theta_max"] = found(largest, -1, lambda value: holds(disk(value, Fraction(1))))
        best, least = search.best_theta(float(k), largest)
        known |= {"theta_best": best, "factor_best": factor(Fraction(best), least)}
        theta = Fraction(str(best)) if theta is None else theta
    if theta is not None and (q := search.factor(float(theta), float(k))) is not None:
        known["factor"] = factor(theta, q)
    known["friction_threshold"] = found(search.friction_threshold, -1, lambda value: holds(SMALL_THETAS, value))
    return known


def with_friction(by: M, k: Fraction) -> M:
    """Rational multipliers near some in doubles, with ``4 alpha beta = k^2``."""
    exact: dict[str, Any] = {name: Fraction(value) for name, value in vars(by).items()}
    return replace(by, **exact | {"alpha": k**2 / (4 * exact["beta"])})


def proved(value: float, side: int, holds: Callable[[Fraction], bool], margins: Sequence[float] = MARGINS) -> Number:
    """The nearest of some numbers beside one, above it (side 1) or below it (-1), for which something is proved.

    Above a number below 1 it stays there.  The number in doubles where it is proved for none.
    """
    for margin in (0.0, *margins) if value == 1 else margins:  # theta = 1 itself may be proved
        moved = Fraction(value * (1 + side * margin))
        if value < 1 <= moved:
            moved = (1 + Fraction(value)) / 2
        if holds(moved):
            end = above(moved) if side > 0 else below(moved)
            return Number(value=end, **{"hi" if side > 0 else "lo": end}, level="guaranteed")
    return Number.of_float(value)

"""A convergence log as it was read, and how its numbers are written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fem1d2d.mesh import Floats

#: From so many lines at both ends of a log it is seen how many digits its numbers have.
LOOKED_AT = 200

#: What to do about a log whose relaxation was not constant.
RUN_AGAIN = "run again with constant relaxation: where it changes, the ratios of residuals say nothing of rho"

Residual = Literal["absolute", "relative", "drop", "assumed"]


@dataclass(frozen=True, kw_only=True)
class Column:
    """The residuals of one field.

    Attributes
    ----------
    name : str
    residual : {'absolute', 'relative', 'drop', 'assumed'}
        ``|T x - x|``; over ``|T x|``; over the first one of its window, whose ratios are those of the absolute one;
        taken as absolute because nothing says otherwise.
    windows : tuple of array
        The residuals of each time window in their order.
    digits : float
        Rounding of a number relative to its size, as its digits have it.
    decimals : float
        Rounding of a number that is written with a fixed number of decimals, else 0.
    """

    name: str
    residual: Residual
    windows: tuple[Floats, ...]
    digits: float
    decimals: float


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log as it was read.

    Attributes
    ----------
    path : Path
    form : {'preCICE', 'Kratos CoSimulation', 'columns'}
    columns : tuple of Column
    theta : float or None
        The relaxation factor that the log itself names.
    notes : tuple of str
        What was left out.
    """

    path: Path
    form: Literal["preCICE", "Kratos CoSimulation", "columns"]
    columns: tuple[Column, ...]
    theta: float | None = None
    notes: tuple[str, ...] = ()


def number(word: str) -> float:
    """A number as C, Fortran or Python writes it."""
    try:
        return float(word)
    except ValueError:
        plain = word.lower()
        if plain.lstrip("+-").startswith(("nan", "1.#ind", "1.#qnan")):
            return math.nan
        if plain.lstrip("+-").startswith("1.#inf"):
            return math.inf
        return float(plain.replace("d", "e"))


def rounding(words: Sequence[str]) -> tuple[float, float]:
    """How numbers are rounded as they are written: relative to them, and in units where all have so many decimals.

    >>> rounding(["1.234e-05", "1.2e-06"]), rounding(["0.0012", "0.2"])
    ((0.0005, 0.0), (0.0, 5e-05))
    """
    numbers = [word.lower().replace("d", "e").partition("e") for word in words if "n" not in word.lower()]
    decimals = [len(figures.partition(".")[2]) for figures, _, _ in numbers]
    scientific = [places for places, (_, exponent, _) in zip(decimals, numbers, strict=True) if exponent]
    if scientific:
        return 0.5 * 10.0 ** -max(scientific), 0.0
    return 0.0, 0.5 * 10.0 ** -max(decimals, default=0)

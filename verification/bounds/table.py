"""The editions of the theorem side by side: what a table shows of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ndtheory import Bounds, Number, SharpBounds

#: The semidefinite edition and the losses are worked out up to this many contact nodes: some seconds.
LARGEST = 30


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How much friction an edition allows.

    Attributes
    ----------
    every : Number or None
        Below it every small theta contracts; None where that was not worked out.
    some : Number or None
        Below it some theta contracts; None where that was not worked out.
    on : {'k', 'C_K', 'multiple', 'any'}
        What they bound; ``multiple``: the friction that was given may grow by this factor; ``any``: without a law of
        friction there is nothing to bound.
    """

    every: Number | None = None
    some: Number | None = None
    on: str = "any"


@dataclass(frozen=True, kw_only=True)
class EditionRow:
    """What a table shows of one edition.

    Attributes
    ----------
    name : {'printed', 'repaired', 'sharp', 'lmi'}
    friction : Thresholds
    interval : pair or None
        The thetas that contract.
    theta : float or None
    factor, one_minus_factor : Number or None
        At theta; None where there is no conclusion.
    """

    name: str
    friction: Thresholds = field(default_factory=Thresholds)
    interval: tuple[float, float] | None
    theta: float | None
    factor: Number | None
    one_minus_factor: Number | None


def bounded(rows: Sequence[EditionRow]) -> str:
    """What the thresholds of a table bound, ``k`` or ``C_K``."""
    return next((row.friction.on for row in rows if row.friction.on in ("k", "C_K")), "k")


def row_of(name: str, bounds: Bounds | SharpBounds, friction: Thresholds | None = None) -> EditionRow:
    """The row of an edition; the sharp one takes its thresholds on k from elsewhere, where they are known."""
    if isinstance(bounds, Bounds):
        friction = Thresholds(every=bounds.C4, some=bounds.C2, on="any" if bounds.C2 is None else bounds.threshold_on)
    elif friction is None:
        every, some = bounds.friction_multiple, bounds.friction_limit_multiple
        friction = Thresholds(every=every, some=some, on="any" if every is None else "multiple")
    return EditionRow(
        name=name,
        friction=friction,
        interval=bounds.interval,
        theta=bounds.theta,
        factor=bounds.factor,
        one_minus_factor=bounds.one_minus_factor,
    )

"""The editions of the theorem side by side: what a table shows of each."""

from __future__ import annotations

from dataclasses import dataclass

from ndtheory import Bounds, Number, SharpBounds

#: The semidefinite edition and the losses are worked out up to this many contact nodes: some seconds.
LARGEST = 30


@dataclass(frozen=True, kw_only=True)
class EditionRow:
    """What a table shows of one edition.

    Attributes
    ----------
    name : {'printed', 'repaired', 'sharp', 'lmi'}
    threshold : Number or None
        Friction below which some theta contracts; None: any.
    threshold_on : {'k', 'C_K', 'multiple'}
        What it bounds; ``multiple``: the friction that was given may grow by this factor.
    interval : pair or None
        The thetas that contract.
    theta : float or None
    factor, one_minus_factor : Number or None
        At theta; None where there is no conclusion.
    """

    name: str
    threshold: Number | None
    threshold_on: str
    interval: tuple[float, float] | None
    theta: float | None
    factor: Number | None
    one_minus_factor: Number | None


def row_of(name: str, bounds: Bounds | SharpBounds, threshold: Number | None = None) -> EditionRow:
    """The row of an edition; the sharp one takes its threshold on k from elsewhere, where it is known."""
    on = "k"
    if isinstance(bounds, Bounds):
        threshold, on = bounds.C2, bounds.threshold_on
    elif threshold is None:
        threshold, on = bounds.friction_multiple, "multiple"
    return EditionRow(
        name=name,
        threshold=threshold,
        threshold_on=on,
        interval=bounds.interval,
        theta=bounds.theta,
        factor=bounds.factor,
        one_minus_factor=bounds.one_minus_factor,
    )

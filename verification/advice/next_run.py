"""The run to make next is one that was not made yet; a theta that was run is kept, or not named."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from verification.advice.readings import SHORTEST_STEP, NextRun, rounded_down, same_run, steps_needed


@dataclass(frozen=True, kw_only=True)
class Made:
    """A run that was made.

    Attributes
    ----------
    theta : Fraction
    falls : bool
        True if its residual falls to the end of the log.
    rises : bool
        True if the run does not converge.
    ratio : Fraction or None
        The ratio by which it falls or grows at most, where it is steady.
    """

    theta: Fraction
    falls: bool
    rises: bool = False
    ratio: Fraction | None = None


def kept(theta: Fraction, why: str) -> NextRun:
    """The theta of a run that is to be kept."""
    return NextRun(theta=float(theta), why=why if why.startswith("keep it") else f"keep it: {why}", kept=True)


def pasted_or_not(following: NextRun, made: Sequence[Made]) -> NextRun | None:
    """The theta to paste: kept where a run with it falls; None where it is not below all that do not converge."""
    low = min((one.theta for one in made if one.rises), default=None)
    if low is not None and (following.theta > low or same_run(following.theta, low)):
        return None
    twin = next((one for one in made if same_run(following.theta, one.theta)), None)
    return following if twin is None or following.kept else kept(twin.theta, following.why)


def anew(following: NextRun, made: Sequence[Made]) -> NextRun:
    """The run that was proposed, or another one where a run with that theta was made.

    Between the largest theta that falls and the next one above it, or above all of them, or below all where none falls;
    the fastest run is kept where that leaves no other theta.  A log that is too short is asked for again where there
    are none at another theta.
    """
    thetas = [one.theta for one in made]
    again = following.again and all(same_run(thetas[0], theta) for theta in thetas)
    if following.kept or again or not any(same_run(following.theta, theta) for theta in thetas):
        return following
    falling = [one for one in made if one.falls]
    low = max((one.theta for one in falling), default=None)
    if low is None:
        theta, why = min(thetas) / 2, "half of the smallest theta so far, as no run is seen to converge"
    elif beyond := [theta for theta in thetas if theta > low]:
        high = min(beyond)
        theta = Fraction(math.sqrt(low * high)) if high > SHORTEST_STEP * low else low
        why = f"between {float(low):.4g}, which falls, and {float(high):.4g}, which does not or shows no ratio"
    else:
        theta = min(3 * low / 2, (1 + low) / 2) if SHORTEST_STEP * low < 1 else low
        why = f"larger than {float(low):.4g}, which falls"
    if theta == low:
        best = min(falling, key=lambda one: (one.ratio is None, one.ratio or 0, one.theta))
        return kept(best.theta, "it falls, and no other theta is worth a run")
    steps = f"{steps_needed(theta)} steps or more in one time window"
    return NextRun(theta=rounded_down(theta), why=f"{why}; come back with all logs, with {steps}")

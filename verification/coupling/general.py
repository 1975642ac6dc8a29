"""Runs of couplings of kind general, of which nothing is known beforehand but that eigenvalues are real.

A mode is multiplied by ``1 - theta z`` with ``z = 1 + lambda``.  A run with ratio r has all z between ``(1 - r)/theta``
and ``(1 + r)/theta``, and one of both ends among them: an eigenvalue that changes its sign in every step, or one that
keeps it.  The second is positive feedback where lambda < 0; a larger theta is then faster, above 1 as well.  Where a z
is below 0 no theta converges.  Both ends fit two ratios of any coupling, so that a third one has to confirm them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from verification.coupling import ends, readings
from verification.coupling.ends import DEAR, GROWS, Box
from verification.coupling.kinds import ANY_THETA
from verification.coupling.readings import Made, NextRun, Observed, RunReading, few, rounded_down, same_run
from verification.coupling.spectrum import Spectrum

#: Modes close to the slowest one die out so slowly that a ratio may still rise by these shares of its distance from 1.
RISES, LATEST = 0.1, 0.3

#: A run to make has at most so many times the largest theta that falls: where it diverges it shows the largest lambda.
FURTHER = 2.0


def readings_of(theta: Fraction, ratio: Observed) -> tuple[RunReading, ...]:
    """Both readings of a ratio."""
    high, low = (1 + ratio.value) / theta - 1, (1 - ratio.value) / theta - 1
    changes = f"a mode with lambda = {few(high)} changes its sign in every step and is the slowest"
    keeps = f"a mode with lambda = {few(low)} keeps its sign and is the slowest"
    if low <= -1:
        keeps += ": no theta converges then"
    elif low < 0:
        keeps += ": positive feedback"
    return (
        RunReading(kind="mode-high", value=float(high), lo=float((1 + ratio.least) / theta - 1), says=changes),
        RunReading(kind="mode-low", lo=float((1 - ratio.most) / theta - 1), says=keeps),
    )


def boxes_of(runs: Sequence[tuple[Fraction, Observed, int]]) -> list[tuple[Box, Box]]:
    """Limits of both ends by each run; one that grows unsteadily has bounds only, if another falls.

    Over n steps the slowest of dense modes stands out from the others up to 1/n: by that a ratio may still rise.
    """
    falls, each = any(ratio.most < 1 for _, ratio, _ in runs), []
    for theta, ratio, steps in runs:
        least, most = float(ratio.least), float(ratio.most)
        late = 1 / (steps * (1 - most)) if most < 1 else 0.0
        one, other = ends.of_ratio(float(theta), least, most, rises=min(max(RISES, late), LATEST))
        if falls and least > 1 and most > GROWS * least:
            one = Box(a=(-math.inf, one.a[1]), b=ends.ANYTHING.b)
            other = Box(a=ends.ANYTHING.a, b=(other.b[0], math.inf))
        each.append((one, other))
    return each


def decide(each: Sequence[Sequence[Box]], made: Sequence[Made]) -> tuple[NextRun, Spectrum | None]:
    """The theta to paste and the spectrum that runs leave together, or the run to make next and None.

    ``each`` has the boxes that each run leaves which has a steady ratio.
    """
    boxes, known = ends.common(each, ends.ANYTHING), [float(one.theta) for one in made]
    falling, rising = ([one for one in made if getattr(one, name)] for name in ("falls", "rises"))
    half = rounded_down(min(one.theta for one in made) / 2)
    if not boxes:
        why = "half of the smallest theta: no coupling with real eigenvalues has these ratios together"
        return NextRun(theta=half, why=why), None
    if not each:
        return NextRun(theta=half, why="half of the smallest theta, until a ratio shows"), None
    least, most = min(box.a[0] for box in boxes), max(box.b[1] for box in boxes)
    if (softest := max(box.a[1] for box in boxes)) <= 0:
        why = f"no constant theta above 0 converges: an eigenvalue is {few(softest - 1)} or less"
        why += ", or a solver has the wrong sign; IQN-ILS may converge"
        return NextRun(theta=half, why=why), Spectrum.between(softest - 1, most - 1)
    if least <= 0:
        theta = min(1 / most, 2 * half)
        why = "there no mode changes its sign: its ratio shows the least eigenvalue, or grows as for any theta"
        return readings.near(Fraction(theta), made, why), None
    theta, cost = ends.cheapest(boxes, float(ANY_THETA))
    if cost <= DEAR and falling:
        low, high = min(box.a[0] for box in boxes) - 1, most - 1
        theta, between = rounded_down(theta), f"with lambda from {low:.3g} to {high:.3g}, if all are real"
        if len(each) > 2 or any(same_run(theta, one.theta) for one in made):
            why = f"at most {max(cost, 1):.2g} times the fewest steps {between}, by these runs"
            return NextRun(theta=theta, why=why), Spectrum.between(low, high)
        ratio = max(abs(1 - theta * z) for z in (1 + low, 1 + high))
        why = f"the best one {between}: then its ratio is {ratio:.3g} or less, and a larger one shows complex ones"
        return readings.at_risk(NextRun(theta=theta, why=why), made), None
    # the second run is below the first: it converges where that does, and shows which end does not change the sign
    largest = max((float(one.theta) for one in falling), default=min(known))
    below = min([float(one.theta) for one in rising], default=float(ANY_THETA))
    theta = ends.telling(boxes, known, below if len(made) > 1 else min(known))
    theta = min(theta, FURTHER * largest)
    if any(same_run(theta, one.theta) for one in made):
        return readings.fastest_of(falling or made), None
    why = f"its ratio shows the other end: lambda is from {least - 1:.3g} to {most - 1:.3g} by the runs so far"
    return readings.at_risk(NextRun(theta=rounded_down(theta), why=why), made), None

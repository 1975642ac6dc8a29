"""Limits of the ends of the spectrum from logs of linear runs, and the theta that serves all of them.

A linear run multiplies each mode by ``1 - theta z`` with ``z = 1 + lambda`` between ``a = 1 + lambda_min`` and
``b = 1 + rho``.  Its steady ratio r is the larger one of ``|1 - theta a|`` and ``|1 - theta b|``, so that either
``1 - theta a = r`` and ``b <= (1 + r)/theta``, or ``theta b - 1 = r`` and ``a >= (1 - r)/theta``.  One log leaves two
boxes in the plane of a and b, and several logs leave their intersections.  With a and b, no theta has fewer steps
than ``2/(a + b)``, which takes ``q = (b - a)/(b + a)`` a step.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

#: A ratio has not wholly settled: by this share of its distance from 1 it may be wrong, and one above 1 by this share.
SETTLED = 0.03

#: Growth bounds the stiffest mode from below; where ratios vary by this factor at most it is an estimate, too.
GROWS = 1.01

#: A theta is recommended where it takes at most so many times the fewest steps, wherever the ends may lie.
DEAR = 1.4

#: Steps are those to 1e-9, and seven at least: a few more or less of so few are not worth another run.
TO, FEWEST = math.log(1e-9), 7.0

#: No faster theta is looked for where the residual falls by this a step or faster: about 0.12.
SWIFT = math.exp(TO / (DEAR * FEWEST))

#: Couplings with fewer modes than this may take fewer steps than their spectrum predicts: one mode needs a single step.
FEWEST_MODES = 5

#: Thetas that are compared are so much apart, and so many intervals each side of a box has.
FINE, MESH = 1.02, 4


@dataclass(frozen=True, kw_only=True)
class Box:
    """Limits of ``a = 1 + lambda_min`` and ``b = 1 + rho``."""

    a: tuple[float, float]
    b: tuple[float, float]

    def meets(self, other: Box) -> Box | None:
        """The intersection of both boxes, with a <= b; None where it is empty."""
        a = max(self.a[0], other.a[0]), min(self.a[1], other.a[1], self.b[1], other.b[1])
        b = max(self.b[0], other.b[0], a[0]), min(self.b[1], other.b[1])
        return Box(a=a, b=b) if a[0] <= a[1] and b[0] <= b[1] else None

    def holds(self, other: Box) -> bool:
        """True if all of another box lies in this one."""
        return all(
            mine[0] <= theirs[0] and theirs[1] <= mine[1] for mine, theirs in ((self.a, other.a), (self.b, other.b))
        )

    @property
    def points(self) -> list[tuple[float, float]]:
        """Pairs of a and b in the box, its corners among them."""
        shares = [i / MESH for i in range(MESH + 1)]
        between = lambda low, high, share: (1 - share) * low + share * high if share < 1 else high
        bs = [between(*self.b, share) for share in shares]
        return [(min(between(*self.a, share), b), b) for share in shares for b in bs]

    @property
    def best(self) -> tuple[float, float]:
        """The limits of the best theta."""
        return 2 / (self.a[1] + self.b[1]), 2 / (self.a[0] + self.b[0])


#: What holds of every tied run: 0 <= lambda_min <= rho; and of a run of any coupling.
EVERYTHING, ANYTHING = (Box(a=(least, math.inf), b=(least, math.inf)) for least in (1.0, -math.inf))


def of_ratio(theta: float, least: float, most: float, *, rises: float = SETTLED) -> tuple[Box, Box]:
    """Boxes of the steady ratio of a linear run: the softest mode is the slowest, or the stiffest one is.

    A ratio below 1 may still rise by the share ``rises`` of its distance from 1.
    """
    unsettled = abs(1 - least) if most < 1 else 1 + most
    low, high = least - SETTLED * unsettled, most + (rises if most < 1 else SETTLED) * unsettled
    softest, stiffest = ((1 - high) / theta, (1 - low) / theta), ((1 + low) / theta, (1 + high) / theta)
    one, other = Box(a=softest, b=(softest[0], stiffest[1])), Box(a=(softest[0], math.inf), b=stiffest)
    return one, other


def of_stiffest(least: float, most: float = math.inf) -> tuple[Box]:
    """The box of limits of ``b``."""
    return (Box(a=EVERYTHING.a, b=(least, most)),)


def common(each: Iterable[Sequence[Box]], all_of: Box = EVERYTHING) -> list[Box]:
    """Boxes of ``all_of`` that logs leave together, each of which leaves some; empty where they exclude each other."""
    left = [all_of]
    for boxes in each:
        met = [found for one in left for other in boxes if (found := one.meets(other)) is not None]
        left = [
            box
            for i, box in enumerate(met)
            if not any(m.holds(box) and (j < i or not box.holds(m)) for j, m in enumerate(met))
        ]
    return left


def dearest(theta: float, boxes: Sequence[Box]) -> float:
    """Steps that theta takes at worst, over the fewest steps; inf where it may not converge."""
    return max(
        (
            _steps(max(abs(1 - theta * a), abs(theta * b - 1))) / _steps((b - a) / (b + a))
            for box in boxes
            for a, b in box.points
        )
    )


def _steps(q: float) -> float:
    return math.inf if q >= 1 else max(FEWEST, TO / math.log(q)) if q > 0 else FEWEST


def cheapest(boxes: Sequence[Box], most: float) -> tuple[float, float]:
    """The theta up to ``most`` with the fewest steps at worst, and these over the fewest steps."""
    low, high = min(box.best[0] for box in boxes), max(box.best[1] for box in boxes)
    low, high = min(max(low, 1e-9), most), min(high, most)
    count = math.ceil(math.log(high / low) / math.log(FINE)) + 1 if high > low else 1
    thetas = [low * (high / low) ** (i / max(count - 1, 1)) for i in range(count)]
    cost, theta = min((dearest(theta, boxes), theta) for theta in thetas)
    return theta, cost


def telling(boxes: Sequence[Box], known: Iterable[float], most: float) -> float:
    """The theta of the next run: the middle of the widest gap that runs have left where the best one may lie."""
    low, high = min(box.best[0] for box in boxes), min(max(box.best[1] for box in boxes), most)
    inside = sorted({low, high, *(theta for theta in known if low < theta < high)})
    gaps = [(above / below, below) for below, above in pairwise(inside)]
    ratio, below = max(gaps, default=(1.0, high))
    return below * math.sqrt(ratio)

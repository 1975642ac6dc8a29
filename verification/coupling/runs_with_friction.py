"""Advice from runs with friction: what their residuals prove and what they let estimate, and the run to make next.

With friction no ratio of residuals bounds rho.  The theorem in energy norms bounds one step by a factor q of rho,
kappa_1 and kappa_2 together, and a mode that slides has a complex eigenvalue.  Three things are left:

* Every step of T_theta is at most ``(1 - theta) + theta L`` in any norm, where L is the Lipschitz constant of T in it.
  So a ratio r of absolute residuals proves ``L >= 1 - (1 - r)/theta`` in the norm of the log.  If residuals go on so
  for ever, this holds in the norm (5.21), and ``L >= 1`` if they stay at a level.  The theorem has ``L <= sqrt(rho) R``
  there, with ``R = (s + sqrt(s^2 + 4 kappa_2))/2`` and ``s = sqrt(rho) + kappa_1``.
* Near a solution where contact does not change, each mode is multiplied by ``1 - theta z`` with a complex number z.
  The limit r of the ratios is the largest ``|1 - theta z|``, so that ``(1 - r)/theta <= |z| <= (1 + r)/theta`` for the
  slowest mode.  It is convex in theta and 1 at theta = 0.  So a smaller theta' has ``1 - (1 - r) theta'/theta`` or
  less, and lines through two limits bound it from below beyond both.  A log shows no limit, as a slower mode may be too
  small to be seen yet: all this is an estimate, and left out where ratios visibly move.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

from ndtheory.keys import Part, key
from ndtheory.number import above, below
from verification.coupling.ends import DEAR, SWIFT
from verification.coupling.kinds import LARGEST_TO_PASTE
from verification.coupling.readings import SAME, SHORTEST_STEP, NextRun, Observed, RunReading, few, kept, rounded_down
from verification.coupling.seen import SeenLog

#: So many thetas between two runs are compared.
BETWEEN = 32

_SAYS = {
    "mode-high": "a mode that changes its sign in every step is the slowest; with friction it does not bound rho",
    "mode-low": "a mode that keeps its sign is the slowest; with friction it does not bound rho",
    "open": "nodes that are open set the pace, 1 - theta a step, whatever rho is",
    "level": "contact alternates between open and closed, or stick and slip: with friction this does not bound rho",
}

UNSETTLED = "no residual falls, or the ratio of the largest theta has not settled"

_FASTEST: dict[str, Any] = {
    "says": r"the largest theta whose residual falls, and its ratio at most if it has settled; an estimate of the "
    r"modes in its log: a smaller $\theta'$ takes at most $1 - (1 - \text{rate})\,\theta'/\theta$ a step",
    "unit": "1",
    "null": "where it has not",
    "why": UNSETTLED,
}


@dataclass(frozen=True, kw_only=True)
class FrictionBounds(Part):
    """A bound that runs with friction prove, and estimates; if residuals go on so, ``sqrt(rho) R >= image``, too."""

    image: float | None = key(
        "the Lipschitz constant of $T$ in the norm of absolute residuals is at least this; in the norm (5.21), and "
        "where 1 is given for a residual at a level, if residuals go on as in the log",
        unit="1",
        null="where every run is as fast as with only open nodes",
        why="every run is as fast as with open nodes alone",
    )
    theta: float | None = key(**_FASTEST)
    rate: float | None = key(**_FASTEST)
    eigenvalue: tuple[float, float] | None = key(
        r"limits `least` and `most` of $\lvert 1 + \lambda\rvert$ for the slowest mode that the log shows, an estimate",
        type="map of number",
        unit="1",
        null="where there is none",
        why=UNSETTLED,
        of=lambda ends: dict(zip(("least", "most"), ends, strict=True)),
    )


Runs = list[tuple[Fraction, Observed]]
Rising = list[tuple[Fraction, Observed | None]]


def by_kind(logs: Sequence[SeenLog]) -> tuple[Runs, Rising]:
    """theta and ratio of the logs that converge, and of those that do not: None for one that stays at a level."""
    falling: Runs = [(log.theta, log.slowest) for log in logs if log.converges and log.slowest is not None]
    grows = lambda log: log.slowest if log.slowest is not None and log.slowest.least > 1 else None
    return falling, [(log.theta, grows(log)) for log in logs if log.diverges]


def with_friction(logs: Sequence[SeenLog]) -> tuple[tuple[RunReading, ...], NextRun, None]:
    """The readings of the log that decides most and the run to make next; logs decide no rho with friction."""
    falling, rising = by_kind(logs)
    if not falling and not rising:
        swift = (kept(log.theta, log.next.why) for log in logs if log.swift)
        return (), next(swift, max(logs, key=lambda log: log.length).next), None
    decides = max(theta for theta, _ in falling) if falling else min(theta for theta, _ in rising)
    readings = next(log.readings for log in logs if log.theta == decides and (log.converges or log.diverges))
    return readings, next_with_friction(falling, [theta for theta, _ in rising]), None


def friction_bounds(
    falling: Sequence[tuple[Fraction, Observed]], rising: Sequence[tuple[Fraction, Observed | None]]
) -> FrictionBounds:
    """A bound and estimates from runs whose residual falls by a ratio, and from those that do not converge.

    Both are sequences of theta and its steady ratio; None for a residual that stays at a level.
    """
    known = [(theta, ratio.least) for theta, ratio in (*falling, *rising) if ratio is not None]
    shown = max([1 - (1 - least) / theta for theta, least in known] + [Fraction(1)] * bool(rising), default=Fraction(0))
    image = below(shown) if shown > 0 else None
    theta, ratio = max(falling, key=lambda run: run[0], default=(None, None))
    if theta is None or ratio is None or ratio.moves:
        return FrictionBounds(image=image, theta=None, rate=None, eigenvalue=None)
    ends = below((1 - ratio.most) / theta), above((1 + ratio.most) / theta)
    return FrictionBounds(image=image, theta=float(theta), rate=above(ratio.most), eigenvalue=ends)


def readings_with_friction(readings: Sequence[RunReading]) -> tuple[RunReading, ...]:
    """The readings of a run without bounds of rho; a plateau needs a tied interface."""
    return tuple(RunReading(kind=one.kind, says=_SAYS[one.kind]) for one in readings if one.kind in _SAYS)


def next_with_friction(falling: Sequence[tuple[Fraction, Observed]], rising: Sequence[Fraction]) -> NextRun:
    """The run to make next, or the theta of the fastest run where no other one is much faster.

    ``falling`` are theta and ratio of the runs whose residual falls, ``rising`` the thetas that do not converge; at
    least one run of either kind is given.
    """
    if not falling:
        parts = 2 if len(rising) == 1 else 4
        share = "half" if parts == 2 else "a quarter"
        why = f"{share} of {few(min(rising))}, which does not converge; that run shows whether it suffices"
        return NextRun(theta=rounded_down(min(rising) / parts), why=why)
    theta, ratio = min(falling, key=lambda run: (run[1].value, run[0]))
    pace = f"its residual changes by {few(ratio.value)} a step"
    if ratio.most <= SWIFT:
        return kept(theta, f"{pace}, and none much faster is to be found")
    made = [other for other, _ in falling] + list(rising)
    slower = ratio.least > 1 - (1 - SAME) * theta  # than nodes that are open
    lower = max((other for other in made if other < theta), default=theta / 4 if slower else theta)
    upper = min((other for other in made if other > theta), default=max(theta, LARGEST_TO_PASTE))
    low, middle, high = float(lower), float(theta), float(upper)
    points = [(0.0, 1.0, 1.0)] + [(float(at), float(r.least), float(r.most)) for at, r in falling]
    thetas = [low + (high - low) * i / BETWEEN for i in range(BETWEEN + 1)]
    least = min(least_rate(points, at) for at in thetas)
    if least > 0 and math.log(least) >= DEAR * math.log(float(ratio.most)):
        none = f"none between {low:.4g} and {high:.4g} takes less than 1/{DEAR:g} of its steps"
        return kept(theta, f"{pace}, and by these ratios {none}")
    if max(middle / low, high / middle) < SHORTEST_STEP:
        return kept(theta, f"{pace}, and the runs next to it leave no room for a faster one")
    where, end = ("smaller", low) if middle / low > high / middle else ("larger", high)
    next_theta = math.sqrt(middle * end)
    why = f"{where} than {middle:.4g}, the fastest so far: {pace}; that run shows whether a {where} one is faster"
    return NextRun(theta=rounded_down(next_theta), why=why)


def least_rate(points: Sequence[tuple[float, float, float]], theta: float) -> float:
    """Least ratio that a theta can have by convexity, from points (theta, least and largest ratio).

    Examples
    --------
    >>> points = [(0.0, 1.0, 1.0), (0.2, 0.8, 0.8), (0.6, 0.9, 0.9)]
    >>> round(least_rate(points, 0.4), 12)
    0.6
    """
    found = [0.0]
    for one, other in combinations(sorted(points), 2):
        if one[0] == other[0]:
            continue
        if other[0] <= theta:  # the line through the ends that make it lowest
            (a, _, high), (b, low, _) = one, other
            found.append(low + (low - high) / (b - a) * (theta - b))
        elif one[0] >= theta:
            (a, low, _), (b, _, high) = one, other
            found.append(low + (high - low) / (b - a) * (theta - a))
    return max(found)

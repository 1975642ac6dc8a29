r"""An upper bound of displacements along Gamma_c by their energy, from straight segments to the clamped side.

Let body a be a rectangle of thickness d whose side opposite Gamma_c is clamped.  Along a segment from the point x of
Gamma_c to the clamped side, with the direction (s, 1) in coordinates along Gamma_c and into the body, the strain
``(s, 1) e(v) (s, 1)`` is the derivative of ``(s, 1) v``.  Two such segments with slopes s < t therefore give

    v_T(x) = 1/(t - s) * integral over 0 < y < d of  (s, 1) e (s, 1) at x + s y  -  (t, 1) e (t, 1) at x + t y.

That holds for every v in V^a, as long as both segments lie in the body.  Slopes are chosen zone by zone.  By duality
the square of the norm of ``e -> v_T`` from the energy to L2(Gamma_c) is the norm of an integral operator on Gamma_c
with a known kernel: segments contribute where they cross, with the weight :func:`meeting`.  The largest integral of the
modulus of the kernel over one variable bounds it (Schur's test, ``docs/continuum.md``).  These integrals are piecewise
linear with known breakpoints, so the bound is a rational number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from ndtheory.errors import HypothesisError
from ndtheory.scalar import Scalar

#: Steps of the search for slopes and zones, in thicknesses, from coarse to fine.
STEPS = [Fraction(1, 2**j) for j in (1, 2, 3, 4, 5, 6)]

#: Slope of a segment that no side stops: two of +-1 give v_T with the best constant, 1.
FREE = Fraction(1)


@dataclass(frozen=True, kw_only=True)
class Zone:
    """A part of Gamma_c and the slopes of its two segments, lengths in thicknesses.

    It is from ``lo`` to ``hi``, distances from the left side of the body; ``left`` and ``right`` are the slopes, left <
    right.
    """

    lo: Scalar
    hi: Scalar
    left: Scalar
    right: Scalar

    def in_doubles(self) -> Zone:
        """The same in doubles, for the search."""
        return Zone(lo=float(self.lo), hi=float(self.hi), left=float(self.left), right=float(self.right))

    def inside(self, length: Scalar) -> bool:
        """True if all segments lie in a body of that length."""
        return bool(self.left < self.right and self.lo + min(self.left, 0) >= 0 and self.hi + self.right <= length)


def meeting(s: Scalar, t: Scalar, kappa: Scalar) -> Scalar:
    """The weight ``G C^-1 (s,1)(s,1) : (t,1)(t,1)`` of a crossing of segments with slopes s and t.

    Examples
    --------
    >>> meeting(1, -1, Fraction(9, 5)), meeting(0, 0, Fraction(9, 5))
    (Fraction(-3, 5), Fraction(7, 20))
    """
    return ((1 + s * t) ** 2 - (3 - kappa) * (1 + s * s) * (1 + t * t) / 4) / 2


def bound(zones: Sequence[Zone], kappa: Scalar) -> Scalar:
    """An upper bound of ``G |v_T|^2 / (d a(v))``, the norm over the zones.

    Exact where zones and kappa are rational; the search for zones calls it with doubles.  The zones have no common
    inner points, and their segments lie inside the body.

    Examples
    --------
    No side is near:

    >>> bound([Zone(lo=Fraction(1), hi=Fraction(5), left=-FREE, right=FREE)], Fraction(9, 5))
    Fraction(1, 1)
    """
    return max(_largest_sum(zone, zones, kappa) for zone in zones)


def _largest_sum(zone: Zone, zones: Sequence[Zone], kappa: Scalar) -> Scalar:
    """The largest integral of the kernel's modulus over the second variable, the first one in a zone."""
    alone: Scalar = 0
    crossings: list[tuple[Scalar, Scalar, Zone]] = []
    breaks = {zone.lo, zone.hi}
    for s in (zone.left, zone.right):
        for other in zones:
            for t in (other.left, other.right):
                weight = abs(meeting(s, t, kappa)) / ((zone.right - zone.left) * (other.right - other.left))
                if s == t:
                    alone += weight * (other is zone)  # parallel segments of different points do not meet
                    continue
                # that of x meets that of x' = x + (s - t) y at the depth y
                crossings.append((weight, s - t, other))
                breaks.update(
                    x for x in (other.lo - s + t, other.hi - s + t, other.lo, other.hi) if zone.lo < x < zone.hi
                )

    def integral(x: Scalar) -> Scalar:
        total = alone
        for weight, drift, other in crossings:
            first, last = sorted(((other.lo - x) / drift, (other.hi - x) / drift))
            total += weight * max(min(last, 1) - max(first, 0), 0)
        return total

    return max(map(integral, breaks))


def zones(length: Fraction, lo: Fraction, hi: Fraction, kappa: Fraction) -> list[Zone]:
    """Zones with a small :func:`bound`, for Gamma_c from lo to hi on a body, lengths in thicknesses.

    Every choice gives a proof; this one is the best of a search in doubles.  Where a side is nearer than one thickness,
    a zone at that side has one segment along that side or as far towards it as there is room, and one into the body.

    HypothesisError unless 0 <= lo < hi <= length.

    Examples
    --------
    >>> found = zones(Fraction(4), Fraction(0), Fraction(4), Fraction(9, 5))
    >>> len(found), round(float(bound(found, Fraction(9, 5))), 2)
    (2, 2.04)
    """
    if not 0 <= lo < hi <= length:
        raise HypothesisError("Gamma_c", f"[{lo}, {hi}]", f"an interval inside [0, {length}], in thicknesses")
    rooms = (min(lo, FREE), min(length - hi, FREE))
    if rooms == (FREE, FREE):
        return [Zone(lo=lo, hi=hi, left=-FREE, right=FREE)]
    tied = lo == length - hi

    def layout(at: Sequence[Fraction]) -> list[Zone]:
        # where the end zones end, how far their segments go inward, and the slope between them
        left_end, left_slope, right_end, right_slope, slope = (*at[:2], *at[:2], at[4]) if tied else at
        first, last = lo + left_end, hi - right_end
        parts = [Zone(lo=lo, hi=first, left=-rooms[0], right=left_slope)] if left_end > 0 else []
        if first < last:
            parts.append(Zone(lo=first, hi=last, left=-slope, right=slope))
        return [*parts, *([Zone(lo=last, hi=hi, left=-right_slope, right=rooms[1])] if right_end > 0 else [])]

    def cost(at: Sequence[Fraction]) -> float:
        if min(at) < 0 or at[4] == 0 or lo + at[0] > hi - at[0 if tied else 2]:
            return float("inf")
        parts = layout(at)
        if not all(zone.inside(length) for zone in parts):
            return float("inf")
        return float(bound([zone.in_doubles() for zone in parts], float(kappa)))

    half = (hi - lo) / 2
    starts = [
        [end, inward, end, inward, slope]
        for end in (half, min(half, FREE), min(half, FREE / 2))
        for inward in (min(half, 3 * FREE / 2), (length - lo - end) / 2)
        for slope in (FREE, min(FREE, half, end + lo))
    ]
    best = min(starts, key=cost)
    least = cost(best)
    for step in STEPS:
        improved = True
        while improved:
            improved = False
            for i in range(5):
                for move in (step, -step):
                    trial = [*best[:i], best[i] + move, *best[i + 1 :]]
                    if (value := cost(trial)) < least * 0.9999:
                        best, least, improved = trial, value, True
    return layout(best)


def bound_at_end(room: Fraction, kappa: Fraction) -> Fraction:
    """An upper bound of :func:`bound` for points beside a side that all have the slopes 0 and t, t at most ``room``.

    Two families of parallel segments: every point has the same sum, so that the bound also holds for any part of a body
    below a line parallel to Gamma_c, with the distance of that line from the clamped side in place of d.

    ``room`` > 0 is the largest reach of segments into the body, in thicknesses.

    Examples
    --------
    >>> round(float(bound_at_end(Fraction(2), Fraction(9, 5))), 3)
    1.801
    """
    slopes = {min(room, Fraction(j, 16)) for j in range(4, 65)}
    return min(
        Fraction(meeting(0, 0, kappa) + meeting(t, t, kappa) + 2 * abs(meeting(0, t, kappa))) / t**2 for t in slopes
    )

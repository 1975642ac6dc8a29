"""The theorem in energy norms: the proof of Section 5 with the least possible constants.

For two forces psi, psi~ let d_1, d_2 be the differences of the traces of the contact body and of the Neumann body, with
``|d_a|^2 = a^a(R d_a, R d_a)``, and ``x = |d_1| / |d_2|``; ``|d_2|`` is the norm (5.21) of psi - psi~.  Then

* ``|||T psi - T psi~|||^2 <= rho x^2 |d_2|^2`` replaces (5.18), (5.22), (5.38),
* ``x <= r``, with ``r^2 = (sqrt(rho) + kappa_1) r + kappa_2``, replaces (5.11),
* ``<T psi - T psi~, d_2> <= f(x) |d_2|^2``, with ``f(x) = kappa_2 + kappa_1 x - x^2``, replaces (5.29) and (5.30).

So by (5.24) ``q(theta)^2``, the largest ``(1-theta)^2 + 2 theta (1-theta) f(x) + theta^2 rho x^2`` over 0 <= x <= r,
bounds the square of the Lipschitz constant of T_theta.  The proof, step by step, is in ``docs/energy.md``.

Every formula applies to any scalar, as in :mod:`ndtheory.bounds`.  All arguments and results are numbers without unit.

r grows with rho, kappa_1 and kappa_2, and so does the expression above at each x in [0, r], as 0 < theta <= 1: q grows.
As q grows, the thetas with q < 1, an interval, become fewer: its upper end does not grow, the least q does not fall,
and neither multiple of friction grows, up to which every small theta and some theta has q < 1.  So an enclosure of the
three (rho_normal in place of rho without friction) gives one of each result: its values at both ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any, ClassVar

from ndtheory.bounds import MARGIN, Answer, factor_and_rest
from ndtheory.constants import EnergyConstants, relaxation_factor
from ndtheory.keys import key
from ndtheory.number import SLACK, Number, Numeric, decimal, rounded, weakest, working_precision
from ndtheory.scalar import Scalar, absolute, maximum, minimum, sqrt, where

#: Halvings of an interval inside (0, 1) until theta is known to far below a double.
HALVINGS = 80

# The formulas: rho > 0, kappa_1, kappa_2 >= 0, 0 < theta <= 1.


def largest_ratio(rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """r, the largest ``x = |d_1|/|d_2|``: the positive root of ``r^2 = (sqrt(rho) + kappa_1) r + kappa_2``.

    Examples
    --------
    >>> largest_ratio(4.0, 0.0, 0.0)
    2.0
    """
    s = sqrt(rho) + kappa_1
    return (s + sqrt(s * s + 4 * kappa_2)) / 2


def work(x: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """f(x): bounds ``<T psi - T psi~, d_2> / |d_2|^2``; ``f(r) = -sqrt(rho) r``."""
    return kappa_2 + kappa_1 * x - x * x


def square_at(x: Scalar, theta: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """The right-hand side of (5.24) at one x, over ``|||psi - psi~|||^2``."""
    return (1 - theta) ** 2 + 2 * theta * (1 - theta) * work(x, kappa_1, kappa_2) + theta**2 * rho * x * x


def turning_theta(rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """theta_s: from here on the worst x is r, below it lies in [0, r).

    Examples
    --------
    >>> turning_theta(2.0, 0.0, 0.0)  # without friction 2/(2 + rho)
    0.5
    """
    r = largest_ratio(rho, kappa_1, kappa_2)
    return (2 * r - kappa_1) / ((2 + rho) * r - kappa_1)


def worst_ratio(theta: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """The x in [0, r] at which ``square_at`` is largest."""
    return where(
        theta >= turning_theta(rho, kappa_1, kappa_2),
        lambda: largest_ratio(rho, kappa_1, kappa_2),
        lambda: where(kappa_1 == 0, 0 * theta, lambda: (1 - theta) * kappa_1 / (2 - (2 + rho) * theta)),
    )


def one_minus_end(theta: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """1 - q^2 where the worst x is r: there ``q = |1 - theta (1 + sqrt(rho) r)|``."""
    slope = 1 + sqrt(rho) * largest_ratio(rho, kappa_1, kappa_2)
    return theta * slope * (2 - theta * slope)


def one_minus_inside(theta: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """1 - q^2 where the worst x lies inside: for theta below ``turning_theta``, at most 2/(2 + rho)."""
    bend = where(kappa_1 == 0, 0, lambda: (1 - theta) ** 2 * kappa_1**2 / (2 - (2 + rho) * theta))
    return theta * (2 - theta - 2 * (1 - theta) * kappa_2 - bend)


def one_minus_square(theta: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """1 - q(theta)^2; negative where q > 1."""
    at = (theta, rho, kappa_1, kappa_2)
    turned = theta >= turning_theta(rho, kappa_1, kappa_2)
    return where(turned, lambda: one_minus_end(*at), lambda: one_minus_inside(*at))


def slope_inside(theta: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """Derivative of ``one_minus_inside`` by theta."""
    c = 2 + rho
    bend = where(kappa_1 == 0, 0, lambda: 2 * (1 - theta) * (1 - 3 * theta + c * theta**2) / (2 - c * theta) ** 2)
    return 2 - 2 * theta - 2 * (1 - 2 * theta) * kappa_2 - kappa_1**2 * bend


def friction_number(kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """``kappa_2 + kappa_1^2/4``, the largest f: every small theta contracts where it is below 1, none where above."""
    return kappa_2 + kappa_1**2 / 4


def friction_multiple(kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """The factor t by which friction may grow until ``friction_number(t kappa_1, t kappa_2) = 1``.

    Examples
    --------
    >>> friction_multiple(0.0, 0.25), friction_multiple(1.0, 0.0)
    (4.0, 2.0)
    """
    return 2 / (kappa_2 + sqrt(kappa_2**2 + kappa_1**2))


def friction_limit(rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """The factor t by which friction may grow until no theta at all is proved; never below :func:`friction_multiple`.

    ``(1 + 1/rho) / (kappa_2 + kappa_1/sqrt(rho))`` where ``kappa_1 (sqrt(rho) - 1/sqrt(rho)) < 2 kappa_2``;
    elsewhere it is :func:`friction_multiple`, and the two thresholds are one.

    Examples
    --------
    >>> friction_multiple(0.0, 0.25), friction_limit(1.0, 0.0, 0.25), friction_limit(4.0, 1.0, 0.0)
    (4.0, 8.0, 2.0)
    """
    root = sqrt(rho)
    return where(
        kappa_1 * (root - 1 / root) < 2 * kappa_2,
        lambda: (1 + 1 / rho) / (kappa_2 + kappa_1 / root),
        lambda: friction_multiple(kappa_1, kappa_2),
    )


def predicted_theta(rho: Scalar) -> Scalar:
    """``2/(2 + rho)``: the best theta without friction, and a prediction with it."""
    return 2 / (2 + rho)


def predicted_rate(rho: Scalar) -> Scalar:
    """``rho/(2 + rho)``: the factor at :func:`predicted_theta` without friction, and a prediction with it."""
    return rho / (2 + rho)


def tied_theta(rho_min: Scalar, rho: Scalar) -> Scalar:
    """``2/(2 + rho_min + rho)``: the best theta where nothing opens or slips, so that every step is linear.

    Below 2/(1 + rho), and so safe without friction even if something opens.

    Examples
    --------
    >>> tied_theta(Fraction(1, 2), Fraction(3, 2))
    Fraction(1, 2)
    """
    return 2 / (2 + rho_min + rho)


def tied_rate(rho_min: Scalar, rho: Scalar) -> Scalar:
    """``(rho - rho_min)/(2 + rho_min + rho)``: the factor at :func:`tied_theta` where nothing opens or slips."""
    return (rho - rho_min) / (2 + rho_min + rho)


def tied_factor(theta: Scalar, rho_min: Scalar, rho: Scalar) -> Scalar:
    """``max(|1 - theta (1 + rho_min)|, |1 - theta (1 + rho)|)``: the factor where nothing opens or slips.

    A step then multiplies each mode by ``1 - theta (1 + lambda)``, rho_min <= lambda <= rho; it is attained at an end.

    Examples
    --------
    >>> tied_factor(Fraction(1, 2), Fraction(1, 2), Fraction(3, 2)) == tied_rate(Fraction(1, 2), Fraction(3, 2))
    True
    """
    return maximum(absolute(1 - theta * (1 + rho_min)), absolute(1 - theta * (1 + rho)))


def parallel_factor(theta: Scalar, rho: Scalar) -> Scalar:
    """``sqrt((1 - theta)^2 + theta^2 rho)``: the factor of *parallel* coupling where nothing opens or slips.

    A mode is multiplied by ``1 - theta +- i theta sqrt(lambda)``.  It is least, ``sqrt(rho/(1 + rho))``, at
    :func:`parallel_theta`, and below 1 where ``theta (1 + rho) < 2``, as of serial coupling.

    Examples
    --------
    >>> parallel_factor(0.8, 0.25)
    0.4472135954999579
    """
    return sqrt((1 - theta) ** 2 + theta**2 * rho)


def parallel_theta(rho: Scalar) -> Scalar:
    """``1/(1 + rho)``: the theta of the least :func:`parallel_factor`."""
    return 1 / (1 + rho)


def predicted_factor(theta: Scalar, rho: Scalar) -> Scalar:
    """``max(|1 - theta|, |1 - theta (1 + rho)|)``: q(theta) without friction, and a prediction with it.

    The first is the factor of a node that stays open, the second the factor of the stiffest mode in contact.  Without
    friction (rho is rho_normal then) it is attained, with friction q is never less; 0 < theta <= 1.

    Examples
    --------
    >>> predicted_factor(Fraction(1, 2), 2), predicted_factor(Fraction(1, 4), 2), predicted_factor(Fraction(3, 4), 2)
    (Fraction(1, 2), Fraction(3, 4), Fraction(5, 4))
    """
    return maximum(absolute(1 - theta), absolute(1 - theta * (1 + rho)))


def end_quadratic(rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """a, b and c of ``a theta^2 + b theta + c = h (2 - (2 + rho) theta)``, with h = (q^2 - 1)/theta.

    Below :func:`turning_theta`, where the second factor is positive, it has the sign of q - 1.

    Examples
    --------
    >>> end_quadratic(2, 0, 0)
    (-4, 10, -4)
    """
    spare = 1 - kappa_2
    a = (1 - 2 * spare) * (2 + rho) + kappa_1**2
    b = (8 + 2 * rho) * spare - 2 - 2 * kappa_1**2
    c = kappa_1**2 - 4 * spare
    return a, b, c


def contraction_ends(
    rho: Scalar, kappa_1: Scalar, kappa_2: Scalar, margin: Scalar = 0
) -> tuple[Scalar, Scalar, Scalar]:
    """Both ends of the interval of the thetas with q < 1, and the condition that it exists.

    ``q < 1`` means ``2 (f - 1) + theta (1 - 2 f + rho x^2) < 0`` for every x in [0, r].  Each is linear in theta, so
    their maximum h is convex, and ``h < 0`` on one interval.  Its ends are 0, 1, ``2/(1 + sqrt(rho) r)`` or roots of
    :func:`end_quadratic` below :func:`turning_theta`.  Scalars that round need a ``margin`` well above their relative
    rounding, within which an end counts as met.
    """
    turn = turning_theta(rho, kappa_1, kappa_2)
    end = 2 / (1 + sqrt(rho) * largest_ratio(rho, kappa_1, kappa_2))
    a, b, c = end_quadratic(rho, kappa_1, kappa_2)
    (first, one), (second, other) = (
        (root, there & (margin < root) & (root < turn * (1 - margin))) for root, there in _roots(a, b, c, margin)
    )
    from_0 = c <= margin  # h <= 0 at 0
    beyond = end >= turn * (1 - margin)  # and at the turning theta
    low = where(from_0, 0 * end, where(one, where(other, minimum(first, second), first), second))
    high = where(beyond, minimum(end, end / end), where(one, where(other, maximum(first, second), first), second))
    ends = sum(where(counts, 1, 0) for counts in (from_0, beyond, one, other))
    return low, high, ends == 2


def contraction_interval(
    rho: Scalar, kappa_1: Scalar, kappa_2: Scalar, margin: Scalar = 0
) -> tuple[Scalar, Scalar] | None:
    """The thetas with q < 1, an open interval inside (0, 1), or None where there are none.

    For scalars whose comparisons are decided; :func:`contraction_ends` is the formula.
    """
    low, high, there = contraction_ends(rho, kappa_1, kappa_2, margin)
    return (low, high) if there else None


def _roots(a: Scalar, b: Scalar, c: Scalar, margin: Scalar) -> tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]:
    """Both real roots of ``a t^2 + b t + c`` where they differ, without cancellation, each with whether it exists."""
    discriminant = b * b - 4 * a * c
    real = discriminant > margin * b * b
    root = where(real, lambda: sqrt(discriminant), 0 * b)
    q = -(b + where(b > 0, root, -root)) / 2
    return (where(a != 0, lambda: q / a, 0 * b), real & (a != 0)), (
        where(q != 0, lambda: c / q, 0 * b),
        real & (q != 0),
    )


def best_theta(rho: Scalar, kappa_1: Scalar, kappa_2: Scalar, margin: Scalar = 0) -> Scalar | None:
    """The theta of least q, or None where q >= 1 everywhere; for scalars whose comparisons are decided."""
    interval = contraction_interval(rho, kappa_1, kappa_2, margin)
    return None if interval is None else best_between(*interval, rho, kappa_1, kappa_2)


def best_between(low: Scalar, high: Scalar, rho: Scalar, kappa_1: Scalar, kappa_2: Scalar) -> Scalar:
    """The theta of least q, given the interval in which q < 1.

    q grows above :func:`turning_theta`; below it, where q < 1, it has one minimum, since ``q <= c`` holds on one
    interval for each c <= 1.
    """
    top = minimum(high, turning_theta(rho, kappa_1, kappa_2))
    return _last_where(lambda theta: slope_inside(theta, rho, kappa_1, kappa_2) > 0, low, top)


def _last_where(holds: Callable[[Scalar], bool], low: Scalar, high: Scalar) -> Scalar:
    """The end of an interval (low, ..) inside (low, high) on which a condition holds, by halving."""

    def halved() -> Scalar:
        yes, no = low, high
        for _ in range(HALVINGS):
            middle = (yes + no) / 2
            further = holds(middle)
            yes, no = where(further, middle, yes), where(further, no, middle)
        return yes

    return where(holds(high), high, halved)


_CONSTANT = r"the constants in the bound; $\rho$ is the normal one without friction"
_PREDICTED = r"$2/(2+\rho)$ and $\rho/(2+\rho)$: proved without friction, no bound with it"
_PROVED: dict[str, Any] = {"null": "where none is proved", "why": lambda bounds: bounds.why}
_RUBS = {"null": "without friction", "why": "no friction"}


@dataclass(frozen=True, kw_only=True)
class EnergyBounds(Answer):
    """The answer of the theorem in energy norms: ``factor`` is q(theta), ``interval`` is None where q >= 1 everywhere.

    Times k the multiples of friction are the thresholds k_s and k_e >= k_s.
    """

    part: ClassVar[str] = "Bound in energy norms"
    why: ClassVar[str] = "q >= 1 for every theta"

    rho: Number = key(_CONSTANT)
    kappa_1: Number = key(_CONSTANT)
    kappa_2: Number = key(_CONSTANT)
    ratio: Number = key(
        "the largest ratio of the differences of displacement of the contact body and of the Neumann body"
    )
    friction_multiple: Number | None = key("by which friction may grow until no small theta is proved", **_RUBS)
    friction_limit_multiple: Number | None = key("by which it may grow until no theta is proved", **_RUBS)
    theta_proved: float | None = key("the theta of least factor", **_PROVED)
    factor_proved: Number | None = key("the factor there", **_PROVED)
    theta_max_proved: Number | None = key("end of the interval", **_PROVED)
    theta_predicted: float = key(_PREDICTED)
    rate_predicted: float = key(_PREDICTED)


def evaluate_energy(constants: EnergyConstants, theta: Numeric | None = None) -> EnergyBounds:
    """Evaluate the theorem in energy norms, at a relaxation factor 0 < theta < 1 if one is given, read exactly.

    Returns
    -------
    EnergyBounds
        Right to the last place of a double.  Where a constant was given as an enclosure, and the others as one or
        exactly, the numbers have enclosures too, at the weakest level (``verified`` at best), if all of the constants
        enclosed have such a number: ``factor_proved``, ``theta_max_proved`` have one only if there is a contraction
        interval throughout, ``factor`` and ``one_minus_factor`` if theta is inside it.  ``interval``, ``verdict`` and
        plain numbers come from the values, not from the enclosures.

    Raises
    ------
    HypothesisError
        theta outside (0, 1).

    Examples
    --------
    >>> s = evaluate_energy(EnergyConstants(rho=2), theta="3/5")
    >>> s.interval, s.theta_proved, s.factor_proved.value, round(s.factor.value, 12)
    ((0.0, 0.6666666666666666), 0.5, 0.5, 0.8)
    >>> from ndtheory import Number
    >>> rho = Number(value=2.0, lo=1.75, hi=2.25, level="guaranteed")
    >>> s = evaluate_energy(EnergyConstants(rho=rho), theta="1/2")
    >>> s.factor.level, s.factor.value, round(s.factor.lo, 12), round(s.factor.hi, 12)
    ('guaranteed', 0.5, 0.5, 0.625)
    """
    chosen = None if theta is None else relaxation_factor(theta)
    with working_precision():
        t = None if chosen is None else decimal(chosen)
        here = (constants.at_work, constants.kappa_1, constants.kappa_2)
        found = _figures(here, t, MARGIN)
        corners = [_figures(corner, t, SLACK) for corner in constants.corners or ()]
        level = weakest([constants.level, "verified"])

        def number(name: str) -> Scalar:
            return rounded(found[name], [corner[name] for corner in corners], level)

        names = ("rho", "kappa_1", "kappa_2", "ratio", "friction_multiple", "friction_limit_multiple")
        proved = ("factor_proved", "theta_max_proved", "factor", "one_minus_factor")
        return EnergyBounds(
            **{name: number(name) for name in (*names, *proved)},
            **Answer.shared(found, corners, level, chosen),
            theta_proved=None if found["theta_proved"] is None else float(found["theta_proved"]),
            theta_predicted=float(predicted_theta(found["rho"])),
            rate_predicted=float(predicted_rate(found["rho"])),
        )


def _figures(at: tuple[Fraction, ...], theta: Decimal | None, margin: Decimal) -> dict[str, Any]:
    """The values of the theorem for rho, kappa_1 and kappa_2: decimals by name, None where there is none."""
    rho, kappa_1, kappa_2 = data = decimal(at[0]), decimal(at[1]), decimal(at[2])
    rubs = any(at[1:])
    interval = contraction_interval(*data, margin)
    if interval is not None and float(interval[0]) == float(interval[1]):
        interval = None  # no double lies inside
    low = high = best = factor = rest = None
    if interval is not None:
        low, high = interval
        best = best_theta(*data, margin)
        if theta is not None and low * (1 + margin) < theta < high * (1 - margin):
            gain = one_minus_square(theta, *data)
            if gain > 0:
                factor, rest = factor_and_rest(gain)
    return {
        "rho": rho,
        "kappa_1": kappa_1,
        "kappa_2": kappa_2,
        "ratio": largest_ratio(*data),
        "friction_multiple": friction_multiple(kappa_1, kappa_2) if rubs else None,
        "friction_limit_multiple": friction_limit(*data) if rubs else None,
        "low": low,
        "high": high,
        "theta_proved": best,
        "factor_proved": None if best is None else factor_and_rest(one_minus_square(best, *data))[0],
        "theta_max_proved": high,
        "factor": factor,
        "one_minus_factor": rest,
    }

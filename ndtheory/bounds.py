"""C_0, .., C_6, G, h_1, h_2 and the contraction interval (Section 5), printed and repaired.

Every formula applies to any scalar (float, Decimal, Fraction where roots are rational, sympy, mpmath, an interval, an
object that records its operations), avoids the cancellation of the printed form, and branches by
:func:`ndtheory.scalar.where`.  Docstrings give the equation, ``tests/theorem`` a second derivation.  With u = m all m,
M, u and x = C_K are stresses and G is a stress cubed; C_R, theta, C_T, P, D, Q, C_0, C_1, C_6 are numbers.

The two editions are one set of formulas.  The paper's bracket ``M C_R + C_K + sqrt(C_K m) + 1`` in (5.30)
adds a stress to the number 1: (5.11), (5.13), (5.19) and (5.23) give a *stress* ``u = m`` in place of the 1, and an
overall factor 1/u.  The printed edition is ``u = 1`` with ``m~ = min(m, 1)`` for m; the repaired one is
``u = m`` with m itself.  They agree in the unit of stress in which m = 1.

In both editions every number but C1 is monotone in m, M, C_R and x = C_K, so enclosed constants give enclosed results:
their values where m is largest and the others least, and the other way round.  Beyond C2, where C1 need not be
monotone, D and Q at opposite ends enclose it.  ``docs/verified.md`` has the proof.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from typing import Any, ClassVar, Literal

from ndtheory.constants import Constants, Corner, relaxation_factor
from ndtheory.errors import HypothesisError
from ndtheory.keys import Part, key
from ndtheory.number import DIGITS, SLACK, Level, Number, Numeric, decimal, rounded, weakest, working_precision
from ndtheory.scalar import Scalar, maximum, minimum, sqrt, where

Conclusion = Literal["contraction", "no conclusion"]

#: The meaning of a factor in documents.
FACTOR = "the factor of one step in the norm (5.21), and 1 minus it without cancellation"

#: The ends of the open intervals count as outside, with a margin far above the rounding of the evaluation.
MARGIN = Decimal(10) ** -(DIGITS // 2)

#: Newton's steps in :func:`inverse_G`: the start exceeds the root by a factor of at most sqrt(3), and the excess falls
#: to 0.35, 0.12, 0.02 or less and then from e to at most 1.5 e^2: below 1e-400 after twelve.
NEWTON_STEPS = 12


@dataclass(frozen=True, kw_only=True)
class Edition:
    """A reading of the theorem: its m and the stress u of (5.30).

    Attributes
    ----------
    name : str
    coercivity : callable
        m -> the m that enters the formulas: ``min(m, 1)`` by (5.34), or m.
    unit : callable
        m -> u: 1 as printed, m as repaired.
    proved : callable
        m -> True if the edition's own proof, its chain of estimates, holds: everywhere when repaired, for m >= 1 as
        printed.  Other estimates prove more: (5.30) holds as printed exactly where M^2 >= m, and Proposition 5.6 for
        every m with M >= 2 m and C_tr into L2(Gamma_c) (``x-printed-border`` and ``x-printed-rescued`` of the ledger).
    """

    name: Literal["printed", "repaired"]
    coercivity: Callable[[Scalar], Scalar]
    unit: Callable[[Scalar], Scalar]
    proved: Callable[[Scalar], bool]

    def __reduce__(self) -> str:  # pickled by its name, as functions are
        return self.name.upper()


PRINTED = Edition(name="printed", coercivity=lambda m: minimum(m, m / m), unit=lambda m: m / m, proved=lambda m: m >= 1)
REPAIRED = Edition(name="repaired", coercivity=lambda m: m, unit=lambda m: m, proved=lambda m: True)
EDITIONS = (PRINTED, REPAIRED)


# The formulas.  Here m is m~ in the printed edition, A = M C_R, x = C_K.


def lipschitz(m: Scalar, M: Scalar, C_R: Scalar, x: Scalar) -> Scalar:
    """C_T (5.16); with m~ for m it is C~_T (5.35).

    Examples
    --------
    >>> lipschitz(1.0, 2.0, 1.5, 0.0)
    9.0
    """
    A = M * C_R
    return A / m**2 * (A + x + sqrt(x * m))


def C0(m: Scalar, M: Scalar, C_R: Scalar) -> Scalar:
    """C_0 (5.37): from this theta on the coefficient of |||T psi - T psi~|||^2 is non-negative."""
    return 2 * m**2 / ((M * C_R) ** 2 + 2 * m**2)


def G(x: Scalar, m: Scalar, M: Scalar, C_R: Scalar, u: Scalar) -> Scalar:
    """G (5.42): ``M^2 (x^2 + sqrt(m) x^(3/2) + (M C_R + u) x) / u``."""
    return M**2 / u * x * (x + sqrt(m * x) + M * C_R + u)


def inverse_G(y: Scalar, m: Scalar, M: Scalar, C_R: Scalar, u: Scalar) -> Scalar:
    """The x >= 0 with G(x) = y, for y > 0: a friction constant C_K (stress) from a stress cubed.

    In t = sqrt(x) this is ``t^4 + sqrt(m) t^3 + (M C_R + u) t^2 = Y``: increasing and convex, so Newton's method
    falls monotonically from any start above the root.  The smaller of the roots of the first and of the last
    term alone is such a start (the middle term never dominates, as M C_R + u >= m).
    """
    Y = y * u / M**2
    root_m, B = sqrt(m), M * C_R + u
    t = minimum(sqrt(sqrt(Y)), sqrt(Y / B))
    for _ in range(NEWTON_STEPS):
        residual = t**2 * (t * (t + root_m) + B) - Y
        lower = t - residual / (t * (t * (4 * t + 3 * root_m) + 2 * B))
        falls = lower < t
        if falls is False:  # rounding has stopped the descent: the other steps would change nothing
            break
        t = where(falls, lower, t)
    return t**2


def thresholds(m: Scalar, M: Scalar, C_R: Scalar, u: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """C2 (5.43), C3, C4, C5 (Cases 2-1 to 2-3), each as the C_K (stress) below which a case holds."""
    c0 = C0(m, M, C_R)
    right = (m**5 / (M * C_R) ** 2 + m**3, m**3 / 2, m**3, (2 - c0) / (1 - c0) * m**3 / 2)
    C2, C3, C4, C5 = (inverse_G(y, m, M, C_R, u) for y in right)
    return C2, C3, C4, C5


def P(x: Scalar, m: Scalar, M: Scalar, C_R: Scalar, u: Scalar) -> Scalar:
    """``G(C_K)/m^3``, the friction term of (5.36) with ``2 theta (1 - theta)`` taken out."""
    return G(x, m, M, C_R, u) / m**3


def D(x: Scalar, m: Scalar, M: Scalar, C_R: Scalar, u: Scalar) -> Scalar:
    """``C_T^2/C_R^2 - P >= 0``, which proves a >= 1, b <= -2 after (5.39), without subtracting.

    With ``A = M C_R``, ``s = sqrt(m x)`` and ``r = m/u <= 1`` the term m x of the square cancels that of P.
    """
    A, s, r = M * C_R, sqrt(m * x), m / u
    return M**2 / m**4 * (A**2 + 2 * A * s + (2 - r) * (A + s) * x + (1 - r) * x**2)


def Q(x: Scalar, m: Scalar, M: Scalar, C_R: Scalar) -> Scalar:
    """``C_T^2 M^2/m^2``: the Lipschitz constant squared of T in the norm (5.21), by (5.22), (5.16), (5.23)."""
    return (lipschitz(m, M, C_R, x) * M / m) ** 2


def C1(D: Scalar, Q: Scalar) -> Scalar:
    """C_1 = -b/a (5.40) with a = 1 + 2D + Q and b = -2(1 + D)."""
    return 2 * (1 + D) / (1 + 2 * D + Q)


def C6(P: Scalar) -> Scalar:
    """C_6 = 1 + 1/a' with a' = 1 - 2P (5.46); counts only when a' < -1, that is P > 1."""
    return 2 * (1 - P) / (1 - 2 * P)


def one_minus_h1(theta: Scalar, D: Scalar, Q: Scalar) -> Scalar:
    """1 - h_1(theta) = -theta (a theta + b), h_1 of (5.39)."""
    return theta * (2 * (1 + D) - theta * (1 + 2 * D + Q))


def one_minus_h2(theta: Scalar, P: Scalar) -> Scalar:
    """1 - h_2(theta) = -theta (a' theta + b'), h_2 of (5.45), a' = 1 - 2P, b' = -1 - a'."""
    return theta * ((2 - theta) - 2 * P * (1 - theta))


def lower_end(P: Scalar) -> Scalar:
    """max(0, C6) with C6 counted only where a' < -1: where the thetas that contract begin, friction being below C2."""
    return where(P > 1, lambda: maximum(0 * P, C6(P)), 0 * P)


def one_minus_square(theta: Scalar, P: Scalar, D: Scalar, Q: Scalar) -> Scalar:
    """1 - K(theta)^2, K^2 = max(h1, h2)."""
    return minimum(one_minus_h1(theta, D, Q), one_minus_h2(theta, P))


def factor_and_rest(gain: Scalar) -> tuple[Scalar, Scalar]:
    """q and 1 - q from 1 - q^2 <= 1, the latter without cancellation.

    Examples
    --------
    >>> factor_and_rest(0.75)
    (0.5, 0.5)
    """
    q = sqrt(maximum(1 - gain, 0 * gain))
    return q, gain / (1 + q)


def _no_factor(answer: Answer) -> str:
    return "no theta given" if answer.theta is None else "theta outside the interval: no conclusion"


@dataclass(frozen=True, kw_only=True)
class Answer(Part):
    """The values that the answers of both theorems share, in the norms of the paper and in energy norms."""

    interval: tuple[float, float] | None = key(
        "the thetas that contract, inside (0, 1)", null="where there are none", why=lambda answer: answer.why
    )
    interval_proved: tuple[float, float] | None = key(
        "those that contract for all the constants enclosed",
        null="where there are none, or no enclosures",
        why="the constants have no enclosures, or some of those enclosed have no interval",
    )
    theta: float | None = key("the one asked about", null="without one", why="no theta given")
    factor: Number | None = key(FACTOR, null="without a conclusion", why=_no_factor)
    one_minus_factor: Number | None = key(FACTOR, null="without a conclusion", why=_no_factor)
    verdict: Conclusion | None = key("`contraction` or `no conclusion`", null="without theta", why="no theta given")

    @staticmethod
    def shared(
        found: dict[str, Any], corners: list[dict[str, Any]], level: Level, theta: Fraction | None
    ) -> dict[str, Any]:
        """The intervals, theta and the verdict by name, from the ``low``, ``high`` and ``factor`` that a theorem found.

        ``corners`` has them where the theorem gives most and where it gives least, or is empty without enclosures.
        """
        proved = None
        if corners and all(corner["high"] is not None for corner in corners):
            first, last = [rounded(corners[-1][end], [corners[-1][end]], level) for end in ("low", "high")]
            if first and last and first.hi is not None and last.lo is not None and first.hi < last.lo:
                proved = first.hi, last.lo  # each end moved inwards to a double
        return {
            "interval": None if found["high"] is None else (float(found["low"]), float(found["high"])),
            "interval_proved": proved,
            "theta": None if theta is None else float(theta),
            "verdict": None if theta is None else "no conclusion" if found["factor"] is None else "contraction",
        }


#: The numbers of an edition.
NAMES = ("C_K", "C_T", "C_T_tilde", "C0", "C1", "C2", "C3", "C4", "C5", "C6", "factor", "one_minus_factor")


_THRESHOLD: dict[str, Any] = {
    "says": "thresholds of Proposition 5.6 on k, or on C_K where C_s and C_tr are not known",
    "unit": "1 or stress",
    "null": "where every friction is below",
    "why": "C_s C_tr = 0: every friction coefficient is below",
}


@dataclass(frozen=True, kw_only=True)
class Bounds(Answer):
    """The answer of an edition: ``factor`` is K(theta), ``interval`` has all cases of Proposition 5.6, None from C2 on.

    ``why`` is the reason for an interval of None.
    """

    part: ClassVar[str] = "Bound of Section 5"

    edition: Edition
    C_K: Number = key("friction constant", unit="stress")
    C_T: Number = key("Lipschitz constants (5.16), (5.35)")
    C_T_tilde: Number = key("Lipschitz constants (5.16), (5.35)")
    C0: Number = key("where the two estimates of the factor meet, and the end of the interval of theta")
    C1: Number = key("where the two estimates of the factor meet, and the end of the interval of theta")
    C2: Number | None = key(**_THRESHOLD)
    C3: Number | None = key(**_THRESHOLD)
    C4: Number | None = key(**_THRESHOLD)
    C5: Number | None = key(**_THRESHOLD)
    C6: Number | None = key("lower end of the interval", null="where that is 0", why="a' >= -1: no lower end but 0")
    proved: bool = key("whether the proof behind this edition holds for these constants, all that are enclosed")
    threshold_on: Literal["k", "C_K"] = key("`k` or `C_K`")
    why: str = "friction at or above C2"

    def without_conclusion(self, why: str) -> Bounds:
        """The same constants, and no theta that contracts."""
        verdict: Conclusion | None = None if self.theta is None else "no conclusion"
        none = replace(self, interval=None, interval_proved=None, factor=None, one_minus_factor=None)
        return replace(none, verdict=verdict, why=why)


def evaluate(edition: Edition, constants: Constants, theta: Numeric | None = None) -> Bounds:
    """Evaluate an edition of Proposition 5.6.

    T_theta contracts for ``max(0, C6) < theta < C1`` as long as ``k < C2``, with ``K^2 = max(h1, h2)``; the four cases
    of the proposition are one (C5 = C2 identically, h1 = h2 at C0, and the end points C3, C4 hold too).

    Parameters
    ----------
    edition : Edition
        ``PRINTED`` or ``REPAIRED``.
    constants : Constants
    theta : number, optional
        Relaxation factor, 0 < theta < 1, read exactly.

    Returns
    -------
    Bounds
        Right to the last place of a double: evaluated with 200 decimal digits, comparisons included.  If every constant
        is exact or an enclosure, the numbers are enclosures too, at the weakest level (``verified`` at best), but
        ``factor`` and ``one_minus_factor`` only if theta is inside the contraction interval throughout.
        ``interval`` and ``verdict`` come from the values, not from the enclosures.

    Raises
    ------
    HypothesisError
        theta outside (0, 1), or constants so far apart that a bound overflows a double.

    Examples
    --------
    >>> b = evaluate(REPAIRED, Constants(m=1, M=2, C_R=1, C_K=0), theta="1/3")
    >>> b.C0.value, b.verdict, round(b.factor.value, 6)
    (0.3333333333333333, 'contraction', 0.666667)
    >>> m = Number(value=1.0, lo=0.999, hi=1.001, level="verified")
    >>> b = evaluate(REPAIRED, Constants(m=m, M=2, C_R=1, C_K=0), theta="1/3")
    >>> b.factor.level, round(b.factor.lo, 3), round(b.factor.hi, 3)
    ('verified', 0.667, 0.677)
    """
    chosen = None if theta is None else relaxation_factor(theta)
    scale = constants.friction_scale
    with working_precision():
        t = None if chosen is None else decimal(chosen)
        here = (constants.m, constants.M, constants.C_R, constants.C_K, scale)
        found = _figures(edition, here, t, MARGIN)
        if not all(math.isfinite(float(found[name])) for name in ("Q", "C_T_tilde")):
            m, M, C_R = (decimal(value) for value in here[:3])
            raise HypothesisError("M C_R / m", f"{M * C_R / m:.3g}", "constants whose bounds fit into a double")
        corners = [_figures(edition, corner, t, SLACK) for corner in constants.corners or ()]
        level = weakest([constants.level, "verified"])

        def number(name: str) -> Scalar:
            ends = _ends_of_C1(corners) if name == "C1" else [corner[name] for corner in corners]
            return rounded(found[name], ends, level)

        least = constants.ends("m")
        return Bounds(
            edition=edition,
            **{name: number(name) for name in NAMES},
            **Answer.shared(found, corners, level, chosen),
            proved=edition.proved(constants.m if least is None else least[0]),
            threshold_on="C_K" if scale is None else "k",
        )


def _ends_of_C1(corners: list[dict[str, Any]]) -> list[Decimal | None]:
    """Ends of an enclosure of C1: ends of the intervals; where there are none, C1 of D and Q at opposite ends.

    C1 falls as Q grows, and does not fall as D grows, since Q >= 1 for m <= M and C_R >= 1.
    """
    if all(corner["high"] is not None for corner in corners):
        return [corner["high"] for corner in corners]
    return [C1(one["D"], other["Q"]) for one, other in zip(corners, reversed(corners), strict=True)]


def _figures(edition: Edition, at: Corner, theta: Decimal | None, margin: Decimal) -> dict[str, Any]:
    """The values of an edition for m, M, C_R, C_K and C_s C_tr: decimals by name, None where there is none.

    ``low`` and ``high`` are the ends of the interval; an end within the ``margin``, relatively, counts as met.
    """
    m, M, C_R, x = (decimal(value) for value in at[:4])
    read, u = edition.coercivity(m), edition.unit(m)
    shared = (read, M, C_R)
    p, d, q = P(x, *shared, u), D(x, *shared, u), Q(x, *shared)
    c1 = C1(d, q)
    ends: tuple[Scalar, ...] = thresholds(*shared, u)
    # C1 - C0 can be 1e-22 relative: never compare those two instead.
    low = high = factor = rest = None
    if x < ends[0] * (1 - margin):
        low, high = lower_end(p), c1
        if theta is not None and low * (1 + margin) < theta < high * (1 - margin):
            factor, rest = factor_and_rest(one_minus_square(theta, p, d, q))
    if at[4] is not None:
        ends = tuple(end / decimal(at[4]) for end in ends) if at[4] else (None,) * 4
    names = ("C2", "C3", "C4", "C5")
    return dict(zip(names, ends, strict=True)) | {
        "C_K": x,
        "C_T": lipschitz(m, M, C_R, x),
        "C_T_tilde": lipschitz(*shared, x),
        "D": d,
        "Q": q,
        "C0": C0(*shared),
        "C1": c1,
        "C6": C6(p) if p > 1 else None,
        "low": low,
        "high": high,
        "factor": factor,
        "one_minus_factor": rest,
    }

"""The paper's formulas (5.16), (5.34)-(5.46), copied term by term into many digits: an oracle that shares no code.

Nothing is rearranged against cancellation; instead `DIGITS` exceeds what the formulas can lose. Over constants in
1e-12..1e12 the coefficient a reaches 1e180, and 1 - h1 loses as many digits near theta = C1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from mpmath import mp, mpf

DIGITS = 400
THRESHOLD_DIGITS = 150
BRACKET = mpf(10) ** -120  # on either side of log x, G - y must have the right sign


def real(value: Any) -> mpf:
    """A rational as a quotient in `DIGITS` digits; a binary float is the number it stores."""
    if isinstance(value, mpf):
        return value
    value = Fraction(value)
    with mp.workdps(DIGITS):
        return mpf(value.numerator) / mpf(value.denominator)


def rational(value: mpf, digits: int) -> Fraction:
    """A high-precision value to `digits` significant decimals."""
    with mp.workdps(DIGITS):
        return Fraction(mp.nstr(value, digits, min_fixed=1, max_fixed=0))


def square_root(value: Any) -> mpf:
    """In `DIGITS` digits."""
    with mp.workdps(DIGITS):
        return mp.sqrt(real(value))


def inverse(G: Callable[[mpf], mpf], y: mpf) -> mpf:
    """Solve G(x) = y > 0 for x > 0: secants on logarithms, where the slope of G lies between 1 and 2."""
    with mp.workdps(THRESHOLD_DIGITS):  # positive terms: nothing cancels
        ratio = mp.log(y / G(mpf(1)))
        excess = lambda t: mp.log(G(mp.exp(t)) / y)
        t = mp.findroot(excess, (ratio / 2, ratio), tol=mpf(10) ** -250) if ratio else ratio
        if not excess(t - BRACKET) < 0 < excess(t + BRACKET):
            raise ArithmeticError(f"G(x) = {y} is not solved by x = exp({t})")
        return mp.exp(t)


@dataclass(frozen=True)
class Paper:
    """One edition at one set of constants, m standing for m~; thresholds are on C_K (the paper's, times C_s C_tr)."""

    m: mpf
    M: mpf
    C_R: mpf
    C_K: mpf
    C_T: mpf
    C_T_tilde: mpf
    bracket: mpf  # what follows 2 theta (1 - theta) in (5.36)
    G: Callable[[mpf], mpf]

    @cached_property
    def a(self) -> mpf:
        """Below (5.39)."""
        with mp.workdps(DIGITS):
            return (
                self.C_T_tilde**2 * self.M**2 / self.m**2 + 2 * self.C_T_tilde**2 / self.C_R**2 - 2 * self.bracket + 1
            )

    @cached_property
    def b(self) -> mpf:
        """Below (5.39)."""
        with mp.workdps(DIGITS):
            return -2 * self.C_T_tilde**2 / self.C_R**2 + 2 * self.bracket - 2

    @cached_property
    def a_prime(self) -> mpf:
        """Below (5.45)."""
        with mp.workdps(DIGITS):
            return 1 - 2 * self.bracket

    @cached_property
    def b_prime(self) -> mpf:
        """Below (5.45)."""
        with mp.workdps(DIGITS):
            return -2 + 2 * self.bracket

    @cached_property
    def C0(self) -> mpf:
        """(5.37)."""
        with mp.workdps(DIGITS):
            return 2 * self.m**2 / (self.M**2 * self.C_R**2 + 2 * self.m**2)

    @cached_property
    def C1(self) -> mpf:
        """(5.40)."""
        with mp.workdps(DIGITS):
            return -self.b / self.a

    @cached_property
    def C6(self) -> mpf | None:
        """After Case 2-3; it is used where a' < -1 only."""
        with mp.workdps(DIGITS):
            return 1 + 1 / self.a_prime if self.a_prime < -1 else None

    @cached_property
    def right(self) -> dict[str, mpf]:
        """The arguments of G^-1 that define C2 to C5."""
        with mp.workdps(DIGITS):
            return {
                "C2": self.m**5 / (self.M**2 * self.C_R**2) + self.m**3,
                "C3": self.m**3 / 2,
                "C4": self.m**3,
                "C5": (2 - self.C0) / (1 - self.C0) * self.m**3 / 2,
            }

    def threshold(self, name: str) -> mpf:
        """C2, .., C5, on C_K."""
        return inverse(self.G, self.right[name])

    def below(self, name: str) -> bool:
        """C_K < G^-1(y), read as G(C_K) < y."""
        with mp.workdps(DIGITS):
            return bool(self.G(self.C_K) < self.right[name])

    def h1(self, theta: Any) -> mpf:
        """(5.39)."""
        theta = real(theta)
        with mp.workdps(DIGITS):
            return self.a * theta**2 + self.b * theta + 1

    def h2(self, theta: Any) -> mpf:
        """(5.45)."""
        theta = real(theta)
        with mp.workdps(DIGITS):
            return self.a_prime * theta**2 + self.b_prime * theta + 1

    def K(self, theta: Any) -> mpf:
        """Case 5.7 from C0 on, Case 5.8 below it."""
        with mp.workdps(DIGITS):
            return mp.sqrt(self.h1(theta) if real(theta) >= self.C0 else self.h2(theta))

    def contracts(self, theta: Any) -> bool:
        """Proposition 5.6, wording by wording, with its end points C3 and C4 put in."""
        t = real(theta)
        first = self.below("C2") and self.C0 <= t < self.C1
        second = self.below("C3") and 0 < t < self.C0
        third = not self.below("C3") and self.a_prime >= -1 and 0 < t < self.C0
        fourth = self.a_prime < -1 and self.below("C5") and self.C6 < t < self.C0
        return bool(first or second or third or fourth)


def printed(*, m: Any, M: Any, C_R: Any, C_K: Any) -> Paper:
    """The paper as printed: m~ = min(m, 1)."""
    m, M, C_R, C_K = map(real, (m, M, C_R, C_K))
    mt = min(m, mpf(1))

    def G(x: mpf) -> mpf:
        """(5.42)."""
        return M**2 * (x**2 + mp.sqrt(mt) * x ** mpf("1.5") + (M * C_R + 1) * x)

    with mp.workdps(DIGITS):
        C_T = (M * C_R / m**2) * (M * C_R + C_K + mp.sqrt(C_K * m))
        C_T_tilde = (M * C_R / mt**2) * (M * C_R + C_K + mp.sqrt(C_K * mt))
        bracket = (M**2 / mt) * (C_K * C_T_tilde / (M * C_R) + C_K / mt**2)
    return Paper(mt, M, C_R, C_K, C_T, C_T_tilde, bracket, G)


def repaired(*, m: Any, M: Any, C_R: Any, C_K: Any) -> Paper:
    """m is m, and (5.30) has the bracket (M C_R + C_K + sqrt(C_K m))/m + 1 that its sources give."""
    m, M, C_R, C_K = map(real, (m, M, C_R, C_K))

    def G(x: mpf) -> mpf:
        return M**2 * ((x**2 + mp.sqrt(m) * x ** mpf("1.5") + M * C_R * x) / m + x)

    with mp.workdps(DIGITS):
        C_T = (M * C_R / m**2) * (M * C_R + C_K + mp.sqrt(C_K * m))
        bracket = (C_K / m**2) * ((M * C_R + C_K + mp.sqrt(C_K * m)) / m + 1) * (M**2 / m)
    return Paper(m, M, C_R, C_K, C_T, C_T, bracket, G)


EDITIONS = {"printed": printed, "repaired": repaired}

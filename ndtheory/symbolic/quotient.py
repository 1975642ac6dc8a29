"""A rational expression as a polynomial times powers of polynomials, and its sign as far as the coefficients show it.

Factors stay factors: a sum takes the common ones out, so that no common denominator is expanded, and no common divisor
is sought where the signs can be read off without one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import add, mul
from typing import Any

import sympy as sp
from sympy.polys.rings import PolyElement, PolyRing


class NotRational(ValueError):
    """A root, a minimum, a division by 0: no quotient of polynomials over the rationals."""


@dataclass(frozen=True)
class Quotient:
    """``polynomial`` times the product of base^power.

    ``powers`` has the power of each base, an integer other than 0; below the line where it is negative.
    """

    polynomial: PolyElement
    powers: dict[PolyElement, int]

    @classmethod
    def of(cls, expression: Any) -> Quotient:
        """Read an expression; its symbols are the variables.

        Raises
        ------
        NotRational
            The expression is not such a quotient.

        Examples
        --------
        >>> p, q = sp.symbols("p q")
        >>> Quotient.of(p / (1 + q) ** 2 - 1 / (1 + q))
        Quotient(polynomial=p - q - 1, powers={q + 1: -2})
        """
        ring = PolyRing(sorted(expression.free_symbols, key=str), sp.ZZ)
        known = {symbol: cls(gen, {}) for symbol, gen in zip(ring.symbols, ring.gens, strict=True)}

        def read(part: Any) -> Quotient:
            if part not in known:
                if part.is_Rational:
                    known[part] = cls(ring(part.p), {ring(part.q): -1} if part.q != 1 else {})
                elif part.is_Add or part.is_Mul:
                    known[part] = reduce(add if part.is_Add else mul, map(read, part.args))
                elif part.is_Pow and part.exp.is_Integer:
                    known[part] = read(part.base) ** int(part.exp)
                else:
                    raise NotRational(str(part))
            return known[part]

        return read(expression)

    def __mul__(self, other: Quotient) -> Quotient:
        powers = {base: self.power(base) + other.power(base) for base in self.powers | other.powers}
        return Quotient(self.polynomial * other.polynomial, {base: power for base, power in powers.items() if power})

    def __add__(self, other: Quotient) -> Quotient:
        common = {base: min(self.power(base), other.power(base)) for base in self.powers | other.powers}
        rest = [
            reduce(mul, (base ** (term.power(base) - power) for base, power in common.items()), term.polynomial)
            for term in (self, other)
        ]
        return Quotient(sum(rest), {base: power for base, power in common.items() if power})

    def __pow__(self, exponent: int) -> Quotient:
        if not self.polynomial:  # so that 0 never becomes a base
            if exponent < 0:
                raise NotRational("a division by 0")
            return self
        one = self.polynomial.ring.one
        powers = {base: power * exponent for base, power in self.powers.items()}
        return Quotient(one, powers) * Quotient(one, {self.polynomial: exponent})

    def power(self, base: PolyElement) -> int:
        """The power of a base, 0 if the base is not a factor."""
        return self.powers.get(base, 0)

    def cancelled(self) -> Quotient:
        """The same, as one numerator and one denominator without a common factor."""
        above, below = (
            reduce(mul, (base ** (sign * power) for base, power in self.powers.items() if sign * power > 0), start)
            for sign, start in ((1, self.polynomial), (-1, self.polynomial.ring.one))
        )
        numerator, denominator = above.cancel(below)
        return Quotient(numerator, {denominator: -1})

    def is_certified(self, *, strict: bool) -> bool:
        """True if the signs of all factors show that it is at least 0, or above 0 if strict.

        Factors below the line must be shown to differ from 0 in any case.
        """
        signs = [sign(base, nonzero=strict or power < 0) ** abs(power) for base, power in self.powers.items()]
        return reduce(mul, signs, sign(self.polynomial, nonzero=strict)) == 1


def sign(polynomial: PolyElement, *, nonzero: bool) -> int:
    """Return 1 or -1 where coefficients of one sign show it for parameters >= 0, else 0.

    With ``nonzero`` the polynomial must also have a term in which all parameters are > 0: it is never 0 then.
    """
    symbols = polynomial.ring.symbols
    terms = [[s for s, power in zip(symbols, powers, strict=True) if power] for powers in polynomial.monoms()]
    if not all(symbol.is_nonnegative for term in terms for symbol in term):
        return 0
    if nonzero and not any(all(symbol.is_positive for symbol in term) for term in terms):
        return 0
    return next((one for one in (1, -1) if all(one * coefficient > 0 for coefficient in polynomial.coeffs())), 0)

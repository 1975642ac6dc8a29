"""The constants of the energy norms as symbols, and what decides equalities and inequalities among them."""

import sympy as sp

from ndtheory import energy_norms

s, d = sp.symbols("s d", positive=True)  # d: any further amount > 0
kappa_1, e, g = sp.symbols("kappa_1 e g", nonnegative=True)
theta = sp.Symbol("theta", positive=True)
x = sp.Symbol("x", real=True)

rho = s**2
r = s + kappa_1 + e
kappa_2 = e * r
DATA = (rho, kappa_1, kappa_2)
FRICTION = (kappa_1, kappa_2)


def plain(expression):
    """The same with every root of a square taken."""
    is_root = lambda term: term.is_Pow and abs(term.exp) == sp.Rational(1, 2)
    return sp.sympify(expression).replace(is_root, lambda term: sp.sqrt(sp.factor(term.base)) ** (2 * term.exp))


def quotient(expression):
    """Numerator and denominator without a common factor, expanded."""
    return tuple(map(sp.expand, sp.fraction(sp.cancel(plain(expression)))))


def zero(expression) -> bool:
    """Whether an expression vanishes identically."""
    return sp.expand(sp.fraction(sp.together(plain(expression)))[0]) == 0


def certified(polynomial) -> bool:
    """Whether it is a polynomial in quantities >= 0 without a negative coefficient."""
    known = (s, d, kappa_1, e, g)
    return polynomial.free_symbols <= set(known) and min(sp.Poly(polynomial, *known).coeffs()) >= 0


def above_zero(polynomial) -> bool:
    """Whether, besides, one of its terms consists of quantities > 0 alone."""
    return certified(polynomial) and polynomial.subs({kappa_1: 0, e: 0, g: 0}) != 0


def never_negative(expression) -> bool:
    numerator, denominator = quotient(expression)
    return certified(numerator) and above_zero(denominator)


def positive(expression) -> bool:
    return all(map(above_zero, quotient(expression)))


RATIO = plain(energy_norms.largest_ratio(*DATA))
TURN = sp.cancel(plain(energy_norms.turning_theta(*DATA)))
VERTEX = (1 - theta) * kappa_1 / (2 - (2 + rho) * theta)
SLOPE = 1 + s * r  # of |1 - theta (1 + sqrt(rho) r)| in theta


def right_side(at, theta=theta, rho=rho):
    return energy_norms.square_at(at, theta, rho, *FRICTION)

"""Symbols, units and charts that checks of several modules share."""

from __future__ import annotations

import sympy as sp

from ndtheory.symbolic.dimension import Dimension
from ndtheory.symbolic.engine import Vector, bilinear, functional, nonnegative, positive

# The constants, and norms of the differences of two solutions: |w1-w~1|_1, |w2-w~2|_2 and |||psi-psi~|||.
m, M, C_R = positive("m M C_R")
x = sp.Symbol("C_K", nonnegative=True)
theta = positive("theta")
d1, d2, e = nonnegative("d_1 d_2 e")
k, C_s = nonnegative("k C_s")
C = positive("C")  # any constant
A = M * C_R

#: Exponents of stress and length.  Energies and forces are per unit thickness.
DIMENSIONS: dict[str, Dimension] = {
    **dict.fromkeys(["m", "M", "C_K", "m_tilde"], (sp.Integer(1), sp.Integer(0))),
    **dict.fromkeys(["d_1", "d_2"], (sp.Integer(0), sp.Integer(1))),
    **dict.fromkeys(["n", "t_n"], (sp.Integer(1), sp.Integer(1))),
    **dict.fromkeys(["e", "t"], (sp.Rational(1, 2), sp.Integer(1))),
    **dict.fromkeys(["F", "a_11", "W"], (sp.Integer(1), sp.Integer(2))),
    "C_s": (sp.Integer(1), sp.Rational(-1, 2)),
    "C_tr": (sp.Integer(0), sp.Rational(1, 2)),
}

# Parameters of the charts: p, q, r, o slack of a premise; mu, xi roots of m, C_K; 2 + b = M/m, 1 + c = C_R.
mu, y = positive("mu y")
b, c, xi, p, q, r, o = nonnegative("b c xi p q r o")

#: Every m > 0, M >= 2 m by (4.2), C_R >= 1, C_K >= 0.
CONSTANTS = {m: mu**2, M: mu**2 * (2 + b), C_R: 1 + c, x: xi**2}

# Fields, of which linearity is all that is known, and the forms and loads of the bodies.
test, psi = map(Vector, ("v", "psi"))
a1, a2, L1, L2 = bilinear("a1"), bilinear("a2"), functional("L1"), functional("L2")

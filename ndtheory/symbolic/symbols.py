"""Symbols, units and charts that the checks share, and the bounds that the proof of Section 5 supplies."""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory.symbolic import engine
from ndtheory.symbolic.dimension import Dimension
from ndtheory.symbolic.engine import Goal, Vector, bilinear, functional, linear, nonnegative, positive

# --- symbols: the constants, and the norms of the differences of two solutions --------------------------------------

m, M, C_R, m_tilde = positive("m M C_R m_tilde")
x = sp.Symbol("C_K", nonnegative=True)
theta = positive("theta")
d1, d2, n, e, tn, t = nonnegative("d_1 d_2 n e t_n t")  # |w1-w~1|_1, |w2-w~2|_2, |psi-psi~|, |||psi-psi~|||, same of T
F, q1, W = sp.symbols("F a_11 W", real=True)  # (5.13) left, a1(w1-w~1, w1-w~1), a2(R2(T psi-T psi~), R2(psi-psi~))
k, C_s, C_tr, C_tr_half = nonnegative("k C_s C_tr C_tr_half")
C_T, C_T_tilde = positive("C_T C_T_tilde")
C = positive("C")  # any constant

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

A = M * C_R
s = sp.sqrt(m * x)

# Parameters of the charts: p, q, r, o slack of a premise; mu, xi roots of m, C_K; 2 + b = M/m, 1 + c = C_R.
mu, t_, y = positive("mu tau y")
b, c, xi, p, q, r, o = nonnegative("b c xi p q r o")

#: Every m > 0, M >= 2 m by (4.2), C_R >= 1, C_K >= 0.
CONSTANTS = {m: mu**2, M: mu**2 * (2 + b), C_R: 1 + c, x: xi**2}
#: The same with a rational root of M.
ROOTS = {m: mu**2, M: (mu * (1 + b)) ** 2}  # M >= m
#: The same, and 0 < theta < 1.
WITH_THETA = {**CONSTANTS, theta: t_ / (1 + t_)}
#: The same for m <= 1 and for m >= 1, with m~ = min(m, 1).
SMALL_M = {m: 1 / (1 + o) ** 2, m_tilde: 1 / (1 + o) ** 2, M: (2 + b) / (1 + o) ** 2, C_R: 1 + c, x: xi**2}
LARGE_M = {m: (1 + o) ** 2, m_tilde: 1, M: (2 + b) * (1 + o) ** 2, C_R: 1 + c, x: xi**2}

with_theta = lambda chart: {**chart, theta: t_ / (1 + t_)}

# --- fields, of which linearity is all that is known -----------------------------------------------------------------

w1, v1, w2, v2, test = map(Vector, ("w1", "w~1", "w2", "w~2", "v"))
psi, psi2 = Vector("psi"), Vector("psi~")
a1, a2, L1, L2 = bilinear("a1"), bilinear("a2"), functional("L1"), functional("L2")  # forms and loads of the bodies
lift, lift2 = linear("R1"), linear("R2")
delta1, delta2 = w1 - v1, w2 - v2

# --- norms and strains of one field ----------------------------------------------------------------------------------

M_1 = positive("M_1")
u_1, u_2, v_1, v_2 = nonnegative("u_1 u_2 v_1 v_2")  # norms of two fields on body 1 and on body 2
lame_mu = positive("lame_mu")
exx, eyy, exy = sp.symbols("e_xx e_yy e_xy", real=True)
strain_energy = lambda lam: 2 * lame_mu * (exx**2 + eyy**2 + 2 * exy**2) + lam * (exx + eyy) ** 2  # sigma : e

# --- what the proof supplies ----------------------------------------------------------------------------------------

#: d_1 <= X d_2, by (5.14).
X = (A + x) / m + sp.sqrt(x / m)
#: The friction term is at most P e^2, by (5.13), (5.11), (5.19), (5.23); and what the paper prints for it, by m.
P = x / m**2 * (X + 1) * M**2 / m
printed_P = lambda m: x / m**2 * (A + x + sp.sqrt(m * x) + 1) * M**2 / m
#: |||T psi - T psi~|||^2 <= Q e^2, by (5.22), (5.18), (5.11), (5.19), (5.23).
Q = (A * X / m * M / m) ** 2
below = 2 * theta * (1 - theta) * m**2 / A**2  # what (5.29) takes off the coefficient of t^2

of_h2 = lambda P: (1 - theta) ** 2 + 2 * theta * (1 - theta) * P
of_h1 = lambda m, P, Q: (theta**2 - 2 * theta * (1 - theta) * m**2 / A**2) * Q + of_h2(P)


def at_most(bound: Any, value: Any, *charts: Any) -> Goal:
    """value <= bound in each chart; for all constants by default."""
    return engine.at_most(bound, value, *(charts or (CONSTANTS,)))

"""Sections 2 to 4, and (5.1) to (5.10): the contact problem, the algorithm and its weak form.

What is computed with generic vectors holds for all of them.  One bar, one node or one strip (``one_case``) refutes what
it contradicts and proves nothing: the general form is then read, in the proof of the statement.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import sympy as sp

from ndtheory.symbolic.engine import (
    Check,
    Goal,
    Vector,
    add,
    at_most,
    bilinear,
    equal,
    functional,
    less,
    linear,
    nonnegative,
    positive,
)
from ndtheory.symbolic.symbols import C_R, CONSTANTS, M, m, o, p, q, r, theta, y

CHECKS: list[Check] = []
check = partial(add, CHECKS)

# --- Section 2 ------------------------------------------------------------------------------------------------------

lame_mu, lame_lambda = positive("lame_mu lame_lambda")
exx, eyy, exy = sp.symbols("e_xx e_yy e_xy", real=True)
C = positive("C")

check(
    id="2.2",
    text="Isotropic Hooke in the plane: sigma : e = mu ((e_xx - e_yy)^2 + 4 e_xy^2) + (lambda + mu) (tr e)^2, which is"
    " elliptic.",
    one_case=True,
    goals=lambda form: [
        equal(
            2 * lame_mu * (exx**2 + eyy**2 + 2 * exy**2) + lame_lambda * (exx + eyy) ** 2,
            lame_mu * ((exx - eyy) ** 2 + 4 * exy**2) + form * (exx + eyy) ** 2,
        )
    ],
    forms={"printed": lame_lambda + lame_mu},
    mutants={"lambda + 2 mu": lame_lambda + 2 * lame_mu},
)

sxx, syy, sxy, other = sp.symbols("s_xx s_yy s_xy s", real=True)
t = positive("t")
normal = sp.Matrix([1 - t**2, 2 * t]) / (1 + t**2)  # every unit vector but one and its mirror images
along = sp.Matrix([-normal[1], normal[0]])
stress1 = sp.Matrix([[sxx, sxy], [sxy, syy]])
stress2 = stress1 + other * along * along.T  # the same traction on the interface: sigma^1 n^1 = - sigma^2 n^2


def _shear(stress: Any, n: Any) -> Any:
    traction = stress * n
    return traction - (n.T * traction)[0] * n


check(
    id="2.3",
    text="Action and reaction, sigma^1 n^1 + sigma^2 n^2 = 0 with n^2 = -n^1: the normal stresses are equal, the"
    " tangential"
    " stress vectors are opposite.",
    goals=lambda form: [
        equal((normal.T * stress1 * normal)[0], (normal.T * stress2 * normal)[0]),
        *(equal(a, form * b) for a, b in zip(_shear(stress1, normal), _shear(stress2, -normal), strict=True)),
    ],
    forms={"printed": 1, "repaired": -1},
    mutants={"twice": -2},
)

apart = positive("d")  # how far tau moves

check(
    id="2.5",
    text="That |S(tau)| <= |tau| does not make S Lipschitz, which (5.13) uses: S(tau) = tau for tau >= 1 and 0 below"
    " jumps by 1 between 1 - d and 1, however small d > 0 is, while C d < 1 for every d < 1/C, whatever C.  A linear S"
    " has the difference S(d).",
    goals=lambda form: [at_most(C * apart, form(apart)), less(C * apart, 1, {apart: 1 / (C * (1 + y))})],
    forms={"step": lambda d: sp.Integer(1), "repaired": lambda d: C * d / (1 + q)},
    mutants={"twice the bound": lambda d: 2 * C * d},
)

b, slip = positive("b"), nonnegative("u_T")

check(
    id="2.6",
    text="With |tau| <= b = k|S(sigma_N)| and slip u >= 0, b > 0: for tau = -b (2.6) holds; for tau = -b + t it is"
    " positive"
    " unless u = 0.  Where b = 0 (2.6) holds for every slip, while (2.5) as printed asks for u = -nu tau = 0.",
    goals=lambda form: [equal(b * slip + form[0] * b * slip, 0), less(0, b * y + (-b + t) * y), equal(form[1], 0)],
    forms={"printed": (-1, slip), "repaired": (-1, sp.Integer(0))},
    mutants={"shear in the direction of the slip": (1, sp.Integer(0))},
)

# --- Section 3, in one dimension ------------------------------------------------------------------------------------

X, f, young, length = sp.symbols("X f E L", positive=True)
c1, c2 = sp.symbols("c_1 c_2", real=True)


def _weak(sign: Any) -> Goal:
    """E u'' = sign f, tested with v = c_1 X + c_2 X^2: int E u' v' = int f v + E u'(L) v(L)."""
    u = sign * f * X**2 / (2 * young) + c1 * X
    v = c1 * X + c2 * X**2
    over = lambda expression: sp.integrate(sp.expand(expression), (X, 0, length))
    end = young * sp.diff(u, X).subs(X, length) * v.subs(X, length)
    return equal(over(young * sp.diff(u, X) * sp.diff(v, X)), over(f * v) + end)


for number, body in ((1, "2"), (2, "1")):
    check(
        id=f"3.1.{number}",
        text=f"A bar with E u'' = -f has the weak form (4.9), int E u' v' = int f v + (end force) v; with div sigma = f"
        f" for body {body} the load has the other sign than in (2.1).",
        one_case=True,
        goals=_weak,
        forms={"printed": 1, "repaired": -1},
        mutants={"no load": sp.Integer(0), "twice": -2},
    )

S_1, S_2 = positive("S_1 S_2")
load_1, load_2, g = sp.symbols("l_1 l_2 g", real=True)


def _bars(sign: Any) -> list[Goal]:
    """Two bars in contact: the solution must be a fixed point, and a step multiplies errors by 1 - theta - theta"
    " rho."""
    end = lambda g: (g + load_2) / S_2  # displacement of the end of body 2 under the force g
    step = lambda g: sign * theta * (S_1 * end(g) - load_1) + (1 - theta) * g  # sigma^1 n^1 = S_1 u - l_1
    solution = S_2 * (load_1 + load_2) / (S_1 + S_2) - load_2
    return [equal(step(solution), solution), equal(sp.diff(step(g), g), 1 - theta - theta * S_1 / S_2)]


check(
    id="3.1.3",
    text="Two bars that stay in contact, g = sigma^2 n^2 = -sigma^1 n^1 at the solution: only -theta sigma^1 n^1"
    " leaves the"
    " solution where it is.  The printed sign multiplies errors by 1 - theta + theta rho.",
    one_case=True,
    goals=_bars,
    forms={"printed": 1, "repaired": -1},
    mutants={"twice": -2},
)

# --- Section 4 ------------------------------------------------------------------------------------------------------

first, second = (lambda v: sp.sqrt(100 * v[0] ** 2 + v[1] ** 2)), (lambda v: sp.sqrt(v[0] ** 2 + 100 * v[1] ** 2))
one, two = (sp.Integer(1), sp.Integer(0)), (sp.Integer(0), sp.Integer(1))

check(
    id="norm-half",
    text="The smaller of two norms is no norm: of sqrt(100 v_1^2 + v_2^2) and sqrt(v_1^2 + 100 v_2^2) it is 1 at both"
    " unit"
    " vectors and sqrt(101) at their sum.  The larger one: N_1(u+v) <= N_1(u) + N_1(v) <= max(u) + max(v).",
    goals=lambda form: form(),
    forms={
        "printed": lambda: at_most(
            *(sum(sp.Min(first(v), second(v)) for v in vs) for vs in ((one, two), ((sp.Integer(1), sp.Integer(1)),)))
        ),
        "repaired": lambda: at_most((p + r) + (q + o), (p + q) / (1 + y)),  # p, q the values of N_1
    },
    mutants={"half the larger one": lambda: at_most((p + r) / 2 + (q + o) / 2, (p + q) / (1 + y))},
)

M_1, m_1 = positive("M_1 m_1")
u1, u2, v1, v2 = nonnegative("u_1 u_2 v_1 v_2")

check(
    id="4.3",
    text="|a(u, v)| <= M_1 u_1 v_1 + M_2 u_2 v_2 <= (M_1 + M_2) |u| |v|, and a(v, v) >= min(m_1, m_2) |v|^2.",
    goals=lambda form: [
        at_most(
            form[0](M_1, M_1 + o) ** 2 * (u1**2 + u2**2) * (v1**2 + v2**2),
            (M_1 * u1 * v1 + (M_1 + o) * u2 * v2) ** 2,
            squares=[M_1 * (M_1 + o) * (u1 * v2 - u2 * v1) ** 2],
        ),
        at_most(m_1 * v1**2 + (m_1 + o) * v2**2, form[1](m_1, m_1 + o) * (v1**2 + v2**2)),
    ],
    forms={"printed": (lambda one, other: one + other, lambda small, large: small)},
    mutants={
        "the smaller M": (lambda one, other: one, lambda small, large: small),
        "a quarter of the sum": (lambda one, other: (one + other) / 4, lambda small, large: small),
        "the larger m": (lambda one, other: one + other, lambda small, large: large),
    },
)

check(
    id="4.2",
    text="With M the sum, M >= 2 m: each M^a >= m^a >= m.",
    goals=lambda form: at_most((m_1 + o + p) + (m_1 + q + r), form * m_1),
    forms={"printed": 2},
    mutants={"M >= 3 m": 3},
)

check(
    id="4.7",
    text="Two bars, |phi|^2 = coth(L_2) >= 1/L_2 in the norm of the one, |R phi|^2 = L_1/3 + 1/L_1 in the other:"
    " measured in"
    " another body the norm of a trace exceeds that of its lift.  In the same body the infimum is at most one of its"
    " values.",
    goals=lambda form: form(y),
    forms={
        "printed": lambda lifted: at_most(lifted / 3 + 1 / lifted, 1 / t),
        "repaired": lambda lifted: at_most(lifted, lifted / (1 + p)),
    },
    mutants={"half the norm of the lift": lambda lifted: at_most(lifted / 2, lifted / (1 + p))},
)

check(
    id="4.8",
    text="m |R phi|^2 <= a(R phi, R phi) <= a(v, v) <= M |v|^2 for each v of that trace, and the infimum over v: the"
    " constant sqrt(M/m), in the norm of the lift's own body.",
    goals=lambda form: at_most(form**2 * y**2, M * y**2 / (m * (1 + p) * (1 + q) * (1 + r)), CONSTANTS),
    forms={"repaired": sp.sqrt(M / m)},
    mutants={"1": sp.Integer(1), "m/M": sp.sqrt(m / M)},
)


check(
    id="prop-4.1.2",
    text="|R^b gamma v|_b^2 <= M/m |gamma v|^2 in the trace norm of body b by (4.8), that norm is at most C times the"
    " one of body a by (i), and the trace of v has a norm of at most |v|_a there.",
    goals=lambda form: at_most(form * y**2, M * C**2 * y**2 / (m * (1 + p) * (1 + q) * (1 + r)), CONSTANTS),
    forms={"printed": M / m * C**2},
    mutants={"without C": M / m, "without M/m": C**2, "C for C^2": M / m * C},
)

check(
    id="rem-4.3",
    text="|<g, v>| <= (M |u| + |L|) |R gamma v| <= (M |u| + |L|) C |v| by Proposition 4.1 (ii).",
    goals=lambda form: at_most(form, (M * o / (1 + p) + q) * (C * y / (1 + r)), CONSTANTS),
    forms={"printed": (M * o + q) * C * y},
    mutants={"without C": (M * o + q) * y, "without the load": M * o * C * y},
)

w1, w2, test, field = Vector("u1"), Vector("u2"), Vector("v"), Vector("w")
a1, a2 = bilinear("a1"), bilinear("a2")
lift, L1, L2, force = linear("R1"), functional("L1"), functional("L2"), functional("g")

check(
    id="4.9.2",
    text="One node that sticks, u = u_2, |tau| <= b: tau w + b (|w| - j) >= 0 for all w needs j = 0, which is the jump"
    " |u - u_2| and not |u|.",
    one_case=True,
    goals=lambda form: [
        at_most((-b / (1 + p)) * o + b * (o - form), 0),  # w >= 0
        at_most((b / (1 + p)) * (-o) + b * (o - form), 0),  # w <= 0
    ],
    forms={"printed": positive("u_2"), "repaired": sp.Integer(0)},
    mutants={"half of it": positive("u_2") / 2},
)

check(
    id="4.9.3",
    text="Bar 1 with E u'' = -f: minus the end force on v is -a_1(u, v) + L_1(v), so that (III) is -theta sigma^1 n^1.",
    one_case=True,
    goals=lambda form: _green(form),
    forms={"printed": -1},
    mutants={"the sign": 1, "twice": -2},
)


def _green(sign: Any) -> Goal:
    u = -f * X**2 / (2 * young) + c1 * X
    v = c2 * X
    over = lambda expression: sp.integrate(sp.expand(expression), (X, 0, length))
    end = young * sp.diff(u, X).subs(X, length) * v.subs(X, length)
    return equal(sign * end, -over(young * sp.diff(u, X) * sp.diff(v, X)) + over(f * v))


# --- (5.1) to (5.10) ------------------------------------------------------------------------------------------------

check(
    id="5.1",
    text="At the limit (III) reads g = theta (-a_1(u1, R v) + L_1(R v)) + (1-theta) g: g is that functional.",
    goals=lambda form: equal(
        theta * (-a1(w1, lift(test)) + L1(lift(test))) + (1 - theta) * form, form, {theta: 1 / (1 + y)}
    ),
    forms={"printed": -a1(w1, lift(test)) + L1(lift(test))},
    mutants={"the sign of a_1": a1(w1, lift(test)) + L1(lift(test)), "without the lift": -a1(w1, test) + L1(test)},
)

check(
    id="5.2",
    text="The shift v = w + R u2: v - u1 is the test function of (4.9) II, and the trace of w is v - u2, whose size"
    " is the"
    " jump of the test function; V_-(0) goes over into V_-(u2).",
    goals=lambda form: [equal(form - lift(w2) - field, 0), equal(form.subs(lift(w2), w2) - w2, field)],
    forms={"printed": field + lift(w2)},
    mutants={"the sign of the lift": field - lift(w2)},
)

check(
    id="5.3",
    text="The same shift back: w = v - R u2 is in V_-(0) exactly where v is in V_-(u2), and |w_T| = |v_T - u2_T|.",
    goals=lambda form: [equal(form + lift(w2), test), equal(form.subs(lift(w2), w2), test - w2)],
    forms={"printed": test - lift(w2)},
    mutants={"the sign of the lift": test + lift(w2), "without the lift": test},
)

v_1, v_2 = Vector("v1"), Vector("v2")


def _lemma(shift: Any) -> list[Goal]:
    d = v_2 - w2
    tested = v_1 - shift * lift(d)
    P3 = a1(w1, tested - w1) - L1(tested) + L1(w1)
    P2 = a2(w2, d) - L2(d) + a1(w1, lift(d)) - L1(lift(d))
    P1 = a1(w1, v_1 - w1) + a2(w2, d) - L1(v_1) + L1(w1) - L2(d)
    return [equal(P3 + P2, P1), equal(tested.subs({lift(v_2): v_2, lift(w2): w2}) - w2, v_1 - v_2)]


check(
    id="lemma-5.2",
    text="(P3) for v1 - R(v2 - u2) and (P2) for v2 - u2, added: the elastic terms and loads are those of (P1), and"
    " the test"
    " function has the jump of v.",
    goals=_lemma,
    forms={"printed": 1},
    mutants={"without the lift": 0, "the sign of the lift": -1},
)

n = positive("n")

check(
    id="5.8",
    text="A bar-like strip (0, 2) x (0, 1/4), clamped at x = 0, Gamma_c its upper side for 1 < x < 2, v = (min(x, 1),"
    " 0):"
    " |v_T|^2 = 1 in L2(Gamma_c) and |v|^2 = 7/12.  Into H^1/2 the tangential trace has a constant of 1 at most"
    " there, as"
    " (v_1, 0) lifts it: (5.13) does not follow with that constant.",
    one_case=True,
    goals=lambda form: at_most(form * _strip(), sp.Integer(1)),
    forms={"step": sp.Integer(1), "repaired": sp.Rational(12, 7)},
    mutants={"3/2": sp.Rational(3, 2)},
)


def _strip() -> Any:
    """|v|^2 in H1 of the strip."""
    left = sp.integrate(X**2 + 1, (X, 0, 1))  # v = x, |grad v| = 1
    return (left + 1) / 4  # and v = 1 on the right half; thickness 1/4


check(
    id="C_s",
    text="w_n = (0, Y (1 - nY)^2) for 0 < Y < 1/n beside Gamma_c has the normal stress A_2222 for every n, and"
    " |w_n|^2 ="
    " 2/(15n) + 1/(105n^3): whatever C, C |w_n| < 1 for n = 1 + C^2.  For w that satisfy (5.6) sigma_N is the"
    " functional"
    " phi -> a(w, R phi n) of traces, bounded by M C_R |w|.",
    goals=lambda form: form(C),
    forms={
        "printed": lambda C: at_most(C**2 * _spike(1 + C**2), sp.Integer(1)),
        "repaired": lambda C: [
            less(C**2 * _spike(1 + C**2), 1),
            at_most(M * C_R * o, (M * o / (1 + p)) * (C_R / (1 + q)), CONSTANTS),
        ],
    },
    mutants={"C_R dropped": lambda C: at_most(M * o, (M * o / (1 + p)) * (C_R / (1 + q)), CONSTANTS)},
)


def _spike(n: Any) -> Any:
    Y = positive("Y")
    w = Y * (1 - n * Y) ** 2
    return sp.integrate(sp.expand(w**2 + sp.diff(w, Y) ** 2), (Y, 0, 1 / n))


# --- Section 6 ------------------------------------------------------------------------------------------------------

E, nu = positive("E nu")

check(
    id="sec-6.1",
    text="The law printed in 6.1 is that of plane strain: inverting e = ((1+nu) sigma - nu (1+nu) tr sigma I)/E gives"
    " lambda = E nu/((1-2nu)(1+nu)), 2 mu = E/(1+nu).  A displacement prescribed on Gamma_u leaves every difference"
    " of two"
    " solutions in V: the known part cancels.",
    goals=lambda form: [
        equal(_plane_strain(form[0] * E * nu / ((1 - 2 * nu) * (1 + nu)), E / (1 + nu)), exx),
        equal(a2((w2 + form[1] * field) - (v_2 + field), test), a2(w2 - v_2, test)),
    ],
    forms={"repaired": (1, 1)},
    mutants={"lambda/2": (sp.Rational(1, 2), 1), "the known part in one of them": (1, 0)},
)


def _plane_strain(lam: Any, two_mu: Any) -> Any:
    trace = exx + eyy
    s_xx, s_yy = two_mu * exx + lam * trace, two_mu * eyy + lam * trace
    return ((1 + nu) * s_xx - nu * (1 + nu) * (s_xx + s_yy)) / E

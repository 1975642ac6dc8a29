"""Section 5, derived a second time.

Each inequality is proved from those before it: a quantity known to be at most b is written b/(1+p) or b - p with a free
parameter, so that what is proved holds for every value the premises allow.  Inner products enter only through the
Cauchy-Schwarz inequality and the definitions of the constants; the text of each check names what it uses.  What is
computed with generic vectors holds for all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic import engine
from ndtheory.symbolic.engine import (
    Check,
    CheckList,
    Goal,
    Relation,
    Vector,
    bilinear,
    equal,
    functional,
    less,
    linear,
    nonnegative,
    positive,
)
from ndtheory.symbolic.symbols import *

CHECKS = CheckList()
check = CHECKS.add

# --- what the checks of this section share ----------------------------------------------------------------------------

m_tilde, C_T, C_T_tilde, t_ = positive("m_tilde C_T C_T_tilde tau")
n, tn, t, C_tr, C_tr_half = nonnegative("n t_n t C_tr C_tr_half")  # |psi-psi~|, |T psi-T psi~|, |||T psi-T psi~|||
F, q1, W = sp.symbols("F a_11 W", real=True)  # (5.13) left, a1(w1-w~1, w1-w~1), a2(R2(T psi-T psi~), R2(psi-psi~))
s = sp.sqrt(m * x)

with_theta = lambda chart: {**chart, theta: t_ / (1 + t_)}  # 0 < theta < 1
WITH_THETA = with_theta(CONSTANTS)
#: Every m and M >= m, with a rational root of M.
ROOTS = {m: mu**2, M: (mu * (1 + b)) ** 2}
#: As CONSTANTS for m <= 1 and for m >= 1, with m~ = min(m, 1).
SMALL_M = {m: 1 / (1 + o) ** 2, m_tilde: 1 / (1 + o) ** 2, M: (2 + b) / (1 + o) ** 2, C_R: 1 + c, x: xi**2}
LARGE_M = {m: (1 + o) ** 2, m_tilde: 1, M: (2 + b) * (1 + o) ** 2, C_R: 1 + c, x: xi**2}
TILDE = (with_theta(SMALL_M), with_theta(LARGE_M))

w1, v1, w2, v2, psi2 = map(Vector, ("w1", "w~1", "w2", "w~2", "psi~"))
lift, lift2 = linear("R1"), linear("R2")
delta1, delta2 = w1 - v1, w2 - v2
reaction = lambda w, v: -a1(w, lift(v)) + L1(lift(v))  # what body 1 with the displacement w does to a trace

#: d_1 <= X d_2, by (5.14).
X = (A + x) / m + sp.sqrt(x / m)
#: The friction term is at most P e^2, by (5.13), (5.11), (5.19), (5.23); and what the paper prints for it, by m.
P = x / m**2 * (X + 1) * M**2 / m
printed_P = lambda m: x / m**2 * (A + x + sp.sqrt(m * x) + 1) * M**2 / m
#: |||T psi - T psi~|||^2 <= Q e^2, by (5.22), (5.18), (5.11), (5.19), (5.23).
Q = (A * X / m * M / m) ** 2

of_h2 = lambda P: (1 - theta) ** 2 + 2 * theta * (1 - theta) * P
of_h1 = lambda m, P, Q: (theta**2 - 2 * theta * (1 - theta) * m**2 / A**2) * Q + of_h2(P)


def at_most(bound: Any, value: Any, *charts: Any) -> Goal:
    """value <= bound in each chart; for all constants by default."""
    return engine.at_most(bound, value, *(charts or (CONSTANTS,)))


# --- the weak form of the limit, (5.1) to (5.10), and the constants that its terms need -------------------------------

u1, u2, field = Vector("u1"), Vector("u2"), Vector("w")

check(
    id="5.1",
    text="At the limit (III) reads g = theta (-a_1(u1, R v) + L_1(R v)) + (1-theta) g: g is that functional.",
    goals=lambda form: equal(theta * reaction(u1, test) + (1 - theta) * form, form, {theta: 1 / (1 + y)}),
    forms={"printed": reaction(u1, test)},
    mutants={"the sign of a_1": a1(u1, lift(test)) + L1(lift(test)), "without the lift": -a1(u1, test) + L1(test)},
)

check(
    id="5.2",
    text="The shift v = w + R u2: v - u1 is the test function of (4.9) II, and the trace of w is v - u2, whose size is"
    " the jump of the test function; V_-(0) goes over into V_-(u2).",
    goals=lambda form: [equal(form - lift(u2) - field, 0), equal(form.subs(lift(u2), u2) - u2, field)],
    forms={"printed": field + lift(u2)},
    mutants={"the sign of the lift": field - lift(u2)},
)

check(
    id="5.3",
    text="The same shift back: w = v - R u2 is in V_-(0) exactly where v is in V_-(u2), and |w_T| = |v_T - u2_T|.",
    goals=lambda form: [equal(form + lift(u2), test), equal(form.subs(lift(u2), u2), test - u2)],
    forms={"printed": test - lift(u2)},
    mutants={"the sign of the lift": test + lift(u2), "without the lift": test},
)

v_1, v_2 = Vector("v1"), Vector("v2")


def _lemma(shift: Any) -> list[Goal]:
    d = v_2 - u2
    tested = v_1 - shift * lift(d)
    P3 = a1(u1, tested - u1) - L1(tested) + L1(u1)
    P2 = a2(u2, d) - L2(d) + a1(u1, lift(d)) - L1(lift(d))
    P1 = a1(u1, v_1 - u1) + a2(u2, d) - L1(v_1) + L1(u1) - L2(d)
    return [equal(P3 + P2, P1), equal(tested.subs({lift(v_2): v_2, lift(u2): u2}) - u2, v_1 - v_2)]


check(
    id="lemma-5.2",
    text="(P3) for v1 - R(v2 - u2) and (P2) for v2 - u2, added: the elastic terms and loads are those of (P1), and the"
    " test function has the jump of v.",
    goals=_lemma,
    forms={"printed": 1},
    mutants={"without the lift": 0, "the sign of the lift": -1},
)

Y = positive("Y")
strip = (sp.integrate(Y**2 + 1, (Y, 0, 1)) + 1) / 4  # |v|^2: v = x and |grad v| = 1, then v = 1; thickness 1/4

check(
    id="5.8",
    text="A bar-like strip (0, 2) x (0, 1/4), clamped at x = 0, Gamma_c its upper side for 1 < x < 2, v = (min(x, 1),"
    " 0): |v_T|^2 = 1 in L2(Gamma_c) and |v|^2 = 7/12.  Into H^1/2 the tangential trace has a constant of 1 at most"
    " there, as (v_1, 0) lifts it: (5.13) does not follow with that constant.",
    one_case=True,
    goals=lambda form: at_most(form * strip, sp.Integer(1)),
    forms={"step": sp.Integer(1), "repaired": sp.Rational(12, 7)},
    mutants={"3/2": sp.Rational(3, 2)},
)


check(
    id="C_s",
    text="w_n = (0, Y (1 - nY)^2) for 0 < Y < 1/n beside Gamma_c has the normal stress A_2222 for every n, and |w_n|^2"
    " = 2/(15n) + 1/(105n^3): whatever C, C |w_n| < 1 for n = 1 + C^2.  For w that satisfy (5.6) sigma_N is the"
    " functional phi -> a(w, R phi n) of traces, bounded by M C_R |w|.",
    goals=lambda form: form(C),
    forms={
        "printed": lambda C: at_most(C**2 * _spike(1 + C**2), sp.Integer(1)),
        "repaired": lambda C: [
            less(C**2 * _spike(1 + C**2), 1),
            at_most(M * C_R * o, (M * o / (1 + p)) * (C_R / (1 + q))),
        ],
    },
    mutants={"C_R dropped": lambda C: at_most(M * o, (M * o / (1 + p)) * (C_R / (1 + q)))},
)


def _spike(n: Any) -> Any:
    """|w_n|^2."""
    w = Y * (1 - n * Y) ** 2
    return sp.integrate(sp.expand(w**2 + sp.diff(w, Y) ** 2), (Y, 0, 1 / n))


# --- Lemma 5.3 ------------------------------------------------------------------------------------------------------

S, S2, J1, J2 = nonnegative("S S~ J J~")

check(
    id="5.12",
    text="The sum of (5.9) and (5.10) for the two test functions: elastic terms, loads, friction (S, S~ the bounds, J,"
    " J~ the sizes of the jumps), and that each test function has the jump of the other solution.",
    goals=lambda form: [
        equal(a1(w1, form[0] - w1) + a1(v1, form[1] - v1), -a1(delta1, delta1) + a1(delta1, lift(delta2))),
        equal(L1(form[0] - w1) + L1(form[1] - v1), 0),
        equal(S * (J2 - J1) + S2 * (J1 - J2), -(S - S2) * (J1 - J2)),
        # traces: R_D1 leaves the trace as it is; (v - w2) must be the jump of w~, (v~ - w~2) that of w
        *(
            equal(form[i].subs({lift(w2): w2, lift(v2): v2}) - old, new)
            for i, (old, new) in enumerate(((w2, v1 - v2), (v2, w1 - w2)))
        ),
    ],
    forms={"printed": (v1 - lift(v2) + lift(w2), w1 - lift(w2) + lift(v2))},
    mutants={
        "the lift with the other sign": (v1 + lift(v2) - lift(w2), w1 + lift(w2) - lift(v2)),
        "without the lift": (v1, w1),
    },
)

check(
    id="5.13",
    text="Cauchy-Schwarz: F <= k |S sigma_N - S sigma~_N| |[w_T] - [w~_T]|, with factors of at most C_s d_2 and"
    " C_tr (d_1 + d_2), both in L2(Gamma_c).",
    goals=lambda form: at_most(form, k * (C_s * d2 / (1 + p)) * (C_tr * (d1 + d2) / (1 + q)) - r, {}),
    forms={"repaired": k * C_s * C_tr * (d1 * d2 + d2**2)},
    mutants={"without d_2^2": k * C_s * C_tr * d1 * d2, "C_s for C_s C_tr": k * C_s * (d1 * d2 + d2**2) / (1 + C_tr)},
    units={
        "printed": Relation(F, "<=", k * C_s * C_tr_half * (d1 * d2 + d2**2)),
        "repaired": Relation(F, "<=", k * C_s * C_tr * (d1 * d2 + d2**2)),
    },
)

check(
    id="5.14",
    text="m d_1^2 <= a_1(d, d) <= M d_1 (C_R d_2) + F by (5.12), with (5.13) for F.",
    goals=lambda form: at_most(form, M * d1 * (C_R * d2 / (1 + p)) / (1 + q) + x * (d1 * d2 + d2**2) - r),
    forms={"repaired": (A + x) * d1 * d2 + x * d2**2},
    mutants={"without C_R": (M + x) * d1 * d2 + x * d2**2, "without C_K d_2^2": (A + x) * d1 * d2},
    states=lambda form: Relation(m * d1**2, "<=", form),
)

check(
    id="5.15",
    text="(5.15) is (5.14) with the square completed.",
    goals=lambda form: equal(
        m * (d1 - form * d2) ** 2 - (m * form**2 + x) * d2**2, m * d1**2 - (A + x) * d1 * d2 - x * d2**2
    ),
    forms={"repaired": (A + x) / (2 * m)},
    mutants={"the factor 1/2 dropped": (A + x) / m, "1/m dropped": (A + x) / 2},
    states=lambda form: Relation(m * (d1 - form * d2) ** 2, "<=", ((A + x) ** 2 / (4 * m) + x) * d2**2),
)

check(
    id="5.11",
    text="No d_1 above the bound satisfies (5.14): at d_1 = (bound + y) d_2, y > 0, its left side is the larger one.",
    goals=lambda form: less((A + x) * (form + y) + x, m * (form + y) ** 2, CONSTANTS),
    forms={"repaired": X},
    mutants={
        "without the root": (A + x) / m,
        "1/m dropped under the root": (A + x) / m + sp.sqrt(x),
        "C_R dropped": (M + x) / m + sp.sqrt(x / m),
        "1/m dropped": A + x + sp.sqrt(x / m),
    },
    states=lambda form: Relation(d1, "<=", form * d2),
)

z = Vector("z")  # a field that vanishes on Gamma_c: v and v + z extend the same trace


def _stress(work: Any) -> Goal:
    """a(w, .) - L(.) takes one value at every extension of a trace, where a(w, z) is ``work``."""
    at = lambda extension: (a2(w2, extension) - L2(extension)).subs(a2(w2, z), work)
    return equal(at(test + z), at(test))


check(
    id="lemma-5.3",
    text="sigma_N(w2) is the functional a(w2, .) - L(.) on traces.  It takes one value at all extensions of a trace, v"
    " and v + z with z = 0 on Gamma_c, where a(w2, z) = L(z), as (5.6) has it; for any other w2 the value depends on"
    " the extension.",
    goals=_stress,
    forms={"step": a2(w2, z), "repaired": L2(z)},
    mutants={"the load with the other sign": -L2(z), "no load": sp.Integer(0)},
)

# --- Proposition 5.4 ------------------------------------------------------------------------------------------------

check(
    id="5.17",
    text="The definition of T for psi and psi~, subtracted: the loads cancel.",
    goals=lambda form: equal(reaction(w1, test) - reaction(v1, test), form),
    forms={"printed": -a1(w1 - v1, lift(test))},
    mutants={"the sign": a1(w1 - v1, lift(test)), "without the lift": -a1(w1 - v1, test)},
)

check(
    id="5.18",
    text="|a_1(w1-w~1, R_D v)| <= M d_1 (C_R |v|), divided by |v|.",
    goals=lambda form: at_most(form, M * d1 * (C_R * y / (1 + p)) / (1 + q) / y),
    forms={"printed": A * d1},
    mutants={"C_R dropped": M * d1, "m for M": m * C_R * d1},
    states=lambda form: Relation(tn, "<=", form),
)

check(
    id="5.19",
    text="m d_2^2 <= a_2(w2-w~2, w2-w~2) = <psi-psi~, w2-w~2> <= n d_2, hence n = (1+p)(1+q) m d_2.",
    goals=lambda form: at_most(form.subs(n, (1 + p) * (1 + q) * m * d2), d2),
    forms={"printed": n / m},
    mutants={"1/m^2 for 1/m": n / m**2, "M for m": n / M},
    states=lambda form: Relation(d2, "<=", form),
)

of_16, of_35 = (bounds.lipschitz(value, M, C_R, x) for value in (m, m_tilde))

check(
    id="5.16",
    text="C_T is the product of the constants of (5.18), (5.11) and (5.19).",
    goals=lambda form: equal(form, A * X / m, CONSTANTS),
    forms={"repaired": of_16},
    mutants={
        "C_R dropped": of_16 / C_R,
        "1/m for 1/m^2": of_16 * m,
        "the root of m dropped": A / m**2 * (A + x + sp.sqrt(x)),
    },
    states=lambda form: Relation(tn, "<=", form * n),
)

check(
    id="prop-5.4",
    text="|T psi - T psi~| <= A d_1, d_1 <= X d_2, d_2 <= n/m: the Lipschitz constant C_T.",
    goals=lambda form: at_most(form, A * X / (1 + p) * (n / m) / (1 + q) / (1 + r)),
    forms={"repaired": of_16 * n},
    mutants={"m for M": bounds.lipschitz(m, m, C_R, x) * n},
    states=lambda form: Relation(tn, "<=", form),
)

# --- the norm (5.21) ------------------------------------------------------------------------------------------------

check(
    id="5.21",
    text="The norm comes from an inner product: R2 is linear, and a_2(R2 psi, R2 chi) obeys the law of"
    " parallelograms; it is definite, as e = 0 means R2 psi = 0.",
    goals=lambda form: equal(form(psi + psi2) + form(psi - psi2), 2 * form(psi) + 2 * form(psi2)),
    forms={"printed": lambda u: a2(lift2(u), lift2(u))},
    mutants={"around another force": lambda u: a2(lift2(u) + test, lift2(u) + test)},
)

check(
    id="5.22",
    text="z = R2 psi: m |z|^2 <= a_2(z, z) = e^2 = <psi, z> <= n |z|, hence e^2 <= n^2/m.",
    goals=lambda form: at_most((form**2).subs(n, m * y * (1 + p) * (1 + q)), m * y**2 * (1 + p)),
    forms={"printed": n / sp.sqrt(m)},
    mutants={"1/m for 1/sqrt(m)": n / m, "M for m": n / sp.sqrt(M)},
    states=lambda form: Relation(e, "<=", form),
)

check(
    id="5.23",
    text="n = sup a_2(z, v)/|v| <= M |z|, and m |z|^2 <= e^2.",
    goals=lambda form: at_most((form**2).subs(e, sp.sqrt(m * (1 + q)) * y), (M * y / (1 + p)) ** 2),
    forms={"printed": M / sp.sqrt(m) * e},
    mutants={"sqrt(m) dropped": M * e, "m for M": sp.sqrt(m) * e},
    states=lambda form: Relation(n, "<=", form),
)

check(
    id="x-root-M",
    text="Cauchy-Schwarz in a_2: a_2(z, v)^2 <= e^2 a_2(v, v) <= e^2 M |v|^2, so sqrt(M) suffices; and it is at most"
    " M/sqrt(m).",
    goals=lambda form: [at_most((form * e) ** 2, e**2 * M / (1 + p), ROOTS), at_most(M / sp.sqrt(m), form, ROOTS)],
    forms={"repaired": sp.sqrt(M)},
    mutants={"sqrt(m)": sp.sqrt(m), "M": M},
    states=lambda form: Relation(n, "<=", form * e),
)

check(
    id="prop-5.5",
    text="(5.22) and (5.23) together, and that the lower constant is at most the upper one.",
    goals=lambda form: at_most(form[1], form[0]),
    forms={"printed": (sp.sqrt(m), M / sp.sqrt(m))},
    mutants={"constants exchanged": (M / sp.sqrt(m), sp.sqrt(m))},
    states=lambda form: [Relation(form[0] * e, "<=", n), Relation(n, "<=", form[1] * e)],
)

# --- the first step of Proposition 5.6, (5.24) to (5.33) --------------------------------------------------------------

#: |||(T_theta psi) - (T_theta psi~)|||^2 in full, by (5.24); what (5.31) has for W, and what (5.36) has for all of it.
expanded = theta**2 * t**2 + (1 - theta) ** 2 * e**2 + 2 * theta * (1 - theta) * W
of_31 = lambda P: -(m**2) / A**2 * t**2 + P * e**2
of_36 = lambda m, P: (theta**2 - 2 * theta * (1 - theta) * m**2 / A**2) * t**2 + of_h2(P) * e**2

inner = bilinear("b")  # the inner product of (5.21)
chi, rest = Vector("T psi - T psi~"), Vector("psi - psi~")

check(
    id="5.24",
    text="The square of the norm (5.21) of theta chi + (1-theta) eta, expanded.",
    goals=lambda form: equal(
        inner(theta * chi + (1 - theta) * rest, theta * chi + (1 - theta) * rest),
        theta**2 * inner(chi, chi) + (1 - theta) ** 2 * inner(rest, rest) + form * inner(chi, rest),
        {theta: t_ / (1 + t_)},
    ),
    forms={"printed": 2 * theta * (1 - theta)},
    mutants={"the factor 2 dropped": theta * (1 - theta), "1 + theta": 2 * theta * (1 + theta)},
    states=lambda form: Relation(t**2, "=", theta**2 * t**2 + (1 - theta) ** 2 * e**2 + form * W),
)

check(
    id="5.25",
    text="(5.6) for psi and psi~, subtracted: a_2(w2-w~2, v) = <psi-psi~, v>, the equation of R2(psi-psi~).",
    goals=lambda form: equal((L2(test) + functional("psi")(test)) - (L2(test) + functional("psi~")(test)), form),
    forms={"printed": functional("psi")(test) - functional("psi~")(test)},
    mutants={"the sum": functional("psi")(test) + functional("psi~")(test)},
)

a1R = sp.Symbol("a_1R", real=True)  # a1(w1-w~1, R_D(w2-w~2))

Tpsi = functional("T psi - T psi~")
riesz = {a2(lift2(chi), v): Tpsi(v) for v in (w2, v2)}  # (5.20) for w2 and for w~2

check(
    id="5.26",
    text="The definition (5.20) of R2 for v = w2 and v = w~2, subtracted: a_2(R2 chi, w2-w~2) = <chi, w2-w~2>.",
    goals=lambda form: equal(a2(lift2(chi), delta2).subs(riesz), form),
    forms={"printed": Tpsi(delta2)},
    mutants={"the sign": -Tpsi(delta2), "w2 for the difference": Tpsi(w2)},
)


check(
    id="5.27",
    text="(5.17) with v = w2-w~2.",
    goals=lambda form: equal(reaction(w1, delta2) - reaction(v1, delta2), form),
    forms={"printed": -a1(delta1, lift(delta2))},
    mutants={"the sign": a1(delta1, lift(delta2)), "the lift of w1": -a1(delta1, lift(delta1))},
)

check(
    id="5.28",
    text="(5.12), a_11 = a_1R + F - p with p >= 0, rearranged.",
    goals=lambda form: at_most(form.subs(q1, a1R + F - p), -a1R, {}),
    forms={"printed": -q1 + F},
    mutants={"the sign of F": -q1 - F, "the sign of the energy": q1 + F},
    states=lambda form: Relation(W, "<=", form),
)

check(
    id="5.29",
    text="a_11 >= m d_1^2 by coercivity, d_1 >= t_n/(M C_R) by (5.18), t_n^2 >= m t^2 by (5.22).",
    goals=lambda form: at_most(m * (1 + p) * ((1 + q) / A) ** 2 * m * t**2 * (1 + r), form * t**2),
    forms={"printed": m**2 / A**2},
    mutants={"C_R^2 dropped": m**2 / M**2, "m for m^2": m / A**2, "C_R for C_R^2": m**2 / (M**2 * C_R)},
    states=lambda form: Relation(form * t**2, "<=", q1),
)

check(
    id="5.30",
    text="F <= C_K (d_1 d_2 + d_2^2), d_1 <= X d_2, d_2 <= n/m, n <= M/sqrt(m) e, one after the other.",
    goals=lambda form: at_most(form, P),
    forms={"step": printed_P(m), "repaired": x / m**2 * ((A + x + s) / m + 1) * M**2 / m},
    mutants={
        "the bracket as printed": printed_P(m),
        "1 dropped from the bracket": x / m**2 * ((A + x + s) / m) * M**2 / m,
        "M for M^2": x / m**2 * ((A + x + s) / m + 1) * M / m,
        "1/m for 1/m^2": x / m * ((A + x + s) / m + 1) * M**2 / m,
    },
    states=lambda form: Relation(F, "<=", form * e**2),
)

check(
    id="x-printed-at-large-m",
    text="For m >= 1 the bracket printed in (5.30) is at least the one that the proof supplies.",
    goals=lambda form: at_most(form, P, LARGE_M),
    forms={"printed": printed_P(m)},
    mutants={
        "1 dropped from the bracket": x / m**2 * (A + x + s) * M**2 / m / (1 + x),
        "m^2 for m": printed_P(m) / m**2,
    },
)

check(
    id="5.31",
    text="(5.25) to (5.29), and the friction term of (5.30): W <= -(m/A)^2 t^2 + P e^2.",
    goals=lambda form: at_most(form, -(m**2) / A**2 * t**2 * (1 + q) + P * e**2 - r),
    forms={"step": of_31(printed_P(m)), "repaired": of_31(P)},
    mutants={
        "the sign of the first term, no friction": -(m**2) / A**2 * t**2,
        "C_R dropped": -(m**2) / M**2 * t**2 + P * e**2,
    },
    states=lambda form: Relation(W, "<=", form),
)

check(
    id="5.32",
    text="(5.31) in (5.24).",
    goals=lambda form: at_most(form, expanded.subs(W, of_31(P) - r), WITH_THETA),
    forms={"step": of_36(m, printed_P(m)), "repaired": of_36(m, P)},
    mutants={"the factor 2 dropped": of_36(m, P / 2), "C_R dropped": of_36(m * C_R, P)},
    states=lambda form: Relation(t**2, "<=", form),
)

check(
    id="5.33",
    text="(5.32) with the friction term written by means of C_T = A X/m.",
    goals=lambda form: equal(form, P, CONSTANTS),
    forms={
        "step": M**2 / m * (x * (A * X / m) / A + x / m**2),
        "repaired": M**2 / m * (x * (A * X / m) / (A * m) + x / m**2),
    },
    mutants={"1/m^2 dropped": M**2 / m * (x * (A * X / m) / (A * m)), "M for M^2": M / m * (x * X / m**2 + x / m**2)},
    states=lambda form: Relation(W, "<=", form * e**2),
)

# --- one open node that slides: there (5.30) to (5.36) fail as printed ------------------------------------------------

kappa, lam = nonnegative("kappa"), positive("lambda")
#: One open node that slides under the friction of its g_N: S_1 = S_2 = lambda I, the norm of R^2.  For
#: psi = (0, psi_N) step I gives w2 = psi/lambda; in step II friction moves body 1 by -kappa psi_N/lambda, and
#: T psi = (kappa psi_N, 0).  Hence F = kappa^2 e^2, t = kappa e, W = 0 with e^2 = psi_N^2/lambda.
ONE_NODE = {m: lam, M: 2 * lam, C_R: sp.Integer(1), x: kappa * lam, F: kappa**2 * e**2, t: kappa * e, W: sp.Integer(0)}
AT_THE_NODE = {lam: mu**2, kappa: xi**2, theta: t_ / (1 + t_)}


def one_node(id: str, value: Any, printed: Any, repaired: Any, chart: Any = AT_THE_NODE, more: str = "") -> Check:
    """The printed bound of a quantity is exceeded in the one-node problem: small m, much friction."""
    at_the_node = lambda expression: expression.xreplace(ONE_NODE)
    return Check(
        id=id,
        text="One open node that slides, S_1 = S_2 = m I, M = 2 m, C_R = 1, C_K = kappa m: exactly F = kappa^2 e^2,"
        f" t = kappa e, W = 0.{more}",
        goals=lambda form: at_most(at_the_node(form), at_the_node(value), chart),
        forms={"printed": printed, "repaired": repaired},
        mutants={"without friction": repaired.subs(x, 0)},
    )


CHECKS.append(one_node("5.30", F, printed_P(m) * e**2, P * e**2))
CHECKS.append(one_node("5.31", W, of_31(printed_P(m)), of_31(P)))
for label in ("5.32", "5.33", "5.36"):
    CHECKS.append(one_node(label, expanded, of_36(m, printed_P(m)), of_36(m, P)))

# --- second step ----------------------------------------------------------------------------------------------------

check(
    id="5.35",
    text="C_T falls as m grows, and m~ <= m.",
    goals=lambda form: at_most(form, A * X / m, SMALL_M, LARGE_M),
    forms={"printed": of_35},
    mutants={"m~ for m~^2": of_35 * m_tilde / m**2, "C_R dropped": of_35 / C_R},
    states=lambda form: Relation(C_T, "<=", form),
)

check(
    id="5.36",
    text="(5.33) with m~ for m in each coefficient.",
    goals=lambda form: at_most(form, of_36(m, P), *TILDE),
    forms={"step": of_36(m_tilde, printed_P(m_tilde)), "repaired": of_36(m, P)},
    mutants={"without friction": of_36(m, 0), "M for M^2 in the first term": of_36(m * sp.sqrt(M), P)},
    states=lambda form: Relation(t**2, "<=", form),
)

C0 = bounds.C0(m, M, C_R)

check(
    id="5.37",
    text="theta^2 - 2 theta (1-theta) m^2/A^2 = theta (theta - 2 (1-theta) m^2/A^2) vanishes at C_0, is positive above"
    " and negative below.",
    goals=lambda form: [
        equal(form - 2 * (1 - form) * m**2 / A**2, 0, CONSTANTS),
        less(0, (form + y) - 2 * (1 - form - y) * m**2 / A**2, CONSTANTS),
    ],
    forms={"printed": C0},
    mutants={
        "C_R for C_R^2": 2 * m**2 / (M**2 * C_R + 2 * m**2),
        "the factor 2 dropped": m**2 / (A**2 + m**2),
        "1/m for 1/m^2": 2 * m / (A**2 + 2 * m),
    },
    states=lambda form: Relation(theta, "=", form),
)

check(
    id="C0",
    text="0 < C_0 < 1: Case 5.7 and Case 5.8 both occur.",
    goals=lambda form: [less(0, form, CONSTANTS), less(form, 1, CONSTANTS)],
    forms={"printed": C0},
    mutants={"four times as large": 4 * C0, "the sign": -C0},
    states=lambda form: Relation(theta, "=", form),
)

check(
    id="5.38",
    text="(5.38) with m~ in front and C_T itself.",
    goals=lambda form: at_most(form, (A * X / m) ** 2 / m * M**2 / m / (1 + p), SMALL_M, LARGE_M),
    forms={"repaired": of_16**2 * M**2 / m_tilde**2},
    mutants={"1/m~ for 1/m~^2": of_16**2 * M**2 / m_tilde / m / (1 + m)},
)

check(
    id="5.38",
    text="t^2 <= t_n^2/m by (5.22), t_n <= C_T n, n^2 <= M^2 e^2/m by (5.23).",
    goals=lambda form: at_most(form, (A * X / m) ** 2 / m * M**2 / m / (1 + p)),
    forms={"repaired": bounds.Q(x, m, M, C_R)},
    mutants={
        "M^2 dropped": bounds.Q(x, m, M, C_R) / M**2,
        "C_T for C_T^2": of_16 * M**2 / m**2,
        "1/m for 1/m^2": bounds.Q(x, m, M, C_R) * m,
    },
    states=lambda form: Relation(t**2, "<=", form * e**2),
)

#: a, b, c of (5.39) as printed, in C~_T, and the first line of h_1 with any constant for C_T.
tilde_Q = C_T_tilde**2 * M**2 / m_tilde**2
tilde_P = M**2 / m_tilde * (x * C_T_tilde / A + x / m_tilde**2)
printed_a = tilde_Q + 2 * C_T_tilde**2 / C_R**2 - 2 * tilde_P + 1
printed_b = -2 * C_T_tilde**2 / C_R**2 + 2 * tilde_P - 2
first_line = lambda constant: of_h1(m_tilde, tilde_P, constant**2 * M**2 / m_tilde**2)

of_edition = {C_T: of_16, C_T_tilde: of_35}

check(
    id="5.39",
    text="The first line of h_1 is a theta^2 + b theta + 1 with the printed a and b, (5.16) for C_T and (5.35) for"
    " C~_T.",
    goals=lambda form: equal(
        form.subs(of_edition, simultaneous=True),
        (printed_a * theta**2 + printed_b * theta + 1).subs(of_edition, simultaneous=True),
        *TILDE,
    ),
    forms={"step": first_line(C_T), "repaired": first_line(C_T_tilde)},
    mutants={"C_T for C~_T": first_line(C_T), "the friction term halved": of_h1(m_tilde, tilde_P / 2, tilde_Q)},
    units={"printed": Relation(tilde_P, "=", 1), "repaired": Relation(P, "=", 1)},
)

# from here on an edition is its m, its P and its Q, all as symbols where no more of them is needed
P_, Q_ = nonnegative("P Q")
a_ = 1 + 2 * (Q_ * m**2 / A**2 - P_) + Q_  # C_T^2/C_R^2 = Q m^2/A^2
b_ = -2 * (1 + Q_ * m**2 / A**2 - P_)
#: Of m, M and C_R only the ratio A/m >= 2 enters h_1: m = 1, M = 2 reach all.  (A/m)^4 (M/m)^2 <= Q, the value without
#: friction, and P < C_T^2/C_R^2 = Q m^2/A^2.
Q_at_least = 64 * (1 + c) ** 4 + r
ADMISSIBLE = {
    m: sp.Integer(1),
    M: sp.Integer(2),
    C_R: 1 + c,
    Q_: Q_at_least,
    P_: Q_at_least / (4 * (1 + c) ** 2) * q / (1 + q),
}

check(
    id="h1",
    text="The form of 1 - h_1 that is computed is the one derived from (5.36) and (5.38).",
    goals=lambda form: equal(form(theta, Q_ * m**2 / A**2 - P_, Q_), 1 - of_h1(m, P_, Q_)),
    forms={"repaired": bounds.one_minus_h1},
    mutants={"D for 2 D": lambda theta, D, Q: bounds.one_minus_h1(theta, D / 2, Q)},
)

check(
    id="h2",
    text="The form of 1 - h_2 that is computed is the one derived from (5.36).",
    goals=lambda form: equal(form(theta, P_), 1 - of_h2(P_)),
    forms={"repaired": bounds.one_minus_h2},
    mutants={"P for 2 P": lambda theta, P: bounds.one_minus_h2(theta, P / 2)},
)

check(
    id="a-b",
    text="a >= 1 and b <= -2 say that P <= C_T^2/C_R^2: for the printed P with m~ <= 1, for the repaired one with any"
    " m.",
    goals=lambda form: at_most(form[0], form[1], SMALL_M, LARGE_M),
    forms={"printed": ((of_35 / C_R) ** 2, printed_P(m_tilde)), "repaired": ((of_16 / C_R) ** 2, P)},
    mutants={
        "C_R^2 for C_R": ((of_16 / C_R**2) ** 2, P),
        "m itself in the printed P": ((of_16 / C_R) ** 2, printed_P(m)),
    },
    units={"repaired": Relation(P, "<=", (of_16 / C_R) ** 2)},
)

check(
    id="5.40",
    text="h_1 = 1 at -b/a and h_1 < 1 below it, where P <= C_T^2/C_R^2.",
    goals=lambda form: [
        equal(1 - of_h1(m, P_, Q_).subs(theta, form), 0),
        less(0, 1 - of_h1(m, P_, Q_).subs(theta, form / (1 + y)), ADMISSIBLE),
    ],
    forms={"printed": -b_ / a_},
    mutants={"-b/(2a)": -b_ / (2 * a_), "2 for -b": 2 / a_},
)

#: C~_T^2/C_R^2 minus the printed friction term: a = 1 + 2 D + Q, b = -2 (1 + D).
tilde_D = C_T_tilde**2 / C_R**2 - tilde_P

check(
    id="C1",
    text="C_1 as it is computed is -b/a with the a and b printed below (5.39), and it is positive, as b <= -2 and"
    " a >= 1: D = C_T^2/C_R^2 - P >= 0.",
    goals=lambda form: [
        equal(form[0](tilde_D, tilde_Q), -printed_b / printed_a),
        less(0, form[0](form[1], nonnegative("Q"))),
    ],
    forms={"printed": (bounds.C1, nonnegative("D"))},
    mutants={
        "1 dropped below": (lambda D, Q: 2 * (1 + D) / (2 * D + Q), nonnegative("D")),
        "D below -1": (bounds.C1, -1 - nonnegative("D")),
    },
    units={"repaired": Relation((A * X / m) ** 2 / C_R**2 - P, "=", 1)},
)

check(
    id="x-c1-at-most-1",
    text="a + b = Q - 1 >= 0, because M >= m and C_R >= 1: C_1 <= 1, which the paper uses and does not prove.",
    goals=lambda form: [equal(a_ + b_, Q_ - 1), at_most(form, 1)],
    forms={"repaired": Q},
    mutants={"eight powers of M/m dropped": Q * m**8 / M**8, "M^2 more below": Q / M**2},
)

# --- G and the thresholds -------------------------------------------------------------------------------------------

printed_G, repaired_G = (bounds.G(x, m, M, C_R, u) for u in (sp.Integer(1), m))
tilde_G = bounds.G(x, m_tilde, M, C_R, sp.Integer(1))


def _one_fraction(form: Any) -> list[Goal]:
    """C_0 - C_1 = numerator/((A^2 + 2 m^2) a), line by line: with P for the friction term, and with (5.35) inserted."""
    bracket, sign, m_, a, b, P_of_a = form
    numerator = lambda P: -2 * sign * m_**2 - 2 * A**2 + 2 * A**2 * P
    return [
        equal(bounds.C0(m_, M, C_R) + b / a, numerator(P_of_a) / ((A**2 + 2 * m_**2) * a)),
        equal(numerator(P_of_a).subs(of_edition), numerator(bracket / m_**3), SMALL_M, LARGE_M),
    ]


as_printed = (m_tilde, printed_a, printed_b, tilde_P)

check(
    id="5.41",
    text="C_0 - C_1 reduced to one fraction, as printed: with m~, (5.35) for C~_T and the bracket that is G/M^2.",
    goals=_one_fraction,
    forms={"printed": (tilde_G, 1, *as_printed), "repaired": (m**3 * P_, 1, m, a_, b_, P_)},
    mutants={
        "C_R dropped": (tilde_G / C_R**2, 1, *as_printed),
        "the sign of m^2": (tilde_G, -1, *as_printed),
        "1 dropped from the bracket": (tilde_G - M**2 * x, 1, *as_printed),
    },
    units={"repaired": Relation(-2 * m**2 - 2 * A**2, "=", 2 * A**2 * P)},
)

check(
    id="5.42",
    text="G(C_K)/m^3 is the friction term that (5.13), (5.11), (5.19), (5.23) supply, and G grows with C_K.",
    goals=lambda form: [
        at_most(form / m**3, P),
        less(0, sp.diff(form.subs(x, y**2), y), {m: mu**2, M: mu**2 * (1 + b), C_R: 1 + c}),
    ],
    forms={"step": printed_G, "repaired": repaired_G},
    mutants={"m^2 for m in front": repaired_G * m, "M for M^2": repaired_G / M},
    states=lambda form: Relation(form, "=", m**3),
)

end_of_43 = m**5 / A**2 + m**3
G_below = lambda G: Relation(G, "<", end_of_43)

right_of_43 = 2 * m**2 + 2 * A**2

check(
    id="5.43",
    text="C_0 < C_1 exactly for G(C_K) below m^5/A^2 + m^3: there the numerator of (5.41) is negative, from there on"
    " it is not.  The interval is half open.",
    goals=lambda form: [
        less(2 * A**2 / m**3 * form[0], right_of_43, CONSTANTS),
        at_most(2 * A**2 / m**3 * form[1], right_of_43),
    ],
    forms={
        "printed": (end_of_43 / (1 + q), end_of_43 * (1 + r)),
        "repaired": (end_of_43 * q / (1 + q), end_of_43 * (1 + r)),
    },
    mutants={
        "C_R dropped": ((m**5 / M**2 + m**3) * q / (1 + q), end_of_43 * (1 + r)),
        "twice as far": (2 * end_of_43 * q / (1 + q), end_of_43 * (1 + r)),
    },
    units={"printed": G_below(printed_G), "repaired": G_below(repaired_G)},
)

#: Bodies with m = 1/100, M = 2 m, C_R = 1; C_K over m where the printed G is below a threshold and the friction term is
#: not.
SMALL_BODIES = {m: sp.Rational(1, 100), M: sp.Rational(1, 50), C_R: sp.Integer(1)}

for name, where, holds, value, changed, share in (
    ("C2", "P = 1 + m^2/A^2, where C_0 = C_1", C0 + b_ / a_, end_of_43 / m**3, {"m^5/A^2 dropped": sp.Integer(1)}, 4),
    ("C3", "P = 1/2, where a' = 0", 1 - 2 * P_, sp.Rational(1, 2), {"the factor 1/2 dropped": sp.Integer(1)}, 9),
    ("C4", "P = 1, where a' = -1", (1 - 2 * P_) + 1, sp.Integer(1), {"m^3/2 for m^3": sp.Rational(1, 2)}, 9),
    (
        "C5",
        "P = (2-C_0)/(1-C_0)/2, where C_6 = C_0",
        bounds.C6(P_) - C0,
        (2 - C0) / (1 - C0) / 2,
        {"1-C_0 dropped": (2 - C0) / 2},
        4,
    ),
):
    check(
        id=name,
        text=f"{name} C_s C_tr is the C_K with {where}; P = G(C_K)/m^3 as (5.42) is repaired.",
        goals=lambda form, holds=holds: equal(holds.subs({P_: form}).subs({Q_: Q}), 0, CONSTANTS),
        forms={"repaired": value},
        mutants=changed,
        units={"printed": Relation(printed_G, "=", m**3), "repaired": Relation(repaired_G, "=", m**3)},
    )
    at = {**SMALL_BODIES, x: sp.Rational(1, 100 * share)}
    check(
        id=name,
        text=f"At m = 1/100, M = 2 m, C_R = 1, C_K = m/{share} the printed G is below the threshold of {name}, and"
        " the friction term P that the proof supplies above it.",
        goals=lambda form, value=value, at=at: [
            less(printed_P(m).subs(at), value.subs(at)),
            less(form.subs(at), value.subs(at)),
        ],
        forms={"step": P},
        mutants={"twice the friction term": 2 * P},
    )

# --- Cases 5.7 and 5.8 ----------------------------------------------------------------------------------------------

check(
    id="case-5.7",
    text="From C_0 on the coefficient of t^2 is not negative, so that (5.38) may be used: theta = C_0 + p.",
    goals=lambda form: at_most((form + p) - 2 * (1 - form - p) * m**2 / A**2, 0),
    forms={"printed": C0},
    mutants={"half of C_0": C0 / 2, "C_R for C_R^2": 2 * m**2 / (M**2 * C_R**4 + 2 * m**2)},
)

below_C0 = lambda form: at_most(0, form / (1 + p) - 2 * (1 - form / (1 + p)) * m**2 / A**2)
too_large = {"twice C_0": 2 * C0, "2 m^2 dropped below": 2 * m**2 / A**2}

check(
    id="case-5.8",
    text="Below C_0 the coefficient of t^2 is not positive and may be dropped: theta = C_0/(1+p).",
    goals=below_C0,
    forms={"printed": C0},
    mutants=too_large,
)

check(
    id="5.44",
    text="The coefficient of t^2 is not positive at theta = C_0/(1+p); what is left of (5.36) is h_2.",
    goals=lambda form: [below_C0(form[0]), equal(of_36(m, form[1]).subs(t, 0), of_h2(P) * e**2)],
    forms={"repaired": (C0, P)},
    mutants={"twice C_0": (2 * C0, P), "the friction term halved": (C0, P / 2)},
    units={
        "printed": Relation(t**2, "<=", of_h2(printed_P(m)) * e**2),
        "repaired": Relation(t**2, "<=", of_h2(P) * e**2),
    },
)

slope = sp.Symbol("a'", real=True)
h2_of = lambda slope, theta: slope * theta**2 - (1 + slope) * theta + 1

check(
    id="5.45",
    text="h_2 = a' theta^2 + b' theta + 1 = a' (theta - 1)(theta - 1/a') with b' = -1 - a', as printed with (5.35) for"
    " C~_T.",
    goals=lambda form: [
        equal(of_h2(form[0]).subs(of_edition), (form[1] * theta**2 + form[2] * theta + 1).subs(of_edition), *TILDE),
        equal(h2_of(slope, theta), slope * (theta - 1) * (theta - 1 / slope)),
        equal(form[1], -form[2] - 1),
    ],
    forms={"printed": (tilde_P, 1 - 2 * tilde_P, -2 + 2 * tilde_P), "repaired": (P, 1 - 2 * P, -2 + 2 * P)},
    mutants={
        "P for 2 P": (tilde_P, 1 - tilde_P, -2 + tilde_P),
        "the sign of b'": (tilde_P, 1 - 2 * tilde_P, 2 - 2 * tilde_P),
    },
    units={"repaired": Relation(1 - 2 * P, "=", 1)},
)

check(
    id="5.46",
    text="a' = 1 - 2 G(C_K)/m~^3 is the a' of (5.45), with (5.35) for C~_T and the G of (5.42).",
    goals=lambda form: equal((1 - 2 * form[0]).subs(of_edition), form[1], *TILDE),
    forms={"printed": (tilde_P, 1 - 2 * tilde_G / m_tilde**3), "repaired": (P, 1 - 2 * repaired_G / m**3)},
    mutants={
        "the factor 2 dropped": (tilde_P, 1 - tilde_G / m_tilde**3),
        "m~^2 for m~^3": (tilde_P, 1 - 2 * tilde_G / m_tilde**2),
        "the repaired G with the printed P": (tilde_P, 1 - 2 * repaired_G / m**3),
    },
    units={"repaired": Relation(repaired_G / m**3, "=", 1)},
)

any_theta = t_ / (1 + t_)


def inside(slope: Any, theta: Any) -> list[Goal]:
    """0 < h_2 < 1."""
    h = h2_of(slope, theta)
    return [less(0, h), less(h, 1)]


check(
    id="case-2-1",
    text="a' < 1 needs C_K > 0; without friction a' = 1.  For 0 < a' <= 1 still 0 < h_2 < 1 on (0, 1).",
    goals=lambda form: [Goal(relation=Relation(1 - 2 * P_, form, 1)), *inside(1 / (1 + p), any_theta)],
    forms={"printed": "<", "repaired": "<="},
    mutants={"a' = 1": "="},
)

check(
    id="case-2-2",
    text="For -1 < a' < 0: 0 < h_2 < 1 on (0, 1), with a' = -1/(1+y).",
    goals=lambda form: inside(form, any_theta),
    forms={"printed": -1 / (1 + y)},
    mutants={"a' = -1 - y": -1 - y},
)

#: Thetas above and below C_6 = 1 + 1/a' for a' = -1 - y.
above_C6, below_C6 = 1 - 1 / ((1 + y) * (1 + t_)), (1 - 1 / (1 + y)) / (1 + t_)

check(
    id="case-2-3",
    text="For a' = -1 - y: 0 < h_2 < 1 on (1 + 1/a', 1), where 1 - theta = -1/(a' (1 + tau)); and C_0 exceeds C_6 by"
    " ((2-C_0) - 2 P (1-C_0))/(2P-1).",
    goals=lambda form: [
        *inside(-1 - y, form),
        equal(C0 - bounds.C6(P_), ((2 - C0) - 2 * P_ * (1 - C0)) / (2 * P_ - 1)),
    ],
    forms={"printed": above_C6},
    mutants={"below 1 + 1/a'": below_C6},
)

check(
    id="C6",
    text="C_6 as it is computed, from whatever P the edition has, is 1 + 1/a'; h_2 = 1 there.",
    goals=lambda form: [equal(form, 1 + 1 / (1 - 2 * P_)), equal(h2_of(1 - 2 * P_, form), 1)],
    forms={"printed": bounds.C6(P_)},
    mutants={"1 - 1/a'": 1 - 1 / (1 - 2 * P_), "P for 2 P": 1 + 1 / (1 - P_)},
    units={"repaired": Relation(1 - 2 * P, "=", 1)},
)

# --- Proposition 5.6 and Theorem 5.9 --------------------------------------------------------------------------------


def proposition(number: int, text: str, goals: Callable[[Any], list[Goal]], form: Any, mutants: dict[str, Any]) -> None:
    """One of the four claims; the bound (5.36) they rest on is its step."""
    bound = lambda form: at_most(form, of_36(m, P), *TILDE)
    check(
        id=f"prop-5.6.{number}",
        text=f"{text}; with (5.36) for the P that the proof supplies.",
        goals=lambda form: [bound(form[0]), *goals(form[1])],
        forms={"step": (of_36(m_tilde, printed_P(m_tilde)), form), "repaired": (of_36(m, P), form)},
        mutants={name: (of_36(m, P), mutant) for name, mutant in mutants.items()},
        units={"printed": Relation(t**2, "<=", of_36(m, printed_P(m))), "repaired": Relation(t**2, "<=", of_36(m, P))},
    )


proposition(
    1,
    "h_1 < 1 for theta = C_1/(1+y)",
    lambda factor: [less(0, 1 - of_h1(m, P_, Q_).subs(theta, -factor * b_ / a_ / (1 + y)), ADMISSIBLE)],
    1,
    {"up to 2 C_1": 2},
)
proposition(
    2, "0 < h_2 < 1 for 0 < a' <= 1", lambda slope: inside(slope, any_theta), 1 / (1 + p), {"a' = -3": sp.Integer(-3)}
)
proposition(3, "0 < h_2 < 1 for -1 < a' < 0", lambda slope: inside(slope, any_theta), -1 / (1 + y), {"a' < -1": -1 - y})
proposition(
    4,
    "0 < h_2 < 1 for a' = -1 - y and theta > C_6",
    lambda theta: inside(-1 - y, theta),
    above_C6,
    {"below C_6": below_C6},
)

check(
    id="5.47",
    text="g_i - g = T_theta g_(i-1) - T_theta g, and K bounds the difference; after i steps K^i.",
    goals=lambda form: at_most(form(form(e)), (y / (1 + p)) ** 2 * e, {}),
    forms={"printed": lambda error: y * error},
    mutants={"K^2 for K": lambda error: y**2 * error, "K/2": lambda error: y / 2 * error},
    states=lambda form: Relation(e, "<=", form(e)),
)

check(
    id="thm-5.9.1",
    text="A contraction has one fixed point at most: e <= K e with K < 1 forces e = 0, so that g^2 is the only one and"
    " no converse of Lemma 5.2 is needed; that one exists is Banach's theorem.",
    goals=lambda form: less(form * y, y),
    forms={"repaired": 1 / (1 + t_)},
    mutants={"K = 1": sp.Integer(1)},
)

check(
    id="thm-5.9.2",
    text="For a fixed 0 < theta <= 1, m d^2 <= (n_1 + (n_2 + n_3)/theta) C_R d, at most (n_1 + n_2 + n_3)/theta C_R d;"
    " theta_min is not needed.",
    goals=lambda form: at_most(form, (p + (q + r) / theta), {theta: 1 / (1 + o)}),
    forms={"repaired": (p + q + r) / theta},
    mutants={"without 1/theta": p + q + r},
)

check(
    id="prop-5.1",
    text="n_1 + (n_2 + n_3)/theta <= (n_1 + n_2 + n_3)/theta for 0 < theta <= 1.  For all theta >= theta_min"
    " convergence is never supplied: h_1 > 1 on all of (C_1, 1).",
    goals=lambda form: [
        at_most((p + q + r) / theta, (p + (q + r) / theta), {theta: 1 / (1 + o)}),
        form(of_h1(m, P_, Q_).subs(theta, 1 - (1 + b_ / a_) / (1 + y))),
    ],
    forms={"step": lambda h1: less(h1, 1, ADMISSIBLE), "repaired": lambda h1: less(1, h1, ADMISSIBLE)},
    mutants={"h_1 < 1 beyond C_1": lambda h1: less(h1, 1, ADMISSIBLE)},
)

check(
    id="rem-5.10",
    text="k = 0: P = 0, so that h_2 = (1-theta)^2 and h_1 < 1 below C_1.",
    goals=lambda form: [
        equal(P.subs(x, form), 0, CONSTANTS),
        equal(of_h2(P).subs(x, form), (1 - theta) ** 2, CONSTANTS),
        less(
            0,
            1 - of_h1(m, P_, Q_).subs(P_, form).subs(theta, -b_ / a_ / (1 + y)).subs(P_, form),
            {**ADMISSIBLE, P_: sp.Integer(0)},
        ),
    ],
    forms={"printed": sp.Integer(0)},
    mutants={"a little friction": sp.Integer(1)},
)

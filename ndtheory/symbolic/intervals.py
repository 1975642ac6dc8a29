"""Section 5 from (5.34) to C_5, derived a second time: h_1, a, b, C_0, C_1, G and the thresholds."""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic.engine import CheckList, Goal, Relation, equal, less, nonnegative
from ndtheory.symbolic.symbols import (
    C_R,
    C_T,
    CONSTANTS,
    LARGE_M,
    SMALL_M,
    A,
    C_T_tilde,
    M,
    P,
    Q,
    X,
    at_most,
    b,
    c,
    e,
    m,
    m_tilde,
    mu,
    of_h1,
    of_h2,
    p,
    printed_P,
    q,
    r,
    t,
    theta,
    with_theta,
    x,
    y,
)

CHECKS = CheckList()
check = CHECKS.add

# --- second step ----------------------------------------------------------------------------------------------------

check(
    id="5.35",
    text="C_T falls as m grows, and m~ <= m.",
    goals=lambda form: at_most(form, A * X / m, SMALL_M, LARGE_M),
    forms={"printed": bounds.lipschitz(m_tilde, M, C_R, x)},
    mutants={
        "m~ for m~^2": bounds.lipschitz(m_tilde, M, C_R, x) * m_tilde / m**2,
        "C_R dropped": bounds.lipschitz(m_tilde, M, C_R, x) / C_R,
    },
    states=lambda form: Relation(C_T, "<=", form),
)

of_36 = lambda m, P: (theta**2 - 2 * theta * (1 - theta) * m**2 / A**2) * t**2 + of_h2(P) * e**2

check(
    id="5.36",
    text="(5.33) with m~ for m in each coefficient.",
    goals=lambda form: at_most(form, of_36(m, P), with_theta(SMALL_M), with_theta(LARGE_M)),
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
    text="(5.38) as printed, with m~ in front and C_T itself.",
    goals=lambda form: at_most(form, (A * X / m) ** 2 / m * M**2 / m / (1 + p), SMALL_M, LARGE_M),
    forms={"printed": bounds.lipschitz(m, M, C_R, x) ** 2 * M**2 / m_tilde**2},
    mutants={"1/m~ for 1/m~^2": bounds.lipschitz(m, M, C_R, x) ** 2 * M**2 / m_tilde / m / (1 + m)},
)

check(
    id="5.38",
    text="t^2 <= t_n^2/m by (5.22), t_n <= C_T n, n^2 <= M^2 e^2/m by (5.23).",
    goals=lambda form: at_most(form, (A * X / m) ** 2 / m * M**2 / m / (1 + p)),
    forms={"printed": bounds.Q(x, m, M, C_R)},
    mutants={
        "M^2 dropped": bounds.Q(x, m, M, C_R) / M**2,
        "C_T for C_T^2": bounds.lipschitz(m, M, C_R, x) * M**2 / m**2,
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

of_edition = {C_T: bounds.lipschitz(m, M, C_R, x), C_T_tilde: bounds.lipschitz(m_tilde, M, C_R, x)}

check(
    id="5.39",
    text="The first line of h_1 is a theta^2 + b theta + 1 with the printed a and b, (5.16) for C_T and (5.35) for"
    " C~_T.",
    goals=lambda form: equal(
        form.subs(of_edition, simultaneous=True),
        (printed_a * theta**2 + printed_b * theta + 1).subs(of_edition, simultaneous=True),
        with_theta(SMALL_M),
        with_theta(LARGE_M),
    ),
    forms={"step": first_line(C_T), "repaired": first_line(C_T_tilde)},
    mutants={"C_T for C~_T": first_line(C_T), "the friction term halved": of_h1(m_tilde, tilde_P / 2, tilde_Q)},
    units={"printed": Relation(tilde_P, "=", 1), "repaired": Relation(P, "=", 1)},
)

# from here on an edition is its m, its P and its Q, all as symbols where no more of them is needed
P_, Q_, G_ = nonnegative("P Q G")
a_ = 1 + 2 * (Q_ * m**2 / A**2 - P_) + Q_  # C_T^2/C_R^2 = Q m^2/A^2
b_ = -2 * (1 + Q_ * m**2 / A**2 - P_)
#: h_1 knows of m, M and C_R the ratio A/m >= 2 alone: m = 1, M = 2 reach all.  (A/m)^4 (M/m)^2 <= Q, the value without
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
    forms={
        "printed": ((bounds.lipschitz(m_tilde, M, C_R, x) / C_R) ** 2, printed_P(m_tilde)),
        "repaired": ((bounds.lipschitz(m, M, C_R, x) / C_R) ** 2, P),
    },
    mutants={
        "C_R^2 for C_R": ((bounds.lipschitz(m, M, C_R, x) / C_R**2) ** 2, P),
        "m itself in the printed P": ((bounds.lipschitz(m, M, C_R, x) / C_R) ** 2, printed_P(m)),
    },
    units={"repaired": Relation(P, "<=", (bounds.lipschitz(m, M, C_R, x) / C_R) ** 2)},
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
        Goal(
            relation=Relation(0, "<", sp.diff(form.subs(x, y**2), y)),
            charts=({m: mu**2, M: mu**2 * (1 + b), C_R: 1 + c},),
        ),
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

for name, where, holds, value, changed in (
    ("C2", "P = 1 + m^2/A^2, where C_0 = C_1", C0 + b_ / a_, end_of_43 / m**3, {"m^5/A^2 dropped": sp.Integer(1)}),
    ("C3", "P = 1/2, where a' = 0", 1 - 2 * P_, sp.Rational(1, 2), {"the factor 1/2 dropped": sp.Integer(1)}),
    ("C4", "P = 1, where a' = -1", (1 - 2 * P_) + 1, sp.Integer(1), {"m^3/2 for m^3": sp.Rational(1, 2)}),
    (
        "C5",
        "P = (2-C_0)/(1-C_0)/2, where C_6 = C_0",
        bounds.C6(P_) - C0,
        (2 - C0) / (1 - C0) / 2,
        {"1-C_0 dropped": (2 - C0) / 2},
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

#: Bodies with m = 1/100, M = 2 m, C_R = 1; C_K over m where the printed G is below a threshold and the friction term is
#: not.
SMALL_BODIES = {m: sp.Rational(1, 100), M: sp.Rational(1, 50), C_R: sp.Integer(1)}

for name, value, share in (
    ("C2", end_of_43 / m**3, sp.Rational(1, 4)),
    ("C3", sp.Rational(1, 2), sp.Rational(1, 9)),
    ("C4", sp.Integer(1), sp.Rational(1, 9)),
    ("C5", (2 - C0) / (1 - C0) / 2, sp.Rational(1, 4)),
):
    at = {**SMALL_BODIES, x: share / 100}
    check(
        id=name,
        text=f"At m = 1/100, M = 2 m, C_R = 1, C_K = m/{share.q} the printed G is below the threshold of {name}, and"
        " the friction term P that the proof supplies above it.",
        goals=lambda form, value=value, at=at: [
            less(printed_P(m).subs(at), sp.sympify(value).subs(at)),
            less(form.subs(at), sp.sympify(value).subs(at)),
        ],
        forms={"step": P},
        mutants={"twice the friction term": 2 * P},
    )

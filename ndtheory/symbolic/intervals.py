"""Section 5 from (5.34) on, derived a second time: C_0 to C_6, the cases, Proposition 5.6 and Theorem 5.9."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic.engine import Check, Goal, Relation, add, equal, less, nonnegative
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
    o,
    of_h1,
    of_h2,
    p,
    printed_P,
    q,
    r,
    t,
    t_,
    theta,
    with_theta,
    x,
    y,
)

CHECKS: list[Check] = []
check = partial(add, CHECKS)

# --- second step ----------------------------------------------------------------------------------------------------

check(
    id="5.34",
    text="What min(m, 1) is there for, C_T^2/C_R^2 >= P, holds with m itself for the P that the proof supplies.",
    goals=lambda form: at_most((A * X / m) ** 2 / C_R**2, form),
    forms={"repaired": P},
    mutants={"1/m more": P / m, "1/m^2 more": P / m**2},
    units={"printed": Relation(m_tilde, "=", sp.Min(m, 1)), "repaired": Relation(m_tilde, "=", m)},
)

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
    text="h_1 = a theta^2 + b theta + 1 with the printed a and b, (5.16) for C_T and (5.35) for C~_T.",
    goals=lambda form: equal(
        form.subs(of_edition, simultaneous=True),
        (printed_a * theta**2 + printed_b * theta + 1).subs(of_edition, simultaneous=True),
        with_theta(SMALL_M),
        with_theta(LARGE_M),
    ),
    forms={"printed": first_line(C_T), "repaired": first_line(C_T_tilde)},
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
    text="a >= 1 and b <= -2 say that P <= C_T^2/C_R^2; the printed P needs m~ <= 1.",
    goals=lambda form: at_most(form[0], form[1], SMALL_M, LARGE_M),
    forms={
        "printed": ((bounds.lipschitz(m_tilde, M, C_R, x) / C_R) ** 2, printed_P(m_tilde)),
        "repaired": ((bounds.lipschitz(m, M, C_R, x) / C_R) ** 2, P),
    },
    mutants={
        "C_R^2 for C_R": ((bounds.lipschitz(m, M, C_R, x) / C_R**2) ** 2, P),
        "m itself in the printed P": ((bounds.lipschitz(m, M, C_R, x) / C_R) ** 2, printed_P(m)),
    },
    states=lambda form: Relation(form[1], "<=", form[0].subs(m_tilde, m)),
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

check(
    id="C1",
    text="C_1 as it is computed is -b/a, and it is positive.",
    goals=lambda form: [equal(form, -b_ / a_), less(0, form, ADMISSIBLE)],
    forms={"repaired": bounds.C1(Q_ * m**2 / A**2 - P_, Q_)},
    mutants={"1 dropped below": 2 * (1 + Q_ * m**2 / A**2 - P_) / (2 * (Q_ * m**2 / A**2 - P_) + Q_)},
    units={
        "printed": Relation((A * X / m) ** 2 / C_R**2 - printed_P(m), "=", 1),
        "repaired": Relation((A * X / m) ** 2 / C_R**2 - P, "=", 1),
    },
)

check(
    id="x-c1-at-most-1",
    text="a + b = Q - 1 >= 0, because M >= m and C_R >= 1: C_1 <= 1, which the paper uses and does not prove.",
    goals=lambda form: [equal(a_ + b_, Q_ - 1), at_most(form, 1)],
    forms={"repaired": Q},
    mutants={"eight powers of M/m dropped": Q * m**8 / M**8, "M^2 more below": Q / M**2},
)

check(
    id="5.41",
    text="C_0 - C_1 reduced to one fraction.",
    goals=lambda form: equal((C0 + b_ / a_).subs(Q_, Q), (form / ((A**2 + 2 * m**2) * a_)).subs(Q_, Q), CONSTANTS),
    forms={"repaired": -2 * m**2 - 2 * A**2 + 2 * A**2 * P_},
    mutants={
        "C_R dropped": -2 * m**2 - 2 * A**2 + 2 * M**2 * P_,
        "the sign of m^2": 2 * m**2 - 2 * A**2 + 2 * A**2 * P_,
    },
    units={
        "printed": Relation(-2 * m**2 - 2 * A**2, "=", 2 * A**2 * printed_P(m)),
        "repaired": Relation(-2 * m**2 - 2 * A**2, "=", 2 * A**2 * P),
    },
)

# --- G and the thresholds -------------------------------------------------------------------------------------------

printed_G, repaired_G = (bounds.G(x, m, M, C_R, u) for u in (sp.Integer(1), m))

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
    " it is"
    " not.  The interval is half open.",
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
    text="h_2 = a' theta^2 + b' theta + 1 = a' (theta - 1)(theta - 1/a') with b' = -1 - a'.",
    goals=lambda form: [
        equal(of_h2(P_), form[0] * theta**2 + form[1] * theta + 1),
        equal(h2_of(slope, theta), slope * (theta - 1) * (theta - 1 / slope)),
        equal(form[0], -form[1] - 1),
    ],
    forms={"repaired": (1 - 2 * P_, -2 + 2 * P_)},
    mutants={"P for 2 P": (1 - P_, -2 + P_), "the sign of b'": (1 - 2 * P_, 2 - 2 * P_)},
    units={"printed": Relation(1 - 2 * printed_P(m), "=", 1), "repaired": Relation(1 - 2 * P, "=", 1)},
)

check(
    id="5.46",
    text="a' = 1 - 2 P with P = G(C_K)/m^3.",
    goals=lambda form: equal(1 - 2 * P_, form.subs(G_, P_ * m**3)),
    forms={"repaired": 1 - 2 * G_ / m**3},
    mutants={"the factor 2 dropped": 1 - G_ / m**3, "m^2 for m^3": 1 - 2 * G_ / m**2},
    units={"printed": Relation(printed_G / m**3, "=", 1), "repaired": Relation(repaired_G / m**3, "=", 1)},
)

any_theta = t_ / (1 + t_)


def inside(slope: Any, theta: Any) -> list[Goal]:
    """0 < h_2 < 1."""
    h = h2_of(slope, theta)
    return [Goal(relation=Relation(0, "<", h)), Goal(relation=Relation(h, "<", 1))]


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
    text="C_6 as it is computed is 1 + 1/a'; h_2 = 1 there.",
    goals=lambda form: [equal(form, 1 + 1 / (1 - 2 * P_)), equal(h2_of(1 - 2 * P_, form), 1)],
    forms={"repaired": bounds.C6(P_)},
    mutants={"1 - 1/a'": 1 - 1 / (1 - 2 * P_), "P for 2 P": 1 + 1 / (1 - P_)},
    units={"printed": Relation(1 - 2 * printed_P(m), "=", 1), "repaired": Relation(1 - 2 * P, "=", 1)},
)

# --- Proposition 5.6 and Theorem 5.9 --------------------------------------------------------------------------------


def proposition(number: int, text: str, goals: Callable[[Any], list[Goal]], form: Any, mutants: dict[str, Any]) -> None:
    """One of the four claims; the bound (5.36) they rest on is its step."""
    bound = lambda form: at_most(form, of_36(m, P), with_theta(SMALL_M), with_theta(LARGE_M))
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
    goals=lambda form: Goal(relation=Relation(form * y, "<", y)),
    forms={"repaired": 1 / (1 + t_)},
    mutants={"K = 1": sp.Integer(1)},
)

check(
    id="thm-5.9.2",
    text="For any fixed 0 < theta <= 1, m d^2 <= (n_1 + (n_2 + n_3)/theta) C_R d: theta_min is not needed.",
    goals=lambda form: at_most(form, (p + (q + r) / theta), {theta: 1 / (1 + o)}),
    forms={"repaired": (p + q + r) / theta},
    mutants={"without 1/theta": p + q + r},
)

check(
    id="prop-5.1",
    text="n_1 + (n_2 + n_3)/theta <= (n_1 + n_2 + n_3)/theta for 0 < theta <= 1.  For all theta >= theta_min"
    " convergence"
    " is never supplied: h_1 > 1 on all of (C_1, 1).",
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
        Goal(
            relation=Relation(
                0, "<", 1 - of_h1(m, P_, Q_).subs(P_, form).subs(theta, -b_ / a_ / (1 + y)).subs(P_, form)
            ),
            charts=({**ADMISSIBLE, P_: sp.Integer(0)},),
        ),
    ],
    forms={"printed": sp.Integer(0)},
    mutants={"a little friction": sp.Integer(1)},
)

"""Section 5 from Case 5.7 on, derived a second time: the cases, Proposition 5.6, Theorem 5.9."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic.engine import CheckList, Goal, Relation, equal, less
from ndtheory.symbolic.intervals import ADMISSIBLE, C0, P_, Q_, a_, b_, of_36, of_edition, repaired_G, tilde_G, tilde_P
from ndtheory.symbolic.symbols import (
    C_R,
    CONSTANTS,
    LARGE_M,
    SMALL_M,
    A,
    M,
    P,
    at_most,
    e,
    m,
    m_tilde,
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

CHECKS = CheckList()
check = CHECKS.add

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
TILDE = (with_theta(SMALL_M), with_theta(LARGE_M))
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
    text="C_6 as it is computed, from whatever P the edition has, is 1 + 1/a'; h_2 = 1 there.",
    goals=lambda form: [equal(form, 1 + 1 / (1 - 2 * P_)), equal(h2_of(1 - 2 * P_, form), 1)],
    forms={"printed": bounds.C6(P_)},
    mutants={"1 - 1/a'": 1 - 1 / (1 - 2 * P_), "P for 2 P": 1 + 1 / (1 - P_)},
    units={"repaired": Relation(1 - 2 * P, "=", 1)},
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

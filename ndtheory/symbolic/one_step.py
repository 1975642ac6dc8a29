"""The first step of Proposition 5.6, (5.24) to (5.33), derived a second time.

The slack of a premise is a parameter, as in ``estimates``.
"""

from __future__ import annotations

import sympy as sp

from ndtheory.symbolic.engine import CheckList, Relation, Vector, bilinear, equal, functional
from ndtheory.symbolic.symbols import (
    C_R,
    CONSTANTS,
    L1,
    L2,
    LARGE_M,
    WITH_THETA,
    A,
    F,
    M,
    P,
    W,
    X,
    a1,
    a2,
    at_most,
    below,
    delta1,
    delta2,
    e,
    lift,
    lift2,
    m,
    of_h2,
    p,
    printed_P,
    q,
    q1,
    r,
    s,
    t,
    t_,
    test,
    theta,
    v1,
    v2,
    w1,
    w2,
    x,
)

CHECKS = CheckList()
check = CHECKS.add

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
    goals=lambda form: equal(
        (-a1(w1, lift(delta2)) + L1(lift(delta2))) - (-a1(v1, lift(delta2)) + L1(lift(delta2))), form
    ),
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
    forms={"step": -(m**2) / A**2 * t**2 + printed_P(m) * e**2, "repaired": -(m**2) / A**2 * t**2 + P * e**2},
    mutants={
        "the sign of the first term, no friction": -(m**2) / A**2 * t**2,
        "C_R dropped": -(m**2) / M**2 * t**2 + P * e**2,
    },
    states=lambda form: Relation(W, "<=", form),
)

relaxed = lambda P: (theta**2 - below) * t**2 + of_h2(P) * e**2

check(
    id="5.32",
    text="(5.31) in (5.24).",
    goals=lambda form: at_most(
        form,
        theta**2 * t**2 + (1 - theta) ** 2 * e**2 + 2 * theta * (1 - theta) * (-(m**2) / A**2 * t**2 + P * e**2 - r),
        WITH_THETA,
    ),
    forms={"step": relaxed(printed_P(m)), "repaired": relaxed(P)},
    mutants={
        "the factor 2 dropped": (theta**2 - below) * t**2 + ((1 - theta) ** 2 + theta * (1 - theta) * P) * e**2,
        "C_R dropped": (theta**2 - below * C_R**2) * t**2 + of_h2(P) * e**2,
    },
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

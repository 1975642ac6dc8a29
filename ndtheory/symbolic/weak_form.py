"""(5.1) to (5.10): the weak form of the limit, and the constants that its terms need.

What is computed with generic vectors holds for all of them.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory.symbolic.engine import CheckList, Goal, Vector, at_most, equal, less, positive
from ndtheory.symbolic.symbols import C_R, CONSTANTS, L1, L2, C, M, a1, a2, lift, o, p, q, test, theta, y

CHECKS = CheckList()
check = CHECKS.add

u1, u2, field = Vector("u1"), Vector("u2"), Vector("w")

check(
    id="5.1",
    text="At the limit (III) reads g = theta (-a_1(u1, R v) + L_1(R v)) + (1-theta) g: g is that functional.",
    goals=lambda form: equal(
        theta * (-a1(u1, lift(test)) + L1(lift(test))) + (1 - theta) * form, form, {theta: 1 / (1 + y)}
    ),
    forms={"printed": -a1(u1, lift(test)) + L1(lift(test))},
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

n = positive("n")

check(
    id="5.8",
    text="A bar-like strip (0, 2) x (0, 1/4), clamped at x = 0, Gamma_c its upper side for 1 < x < 2, v = (min(x, 1),"
    " 0): |v_T|^2 = 1 in L2(Gamma_c) and |v|^2 = 7/12.  Into H^1/2 the tangential trace has a constant of 1 at most"
    " there, as (v_1, 0) lifts it: (5.13) does not follow with that constant.",
    one_case=True,
    goals=lambda form: at_most(form * _strip(), sp.Integer(1)),
    forms={"step": sp.Integer(1), "repaired": sp.Rational(12, 7)},
    mutants={"3/2": sp.Rational(3, 2)},
)


def _strip() -> Any:
    """|v|^2 in H1 of the strip."""
    X = positive("X")
    left = sp.integrate(X**2 + 1, (X, 0, 1))  # v = x, |grad v| = 1
    return (left + 1) / 4  # and v = 1 on the right half; thickness 1/4


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
            at_most(M * C_R * o, (M * o / (1 + p)) * (C_R / (1 + q)), CONSTANTS),
        ],
    },
    mutants={"C_R dropped": lambda C: at_most(M * o, (M * o / (1 + p)) * (C_R / (1 + q)), CONSTANTS)},
)


def _spike(n: Any) -> Any:
    Y = positive("Y")
    w = Y * (1 - n * Y) ** 2
    return sp.integrate(sp.expand(w**2 + sp.diff(w, Y) ** 2), (Y, 0, 1 / n))

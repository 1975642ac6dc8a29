"""What the paper does not state, proved: how its constants hang together, and the theorem in energy norms."""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic.contraction import above_C6, any_theta, inside
from ndtheory.symbolic.engine import CheckList, at_most, equal, less, nonnegative, positive
from ndtheory.symbolic.intervals import C0, P_, Q_, end_of_43
from ndtheory.symbolic.symbols import (
    C_R,
    CONSTANTS,
    M_1,
    A,
    M,
    P,
    Q,
    exx,
    exy,
    eyy,
    lame_mu,
    m,
    o,
    of_h1,
    of_h2,
    p,
    printed_P,
    q,
    r,
    strain_energy,
    theta,
    u_1,
    u_2,
    v_1,
    v_2,
    x,
    y,
)

CHECKS = CheckList()
check = CHECKS.add

check(
    id="x-c5-is-c2",
    text="(2-C_0)/(1-C_0) m^3/2 = m^5/A^2 + m^3.",
    goals=lambda form: equal((2 - form) / (1 - form) * m**3 / 2, end_of_43, CONSTANTS),
    forms={"repaired": C0},
    mutants={"C_R for C_R^2": 2 * m**2 / (M**2 * C_R + 2 * m**2), "the factor 2 dropped": m**2 / (A**2 + m**2)},
)

check(
    id="x-h1-h2-at-c0",
    text="h_1 - h_2 is Q times the coefficient of t^2, which changes its sign at C_0.",
    goals=lambda form: equal((of_h1(m, P_, Q_) - of_h2(P_)).subs(theta, form), 0, CONSTANTS),
    forms={"repaired": C0},
    mutants={"C_R for C_R^2": 2 * m**2 / (M**2 * C_R + 2 * m**2)},
)

check(
    id="x-end-points",
    text="At C_3 (a' = 0) and C_4 (a' = -1) still 0 < h_2 < 1 on (0, 1).",
    goals=lambda form: [goal for value in form for goal in inside(value, any_theta)],
    forms={"repaired": (sp.Integer(0), sp.Integer(-1))},
    mutants={"a' = -2 too": (sp.Integer(0), sp.Integer(-2))},
)

z = positive("z")  # (m/A)^2
C0_of_z = 2 * z / (1 + 2 * z)


def _merged(reach: Any) -> list[Any]:
    """C_6 < C_0 < C_1 for 1 < P < 1 + z reach, C_0 < C_1 for P <= 1, and h_1, h_2 < 1 between C_6 and C_1."""
    strong, weak = 1 + z * reach / (1 + y), q / (1 + q)
    C1 = lambda P: bounds.C1(Q_ * z - P_, Q_).subs(Q_, (P_ + r) / z).subs(P_, P)
    return [
        equal(C0_of_z.subs(z, m**2 / A**2), C0, CONSTANTS),
        less(bounds.C6(strong), C0_of_z),
        less(C0_of_z, C1(strong)),
        *(less(C0_of_z, C1(P).subs(r, r + z)) for P in (weak, sp.Integer(1))),  # Q >= 1
        less(0, 1 - of_h2(1 + y).subs(theta, above_C6.subs(y, 2 * y))),  # theta > C_6, P > 1
        *(less(0, 1 - of_h2(P).subs(theta, any_theta)) for P in (weak, sp.Integer(1))),
    ]


check(
    id="x-merged-interval",
    text="The four cases are one: max(0, C_6) < theta < C_1 as long as P < 1 + m^2/A^2.  C_6 < C_0 < C_1 there; h_2 < 1"
    " above C_6, and on all of (0, 1) for P <= 1; h_1 < 1 below C_1 by (5.40).",
    goals=_merged,
    forms={"repaired": sp.Integer(1)},
    mutants={"as long as P < 1 + 3 m^2/A^2": sp.Integer(3)},
)

scale = positive("lambda")
scaled = lambda expression: expression.subs({m: scale * m, M: scale * M, x: scale * x}, simultaneous=True)

check(
    id="x-homogeneity",
    text="With m and M and C_K times lambda the repaired G is G times lambda^3, so that P, C_0, C_1, C_6 and each"
    " threshold on k stay as they are in every unit of stress.",
    goals=lambda form: equal(scaled(form), scale**3 * form, {**CONSTANTS, scale: o + 1}),
    forms={"repaired": bounds.G(x, m, M, C_R, m)},
    mutants={"as printed": bounds.G(x, m, M, C_R, sp.Integer(1))},
)

check(
    id="x-editions-agree",
    text="In the unit of stress in which m = 1 the printed and the repaired bracket of (5.30) are one.",
    goals=lambda form: equal(form, P, {**CONSTANTS, m: sp.Integer(1), M: 1 + o}),
    forms={"repaired": printed_P(m)},
    mutants={"1 dropped from the bracket": printed_P(m) - x * M**2 / m**3},
)

check(
    id="x-max-suffices",
    text="|a(u, v)| <= M_1 u_1 v_1 + M_2 u_2 v_2 <= max(M_1, M_2) |u| |v|: (4.2) could take the maximum for M.",
    goals=lambda form: [
        at_most(
            form(big, less_) ** 2 * (u_1**2 + u_2**2) * (v_1**2 + v_2**2),
            (first * u_1 * v_1 + second * u_2 * v_2) ** 2,
            squares=[big**2 * (u_1 * v_2 - u_2 * v_1) ** 2],
        )
        for first, second, big, less_ in ((M_1, M_1 + o, M_1 + o, M_1), (M_1 + o, M_1, M_1 + o, M_1))
    ],
    forms={"repaired": lambda large, small: large},
    mutants={"the minimum": lambda large, small: small},
)

check(
    id="x-lift-bound",
    text="m |R phi|^2 <= a(R phi, R phi) <= a(v, v) <= M |v|^2 for every v with the trace phi: into the norm of its own"
    " body the lift has a constant of at most sqrt(M/m), and no theorem of Banach is needed.",
    goals=lambda form: at_most(form, M * y**2 / (m * (1 + p) * (1 + q) * (1 + r)), CONSTANTS),
    forms={"repaired": M / m * y**2},
    mutants={"m/M": m / M * y**2, "1": y**2},
)

w = sp.Symbol("omega", real=True)
gradient = exx**2 + eyy**2 + 2 * exy**2 + 2 * w**2

check(
    id="x-continuity",
    text="sigma : e = 2 mu |e|^2 + lambda (tr e)^2 with |grad v|^2 = |e|^2 + 2 omega^2 and (tr e)^2 <= 2 |e|^2, in"
    " plane strain: M^a <= max(2 mu, 2 mu + 2 lambda) for the norm of the gradient, hence for that of V^a.",
    goals=lambda form: [
        at_most(
            (2 * lame_mu + form * o) * gradient,
            strain_energy(o),
            squares=[o * (exx - eyy) ** 2, 4 * o * exy**2, (4 * lame_mu + 4 * o) * w**2],
        ),
        at_most(2 * lame_mu * gradient, strain_energy(-o), squares=[o * (exx + eyy) ** 2, 4 * lame_mu * w**2]),
    ],
    forms={"repaired": sp.Integer(2)},
    mutants={"lambda for 2 lambda": sp.Integer(1)},
)

# --- what the interval can reach -------------------------------------------------------------------------------------

square, Q_more, D_share = 1 + p, nonnegative("Q_more"), nonnegative("D_share")
C0_of = 2 / ((4 + o) * square + 2)  # (M/m)^2 = 4 + o, C_R^2 = 1 + p
Q_of = (4 + o) ** 3 * square**2 + Q_more  # Q >= (A/m)^4 (M/m)^2
D_of = Q_of / ((4 + o) * square) / (1 + D_share)  # 0 < D = C_T^2/C_R^2 - P <= C_T^2/C_R^2 = Q m^2/A^2

check(
    id="x-theta-below-34-97",
    text="M >= 2 m, C_R >= 1, Q >= (A/m)^4 (M/m)^2 and 0 <= D <= Q m^2/A^2 in C_1 = 2 (1 + D)/(1 + 2 D + Q) and in"
    " C_0.",
    goals=lambda form: [
        at_most(form, bounds.C1(D_of, Q_of)),
        at_most(sp.Rational(1, 3), C0_of),
        equal(C0_of.subs({p: C_R**2 - 1, o: (M / m) ** 2 - 4}, simultaneous=True), C0, CONSTANTS),
        at_most(Q, (A / m) ** 4 * (M / m) ** 2, CONSTANTS),
    ],
    forms={"repaired": sp.Rational(34, 97)},
    mutants={"1/3": sp.Rational(1, 3)},
)

check(
    id="x-best-proved-theta",
    text="At C_0 the slope of h_1, convex, is positive; below it h_2 falls: its slope at C_0 is negative for"
    " P < (2-C_0)/(1-C_0)/2 (if h_2 is convex it falls before; if it is concave on (0, C_0), h_2(0) = 1"
    " exceeds h_2(C_0)).  K^2 = h_2(C_0), and 1 - C_0 >= 2/3.",
    goals=lambda form: [
        less(0, sp.diff(1 - bounds.one_minus_h1(theta, D_of, Q_of), theta).subs(theta, form)),
        less(sp.diff(of_h2(P_), theta).subs({theta: form, P_: (2 - C0_of) / (1 - C0_of) / 2 / (1 + y)}), 0),
        equal(of_h2(P_).subs(theta, form), (1 - form) * (1 - form + 2 * P_ * form)),
        at_most(1 - form, sp.Rational(2, 3)),
    ],
    forms={"repaired": C0_of},
    mutants={"C_0/2": C0_of / 2, "2 C_0": 2 * C0_of},
)

check(
    id="x-open-shear",
    text="The hat kernel of radius r gives S(sigma_N) = f (1 - t/r)/r at the distance t of a node pressed by f,"
    " which is positive for every t < r, whatever the gap there.",
    goals=lambda form: less(0, (1 - form) / y),
    forms={"repaired": q / (1 + p + q)},
    mutants={"at the distance r": sp.Integer(1), "beyond r": 1 + q},
)

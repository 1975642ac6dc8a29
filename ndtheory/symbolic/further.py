"""What the paper does not state, proved: how its constants hang together, and the theorem in energy norms."""

from __future__ import annotations

from functools import partial
from typing import Any

import sympy as sp

from ndtheory import bounds, sharp
from ndtheory.symbolic.contraction import above_C6, any_theta, inside
from ndtheory.symbolic.engine import Check, add, at_most, equal, less, nonnegative, positive
from ndtheory.symbolic.estimates import expanded
from ndtheory.symbolic.intervals import C0, P_, Q_, end_of_43, of_36
from ndtheory.symbolic.symbols import (
    C_R,
    CONSTANTS,
    LARGE_M,
    SMALL_M,
    WITH_THETA,
    A,
    M,
    P,
    Q,
    W,
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
    theta,
    with_theta,
    x,
    y,
)

CHECKS: list[Check] = []
check = partial(add, CHECKS)

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

M_1 = positive("M_1")
u1, u2, v1, v2 = nonnegative("u_1 u_2 v_1 v_2")
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
            form(big, less_) ** 2 * (u1**2 + u2**2) * (v1**2 + v2**2),
            (first * u1 * v1 + second * u2 * v2) ** 2,
            squares=[big**2 * (u1 * v2 - u2 * v1) ** 2],
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

lame_mu = positive("lame_mu")
exx, eyy, exy, w = sp.symbols("e_xx e_yy e_xy omega", real=True)
lame_lambda = sp.Symbol("lame_lambda", real=True)
strain_energy = lambda lam: 2 * lame_mu * (exx**2 + eyy**2 + 2 * exy**2) + lam * (exx + eyy) ** 2
gradient = exx**2 + eyy**2 + 2 * exy**2 + 2 * w**2

check(
    id="x-continuity",
    text="sigma : e = 2 mu |e|^2 + lambda (tr e)^2 with |grad v|^2 = |e|^2 + 2 omega^2 and (tr e)^2 <= 2 |e|^2, in"
    " plane"
    " strain: M^a <= max(2 mu, 2 mu + 2 lambda) for the norm of the gradient, hence for that of V^a.",
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

# --- gradient descent, uniqueness, the theorem in energy norms ------------------------------------------------------

S_1, S_2 = positive("S_1 S_2")
u, g, load_1, load_2 = sp.symbols("u g l_1 l_2", real=True)
_energy = lambda u: S_2 * u**2 / 2 - load_2 * u + S_1 * u**2 / 2 - load_1 * u
_T = lambda g: load_1 - S_1 * (g + load_2) / S_2

check(
    id="x-gradient-descent",
    text="Without friction, bars in contact: E(u) = S_2 u^2/2 - l_2 u + (energy of body 1 at u) has the slope g - T g"
    " at"
    " u = (g + l_2)/S_2, and step III moves u by -theta S_2^-1 E'(u).  For more unknowns the slope of a minimum over"
    " the"
    " admissible u_1 is its multiplier, the reaction.",
    goals=lambda form: [
        equal(sp.diff(_energy(u), u).subs(u, (g + load_2) / S_2), g - _T(g)),
        equal(
            (theta * _T(g) + (1 - theta) * g + load_2) / S_2 - (g + load_2) / S_2,
            form * (g - _T(g)) / S_2,
            {theta: any_theta},
        ),
    ],
    forms={"repaired": -theta},
    mutants={"uphill": theta, "theta/S_2": -theta / S_2},
)

kappa_1, kappa_2, root_rho, more = nonnegative("kappa_1 kappa_2 s e")
ratio = positive("x")

check(
    id="x-threshold-uniqueness",
    text="Two solutions: x^2 + 1 <= kappa_1 x + kappa_2 for x = |d_1|/|d_2| by the energy argument; impossible for"
    " every"
    " x exactly where kappa_2 + kappa_1^2/4 < 1, as 1 - f(x) = (x - kappa_1/2)^2 + 1 - kappa_2 - kappa_1^2/4.",
    goals=lambda form: equal(
        1 + ratio**2 - kappa_1 * ratio - kappa_2, (ratio - kappa_1 / 2) ** 2 + 1 - form(kappa_1, kappa_2)
    ),
    forms={"repaired": sharp.friction_number},
    mutants={"kappa_1^2/2": lambda k1, k2: k2 + k1**2 / 2, "kappa_1/4": lambda k1, k2: k2 + k1 / 4},
)

largest = root_rho + kappa_1 + more  # r, with kappa_2 = e (s + kappa_1 + e): every kappa_2 >= 0 once
ENERGY = (root_rho**2, kappa_1, more * largest)

vertex = (1 - theta) * kappa_1 / (2 - (2 + root_rho**2) * theta)

check(
    id="x-sharp",
    text="x <= r by r^2 = (sqrt(rho) + kappa_1) r + kappa_2, no larger x satisfies it; f(r) = -sqrt(rho) r; the"
    " square of"
    " (5.24) with t^2 <= rho x^2 and W <= f(x) is what q(theta)^2 is the largest value of.",
    goals=lambda form: [
        equal(sharp.largest_ratio(*ENERGY), largest),
        less((root_rho + kappa_1) * (form + y) + ENERGY[2], (form + y) ** 2),
        equal(sharp.work(form, *ENERGY[1:]), -root_rho * form),
        equal(
            sharp.square_at(ratio, theta, *ENERGY),
            (1 - theta) ** 2
            + 2 * theta * (1 - theta) * sharp.work(ratio, *ENERGY[1:])
            + theta**2 * ENERGY[0] * ratio**2,
        ),
        # the vertex below r, and the end r: where the square is largest, and what 1 - q^2 is there
        equal(sp.diff(sharp.square_at(ratio, theta, *ENERGY), ratio).subs(ratio, vertex), 0),
        equal(1 - sharp.square_at(vertex, theta, *ENERGY), sharp.one_minus_inside(theta, *ENERGY)),
        equal(1 - sharp.square_at(largest, theta, *ENERGY), sharp.one_minus_end(theta, *ENERGY)),
    ],
    forms={"repaired": largest},
    mutants={"without kappa_2": root_rho + kappa_1, "half as large": largest / 2},
)

check(
    id="x-sharp-interval",
    text="The square at x is below 1 exactly where 2 (f - 1) + theta (1 - 2 f + rho x^2) < 0: linear in theta for"
    " each x,"
    " so that the good thetas form one interval.",
    goals=lambda form: equal(
        sharp.square_at(ratio, theta, root_rho**2, kappa_1, kappa_2) - 1, theta * form, {theta: any_theta}
    ),
    forms={
        "repaired": 2 * (sharp.work(ratio, kappa_1, kappa_2) - 1)
        + theta * (1 - 2 * sharp.work(ratio, kappa_1, kappa_2) + root_rho**2 * ratio**2)
    },
    mutants={"the factor 2 dropped": sharp.work(ratio, kappa_1, kappa_2) - 1 + theta * root_rho**2 * ratio**2},
)

check(
    id="x-best-theta",
    text="Without friction |1-theta| and |1 - theta (1+rho)| are equal and opposite at theta = 2/(2+rho), where both"
    " are"
    " rho/(2+rho): C_0 is this theta with rho estimated by (M C_R/m)^2.",
    goals=lambda form: [
        equal(1 - form, form * (1 + S_1) - 1),
        equal(1 - form, sharp.predicted_rate(S_1)),
        equal(C0, form.subs(S_1, A**2 / m**2), CONSTANTS),
    ],
    forms={"repaired": sharp.predicted_theta(S_1)},
    mutants={"1/(1+rho)": 1 / (1 + S_1), "2/(1+rho)": 2 / (1 + S_1)},
)

# --- what a closer look at the printed proof shows ------------------------------------------------------------------

kappa = nonnegative("kappa")
d_1, d_2 = nonnegative("d_1 d_2")
M_sum = {M: (2 + o) * m}

check(
    id="x-printed-rescued",
    text="Split a_11: half of it bounds t^2, as Cauchy-Schwarz in a_1 gives a_11 >= m t^2/(M^1 C_R^2), and"
    " M^2 >= 2 m M^1 for M >= 2 m and M >= M^1; by Young -m d_1^2/2 + C_K d_1 d_2 <= C_K^2 d_2^2/(2m).  With"
    " kappa = C_K/m and m d_2^2 <= e^2 friction adds at most (kappa + kappa^2/2) e^2, for kappa <= 6 below 4 kappa e^2"
    " and so below the printed bound; and k < C_2 implies kappa < 4.",
    goals=lambda form: [
        at_most(
            x**2 * d_2**2 / (2 * m), x * d_1 * d_2 - m * d_1**2 / 2, {}, squares=[(m * d_1 - x * d_2) ** 2 / (2 * m)]
        ),
        at_most(M**2, 2 * m * M / (1 + p), {M: (2 + o) * m}),
        at_most(4 * kappa, kappa + kappa**2 / 2, {kappa: form[0] * q / (1 + q)}),
        at_most(of_36(m_tilde, printed_P(m_tilde)), of_36(m, P), with_theta(LARGE_M)),
        at_most(
            of_36(m, 4 * kappa),
            expanded.subs(W, -(m**2) / A**2 * t**2 + (kappa + kappa**2 / 2) * e**2 - r),
            {**WITH_THETA, kappa: form[0] * q / (1 + q)},
        ),
        at_most(printed_P(m).subs(M_sum), 4 * x / m, {**CONSTANTS, m: mu**2}),
        *(
            at_most(
                bounds.G(x, m_tilde, M, C_R, sp.Integer(1)).subs(x, form[1] * m),
                m_tilde**3 + m_tilde**5 / A**2,
                {**chart, x: sp.Integer(0), M: chart[m] * (2 + q)},
            )
            for chart in (SMALL_M, LARGE_M)
        ),
    ],
    forms={"repaired": (6, 4)},
    mutants={"for C_K <= 17 m": (17, 4), "k < C_2 implies C_K < m/100": (6, sp.Rational(1, 100))},
)

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

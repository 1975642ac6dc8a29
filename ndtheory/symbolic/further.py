"""Proofs of facts that the paper does not state.

They say where the printed (5.30) holds, how the constants are connected, what the theorem in energy norms claims, and
what it is without friction: gradient descent.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

from ndtheory import bounds, energy_norms
from ndtheory.symbolic.engine import CheckList, Goal, Vector, at_most, equal, less, linear, nonnegative, positive
from ndtheory.symbolic.section5 import (
    AT_THE_NODE,
    C0,
    LARGE_M,
    P_,
    Q_,
    SMALL_M,
    WITH_THETA,
    P,
    Q,
    W,
    X,
    above_C6,
    any_theta,
    end_of_43,
    expanded,
    inside,
    kappa,
    m_tilde,
    of_31,
    of_36,
    of_h1,
    of_h2,
    one_node,
    printed_P,
    s,
    with_theta,
)
from ndtheory.symbolic.symbols import *

CHECKS = CheckList()
check = CHECKS.add

# --- (5.39) and (5.44) at the one sliding node: there C_0 = 1/3 ------------------------------------------------------

CHECKS += [
    one_node(
        "5.39",
        expanded,
        of_h1(m, printed_P(m), Q) * e**2,
        of_h1(m, P, Q) * e**2,
        {**AT_THE_NODE, theta: (1 + p) / (3 + p)},
        "  For m <= 1 C_T is C~_T.  theta from C_0 = 1/3 on: near C_0 the coefficient of t^2, and with it C_T, hardly"
        " counts.",
    ),
    one_node(
        "5.44",
        expanded,
        of_h2(printed_P(m)) * e**2,
        of_h2(P) * e**2,
        {**AT_THE_NODE, theta: 1 / (3 + y)},
        "  theta below C_0 = 1/3.  At kappa = 400, m = 1e-6 and theta = 0.33 the left side is 17424, the right 708.",
    ),
]

# --- where (5.30) holds as printed, and where it fails ---------------------------------------------------------------


def _border(root: Any) -> list[Goal]:
    """(5.30) holds for M >= root sqrt(m), and for each m and M >= 2 m below that some friction breaks it."""
    ratio = root / (1 + y)  # M/sqrt(m)
    below = {m: (ratio / (2 * (1 + q))) ** 2, M: ratio**2 / (2 * (1 + q))}  # M >= 2 m
    many = (1 + y) ** 2 / (y * (2 + y)) * (1 + ratio**2 + ratio**2 * (M + 1) / m).subs(below)  # sqrt(kappa)
    direct = x * (X + 1) * d2**2  # (5.13), (5.11)
    return [
        *(
            at_most(printed_P(m) * e**2, direct.subs(d2, e / sp.sqrt(m * (1 + p))), chart)
            for chart in (
                {m: (root / (1 + o)) ** 2, M: root**2 / (1 + o) * (1 + b), C_R: 1 + c, x: xi**2},
                {m: (root + o) ** 2, M: (root + o) ** 2 * (1 + b), C_R: 1 + c, x: xi**2},
            )
        ),
        less((printed_P(m).subs({C_R: 1, x: xi**2 * m}) / xi**2).subs(below).subs(xi, many), many**2),
    ]


check(
    id="x-printed-border",
    text="With m d_2^2 <= e^2 directly for (5.19), (5.23), F <= C_K (X + 1) e^2/m; the printed bound exceeds that by"
    " C_K/m^3 ((M^2 - m)(A + C_K + s) + M^2 - m^2) e^2.  For M^2 < m, M >= 2 m: the one open node that slides,"
    " F = kappa^2 e^2, body 1 with one more unknown that is not on Gamma_c and has the stiffness M - m; it breaks"
    " (5.30) as soon as sqrt(kappa) >= (1 + v + v (M + 1)/m)/(1 - v), v = M^2/m.",
    goals=_border,
    forms={"repaired": sp.Integer(1)},
    mutants={"true from M^2 = m/4 on": sp.Rational(1, 2), "false below M^2 = 4 m": sp.Integer(2)},
)

unit, slips, stretch, pull, bound = positive("lambda alpha beta gamma delta")
weights = positive("w_1 w_2")
zeta, along = sp.symbols("zeta_1 zeta_2", real=True), sp.symbols("d_2T1 d_2T2", real=True)


def _flexibility(name: str) -> Any:
    """``(S^-1)_TT`` at two nodes."""
    return sp.Matrix(2, 2, lambda i, j: sp.Symbol(f"{name}_{min(i, j) + 1}{max(i, j) + 1}", real=True))


def _all_slide(form: Any) -> list[Goal]:
    """Two nodes, open and sliding one way, for two forces; and the printed bound in a unit of stress."""
    factor, of_k = form
    k = positive("k")
    one, two, d_2 = _flexibility("f"), _flexibility("g"), sp.Matrix(along)
    load = sp.Matrix([w * z for w, z in zip(weights, zeta, strict=True)])
    p_T = k * load  # p_N = 0
    bounds_ = k * load  # differences of the friction bounds, S sigma_N > 0
    slide = -one * p_T - d_2  # of the slips, which have one sign
    large = (of_k * bound + pull + y) / slips
    in_unit = printed_P(m).subs({m: unit * m, M: unit * M, x: unit * x}, simultaneous=True)
    return [
        equal(-(bounds_.T * slide)[0], factor * k**2 * (load.T * one * load)[0] + k * (load.T * d_2)[0]),  # F
        equal((p_T.T * two * p_T)[0], factor * k**2 * (load.T * two * load)[0]),  # t^2
        equal((p_T.T * d_2)[0], k * (load.T * d_2)[0]),  # W
        equal(in_unit, x * M**2 / m**3 * (1 + unit * (A + x + s)), {**CONSTANTS, unit: o + 1}),
        less(large * bound * (1 + unit * stretch), slips * large**2 - pull * large, {unit: 1 / (stretch * (1 + p))}),
    ]


check(
    id="x-printed-false-everywhere",
    text="Loads make every node open and slide one way with S sigma_N > 0, for any pair of bodies and no gap.  Then"
    " p_N = 0, p_T = k W zeta, d_1 = -S_1^-1 p and F = k^2 <W zeta, (S_1^-1)_TT W zeta> + k <W zeta, d_2T>: of"
    " e^2, alpha k^2 - gamma k at least, alpha > 0.  In a unit of stress in which all stresses are lambda times as"
    " large the printed bound is delta k (1 + lambda beta) e^2 with delta = C_s C_tr M^2/m^3, beta = A + C_K + s; it"
    " is exceeded for k > (2 delta + gamma)/alpha, lambda <= 1/beta.  Likewise W + (m/A)^2 t^2 of (5.31), and so"
    " (5.32), (5.33), (5.36), and theta t^2 + 2 (1-theta) W of (5.44), and of (5.39) at C_0, against the same term:"
    " t^2 = k^2 <W zeta, (S_2^-1)_TT W zeta>, W = k <W zeta, d_2T>.",
    goals=_all_slide,
    forms={"repaired": (1, 2)},
    mutants={
        "half of the quadratic term": (sp.Rational(1, 2), 2),
        "from k = delta/(2 alpha) on": (1, sp.Rational(1, 2)),
    },
)

# --- Proposition 5.6 with the printed constants ----------------------------------------------------------------------

M_sum = {M: (2 + o) * m}

check(
    id="x-printed-rescued",
    text="Split a_11: half of it bounds t^2, as Cauchy-Schwarz in a_1 gives a_11 >= m t^2/(M^1 C_R^2), and"
    " M^2 >= 2 m M^1 for M >= 2 m and M >= M^1; by Young -m d_1^2/2 + C_K d_1 d_2 <= C_K^2 d_2^2/(2m).  With"
    " kappa = C_K/m and m d_2^2 <= e^2 friction adds at most (kappa + kappa^2/2) e^2, for kappa <= 6 below 4 kappa e^2"
    " and so below the printed bound; and k < C_2 implies kappa < 4.  C_K is k C_s C_tr with C_tr into L2(Gamma_c)"
    " throughout, in (5.13) as in C_2.",
    goals=lambda form: [
        at_most(x**2 * d2**2 / (2 * m), x * d1 * d2 - m * d1**2 / 2, squares=[(m * d1 - x * d2) ** 2 / (2 * m)]),
        at_most(M**2, 2 * m * M / (1 + p), M_sum),
        at_most(4 * kappa, kappa + kappa**2 / 2, {kappa: form[0] * q / (1 + q)}),
        at_most(of_36(m_tilde, printed_P(m_tilde)), of_36(m, P), with_theta(LARGE_M)),
        at_most(
            of_36(m, 4 * kappa),
            expanded.subs(W, of_31(kappa + kappa**2 / 2) - r),
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

more, true_kappa = positive("c kappa_2")  # C_tr(L2)/C_tr(H^1/2), and kappa with C_tr into L2


def _literal(reach: Any) -> list[Goal]:
    """With x = k C_s C_tr, C_tr into H^1/2, and c x the constant of friction that (5.13) needs: c <= reach (M/m)^2."""
    at_end = lambda m_tilde, M: (1 + m_tilde**2 / M**2) * m_tilde**3 / M**2 / (1 + q)  # k < C_2 leaves x below
    goals, cap = [], sp.Rational(5, 4) * reach
    for chart in (SMALL_M, LARGE_M):
        ratio = {more: reach * (chart[M] / chart[m]) ** 2 / (1 + p), m: chart[m], M: chart[M], m_tilde: chart[m_tilde]}
        goals += [
            at_most(printed_P(m_tilde), x * M**2 / m_tilde**3, chart),
            at_most(1 + m_tilde**2 / M**2, 1 + m_tilde**2 / A**2, chart),
            at_most(cap, more * x / m, {**ratio, x: at_end(chart[m_tilde], chart[M])}),  # kappa
            at_most(M**2 / m_tilde**3, more / m * (1 + cap / 2), ratio),  # times x: friction
            at_most(1 + true_kappa, 2 * sp.sqrt(true_kappa), {true_kappa: y**2}, squares=[(y - 1) ** 2]),
            # t <= A/m X e with X of the true kappa; C_T M/m~ >= (A/m) (A M/m^2)
            at_most(A * M / m**2, A / m + cap + (1 + cap) / 2, {**chart, x: sp.Integer(0)}),
        ]
    return goals


check(
    id="x-printed-literal",
    text="x = k C_s C_tr with C_tr into H^1/2, c = C_tr(L2)/C_tr(H^1/2), kappa = c x/m: friction adds at most"
    " (kappa + kappa^2/2) e^2 as in x-printed-rescued.  k < C_2 says that the printed term P(x) is below"
    " 1 + m~^2/A^2, and P(x) >= x M^2/m~^3.  For c <= 2/3 (M/m)^2 that leaves kappa <= 5/6, hence"
    " kappa + kappa^2/2 <= x M^2/m~^3 <= P(x), and t^2 <= C_T^2 M^2/m~^2 e^2 with the C_T of x, as"
    " sqrt(kappa) <= (1 + kappa)/2.",
    goals=_literal,
    forms={"repaired": sp.Rational(2, 3)},
    mutants={"c <= 3/4 (M/m)^2": sp.Rational(3, 4), "c <= (M/m)^2": sp.Integer(1)},
)

# --- how the constants hang together ----------------------------------------------------------------------------------

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

# --- the theorem in energy norms: its premises ------------------------------------------------------------------------

# D is |d_1|^2 in the energy of body 1 and d1 its root, e = |d_2| the norm (5.21) of psi - psi~, t the norm of
# p = T psi - T psi~.  The Cauchy-Schwarz inequality of an inner product is used freely; its slack is a parameter.
rho, size = positive("rho E")
D, work = nonnegative("D Y")
kappa_1, kappa_2, root_rho, extra = nonnegative("kappa_1 kappa_2 s e_")
ratio = positive("x")

check(
    id="x-reaction",
    text="With v = R2 p: t^2 = a_2(v, v) = <p, v> = -a_1(d_1, v), so t^4 <= D a_1(v, v) <= D rho t^2: with slack"
    " t^2 = rho D/((1+p)(1+q)).  Least: where S_1 d_1 = rho S_2 d_1, p = -rho S_2 d_1, with E = a_2(d_1, d_1) D is"
    " rho E and t^2 = rho^2 E.",
    goals=lambda form: [
        equal((rho * D / ((1 + p) * (1 + q))) ** 2, D / (1 + p) * rho / (1 + q) * (rho * D / ((1 + p) * (1 + q)))),
        at_most(form * D, rho * D / ((1 + p) * (1 + q))),
        equal(rho**2 * size, form * rho * size),
    ],
    forms={"repaired": rho},
    mutants={"half of rho": rho / 2, "twice rho": 2 * rho, "rho^2": rho**2},
)

tt, tn, nn = sp.symbols("s_TT s_TN s_NN", positive=True)

check(
    id="x-reaction-normal",
    text="Without friction p_T = 0.  With v = R2 p: t^2 = <p, v> = <p, w> = -a_1(d_1, w) for every w with w_N = v_N;"
    " for the w of least energy t^4 <= D a_1(w, w), a_1(w, w) = v_N' S_1N v_N <= rho_N v_N' S_2N v_N and"
    " v_N' S_2N v_N <= a_2(v, v) = t^2.  Least: S_1N y = rho_N S_2N y, p_N = -S_1N y, where with E = y' S_2N y"
    " D = p_N' S_1N^-1 p_N = rho_N E and t^2 = p_N' S_2N^-1 p_N = rho_N^2 E; (S^-1)_NN = S_N^-1, shown at one node."
    "  And rho_N <= rho, as v_N' S_1N v_N <= a_1(v, v) <= rho a_2(v, v) for the v of least energy in body 2.",
    goals=lambda form: [
        at_most(form * D, rho * D / ((1 + p) * (1 + q) * (1 + r))),
        equal(rho**2 * size, form * rho * size),
        equal(sp.Matrix([[tt, tn], [tn, nn]]).inv()[1, 1], 1 / (nn - tn**2 / tt)),
        at_most(form * size, rho * size / ((1 + p) * (1 + q))),
    ],
    forms={"repaired": rho},
    mutants={"half of rho_N": rho / 2, "twice rho_N": 2 * rho},
)

C_t1, C_t2 = nonnegative("C_t1 C_t2")

check(
    id="x-friction-energy",
    text="Cauchy-Schwarz: F <= k |zeta| |(d_1 - d_2)_T| in L2(Gamma_c), with |zeta| <= C_s e and"
    " |(d_1 - d_2)_T| <= C_t1 |d_1| + C_t2 e; kappa_a = k C_s C_ta.",
    goals=lambda form: at_most(
        form[0] * d1 * e + form[1] * e**2, k * (C_s * e / (1 + p)) * (C_t1 * d1 / (1 + q) + C_t2 * e / (1 + r)) - o
    ),
    forms={"repaired": (k * C_s * C_t1, k * C_s * C_t2)},
    mutants={"without kappa_2": (k * C_s * C_t1, 0), "without kappa_1": (0, k * C_s * C_t2)},
)

largest = root_rho + kappa_1 + extra  # r, with kappa_2 = e_ (s + kappa_1 + e_): every kappa_2 >= 0 once
ENERGY = (root_rho**2, kappa_1, extra * largest)
f = lambda x: energy_norms.work(x, *ENERGY[1:])

check(
    id="x-ratio",
    text="With |d_1| = x e: W <= -D + F <= (kappa_2 + kappa_1 x - x^2) e^2 = f(x) e^2 by (5.28), and W >= -t e >="
    " -sqrt(rho) x e^2.  So x^2 <= (sqrt(rho) + kappa_1) x + kappa_2, which no x above its positive root r satisfies;"
    " f(r) = -sqrt(rho) r.",
    goals=lambda form: [
        at_most(f(ratio) * e**2, -(ratio**2) * e**2 + kappa_1 * ratio * e**2 + ENERGY[2] * e**2 - q - p),
        equal(f(ratio) + root_rho * ratio, (root_rho + kappa_1) * ratio + ENERGY[2] - ratio**2),
        equal(energy_norms.largest_ratio(*ENERGY), form),
        less((root_rho + kappa_1) * (form + y) + ENERGY[2], (form + y) ** 2),
        equal(f(form), -root_rho * form),
    ],
    forms={"repaired": largest},
    mutants={"without kappa_2": root_rho + kappa_1, "half as large": largest / 2},
)

# --- the theorem ------------------------------------------------------------------------------------------------------

at = lambda x, theta: energy_norms.square_at(x, theta, *ENERGY)

check(
    id="x-energy",
    text="(5.24) with t^2 = rho x^2 e^2/(1+p) by x-reaction and W = (f(x) - q) e^2 by x-ratio, for any x: its square is"
    " at most phi(x) e^2, as 2 theta (1-theta) >= 0; and x is in [0, r] by x-ratio, where q(theta)^2 is the largest"
    " phi(x).",
    goals=lambda form: [
        at_most(
            form(ratio, value) * e**2,
            (1 - value) ** 2 * e**2
            + 2 * value * (1 - value) * (f(ratio) - q) * e**2
            + value**2 * ENERGY[0] * ratio**2 * e**2 / (1 + p),
        )
        for value in (any_theta, sp.Integer(1))
    ],
    forms={"repaired": at},
    mutants={
        "half of rho": lambda x, theta: energy_norms.square_at(x, theta, ENERGY[0] / 2, *ENERGY[1:]),
        "without friction": lambda x, theta: energy_norms.square_at(x, theta, ENERGY[0], 0, 0),
        "the factor 2 dropped": lambda x, theta: (at(x, theta) + (1 - theta) ** 2 + (theta * root_rho * x) ** 2) / 2,
    },
)

s_ = positive("s_")  # sqrt(rho) > 0
r_ = s_ + kappa_1 + extra
WHERE = (s_**2, kappa_1, extra * r_)
turn = (2 * r_ - kappa_1) / ((2 + s_**2) * r_ - kappa_1)
vertex = lambda theta: (1 - theta) * kappa_1 / (2 - (2 + s_**2) * theta)


def _branches(turning: Any) -> list[Goal]:
    """phi is largest at the vertex, in [0, r), before the turning theta, and at r from there on."""
    phi = lambda x, theta: energy_norms.square_at(x, theta, *WHERE)
    early = turning / (1 + y)
    late = turning + (1 - turning) * o / (1 + o)
    bend = lambda theta: theta * (2 - (2 + s_**2) * theta)
    return [
        equal(phi(vertex(theta), theta) - phi(ratio, theta), bend(theta) * (ratio - vertex(theta)) ** 2),
        less(0, 2 - (2 + s_**2) * early),
        at_most(vertex(early), 0),
        less(vertex(early), r_),
        equal(1 - phi(vertex(theta), theta), energy_norms.one_minus_inside(theta, *WHERE)),
        # phi(r) - phi(x) = (r - x) (2 theta (1-theta) kappa_1 - bend (r + x)), the last factor least at x = 0 or r
        equal(
            phi(r_, theta) - phi(ratio, theta),
            (r_ - ratio) * (2 * theta * (1 - theta) * kappa_1 - bend(theta) * (r_ + ratio)),
        ),
        *(at_most(2 * (1 - late) * kappa_1, (2 - (2 + s_**2) * late) * (r_ + end)) for end in (0, r_)),
        equal(1 - phi(r_, theta), energy_norms.one_minus_end(theta, *WHERE)),
    ]


check(
    id="x-energy-branches",
    text="phi is a parabola in x, concave before 2/(2+rho).  Before theta_s its vertex lies in [0, r) and gives the"
    " largest value; from theta_s on r does, as phi(r) - phi(x) is (r - x) times a factor that is linear in x and not"
    " negative at x = 0 and x = r.  The two forms of 1 - q^2 that are computed are those values.",
    goals=_branches,
    forms={"repaired": turn},
    mutants={"2/(2+rho)": 2 / (2 + s_**2) * (1 + kappa_1), "half of theta_s": turn / 2},
)

work_there = energy_norms.work(ratio, kappa_1, kappa_2)

check(
    id="x-energy-interval",
    text="The square at x is below 1 exactly where 2 (f - 1) + theta (1 - 2 f + rho x^2) < 0: linear in theta for each"
    " x, so that the good thetas form one interval.",
    goals=lambda form: equal(
        energy_norms.square_at(ratio, theta, root_rho**2, kappa_1, kappa_2) - 1, theta * form, {theta: any_theta}
    ),
    forms={"repaired": 2 * (work_there - 1) + theta * (1 - 2 * work_there + root_rho**2 * ratio**2)},
    mutants={"the factor 2 dropped": work_there - 1 + theta * root_rho**2 * ratio**2},
)

check(
    id="x-threshold-uniqueness",
    text="Two solutions: x^2 + 1 <= kappa_1 x + kappa_2 for x = |d_1|/|d_2| by the energy argument; impossible for"
    " every x exactly where kappa_2 + kappa_1^2/4 < 1, as 1 - f(x) = (x - kappa_1/2)^2 + 1 - kappa_2 - kappa_1^2/4.",
    goals=lambda form: equal(
        1 + ratio**2 - kappa_1 * ratio - kappa_2, (ratio - kappa_1 / 2) ** 2 + 1 - form(kappa_1, kappa_2)
    ),
    forms={"repaired": energy_norms.friction_number},
    mutants={"kappa_1^2/2": lambda k1, k2: k2 + k1**2 / 2, "kappa_1/4": lambda k1, k2: k2 + k1 / 4},
)

# --- without friction -------------------------------------------------------------------------------------------------

u, v, u_1, v_1 = Vector("u2"), Vector("u~2"), Vector("u1"), Vector("u~1")
image, loads = Vector("T psi"), Vector("l2")
solve = linear("S2^-1")
c_N = nonnegative("c_N")
gap_, u_N, below = sp.symbols("gap u_2N u~_2N", real=True)


def _descent(form: Any) -> list[Goal]:
    """e, E, their slope and step III, in as many unknowns as there are."""
    step, convex, smooth, sign = form
    reaction = lambda w: L1(w) - a1(u_1, w)  # c = T psi
    half = sp.Rational(1, 2)
    energy_1, energy_2 = (lambda w: half * a1(w, w) - L1(w)), (lambda w: half * a2(w, w) - L2(w))
    touching = {"u_1N": u_N + gap_, "u~_1N": below + gap_ - p}
    return [
        # the energy of body 1 at an admissible u~1, about u1
        equal(energy_1(v_1) - energy_1(u_1), half * a1(v_1 - u_1, v_1 - u_1) - reaction(v_1 - u_1)),
        # -c (u~1 - u1)_N >= -c (u~2 - u2)_N at a node that touches, c >= 0, and at one that is open, c = 0; c_T = 0
        at_most(-sign * c_N * (touching["u~_1N"] - touching["u_1N"]), -sign * c_N * (below - u_N)),
        # the energy of body 2, about u2, where a_2(u2, .) = L2 + psi by step I
        equal(energy_2(v) - energy_2(u) - (a2(u, v - u) - L2(v - u)), half * a2(v - u, v - u)),
        # E(u~2) >= E(u2) + <psi - T psi, d> + e^2/2 + D/2, and the same from u~2 to u2: E above and below its tangent
        at_most(e**2 / 2 + D / 2 + q, convex * e**2 / 2),
        at_most(
            smooth * e**2 / 2,
            e**2 / 2 + s_ * d1 * e / (1 + p) - d1**2 / 2,
            {rho: s_**2},
            squares=[(s_ * e - d1) ** 2 / 2],
        ),
        # -<p, d_2> >= D >= t^2/rho_N
        at_most(D + q, (smooth - 1) * D / ((1 + p) * rho)),
        # step I of the new force less step I of the old one
        equal(
            solve(theta * image + (1 - theta) * psi + loads) - solve(psi + loads),
            step * solve(psi - image),
            {theta: any_theta},
        ),
    ]


check(
    id="x-gradient-descent",
    text="e(u2), the least energy of body 1 over u_N <= u2_N + gap: at an admissible u~1 it is e(u2) - c (u~1 - u1) +"
    " |u~1 - u1|^2/2, c = T psi >= 0, c_T = 0, and c (u~1 - u1) <= c_N (u~2 - u2)_N node by node; so e(u~2) >= e(u2) -"
    " c_N (u~2 - u2)_N + D/2.  With step I, E(u~2) >= E(u2) + <psi - T psi, d> + e^2/2: E is 1-strongly convex."
    "  Exchanged, E(u~2) <= E(u2) + <psi - T psi, d> + e^2/2 - <p, d> - D/2, at most (1+rho_N) e^2/2 more than the"
    " tangent, as |<p, d>| <= t e <= sqrt(rho_N D) e: psi - T psi is the gradient, (1+rho_N)-Lipschitz.  -T is"
    " cocoercive, -<p, d> >= D >= t^2/rho_N.  Step III moves u2 by -theta S_2^-1 times the gradient.",
    goals=_descent,
    forms={"repaired": (-theta, 1, 1 + rho, 1)},
    mutants={
        "uphill": (theta, 1, 1 + rho, 1),
        "theta squared": (-(theta**2), 1, 1 + rho, 1),
        "2-strongly convex": (-theta, 2, 1 + rho, 1),
        "rho_N-smooth": (-theta, 1, rho, 1),
        "(1 + 2 rho_N)-cocoercive": (-theta, 1, 1 + 2 * rho, 1),
        "a reaction that pulls": (-theta, 1, 1 + rho, -1),
    },
)


def _attained(form: Any) -> list[Goal]:
    """The square of (1-theta) g + theta p with e = 1, Y = -<p, g> between t^2/rho and what Cauchy-Schwarz leaves."""
    square = lambda theta, t2, Y: (1 - theta) ** 2 - 2 * theta * (1 - theta) * Y + theta**2 * t2
    least = 2 / (2 + rho)
    t2 = rho**2 / (1 + p)
    low, high, beyond = least / (1 + o), (least + o) / (1 + o), 1 + o
    first, second = form(rho)
    return [
        at_most(first(low) ** 2, square(low, t2, t2 / rho + q)),
        at_most(second(high) ** 2, square(high, t2, t2 / rho + q)),
        at_most(second(beyond) ** 2, square(beyond, rho * work / (1 + q), work), {work: rho / (1 + p)}),
        equal(square(theta, 0, 0), first(theta) ** 2),  # all open, p = 0
        equal(square(theta, rho**2, rho), second(theta) ** 2),  # all touch, p = -rho_N g
    ]


check(
    id="x-attained",
    text="-<p, g> = D + .. >= t^2/rho_N and t <= rho_N e: for theta <= 1 the square is linear in t^2 and below the"
    " larger of its values at t = 0 and t = rho_N e, for theta > 1 at most (theta (1+rho_N) - 1)^2 e^2.  Both values"
    " occur: where all nodes are open T is constant, p = 0; where all touch, p = -rho_N g for g_N = S_2N y,"
    " S_1N y = rho_N S_2N y.",
    goals=_attained,
    forms={"repaired": lambda rho: (lambda theta: 1 - theta, lambda theta: theta * (1 + rho) - 1)},
    mutants={
        "half of rho_N": lambda rho: (lambda theta: 1 - theta, lambda theta: theta * (1 + rho / 2) - 1),
        "without the open nodes": lambda rho: (lambda theta: 1 - 2 * theta, lambda theta: theta * (1 + rho) - 1),
    },
)

check(
    id="x-best-theta",
    text="1 - theta and theta (1+rho_N) - 1 are both rho_N/(2+rho_N) at theta = 2/(2+rho_N); below it the first is"
    " larger, above it the second: no other theta has a factor as small.  C_0 is this theta with rho_N replaced by"
    " (M C_R/m)^2, which is at least rho: with E = phi' E_2 phi, phi' S_1 phi <= M C_R^2 E and phi' S_2 phi >= m E.",
    goals=lambda form: [
        equal(1 - form, form * (1 + rho) - 1),
        equal(1 - form, energy_norms.predicted_rate(rho)),
        less(energy_norms.predicted_rate(rho), 1 - form / (1 + y)),
        less(energy_norms.predicted_rate(rho), form * (1 + y) * (1 + rho) - 1),
        equal(C0, form.subs(rho, A**2 / m**2), CONSTANTS),
        at_most(A**2 / m**2, M * C_R**2 * size / (1 + p) / (m * size * (1 + q)), CONSTANTS),
    ],
    forms={"repaired": energy_norms.predicted_theta(rho)},
    mutants={"1/(1+rho_N)": 1 / (1 + rho), "2/(1+rho_N)": 2 / (1 + rho)},
)

check(
    id="x-no-theta-for-all-moduli",
    text="S_1 is proportional to E_1, so that E_1 c times as large makes rho_N c times as large.  With"
    " c = (2/theta - 1)/rho_N the factor theta (1 + c rho_N) - 1 is 1, and larger c make it larger.  With"
    " c = 2 (1/theta - 1)/rho_N the best theta 2/(2 + c rho_N) is theta, any number in (0, 1).",
    goals=lambda form: [
        equal(theta * (1 + form[0] * rho) - 1, 1),
        less(1, theta * (1 + (1 + y) * form[0] * rho) - 1, {theta: any_theta}),
        equal(energy_norms.predicted_theta(form[1] * rho), theta),
    ],
    forms={"repaired": ((2 / theta - 1) / rho, 2 * (1 / theta - 1) / rho)},
    mutants={
        "half of the first": ((2 / theta - 1) / (2 * rho), 2 * (1 / theta - 1) / rho),
        "half of the second": ((2 / theta - 1) / rho, (1 / theta - 1) / rho),
    },
)

# --- a norm that the proof chooses ------------------------------------------------------------------------------------


def _free_norm(form: Any) -> list[Goal]:
    """The circle of h and its ends; smaller thetas in the same norm."""
    low, high, smaller = form(q)
    rest, z = 1 - theta, sp.Symbol("u", real=True) + sp.I * sp.Symbol("v", real=True)
    u, v = z.as_real_imag()
    D = (u - rest) ** 2 + v**2
    real, square = theta * (u - rest) / D, theta**2 / D  # of h = theta/(z - rest)
    on_circle = lambda expression: sp.numer(sp.together(expression)).expand().subs(v**2, q**2 - u**2)
    share = 1 / (1 + p)
    return [
        equal(on_circle(square - (low + high) * real + low * high), 0),
        equal(low, theta / (-q - rest)),
        equal(high, theta / (q - rest)),
        equal(smaller(share), 1 - share + share * q),  # T_(s theta) = (1 - s) id + s T_theta
    ]


check(
    id="x-free-norm",
    text="Where (1 - theta) g + theta p = z g with |z| = q, that is for g = h p, h = theta/(z - (1 - theta)), the terms"
    " of Q in q^2 |g|_Q^2 - |(1 - theta) g + theta p|_Q^2 cancel: what is left is -Sigma(h p, p).  By the strict lemma"
    " of Kalman, Yakubovich and Popov some Q makes the form definite if and only if that is positive on the whole"
    " circle, which meets the real axis at -theta/(q+1-theta) and theta/(q-1+theta).  T_(s theta) is a mean of the"
    " identity and T_theta.",
    goals=_free_norm,
    forms={"repaired": lambda q: (-theta / (q + 1 - theta), theta / (q - 1 + theta), lambda s: 1 - s * (1 - q))},
    mutants={
        "a circle with another end": lambda q: (-theta / (q + 1), theta / (q - 1 + theta), lambda s: 1 - s * (1 - q)),
        "the share of q": lambda q: (-theta / (q + 1 - theta), theta / (q - 1 + theta), lambda s: s * q),
    },
)

# --- the same without a mesh: layers, rectangles, and the local law ---------------------------------------------------


def _two_matrices(form: Any) -> list[Goal]:
    """The circle by its ends, and the determinant of M(h) by those of M(x_1), M(x_2) and its middle coefficient."""
    x1, x2, h = sp.symbols("x1 x2 h", real=True)
    u, t, a, b_, o, d_, e_, f = sp.symbols("u t a1 b1 o1 a2 b2 o2", real=True)
    on_circle = (x1 + x2) * h - x1 * x2  # |h|^2, for h its real part
    share = (h - x1) / (x2 - x1)
    mean = lambda one, other: (1 - u) * one + u * other
    determinant = mean(a, d_) * mean(b_, e_) - mean(o, f) ** 2 - t**2 * u * (1 - u)
    ends = (1 - u) ** 2 * (a * b_ - o**2) + u**2 * (d_ * e_ - f**2)
    return [
        equal(on_circle - h**2, (h - x1) * (x2 - h)),  # the square of the imaginary part of h
        equal(on_circle - h**2, (x2 - x1) ** 2 * share * (1 - share)),
        equal(determinant, ends + 2 * u * (1 - u) * form((a, b_, o), (d_, e_, f), t)),
        equal((1 - u) ** 2 * p**2 + u**2 * q**2 - 2 * u * (1 - u) * p * q, ((1 - u) * p - u * q) ** 2),
    ]


def _middle(of_t: Any) -> Any:
    """The coefficient of 2u(1-u), with a term of t."""
    return lambda one, other, t: (one[0] * other[1] + other[0] * one[1] - of_t * t**2) / 2 - one[2] * other[2]


check(
    id="x-layers",
    text="On the circle (Im h)^2 = (Re h - x_1)(x_2 - Re h), so that beside the diagonal M(h) has"
    " +-i t sqrt(u(1-u)), u = (Re h - x_1)/(x_2 - x_1).  Its determinant is (1-u)^2 det M(x_1) + 2u(1-u) m +"
    " u^2 det M(x_2), which at m = -sqrt(det M(x_1) det M(x_2)) is a square with a zero in between.",
    goals=_two_matrices,
    forms={"repaired": _middle(1)},
    mutants={"without t": _middle(0), "twice t^2": _middle(2)},
)


def _squares(form: Any) -> list[Goal]:
    """|h|^2/(Re h + nu) is monotone on the circle, with these ends; the square that bounds the unknown form E_n."""
    x1, x2, h, nu, y_ = sp.symbols("x1 x2 h nu y", real=True)
    r, i, e1, e2 = sp.symbols("r i e1 e2", real=True)  # h = r + i i, and an amplitude e1 + i e2 against a real y
    quotient = ((x1 + x2) * h - x1 * x2) / (h + nu)
    low, high = form(x1, x2, nu)
    rest = (r + nu) * (e1**2 + e2**2) - 2 * y_ * (r * e1 - i * e2) + (r**2 + i**2) / (r + nu) * y_**2
    return [
        equal(sp.diff(quotient, h) * (h + nu) ** 2, (x1 + x2) * nu + x1 * x2),
        equal(quotient.subs(h, x1), low),
        equal(quotient.subs(h, x2), high),
        equal(rest, (r + nu) * ((e1 - r * y_ / (r + nu)) ** 2 + (e2 + i * y_ / (r + nu)) ** 2)),
    ]


check(
    id="x-rectangles",
    text="On the circle |h|^2 = (x_1+x_2) Re h - x_1 x_2, and the derivative of |h|^2/(Re h + nu) has the sign of"
    " (x_1+x_2) nu + x_1 x_2 everywhere: the quotient is largest at an end, x_1^2/(x_1+nu) or x_2^2/(x_2+nu).  The"
    " square in the unknown part of the flexibility is completed for complex amplitudes.",
    goals=_squares,
    forms={"repaired": lambda x1, x2, nu: (x1**2 / (x1 + nu), x2**2 / (x2 + nu))},
    mutants={
        "ends without nu": lambda x1, x2, nu: (x1, x2),
        "one end twice": lambda x1, x2, nu: (x2**2 / (x2 + nu),) * 2,
    },
)


@cache
def _waves() -> tuple[Any, ...]:
    """h, m >= 0 and the coefficient of cos((2m+1) pi x/h) in a hat of base 2h and height 1."""
    (width, wave), x = sp.symbols("h xi", positive=True), sp.Symbol("x", real=True)
    j = sp.Symbol("m", integer=True, nonnegative=True)
    found = 2 * sp.integrate((1 - x / width) * sp.cos(wave * x), (x, 0, width))  # quick for a symbol
    return width, j, sp.simplify(found.subs(wave, (2 * j + 1) * sp.pi / width))


def _saw_tooth(form: Any) -> list[Goal]:
    """The amplification of a saw-tooth of pressure: its image from below, its own norm from above."""
    n, d, G, nu, zeta = sp.symbols("n d G nu zeta", positive=True)
    width, j, hat = _waves()
    E = 2 * G / (1 - nu)  # E^*
    odd = sp.Rational(7, 8) * zeta  # the sum of (2m+1)^-3
    first = sp.pi**2 / (4 * width * odd)  # c_0 from the sum of c_m 4h/(pi^2 (2m+1)^2) = 1, c_m = c_0/(2m+1)
    own = width / 2 * first**2 * 2 * width / (E * sp.pi) * odd  # for each node
    image = theta**2 * k**2 * n * d / (G * width)
    return [
        equal(hat, 4 * width / (sp.pi**2 * (2 * j + 1) ** 2)),
        equal(own, sp.pi**3 / (14 * zeta * E)),
        equal(image / (n * own), form(zeta) * theta**2 * k**2 * d / ((1 - nu) * width)),
    ]


check(
    id="x-local-law",
    text="The shear field (y/d, 0) has the energy G n h/d and the work theta k n, so the image has at least the square"
    " theta^2 k^2 n d/(G h).  The saw-tooth has at most pi^3/(14 zeta(3) E*) for each node, by the pressure"
    " sum c_0/(2m+1) cos((2m+1) pi x/h) in a half-plane.  With E*/G = 2/(1-nu) the quotient is 28 zeta(3)/pi^3 times"
    " theta^2 k^2 d/((1-nu) h).",
    goals=_saw_tooth,
    forms={"repaired": lambda zeta: 28 * zeta / sp.pi**3},
    mutants={"14 for 28": lambda zeta: 14 * zeta / sp.pi**3, "pi^2": lambda zeta: 28 * zeta / sp.pi**2},
)

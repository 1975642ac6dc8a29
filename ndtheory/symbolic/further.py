"""What the paper does not state, proved: where the printed (5.30) holds, and how the constants are connected."""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic.engine import CheckList, Goal, at_most, equal, less, nonnegative, positive
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
from ndtheory.symbolic.symbols import C_R, CONSTANTS, A, M, b, c, d1, d2, e, m, mu, o, p, q, r, theta, x, xi, y

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
k = positive("k")


def _flexibility(name: str) -> Any:
    """``(S^-1)_TT`` at two nodes."""
    return sp.Matrix(2, 2, lambda i, j: sp.Symbol(f"{name}_{min(i, j) + 1}{max(i, j) + 1}", real=True))


def _all_slide(form: Any) -> list[Goal]:
    """Two nodes, open and sliding one way, for two forces; and the printed bound in a unit of stress."""
    factor, of_k = form
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

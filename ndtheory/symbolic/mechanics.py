"""Sections 2 to 4 and 6.1: the contact problem and the algorithm.

One bar, one node or one strip (``one_case``) refutes what it contradicts and proves nothing: the general form is then
read, in the proof of the statement.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory.symbolic.engine import CheckList, Goal, Vector, at_most, equal, less, nonnegative, positive
from ndtheory.symbolic.symbols import CONSTANTS, C, M, a2, m, o, p, q, r, test, theta, y

CHECKS = CheckList()
check = CHECKS.add

# --- Section 2 ------------------------------------------------------------------------------------------------------

lame_lambda, lame_mu = positive("lame_lambda lame_mu")
exx, eyy, exy = sp.symbols("e_xx e_yy e_xy", real=True)
strain_energy = lambda lam: 2 * lame_mu * (exx**2 + eyy**2 + 2 * exy**2) + lam * (exx + eyy) ** 2  # sigma : e

check(
    id="2.2",
    text="Isotropic Hooke in the plane: sigma : e = mu ((e_xx - e_yy)^2 + 4 e_xy^2) + (lambda + mu) (tr e)^2, which is"
    " elliptic.",
    one_case=True,
    goals=lambda form: [
        equal(strain_energy(lame_lambda), lame_mu * ((exx - eyy) ** 2 + 4 * exy**2) + form * (exx + eyy) ** 2)
    ],
    forms={"printed": lame_lambda + lame_mu},
    mutants={"lambda + 2 mu": lame_lambda + 2 * lame_mu},
)

sxx, syy, sxy, other = sp.symbols("s_xx s_yy s_xy s", real=True)
t = positive("t")
normal = sp.Matrix([1 - t**2, 2 * t]) / (1 + t**2)  # every unit vector but one and its mirror images
along = sp.Matrix([-normal[1], normal[0]])
stress1 = sp.Matrix([[sxx, sxy], [sxy, syy]])
stress2 = stress1 + other * along * along.T  # the same traction on the interface: sigma^1 n^1 = - sigma^2 n^2


def _shear(stress: Any, n: Any) -> Any:
    traction = stress * n
    return traction - (n.T * traction)[0] * n


check(
    id="2.3",
    text="Action and reaction, sigma^1 n^1 + sigma^2 n^2 = 0 with n^2 = -n^1: the normal stresses are equal, the"
    " tangential stress vectors are opposite.",
    goals=lambda form: [
        equal((normal.T * stress1 * normal)[0], (normal.T * stress2 * normal)[0]),
        *(equal(a, form * b) for a, b in zip(_shear(stress1, normal), _shear(stress2, -normal), strict=True)),
    ],
    forms={"printed": 1, "repaired": -1},
    mutants={"twice": -2},
)

b, slip = positive("b"), nonnegative("u_T")

check(
    id="2.6",
    text="With |tau| <= b = k|S(sigma_N)| and slip u >= 0, b > 0: for tau = -b (2.6) holds; for tau = -b + t it is"
    " positive unless u = 0.  Where b = 0 (2.6) holds for every slip, while (2.5) as printed asks for u = -nu tau = 0.",
    goals=lambda form: [equal(b * slip + form[0] * b * slip, 0), less(0, b * y + (-b + t) * y), equal(form[1], 0)],
    forms={"printed": (-1, slip), "repaired": (-1, sp.Integer(0))},
    mutants={"shear in the direction of the slip": (1, sp.Integer(0))},
)

# --- Section 3, in one dimension ------------------------------------------------------------------------------------

X, f, young, length = sp.symbols("X f E L", positive=True)
c1, c2 = sp.symbols("c_1 c_2", real=True)


def _bar(sign: Any) -> tuple[Any, Any]:
    """int E u' v' - f v, and E u'(L) v(L), for E u'' = sign f and v = c_1 X + c_2 X^2."""
    u = sign * f * X**2 / (2 * young) + c1 * X
    v = c1 * X + c2 * X**2
    over = lambda expression: sp.integrate(sp.expand(expression), (X, 0, length))
    end = young * sp.diff(u, X).subs(X, length) * v.subs(X, length)
    return over(young * sp.diff(u, X) * sp.diff(v, X)) - over(f * v), end


for number, body in ((1, "2"), (2, "1")):
    check(
        id=f"3.1.{number}",
        text=f"A bar with E u'' = -f has the weak form (4.9), int E u' v' = int f v + (end force) v; with div sigma = f"
        f" for body {body} the load has the other sign than in (2.1).",
        one_case=True,
        goals=lambda sign: equal(*_bar(sign)),
        forms={"printed": 1, "repaired": -1},
        mutants={"no load": sp.Integer(0), "twice": -2},
    )

S_1, S_2 = positive("S_1 S_2")
load_1, load_2, g = sp.symbols("l_1 l_2 g", real=True)


def _bars(sign: Any) -> list[Goal]:
    """Two bars in contact: the solution must be a fixed point; a step multiplies errors by 1 - theta - theta rho."""
    end = lambda g: (g + load_2) / S_2  # displacement of the end of body 2 under the force g
    step = lambda g: sign * theta * (S_1 * end(g) - load_1) + (1 - theta) * g  # sigma^1 n^1 = S_1 u - l_1
    solution = S_2 * (load_1 + load_2) / (S_1 + S_2) - load_2
    return [equal(step(solution), solution), equal(sp.diff(step(g), g), 1 - theta - theta * S_1 / S_2)]


check(
    id="3.1.3",
    text="Two bars that stay in contact, g = sigma^2 n^2 = -sigma^1 n^1 at the solution: only -theta sigma^1 n^1"
    " leaves the solution where it is.  The printed sign multiplies errors by 1 - theta + theta rho.",
    one_case=True,
    goals=_bars,
    forms={"printed": 1, "repaired": -1},
    mutants={"twice": -2},
)

# --- Section 4 ------------------------------------------------------------------------------------------------------

first, second = (lambda v: sp.sqrt(100 * v[0] ** 2 + v[1] ** 2)), (lambda v: sp.sqrt(v[0] ** 2 + 100 * v[1] ** 2))
one, two = (sp.Integer(1), sp.Integer(0)), (sp.Integer(0), sp.Integer(1))

check(
    id="norm-half",
    text="The smaller of two norms is no norm: of sqrt(100 v_1^2 + v_2^2) and sqrt(v_1^2 + 100 v_2^2) it is 1 at both"
    " unit vectors and sqrt(101) at their sum.  The larger one: N_1(u+v) <= N_1(u) + N_1(v) <= max(u) + max(v).",
    goals=lambda form: form(),
    forms={
        "printed": lambda: at_most(
            *(sum(sp.Min(first(v), second(v)) for v in vs) for vs in ((one, two), ((sp.Integer(1), sp.Integer(1)),)))
        ),
        "repaired": lambda: at_most((p + r) + (q + o), (p + q) / (1 + y)),  # p, q the values of N_1
    },
    mutants={"half the larger one": lambda: at_most((p + r) / 2 + (q + o) / 2, (p + q) / (1 + y))},
)

m_1, M_1 = positive("m_1 M_1")
u_1, u_2, v_1, v_2 = nonnegative("u_1 u_2 v_1 v_2")  # norms of two fields on body 1 and on body 2

check(
    id="4.3",
    text="|a(u, v)| <= M_1 u_1 v_1 + M_2 u_2 v_2 <= (M_1 + M_2) |u| |v|, and a(v, v) >= min(m_1, m_2) |v|^2.",
    goals=lambda form: [
        at_most(
            form[0](M_1, M_1 + o) ** 2 * (u_1**2 + u_2**2) * (v_1**2 + v_2**2),
            (M_1 * u_1 * v_1 + (M_1 + o) * u_2 * v_2) ** 2,
            squares=[M_1 * (M_1 + o) * (u_1 * v_2 - u_2 * v_1) ** 2],
        ),
        at_most(m_1 * v_1**2 + (m_1 + o) * v_2**2, form[1](m_1, m_1 + o) * (v_1**2 + v_2**2)),
    ],
    forms={"printed": (lambda one, other: one + other, lambda small, large: small)},
    mutants={
        "the smaller M": (lambda one, other: one, lambda small, large: small),
        "a quarter of the sum": (lambda one, other: (one + other) / 4, lambda small, large: small),
        "the larger m": (lambda one, other: one + other, lambda small, large: large),
    },
)

check(
    id="4.2",
    text="With M the sum, M >= 2 m: each M^a >= m^a >= m.",
    goals=lambda form: at_most((m_1 + o + p) + (m_1 + q + r), form * m_1),
    forms={"printed": 2},
    mutants={"M >= 3 m": 3},
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

check(
    id="4.7",
    text="Two bars, |phi|^2 = coth(L_2) >= 1/L_2 in the norm of the one, |R phi|^2 = L_1/3 + 1/L_1 in the other:"
    " measured in another body the norm of a trace exceeds the norm of its lift.  In the same body the infimum is at"
    " most one of its values.",
    goals=lambda form: form(y),
    forms={
        "printed": lambda lifted: at_most(lifted / 3 + 1 / lifted, 1 / t),
        "repaired": lambda lifted: at_most(lifted, lifted / (1 + p)),
    },
    mutants={"half the norm of the lift": lambda lifted: at_most(lifted / 2, lifted / (1 + p))},
)

check(
    id="4.8",
    text="m |R phi|^2 <= a(R phi, R phi) <= a(v, v) <= M |v|^2 for each v of that trace, and the infimum over v: the"
    " constant sqrt(M/m), in the norm of the lift's own body.",
    goals=lambda form: at_most(form**2 * y**2, M * y**2 / (m * (1 + p) * (1 + q) * (1 + r)), CONSTANTS),
    forms={"repaired": sp.sqrt(M / m)},
    mutants={"1": sp.Integer(1), "m/M": sp.sqrt(m / M)},
)

check(
    id="x-lift-bound",
    text="m |R phi|^2 <= a(R phi, R phi) <= a(v, v) <= M |v|^2 for every v with the trace phi: into the norm of its own"
    " body the lift has a constant of at most sqrt(M/m), and no theorem of Banach is needed.",
    goals=lambda form: at_most(form, M * y**2 / (m * (1 + p) * (1 + q) * (1 + r)), CONSTANTS),
    forms={"repaired": M / m * y**2},
    mutants={"m/M": m / M * y**2, "1": y**2},
)

check(
    id="prop-4.1.2",
    text="|R^b gamma v|_b^2 <= M/m |gamma v|^2 in the trace norm of body b by (4.8), that norm is at most C times the"
    " one of body a by (i), and the trace of v has a norm of at most |v|_a there.",
    goals=lambda form: at_most(form * y**2, M * C**2 * y**2 / (m * (1 + p) * (1 + q) * (1 + r)), CONSTANTS),
    forms={"printed": M / m * C**2},
    mutants={"without C": M / m, "without M/m": C**2, "C for C^2": M / m * C},
)

check(
    id="rem-4.3",
    text="|<g, v>| <= (M |u| + |L|) |R gamma v| <= (M |u| + |L|) C |v| by Proposition 4.1 (ii).",
    goals=lambda form: at_most(form, (M * o / (1 + p) + q) * (C * y / (1 + r)), CONSTANTS),
    forms={"printed": (M * o + q) * C * y},
    mutants={"without C": (M * o + q) * y, "without the load": M * o * C * y},
)

check(
    id="4.9.2",
    text="One node that sticks, u = u_2, |tau| <= b: tau w + b (|w| - j) >= 0 for all w needs j = 0, which is the jump"
    " |u - u_2| and not |u|.",
    one_case=True,
    goals=lambda form: [
        at_most((-b / (1 + p)) * o + b * (o - form), 0),  # w >= 0
        at_most((b / (1 + p)) * (-o) + b * (o - form), 0),  # w <= 0
    ],
    forms={"printed": positive("u_2"), "repaired": sp.Integer(0)},
    mutants={"half of it": positive("u_2") / 2},
)

check(
    id="4.9.3",
    text="Bar 1 with E u'' = -f: minus the end force on v is -a_1(u, v) + L_1(v), so that (III) is -theta sigma^1 n^1.",
    one_case=True,
    goals=lambda sign: equal(sign * _bar(-1)[1], -_bar(-1)[0]),
    forms={"printed": -1},
    mutants={"the sign": 1, "twice": -2},
)

old, image = sp.symbols("g Tg", real=True)

check(
    id="x-increment-test",
    text="g_n - g_(n-1) = theta (T g - g) with g = g_(n-1).  Where T g - h = -l (g - h) for the fixed point h, an"
    " increment of eps leaves g - h = eps/(theta (1+l)), 1/theta times what a residual of eps leaves.  In a unit of"
    " force 1/u times as large the increment is u times as large a number, and the quotient of residual and T g is what"
    " it was.",
    goals=lambda form: [
        equal(theta * image + (1 - theta) * old - old, form * (image - old)),
        equal((theta * (-o * y) + (1 - theta) * y) - y, -form * (1 + o) * y),
        equal(q * (theta * image + (1 - theta) * old - old), q * form * (image - old)),
        equal(q * (image - old) / (q * image), (image - old) / image),
    ],
    forms={"repaired": theta},
    mutants={"without theta": sp.Integer(1), "1 - theta": 1 - theta},
)

# --- Section 6 ------------------------------------------------------------------------------------------------------

E, nu = positive("E nu")
one_field, another, known = Vector("u2"), Vector("v2"), Vector("w")

check(
    id="sec-6.1",
    text="The law printed in 6.1 is that of plane strain: inverting e = ((1+nu) sigma - nu (1+nu) tr sigma I)/E gives"
    " lambda = E nu/((1-2nu)(1+nu)), 2 mu = E/(1+nu).  A displacement prescribed on Gamma_u leaves every difference of"
    " two solutions in V: the known part cancels.",
    goals=lambda form: [
        equal(_plane_strain(form[0] * E * nu / ((1 - 2 * nu) * (1 + nu)), E / (1 + nu)), exx),
        equal(a2((one_field + form[1] * known) - (another + known), test), a2(one_field - another, test)),
    ],
    forms={"repaired": (1, 1)},
    mutants={"lambda/2": (sp.Rational(1, 2), 1), "the known part in one of them": (1, 0)},
)


def _plane_strain(lam: Any, two_mu: Any) -> Any:
    trace = exx + eyy
    s_xx, s_yy = two_mu * exx + lam * trace, two_mu * eyy + lam * trace
    return ((1 + nu) * s_xx - nu * (1 + nu) * (s_xx + s_yy)) / E

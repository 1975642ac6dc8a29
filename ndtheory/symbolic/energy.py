"""The theorem in energy norms from its premises on, and what it is without friction: gradient descent.

``D`` is |d_1|^2 in the energy of body 1 and ``d1`` its root, ``e`` = |d_2| the norm (5.21) of psi - psi~, ``t`` that of
p = T psi - T psi~.
The Cauchy-Schwarz inequality of an inner product is used freely; its slack is a parameter.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory import energy_norms
from ndtheory.symbolic.engine import CheckList, Goal, Vector, at_most, equal, less, linear, nonnegative, positive
from ndtheory.symbolic.section5 import C0, any_theta
from ndtheory.symbolic.symbols import C_R, CONSTANTS, L1, L2, A, C_s, M, a1, a2, d1, e, k, m, o, p, psi, q, r, theta, y

CHECKS = CheckList()
check = CHECKS.add

rho, size = positive("rho E")
D, work = nonnegative("D Y")
kappa_1, kappa_2, root_rho, more = nonnegative("kappa_1 kappa_2 s e_")
ratio = positive("x")

# --- premises ---------------------------------------------------------------------------------------------------------

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

largest = root_rho + kappa_1 + more  # r, with kappa_2 = e_ (s + kappa_1 + e_): every kappa_2 >= 0 once
ENERGY = (root_rho**2, kappa_1, more * largest)

check(
    id="x-ratio",
    text="With |d_1| = x e: W <= -D + F <= (kappa_2 + kappa_1 x - x^2) e^2 = f(x) e^2 by (5.28), and W >= -t e >="
    " -sqrt(rho) x e^2.  So x^2 <= (sqrt(rho) + kappa_1) x + kappa_2, which no x above its positive root r satisfies;"
    " f(r) = -sqrt(rho) r.",
    goals=lambda form: [
        at_most(
            energy_norms.work(ratio, *ENERGY[1:]) * e**2,
            -(ratio**2) * e**2 + kappa_1 * ratio * e**2 + ENERGY[2] * e**2 - q - p,
        ),
        equal(
            energy_norms.work(ratio, *ENERGY[1:]) + root_rho * ratio,
            (root_rho + kappa_1) * ratio + ENERGY[2] - ratio**2,
        ),
        equal(energy_norms.largest_ratio(*ENERGY), form),
        less((root_rho + kappa_1) * (form + y) + ENERGY[2], (form + y) ** 2),
        equal(energy_norms.work(form, *ENERGY[1:]), -root_rho * form),
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
            + 2 * value * (1 - value) * (energy_norms.work(ratio, *ENERGY[1:]) - q) * e**2
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
r_ = s_ + kappa_1 + more
WHERE = (s_**2, kappa_1, more * r_)
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

check(
    id="x-energy-interval",
    text="The square at x is below 1 exactly where 2 (f - 1) + theta (1 - 2 f + rho x^2) < 0: linear in theta for each"
    " x, so that the good thetas form one interval.",
    goals=lambda form: equal(
        energy_norms.square_at(ratio, theta, root_rho**2, kappa_1, kappa_2) - 1, theta * form, {theta: any_theta}
    ),
    forms={
        "repaired": 2 * (energy_norms.work(ratio, kappa_1, kappa_2) - 1)
        + theta * (1 - 2 * energy_norms.work(ratio, kappa_1, kappa_2) + root_rho**2 * ratio**2)
    },
    mutants={"the factor 2 dropped": energy_norms.work(ratio, kappa_1, kappa_2) - 1 + theta * root_rho**2 * ratio**2},
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

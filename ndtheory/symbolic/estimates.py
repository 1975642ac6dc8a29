"""Lemma 5.3 and Propositions 5.4 and 5.5, (5.11) to (5.23), derived a second time.

Each inequality is proved from those before it: a quantity known to be at most b is written b/(1+p) or b - p with a free
parameter, so that what is proved holds for every value the premises allow.  Inner products enter through the
Cauchy-Schwarz inequality and the definitions of the constants alone; what is used is said in the text of each check.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory import bounds
from ndtheory.symbolic.engine import CheckList, Goal, Relation, Vector, equal, nonnegative
from ndtheory.symbolic.symbols import (
    C_R,
    CONSTANTS,
    L1,
    L2,
    ROOTS,
    A,
    C_s,
    C_tr,
    C_tr_half,
    F,
    M,
    X,
    a1,
    a2,
    at_most,
    d1,
    d2,
    delta1,
    delta2,
    e,
    k,
    lift,
    lift2,
    m,
    n,
    p,
    psi,
    psi2,
    q,
    r,
    test,
    tn,
    v1,
    v2,
    w1,
    w2,
    x,
    y,
)

CHECKS = CheckList()
check = CHECKS.add

# --- Lemma 5.3 ------------------------------------------------------------------------------------------------------

S, S2, J1, J2 = nonnegative("S S~ J J~")

check(
    id="5.12",
    text="The sum of (5.9) and (5.10) for the two test functions: elastic terms, loads, friction (S, S~ the bounds, J,"
    " J~ the sizes of the jumps), and that each test function has the jump of the other solution.",
    goals=lambda form: [
        equal(a1(w1, form[0] - w1) + a1(v1, form[1] - v1), -a1(delta1, delta1) + a1(delta1, lift(delta2))),
        equal(L1(form[0] - w1) + L1(form[1] - v1), 0),
        equal(S * (J2 - J1) + S2 * (J1 - J2), -(S - S2) * (J1 - J2)),
        # traces: R_D1 leaves the trace as it is; (v - w2) must be the jump of w~, (v~ - w~2) that of w
        *(
            equal(form[i].subs({lift(w2): w2, lift(v2): v2}) - old, new)
            for i, (old, new) in enumerate(((w2, v1 - v2), (v2, w1 - w2)))
        ),
    ],
    forms={"printed": (v1 - lift(v2) + lift(w2), w1 - lift(w2) + lift(v2))},
    mutants={
        "the lift with the other sign": (v1 + lift(v2) - lift(w2), w1 + lift(w2) - lift(v2)),
        "without the lift": (v1, w1),
    },
)

check(
    id="5.13",
    text="Cauchy-Schwarz: F <= k |S sigma_N - S sigma~_N| |[w_T] - [w~_T]|, with factors of at most C_s d_2 and"
    " C_tr (d_1 + d_2), both in L2(Gamma_c).",
    goals=lambda form: at_most(form, k * (C_s * d2 / (1 + p)) * (C_tr * (d1 + d2) / (1 + q)) - r, {}),
    forms={"repaired": k * C_s * C_tr * (d1 * d2 + d2**2)},
    mutants={"without d_2^2": k * C_s * C_tr * d1 * d2, "C_s for C_s C_tr": k * C_s * (d1 * d2 + d2**2) / (1 + C_tr)},
    units={
        "printed": Relation(F, "<=", k * C_s * C_tr_half * (d1 * d2 + d2**2)),
        "repaired": Relation(F, "<=", k * C_s * C_tr * (d1 * d2 + d2**2)),
    },
)

check(
    id="5.14",
    text="m d_1^2 <= a_1(d, d) <= M d_1 (C_R d_2) + F by (5.12), with (5.13) for F.",
    goals=lambda form: at_most(form, M * d1 * (C_R * d2 / (1 + p)) / (1 + q) + x * (d1 * d2 + d2**2) - r),
    forms={"printed": (A + x) * d1 * d2 + x * d2**2},
    mutants={"without C_R": (M + x) * d1 * d2 + x * d2**2, "without C_K d_2^2": (A + x) * d1 * d2},
    states=lambda form: Relation(m * d1**2, "<=", form),
)

check(
    id="5.15",
    text="(5.15) is (5.14) with the square completed.",
    goals=lambda form: equal(
        m * (d1 - form * d2) ** 2 - (m * form**2 + x) * d2**2, m * d1**2 - (A + x) * d1 * d2 - x * d2**2
    ),
    forms={"printed": (A + x) / (2 * m)},
    mutants={"the factor 1/2 dropped": (A + x) / m, "1/m dropped": (A + x) / 2},
    states=lambda form: Relation(m * (d1 - form * d2) ** 2, "<=", ((A + x) ** 2 / (4 * m) + x) * d2**2),
)

check(
    id="5.11",
    text="No d_1 above the bound satisfies (5.14): at d_1 = (bound + y) d_2, y > 0, its left side is the larger one.",
    goals=lambda form: Goal(relation=Relation((A + x) * (form + y) + x, "<", m * (form + y) ** 2), charts=(CONSTANTS,)),
    forms={"printed": X},
    mutants={
        "without the root": (A + x) / m,
        "1/m dropped under the root": (A + x) / m + sp.sqrt(x),
        "C_R dropped": (M + x) / m + sp.sqrt(x / m),
        "1/m dropped": A + x + sp.sqrt(x / m),
    },
    states=lambda form: Relation(d1, "<=", form * d2),
)

z = Vector("z")  # a field that vanishes on Gamma_c: v and v + z extend the same trace


def _stress(work: Any) -> Goal:
    """a(w, .) - L(.) takes one value at every extension of a trace, where a(w, z) is ``work``."""
    at = lambda extension: (a2(w2, extension) - L2(extension)).subs(a2(w2, z), work)
    return equal(at(test + z), at(test))


check(
    id="lemma-5.3",
    text="sigma_N(w2) is the functional a(w2, .) - L(.) on traces.  It takes one value at all extensions of a trace, v"
    " and v + z with z = 0 on Gamma_c, where a(w2, z) = L(z), as (5.6) has it; for any other w2 the value depends on"
    " the extension.",
    goals=_stress,
    forms={"step": a2(w2, z), "repaired": L2(z)},
    mutants={"the load with the other sign": -L2(z), "no load": sp.Integer(0)},
)

# --- Proposition 5.4 ------------------------------------------------------------------------------------------------

check(
    id="5.17",
    text="The definition of T for psi and psi~, subtracted: the loads cancel.",
    goals=lambda form: equal((-a1(w1, lift(test)) + L1(lift(test))) - (-a1(v1, lift(test)) + L1(lift(test))), form),
    forms={"printed": -a1(w1 - v1, lift(test))},
    mutants={"the sign": a1(w1 - v1, lift(test)), "without the lift": -a1(w1 - v1, test)},
)

check(
    id="5.18",
    text="|a_1(w1-w~1, R_D v)| <= M d_1 (C_R |v|), divided by |v|.",
    goals=lambda form: at_most(form, M * d1 * (C_R * y / (1 + p)) / (1 + q) / y),
    forms={"printed": A * d1},
    mutants={"C_R dropped": M * d1, "m for M": m * C_R * d1},
    states=lambda form: Relation(tn, "<=", form),
)

check(
    id="5.19",
    text="m d_2^2 <= a_2(w2-w~2, w2-w~2) = <psi-psi~, w2-w~2> <= n d_2, hence n = (1+p)(1+q) m d_2.",
    goals=lambda form: at_most(form.subs(n, (1 + p) * (1 + q) * m * d2), d2),
    forms={"printed": n / m},
    mutants={"1/m^2 for 1/m": n / m**2, "M for m": n / M},
    states=lambda form: Relation(d2, "<=", form),
)

check(
    id="5.16",
    text="C_T is the product of the constants of (5.18), (5.11) and (5.19).",
    goals=lambda form: equal(form, A * X / m, CONSTANTS),
    forms={"printed": bounds.lipschitz(m, M, C_R, x)},
    mutants={
        "C_R dropped": bounds.lipschitz(m, M, C_R, x) / C_R,
        "1/m for 1/m^2": bounds.lipschitz(m, M, C_R, x) * m,
        "the root of m dropped": A / m**2 * (A + x + sp.sqrt(x)),
    },
    states=lambda form: Relation(tn, "<=", form * n),
)

check(
    id="prop-5.4",
    text="|T psi - T psi~| <= A d_1, d_1 <= X d_2, d_2 <= n/m: the Lipschitz constant C_T.",
    goals=lambda form: at_most(form, A * X / (1 + p) * (n / m) / (1 + q) / (1 + r)),
    forms={"printed": bounds.lipschitz(m, M, C_R, x) * n},
    mutants={"m for M": bounds.lipschitz(m, m, C_R, x) * n},
    states=lambda form: Relation(tn, "<=", form),
)

# --- the norm (5.21) ------------------------------------------------------------------------------------------------

check(
    id="5.21",
    text="The norm comes from an inner product: R2 is linear, and a_2(R2 psi, R2 chi) obeys the law of"
    " parallelograms; it is definite, as e = 0 means R2 psi = 0.",
    goals=lambda form: equal(form(psi + psi2) + form(psi - psi2), 2 * form(psi) + 2 * form(psi2)),
    forms={"printed": lambda u: a2(lift2(u), lift2(u))},
    mutants={"around another force": lambda u: a2(lift2(u) + test, lift2(u) + test)},
)

check(
    id="5.22",
    text="z = R2 psi: m |z|^2 <= a_2(z, z) = e^2 = <psi, z> <= n |z|, hence e^2 <= n^2/m.",
    goals=lambda form: at_most((form**2).subs(n, m * y * (1 + p) * (1 + q)), m * y**2 * (1 + p)),
    forms={"printed": n / sp.sqrt(m)},
    mutants={"1/m for 1/sqrt(m)": n / m, "M for m": n / sp.sqrt(M)},
    states=lambda form: Relation(e, "<=", form),
)

check(
    id="5.23",
    text="n = sup a_2(z, v)/|v| <= M |z|, and m |z|^2 <= e^2.",
    goals=lambda form: at_most((form**2).subs(e, sp.sqrt(m * (1 + q)) * y), (M * y / (1 + p)) ** 2),
    forms={"printed": M / sp.sqrt(m) * e},
    mutants={"sqrt(m) dropped": M * e, "m for M": sp.sqrt(m) * e},
    states=lambda form: Relation(n, "<=", form),
)

check(
    id="x-root-M",
    text="Cauchy-Schwarz in a_2: a_2(z, v)^2 <= e^2 a_2(v, v) <= e^2 M |v|^2, so sqrt(M) suffices; and it is at most"
    " M/sqrt(m).",
    goals=lambda form: [at_most((form * e) ** 2, e**2 * M / (1 + p), ROOTS), at_most(M / sp.sqrt(m), form, ROOTS)],
    forms={"repaired": sp.sqrt(M)},
    mutants={"sqrt(m)": sp.sqrt(m), "M": M},
    states=lambda form: Relation(n, "<=", form * e),
)

check(
    id="prop-5.5",
    text="(5.22) and (5.23) together, and that the lower constant is at most the upper one.",
    goals=lambda form: at_most(form[1], form[0]),
    forms={"printed": (sp.sqrt(m), M / sp.sqrt(m))},
    mutants={"constants exchanged": (M / sp.sqrt(m), sp.sqrt(m))},
    states=lambda form: [Relation(form[0] * e, "<=", n), Relation(n, "<=", form[1] * e)],
)

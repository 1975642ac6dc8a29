"""One open node that slides: a problem small enough to solve, in which (5.30) to (5.36) fail as printed."""

from __future__ import annotations

from typing import Any

import sympy as sp

from ndtheory.symbolic.engine import Check, CheckList, nonnegative, positive
from ndtheory.symbolic.one_step import relaxed
from ndtheory.symbolic.symbols import C_R, A, F, M, P, W, at_most, e, m, mu, printed_P, t, t_, theta, x, xi

CHECKS = CheckList()
check = CHECKS.add

#: |||(T_theta psi) - (T_theta psi~)|||^2 in full, by (5.24).
expanded = theta**2 * t**2 + (1 - theta) ** 2 * e**2 + 2 * theta * (1 - theta) * W

kappa, lam = nonnegative("kappa"), positive("lambda")
#: One open node that slides under the friction of its own g_N: S_1 = S_2 = lambda I, the norm of R^2.  For
#: psi = (0, psi_N) step I gives w2 = psi/lambda; in step II friction moves body 1 by -kappa psi_N/lambda, and
#: T psi = (kappa psi_N, 0).
#: Hence F = kappa^2 e^2, t = kappa e, W = 0 with e^2 = psi_N^2/lambda.
ONE_NODE = {m: lam, M: 2 * lam, C_R: sp.Integer(1), x: kappa * lam, F: kappa**2 * e**2, t: kappa * e, W: sp.Integer(0)}


AT_THE_NODE = {lam: mu**2, kappa: xi**2, theta: t_ / (1 + t_)}


def one_node(id: str, value: Any, printed: Any, repaired: Any, chart: Any = AT_THE_NODE, more: str = "") -> Check:
    """The printed bound of a quantity is exceeded in the one-node problem: small m, much friction."""
    at_the_node = lambda expression: expression.xreplace(ONE_NODE)
    return Check(
        id=id,
        text="One open node that slides, S_1 = S_2 = m I, M = 2 m, C_R = 1, C_K = kappa m: exactly F = kappa^2 e^2,"
        f" t = kappa e, W = 0.{more}",
        goals=lambda form: at_most(at_the_node(form), at_the_node(value), chart),
        forms={"printed": printed, "repaired": repaired},
        mutants={"without friction": repaired.subs(x, 0)},
    )


CHECKS.append(one_node("5.30", F, printed_P(m) * e**2, P * e**2))
CHECKS.append(one_node("5.31", W, -(m**2) / A**2 * t**2 + printed_P(m) * e**2, -(m**2) / A**2 * t**2 + P * e**2))
for label in ("5.32", "5.33", "5.36"):
    CHECKS.append(one_node(label, expanded, relaxed(printed_P(m)), relaxed(P)))

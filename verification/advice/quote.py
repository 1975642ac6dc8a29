"""The reason for an advice in two sentences, for who asks in public."""

from __future__ import annotations

from typing import TYPE_CHECKING

from verification.advice.role import Role, in_steps

if TYPE_CHECKING:
    from verification.advice.roles import Advice


def reason(found: Advice) -> str:
    """rho in both roles, the theta that follows from it, and the steps of both.

    Raises
    ------
    ValueError
        As :attr:`verification.advice.roles.Advice.best`.
    """
    best, other = found.best, found.other
    tied = found.tied and best.ends is not None
    theta, rate = found.chosen(best)
    first = "" if found.assumes is None else f"Assumed: {found.assumes}. "
    first += f"rho (stiffness of contact body over Neumann body on the interface, at worst) is {_rho(best, tied)}"
    if found.neumann_body is not None:
        first += f" with body {found.neumann_body} as Neumann body"
    if other is not None:
        first += f", {_rho(other, tied)} with the roles exchanged"
    formula = "2/(2+rho)"
    if tied and best.rho_min is not None:
        formula = "2/(2+rho_min+rho)"
        first += f"; rho_min (at best) is {best.rho_min.value:.3g}"
    bound = "at most " * (tied or best.proved)
    then = f"So relax by {formula} = {theta:.3g}: {bound}{in_steps(rate)} to 1e-9"
    then += " if nothing opens or slips" if tied else " without friction" if best.proved else " are predicted"
    if other is not None:
        away = in_steps(found.chosen(other)[1]).removesuffix(" steps")
        then += ", the same with the roles exchanged" if found.no_difference else f", against {away}"
    return f"{first}. {then}."


def _rho(role: Role, tied: bool) -> str:
    rho = role.rho_tied if tied and role.rho_tied is not None else role.rho
    return "unknown" if rho is None else f"{rho.value:.3g}"

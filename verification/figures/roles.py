"""The figure of advice: the factor of one step over theta for each assignment of the roles."""

from __future__ import annotations

from matplotlib.figure import Figure

from ndtheory import EnergyConstants
from verification.coupling.roles import Advice
from verification.figures.factor import draw_factor
from verification.registry import draw


@draw.register
def _(result: Advice) -> Figure:
    """The factor of one step over theta, for each assignment of the roles."""
    if not result.roles:
        raise ValueError("several readings are left: make the run that `next` names")
    if result.moduli is not None:
        raise ValueError("moduli bound rho from below only: no factor of a step follows")
    named = {
        f"Neumann {result.words(role.neumann_body)}" if role.neumann_body else "that run": role for role in result.roles
    }
    energy = {
        name: role.energy or EnergyConstants(rho=role.rho.value) for name, role in named.items() if role.rho is not None
    }
    return draw_factor(energy)

"""The figure of advice: the factor of one step over theta for each assignment of the roles."""

from __future__ import annotations

from matplotlib.figure import Figure

from ndtheory import EnergyConstants
from verification.coupling.advice import Advice
from verification.figures.factor import draw_factor
from verification.registry import draw


@draw.register
def _(result: Advice) -> Figure:
    """The factor of one step over theta, for each assignment of the roles."""
    if result.why_no_theta:
        raise ValueError(result.why_no_theta)
    known = {
        f"Neumann {result.evidence.words(role.neumann_body)}" if role.neumann_body else "that run": role
        for role in result.roles
    }
    energy = {
        name: role.energy or EnergyConstants(rho=role.rho.value) for name, role in known.items() if role.rho is not None
    }
    return draw_factor(energy)

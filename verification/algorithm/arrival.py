"""Arrival of the state at the end of a run: its distance from contact, measured in its own traction.

The joined state at g consists of both displacements, u2 from step I and u1 from step II, and of g itself as the
traction between the bodies.  A residual ``|||T g - g|||`` that is small beside the first step does not bound it: with
a contact body much stiffer than the other one the first step throws the bodies apart, and g then decays with every
node open.
"""

from __future__ import annotations

import math

import numpy as np

from verification.algorithm.iterate import Iterate
from verification.interface.pair import ContactPair

#: A run has not arrived while its coupled residual is above both the first number and its tolerance times the second:
#: a tenth of the traction is more than the step ratios of a converging run leave in any one condition.
MOST, TOLERANCES = 0.1, 10.0

#: The reason for a missing coupled residual.
NO_FORCE = "no force acts between the bodies at the end"


def coupled_residual(pair: ContactPair, iterate: Iterate) -> float | None:
    """Return the largest violation of a contact condition by the joined state at g, relative to g, in the norm (5.21).

    The conditions are those of (2.4) and (2.6) on the contact nodes, with the pattern of step II (an open node carries
    no pressure, no node pulls, friction stays within its bound), and the equilibrium of the contact body under g.  The
    others hold by construction: step I balances the Neumann body with g, and step II lets nothing penetrate.  Each
    violation is a nodal force, of which the norm is taken.

    Returns
    -------
    float or None
        None without a force: g is 0, or within the tolerance of 0 beside the scale of the iterate.

    Notes
    -----
    On grids that differ the traction of g on the contact grid is the reaction of step II and the difference g - T g,
    carried there as a stress; at a fixed point it is the reaction itself.
    """
    violation, size = _violation(pair, iterate)
    return None if size <= pair.settings.tolerance * iterate.scale else violation / size


def _violation(pair: ContactPair, iterate: Iterate) -> tuple[float, float]:
    """Return the largest violation of a contact condition by the joined state at g, and the size of g."""
    neumann, grid = pair.neumann, pair.contact.grid
    off = iterate.g - iterate.image
    force = iterate.contact.force + pair.interface.spread(off)
    pressure, touching = force[grid.normal], iterate.contact.pattern.touching
    parts = np.zeros((grid.size, 3))
    parts[grid.normal, 0] = np.where(touching, 0.0, pressure)
    parts[grid.normal, 1] = np.where(touching, np.minimum(pressure, 0.0), 0.0)
    if grid.t:
        shear = force[grid.tangential]
        bound = pair.bound(iterate.g)
        parts[grid.tangential, 2] = shear - np.clip(shear, -bound, bound)
    forces = np.column_stack([pair.interface.carry_back(parts), off, iterate.g])
    squares = np.maximum(np.einsum("ij,ij->j", forces, neumann.flexibility(forces)), 0.0)
    return math.sqrt(float(squares[:-1].max())), math.sqrt(float(squares[-1]))


def arrived(pair: ContactPair, iterate: Iterate) -> bool:
    """Return True if the joined state at g meets the conditions of contact as closely as a run must end.

    Forces within the tolerance of 0 beside the scale of the iterate are none.
    """
    tolerance = pair.settings.tolerance
    violation, size = _violation(pair, iterate)
    return min(violation, size) <= tolerance * iterate.scale or violation <= max(MOST, TOLERANCES * tolerance) * size

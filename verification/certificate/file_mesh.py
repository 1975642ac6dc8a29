"""rho on the mesh of a problem file, to be shown beside the bound for the continuum.

The continuum does not have the waves that are as short as the cells.  Their ratio of stiffnesses may be larger, also on
finer meshes of such cells, and then a theta that is proved to contract in the continuum does not contract on the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ndtheory import EnergyConstants, Number, evaluate_energy
from verification.constants.pencils import of_energy
from verification.interface.pair import pair_from
from verification.problem import Problem, ProblemError
from verification.progress import Progress, silent
from verification.threads import one_thread

#: Cells along Gamma_c, and of both bodies, up to which rho is computed: a few seconds.
MOST_ALONG, MOST_CELLS = 320, 30_000

#: Why no theta is judged.
NO_THETA = "the file gives no theta, and none is proved in the continuum"


@dataclass(frozen=True, kw_only=True)
class FileMesh:
    """The constants in energy norms of the mesh of a file, in doubles.

    Attributes
    ----------
    interface_nodes : int or None
        Contact nodes.
    energy : EnergyConstants or None
        None where they were not computed.
    why : str
        Why not; empty where they were.
    """

    interface_nodes: int | None
    energy: EnergyConstants | None
    why: str = ""

    @property
    def theta_limit(self) -> float | None:
        """``2/(1 + rho)``, with rho_normal without friction: where all of Gamma_c sticks no larger theta contracts."""
        return None if self.energy is None else float(2 / (1 + self.energy.at_work))

    def contracts(self, theta: float | None) -> bool | None:
        """True if one step contracts at a theta; None where neither the limit nor the bound in energy norms decides."""
        if self.energy is None or self.theta_limit is None or theta is None:
            return None
        if theta >= self.theta_limit:
            return False
        return True if evaluate_energy(self.energy, theta).verdict == "contraction" else None

    def to_dict(self, theta: float | None) -> dict[str, Any]:
        """The object ``mesh`` of the document."""
        contracts, numbers = self.contracts(theta), ("rho", "rho_normal")
        reason = dict.fromkeys(("interface_nodes", *numbers, "theta_limit"), self.why) if self.energy is None else {}
        if contracts is None:
            undecided = "theta is below the limit, and the bound in energy norms does not prove contraction there"
            reason["contracts"] = self.why or (undecided if theta is not None else NO_THETA)
        return {
            "interface_nodes": self.interface_nodes,
            **{name: self.number(name) for name in numbers},
            "theta_limit": self.theta_limit,
            "theta": theta,
            "contracts": contracts,
            "reason": reason | ({} if theta is not None else {"theta": NO_THETA}),
        }

    def number(self, name: str) -> dict[str, Any] | None:
        """``rho`` or ``rho_normal`` of the mesh with its level."""
        value = None if self.energy is None else getattr(self.energy, name)
        return None if value is None else Number.of_float(float(value)).to_dict()


def file_mesh(problem: Problem, progress: Progress = silent) -> FileMesh:
    """Condense the two rectangles of a problem on their meshes and find rho.

    Parameters
    ----------
    problem : Problem
        Of two rectangles, each held only at its outer side.
    progress : callable
    """
    cells = [body.cells or () for body in (problem.body1, problem.body2)]
    if max(max(own) for own in cells) > MOST_ALONG or sum(int(np.prod(own)) for own in cells) > MOST_CELLS:
        needed = f"up to {MOST_ALONG} cells along a side and {MOST_CELLS} in all"
        why = f"not computed beside a bound for the continuum: {needed} are; `ndtheory constants` finds rho"
        return FileMesh(interface_nodes=None, energy=None, why=why)
    progress("measuring rho on the mesh of the file", None)
    try:
        with one_thread():
            pair = pair_from(problem)
            grid = pair.contact.grid
            found = of_energy(pair, np.arange(grid.size) < grid.t)
    except ProblemError as error:
        return FileMesh(interface_nodes=None, energy=None, why=f"the meshes are refused: {error}")
    rho, rho_normal, k = found["rho_max"], found["rho_normal"], pair.friction
    assert rho is not None
    assert rho_normal is not None
    kappas = {}
    if k:
        C_s, C_t1, C_t2 = (Fraction(found[name] or 0.0) for name in ("C_s_energy", "C_t1", "C_t2"))
        kappas = {"kappa_1": k * C_s * C_t1, "kappa_2": k * C_s * C_t2}
    # equal up to rounding where nothing slides
    energy = EnergyConstants(rho=rho, rho_normal=min(rho_normal, rho), **kappas)
    return FileMesh(interface_nodes=grid.n, energy=energy)

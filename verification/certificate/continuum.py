"""The theorem in energy norms for the bodies of a problem file themselves, not for a mesh.

The mesh of the file enters no bound; its rho is shown beside the continuum's.  The continuum does not have the waves
that are as short as the cells.  Their ratio of stiffnesses may be larger, also on finer meshes of such cells, and then
a theta that is proved to contract in the continuum does not contract on the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from ndtheory import EnergyBounds, EnergyConstants, Number, evaluate_energy
from ndtheory.continuum.intervals import Interval
from ndtheory.continuum.rectangles import (
    ContinuumConstants,
    Rectangle,
    TwoRectangles,
    continuum_constants,
    friction_threshold,
    lower,
    statement,
    upper,
)
from ndtheory.moduli import half_planes
from verification.certificate.calibrating import for_cut_off, for_traces
from verification.constants.cells import OfCells, rho_of_cells
from verification.constants.measuring import of_energy
from verification.document import Document
from verification.interface.pair import pair_from
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.problem import Problem, ProblemError

#: Radius of the kernel without friction, where C_s plays no part.
ANY_RADIUS = Fraction(1)

#: Claims that no number here makes.
NOT_CLAIMED = (
    "contraction on a mesh, which may need a smaller theta however fine it is; the local Coulomb law, other"
    " kernels than the hat, unloading, rounding and discretisation errors of a run; that the iteration diverges at a"
    " larger friction or theta"
)


#: Cells along Gamma_c, and of both bodies, up to which rho is computed: a few seconds.
MOST_ALONG, MOST_CELLS = 320, 30_000

#: Why no theta is judged on the mesh.
NO_THETA = "the file gives no theta, and none is proved in the continuum"


@dataclass(frozen=True, kw_only=True)
class FileMesh:
    """Contact nodes and constants in energy norms of the mesh of a file, in doubles; ``why`` they were not computed.

    ``cells`` has rho of half-planes of its cells, once halved.
    """

    interface_nodes: int | None
    energy: EnergyConstants | None
    cells: OfCells
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
        of_cells, none = self.cells.objects()
        return {
            "interface_nodes": self.interface_nodes,
            **{name: self.number(name) for name in numbers},
            **of_cells,
            "theta_limit": self.theta_limit,
            "theta": theta,
            "contracts": contracts,
            "reason": reason | none | ({} if theta is not None else {"theta": NO_THETA}),
        }

    def number(self, name: str) -> dict[str, Any] | None:
        """``rho`` or ``rho_normal`` of the mesh with its level."""
        value = None if self.energy is None else getattr(self.energy, name)
        return None if value is None else Number.of_float(float(value)).to_dict()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContinuumCertificate(Document):
    """Bounds that are guaranteed for the continuum.

    ``energy`` is the theorem for the upper bounds of the constants, None where rho is not bounded; ``mesh`` is rho on
    the mesh of the file, in doubles, which may be larger than the continuum's.
    """

    schema: ClassVar[str] = "ndtheory.certificate/1"

    problem: Problem
    constants: ContinuumConstants
    energy: EnergyBounds | None
    mesh: FileMesh

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return dict(self.problem.units)

    @property
    def friction(self) -> Fraction:
        """k."""
        return self.problem.contact.friction

    @property
    def contracts(self) -> bool:
        """True if contraction is proved at the theta of the file; with ``auto`` at some theta."""
        if self.energy is None:
            return False
        return self.energy.interval is not None if self.energy.theta is None else self.energy.verdict == "contraction"

    @property
    def theta_judged(self) -> float | None:
        """The theta of the file; with ``auto`` the best one that is proved, None where there is none."""
        theta = self.problem.iteration.theta
        if theta != "auto":
            return float(theta)
        return None if self.energy is None else self.energy.theta_proved

    @property
    def solvable(self) -> bool:
        """True if every small theta is proved to contract, so that (P1) has exactly one solution."""
        threshold = friction_threshold(self.constants).lo
        assert threshold is not None
        return self.friction < Fraction(threshold)

    @property
    def _interval(self) -> list[float] | None:
        if self.energy is None or self.energy.interval is None or self.energy.theta_max_proved is None:
            return None
        lo, hi = self.energy.interval[0], self.energy.theta_max_proved.lo
        return None if hi is None else [math.nextafter(lo, 1.0) if lo else lo, hi]

    @property
    def summary(self) -> str:
        said = friction_threshold(self.constants)
        return f"{self.problem.title}, continuum: every small theta contracts for k < {said.lo:.4g}"

    def content(self) -> dict[str, Any]:
        c, k, energy = self.constants, self.friction, self.energy
        limit = None if energy is None or energy.friction_limit_multiple is None else energy.friction_limit_multiple.lo
        reason = dict(c.reason)
        if energy is None:
            reason |= dict.fromkeys(OF_ENERGY, c.reason.get("rho", ""))
        else:
            none = {name: why for name, why in energy.reason.items() if name in OF_ENERGY}
            reason |= none | ({"friction_limit": "no friction"} if limit is None else {})
        at_most = lambda value: None if value is None else upper(Fraction(value)).to_dict()
        at_least = lambda value: None if value is None else lower(Fraction(value)).to_dict()
        end = lambda name, side: getattr(getattr(energy, name, None), side, None)
        uppers = {name: getattr(c, name) for name in ("strips", "cut_off", "rho", "rho_normal")}
        for name in ("C_s", "C_t1", "C_t2"):
            uppers[name] = Interval.of(getattr(c, f"{name}_square")).sqrt().hi
        uppers["kappa_1"], uppers["kappa_2"] = c.kappa(k)
        order = 1 if self.problem.contact_body == 1 else -1  # the contact body first
        bodies = (self.problem.body1, self.problem.body2)[::order]
        return {
            "kind": "continuum",
            "constants": {
                **{name: at_most(value) for name, value in uppers.items()},
                "K": [str(value) for value in c.K],
                "rho_least": at_least(half_planes(*(body.moduli for body in bodies)).high),
                "rho_ends": at_least(c.rho_ends),
            },
            "friction": float(k),
            "friction_threshold": friction_threshold(c).to_dict(),
            "friction_limit": None if limit is None else at_least(k * Fraction(limit)),
            "theta": None if energy is None else energy.theta,
            "solvable": self.solvable,
            "interval": self._interval,
            "theta_max_proved": at_least(end("theta_max_proved", "lo")),
            "theta_proved": None if energy is None else energy.theta_proved,
            "factor_proved": at_most(end("factor_proved", "hi")),
            "factor": at_most(end("factor", "hi")),
            "verdict": "contraction" if self.contracts else "no conclusion",
            "mesh": self.mesh.to_dict(self.theta_judged),
            "not_claimed": NOT_CLAIMED,
            "reason": reason,
        }


#: Keys of the document that need a bound of rho.
OF_ENERGY = ("interval", "theta_max_proved", "theta_proved", "factor_proved", "factor", "theta", "friction_limit")


def two_rectangles(problem: Problem) -> TwoRectangles:
    """The bodies of a problem to which the theory of the continuum applies.

    Raises
    ------
    ProblemError
        Naming the key to which it does not apply.
    """

    def refuse(key: str, value: Any, needed: str) -> ProblemError:
        return ProblemError(problem.source, key, value, f"{needed} (for the continuum)")

    if problem.dimension != 2:
        raise refuse("dimension", problem.dimension, "needed 2")
    law, friction = problem.contact.law, problem.contact.friction
    if friction and law != "nonlocal":
        raise refuse("contact.law", law, 'needed "nonlocal": the theorem does not apply to the local law')
    if problem.several:
        raise refuse("contact", None, "needed one table [contact], and two bodies")
    if problem.contact.surface is not None:
        raise refuse("contact.surface", list(problem.contact.surface), "needed an interval, or neither key")
    found = {}
    for name, outer in (("body1", "bottom"), ("body2", "top")):
        body = getattr(problem, name)
        if body.shape != "rectangle":
            raise refuse(f"{name}.shape", body.shape, 'needed "rectangle"')
        held = {*body.fixed, *body.prescribed}
        if held != {outer}:
            raise refuse(f"{name}.fixed", sorted(held), f'needed a body held at "{outer}" only, fixed or prescribed')
        if None in body.prescribed.get(outer, ()):
            raise refuse(f"{name}.prescribed.{outer}", "free", "needed both components")
        found[name] = Rectangle(left=body.x[0], right=body.x[1], thickness=body.y[1] - body.y[0], body=body.moduli)
    lower_body, upper_body = found["body1"], found["body2"]
    overlap = (max(lower_body.left, upper_body.left), min(lower_body.right, upper_body.right))
    contact, neumann = (upper_body, lower_body) if problem.contact_body == 2 else (lower_body, upper_body)
    return TwoRectangles(
        contact=contact,
        neumann=neumann,
        interval=problem.contact.interval or overlap,
        radius=problem.contact.radius or ANY_RADIUS,
    )


def bounded(model: TwoRectangles) -> ContinuumConstants:
    """The constants of two rectangles, with calibrations from a solver where these are better than closed forms."""
    proofs = []
    for body in (model.contact, model.neumann):
        at, kappa = body.in_thicknesses(model.interval), body.body.kappa
        found = [for_traces(*at, kappa)]
        if body is model.neumann and min(model.margins) > 0:
            found.append(for_cut_off(*at, kappa))
        proofs.append([proof for proof in found if proof is not None])
    return continuum_constants(model, contact=proofs[0], neumann=proofs[1])


def certify_continuum(problem: Problem, progress: Progress = silent) -> ContinuumCertificate:
    """Prove contraction for two rectangles in the continuum.

    Parameters
    ----------
    problem : Problem
        Two rectangles held only at their outer sides, with the non-local law.  Its mesh enters no bound.
    progress : Progress

    Returns
    -------
    ContinuumCertificate
        For the theta of the problem; where that is ``auto`` for no single theta.

    Raises
    ------
    ProblemError
        The theory does not apply to these bodies.
    """
    model, theta = two_rectangles(problem), problem.iteration.theta
    progress("bounding the constants of the continuum", None)
    constants = bounded(model)
    energy = statement(constants, friction=problem.contact.friction, theta=None if theta == "auto" else theta)
    mesh = file_mesh(problem, progress)
    return ContinuumCertificate(problem=problem, constants=constants, energy=energy, mesh=mesh)


def file_mesh(problem: Problem, progress: Progress = silent) -> FileMesh:
    """Condense the two rectangles of a problem on their meshes, each held only at its outer side, and find rho."""
    counts, cells = [body.cells or () for body in (problem.body1, problem.body2)], rho_of_cells(problem)
    if max(max(own) for own in counts) > MOST_ALONG or sum(int(np.prod(own)) for own in counts) > MOST_CELLS:
        needed = f"up to {MOST_ALONG} cells along a side and {MOST_CELLS} in all"
        why = f"not computed beside a bound for the continuum: {needed} are; `ndtheory constants` finds rho"
        return FileMesh(interface_nodes=None, energy=None, cells=cells, why=why)
    progress("measuring rho on the mesh of the file", None)
    try:
        with one_thread():
            pair = pair_from(problem)
            grid = pair.contact.grid
            found = of_energy(pair, np.arange(grid.size) < grid.t)
    except ProblemError as error:
        return FileMesh(interface_nodes=None, energy=None, cells=cells, why=f"the meshes are refused: {error}")
    rho, rho_normal, k = found["rho_max"], found["rho_normal"], pair.friction
    assert rho is not None
    assert rho_normal is not None
    kappas = {}
    if k:
        C_s, C_t1, C_t2 = (Fraction(found[name] or 0.0) for name in ("C_s_energy", "C_t1", "C_t2"))
        kappas = {"kappa_1": k * C_s * C_t1, "kappa_2": k * C_s * C_t2}
    # equal up to rounding where nothing slides
    energy = EnergyConstants(rho=rho, rho_normal=min(rho_normal, rho), **kappas)
    return FileMesh(interface_nodes=grid.n, energy=energy, cells=cells)

"""The theorem in energy norms, and the one in a norm that the proof chooses, for the bodies of a problem file.

The mesh of the file enters no bound; its rho is shown beside the continuum's.  The continuum does not have the waves
that are as short as the cells.  Their ratio of stiffnesses may be larger, also on finer meshes of such cells, and then
a theta that is proved to contract in the continuum does not contract on the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from ndtheory import EnergyBounds, EnergyConstants, Number, evaluate_energy
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
from ndtheory.keys import Part, key
from ndtheory.moduli import half_planes
from verification.certificate.calibrating import for_cut_off, for_traces
from verification.constants.cells import rho_of_cells
from verification.constants.measuring import of_energy
from verification.document import Document
from verification.free_norm.rectangles import RectangleNorm, rectangle_norm
from verification.interface.pair import pair_from
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.problem import Problem, ProblemError
from verification.registry import LAWS

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

#: What keys share that are null together.
MESH: dict[str, Any] = {"default": None, "why": lambda mesh: mesh.why}
MEASURED = MESH | {"null": "where `mesh.interface_nodes` is"}
OF_CELLS = MEASURED | {"null": "where the grids have no ratio that is done", "why": lambda mesh: mesh.why_no_cells}
IF_INTERVAL: dict[str, Any] = {"null": "where `interval` is"}


@dataclass(frozen=True, kw_only=True)
class FileMesh(Part):
    """The mesh of a file, in doubles; ``why`` it was not measured, and ``why_no_cells``."""

    interface_nodes: int | None = key(
        "contact nodes of the file's mesh", unit="", null="where it is too fine for a quick answer, or refused", **MESH
    )
    rho: Number | None = key(r"$\rho$ of the file's mesh", **MEASURED)
    rho_normal: Number | None = key(r"$\rho_N$ of the file's mesh", **MEASURED)
    rho_cells: Number | None = key(
        "lower bound of the limit of `mesh.rho` on finer meshes of such cells, as in the constants", **OF_CELLS
    )
    rho_normal_cells: Number | None = key("the same of `mesh.rho_normal`", **OF_CELLS)
    theta_limit: float | None = key(
        r"$2/(1+\rho)$ of the mesh, with $\rho_N$ without friction: where all of $\Gamma_c$ sticks no $\theta$ from"
        " there on contracts",
        **MEASURED,
    )
    theta: float | None = key(
        r"the file's $\theta$, with `auto` `theta_proved`, or else `free_norm.theta_best`",
        null="where there is none",
        why="the file gives no theta, and none is proved in the continuum",
    )
    contracts: bool | None = key(
        "whether one step contracts on the mesh at `mesh.theta`",
        default=None,
        null="where neither `mesh.theta_limit` nor the bound in energy norms of the mesh decides",
        why=lambda mesh: mesh.why or mesh.why_undecided,
    )
    why: str = ""
    why_no_cells: str = ""

    @property
    def why_undecided(self) -> str:
        """Why it is not known whether one step contracts."""
        if self.theta is None:
            return "the file gives no theta, and none is proved in the continuum"
        return "theta is below the limit, and the bound in energy norms does not prove contraction there"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContinuumCertificate(Document):
    """Bounds that are guaranteed for the continuum.

    ``energy`` is the theorem for the upper bounds of the constants, None where rho is not bounded; ``free_norm`` has
    the numbers of the circle criterion for two rectangles.
    """

    schema: ClassVar[str] = "ndtheory.certificate/1"
    kind: ClassVar[str] = "continuum"

    problem: Problem
    energy: EnergyBounds | None
    constants: ContinuumConstants = key()
    rho_least: Number = key("at least: the bound from half-planes", name="constants.rho_least")
    kappa_1: Number = key("at most, at the file's friction", name="constants.kappa_1")
    kappa_2: Number = key("at most, at the file's friction", name="constants.kappa_2")
    friction: float = key("$k$, the largest one where it varies")
    friction_threshold: Number = key(r"at least: every small $\theta$ contracts for smaller $k$")
    friction_limit: Number | None = key(
        r"at least: some $\theta$ contracts for smaller $k$", null=r"without friction or without a bound of $\rho$"
    )
    solvable: bool = key("whether (P1) is proved to have exactly one solution")
    interval: list[float] | None = key(r"every $\theta$ inside contracts", null="where none is proved to")
    theta_max_proved: Number | None = key("its upper end, at least", **IF_INTERVAL)
    theta_proved: float | None = key(r"the $\theta$ with the least proved factor", **IF_INTERVAL)
    factor_proved: Number | None = key("the factor there, at most", **IF_INTERVAL)
    theta: float | None = key("the theta of the file", null=r"for `auto` and without a bound of $\rho$")
    factor: Number | None = key("the factor at `theta`, at most", null="where `theta` is, or lies outside `interval`")
    verdict: str = key(
        r"`contraction` where it is proved at the file's $\theta$, with `auto` at some $\theta$, in energy norms or in"
        " the free norm; else `no conclusion`; for the continuum"
    )
    free_norm: RectangleNorm = key("in a norm that the proof chooses")
    mesh: FileMesh = key("the mesh of the file, whose rho may be larger than the continuum's")
    not_claimed: str = key("what the numbers do not claim", default=NOT_CLAIMED)

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        return dict(self.problem.units)

    @property
    def contracts(self) -> bool:
        """True if contraction is proved at the theta of the file; with ``auto`` at some theta."""
        return self.verdict == "contraction"

    @property
    def reason(self) -> dict[str, str]:
        """Why keys are null."""
        none = self.constants.reason
        if self.energy is None:
            return none | dict.fromkeys(OF_ENERGY, none.get("rho", ""))
        none = none | {name: why for name, why in self.energy.to_dict()["reason"].items() if name in OF_ENERGY}
        return none if self.friction_limit else none | {"friction_limit": "no friction"}

    @property
    def summary(self) -> str:
        return f"{self.problem.title}, continuum: every small theta contracts for k < {self.friction_threshold.lo:.4g}"


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
    if friction and LAWS[law].outside:
        raise refuse("contact.law", law, f'needed "nonlocal": the theorem does not apply to the {LAWS[law].label} law')
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
    model, given, k = two_rectangles(problem), problem.iteration.theta, problem.contact.friction
    progress("bounding the constants of the continuum", None)
    constants = bounded(model)
    energy = statement(constants, friction=k, theta=None if given == "auto" else given)
    progress("proving contraction in a norm that the proof chooses", None)
    free = rectangle_norm(model, constants, k, None if given == "auto" else Fraction(given))
    threshold, kappas = friction_threshold(constants), constants.kappa(k)
    assert threshold.lo is not None
    small = max(number.lo or 0.0 for number in (threshold, free.friction_threshold) if number)
    inside = None if energy is None else energy.interval
    theta = None if energy is None else energy.theta
    proved = inside is not None if energy is None or theta is None else energy.verdict == "contraction"
    most = free.theta_max.value if free.theta_max else 0.0  # every theta up to it contracts
    proved = proved or (bool(most) if given == "auto" else given <= most or free.factor is not None)
    best = None if energy is None else energy.theta_proved

    def end(name: str, of: Callable[[Fraction], Number], side: str, times: Fraction = Fraction(1)) -> Number | None:
        value = getattr(getattr(energy, name, None), side, None)
        return None if value is None else of(times * Fraction(value))

    highest = end("theta_max_proved", lower, "lo")
    return ContinuumCertificate(
        problem=problem,
        energy=energy,
        constants=constants,
        rho_least=lower(half_planes(model.contact.body, model.neumann.body).high),
        kappa_1=upper(kappas[0]),
        kappa_2=upper(kappas[1]),
        friction=float(k),
        friction_threshold=threshold,
        friction_limit=end("friction_limit_multiple", lower, "lo", k),
        solvable=k < Fraction(small),
        interval=[math.nextafter(inside[0], 1.0) if inside[0] else 0.0, highest.value] if inside and highest else None,
        theta_max_proved=highest,
        theta_proved=best,
        factor_proved=end("factor_proved", upper, "hi"),
        theta=theta,
        factor=end("factor", upper, "hi"),
        verdict="contraction" if proved else "no conclusion",
        free_norm=free,
        mesh=file_mesh(problem, (best or free.theta_best) if given == "auto" else float(given), progress),
    )


def file_mesh(problem: Problem, theta: float | None, progress: Progress = silent) -> FileMesh:
    """Condense the two rectangles of a problem on their meshes, each held only at its outer side, and find rho."""
    counts, cells = [body.cells or () for body in (problem.body1, problem.body2)], rho_of_cells(problem)
    rho_cells, rho_normal_cells = (cells.numbers.get(name) for name in ("rho_cells", "rho_normal_cells"))
    mesh = FileMesh(theta=theta, rho_cells=rho_cells, rho_normal_cells=rho_normal_cells, why_no_cells=cells.why)
    if max(max(own) for own in counts) > MOST_ALONG or sum(int(np.prod(own)) for own in counts) > MOST_CELLS:
        needed = f"up to {MOST_ALONG} cells along a side and {MOST_CELLS} in all"
        why = f"not computed beside a bound for the continuum: {needed} are; `ndtheory constants` finds rho"
        return replace(mesh, why=why)
    progress("measuring rho on the mesh of the file", None)
    try:
        with one_thread():
            pair = pair_from(problem)
            grid = pair.contact.grid
            found = of_energy(pair, np.arange(grid.size) < grid.t)
    except ProblemError as error:
        return replace(mesh, why=f"the meshes are refused: {error}")
    rho, rho_normal, k = found["rho_max"], found["rho_normal"], pair.friction
    assert rho is not None
    assert rho_normal is not None
    kappas = {}
    if k:
        C_s, C_t1, C_t2 = (Fraction(found[name] or 0.0) for name in ("C_s_energy", "C_t1", "C_t2"))
        kappas = {"kappa_1": k * C_s * C_t1, "kappa_2": k * C_s * C_t2}
    # equal up to rounding where nothing slides
    energy = EnergyConstants(rho=rho, rho_normal=min(rho_normal, rho), **kappas)
    limit, contracts = float(2 / (1 + energy.at_work)), None
    if theta is not None and theta >= limit:
        contracts = False
    elif theta is not None and evaluate_energy(energy, theta).verdict == "contraction":
        contracts = True
    return replace(
        mesh,
        interface_nodes=grid.n,
        rho=Number.of_float(float(energy.rho)),
        rho_normal=Number.of_float(float(min(rho_normal, rho))),
        theta_limit=limit,
        contracts=contracts,
    )

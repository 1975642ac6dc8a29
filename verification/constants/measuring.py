"""The paper's constants, measured on the mesh as extremal generalised eigenvalues."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ndtheory import Number
from verification.constants.measured import ENERGY_NAMES, FROM_MATRICES, NAMES, OF_MESHES, SLIDES, Measured
from verification.constants.of_body import constants_of
from verification.constants.operators import Pencils, needs_matrices, pair_or_bodies
from verification.constants.pencils import of_energy, of_section_5
from verification.constants.proved import verify
from verification.interface.assembly import TwoBodies
from verification.interface.pair import ContactPair
from verification.problem import Problem
from verification.progress import Progress, silent
from verification.threads import one_thread


def measure(
    problem: Problem | ContactPair | Path | str, *, refine: int = 0, verified: bool = False, progress: Progress = silent
) -> Measured:
    """Measure the constants of a problem.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    refine : int
        With N > 0 the result lists the constants on meshes halved 0 to N times.
    verified : bool
        Whether to prove bounds of each constant, for the exact data of the problem: then its level is ``verified``.
    progress : callable
        Told which mesh is measured.

    Returns
    -------
    Measured

    Raises
    ------
    ProblemError
        A problem that has no bodies facing each other.
    ValueError
        A pair made from matrices has no mesh to halve.
    KeyboardInterrupt
        Before the given mesh was measured; later it ends the list, and ``reason["levels"]`` says so.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(3, 2))
    >>> round(measure(bars).rho_max.value, 12)
    1.5
    """
    pair = pair_or_bodies(problem)
    progress("measuring the constants", None)
    with one_thread():
        finer = [] if not refine else _halved(pair, refine)  # refused before any is measured
        result = _measure(pair, progress, verified)
        if refine:
            levels, reason = [result], dict(result.reason)
            try:
                for halvings, halved in enumerate(finer, 1):
                    progress(f"measuring the constants, {halvings} of {refine} halvings", (halvings - 1) / refine)
                    levels.append(_measure(pair_or_bodies(halved), progress, verified))
            except KeyboardInterrupt:
                reason["levels"] = f"interrupted after {len(levels) - 1} of {refine} halvings"
            result = replace(result, levels=tuple(levels), reason=reason)
    return result


def _halved(pair: ContactPair | TwoBodies, refine: int) -> list[Problem]:
    if pair.problem is None:
        raise ValueError("this pair is made from matrices: needed a problem whose meshes can be halved")
    return [pair.problem.refined(level) for level in range(1, refine + 1)]


def _measure(pair: ContactPair | TwoBodies, progress: Progress, verified: bool) -> Measured:
    plain = _without_matrices(pair, progress) if isinstance(pair, TwoBodies) else _with_matrices(pair)
    if not verified:
        return plain
    return verify(plain, pair, progress=progress)


def _with_matrices(pair: ContactPair) -> Measured:
    friction = float(pair.friction)
    values: dict[str, float | None] = dict.fromkeys((*NAMES, *ENERGY_NAMES))
    reason: dict[str, str] = {}
    body1 = body2 = None
    meshes = pair.contact.body is not None
    if not meshes:
        reason = dict.fromkeys(OF_MESHES, FROM_MATRICES)
    else:
        body1, body2 = constants_of(pair.body1.mesh_body), constants_of(pair.body2.mesh_body)
        values |= {"m": min(body1.m.value, body2.m.value), "M": body1.M.value + body2.M.value}
    if pair.interface.transfer is not None and pair.held:
        why = "a contact node is held tangentially and the grids differ: no trace space serves both bodies"
    elif not np.array_equal(pair.contact.free, pair.neumann.free) and pair.interface.transfer is None:
        why = "the bodies hold different tangential components of Gamma_c: their traces differ"
    else:
        why = ""
    if why:
        reason |= dict.fromkeys((*NAMES[2:], *ENERGY_NAMES), why)
    else:
        free, grid = pair.contact.free, pair.contact.grid
        tangential = (np.arange(grid.size) < grid.t)[free]
        values |= of_energy(pair, tangential)
        if meshes:
            values |= of_section_5(pair, tangential)
        if pair.interface.kernel is None:
            reason = dict.fromkeys(("C_s", "C_s_energy"), "no friction and no radius: S is not defined") | reason
            values |= {"kappa_1": 0.0, "kappa_2": 0.0} | ({"C_K": 0.0} if meshes else {})
        if pair.contact.slides:
            reason["C_t1"] = SLIDES
            if friction:
                reason["kappa_1"] = f"C_t1 is {SLIDES}"
            else:
                values["kappa_1"] = 0.0
    products = (("C_K", "C_s", "C_tr"), ("kappa_1", "C_s_energy", "C_t1"), ("kappa_2", "C_s_energy", "C_t2"))
    for name, first, second in products:
        a, b = values[first], values[second]
        if a is not None and b is not None:
            values[name] = friction * a * b
    numbers: dict[str, Any] = {name: None if v is None else Number.of_float(v) for name, v in values.items()}
    if body1 is not None and body2 is not None:
        numbers["m"] = min(body1.m, body2.m, key=lambda m: m.value)  # 0 is exact
    return Measured(
        body1=body1,
        body2=body2,
        friction=friction,
        interface_nodes=pair.contact.grid.n,
        reason=reason,
        units=pair.units,
        problem=pair.problem,
        **numbers,
    )


def _without_matrices(bodies: TwoBodies, progress: Progress) -> Measured:
    """What needs no interface matrices."""
    pencils, problem = Pencils(bodies, progress), bodies.problem
    values: dict[str, Any] = dict.fromkeys((*NAMES, *ENERGY_NAMES))
    lower, upper = (constants_of(body, dense=False) for body in bodies.elastic)
    values |= {"m": min(lower.m.value, upper.m.value), "M": lower.M.value + upper.M.value}
    if not pencils.reason:
        neumann = problem.iteration.neumann_body
        values["rho_max"] = pencils.largest(neumann_body=neumann).value
        values["rho_min"] = 1 / pencils.largest(neumann_body=3 - neumann).value
        values["rho_normal"] = pencils.largest(neumann_body=neumann, normal=True).value
    if not bodies.friction:
        values |= dict.fromkeys(("C_K", "kappa_1", "kappa_2"), 0.0)
    numbers: dict[str, Any] = {name: None if v is None else Number.of_float(v) for name, v in values.items()}
    missing = [name for name, value in numbers.items() if value is None]
    return Measured(
        body1=lower,
        body2=upper,
        friction=float(bodies.friction),
        interface_nodes=bodies.interface.contact.n,
        reason=dict.fromkeys(missing, needs_matrices(bodies)) | pencils.reason,
        units=problem.units,
        problem=problem,
        **numbers,
    )

"""Constants of Section 5 and of the theorem in energy norms, measured on the mesh as extremal eigenvalues."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem1d2d import Eigenvalue, elimination_order, largest, largest_sparse, solver
from fem1d2d.mesh import Bools, Floats
from ndtheory import Number
from verification.constants.measured import (
    ALL_NAMES,
    FROM_MATRICES,
    OF_MESHES,
    PRODUCTS,
    SLIDES,
    BodyConstants,
    Measured,
)
from verification.constants.operators import Pencils, needs_matrices, pair_or_bodies
from verification.dense import Cholesky, pinned, symmetric
from verification.interface.assembly import TwoBodies
from verification.interface.body import Body, Condensed
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.problem import Problem
from verification.registry import PROOFS


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
        True to prove bounds of each constant, for the exact data of the problem: then its level is ``verified``.
    progress : callable
        Called with the mesh that is measured.

    Returns
    -------
    Measured
        For theta ``rho_max.value`` matters most; without friction ``rho_normal.value``.

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
    if refine and pair.problem is None:
        raise ValueError("this pair is made from matrices: needed a problem whose meshes can be halved")
    with one_thread():
        finer = [] if pair.problem is None else [pair.problem.refined(level) for level in range(1, refine + 1)]
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


def _measure(pair: ContactPair | TwoBodies, progress: Progress, verified: bool) -> Measured:
    plain = _without_matrices(pair, progress) if isinstance(pair, TwoBodies) else _with_matrices(pair)
    if not verified:
        return plain
    proved: Measured = PROOFS["constants"].of(plain, pair, progress=progress)
    return proved


def _with_matrices(pair: ContactPair) -> Measured:
    friction = float(pair.friction)
    values: dict[str, float | None] = dict.fromkeys(ALL_NAMES)
    reason: dict[str, str] = {}
    sides = (pair.body1, pair.body2)
    bodies = [constants_of(side.body) for side in sides if side.body is not None]
    free, grid = pair.contact.free, pair.contact.grid
    tangential = (np.arange(grid.size) < grid.t)[free]
    values |= of_energy(pair, tangential)
    if bodies:
        values |= of_section_5(pair, tangential)
    else:
        reason = dict.fromkeys(OF_MESHES, FROM_MATRICES)
    if pair.interface.kernel is None:
        reason = dict.fromkeys(("C_s", "C_s_energy"), "no friction and no radius: S is not defined") | reason
        values |= {"kappa_1": 0.0, "kappa_2": 0.0} | ({"C_K": 0.0} if bodies else {})
    if pair.contact.slides:
        reason["C_t1"] = SLIDES
        if friction:
            reason["kappa_1"] = f"C_t1 is {SLIDES}"
        else:
            values["kappa_1"] = 0.0
    for name, first, second in PRODUCTS:
        a, b = values[first], values[second]
        if a is not None and b is not None:
            values[name] = friction * a * b
    return _gathered(pair, bodies, values, reason)


def _without_matrices(bodies: TwoBodies, progress: Progress) -> Measured:
    """The constants that need no interface matrices."""
    pencils, problem = Pencils(bodies, progress), bodies.problem
    values: dict[str, float | None] = dict.fromkeys(ALL_NAMES)
    each = [constants_of(body, dense=False) for body in bodies.elastic]
    if not pencils.reason:
        neumann = problem.iteration.neumann_body
        values["rho_max"] = pencils.largest(neumann_body=neumann).value
        values["rho_min"] = 1 / pencils.largest(neumann_body=3 - neumann).value
        values["rho_normal"] = pencils.largest(neumann_body=neumann, normal=True).value
    if not bodies.friction:
        values |= dict.fromkeys(("C_K", "kappa_1", "kappa_2"), 0.0)
    missing = [name for name, value in values.items() if value is None and name not in ("m", "M")]
    return _gathered(bodies, each, values, dict.fromkeys(missing, needs_matrices(bodies)) | pencils.reason)


def _gathered(
    of: ContactPair | TwoBodies, bodies: list[BodyConstants], values: dict[str, float | None], reason: dict[str, str]
) -> Measured:
    """The constants of bodies, none where they are known by matrices only, and those that they have together."""
    numbers: dict[str, Any] = {name: None if v is None else Number.of_float(v) for name, v in values.items()}
    if bodies:
        numbers["m"] = min((body.m for body in bodies), key=lambda m: m.value)  # 0 is exact
        numbers["M"] = Number.of_float(sum(body.M.value for body in bodies))
    body1, body2 = bodies or (None, None)
    return Measured(
        body1=body1,
        body2=body2,
        friction=float(of.friction),
        interface_nodes=of.interface.contact.n,
        reason=reason,
        units=of.problem.units if isinstance(of, TwoBodies) else of.units,
        problem=of.problem,
        **numbers,
    )


def constants_of(body: Body, *, dense: bool = True) -> BodyConstants:
    """Measure m and M of a body by extremal eigenvalues of its stiffness matrix against the norm.

    ``dense`` is True if the Schur complement of the norm is wanted too, which one factorisation gives with the solves;
    False where there are too many contact nodes for it.
    """
    A, H, loose = body.stiffness, body.gram_matrix, body.motions.shape[1] > 0
    if body.few:
        A, H = A.toarray(), H.toarray()
        return _of(body, None if loose else largest(H, A), largest(A, H))
    # the interface need not come last here, which saves fill, and with it time at each solve of Lanczos
    order = elimination_order(A, np.arange(0)) if dense else None
    solve_H = body.gram.solver() if dense else solver(H)
    # 1/m, so that products with A^-1 find it
    smallest = None if loose else largest_sparse(H, A, solver(A, order) if dense else body.solve)
    above = body.material.continuity(body.mesh.dimension)
    return _of(body, smallest, largest_sparse(A, H, solve_H, above=above, order=order))


def _of(body: Body, smallest: Eigenvalue | None, biggest: Eigenvalue) -> BodyConstants:
    """From the eigenvalues 1/m, None where m is 0, and M."""
    return BodyConstants(
        m=Number(value=0.0, lo=0.0, hi=0.0, level="exact") if smallest is None else Number.of_float(1 / smallest.value),
        M=Number.of_float(biggest.value),
        nodes=len(body.mesh.points),
        cut=body.mesh.cut,
        residual_m=0.0 if smallest is None else smallest.residual / smallest.value,
        residual_M=biggest.residual / biggest.value,
    )


def of_section_5(pair: ContactPair, tangential: Bools) -> dict[str, float | None]:
    """C_R, C_tr and C_s of Section 5: matrices on the components that Gamma_u leaves free.

    Where the bodies have different traces P carries forms of the contact body to the Neumann grid.  Section 5 needs no
    way back: it lifts only the Neumann body's traces into the contact body.
    """
    grid, kernel = pair.contact.grid, pair.interface.kernel
    interface = pair.interface_along_y
    same = pair.same_traces
    contact, neumann = pair.contact.mesh_body, pair.neumann.mesh_body
    # along y and by number, so that the constants do not depend on the roles, to the last digit
    bodies = (pair.body1.mesh_body, pair.body2.mesh_body)
    E = {body.name: body.gram.schur for body in bodies}
    fits = [(a, b) for b in bodies for a in bodies if same or a is b or b is neumann]  # a form of a, in norm b
    carried = lambda form: interface.carry_free(form, contact.unknown, neumann.unknown)
    felt = lambda form, a, b: form if same or a is b else carried(form)
    values: dict[str, float | None] = {
        "C_R": float(np.sqrt(max(largest(felt(a.lift_gram, a, b), E[b.name]).value for a, b in fits)))
    }
    if not tangential.any():
        return values | dict.fromkeys(("C_tr", "C_tr_half", "C_s"), 0.0)
    B_T = _tangential_mass(pair, tangential)
    values["C_tr"] = float(np.sqrt(max(largest(felt(B_T, contact, b), E[b.name]).value for b in bodies)))
    halves: dict[str, list[float]] = {body.name: [] for body in bodies}
    for a, b in fits:
        slides = np.arange(len(a.interface)) < len(a.interface) - len(a.nodes)
        kept = np.where(np.outer(slides, slides), E[a.name], 0.0)
        halves[b.name].append(largest(felt(kept, a, b), E[b.name]).value)
    values["C_tr_half"] = float(np.sqrt(max(map(min, halves.values()))))
    if kernel is not None:
        squares = {}
        for body in bodies:
            force = np.zeros((len(body.unknown), len(body.interface)))
            force[body.unknown] = body.elastic.schur
            force = force if body is neumann else interface.carry_back(force)
            z = kernel @ force[-pair.neumann.grid.n :]
            squares[body.name] = z.T @ (grid.weights[:, None] * z)
        values["C_s"] = float(np.sqrt(max(largest(symmetric(z), E[name]).value for name, z in squares.items())))
    return values


def of_energy(pair: ContactPair, tangential: Bools) -> dict[str, float | None]:
    """rho and the constants of friction in energy norms, with P between the grids."""
    interface, grid, kernel = pair.interface, pair.contact.grid, pair.interface.kernel
    contact = _free(pair.contact)
    carried, neumann = pencil(pair)
    values: dict[str, float | None] = {
        "rho_max": largest(carried, neumann).value,
        "rho_min": _smallest(pair, carried, neumann, contact),
        "rho_normal": largest(*normal_pencil(pair)).value,
    }
    if not tangential.any():
        return values | dict.fromkeys(("C_s_energy", "C_t1", "C_t2"), 0.0)
    B_T = _tangential_mass(pair, tangential)
    if kernel is not None:
        # sup |S g_N|^2 / g' S_2^-1 g over g = S_2 phi is the largest eigenvalue of S (S_2)_NN S' in the weights
        normal = np.arange(pair.neumann.grid.size)[pair.neumann.free] >= pair.neumann.grid.t
        root = np.sqrt(grid.weights)[:, None] * kernel
        stress = root @ neumann[np.ix_(normal, normal)] @ root.T
        values["C_s_energy"] = float(np.sqrt(np.linalg.eigvalsh(symmetric(stress))[-1]))
    if not pair.contact.slides:  # else it is infinite; motions that do not slide do not enter the maximum
        motions = _motions(pair.contact)
        definite = contact if motions is None else pinned(contact, np.arange(len(contact)), motions)
        values["C_t1"] = float(np.sqrt(largest(B_T, definite).value))
    carried = interface.carry_free(B_T, pair.contact.free, pair.neumann.free)
    values["C_t2"] = float(np.sqrt(largest(carried, neumann).value))
    return values


def pencil(pair: ContactPair) -> tuple[Floats, Floats]:
    """``P' S_c P`` and S_n on the components that the Neumann body leaves free: rho is the largest eigenvalue."""
    free = pair.neumann.free
    return pair.interface.carry_form(pair.contact.schur)[np.ix_(free, free)], _free(pair.neumann)


def normal_pencil(pair: ContactPair) -> tuple[Floats, Floats]:
    """The same of the normal components, the tangential ones condensed out: rho_normal is the largest eigenvalue."""
    grid, join = pair.contact.grid, pair.interface.join
    normal = np.arange(grid.size)[pair.contact.free] >= grid.t
    contact = _condense_tangential(_free(pair.contact), normal, _motions(pair.contact))
    if not (join.one_grid or join.alike):  # a normal force on one grid has a tangential part on the other
        rows = pair.interface.carry(np.eye(pair.neumann.grid.size))[grid.normal][:, pair.neumann.free]
        return rows.T @ contact @ rows, _free(pair.neumann)
    contact = join.values_back(join.values_back(contact).T)
    normal = np.arange(pair.neumann.grid.size)[pair.neumann.free] >= pair.neumann.grid.t
    return contact, _condense_tangential(_free(pair.neumann), normal)


def _smallest(pair: ContactPair, carried: Floats, neumann: Floats, contact: Floats) -> float:
    """The smallest eigenvalue of (P' S_c P, S_n); where P is not the identity to rounding relative to the largest."""
    if pair.contact.loose or len(contact) < len(neumann):  # S_c or P has a kernel
        return 0.0
    if pair.same_traces:
        return 1 / largest(neumann, contact).value
    return max(-largest(-carried, neumann).value, 0.0)


def _free(side: Condensed) -> Floats:
    return side.schur[np.ix_(side.free, side.free)]


def _motions(side: Condensed) -> Floats | None:
    """The kernel of :func:`_free`; None where it is definite."""
    return side.motions[side.free] if side.loose else None


def _tangential_mass(pair: ContactPair, tangential: Bools) -> Floats:
    """B_T: the quadrature of ``|v_T|^2`` on the free components of the contact grid."""
    grid = pair.contact.grid
    weights = np.zeros(len(tangential))
    weights[tangential] = grid.weights[pair.contact.free[grid.tangential]]
    return np.diag(weights)


def _condense_tangential(S: Floats, normal: Any, motions: Floats | None = None) -> Floats:
    """Schur complement of S on the normal components; S may be semidefinite, with motions as its kernel."""
    slide = ~normal
    if not slide.any():
        return S
    cross = S[np.ix_(slide, normal)]
    inner = Cholesky(S, np.flatnonzero(slide), motions).solve(S[:, normal])[slide]
    return symmetric(S[np.ix_(normal, normal)] - cross.T @ inner)

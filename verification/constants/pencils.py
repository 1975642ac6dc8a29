"""The constants of a pair as extremal generalised eigenvalues of its interface matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d import largest
from fem1d2d.mesh import Floats
from verification.dense import Cholesky, pinned
from verification.interface.body import Condensed
from verification.interface.pair import ContactPair


def of_section_5(pair: ContactPair, tangential: NDArray[np.bool_]) -> dict[str, float | None]:
    """C_R, C_tr and C_s of Section 5: matrices on the components that both bodies leave free.

    Where the grids differ a form of the contact body is felt on the Neumann grid through P.  Nothing leads the other
    way, and Section 5 needs nothing: of two bodies it lifts the Neumann body's traces into the contact body alone.
    """
    interface, grid, kernel = pair.interface, pair.contact.grid, pair.interface.kernel
    one_grid = interface.transfer is None
    contact, neumann = pair.contact.mesh_body, pair.neumann.mesh_body
    # along y and by number, so that the constants do not depend on the roles, to the last digit
    bodies = (pair.body1.mesh_body, pair.body2.mesh_body)
    E = {body.name: body.gram.schur for body in bodies}
    fits = [(a, b) for b in bodies for a in bodies if one_grid or a is b or b is neumann]  # a form of a, in norm b
    felt = lambda form, a, b: form if a is b else interface.carry_form(form)
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
            normal = body.elastic.schur[-len(body.nodes) :]
            z = kernel @ (normal if body is neumann else interface.onto_neumann(normal))
            squares[body.name] = z.T @ (grid.weights[:, None] * z)
        values["C_s"] = float(np.sqrt(max(largest((z + z.T) / 2, E[name]).value for name, z in squares.items())))
    return values


def of_energy(pair: ContactPair, tangential: NDArray[np.bool_]) -> dict[str, float | None]:
    """rho and what the theorem in energy norms knows of friction, with P between the grids."""
    interface, grid, kernel = pair.interface, pair.contact.grid, pair.interface.kernel
    contact, neumann = _free(pair.contact), _free(pair.neumann)
    normal = ~tangential
    carried = contact if interface.transfer is None else interface.carry_form(contact)
    values: dict[str, float | None] = {
        "rho_max": largest(carried, neumann).value,
        "rho_min": _smallest(pair, carried, neumann, contact),
    }
    normal_contact = _condense_tangential(contact, normal, _motions(pair.contact))
    if interface.transfer is not None:
        normal_contact = interface.transfer.T @ normal_contact @ interface.transfer
        normal = np.arange(pair.neumann.grid.size) >= pair.neumann.grid.t
    values["rho_normal"] = largest(normal_contact, _condense_tangential(neumann, normal)).value
    if not tangential.any():
        return values | dict.fromkeys(("C_s_energy", "C_t1", "C_t2"), 0.0)
    B_T = _tangential_mass(pair, tangential)
    if kernel is not None:
        # sup |S g_N|^2 / g' S_2^-1 g over g = S_2 phi is the largest eigenvalue of S (S_2)_NN S' in the weights
        root = np.sqrt(grid.weights)[:, None] * kernel
        stress = root @ neumann[np.ix_(normal, normal)] @ root.T
        values["C_s_energy"] = float(np.sqrt(np.linalg.eigvalsh((stress + stress.T) / 2)[-1]))
    if not pair.contact.slides:  # else it is infinite; motions that do not slide are no part of the maximum
        motions = _motions(pair.contact)
        definite = contact if motions is None else pinned(contact, np.arange(len(contact)), motions)
        values["C_t1"] = float(np.sqrt(largest(B_T, definite).value))
    values["C_t2"] = float(
        np.sqrt(largest(B_T if interface.transfer is None else interface.carry_form(B_T), neumann).value)
    )
    return values


def _smallest(pair: ContactPair, carried: Floats, neumann: Floats, contact: Floats) -> float:
    """The smallest eigenvalue of (P' S_c P, S_n); where P is not the identity to rounding relative to the largest."""
    if pair.contact.loose or pair.contact.grid.n < pair.neumann.grid.n:  # S_c or P has a kernel
        return 0.0
    if pair.interface.transfer is None:
        return 1 / largest(neumann, contact).value
    return max(-largest(-carried, neumann).value, 0.0)


def _free(side: Condensed) -> Floats:
    return side.stiffness[np.ix_(side.free, side.free)]


def _motions(side: Condensed) -> Floats | None:
    """The kernel of :func:`_free`; None where it is definite."""
    return side.motions[side.free] if side.loose else None


def _tangential_mass(pair: ContactPair, tangential: NDArray[np.bool_]) -> Floats:
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
    result = S[np.ix_(normal, normal)] - cross.T @ inner
    return np.asarray((result + result.T) / 2)

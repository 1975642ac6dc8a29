"""Pairs of bodies that are their own mirror image, and the mirror image of what is known of a set of pieces.

The reflection of Gamma_c about its middle reverses the order of the nodes and turns tangential components round.
Where it changes neither the matrices of a pair nor its law of friction, two forces and their images fulfil the same
conditions of step II, with the other sign of slip against S sigma_N: so a set of pieces and its mirror image have the
same Lipschitz constant, and multipliers prove for the one what their images prove for the other.  What is said here is
only proposed: that the images prove it is checked as for any multipliers, with the matrices as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from fem1d2d.mesh import Floats
from verification.bounds.conditions import Conditions, Pieces
from verification.bounds.program import Optimum, Weights
from verification.interface.interface import Grid
from verification.interface.pair import ContactPair

#: Entries that differ by less, relative to the diagonal or to the largest, are equal: rounding leaves 1e-14 on Section
#: 6 with 97 contact nodes.
SAME = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Mirror:
    """The reflection of a pair of bodies that is its own mirror image.

    Attributes
    ----------
    turn : array, shape (d, d)
        What it makes of the coordinates of :class:`verification.bounds.conditions.Conditions`.
    """

    turn: Floats

    @classmethod
    def of(cls, pair: ContactPair, forms: Conditions) -> Mirror | None:
        """The reflection; None where the pair is not its own mirror image to rounding, and without friction."""
        interface, contact, neumann = pair.interface, pair.contact, pair.neumann
        if interface.kernel is None or len(forms.families) == 1:
            return None
        same = _alike(contact.grid.weights, contact.grid.weights[::-1]) and _alike(
            interface.kernel, interface.kernel[::-1, ::-1]
        )
        if interface.transfer is not None:
            same = same and _alike(interface.transfer, interface.transfer[::-1, ::-1])
        if not (same and _is_even(contact.stiffness, contact.grid) and _is_even(neumann.stiffness, neumann.grid)):
            return None
        L_2, carried = neumann.root, forms.carried
        turns = (
            np.linalg.solve(L_2, _reflected(L_2, neumann.grid)),
            np.linalg.solve(carried, _reflected(carried, contact.grid)),
        )
        return cls(turn=block_diag(*turns))

    def pieces(self, pieces: Pieces) -> Pieces:
        """The images of some pieces."""
        return Pieces(signs=-pieces.signs[::-1], normal=pieces.normal[::-1], slip=pieces.slip[::-1])

    def multipliers(self, multipliers: Weights) -> Weights:
        """The images of multipliers; those of ``w k zeta v_T`` and of ``p_T sqrt(w k) zeta`` change sign."""
        signs = (1, 1, 1, 1, -1, 1, 1, 1, -1)
        return tuple(sign * values[::-1] for sign, values in zip(signs, multipliers, strict=False))

    def proposal(self, found: Optimum, forms: Conditions, pieces: Pieces) -> Optimum:
        """The image of what a solver found for some pieces."""
        reverse = lambda y: np.concatenate([part[::-1] for part in forms.parts(y, pieces)])
        early = None if found.early is None else (found.early[0], reverse(found.early[1]))
        return replace(found, y=reverse(found.y), moments=self.turn @ found.moments @ self.turn.T, early=early)


def _reflected(rows: Floats, grid: Grid) -> Floats:
    """Interface vectors, as columns, reflected."""
    return np.concatenate([-rows[grid.tangential][::-1], rows[grid.normal][::-1]])


def _is_even(S: Floats, grid: Grid) -> bool:
    """Whether the reflection does not change a symmetric positive definite matrix, entry by entry."""
    root = np.sqrt(np.diag(S))
    scaled = S / np.outer(root, root)
    return bool(np.abs(_reflected(_reflected(scaled, grid).T, grid) - scaled).max() <= SAME)


def _alike(a: Floats, b: Floats) -> bool:
    return bool(np.abs(a - b).max() <= SAME * np.abs(a).max())

"""Bodies that are their own mirror image: half of the work for their bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from fem1d2d.mesh import Floats
from verification.dense import symmetric
from verification.interface.interface import Grid
from verification.interface.pair import ContactPair
from verification.semidefinite.conditions import Conditions, Pieces
from verification.semidefinite.interior_point import Indices, Optimum, Program, Weights

#: Entries that differ by less, relative to the diagonal or to the largest, are equal: rounding leaves 1e-14 on Section
#: 6 with 97 contact nodes.
SAME = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Mirror:
    """The reflection of a pair of bodies that is its own mirror image.

    The reflection of Gamma_c about its middle reverses the order of the nodes and turns tangential components round.
    Where it changes neither the matrices of a pair nor its law of friction, two forces and their images fulfil the same
    conditions of step II, with the other sign of slip against S sigma_N: so a set of pieces and its mirror image have
    the same Lipschitz constant, and the images of multipliers prove the image of a claim.  Images are only proposals:
    they are checked as any multipliers, with the matrices as they are.

    ``turns`` are the reflections of g and of d_1 in the coordinates of
    :class:`verification.semidefinite.conditions.Conditions`.
    """

    turns: tuple[Floats, Floats]

    @classmethod
    def of(cls, pair: ContactPair, forms: Conditions) -> Mirror | None:
        """The reflection; None where the pair is not its own mirror image to rounding, and without friction."""
        interface, contact, neumann = pair.interface, pair.contact, pair.neumann
        if interface.kernel is None or len(forms.families) == 1 or forms.lifts:
            return None
        same = _alike(contact.grid.weights, contact.grid.weights[::-1]) and _alike(
            interface.kernel, interface.kernel[::-1, ::-1]
        )
        P = interface.carry(np.eye(neumann.grid.size))
        same = same and _alike(P, _reflected(_reflected(P, contact.grid).T, neumann.grid).T)
        if not (same and _is_even(contact.schur, contact.grid) and _is_even(neumann.schur, neumann.grid)):
            return None
        L_2, carried = neumann.root, forms.carried
        turns = (
            solve_triangular(L_2, _reflected(L_2, neumann.grid), lower=True),
            solve_triangular(carried, _reflected(carried, contact.grid)),
        )
        return cls(turns=turns)

    @cached_property
    def turn(self) -> Floats:
        """The reflection of (g, d_1), shape (d, d)."""
        return np.asarray(block_diag(*self.turns))

    @cached_property
    def modes(self) -> tuple[Floats, int]:
        """An orthonormal basis of (g, d_1), shape (d, d): first what a reflection turns round, and how much it is."""
        values, columns = zip(*(np.linalg.eigh(symmetric(turn)) for turn in self.turns), strict=True)
        odd = np.concatenate(values) < 0
        basis = block_diag(*columns)
        return np.hstack([basis[:, odd], basis[:, ~odd]]), int(odd.sum())

    def pieces(self, pieces: Pieces) -> Pieces:
        """The images of some pieces."""
        return Pieces(signs=-pieces.signs[::-1], normal=pieces.normal[::-1], slip=pieces.slip[::-1])

    def multipliers(self, multipliers: Weights) -> Weights:
        """The images of multipliers; those of ``w k zeta v_T`` and of ``p_T sqrt(w k) zeta`` change sign."""
        signs = (1, 1, 1, 1, -1, 1, 1, 1, -1)
        return tuple(sign * values[::-1] for sign, values in zip(signs, multipliers, strict=False))

    def proposal(self, found: Optimum, forms: Conditions, pieces: Pieces) -> Optimum:
        """The image of a solver's answer for some pieces."""
        reverse = lambda y: np.concatenate([part[::-1] for part in forms.parts(y, pieces)])
        early = None if found.early is None else (found.early[0], reverse(found.early[1]))
        return replace(found, y=reverse(found.y), moments=self.turn @ found.moments @ self.turn.T, early=early)

    @cached_property
    def parts(self) -> tuple[Floats, ...]:
        """An orthonormal basis of d_1 in two parts: what a reflection turns round, and what it does not."""
        values, columns = np.linalg.eigh(symmetric(self.turns[1]))
        return columns[:, values < 0], columns[:, values >= 0]

    def halved(self, program: Program) -> tuple[Program, Indices]:
        """A program for all pieces with one multiplier for a node and its image, and the place of each multiplier.

        Its rows stand for their images, too: they are right in coordinates in which the form has no products of what a
        reflection turns round with what it does not.
        """
        n = len(program.cones)
        half = np.arange((n + 1) // 2)
        twice = np.where(2 * half == n - 1, 1.0, 2.0)  # a node in the middle is its own image
        kept = (n * np.arange(4)[:, None] + half).ravel()
        place = (len(half) * np.arange(4)[:, None] + np.minimum(np.arange(n), np.arange(n)[::-1])).ravel()
        halved = replace(
            program,
            left=np.tile(twice, 4)[:, None] * program.left[kept],
            right=program.right[kept],
            cones=place[program.cones[half]],
            most=program.most[kept],
            y=program.y[kept],
        )
        return halved, place

    def solved(self, program: Program, solve: Callable[[Program], Optimum]) -> Optimum:
        """A solver's answer to a program for all pieces, from one with half of the multipliers and two blocks.

        A node and its image may have equal multipliers, as the program is convex.  The form then has no products of
        what a reflection turns round with what it does not.
        """
        (basis, odd), (half, place) = self.modes, self.halved(program)
        found = solve(
            replace(
                half,
                fixed=basis.T @ program.fixed @ basis,
                free=basis.T @ program.free @ basis,
                left=half.left @ basis,
                right=half.right @ basis,
                blocks=(slice(0, odd), slice(odd, len(basis))),
            )
        )
        early = None if found.early is None else (found.early[0], found.early[1][place])
        return replace(found, y=found.y[place], moments=basis @ found.moments @ basis.T, early=early)


def _reflected(rows: Floats, grid: Grid) -> Floats:
    """Interface vectors, as columns, reflected."""
    return np.concatenate([-rows[grid.tangential][::-1], rows[grid.normal][::-1]])


def _is_even(S: Floats, grid: Grid) -> bool:
    """True if the reflection does not change a symmetric positive definite matrix, entry by entry."""
    root = np.sqrt(np.diag(S))
    scaled = S / np.outer(root, root)
    return bool(np.abs(_reflected(_reflected(scaled, grid).T, grid) - scaled).max() <= SAME)


def _alike(a: Floats, b: Floats) -> bool:
    return bool(np.abs(a - b).max() <= SAME * np.abs(a).max())

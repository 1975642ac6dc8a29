"""Fixed points at which a part of Gamma_c sticks: what the statements on meshes of the continuum page are about."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pieces import Evaluated
from scipy.linalg import eigh

from verification.algorithm.affine_piece import Piece, piece_of
from verification.interface.pair import ContactPair


def condensed(stiffness: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """The form of a stiffness matrix for the components kept, the others taking their least energy; 0 elsewhere."""
    result, rows, rest = np.zeros_like(stiffness), np.flatnonzero(kept), np.flatnonzero(~kept)
    coupled = stiffness[np.ix_(rows, rest)]
    result[np.ix_(rows, rows)] = stiffness[np.ix_(rows, rows)]
    result[np.ix_(rows, rows)] -= coupled @ np.linalg.solve(stiffness[np.ix_(rest, rest)], coupled.T)
    return result


@dataclass(frozen=True, kw_only=True, eq=False)
class Sticking:
    """A fixed point of a pair with loads chosen so that it is one.

    Attributes
    ----------
    pair : ContactPair
    g : array
    A : bool array
        Nodes of the part of Gamma_c that sticks, or, without friction, that touches.
    piece : Piece
        The affine piece of T around g, as the library finds it.
    """

    pair: ContactPair
    g: np.ndarray
    A: np.ndarray
    piece: Piece

    @property
    def within_reach(self) -> np.ndarray:
        """The nodes with a friction bound above 0."""
        return self.pair.bound(self.g) > 0

    @property
    def held(self) -> np.ndarray:
        """The components of the contact body's trace that follow the Neumann body."""
        pattern = self.piece.pattern
        return np.concatenate([(pattern.sliding == 0) & self.within_reach, pattern.touching])

    @property
    def slides(self) -> bool:
        """True if friction that depends on g acts at a node."""
        return bool((self.within_reach & (self.piece.pattern.sliding != 0)).any())

    @property
    def prescribed(self) -> np.ndarray:
        """The components of A in the statement: both, and without friction the normal ones."""
        return np.concatenate([self.A & self.pair.rubs, self.A])

    def largest(self, kept: np.ndarray) -> float:
        """The contact body's least energy for given components, at most, over the Neumann body's."""
        form = condensed(self.pair.contact.schur, kept)
        return float(eigh(form, self.pair.neumann.schur, eigvals_only=True)[-1])

    @cached_property
    def rho_A(self) -> float:
        return self.largest(self.prescribed)

    @cached_property
    def P(self) -> np.ndarray:
        """The selfadjoint part of -T', in the coordinates of the piece, where (5.21) is the Euclidean norm."""
        carried = self.pair.neumann.flexibility(self.piece.basis)
        return np.asarray(carried.T @ condensed(self.pair.contact.schur, self.held) @ carried)

    @cached_property
    def F(self) -> np.ndarray:
        """What sliding adds: T' + P."""
        return np.asarray(self.piece.jacobian + self.P)

    @cached_property
    def beta(self) -> np.ndarray:
        """The real parts of the eigenvalues of -T', falling."""
        return np.sort(-np.linalg.eigvals(self.piece.jacobian).real)[::-1]

    @cached_property
    def kernel_size(self) -> float:
        """``sigma``: root of the sum of w_j times the energy of the Neumann body with the kernel at x_j as trace."""
        K, n = self.pair.interface.kernel, self.pair.neumann.grid.n
        energies = np.einsum("ji,il,jl->j", K, self.pair.neumann.schur[n:, n:], K)
        return float(np.sqrt(self.pair.contact.grid.weights @ energies))

    @cached_property
    def Ct(self) -> tuple[float, float]:
        """C_t1 and C_t2."""
        mass = np.diag(np.concatenate([self.pair.contact.grid.weights, 0 * self.pair.contact.grid.weights]))
        sides = self.pair.contact, self.pair.neumann
        first, second = (float(eigh(mass, side.schur, eigvals_only=True)[-1]) ** 0.5 for side in sides)
        return first, second

    def least(self, theta: float) -> float:
        """The least real part of an eigenvalue of the Jacobian of T_theta."""
        return 1 - theta - theta * float(self.beta[0])

    def run(self, theta: float, steps: int, random: np.random.Generator) -> tuple[float, float]:
        """The distance from g, of 1, in the norm (5.21) after some steps from a force near by, and the largest one."""
        T, norm = Evaluated(self.pair), self.pair.neumann.dual_norm
        d = self.piece.basis @ random.standard_normal(self.piece.basis.shape[1])
        start = 1e-6 * norm(self.g)
        g, distances = self.g + start * d / norm(d), [1.0]
        for _ in range(steps):
            g = theta * T(g).image + (1 - theta) * g
            distances.append(norm(g - self.g) / start)
        return distances[-1], max(distances)


def fixed_point(
    pair: ContactPair, A: np.ndarray, touching: np.ndarray, sliding: np.ndarray, random: np.random.Generator
) -> Sticking:
    """Loads that make a state of the contact nodes a fixed point, with strict inequalities.

    Parameters
    ----------
    pair : ContactPair
    A, touching : bool array
    sliding : int array
        Where no friction can act it says which way the bodies have moved apart.
    random : Generator
    """
    grid = pair.contact.grid
    positive = lambda: random.uniform(0.5, 1.5, grid.n)
    g = np.zeros(grid.size)
    g[grid.t :] = np.where(touching, positive() * grid.weights, 0.0)
    bound = pair.bound(g)
    g[: grid.t] = bound * np.where(sliding != 0, sliding, random.uniform(-0.9, 0.9, grid.n))
    apart = np.where((bound == 0) & (sliding == 0), 1, sliding)
    v = np.concatenate([apart * positive(), np.where(touching, 0.0, -positive())])
    v *= np.abs(g).max() / np.abs(pair.contact.schur).max()
    contact = replace(pair.contact, load=pair.contact.schur @ v + g)
    loaded = replace(pair, contact=contact, neumann=replace(pair.neumann, load=-g))
    state = Evaluated(loaded)(g)
    assert np.abs(state.image - g).max() <= 1e-9 * np.abs(g).max()
    assert np.array_equal(state.contact.pattern.touching, touching)
    assert np.array_equal(state.contact.pattern.sliding[bound > 0], sliding[bound > 0])
    return Sticking(pair=loaded, g=g, A=A, piece=piece_of(loaded, g, state.contact.pattern))

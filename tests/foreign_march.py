"""A loading history by another code: scikit-fem assembles two boxes from mesh files; nothing of this project is used.

The unknowns are all displacements and contact forces at once, in one sparse system, and Newton's method exchanges its
rows of contact (Alart and Curnier 1991).  Friction has the averaged pressure of the paper: nodal forces on the lower
box, with the hat of a given radius.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import bmat, csr_matrix, diags
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTriP1, ElementVector, MeshTri
from skfem.models.elasticity import lame_parameters, linear_elasticity

#: Newton's method ends once a pattern comes again that is its own successor; after so many others it takes another r.
MOST = 40


class Box:
    """The stiffness of a body, its contact line y = 0 from left to right, and the far side, which is prescribed."""

    def __init__(self, path: Path, young: float, poisson: float) -> None:
        mesh = MeshTri.load(path)
        basis = Basis(mesh, ElementVector(ElementTriP1()))
        self.K = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
        x, y = mesh.p
        line = np.flatnonzero(np.isclose(y, 0))
        line = line[np.argsort(x[line])]
        self.x, self.at = x[line], basis.nodal_dofs[:, line]
        self.far = basis.nodal_dofs[:, np.isclose(np.abs(y), np.abs(y).max())]


def hats(x: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The piecewise linear basis functions of a grid at some points, one column each."""
    return np.stack([np.interp(at, x, row) for row in np.eye(len(x))], axis=1)


def mortar(x: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of the functions of another grid by the dual basis of this one, and the integrals of this one's hats."""
    means, weights = np.zeros((len(x), len(other))), np.zeros(len(x))
    cuts = np.union1d(x, other[(other > x[0]) & (other < x[-1])])
    for low, high in pairwise(cuts):
        at, w = (low + high) / 2 + (high - low) / 2 * np.array([-1, 1]) / np.sqrt(3), (high - low) / 2
        e = np.searchsorted(x, at[0]) - 1
        phi = hats(x, at)[:, e : e + 2]
        means[e : e + 2] += w * (2 * phi - phi[:, ::-1]).T @ hats(other, at)
        weights[e : e + 2] += w * phi.sum(axis=0)
    return means / weights[:, None], weights


def march(
    files: Sequence[Path], tops: Iterable[Sequence[float]], young: Sequence[float], poisson: float, k: float, r: float
) -> dict[str, np.ndarray]:
    """Pressure, shear and total slip at the contact nodes of the upper box after each place of its far side."""
    lower, upper = (Box(path, E, poisson) for path, E in zip(files, young, strict=True))
    n, first = len(upper.x), lower.K.shape[0]
    size = first + upper.K.shape[0]
    P, weights = mortar(upper.x, lower.x)
    apart = np.zeros((2 * n, size))  # tangential jumps, then normal ones: lower less upper
    for i in range(2):
        apart[i * n : (i + 1) * n, lower.at[i]] = P
        apart[np.arange(i * n, (i + 1) * n), first + upper.at[i]] = -1.0
    D, K = csr_matrix(apart), bmat([[lower.K, None], [None, upper.K]]).tocsr()
    law = k * weights[:, None] * (np.maximum(0, 1 - np.abs(upper.x[:, None] - lower.x) / r) / r) @ P.T
    u, force, slip = np.zeros(size), np.zeros(2 * n), np.zeros(n)
    held = np.concatenate([lower.far.ravel(), first + upper.far.ravel()])
    free = np.setdiff1d(np.arange(size), held)
    found: dict[str, list[np.ndarray]] = {"pressure": [], "shear": [], "slip": []}
    for top in tops:
        u[held] = np.concatenate([np.zeros(lower.far.size), np.repeat(top, upper.far.shape[1])])
        u, force = _increment(K, D, law, u, force, slip, free, max(young))
        slip = (D @ u)[:n]
        for name, values in zip(found, (force[n:] / weights, force[:n] / weights, slip), strict=True):
            found[name].append(values)
    return {name: np.array(rows) for name, rows in found.items()}


def _increment(K, D, law, u, force, slip, free, stiff):  # type: ignore[no-untyped-def]
    """Displacements and contact forces, where the far sides are known and the slip so far is given."""
    n = len(slip)
    offset = np.concatenate([slip, np.zeros(n)])
    fixed = np.setdiff1d(np.arange(len(u)), free)
    for penalty in stiff * 3.0 ** np.array([0, 1, -1, 2, -2, 3, -3]):
        now, lam, before = u.copy(), force.copy(), None
        for _ in range(MOST):
            pulled = lam + penalty * (D @ now - offset)
            bound = law @ np.maximum(lam[n:], 0)
            slides = np.where(np.abs(pulled[:n]) > bound, np.sign(pulled[:n]), 0.0)
            touches = pulled[n:] > 0
            if before is None and not lam.any():
                slides, touches = np.zeros(n), np.ones(n, dtype=bool)
            if before is not None and np.array_equal(before, np.concatenate([slides, touches])):
                return now, lam
            before = np.concatenate([slides, touches])
            shut = diags(np.concatenate([slides == 0, touches]).astype(float))
            forces = np.diag(np.concatenate([slides != 0, ~touches]).astype(float))
            forces[:n, n:] = -slides[:, None] * law
            A = bmat([[K[free][:, free], D[:, free].T], [shut @ D[:, free], csr_matrix(forces)]]).tocsc()
            right = np.concatenate([-K[free][:, fixed] @ now[fixed], shut @ (offset - D[:, fixed] @ now[fixed])])
            solved = splu(A).solve(right)
            now[free], lam = solved[: len(free)], solved[len(free) :]
    raise RuntimeError("the other code found no solution")

"""Two bodies in contact with friction by scikit-fem and a primal-dual active set, the usual way to write it.

Each node of one body lies on a node of the other.  A pair that touches shares its normal unknown, one that sticks its
tangential one too, and where it slides the friction forces follow the normal ones.  Each step factorises the matrix of
both bodies once.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import skfem
from scipy.sparse.linalg import splu
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fem1d2d.mesh import Floats
from verification.interface.assembly import TwoBodies

#: Steps after which the sets are taken to repeat.
MOST = 50


def forces(bodies: TwoBodies) -> Floats:
    """Normal forces on Gamma_c, compression positive, shape (n,), of two elastic bodies whose nodes match.

    Only meshes, moduli, supports, pairs of nodes and the law of friction are taken from ``bodies``.

    Raises
    ------
    RuntimeError
        The sets do not settle.
    """
    parts, values, held, pairs, first = [], [], [], [], 0
    for body, spec in zip(bodies.elastic, (bodies.problem.body1, bodies.problem.body2), strict=True):
        mesh = skfem.MeshTri(body.mesh.points.T.copy(), body.mesh.cells.T.copy())
        basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP1()))
        parts.append(linear_elasticity(*lame_parameters(float(spec.young), float(spec.poisson))).assemble(basis))
        unknowns = basis.nodal_dofs.T
        u = np.zeros(unknowns.size)
        u[unknowns[body.known.held]] = body.known.values[body.known.held]
        values.append(u)
        held.append(first + unknowns[body.known.held])
        pairs.append(first + unknowns[body.nodes].T)
        first += len(u)
    K, known = sp.block_diag(parts, format="csr"), np.concatenate(values)
    (t1, n1), (t2, n2) = pairs
    load, size = -(K @ known), len(known)
    free = np.setdiff1d(np.arange(size), np.concatenate(held))
    grid, kernel = bodies.interface.contact, bodies.interface.contact_kernel
    law = float(bodies.friction) * grid.weights[:, None] * kernel
    touching, sliding = np.ones(grid.n, dtype=bool), np.zeros(grid.n)
    for _ in range(MOST):
        sticks, slides = np.flatnonzero(touching & (sliding == 0)), np.flatnonzero(touching & (sliding != 0))
        shared = np.arange(size)
        shared[n2[touching]], shared[t2[sticks]] = n1[touching], t1[sticks]
        _, column = np.unique(shared[free], return_inverse=True)
        T = sp.csr_array((np.ones(len(free)), (free, column)), shape=(size, column.max() + 1))
        row, other = np.nonzero(law[slides])
        rubs = sliding[slides[row]] * law[slides[row], other]
        at = np.concatenate([t2[slides[row]], t1[slides[row]]])
        follow = sp.csr_array((np.concatenate([-rubs, rubs]), (at, np.tile(n2[other], 2))), shape=(size, size))
        tested = T.T @ (sp.eye_array(size, format="csr") + follow)
        matrix = (tested @ K @ T).tocsc()
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
        moved = T @ factor.solve(tested @ load)
        force = K @ moved - load
        normal, shear, slip = force[n2], force[t2], moved[t1] - moved[t2]
        bound = np.abs(law @ normal)
        pushed = np.where(np.abs(shear) > bound, np.sign(shear), 0)
        kept = np.where(sliding * slip >= 0, sliding, 0)
        new = np.where(touching, normal > 0, moved[n1] > moved[n2]), np.where(sliding == 0, pushed, kept)
        if np.array_equal(new[0], touching) and np.array_equal(new[1][touching], sliding[touching]):
            return np.where(touching, normal, 0.0)
        touching, sliding = new
    raise RuntimeError(f"the sets of touching and sliding nodes do not settle within {MOST} steps")

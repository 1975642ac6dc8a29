"""Closed-form P1 element matrices, one formula for floats and for exact rationals.

All arrays have the cells first.  d is the dimension, a cell has d + 1 vertices.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d.material import Material
from fem1d2d.mesh import Mesh, measures


def gradients(mesh: Mesh) -> NDArray[Any]:
    """Gradients of the hat functions, shape (c, d + 1, d), unit 1/length."""
    p = mesh.points[mesh.cells]
    size = measures(mesh.points, mesh.cells)
    if mesh.dimension == 1:
        return np.stack([-1 / size, 1 / size], axis=-1)[..., None]
    following, previous = np.roll(p, -1, axis=1), np.roll(p, 1, axis=1)
    opposite = following - previous  # the edge facing each vertex, reversed
    rotated = np.stack([opposite[..., 1], -opposite[..., 0]], axis=-1)
    return np.asarray(rotated / (2 * size)[:, None, None])


def stiffness(mesh: Mesh, material: Material) -> NDArray[Any]:
    """``int lame_lambda div u div v + 2 lame_mu eps(u) : eps(v)``, shape (c, d + 1, d, d + 1, d).

    Unit: stress x length^(d - 2).  Entry (c, i, p, j, q) belongs to component p at vertex i and q at vertex j.
    """
    g, size = gradients(mesh), measures(mesh.points, mesh.cells)
    outer = np.einsum("cip,cjq->cipjq", g, g)
    dot = np.einsum("cip,cjp->cij", g, g)
    unit = np.eye(mesh.dimension, dtype=int)
    shear = np.einsum("cij,pq->cipjq", dot, unit) + outer.transpose(0, 1, 4, 3, 2)
    return np.asarray((material.lame_lambda * outer + material.lame_mu * shear) * size[:, None, None, None, None])


def laplace(mesh: Mesh) -> NDArray[Any]:
    """``int grad u . grad v`` of scalar functions, shape (c, d + 1, d + 1), unit length^(d - 2)."""
    g, size = gradients(mesh), measures(mesh.points, mesh.cells)
    return np.asarray(np.einsum("cip,cjp->cij", g, g) * size[:, None, None])


def mass(mesh: Mesh) -> NDArray[Any]:
    """``int u v`` of scalar functions, shape (c, d + 1, d + 1), unit length^d."""
    d, size = mesh.dimension, measures(mesh.points, mesh.cells)
    pattern = np.ones((d + 1, d + 1), dtype=int) + np.eye(d + 1, dtype=int)
    return np.asarray(size[:, None, None] * pattern / ((d + 1) * (d + 2)))

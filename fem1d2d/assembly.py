"""Stiffness matrix, H1 Gram matrix and load vectors.  Unknown d * node + p is component p at a node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem1d2d import element
from fem1d2d.material import Material
from fem1d2d.mesh import Cells, Floats, Ints, Mesh


def assemble(nodes: Ints, entries: NDArray[np.float64], size: int) -> sp.csc_array:
    """Sum element matrices, shape (c, k, k), of the unknowns ``nodes``, shape (c, k)."""
    nodes = nodes.astype(sp.get_index_dtype(maxval=max(size, entries.size)))  # short ones, as SuperLU takes them
    rows = np.repeat(nodes, nodes.shape[1], axis=1).ravel()
    columns = np.tile(nodes, nodes.shape[1]).ravel()
    return sp.coo_array((entries.ravel(), (rows, columns)), shape=(size, size)).tocsc()


def unknowns(mesh: Cells) -> Ints:
    """The unknowns of each cell, shape (c, d k)."""
    d = mesh.dimension
    return np.asarray((d * mesh.cells[:, :, None] + np.arange(d)).reshape(len(mesh.cells), -1))


def stiffness(mesh: Mesh, material: Material) -> sp.csc_array:
    """``a(u, v)`` of (4.1), shape (d n, d n), unit stress x length^(d - 2)."""
    local, nodes = element.stiffness(mesh, material), unknowns(mesh)
    return assemble(nodes, local.reshape(*nodes.shape, -1).astype(float), mesh.dimension * len(mesh.points))


def gram(mesh: Mesh, length: float = 1.0) -> sp.csc_array:
    """The norm ``int |v|^2 / L^2 + |grad v|^2`` of H1, shape (d n, d n), unit length^(d - 2).

    ``length`` is L, in the unit of length; the paper has L = 1 in the file's unit.  ValueError unless L > 0.
    """
    if not length > 0:
        raise ValueError(f"length {length}: a positive number is needed")
    d = mesh.dimension
    local = (element.laplace(mesh) + element.mass(mesh) / length**2).astype(float)
    # each component has a copy of every cell
    cells = np.concatenate([d * mesh.cells + p for p in range(d)])
    return assemble(cells, np.concatenate([local] * d), d * len(mesh.points))


def body_load(mesh: Mesh, force: Sequence[float], cells: Ints | None = None) -> Floats:
    """``int f . v`` of a constant force f, unit stress / length: shape (n, d), unit stress x length^(d - 1).

    It acts on all cells, or on those whose numbers are given.
    """
    volumes, on = element.element_of(mesh).volumes(mesh).astype(float), mesh.cells
    if cells is not None:
        volumes, on = volumes[cells], on[cells]
    weights = np.bincount(on.ravel(), volumes.ravel(), minlength=len(mesh.points))
    return np.asarray(weights[:, None] * np.asarray(force, dtype=float))


def facet_weights(
    mesh: Mesh, facets: Ints, between: tuple[float, float] | None = None, along: Floats | None = None
) -> Floats:
    """``int v`` over facets for every hat function v, shape (n,), unit length^(d - 1).

    ``facets`` are the nodes of each facet, shape (f, d); in 1D a facet is a point of measure 1.  In 2D ``between`` is
    the part of the x axis over which to integrate; no facet may be vertical then.  ``along`` are other positions of all
    nodes in place of x.
    """
    p = mesh.points[facets].astype(float)
    sizes = np.ones(len(facets)) if mesh.dimension == 1 else np.linalg.norm(p[:, 1] - p[:, 0], axis=1)
    share = np.full(facets.shape, 1 / facets.shape[1])
    if between is not None and mesh.dimension == 2:
        x = p[..., 0] if along is None else along[facets]
        s, t = np.sort([np.clip((end - x[:, 0]) / (x[:, 1] - x[:, 0]), 0, 1) for end in between], axis=0)
        share[:, 1] = (t**2 - s**2) / 2
        share[:, 0] = t - s - share[:, 1]
    return np.asarray(np.bincount(facets.ravel(), (sizes[:, None] * share).ravel(), minlength=len(mesh.points)))

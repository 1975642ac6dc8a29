"""Fixed and prescribed sides: which unknowns are known, and the rigid motions that are left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from fem1d2d.mesh import Bools, Cells, Floats, Mesh, MeshError, edges, place_of, undirected


@dataclass(frozen=True, kw_only=True)
class Supports:
    """Known displacements.

    Attributes
    ----------
    held : bool array, shape (n, d)
    values : float array, shape (n, d)
        Displacement where held (unit of length), 0 elsewhere.
    """

    held: Bools
    values: Floats

    def __post_init__(self) -> None:
        for array in (self.held, self.values):
            array.setflags(write=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Supports, held=self.held, values=self.values), ()


def supports(mesh: Mesh, sides: Mapping[str, Sequence[float | None]]) -> Supports:
    """Collect the displacements that sides prescribe.

    ``sides`` maps names of sides to d displacements in the mesh's unit of length; None leaves a component free.
    MeshError if two sides prescribe different values at a common node.

    Examples
    --------
    >>> from fem1d2d.mesh import interval
    >>> supports(interval((0.0, 1.0), 2), {"left": [0.0]}).held[:, 0]
    array([ True, False, False])
    """
    held = np.zeros(mesh.points.shape, dtype=bool)
    values = np.zeros(mesh.points.shape)
    for name, components in sides.items():
        nodes = np.unique(mesh.sides[name])
        for p, value in enumerate(components):
            if value is None:
                continue
            clash = nodes[held[nodes, p] & (values[nodes, p] != value)]
            if len(clash):
                raise MeshError(
                    f"side {name!r} prescribes {value:g} at {place_of(mesh.points[clash[0]])} where another side"
                    f" prescribes {values[clash[0], p]:g} for the same component"
                )
            held[nodes, p] = True
            values[nodes, p] = value
    return Supports(held=held, values=values)


def rigid_motions(mesh: Mesh, known: Bools) -> Floats:
    """The rigid motions that supports leave: a basis of the kernel of the stiffness matrix of the free unknowns.

    Shape (n, d, k): k orthonormal motions, 0 where ``known``, of shape (n, d), holds; k = 3 for an unsupported plane
    body.  Cells that share a facet move as one piece; pieces that share only a node hinge on it.
    """
    n, d = mesh.points.shape
    piece = pieces(mesh)
    count = int(piece.max()) + 1
    points = mesh.points.astype(float)
    centred = points - points.mean(axis=0)
    modes = np.zeros((n, d, 1 if d == 1 else 3))  # of one piece, evaluated at every node
    for p in range(d):
        modes[:, p, p] = 1
    if d == 2:
        size = np.abs(centred).max()
        modes[:, 0, 2], modes[:, 1, 2] = -centred[:, 1] / size, centred[:, 0] / size
    per_piece = modes.shape[2]
    pairs = np.column_stack(np.divmod(np.unique(mesh.cells * count + piece[:, None]), count))
    home = np.full(n, -1)  # one piece of each node; the others must agree with it there
    home[pairs[::-1, 0]] = pairs[::-1, 1]
    hinge, other = pairs[pairs[:, 1] != home[pairs[:, 0]]].T
    hinged = np.zeros((len(hinge), d, count, per_piece))
    each = np.arange(len(hinge))
    hinged[each, :, home[hinge]], hinged[each, :, other] = modes[hinge], -modes[hinge]
    node, component = np.nonzero(known)
    held = np.zeros((len(node), count, per_piece))
    held[np.arange(len(node)), home[node]] = modes[node, component]
    unknowns = count * per_piece
    matrix = np.concatenate([hinged.reshape(-1, unknowns), held.reshape(-1, unknowns)])
    kernel = np.eye(unknowns)
    if len(matrix):
        if len(matrix) > unknowns:
            matrix = np.asarray(np.linalg.qr(matrix, mode="r"))  # the same kernel, without the size of a long support
        _, values, right = np.linalg.svd(matrix)
        rank = int((values > 1e-9 * np.sqrt(n)).sum())
        kernel = right[rank:].T
    motions = np.einsum("npm,nmk->npk", modes, kernel.reshape(count, per_piece, kernel.shape[1])[home])
    orthonormal, _ = np.linalg.qr(motions.reshape(n * d, kernel.shape[1]))
    return np.asarray(orthonormal.reshape(n, d, kernel.shape[1]))


def pieces(mesh: Cells, *, hinged: bool = False) -> NDArray[np.int64]:
    """The piece of each cell, shape (c,): cells that share a facet lie in the same one; if ``hinged``, or a node."""
    c = len(mesh.cells)
    facets = mesh.cells.T.reshape(-1, 1) if hinged or mesh.dimension == 1 else edges(mesh.cells)
    facet = undirected(facets, len(mesh.points))
    order = np.argsort(facet, kind="stable")  # cells that share a facet become neighbours
    shared = facet[order[1:]] == facet[order[:-1]]
    one, other = order[:-1][shared] % c, order[1:][shared] % c
    touches = sp.coo_array((np.ones(len(one)), (one, other)), shape=(c, c))
    _, piece = connected_components(touches, directed=False)
    return np.asarray(piece, dtype=np.int64)

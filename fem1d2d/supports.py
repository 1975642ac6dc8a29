"""Fixed and prescribed sides: which unknowns are known, and what is left to move rigidly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from fem1d2d.mesh import Floats, Mesh, MeshError


@dataclass(frozen=True, kw_only=True)
class Supports:
    """Known displacements.

    Attributes
    ----------
    known : bool array, shape (n, d)
    values : float array, shape (n, d)
        Displacement where known (unit of length), 0 elsewhere.
    """

    known: NDArray[np.bool_]
    values: Floats


def supports(mesh: Mesh, sides: Mapping[str, Sequence[float | None]]) -> Supports:
    """Collect the displacements that sides prescribe.

    Parameters
    ----------
    sides : mapping from side name to d numbers
        None leaves a component free.

    Raises
    ------
    MeshError
        Two sides prescribe different values at a common node.

    Examples
    --------
    >>> from fem1d2d.mesh import interval
    >>> supports(interval((0.0, 1.0), 2), {"left": [0.0]}).known[:, 0]
    array([ True, False, False])
    """
    known = np.zeros(mesh.points.shape, dtype=bool)
    values = np.zeros(mesh.points.shape)
    for name, components in sides.items():
        nodes = np.unique(mesh.sides[name])
        for p, value in enumerate(components):
            if value is None:
                continue
            clash = nodes[known[nodes, p] & (values[nodes, p] != value)]
            if len(clash):
                where = ", ".join(f"{c:g}" for c in mesh.points[clash[0]].astype(float))
                raise MeshError(
                    f"side {name!r} prescribes {value:g} at ({where}) where another side prescribes "
                    f"{values[clash[0], p]:g} for the same component"
                )
            known[nodes, p] = True
            values[nodes, p] = value
    for array in (known, values):
        array.setflags(write=False)
    return Supports(known=known, values=values)


def rigid_motions(mesh: Mesh, known: NDArray[np.bool_]) -> int:
    """How many independent rigid motions the supports leave to the freest connected piece of the mesh.

    Parameters
    ----------
    known : bool array, shape (n, d)

    Returns
    -------
    int
        0 where the stiffness matrix of the free unknowns is positive definite; 3 for an unsupported plane body.
    """
    n, d = mesh.points.shape
    points = mesh.points.astype(float)
    links = sp.coo_array(
        (np.ones(mesh.cells.size - len(mesh.cells)), (np.repeat(mesh.cells[:, 0], d), mesh.cells[:, 1:].ravel())),
        shape=(n, n),
    )
    pieces, piece = connected_components(links, directed=False)
    free = 0
    for k in range(pieces):
        nodes = np.flatnonzero(piece == k)
        centred = points[nodes] - points[nodes].mean(axis=0)
        size = np.abs(centred).max()
        modes = np.zeros((len(nodes), d, 1 if d == 1 else 3))
        for p in range(d):
            modes[:, p, p] = 1
        if d == 2:
            modes[:, 0, 2], modes[:, 1, 2] = -centred[:, 1] / size, centred[:, 0] / size
        held = modes[known[nodes]]
        rank = int(np.linalg.matrix_rank(held, tol=1e-9 * np.sqrt(len(nodes)))) if len(held) else 0
        free = max(free, modes.shape[2] - rank)
    return free

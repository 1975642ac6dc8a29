"""The mortar transfer between two traces on one line, whose grids need share only the interval they cover."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def mortar(contact: NDArray[Any], neumann: NDArray[Any]) -> NDArray[Any]:
    """P: nodal values on one grid of piecewise linear functions given on another, shape (n_c, n_n).

    ``P = D^-1 M`` with ``M_ji = int psi_j phi_i`` and ``D = diag(int phi_j)`` over the interval of the contact grid,
    exact on the intersections of both grids.  psi_j is the dual basis of the contact grid, on every cell ``2 phi_j``
    minus the other hat function: ``int psi_j phi_k = 0`` for j != k, and ``sum_j psi_j = 1``.  So

    * P reproduces functions that are piecewise linear on the contact grid, constants and rigid motions among them;
    * ``P' w_c = w_n``, where w are integrals of hat functions over that interval: a constant pressure stays constant.

    psi_j is negative in places, and so are some entries of P (none below -1/3).

    Parameters
    ----------
    contact, neumann : array, shapes (n_c,), (n_n,)
        Increasing positions, n_c >= 2; of the second grid all nodes whose hat functions reach into the interval of the
        first, so that the outermost may lie outside.  Rational entries (object arrays) give rational ones.

    Raises
    ------
    ValueError
        The second grid does not cover the interval of the first.

    Examples
    --------
    >>> mortar(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0]))
    array([[1. , 0. ],
           [0.5, 0.5],
           [0. , 1. ]])
    """
    if not (neumann[0] <= contact[0] and contact[-1] <= neumann[-1]):
        covered = [float(grid[end]) for grid in (neumann, contact) for end in (0, -1)]
        raise ValueError("the grid from {:g} to {:g} does not cover that from {:g} to {:g}".format(*covered))
    inside = neumann[(neumann > contact[0]) & (neumann < contact[-1])]
    points = np.unique(np.concatenate([contact, inside]))
    start, end = points[:-1], points[1:]
    cell_c, one_c = _hats(contact, start, end)
    cell_n, one_n = _hats(neumann, start, end)
    M = np.zeros((len(contact), len(neumann)), dtype=points.dtype)
    for j in range(2):
        psi = [2 * a - b for a, b in zip(one_c[j], one_c[1 - j], strict=True)]
        for i in range(2):
            phi = one_n[i]
            product = 2 * (psi[0] * phi[0] + psi[1] * phi[1]) + psi[0] * phi[1] + psi[1] * phi[0]
            np.add.at(M, (cell_c + j, cell_n + i), (end - start) * product / 6)
    return np.asarray(M / M.sum(axis=1)[:, None])  # int psi_j = int phi_j, and the hat functions phi_i add up to 1


def _hats(grid: NDArray[Any], start: NDArray[Any], end: NDArray[Any]) -> tuple[NDArray[np.int64], list[Any]]:
    """The cells of a grid in which segments lie, and both hat functions there at both ends of each segment."""
    cell = np.clip(np.searchsorted(grid, start, side="right") - 1, 0, len(grid) - 2)
    left, right = grid[cell], grid[cell + 1]
    rising = [(x - left) / (right - left) for x in (start, end)]
    return cell, [[1 - value for value in rising], rising]

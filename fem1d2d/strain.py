"""Strains of a displacement on a mesh."""

from __future__ import annotations

import numpy as np

from fem1d2d.element import element_of
from fem1d2d.mesh import Cells, Floats


def largest_strains(mesh: Cells, displacement: Floats) -> Floats:
    """Largest absolute principal strain of each cell, shape (c,), a pure number.

    In the plane the principal strains of eps = (grad u + grad u') / 2 are

        (eps_xx + eps_yy)/2 +- sqrt((eps_xx - eps_yy)^2/4 + eps_xy^2);

    the third one of plane strain is 0.

    Parameters
    ----------
    displacement : array, shape (n, d)
        At the nodes, unit of length.

    Examples
    --------
    >>> from fem1d2d import rectangle
    >>> mesh = rectangle((0.0, 1.0), (0.0, 1.0), (1, 1))
    >>> float(largest_strains(mesh, mesh.points * [0.25, -0.5]).max())
    0.5
    """
    found = []
    for _, gradients in element_of(mesh).points(mesh):
        slopes = np.einsum("cip,ciq->cpq", gradients, displacement[mesh.cells])
        if mesh.dimension == 1:
            found.append(np.abs(slopes[:, 0, 0]))
            continue
        (xx, xy), (yx, yy) = np.moveaxis(slopes, 0, -1)
        found.append(np.abs(xx + yy) / 2 + np.hypot((xx - yy) / 2, (xy + yx) / 2))
    return np.asarray(np.max(found, axis=0))

"""The regularisation S of the friction law, as a matrix on normal nodal forces."""

from __future__ import annotations

from typing import Literal

import numpy as np

from fem1d2d.mesh import Floats


def hat(t: Floats, radius: float) -> Floats:
    """The kernel ``omega_r(t) = max(0, 1 - |t|/r)/r``, of integral 1, unit 1/length.

    Examples
    --------
    >>> hat(np.array([0.0, 0.5, 2.0]), 1.0)
    array([1. , 0.5, 0. ])
    """
    return np.maximum(0.0, 1.0 - np.abs(t) / radius) / radius


def friction_operator(x: Floats, weights: Floats, *, law: Literal["nonlocal", "local"], radius: float | None) -> Floats:
    """S as a matrix: normal nodal forces (force per thickness) to normal stress at the nodes, shape (n, n).

    Non-local: ``(S f)_j = sum_i f_i omega_r(x_j - x_i)``, linear, not renormalised at the ends; S of (2.5).
    Local: ``(S f)_j = f_j / w_j``, Coulomb's law itself, outside the theorem.

    Parameters
    ----------
    x, weights : array, shape (n,)
        Nodes and trapezoid weights, unit of length.
    radius : float or None
        r > 0, needed by the non-local law.

    Raises
    ------
    ValueError
        The non-local law without a positive radius.
    """
    if law == "local":
        return np.diag(1.0 / weights)
    if radius is None or not radius > 0:
        raise ValueError(f"radius {radius}: the non-local law needs a positive radius")
    return hat(x[:, None] - x[None, :], radius)

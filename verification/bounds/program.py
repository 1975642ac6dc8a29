"""The semidefinite program of the bound: the data that the interior-point method and cvxpy both read."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats

#: lambda, tau, a, b by node; lambda alone without friction.  Where something is fixed at nodes, also what multiplies
#: w k zeta v_T, v_N^2, p_N^2, p_T^2 and p_T sqrt(w k) zeta.
Weights = tuple[Floats, ...]


class LMIError(RuntimeError):
    """No multipliers that certify anything were found."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """End of a solver: where it knows s up to ``accuracy``, relatively, or at any s below ``enough``."""

    accuracy: float = 1e-7
    enough: float = -math.inf


#: Of a solver that is asked for the least s alone.
USUAL = Stop()


@dataclass(frozen=True, kw_only=True, eq=False)
class Program:
    """The least s for which ``fixed + s free - sum_i y_i (a_i b_i' + b_i a_i')/2`` is positive semidefinite.

    The multipliers are ``y >= 0``, with ``4 y_a y_b >= y_tau^2`` in each row of ``cones``.

    Attributes
    ----------
    fixed, free : array, shape (d, d)
        Symmetric.
    left, right : array, shape (K, d)
        Their rows are a_i and b_i.
    cones : int array, shape (n, 3)
        Positions of (tau, a, b) among the multipliers.
    most : array, shape (K,)
        Largest multipliers; inf without a limit.
    s, y : float, array of shape (K,)
        A start of a search: the matrix is positive definite there, and every inequality strict.
    highest : float or None
        Where given, the largest s up to it is wanted instead of the least.
    """

    fixed: Floats
    free: Floats
    left: Floats
    right: Floats
    cones: NDArray[np.intp]
    most: Floats
    s: float
    y: Floats
    highest: float | None = None
    stop: Stop = USUAL


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """A solver's answer.

    Attributes
    ----------
    s, y : float, array of shape (K,)
        The value and the multipliers.
    moments : array, shape (d, d)
        The dual variable of the matrix: the second moments of the pairs of forces that are worst for it.
    steps, converged : int, bool
        Number of steps; True if the gap to the dual value is below the accuracy asked for.
    early : (float, array of shape (K,)), optional
        s and y close to the central path and far from its end: a program with more conditions may start there.
    """

    s: float
    y: Floats
    moments: Floats
    steps: int
    converged: bool
    early: tuple[float, Floats] | None = None

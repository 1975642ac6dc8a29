"""One body by its interface stiffness: a matrix, or what its solver does with a vector."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import LinearOperator

from fem1d2d import solver_with_inertia
from fem1d2d.mesh import Floats
from verification.advice import BodyNumber
from verification.advice.seen_matrices import SeenMatrix
from verification.interface.matrices import MOST_ROWS, Stiffness, real_array, stiffness

#: Up to this asymmetry the symmetric part of a matrix is taken, and that is told.
TOLD = 1e-3

#: How far a solve may be from the inverse of the product beside it.
INVERSE = 1e-3

#: The Neumann bodies of the roles, in their order.
BODIES: tuple[BodyNumber, BodyNumber] = (2, 1)

Apply = Callable[[Floats], Floats]


def other(body: BodyNumber) -> BodyNumber:
    """The other body."""
    return 1 if body == 2 else 2


def is_operator(S: Any) -> bool:
    """True for an operator, and for a sparse matrix beyond the size of dense ones."""
    if sp.issparse(S):
        return bool(S.shape[0] > MOST_ROWS)
    return isinstance(S, LinearOperator) or callable(S)


def dense(name: str, matrix: Any) -> Floats:
    """A matrix of real numbers, dense.

    Raises
    ------
    ValueError
    """
    if matrix is None:
        raise ValueError(f"no {name}: needed S1 and S2, or an operator for each")
    array = np.asarray(matrix.toarray() if sp.issparse(matrix) else matrix)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} has no real numbers (numpy type {array.dtype}): needed a matrix of them")
    return np.asarray(array, dtype=float)


@dataclass(frozen=True, kw_only=True)
class Side:
    """One body.

    Attributes
    ----------
    seen : SeenMatrix
    matrix : Stiffness or None
        None of an operator.
    apply, solve : callable or None
        ``u -> S u`` and ``f -> S^-1 f``; None where that is not known.
    """

    seen: SeenMatrix
    matrix: Stiffness | None = None
    apply: Apply | None = None
    solve: Apply | None = None

    @property
    def singular(self) -> str:
        """Why a matrix is singular; empty where it is not, and of an operator."""
        free = 0 if self.matrix is None else self.matrix.motions.shape[1]
        return f"singular ({free} free motion{'s' * (free > 1)})" if free else ""


def of_matrix(body: BodyNumber, S: Any) -> Side:
    """A body by its matrix.

    Raises
    ------
    ValueError
        No stiffness.
    """
    name = f"S{body}"
    S = stiffness(name, dense(name, S), asymmetry=TOLD)
    n, free = len(S.matrix), S.motions.shape[1]
    seen = SeenMatrix(rows=n, form="matrix", asymmetry=S.asymmetry, zeros=S.zeros, free_motions=free)
    return Side(matrix=S, apply=S.matrix.__matmul__, seen=seen)


def rows_of(given: dict[BodyNumber, tuple[Any, Any]], unknowns: Any, transfer: Any) -> dict[int, int]:
    """Number of unknowns of each body on the interface, by what is given of (S, solve).

    Raises
    ------
    ValueError
    """
    told: dict[int, set[int]] = {
        body: {int(thing.shape[0]) for thing in things if hasattr(thing, "shape") and len(thing.shape) == 2}
        for body, things in given.items()
    }
    for body, sizes in told.items():
        if len(sizes) > 1:
            raise ValueError(
                f"S{body} and solve{body} have {' and '.join(map(str, sorted(sizes)))} rows: needed one size"
            )
    if unknowns is not None and not (isinstance(unknowns, int) and unknowns > 0):
        raise ValueError(f"unknowns {unknowns!r}: needed a whole number > 0")
    rows: dict[int, int] = {}
    for body, sizes in told.items():
        others = told[3 - body] if transfer is None else set()
        known = sizes or others or ({unknowns} if unknowns is not None else set())
        if not known:
            raise ValueError(f"functions alone do not tell how many unknowns body {body} has: needed unknowns")
        rows[body] = int(next(iter(known)))
    return rows


def of_solver(body: BodyNumber, S: Any, solve: Any, n: int) -> Side:
    """A body by products and solves with vectors of n numbers, tried on random ones.

    Raises
    ------
    ValueError
        No stiffness, or not its inverse.
    """
    name = f"S{body}"
    apply = _function(name, S, n)
    inverse = _function(f"solve{body}", solve, n)
    side = Side(seen=SeenMatrix(rows=n, form="operator"), apply=apply)
    if S is not None and not is_operator(S):
        side = of_matrix(body, S)
        assert side.matrix is not None
        if inverse is None and not side.singular:
            factor = cho_factor(side.matrix.matrix)
            inverse = lambda f: np.asarray(cho_solve(factor, f))
    elif sp.issparse(S):
        side, inverse = _of_sparse(name, sp.csc_array(S), inverse)
    seen, apply = side.seen, side.apply
    u, v = np.random.default_rng(1).standard_normal((2, n))
    if apply is not None:
        Su, Sv = apply(u), apply(v)
        energies = float(u @ Su), float(v @ Sv)
        if not min(energies) >= 0:
            raise ValueError(f"{name} is not positive (u'Su = {min(energies):.3g} for some u): needed a stiffness")
        if seen.form == "operator":
            scale = np.sqrt(energies[0] * energies[1]) or 1.0
            seen = replace(seen, asymmetry=_symmetric(name, abs(float(u @ Sv - v @ Su)) / scale))
    if inverse is not None and solve is not None:
        Fu, Fv = inverse(u), inverse(v)
        energies = float(u @ Fu), float(v @ Fv)
        if not min(energies) > 0:
            raise ValueError(
                f"solve{body} is not positive (f'u = {min(energies):.3g} for some f): needed the inverse of S"
            )
        _symmetric(f"solve{body}", abs(float(u @ Fv - v @ Fu)) / float(np.sqrt(energies[0] * energies[1])))
        if apply is not None and not (off := float(np.linalg.norm(apply(Fu) - u) / np.linalg.norm(u))) <= INVERSE:
            raise ValueError(
                f"solve{body} is not the inverse of {name}: their product changes a vector by {off:.2g} of it"
            )
    return replace(side, solve=inverse, seen=seen)


def _of_sparse(name: str, S: sp.csc_array, inverse: Apply | None) -> tuple[Side, Apply | None]:
    """A body by a sparse matrix, and solves with its factor where none are given."""
    n = S.shape[0]
    skew = abs(S - S.T).max() / abs(S).max()
    if not skew <= TOLD:
        raise ValueError(f"{name} is not symmetric (|A - A'| is {skew:.2g} of its largest entry): needed a stiffness")
    symmetric = sp.csc_array((S + S.T) / 2)
    full = (S.count_nonzero() - np.count_nonzero(S.diagonal())) / (n * n - n)
    if inverse is None:
        try:
            inverse, negative = solver_with_inertia(symmetric)
        except RuntimeError:  # a pivot is 0
            negative = None
        if negative is None or negative:
            raise ValueError(f"{name} is not positive definite: needed a Schur complement of a stiffness matrix")
    seen = SeenMatrix(rows=n, form="matrix", asymmetry=float(skew), zeros=1 - full, free_motions=0)
    return Side(seen=seen, apply=symmetric.__matmul__), inverse


def _symmetric(name: str, skew: float) -> float:
    if not skew <= TOLD:
        raise ValueError(f"{name} is not symmetric (by {skew:.2g} of its size): needed at most {TOLD:g}")
    return skew


def _function(name: str, given: Any, n: int) -> Apply | None:
    """A product or a solve as a function that is held to vectors of n finite numbers."""
    if given is None:
        return None
    if not callable(given) or isinstance(given, LinearOperator) or sp.issparse(given):
        shape = getattr(given, "shape", None)
        if shape is not None and tuple(shape) != (n, n):
            raise ValueError(f"{name} is {' x '.join(map(str, shape))}: needed {n} x {n}")
        function = given.__matmul__
    else:
        function = given

    def checked(vector: Floats) -> Floats:
        return real_array(f"what {name} returns", np.asarray(function(vector)), (n,))

    return checked

"""Advice from what the solvers of both bodies do with a vector, for interfaces of any size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import LinearOperator

from fem1d2d import extremes_by_solves, solver_with_inertia
from fem1d2d.mesh import Floats
from ndtheory import Number
from verification.advice.given_matrices import (
    BODIES,
    TOLD,
    Body,
    advice_of,
    dense,
    other,
    read_transfer,
    refused_by,
    some_role_left,
    with_seen,
)
from verification.advice.role import Role
from verification.advice.roles import Advice, plain_role
from verification.advice.seen_matrices import SeenLanczos, SeenMatrix
from verification.interface.matrices import MOST_ROWS, real_array, stiffness
from verification.progress import Progress
from verification.threads import one_thread

#: The relative residual of rho at which Lanczos stops: theta changes by less.
ENOUGH = 1e-4

#: How far a solve may be from the inverse of the product beside it.
INVERSE = 1e-3

#: Why Lanczos proves no theta.
WORD_OF_LANCZOS = "rho is a value that Lanczos found: the largest eigenvalue may be larger, so that nothing is proved"

#: The entries of a role that rest on an upper bound of rho.
PROVED = ("theta_proved", "factor_proved", "theta_max_proved")

Apply = Callable[[Floats], Floats]


def is_operator(S: Any) -> bool:
    """Whether it is an operator, or a sparse matrix beyond the size of dense ones."""
    if sp.issparse(S):
        return bool(S.shape[0] > MOST_ROWS)
    return isinstance(S, LinearOperator) or callable(S)


@dataclass(frozen=True, kw_only=True)
class _Side:
    """One body by what can be done with it; None where that is not known."""

    apply: Apply | None
    solve: Apply | None
    seen: SeenMatrix


def of_operators(
    S: tuple[Any, Any],
    solve: tuple[Any, Any],
    unknowns: int | None,
    transfer: Any,
    neumann_body: Body | None,
    tied: bool,
    progress: Progress,
) -> Advice:
    """What :func:`verification.advise_matrices` answers where a body is an operator: (S1, S2), (solve1, solve2)."""
    rows = _rows(dict(zip((1, 2), zip(S, solve, strict=True), strict=True)), unknowns, transfer)
    sides: dict[Body, _Side] = {1: _side(1, S[0], solve[0], rows[1]), 2: _side(2, S[1], solve[1], rows[2])}
    P = read_transfer(transfer, rows, neumann_body)
    refused = refused_by(P)
    for n in BODIES:
        c = other(n)
        if sides[c].apply is None or sides[n].solve is None:
            why = f"needed products with S{c} and solves with S{n} (solve{n})"
            refused.setdefault(n, Role.refused(n, ValueError(why)))
    some_role_left(refused)
    roles, lanczos = [], []
    for n in BODIES:
        if n in refused:
            roles.append(refused[n])
            continue
        apply, solved = sides[other(n)].apply, sides[n].solve
        assert apply is not None  # else the role is refused
        assert solved is not None
        felt = apply if P is None else lambda u, apply=apply, P=P: P.carry_back(apply(P.carry(u)))

        def tell(steps: int, value: float, residual: float, n: Body = n) -> None:
            progress(f"rho, Neumann body {n}: {value:.6g} up to {residual:.1e}, step {steps} of Lanczos", None)

        with one_thread():
            ends = extremes_by_solves(felt, solved, rows[n], tolerance=ENOUGH, progress=tell)
        rho = Fraction(ends.largest.value)
        if not rho > 0:
            raise ValueError(f"S{other(n)} is not positive (rho = {float(rho):.3g}): needed a stiffness")
        role = plain_role(n, rho)
        nothing = dict.fromkeys(PROVED, WORD_OF_LANCZOS)
        least = Number.of_float(max(Fraction(ends.least.value), Fraction(0)))
        unproved: dict[str, Any] = dict.fromkeys(PROVED)
        roles.append(replace(role, **unproved, reason={**role.reason, **nothing}, rho_min=least, rho_tied=role.rho))
        lanczos.append(
            SeenLanczos(
                neumann_body=n,
                rho=ends.largest.value,
                residual=ends.largest.residual,
                rho_min=ends.least.value,
                residual_min=ends.least.residual,
                steps=ends.steps,
            )
        )
    seen = {body: side.seen for body, side in sides.items()}
    return with_seen(advice_of(tuple(roles), tied=tied), seen, P, lanczos=tuple(lanczos))


def _rows(given: dict[Any, Any], unknowns: Any, transfer: Any) -> dict[int, int]:
    """How many unknowns each body has on the interface."""
    told = {
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


def _side(body: Body, S: Any, solve: Any, n: int) -> _Side:
    """Products and solves of one body, tried on random vectors."""
    name = f"S{body}"
    apply = _function(name, S, n)
    inverse = _function(f"solve{body}", solve, n)
    seen = SeenMatrix(rows=n, form="operator")
    if S is not None and not is_operator(S):
        matrix = stiffness(name, dense(name, S), asymmetry=TOLD)
        free = matrix.motions.shape[1]
        seen = SeenMatrix(rows=n, form="matrix", asymmetry=matrix.asymmetry, zeros=matrix.zeros, free_motions=free)
        apply = matrix.matrix.__matmul__
        if inverse is None and not free:
            factor = cho_factor(matrix.matrix)
            inverse = lambda f: np.asarray(cho_solve(factor, f))
    elif sp.issparse(S):
        S = sp.csc_array(S)
        skew = abs(S - S.T).max() / abs(S).max()
        if not skew <= TOLD:
            raise ValueError(
                f"{name} is not symmetric (|A - A'| is {skew:.2g} of its largest entry): needed a stiffness"
            )
        symmetric = sp.csc_array((S + S.T) / 2)
        full = (S.count_nonzero() - np.count_nonzero(S.diagonal())) / (n * n - n)
        seen = SeenMatrix(rows=n, form="matrix", asymmetry=float(skew), zeros=1 - full, free_motions=0)
        apply = symmetric.__matmul__
        if inverse is None:
            try:
                inverse, negative = solver_with_inertia(symmetric)
            except RuntimeError:  # a pivot is 0
                negative = None
            if negative is None or negative:
                raise ValueError(f"{name} is not positive definite: needed a Schur complement of a stiffness matrix")
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
    return _Side(apply=apply, solve=inverse, seen=seen)


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

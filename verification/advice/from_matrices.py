"""Advice from the interface matrices of any code, or from what its solvers do with a vector."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator

from fem1d2d import largest
from fem1d2d.mesh import Floats
from ndtheory import Number
from verification.advice.from_operators import is_operator, of_operators
from verification.advice.given_matrices import (
    BODIES,
    TOLD,
    Body,
    Transfer,
    advice_of,
    dense,
    other,
    read_transfer,
    refused_by,
    some_role_left,
    with_seen,
)
from verification.advice.role import Role, with_both_ends
from verification.advice.roles import Advice, advise, plain_role
from verification.advice.seen_matrices import SeenMatrix
from verification.interface.build import build
from verification.interface.friction import Nonlocal, hat
from verification.interface.matrices import Stiffness, real_array, size, stiffness
from verification.progress import Progress, silent
from verification.threads import one_thread


def advise_matrices(
    S1: Any = None,
    S2: Any = None,
    *,
    solve1: Any = None,
    solve2: Any = None,
    unknowns: int | None = None,
    transfer: Any = None,
    neumann_body: Body | None = None,
    friction: Any = None,
    x: Any = None,
    x_neumann: Any = None,
    weights: Any = None,
    radius: float | None = None,
    kernel: Any = None,
    tied: bool = False,
    progress: Progress = silent,
) -> Advice:
    """Advice from the interface stiffness of both bodies: matrices, or operators for interfaces of any size.

    ``rho = lambda_max(P' S_c P, S_n)``, c the contact body and n the body with the Neumann problem.  Each assignment of
    the roles is refused alone: where the Neumann body can move rigidly, where P leads the other way, where an operator
    is missing.

    Without friction rho does not depend on the ordering of the unknowns, so long as both bodies have the same.  With
    friction, or a transfer of values at nodes, vectors list all tangential components from left to right, then all
    normal ones along y, from body 1 to body 2.

    Parameters
    ----------
    S1, S2 : array, sparse array, LinearOperator or callable
        Schur complements of bodies 1 and 2 on the interface, or ``u -> S u``.  Symmetric, positive semidefinite; a
        matrix may be asymmetric by TOLD of its largest entry.
    solve1, solve2 : callable, LinearOperator or matrix, optional
        ``f -> S1^-1 f`` and ``f -> S2^-1 f``, as a solver with the Neumann problem of that body does them: S1 and
        solve2 suffice for the role in which body 2 has the Neumann problem.  A matrix S needs none.
    unknowns : int, optional
        The size of the vectors, where functions alone are given.
    transfer : array, sparse array or LinearOperator, optional
        P: from the unknowns of the Neumann body to those of the contact body, or from one component at its nodes.
    neumann_body : {1, 2}, optional
        From whose unknowns P leads; without it the shape of P decides, and 2 where both bodies have as many.
    friction : number, optional
        k >= 0; needs matrices of two components at each node, and ``radius`` with ``x`` or ``kernel``.
    x : array, optional
        Positions of the nodes of the contact body, increasing.
    x_neumann : array, optional
        Those of the Neumann body, where a transfer joins the grids and ``radius`` is given.
    weights : array, optional
        Of the quadrature on ``x``; those of the trapezoid rule by default.
    radius : number, optional
        Of the hat kernel.
    kernel : array, optional
        The operator S of the law of friction as :func:`verification.build` takes it, in place of ``radius``.
    tied : bool
        Whether to advise by what holds where nothing opens or slips.
    progress : callable
        Told steps, value and residual of Lanczos.

    Returns
    -------
    Advice

    Raises
    ------
    ValueError
        Matrices or operators that are no stiffness, that do not fit, or leave no role.

    Examples
    --------
    >>> import numpy as np
    >>> found = advise_matrices(np.diag([3.0, 2.0]), np.eye(2))
    >>> found.neumann_body, round(found.best.theta_predicted, 3)
    (1, 0.8)

    Body 1 by products and body 2 by solves, as a coupling has them:

    >>> found = advise_matrices(lambda u: 3 * u, solve2=lambda f: f / 4, unknowns=1000)
    >>> found.neumann_body, round(found.best.rho.value, 9)
    (2, 0.75)
    """
    if neumann_body not in (None, 1, 2):
        raise ValueError(f"neumann_body {neumann_body!r}: needed 1 or 2")
    beside = {"x": x, "x_neumann": x_neumann, "weights": weights, "radius": radius, "kernel": kernel}
    if friction is None and (left := [name for name, value in beside.items() if value is not None]):
        raise ValueError(f"{left[0]} without friction: needed both, or neither")
    if (
        solve1 is not None
        or solve2 is not None
        or isinstance(transfer, LinearOperator)
        or is_operator(S1)
        or is_operator(S2)
    ):
        if friction is not None:
            raise ValueError("friction with an operator: needed S1, S2 and the transfer as matrices")
        return of_operators((S1, S2), (solve1, solve2), unknowns, transfer, neumann_body, tied, progress)
    one, two = (stiffness(name, dense(name, S), asymmetry=TOLD) for name, S in (("S1", S1), ("S2", S2)))
    return _of_matrices({1: one, 2: two}, transfer, neumann_body, friction, beside, tied)


# --- matrices ---------------------------------------------------------------------------------------------------------


def _of_matrices(
    given: dict[Body, Stiffness],
    transfer: Any,
    neumann_body: Body | None,
    friction: Any,
    beside: dict[str, Any],
    tied: bool,
) -> Advice:
    P = read_transfer(transfer, {body: len(S.matrix) for body, S in given.items()}, neumann_body)
    refused = refused_by(P)
    for body, S in given.items():
        if S.motions.shape[1]:
            free = f"{S.motions.shape[1]} free motion{'s' if S.motions.shape[1] > 1 else ''}"
            why = f"S{body} is singular ({free}): its supports do not hold body {body} in a Neumann problem"
            refused.setdefault(body, Role.refused(body, ValueError(why)))
            refused[body] = replace(refused[body], singular=True)
    some_role_left(refused)
    if friction is None:
        roles = tuple(refused.get(body) or _role(body, given, P) for body in BODIES)
        found = advice_of(roles if P is not None or refused else with_both_ends(roles), tied=tied)
    else:
        found = _with_friction(given, P, 1 if 2 in refused else 2, friction, beside, tied)
        found = replace(found, roles=tuple(refused.get(role.neumann_body or 2, role) for role in found.roles))
    seen = {
        body: SeenMatrix(
            rows=len(S.matrix), form="matrix", asymmetry=S.asymmetry, zeros=S.zeros, free_motions=S.motions.shape[1]
        )
        for body, S in given.items()
    }
    return with_seen(found, seen, P, ordered=friction is not None)


def _role(body: Body, given: dict[Body, Stiffness], P: Transfer | None) -> Role:
    """The role in which a body has the Neumann problem, by the spectrum of (P' S_c P, S_n)."""
    units = [float(np.abs(S.matrix).max()) for S in (given[other(body)], given[body])]
    S_c, S_n = (S.matrix / unit for S, unit in zip((given[other(body)], given[body]), units, strict=True))
    if P is not None:
        S_c = P.carry_back(P.carry_back(S_c).T)
        S_c = (S_c + S_c.T) / 2
    unit = Fraction(units[0]) / Fraction(units[1])
    with one_thread():
        role = plain_role(body, Fraction(largest(S_c, S_n).value) * unit)
        if P is None and not given[other(body)].motions.size:
            return role  # the eigenvalues of both roles are reciprocal
        least = max(float(eigh(S_c, S_n, eigvals_only=True, subset_by_index=[0, 0])[0]), 0.0)
    return replace(role, rho_min=Number.of_float(Fraction(least) * unit), rho_tied=role.rho)


def _with_friction(
    given: dict[Body, Stiffness],
    P: Transfer | None,
    neumann_body: Body,
    friction: Any,
    beside: dict[str, Any],
    tied: bool,
) -> Advice:
    x, x_neumann, weights, radius, kernel = beside.values()
    for body, S in given.items():
        if len(S.matrix) % 2:
            raise ValueError(f"S{body} is {size(S.matrix)}: needed two components at each node, as there is friction")
    if (radius is None) == (kernel is None):
        raise ValueError("friction: needed a radius with x, or a kernel with weights or x, and not both")
    if kernel is None and x is None:
        raise ValueError("friction with a radius: needed x, the positions of the nodes of the contact body")
    if kernel is not None and x is None and weights is None:
        raise ValueError("friction with a kernel: needed weights of its nodes, or x, their positions")
    n = len(given[other(neumann_body)].matrix) // 2
    positions = np.arange(float(n)) if x is None else x  # beside weights and a kernel they mean nothing
    matrix = None if P is None else _of_nodes(P, n)
    law = None
    if radius is not None and matrix is None:
        law = Nonlocal(radius=radius)
    elif radius is not None and matrix is not None:
        if x_neumann is None:
            raise ValueError("friction with a transfer: needed a kernel, or x_neumann beside the radius")
        Nonlocal(radius=radius)  # refuses what is no radius
        x_n = real_array("x_neumann", x_neumann, (matrix.shape[1],))
        kernel = hat(real_array("x", x, (n,))[:, None] - x_n[None, :], radius)
    pair = build(
        S1=given[1].matrix,
        S2=given[2].matrix,
        x=positions,
        weights=weights,
        law=law,
        kernel=_plain(kernel),
        transfer=matrix,
        friction=friction,
        neumann_body=neumann_body,
    )
    found = advise(pair, tied=tied)
    return replace(
        found, roles=tuple(replace(role, theta_auto=None) for role in found.roles)
    )  # there is no problem file


def _plain(matrix: Any) -> Any:
    return matrix.toarray() if sp.issparse(matrix) else matrix


def _of_nodes(P: Transfer, n: int) -> Floats:
    """P of one component at the nodes."""
    whole = np.asarray(_plain(P.P), dtype=float)
    if P.components == 2:
        return whole
    m = whole.shape[1] // 2
    part = whole[:n, :m]
    if P.components != 1 or not np.array_equal(whole, np.kron(np.eye(2), part)):
        raise ValueError("the transfer mixes components: needed one of values at nodes, as there is friction")
    return part

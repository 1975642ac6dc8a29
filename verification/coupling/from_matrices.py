"""Advice from the interface matrices of any code, or from products and solves of its solvers."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator

from fem1d2d import extremes_by_solves, largest
from fem1d2d.mesh import Floats
from ndtheory import Number
from verification.coupling.advice import Advice
from verification.coupling.from_problems import ALL, of_problem
from verification.coupling.kinds import BodyNumber, Kind, kind_of
from verification.coupling.roles import Role, plain_role, role_on, with_both_ends
from verification.coupling.sides import (
    BODIES,
    ORDERING,
    TOLD,
    Matrices,
    SeenLanczos,
    Side,
    Transfer,
    is_operator,
    of_matrix,
    of_solver,
    other,
    read_transfer,
    rows_of,
)
from verification.coupling.spectrum import Spectrum
from verification.interface.build import build
from verification.interface.friction import Nonlocal, hat
from verification.interface.matrices import ASYMMETRY, real_array, size
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread

#: The relative residual of rho at which Lanczos stops: theta changes by less.
ENOUGH = 1e-4

#: Why Lanczos proves no theta.
WORD_OF_LANCZOS = "rho is a value that Lanczos found: the largest eigenvalue may be larger, so that nothing is proved"

#: Why nothing is proved of matrices that are not symmetric.
WORD_OF_ASYMMETRY = "the matrices are not symmetric: no theorem applies"

Sides = dict[BodyNumber, Side]


def advise_matrices(
    S1: Any = None,
    S2: Any = None,
    *,
    solve1: Any = None,
    solve2: Any = None,
    unknowns: int | None = None,
    transfer: Any = None,
    neumann_body: BodyNumber | None = None,
    friction: Any = None,
    x: Any = None,
    x_neumann: Any = None,
    weights: Any = None,
    radius: float | None = None,
    kernel: Any = None,
    tied: bool = False,
    kind: str | Kind | None = None,
    parallel: bool = False,
    progress: Progress = silent,
) -> Advice:
    """Advice from the interface stiffness of both bodies: matrices, or operators for interfaces of any size.

    ``rho = lambda_max(P' S_c P, S_n)``, c the contact body and n the body with the Neumann problem.  Each assignment of
    the roles is refused separately: where the Neumann body can move rigidly, where P leads the other way, where an
    operator is missing.

    Without friction rho does not depend on the ordering of the unknowns, so long as both bodies have the same.  With
    friction, or a transfer of values at nodes, vectors list all tangential components from left to right, then all
    normal ones along y, from body 1 to body 2.

    Parameters
    ----------
    S1, S2 : array, sparse array, LinearOperator or callable
        Schur complements of bodies 1 and 2 on the interface, or ``u -> S u``.  Symmetric, positive semidefinite.  If a
        matrix is asymmetric by up to 0.001 of its largest entry, its symmetric part is taken.  Without friction a
        matrix may be asymmetric by more, as with convection, if its symmetric part is positive definite: eigenvalues
        are complex then, exact for a linear coupling, and nothing is proved.
    solve1, solve2 : callable, LinearOperator or matrix, optional
        ``f -> S1^-1 f`` and ``f -> S2^-1 f``, as a solver with the Neumann problem of that body does them: S1 and
        solve2 suffice for the role in which body 2 has the Neumann problem.  A matrix S needs none.
    unknowns : int, optional
        The size of the vectors, where only functions are given.
    transfer : array, sparse array or LinearOperator, optional
        P: from the unknowns of the Neumann body to the unknowns of the contact body, or for one component at nodes.
    neumann_body : {1, 2}, optional
        The body from whose unknowns P leads; by default the shape of P decides, and body 2 where both have as many.
    friction : number or array, optional
        k >= 0, one number or one for each contact node; needs matrices of two components at each node, and ``radius``
        with ``x`` or ``kernel``.
    x : array, optional
        Positions of the nodes of the contact body, increasing.
    x_neumann : array, optional
        Positions of the nodes of the Neumann body, if a transfer joins the grids and ``radius`` is given.
    weights : array, optional
        Weights of the quadrature on ``x``; by default the trapezoid rule.
    radius : number, optional
        Radius of the hat kernel.
    kernel : array, optional
        The operator S of the law of friction as :func:`verification.build` takes it, in place of ``radius``.
    tied : bool
        True to advise for an interface where nothing opens or slips.
    kind : {'contact', 'tied', 'general'}, optional
        The kind of the coupling; of kind general eigenvalues of asymmetric matrices may be below 0.
    parallel : bool
        True if both solvers run at once.
    progress : callable
        Called with steps, value and residual of Lanczos.

    Returns
    -------
    Advice

    Raises
    ------
    ValueError
        Matrices or operators that are not a stiffness, do not fit, or leave no role; an unknown kind, or kind
        general with friction.

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
    of = kind_of(kind, tied=tied, parallel=parallel)
    if friction is not None and not of.signed:
        raise ValueError("friction with kind general: needed kind contact or tied")
    if neumann_body not in (None, 1, 2):
        raise ValueError(f"neumann_body {neumann_body!r}: needed 1 or 2")
    beside = {"x": x, "x_neumann": x_neumann, "weights": weights, "radius": radius, "kernel": kernel}
    if friction is None and (left := [name for name, value in beside.items() if value is not None]):
        raise ValueError(f"{left[0]} without friction: needed both, or neither")
    given: dict[BodyNumber, tuple[Any, Any]] = {1: (S1, solve1), 2: (S2, solve2)}
    functions = isinstance(transfer, LinearOperator) or any(
        is_operator(S) or solve is not None for S, solve in given.values()
    )
    if functions and not of.signed:
        raise ValueError("kind general with an operator: needed S1 and S2 as matrices, or vectors of a run")
    if functions and friction is not None:
        raise ValueError("friction with an operator: needed S1, S2 and the transfer as matrices")
    if functions:
        rows = rows_of(given, unknowns, transfer)
        sides = {body: of_solver(body, S, solve, rows[body]) for body, (S, solve) in given.items()}
    else:
        sides = {body: of_matrix(body, S, general=friction is None) for body, (S, _) in given.items()}
    P = read_transfer(transfer, {body: side.seen.rows for body, side in sides.items()}, neumann_body)
    refused = _refused(sides, P, functions)
    lanczos: list[SeenLanczos] = []
    if friction is None:
        roles = {body: _by_eigenvalues(body, sides, P, of) for body in BODIES if body not in refused and not functions}
        for body in BODIES:
            if functions and body not in refused:
                roles[body], seen = _by_lanczos(body, sides, P, progress)
                lanczos.append(seen)
        both = tuple((refused | roles)[body] for body in BODIES)
        if all(role.rho is None for role in both):
            raise ValueError(f"body 1: {both[0].reason['rho']}; body 2: {both[1].reason['rho']}")
        symmetric = all(side.seen.asymmetry is None or side.seen.asymmetry <= TOLD for side in sides.values())
        if not functions and P is None and not refused and symmetric:
            both = with_both_ends(both)
        known: dict[str, Any] = {"kind": of}
    else:
        pair = _with_friction(sides, P, 1 if 2 in refused else 2, friction, beside)
        of_pair = of_problem(pair, tied=of.linear)
        known = {"kind": of} | {name: getattr(of_pair, name) for name in ("friction", "outside")}
        # without a problem file "auto" has no meaning
        both = tuple(refused.get(role.neumann_body or 2, replace(role, theta_auto=None)) for role in of_pair.spectra())
    ordered = friction is not None or (P is not None and P.components > 1)
    matrices = Matrices(
        roles=both,
        S1=sides[1].seen,
        S2=sides[2].seen,
        transfer=None if P is None else (int(P.P.shape[0]), int(P.P.shape[1])),
        neumann_body=None if P is None else P.neumann_body,
        ordering=ORDERING if ordered else None,
        lanczos=tuple(lanczos),
        notes=tuple(
            [note for body in (1, 2) for note in sides[body].seen.notes(f"S{body}", ASYMMETRY)]
            + ([] if P is None else P.notes)
        ),
        **known,
    )
    return Advice.of(matrices)


def _refused(sides: Sides, P: Transfer | None, functions: bool) -> dict[BodyNumber, Role]:
    """Refused roles: P does not belong to them, the Neumann body can move, or a product or solve is missing.

    Raises
    ------
    ValueError
        No role is left.
    """
    refused: dict[BodyNumber, Role] = {}
    if P is not None:
        n, c = other(P.neumann_body), P.neumann_body
        why = f"needed its own transfer, from the unknowns of body {n} to those of body {c};"
        refused[n] = Role.refused(n, ValueError(f"{why} P' carries forces back, and no displacements"))
    for n, side in sides.items():
        c = other(n)
        if functions and (sides[c].apply is None or side.solve is None):
            why = f"needed products with S{c} and solves with S{n} (solve{n})"
            refused.setdefault(n, Role.refused(n, ValueError(why)))
        elif not functions and side.singular:
            why = f"S{n} is {side.singular}: its supports do not hold body {n} in a Neumann problem"
            refused[n] = replace(refused.get(n) or Role.refused(n, ValueError(why)), singular=True)
    if len(refused) == 2:
        raise ValueError("; ".join(f"body {body}: {refused[body].reason['rho']}" for body in sorted(refused)))
    return refused


def _by_eigenvalues(body: BodyNumber, sides: Sides, P: Transfer | None, kind: Kind) -> Role:
    """The role in which a body has the Neumann problem, by the eigenvalues of (P' S_c P, S_n), which may be complex."""
    contact, neumann = sides[other(body)].matrix, sides[body].matrix
    assert contact is not None
    assert neumann is not None
    units = [float(np.abs(S.matrix).max()) for S in (contact, neumann)]
    S_c, S_n = contact.matrix / units[0], neumann.matrix / units[1]
    unit = Fraction(units[0]) / Fraction(units[1])
    if max(side.asymmetry for side in (contact, neumann)) > TOLD:
        S_c = S_c if P is None else P.carry_back(P.carry_back(S_c.T).T)
        with one_thread():
            spectrum = Spectrum.of(np.linalg.eigvals(np.linalg.solve(S_n, S_c)) * float(unit))
        if not (spectrum.parallel() if kind.parallel else spectrum).theta:
            return Role.refused(
                body, ValueError(f"no theta above 0 converges, by eigenvalues from {spectrum.low:.3g} on")
            )
        return role_on(body, spectrum, least=kind.least, nothing=WORD_OF_ASYMMETRY)
    if P is not None:
        S_c = P.carry_back(P.carry_back(S_c).T)
        S_c = (S_c + S_c.T) / 2
    with one_thread():
        role = plain_role(body, Fraction(largest(S_c, S_n).value) * unit)
        reciprocal = P is None and not contact.motions.size  # the eigenvalues of both roles
        whole = len(S_n) <= ALL
        if whole or not reciprocal:
            values = np.maximum(eigh(S_c, S_n, eigvals_only=True), 0.0)  # of one that is multiple LAPACK finds none
        if whole:
            role = replace(role, spectrum=Spectrum.of(values * float(unit)))
        if reciprocal:
            return role
    least = float(values[0])
    return replace(role, rho_min=Number.of_float(Fraction(least) * unit), rho_tied=role.rho)


def _by_lanczos(body: BodyNumber, sides: Sides, P: Transfer | None, progress: Progress) -> tuple[Role, SeenLanczos]:
    """The same by products with one body and solves with the other."""
    apply, solve = sides[other(body)].apply, sides[body].solve
    assert apply is not None  # else the role is refused
    assert solve is not None
    felt = apply if P is None else lambda u: P.carry_back(apply(P.carry(u)))

    tell = lambda steps, value, residual: progress(
        f"rho, Neumann body {body}: {value:.6g} up to {residual:.1e}, step {steps} of Lanczos", None
    )
    with one_thread():
        ends = extremes_by_solves(felt, solve, sides[body].seen.rows, tolerance=ENOUGH, progress=tell)
    rho = Fraction(ends.largest.value)
    if not rho > 0:
        raise ValueError(f"S{other(body)} is not positive (rho = {float(rho):.3g}): needed a stiffness")
    role = plain_role(body, rho, nothing=WORD_OF_LANCZOS)
    role = replace(role, rho_min=Number.of_float(max(Fraction(ends.least.value), Fraction(0))), rho_tied=role.rho)
    return role, SeenLanczos(
        neumann_body=body,
        rho=ends.largest.value,
        residual=ends.largest.residual,
        rho_min=ends.least.value,
        residual_min=ends.least.residual,
        steps=ends.steps,
    )


def _with_friction(
    sides: Sides, P: Transfer | None, neumann_body: BodyNumber, friction: Any, beside: dict[str, Any]
) -> ContactPair:
    x, x_neumann, weights, radius, kernel = beside.values()
    one, two = (side.matrix for side in (sides[1], sides[2]))
    assert one is not None
    assert two is not None
    for body, S in ((1, one), (2, two)):
        if len(S.matrix) % 2:
            raise ValueError(f"S{body} is {size(S.matrix)}: needed two components at each node, as there is friction")
    if (radius is None) == (kernel is None):
        raise ValueError("friction: needed a radius with x, or a kernel with weights or x, and not both")
    if kernel is None and x is None:
        raise ValueError("friction with a radius: needed x, the positions of the nodes of the contact body")
    if kernel is not None and x is None and weights is None:
        raise ValueError("friction with a kernel: needed weights of its nodes, or x, their positions")
    n = sides[other(neumann_body)].seen.rows // 2
    positions = np.arange(float(n)) if x is None else x  # beside weights and a kernel they mean nothing
    matrix = None if P is None else _of_nodes(P, n)
    law = None
    if radius is not None and matrix is None:
        law = Nonlocal(radius=radius)
    elif radius is not None and matrix is not None:
        if x_neumann is None:
            raise ValueError("friction with a transfer: needed a kernel, or x_neumann beside the radius")
        Nonlocal(radius=radius)  # refuses a number that cannot be a radius
        x_n = real_array("x_neumann", x_neumann, (matrix.shape[1],))
        kernel = hat(real_array("x", x, (n,))[:, None] - x_n[None, :], radius)
    return build(
        S1=one.matrix,
        S2=two.matrix,
        x=positions,
        weights=weights,
        law=law,
        kernel=kernel,
        transfer=matrix,
        friction=friction,
        neumann_body=neumann_body,
    )


def _of_nodes(P: Transfer, n: int) -> Floats:
    """P of one component at the nodes."""
    whole: Floats = P.P.toarray() if sp.issparse(P.P) else P.P
    if P.components == 2:
        return whole
    m = whole.shape[1] // 2
    part = whole[:n, :m]
    if P.components != 1 or not np.array_equal(whole, np.kron(np.eye(2), part)):
        raise ValueError("the transfer mixes components: needed one of values at nodes, as there is friction")
    return part

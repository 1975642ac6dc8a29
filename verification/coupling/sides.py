"""Both bodies by the interface stiffness that was given, as matrices or operators, and the transfer between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import LinearOperator

from fem1d2d import MeshError, solver_with_inertia
from fem1d2d.condense import Apply
from fem1d2d.mesh import Floats
from ndtheory.keys import Part, key
from verification.coupling.evidence import Evidence
from verification.coupling.kinds import BodyNumber
from verification.coupling.roles import Role
from verification.interface.matrices import MOST_ROWS, Stiffness, real_array, size, stiffness

#: Up to this asymmetry the symmetric part of a matrix is taken, with a note.
TOLD = 1e-3

#: How far a solve may be from the inverse of the product beside it.
INVERSE = 1e-3

#: From this share of zeros off the diagonal on a matrix looks assembled.  A Schur complement on an interface of which
#: the components do not act on each other has up to 2/3; linear triangles at 60 unknowns have 3/4 and more.
SPARSE = 0.75

#: The ordering that is assumed where it matters.
ORDERING = "tangential components from left to right, then normal ones"

#: The Neumann bodies of the roles, in their order.
BODIES: tuple[BodyNumber, BodyNumber] = (2, 1)


_NO_ENTRIES: dict[str, Any] = {"null": "of an operator", "why": "an operator tells no entries", "default": None}

# --- in documents -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class SeenMatrix(Part):
    """One matrix or operator."""

    part: ClassVar[str] = "Given stiffness"

    rows: int = key("unknowns on the interface", unit="1")
    form: Literal["matrix", "operator"] = key("`matrix` or `operator`")
    asymmetry: float | None = key(
        r"the largest entry of $S - S^\top$ over the largest entry of $S$; for an operator estimated with two random "
        "vectors",
        unit="1",
        null="where only its solves are given",
        why="known by its solves alone",
        default=None,
    )
    zeros: float | None = key("share of zeros off the diagonal", unit="1", **_NO_ENTRIES)
    free_motions: int | None = key("rigid motions that the supports leave", unit="1", **_NO_ENTRIES)

    def notes(self, name: str, rounding: float) -> list[str]:
        """Warnings for the user; an asymmetry up to ``rounding`` is rounding."""
        found = []
        if self.asymmetry is not None and self.asymmetry > rounding:
            taken = "its symmetric part is taken" if self.form == "matrix" else "no residual means less than that"
            if self.form == "matrix" and self.asymmetry > TOLD:
                taken = "eigenvalues may be complex, and no theorem applies"
            found.append(f"{name} is asymmetric by {self.asymmetry:.2g} of its largest entry: {taken}")
        if self.zeros is not None and self.zeros >= SPARSE:
            found.append(
                f"{100 * self.zeros:.0f} % of the entries of {name} off the diagonal are 0, as in an assembled"
                f" stiffness matrix ({100 * SPARSE:.0f} % or more); a Schur complement on the interface is dense."
                "  If it is the matrix of a whole body, condense it first: rho below is not the coupling's"
            )
        return found


_FOUND = (
    "the largest and the least value found: the largest eigenvalue is at least the one, the least at most the other"
)
_RESIDUAL = "some eigenvalue lies within it of the value; not that it is the last one"


@dataclass(frozen=True, kw_only=True)
class SeenLanczos(Part):
    """The ends of the spectrum of (S_c, S_n) for one role, by Lanczos, which finds Rayleigh quotients."""

    neumann_body: BodyNumber = key(type="integer")
    rho: float = key(_FOUND, unit="1")
    residual: float = key(_RESIDUAL, unit="1")
    rho_min: float = key(_FOUND, unit="1")
    residual_min: float = key(_RESIDUAL, unit="1")
    steps: int = key("products with the contact body", unit="1")


@dataclass(frozen=True, kw_only=True)
class Matrices(Evidence):
    """The matrices or operators that were given, and the ``roles`` that they have."""

    roles: tuple[Role, ...]
    S1: SeenMatrix = key("those of bodies 1 and 2")
    S2: SeenMatrix = key("those of bodies 1 and 2")
    transfer: tuple[int, int] | None = key(
        "rows and columns of $P$", unit="1", null="without a transfer", why="no transfer was given", default=None
    )
    neumann_body: BodyNumber | None = key(
        "the body from whose unknowns $P$ leads",
        type="integer",
        null="without a transfer",
        why="no transfer was given",
        default=None,
    )
    ordering: str | None = key(
        "the ordering of the unknowns that is assumed",
        null=r"where $\rho$ does not depend on it",
        why="rho does not depend on it, so long as both have the same",
        default=None,
    )
    lanczos: tuple[SeenLanczos, ...] = key(
        r"one for each role whose $\rho$ Lanczos found; empty where matrices gave the whole spectrum", default=()
    )
    notes: tuple[str, ...] = key(
        "what a user should know: asymmetry, zeros as of an assembled matrix, which way $P$ was read", default=()
    )

    def spectra(self) -> tuple[Role, ...]:
        """Both roles, as they were measured."""
        return self.roles


# --- one body ---------------------------------------------------------------------------------------------------------


def other(body: BodyNumber) -> BodyNumber:
    """The other body."""
    return 1 if body == 2 else 2


def is_operator(S: Any) -> bool:
    """True for an operator, and for a sparse matrix beyond the size of dense ones."""
    if sp.issparse(S):
        return bool(S.shape[0] > MOST_ROWS)
    return isinstance(S, LinearOperator) or callable(S)


def dense(name: str, matrix: Any, needed: str = "a matrix of real numbers") -> Floats:
    """A matrix of real numbers, dense, in any unit."""
    if matrix is None:
        raise ValueError(f"no {name}: needed S1 and S2, or an operator for each")
    return real_array(name, matrix, (None, None), needed, most=np.inf)


def sparse(name: str, matrix: Any) -> sp.csc_array | None:
    """A sparse matrix of real numbers; None where it is not sparse."""
    if not sp.issparse(matrix):
        return None
    found = sp.csc_array(matrix)
    found.data = real_array(name, found.data, found.data.shape, "real numbers", most=np.inf)
    return found


@dataclass(frozen=True, kw_only=True)
class Side:
    """One body: its matrix, None of an operator, and ``u -> S u`` and ``f -> S^-1 f``, None if not known."""

    seen: SeenMatrix
    matrix: Stiffness | None = None
    apply: Apply | None = None
    solve: Apply | None = None

    @property
    def singular(self) -> str:
        """Why a matrix is singular; empty where it is not, and of an operator."""
        free = 0 if self.matrix is None else self.matrix.motions.shape[1]
        return f"singular ({free} free motion{'s' * (free > 1)})" if free else ""


def of_matrix(body: BodyNumber, S: Any, *, general: bool = False) -> Side:
    """A body by its matrix; a ``general`` one may be asymmetric.

    Raises
    ------
    ValueError
        No stiffness.
    """
    name = f"S{body}"
    S = stiffness(name, dense(name, S, "a square matrix of real numbers"), asymmetry=TOLD, general=general)
    n, free = len(S.matrix), S.motions.shape[1]
    seen = SeenMatrix(rows=n, form="matrix", asymmetry=S.asymmetry, zeros=S.zeros, free_motions=free)
    return Side(matrix=S, apply=S.matrix.__matmul__, seen=seen)


def rows_of(given: dict[BodyNumber, tuple[Any, Any]], unknowns: Any, transfer: Any) -> dict[int, int]:
    """Number of unknowns of each body on the interface, by the sizes of (S, solve) that were given.

    ValueError where they do not tell it, or differ.
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
    if unknowns is not None and not (isinstance(unknowns, int | np.integer) and unknowns > 0):
        raise ValueError(f"unknowns {unknowns!r}: needed a whole number > 0")
    rows: dict[int, int] = {}
    for body, sizes in told.items():
        others = told[3 - body] if transfer is None else set()
        known = sizes or others or ({int(unknowns)} if unknowns is not None else set())
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
    elif (matrix := sparse(name, S)) is not None:
        side, inverse = _of_sparse(name, matrix, inverse)
    seen, apply = side.seen, side.apply
    u, v = np.random.default_rng(1).standard_normal((2, n))
    if apply is not None:
        _, skew = _tried(name, apply, u, v, "u'Su = {:.3g} for some u): needed a stiffness", 0.0)
        if seen.form == "operator":
            seen = replace(seen, asymmetry=_symmetric(name, skew))
    if inverse is not None and solve is not None:
        needed = "f'u = {:.3g} for some f): needed the inverse of S"
        Fu, skew = _tried(f"solve{body}", inverse, u, v, needed, math.ulp(0.0))
        _symmetric(f"solve{body}", skew)
        off = 0.0 if apply is None else float(np.linalg.norm(apply(Fu) - u) / np.linalg.norm(u))
        if not off <= INVERSE:
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
        except MeshError:  # a pivot is 0
            negative = None
        if negative is None or negative:
            raise ValueError(f"{name} is not positive definite: needed a Schur complement of a stiffness matrix")
    seen = SeenMatrix(rows=n, form="matrix", asymmetry=float(skew), zeros=1 - full, free_motions=0)
    return Side(seen=seen, apply=symmetric.__matmul__), inverse


def _tried(name: str, function: Apply, u: Floats, v: Floats, refusal: str, least: float) -> tuple[Floats, float]:
    """The image of u under a function; its asymmetry by u and v over their energies, which are at least ``least``."""
    Au, Av = function(u), function(v)
    energies = float(u @ Au), float(v @ Av)
    if not min(energies) >= least:
        raise ValueError(f"{name} is not positive ({refusal.format(min(energies))}")
    return Au, abs(float(u @ Av - v @ Au)) / (math.sqrt(energies[0] * energies[1]) or 1.0)


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
        return real_array(f"what {name} returns", function(vector), (n,), most=np.inf)

    return checked


# --- the transfer -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """The transfer P between two grids as it was given, from the unknowns of ``neumann_body``.

    It applies to each of the ``components`` at the nodes; ``chosen`` is True if its shape fits both ways.
    """

    P: Any
    neumann_body: BodyNumber
    components: int
    chosen: bool

    def carry(self, u: Floats) -> Floats:
        """``P u``."""
        return np.concatenate([self.P @ part for part in u.reshape(self.components, -1, *u.shape[1:])])

    def carry_back(self, f: Floats) -> Floats:
        """``P' f``."""
        back = self.P.rmatvec if isinstance(self.P, LinearOperator) else self.P.T.__matmul__
        return np.concatenate([back(part) for part in f.reshape(self.components, -1, *f.shape[1:])])

    @property
    def notes(self) -> list[str]:
        """Warnings for the user."""
        if not self.chosen:
            return []
        n = self.neumann_body
        return [f"P is read as leading from body {n} to body {3 - n}: its shape fits both ways"]


def read_transfer(given: Any, rows: dict[int, int], neumann_body: BodyNumber | None) -> Transfer | None:
    """The transfer P, whose direction its shape decides; None without one.

    Raises
    ------
    ValueError
        It does not fit, or there is none and the bodies have not as many unknowns.
    """
    if given is None:
        if rows[1] != rows[2]:
            sizes = ", ".join(f"S{body} is {n} x {n}" for body, n in rows.items())
            raise ValueError(f"{sizes}: needed matrices on the same interface unknowns, or a transfer")
        return None
    P: Any = given if isinstance(given, LinearOperator) else sparse("the transfer", given)
    P = dense("the transfer", given) if P is None else P
    if min(P.shape) == 0:
        raise ValueError(f"the transfer is {size(P)}: needed a matrix")
    bodies: tuple[BodyNumber, ...] = BODIES if neumann_body is None else (neumann_body,)
    fits = [
        (body, components)
        for body in bodies
        for components in (1, 2, 3)
        if (P.shape[0] * components, P.shape[1] * components) == (rows[3 - body], rows[body])
    ]
    if not fits:
        needed = (
            "needed a row for each unknown of the contact body, a column for each of the Neumann body, or for nodes"
        )
        raise ValueError(f"the transfer is {P.shape[0]} x {P.shape[1]}, S1 has {rows[1]} rows, S2 {rows[2]}: {needed}")
    body, components = fits[0]
    return Transfer(P=P, neumann_body=body, components=components, chosen=len({body for body, _ in fits}) > 1)

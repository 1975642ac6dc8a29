"""What advice from matrices and advice from operators share: the transfer, and how roles are put together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator

from fem1d2d.mesh import Floats
from verification.advice.role import Role, best_of
from verification.advice.roles import Advice
from verification.advice.seen_matrices import ORDERING, SeenLanczos, SeenMatrices, SeenMatrix
from verification.interface.matrices import ASYMMETRY, size
from verification.interface.pair import UNITS

#: Up to this asymmetry the symmetric part of a matrix is taken, and that is told.
TOLD = 1e-3

Body = Literal[1, 2]

#: The Neumann bodies of the roles, in their order.
BODIES: tuple[Body, Body] = (2, 1)


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
class Transfer:
    """P as given, of which body's unknowns, for how many components at each node."""

    P: Any
    neumann_body: Body
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
        """What a user should know of how it was read."""
        if not self.chosen:
            return []
        n = self.neumann_body
        return [f"P is read as leading from body {n} to body {3 - n}: its shape fits both ways"]


def read_transfer(given: Any, rows: dict[int, int], neumann_body: Body | None) -> Transfer | None:
    """Which way P leads, by its shape; None without one.

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
    P = given if isinstance(given, LinearOperator) or sp.issparse(given) else dense("the transfer", given)
    if len(P.shape) != 2 or min(P.shape) == 0:
        raise ValueError(f"the transfer is {size(P)}: needed a matrix")
    entries = None if isinstance(P, LinearOperator) else P.data if sp.issparse(P) else P
    if entries is not None and (np.asarray(entries).dtype.kind not in "fiu" or not np.isfinite(entries).all()):
        raise ValueError("the transfer has entries that are not finite numbers: needed real ones")
    bodies: tuple[Body, ...] = BODIES if neumann_body is None else (neumann_body,)
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


def other(body: Body) -> Body:
    """The other body."""
    return 1 if body == 2 else 2


def refused_by(P: Transfer | None) -> dict[Body, Role]:
    """The role to which P does not belong."""
    if P is None:
        return {}
    n, c = other(P.neumann_body), P.neumann_body
    why = (
        f"needed a transfer of its own, from the unknowns of body {n} to those of body {c};"
        " P' carries forces back, and no displacements"
    )
    return {n: Role.refused(n, ValueError(why))}


def some_role_left(refused: dict[Body, Role]) -> None:
    """Refuse what leaves no role.

    Raises
    ------
    ValueError
    """
    if len(refused) == 2:
        raise ValueError("; ".join(f"body {body}: {refused[body].reason['rho']}" for body in sorted(refused)))


def advice_of(roles: tuple[Role, ...], *, tied: bool) -> Advice:
    """Advice for the role that takes fewer steps; one of them at least is not refused."""
    return Advice(neumann_body=best_of(roles, tied=tied).neumann_body, roles=roles, units=UNITS, tied=tied)


def with_seen(
    found: Advice,
    seen: dict[Body, SeenMatrix],
    P: Transfer | None,
    *,
    ordered: bool = False,
    lanczos: tuple[SeenLanczos, ...] = (),
) -> Advice:
    """The advice with what was seen of the matrices."""
    notes = [note for body in (1, 2) for note in seen[body].notes(f"S{body}", ASYMMETRY)]
    return replace(
        found,
        matrices=SeenMatrices(
            S1=seen[1],
            S2=seen[2],
            transfer=None if P is None else (int(P.P.shape[0]), int(P.P.shape[1])),
            neumann_body=None if P is None else P.neumann_body,
            ordering=ORDERING if ordered or (P is not None and P.components > 1) else None,
            lanczos=lanczos,
            notes=(*notes, *([] if P is None else P.notes)),
        ),
    )

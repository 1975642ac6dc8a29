"""The transfer between two grids that is given with interface matrices: which way it leads, and for how many parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator

from fem1d2d.mesh import Floats
from verification.advice import BodyNumber
from verification.advice.sides import BODIES, dense
from verification.interface.matrices import size


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """P as given, of which body's unknowns, for how many components at each node."""

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
        """What a user should know of how it was read."""
        if not self.chosen:
            return []
        n = self.neumann_body
        return [f"P is read as leading from body {n} to body {3 - n}: its shape fits both ways"]


def read_transfer(given: Any, rows: dict[int, int], neumann_body: BodyNumber | None) -> Transfer | None:
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

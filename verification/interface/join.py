"""P, which joins two grids along Gamma_c: it carries traces to the contact grid, its transpose returns the forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from verification.value import Value

Numbers = NDArray[Any]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Join(Value):
    """The identity, which joins two bodies on one grid, and the base of the others.

    Vectors, or columns of them, hold any type of number; interface vectors have all tangential components first.

    Attributes
    ----------
    one_grid : bool
        Whether both bodies have the same contact nodes, so that the identity leads back as well.
    alike : bool
        Whether P acts on each component by itself, and alike.
    """

    one_grid: ClassVar[bool] = True
    alike: ClassVar[bool] = True

    def values(self, v: Numbers) -> Numbers:
        """P on the values of one component at the Neumann nodes: its values at the contact nodes."""
        return v

    def values_back(self, v: Numbers) -> Numbers:
        """Its transpose."""
        return v

    def carry(self, u: Numbers) -> Numbers:
        """``P u``: traces on the Neumann grid, on the contact grid."""
        return u

    def carry_back(self, f: Numbers) -> Numbers:
        """``P' f``: nodal forces on the contact grid, on the Neumann grid."""
        return f

    def felt(self, S: Numbers) -> Numbers:
        """An operator on normal forces of the Neumann grid, on the forces of the contact grid that it feels by P'.

        On normal ones, shape (.., contact nodes), or on all components where P mixes them.
        """
        return S

    @property
    def free(self) -> Join:
        """P without supports."""
        return self

    def mapped(self, change: Callable[[Numbers], Numbers]) -> Join:
        """The same with a function of its matrices, as of their moduli, in their place."""
        return self

    def reversed(self, contact: int, neumann: int) -> Join:
        """The same for normal components along the opposite direction, behind so many tangential ones of each grid."""
        return self


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Mortar(Join):
    """P as a matrix on nodal values, shape (contact nodes, Neumann nodes), which acts on each component."""

    one_grid = False
    nodal: Numbers

    def values(self, v: Numbers) -> Numbers:
        return np.asarray(self.nodal @ v)

    def values_back(self, v: Numbers) -> Numbers:
        return np.asarray(self.nodal.T @ v)

    def carry(self, u: Numbers) -> Numbers:
        return _by_component(self.nodal, u)

    def carry_back(self, f: Numbers) -> Numbers:
        return _by_component(self.nodal.T, f)

    def felt(self, S: Numbers) -> Numbers:
        return np.asarray(S @ self.nodal.T)

    def mapped(self, change: Callable[[Numbers], Numbers]) -> Join:
        return replace(self, nodal=change(self.nodal))


def _by_component(P: Numbers, u: Numbers) -> Numbers:
    n = P.shape[1]
    return np.concatenate([P @ u[start : start + n] for start in range(0, len(u), n)])


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Turned(Mortar):
    """P where the normals of two grids differ: it turns each vector from one node's directions into another's.

    ``vectors`` is P on all components, shape (contact components, Neumann components).
    """

    alike = False
    vectors: Numbers

    def carry(self, u: Numbers) -> Numbers:
        return np.asarray(self.vectors @ u)

    def carry_back(self, f: Numbers) -> Numbers:
        return np.asarray(self.vectors.T @ f)

    def felt(self, S: Numbers) -> Numbers:
        return np.asarray(S @ self.vectors[:, self.nodal.shape[1] :].T)

    def mapped(self, change: Callable[[Numbers], Numbers]) -> Join:
        return replace(self, nodal=change(self.nodal), vectors=change(self.vectors))

    def reversed(self, contact: int, neumann: int) -> Join:
        vectors = self.vectors.copy()
        vectors[contact:] *= -1
        vectors[:, neumann:] *= -1
        return replace(self, vectors=vectors)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Held(Join):
    """P where supports hold tangential components, which it does not carry.

    Attributes
    ----------
    of : Join
        P without supports.
    contact, neumann : bool array
        Components of either grid that it carries.
    """

    alike = False
    of: Join
    contact: NDArray[np.bool_]
    neumann: NDArray[np.bool_]

    @property
    def one_grid(self) -> bool:  # type: ignore[override]
        return self.of.one_grid

    def values(self, v: Numbers) -> Numbers:
        return self.of.values(v)

    def values_back(self, v: Numbers) -> Numbers:
        return self.of.values_back(v)

    def carry(self, u: Numbers) -> Numbers:
        return _kept(self.contact, self.of.carry(_kept(self.neumann, u)))

    def carry_back(self, f: Numbers) -> Numbers:
        return _kept(self.neumann, self.of.carry_back(_kept(self.contact, f)))

    def felt(self, S: Numbers) -> Numbers:
        return self.of.felt(S)

    @property
    def free(self) -> Join:
        return self.of

    def mapped(self, change: Callable[[Numbers], Numbers]) -> Join:
        return replace(self, of=self.of.mapped(change))

    def reversed(self, contact: int, neumann: int) -> Join:
        return replace(self, of=self.of.reversed(contact, neumann))


def _kept(components: NDArray[np.bool_], u: Numbers) -> Numbers:
    return np.asarray((u.T * components).T)


#: The identity.
ONE_GRID = Join()


def joined(P: Numbers | None, contact: Numbers | None, neumann: Numbers | None) -> Join:
    """Return the join by a matrix on nodal values between nodes with these normals, the identity without one.

    Normals turn vectors unless all of both grids are the same; rational ones give a rational P.
    """
    if P is None:
        return ONE_GRID
    if contact is None or neumann is None or all((normals == contact[0]).all() for normals in (contact, neumann)):
        return Mortar(nodal=P)
    tangents = [np.stack([normals[:, 1], -normals[:, 0]], axis=1) for normals in (contact, neumann)]
    rows, columns = ((t, n) for t, n in zip(tangents, (contact, neumann), strict=True))
    return Turned(nodal=P, vectors=np.block([[P * (one @ other.T) for other in columns] for one in rows]))

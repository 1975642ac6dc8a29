"""Two bodies joined along Gamma_c: their grids, the transfer between them, the gap, and a law of friction."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fem1d2d import trapezoid
from fem1d2d.mesh import Floats
from verification.interface.matrices import real_array
from verification.problem.specs import Profile
from verification.value import Value, freeze, lent


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Grid(Value):
    """The contact nodes of one body, in the direction of s, with the trapezoid rule on them.

    An interface vector on it lists all tangential components first, then all normal ones.

    Attributes
    ----------
    x : array, shape (n,)
        Positions along Gamma_c, unit of length: x where it lies along an interval, distances s from its first node
        along a named line; in 1D the one point.
    weights : array, shape (n,)
        w_j of the trapezoid rule, unit of length; 1 in 1D.
    dimension : {1, 2}
    points : array, shape (n, 2), or None
        Coordinates of the nodes, where they are known.
    normals : array, shape (n, 2), or None
        Unit normals from body 1 to body 2; vectors are split into components along them and along the tangents.  None
        where all are (0, 1).
    """

    x: Floats
    weights: Floats
    dimension: Literal[1, 2] = 2
    points: Floats | None = None
    normals: Floats | None = None

    @property
    def s(self) -> Floats:
        """Distances from the first node along Gamma_c."""
        return self.x - self.x[:1]

    @property
    def upright(self) -> Floats:
        """Unit normals of the nodes from body 1 to body 2, shape (n, 2), (0, 1) without their own."""
        return np.tile((0.0, 1.0), (self.n, 1)) if self.normals is None else self.normals

    def place(self, j: int) -> str:
        """Return the place of a node, for a message."""
        if self.normals is None or self.points is None:
            return f"x = {self.x[j]:g}"
        return f"({self.points[j, 0]:g}, {self.points[j, 1]:g})"

    @property
    def summary(self) -> str:
        return f"{self.n} nodes from {self.x[0]:g} to {self.x[-1]:g}" if self.n else "no nodes"

    @classmethod
    def on(cls, x: Floats, dimension: Literal[1, 2] = 2) -> Grid:
        """Return the grid of these nodes with trapezoid weights."""
        return cls(x=x, weights=trapezoid(x), dimension=dimension)

    def equals(self, other: Grid) -> bool:
        """Return True for the same nodes, weights and normals."""
        parts = ((self.x, other.x), (self.weights, other.weights), (self.upright, other.upright))
        return all(np.array_equal(mine, its) for mine, its in parts)

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.x)

    @property
    def t(self) -> int:
        """Number of tangential components: n in two dimensions, 0 in one."""
        return self.n * (self.dimension - 1)

    @property
    def size(self) -> int:
        """Number of components of an interface vector."""
        return self.n * self.dimension

    @property
    def tangential(self) -> slice:
        """Tangential components of an interface vector; empty in 1D."""
        return slice(0, self.t)

    @property
    def normal(self) -> slice:
        """Normal components of an interface vector."""
        return slice(self.t, self.size)

    def components(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Split interface vectors, one or columns of them, by component: shape (d, n, ..)."""
        return vectors.reshape(self.dimension, self.n, *vectors.shape[1:])

    def turn(self, vectors: Floats) -> Floats:
        """Return interface vectors, or columns of them, with reversed normal components (its own inverse)."""
        turned = vectors.copy()
        turned[self.normal] *= -1.0
        return turned


class Law(ABC):
    """A law of friction: the friction bound at a contact node is ``w_j k |(S sigma_N)_j|``, with S linear.

    Attributes
    ----------
    name : str
    label : str
        Adjective in front of "law".
    outside : str
        Why the theorem does not apply to this law; empty where it does.
    needs_radius : bool
        Whether a problem file with friction must give a radius.
    of_contact : bool
        Whether it takes the forces of the contact grid where the grids differ.  They are no function of the forces g
        on the Neumann grid, so that there only the global method can use it.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    outside: str = ""
    needs_radius: ClassVar[bool] = False
    of_contact: ClassVar[bool] = False

    @classmethod
    def of(cls, radius: Fraction | None) -> Law | None:
        """Return the law of a problem file with that radius; None if it needs one and has none, without friction."""
        return cls()

    def scaled(self, length: float) -> Law:
        """Return the same law in a unit of length in which lengths are ``length`` times as large numbers.

        Its operator must then be ``operator / length``; a law that holds a length multiplies it.
        """
        return self

    @property
    @abstractmethod
    def words(self) -> str:
        """The law in a few words, for a screen."""

    @abstractmethod
    def operator(self, interface: Interface) -> Floats:
        """Return S: normal nodal forces on the Neumann grid to normal stress at the contact nodes, shape (n_c, n_n).

        With ``of_contact`` it takes those on the contact grid, shape (n_c, n_c).  Forces are per unit thickness,
        compressive ones positive.
        """

    def warnings(self, interface: Interface) -> list[str]:
        """Return what a user should know before trusting the numbers of this law on these grids."""
        return []


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """The line between two of several bodies.

    Attributes
    ----------
    bodies : pair of int
        Their numbers, in the order of the file.
    contact, neumann : slice
        Its nodes on both grids.
    flipped : bool
        Whether the normals of the grids lead from the second of ``bodies`` to the first.
    """

    bodies: tuple[int, int]
    contact: slice
    neumann: slice
    flipped: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Interface(Value):
    """Two grids along Gamma_c and what passes between them.

    Attributes
    ----------
    contact, neumann : Grid
        Those of the contact body and of the Neumann body.
    gap : array, shape (contact nodes,)
        Initial distance, unit of length.
    law : Law or None
        The law of friction; None where no friction force can act.
    transfer : array, shape (contact nodes, Neumann nodes), or None
        P: values on the contact grid of a function given on the Neumann grid.  Only its transpose returns the forces.
        None where both grids are one: then P is the identity.
    profile : Profile or None
        How the coefficient of friction varies along Gamma_c; None where it is constant.
    on_traces : array, shape (contact components, Neumann components), or None
        P on vectors, where the normals of the two grids differ: it turns each vector from one node's directions into
        another's.  None where P acts on each component by itself.
    slipped : array, shape (t of the contact grid,), or None
        ``u1_T - u2_T`` before the load increment, from which friction measures slip, unit of length; None for 0.
    lines : tuple of Stretch
        The lines of more than two bodies, one after the other; empty for two bodies, which have one line.
    """

    contact: Grid
    neumann: Grid
    gap: Floats
    law: Law | None = None
    transfer: Floats | None = None
    profile: Profile | None = None
    slipped: Floats | None = None
    on_traces: Floats | None = None
    lines: tuple[Stretch, ...] = ()

    @classmethod
    def joining(cls, contact: Grid, neumann: Grid, transfer: Floats | None, **rest: Any) -> Interface:
        """Return an interface with this transfer P between nodal values, each node with the normal of its grid."""
        turning = turned_transfer(transfer, contact.normals, neumann.normals)
        return cls(contact=contact, neumann=neumann, transfer=transfer, on_traces=turning, **rest)

    def reversed(self) -> Interface:
        """Return the interface for vectors with their normal components along the opposite direction."""
        if self.on_traces is None:
            return self
        return replace(self, on_traces=self.contact.turn(self.neumann.turn(self.on_traces.T).T))

    @property
    def varies(self) -> bool:
        """True if the coefficient of friction may differ from place to place: k is then the largest one."""
        return self.profile is not None or bool(self.lines)

    @property
    def stretches(self) -> list[tuple[slice, slice, Floats]]:
        """The nodes of each line on the contact grid and on the Neumann grid, and its ends as positions."""
        every = [(line.contact, line.neumann) for line in self.lines] or [(slice(None), slice(None))]
        return [(own, other, self.contact.x[own][[0, -1]]) for own, other in every]

    @property
    def moduli(self) -> Interface:
        """The interface with the moduli of all entries of P, to bound rounding."""
        transfer, on_traces = (None if P is None else np.abs(P) for P in (self.transfer, self.on_traces))
        return replace(self, transfer=transfer, on_traces=on_traces)

    @property
    def counts(self) -> dict[str, int]:
        """Number of nodes of each grid."""
        return {"contact_nodes": self.contact.n, "neumann_nodes": self.neumann.n}

    @property
    def summary(self) -> str:
        return f"{self.contact.n} contact nodes, {'no law of friction' if self.law is None else self.law.words}"

    @property
    def offset(self) -> Floats:
        """The jump of body 1 against body 2 at which nothing has moved: the slip before the increment, and the gap."""
        slipped = np.zeros(self.contact.t) if self.slipped is None else self.slipped
        return np.concatenate([slipped, self.gap])

    @lent
    def kernel(self) -> Floats | None:
        """S as a matrix: normal nodal forces on the Neumann grid to normal stress at the contact nodes.

        Where the coefficient of friction varies it is ``diag(k_j / max k) S``, so that the friction bound is
        ``w_j max k |(S sigma_N)_j|`` as with a constant one.  ValueError where the grids differ, and the law takes the
        forces of the contact grid.
        """
        if self.law is None or self.contact.dimension == 1:
            return None
        if self.law.of_contact and self.transfer is not None:
            raise ValueError(f"{self.law.words}: no operator on the Neumann grid")
        S = real_array("the operator S", self.operator(self.law), (self.contact.n, self.neumann.n))
        return freeze(S)

    @property
    def shares(self) -> Floats | None:
        """``k_j / max k`` at the contact nodes, rationals where their positions are; None where k is constant."""
        if self.profile is None:
            return None
        s = self.contact.s
        found = [self.profile.at(Fraction(value)) for value in s]
        return np.array(found, dtype=s.dtype)

    def operator(self, law: Law) -> Floats:
        """Return the operator of a law, each row times the share of its contact node."""
        shares, S = self.shares, law.operator(self)
        return S if shares is None else shares[:, None] * S

    @property
    def contact_kernel(self) -> Floats | None:
        """S as a matrix on normal nodal forces of the contact grid, shape (contact nodes, contact nodes).

        On all its components, where normals differ: tangential forces of one grid have a normal part on the other.
        """
        if self.transfer is not None and self.law is not None and self.law.of_contact:
            return self.operator(self.law)
        if self.transfer is None or self.kernel is None:
            return self.kernel
        return self.kernel @ (self.transfer if self.on_traces is None else self.on_traces[:, self.neumann.normal]).T

    def stress(self, force: Floats) -> Floats:
        """Return ``S sigma_N`` at the contact nodes for a force on the Neumann grid; 0 without a law of friction."""
        kernel = self.kernel
        return np.zeros(self.contact.n) if kernel is None else np.asarray(kernel @ force[self.neumann.normal])

    def carry(self, traces: Floats) -> Floats:
        """Return ``P u``: traces on the Neumann grid, one or columns of them, on the contact grid."""
        if self.transfer is None:
            return traces
        if self.on_traces is not None:
            return np.asarray(self.on_traces @ traces)
        return np.concatenate([self.transfer @ block for block in self.neumann.components(traces)])

    def carry_back(self, forces: Floats) -> Floats:
        """Return ``P' f``: nodal forces on the contact grid, one or columns of them, on the Neumann grid."""
        if self.transfer is None:
            return forces
        if self.on_traces is not None:
            return np.asarray(self.on_traces.T @ forces)
        return np.concatenate([self.transfer.T @ block for block in self.contact.components(forces)])

    def spread(self, forces: Floats) -> Floats:
        """Return the nodal forces on the contact grid that have the stresses of given ones on the Neumann grid."""
        if self.transfer is None:
            return forces
        stresses = self.neumann.components(forces) / self.neumann.weights
        carried = self.contact.components(self.carry(stresses.reshape(-1)))
        return np.asarray((self.contact.weights * carried).reshape(-1))

    def reaches(self, components: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return True for the contact components whose forces act on given components of the Neumann grid."""
        if self.transfer is None:
            return components
        if self.on_traces is not None:
            return np.asarray((self.on_traces != 0) @ components)
        return np.concatenate([(self.transfer != 0) @ block for block in self.neumann.components(components)])

    def pressed(self, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return True for the Neumann nodes on which the forces of some contact nodes act."""
        return touching if self.transfer is None else np.asarray((self.transfer != 0).T @ touching, dtype=bool)

    def carry_form(self, form: Floats) -> Floats:
        """Return ``P' X P`` of a symmetric matrix X on the contact grid."""
        return form if self.transfer is None else self.carry_back(self.carry_back(form).T)

    def swapped(self) -> Interface:
        """Return the interface with the roles of the grids exchanged; ValueError where the grids differ."""
        if self.transfer is not None:
            raise ValueError("the grids differ: needed a pair built for these roles, with its own transfer")
        return replace(self, contact=self.neumann, neumann=self.contact)


def turned_transfer(P: NDArray[Any] | None, contact: NDArray[Any] | None, neumann: NDArray[Any] | None) -> Any:
    """Return P on vectors, tangential components first, between nodes with these normals; rational where they are.

    None where all normals are the same, or P is the identity: then it acts on each component by itself.
    """
    if P is None or contact is None or neumann is None:
        return None
    if all((normals == contact[0]).all() for normals in (contact, neumann)):
        return None
    tangents = [np.stack([normals[:, 1], -normals[:, 0]], axis=1) for normals in (contact, neumann)]
    rows, columns = ((t, n) for t, n in zip(tangents, (contact, neumann), strict=True))
    return np.block([[P * (one @ other.T) for other in columns] for one in rows])

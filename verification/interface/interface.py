"""Two bodies joined along Gamma_c: their grids, the transfer between them, the gap, and a law of friction."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fem1d2d import trapezoid
from fem1d2d.mesh import Floats
from fem1d2d.trace import SAME
from ndtheory.keys import Part, key
from verification.interface.matrices import real_array
from verification.problem.specs import Profile
from verification.value import Value, freeze, lent

#: One truth value for each node, or for each component, of a grid.
Nodes = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Grids(Part):
    """The grids along Gamma_c in documents."""

    part: ClassVar[str] = "Grids"

    contact_body: int = key("1 or 2: the body that carries the contact grid")
    contact_nodes: int = key(r"its nodes on $\Gamma_c$, to which pattern, pressure and the friction bound belong")
    neumann_nodes: int = key(
        "the nodes of the other body, to which the forces g belong; where the grids differ, also the nodes beyond an "
        r"end of $\Gamma_c$ whose hat functions extend onto it"
    )


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

    def warnings_after(self, interface: Interface, k: float, pressure: Floats, bound: Floats) -> list[str]:
        """Return what a solution shows of this law: its pressure and friction bound at the contact nodes."""
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
        P on vectors, where it does not act alike on both components: where the normals of the two grids differ it turns
        each vector from one node's directions into another's, and what is held tangentially is 0.
    held : bool array, shape (contact nodes,), or None
        Contact nodes whose tangential component a support of the contact body holds.  The support carries any shear
        there, so that they have no friction condition, and their tangential unknowns are not in the trace space.
    planes : pair of bool arrays, shapes (contact nodes,) and (Neumann nodes,), or None
        The ends of Gamma_c on a plane of symmetry, where supports hold both bodies tangentially at 0.
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
    held: Nodes | None = None
    planes: tuple[Nodes, Nodes] | None = None
    lines: tuple[Stretch, ...] = ()

    @classmethod
    def joining(cls, contact: Grid, neumann: Grid, transfer: Floats | None, **rest: Any) -> Interface:
        """Return an interface with this transfer P between nodal values, each node with the normal of its grid."""
        found = cls(contact=contact, neumann=neumann, transfer=transfer, **rest)
        return replace(found, on_traces=found.between(transfer, contact.normals, neumann.normals))

    def between(self, P: NDArray[Any] | None, contact: NDArray[Any] | None, neumann: NDArray[Any] | None) -> Any:
        """Return P on vectors between nodes with these normals, 0 where a tangential component is held.

        Rational where P is; None where it acts alike on both components.
        """
        turned = turned_transfer(P, contact, neumann)
        if self.held is None:
            return turned
        if turned is None:
            P = np.eye(self.contact.n) if P is None else P
            turned = np.block([[P, 0 * P], [0 * P, P]])
        turned[self.contact.tangential][self.held] = 0
        if self.planes is not None:
            turned[:, self.neumann.tangential][:, self.planes[1]] = 0
        return turned

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
    def shown(self) -> Interface:
        """The interface that also carries displacements past a held node, which friction there does not feel."""
        held = None if self.planes is None else self.planes[0]
        if self.held is None or (held is not None and np.array_equal(held, self.held)):
            return self
        other = replace(self, held=held)
        return replace(other, on_traces=other.between(self.transfer, self.contact.normals, self.neumann.normals))

    def reflected(self, x: Floats, reach: float) -> list[Floats]:
        """Return the images of positions in the planes of symmetry that come within a distance of Gamma_c.

        Between two planes the images are reflected in turn.
        """
        at = [] if self.planes is None else list(self.contact.x[self.planes[0]])
        low, high = self.contact.x[0] - reach, self.contact.x[-1] + reach
        found, last = [], [(x, -1)]
        while last:
            images = [(2 * at[i] - y, i) for y, before in last for i in range(len(at)) if i != before]
            last = [(y, i) for y, i in images if low < y.max() and y.min() < high]
            found += [y for y, _ in last]
        return found

    @property
    def shares(self) -> Floats | None:
        """``k_j / max k`` at the contact nodes, rationals where their positions are; None where k is constant."""
        if self.profile is None:
            return None
        s = self.contact.s
        found = [self.profile.at(Fraction(value)) for value in s]
        return np.array(found, dtype=s.dtype)

    def operator(self, law: Law) -> Floats:
        """Return the operator of a law, each row times the share of its contact node; 0 where no friction can act."""
        shares, S = self.shares, law.operator(self)
        S = S if shares is None else shares[:, None] * S
        if self.held is None:
            return S
        rubs = ~self.held if self.planes is None else ~self.held | self.planes[0]
        return np.where(rubs[:, None], S, 0)

    @property
    def contact_kernel(self) -> Floats | None:
        """S as a matrix on normal nodal forces of the contact grid, shape (contact nodes, contact nodes).

        On all its components, where normals differ: tangential forces of one grid have a normal part on the other.
        """
        if self.transfer is not None and self.law is not None and self.law.of_contact:
            return self.operator(self.law)
        if self.transfer is None or self.kernel is None:
            return self.kernel  # on one grid P leaves normal components as they are
        return self.kernel @ (self.transfer if self.on_traces is None else self.on_traces[:, self.neumann.normal]).T

    def stress(self, force: Floats) -> Floats:
        """Return ``S sigma_N`` at the contact nodes for a force on the Neumann grid; 0 without a law of friction."""
        kernel = self.kernel
        return np.zeros(self.contact.n) if kernel is None else np.asarray(kernel @ force[self.neumann.normal])

    def carry(self, traces: Floats) -> Floats:
        """Return ``P u``: traces on the Neumann grid, one or columns of them, on the contact grid."""
        if self.on_traces is not None:
            return np.asarray(self.on_traces @ traces)
        if self.transfer is None:
            return traces
        return np.concatenate([self.transfer @ block for block in self.neumann.components(traces)])

    def carry_back(self, forces: Floats) -> Floats:
        """Return ``P' f``: nodal forces on the contact grid, one or columns of them, on the Neumann grid."""
        if self.on_traces is not None:
            return np.asarray(self.on_traces.T @ forces)
        if self.transfer is None:
            return forces
        return np.concatenate([self.transfer.T @ block for block in self.contact.components(forces)])

    def spread(self, forces: Floats) -> Floats:
        """Return the nodal forces on the contact grid that have the stresses of given ones on the Neumann grid."""
        if self.transfer is None:
            return self.carry(forces)
        stresses = self.neumann.components(forces) / self.neumann.weights
        carried = self.contact.components(self.carry(stresses.reshape(-1)))
        return np.asarray((self.contact.weights * carried).reshape(-1))

    def pressed(self, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return True for the Neumann nodes on which the forces of some contact nodes act."""
        return touching if self.transfer is None else np.asarray((self.transfer != 0).T @ touching, dtype=bool)

    def carry_form(self, form: Floats) -> Floats:
        """Return ``P' X P`` of a symmetric matrix X on the contact grid."""
        return self.carry_back(self.carry_back(form).T)

    def carry_free(self, form: Floats, contact: Nodes, neumann: Nodes) -> Floats:
        """Return ``P' X P``, of free components of the Neumann grid, from a form X of free ones of the contact grid.

        Both masks, of shapes (contact components,) and (Neumann components,), are True where Gamma_u leaves the
        component free.
        """
        every = np.zeros((len(contact), len(contact)))
        every[np.ix_(contact, contact)] = form
        return self.carry_form(every)[np.ix_(neumann, neumann)]

    def swapped(self, held: Nodes) -> Interface:
        """Return the interface with the roles of the grids exchanged; ValueError where the grids differ.

        ``held`` are the nodes whose tangential component is held for the body that has the contact grid then.
        """
        if self.transfer is not None:
            raise ValueError("the grids differ: needed a pair built for these roles, with its own transfer")
        planes = None if self.planes is None else self.planes[::-1]
        other = replace(self, contact=self.neumann, neumann=self.contact, planes=planes, on_traces=None)
        other = replace(other, held=held if held.any() else None)
        return replace(other, on_traces=other.between(None, None, None))


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


#: The nodes of a body whose tangential component is held, and those of them that are held at 0; None for a rigid body.
Support = tuple[Nodes, Nodes] | None

#: Contact nodes that are held tangentially, and nodes of both grids on planes of symmetry; None where there are none.
Held = tuple[Nodes | None, tuple[Nodes, Nodes] | None]


def held_along(
    support: Sequence[Support], contact: Grid, neumann: Grid
) -> tuple[Nodes | None, tuple[Nodes, Nodes] | None]:
    """Return the contact nodes that are held tangentially, and the ends of Gamma_c on a plane of symmetry.

    There every elastic body is held at 0; a rigid one is its own mirror image.
    """
    planes = np.zeros(contact.n, dtype=bool), np.zeros(neumann.n, dtype=bool)
    for end in (0, -1):
        together = abs(contact.x[end] - neumann.x[end]) <= SAME * np.ptp(contact.x)
        if together and any(support) and all(body is None or body[1][end] for body in support):
            planes[0][end] = planes[1][end] = True
    held = planes[0] if support[0] is None else planes[0] | support[0][0]
    return held if held.any() else None, planes if planes[0].any() else None

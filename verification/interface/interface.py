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
from fem1d2d.mesh import Floats, place_of
from fem1d2d.trace import SAME
from ndtheory.keys import Part, key
from verification.interface.join import ONE_GRID, Held, Join, joined
from verification.interface.matrices import real_array
from verification.problem.specs import ContactSpec, Profile
from verification.value import Value, copied, freeze, lent

#: One truth value for each node, or for each component, of a grid.
Nodes = NDArray[np.bool_]

#: The nodes of a body whose tangential component is held, and those of them that are held at 0; None for a rigid body.
Support = tuple[Nodes, Nodes] | None

#: What holds bodies whose supports are not known.
NO_SUPPORT: tuple[Support, Support] = (None, None)


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
        return place_of(self.points[j])

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
        True if a problem file with friction must give a radius.
    of_contact : bool
        True if it takes the forces of the contact grid where the grids differ.  They are not a function of the forces
        g on the Neumann grid, so that only the global method can use it there.
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

    @classmethod
    def of_file(cls, contact: ContactSpec) -> Law | None:
        """The law of a table of a problem file: one that takes other keys than the radius has its own way."""
        return cls.of(contact.radius)

    def scaled(self, length: float) -> Law:
        """Return the same law in a unit of length in which lengths are ``length`` times as large numbers.

        Its operator must then be ``operator / length``; a law that holds a length multiplies it.
        """
        return self

    def exact(self, radius: Fraction | None) -> Law:
        """Return the same law with the radius of the file as a rational, for a formula that takes any number."""
        return self

    def of_line(self, i: int) -> Law | None:
        """Return the law of a line, of several."""
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

    def warnings_after(self, interface: Interface, k: float, pressure: Floats, bound: Floats) -> list[str]:
        """Return what a solution shows of this law: its pressure and friction bound at the contact nodes."""
        return []


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A line between two bodies.

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
    join : Join
        P: traces on the contact grid of a function given on the Neumann grid.  Only its transpose returns the forces.
    profile : Profile or None
        How the coefficient of friction varies along Gamma_c; None where it is constant.
    held : bool array, shape (contact nodes,)
        Contact nodes whose tangential component a support of the contact body holds.  The support carries any shear
        there, so that they have no friction condition, and their tangential unknowns are not in the trace space.
    planes : pair of bool arrays, shapes (contact nodes,) and (Neumann nodes,)
        The ends of Gamma_c on a plane of symmetry, where supports hold both bodies tangentially at 0.
    slipped : array, shape (t of the contact grid,)
        ``u1_T - u2_T`` before the load increment, from which friction measures slip, unit of length.
    lines : tuple of Stretch
        The lines of Gamma_c, one after the other; two bodies mostly have one.
    """

    contact: Grid
    neumann: Grid
    gap: Floats
    join: Join
    held: Nodes
    planes: tuple[Nodes, Nodes]
    slipped: Floats
    lines: tuple[Stretch, ...]
    law: Law | None = None
    profile: Profile | None = None

    @classmethod
    def joining(
        cls,
        contact: Grid,
        neumann: Grid,
        transfer: Floats | None,
        support: Sequence[Support] = NO_SUPPORT,
        *,
        law: Law | None = None,
        **rest: Any,
    ) -> Interface:
        """Return an interface with this P between nodal values, one grid without; nodes have the normals of their grid.

        ``support`` is what supports hold of both bodies' contact nodes, the contact body first.
        """
        held, planes = held_along(support, contact, neumann)
        whole = Stretch(bodies=(1, 2), contact=slice(0, contact.n), neumann=slice(0, neumann.n), flipped=False)
        given: dict[str, Any] = {"held": held, "planes": planes, "slipped": np.zeros(contact.t), "lines": (whole,)}
        law = law if contact.t else None  # bars meet at a point
        found = cls(contact=contact, neumann=neumann, join=ONE_GRID, law=law, **given | rest)
        return replace(found, join=found.holding(joined(transfer, contact.normals, neumann.normals)))

    def holding(self, join: Join) -> Join:
        """Return a join of these grids that leaves out the tangential components that are held."""
        if not self.held.any():
            return join
        kept = (~np.append(nodes, np.zeros(len(nodes), dtype=bool)) for nodes in (self.held, self.planes[1]))
        return Held(of=join, contact=next(kept), neumann=next(kept))

    def reversed(self) -> Interface:
        """Return the interface for vectors with their normal components along the opposite direction."""
        return copied(self, join=self.join.reversed(self.contact.t, self.neumann.t))

    @property
    def one_grid(self) -> bool:
        """True if both bodies have the same contact nodes."""
        return self.join.one_grid

    @property
    def transfer(self) -> Floats:
        """P as a matrix on nodal values, shape (contact nodes, Neumann nodes): the identity on one grid."""
        return self.join.values(np.eye(self.neumann.n))

    @property
    def varies(self) -> bool:
        """True if the coefficient of friction may differ from place to place: k is then the largest one."""
        return self.profile is not None or self.several

    @property
    def several(self) -> bool:
        """True if Gamma_c has several lines."""
        return len(self.lines) > 1

    @property
    def moduli(self) -> Interface:
        """The interface with the moduli of all entries of P, to bound rounding."""
        return replace(self, join=self.join.mapped(np.abs))

    @property
    def counts(self) -> dict[str, int]:
        """Number of nodes of each grid."""
        return {"contact_nodes": self.contact.n, "neumann_nodes": self.neumann.n}

    @property
    def summary(self) -> str:
        return f"{self.contact.n} contact nodes, {'no law of friction' if self.law is None else self.law.words}"

    @property
    def only_solved(self) -> bool:
        """True if no iteration has this law here: it takes the forces of the contact grid, and the grids differ."""
        return self.law is not None and self.law.of_contact and not self.one_grid

    @property
    def offset(self) -> Floats:
        """The jump of body 1 against body 2 at which nothing has moved: the slip before the increment, and the gap."""
        return np.concatenate([self.slipped, self.gap])

    @lent
    def kernel(self) -> Floats | None:
        """S as a matrix: normal nodal forces on the Neumann grid to normal stress at the contact nodes.

        Where the coefficient of friction varies it is ``diag(k_j / max k) S``, so that the friction bound is
        ``w_j max k |(S sigma_N)_j|`` as with a constant one.  ValueError where the grids differ, and the law takes the
        forces of the contact grid.
        """
        if self.law is None:
            return None
        if self.only_solved:
            raise ValueError(f"{self.law.words}: no operator on the Neumann grid")
        S = real_array("the operator S", self.operator(self.law), (self.contact.n, self.neumann.n))
        return freeze(S)

    @property
    def shown(self) -> Interface:
        """The interface that also carries displacements past a held node, which friction there does not feel."""
        if np.array_equal(self.held, self.planes[0]):
            return self
        other = replace(self, held=self.planes[0])
        return replace(other, join=other.holding(self.join.free))

    def reflected(self, x: Floats, reach: float) -> list[Floats]:
        """Return the images of positions in the planes of symmetry that come within a distance of Gamma_c.

        Between two planes each image is reflected in the other plane.
        """
        at = list(self.contact.x[self.planes[0]])
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
        rubs = ~self.held | self.planes[0]
        return S if rubs.all() else np.where(rubs[:, None], S, 0)

    @property
    def contact_kernel(self) -> Floats | None:
        """S as a matrix on normal nodal forces of the contact grid, shape (contact nodes, contact nodes).

        On all its components, where normals differ: tangential forces of one grid have a normal part on the other.
        """
        if self.law is not None and self.law.of_contact:
            return self.operator(self.law)
        return None if self.kernel is None else self.join.felt(self.kernel)

    def stress(self, force: Floats) -> Floats:
        """Return ``S sigma_N`` at the contact nodes for a force on the Neumann grid; 0 without a law of friction."""
        kernel = self.kernel
        return np.zeros(self.contact.n) if kernel is None else np.asarray(kernel @ force[self.neumann.normal])

    def carry(self, traces: Floats) -> Floats:
        """Return ``P u``: traces on the Neumann grid, one or columns of them, on the contact grid."""
        return self.join.carry(traces)

    def carry_back(self, forces: Floats) -> Floats:
        """Return ``P' f``: nodal forces on the contact grid, one or columns of them, on the Neumann grid."""
        return self.join.carry_back(forces)

    def spread(self, forces: Floats) -> Floats:
        """Return the nodal forces on the contact grid that have the stresses of given ones on the Neumann grid."""
        stresses = self.neumann.components(forces) / self.neumann.weights
        carried = self.contact.components(self.carry(stresses.reshape(-1)))
        return np.asarray((self.contact.weights * carried).reshape(-1))

    def pressed(self, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return True for the Neumann nodes on which the forces of some contact nodes act."""
        return self.join.mapped(np.abs).values_back(touching) > 0

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
        if not self.one_grid:
            raise ValueError("the grids differ: needed a pair built for these roles, with its own transfer")
        other = replace(self, contact=self.neumann, neumann=self.contact, planes=self.planes[::-1], held=held)
        return replace(other, join=other.holding(ONE_GRID))


def held_along(support: Sequence[Support], contact: Grid, neumann: Grid) -> tuple[Nodes, tuple[Nodes, Nodes]]:
    """Return the contact nodes that are held tangentially, and the ends of Gamma_c on a plane of symmetry.

    There every elastic body is held at 0; a rigid one is its own mirror image.
    """
    planes = np.zeros(contact.n, dtype=bool), np.zeros(neumann.n, dtype=bool)
    for end in (0, -1):
        together = abs(contact.x[end] - neumann.x[end]) <= SAME * np.ptp(contact.x)
        if together and any(support) and all(body is None or body[1][end] for body in support):
            planes[0][end] = planes[1][end] = True
    return planes[0] if support[0] is None else planes[0] | support[0][0], planes

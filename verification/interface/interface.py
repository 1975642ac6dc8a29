"""Two bodies joined along Gamma_c: their grids, the transfer between them, the gap, and a law of friction."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from verification.interface.grid import Grid
from verification.value import Value, freeze


class Law(ABC):
    """A law of friction: the friction bound at a contact node is ``w_j k |(S sigma_N)_j|``, with S linear.

    Attributes
    ----------
    name : str
    label : str
        What it is called in front of "law".
    outside : str
        Why the theorem does not speak of this law; empty where it does.
    needs_radius : bool
        Whether a problem file with friction must give a radius.
    of_contact : bool
        Whether it takes the forces of the contact grid where the grids differ.  They are no function of the forces g on
        the Neumann grid, so that the global method alone can use it there.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    outside: str = ""
    needs_radius: ClassVar[bool] = False
    of_contact: ClassVar[bool] = False

    @classmethod
    def of(cls, radius: Fraction | None) -> Law | None:
        """The law of a problem file with that radius; None where it needs one and has none, as there is no friction."""
        return cls()

    def scaled(self, length: float) -> Law:
        """The same law in a unit of length in which lengths are ``length`` times as large numbers.

        Its operator must then be ``operator / length``; a law that holds a length multiplies it.
        """
        return self

    @property
    @abstractmethod
    def words(self) -> str:
        """The law in a few words, for a screen."""

    @abstractmethod
    def operator(self, interface: Interface) -> Floats:
        """S: normal nodal forces on the Neumann grid to normal stress at the contact nodes, shape (n_c, n_n).

        With ``of_contact`` those on the contact grid, shape (n_c, n_c).
        Forces are per unit thickness, compressive ones positive.
        """

    def warnings(self, interface: Interface) -> list[str]:
        """What a user should know before trusting the numbers of this law on these grids."""
        return []


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
        P: values on the contact grid of a function given on the Neumann grid.  Its transpose and nothing else returns
        the forces.  None where both grids are one: then P is the identity.
    """

    contact: Grid
    neumann: Grid
    gap: Floats
    law: Law | None = None
    transfer: Floats | None = None

    @property
    def counts(self) -> dict[str, int]:
        """How many nodes each grid has."""
        return {"contact_nodes": self.contact.n, "neumann_nodes": self.neumann.n}

    @property
    def summary(self) -> str:
        return f"{self.contact.n} contact nodes, {'no law of friction' if self.law is None else self.law.words}"

    @cached_property
    def kernel(self) -> Floats | None:
        """S as a matrix: normal nodal forces on the Neumann grid to normal stress at the contact nodes.

        Raises
        ------
        ValueError
            The grids differ, and the law takes the forces of the contact grid.
        """
        if self.law is None or self.contact.dimension == 1:
            return None
        if self.law.of_contact and self.transfer is not None:
            raise ValueError(f"{self.law.words}: no operator on the Neumann grid")
        kernel: Floats = freeze(self.law.operator(self))
        return kernel

    @property
    def contact_kernel(self) -> Floats | None:
        """S as a matrix on normal nodal forces of the contact grid, shape (contact nodes, contact nodes)."""
        if self.transfer is not None and self.law is not None and self.law.of_contact:
            return self.law.operator(self)
        if self.transfer is None or self.kernel is None:
            return self.kernel
        return self.kernel @ self.transfer.T

    def stress(self, force: Floats) -> Floats:
        """``S sigma_N`` at the contact nodes for a force on the Neumann grid; 0 without a law of friction."""
        kernel = self.kernel
        return np.zeros(self.contact.n) if kernel is None else np.asarray(kernel @ force[self.neumann.normal])

    def carry(self, traces: Floats) -> Floats:
        """``P u``: traces on the Neumann grid, one or columns of them, as the contact grid sees them."""
        if self.transfer is None:
            return traces
        blocks = traces.reshape(self.neumann.dimension, self.neumann.n, *traces.shape[1:])
        return np.concatenate([self.transfer @ block for block in blocks])

    def carry_back(self, forces: Floats) -> Floats:
        """``P' f``: nodal forces on the contact grid, one or columns of them, as the Neumann grid receives them."""
        if self.transfer is None:
            return forces
        blocks = forces.reshape(self.contact.dimension, self.contact.n, *forces.shape[1:])
        return np.concatenate([self.onto_neumann(block) for block in blocks])

    def spread(self, forces: Floats) -> Floats:
        """Nodal forces on the Neumann grid as nodal forces on the contact grid that have the same stresses there."""
        if self.transfer is None:
            return forces
        blocks = forces.reshape(self.neumann.dimension, self.neumann.n)
        weights = self.contact.weights
        return np.concatenate([weights * (self.transfer @ (block / self.neumann.weights)) for block in blocks])

    def reaches(self, components: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """True for the contact components whose forces act on some of the given components of the Neumann grid."""
        if self.transfer is None:
            return components
        blocks = components.reshape(self.neumann.dimension, self.neumann.n)
        return np.concatenate([(self.transfer != 0) @ block for block in blocks])

    def onto_neumann(self, forces: Floats) -> Floats:
        """``P' f`` of one component: nodal forces on the contact grid, one or columns of them."""
        return forces if self.transfer is None else np.asarray(self.transfer.T @ forces)

    def pressed(self, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The Neumann nodes on which the forces of some contact nodes act."""
        return touching if self.transfer is None else np.asarray((self.transfer != 0).T @ touching, dtype=bool)

    def carry_form(self, form: Floats) -> Floats:
        """``P' X P`` of a symmetric matrix on the contact grid."""
        return form if self.transfer is None else self.carry_back(self.carry_back(form).T)

    def swapped(self) -> Interface:
        """The interface with the roles of the grids exchanged.

        Raises
        ------
        ValueError
            The grids differ: each direction has a transfer of its own.
        """
        if self.transfer is not None:
            raise ValueError("the grids differ: needed a pair built for these roles, with a transfer of its own")
        return Interface(contact=self.neumann, neumann=self.contact, gap=self.gap, law=self.law)

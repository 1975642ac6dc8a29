"""Two bodies on their meshes along Gamma_c, as they were assembled, and what to say of them before any number."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.interface.body import Body
from verification.interface.interface import Interface
from verification.problem import Problem
from verification.problem.tables import ProblemError
from verification.value import Value

#: Poisson ratio from which on linear triangles err visibly.  Two models against a mesh that does not lock (rectangles
#: split by both diagonals, 72 cells along Gamma_c): at 0.48 the nodal pressures of the built-in split are off by 5 and
#: 6 % (0.7 and 2.3 % at 0.3) and the force by 2 %, 7 to 11 % with 12 cells; at 0.499 the pressures by 40 and 11 %.
LOCKING = 0.48


class SingularRole(ProblemError):
    """The body that would get the Neumann problem can move rigidly.

    Parameters
    ----------
    body : {1, 2}
    motions : int
        How many rigid motions its supports leave.
    """

    def __init__(self, source: str, body: int, motions: int) -> None:
        name, other = f"body{body}", 3 - body
        free = f"{motions} free motion{'s' if motions > 1 else ''}"
        super().__init__(
            source,
            name,
            None,
            f"{name} can move rigidly ({free}), so that its stiffness matrix in the Neumann problem of step I is"
            f" singular: give body {other} the Neumann problem (iteration.neumann_body = {other}), fix or prescribe"
            f" more sides of {name}, or use `ndtheory solve`",
        )


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class TwoBodies(Value):
    """Two bodies on their meshes along Gamma_c; one of them may be rigid.

    Attributes
    ----------
    body1, body2 : Body or None
        None where rigid.
    interface : Interface
        What joins them, in the roles of the problem.
    friction : Fraction
        k, constant along Gamma_c.
    problem : Problem
        What they were made from.
    """

    body1: Body | None
    body2: Body | None
    interface: Interface
    friction: Fraction
    problem: Problem

    @property
    def summary(self) -> str:
        return f"{self.problem.title}, {self.interface.contact.n} contact nodes"

    @property
    def neumann(self) -> Body | None:
        """The body whose traces reach the contact grid by the transfer; None where it is rigid."""
        return self.body2 if self.problem.contact_body == 1 else self.body1

    def force_on(self, body: Body, force: Floats) -> Floats:
        """Nodal forces on the contact grid as the grid of a body receives them."""
        return self.interface.carry_back(force) if body is self.neumann else force

    @property
    def elastic(self) -> list[Body]:
        """The bodies that are not rigid."""
        return [body for body in (self.body1, self.body2) if body is not None]

    @property
    def outside(self) -> list[str]:
        """Why the theorem does not speak of this problem; empty where it does."""
        return reasons_outside(self.interface, self.friction, [body.unknown for body in self.elastic])

    @property
    def warnings(self) -> list[str]:
        """What a user should know before trusting the numbers."""
        return warnings_of(self.interface, self.friction, self.elastic)


def reasons_outside(interface: Interface, friction: Fraction, free: list[Any]) -> list[str]:
    reasons = []
    if friction and interface.law is not None and interface.law.outside:
        reasons.append(interface.law.outside)
    if not all(components.all() for components in free):
        reasons.append("a contact node is held tangentially: Gamma_u and Gamma_c must not meet")
    return reasons


def nearly_incompressible(bodies: list[Body]) -> str:
    ratios = {f"{body.name}.poisson": body.poisson for body in bodies}
    return " and ".join(f"{key} = {ratio:.12g}" for key, ratio in ratios.items() if ratio >= LOCKING)


def warnings_of(interface: Interface, friction: Fraction, bodies: list[Body]) -> list[str]:
    found = []
    near = nearly_incompressible(bodies)
    if near:
        found.append(
            f"{near}: near 1/2 linear triangles make a body too stiff and scatter the nodal"
            f" pressures (Section 6 at {LOCKING:g}: 5 %, at 0.499: 40 %); needed a finer mesh, or a mesh file whose"
            " rectangles are split by both diagonals"
        )
    if interface.gap.min() < 0:
        j = int(np.argmin(interface.gap))
        found.append(
            f"the initial gap is {interface.gap[j]:.4g} at x = {interface.contact.x[j]:g}: the bodies overlap as they"
            " are drawn, and press each other apart before any load acts"
        )
    if friction and interface.law is not None and interface.contact.dimension == 2:
        found += interface.law.warnings(interface)
    return found

"""Two bodies along Gamma_c: on their meshes as they were assembled, and condensed, with the roles of the algorithm."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.constants import take
from ndtheory.number import Numeric
from verification.interface.body import Body, Condensed
from verification.interface.interface import Interface
from verification.interface.joining import check_slopes
from verification.problem import Problem, Settings
from verification.problem.specification import MOST_FRICTION
from verification.problem.tables import ProblemError
from verification.value import Value, freeze

#: Poisson ratio from which on linear triangles err visibly.  Two models against a mesh that does not lock (rectangles
#: split by both diagonals, 72 cells along Gamma_c): at 0.48 the nodal pressures of the built-in split are off by 5 and
#: 6 % (0.7 and 2.3 % at 0.3) and the force by 2 %, 7 to 11 % with 12 cells; at 0.499 the pressures by 40 and 11 %.
LOCKING = 0.48


class SingularRole(ProblemError):
    """The body that would get the Neumann problem can move rigidly.

    Parameters
    ----------
    source : str
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


#: What is unknown of matrices and runs from elsewhere.
UNITS = {"length": "any", "stress": "any"}


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
        return _outside(self.interface, self.friction, [body.unknown for body in self.elastic])

    @property
    def warnings(self) -> list[str]:
        """What a user should know before trusting the numbers."""
        return _warnings(self.interface, self.friction, self.elastic)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContactPair(Value):
    """Two condensed bodies with the roles of the algorithm, the interface that joins them, and friction.

    Attributes
    ----------
    contact : Condensed
        The body of step II.
    neumann : Condensed
        The body of step I.  Both have their normal components along n of the contact body.
    interface : Interface
    friction : Fraction
        k, constant along Gamma_c.
    neumann_body : {1, 2}
        Who has the Neumann problem; body 1 lies below body 2.
    settings : Settings
        How a run goes unless it is told otherwise.
    problem : Problem or None
        What the pair was made from, for documents and messages; None where it was made from matrices.
    """

    contact: Condensed
    neumann: Condensed
    interface: Interface
    friction: Fraction = Fraction(0)
    neumann_body: Literal[1, 2] = 2
    settings: Settings = field(default_factory=Settings)
    problem: Problem | None = None

    @property
    def summary(self) -> str:
        k = f"k = {float(self.friction):g}"
        return f"{self.title}, {self.contact.grid.n} contact nodes, {k}, Neumann body {self.neumann_body}"

    @property
    def contact_body(self) -> Literal[1, 2]:
        """The body of step II, which carries the contact grid."""
        return 1 if self.neumann_body == 2 else 2

    @property
    def body1(self) -> Condensed:
        """The lower body."""
        return self.contact if self.neumann_body == 2 else self.neumann

    @property
    def body2(self) -> Condensed:
        """The upper body."""
        return self.neumann if self.neumann_body == 2 else self.contact

    @property
    def along_y(self) -> tuple[Condensed, Condensed]:
        """The lower body and the upper one with their normal components along y, as matrices are written and read."""
        lower, upper = (side if side.upward else side.turned() for side in (self.body1, self.body2))
        return lower, upper

    @property
    def upward(self) -> float:
        """+1 where the outward normal of the contact body points up (body 1), -1 where it points down (body 2)."""
        return 1.0 if self.neumann_body == 2 else -1.0

    def orient(self, interface: Floats) -> Floats:
        """Turn interface vectors of the contact grid between y and n of the contact body (its own inverse)."""
        return self.contact.orient(interface)

    def at(self, *, friction: Numeric) -> ContactPair:
        """The same bodies at another friction; what is condensed is shared.

        Raises
        ------
        HypothesisError
            Unless k >= 0, or where friction has no law.
        """
        law = self.interface.kernel is not None
        needed = "a number >= 0" if law else "0: without a law of friction there is none"
        k = take("friction", friction, needed, lambda v: v == 0 or (law and v > 0))
        origin = self.problem
        if origin is not None:  # a file may not hold every friction
            origin = origin.changed(friction=k) if k <= MOST_FRICTION else None
        return replace(self, friction=k, problem=origin)

    def changed(self, **values: Any) -> ContactPair:
        """The pair of its problem with other values, which are those of :meth:`verification.Problem.changed`.

        What is condensed is shared: a body is condensed anew only where its mesh, its supports or its Poisson ratio
        change.  Young's modulus multiplies its stiffness.  A law of friction of its own stays unless ``law`` or
        ``radius`` is given; the settings are those of the changed problem.

        Raises
        ------
        ProblemError
            Naming the key as the problem file has it.
        ValueError
            The pair is made from matrices.
        """
        if self.problem is None:
            raise ValueError("this pair is made from matrices: needed a problem, whose values can change")
        from verification.interface.assembly import build  # it makes pairs

        law = None if {"law", "radius"} & values.keys() else self.interface.law
        return build(self.problem.changed(**values), law=law, like=self)

    def swapped(self) -> ContactPair:
        """The same bodies with the roles exchanged; what is condensed is shared.

        Where the grids differ the transfer is another one: that of the problem with these roles.

        Raises
        ------
        SingularRole
            Contact alone holds the contact body, which would get the Neumann problem.
        ProblemError
            The grids differ, and Gamma_c does not end at nodes of the other body; or that body's line is steep.
        ValueError
            The grids differ, and the pair is made from matrices.
        """
        if self.contact.loose:
            raise SingularRole(self.source, self.contact_body, self.contact.motions.shape[1])
        if self.interface.transfer is not None and self.problem is not None:
            from verification.interface.assembly import build  # it makes pairs

            return build(self.problem.swapped(), law=self.interface.law, like=self)
        if self.problem is not None and self.contact.grid.dimension == 2:
            bodies = [side.mesh_body for side in (self.body1, self.body2)]
            check_slopes(self.problem.swapped(), [body.mesh.points[body.nodes] for body in bodies])
        return replace(
            self,
            contact=self.neumann.turned(),
            neumann=self.contact.turned(),
            interface=self.interface.swapped(),
            neumann_body=1 if self.neumann_body == 2 else 2,
            problem=None if self.problem is None else self.problem.swapped(),
        )

    def on_meshes(self) -> TwoBodies:
        """The bodies on their meshes under the loads of this pair, as the global method takes them.

        Raises
        ------
        ValueError
            The pair is made from matrices.
        """
        if self.problem is None:
            raise ValueError("this pair is made from matrices: needed the meshes of both bodies")
        return TwoBodies(
            body1=self.body1.loaded_body,
            body2=self.body2.loaded_body,
            interface=self.interface,
            friction=self.friction,
            problem=self.problem,
        )

    @property
    def title(self) -> str:
        """That of the problem."""
        return "matrices" if self.problem is None else self.problem.title

    @property
    def units(self) -> dict[str, str]:
        """Labels ``length`` and ``stress``."""
        return dict(UNITS if self.problem is None else self.problem.units)

    @property
    def source(self) -> str:
        """What errors name: a file, ``<dict>`` or ``<matrices>``."""
        return "<matrices>" if self.problem is None else self.problem.source

    @property
    def rubs(self) -> bool:
        """Whether friction can act."""
        return bool(self.friction) and self.interface.kernel is not None

    @property
    def held(self) -> bool:
        """Whether a contact node of a body is held tangentially."""
        return not (self.contact.free.all() and self.neumann.free.all())

    def bound(self, force: Floats) -> Floats:
        """Friction bound on nodal forces at the contact nodes, ``w_j k |(S sigma_N)_j|``, shape (t,).

        Parameters
        ----------
        force : array
            On the Neumann grid; sigma_N are its normal components.
        """
        if not self.rubs:
            return np.zeros(self.interface.contact.t)
        return np.asarray(self._limits * np.abs(self.interface.stress(force)))

    @cached_property
    def _limits(self) -> Floats:
        """``w_j k``."""
        limits: Floats = freeze(float(self.friction) * self.interface.contact.weights)
        return limits

    @property
    def outside(self) -> list[str]:
        """Why the theorem does not speak of this pair; empty where it does."""
        return _outside(self.interface, self.friction, [self.contact.free, self.neumann.free])

    @property
    def nearly_incompressible(self) -> str:
        """The keys that hold a Poisson ratio of LOCKING or more, for a message; empty where none does."""
        return _nearly_incompressible([side.body for side in (self.body1, self.body2) if side.body is not None])

    @property
    def warnings(self) -> list[str]:
        """What a user should know before trusting the numbers."""
        bodies = [side.body for side in (self.body1, self.body2) if side.body is not None]
        return _warnings(self.interface, self.friction, bodies)


def _outside(interface: Interface, friction: Fraction, free: list[Any]) -> list[str]:
    reasons = []
    if friction and interface.law is not None and interface.law.outside:
        reasons.append(interface.law.outside)
    if not all(components.all() for components in free):
        reasons.append("a contact node is held tangentially: Gamma_u and Gamma_c must not meet")
    return reasons


def _nearly_incompressible(bodies: list[Body]) -> str:
    ratios = {f"{body.name}.poisson": body.poisson for body in bodies}
    return " and ".join(f"{key} = {ratio:.12g}" for key, ratio in ratios.items() if ratio >= LOCKING)


def _warnings(interface: Interface, friction: Fraction, bodies: list[Body]) -> list[str]:
    found = []
    near = _nearly_incompressible(bodies)
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

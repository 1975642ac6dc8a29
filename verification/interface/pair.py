"""Two bodies condensed onto Gamma_c, with the roles of the algorithm: made from a problem, changed, swapped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.constants import take
from ndtheory.number import Numeric
from verification.dense import reciprocal_condition
from verification.interface.assembly import (
    SingularRole,
    TwoBodies,
    held_bodies,
    nearly_incompressible,
    reasons_outside,
    warnings_of,
)
from verification.interface.body import Body, Condensed
from verification.interface.interface import Grid, Interface, Law
from verification.interface.joining import check_slopes
from verification.interface.matrices import real_array
from verification.problem import Problem, Settings
from verification.problem.readers import MOST_FRICTION
from verification.problem.specs import Profile
from verification.problem.steps import path_warnings
from verification.value import Value, copied, freeze

#: Condensation loses one digit of the least stiff motion of a body for each digit of 1/rcond: at 1e-13 three are left.
LEAST_RCOND = 1e-13

#: The units of matrices and runs from elsewhere.
UNITS = {"length": "any", "stress": "any"}


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
        k, the largest one where it varies along Gamma_c.
    neumann_body : {1, 2}
        The body of the file with the Neumann problem; body 1 lies below body 2.
    settings : Settings
        Settings of a run, unless others are given.
    problem : Problem or None
        The problem of the pair, for documents and messages; None if the pair was made from matrices.
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
        k = f"k = {float(self.friction):g}" + " at most" * self.interface.varies
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
        """Both bodies with their normal components from body 1 to body 2, as matrices are written and read."""
        lower, upper = (side if side.upward else side.turned() for side in (self.body1, self.body2))
        return lower, upper

    @property
    def interface_along_y(self) -> Interface:
        """The interface for vectors as those of :attr:`along_y`."""
        return self.interface if self.contact.upward else self.interface.reversed()

    @property
    def normal_sign(self) -> float:
        """+1 where the outward normal of the contact body points up (body 1), -1 where it points down (body 2)."""
        return 1.0 if self.neumann_body == 2 else -1.0

    def at(self, *, friction: Numeric) -> ContactPair:
        """Return the same bodies at another friction; condensed matrices are shared.

        Where k varies along Gamma_c, all of it is multiplied by one number, and ``friction`` is its largest value.

        Raises
        ------
        HypothesisError
            Unless k >= 0, or if friction has no law.
        """
        law = self.interface.kernel is not None
        needed = "a number >= 0" if law else "0: without a law of friction there is none"
        k = take("friction", friction, needed, lambda v: v == 0 or (law and v > 0))
        origin = self.problem
        if origin is not None and k > MOST_FRICTION:  # a file may not hold every friction
            origin = None
        elif origin is not None and self.interface.varies:
            origin = origin.rubbing(k)
        elif origin is not None:
            origin = origin.changed(friction=k)
        return replace(self, friction=k, problem=origin)

    def along(self, friction: Callable[[float], Any] | Sequence[Any] | Floats) -> ContactPair:
        """Return the same bodies with a coefficient of friction that varies; condensed matrices are shared.

        Parameters
        ----------
        friction : callable or array, shape (contact nodes,)
            k at the contact nodes from left to right, or a function of their distance s from the left end of Gamma_c.

        Raises
        ------
        ValueError
            Unless all k >= 0 and one for each contact node, or if friction has no law.
        """
        if self.interface.several:
            raise ValueError("friction: needed a number, or a table in each [[contact]] of the file")
        s = [Fraction(at) for at in self.contact.grid.s.tolist()]
        if isinstance(friction, np.ndarray) and friction.dtype.kind not in "OU":  # those may hold exact numbers
            friction = real_array("friction", friction, (len(s),), f"a number for each of the {len(s)} contact nodes")
        values = [friction(float(at)) for at in s] if callable(friction) else np.asarray(friction).tolist()
        if not isinstance(values, list) or len(values) != len(s) or len(s) < 2:
            raise ValueError(f"friction: needed a number for each of the {len(s)} contact nodes, two or more")
        k = [take("friction", value, "numbers >= 0", lambda v: v >= 0) for value in values]
        largest, profile = Profile.of(s, k)
        found = replace(self, interface=replace(self.interface, profile=profile), problem=None).at(friction=largest)
        if self.problem is None or largest > MOST_FRICTION:
            return found
        contact = replace(self.problem.contact, friction=largest, profile=profile)
        return replace(found, problem=replace(self.problem, contacts=(contact,)))

    def changed(self, **values: Any) -> ContactPair:
        """Return the pair of its problem with other values, which are those of :meth:`verification.Problem.changed`.

        Condensed matrices are shared: a body is condensed anew only where its mesh, its supports or its Poisson ratio
        change.  Young's modulus multiplies its stiffness.  A law that was given to the pair stays unless ``law`` or
        ``radius`` is given; the settings come from the changed problem.

        Raises
        ------
        ProblemError
            Naming the key as the problem file has it.
        ValueError
            The pair is made from matrices.
        """
        if self.problem is None:
            raise ValueError("this pair is made from matrices: needed a problem, whose values can change")
        law = None if {"law", "radius"} & values.keys() else self.interface.law
        return pair_from(self.problem.changed(**values), law=law, like=self)

    def under(self, problem: Problem, slipped: Floats | None = None) -> ContactPair:
        """Return the same bodies under the loads of another problem, which has no other difference.

        Nothing is assembled or factorised anew.

        Parameters
        ----------
        slipped : array, shape (contact nodes,), optional
            ``u1_T - u2_T`` so far, from which friction measures slip; 0 by default.

        Raises
        ------
        ProblemError
            Two sides prescribe different displacements of a node.
        ValueError
            The pair is made from matrices.
        """
        bodies = self.on_meshes().under(problem, slipped)
        lower, upper = (
            side if body is None else side.under(body)
            for side, body in ((self.body1, bodies.body1), (self.body2, bodies.body2))
        )
        contact, neumann = (lower, upper) if self.neumann_body == 2 else (upper, lower)
        interface = copied(self.interface, slipped=bodies.interface.slipped)
        return replace(self, contact=contact, neumann=neumann, interface=interface, problem=problem)

    def swapped(self) -> ContactPair:
        """Return the same bodies with the roles exchanged; condensed matrices are shared.

        Where the grids differ, or the line is a named one, the interface is made anew, from the problem with these
        roles.

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
            if self.problem is not None:
                raise SingularRole.of(self.problem, self.contact.mesh_body, self.neumann.mesh_body)
            raise SingularRole(self.source, self.contact_body, self.contact.motions.shape[1])
        if self.problem is not None and (self.problem.named or not self.interface.one_grid):
            return pair_from(self.problem.swapped(), law=self.interface.law, like=self)
        if self.problem is not None and self.contact.grid.dimension == 2:
            bodies = [side.mesh_body for side in (self.body1, self.body2)]
            check_slopes(self.problem.swapped(), [body.mesh.points[body.nodes] for body in bodies])
        return replace(
            self,
            contact=self.neumann.turned(),
            neumann=self.contact.turned(),
            interface=self.interface.swapped(self.neumann.support[0]),
            neumann_body=1 if self.neumann_body == 2 else 2,
            problem=None if self.problem is None else self.problem.swapped(),
        )

    def on_meshes(self) -> TwoBodies:
        """Return the bodies on their meshes under the loads of this pair, as the global method takes them.

        Raises
        ------
        ValueError
            The pair is made from matrices.
        """
        if self.problem is None:
            raise ValueError("this pair is made from matrices: needed the meshes of both bodies")
        return TwoBodies(
            body1=None if self.body1.rigid else self.body1.loaded_body,
            body2=None if self.body2.rigid else self.body2.loaded_body,
            interface=self.interface_along_y,
            friction=self.friction,
            problem=self.problem,
        )

    def words(self, body: int) -> str:
        """Return what body 1 or body 2 stands for in the file: ``body 2``, or ``bodies 2, 4``."""
        return f"body {body}" if self.problem is None else self.problem.words(body)

    @property
    def title(self) -> str:
        """The title of the problem."""
        return "matrices" if self.problem is None else self.problem.title

    @property
    def units(self) -> dict[str, str]:
        """Labels ``length`` and ``stress``."""
        return dict(UNITS if self.problem is None else self.problem.units)

    @property
    def source(self) -> str:
        """The name in errors: a file, ``<dict>`` or ``<matrices>``."""
        return "<matrices>" if self.problem is None else self.problem.source

    @cached_property
    def offset(self) -> Floats:
        """The jump of the contact body against the other one at which v = 0: the slip so far, and the gap."""
        offset = self.interface.offset
        offset[self.contact.grid.tangential] *= self.normal_sign
        return freeze(offset)

    @property
    def rubs(self) -> bool:
        """True if friction can act."""
        return bool(self.friction) and self.interface.kernel is not None

    @property
    def held(self) -> bool:
        """True if a contact node of a body is held tangentially."""
        return not (self.contact.free.all() and self.neumann.free.all())

    @property
    def same_traces(self) -> bool:
        """True if both bodies have the same traces: one grid, and the same components held."""
        return self.interface.one_grid and np.array_equal(self.contact.free, self.neumann.free)

    def bound(self, force: Floats) -> Floats:
        """Return the friction bound ``w_j k_j |(S sigma_N)_j|``, shape (t,), for nodal forces on the Neumann grid."""
        if not self.rubs:
            return np.zeros(self.interface.contact.t)
        return np.asarray(self._limits * np.abs(self.interface.stress(force)))

    @cached_property
    def _limits(self) -> Floats:
        """``w_j max k``; the kernel has ``k_j / max k``."""
        return freeze(float(self.friction) * self.interface.contact.weights)

    @property
    def outside(self) -> list[str]:
        """The reasons why the theorem does not apply to this pair; empty where it does."""
        return reasons_outside(self.interface, self.friction, {1: self.body1.free, 2: self.body2.free})

    @property
    def _meshed(self) -> list[Body]:
        return [side.body for side in (self.body1, self.body2) if side.body is not None]

    @property
    def nearly_incompressible(self) -> str:
        """The keys that hold a Poisson ratio of LOCKING or more, for a message; empty where none does."""
        return nearly_incompressible(self._meshed)

    @property
    def warnings(self) -> list[str]:
        """Facts that a user should know before trusting the numbers."""
        path = [] if self.problem is None else path_warnings(self.problem)
        return warnings_of(self.interface, self._meshed) + path


def pair_from(
    problem: Problem, *, law: Law | None = None, like: ContactPair | None = None, obstacle: bool = False
) -> ContactPair:
    """Condense the two bodies of a problem and give them roles, as the iteration and its constants need them.

    Parameters
    ----------
    problem : Problem
        Its ``[iteration]`` gives the roles and the pair's settings.
    law : Law, optional
        A law of friction in place of the problem's.
    like : ContactPair, optional
        Its condensed matrices are shared by bodies that are the same, or differ only in Young's modulus and loads.
    obstacle : bool
        True if the body with the Neumann problem may be rigid: it does not move, and only a run takes such a pair.

    Raises
    ------
    ProblemError
        As :func:`verification.interface.assembly.discretise`, and where a body is rigid, the one with the Neumann
        problem can move rigidly, or rounding leaves no digit of a stiffness on Gamma_c.
    """
    bodies, iteration = held_bodies(problem, law=law, obstacle=obstacle), problem.iteration
    known = (None, None) if like is None else (like.body1, like.body2)
    upward, grids = iteration.neumann_body == 2, (bodies.interface.contact, bodies.interface.neumann)
    interface = bodies.interface
    if like is not None and like.interface.slipped.any():
        if not interface.contact.equals(like.interface.contact):
            raise problem.refuse("contact", None, "needed the contact nodes of the increment, on which it has slipped")
        interface = replace(interface, slipped=like.interface.slipped)
    places = zip((bodies.body1, bodies.body2), grids if upward else grids[::-1], known, strict=True)
    sides = [None if body is None else _condensed(body, grid, upward, side) for body, grid, side in places]
    for name, side in zip(("body1", "body2"), sides, strict=True):
        if side is not None:
            _check_digits(problem, name, side)
    contact, neumann = sides if upward else sides[::-1]
    assert contact is not None  # see `held_bodies`
    return ContactPair(
        contact=contact,
        neumann=Condensed.obstacle(contact) if neumann is None else neumann,
        interface=interface if upward else interface.reversed(),
        friction=bodies.friction,
        neumann_body=iteration.neumann_body,
        settings=iteration.settings,
        problem=problem,
    )


def _check_digits(problem: Problem, name: str, side: Condensed) -> None:
    """Refuse a body so slender, or of cells so stretched, that rounding hides its stiffness in the softest motion."""
    found = reciprocal_condition(side.schur, np.flatnonzero(side.free), side.motions)
    if not found > LEAST_RCOND:
        needed = (
            f"its stiffness on Gamma_c is lost in rounding (1/condition {found:.1g}): needed more than {LEAST_RCOND:g},"
            " by a body less slender or cells less stretched; `ndtheory solve` needs no such matrix"
        )
        raise problem.refuse(name, None, needed)


def _condensed(body: Body, grid: Grid, upward: bool, like: Condensed | None) -> Condensed:
    """Condense a body, its normal components along y or against it; one like it may be condensed already."""
    if like is None or like.body is None:
        found = Condensed.of(body, grid)
    elif body.equals(like.body):
        found = like if grid.equals(like.grid) else replace(like, grid=grid)
    else:
        found = Condensed.of(body, grid, like.body)
    return found if found.upward == upward else found.turned()

"""The same pair or problem in another unit, in a mirror, or from below.

Nothing that is true of the theorem may change with any of these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.interface.body import Condensed
from verification.interface.friction import GivenOperator
from verification.interface.interface import Grid
from verification.interface.pair import ContactPair
from verification.problem import Problem
from verification.problem.specs import BodySpec, Norm


def _of_matrices(
    pair: ContactPair, side: Callable[[Condensed], Condensed], kernel: Floats | None, **changes: Any
) -> ContactPair:
    """A pair of matrices whose sides are made from those of another one."""
    contact, neumann = (replace(side(given), body=None, own_load=None) for given in (pair.contact, pair.neumann))
    law = None if kernel is None else GivenOperator(matrix=kernel)
    joined = replace(pair.interface, contact=contact.grid, neumann=neumann.grid, law=law, profile=None, **changes)
    return replace(pair, contact=contact, neumann=neumann, interface=joined, problem=None)


def in_units(pair: ContactPair, *, force: float = 1.0, stress: float = 1.0, length: float = 1.0) -> ContactPair:
    """A pair whose numbers are those of other units, as a pair of matrices.

    Stresses are ``stress`` times as large numbers, lengths ``length`` times.  ``force`` does not change a unit: loads,
    prescribed displacements and gaps are that many times as large, and so are forces and displacements of the solution.

    Interface forces, per unit thickness, are then ``force * stress * length`` times as large (``force * stress`` in one
    dimension).
    """
    plane = pair.contact.grid.dimension == 2
    of_forces = force * stress * (length if plane else 1.0)
    of_stiffness = stress if plane else stress / length

    def side(given: Condensed) -> Condensed:
        grid = given.grid
        scaled = Grid(x=length * grid.x, weights=(length if plane else 1.0) * grid.weights, dimension=grid.dimension)
        return replace(
            given,
            grid=scaled,
            schur=of_stiffness * given.schur,
            load=of_forces * given.load,
            known=force * length * given.known,
        )

    kernel, gap = pair.interface.kernel, force * length * pair.interface.gap
    return _of_matrices(pair, side, None if kernel is None else kernel / length, gap=gap)


def reflect(pair: ContactPair, force: Floats) -> Floats:
    """Forces on the Neumann grid, or columns of them, as a mirror across Gamma_c shows them: x becomes -x."""
    return _reflected(pair.neumann.grid, force)


def _reflected(grid: Grid, vector: Floats) -> Floats:
    return np.concatenate([-vector[grid.tangential][::-1], vector[grid.normal][::-1]])


def mirrored(pair: ContactPair) -> ContactPair:
    """The mirror image of a pair, x to -x, as a pair of matrices; that of bars has the same matrices."""
    interface = pair.interface

    def side(given: Condensed) -> Condensed:
        grid = given.grid
        return replace(
            given,
            grid=Grid(x=-grid.x[::-1], weights=grid.weights[::-1], dimension=grid.dimension),
            schur=_reflected(grid, _reflected(grid, given.schur).T),
            load=_reflected(grid, given.load),
            known=_reflected(grid, given.known),
            free=np.concatenate([given.free[grid.tangential][::-1], given.free[grid.normal][::-1]]),
        )

    turn = lambda matrix: None if matrix is None else matrix[::-1, ::-1].copy()
    join = interface.join.mapped(lambda P: P[::-1, ::-1].copy())
    return _of_matrices(pair, side, turn(interface.kernel), gap=interface.gap[::-1], join=join)


def upside_down(pair: ContactPair) -> ContactPair:
    """The pair seen from behind: body 1 is called body 2, and the roles stay with their bodies, as a pair of matrices.

    Forces, in the direction of the contact body's normal, keep their numbers.
    """
    turned = _of_matrices(pair, lambda side: replace(side, upward=not side.upward), pair.interface.kernel)
    return replace(turned, neumann_body=1 if pair.neumann_body == 2 else 2)


# --- problems ---------------------------------------------------------------------------------------------------------


def _times(values: tuple[Any, ...] | None, factor: Fraction) -> Any:
    return None if values is None else tuple(None if v is None else v * factor for v in values)


def problem_in_units(problem: Problem, *, stress: Fraction = Fraction(1), length: Fraction = Fraction(1)) -> Problem:
    """A problem whose stresses and lengths are so many times as large numbers; what it describes is the same."""

    def body(given: BodySpec) -> BodySpec:
        each = lambda sides, factor: {name: _times(values, factor) for name, values in sides.items()}
        return replace(
            given,
            x=_times(given.x, length),
            y=_times(given.y, length),
            young=given.young * stress,
            prescribed=each(given.prescribed, length),
            traction=each(given.traction, stress),
            body_force=_times(given.body_force, stress / length),
        )

    contact = problem.contact
    radius = None if contact.radius is None else contact.radius * length
    interval, profile = _times(contact.interval, length), contact.profile
    if profile is not None:
        profile = replace(profile, s=_times(profile.s, length))
    return replace(
        problem,
        body1=body(problem.body1),
        body2=body(problem.body2),
        contacts=(replace(contact, interval=interval, radius=radius, gap=contact.gap * length, profile=profile),),
        norm=Norm(length=problem.length * length),
    )


def problem_mirrored(problem: Problem) -> Problem:
    """The mirror image of a plane problem whose rectangles have an even number of cells along x.

    With an odd number the image of a mesh is split along the other diagonals, and is another mesh.
    """
    if problem.dimension == 1:
        return problem
    names = {"left": "right", "right": "left"}
    turned = lambda v: (None if v[0] is None else -v[0], *v[1:])

    def sides(given: Mapping[str, Any]) -> dict[str, Any]:
        return {names.get(name, name): turned(values) for name, values in given.items()}

    def body(given: BodySpec) -> BodySpec:
        if given.x is None or given.cells is None or given.cells[0] % 2:
            raise ValueError(f"cells {given.cells}: needed a rectangle with an even number of cells along x")
        return replace(
            given,
            x=(-given.x[1], -given.x[0]),
            fixed=tuple(names.get(name, name) for name in given.fixed),
            prescribed=sides(given.prescribed),
            traction=sides(given.traction),
            body_force=turned(given.body_force) if given.body_force else (),
        )

    interval, profile = problem.contact.interval, problem.contact.profile
    ends = None if interval is None else (-interval[1], -interval[0])
    if profile is not None:
        if interval is None:
            raise ValueError("contact.interval: needed where friction varies")
        s = tuple(interval[1] - interval[0] - at for at in profile.s[::-1])
        profile = replace(profile, s=s, share=profile.share[::-1])
    return replace(
        problem,
        body1=body(problem.body1),
        body2=body(problem.body2),
        contacts=(replace(problem.contact, interval=ends, profile=profile),),
    )

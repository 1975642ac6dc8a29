"""Checks of a deformed state outside Gamma_c: whether the bodies penetrate, and whether the strains are small."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations
from typing import ClassVar

import numpy as np

from fem1d2d import Mesh, depths, facet_weights, largest_strains, rectangle, surface
from fem1d2d.mesh import Floats, Ints
from fem1d2d.trace import SAME, extent
from ndtheory.keys import Part, key
from verification.interface.assembly import TwoBodies, lines_on
from verification.interface.body import Body
from verification.interface.fields import ContactFields
from verification.interface.interface import Grid
from verification.interface.joining import obstacle_edges, obstacle_level
from verification.interface.pair import ContactPair
from verification.machine.threads import one_thread
from verification.problem.specs import BodySpec
from verification.value import Value

#: Strain from which a warning is given: linear elasticity is for small strains.
LARGE_STRAIN = 0.05

#: The bodies give way along Gamma_c by the order of the largest strain times its length.  A penetration below this part
#: of it is no more than the strains of the second order, which linear elasticity drops, and the mesh leave open.
SHARE = 0.01

#: Two measures of one state are equal up to this part: runs end 1e-9 from the solution, ``solve`` at rounding.
TIE = 1e-6

NO_NODES: Ints = np.empty(0, dtype=np.int64)

Place = tuple[float, ...]
Displacements = Sequence[Floats | None]


def _whose(measure: str, otherwise: str) -> Callable[[Checks], str]:
    """Why a place is null: as its measure is, or otherwise."""
    return lambda checks: checks.reason.get(measure, otherwise)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Checks(Value, Part):
    """Two measures of a deformed state, and where they are largest; ``reason`` says why a measure is None."""

    part: ClassVar[str] = "Checks"

    penetration_outside: float | None = key(
        r"greatest depth of a surface node outside $\Gamma_c$ inside the other body, in the deformed state; 0 where "
        "none is inside",
        unit="length",
        null="in 1D, for matrices and where the run diverged",
        default=None,
    )
    penetration_at: Place | None = key(
        "where that node is drawn",
        unit="length",
        null="where none is inside",
        why=_whose("penetration_outside", "no node lies inside the other body"),
        default=None,
    )
    largest_strain: float | None = key(
        "largest absolute principal strain over the elements",
        null="for matrices and where the run diverged",
        default=None,
    )
    strain_at: Place | None = key(
        "centre of that element as it is drawn",
        unit="length",
        null="with it, and where nothing is strained",
        why=_whose("largest_strain", "nothing is strained"),
        default=None,
    )
    cut_length: float | None = key(
        r"length of the contact bodies' named sides beyond $\Gamma_c$, where the other body does not face them",
        unit="length",
        null="without named sides",
        why=_whose("penetration_outside", "no side is named"),
        default=None,
    )
    cut_depth: float | None = key(
        "greatest depth of a node of that part inside the other body, in the deformed state; 0 where none would touch",
        unit="length",
        null="with it",
        why=_whose("penetration_outside", "no side is named"),
        default=None,
    )
    reason: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        return f"penetration outside Gamma_c {self.penetration_outside}, largest strain {self.largest_strain}"

    @classmethod
    def without(cls, why: str) -> Checks:
        """Return no measures, for one reason."""
        return cls(reason=dict.fromkeys(("penetration_outside", "largest_strain"), why))


def check_state(
    bodies: TwoBodies | ContactPair,
    displacements: Callable[[], Displacements],
    contact: Callable[[], ContactFields],
    why: str = "",
) -> Checks:
    """Measure a deformed state.

    Parameters
    ----------
    displacements : callable
        Returns those of body 1 and of body 2, shape (nodes, d), unit of length; None where rigid.  It is not called
        where nothing is measured.
    contact : callable
        Returns what happens along Gamma_c.
    why : str
        Why nothing is to be measured.
    """
    if why:
        return Checks.without(why)
    if isinstance(bodies, ContactPair) and bodies.problem is None:
        found = Checks.without("the pair is made from matrices, without meshes")
    else:
        with one_thread():
            on_meshes = bodies.on_meshes() if isinstance(bodies, ContactPair) else bodies
            found = _check(on_meshes, displacements())
    return replace(found, warnings=(*found.warnings, *_of_the_law(bodies, contact())))


def _of_the_law(bodies: TwoBodies | ContactPair, contact: ContactFields) -> list[str]:
    interface = bodies.interface
    if interface.law is None or not bodies.friction:
        return []
    return interface.law.warnings_after(interface, float(bodies.friction), contact.pressure, contact.bound)


def _check(bodies: TwoBodies, moved: Displacements) -> Checks:
    if not all(np.isfinite(u).all() for u in moved if u is not None):
        return Checks.without("the displacements are not finite")
    strain, strain_at = _strain(bodies, moved)
    strained: tuple[str, ...] = ()
    if strain > LARGE_STRAIN:
        above = f"above {100 * LARGE_STRAIN:g} %"
        strained = (f"the largest principal strain is {100 * strain:.2g} % at {_show(strain_at)}, {above}",)
    if bodies.problem.dimension == 1:
        reason = {"penetration_outside": "bars meet at one point, which is Gamma_c"}
        return Checks(largest_strain=strain, strain_at=strain_at, reason=reason, warnings=strained)
    cut, beyond = _cut(bodies) if bodies.problem.named else (None, NO_NODES)
    depth, at, cut_depth = _penetration(bodies, moved, beyond)
    grid = bodies.interface.contact
    crossed: tuple[str, ...] = ()
    if depth > SHARE * strain * float(np.ptp(grid.x)):
        where = f"by {depth:.3g} {bodies.problem.units['length']} at {_show(at)}"
        low, high = grid.place(0), grid.place(-1).removeprefix("x = ")
        short = f"Gamma_c, from {low} to {high}, is too short, and the forces are wrong"
        if bodies.interface.several:
            short = "a line of contact is too short or is missing, and the forces are wrong"
        if cut_depth:
            short += "; nodes of a named side would touch, at which the other side does not face it as they are drawn"
        crossed = (f"outside Gamma_c the bodies overlap, {where}: {short}",)
    return Checks(
        penetration_outside=depth,
        penetration_at=at,
        largest_strain=strain,
        strain_at=strain_at,
        cut_length=cut,
        cut_depth=None if cut is None else cut_depth,
        warnings=crossed + strained,
    )


def _cut(bodies: TwoBodies) -> tuple[float, Ints]:
    """Return the length of the contact body's named sides beyond their lines of contact, and the nodes there."""
    problem, contact = bodies.problem, bodies.problem.contact_body
    body = bodies.body1 if contact == 1 else bodies.body2
    assert body is not None
    length, beyond = 0.0, []
    for line, one in zip(bodies.interface.lines, problem.contacts, strict=True):
        assert one.surface is not None
        [(number, side)] = [
            pair for pair in zip(one.bodies, one.surface, strict=True) if pair[0] in problem.numbers(contact)
        ]
        edges = body.mesh.sides[f"body{number}.{side}" if problem.several else side]
        s = bodies.interface.contact.x[line.contact]
        rest = float(facet_weights(body.mesh, edges).sum()) - float(s[-1] - s[0])
        length += rest if rest > SAME * extent(body.mesh) else 0.0
        beyond.append(np.setdiff1d(edges, body.nodes[line.contact]))
    return length, np.concatenate(beyond)


def _show(place: Place | None) -> str:
    return "" if place is None else f"({', '.join(f'{c:.4g}' for c in place)})"


def _first_largest(values: Floats) -> int:
    """Return the index of the first of the largest values, so that rounding does not choose between mirror images."""
    return int(np.argmax(values >= values.max() * (1 - TIE)))


def _strain(bodies: TwoBodies, moved: Displacements) -> tuple[float, Place | None]:
    """Return the largest absolute principal strain, and the centre of its element."""
    largest, at = 0.0, None
    for body, u in bodies.each(moved):
        strains = largest_strains(body.mesh, u, body.material)
        if strains.max() > largest * (1 + TIE):
            centre = body.mesh.points[body.mesh.cells[_first_largest(strains)]].mean(axis=0)
            at = tuple(map(float, centre))
        largest = max(largest, float(strains.max()))
    return largest, at


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class _Surface(Value):
    """The surface of a body in the deformed state.

    ``drawn`` and ``moved``, shape (n, 2), are its ``nodes`` outside Gamma_c as they are drawn and where they lie now;
    its edges run from ``start`` to ``end``, shape (b, 2), with the body on their left.
    """

    nodes: Ints
    drawn: Floats
    moved: Floats
    start: Floats
    end: Floats

    @classmethod
    def of(cls, mesh: Mesh, u: Floats, lines: Iterable[tuple[Ints, Floats | None, Floats]], cells: Ints) -> _Surface:
        """Return the surface of the body of some cells, with the contact nodes of each line, which may end before them.

        The second entry of a line has the positions of its nodes, x by default.
        """
        points, slack = mesh.points.astype(float), SAME * extent(mesh)
        boundary = mesh.boundary[np.isin(mesh.boundary[:, 0], cells)]
        outside = np.unique(boundary)
        for nodes, positions, ends in lines:
            x = points[nodes, 0] if positions is None else positions
            outside = np.setdiff1d(outside, nodes[(x >= ends[0] - slack) & (x <= ends[1] + slack)])
        now = points + u
        start, end = now[boundary[:, 0]], now[boundary[:, 1]]
        return cls(nodes=outside, drawn=points[outside], moved=now[outside], start=start, end=end)


def _penetration(bodies: TwoBodies, moved: Displacements, beyond: Ints) -> tuple[float, Place | None, float]:
    """Return the greatest depth of a surface node outside Gamma_c inside another body, and where it is drawn.

    The third value is the greatest depth of some nodes of the contact body.
    """
    problem, grid = bodies.problem, bodies.interface.contact
    mean = grid.upright.mean(axis=0)
    gap, named = float(problem.contact.gap), problem.named
    lift = gap * mean / np.linalg.norm(mean) if gap else np.zeros(2)  # of body 2
    surfaces: list[list[_Surface]] = [[], []]
    for body, u in bodies.each(moved):
        i = int(body.name[-1]) - 1
        on = lines_on(body.nodes, bodies.interface, own=body is not bodies.neumann)
        lines = [(nodes, x if named else None, its) for nodes, x, its in on]
        members = [body.mesh.surfaces[f"body{j}"] for j in problem.numbers(i + 1)] if problem.several else []
        each = [body.mesh.cells[cells] for cells in members] or [body.mesh.cells]
        surfaces[i] = [_Surface.of(body.mesh, u + i * lift, lines, cells) for cells in each]
    if not surfaces[0]:
        assert bodies.body2 is not None
        surfaces[0] = [_obstacle(problem.body1, bodies.body2, surfaces[1][0], grid, 0 * lift, upper=True)]
    if not surfaces[1]:
        assert bodies.body1 is not None
        surfaces[1] = [_obstacle(problem.body2, bodies.body1, surfaces[0][0], grid, lift, upper=False)]
    deepest, at, of_cut = 0.0, None, 0.0
    every, own_surfaces = [*surfaces[0], *surfaces[1]], surfaces[problem.contact_body - 1]
    rounding = SAME * max(float(np.ptp(surface.start, axis=0).max()) for surface in every)
    for own, other in permutations(every, 2):
        depth = depths(own.moved, other.start, other.end)
        if len(depth) and depth.max() > max(deepest * (1 + TIE), rounding):
            at = tuple(map(float, own.drawn[_first_largest(depth)]))
        if at is not None:
            deepest = max(deepest, float(depth.max(initial=0.0)))
        if own in own_surfaces:
            of_cut = max(of_cut, float(depth[np.isin(own.nodes, beyond)].max(initial=0.0)))
    return deepest, at, of_cut if of_cut > rounding else 0.0


def _obstacle(spec: BodySpec, body: Body, opposite: _Surface, grid: Grid, lift: Floats, *, upper: bool) -> _Surface:
    """Return an obstacle, as a rectangle that reaches beyond the other body where the problem gives it no end."""
    low, high = opposite.start.min(axis=0), opposite.start.max(axis=0)
    size = float((high - low).max())
    if spec.face:
        start, end = obstacle_edges(spec, size, grid, upper=upper)
        return _Surface(nodes=NO_NODES, drawn=start[:0], moved=start[:0], start=start + lift, end=end + lift)
    ends = grid.x[[0, -1]]
    x = (float(low[0]) - size, float(high[0]) + size) if spec.x is None else (float(spec.x[0]), float(spec.x[1]))
    if spec.y is not None:
        y = (float(spec.y[0]), float(spec.y[1]))
    else:
        face = float(obstacle_level(spec, body.mesh.points[body.nodes].astype(float), upper=upper))
        y = (min(float(low[1]), face) - size, face) if upper else (face, max(float(high[1]), face) + size)
    mesh = rectangle(x, y, (1, 1))
    lines = [(surface(mesh, upper=upper), None, ends)]
    return _Surface.of(mesh, np.broadcast_to(lift, mesh.points.shape), lines, mesh.cells)

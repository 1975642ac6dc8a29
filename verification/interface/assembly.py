"""Two bodies on their meshes along Gamma_c, assembled from a problem: supports, stiffness matrices, warnings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fem1d2d import (
    Mesh,
    MeshError,
    Place,
    Supports,
    body_load,
    facet_weights,
    from_file,
    interval,
    node_at,
    pieces,
    place,
    rectangle,
    rigid_motions,
    stiffness,
    supports,
)
from fem1d2d.element import element_of
from fem1d2d.mesh import Floats, Ints, Split, place_of, shared
from fem1d2d.trace import SAME, extent
from verification.dense import STILL
from verification.interface.body import Body, Name, in_frames, material_of, turning
from verification.interface.interface import Interface, Law, Nodes
from verification.interface.joining import held_normals, join, width_at
from verification.interface.several import join_lines, together
from verification.problem.specification import Problem
from verification.problem.specs import MOST_CELLS, BodySpec
from verification.problem.steps import path_warnings
from verification.problem.tables import ProblemError, short
from verification.value import Value, copied

#: Largest number of contact nodes for interface matrices, which are dense: more would fill the memory.
MOST_CONTACT_NODES = 2000

#: Poisson ratio from which linear triangles err visibly unless they are quadrilaterals split by both diagonals.  Hertz,
#: 24 cells along half the width of contact, irregular nodes with Delaunay's triangles: the largest error of pressure is
#: 3.5 % at 0.3, 8 % at 0.45 and 13 % at 0.475; split by both diagonals 0.3 %, with irregular nodes 0.7 %.
LOCKING = 0.45

#: Errors of the nodal pressures in percent, by Poisson's ratio: root mean squares on the model of Section 6, 24 cells
#: along Gamma_c, for rectangles whose cells are split along alternating diagonals or along both; the largest ones on
#: Hertz's cylinder, 24 cells along half the width of contact, for Delaunay's triangles and for quadrilaterals.
RATIOS = (0.45, 0.475, 0.48, 0.49, 0.499)
PRESSURE_ERRORS = {
    "rectangle": ((2.2, 4.5, 5.0, 9.2, 40.0), (0.7, 1.1, 1.2, 1.5, 1.8), 'with split = "both"'),
    "mesh": ((8.3, 13.0), (0.3, 0.3), "on quadrilaterals"),
}

#: The smaller extent of a body over the larger one, at least: places within 1e-9 of the larger one count as the same.
SLENDEREST = 1e-7

#: From this ratio of the edges of the contact grid to the edges opposite on a warning is given where bodies are
#: curved: with 210 a single node was closed, and the largest pressure was a fifth of the right one.
COARSE = 4.0

#: Part of the length of Gamma_c up to which an overlap may come from reading the gap of curved bodies off their nodes.
READING = 1e-6


class TooManyContactNodes(ProblemError):
    """A valid problem, too large for dense interface matrices."""


class SingularRole(ProblemError):
    """The body that would get the Neumann problem can move rigidly.

    ``motions`` is the number of rigid motions that its supports leave.
    """

    def __init__(self, source: str, body: int, motions: int) -> None:
        name, other = f"body{body}", 3 - body
        remedy = f"give body {other} the Neumann problem (iteration.neumann_body = {other}), fix or prescribe"
        super().__init__(source, name, None, f"{_singular(name, motions)}: {remedy} {_or_solve(name)}")

    @classmethod
    def of(cls, problem: Problem, body: Body, other: Body) -> SingularRole:
        """Return the error for a body of a problem, or for bodies with one role; the other one would have the other."""
        error = cls(problem.source, int(body.name[-1]), body.motions.shape[1])
        if not problem.several:
            return error
        name = f"body{_loose(problem, body)[0]}"
        if loose := _loose(problem, other):
            remedy = f"body{loose[0]} can too, and of a chain held only at its ends neither colouring works: fix"
        else:
            remedy = f"set iteration.neumann_bodies = {list(problem.numbers(int(other.name[-1])))}, fix"
        needed = f"{_singular(name, body.motions.shape[1])}: {remedy} or prescribe {_or_solve(name)}"
        ProblemError.__init__(error, problem.source, name, None, needed)
        return error


def _singular(name: str, motions: int) -> str:
    free = f"{motions} free motion{'s' if motions > 1 else ''}"
    return (
        f"{name} can move rigidly ({free}), so that its stiffness matrix in the Neumann problem of step I is singular"
    )


def _or_solve(name: str) -> str:
    return f"more sides of {name}, or use `ndtheory solve`"


def _moved(body: Body, motions: Floats) -> Nodes:
    """Return the nodes of the cells that some of these motions of the unknowns move, shape (c, corners)."""
    everywhere = np.zeros((body.known.held.size, motions.shape[1]))
    everywhere[body.positions] = motions if body.turned is None else body.turned.T @ motions
    moves = np.abs(everywhere).max(axis=1, initial=0.0).reshape(-1, body.mesh.dimension).max(axis=1) > STILL
    return np.asarray(moves[body.mesh.cells])


def _loose(problem: Problem, body: Body) -> list[int]:
    """Return the numbers of the bodies of a union that can move rigidly."""
    moved = _moved(body, body.motions)
    return [i for i in problem.numbers(int(body.name[-1])) if moved[body.mesh.surfaces[f"body{i}"]].any()]


def _check_pieces(problem: Problem, body: Body, *, hinged: bool) -> None:
    """Refuse a body with a piece that can move where neither its supports nor its contact nodes feel it.

    The global method takes a piece that hangs on a node of another one, as its turning changes no force: ``hinged``.
    """
    if body.motion_traces.shape[1] == body.motions.shape[1]:
        return
    _, values, right = np.linalg.svd(body.motions[body.interface], full_matrices=False)
    felt = right[values > STILL]
    moved, piece = _moved(body, body.motions - body.motions @ felt.T @ felt), pieces(body.mesh, hinged=hinged)
    loose = moved.any(axis=1)
    if hinged:
        loose &= ~np.isin(piece, piece[~moved.all(axis=1)])
        if not loose.any():
            return
    first = int(np.argmax(loose))
    corners = body.mesh.points[body.mesh.cells[piece == piece[first]]].reshape(-1, body.mesh.dimension)
    ends = zip("xy", corners.min(axis=0), corners.max(axis=0), strict=False)
    where = " and ".join(f"{axis} = {low:.6g} to {high:.6g}" for axis, low, high in ends)
    owners = (
        name
        for name, _, prefix in _owners(getattr(problem, body.name), body.name)
        if not prefix or first in body.mesh.surfaces[name]
    )
    needed = f"the piece at {where} can move rigidly where no contact node feels it: fix or prescribe a side of it"
    raise problem.refuse(next(owners), None, f"{needed}, or leave it out")


class NamedPlace(NamedTuple):
    """A point that the problem names: the number of its body in the file, and its place on the mesh of `body`."""

    body: Body
    number: int
    name: str
    point: Floats
    place: Place


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class TwoBodies(Value):
    """Two bodies on their meshes along Gamma_c; one of them may be rigid.

    Attributes
    ----------
    body1, body2 : Body or None
        None where rigid.
    interface : Interface
        In the roles of the problem.
    friction : Fraction
        k, the largest one where it varies along Gamma_c.
    problem : Problem
        The problem they were made from.
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

    @property
    def elastic(self) -> list[Body]:
        """The bodies that are not rigid."""
        return [body for body in (self.body1, self.body2) if body is not None]

    def each(self, moved: Sequence[Floats | None]) -> list[tuple[Body, Floats]]:
        """Return the bodies that are not rigid, with the values of both that belong to them."""
        both = zip((self.body1, self.body2), moved, strict=True)
        return [(body, u) for body, u in both if body is not None and u is not None]

    def under(self, problem: Problem, slipped: Floats | None) -> TwoBodies:
        """Return the bodies under the loads of another problem, which has no other difference, after they have slipped.

        Nothing is assembled or factorised anew.

        Raises
        ------
        ProblemError
            Two sides prescribe different displacements of a node, or a plane of symmetry moves.
        """

        def loaded(body: Body | None) -> Body | None:
            if body is None:
                return None
            known = _supports(problem, body.name, body.mesh)
            load = _load(problem, body.name, body.mesh, known, body.nodes, self.interface)
            if known.values[body.nodes[self.interface.planes[body is self.neumann]]].any():
                needed = "needed 0 along Gamma_c at its ends that both bodies hold: they are planes of symmetry"
                raise problem.refuse(f"{body.name}.prescribed", None, needed)
            return body.under(known, load)

        still = np.zeros(self.interface.contact.t)
        interface = copied(self.interface, slipped=still if slipped is None else slipped)
        body1, body2 = loaded(self.body1), loaded(self.body2)
        return replace(self, body1=body1, body2=body2, interface=interface, problem=problem)

    @cached_property
    def places(self) -> tuple[NamedPlace, ...]:
        """The points that the problem names, body by body; ProblemError for one that lies in no cell."""
        return tuple(named for body in self.elastic for named in _places(self.problem, body))

    @property
    def outside(self) -> list[str]:
        """The reasons why the theorem does not apply to this problem; empty where it does."""
        return reasons_outside(
            self.interface, self.friction, {int(body.name[-1]): body.unknown for body in self.elastic}
        )

    @property
    def warnings(self) -> list[str]:
        """Facts that a user should know before trusting the numbers."""
        return warnings_of(self.interface, self.elastic) + path_warnings(self.problem)


def reasons_outside(interface: Interface, friction: Fraction, free: Mapping[int, Nodes]) -> list[str]:
    """Return why the theorem does not apply; ``free`` has, by body, the contact components that supports leave free.

    Half of a symmetric model stands for the whole: its planes of symmetry do not count.
    """
    reasons = []
    if friction and interface.law is not None and interface.law.outside:
        reasons.append(interface.law.outside)
    holds = [body for body, components in free.items() if (~components).sum() > interface.planes[0].sum()]
    if holds:
        which = " and ".join(f"body {body}" for body in holds)
        half = "; half of a symmetric model has supports on both bodies there" if len(holds) < len(free) else ""
        reasons.append(f"a contact node of {which} is held tangentially: Gamma_u and Gamma_c must not meet{half}")
    return reasons


def nearly_incompressible(bodies: list[Body]) -> str:
    return " and ".join(f"{body.name}.poisson = {body.poisson:.12g}" for body in bodies if body.poisson >= LOCKING)


def pressure_errors(problem: Problem, bodies: list[Body]) -> Iterator[str]:
    """Yield the error of the nodal pressures to expect of each body near nu = 1/2 that locks, in words."""
    for body in bodies if problem.dimension == 2 else ():
        for own, spec, _ in _owners(getattr(problem, body.name), body.name):
            ratio = float(spec.moduli.poisson)
            if ratio >= LOCKING and element_of(body.mesh).locks(body.mesh):
                here, crossed, words = PRESSURE_ERRORS[spec.shape]
                off, less = (float(np.interp(ratio, RATIOS[: len(errors)], errors)) for errors in (here, crossed))
                more = " or more" if ratio > RATIOS[len(here) - 1] else ""
                yield f"nodal pressures off by about {off:.2g} %{more} at nu = {ratio:g} of {own}, {less:.1g} % {words}"


def warnings_of(interface: Interface, bodies: list[Body]) -> list[str]:
    found = []
    if near := nearly_incompressible([body for body in bodies if element_of(body.mesh).locks(body.mesh)]):
        found.append(
            f"{near}: near 1/2 linear triangles make a body too stiff and scatter the nodal pressures (Hertz on a"
            f" Delaunay mesh at {LOCKING:g}: 8 %, at 0.475: 13 %); needed a finer mesh, or"
            ' quadrilaterals that are split by both diagonals (0.3 %): split = "both" of a rectangle, or a mesh file'
            " with quadrilaterals"
        )
    if unowned := [name for name, has in shared(body.mesh for body in bodies).items() if not has]:
        found.append(f"no body takes {short(', '.join(unowned), 300)}: these cells are left out")
    if interface.gap.min() < -READING * float(np.ptp(interface.contact.x)):
        j = int(np.argmin(interface.gap))
        found.append(
            f"the initial gap is {interface.gap[j]:.4g} at {interface.contact.place(j)}: the bodies overlap as they"
            " are drawn, and press each other apart before any load acts"
        )
    nearest = float(interface.contact.x[int(np.argmin(interface.gap))])
    own, other = (width_at(grid.x, nearest) for grid in (interface.contact, interface.neumann))
    if (
        not interface.one_grid
        and np.ptp(interface.gap) > READING * np.ptp(interface.contact.x)
        and own > COARSE * other
    ):
        found.append(
            f"where the bodies are nearest the edges of the contact grid are {own / other:.2g} times as long as"
            " the edges opposite, which resolves the contact of curved bodies badly: give the coarser body the"
            " Neumann problem (iteration.neumann_body)"
        )
    return found


def held_bodies(problem: Problem, *, law: Law | None = None, dense: bool = True, obstacle: bool = False) -> TwoBodies:
    """Return the bodies on their meshes as the iteration needs them: elastic, and held by their supports.

    Parameters as for :func:`discretise`; with ``obstacle`` one with the Neumann problem may be rigid.

    Raises
    ------
    ProblemError
        As :func:`verification.interface.pair.pair_from`.
    """
    for name, spec in _specs(problem):
        neumann = problem.iteration.neumann_body == int(name[-1])
        if spec.rigid and obstacle and not neumann:
            needed = (
                f"needed {name[-1]}: rho, a ratio of stiffnesses, is infinite where the contact body is rigid; with the"
                " Neumann problem the obstacle stays where it is"
            )
            raise problem.refuse("iteration.neumann_body", problem.iteration.neumann_body, needed)
        if spec.rigid and not obstacle:
            role = "Neumann" if neumann else "contact"
            needed = f"needed an elastic body: it has the {role} problem of the iteration"
            raise problem.refuse(f"{name}.shape", "rigid", f"{needed}; `ndtheory solve` and `run` take obstacles")
    bodies = discretise(problem, law=law, dense=dense)
    law = bodies.interface.law
    if bodies.interface.only_solved:
        needed = (
            "needed another law on grids that differ: the iteration knows the forces of the Neumann grid, not those of"
            " the contact grid; `ndtheory solve` takes it"
        )
        raise problem.refuse("contact.law", problem.contact.law, needed)
    _check_supports(bodies, dense=dense)
    return bodies


def _check_supports(bodies: TwoBodies, *, dense: bool) -> None:
    """Refuse bodies that the iteration cannot take: contact may hold the contact body, and no other."""
    problem = bodies.problem
    for body in bodies.elastic:
        _check_pieces(problem, body, hinged=False)
        if not body.motions.shape[1]:
            continue
        if int(body.name[-1]) == problem.iteration.neumann_body:
            raise SingularRole.of(problem, body, next(one for one in bodies.elastic if one is not body))
        name = f"body{_loose(problem, body)[0]}" if problem.several else body.name
        if problem.dimension == 1:
            needed = "its loads are its contact force, and nothing is left to iterate; `ndtheory solve` takes it"
        elif not dense:
            needed = f"needed at most {MOST_CONTACT_NODES} contact nodes for a body that contact alone holds"
        else:
            continue
        raise problem.refuse(name, None, f"{name} can move rigidly: {needed}")


def discretise(problem: Problem, *, law: Law | None = None, dense: bool = True) -> TwoBodies:
    """Mesh and assemble the bodies and find Gamma_c.

    Parameters
    ----------
    law : Law, optional
        A law of friction in place of the problem's.
    dense : bool
        False where no interface matrices will be made: then there may be any number of contact nodes.

    Raises
    ------
    TooManyContactNodes
        More than MOST_CONTACT_NODES of them, for dense interface matrices.
    ProblemError
        A piece of a body that nothing holds, bodies that can move rigidly together, or do not meet, an interval outside
        the overlap or without nodes of the contact body at its ends, Gamma_u holding the normal component of a contact
        node, an unreadable mesh.
    """
    meshes = [None if spec.rigid else _mesh(problem, spec, name) for name, spec in _specs(problem)]
    known: list[Supports | None] = []
    for (name, _), mesh in zip(_specs(problem), meshes, strict=True):
        _check_extents(problem, name, mesh)
        known.append(None if mesh is None else _supports(problem, name, mesh))
    nodes, interface = (join_lines if problem.several else join)(problem, meshes, known, law)
    if dense and interface.contact.n > MOST_CONTACT_NODES:
        needed = f"needed at most {MOST_CONTACT_NODES} contact nodes, these are {interface.contact.n}"
        raise TooManyContactNodes(problem.source, "contact", None, needed)
    body1, body2 = (
        None if mesh is None or held is None else _body(problem, name, mesh, held, own, interface)
        for (name, _), mesh, held, own in zip(_specs(problem), meshes, known, nodes, strict=True)
    )
    bodies = TwoBodies(
        body1=body1, body2=body2, interface=interface, friction=problem.contact.friction, problem=problem
    )
    for body in bodies.elastic:
        _check_pieces(problem, body, hinged=True)
    if len(bodies.elastic) == 2 and _move_together(bodies):
        which = "bodies that touch" if problem.several else "body1 and body2"
        needed = f"{which} can move rigidly together, each held only by the other: fix or prescribe some sides"
        raise problem.refuse("contact" if problem.several else "body2", None, needed)
    assert bodies.places is not None  # refuses points outside the bodies
    return bodies


def _places(problem: Problem, body: Body) -> Iterator[NamedPlace]:
    """Yield the points that a body names, or the bodies of a union."""
    for own, spec, prefix in _owners(getattr(problem, body.name), body.name):
        for name, point in spec.points.items():
            at = np.array(point, dtype=float)
            try:
                found = place(body.mesh, at, body.mesh.surfaces[own] if prefix else None)
            except MeshError as error:
                raise problem.refuse(f"{own}.points.{name}", list(point), f"needed a point of it: {error}") from None
            yield NamedPlace(body, int(own.removeprefix("body")), name, at, found)


def _check_extents(problem: Problem, name: str, mesh: Mesh | None) -> None:
    """Refuse a plane body so slender that tolerances of its extent hide it."""
    if mesh is None:
        return
    extents = np.ptp(mesh.points.astype(float), axis=0)
    across, along = extents.min(), extents.max()
    if across < SLENDEREST * along:
        needed = f"its extents are {across:g} and {along:g}: needed a body less slender, from {SLENDEREST:g} on"
        raise problem.refuse(name, None, needed)


def _move_together(bodies: TwoBodies) -> bool:
    """Return True if both bodies have a rigid motion in common that changes nothing between them."""
    both = bodies.elastic
    if not all(body.motions.shape[1] for body in both):
        return False
    carry = bodies.interface.carry
    traces = {body.name: body.motion_traces for body in both}
    jumps = np.hstack([carry(traces[body.name]) if body is bodies.neumann else traces[body.name] for body in both])
    return bool(np.linalg.svd(jumps, compute_uv=False)[-1] <= STILL or jumps.shape[1] > jumps.shape[0])


def _specs(problem: Problem) -> list[tuple[Name, BodySpec]]:
    return [("body1", problem.body1), ("body2", problem.body2)]


def _owners(spec: BodySpec, name: str) -> list[tuple[str, BodySpec, str]]:
    """Return the bodies of a union, or the one body: each with its name in the file and the prefix of its sides."""
    return [(f"body{i}", member, f"body{i}.") for i, member in spec.members] or [(name, spec, "")]


def _mesh(problem: Problem, spec: BodySpec, name: str) -> Mesh:
    if spec.members:
        return together(problem, {i: _mesh(problem, member, f"body{i}") for i, member in spec.members})
    if spec.mesh is not None:
        path = spec.mesh.path
        refuse = lambda needed: problem.refuse(f"{name}.mesh", path, needed)
        if why := spec.mesh.unusable():
            raise refuse(why)
        try:
            mesh = from_file(path, one_material=not spec.materials, plane=problem.plane, group=spec.group)
        except MeshError as error:
            raise refuse(str(error).removeprefix(f"{path}: ")) from None
        if spec.materials:
            try:
                mesh.split([*spec.materials])
            except MeshError as error:
                raise problem.refuse(f"{name}.young", [*spec.materials], str(error)) from None
        if len(mesh.cells) > 2 * MOST_CELLS:
            raise refuse(f"needed at most {2 * MOST_CELLS} triangles, these are {len(mesh.cells)}")
        mesh = _with_parts(problem, spec, name, mesh)
        for key in ("fixed", "prescribed", "traction"):
            for side in getattr(spec, key):
                if side not in mesh.sides:
                    raise problem.refuse(f"{name}.{key}", side, f"unknown side; {mesh.lacks(side)}")
        return mesh
    assert spec.x is not None
    assert spec.cells is not None
    x = (float(spec.x[0]), float(spec.x[1]))
    try:
        if problem.dimension == 1:
            return interval(x, spec.cells[0])
        assert spec.y is not None
        mesh = rectangle_of_cells(x, (float(spec.y[0]), float(spec.y[1])), (spec.cells[0], spec.cells[1]), spec.split)
        return _with_parts(problem, spec, name, mesh)
    except MeshError as error:  # coordinates that no longer differ in doubles
        raise problem.refuse(f"{name}.cells", list(spec.cells), str(error)) from None


def rectangle_of_cells(
    x: tuple[float, float], y: tuple[float, float], cells: tuple[int, int], split: Split = "alternating"
) -> Mesh:
    """Return the mesh of a body with ``shape = "rectangle"``: its cells are those of one element."""
    return rectangle(x, y, cells, split)


def _with_parts(problem: Problem, spec: BodySpec, name: str, mesh: Mesh) -> Mesh:
    """Add the parts of sides that the problem names: the edges of the side between the ends of the part."""
    parts = {}
    for key, part in spec.parts.items():
        refuse = lambda needed, key=key: problem.refuse(f"{name}.parts.{key}", None, needed)
        if key in mesh.sides or part.side not in mesh.sides:
            raise refuse(f"needed a part of a side, with a name that no side has; {mesh.lacks(part.side)}")
        edges, slack = mesh.sides[part.side], SAME * extent(mesh)
        along = mesh.points[edges, "xy".index(part.axis)].astype(float)
        low, high = map(float, part.ends)
        inside = (along.min(axis=1) >= low - slack) & (along.max(axis=1) <= high + slack)
        if not inside.any():
            raise refuse(f"no edge of side {part.side!r} lies between {part.axis} = {low:g} and {high:g}")
        parts[key] = edges[inside]
    return replace(mesh, sides={**mesh.sides, **parts}) if parts else mesh


def _known_sides(spec: BodySpec, dimension: int) -> dict[str, list[float | None]]:
    """Return the displacements that the sides of Gamma_u have, by component; None leaves one free."""
    sides: dict[str, list[float | None]] = {side: [0.0] * dimension for side in spec.fixed}
    return sides | {side: [None if v is None else float(v) for v in vs] for side, vs in spec.prescribed.items()}


def _supports(problem: Problem, name: Name, mesh: Mesh) -> Supports:
    """Return the displacements known on Gamma_u; ProblemError where two sides contradict each other."""
    found = []
    for own, spec, prefix in _owners(getattr(problem, name), name):
        sides = {prefix + side: values for side, values in _known_sides(spec, mesh.dimension).items()}
        try:
            found.append(supports(mesh, sides))
        except MeshError as error:
            raise problem.refuse(f"{own}.prescribed", None, str(error)) from None
    held, values = ([getattr(each, what) for each in found] for what in ("held", "values"))
    return Supports(held=np.logical_or.reduce(held), values=np.sum(values, axis=0))


def _check_free(problem: Problem, name: Name, mesh: Mesh, known: Supports, nodes: Ints, normals: Floats | None) -> None:
    """Refuse supports that hold more of a contact node than its tangential component."""
    if normals is None:
        normals = np.tile(np.eye(mesh.dimension)[-1], (len(nodes), 1))
    wrong = held_normals(known, nodes, normals)
    if not wrong.any():
        return
    j = int(np.argmax(wrong))
    own, spec, holds = next(
        (own, spec, side)
        for own, spec, prefix in _owners(getattr(problem, name), name)
        for side, values in _known_sides(spec, mesh.dimension).items()
        if nodes[j] in mesh.sides[prefix + side]
        and any(v is not None and n for v, n in zip(values, normals[j], strict=True))
    )
    key, value = ("fixed", list(spec.fixed)) if holds in spec.fixed else (f"prescribed.{holds}", None)
    end = "a part of the side" if problem.named else "an interval"
    remedy = f"leave it free, or let Gamma_c end before it, by {end}"
    if wrong.all() and not problem.several:
        remedy = f'a body held all along Gamma_c is an obstacle: {own}.shape = "rigid" in place of its mesh and moduli'
    needed = f"needed the normal component of every contact node free, side {holds!r} holds the one at"
    raise problem.refuse(f"{own}.{key}", value, f"{needed} {place_of(mesh.points[nodes[j]])}; {remedy}")


def _load(problem: Problem, name: Name, mesh: Mesh, known: Supports, nodes: Ints, interface: Interface) -> Floats:
    """Return the nodal forces of body force, tractions and point loads, shape (n, d).

    ProblemError for a force that is lost, and for a point load away from every node.

    ``nodes`` are those of Gamma_c: no traction acts between the ends of its lines.
    """
    load, plain = np.zeros((len(mesh.points), mesh.dimension)), lambda values: [float(v) for v in values]
    for own, spec, prefix in _owners(getattr(problem, name), name):
        load += body_load(mesh, plain(spec.body_force), mesh.surfaces[own] if prefix else None)
        for side, force in spec.traction.items():
            facets = mesh.sides[prefix + side]
            loaded = facet_weights(mesh, facets)
            for line, x, ends in lines_on(nodes, interface, own=int(name[-1]) == problem.contact_body):
                loaded -= _covered(mesh, facets, line, x if problem.named else None, ends)
            if any(force) and loaded.max() <= SAME * extent(mesh):
                needed = "Gamma_c covers this side: a force there is lost; point_load gives one to its nodes"
                raise problem.refuse(f"{own}.traction.{side}", list(force), needed)
            load += loaded[:, None] * plain(force)
        for point, force in spec.point_load.items():
            try:
                node = node_at(mesh, np.array(point, dtype=float), mesh.surfaces[own] if prefix else None)
            except MeshError as error:
                raise problem.refuse(f"{own}.point_load", list(point), str(error)) from None
            if (known.held[node] & (np.array(force, dtype=float) != 0)).any():
                needed = "the node there is held along the force, which is lost"
                raise problem.refuse(f"{own}.point_load", list(point), needed)
            load[node] += plain(force)
    return load


def lines_on(nodes: Ints, interface: Interface, *, own: bool) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Yield the contact nodes of a body on each line of Gamma_c, their positions, and the ends of the line.

    ``own`` is True for the body that carries the contact grid.
    """
    for line in interface.lines:
        on, grid = (line.contact, interface.contact) if own else (line.neumann, interface.neumann)
        yield nodes[on], grid.x[on], interface.contact.x[line.contact][[0, -1]]


def _covered(mesh: Mesh, facets: Ints, nodes: Ints, x: Floats | None, ends: Floats) -> Floats:
    """Return the weights of those facets that lie on a line of Gamma_c, between its ends."""
    d, along = mesh.dimension, None
    if x is not None:
        along = np.zeros(len(mesh.points))
        along[nodes] = x
    pieces = {frozenset(nodes[i : i + d].tolist()) for i in range(len(nodes) - d + 1)}
    covered = np.array([frozenset(facet) in pieces for facet in facets.tolist()])
    return facet_weights(mesh, facets[covered], between=(ends[0], ends[1]), along=along)


def _body(problem: Problem, name: Name, mesh: Mesh, known: Supports, nodes: Ints, interface: Interface) -> Body:
    spec: BodySpec = getattr(problem, name)
    grid = interface.contact if int(name[-1]) == problem.contact_body else interface.neumann
    d = mesh.dimension
    _check_free(problem, name, mesh, known, nodes, grid.normals)
    motions = rigid_motions(mesh, known.held)
    material = material_of(spec, mesh=mesh)
    matrix = stiffness(mesh, material)
    load = _load(problem, name, mesh, known, nodes, interface)
    free = np.flatnonzero(~known.held.ravel())
    rigid = motions.reshape(known.held.size, motions.shape[2])[free]
    right = load.ravel()[free] - (matrix @ known.values.ravel())[free]
    position = np.full(known.held.size, -1)
    position[free] = np.arange(len(free))
    places = np.stack([position[d * nodes + p] for p in range(d)])
    turned = None
    if grid.normals is not None:
        turned = turning(grid.normals, places, len(free))
        places = np.where((places >= 0).all(axis=0), places, np.sort(places, axis=0))  # a single free one is normal
    positions = places.ravel()
    unknown = positions >= 0
    return Body(
        name=name,
        mesh=mesh,
        material=material,
        poisson=float(spec.moduli.poisson),
        known=known,
        nodes=nodes,
        positions=free,
        unknown=unknown,
        interface=positions[unknown],
        stiffness=in_frames(matrix[free][:, free].tocsc(), turned),
        load=right if turned is None else turned @ right,
        motions=rigid if turned is None else turned @ rigid,
        length=float(problem.length),
        turned=turned,
        normals=grid.normals,
    )

"""More than two bodies as two: those of one role are one mesh, and the lines of all contacts are one Gamma_c.

The iteration takes all Neumann bodies at once, then all contact bodies.  Stiffness matrices, S_a, P and S are block
sums, and no statement about two bodies needs connected ones.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from fem1d2d import Mesh, MeshError, Supports
from fem1d2d.mesh import Floats, Ints, place_of, shared
from verification.interface.friction import OF_TWO
from verification.interface.interface import Grid, Interface, Law, Stretch
from verification.interface.joining import check_profile, join
from verification.problem.specification import Problem
from verification.problem.specs import ContactSpec
from verification.problem.tables import ProblemError
from verification.value import Value


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Blocks(Value, Law):
    """The laws of several lines, each on its own; rows of S are scaled by the friction of their line over the largest.

    The friction bound is then ``w_j k_j |(S sigma_N)_j|`` with the largest k in front.
    """

    name, label = "blocks", "own"
    parts: tuple[Interface, ...]
    scales: tuple[float, ...]

    def of_line(self, i: int) -> Law | None:
        return self.parts[i].law

    @property
    def words(self) -> str:
        each = dict.fromkeys("no law" if part.law is None else part.law.words for part in self.parts)
        return "; ".join(each)

    @property
    def outside(self) -> str:  # type: ignore[override]
        rubbing = (part.law for part, scale in zip(self.parts, self.scales, strict=True) if scale)
        return next((law.outside for law in rubbing if law is not None and law.outside), "")

    def operator(self, interface: Interface) -> Floats:
        blocks = []
        for part, scale in zip(self.parts, self.scales, strict=True):
            zero = np.zeros((part.contact.n, part.neumann.n))
            blocks.append(zero if part.kernel is None else scale * part.kernel)
        return np.asarray(block_diag(*blocks))

    def warnings_after(self, interface: Interface, k: float, pressure: Floats, bound: Floats) -> list[str]:
        found = []
        for i, (line, part, scale) in enumerate(zip(interface.lines, self.parts, self.scales, strict=True), 1):
            own = line.contact
            texts = part.law.warnings_after(part, scale * k, pressure[own], bound[own]) if part.law and scale else []
            found += [text.replace("contact.", f"contact[{i}].", 1).removesuffix(OF_TWO) for text in texts]
        return found


def together(problem: Problem, meshes: Mapping[int, Mesh]) -> Mesh:
    """Return bodies, by their numbers, as one mesh, with sides ``body3.top``, surfaces ``body3`` and ``body3.steel``.

    Raises
    ------
    ProblemError
        Bodies that lie on each other or touch.
    """
    points, cells = 0, 0
    sides: dict[str, Ints] = {}
    surfaces: dict[str, Ints] = {}
    corners: list[Ints] = []
    centres: list[Ints] = []
    for i, mesh in meshes.items():
        sides |= {f"body{i}.{side}": facets + points for side, facets in mesh.sides.items()}
        surfaces |= {f"body{i}.{surface}": members + cells for surface, members in mesh.surfaces.items()}
        surfaces[f"body{i}"] = cells + np.arange(len(mesh.cells))
        corners.append(mesh.cells + points)
        centres.append(mesh.centres + points)
        points, cells = points + len(mesh.points), cells + len(mesh.cells)
    drawn = np.concatenate([mesh.points.astype(float) for mesh in meshes.values()])
    cut = " and ".join(dict.fromkeys(mesh.cut for mesh in meshes.values() if mesh.cut))
    rest: dict[str, Any] = {"cut": cut, "shares": shared(meshes.values()), "centres": np.concatenate(centres)}
    try:
        return Mesh(points=drawn, cells=np.concatenate(corners), sides=sides, surfaces=surfaces, **rest)
    except MeshError as error:
        numbers = ", ".join(map(str, meshes))
        needed = f"bodies {numbers} have one role in the iteration, and must not touch each other: {error}"
        raise problem.refuse("contact", None, needed) from None


def _part(mesh: Mesh, known: Supports, i: int) -> tuple[Mesh, Supports, int]:
    """Return a body of a union, its supports, and the number of its first node in the union."""
    cells, prefix = mesh.cells[mesh.surfaces[f"body{i}"]], f"body{i}."
    first, end = int(cells.min()), int(cells.max()) + 1
    sides = {name.removeprefix(prefix): f - first for name, f in mesh.sides.items() if name.startswith(prefix)}
    own = Mesh(points=mesh.points[first:end], cells=cells - first, sides=sides)
    return own, Supports(held=known.held[first:end], values=known.values[first:end]), first


def join_lines(
    problem: Problem, meshes: Sequence[Mesh | None], known: Sequence[Supports | None], law: Law | None = None
) -> tuple[list[Ints], Interface]:
    """Find the lines of all contacts between two unions of bodies; parameters and errors as those of ``join``."""
    joined: list[Interface] = []
    flipped, nodes = [], [[], []]  # type: tuple[list[bool], list[list[Ints]]]
    for number, line in enumerate(problem.contacts, 1):
        flipped.append(line.bodies[0] not in problem.numbers(1))
        order = line.bodies[::-1] if flipped[-1] else line.bodies
        parts = []
        for mesh, held, i in zip(meshes, known, order, strict=True):
            assert mesh is not None
            assert held is not None
            parts.append(_part(mesh, held, i))
        own, supports, first = zip(*parts, strict=True)
        given = None if law is None else law.of_line(number - 1)  # of a pair made before
        try:
            found, interface = _join_line(problem, line, order, list(own), list(supports), given)
        except ProblemError as error:
            raise _renamed(error, order, number) from None
        joined.append(interface)
        for of_body, mesh, before, start, i in zip(nodes, meshes, found, first, order, strict=True):
            own = before + start
            common = np.intersect1d(own, np.concatenate([own[:0], *of_body]))
            if len(common) and mesh is not None:
                needed = (
                    f"two contacts share the node of body {i} at {place_of(mesh.points[common[0]])}: needed sides, or"
                    " parts of sides, that have no node in common along their lines of contact"
                )
                raise problem.refuse(f"contact[{number}].surface", list(line.surface or ()), needed)
            of_body.append(own)
    law = Blocks(parts=tuple(joined), scales=tuple(map(float, problem.shares)))
    return [np.concatenate(each) for each in nodes], _one_after_another(problem, joined, flipped, law)


def _join_line(
    problem: Problem,
    contact: ContactSpec,
    order: tuple[int, int],
    meshes: list[Mesh | None],
    known: list[Supports | None],
    law: Law | None,
) -> tuple[list[Ints], Interface]:
    """Join two bodies, in the order of the unions to which they belong."""
    bodies, profile = problem.bodies, contact.profile
    if order != contact.bodies and contact.surface is not None:
        contact = replace(contact, surface=contact.surface[::-1], profile=None)
    two = replace(problem, body1=bodies[order[0]], body2=bodies[order[1]], contacts=(contact,))
    nodes, interface = join(two, meshes, known, law)
    if contact.profile is profile:
        return nodes, interface
    check_profile(two, replace(interface, profile=profile))
    assert profile is not None
    return nodes, replace(interface, profile=profile.mirrored(Fraction(float(interface.contact.s[-1]))))


def _renamed(error: ProblemError, order: tuple[int, int], line: int) -> ProblemError:
    """Return the error of two bodies with their numbers in the file, and with the number of their contact."""
    numbered = lambda text: re.sub(r"\b(body ?)([12])\b", lambda m: f"{m[1]}{order[int(m[2]) - 1]}", text)
    key = re.sub(r"^contact\b", f"contact[{line}]", numbered(error.key))
    return ProblemError(error.file, key, error.value, numbered(error.needed))


def _one_after_another(problem: Problem, parts: Sequence[Interface], flipped: Sequence[bool], law: Law) -> Interface:
    """Return the interfaces of all lines as one; the positions of each begin one edge behind the end of the last."""
    shift, lines, grids = 0.0, [], []
    x: list[list[Floats]] = [[], []]
    ends = np.zeros(2, dtype=int)
    for part, line, turned in zip(parts, problem.contacts, flipped, strict=True):
        for positions, grid in zip(x, (part.contact, part.neumann), strict=True):
            positions.append(grid.x - part.contact.x[0] + shift)
        shift = float(x[0][-1][-1]) + float(np.diff(part.contact.x).max())
        starts, ends = ends, ends + np.array([part.contact.n, part.neumann.n])
        own, other = (slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True))
        lines.append(Stretch(bodies=line.bodies, contact=own, neumann=other, flipped=turned))
    for positions, of in zip(x, ([p.contact for p in parts], [p.neumann for p in parts]), strict=True):
        grids.append(
            Grid(
                x=np.concatenate(positions),
                weights=np.concatenate([grid.weights for grid in of]),
                points=np.concatenate([grid.points for grid in of if grid.points is not None]),
                normals=np.concatenate([grid.upright for grid in of]),
            )
        )
    P = None
    if not all(part.one_grid for part in parts):
        P = block_diag(*(part.transfer for part in parts))
    gap = np.concatenate([part.gap for part in parts])
    return Interface.joining(
        grids[0],
        grids[0 if P is None else 1],
        P,
        gap=gap,
        law=law,
        lines=tuple(lines),
        held=np.concatenate([part.held for part in parts]),
        planes=tuple(np.concatenate(each) for each in zip(*(part.planes for part in parts), strict=True)),
    )

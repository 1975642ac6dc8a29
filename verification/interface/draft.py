"""A draft of a problem file from mesh files, with comments on what the user has to choose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from fem1d2d import Mesh
from fem1d2d.mesh import Floats, Ints
from fem1d2d.trace import SAME, extent
from ndtheory.keys import key
from ndtheory.texts import printable
from verification.document import Document
from verification.interface.drawn import Drawn, Touch, bodies_of, touching
from verification.problem.writing import key as name_of
from verification.problem.writing import string, value

#: A displacement that presses bodies together, as a part of the smaller extent.
PRESS = 0.005

#: Parts of the text.
HEAD = """\
# A draft of a problem file: choose what the comments name, and take away the #
# before the lines that you want.
# A path of a mesh is relative to the folder of this file.
title = {title}
plane = "{plane}"

[units]  # labels
length = "mm"
stress = "MPa"
"""
TIED = (
    "# Its surfaces share nodes and stick to each other. For contact between them give each a [body] with its group.\n"
)
OBSTACLE = '# [body2]  # a rigid obstacle on the flat top of body 1\n# shape = "rigid"\n'
FRICTION = 'friction = 0.0  # choose; law = "local" is Coulomb\'s law without a radius\n'
FLAT = f"[contact]  # without names: the flat top of body 1 and the flat bottom of body 2\n{FRICTION}"

#: What every draft leaves to choose.
ALWAYS = ("moduli: those of steel in MPa are written", "friction: 0 is written", "units: they are labels")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Draft(Document):
    """A problem file for the bodies of one or two mesh files."""

    schema: ClassVar[str] = "ndtheory.draft/1"
    units: ClassVar[Mapping[str, str]] = {"length": "as in the mesh", "stress": "any"}  # type: ignore[misc]

    toml: str = key("its text")
    bodies: tuple[Drawn, ...] = key("its bodies in their order, from below")
    contacts: tuple[Touch, ...] = key("the sides that may touch, the nearest first")
    choices: tuple[str, ...] = key("what the user has to choose, as sentences")


def draft(*paths: Path) -> Draft:
    """Write a problem file for one mesh file with all bodies, or for two with one body each.

    Parameters
    ----------
    paths : Path
        One or two; the text has them as they are given.

    Raises
    ------
    MeshError
        As :func:`verification.interface.drawn.bodies_of`.
    """
    found = [body for path in paths for body in bodies_of(path, one=len(paths) > 1)]
    bodies = tuple(sorted(found, key=lambda body: body.place))
    contacts, left_out = touching(bodies)
    missing = [*_missing(bodies, left_out), *_alone(bodies, [*contacts, *left_out])]
    seats = [_Seat(number=i, bodies=bodies, contacts=contacts) for i in range(1, len(bodies) + 1)]
    plane = "stress" if any("stress" in body.planes for body in bodies) else "strain"
    title = string(" and ".join(printable(path.stem) for path in paths))
    notes = [f"# {sentence}\n" for sentence in missing] + [OBSTACLE] * (len(bodies) == 1)
    several = len(bodies) > 2 or len(contacts) > 1
    tables = [_contact(touch, several=several) for touch in contacts]
    neumann = "" if several else f"neumann_body = {1 if contacts and contacts[0].contact == 2 else 2}\n"
    parts = [HEAD.format(title=title, plane=plane), *(seat.table for seat in seats), "".join(notes)]
    parts += [*(tables if tables or several else [FLAT]), f'[iteration]\n{neumann}theta = "auto"\n']
    as_file = "the elements of the file are made for it" if any(body.planes for body in bodies) else "thick bodies"
    choices = (
        *missing,
        *(f"body {seat.number}: {seat.proposal[1]}" for seat in seats),
        f"plane: {plane} is written, as {as_file}",
        *ALWAYS,
    )
    return Draft(toml="\n".join(filter(None, parts)), bodies=bodies, contacts=tuple(contacts), choices=choices)


def _contact(touch: Touch, *, several: bool) -> str:
    head = f"[[contact]]\nbodies = {value(touch.bodies)}\n" if several else "[contact]\n"
    radius = max(1.05 * touch.width, min(3 * touch.width, 0.3 * touch.length))  # in between friction is hardly lost
    return f"{head}surface = {value(touch.surface)}\n{FRICTION}radius = {radius:.2g}  # of the kernel of friction\n"


# --- what is left to choose -------------------------------------------------------------------------------------------


def _missing(bodies: Sequence[Drawn], left_out: Sequence[Touch]) -> Iterator[str]:
    """Explain why lines that face each other are left out."""
    for touch in left_out:
        sides = list(zip(touch.bodies, touch.surface, strict=True))
        bare = [f"the boundary of body {i} {line}" for i, line in sides if line not in bodies[i - 1].sides]
        named = [f"side {side!r} of body {i}" for i, side in sides if side in bodies[i - 1].sides]
        left = "it is left out, as it shares a node with another contact or closes a ring of an odd number"
        why = f"needed a physical name for {' and '.join(bare)}" if bare else left
        yield f"{' and '.join(bare + named)} face each other: {why}"


def _alone(bodies: Sequence[Drawn], touches: Sequence[Touch]) -> list[str]:
    """Explain which bodies face no other one nearby."""
    if len(bodies) == 1:
        return ["a second body is missing: give a second mesh file, or take an obstacle"]
    met = {i for touch in touches for i in touch.bodies}
    needed = "needed a line of it that faces another body nearby"
    return [f"body {i}: {needed}" for i in range(1, len(bodies) + 1) if i not in met]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Seat:
    """A body, by its number, among the others."""

    number: int
    bodies: Sequence[Drawn]
    contacts: Sequence[Touch]

    @property
    def table(self) -> str:
        """Its table of the file, with the proposal as a comment."""
        body, (line, words) = self.bodies[self.number - 1], self.proposal
        group = f"group = {value(body.group)}\n" if body.group else ""
        each = lambda modulus: ", ".join(f"{name_of(name)} = {modulus}" for name in body.materials)
        young, poisson = (f"{{ {each(modulus)} }}" if body.materials else modulus for modulus in ("2.1e5", "0.3"))
        head = f"[body{self.number}]\nmesh = {string(str(body.path))}\n{group}{TIED if body.materials else ''}"
        support = f"# {line}  # {words}\n" if line else f"# {words}\n"
        return f"{head}young = {young}  # choose\npoisson = {poisson}  # choose\n{support}"

    @cached_property
    def ends(self) -> list[tuple[Touch, int]]:
        """Its contacts, and its place in each, 0 or 1."""
        return [(touch, touch.bodies.index(self.number)) for touch in self.contacts if self.number in touch.bodies]

    @cached_property
    def proposal(self) -> tuple[str, str]:
        """Supports as a line of the file, and the choice in words: it is held, or moved where it lies above."""
        mesh, places = self.bodies[self.number - 1].mesh, {end for _, end in self.ends}
        nodes = np.unique(np.concatenate([*(touch.nodes[end] for touch, end in self.ends), np.array([], np.int64)]))
        free = {side: edges for side, edges in mesh.sides.items() if not np.isin(edges, nodes).all(axis=1).any()}
        away = [side for side, edges in free.items() if not np.isin(edges, nodes).any()]
        names, planes = ", ".join(map(name_of, free)), self._planes(mesh, free)
        if len(places) > 1:
            held = [*planes, *(f"fixed = {value([side])}" for side in away), ""]
            return held[0], f"if it slides between its contacts, choose among {names or 'sides, which need names'}"
        symmetry = f"; on a plane of symmetry {planes[0]}" if planes else ""
        if not away:
            return "", f"needed a named side{' away from the contact' * bool(free)}, to hold it or to move it{symmetry}"
        side = min(away, key=lambda name: float(mesh.points[free[name]].mean(axis=(0, 1)) @ self.toward))
        if 0 in places or (not places and self.number == 1 < len(self.bodies)):
            return f"fixed = {value([side])}", f"choose the sides that hold it: {names}{symmetry}"
        moved = f"prescribed = {{ {name_of(side)} = {self._press()} }}"
        return moved, f"choose the sides that move, and how far: {names}{symmetry}"

    def _planes(self, mesh: Mesh, sides: Mapping[str, Ints]) -> list[str]:
        """Supports of straight sides along an axis, from an end of a contact on: they may be planes of symmetry."""
        found = []
        for side, edges in sides.items():
            flat = np.ptp(mesh.points[edges.ravel()], axis=0) <= SAME * extent(mesh)
            normals = [touch.normal for touch, end in self.ends if np.isin(edges, touch.nodes[end]).any()]
            if flat.any() and normals and max(abs(normal[1 - int(flat[0])]) for normal in normals) < 0.5:
                held = [0.0, "free"] if flat[0] else ["free", 0.0]
                found.append(f"prescribed = {{ {name_of(side)} = {value(held)} }}")
        return found

    @cached_property
    def toward(self) -> Floats:
        """The direction to its contacts; without any upwards for body 1, downwards for others."""
        found = sum((touch.normal * (1 - 2 * end) for touch, end in self.ends), start=np.zeros(2))
        found = found if found.any() else np.array([0.0, 1.0 if self.number == 1 else -1.0])
        return np.asarray(np.round(found / np.linalg.norm(found), 3), dtype=np.float64)

    def _press(self) -> str:
        """A displacement towards the contacts that closes the gap and presses."""
        far = PRESS * self.bodies[self.number - 1].size + max((touch.gap for touch, _ in self.ends), default=0.0)
        return value([float(f"{c:.2g}") + 0.0 for c in self.toward * far])

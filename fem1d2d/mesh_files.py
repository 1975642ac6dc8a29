"""Triangle meshes in files, in any format meshio reads."""

from __future__ import annotations

import contextlib
import io
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats, Ints, Mesh, MeshError, measures

#: Nodes of a file are not numbered beyond this: a table of them would fill the memory.
LARGEST_NUMBER = 10**8

#: The endings of TetGen's files.
TETRAHEDRA = (".node", ".ele")


def from_file(path: Path | str) -> Mesh:
    """A triangle mesh in any format meshio reads; its sides are the physical names of its lines.

    A triangle that the file lists clockwise is turned over; points that no triangle uses and names without lines are
    left out.

    Raises
    ------
    MeshError
        Unreadable, no triangles or other cells too, not plane, no named lines, or no mesh as :class:`Mesh` needs it.
    """
    import meshio

    path = Path(path)
    try:
        if not path.is_file():
            raise MeshError(f"{path}: no such mesh file")
    except (OSError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if path.suffix.lower() in TETRAHEDRA:  # meshio's reader would not come back from a short one
        raise MeshError(f"{path}: a TetGen file holds tetrahedra: triangles are needed")
    largest = _largest_number(path)
    if largest > LARGEST_NUMBER:
        raise MeshError(f"{path}: a node has the number {largest:g}: at most {LARGEST_NUMBER} is needed")
    words = io.StringIO()  # its readers print, and exit the interpreter on what they cannot read
    try:
        with contextlib.redirect_stdout(words), contextlib.redirect_stderr(words), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about what does not parse
            read = meshio.read(path)
            triangles, lines = read.cells_dict.get("triangle"), _named_lines(read)
    except (Exception, SystemExit) as error:
        why = " ".join(words.getvalue().split()) or f"{type(error).__name__}: {error}"
        raise MeshError(f"{path}: meshio cannot read it ({why})") from None
    try:
        if triangles is None or len(triangles) == 0:
            raise MeshError(f"no triangles in it, only {', '.join(read.cells_dict) or 'nothing'}")
        others = sorted(set(read.cells_dict) - {"triangle", "line", "vertex"})
        if others:
            raise MeshError(f"needed triangles alone, it has {', '.join(others)} too")
        if not lines:
            raise MeshError("no named lines; give the sides physical names")
        try:
            least = _least_number(path)
        except (IndexError, KeyError, ValueError):
            raise MeshError("its elements do not fit its format") from None
        if least < 1:
            raise MeshError(f"an element names node {least}: nodes are numbered from 1")
        return _plane_mesh(np.asarray(read.points, dtype=float), np.asarray(triangles, dtype=np.int64), lines)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def _named_lines(read: Any) -> dict[str, Ints]:
    """The lines that a name of the file gathers; names without lines are left out."""
    lines: dict[str, Ints] = {}
    for name, blocks in read.cell_sets_dict.items():
        if "line" in blocks and not name.startswith("gmsh:"):
            lines[name] = read.cells_dict["line"][blocks["line"]]
    if not lines and "gmsh:physical" in read.cell_data_dict and "line" in read.cells_dict:
        tags = read.cell_data_dict["gmsh:physical"]["line"]
        for name, (tag, dimension) in read.field_data.items():
            if dimension == 1:
                lines[name] = read.cells_dict["line"][tags == tag]
    return {name: np.asarray(facets, dtype=np.int64) for name, facets in lines.items() if len(facets)}


def _largest_number(path: Path) -> float:
    """The largest number that a Gmsh text file gives a node; meshio fills a table as long."""
    content = path.read_bytes()
    nodes = re.search(rb"\$Nodes\s(.*?)\$EndNodes", content, re.DOTALL)
    if not content.startswith(b"$MeshFormat") or nodes is None or content.split(None, 3)[2:3] != [b"0"]:
        return 0
    width = 4 if content.split(None, 2)[1].startswith(b"2") else 1  # beside its coordinates, or on a line of its own
    first = (line.split() for line in nodes[1].splitlines())
    with contextlib.suppress(ValueError):  # what is no number is meshio's to refuse
        return max((float(words[0]) for words in first if len(words) == width), default=0)
    return 0


def _least_number(path: Path) -> int:
    """The least node number of points, lines and triangles of a Gmsh file; meshio counts 0 and below from the end.

    1 for other formats, other elements and the binary variants of version 4.
    """
    content = path.read_bytes()
    start = re.search(rb"\$Elements\s*?\n", content)
    if not content.startswith(b"$MeshFormat") or start is None:
        return 1
    version, binary = content.split(None, 3)[1:3]
    corners, least, at = {15: 1, 1: 2, 2: 3}, 1, 0
    if binary == b"1":
        if not version.startswith(b"2"):
            return 1
        data = content[content.index(b"\n", start.end()) + 1 :]
        numbers = np.frombuffer(data[: len(data) // 4 * 4], dtype=np.int32)
        left = int(content[start.end() :].split(None, 1)[0])
        while left > 0:
            kind, count, tags = numbers[at : at + 3].tolist()
            if count < 1 or tags < 0:
                raise ValueError("no block of elements")
            width = 1 + tags + corners[kind]
            rows = numbers[at + 3 : at + 3 + count * width].reshape(count, width)
            least = min(least, int(rows[:, 1 + tags :].min(initial=1)))
            at, left = at + 3 + count * width, left - count
        return least
    listed = content[start.end() :].partition(b"$EndElements")[0]
    if version.startswith(b"2"):  # meshio takes the last numbers of a line for its nodes
        for line in listed.splitlines()[1:]:
            row = [int(word) for word in line.split()]
            if row and len(row) != 3 + row[2] + corners[row[1]]:
                raise ValueError("another number of tags and nodes than the line says")
            least = min([least, *row[3 + row[2] :]]) if row else least
        return least
    numbers, at = np.array(listed.split(), dtype=np.int64), 2 if version == b"4" else 4
    while at < len(numbers):
        width, count = 1 + corners[int(numbers[at + 2])], int(numbers[at + 3])
        if count < 0:
            raise ValueError("no block of elements")
        rows = numbers[at + 4 : at + 4 + count * width].reshape(count, width)
        least, at = min(least, int(rows[:, 1:].min(initial=1))), at + 4 + count * width
    return least


def _plane_mesh(points: Floats, triangles: Ints, sides: Mapping[str, Ints]) -> Mesh:
    """A mesh of the points in use, its triangles turned anticlockwise."""
    for what, named in (("a triangle", triangles), *((f"side {name!r}", facets) for name, facets in sides.items())):
        outside = named[(named < 0) | (named >= len(points))]
        if len(outside):
            raise MeshError(f"{what} names a node that the file does not have")
    used = np.unique(triangles)  # geometry points of the mesher belong to no triangle
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    for name, facets in sides.items():
        if (number[facets] < 0).any():
            raise MeshError(f"side {name!r} has a node that no triangle uses")
    points = points[used]
    if not np.isfinite(points).all():
        raise MeshError("a coordinate is not finite")
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > 0:
        raise MeshError("the points do not lie in a plane z = constant")
    points, triangles = points[:, :2], number[triangles]
    with np.errstate(over="ignore", invalid="ignore"):  # coordinates too large for their products are refused later
        flipped = measures(points, triangles) < 0
    return Mesh(
        points=points,
        cells=np.where(flipped[:, None], triangles[:, ::-1], triangles),
        sides={name: number[facets] for name, facets in sides.items()},
    )

"""Read a mesh file with meshio: a script for a process with limits on memory and time.

:mod:`fem1d2d.mesh_files` runs it by its path, in isolated mode, so it imports nothing of this package.

All cells become linear triangles.  A triangle of second order is cut through its middle nodes into four, a
quadrilateral by both diagonals into four, or from the mean of its corners where they cross too near its edge; one of
second order is cut into four of first order before.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import threading
import warnings
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

#: What the surfaces of an Abaqus file list, numbers or sets of elements, by their name and the number of a face.
Faces = dict[tuple[str, str], list[str]]

#: meshio's names of the formats that are read.
FORMATS = {".msh": "gmsh", ".inp": "abaqus"}

#: Linear triangles of each kind of cell, by its nodes in the order of meshio and by the points that are new, which
#: follow them; then each new point, as weights of the nodes.
_QUARTERS = ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))  # of a quadrilateral, its centre last
_BESIDE = 0.4  # at most, as a part of a diagonal, from its middle to the crossing: further out triangles are slivers
_SMALL = ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))  # the four in one of second order
_SERENDIPITY = (-0.25, -0.25, -0.25, -0.25, 0.5, 0.5, 0.5, 0.5)


def _of_four(middle: Sequence[float] | None) -> tuple[list[list[int]], list[list[float]]]:
    """The sixteen triangles of a quadrilateral of second order, whose middle is a node or has these weights."""
    new = [] if middle is None else [np.array(middle)]
    nodes = np.eye(9)[:, : 9 - len(new)]
    nodes[8] = nodes[8] if middle is None else new[0]
    new += [nodes[list(corners)].mean(axis=0) for corners in _SMALL]
    cells = [
        [(*corners, 9 + i)[corner] for corner in quarter] for i, corners in enumerate(_SMALL) for quarter in _QUARTERS
    ]
    return cells, [list(map(float, weights)) for weights in new]


CUTS: dict[str, tuple[Sequence[Sequence[int]], Sequence[Sequence[float]]]] = {
    "triangle": (((0, 1, 2),), ()),
    "triangle6": (((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)), ()),
    "quad": (_QUARTERS, ([0.25] * 4,)),
    "quad8": _of_four(_SERENDIPITY),
    "quad9": _of_four(None),
}

#: Kinds of cells of a line, with its linear pieces; and kinds outside the plane, which are left out.
PIECES = {"line": ((0, 1),), "line3": ((0, 2), (2, 1))}
LEFT_OUT = {"vertex"}

#: Words for cells that were cut.
CUT = {
    "triangle6": "triangles of second order",
    "quad": "quadrilaterals",
    "quad8": "quadrilaterals of second order",
    "quad9": "quadrilaterals of second order",
}

#: Plane elements of Abaqus that meshio does not know, by the letters before the number of their nodes.
ABAQUS_NODES = {"3": "triangle", "4": "quad", "6": "triangle6", "8": "quad8"}
ABAQUS_PLANES = {"CPE": "strain", "CPS": "stress", "M3D": "", "S": ""}
ABAQUS = {
    f"{start}{nodes}{more}": kind
    for start in ABAQUS_PLANES
    for nodes, kind in ABAQUS_NODES.items()
    for more in ("", "H", "R", "RH", "I", "IH", "M", "MH")
}

#: The beginning of names of sets that no user has given.
HIDDEN = "gmsh:"

#: Gmsh's numbers of the kinds that are read, and their nodes.
GMSH_NODES = {15: 1, 1: 2, 8: 3, 2: 3, 9: 6, 3: 4, 16: 8, 10: 9}

#: Sections of an Abaqus file that give an element set its material.
SECTIONS = ("SOLIDSECTION", "SHELLSECTION", "MEMBRANESECTION")

#: Why a file is refused that is damaged where nothing more can be said.
MISFIT = "its contents do not fit its format"

#: What gmsh writes where it saves the elements of no group too.
SAVE_ALL = "Mesh.SaveAll = 1 of gmsh writes such files; save it with Mesh.SaveAll = 0"

#: Most characters of what meshio says that a message repeats.
SAID = 100

#: Exit status where the file is refused; stdout then holds the reason.
REFUSED = 3


class NotRead(Exception):
    """A file is not read; the message is the reason."""


def contents(path: Path) -> dict[str, Any]:
    """Points, triangles, named lines and named surfaces of a mesh file.

    Returns
    -------
    dict
        ``points`` of shape (n, 2) or (n, 3), ``triangles`` of shape (c, 3), ``centres``, the points in the middle of
        quadrilaterals, ``lines`` of shape (l, 2) by their names, ``surfaces``, the numbers of their triangles by their
        names, ``split``, why they are several materials, or ""; ``cut``, the cells of other kinds that were cut, in
        words; ``plane``, elements of Abaqus that are of plane strain or stress by these words.

    Raises
    ------
    NotRead
        Unreadable, no cells of a plane or other ones too, or no named lines.
    """
    try:
        return _contents(path)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        raise NotRead(MISFIT) from None


def _contents(path: Path) -> dict[str, Any]:
    kind = FORMATS[path.suffix.lower()]
    materials, planes, faces = set[str](), dict[str, str](), Faces()
    if kind == "gmsh":
        with path.open("rb") as file:
            if file.read(11) != b"$MeshFormat":
                raise NotRead("no Gmsh file: needed $MeshFormat on its first line")
    else:
        try:
            materials, planes, faces = _abaqus_keywords(path)
        except UnicodeDecodeError as error:
            raise NotRead(f"needed text in UTF-8: {error.reason}") from None
    read, lines = _by_meshio(path, kind, faces)
    cells = read.cells_dict
    if any(len(of) and not 0 <= of.min() <= of.max() < len(read.points) for of in cells.values()):
        raise NotRead("a cell names a node that the file does not have")
    plane = [name for name in CUTS if len(cells.get(name, ()))]
    if not plane:
        remedy = "; give the surface a physical name too" if kind == "gmsh" and lines else ""
        raise NotRead(f"no triangles or quadrilaterals in it, only {', '.join(cells) or 'nothing'}{remedy}")
    others = sorted(set(cells) - CUTS.keys() - PIECES.keys() - LEFT_OUT)
    if others:
        raise NotRead(f"needed only triangles and quadrilaterals, it has {', '.join(others)} too")
    points, triangles, parts, centres = _triangles(
        np.asarray(read.points, dtype=float), {name: cells[name] for name in plane}
    )
    for found in (_by_name(_faces(read, faces)), _of_nodes(read.point_sets, triangles)):
        lines = lines | found | lines  # names that come first win
    groups = _by_name(
        (name, rows[members].ravel())  # numbers of triangles
        for kind, rows in parts.items()
        for name, members in _groups(read, kind, 2).items()
    )
    split = sorted(materials) if materials else _split(read, groups, len(triangles))
    why = ""
    if len(split) > 1:
        named = ", ".join(
            [json.dumps(name[:40], ensure_ascii=False) for name in split[:5]] + ["..."] * (len(split) > 5)
        )
        what = "materials" if materials else "groups"
        why = (
            f"needed one material: its triangles are split into the {what} {named}; write a file for each, put all"
            " triangles into one group, or give young by the names of groups"
        )
    if not lines:
        if empty := ", ".join(name for name, (_, of) in read.field_data.items() if of == 1):
            raise NotRead(f"it names lines ({empty[:SAID]}), but no element belongs to one: {SAVE_ALL}")
        raise NotRead("no named lines; give the sides physical names, in Abaqus a *SURFACE or an *NSET each")
    if kind == "gmsh":
        least = _least_number(path.read_bytes())
        if least < 1:
            raise NotRead(f"an element names node {least}: nodes are numbered from 1")
    cut = [f"{len(cells[name])} {CUT[name]}" for name in plane if name in CUT]
    return {
        "points": points,
        "triangles": triangles,
        "centres": centres,
        "lines": lines,
        "surfaces": groups,
        "split": why,
        "cut": " and ".join(cut),
        "plane": planes,
    }


def _by_meshio(path: Path, kind: str, faces: Faces) -> tuple[Any, dict[str, Ints]]:
    """The mesh, and its named lines; the numbers that each of ``faces`` lists are a set, HIDDEN and its place."""
    import meshio

    words = io.StringIO()  # its readers print, and exit the interpreter on what they cannot read
    try:
        with contextlib.redirect_stdout(words), contextlib.redirect_stderr(words), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about what does not parse
            if kind == "abaqus":
                meshio.abaqus._abaqus.abaqus_to_meshio_type.update(ABAQUS)
                text, numbers = path.read_text("utf-8"), [filter(str.isdecimal, listed) for listed in faces.values()]
                text += "".join(f"\n*ELSET, ELSET={HIDDEN}{i}\n{', '.join(of)}" for i, of in enumerate(numbers))
                read = meshio.abaqus._abaqus.read_buffer(io.StringIO(text))
            else:
                read = meshio.read(path, file_format=kind)
            return read, _by_name(
                (name, read.cells_dict[of][members][:, list(piece)])
                for of, pieces in PIECES.items()
                for name, members in _groups(read, of, 1).items()
                for piece in pieces
            )
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:
        if "Incompatible cell data 'gmsh:physical'" in str(error):
            raise NotRead(f"some of its elements belong to a physical group and others to none: {SAVE_ALL}") from None
        why = str(error) if str(error).startswith("could not convert") else ""
        said = [*words.getvalue().splitlines(), why][0].strip()
        if not said or not said.isprintable() or "\\x" in said or said.startswith("Error"):
            said = MISFIT
        raise NotRead(f"meshio cannot read it ({said[:SAID]})") from None


def _triangles(points: Any, blocks: dict[str, Any]) -> tuple[Any, Ints, dict[str, Ints], Ints]:
    """Points, linear triangles of cells of several kinds, the triangles of each cell by its kind, as rows, and centres.

    The last new points of a cell are the centres of the quadrilaterals that it is cut into before.
    """
    triangles, parts, count, centres = [], {}, 0, [np.empty(0, dtype=np.int64)]
    for name, cells in blocks.items():
        cut, new = CUTS[name]
        cells = np.asarray(cells, dtype=np.int64)
        if new:
            weights = np.array(new)[:, : cells.shape[1]]
            made = np.einsum("ij,cjk->cik", weights, points[cells])
            number = len(points) + np.arange(made.shape[0] * made.shape[1]).reshape(made.shape[:2])
            points = np.concatenate([points, made.reshape(-1, points.shape[1])])
            cells = np.column_stack([cells, number])
            corners = cells[:, np.array(cut)[:, 0]].reshape(-1, 4)
            centres.append(number[:, -len(cut) // len(_QUARTERS) :].ravel())
            points[centres[-1]] = _crossings(points[corners], points[centres[-1]])
        triangles.append(cells[:, np.array(cut)].reshape(-1, 3))
        parts[name] = count + np.arange(len(triangles[-1])).reshape(len(cells), len(cut))
        count += len(triangles[-1])
    return points, np.concatenate(triangles), parts, np.concatenate(centres)


def _crossings(corners: Any, otherwise: Any) -> Any:
    """The points at which the diagonals of quadrilaterals cross, or others where that is too near the end of one."""
    a, b, c, d = np.swapaxes(corners[:, :, :2] @ [[1], [1j]], 0, 1)
    with np.errstate(all="ignore"):
        s, t = (((b - a).conj() * u).imag / ((c - a).conj() * (d - b)).imag for u in (c - a, d - b))
    inside = np.maximum(abs(s - 0.5), abs(t - 0.5)) < _BESIDE
    return np.where(inside, corners[:, 0] + t * (corners[:, 2] - corners[:, 0]), otherwise)


def _by_name(pairs: Iterable[tuple[str, Ints]]) -> dict[str, Ints]:
    """All rows of each name."""
    found: dict[str, list[Ints]] = {}
    for name, rows in pairs:
        found.setdefault(name, []).append(rows)
    return {name: np.concatenate(each) for name, each in found.items()}


def _groups(read: Any, kind: str, dimension: int) -> dict[str, Ints]:
    """Numbers of the cells of a kind that a name of the file gathers; names without cells are left out.

    The name of a physical group of Gmsh without one is its number; without any group the geometry's numbers are names.
    """
    groups = {name: of[kind] for name, of in read.cell_sets_dict.items() if kind in of and not name.startswith(HIDDEN)}
    numbers = read.cell_data_dict.get("gmsh:physical", {})
    if not read.field_data and not any(map(np.any, numbers.values())):
        numbers = read.cell_data_dict.get("gmsh:geometrical", {})
    tags = numbers.get(kind, np.empty(0, dtype=np.int64))
    names = {name: tag for name, (tag, of) in read.field_data.items() if of == dimension}
    names |= {str(tag): tag for tag in np.unique(tags[tags != 0]).tolist() if tag not in names.values()}
    groups = {name: np.flatnonzero(tags == tag) for name, tag in names.items()} | groups
    return {name: np.asarray(members, dtype=np.int64) for name, members in groups.items() if len(members)}


def _faces(read: Any, faces: Faces) -> Iterator[tuple[str, Ints]]:
    """Edges of the surfaces of an Abaqus file: faces 1, 2, .. of its plane elements, or its line elements."""
    sets = {name.upper(): of for name, of in read.cell_sets_dict.items()}
    for i, ((surface, face), listed) in enumerate(faces.items()):
        elements = {int(one) for one in listed if one.isdecimal()}
        if lost := [one for one in listed if not one.isdecimal() and one.upper() not in sets]:
            raise NotRead(f"its surface {surface[:SAID]} lists {lost[0][:SAID]}, which is no element set of it")
        if sum(map(len, sets.get(f"{HIDDEN}{i}".upper(), {}).values())) < len(elements):
            raise NotRead(f"its surface {surface[:SAID]} lists an element that it does not have")
        for kinds in {name.upper(): sets.get(name.upper(), {}) for name in (f"{HIDDEN}{i}", *listed)}.values():
            for kind, members in kinds.items():
                corners, first = 3 if kind.startswith("triangle") else 4, int(face) if face.isdecimal() else 0
                if first > corners and kind not in PIECES:
                    raise NotRead(f"its surface {surface[:SAID]} names face {first} of an element with {corners}")
                path = [first - 1, *[corners + first - 1] * (kind in ("triangle6", "quad8")), first % corners]
                for pair in PIECES.get(kind) or pairwise(path if first else ()):
                    yield surface, read.cells_dict[kind][members][:, list(pair)]


def _of_nodes(sets: dict[str, Ints], triangles: Ints) -> dict[str, Ints]:
    """The edges of the outline between the nodes of each set all of whose nodes lie on it."""
    if not sets:
        return {}
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
    _, first, count = np.unique(ends @ [ends.max() + 1, 1], return_index=True, return_counts=True)
    outline = ends[first[count == 1]]
    edges = {name: outline[np.isin(outline, of).all(axis=1)] for name, of in sets.items() if np.isin(of, outline).all()}
    return {name: of for name, of in edges.items() if len(of)}


def _split(read: Any, groups: dict[str, Ints], count: int) -> list[str]:
    """Names of the groups that share the triangles; none if one of them holds all.

    Named surfaces of a Gmsh file are materials.  Element sets of an Abaqus file may also be neighbours of a side: they
    count as materials only if each triangle lies in one of them.
    """
    each = [np.unique(members) for members in groups.values()]
    if any(len(members) == count for members in each):
        return []
    covered = len(np.unique(np.concatenate([[-1], *each]))) > count
    of_gmsh = any(name in groups for name, (_, of) in read.field_data.items() if of == 2)
    return sorted(groups) if of_gmsh or (not read.cell_data_dict and covered) else []


def _abaqus_keywords(path: Path) -> tuple[set[str], dict[str, str], Faces]:
    """Materials of the sections of an Abaqus file, an element type of each plane of its elements, and its surfaces.

    Refuses files that meshio would read from elsewhere or mix up, and elements of another kind of plane.
    """
    materials, planes, blocks, lists, keyword = set(), dict[str, str](), [], [], ""
    faces, surface = Faces(), ""
    with path.open(encoding="utf-8") as file:
        for line in file:
            if line.startswith("**") or (keyword not in ("ELSET", "SURFACE") and line.lstrip()[:1].isdigit()):
                continue  # a comment; a node or an element, as almost all lines are
            head, *options = line.split(",")
            word = "".join(head.split()).replace("*", "").upper()
            given = {key.strip().upper(): value.strip() for key, _, value in (pair.partition("=") for pair in options)}
            if word == "INCLUDE" or "INPUT" in given:  # meshio needs no star before it
                raise NotRead("it includes another file: needed one file that holds the whole mesh")
            if not line.startswith("*"):
                if keyword == "ELSET" and line.strip(" \t\r\n,") and not head.strip().isnumeric():
                    raise NotRead("an *ELSET lists names of other sets: needed numbers of elements")
                if keyword == "SURFACE" and surface and head.strip():
                    faces.setdefault((surface, "".join(options[:1]).strip()[1:]), []).append(head.strip())
                continue
            keyword = word
            if keyword in SECTIONS and given.get("MATERIAL"):
                materials.add(given["MATERIAL"].upper())
            elif keyword == "ELEMENT":
                blocks.append(given.get("ELSET"))
                of = given.get("TYPE", "").upper()
                if of.startswith(("CAX", "CGAX")):
                    raise NotRead(f"its elements {of[:SAID]} are axisymmetric: needed those of plane strain or stress")
                if plane := next((word for start, word in ABAQUS_PLANES.items() if word and of.startswith(start)), ""):
                    planes.setdefault(plane, of)
            elif keyword in ("ELSET", "NSET"):
                lists.append((keyword, given.get(keyword)))
            elif keyword == "SURFACE":
                surface = given.get("NAME", "") if given.get("TYPE", "ELEMENT").upper() == "ELEMENT" else ""
    named = [name for name in blocks if name]
    if len(set(named)) < len(named) or None in blocks[: len(named)]:  # meshio counts the sets for the blocks
        raise NotRead("needed a different ELSET for each *ELEMENT, or for none of them")
    if len(set(lists)) < len(lists):  # meshio keeps the last
        raise NotRead("needed one *ELSET or *NSET for each name")
    return materials, planes, faces


def _least_number(content: bytes) -> int:
    """The least node number of the cells of a Gmsh text file; meshio counts 0 and below from the end.

    1 for the binary variants.
    """
    version, binary = content.split(None, 3)[1:3]
    listed = content.partition(b"$Elements")[2].partition(b"$EndElements")[0]
    corners, least, at = GMSH_NODES, 1, 2 if version == b"4.0" else 4
    if binary == b"1":
        return 1
    if version.startswith(b"2"):  # meshio takes the last numbers of a line for its nodes
        for line in listed.splitlines()[2:]:
            row = [int(word) for word in line.split()]
            if row and len(row) != 3 + row[2] + corners[row[1]]:
                raise ValueError("another number of tags and nodes than the line says")
            least = min([least, *row[3 + row[2] :]]) if row else least
        return least
    numbers = np.array(listed.split(), dtype=np.int64)
    while at < len(numbers):
        width, count = 1 + corners[int(numbers[at + 2])], int(numbers[at + 3])
        if count < 0:
            raise ValueError("no block of elements")
        rows = numbers[at + 4 : at + 4 + count * width].reshape(count, width)
        least, at = min(least, int(rows[:, 1:].min(initial=1))), at + 4 + count * width
    return least


def limit(seconds: int, memory: int) -> None:
    """Let this process use no more than this processor time, in seconds, and memory, in bytes.

    Windows offers neither, macOS no limit on memory.
    """
    try:
        import resource
    except ImportError:
        return
    # processor time beyond the first limit is a signal that says so, beyond the second one it is SIGKILL
    for what, first, last in (
        (resource.RLIMIT_CPU, seconds, seconds + 5),
        (resource.RLIMIT_AS, memory, memory),
        (resource.RLIMIT_CORE, 0, 0),
    ):
        most = resource.getrlimit(what)[1]
        ends = (end if most == resource.RLIM_INFINITY else min(end, most) for end in (first, last))
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(what, (next(ends), next(ends)))


def _end_with_parent() -> None:
    os.read(0, 1)  # nothing is ever written to it: this returns when the parent has ended
    os._exit(1)


def main(arguments: Sequence[str]) -> int:
    """Write the arrays of a mesh file to stdout, or the reason why it is refused.

    ``arguments`` are its path, and the limits of :func:`limit`.
    """
    path, seconds, memory = arguments
    limit(int(seconds), int(memory))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    out, status = io.BytesIO(), REFUSED
    try:
        found = contents(Path(path))
        kinds = ("lines", "surfaces")
        words = [*(list(found[kind]) for kind in kinds), *(found[word] for word in ("split", "cut", "plane"))]
        names = np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)
        named = {f"{kind}{i}": members for kind in kinds for i, members in enumerate(found[kind].values())}
        arrays = {name: found[name] for name in ("points", "triangles", "centres")}
        np.savez(out, names=names, **arrays, **named)
        status, reason = 0, ""
    except NotRead as error:
        reason = str(error)
    except MemoryError:
        reason = f"reading it needs more than {int(memory) / 1e9:g} GB of memory"
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
    sys.stdout.buffer.write(reason.encode(errors="replace") if status else out.getbuffer())
    sys.stdout.buffer.flush()
    return status


if __name__ == "__main__":
    os._exit(main(sys.argv[1:]))

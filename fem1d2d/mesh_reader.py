"""Read a mesh file with meshio: a script for a process with limits on memory and time.

:mod:`fem1d2d.mesh_files` runs it by its path, in isolated mode, so it imports nothing of this package.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import threading
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

#: meshio's names of the formats that are read.
FORMATS = {".msh": "gmsh", ".inp": "abaqus"}

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
        ``points`` of shape (n, 2) or (n, 3), ``triangles`` of shape (c, 3), ``lines`` of shape (l, 2) by their names,
        ``surfaces``, the numbers of their triangles by their names, ``split``, why they are several materials, or "".

    Raises
    ------
    NotRead
        Unreadable, no triangles or other cells too, or no named lines.
    """
    try:
        return _contents(path)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        raise NotRead(MISFIT) from None


def _contents(path: Path) -> dict[str, Any]:
    kind = FORMATS[path.suffix.lower()]
    materials: set[str] | None = None
    if kind == "gmsh":
        with path.open("rb") as file:
            if file.read(11) != b"$MeshFormat":
                raise NotRead("no Gmsh file: needed $MeshFormat on its first line")
    else:
        try:
            materials = _abaqus_materials(path)
        except UnicodeDecodeError as error:
            raise NotRead(f"needed text in UTF-8: {error.reason}") from None
    read, triangles, lines, groups = _by_meshio(path, kind)
    if triangles is None or len(triangles) == 0:
        remedy = "; give the surface a physical name too" if kind == "gmsh" and lines else ""
        raise NotRead(f"no triangles in it, only {', '.join(read.cells_dict) or 'nothing'}{remedy}")
    others = sorted(set(read.cells_dict) - {"triangle", "line", "vertex"})
    if others:
        raise NotRead(f"needed only triangles, it has {', '.join(others)} too")
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
        raise NotRead("no named lines; give the sides physical names")
    if kind == "gmsh":
        least = _least_number(path.read_bytes())
        if least < 1:
            raise NotRead(f"an element names node {least}: nodes are numbered from 1")
    points = np.asarray(read.points, dtype=float)
    triangles = np.asarray(triangles, dtype=np.int64)
    return {"points": points, "triangles": triangles, "lines": lines, "surfaces": groups, "split": why}


def _by_meshio(path: Path, kind: str) -> tuple[Any, Any, dict[str, Ints], dict[str, Ints]]:
    """The mesh, its triangles, its named lines, and the numbers of the triangles of each named group."""
    import meshio

    words = io.StringIO()  # its readers print, and exit the interpreter on what they cannot read
    try:
        with contextlib.redirect_stdout(words), contextlib.redirect_stderr(words), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about what does not parse
            read = meshio.read(path, file_format=kind)
            cells = read.cells_dict
            lines = {name: cells["line"][members] for name, members in _groups(read, "line", 1).items()}
            return read, cells.get("triangle"), lines, _groups(read, "triangle", 2)
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


def _groups(read: Any, kind: str, dimension: int) -> dict[str, Ints]:
    """Numbers of the cells of a kind that a name of the file gathers; names without cells are left out."""
    groups: dict[str, Any] = {}
    for name, blocks in read.cell_sets_dict.items():
        if kind in blocks and not name.startswith("gmsh:"):
            groups[name] = blocks[kind]
    if not groups and "gmsh:physical" in read.cell_data_dict and kind in read.cells_dict:
        tags = read.cell_data_dict["gmsh:physical"][kind]
        for name, (tag, of) in read.field_data.items():
            if of == dimension:
                groups[name] = np.flatnonzero(tags == tag)
    return {name: np.asarray(members, dtype=np.int64) for name, members in groups.items() if len(members)}


def _split(read: Any, groups: dict[str, Ints], count: int) -> list[str]:
    """Names of the groups that share the triangles; none if one of them holds all.

    Named surfaces of a Gmsh file are materials.  Element sets of an Abaqus file may also be neighbours of a side: they
    count as materials only if each triangle lies in one of them.
    """
    covered = np.zeros(count, dtype=bool)
    for members in groups.values():
        holds = np.zeros(count, dtype=bool)
        holds[members] = True
        covered |= holds
        if holds.all():
            return []
    names = sorted(groups)
    tags = read.cell_data_dict.get("gmsh:physical", {}).get("triangle")
    if names and tags is not None:
        names += [f"physical surface {tag}" for tag in sorted({*tags[~covered].tolist()} - {0})]
    elif not covered.all():
        return []
    return names


def _abaqus_materials(path: Path) -> set[str]:
    """Materials of the sections of an Abaqus file; refuses files that meshio would read from elsewhere or mix up."""
    materials, blocks, lists, keyword = set(), [], [], ""
    with path.open(encoding="utf-8") as file:
        for line in file:
            if line.startswith("**") or (keyword != "ELSET" and line.lstrip()[:1].isdigit()):
                continue  # a comment; a node or an element, as almost all lines are
            head, *options = line.split(",")
            word = "".join(head.split()).replace("*", "").upper()
            given = {key.strip().upper(): value.strip() for key, _, value in (pair.partition("=") for pair in options)}
            if word == "INCLUDE" or "INPUT" in given:  # meshio needs no star before it
                raise NotRead("it includes another file: needed one file that holds the whole mesh")
            if not line.startswith("*"):
                if keyword == "ELSET" and line.strip(" \t\r\n,") and not head.strip().isnumeric():
                    raise NotRead("an *ELSET lists names of other sets: needed numbers of elements")
                continue
            keyword = word
            if keyword in SECTIONS and given.get("MATERIAL"):
                materials.add(given["MATERIAL"].upper())
            elif keyword == "ELEMENT":
                blocks.append(given.get("ELSET"))
            elif keyword == "ELSET":
                lists.append(given.get("ELSET"))
    named = [name for name in blocks if name]
    if len(set(named)) < len(named) or None in blocks[: len(named)]:  # meshio counts the sets for the blocks
        raise NotRead("needed a different ELSET for each *ELEMENT, or for none of them")
    if len(set(lists)) < len(lists):  # meshio keeps the last
        raise NotRead("needed one *ELSET for each name")
    return materials


def _least_number(content: bytes) -> int:
    """The least node number of points, lines and triangles of a Gmsh text file; meshio counts 0 and below from the end.

    1 for the binary variants.
    """
    version, binary = content.split(None, 3)[1:3]
    listed = content.partition(b"$Elements")[2].partition(b"$EndElements")[0]
    corners, least, at = {15: 1, 1: 2, 2: 3}, 1, 2 if version == b"4.0" else 4
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
        words = [*(list(found[kind]) for kind in kinds), found["split"]]
        names = np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)
        named = {f"{kind}{i}": members for kind in kinds for i, members in enumerate(found[kind].values())}
        np.savez(out, points=found["points"], triangles=found["triangles"], names=names, **named)
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

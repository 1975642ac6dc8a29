"""Meshes in files: Gmsh and Abaqus, read in a process with limits on memory and time; all cells become triangles."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fem1d2d import mesh_reader
from fem1d2d.mesh import Cells, Floats, Ints, Mesh, MeshError, edges, measures, undirected, where
from fem1d2d.supports import pieces
from fem1d2d.trace import SAME

#: Limits of the process that reads: seconds of processor time and bytes of memory, at least and for each byte of the
#: file up to MOST_BYTES.  Half a million triangles in 36 MB take 5 s and 0.3 GB.
SECONDS, SECONDS_PER_BYTE = 10, 1e-6
MEMORY, MEMORY_PER_BYTE = 10**9, 10
MOST_BYTES = 200_000_000

#: The variables that keep each BLAS library to one thread; the last one is that of macOS.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

#: Seconds on the clock for each second of processor time: the machine may do other work.
PATIENCE = 6


def from_file(
    path: Path | str, *, one_material: bool = True, plane: str | None = None, group: Sequence[str] = ()
) -> Mesh:
    """A triangle mesh from a Gmsh (``.msh``) or Abaqus (``.inp``) file; its sides are the names of its lines.

    Quadrilaterals and cells of second order are cut into triangles (:mod:`fem1d2d.mesh_reader`); ``cut`` of the mesh
    says so.  A cell that the file lists clockwise is turned over; points that no cell uses and names without lines are
    left out, lines inside the body or off its cells too: ``off`` of the mesh says where they are.  Its ``surfaces`` are
    the named groups of cells; if these split the mesh it is refused, unless not ``one_material``.

    Parameters
    ----------
    path : path or str
    one_material : bool
    plane : {'strain', 'stress'}, optional
        The plane problem that the mesh is for: elements of Abaqus that are made for the other one are refused.
    group : sequence of str, optional
        Named surfaces that are the mesh, of a file that holds several bodies, or a piece of one, as in
        :func:`with_pieces`.  Of its sides the parts on their outline are left, also where another body begins.

    Raises
    ------
    MeshError
        Another format, unreadable, beyond the limits on memory and time, no cells of a plane or other ones too, several
        materials, not plane, no named lines, elements for another plane problem, a surface that the file does not name,
        or no mesh as :class:`Mesh` needs it.
    """
    path = Path(path)
    try:
        read = _of_group(contents(path), group, path.name)
        if read.split and one_material:
            raise MeshError(read.split)
        other = {"strain": "stress", "stress": "strain"}.get(plane or "", "")
        if other in read.plane:
            needed = f'needed those of plane {plane}, or the problem with plane = "{other}"'
            raise MeshError(f"its elements {read.plane[other]} are of plane {other}: {needed}")
        return _plane_mesh(read)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def contents(path: Path) -> Read:
    """Read all of a mesh file, which may hold bodies that lie on each other; the MeshErrors do not name it.

    Paths without a regular file and endings of other formats are refused unread.
    """
    try:
        if not path.exists():
            raise MeshError("no such mesh file")
        if not path.is_file():
            raise MeshError("a regular file is needed, this is a folder, a pipe or a device")
    except (OSError, ValueError) as error:
        raise MeshError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if path.suffix.lower() not in mesh_reader.FORMATS:
        ending = f"the ending {path.suffix!r}" if path.suffix else "no ending"
        raise MeshError(
            f"needed a Gmsh file (.msh) or an Abaqus file (.inp), this one has {ending};"
            " `meshio convert -o gmsh22 FILE out.msh` writes a Gmsh file"
        )
    return read_in_process(path)


def part_of(read: Read, group: Sequence[str]) -> Mesh:
    """Make the mesh of a body in a file: of some of its named surfaces, or of all cells where none are named.

    MeshError as :func:`from_file`; materials and plane are not checked.
    """
    return _plane_mesh(_of_group(read, group))


class Read(NamedTuple):
    """The contents of a mesh file, as :func:`fem1d2d.mesh_reader.contents` has them."""

    points: Floats
    triangles: Ints
    centres: Ints
    sides: Mapping[str, Ints]
    surfaces: Mapping[str, Ints]
    split: str
    cut: str
    plane: Mapping[str, str]
    shares: Mapping[str, bool] = MappingProxyType({})
    off: Mapping[str, str] = MappingProxyType({})


def read_in_process(path: Path) -> Read:
    """The contents of a file from a separate process.

    The process ends when this one does: it waits for the end of its stdin.  Ctrl-C on a terminal does not reach it.
    MeshError if :func:`fem1d2d.mesh_reader.contents` refuses the file, or the process meets a limit or fails.
    """
    size = min(path.stat().st_size, MOST_BYTES)
    seconds, memory = int(SECONDS + SECONDS_PER_BYTE * size), int(MEMORY + MEMORY_PER_BYTE * size)
    # what lies beside the files of a user is not imported
    command = [sys.executable, "-P", "-X", "utf8", mesh_reader.__file__, str(path), str(seconds), str(memory)]
    # one thread of BLAS: each would claim memory
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1")
    stdin, held = os.pipe()
    try:
        ended = subprocess.run(
            command,
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
            timeout=PATIENCE * seconds,
            process_group=0,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # on Windows
        )
    except subprocess.TimeoutExpired:
        raise MeshError(f"reading it takes longer than {PATIENCE * seconds:g} s") from None
    except OSError as error:
        raise MeshError(f"no process to read it could be started: {error.strerror}") from None
    finally:
        os.close(stdin)
        os.close(held)
    if ended.returncode == mesh_reader.REFUSED:
        raise MeshError(ended.stdout.decode(errors="replace"))
    if ended.returncode == -getattr(signal, "SIGXCPU", sys.maxsize):  # Windows has none, and 0 is success
        raise MeshError(f"reading it takes more than {seconds} s of processor time")
    if ended.returncode:
        raise MeshError(f"the process that read it ended with status {ended.returncode}")
    with np.load(io.BytesIO(ended.stdout), allow_pickle=False) as found:
        lines, surfaces, *said = json.loads(found["names"].tobytes())
        sides = {name: found[f"lines{i}"] for i, name in enumerate(lines)}
        groups = {name: found[f"surfaces{i}"] for i, name in enumerate(surfaces)}
        return Read(found["points"], found["triangles"], found["centres"], sides, groups, *said)


def _of_group(read: Read, group: Sequence[str], file: str = "it") -> Read:
    """The part of a file that some of its named surfaces make; all of it where none are named."""
    flat, sides, off = read.points[:, :2], dict[str, Ints](), dict[str, str]()
    if not read.surfaces.keys() >= {*group}:
        read = with_pieces(read)
    if unknown := [name for name in group if name not in read.surfaces]:
        known = ", ".join(read.surfaces) or "none"
        raise MeshError(f"no surface {unknown[0]!r}; needed names of surfaces (element sets) in it: {known[:200]}")
    members = [read.surfaces[name] for name in group] or [np.arange(len(read.triangles))]
    chosen = np.unique(np.concatenate(members))
    facets = edges(read.triangles[chosen])
    codes, first, times = np.unique(undirected(facets, len(flat)), return_index=True, return_counts=True)
    outline = facets[first[times == 1]]
    for name, line in read.sides.items():
        on = np.isin(undirected(line, len(flat)), codes[times == 1])
        if on.all() or (group and on.any()) or not len(outline):
            sides[name] = line[on]
        else:
            lost = line[int(np.argmin(on))]
            near = np.linalg.norm(flat[outline].mean(axis=1) - flat[lost].mean(axis=0), axis=1).argmin()
            places = f"lies on no outer edge {where(flat, lost)}; the nearest one runs {where(flat, outline[near])}"
            off[name] = f"the line {name!r} of the file {places}"
    read = read._replace(sides=sides, off=off)
    if not group:
        return read
    own = {name: np.flatnonzero(np.isin(chosen, members)) for name, members in read.surfaces.items()}
    bare = np.setdiff1d(np.arange(len(read.triangles)), np.concatenate([*read.surfaces.values()]))
    shares = {f"{name} of {file}": len(members) > 0 for name, members in own.items()}
    shares |= {f"{len(bare)} triangles without a name of {file}": False} if len(bare) else {}
    return read._replace(
        triangles=read.triangles[chosen],
        surfaces={name: members for name, members in own.items() if len(members)},
        split="",
        cut=f"the file's {read.cut}" if read.cut else "",
        shares=shares,
    )


def with_pieces(read: Read) -> Read:
    """Name the pieces of a surface that share no edge: ``all.1``, ``all.2`` of ``all``, in the order of the file.

    Where the file itself has a surface of such a name, the name stays that surface's.
    """
    piece, found = pieces(Cells(points=read.points, cells=read.triangles)), dict(read.surfaces)
    for name, members in read.surfaces.items():
        own = np.unique(piece[members])
        found |= {f"{name}.{n}": members[piece[members] == k] for n, k in enumerate(own, 1)} if len(own) > 1 else {}
    return read._replace(surfaces={**found, **read.surfaces})


def _plane_mesh(read: Read) -> Mesh:
    """A mesh of the points in use, its triangles turned anticlockwise."""
    points, triangles = read.points, read.triangles
    used = np.unique(triangles)  # geometry points of the mesher belong to no triangle
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    points = points[used]
    if not np.isfinite(points).all():
        raise MeshError("a coordinate is not finite")
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > SAME * np.ptp(points, axis=0).max():
        raise MeshError("the points do not lie in a plane z = constant")
    points, triangles = points[:, :2], number[triangles]
    with np.errstate(over="ignore", invalid="ignore"):  # coordinates too large for their products are refused later
        flipped = measures(points, triangles) < 0
    return Mesh(
        points=points,
        cells=np.where(flipped[:, None], triangles[:, ::-1], triangles),
        sides={name: number[facets] for name, facets in read.sides.items()},
        surfaces=read.surfaces,
        cut=read.cut,
        shares=read.shares,
        off=read.off,
        centres=number[read.centres][number[read.centres] >= 0],
    )

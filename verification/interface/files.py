"""A contact pair as one file of matrices, ``interface.npz``, which any code can write or read.

Arrays: S1, S2, load1, load2, x, weights, gap; x_neumann and weights_neumann, the nodes of the Neumann body; kernel and
transfer where there are such; known1, known2, free1, free2 (which interface components Gamma_u leaves free, and the
displacement of the others); motions1 or motions2, where only contact holds a body, an orthonormal basis of the kernel
of its matrix; points, normals, points_neumann, normals_neumann along a named line: coordinates of the nodes and unit
normals from body 1 to body 2.  Texts: friction, neumann_body, dimension, theta, tolerance, max_iterations, with numbers
as texts; law and outside, the words of a law of friction; ndtheory, the version.  Interface vectors list all tangential
components from left to right, then all normal ones along y; along a named line in its direction and along its normals.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from ndtheory import HypothesisError, __version__, exact
from verification.dense import pinned
from verification.interface.body import NO_MOTIONS, Condensed
from verification.interface.friction import GivenOperator
from verification.interface.interface import NO_SUPPORT, Grid, Interface
from verification.interface.matrices import (
    ASYMMETRY,
    UNREADABLE,
    check_matrix,
    check_nodes,
    check_unit,
    headers,
    real_array,
)
from verification.interface.pair import ContactPair
from verification.problem import ProblemError, Settings
from verification.problem.readers import LEAST_FRICTION, at_least_one, factor, tolerance
from verification.problem.tables import TomlTable, choice, label, number, unreadable

#: Largest size of an interface file, and of what it unpacks to: two matrices of 4000 rows, and what else there is.
MOST_BYTES = 600_000_000

#: Names in every interface file.
NEEDED = ("S1", "S2", "load1", "load2", "x", "weights", "gap", "friction", "neumann_body", "dimension")

#: Names of texts and single numbers in an interface file.
SCALARS = ("friction", "neumann_body", "dimension", "theta", "tolerance", "max_iterations", "law", "outside")


def write_interface(pair: ContactPair, path: Path) -> None:
    """Write a pair as an interface file."""
    interface, settings = pair.interface, pair.settings
    arrays: dict[str, Any] = {}
    for i, side in enumerate(pair.along_y, 1):
        arrays |= {f"S{i}": side.schur, f"load{i}": side.load, f"known{i}": side.known, f"free{i}": side.free}
        if side.loose:
            arrays[f"motions{i}"] = side.motions
    for name, grid in (("", interface.contact), ("_neumann", interface.neumann)):
        arrays |= {f"x{name}": grid.x, f"weights{name}": grid.weights}
        if grid.normals is not None and grid.points is not None:
            arrays |= {f"points{name}": grid.points, f"normals{name}": grid.normals}
    arrays |= {
        "gap": interface.gap,
        "friction": str(pair.friction),
        "neumann_body": str(pair.neumann_body),
        "dimension": str(interface.contact.dimension),
        "theta": str(settings.theta),
        "tolerance": repr(settings.tolerance),
        "max_iterations": str(settings.max_iterations),
        "ndtheory": __version__,
    }
    if interface.kernel is not None and interface.law is not None:
        arrays |= {"kernel": interface.kernel, "law": interface.law.words, "outside": interface.law.outside}
    if not interface.one_grid:
        arrays["transfer"] = interface.transfer
    if interface.slipped.any():
        arrays["slipped"] = interface.slipped
    with path.open("wb") as file:
        np.savez(file, **arrays)


def write_transfer(interface: Interface, path: Path) -> None:
    """Write P as ``scipy.sparse.load_npz`` reads it, with the positions and weights of both grids beside it.

    P leads from nodal values on the Neumann grid to those on the contact grid, its transpose from nodal forces back.
    Where normals differ it acts on vectors, of both components, with normals from body 1 to body 2.
    """
    P = sp.csr_array(interface.transfer if interface.join.alike else interface.carry(np.eye(interface.neumann.size)))
    arrays = {"format": b"csr", "shape": P.shape, "data": P.data, "indices": P.indices, "indptr": P.indptr}
    for name, grid in (("contact", interface.contact), ("neumann", interface.neumann)):
        arrays |= {f"x_{name}": grid.x, f"weights_{name}": grid.weights}
    with path.open("wb") as file:
        np.savez(file, **arrays, ndtheory=__version__)


def read_interface(path: Path) -> ContactPair:
    """Read a pair from an interface file.

    Raises
    ------
    ProblemError
        Not such a file, or one whose arrays do not fit each other or the memory.
    """
    refuse = lambda key, needed: ProblemError(str(path), key, None, needed)
    if why := unreadable(path, MOST_BYTES):
        raise refuse("", why)
    try:
        with path.open("rb") as file:
            unpacked = sum(header.entries * header.entry_bytes for header in headers(file))
            if unpacked > MOST_BYTES:
                raise refuse("", f"needed arrays of at most {MOST_BYTES} bytes together, received {unpacked}")
            file.seek(0)
            with np.load(file, allow_pickle=False) as found:
                arrays = {name: np.array(found[name]) for name in found.files}
    except UNREADABLE as error:
        if isinstance(error, ProblemError):
            raise
        raise refuse("", "needed an interface file, as `ndtheory run FILE -o DIR` writes it") from None
    if missing := [name for name in NEEDED if name not in arrays]:
        raise refuse(missing[0], f"needed an interface file with {', '.join(NEEDED)}")
    try:
        return _pair(arrays, str(path))
    except HypothesisError as error:
        raise refuse(error.key, f"needed {error.needed}") from None
    except (ValueError, TypeError, IndexError, ArithmeticError) as error:
        if isinstance(error, ProblemError):
            raise
        raise refuse("", str(error)) from None


def _scalar(array: np.ndarray) -> Any:
    """Return a single value as a text or a whole number; several as a list, which every key refuses."""
    if array.shape != ():
        return array.tolist()
    text = str(array)
    try:
        found = exact(text)
    except ValueError:
        return text
    return int(found) if found.denominator == 1 else text


def _pair(arrays: dict[str, np.ndarray], source: str) -> ContactPair:
    texts = TomlTable({name: _scalar(arrays[name]) for name in SCALARS if name in arrays}, source)
    dimension: Literal[1, 2] = texts.take("dimension", choice(1, 2))
    neumann_body: Literal[1, 2] = texts.take("neumann_body", choice(1, 2))
    x = real_array("x", arrays["x"], (None,))
    n, transfer = len(x), arrays.get("transfer")
    grid = Grid(
        x=x, weights=real_array("weights", arrays["weights"], (n,)), dimension=dimension, **_line(arrays, "", n)
    )
    other = grid
    if transfer is not None:
        transfer = real_array("transfer", transfer, (n, None))
        m = transfer.shape[1]
        weights = real_array("weights_neumann", arrays.get("weights_neumann", transfer.T @ grid.weights), (m,))
        x_neumann = real_array("x_neumann", arrays["x_neumann"], (m,)) if "x_neumann" in arrays else np.full(m, np.nan)
        other = Grid(x=x_neumann, weights=weights, dimension=dimension, **_line(arrays, "_neumann", m))
    law = None
    if "kernel" in arrays:
        kernel = real_array("kernel", arrays["kernel"], (n, other.n))
        law = GivenOperator(
            matrix=kernel,
            words=texts.take("law", label, "operator S given as a matrix"),
            outside=texts.take("outside", label, ""),
        )
    grids = (grid, other) if neumann_body == 2 else (other, grid)
    lower, upper = (_side(arrays, i, own) for i, own in enumerate(grids, 1))
    contact, neumann = (lower, upper) if neumann_body == 2 else (upper.turned(), lower.turned())
    settings = Settings(
        theta=texts.take("theta", factor, Settings.theta),
        tolerance=float(texts.take("tolerance", tolerance, Settings.tolerance)),
        max_iterations=texts.take("max_iterations", at_least_one, Settings.max_iterations),
    )
    check_nodes(grid.x, grid.weights)
    if neumann.loose:
        raise ValueError(f"motions{neumann_body}: needed none of the body with the Neumann problem")
    slipped = real_array("slipped", arrays.get("slipped", np.zeros(grid.t)), (grid.t,))
    gap = real_array("gap", arrays["gap"], (n,))
    support = (contact.support, neumann.support) if grid.t else NO_SUPPORT
    interface = Interface.joining(grid, other, transfer, support, gap=gap, law=law, slipped=slipped)
    if neumann_body == 1:
        interface = interface.reversed()
    pair = ContactPair(
        contact=contact, neumann=neumann, interface=interface, neumann_body=neumann_body, settings=settings
    )
    coefficient = number("a number >= 0", lambda v: v >= 0, LEAST_FRICTION)
    return pair.at(friction=texts.take("friction", coefficient))


def _line(arrays: dict[str, np.ndarray], name: str, n: int) -> dict[str, Any]:
    """Return the points and normals of a named line, if the file has them."""
    if f"normals{name}" not in arrays:
        return {}
    found = {part: real_array(f"{part}{name}", arrays.get(f"{part}{name}"), (n, 2)) for part in ("points", "normals")}
    if np.abs(np.linalg.norm(found["normals"], axis=1) - 1).max(initial=0.0) > ASYMMETRY:
        raise ValueError(f"normals{name}: needed vectors of length 1")
    return found


def _side(arrays: dict[str, np.ndarray], i: int, grid: Grid) -> Condensed:
    size = (grid.size,)
    free = np.array(arrays.get(f"free{i}", np.ones(size)), dtype=bool)
    if free.shape != size:
        raise ValueError(f"free{i}: needed {grid.size} truth values")
    stiffness = real_array(f"S{i}", arrays[f"S{i}"], (grid.size, grid.size))
    check_unit(f"S{i}", stiffness)
    motions = arrays.get(f"motions{i}", NO_MOTIONS)
    if motions.size:
        motions = real_array(f"motions{i}", motions, (grid.size, None))
        scale = float(np.abs(stiffness).max())
        if motions[~free].any() or np.abs(motions.T @ motions - np.eye(motions.shape[1])).max() > ASYMMETRY:
            raise ValueError(f"motions{i}: needed orthonormal columns, 0 where free{i} is false")
        if np.abs(stiffness @ motions).max() > ASYMMETRY * scale:
            raise ValueError(f"motions{i}: needed a basis of the kernel of S{i}")
        check_matrix(f"S{i}", pinned(stiffness, np.flatnonzero(free), motions))
    else:
        check_matrix(f"S{i}", stiffness[np.ix_(free, free)])
    return Condensed(
        grid=grid,
        schur=stiffness,
        load=real_array(f"load{i}", arrays[f"load{i}"], size),
        known=real_array(f"known{i}", arrays.get(f"known{i}", np.zeros(size)), size),
        free=free,
        motions=motions if motions.size else NO_MOTIONS,
    )

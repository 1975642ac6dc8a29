"""Checks of arrays and of interface matrices (symmetric, positive semidefinite); what a file of arrays unpacks to."""

from __future__ import annotations

import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from numbers import Real
from typing import IO, Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from fem1d2d.mesh import Floats
from verification.machine.threads import one_thread
from verification.value import Value

#: Largest number of rows of a matrix, for a dense eigenvalue problem.
MOST_ROWS = 4000

#: Largest size of a number in an array: beyond, a product of a few overflows a double.
LARGEST = 1e60

#: Largest asymmetry of a matrix, relative to its largest entry, that counts as rounding.
ASYMMETRY = 1e-8

#: Eigenvalues below this part of the largest entry are those of rigid motions, up to rounding: a free body of 4025
#: nodes leaves 3e-15 after condensation, a cantilever 2000 times as long as thick has 2e-11.
MOTIONLESS = 1e-12

#: An eigenvalue above minus this is still rounding.
BELOW_ZERO = 1e-10

#: The errors of numpy, scipy and zipfile for a file without a matrix.
UNREADABLE = (
    ArithmeticError, AttributeError, EOFError, LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError,
    struct.error, tokenize.TokenError, SyntaxError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def size(matrix: np.ndarray) -> str:
    """Return the shape of an array in words."""
    if matrix.ndim == 1:
        return f"a vector of {len(matrix)}"
    return " x ".join(map(str, matrix.shape)) or "a single number"


def real_array(
    name: str,
    values: Any,
    shape: tuple[int | None, ...],
    needed: str = "",
    *,
    alone: bool = False,
    most: float = LARGEST,
) -> Floats:
    """Return the numbers that a user gave as a new array: whatever takes arrays from users reads them here.

    Parameters
    ----------
    name : str
        What errors call them.
    values : array, sparse array, or sequences of numbers
    shape : tuple of int or None
        The shape that is needed; None stands for any length > 0.
    needed : str
        What errors say is needed, where it is more than real numbers of that shape.
    alone : bool
        True if a single number may stand for all entries.
    most : float
        Largest size of an entry.

    Raises
    ------
    ValueError
        Another shape, texts, complex numbers or truth values; an entry that is masked, not finite or larger.
    """
    needed = f"needed {needed or ' x '.join('any' if n is None else str(n) for n in shape) + ' real numbers'}"
    if any(map(np.ma.is_masked, values if isinstance(values, (list, tuple)) else [values])):
        raise ValueError(f"{name} has masked entries: {needed}")
    try:
        received = np.asarray(values.toarray() if sp.issparse(values) else values)
    except ValueError:
        raise ValueError(f"{name} has rows of different lengths: {needed}") from None
    kind = received.dtype.kind
    if kind not in "fiuO" or (kind == "O" and not all(isinstance(entry, Real) for entry in received.flat)):
        raise ValueError(f"{name} has no real numbers (numpy type {received.dtype}): {needed}")
    if alone and not received.ndim:
        received = np.broadcast_to(received, [1 if n is None else n for n in shape])
    fits = (n == length or (length is None and n) for n, length in zip(received.shape, shape, strict=False))
    if received.ndim != len(shape) or not all(fits):
        raise ValueError(f"{name} is {size(received)}: {needed}")
    with np.errstate(over="ignore"):  # of extended precision
        try:
            array = np.array(received, dtype=float)
        except OverflowError:  # a whole number beyond the doubles
            array = np.full(received.shape, np.inf)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has entries that are not finite: {needed}")
    largest = max(float(array.max(initial=0.0)), -float(array.min(initial=0.0)))
    if largest > most:
        raise ValueError(f"{name} has an entry of size {largest:.2g}: needed at most {most:g}, in another unit")
    return array


def check_unit(name: str, matrix: Floats) -> None:
    """Raise ValueError for a matrix so small that products of a few of its entries vanish."""
    if 0 < (largest := float(np.abs(matrix).max(initial=0.0))) < 1 / LARGEST:
        raise ValueError(
            f"the largest entry of {name} is {largest:.2g}: needed at least {1 / LARGEST:g}, in another unit"
        )


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Stiffness(Value):
    """An interface stiffness matrix that was given, and some of its properties.

    Attributes
    ----------
    matrix : array, shape (n, n)
        Its symmetric part; all of it where asymmetry is allowed.
    asymmetry : float
        ``max |A - A'| / max |A|`` of the given matrix A.
    zeros : float
        The share of zeros among its entries off the diagonal; 0 where there are none.
    motions : array, shape (n, k)
        An orthonormal basis of its kernel: traces of the rigid motions that the supports leave.
    least : float
        The least eigenvalue.
    """

    matrix: Floats
    asymmetry: float
    zeros: float
    motions: Floats
    least: float

    @property
    def summary(self) -> str:
        return size(self.matrix)


def stiffness(name: str, matrix: Floats, *, asymmetry: float = ASYMMETRY, general: bool = False) -> Stiffness:
    """Check an interface stiffness matrix, which may be singular where rigid motions are left.

    ``asymmetry`` is the largest one that counts as rounding; a ``general`` matrix may have more, and is definite then.

    Raises
    ------
    ValueError
        Not square, too large, or not finite, symmetric and positive semidefinite; or 0.
    """
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not len(matrix):
        raise ValueError(f"{name} is {size(matrix)}: needed a square matrix")
    n = len(matrix)
    if n > MOST_ROWS:
        raise ValueError(f"{name} has {n} rows: needed at most {MOST_ROWS}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} has entries that are not finite: needed numbers")
    unit = float(np.abs(matrix).max())
    if not unit:
        raise ValueError(f"{name} is singular: all its entries are 0")
    scaled = matrix / unit  # entries of order 1, whatever the unit
    skew = float(np.abs(scaled - scaled.T).max())
    zeros = 1 - (np.count_nonzero(matrix) - np.count_nonzero(np.diag(matrix))) / (n * n - n) if n > 1 else 0.0
    if skew > asymmetry and general:
        with one_thread():
            least = float(np.linalg.eigvalsh((scaled + scaled.T) / 2)[0])
        if not least > MOTIONLESS:
            needed = "needed one whose symmetric part is positive definite"
            raise ValueError(f"{name} is not symmetric, and u'Su = {least * unit:.3g} u'u for some u: {needed}")
        found = {"asymmetry": skew, "zeros": zeros, "least": least * unit}
        return Stiffness(matrix=scaled * unit, motions=np.zeros((n, 0)), **found)
    if not skew <= asymmetry:
        needed = f"needed a Schur complement of a stiffness matrix, with at most {asymmetry:g}"
        raise ValueError(f"{name} is not symmetric (|A - A'| is {skew:.2g} of its largest entry): {needed}")
    scaled = (scaled + scaled.T) / 2
    with one_thread():
        least = float(np.linalg.eigvalsh(scaled)[0])
        motions = np.zeros((n, 0))
        if not least > max(n * np.finfo(float).eps, MOTIONLESS):
            if least < -BELOW_ZERO:
                raise ValueError(
                    f"{name} is indefinite (least eigenvalue {least * unit:.3g}): needed a positive definite matrix"
                )
            values, vectors = np.linalg.eigh(scaled)
            motions = vectors[:, values <= max(n * np.finfo(float).eps, MOTIONLESS, -least)]
    return Stiffness(matrix=scaled * unit, asymmetry=skew, zeros=zeros, motions=motions, least=least * unit)


def check_matrix(name: str, matrix: Floats) -> None:
    """Raise ValueError unless it is the interface stiffness matrix of a body that its supports hold."""
    found = stiffness(name, matrix)
    if found.motions.shape[1]:
        raise ValueError(
            f"{name} is singular: the body has too little support (least eigenvalue {found.least:.3g}): needed a"
            " positive definite matrix"
        )


def check_nodes(x: Floats, weights: Floats) -> None:
    """Raise ValueError unless x increases and the weights are positive."""
    if not np.all(np.diff(x) > 0):
        raise ValueError("x: needed positions that increase")
    if not np.all(weights > 0):
        raise ValueError("weights: needed positive ones")


@dataclass(frozen=True, kw_only=True)
class Header:
    """The header of one array: its name, empty in a file of one array, the number of entries and the bytes of one."""

    name: str
    entries: int
    entry_bytes: int


def headers(file: BinaryIO) -> Iterator[Header]:
    """Yield the headers of all arrays in a file ``.npy`` or ``.npz``; raise one of UNREADABLE for any other file.

    No array is read: a small file may unpack to more than the memory holds.
    """
    if not zipfile.is_zipfile(file):
        file.seek(0)
        yield _header("", file)
        return
    with zipfile.ZipFile(file) as archive:
        for name in archive.namelist():
            with archive.open(name) as member:
                yield _header(name.removesuffix(".npy"), member)


def _header(name: str, stream: IO[bytes]) -> Header:
    version = np.lib.format.read_magic(stream)
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
    shape, _, dtype = read(stream)
    return Header(name=name, entries=math.prod(shape), entry_bytes=dtype.itemsize)

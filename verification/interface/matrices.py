"""Checks of arrays: finite and of one shape; of interface matrices: symmetric, positive (semi)definite too."""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.threads import one_thread
from verification.value import Value

#: Matrices of more rows than this do not fit a dense eigenvalue problem.
MOST_ROWS = 4000

#: Largest asymmetry of a matrix, relative to its largest entry, that counts as rounding.
ASYMMETRY = 1e-8

#: Eigenvalues below this part of the largest entry are those of rigid motions, up to rounding: a free body of 4025
#: nodes leaves 3e-15 after condensation, a cantilever 2000 times as long as thick has 2e-11.
MOTIONLESS = 1e-12

#: An eigenvalue as far below 0 is rounding still.
BELOW_ZERO = 1e-10

#: What numpy, scipy and zipfile raise on a file that is no matrix.
UNREADABLE = (
    ArithmeticError, AttributeError, EOFError, LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError,
    struct.error, tokenize.TokenError, SyntaxError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def size(matrix: np.ndarray) -> str:
    """The shape of an array in words."""
    return " x ".join(map(str, matrix.shape)) or "a single number"


def real_array(name: str, values: Any, shape: tuple[int, ...]) -> Floats:
    """Finite real numbers of a shape.

    Raises
    ------
    ValueError
        Another shape, texts or complex numbers, or what is not finite.
    """
    received, needed = np.asarray(values), " x ".join(map(str, shape))
    if received.dtype.kind not in "fiubO":
        raise ValueError(f"{name} has no real numbers (numpy type {received.dtype}): needed {needed} of them")
    if received.shape != shape:
        raise ValueError(f"{name} is {size(received)}: needed {needed} real numbers")
    array = np.array(received, dtype=float)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has entries that are not finite: needed numbers")
    return array


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Stiffness(Value):
    """An interface stiffness matrix that was given, and what was seen of it.

    Attributes
    ----------
    matrix : array, shape (n, n)
        Its symmetric part.
    asymmetry : float
        ``max |A - A'| / max |A|`` of what was given.
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


def stiffness(name: str, matrix: Floats, *, asymmetry: float = ASYMMETRY) -> Stiffness:
    """Take a matrix as interface stiffness matrix, singular where rigid motions are left.

    Parameters
    ----------
    asymmetry : float
        The largest asymmetry allowed.

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
    return Stiffness(
        matrix=scaled * unit,
        asymmetry=skew,
        zeros=1 - (np.count_nonzero(matrix) - np.count_nonzero(np.diag(matrix))) / (n * n - n) if n > 1 else 0.0,
        motions=motions,
        least=least * unit,
    )


def check_matrix(name: str, matrix: Floats) -> None:
    """Refuse what is no interface stiffness matrix of a body that its supports hold.

    Raises
    ------
    ValueError
        As :func:`stiffness`, and singular.
    """
    found = stiffness(name, matrix)
    if found.motions.shape[1]:
        raise ValueError(
            f"{name} is singular: the body has too little support (least eigenvalue {found.least:.3g}): needed a"
            " positive definite matrix"
        )


def check_nodes(x: Floats, weights: Floats) -> None:
    """Refuse what are no contact nodes from left to right, or no quadrature on them.

    Raises
    ------
    ValueError
    """
    if not np.all(np.diff(x) > 0):
        raise ValueError("x: needed positions that increase")
    if not np.all(weights > 0):
        raise ValueError("weights: needed positive ones")

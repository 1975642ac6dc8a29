"""Checks of arrays: finite and of one shape; of interface matrices: symmetric, positive definite too."""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.threads import one_thread

#: Matrices of more rows than this do not fit a dense eigenvalue problem.
MOST_ROWS = 4000

#: Largest asymmetry of a matrix, relative to its largest entry.
ASYMMETRY = 1e-8

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


def check_matrix(name: str, matrix: Floats) -> None:
    """Refuse what is no interface stiffness matrix.

    Raises
    ------
    ValueError
        Not square, too large, or not finite, symmetric and positive definite.
    """
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not len(matrix):
        raise ValueError(f"{name} is {size(matrix)}: needed a square matrix")
    if len(matrix) > MOST_ROWS:
        raise ValueError(f"{name} has {len(matrix)} rows: needed at most {MOST_ROWS}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} has entries that are not finite: needed numbers")
    unit = float(np.abs(matrix).max()) or 1.0
    scaled = matrix / unit  # entries of order 1, whatever the unit
    if not float(np.abs(scaled - scaled.T).max()) <= ASYMMETRY:
        raise ValueError(f"{name} is not symmetric: needed a Schur complement of a stiffness matrix")
    with one_thread():
        eigenvalues = np.linalg.eigvalsh((scaled + scaled.T) / 2)
    least = float(eigenvalues[0])
    if not least > len(matrix) * np.finfo(float).eps:
        kind = "singular: the body has too little support" if least >= -1e-10 else "indefinite"
        raise ValueError(f"{name} is {kind} (least eigenvalue {least * unit:.3g}): needed a positive definite matrix")


def check_nodes(x: Floats, weights: Floats, gap: Floats) -> None:
    """Refuse what are no contact nodes from left to right, no quadrature on them, or no initial distance.

    Raises
    ------
    ValueError
    """
    if not np.all(np.diff(x) > 0):
        raise ValueError("x: needed positions that increase")
    if not np.all(weights > 0):
        raise ValueError("weights: needed positive ones")
    if not np.all(gap >= 0):
        raise ValueError("gap: needed numbers >= 0")

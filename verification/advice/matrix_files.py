"""Reading an interface stiffness matrix from a file of numpy or scipy, which may be damaged or too large."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
import scipy.sparse as sp

from fem1d2d.mesh import Floats
from verification.interface.array_headers import headers
from verification.interface.matrices import MOST_ROWS, UNREADABLE
from verification.problem.tables import ProblemError, unreadable

#: Largest size of a matrix file: a full matrix of MOST_ROWS rows, with the two indices of each entry.
MOST_BYTES = 24 * MOST_ROWS**2


def read_matrix(path: Path) -> Floats:
    """A matrix from ``.npz`` (scipy.sparse.save_npz, or numpy.savez of one array) or ``.npy``.

    Shapes are read first: a small file may unpack to more than the memory holds.

    Raises
    ------
    ProblemError
    """
    refuse = lambda needed: ProblemError(str(path), "", None, needed)
    why = unreadable(path, MOST_BYTES)
    if why:
        raise refuse(why if "folder" not in why else "a matrix file (.npz or .npy) is needed, this is a folder")
    try:
        with warnings.catch_warnings(), path.open("rb") as file:
            warnings.simplefilter("ignore")  # of numbers that do not fit their type: what comes out is checked
            most = max(_rows(file), default=0)
            if most > MOST_ROWS:
                raise refuse(f"needed at most {MOST_ROWS} rows, received {most}")
            file.seek(0)
            data = np.load(file, allow_pickle=False)
            if isinstance(data, np.ndarray):
                return _real(data)
            if "format" in data.files and "shape" in data.files:
                rows = int(np.max(data["shape"]))
                if rows > MOST_ROWS:
                    raise refuse(f"needed at most {MOST_ROWS} rows, received {rows}")
                file.seek(0)
                sparse = sp.load_npz(file)
                if hasattr(sparse, "check_format"):
                    sparse.check_format(full_check=True)  # else indices that point outside are followed
                return _real(sparse.toarray())
            if len(data.files) != 1:
                raise refuse(f"needed one array, received {', '.join(data.files) or 'none'}")
            return _real(data[data.files[0]])
    except UNREADABLE as error:
        if isinstance(error, ProblemError):
            raise
        why = f": {error}" if "needed real numbers" in str(error) else ""
        raise refuse(f"not a matrix that numpy or scipy saved{why}") from None


def _rows(file: BinaryIO) -> Iterator[int]:
    """For each array of a file how many rows a square matrix of as many entries has, from its header alone."""
    for header in headers(file):
        if header.entry_bytes > np.dtype(np.clongdouble).itemsize:
            raise ValueError("needed real numbers")
        yield math.isqrt(header.entries)


def _real(matrix: np.ndarray) -> Floats:
    if matrix.dtype.kind not in "fiu":
        raise ValueError("needed real numbers" + (", received complex ones" if matrix.dtype.kind == "c" else ""))
    return np.asarray(matrix, dtype=float)

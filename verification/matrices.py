"""Interface stiffness matrices from files, and what is no such matrix."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fem1d2d.mesh import Floats
from verification.reader import ProblemError
from verification.threads import one_thread

#: Matrices of more rows than this do not fit a dense eigenvalue problem.
MOST_ROWS = 4000

#: Largest asymmetry of a matrix, relative to its largest entry.
ASYMMETRY = 1e-8


def read_matrix(path: Path) -> Floats:
    """A matrix from ``.npz`` (scipy.sparse.save_npz, or numpy.savez of one array) or ``.npy``.

    Raises
    ------
    ProblemError
    """
    refuse = lambda needed: ProblemError(str(path), "", None, needed)
    if path.is_dir() or not path.exists():
        raise refuse("a matrix file (.npz or .npy) is needed, this is a folder" if path.is_dir() else "no such file")
    try:
        with path.open("rb") as file:
            data = np.load(file, allow_pickle=False)
            if isinstance(data, np.ndarray):
                return _real(data)
            if "format" in data.files and "shape" in data.files:
                sparse = sp.load_npz(path)
                if max(sparse.shape) > MOST_ROWS:
                    raise refuse(f"needed at most {MOST_ROWS} rows, received {sparse.shape[0]}")
                if hasattr(sparse, "check_format"):
                    sparse.check_format(full_check=True)  # else indices that point outside are followed
                return _real(sparse.toarray())
            if len(data.files) != 1:
                raise refuse(f"needed one array, received {', '.join(data.files) or 'none'}")
            return _real(data[data.files[0]])
    except (OSError, ValueError, TypeError, EOFError, KeyError, MemoryError, zipfile.BadZipFile) as error:
        if isinstance(error, ProblemError):
            raise
        why = f": {error}" if "needed real numbers" in str(error) else ""
        raise refuse(f"not a matrix that numpy or scipy saved{why}") from None


def _real(matrix: np.ndarray) -> Floats:
    if matrix.dtype.kind not in "fiu":
        raise ValueError("needed real numbers" + (", received complex ones" if matrix.dtype.kind == "c" else ""))
    return np.asarray(matrix, dtype=float)


def size(matrix: Floats) -> str:
    return " x ".join(str(n) for n in matrix.shape) or "a single number"


def check_matrix(name: str, matrix: Floats) -> None:
    """Refuse what is no interface stiffness matrix.

    Raises
    ------
    ValueError
    """
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not len(matrix):
        raise ValueError(f"{name} is {size(matrix)}: needed a square matrix")
    if len(matrix) > MOST_ROWS:
        raise ValueError(f"{name} has {len(matrix)} rows: needed at most {MOST_ROWS}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} has entries that are not finite: needed numbers")
    largest_entry = float(np.abs(matrix).max())
    if not float(np.abs(matrix - matrix.T).max()) <= ASYMMETRY * largest_entry:
        raise ValueError(f"{name} is not symmetric: needed a Schur complement of a stiffness matrix")
    with one_thread():
        eigenvalues = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    least = float(eigenvalues[0])
    if not least > len(matrix) * np.finfo(float).eps * largest_entry:
        kind = "singular: the body has too little support" if least >= -1e-10 * largest_entry else "indefinite"
        raise ValueError(f"{name} is {kind} (least eigenvalue {least:.3g}): needed a positive definite matrix")

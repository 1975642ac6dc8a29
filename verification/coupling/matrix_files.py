"""Reading interface matrices and vectors from files of many kinds, which may be damaged or too large."""

from __future__ import annotations

import math
import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
import scipy.io
import scipy.sparse as sp
from scipy.io.matlab import MatReadError

from fem1d2d.mesh import Floats
from verification.interface.matrices import MOST_ROWS, UNREADABLE, headers, real_array
from verification.problem.tables import ProblemError, short, unreadable

#: Largest size of a matrix file: a full matrix of MOST_ROWS rows, with the two indices of each entry.
MOST_BYTES = 24 * MOST_ROWS**2

#: The same of a text: numbers of 17 digits take so many characters.
MOST_CHARACTERS = 32 * MOST_ROWS**2

#: Errors of the readers on a file that is not a matrix.
DAMAGED = (*UNREADABLE, MatReadError)

#: The first bytes of an HDF5 file, which MATLAB writes as version 7.3 behind a header of 512 bytes.
HDF5 = b"\x89HDF\r\n\x1a\n"

#: The endings of files that can be read.
KNOWN = ".npy, .npz, .mtx, .mat, .csv or .txt"


class _Refusal(Exception):
    """Why a file is refused, in words of our own."""


def read_matrix(path: Path, name: str = "") -> Floats:
    """Read a matrix or a vector from a file, by its ending.

    ``.npy``; ``.npz`` (scipy.sparse.save_npz, or numpy.savez); ``.mtx`` (Matrix Market); ``.mat`` (MATLAB, not 7.3);
    ``.csv`` and ``.txt`` (rows of numbers, separated by commas, semicolons or blanks).  Shapes are read first: a small
    file may unpack to more than the memory holds.  Of several arrays it is the one called ``name``, also beside a
    sparse matrix, as in P.npz of a run.  ProblemError for a file that is none.
    """
    refuse = lambda needed: ProblemError(str(path), "", None, needed)
    read, written = _READERS.get(path.suffix.lower(), (None, ""))
    why = unreadable(path, MOST_CHARACTERS if read is _text else MOST_BYTES)
    if why:
        raise refuse(why if "folder" not in why else f"a matrix file ({KNOWN}) is needed, this is a folder")
    if read is None:
        raise refuse(f"a matrix file is needed: {KNOWN}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that do not fit their type: what comes out is checked
            return _real(read(path, name), name)
    except _Refusal as error:
        raise refuse(str(error)) from None
    except DAMAGED:
        raise refuse(f"not {written}") from None


def read_vector(path: Path, name: str = "") -> Floats:
    """The same, where one row or one column is a vector."""
    array = read_matrix(path, name)
    return array.ravel() if array.size == max(array.shape, default=0) else array


def names_in(path: Path) -> tuple[str, ...]:
    """The names of the arrays in a file ``.npz`` or ``.mat``; none where it is neither, or damaged."""
    try:
        if unreadable(path, MOST_BYTES):
            return ()
        if path.suffix.lower() == ".npz":
            with path.open("rb") as file:
                return tuple(header.name for header in headers(file))
        if path.suffix.lower() == ".mat":
            return tuple(name for name, *_ in scipy.io.whosmat(path))
    except DAMAGED:
        pass
    return ()


def _within(rows: int) -> None:
    if rows > MOST_ROWS:
        raise _Refusal(f"needed at most {MOST_ROWS} rows, received {rows}")


def _real(matrix: np.ndarray, name: str) -> Floats:
    try:
        return real_array(name or "the array", matrix, matrix.shape, "real numbers", most=math.inf)
    except ValueError as error:
        raise _Refusal(str(error)) from None


def _chosen(names: list[str], name: str) -> str:
    """The name of the array to read among several."""
    if name in names:
        return name
    if len(names) != 1:
        wanted = f"one array, or one named {name}" if name else "one array"
        raise _Refusal(f"needed {wanted}, received {short(', '.join(names), 200) or 'none'}")
    return names[0]


def _numpy(path: Path, name: str) -> np.ndarray:
    with path.open("rb") as file:
        _within(max(_rows(file), default=0))
        file.seek(0)
        data = np.load(file, allow_pickle=False)
        if isinstance(data, np.ndarray):
            return data
        if name not in data.files and {"format", "shape"} <= set(data.files):
            _within(int(np.max(data["shape"])))
            file.seek(0)
            return _dense(sp.load_npz(file))
        return np.asarray(data[_chosen(data.files, name)])


def _dense(sparse: sp.sparray) -> np.ndarray:
    if hasattr(sparse, "check_format"):
        sparse.check_format(full_check=True)  # else indices that point outside are followed
    return np.asarray(sparse.toarray())


def _rows(file: BinaryIO) -> Iterator[int]:
    """For each array of a file the rows of a square matrix with as many entries, read only from its header."""
    for header in headers(file):
        if header.entry_bytes > np.dtype(np.clongdouble).itemsize and header.entries > MOST_ROWS:
            raise ValueError("needed real numbers")
        yield math.isqrt(header.entries)


def _market(path: Path, name: str) -> np.ndarray:
    rows, columns, entries, _, field, _ = scipy.io.mminfo(path)
    if field not in ("real", "double", "integer", "unsigned-integer"):
        raise _Refusal(f"a Matrix Market file of {field} entries: needed real ones")
    _within(max(rows, columns, math.isqrt(entries)))
    found = scipy.io.mmread(path, spmatrix=False)
    return _dense(found) if sp.issparse(found) else np.asarray(found)


def _matlab(path: Path, name: str) -> np.ndarray:
    with path.open("rb") as file:
        head = file.read(520)
        if head.startswith(HDF5) or head[512:] == HDF5:
            raise _Refusal(
                "a MATLAB file of version 7.3 (HDF5), which is not read here: needed one of version 7,"
                " save('S.mat', 'S1', 'S2', '-v7')"
            )
        if len(head) < 20:
            raise ValueError("no MATLAB file")
        file.seek(0)
        if _unpacked(file) > MOST_BYTES:
            raise _Refusal(f"needed a file that unpacks to at most {MOST_BYTES} bytes")
    shapes = {entry[0]: entry[1] for entry in scipy.io.whosmat(path)}
    chosen = _chosen(list(shapes), name)
    _within(max(shapes[chosen], default=0))
    found = scipy.io.loadmat(path, variable_names=[chosen], spmatrix=False)[chosen]
    return _dense(sp.csc_array(found)) if sp.issparse(found) else np.asarray(found)


def _unpacked(file: BinaryIO) -> int:
    """The bytes to which the compressed elements of a MATLAB file unpack; no more than MOST_BYTES and a block."""
    head = file.read(128)
    order = {b"IM": "<", b"MI": ">"}.get(head[126:128])
    if order is None:  # version 4, which is not compressed
        return 0
    total = 0
    while total <= MOST_BYTES and len(tag := file.read(8)) == 8:
        kind, length = (int(n) for n in np.frombuffer(tag, dtype=f"{order}u4"))
        if kind != 15:  # not compressed
            file.seek(length, 1)
            total += length
            continue
        data, rest = zlib.decompressobj(), file.read(length)
        while rest and total <= MOST_BYTES:
            total += len(data.decompress(rest, 2**20))
            rest = data.unconsumed_tail
    return total


def _text(path: Path, name: str) -> np.ndarray:
    """Rows of numbers; what begins with # or % is a comment."""
    rows: list[Floats] = []
    separator: str | None = None
    with path.open(encoding="utf-8-sig") as file:
        for number, line in enumerate(file, 1):
            line = line.strip()
            if not line or line[0] in "#%":
                continue
            if not rows:
                separator = next((sign for sign in ";," if sign in line), None)
            cells = [cell.strip() for cell in line.split(separator)]
            if separator is not None and not cells[-1]:
                cells.pop()  # a separator at the end of each line
            _within(max(len(cells), len(rows) + 1))
            rows.append(_numbers(cells, number, first=not rows))
            if len(rows[-1]) != len(rows[0]):
                raise _Refusal(f"line {number} has {len(rows[-1])} numbers: needed {len(rows[0])}, as in the first row")
    if not rows:
        raise _Refusal("needed rows of numbers, received none")
    return np.array(rows)


def _numbers(cells: list[str], line: int, *, first: bool) -> Floats:
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        bad = next(cell for cell in cells if not _is_number(cell))
    shown = f"line {line} has {short(bad, 30)!r}"
    if "," in bad and _is_number(bad.replace(",", ".")):
        raise _Refusal(f"{shown}, a decimal comma: needed a decimal point")
    if first and not any(map(_is_number, cells)):
        raise _Refusal(f"{shown}, so that it looks like a header: needed only numbers, delete it")
    raise _Refusal(f"{shown}: needed a number")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


#: Readers by the ending of a file, and what such a file holds.
_READERS: dict[str, tuple[Callable[[Path, str], np.ndarray], str]] = {
    ".npy": (_numpy, "a matrix that numpy or scipy saved"),
    ".npz": (_numpy, "a matrix that numpy or scipy saved"),
    ".mtx": (_market, "a matrix that a Matrix Market writer saved"),
    ".mat": (_matlab, "a matrix that MATLAB or scipy saved"),
    ".csv": (_text, "rows of numbers in plain text"),
    ".txt": (_text, "rows of numbers in plain text"),
}

"""What a file of arrays unpacks to, told by the headers alone: a small file may hold more than the memory does."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, BinaryIO

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Header:
    """The header of one array.

    Attributes
    ----------
    name : str
        Of the array in its file; empty where the file is one array.
    entries : int
        How many numbers, truth values or texts the array has.
    entry_bytes : int
        What one of them takes in memory.
    """

    name: str
    entries: int
    entry_bytes: int

    @property
    def bytes(self) -> int:
        """What the array takes in memory."""
        return self.entries * self.entry_bytes


def headers(file: BinaryIO) -> Iterator[Header]:
    """The headers of all arrays in a file ``.npy`` or ``.npz``; no array is read.

    Raises
    ------
    UNREADABLE
        Not such a file.
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

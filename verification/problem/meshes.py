"""Mesh files by path and content."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from verification.problem.tables import Unfit, text, unreadable

#: Largest size of a mesh file: several times the size of the largest mesh as text.
MOST_BYTES = 200_000_000


@dataclass(frozen=True, kw_only=True)
class MeshFile:
    """A mesh file as it was when the problem was read.

    Attributes
    ----------
    path : Path
        Absolute, so that it means the same file wherever the process or the problem goes.
    sha256 : str
        Of the content, in hexadecimal digits.
    """

    path: Path
    sha256: str

    @classmethod
    def read(cls, path: Path, sha256: str | None = None) -> MeshFile:
        """Return the file at a path.

        Raises
        ------
        Unfit
            Not a file, too large, or with another SHA-256 than the one given.
        """
        file = cls(path=path.absolute(), sha256=sha256 or _fingerprint(path))
        why = file.unusable() if sha256 else None
        if why:
            raise Unfit(why)
        return file

    def unusable(self) -> str | None:
        """Return why the file is not the one that was read, or None where it is."""
        try:
            found = _fingerprint(self.path)
        except Unfit as error:
            return str(error)
        if found == self.sha256:
            return None
        return f"its content has changed: needed the file with sha256 {self.sha256}, this one has {found}"


def sha256_text(value: object) -> str:
    """Read a SHA-256 in hexadecimal digits."""
    given = text(value)
    if not re.fullmatch("[0-9a-f]{64}", given):
        raise Unfit("needed the SHA-256 of the mesh file, 64 hexadecimal digits")
    return given


def _fingerprint(path: Path) -> str:
    why = unreadable(path, MOST_BYTES)
    if why:
        raise Unfit(why)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise Unfit(f"cannot be read: {error.strerror}") from None

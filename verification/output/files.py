"""Writing files: only over files of this program, all of one result or none."""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, Literal

from verification.document import Document
from verification.machine.interrupts import cleaned_up, undisturbed
from verification.problem.tables import ProblemError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

Kind = Literal["run", "solve", "march", "compare", "verify", "reproduce"]


def _drawn(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}.{ending}" for name in names for ending in ("svg", "png"))


#: Values at the points that a problem names, and along the named sides.
_VALUES = ("points.csv", "sides.csv")

#: Gamma_c, matrices and fields of a result; the fields of an increment are ``body1-0001.vtu``, .. in ``body1.pvd``.
_RESULT = ("contact.csv", *_VALUES, "P.npz", "body1.vtu", "body2.vtu", *_drawn("bodies"))
_SERIES = ("body1.pvd", "body2.pvd")
_IN_SERIES = "body[12]-[0-9][0-9][0-9][0-9].vtu"

#: The same with what only a run has.
_RUN = (*_RESULT, "history.csv", "interface.npz", *_drawn("residuals"))

#: The files that each command writes, beside the problem.
FILES: dict[Kind, tuple[str, ...]] = {
    "run": ("run.json", *_RUN),
    "solve": ("solve.json", *_RESULT),
    "march": (
        *("history.json", "contact.csv", "history.csv", *_VALUES, *_SERIES),
        *_drawn("loop", "states", "shear", "points"),
    ),
    "compare": ("compare.json", *_RUN, *_drawn("ruler", "waterfall", "factor"), "report.html"),
    "reproduce": ("reproduce.json", *_drawn("reproduce"), *(f"fig{number}.csv" for number in (5, 10, 11, 12))),
    "verify": ("ledger.json", "ledger.md", "errata.md", "verdicts.json"),
}

#: Marks by which files of this program are recognised.
MARKS = {
    ".json": b'"schema": "ndtheory.',
    ".svg": b"<dc:title>ndtheory</dc:title>",
    ".png": b"Software\x00ndtheory",
    ".vtu": b"<!-- ndtheory ",
    ".pvd": b"<!-- ndtheory ",
    ".html": b'name="generator" content="ndtheory ',
    ".md": b"<!-- ndtheory verify -->",
    ".csv": b"# ndtheory ",
    ".nc": b"ndtheory sweep, version ",
    ".npz": b"ndtheory.npy",
    ".toml": b"# ndtheory: the problem as it was computed",
}

#: No file of this program is larger, so that reading a file to look for its mark ends.
MOST_BYTES = 500_000_000

#: Files are written into a folder of such a name before they take their places.
ROOM = ".ndtheory-writing-"


def files_of(kind: Kind, folder: Path) -> tuple[str, ...]:
    """Return the names of the files that a command writes, of a series those that are in the folder."""
    series = sorted(path.name for path in folder.glob(_IN_SERIES)) if kind == "march" else ()
    return (*FILES[kind], *series)


def ours(target: Path) -> bool:
    """Return True for a file that this program has written, and where there is none."""
    try:
        there = target.stat()
        readable = stat.S_ISREG(there.st_mode) and there.st_size <= MOST_BYTES
        return readable and MARKS[target.suffix] in target.read_bytes()
    except FileNotFoundError:
        return True


def check_ours(target: Path, option: str = "-o") -> None:
    """Raise ProblemError where writing would replace a folder, or a file that this program has not written."""
    check_place(target, option)
    if not ours(target):
        needed = f"not written by this program; needed another folder or name ({option})"
        raise ProblemError(str(target), "", None, needed)


def check_folder(room: Path, option: str = "") -> None:
    """Make a folder; ProblemError, with the option that named it, if it cannot be written to."""
    try:
        room.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=room).close()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ProblemError(str(room), "", None, f"needed a folder to write to{option}: {why}") from None


def check_place(target: Path, option: str = "-o") -> None:
    """Raise ProblemError for the name of a folder."""
    if target.is_dir():
        raise ProblemError(str(target), "", None, f"this is a folder: needed another folder or name ({option})")


@contextlib.contextmanager
def staged(folder: Path, stale: Collection[str] = (), *, shown: Path | None = None) -> Iterator[Path]:
    """A folder to write into, whose files move into ``folder`` together at the end; after an error none does.

    Old files, and those named in ``stale``, are removed before any new one comes: a process that is killed in between
    leaves files of one run, some of which are missing, never files of two.  Ctrl-C keeps the documents if there is
    nothing to replace.  A ProblemError names ``shown``, by default the folder.
    """
    try:
        with cleaned_up(), tempfile.TemporaryDirectory(prefix=ROOM, dir=folder) as name:
            room = Path(name)
            try:
                yield room
            except KeyboardInterrupt:
                if not any((folder / name).exists() for name in stale):
                    _place(room, folder, "*.json")
                raise
            _place(room, folder, "*", stale)
    except OSError as error:
        raise ProblemError(str(shown or folder), "", None, f"cannot be written: {error.strerror}") from None


def _place(room: Path, folder: Path, pattern: str, stale: Collection[str] = ()) -> None:
    """Move files where they belong; one process at a time does so, where the system has locks."""
    names = sorted(path.name for path in room.glob(pattern))
    with contextlib.ExitStack() as stack, undisturbed():
        if fcntl is not None:
            number = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, number)  # which ends the lock
            with contextlib.suppress(OSError):  # some file systems have none
                fcntl.flock(number, fcntl.LOCK_EX)
        for name in {*stale, *names}:
            (folder / name).unlink(missing_ok=True)
        for name in names:
            (room / name).replace(folder / name)


def write_into(target: Path, write: Callable[[Path], object]) -> None:
    """Write one file, whole or not at all."""
    with staged(target.parent, shown=target) as room:
        write(room / target.name)


def as_json(found: Document, path: Path) -> None:
    """Write a result as its document."""
    path.write_text(found.to_json(), encoding="utf-8")


def writing(target: Path | None, write: Callable[[Any, Path], object] = as_json) -> Callable[[Any], None] | None:
    """A function that writes a result into a file, as its document or by another way; None if no name was given."""
    return None if target is None else lambda found: write_into(target, lambda path: write(found, path))

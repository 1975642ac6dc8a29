"""Writing files: only over files of this program, all of one result or none."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Literal

from verification.document import Document
from verification.machine.interrupts import cleaned_up, undisturbed
from verification.problem.tables import ProblemError, unreadable

try:
    import fcntl

    LOCKS = True
except ImportError:  # Windows: what a killed process leaves stays there
    LOCKS = False

Kind = Literal["run", "solve", "march", "compare", "verify", "reproduce"]

_PICTURES = ("bodies.svg", "bodies.png", "residuals.svg", "residuals.png")

_LOSSES = ("waterfall.svg", "waterfall.png")

_TABLES = ("contact.csv", "history.csv")

#: The rows behind each figure of Section 6.
_ROWS = ("fig5.csv", "fig10.csv", "fig11.csv", "fig12.csv")

_FIELDS = ("body1.vtu", "body2.vtu")

_MATRICES = ("interface.npz", "P.npz")

#: The views of a history, and the fields of its increments: of each body ``body1-0001.vtu``, .. in ``body1.pvd``.
_VIEWS = tuple(f"{view}.{ending}" for view in ("loop", "states", "shear") for ending in ("svg", "png"))
_SERIES = ("body1.pvd", "body2.pvd")
_IN_SERIES = "body[12]-[0-9][0-9][0-9][0-9].vtu"

#: The files that each command writes, beside the problem.
FILES: dict[Kind, tuple[str, ...]] = {
    "run": ("run.json", *_TABLES, *_MATRICES, *_FIELDS, *_PICTURES),
    "solve": ("solve.json", *_TABLES[:1], *_MATRICES[1:], *_FIELDS, *_PICTURES[:2]),
    "march": ("history.json", *_TABLES, *_SERIES, *_VIEWS),
    "compare": ("compare.json", *_TABLES, *_MATRICES, *_FIELDS, *_PICTURES, *_LOSSES, "report.html"),
    "reproduce": ("reproduce.json", "reproduce.svg", "reproduce.png", *_ROWS),
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


def files_of(kind: Kind, folder: Path) -> tuple[str, ...]:
    """Return the names of the files that a command writes, of a series those that are in the folder."""
    series = sorted(path.name for path in folder.glob(_IN_SERIES)) if kind == "march" else ()
    return (*FILES[kind], *series)


def check_ours(target: Path, option: str = "-o") -> None:
    """Raise ProblemError where writing would replace a file that this program has not written."""
    check_place(target, option)
    if _foreign(target) and _foreign(target):  # another process may just have replaced its own file
        raise ProblemError(
            str(target), "", None, f"not written by this program; needed another folder or name ({option})"
        )


def _foreign(target: Path) -> bool:
    """Return True for a file that this program has not written, False where there is none."""
    try:
        marked = not unreadable(target, MOST_BYTES) and MARKS[target.suffix] in target.read_bytes()
    except FileNotFoundError:
        return False
    return not marked and target.exists()


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


#: Files are written into a folder of such a name before they take their places.
ROOM = ".ndtheory-writing-"


@contextlib.contextmanager
def staged(folder: Path, stale: Collection[str] = (), *, shown: Path | None = None) -> Iterator[Path]:
    """A folder to write into, whose files move into ``folder`` together at the end; after an error none does.

    Old files, and those named in ``stale``, are removed before any new one comes: a process that is killed in between
    leaves files of one run, some of which are missing, never files of two.  Ctrl-C keeps the documents if there is
    nothing to replace.  A ProblemError names ``shown``, by default the folder.
    """
    try:
        with cleaned_up(), contextlib.ExitStack() as stack:
            with _held(folder):
                _sweep(folder)
                room = Path(tempfile.mkdtemp(prefix=ROOM, dir=folder))
                stack.callback(_remove, room)
                stack.enter_context(_held(room))
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
    """Move files where they belong."""
    names = sorted(path.name for path in room.glob(pattern))
    with _held(folder), undisturbed():
        for name in {*stale, *names}:
            (folder / name).unlink(missing_ok=True)
        for name in names:
            (room / name).replace(folder / name)


@contextlib.contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Lock a folder for this process; the system ends the lock with the process."""
    if not LOCKS:
        yield
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # some file systems have no locks
            fcntl.flock(number, fcntl.LOCK_EX)
        yield
    finally:
        os.close(number)


def _sweep(folder: Path) -> None:
    """Remove what a killed process left: folders of ours that nobody holds, with nothing else in them."""
    if not LOCKS:
        return
    for room in folder.glob(ROOM + "*"):
        with contextlib.suppress(OSError):  # held, or no folder
            number = os.open(room, os.O_RDONLY | os.O_DIRECTORY)
            try:
                fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if all(path.is_file() and path.suffix in MARKS for path in room.iterdir()):
                    _remove(room)
            finally:
                os.close(number)


def _remove(room: Path) -> None:
    """Remove a folder with the files in it."""
    with contextlib.suppress(OSError):
        for path in room.iterdir():
            path.unlink()
        room.rmdir()


def writing(target: Path | None) -> Callable[[Document], None] | None:
    """A function that writes a document into a file; None if no name was given."""
    if target is None:
        return None

    def write(found: Document) -> None:
        with staged(target.parent, shown=target) as room:
            (room / target.name).write_text(found.to_json(), encoding="utf-8")

    return write

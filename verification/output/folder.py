"""Writing results into a folder: only our own files, all of one run or none."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ndtheory import __version__
from verification.interrupts import undisturbed
from verification.problem.tables import ProblemError, unreadable
from verification.spreadsheet import as_csv

try:
    import fcntl

    LOCKS = True
except ImportError:  # Windows: what a killed process leaves stays there
    LOCKS = False

if TYPE_CHECKING:
    from verification.algorithm.runs import Run
    from verification.comparison import Comparison
    from verification.ledger import Ledger
    from verification.monolithic import Solution
    from verification.reproduce import Reproduction

Kind = Literal["run", "solve", "compare", "verify", "reproduce"]

_PICTURES = ("bodies.svg", "bodies.png", "residuals.svg", "residuals.png")

_TABLES = ("contact.csv", "history.csv")

#: The rows behind each figure of Section 6.
_ROWS = ("fig5.csv", "fig10.csv", "fig11.csv", "fig12.csv")

_MATRICES = ("interface.npz", "P.npz")

#: What each command writes, beside the problem.
FILES: dict[Kind, tuple[str, ...]] = {
    "run": ("run.json", *_TABLES, *_MATRICES, *_PICTURES),
    "solve": ("solve.json", *_TABLES[:1], *_MATRICES[1:], *_PICTURES[:2]),
    "compare": ("compare.json", *_TABLES, *_MATRICES, *_PICTURES, "waterfall.svg", "waterfall.png", "report.html"),
    "reproduce": ("reproduce.json", "reproduce.svg", "reproduce.png", *_ROWS),
    "verify": ("ledger.json", "ledger.md", "errata.md", "verdicts.json"),
}

#: How a file of ours is told from somebody else's.
MARKS = {
    ".json": b'"schema": "ndtheory.',
    ".svg": b"<dc:title>ndtheory</dc:title>",
    ".png": b"Software\x00ndtheory",
    ".html": b'name="generator" content="ndtheory ',
    ".md": b"<!-- ndtheory verify -->",
    ".csv": b"# ndtheory ",
    ".nc": b"ndtheory sweep, version ",
    ".npz": b"ndtheory.npy",
    ".toml": b"# ndtheory: the problem as it was computed",
}


#: No file of ours is larger: reading another one to tell whose it is must end.
MOST_BYTES = 500_000_000


def check_ours(target: Path) -> None:
    """Refuse to overwrite what is not ours.

    Raises
    ------
    ProblemError
    """
    _check_place(target)
    if target.exists() and (unreadable(target, MOST_BYTES) or MARKS[target.suffix] not in target.read_bytes()):
        raise ProblemError(str(target), "", None, "not written by this program; needed another folder or name (-o)")


def _check_place(target: Path) -> None:
    """Refuse a name that a folder has."""
    if target.is_dir():
        raise ProblemError(str(target), "", None, "this is a folder: needed another folder or name (-o)")


#: Files are written into a folder of such a name before they take their places.
ROOM = ".ndtheory-writing-"


@contextlib.contextmanager
def staged(folder: Path, stale: Collection[str] = (), *, shown: Path | None = None) -> Iterator[Path]:
    """A folder to write into, whose files take their places together at the end; after an error none does.

    What is to be replaced goes before anything comes: a process that is killed in between leaves files of one run, some
    of which are missing, never files of two.  Ctrl-C keeps the documents where there is nothing to replace.

    Parameters
    ----------
    folder : Path
        Where the files belong.
    stale : collection of str
        Names of the files of an earlier run, which go when the others come.
    shown : Path, optional
        What an error names; the folder by default.

    Raises
    ------
    ProblemError
    """
    try:
        with contextlib.ExitStack() as stack:
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
    """Hold a folder against other processes of this program; when a process ends the system lets go of it."""
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


class Folder:
    """A folder for results; refused at once where it cannot be written, before anything long is computed.

    Parameters
    ----------
    path : Path
    kind : {'run', 'solve', 'compare', 'verify', 'reproduce'}
        What will be written: none of those files may be somebody else's.

    Raises
    ------
    ProblemError
        Not a folder, not writable, or it holds a file of that name that is not ours.
    """

    def __init__(self, path: Path, kind: Kind) -> None:
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=path).close()
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise ProblemError(str(path), "", None, f"needed a folder to write to: {why}") from None
        for name in FILES[kind]:
            check_ours(path / name)
        if kind not in ("verify", "reproduce"):
            _check_place(path / "problem.toml")  # a file of a user's stays as it is

    def write_problem(self, text: str) -> Path:
        """Write ``problem.toml``.

        Raises
        ------
        ProblemError
            A different problem.toml is there: an edited one is not overwritten.
        """
        target = self.path / "problem.toml"
        if target.exists() and (target.is_dir() or not _may_go(target.read_bytes(), text)):
            needed = "differs from the built-in problem: needed another folder (-o), or run compare on this file"
            raise ProblemError(str(target), "", None, needed)
        with staged(self.path, shown=target) as room:
            (room / target.name).write_text(text, encoding="utf-8")
        return target

    def write_run(self, run: Run) -> None:
        """Write ``run.json``, the tables, the interface, the problem and the figures."""
        with staged(self.path, FILES["run"]) as room:
            _text(room / "run.json", run.to_json())
            self._tables(room, run)
            _pictures(room, run)

    def write_solution(self, solution: Solution) -> None:
        """Write ``solve.json``, the table of Gamma_c, the problem and the figure of the bodies."""
        with staged(self.path, FILES["solve"]) as room:
            _text(room / "solve.json", solution.to_json())
            self._tables(room, solution)
            _pictures(room, solution)

    def write_comparison(self, comparison: Comparison) -> None:
        """Write ``compare.json``, the tables, the interface, the problem, the figures and ``report.html``."""
        from verification.output.report import report

        with staged(self.path, FILES["compare"]) as room:
            _text(room / "compare.json", comparison.to_json())
            self._tables(room, comparison.run)
            names = _pictures(room, comparison.run, comparison)
            figures = {name: (room / f"{name}.svg").read_text("utf-8") for name in names}
            _text(room / "report.html", report(comparison, figures))

    def _tables(self, room: Path, result: Run | Solution) -> None:
        """Gamma_c and the history as CSV, the interface as matrices, and the problem where a user has none there."""
        from verification.algorithm.runs import Run
        from verification.interface.files import write_interface, write_transfer

        length, stress = result.units["length"], result.units["stress"]
        units = f"x, gap, slip in {length}; pressure, shear in {stress}"
        _csv(room / "contact.csv", units, result.contact.table())
        if isinstance(result, Run):
            _csv(room / "history.csv", "residuals in the norm (5.21), relative ones without unit", result.table())
            write_interface(result.pair, room / "interface.npz")
        interface = result.pair.interface if isinstance(result, Run) else result.bodies.interface
        if interface.transfer is not None:
            write_transfer(interface, room / "P.npz")
        there = self.path / "problem.toml"
        ours = not there.exists() or (not unreadable(there, MOST_BYTES) and MARKS[".toml"] in there.read_bytes())
        if result.problem is not None and ours:
            _text(room / "problem.toml", f"{MARKS['.toml'].decode()}\n{result.problem.to_toml()}")

    def write_reproduction(self, found: Reproduction) -> None:
        """Write ``reproduce.json``, the rows behind each figure and the figures."""
        from verification.figures import save

        with staged(self.path, FILES["reproduce"]) as room:
            _text(room / "reproduce.json", found.to_json())
            for result in found.results:
                names = list(dict.fromkeys(name for row in result.rows for name in row))
                columns = {name: [row.get(name) for row in result.rows] for name in names}
                units = "x, gap, slip in mm; pressure, shear, young1, young2 in MPa"
                _csv(room / f"{result.figure}.csv", f"{result.figure} of Section 6, by reading; {units}", columns)
            figure = found.plot()
            for ending in ("png", "svg"):
                save(figure, room / f"reproduce.{ending}")

    def write_ledger(self, ledger: Ledger) -> None:
        """Write ``ledger.json``, ``ledger.md``, and of a whole ledger ``errata.md`` and ``verdicts.json``."""
        from verification.ledger import sheets

        with staged(self.path, FILES["verify"]) as room:
            _text(room / "ledger.json", ledger.to_json())
            _text(room / "ledger.md", sheets.page(ledger))
            if ledger.whole:
                _text(room / "errata.md", sheets.errata(ledger))
                _text(room / "verdicts.json", sheets.verdicts(ledger))


def _may_go(there: bytes, text: str) -> bool:
    """Whether a problem file may be replaced by a text: it is the same, or was written beside a result."""
    return there == text.encode() or MARKS[".toml"] in there


def _text(path: Path, text: str) -> None:
    with undisturbed():  # whole or not there
        path.write_text(text + "\n", encoding="utf-8")


def _csv(path: Path, says: str, table: Mapping[str, Sequence[Any]]) -> None:
    """A table with a line of words above it, which readers of CSV take for a comment."""
    text = as_csv([f"ndtheory {__version__}: {says}"], list(table), zip(*table.values(), strict=True))
    path.write_text(text, encoding="utf-8", newline="")


def _pictures(room: Path, result: Run | Solution, comparison: Comparison | None = None) -> list[str]:
    """Draw all there is to draw; returns the names of the figures."""
    from verification import figures
    from verification.algorithm.runs import Run

    drawn = {"bodies": figures.draw_bodies(result)}
    if isinstance(result, Run):
        drawn["residuals"] = figures.draw_residuals(result, [] if comparison is None else comparison.computed)
    if comparison is not None and comparison.losses is not None:
        drawn["waterfall"] = figures.draw_waterfall(comparison.losses, comparison.units["stress"])
    for name, figure in drawn.items():
        for ending in ("png", "svg"):
            figures.save(figure, room / f"{name}.{ending}")
    return list(drawn)

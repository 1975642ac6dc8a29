"""Writing results into a folder: only our own files, each whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from verification.reader import ProblemError, unreadable

if TYPE_CHECKING:
    from verification.ledger import Ledger
    from verification.monolithic import Solution
    from verification.runs import Run
    from verification.verdicts import Comparison

Kind = Literal["run", "solve", "compare", "verify"]

_PICTURES = ("bodies.svg", "bodies.png", "residuals.svg", "residuals.png")

#: What each command writes.
FILES: dict[Kind, tuple[str, ...]] = {
    "run": ("run.json", *_PICTURES),
    "solve": ("solve.json", *_PICTURES[:2]),
    "compare": ("compare.json", *_PICTURES, "waterfall.svg", "waterfall.png", "report.html"),
    "verify": ("ledger.json", "ledger.md", "errata.md", "verdicts.json"),
}

#: How a file of ours is told from somebody else's.
MARKS = {
    ".json": b'"schema": "ndtheory.',
    ".svg": b"<dc:title>ndtheory</dc:title>",
    ".png": b"Software\x00ndtheory",
    ".html": b'name="generator" content="ndtheory ',
    ".md": b"<!-- ndtheory verify -->",
}


#: No file of ours is larger: reading another one to tell whose it is must end.
MOST_BYTES = 500_000_000


def check_ours(target: Path) -> None:
    """Refuse to overwrite what is not ours.

    Raises
    ------
    ProblemError
    """
    if target.exists() and (unreadable(target, MOST_BYTES) or MARKS[target.suffix] not in target.read_bytes()):
        raise ProblemError(str(target), "", None, "not written by this program; needed another folder or name (-o)")


def put(target: Path, write: Callable[[Path], object]) -> None:
    """Write a file whole or not at all.

    Raises
    ------
    ProblemError
    """
    try:
        handle, temporary = tempfile.mkstemp(dir=target.parent, suffix=target.suffix)
        os.close(handle)
        try:
            write(Path(temporary))
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        finally:
            Path(temporary).unlink(missing_ok=True)
    except OSError as error:
        raise ProblemError(str(target), "", None, f"cannot be written: {error.strerror}") from None


class Folder:
    """A folder for results; refused at once where it cannot be written, before anything long is computed.

    Parameters
    ----------
    path : Path
    kind : {'run', 'solve', 'compare', 'verify'}
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

    def _put(self, name: str, write: Callable[[Path], object]) -> None:
        put(self.path / name, write)

    def write_problem(self, text: str) -> Path:
        """Write ``problem.toml``.

        Raises
        ------
        ProblemError
            A different problem.toml is there: an edited one is not overwritten.
        """
        target = self.path / "problem.toml"
        if target.exists() and (target.is_dir() or target.read_bytes() != text.encode()):
            needed = "differs from the built-in problem: needed another folder (-o), or run compare on this file"
            raise ProblemError(str(target), "", None, needed)
        self._put(target.name, lambda path: path.write_text(text, encoding="utf-8"))
        return target

    def write_run(self, run: Run) -> None:
        """Write ``run.json`` and the figures."""
        self._text("run.json", run.to_json())
        self._pictures(run)

    def write_solution(self, solution: Solution) -> None:
        """Write ``solve.json`` and the figure of the bodies."""
        self._text("solve.json", solution.to_json())
        self._pictures(solution)

    def write_comparison(self, comparison: Comparison) -> None:
        """Write ``compare.json``, the figures and ``report.html``."""
        from verification.report import report

        self._text("compare.json", comparison.to_json())
        self._pictures(comparison.run, comparison)
        names = [name for name in ("bodies", "residuals", "waterfall") if name != "waterfall" or comparison.losses]
        figures = {name: (self.path / f"{name}.svg").read_text("utf-8") for name in names}
        self._text("report.html", report(comparison, figures))

    def write_ledger(self, ledger: Ledger) -> None:
        """Write ``ledger.json``, ``ledger.md``, and of a whole ledger ``errata.md`` and ``verdicts.json``."""
        from verification.ledger import sheets

        self._text("ledger.json", ledger.to_json())
        self._text("ledger.md", sheets.page(ledger))
        if ledger.whole:
            self._text("errata.md", sheets.errata(ledger))
            self._text("verdicts.json", sheets.verdicts(ledger))
        else:
            for name in ("errata.md", "verdicts.json"):  # of another ledger
                (self.path / name).unlink(missing_ok=True)

    def _text(self, name: str, text: str) -> None:
        self._put(name, lambda path: path.write_text(text + "\n", encoding="utf-8"))

    def _pictures(self, result: Run | Solution, comparison: Comparison | None = None) -> None:
        from verification import figures
        from verification.runs import Run

        drawn = {"bodies": figures.draw_bodies(result)}
        if isinstance(result, Run):
            drawn["residuals"] = figures.draw_residuals(result, [] if comparison is None else comparison.editions)
        if comparison is not None and comparison.losses is not None:
            drawn["waterfall"] = figures.draw_waterfall(comparison.losses, comparison.units["stress"])
        elif comparison is not None:  # one of an earlier run would tell of another problem
            for ending in ("svg", "png"):
                (self.path / f"waterfall.{ending}").unlink(missing_ok=True)
        for name, figure in drawn.items():
            for ending in ("svg", "png"):
                self._put(f"{name}.{ending}", partial(figures.save, figure))

"""Writing results into a folder: only our own files, each whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from verification.reader import ProblemError

if TYPE_CHECKING:
    from verification.monolithic import Solution
    from verification.runs import Run
    from verification.verdicts import Comparison

#: Everything written here carries this word near its beginning; a file without it is somebody else's.
MARK = b"ndtheory"


class Folder:
    """A folder for results; refused at once where it cannot be written, before anything long is computed.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ProblemError
        Not a folder, or not writable.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=path).close()
        except OSError as error:
            raise ProblemError(str(path), "", None, f"needed a folder to write to: {error.strerror}") from None

    def _put(self, name: str, write: Callable[[Path], None]) -> Path:
        target = self.path / name
        if target.exists() and (target.is_dir() or MARK not in target.read_bytes()[:4096]):
            raise ProblemError(str(target), "", None, "not written by this program; needed another folder (-o)")
        handle, temporary = tempfile.mkstemp(dir=self.path, suffix=target.suffix)
        os.close(handle)
        try:
            write(Path(temporary))
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        finally:
            Path(temporary).unlink(missing_ok=True)
        return target

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
        target.write_text(text, encoding="utf-8")
        return target

    def write_run(self, run: Run) -> None:
        """Write ``run.json`` and the figures."""
        from verification.figures import draw_bodies, draw_residuals, save

        self._put("run.json", lambda path: _write(path, run.to_json()))
        for ending in ("svg", "png"):
            self._put(f"bodies.{ending}", lambda path: save(draw_bodies(run), path))
            self._put(f"residuals.{ending}", lambda path: save(draw_residuals(run), path))

    def write_solution(self, solution: Solution) -> None:
        """Write ``solve.json`` and the figure."""
        from verification.figures import draw_bodies, save

        self._put("solve.json", lambda path: _write(path, solution.to_json()))
        for ending in ("svg", "png"):
            self._put(f"bodies.{ending}", lambda path: save(draw_bodies(solution), path))

    def write_comparison(self, comparison: Comparison) -> None:
        """Write ``compare.json``, the figures and ``report.html``."""
        from verification.figures import draw_bodies, draw_residuals, save
        from verification.report import report

        self._put("compare.json", lambda path: _write(path, comparison.to_json()))
        run = comparison.run
        for ending in ("svg", "png"):
            self._put(f"bodies.{ending}", lambda path: save(draw_bodies(run), path))
            self._put(f"residuals.{ending}", lambda path: save(draw_residuals(run, comparison.bounds), path))
        figures = {name: (self.path / f"{name}.svg").read_text("utf-8") for name in ("bodies", "residuals")}
        self._put("report.html", lambda path: _write(path, report(comparison, figures)))


def _write(path: Path, text: str) -> None:
    path.write_text(text + "\n", encoding="utf-8")

"""A folder for the results of one call: documents, tables, matrices and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ndtheory import __version__
from verification.algorithm.runs import Run
from verification.bounds.ruler import ruler
from verification.document import Document
from verification.interface.files import write_interface, write_transfer
from verification.interface.values import columns_of, values_on_sides
from verification.ledger import sheets
from verification.machine.interrupts import undisturbed
from verification.output.fields import write_fields, write_series
from verification.output.files import (
    FILES,
    MARKS,
    Kind,
    check_folder,
    check_ours,
    check_place,
    files_of,
    ours,
    staged,
    write_into,
)
from verification.problem.tables import ProblemError
from verification.registry import BOUNDS
from verification.spreadsheet import as_csv

if TYPE_CHECKING:
    from verification.algorithm.history import History
    from verification.algorithm.monolithic import Solution
    from verification.comparison import Comparison
    from verification.figures import Figure
    from verification.ledger import Ledger
    from verification.reproduce import Reproduction


class Folder:
    """A folder for results of one kind, checked before anything long is computed.

    Raises
    ------
    ProblemError
        Not a folder, not writable, or it holds a file with a name of this kind that another program has written.
    """

    def __init__(self, path: Path, kind: Kind) -> None:
        self.path, self.kind = path, kind
        check_folder(path)
        for name in files_of(kind, path):
            check_ours(path / name)
        if kind not in ("verify", "reproduce"):
            check_place(path / "problem.toml")  # a file of a user's stays as it is

    def write_problem(self, text: str) -> Path:
        """Write ``problem.toml``; ProblemError if an edited one is there, which is not overwritten."""
        target = self.path / "problem.toml"
        if not ours(target) and target.read_bytes() != text.encode():
            needed = "differs from the built-in problem: needed another folder (-o), or run compare on this file"
            raise ProblemError(str(target), "", None, needed)
        write_into(target, lambda path: path.write_text(text, encoding="utf-8"))
        return target

    def write(self, found: Any) -> None:
        """Write a result of this kind: its document with tables, matrices, the problem, figures or pages.

        RuntimeError if a file is written that FILES does not list: then nothing takes its place.
        """
        with staged(self.path, files_of(self.kind, self.path)) as room:
            _text(room / FILES[self.kind][0], found.to_json())
            others: dict[Kind, Callable[[Path, Any], object]] = {"verify": _pages, "reproduce": _reproduced}
            others |= {"compare": self._compared, "march": self._marched}
            others.get(self.kind, self._drawn)(room, found)
            if unknown := {path.name for path in room.iterdir()} - {*files_of(self.kind, room), "problem.toml"}:
                names = ", ".join(sorted(unknown))
                raise RuntimeError(f"{names}: needed in FILES, so that a file of a user's is never overwritten")

    def _drawn(self, room: Path, result: Run | Solution) -> None:
        self._tables(room, result)
        _pictures(room, result)

    def _compared(self, room: Path, comparison: Comparison) -> None:
        """The files of the run, and ``report.html``."""
        from verification.output.report import report

        self._tables(room, comparison.run)
        names = _pictures(room, comparison.run, comparison)
        figures = {name: (room / f"{name}.svg").read_text("utf-8") for name in names}
        _text(room / "report.html", report(comparison, figures))

    def _tables(self, room: Path, result: Run | Solution) -> None:
        """Gamma_c and the history as CSV, the interface as matrices, the fields, the problem where a user has none."""
        length, stress = result.units["length"], result.units["stress"]
        units = f"x, y, s, gap, slip in {length}; pressure, shear, bound in {stress}"
        _csv(room / "contact.csv", units, result.contact.table())
        sides = values_on_sides(result.bodies, result.displacements)
        _values(room, result.units, columns_of(result.points), sides)
        if isinstance(result, Run):
            _csv(room / "history.csv", "residuals in the norm (5.21), relative ones without unit", result.table())
            if not result.pair.neumann.rigid:
                write_interface(result.pair, room / "interface.npz")
        interface = result.pair.interface_along_y if isinstance(result, Run) else result.bodies.interface
        if not interface.one_grid:
            write_transfer(interface, room / "P.npz")
        write_fields(result, room)
        self._problem(room, result)

    def _marched(self, room: Path, history: History) -> None:
        """Increments and Gamma_c as CSV, the fields as a series, the problem where a user has none, the views."""
        from verification.figures import draw_history

        length, stress = history.units["length"], history.units["stress"]
        units = f"x, gap, slip in {length}; stresses in {stress}; forces in {stress} {length}"
        _csv(room / "contact.csv", units, history.contact_table())
        _csv(room / "history.csv", f"one row an increment; {units}", history.table())
        _values(room, history.units, history.point_table(), history.side_table())
        write_series(history, room)
        self._problem(room, history)
        views = ("loop", "states", "shear", *(["points"] if history.points else []))
        _save(room, {view: draw_history(history, view) for view in views})

    def _problem(self, room: Path, result: Document) -> None:
        if result.problem is not None and ours(self.path / "problem.toml"):
            _text(room / "problem.toml", f"{MARKS['.toml'].decode()}\n{result.problem.to_toml()}")


def _reproduced(room: Path, found: Reproduction) -> None:
    """The rows behind each figure, and the figures."""
    for result in found.results:
        names = list(dict.fromkeys(name for row in result.rows for name in row))
        columns = {name: [row.get(name) for row in result.rows] for name in names}
        units = "x, gap, slip in mm; pressure, shear, young1, young2 in MPa"
        _csv(room / f"{result.figure}.csv", f"{result.figure} of Section 6, by reading; {units}", columns)
    _save(room, {"reproduce": found.plot()})


def _pages(room: Path, ledger: Ledger) -> None:
    """``ledger.md``, and of a whole ledger ``errata.md`` and ``verdicts.json``."""
    _text(room / "ledger.md", sheets.page(ledger))
    if ledger.whole:
        _text(room / "errata.md", sheets.errata(ledger))
        _text(room / "verdicts.json", sheets.verdicts(ledger))


def _values(
    room: Path, units: Mapping[str, str], points: Mapping[str, Sequence[Any]], sides: Mapping[str, Sequence[Any]]
) -> None:
    """Displacements and stresses at the points that the problem names, if any, and along the named sides."""
    says = f"x, y, ux, uy in {units['length']}; sxx, syy, sxy, mises in {units['stress']}, means of cells"
    for name, columns in (("points", points), ("sides", sides)):
        if columns:
            _csv(room / f"{name}.csv", says, columns)


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

    drawn = {"bodies": figures.draw_bodies(result)}
    if isinstance(result, Run):
        drawn["residuals"] = figures.draw_residuals(result, [] if comparison is None else comparison.computed)
        if comparison is not None and ruler(comparison.computed, result):
            drawn["ruler"] = figures.draw_ruler(comparison)
    if comparison is not None and comparison.losses is not None:
        drawn["waterfall"] = figures.draw_waterfall(comparison.losses, comparison.units["stress"])
    if comparison is not None and any(BOUNDS[bound.name].on_request for bound in comparison.computed):
        drawn["factor"] = figures.draw_proved(comparison)
    _save(room, drawn)
    return list(drawn)


def _save(room: Path, drawn: Mapping[str, Figure]) -> None:
    """Write figures as PNG and SVG."""
    from verification.figures import save

    for name, figure in drawn.items():
        for ending in ("png", "svg"):
            save(figure, room / f"{name}.{ending}")

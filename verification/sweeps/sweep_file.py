"""The file of a sweep: a problem and a grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

from ndtheory.texts import did_you_mean
from verification.problem.examples import example, examples
from verification.problem.files import load, read_file
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError, TomlTable, Unfit, number, positive, text
from verification.sweeps.grid import MOST_ROWS, SweepGrid

#: The keys of a range of values.
RANGE = ("start", "stop", "step")


def read_sweep(path: Path | str) -> tuple[Problem, SweepGrid]:
    """Read a sweep file.

    Parameters
    ----------
    path : path
        A TOML file.  ``problem`` is a problem file, looked for beside it, or the name of a built-in problem where there
        is no such file; ``[grid]`` has a list of values for each axis, or ``{ start, stop, step }`` with both ends.

    Raises
    ------
    ProblemError
        Naming file, key, value received and what is needed.
    """
    path = Path(path)
    data = read_file(path)
    if "body1" in data and "grid" not in data:
        needed = (
            "needed the file of a sweep, this is a problem file; write another one beside it that names it and the "
            f'values, as problem = "{path.name}" and [grid] theta = [0.3, 0.5]'
        )
        raise ProblemError(str(path), "", None, needed)
    top = TomlTable(data, str(path))
    name = top.take("problem", text)
    grid = top.table("grid", required=True)
    top.close()
    problem = _problem(path, name)
    given = {axis: grid.take(axis, partial(_values, str(path), grid.key(axis))) for axis in grid.names()}
    if not given:
        raise ProblemError(str(path), "grid", None, "needed at least one axis, as theta = [0.3, 0.5]")
    return problem, SweepGrid.of(given, str(path), "grid")


def _problem(path: Path, name: str) -> Problem:
    place = path.parent / name
    built_in = examples()
    try:
        there = place.is_file() or (place.exists() and name not in built_in)
    except ValueError:  # a null character
        there = False
    if there:
        return load(place)
    if name in built_in:
        return example(name)
    needed = f"needed a problem file beside the sweep file, or the name of a built-in problem: {', '.join(built_in)}"
    raise ProblemError(str(path), "problem", name, needed + did_you_mean(name, built_in))


def _values(file: str, key: str, value: Any) -> Any:
    """A list as it stands, a range as the list of its values."""
    if not isinstance(value, Mapping):
        return value
    table = TomlTable(value, file, key)
    reads: tuple[Callable[[Any], Fraction], ...] = (number(), number(), positive)
    start, stop, step = (table.take(name, read) for name, read in zip(RANGE, reads, strict=True))
    table.close()
    steps = (stop - start) / step
    if steps < 0 or steps.denominator != 1:
        raise Unfit("needed a whole number of steps from start up to stop: both ends are values")
    if steps >= MOST_ROWS:
        raise Unfit(f"needed at most {MOST_ROWS} values")
    values = [start + i * step for i in range(int(steps) + 1)]
    whole = all(isinstance(value[name], int) for name in RANGE)
    return [int(v) for v in values] if whole else values

"""The grid of a sweep: the values of each axis, their product in a fixed order, and the file that lists them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

from ndtheory.texts import did_you_mean
from verification.algorithm.relaxation import Rule
from verification.problem.examples import example, examples
from verification.problem.files import load, read_file
from verification.problem.readers import coefficient, factor
from verification.problem.specification import Problem
from verification.problem.tables import (
    ProblemError,
    TomlTable,
    Unfit,
    choice,
    integer,
    number,
    plain,
    positive,
    several,
    show,
    text,
)
from verification.registry import LAWS, RULES

#: Largest number of rows of a sweep, so that a typing error does not fill the memory.
MOST_ROWS = 200_000

#: Largest number of halvings of a mesh, as in ``ndtheory constants --refine``.
MOST_HALVINGS = 8

#: The keys of a range of values.
RANGE = ("start", "stop", "step")

_moduli = "two numbers > 0, Young's modulus of body 1 and of body 2"


def _halvings(value: Any) -> int:
    needed = f"a whole number from 0 to {MOST_HALVINGS}"
    if integer(needed, 0)(value) > MOST_HALVINGS:
        raise Unfit(f"needed {needed}")
    return int(value)


#: Reader of a value of each axis, from the axis that changes most slowly to the one that changes fastest: neighbouring
#: rows share condensed bodies.
AXES: dict[str, Callable[[Any], Any]] = {
    "refine": _halvings,
    "young": several(positive, 2, _moduli),
    "neumann_body": choice(1, 2),
    "law": lambda value: choice(*LAWS)(value),  # those that are registered at that moment
    "radius": positive,
    "friction": coefficient,
    "rule": lambda value: value if isinstance(value, Rule) else choice(*RULES)(value),
    "theta": factor,
}


@dataclass(frozen=True, kw_only=True)
class SweepGrid:
    """The values of the axes that vary.

    ``axes`` has their values by name, in the order of :data:`AXES`; an axis that does not vary is left out and has the
    value of the problem.

    Examples
    --------
    >>> grid = SweepGrid.of({"theta": [0.3, 0.5], "friction": [0, "1/5"]})
    >>> len(grid), [(str(v["friction"]), str(v["theta"])) for v in grid.rows()]
    (4, [('0', '3/10'), ('0', '1/2'), ('1/5', '3/10'), ('1/5', '1/2')])
    """

    axes: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Mapping[str, Sequence[Any] | None], source: str = "<dict>", table: str = "") -> SweepGrid:
        """Read the values of the axes, exactly; None leaves an axis out.

        Errors name the source, a file, and the table of the axes in it.

        Raises
        ------
        ProblemError
            An axis that is unknown or has no values, a value that does not fit or is listed twice, too many rows.
        """
        key = lambda name: f"{table}.{name}" if table else name
        for name in given:
            if name not in AXES:
                raise ProblemError(source, key(name), None, "unknown axis; known here: " + ", ".join(AXES))
        axes = {}
        for name, read in AXES.items():
            values = given.get(name)
            if values is not None:
                axes[name] = _read(values, read, partial(ProblemError, source, key(name)))
        grid = cls(axes=axes)
        if len(grid) > MOST_ROWS:
            raise ProblemError(source, table or "grid", f"{len(grid)} rows", f"needed at most {MOST_ROWS} rows")
        return grid

    def __len__(self) -> int:
        return math.prod(map(len, self.axes.values()))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the values of each row, the last axis of :data:`AXES` changing fastest."""
        for values in itertools.product(*self.axes.values()):
            yield dict(zip(self.axes, values, strict=True))


def _read(values: Any, read: Callable[[Any], Any], refuse: Callable[[Any, str], ProblemError]) -> tuple[Any, ...]:
    values = plain(values)
    if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, (Sequence, range)):
        raise refuse(values, "needed a list of values")
    if not values:
        raise refuse(values, "needed at least one value")
    if len(values) > MOST_ROWS:
        raise refuse(f"{len(values)} values", f"needed at most {MOST_ROWS} values")
    found: dict[Any, None] = {}
    for value in values:
        try:
            one = read(value)
        except Unfit as error:
            raise refuse(value, str(error)) from None
        if one in found:
            raise refuse(value, f"needed each value once, {show(value)} is listed twice")
        found[one] = None
    return tuple(found)


def read_sweep(path: Path | str) -> tuple[Problem, SweepGrid]:
    """Read a sweep file.

    Parameters
    ----------
    path : path
        A TOML file.  ``problem`` is a problem file beside it, or else the name of a built-in
        problem; ``[grid]`` has a list of values for each axis, or ``{ start, stop, step }`` with both ends.

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
    """Return a list as it is, a range as the list of its values."""
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

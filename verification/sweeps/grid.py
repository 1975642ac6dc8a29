"""The grid of a sweep: which values each axis has, and their product in a fixed order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from ndtheory import HypothesisError
from verification.algorithm.relaxation import RULES, Rule
from verification.interface.friction import LAWS
from verification.problem.specs import MOST_FRICTION, read_theta
from verification.problem.tables import ProblemError, Unfit, choice, integer, number, positive, several, show

#: Most rows of a sweep: a typing error should not fill the memory.
MOST_ROWS = 200_000

#: Most halvings of a mesh, as `ndtheory constants --refine` has it.
MOST_HALVINGS = 8

#: A value of a grid by the name of its axis: what one row is a function of.
Values = Mapping[str, Any]

_moduli = "two numbers > 0, Young's modulus of body 1 and of body 2"


def _theta(value: Any) -> Any:
    try:
        return read_theta(value)
    except HypothesisError as error:
        raise Unfit(f"needed {error.needed}") from None


def _halvings(value: Any) -> int:
    needed = f"a whole number from 0 to {MOST_HALVINGS}"
    if integer(needed, 0)(value) > MOST_HALVINGS:
        raise Unfit(f"needed {needed}")
    return int(value)


def _rule(value: Any) -> Any:
    return value if isinstance(value, Rule) else choice(*RULES)(value)


#: How a value of each axis is read, from the axis that changes most slowly to the one that changes fastest: rows that
#: stand together share what is condensed.
AXES: dict[str, Callable[[Any], Any]] = {
    "refine": _halvings,
    "young": several(positive, 2, _moduli),
    "neumann_body": choice(1, 2),
    "law": lambda value: choice(*LAWS)(value),  # those that are registered at that moment
    "radius": positive,
    "friction": number(f"a number >= 0, at most {float(MOST_FRICTION):g}", lambda v: 0 <= v <= MOST_FRICTION),
    "rule": _rule,
    "theta": _theta,
}


@dataclass(frozen=True, kw_only=True)
class SweepGrid:
    """The values of the axes that vary.

    Attributes
    ----------
    axes : mapping from the name of an axis to its values
        In the order of :data:`AXES`; an axis that does not vary is left out and has the value of the problem.

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

        Parameters
        ----------
        source, table : str
            What errors name: a file, and the table of the axes in it.

        Raises
        ------
        ProblemError
            An axis that is unknown or has no values, a value that does not fit or stands there twice, too many rows.
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
        """The values of each row, the last axis of :data:`AXES` changing fastest."""
        for values in itertools.product(*self.axes.values()):
            yield dict(zip(self.axes, values, strict=True))


def _read(values: Any, read: Callable[[Any], Any], refuse: Callable[[Any, str], ProblemError]) -> tuple[Any, ...]:
    if hasattr(values, "tolist"):  # an array
        values = values.tolist()
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
            raise refuse(value, f"needed each value once, {show(value)} stands there twice")
        found[one] = None
    return tuple(found)

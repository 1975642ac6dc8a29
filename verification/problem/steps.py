"""The loads of a problem along its history: those at the end of each step, and of each increment on the way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from itertools import accumulate, pairwise
from typing import Any

from verification.problem.specification import Problem
from verification.problem.specs import Loads

#: The loads of all bodies, by their numbers.
All = dict[int, Loads]


@dataclass(frozen=True, kw_only=True)
class Moment:
    """The end of an increment.

    Attributes
    ----------
    step : int
        Number of its step, from 1.
    name : str
        The name of the step.
    time : Fraction
        0 where the history begins, the number of the step at its end.
    problem : Problem
        The problem with the loads of that time, without steps.
    """

    step: int
    name: str
    time: Fraction
    problem: Problem


def at_rest(problem: Problem) -> Problem:
    """Return the problem where its history begins, without loads, with the supports and sides of all its steps."""
    return _under(problem, _path(problem)[0])


def moments(problem: Problem) -> Iterator[Moment]:
    """Yield the increments of a history in their order."""
    for number, (step, (before, after)) in enumerate(zip(problem.steps, pairwise(_path(problem)), strict=True), 1):
        for i in range(1, step.increments + 1):
            share = Fraction(i, step.increments)
            mix = lambda a, b, share=share: a + share * (b - a)
            loads = {i: _of_each(mix, before[i], after[i]) for i in before}
            yield Moment(step=number, name=step.name, time=number - 1 + share, problem=_under(problem, loads))


def _path(problem: Problem) -> list[All]:
    """Return the loads where the history begins, 0 on every side that the bodies or the steps name, and at each end."""
    rest = {}
    for i, body in problem.bodies.items():
        named: list[Loads] = [body, *(step.loads[i] for step in problem.steps)]
        rest[i] = _of_each(lambda _: Fraction(0), reduce(_after, named))
    later = lambda loads, step: {i: _after(before, step.loads[i]) for i, before in loads.items()}
    return list(accumulate(problem.steps, later, initial=rest))


def path_warnings(problem: Problem) -> list[str]:
    """Return a warning where a static solution cannot be right: friction, and steps that are not proportional."""
    if not problem.contact.friction or proportional(problem):
        return []
    return [
        "the loads of the [[step]] tables are not proportional to one parameter, so that friction depends on the path:"
        " this takes the loads of the bodies' own tables, applied at once; `ndtheory march` follows the steps"
    ]


def proportional(problem: Problem) -> bool:
    """Return True if the loads of the history are multiples of its last ones, by a factor that never falls."""
    path = [_numbers(loads) for loads in _path(problem)[1:]]
    if not path:
        return True
    last = path[-1]
    largest = max(range(len(last)), key=lambda i: abs(last[i]), default=0)
    if not any(last):
        return not any(map(any, path))
    factors = [values[largest] / last[largest] for values in path]
    multiples = [[factor * end for end in last] for factor in factors]
    return multiples == path and factors == sorted(factors) and factors[0] >= 0


def _numbers(loads: All) -> list[Fraction]:
    """Return all components of the loads in one list."""
    vectors = [
        vector
        for each in loads.values()
        for vector in (*each.prescribed.values(), *each.traction.values(), *each.point_load.values(), each.body_force)
    ]
    return [v for vector in vectors for v in vector if v is not None]


def _after(before: Loads, step: Loads) -> Loads:
    return Loads(
        prescribed={**before.prescribed, **step.prescribed},
        traction={**before.traction, **step.traction},
        body_force=step.body_force or before.body_force,
        point_load={**before.point_load, **step.point_load},
    )


def _of_each(of: Callable[..., Fraction], *loads: Loads) -> Loads:
    """Return a function of the components of loads on the same sides; what the first ones leave free stays free."""

    def mixed(vectors: Iterable[Any]) -> Any:
        return tuple(None if values[0] is None else of(*values) for values in zip(*vectors, strict=True))

    return Loads(
        prescribed={side: mixed(each.prescribed[side] for each in loads) for side in loads[0].prescribed},
        traction={side: mixed(each.traction[side] for each in loads) for side in loads[0].traction},
        body_force=mixed(each.body_force for each in loads),
        point_load={at: mixed(each.point_load[at] for each in loads) for at in loads[0].point_load},
    )


def _under(problem: Problem, loads: All) -> Problem:
    """Return the problem under given loads, without steps."""
    bodies = {i: replace(body, **vars(loads[i])) for i, body in problem.bodies.items()}
    return replace(problem.holding(bodies), steps=())

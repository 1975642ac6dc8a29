"""The loads of a problem along its history: those at the end of each step, and of each increment on the way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from verification.problem.specification import Problem
from verification.problem.specs import BodySpec, Loads

#: The loads of both bodies.
Both = tuple[Loads, Loads]


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
    return _under(problem, _loads_at_rest(problem))


def moments(problem: Problem) -> Iterator[Moment]:
    """Yield the increments of a history in their order."""
    before = _loads_at_rest(problem)
    for number, (step, after) in enumerate(zip(problem.steps, ends(problem), strict=True), 1):
        for i in range(1, step.increments + 1):
            share = Fraction(i, step.increments)
            first, second = (_between(a, b, share) for a, b in zip(before, after, strict=True))
            yield Moment(step=number, name=step.name, time=number - 1 + share, problem=_under(problem, (first, second)))
        before = after


def ends(problem: Problem) -> list[Both]:
    """Return the loads at the end of each step; what a step does not name keeps its value."""
    found, loads = [], _loads_at_rest(problem)
    for step in problem.steps:
        loads = _after(loads[0], step.body1), _after(loads[1], step.body2)
        found.append(loads)
    return found


def path_warnings(problem: Problem) -> list[str]:
    """Return a warning where a static solution cannot be right: friction, and steps that are not proportional."""
    if not problem.contact.friction or proportional(problem):
        return []
    return [
        "the loads of the [[step]] tables are not proportional to one parameter, so that friction depends on the path:"
        " this takes the loads of [body1] and [body2], applied at once; `ndtheory march` follows the steps"
    ]


def proportional(problem: Problem) -> bool:
    """Return True if the loads of the history are multiples of its last ones, by a factor that never falls."""
    path = [_numbers(loads) for loads in ends(problem)]
    if not path:
        return True
    last = path[-1]
    largest = max(range(len(last)), key=lambda i: abs(last[i]), default=0)
    if not any(last):
        return not any(map(any, path))
    factors = [values[largest] / last[largest] for values in path]
    multiples = [[factor * end for end in last] for factor in factors]
    return multiples == path and factors == sorted(factors) and factors[0] >= 0


def _numbers(loads: Both) -> list[Fraction]:
    """Return all components of the loads in one list."""
    vectors = [
        vector for each in loads for vector in (*each.prescribed.values(), *each.traction.values(), each.body_force)
    ]
    return [v for vector in vectors for v in vector or () if v is not None]


def _loads_at_rest(problem: Problem) -> Both:
    """Return loads of 0, with every side that the bodies or the steps name."""
    rest = []
    for body, name in ((problem.body1, "body1"), (problem.body2, "body2")):
        given = [Loads(prescribed=body.prescribed, traction=body.traction), *(getattr(s, name) for s in problem.steps)]
        rest.append(
            Loads(
                prescribed={side: _zero(v) for each in given for side, v in each.prescribed.items()},
                traction={side: _zero(v) for each in given for side, v in each.traction.items()},
                body_force=_zero(body.body_force),
            )
        )
    return rest[0], rest[1]


def _zero(values: Any) -> Any:
    return tuple(None if v is None else Fraction(0) for v in values)


def _after(before: Loads, step: Loads) -> Loads:
    return Loads(
        prescribed={**before.prescribed, **step.prescribed},
        traction={**before.traction, **step.traction},
        body_force=before.body_force if step.body_force is None else step.body_force,
    )


def _between(before: Loads, after: Loads, share: Fraction) -> Loads:
    """Return the loads at a share of the way; the first ones have every side."""

    def mix(one: Any, two: Any) -> Any:
        return tuple(None if a is None else a + share * (b - a) for a, b in zip(one, two, strict=True))

    return Loads(
        prescribed={side: mix(v, after.prescribed[side]) for side, v in before.prescribed.items()},
        traction={side: mix(v, after.traction[side]) for side, v in before.traction.items()},
        body_force=mix(before.body_force, after.body_force),
    )


def _under(problem: Problem, loads: Both) -> Problem:
    """Return the problem under given loads, without steps."""

    def loaded(body: BodySpec, under: Loads) -> BodySpec:
        assert under.body_force is not None
        return replace(body, prescribed=under.prescribed, traction=under.traction, body_force=under.body_force)

    body1, body2 = (loaded(*each) for each in zip((problem.body1, problem.body2), loads, strict=True))
    return replace(problem, body1=body1, body2=body2, steps=())

"""What does not depend on a run is computed once: the bounds of one pair of bodies, for all tests of one process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from verification import comparison
from verification.bounds import semidefinite
from verification.constants import Measured
from verification.interface.pair import Pair


def once(compute: Callable[..., Any]) -> Callable[..., Any]:
    """A function of a pair of bodies that keeps its answers.

    They are kept by what they depend on: the matrices of the bodies, the problem but for its title, its units and its
    iteration, the roles, and whatever else is given.  An exception is not kept.
    """
    answers: dict[tuple[Any, ...], Any] = {}

    def answer(pair: Pair, measured: Measured, *given: Any, progress: Any = None, **options: Any) -> Any:
        rest = repr(replace(pair.problem, title="", units={}, source="", iteration=None))
        matrices = (body.elastic.schur.tobytes() for body in pair.elastic)
        key = (rest, pair.problem.iteration.neumann_body, given, *options.items(), *matrices)
        if key not in answers:
            answers[key] = compute(pair, measured, *given, **options | ({"progress": progress} if progress else {}))
        return answers[key]

    return answer


#: Most of the time of a comparison goes into these: module, name, and the function that keeps its answers.
KNOWN = [
    (module, name, once(getattr(module, name)))
    for module, name in [(comparison, "locate"), (semidefinite, "friction_threshold"), (semidefinite, "evaluate_lmi")]
]

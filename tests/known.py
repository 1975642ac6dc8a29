"""Bounds of one pair of bodies, and one run repeated by cvxpy, are computed once for all processes of a session."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from shared import Shared

from verification.algorithm.reference import Reference
from verification.algorithm.runs import Run
from verification.constants import Measured
from verification.interface.pair import ContactPair
from verification.semidefinite import lipschitz, losses, multipliers

#: Most of the time of a comparison goes into these: module and name.
DEAR = [(losses, "locate"), (multipliers, "friction_threshold"), (lipschitz, "work_out")]


def once(compute: Callable[..., Any], shared: Shared) -> Callable[..., Any]:
    """A function of a pair of bodies that keeps its answers.

    They are kept by what they depend on: the matrices of the bodies and of the interface, friction, the roles, and
    whatever else is given.  An exception is not kept.
    """

    def answer(pair: ContactPair, measured: Measured, *given: Any, progress: Any = None, **options: Any) -> Any:
        sides, interface = (pair.contact, pair.neumann), pair.interface
        arrays = (*(side.schur for side in sides), interface.gap, interface.contact.weights, interface.kernel)
        meshes = (() if side.body is None else side.gram.tobytes() for side in sides)
        bytes_ = (b"" if array is None else array.tobytes() for array in arrays)
        key = (compute.__name__, pair.friction, pair.neumann_body, given, *options.items(), *bytes_, *meshes)
        told = {"progress": progress} if progress else {}
        return shared(key, lambda: compute(pair, measured, *given, **options | told))

    return answer


def repeated_once(repeat: Callable[[Run], Reference], shared: Shared) -> Callable[[Run], Reference]:
    """A function of a run that keeps its answers by the bodies, the rule, theta and every iterate."""

    def answer(run: Run) -> Reference:
        pair = run.pair
        arrays = [pair.contact.schur, pair.neumann.schur, *(each.g for each in run.iterates)]
        given = (pair.settings, pair.friction, pair.neumann_body, run.rule, run.theta, run.evaluations)
        key = (repeat.__name__, *given, *(array.tobytes() for array in arrays))
        return shared(key, lambda: repeat(run))

    return answer

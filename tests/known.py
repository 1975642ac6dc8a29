"""Bounds of one pair of bodies, proofs in the continuum, and one run repeated by cvxpy: once in a session."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from shared import Shared

from ndtheory.continuum.rectangle_circle import RectangleCircle
from verification.algorithm.reference import Reference
from verification.algorithm.runs import Run
from verification.certificate import continuum
from verification.constants import Measured
from verification.free_norm.rectangles import RectangleSearch
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


def continuum_once(patch: pytest.MonkeyPatch, shared: Shared) -> None:
    """Keep calibrations of one body, constants of two, and what a proof in a free norm decides."""

    def keep(owner: Any, name: str, of: Callable[[Any], object] = lambda own: own) -> None:
        compute = getattr(owner, name)

        def answer(first: Any, *given: Any) -> Any:
            return shared((name, of(first), *given), lambda: compute(first, *given))

        patch.setattr(owner, name, answer)

    for name in ("for_traces", "for_cut_off", "bounded"):
        keep(continuum, name)
    keep(RectangleCircle, "contracts")
    keep(RectangleSearch, "best_theta", lambda search: search.circle)

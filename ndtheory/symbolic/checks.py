"""All checks, in the order of the paper."""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.symbolic import (
    contraction,
    energy,
    estimates,
    further,
    intervals,
    mechanics,
    one_node,
    one_step,
    printed,
    weak_form,
)
from ndtheory.symbolic.engine import Check


def checks() -> Sequence[Check]:
    """All checks, in the order of the paper."""
    modules = (mechanics, weak_form, estimates, one_step, one_node, intervals, contraction, printed, further, energy)
    return [check for module in modules for check in module.CHECKS]

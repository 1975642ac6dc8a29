"""All checks, in the order of the paper."""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.symbolic import further, mechanics, section5
from ndtheory.symbolic.engine import Check


def checks() -> Sequence[Check]:
    """All checks, in the order of the paper; what the paper does not state comes last."""
    return [check for module in (mechanics, section5, further) for check in module.CHECKS]

"""A second derivation of every algebraic step of the paper, in sympy: proofs and exact counterexamples.

``engine`` decides, ``dimension`` compares units; ``mechanics`` (Sections 2 to 4), ``estimates``, ``intervals``,
``contraction`` (Section 5) and ``further`` (what the paper does not state) hold the checks.
"""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.symbolic.engine import Check


def checks() -> Sequence[Check]:
    """All checks, in the order of the paper; sympy is loaded here."""
    from ndtheory.symbolic import contraction, estimates, further, intervals, mechanics

    return [*mechanics.CHECKS, *estimates.CHECKS, *intervals.CHECKS, *contraction.CHECKS, *further.CHECKS]

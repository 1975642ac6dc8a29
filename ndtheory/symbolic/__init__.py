"""A second derivation of every algebraic step of the paper, in sympy: proofs and exact counterexamples.

``engine`` decides, ``dimension`` compares units; ``mechanics`` (Sections 2 to 4), ``estimates``, ``intervals``,
``contraction``, ``printed`` (Section 5), ``further`` and ``energy`` (what the paper does not state) hold the checks.
"""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.symbolic.engine import Check


def checks() -> Sequence[Check]:
    """All checks, in the order of the paper; sympy is loaded here."""
    from ndtheory.symbolic import contraction, energy, estimates, further, intervals, mechanics, printed

    modules = (mechanics, estimates, intervals, contraction, printed, further, energy)
    return [check for module in modules for check in module.CHECKS]

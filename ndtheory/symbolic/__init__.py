"""A second derivation of every algebraic step of the paper, in sympy: proofs and exact counterexamples.

``engine`` decides by the signs that ``quotient`` reads off, ``dimension`` compares units, ``symbols`` is what the
checks share.  The checks: ``mechanics`` (Sections 2 to 4), ``weak_form``, ``estimates``, ``one_step``, ``one_node``,
``intervals``, ``contraction``, ``printed`` (Section 5), ``further`` and ``energy`` (what the paper does not state).
"""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.symbolic.engine import Check


def checks() -> Sequence[Check]:
    """All checks, in the order of the paper; sympy is loaded here."""
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

    modules = (mechanics, weak_form, estimates, one_step, one_node, intervals, contraction, printed, further, energy)
    return [check for module in modules for check in module.CHECKS]

"""A conformance kit: the property tests of this project for your own rule, law, bound or step.

Each ``check_`` function draws random pairs of bodies and forces, ``examples`` cases for each property.  It returns a
:class:`Report`, or raises :class:`Refused`, an ``AssertionError`` that names the first property that fails and the
counterexample.  The strategies that draw the cases are public too.

The kit needs hypothesis, ``pip install hypothesis``; nothing else in the package does.

>>> from verification.algorithm.relaxation import Aitken
>>> print(check_rule(Aitken(), examples=5))  # doctest: +ELLIPSIS, +NORMALIZE_WHITESPACE
rule 'aitken'
  stays at the solution holds ...
"""

from __future__ import annotations

try:
    import hypothesis as _hypothesis  # noqa: F401  first, so that a message says that it is missing
except ImportError:
    raise ImportError("verification.testing needs hypothesis: pip install hypothesis") from None

from verification.testing.bounds import check_bound
from verification.testing.laws import check_law
from verification.testing.properties import Finding, Refused, Report
from verification.testing.rules import check_rule
from verification.testing.steps import check_step
from verification.testing.strategies import forces, matrix_pairs, mesh_pairs, pairs, problems, thetas

__all__ = [
    "Finding",
    "Refused",
    "Report",
    "check_bound",
    "check_law",
    "check_rule",
    "check_step",
    "forces",
    "matrix_pairs",
    "mesh_pairs",
    "pairs",
    "problems",
    "thetas",
]

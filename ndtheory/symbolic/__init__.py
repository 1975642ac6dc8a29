"""A second derivation of every algebraic step of the paper, in sympy: proofs and exact counterexamples.

``engine`` decides by the signs that ``quotient`` reads off, ``dimension`` compares units, ``symbols`` is what the
checks share.  ``checks`` lists them: ``mechanics`` (Sections 2 to 4 and 6), ``section5``, and ``further``
(what the paper does not state).
"""

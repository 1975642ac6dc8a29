"""Step II: the contact problem of one body against a given displacement, with a given friction bound.

In v = u1 - u2 (tangential) and v = u1_N - u2_N - gap (normal) it reads::

    minimise  1/2 v' S v - q' v + sum_j bound_j |v_T,j|   subject to  v_N <= 0,   q = l1 - S1 (u2 + gap n),

and the reaction on the other body is ``force = q - S v``.  ``model`` is the program in cvxpy, ``active_set`` solves it
exactly, ``kkt`` certifies either.
"""

from verification.contact.kkt import KKT, TOLERANCE
from verification.contact.step import ContactError, ContactSolution, ContactStep, NoMinimiser, Solver

__all__ = ["KKT", "TOLERANCE", "ContactError", "ContactSolution", "ContactStep", "NoMinimiser", "Solver"]

"""The forces with which a run starts, and the iterates from there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fem1d2d.mesh import Floats
from ndtheory.number import Numeric
from verification.algorithm.fixed_point import FixedPointMap, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.relaxation import Rule, rule_of
from verification.algorithm.theta import choose
from verification.contact import NoMinimiser, Solver
from verification.interface.build import pair_of
from verification.interface.matrices import real_array
from verification.interface.pair import ContactPair
from verification.problem import Problem
from verification.problem.tables import ProblemError
from verification.value import Value

#: Forces below this share of the largest ones of a loading history are none: those that are left where load is taken
#: away, or where contact just closes, are rounding of larger ones, and decay for ever beside themselves.
LEAST = 1e-6

#: A residual below this share of the forces of the bodies tied together is rounding of these.
ROUNDING = 1e-15


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Start(Value):
    """g_0 of a run and where it comes from.

    ``g`` are nodal forces on the Neumann grid, tangential components first; ``why`` says why the run does not start
    from g = 0, empty where it does; ``scale`` is the least size with which the residual is compared, in the norm
    (5.21): 0, or from :func:`least_scale`.
    """

    g: Floats
    source: Literal["zero", "given", "tied"] = "zero"
    why: str = ""
    scale: float = 0.0

    @property
    def summary(self) -> str:
        return f"from {self.source}{': ' if self.why else ''}{self.why}"


def iterate(
    problem: Problem | ContactPair,
    *,
    theta: Numeric | None = None,
    rule: Rule | str | None = None,
    solver: Solver = "auto",
    start: ArrayLike | None = None,
) -> Iterator[Iterate]:
    """Run the algorithm without end; the caller decides when to stop.

    Parameters
    ----------
    problem, theta, rule, solver, start
        As :func:`verification.run` takes them.

    Yields
    ------
    Iterate

    Raises
    ------
    HypothesisError
        theta outside (0, 1).
    ContactError
        Step II did not reach its KKT certificate.

    Examples
    --------
    >>> from itertools import islice
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(2, 1))
    >>> [round(float(step.g[0]), 4) for step in islice(iterate(bars, theta="1/2"), 3)]
    [0.0, 0.1, 0.05]
    """
    pair = pair_of(problem, obstacle=True)
    relaxation, T = rule_of(rule or pair.settings.relaxation), FixedPointMap(pair, solver)
    choice, begun = choose(pair, theta, rule=relaxation), begin_at(T, start)
    return iterates(T, relaxation.begin(pair, float(choice.theta), choice.rho), begun.g, begun.scale)


def begin_at(T: FixedPointMap, given: ArrayLike | None = None) -> Start:
    """Return g_0 of a run: the given one, shape (2 n,), else 0, or the tied solution if step II has no minimiser at 0.

    Where only contact holds the contact body, friction has to resist tangential loads, and at g = 0 the bound
    of friction is 0.

    Raises
    ------
    ProblemError
        A given start of another shape, or not finite.
    ContactError
        Step II has no minimiser at g = 0 nor at the tied solution.
    """
    pair = T.pair
    zero = np.zeros(pair.neumann.grid.size)
    if given is not None:
        g = forces(given, pair)
        return Start(g=g, source="given", why="given", scale=least_scale(T, g))
    if not pair.contact.loose:
        return Start(g=zero)
    try:
        T(zero)
    except NoMinimiser as error:
        g = tied_force(pair)
        try:
            T(g)
        except NoMinimiser:
            raise error from None
        why = f"at g = 0 {error}; the run starts from the solution of the bodies tied together"
        return Start(g=g, source="tied", why=why)
    return Start(g=zero)


def forces(given: ArrayLike, pair: ContactPair, source: str = "") -> Floats:
    """Return a given g_0 as an array, shape (2 n,); errors name ``source``, by default the pair's.

    Raises
    ------
    ProblemError
        Another shape, or an entry that is not finite.
    """
    size = pair.neumann.grid.size
    needed = f"{size} finite nodal forces on the contact nodes of the Neumann body, tangential ones first"
    try:
        return real_array("g", given, (size,), needed)
    except ValueError as error:
        raise ProblemError(source or pair.source, "start", None, str(error)) from None


def tied_force(pair: ContactPair, *, drawn: bool = False) -> Floats:
    """Solve for g of the bodies tied along Gamma_c: ``(S2 + P' S1 P) u2 = l2 + P' (l1 - S1 offset)``.

    The gap is closed, and slip so far is an offset, unless the bodies are tied as they are ``drawn``.  Linear, without
    contact and friction, so that it exists wherever the supports hold the two bodies as one.
    """
    contact, neumann, interface = pair.contact, pair.neumann, pair.interface
    apart = interface.carry(neumann.known) + (0.0 if drawn else pair.offset)
    matrix = neumann.schur + interface.carry_form(contact.schur)
    right = neumann.load + interface.carry_back(contact.load - contact.schur @ apart)
    free = neumann.free
    u = np.zeros(len(right))
    u[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
    force: Floats = np.where(free, neumann.schur @ u - neumann.load, 0.0)
    return force


def tied_size(pair: ContactPair) -> float:
    """Return the size of the forces of the bodies tied as they are drawn, in the norm (5.21).

    It is the stiffness of both bodies times what the loads would move them apart, whatever gap they close before.
    """
    return pair.neumann.dual_norm(tied_force(pair, drawn=True))


def compared_with(pair: ContactPair, start: Start) -> float:
    """Return the least size of the forces with which the residuals of a run are compared, in the norm (5.21).

    Beside the scale of its start it is a share of :func:`tied_size` at which the tolerance is rounding.
    """
    return max(start.scale, min(LEAST, ROUNDING / pair.settings.tolerance) * tied_size(pair))


def least_scale(T: FixedPointMap, g: Floats) -> float:
    """Return the least size of the forces with which a residual is compared, in the norm (5.21).

    It is 0 where the loads press the bodies together: the present forces are the measure then.  Where T 0 = 0 the
    solution has no force at all, a run from another start decays towards it, and the measure is the reaction of the
    tied bodies, or where that is 0 too the start.
    """
    zero = np.zeros(len(g))
    try:
        image = T.pair.interface.carry_back(T(zero)[1].force)
    except NoMinimiser:
        return 0.0
    if image.any():
        return 0.0
    norm = T.pair.neumann.dual_norm
    return norm(tied_force(T.pair)) or norm(g)

"""Equalities of Section 5, and inequalities that come close to them, decided in rationals on one pair of bodies.

The data of a problem are rational, so are its stiffness matrices and what their elimination leaves on Gamma_c.  Step II
is solved in doubles first; the state of each node that comes out turns it into a linear system, whose solution in
rationals is taken only where it satisfies every condition of step II exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d import element
from fem1d2d.proofs.exact import Shapes
from verification.algorithm.fixed_point import FixedPointMap
from verification.certificate.exact_bodies import ExactInterface, exact_points
from verification.interface.body import Condensed, material_of
from verification.interface.pair import pair_from
from verification.ledger.cases import rectangle
from verification.ledger.evidence import Evidence, source
from verification.ledger.inequalities import ENTRIES, terms_of
from verification.problem.specification import Problem

#: Rationals.
Exact = NDArray[Any]

#: Two blocks with three contact nodes and a body inside, on one grid.
BLOCKS: Mapping[str, Any] = {
    "body1": rectangle([0, 2], [-1, 0], [2, 2], 3, "1/4", fixed=["bottom"]),
    "body2": rectangle([0, 2], [0, 1], [2, 2], 2, "1/3", fixed=["top"]),
    "contact": {"friction": "1/2", "radius": 1},
}

#: Two forces on the Neumann body: tangential components from left to right, then normal ones.
FORCES = tuple(
    np.array([Fraction(text) for text in texts.split()], dtype=object)
    for texts in ("1/3 1/5 -2/3 1/2 1/7 -1/2", "-1/2 1/20 2/5 1/3 1/2 1/4")
)

THETA = Fraction(2, 7)


def solved(A: Exact, B: Exact) -> Exact:
    """``A^-1 B`` in rationals, for a positive definite A.

    Examples
    --------
    >>> solved(np.array([[Fraction(2), Fraction(1)], [Fraction(1), Fraction(2)]]), np.array([Fraction(3), Fraction(0)]))
    array([Fraction(2, 1), Fraction(-1, 1)], dtype=object)
    """
    n = len(A)
    rows = np.concatenate([A, B.reshape(n, -1)], axis=1)
    for i in range(n):
        rows[i] = rows[i] / rows[i, i]
        for j in range(n):
            if j != i and rows[j, i]:
                rows[j] = rows[j] - rows[j, i] * rows[i]
    return rows[:, n:].reshape(B.shape)


class ExactSide:
    """A body, condensed to its contact nodes in rationals; ``side`` is the same in doubles.

    ``S`` is what elimination leaves of the stiffness matrix on Gamma_c, ``energy`` the form ``a(R phi, R chi)`` of the
    lifted fields: the same matrix by another way.
    """

    def __init__(self, problem: Problem, side: Condensed) -> None:
        body = side.mesh_body
        spec = getattr(problem, body.name)
        cells = body.mesh.cells
        shapes = Shapes.of(exact_points(spec, body), cells)
        local = element.stiffness(shapes, material_of(spec, Fraction))[shapes.of_cell]
        A = np.full((2 * len(body.mesh.points),) * 2, Fraction(0), dtype=object)
        for corners, entries in zip(cells, local, strict=True):
            unknowns = (2 * corners[:, None] + np.arange(2)).ravel()
            A[np.ix_(unknowns, unknowns)] += entries.reshape(len(unknowns), -1)
        A = A[np.ix_(body.positions, body.positions)]
        b = body.interface
        inside = np.setdiff1d(np.arange(len(A)), b)
        lift = np.full((len(A), len(b)), Fraction(0), dtype=object)
        lift[b] = np.eye(len(b), dtype=int)
        lift[inside] = -solved(A[np.ix_(inside, inside)], A[np.ix_(inside, b)])
        turn = np.ones(len(b), dtype=int)  # normal components as step II has them
        turn[side.grid.normal] = 1 if side.upward else -1
        self.S: Exact = np.outer(turn, turn) * (A[np.ix_(b, b)] + A[np.ix_(b, inside)] @ lift[inside])
        self.energy: Exact = np.outer(turn, turn) * (lift.T @ A @ lift)


@dataclass(frozen=True, kw_only=True, eq=False)
class RationalSolution:
    """Steps I and II for the force g, with ``reaction = T g``, traces w_1 and w_2, and ``bound = w k |S sigma_N|``."""

    g: Exact
    reaction: Exact
    w_1: Exact
    w_2: Exact
    slip: Exact
    bound: Exact
    state: str


class RationalPair:
    """The difference of two solutions of steps I and II for a problem without loads on one grid, all rational."""

    def __init__(self) -> None:
        problem = Problem.from_dict(BLOCKS)
        self.pair = pair = pair_from(problem)
        self.one, self.two = (ExactSide(problem, side) for side in (pair.contact, pair.neumann))
        x = [exact_points(getattr(problem, s.mesh_body.name), s.mesh_body) for s in (pair.contact, pair.neumann)]
        nodes = [p[s.mesh_body.nodes, 0] for p, s in zip(x, (pair.contact, pair.neumann), strict=True)]
        joined = ExactInterface(pair, *nodes)
        k: Any = problem.contact.friction
        self.kernel, self.limits = joined.exact_kernel, k * joined.grid.weights
        self.n = pair.contact.grid.n
        self.solutions = tuple(map(self.solve, FORCES))
        one, other = self.solutions
        self.force, self.reaction = one.g - other.g, one.reaction - other.reaction
        self.d_1, self.d_2 = one.w_1 - other.w_1, one.w_2 - other.w_2
        self.friction = -((one.bound - other.bound) @ (abs(one.slip) - abs(other.slip)))

    def solve(self, g: Exact) -> RationalSolution:
        """Steps I and II; ArithmeticError if the states found in doubles lead to no exact solution."""
        n, S = self.n, self.one.S
        assert self.kernel is not None
        _, found = FixedPointMap(self.pair, "active-set")(g.astype(float))
        touching, sliding = found.pattern.touching, found.pattern.sliding.astype(int)
        w_2, bound = solved(self.two.S, g), self.limits * abs(self.kernel @ g[n:])
        moves = np.concatenate([sliding != 0, ~touching])
        given = np.concatenate([sliding * bound, np.full(n, Fraction(0))])  # forces where a node moves
        v = np.full(2 * n, Fraction(0), dtype=object)
        load = -S @ w_2 - given
        v[moves] = solved(S[np.ix_(moves, moves)], load[moves])
        force = -S @ (w_2 + v)
        slip, press = v[:n], force[n:]
        satisfied = (
            (v[n:] <= 0).all()
            and (press >= 0).all()
            and not (press * v[n:]).any()
            and (abs(force[:n]) <= bound).all()
            and (force[:n] * slip == bound * abs(slip)).all()
        )
        if not satisfied:
            raise ArithmeticError("the states of the nodes in doubles lead to no exact solution of step II")
        state = f"{int(touching.sum())} of {n} nodes touch, {int((sliding != 0).sum())} slip"
        return RationalSolution(g=g, reaction=force, w_1=w_2 + v, w_2=w_2, slip=slip, bound=bound, state=state)

    @cached_property
    def lifts(self) -> tuple[Exact, Exact]:
        """The traces of ``R^2 (T psi - T psi~)`` and of ``R^2 (psi - psi~)`` (5.20)."""
        return solved(self.two.S, self.reaction), solved(self.two.S, self.force)

    def square(self, force: Exact) -> Fraction:
        """The square of the norm (5.21)."""
        return _number(force @ solved(self.two.S, force))

    @property
    def inner(self) -> Fraction:
        """``a^2(R^2 (T psi - T psi~), R^2 (psi - psi~))``."""
        return _number(self.lifts[0] @ self.two.energy @ self.lifts[1])

    @property
    def mixed_2(self) -> Fraction:
        """``a^2(R^2 (T psi - T psi~), w^2 - w~^2)``."""
        return _number(self.lifts[0] @ self.two.energy @ self.d_2)

    @property
    def work(self) -> Fraction:
        """``<T psi - T psi~, w^2 - w~^2>``."""
        return _number(self.reaction @ self.d_2)

    @property
    def energy_1(self) -> Fraction:
        """``a^1(w^1 - w~^1, w^1 - w~^1)``."""
        return _number(self.d_1 @ self.one.energy @ self.d_1)

    @property
    def mixed_1(self) -> Fraction:
        """``a^1(w^1 - w~^1, R_D^1 (w^2 - w~^2))``."""
        return _number(self.d_2 @ self.one.energy @ self.d_1)

    def relaxed(self, theta: Fraction) -> Fraction:
        """``|||T_theta psi - T_theta psi~|||^2`` (5.7)."""
        return self.square(theta * self.reaction + (1 - theta) * self.force)


def _number(product: Any) -> Fraction:
    """A product of vectors of rationals, which numpy returns as an object."""
    return Fraction(product)


#: Both sides of equalities between squares of norms, and between vectors; the search has the other formulas.
OWN: Mapping[str, Callable[[RationalPair], tuple[Any, Any]]] = {
    "5.17": lambda d: (d.reaction, -d.one.energy @ d.d_1),
    "5.24": lambda d: (
        d.relaxed(THETA),
        THETA**2 * d.square(d.reaction) + (1 - THETA) ** 2 * d.square(d.force) + 2 * THETA * (1 - THETA) * d.inner,
    ),
}

#: The equalities, and the inequalities that come close to one.
IDS = (*OWN, "5.25", "5.26", "5.27", "5.12", "5.28")


def both_sides(id: str, pair: RationalPair) -> tuple[Any, Any]:
    """Both sides: numbers or vectors."""
    if id in OWN:
        return OWN[id](pair)
    left, right = ENTRIES[id, "printed"].left, ENTRIES[id, "printed"].right
    return sum(terms_of(left(pair, None, None))), sum(terms_of(right(pair, None, None)))


def decided(id: str, pair: RationalPair) -> list[Evidence]:
    """The evidence of an equality or inequality; nothing is rounded, so that there always is some."""
    left, right = both_sides(id, pair)
    holds = bool(np.all(left == right) if ENTRIES[id, "printed"].equality else left <= right)
    apart = max(map(abs, np.atleast_1d(left - right)))
    said = "both sides are equal" if not apart else f"left {'<' if np.all(left <= right) else '>'} right"
    states = "; ".join(solution.state for solution in pair.solutions)
    where = f"two blocks of {len(pair.one.S) // 2} contact nodes, one force: {states.replace('; ', '; the other: ')}"
    data = {
        "where": where,
        "problem": {name: dict(table) for name, table in BLOCKS.items()},
        "forces": [[str(value) for value in solution.g] for solution in pair.solutions],
        "difference": str(apart),
    }
    text = f"{said} ({where}), computed in rationals"
    return [Evidence(method="verified", of="printed", holds=holds, text=text, data=data)]


#: Equalities on one pair of bodies, decided in rationals, the same at both levels.
in_rationals = source({id: partial(decided, id) for id in IDS}, lambda level, watch: RationalPair())

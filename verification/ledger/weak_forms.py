"""The weak forms of the paper on whole bodies: each equation as a residual, each inequality as left minus right side.

The algorithm works only on the interface, with condensed matrices.  Here a displacement is the field of a whole body,
``a`` and ``L`` are its stiffness matrix and its load, and lifts are solved for anew: a second path to the same numbers.

Indices are the paper's: body 1 is the contact body, body 2 the Neumann body.  Normal components are along n^1, and an
initial gap d, which the paper does not have, turns ``[v_N] <= 0`` into ``[v_N] <= d``.  Traces and forces are on the
grid of their body; where the grids differ v^2 enters a jump, K and R_D^1 as ``P v^2`` at the contact nodes.

Test functions are random ones and those for which an inequality is close to equality.  Values of a check on several
problems become evidence by :func:`equations` and :func:`inequalities`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem1d2d import solver
from fem1d2d.mesh import Floats
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.algorithm.monolithic import solve
from verification.algorithm.runs import Run, run
from verification.contact import ContactError
from verification.interface.body import Body, Condensed
from verification.interface.pair import ContactPair, pair_from
from verification.ledger.cases import PROBLEMS, curved, drawn
from verification.ledger.evidence import Evidence, Level, figure
from verification.problem.specification import Problem

#: Every draw of random numbers starts from it.
SEED = 2008

#: An equation holds below this relative residual, and an inequality above minus it.
EXACT = 1e-10

#: The same at the limit of a run, whose residual is at most :data:`verification.ledger.cases.TOLERANCE`.
LIMIT = 1e-9

#: Distances to the solution below this share of its norm are not compared step by step: they contain rounding.
CLEAR = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Fields:
    """Displacements of both bodies, or columns of them: the unknowns of body 1 and of body 2."""

    one: Floats
    two: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Weak:
    """The weak forms of a pair of bodies, in displacements of all their nodes."""

    pair: ContactPair

    @property
    def one(self) -> Body:
        """The contact body."""
        return self.pair.contact.mesh_body

    @property
    def two(self) -> Body:
        """The Neumann body."""
        return self.pair.neumann.mesh_body

    @cached_property
    def _lifts(self) -> dict[str, Any]:
        inside: dict[str, Any] = {}
        for body in (self.one, self.two):
            rows = np.setdiff1d(np.arange(len(body.positions)), body.interface)
            inside[body.name] = rows, solver(body.stiffness[rows][:, rows])
        return inside

    def lift(self, body: Body, trace: Floats) -> Floats:
        """R_D phi of (4.5)."""
        rows, solved = self._lifts[body.name]
        field = np.zeros((len(body.positions), *trace.shape[1:]))
        field[body.interface] = self._side(body).orient(trace)
        field[rows] = -solved(np.asarray(body.stiffness[rows][:, body.interface] @ field[body.interface]))
        return field

    def _side(self, body: Body) -> Condensed:
        return self.pair.contact if body is self.one else self.pair.neumann

    def trace(self, body: Body, field: Floats) -> Floats:
        """gamma v on Gamma_c, tangential components first."""
        return self._side(body).orient(field[body.interface])

    def carried(self, two: Floats) -> Floats:
        """gamma v of body 2 as body 1 feels it: at the contact nodes."""
        return self.pair.interface.carry(self.trace(self.two, two))

    def excess(self, body: Body, field: Floats) -> Floats:
        """``a(u, .) - L(.)`` on the unknowns; on Gamma_c the nodal forces ``sigma n`` of the body."""
        return np.asarray(body.stiffness @ field - body.load)

    def force(self, body: Body, field: Floats) -> Floats:
        """Nodal forces ``sigma n`` on Gamma_c."""
        return self.trace(body, self.excess(body, field))

    def jump(self, one: Floats, two: Floats) -> Floats:
        """``v^1 - v^2`` on Gamma_c, less the initial gap in the normal components."""
        jump = self.trace(self.one, one) - self.carried(two)
        return jump - self.pair.offset.reshape(-1, *[1] * (jump.ndim - 1))

    def bound(self, two: Floats) -> Floats:
        """``w_j k |S sigma_N|`` at the contact nodes, sigma_N that of body 2."""
        return self.pair.bound(self.force(self.two, two))

    @cached_property
    def _riesz(self) -> Any:
        return solver(self.two.gram_matrix)

    def dual(self, force: Floats) -> float:
        """The norm of nodal forces on Gamma_c in the dual of V^2, from the whole Gram matrix."""
        load = np.zeros(len(self.two.positions))
        load[self.two.interface] = self.pair.neumann.orient(force)
        return float(np.sqrt(max(float(load @ self._riesz(load)), 0.0)))

    def energy(self, fields: Fields) -> Floats:
        """``sqrt(a(v, v))`` of the unknowns, for each column."""
        squares = [_dot(v, body.stiffness @ v) for body, v in ((self.one, fields.one), (self.two, fields.two))]
        return np.asarray(np.sqrt(squares[0] + squares[1]))

    def of(self, displacements: tuple[Floats | None, Floats | None]) -> Fields:
        """The unknowns of two displacement fields, the lower body's first."""
        first, second = (
            body.of_nodes(displacement) if displacement is not None else np.zeros(len(body.positions))
            for body, displacement in zip(self.pair.on_meshes().elastic, displacements, strict=True)
        )
        return Fields(one=first, two=second) if self.pair.neumann_body == 2 else Fields(one=second, two=first)

    def at(self, state: Iterate) -> Fields:
        """``w^1`` and ``w^2`` of (5.5) and (5.6), steps II and I of an evaluation of T."""
        pair = self.pair
        moved = pair.interface.carry(state.displacement) + state.contact.v + pair.offset
        traces = {self.one.name: pair.contact.orient(moved), self.two.name: pair.neumann.orient(state.displacement)}
        body1, body2 = pair.on_meshes().elastic
        return self.of((body1.displacement(traces["body1"]), body2.displacement(traces["body2"])))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("i...,i...->...", a, b))


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A problem with its solution by the global method and its run."""

    name: str
    problem: Problem

    @cached_property
    def weak(self) -> Weak:
        """The weak forms."""
        return Weak(pair=pair_from(self.problem))

    @property
    def grids_differ(self) -> bool:
        """True if the bodies have different grids along Gamma_c."""
        return not self.weak.pair.interface.one_grid

    @cached_property
    def solution(self) -> Fields:
        """The solution of the global method."""
        return self.weak.of(solve(self.weak.pair).displacements)

    @cached_property
    def run(self) -> Run:
        """The run from g = 0."""
        return run(self.weak.pair, solver="active-set")

    @cached_property
    def limit(self) -> Fields:
        """The displacements at the end of the run."""
        return self.weak.of(self.run.displacements)

    @cached_property
    def steps(self) -> list[tuple[Iterate, Iterate]]:
        """Some of the run's steps: the first ones, one in the middle, the last one."""
        states = self.run.iterates
        chosen = sorted({0, 1, 2, len(states) // 2, len(states) - 2} & set(range(len(states) - 1)))
        return [(states[i], states[i + 1]) for i in chosen]

    @cached_property
    def g(self) -> Floats:
        """The nodal forces on body 2 at the solution."""
        return self.weak.force(self.weak.two, self.solution.two)

    @cached_property
    def arbitrary(self) -> list[Iterate]:
        """T at random forces: small and large, pressing and pulling."""
        rng = generator("arbitrary")
        size = np.abs(self.g).max() or 1.0
        scales = size * 10.0 ** rng.uniform(-1, 1, 6)
        return [
            image_of(self.weak.pair, s * rng.standard_normal(len(self.g)) + o * self.g)
            for s, o in zip(scales, (0, 0, 0, 1, 1, -1), strict=True)
        ]


def image_of(pair: ContactPair, psi: Floats) -> Iterate:
    """T at a force: by the active set, and by the convex program where that does not close."""
    try:
        return iterate_at(FixedPointMap(pair, "active-set"), psi)
    except ContactError:
        return iterate_at(FixedPointMap(pair), psi)


def generator(key: str) -> np.random.Generator:
    return np.random.default_rng([SEED, *key.encode()])


def cases(level: Level) -> list[Case]:
    """The problems of a level: quick takes the list, full halves their meshes too and draws more at random."""
    named = {name: Problem.from_dict(data) for name, data in PROBLEMS.items()}
    if level == "full":
        named |= {f"{name}, halved": problem.refined(1) for name, problem in list(named.items())}
        named |= {f"random {i}": Problem.from_dict(drawn(generator(f"problem {i}"))) for i in range(24)}
        named |= {f"curved {i}": Problem.from_dict(curved(generator(f"curve {i}"))) for i in range(6)}
    return [Case(name=name, problem=problem) for name, problem in named.items()]


# The statements, as numbers that should vanish or be non-negative; each relative to what its terms are made of.


def unilateral(weak: Weak, u: Fields) -> Floats:
    """(2.4) with sigma_N of body 1: the largest violations of ``[u_N] <= 0``, ``sigma_N <= 0``, ``sigma_N [u_N] = 0``.

    Lengths are relative to the largest displacement.  P' has negative entries: where the grids differ sigma_N of body 2
    may have the other sign at some node.
    """
    normal, one = weak.pair.contact.grid.normal, -weak.force(weak.one, u.one)
    jump = weak.jump(u.one, u.two)[normal] / largest(u)
    pressure = one[normal] / (np.abs(one).max() or 1.0)
    return np.array([np.max(values, initial=0.0) for values in (jump, -pressure, np.abs(pressure * jump))])


def coulomb(weak: Weak, u: Fields) -> Floats:
    """(2.6) with sigma_T of body 1: largest violations of ``|sigma_T| <= b`` and ``b |[u_T]| + sigma_T [u_T] = 0``."""
    t = weak.pair.contact.grid.tangential
    force, bound, jump = weak.force(weak.one, u.one)[t], weak.bound(u.two), weak.jump(u.one, u.two)[t]
    forces = float(np.abs(weak.force(weak.two, u.two)).max()) or 1.0
    beyond, work = (np.abs(force) - bound) / forces, np.abs(bound * np.abs(jump) + force * jump) / forces / largest(u)
    return np.array([np.max(values, initial=0.0) for values in (beyond, work)])


def reaction(weak: Weak, u: Fields) -> dict[str, float]:
    """(2.3): differences of the stress components of the two bodies, relative to the largest nodal force.

    The forces of body 1 as body 2 receives them.
    """
    t, normal = weak.pair.neumann.grid.tangential, weak.pair.neumann.grid.normal
    one, two = weak.pair.interface.carry_back(weak.force(weak.one, u.one)), weak.force(weak.two, u.two)
    forces = float(np.abs(two).max()) or 1.0
    worst = lambda values: float(np.max(np.abs(values), initial=0.0)) / forces
    # sigma_N^a is the component along n^a, and both lists of forces are along n^1 = -n^2
    return {
        "sigma_N^1 = sigma_N^2": worst(one[normal] - -two[normal]),
        "sigma_T^1 = sigma_T^2": worst(one[t] - two[t]),
        "sigma_T^1 = -sigma_T^2": worst(one[t] + two[t]),
    }


def inequality(weak: Weak, u: Fields, d: Fields) -> Floats:
    """(4.4): left minus right side for columns ``d = v - u``, relative to ``|u| |d|`` in the norm of a."""
    work = weak.excess(weak.one, u.one) @ d.one + weak.excess(weak.two, u.two) @ d.two
    value = work + _friction_of_move(weak, u, weak.trace(weak.one, d.one) - weak.carried(d.two))
    return _of_move(weak, u, value, weak.energy(d))


def contact_inequality(weak: Weak, u: Fields, d: Floats) -> Floats:
    """(5.3), (5.5): left minus right side for columns ``d = v - u^1``, relative to ``|u| |d|``."""
    work = weak.excess(weak.one, u.one) @ d
    return _of_move(weak, u, work + _friction_of_move(weak, u, weak.trace(weak.one, d)), norm(weak.one, d))


def shifted_inequality(weak: Weak, u: Fields, w: Floats) -> Floats:
    """(4.9) II with the jump, (5.2): left minus right side for columns w, relative to ``|u| |w + R u^2 - u^1|``."""
    t = weak.pair.contact.grid.tangential
    d = w + (weak.lift(weak.one, weak.carried(u.two)) - u.one)[:, None]
    slides = np.abs(weak.trace(weak.one, w)[t]) - np.abs(weak.jump(u.one, u.two)[t])[:, None]
    return _of_move(weak, u, weak.excess(weak.one, u.one) @ d + weak.bound(u.two) @ slides, norm(weak.one, d))


def _friction_of_move(weak: Weak, u: Fields, moved: Floats) -> Floats:
    """``j(v) - j(u)`` where the jump moves."""
    t = weak.pair.contact.grid.tangential
    jump = weak.jump(u.one, u.two)[t][:, None]
    return np.asarray(weak.bound(u.two) @ (np.abs(jump + moved[t]) - np.abs(jump)))


def neumann_equation(weak: Weak, two: Floats, psi: Floats, v: Floats) -> Floats:
    """(4.9) I, (5.6): ``a^2(u^2, v) - L^2(v) - <psi, v>``, relative to ``|u^2| |v|``."""
    rest = weak.excess(weak.two, two) @ v - psi @ weak.trace(weak.two, v)
    return _over(np.abs(rest), norm(weak.two, two) * norm(weak.two, v))


def transfer(weak: Weak, u: Fields, image: Floats, v: Floats) -> Floats:
    """(4.9) III, (5.4): ``<T psi, v> + a^1(u^1, R v) - L^1(R v)``, relative to ``|u| |R v|``."""
    lifted = weak.lift(weak.one, weak.carried(v))
    rest = image @ weak.trace(weak.two, v) + weak.excess(weak.one, u.one) @ lifted
    return _over(np.abs(rest), weak.energy(u) * norm(weak.one, lifted))


def balance(weak: Weak, u: Fields, v: Floats) -> Floats:
    """(5.1): ``a^2(u^2, v) - L^2(v) + a^1(u^1, R v) - L^1(R v)``, relative to ``|u| |v|``."""
    lifted = weak.lift(weak.one, weak.carried(v))
    rest = weak.excess(weak.two, u.two) @ v + weak.excess(weak.one, u.one) @ lifted
    return _over(np.abs(rest), weak.energy(u) * (norm(weak.two, v) + norm(weak.one, lifted)))


def norm(body: Body, field: Floats) -> Floats:
    return np.asarray(np.sqrt(_dot(field, body.stiffness @ field)))


def _of_move(weak: Weak, u: Fields, value: Floats, size: Floats) -> Floats:
    """A value over the energy norms of u and of ``v - u``; the latter at least 1e-5 of u: what is less is rounding."""
    energy = weak.energy(u)
    return _over(value, energy * np.maximum(size, 1e-5 * energy))


def _over(value: Floats, scale: Floats) -> Floats:
    """The quotient; 0 where both vanish."""
    return np.asarray(np.divide(value, scale, out=np.zeros(np.broadcast(value, scale).shape), where=scale > 0))


# Test functions.


def directions(rng: np.random.Generator, body: Body, count: int) -> Floats:
    """Rough and smooth random fields of a body, largest value 1, as columns."""
    rough = rng.standard_normal((len(body.positions), count))
    smooth = body.solve(rng.standard_normal((len(body.positions), count)))
    columns = np.concatenate([rough, smooth], axis=1)
    return np.asarray(columns / np.abs(columns).max(axis=0))


def hats(body: Body) -> Floats:
    """Both signs of the hat function of every interface unknown, as columns."""
    columns = np.zeros((len(body.positions), len(body.interface)))
    columns[body.interface, np.arange(len(body.interface))] = 1.0
    return np.concatenate([columns, -columns], axis=1)


def closing(weak: Weak, u: Fields) -> Floats:
    """Moves of body 1 by hat functions that undo the jump of u at one node, in one direction."""
    count = len(weak.one.interface)
    return np.asarray(hats(weak.one)[:, :count] * -weak.pair.contact.orient(weak.jump(u.one, u.two)))


def _sizes(rng: np.random.Generator, size: float, count: int) -> Floats:
    return np.asarray(size * 10.0 ** rng.uniform(-4, 1, count))


def moves_in_K(weak: Weak, u: Fields, rng: np.random.Generator, count: int) -> Fields:
    """Columns ``v - u`` with v in K: random fields, hat functions on one body, on the other and on both, closing moves.

    Where a column would penetrate one of the bodies gives way; where the grids differ it is body 1, node by node.
    """
    size = largest(u)
    one, two = (directions(rng, body, count) for body in (weak.one, weak.two))
    hat_1, hat_2 = hats(weak.one), hats(weak.two)
    still_1, still_2 = np.zeros((len(u.one), hat_2.shape[1])), np.zeros((len(u.two), hat_1.shape[1]))
    with_2 = still_1.copy()
    with_2[weak.one.interface] = weak.pair.contact.orient(weak.carried(hat_2))
    columns_1 = np.concatenate([one, hat_1, still_1, with_2] * 2 + [100 * one], axis=1)
    columns_2 = np.concatenate([two, still_2, hat_2, hat_2] * 2 + [100 * two], axis=1)
    sizes = _sizes(rng, size, columns_1.shape[1])
    undone = closing(weak, u)
    one = np.concatenate([sizes * columns_1, undone], axis=1)
    two = np.concatenate([sizes * columns_2, np.zeros((len(u.two), undone.shape[1]))], axis=1)
    normal, up = weak.pair.contact.grid.normal, weak.pair.normal_sign
    rows = weak.one.interface[normal]
    room = -weak.jump(u.one, u.two)[normal][:, None]
    one_grid = weak.pair.interface.one_grid
    first = (rng.random(one.shape[1]) < 0.5) | (not one_grid)
    above = up * one[rows], weak.carried(two)[normal]
    if one_grid:
        two[weak.two.interface[normal]] = up * np.where(first, above[1], np.maximum(above[1], above[0] - room))
    one[rows] = up * np.where(first, np.minimum(above[0], above[1] + room), above[0])
    return Fields(one=one, two=two)


def moves_of_one(weak: Weak, u: Fields, rng: np.random.Generator, count: int) -> Floats:
    """Columns ``v - u^1`` with v in V^1_-(u^2_N): random fields, hat functions, closing moves."""
    random, hat = directions(rng, weak.one, count), hats(weak.one)
    columns = np.concatenate([random, hat, hat, 100 * random], axis=1)
    d = np.concatenate([_sizes(rng, largest(u), columns.shape[1]) * columns, closing(weak, u)], axis=1)
    normal, up = weak.pair.contact.grid.normal, weak.pair.normal_sign
    rows = weak.one.interface[normal]
    d[rows] = up * np.minimum(up * d[rows], -weak.jump(u.one, u.two)[normal][:, None])
    return np.asarray(d)


def obstacle_tests(weak: Weak, u: Fields, rng: np.random.Generator, count: int) -> Floats:
    """Columns w of V^1_-(0): random ones, and ``u^1 - R u^2`` moved as in ``moves_of_one``."""
    body, normal, up = weak.one, weak.pair.contact.grid.normal, weak.pair.normal_sign
    random, hat = directions(rng, body, count), hats(body)
    start = u.one - weak.lift(body, weak.carried(u.two))
    columns = np.concatenate([random, hat, hat], axis=1)
    moves = np.concatenate([_sizes(rng, largest(u), columns.shape[1]) * columns, closing(weak, u)], axis=1)
    w = np.concatenate([start[:, None] + moves, 10 * largest(u) * random], axis=1)
    rows = body.interface[normal]
    w[rows] = up * np.minimum(up * w[rows], weak.pair.interface.gap[:, None])
    return w


def largest(u: Fields) -> float:
    return float(max(np.abs(u.one).max(), np.abs(u.two).max()))


# Evidence.


@dataclass(frozen=True)
class Found:
    """Values of a check on one problem, and their limit."""

    case: Case
    values: Floats
    limit: float = EXACT


def on_problems(found: Iterable[Case]) -> str:
    """The number of problems, and of those with grids that differ."""
    problems = {case.name: case.grids_differ for case in found}
    apart = sum(problems.values())
    return f"{len(problems)} problems" + (f", of which {apart} have grids that differ" if apart else "")


def equations(of: Any, text: str, found: Sequence[Found], **data: Any) -> Evidence:
    """All values at most their limits; rounding is not reported, only that it is below the limit."""
    top, where, holds = _worst(found, 1)
    data = _data(found, data)
    limit = data["limit"]
    if holds:
        seen = f"relative residuals below {limit:g} in {data['cases']} cases on {on_problems(f.case for f in found)}"
        return evidence(of, True, f"{text}: {seen}", data)
    data |= {"worst": top, "where": where}
    return evidence(of, False, f"{text}: a relative residual of {top:.3g} ({where}); needed {limit:g}", data)


def inequalities(of: Any, text: str, found: Sequence[Found], **data: Any) -> Evidence:
    """All values at least minus their limits."""
    low, where, holds = _worst(found, -1)
    # a figure far from rounding, and from the test functions that barely leave u
    most = max(float(f.values.max(initial=0.0)) for f in found)
    data = _data(found, data) | {"largest": figure(most)}
    if holds:
        ends = f"between -{data['limit']:g} and {most:.3g} for {data['cases']} test functions"
        problems = on_problems(f.case for f in found)
        return evidence(of, True, f"{text}: left minus right over its scale {ends} on {problems}", data)
    data |= {"worst": low, "where": where}
    return evidence(of, False, f"{text}: left minus right is {low:.3g} of its scale ({where})", data)


def _worst(found: Sequence[Found], sign: int) -> tuple[float, str, bool]:
    """The value that is largest relative to its limit, times the sign; its problem; True if all are at most theirs."""
    size = lambda f: float((sign * f.values).max(initial=0.0))
    worst = max(found, key=lambda f: size(f) / f.limit)
    return sign * size(worst), worst.case.name, all(size(f) <= f.limit for f in found)


def _data(found: Sequence[Found], data: Mapping[str, Any]) -> dict[str, Any]:
    names, limit = list(dict.fromkeys(f.case.name for f in found)), max(f.limit for f in found)
    return {"seed": SEED, "problems": names, "cases": sum(f.values.size for f in found), **data, "limit": limit}


def evidence(of: Any, holds: bool | None, text: str, data: Mapping[str, Any]) -> Evidence:
    return Evidence(method="discrete", of=of, holds=holds, text=text, data=data)


def figures(values: Floats, size: float) -> list[float]:
    """Six digits relative to a size; what is smaller may be rounding."""
    return [figure(v) + 0.0 for v in np.round(values / size, 6) * size]


def with_friction(found: Sequence[Case]) -> list[Case]:
    return [case for case in found if float(case.problem.contact.friction) > 0]

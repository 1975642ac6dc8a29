"""The weak forms of the paper on whole bodies: each equation as a residual, each inequality as left minus right side.

The algorithm works on the interface alone, with condensed matrices.  Here a displacement is the field of a whole body,
``a`` and ``L`` are its stiffness matrix and its load, and lifts are solved for anew: a second path to the same numbers.

Indices are the paper's: body 1 is the contact body, body 2 the Neumann body.  Normal components are along n^1, and an
initial gap d, which the paper does not have, turns ``[v_N] <= 0`` into ``[v_N] <= d``.  Traces and forces are on the
grid of their body; where the grids differ v^2 enters a jump, K and R_D^1 as ``P v^2`` at the contact nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem1d2d import solver
from fem1d2d.mesh import Floats
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.algorithm.runs import Run, run
from verification.contact import ContactError
from verification.interface.body import Body, Condensed
from verification.interface.pair import ContactPair, pair_from
from verification.ledger.evidence import Level
from verification.ledger.field_problems import PROBLEMS, drawn
from verification.monolithic import solve
from verification.problem.specification import Problem

#: Every draw of random numbers starts from it.
SEED = 2008

#: An equation holds below this relative residual, and an inequality above minus it.
EXACT = 1e-10

#: The same at the limit of a run, whose residual is at most :data:`verification.ledger.field_problems.TOLERANCE`.
LIMIT = 1e-9

#: Distances to the solution below this share of its norm are not compared step by step: rounding stands behind them.
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
        jump[self.pair.contact.grid.normal] -= self.pair.interface.gap.reshape(-1, *[1] * (jump.ndim - 1))
        return jump

    def bound(self, two: Floats) -> Floats:
        """``w_j k |S sigma_N|`` at the contact nodes, sigma_N that of body 2."""
        return self.pair.bound(self.force(self.two, two))

    def energy(self, fields: Fields) -> Floats:
        """``sqrt(a(v, v))`` of the unknowns, for each column."""
        squares = [_dot(v, body.stiffness @ v) for body, v in ((self.one, fields.one), (self.two, fields.two))]
        return np.asarray(np.sqrt(squares[0] + squares[1]))

    def of(self, displacements: tuple[Floats | None, Floats | None]) -> Fields:
        """The unknowns of two displacement fields, the lower body's first."""
        first, second = (
            displacement.ravel()[body.positions] if displacement is not None else np.zeros(len(body.positions))
            for body, displacement in zip(self.pair.on_meshes().elastic, displacements, strict=True)
        )
        return Fields(one=first, two=second) if self.pair.neumann_body == 2 else Fields(one=second, two=first)

    def at(self, state: Iterate) -> Fields:
        """``w^1`` and ``w^2`` of (5.5) and (5.6), steps II and I of an evaluation of T."""
        pair = self.pair
        moved = pair.interface.carry(state.displacement) + state.contact.v
        moved[pair.contact.grid.normal] += pair.interface.gap
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
        """Whether the bodies have different grids along Gamma_c."""
        return self.weak.pair.interface.transfer is not None

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
    return [Case(name=name, problem=problem) for name, problem in named.items()]


# The statements, as numbers that should vanish or be non-negative; each relative to what its terms are made of.


def unilateral(weak: Weak, u: Fields) -> dict[str, float]:
    """(2.4) with sigma_N of body 1: the largest violation of each condition, lengths over the largest displacement.

    P' has negative entries, so that where the grids differ sigma_N of body 2 may have the other sign at some node.
    """
    normal, one = weak.pair.contact.grid.normal, -weak.force(weak.one, u.one)
    jump = weak.jump(u.one, u.two)[normal] / max(np.abs(u.one).max(), np.abs(u.two).max())
    pressure = one[normal] / (np.abs(one).max() or 1.0)
    worst = lambda values: float(np.max(values, initial=0.0))
    return {
        "[u_N] <= 0": worst(jump),
        "sigma_N <= 0": worst(-pressure),
        "sigma_N [u_N] = 0": worst(np.abs(pressure * jump)),
    }


def coulomb(weak: Weak, u: Fields) -> dict[str, float]:
    """(2.6) with the tangential stress of body 1: the largest violation of each line."""
    t = weak.pair.contact.grid.tangential
    force, bound, jump = weak.force(weak.one, u.one)[t], weak.bound(u.two), weak.jump(u.one, u.two)[t]
    forces = float(np.abs(weak.force(weak.two, u.two)).max()) or 1.0
    lengths = float(max(np.abs(u.one).max(), np.abs(u.two).max()))
    worst = lambda values: float(np.max(values, initial=0.0))
    return {
        "|sigma_T| <= k|S(sigma_N)|": worst((np.abs(force) - bound) / forces),
        "k|S(sigma_N)||[u_T]| + sigma_T [u_T] = 0": worst(
            np.abs(bound * np.abs(jump) + force * jump) / forces / lengths
        ),
    }


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
    return _over(value, weak.energy(u) * _moved(weak.energy(d), weak.energy(u)))


def contact_inequality(weak: Weak, u: Fields, d: Floats) -> Floats:
    """(5.3), (5.5): left minus right side for columns ``d = v - u^1``, relative to ``|u| |d|``."""
    work = weak.excess(weak.one, u.one) @ d
    value = work + _friction_of_move(weak, u, weak.trace(weak.one, d))
    return _over(value, weak.energy(u) * _moved(norm(weak.one, d), weak.energy(u)))


def shifted_inequality(weak: Weak, u: Fields, w: Floats) -> Floats:
    """(4.9) II with the jump, (5.2): left minus right side for columns w, relative to ``|u| |w + R u^2 - u^1|``."""
    t = weak.pair.contact.grid.tangential
    d = w + (weak.lift(weak.one, weak.carried(u.two)) - u.one)[:, None]
    slides = np.abs(weak.trace(weak.one, w)[t]) - np.abs(weak.jump(u.one, u.two)[t])[:, None]
    value = weak.excess(weak.one, u.one) @ d + weak.bound(u.two) @ slides
    return _over(value, weak.energy(u) * _moved(norm(weak.one, d), weak.energy(u)))


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


def _moved(d: Floats, u: Floats) -> Floats:
    """The size of ``v - u``, at least a small share of u: a v cut back to u differs by rounding alone."""
    return np.maximum(d, 1e-5 * u)


def _over(value: Floats, scale: Floats) -> Floats:
    """The quotient; 0 where both vanish."""
    return np.asarray(np.divide(value, scale, out=np.zeros(np.broadcast(value, scale).shape), where=scale > 0))

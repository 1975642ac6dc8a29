"""Convergence of the iteration: (3.1) III, Proposition 5.1, Theorem 5.9 and (5.47), compared with runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from fem1d2d import mortar
from fem1d2d.mesh import Floats
from ndtheory import EDITIONS, evaluate, evaluate_energy
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.iterate import Iterate
from verification.algorithm.theta import CLOSEST_TO_ONE
from verification.constants import measure
from verification.contact import ContactError
from verification.dense import symmetric
from verification.interface.body import Body
from verification.ledger.cases import CONVERGENT, PLANE
from verification.ledger.evidence import Evidence, Level, figure
from verification.ledger.inequalities import Reading
from verification.ledger.weak_forms import (
    CLEAR,
    EXACT,
    LIMIT,
    Case,
    Found,
    Weak,
    cases,
    equations,
    evidence,
    image_of,
    on_problems,
)
from verification.problem.specification import Problem

#: Steps of (3.1) with the printed sign.
STEPS = 200


def distances(case: Case, sign: int, steps: int) -> Floats:
    """``|||g_i - g||| / |||g|||`` along ``g_i = sign theta (T g) + (1 - theta) g_{i-1}``, from g_0 = 0."""
    pair, theta = case.weak.pair, float(case.run.theta)
    g, size = np.zeros_like(case.g), pair.neumann.dual_norm(case.g) or 1.0
    T, result = FixedPointMap(pair, "active-set"), []
    for _ in range(steps):
        result.append(pair.neumann.dual_norm(g - case.g) / size)
        if result[-1] <= LIMIT:
            break
        try:
            image = pair.interface.carry_back(T(g)[1].force)
        except ContactError:
            image = image_of(pair, g).image
        g = sign * theta * image + (1 - theta) * g
    return np.array(result)


def strong_form(setting: RunsOfLevel) -> list[Evidence]:
    """Step III of (3.1): ``sigma^1 n^1`` is minus T g, so that the printed sign is that of minus T g."""
    loaded = [case for case in setting.cases if np.abs(case.g).any()]
    printed = {case.name: distances(case, -1, STEPS) for case in loaded}
    repaired = {case.name: distances(case, +1, 3000) for case in loaded}
    nearest = {name: float(d[1:].min()) for name, d in printed.items()}
    where = min(nearest, key=lambda name: figure(nearest[name], 3))
    data = {"problems": list(printed), "steps": STEPS, "limit": LIMIT}
    text = (
        f"with +theta sigma^1 n^1 no g_i of {STEPS} steps is closer to the solution g than {nearest[where]:.3g} of its"
        f" norm, in any of {len(nearest)} problems; a step from g itself leads to (1 - 2 theta) g"
    )
    slowest = max(repaired, key=lambda name: len(repaired[name]))
    good = all(d[-1] <= LIMIT for d in repaired.values())
    seen = f"with -theta it falls below {LIMIT:g} within {len(repaired[slowest]) - 1} steps in each"
    if not good:
        bad = max(repaired, key=lambda name: repaired[name][-1])
        seen = f"with -theta a distance of {repaired[bad][-1]:.3g} is left ({bad})"
    return [
        evidence(
            "printed",
            nearest[where] <= LIMIT,
            text,
            data | {"nearest": {name: figure(d, 3) for name, d in nearest.items()}, "where": where},
        ),
        evidence("repaired", good, seen, data | {"iterations": {n: len(d) - 1 for n, d in repaired.items()}}),
    ]


def size(body: Body, field: Floats) -> float:
    """The H1 norm."""
    return float(np.sqrt(field @ (body.gram_matrix @ field)))


def strong_convergence(weak: Weak, states: Sequence[Iterate], theta: float, m: float) -> Floats:
    """Proposition 5.1: left side of its estimate over the right side, for pairs of steps of a run."""
    fields = [weak.at(state) for state in states[:-1]]
    dual = lambda i, j: weak.dual(states[i].g - states[j].g)
    result = []
    for i in range(len(fields)):
        for j in range(i):
            difference = fields[i].one - fields[j].one
            lifted = size(weak.two, weak.lift(weak.two, weak.trace(weak.one, difference)))
            right = (dual(i, j) + dual(i + 1, i) + dual(j + 1, j)) * lifted / (theta * m)
            result.append(size(weak.one, difference) ** 2 / right if right > 0 else 0.0)
    return np.array(result)


def by_lemma_5_3(weak: Weak, states: Sequence[Iterate], factor: float) -> Floats:
    """``|u_i^1 - u_j^1|_1`` over ``factor |g_{i-1} - g_{j-1}|`` in the dual of V^2, for pairs of steps of a run."""
    fields = [weak.at(state) for state in states]
    pairs = combinations(zip(states, fields, strict=True), 2)
    ratios = [size(weak.one, u.one - v.one) / (factor * weak.dual(a.g - b.g)) for (a, u), (b, v) in pairs]
    return np.array(ratios)


def there_and_back(case: Case) -> float:
    """The least ``a^1(R^1 z, R^1 gamma R^2 z)`` over ``a^1(R^1 z, R^1 z)``, z on the contact grid: 1 on one grid.

    The proof of Proposition 5.1 takes it for 1.  Where the grids differ z must reach body 2 by some transfer, which
    the algorithm does not have: here by the mortar transfer of the other direction.
    """
    interface, stiffness = case.weak.pair.interface, case.weak.pair.contact.schur
    x = interface.contact.x.copy()
    x[0], x[-1] = min(x[0], interface.neumann.x[0]), max(x[-1], interface.neumann.x[-1])  # ends that differ by rounding
    blocks = np.split(np.eye(interface.contact.size), interface.contact.dimension)
    back = mortar(interface.neumann.x, x)
    form = stiffness @ interface.carry(np.concatenate([back @ block for block in blocks]))
    return float(eigvalsh(symmetric(form), stiffness)[0])


def forces_carry_displacements(setting: RunsOfLevel) -> list[Evidence]:
    estimate: dict[str, float] = {}
    lemma: dict[str, float] = {}
    for case in setting.cases:
        clear = [s for s in case.run.iterates if s.relative_residual > CLEAR][:12]
        if len(clear) > 2:
            reading = Reading.of(measure(case.weak.pair))
            lemma[case.name] = float(by_lemma_5_3(case.weak, clear, reading.X / reading.m).max())
            if not case.grids_differ:
                ratios = strong_convergence(case.weak, clear, float(case.run.theta), reading.m)
                estimate[case.name] = float(ratios.max())
    ends = [Found(c, np.array([apart(c)]), LIMIT) for c in setting.cases if c.run.converged]
    lost = min((there_and_back(case) for case in setting.cases if case.grids_differ), default=1.0)
    kept = f"which needs one grid (with mortar transfers both ways a^1(z, R^1 R^2 z) falls to {lost:.2g} of a^1(z, z))"
    return [
        _estimate("step", estimate, setting.cases, "its estimate along runs" + (f", {kept}" if lost < 1 else "")),
        _estimate("repaired", lemma, setting.cases, "along runs by (5.11) and (5.19), without R_D^2"),
        equations("printed", "u_i at the end of runs against the solution of the global method, in V", ends),
    ]


def _estimate(of: Any, ratios: Mapping[str, float], found: Sequence[Case], text: str) -> Evidence:
    """The largest quotient of both sides of an estimate."""
    where = max(ratios, key=lambda name: figure(ratios[name]))
    data = {"problems": list(ratios), "worst": figure(ratios[where]), "where": where}
    problems = on_problems([case for case in found if case.name in ratios])
    seen = f"{text}: left over right side at most {ratios[where]:.3g} ({where}) on {problems}"
    return evidence(of, ratios[where] <= 1, seen, data)


def apart(case: Case) -> float:
    """The distance in V of the end of the run to the global solution, relative to the latter."""
    weak, end, u = case.weak, case.limit, case.solution
    away = size(weak.one, end.one - u.one), size(weak.two, end.two - u.two)
    return math.hypot(*away) / math.hypot(size(weak.one, u.one), size(weak.two, u.two))


# Theorem 5.9.


@dataclass(frozen=True, kw_only=True, eq=False)
class Convergence:
    """A run beside the contraction factor K that is proved of it."""

    case: Case
    factor: float

    @cached_property
    def ratio(self) -> float:
        """The largest ``|||g_i - g||| / |||g_{i-1} - g|||`` while the distance is far above rounding.

        g is the functional of Theorem 5.9, from the displacement of body 1.
        """
        weak = self.case.weak
        neumann, g = weak.pair.neumann, -weak.pair.interface.carry_back(weak.force(weak.one, self.case.solution.one))
        distance = np.array([neumann.dual_norm(state.g - g) for state in self.case.run.iterates])
        count = int((distance > CLEAR * neumann.dual_norm(g)).sum())
        return float((distance[1:count] / distance[: count - 1]).max(initial=0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class RunsOfLevel:
    """The problems and runs that the checks share, each solved when it is first asked for."""

    level: Level

    @property
    def count(self) -> int:
        """Random test functions of each kind."""
        return 10 if self.level == "quick" else 60

    @cached_property
    def cases(self) -> list[Case]:
        """The problems of the level."""
        return cases(self.level)

    @cached_property
    def inside(self) -> list[Convergence]:
        """Runs inside Proposition 5.6, as printed and as repaired: theta = C_0, and k half of its bound.

        The plane ones take thousands of steps; quick makes the first few hundred.
        """
        result = []
        for name, data in (CONVERGENT | PLANE).items():
            problem = Problem.from_dict(data)
            measured = measure(problem)
            if name in PLANE:
                constants = measured.with_friction(1e-12).constants()
                assert constants is not None
                thresholds = [evaluate(edition, constants).C2 for edition in EDITIONS]
                k = Fraction(min(c.value for c in thresholds if c is not None) / 2).limit_denominator(10**9)
                steps = 300 if self.level == "quick" else 20_000
                iteration = replace(problem.iteration, max_iterations=steps)
                problem = replace(problem.changed(friction=k), iteration=iteration)
                measured = measured.with_friction(float(k))
            constants = measured.constants()
            assert constants is not None
            theta = min(evaluate(edition, constants).C0.value for edition in EDITIONS)
            factors = [evaluate(edition, constants, theta=theta).factor for edition in EDITIONS]
            factor = max(2.0 if f is None else f.value for f in factors)
            result.append(Convergence(case=Case(name=name, problem=problem.with_theta(theta)), factor=factor))
        return result

    @cached_property
    def energy(self) -> list[Convergence]:
        """Runs with half the friction that the theorem in energy norms allows, at its best theta."""
        result = []
        for name, problem in ((case.name, case.problem) for case in cases(self.level)):
            measured = measure(problem)
            threshold = measured.friction_threshold
            if threshold is not None and float(problem.contact.friction) > threshold.value / 2:
                k = Fraction(threshold.value / 2).limit_denominator(10**6)
                problem = problem.changed(friction=k)
                measured = measured.with_friction(float(k))
            constants = measured.energy_constants()
            assert constants is not None
            bounds = evaluate_energy(constants)
            if bounds.theta_proved is not None and bounds.factor_proved is not None:
                theta = min(bounds.theta_proved, CLOSEST_TO_ONE)
                case = Case(name=name, problem=problem.with_theta(theta))
                result.append(Convergence(case=case, factor=bounds.factor_proved.value))
        return result


def forces_converge(setting: RunsOfLevel) -> list[Evidence]:
    return [
        _falling(
            "printed", "inside the intervals of Proposition 5.6, printed and repaired, at theta = C_0", setting.inside
        ),
        _falling("repaired", "inside the interval of the theorem in energy norms", setting.energy),
    ]


def _falling(of: Any, text: str, runs: Sequence[Convergence]) -> Evidence:
    """(5.47) step by step."""
    ratios = {r.case.name: r.ratio / r.factor for r in runs}
    where = max(ratios, key=lambda name: figure(ratios[name]))
    converged = [r for r in runs if r.case.run.converged]
    ends = [Found(r.case, np.array([end_of(r.case)]), LIMIT) for r in converged]
    arrived = equations(of, "", ends)
    data = {
        "problems": list(ratios),
        "worst": figure(ratios[where]),
        "where": where,
        "theta": {r.case.name: figure(float(r.case.run.theta)) for r in runs},
        "K": {r.case.name: figure(r.factor) for r in runs},
        "friction": {r.case.name: figure(float(r.case.problem.contact.friction)) for r in runs},
        "steps": {r.case.name: r.case.run.iterations for r in runs},
        "converged": [r.case.name for r in converged],
    }
    holds = ratios[where] <= 1 + EXACT and bool(arrived.holds)
    seen = (
        f"{text}: |||g_i - g||| falls by K or more at every step of a run on each of"
        f" {on_problems([r.case for r in runs])}, at worst {ratios[where]:.6g} of K ({where}); {len(converged)} runs"
        " went to the end, and arrive at the g of the global method"
    )
    if not holds:
        seen = f"{text}: a step of {ratios[where]:.6g} times K ({where}); {arrived.text.lstrip(': ')}"
    return evidence(of, holds, seen, data)


def end_of(case: Case) -> float:
    """``|||g_i - g||| / |||g|||`` at the end of the run."""
    neumann = case.weak.pair.neumann
    return neumann.dual_norm(case.run.last.g - case.g) / (neumann.dual_norm(case.g) or 1.0)


def fields_converge(setting: RunsOfLevel) -> list[Evidence]:
    def arrive(of: Any, text: str, runs: Sequence[Convergence]) -> Evidence:
        ends = [Found(r.case, np.array([apart(r.case)]), LIMIT) for r in runs if r.case.run.converged]
        return equations(of, f"u_i at the end of runs {text}, against the global method in V", ends)

    return [
        arrive("printed", "inside the intervals of Proposition 5.6", setting.inside),
        arrive("repaired", "inside the interval of the theorem in energy norms", setting.energy),
    ]

"""Statements about solutions and iterates, held against whole displacement fields (:mod:`.weak_forms`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from fem1d2d import solver
from fem1d2d.mesh import Floats
from ndtheory import EDITIONS, evaluate, evaluate_sharp
from verification.advice import CLOSEST_TO_ONE
from verification.contact import ContactError
from verification.iteration import FixedPointMap
from verification.ledger.evidence import Evidence
from verification.ledger.weak_forms import (
    CLEAR,
    CONVERGENT,
    EXACT,
    LIMIT,
    PLANE,
    SEED,
    Case,
    Fields,
    Level,
    Weak,
    balance,
    cases,
    contact_inequality,
    coulomb,
    directions,
    generator,
    image_of,
    inequality,
    largest,
    moves_in_K,
    moves_of_one,
    neumann_equation,
    norm,
    obstacle_tests,
    reaction,
    shifted_inequality,
    transfer,
    unilateral,
)
from verification.measured import measure
from verification.pair import Body
from verification.problem import Problem
from verification.state import State
from verification.threads import one_thread

# The evidence.


@dataclass(frozen=True, kw_only=True)
class Found:
    """Values of a check on one problem, and the bound they are held against."""

    name: str
    values: Floats
    limit: float


def _equations(of: Any, text: str, found: Sequence[Found], **data: Any) -> Evidence:
    """All values at most their limits; rounding is not reported, only that it is below the limit."""
    worst = max(found, key=lambda f: float(f.values.max(initial=0.0)) / f.limit)
    top, limit = float(worst.values.max(initial=0.0)), max(f.limit for f in found)
    holds = all(bool((f.values <= f.limit).all()) for f in found)
    count = sum(f.values.size for f in found)
    data = _data(found, data) | {"limit": limit}
    if holds:
        return _evidence(of, True, f"{text}: relative residuals below {limit:g} in {count} cases", data)
    data |= {"worst": top, "where": worst.name}
    return _evidence(of, False, f"{text}: a relative residual of {top:.3g} ({worst.name}); needed {limit:g}", data)


def _inequalities(of: Any, text: str, found: Sequence[Found], **data: Any) -> Evidence:
    """All values at least minus their limits."""
    worst = min(found, key=lambda f: float(f.values.min(initial=0.0)) / f.limit)
    low, limit = float(worst.values.min(initial=0.0)), max(f.limit for f in found)
    holds = all(bool((f.values >= -f.limit).all()) for f in found)
    values = np.concatenate([f.values for f in found])
    # figures far from rounding, and from the test functions that barely leave u
    largest = float(values.max(initial=0.0))
    data = _data(found, data) | {"limit": limit, "largest": _figure(largest)}
    if holds:
        seen = f"left minus right over its scale between -{limit:g} and {largest:.3g} for {len(values)} test functions"
        return _evidence(of, True, f"{text}: {seen}", data)
    data |= {"worst": low, "where": worst.name}
    return _evidence(of, False, f"{text}: left minus right is {low:.3g} of its scale ({worst.name})", data)


def _data(found: Sequence[Found], data: Mapping[str, Any]) -> dict[str, Any]:
    names = list(dict.fromkeys(f.name for f in found))
    return {"seed": SEED, "problems": names, "cases": sum(f.values.size for f in found), **data}


def _evidence(of: Any, holds: bool | None, text: str, data: Mapping[str, Any]) -> Evidence:
    return Evidence(method="discrete", of=of, holds=holds, text=text, data=data)


def _figure(value: float, digits: int = 6) -> float:
    return float(f"{value:.{digits - 1}e}")


def _figures(values: Floats, size: float) -> list[float]:
    """Six digits relative to a size; what is smaller may be rounding."""
    return [_figure(v) + 0.0 for v in np.round(values / size, 6) * size]


def _plane(found: Sequence[Case]) -> list[Case]:
    return [case for case in found if float(case.problem.contact.friction) > 0]


def _action_and_reaction(setting: Setting) -> list[Evidence]:
    seen = {case.name: reaction(case.weak, case.solution) for case in setting.cases}
    normal = [Found(name=n, values=np.array([s["sigma_N^1 = sigma_N^2"]]), limit=EXACT) for n, s in seen.items()]
    opposite = [Found(name=n, values=np.array([s["sigma_T^1 = -sigma_T^2"]]), limit=EXACT) for n, s in seen.items()]
    printed = {name: s["sigma_T^1 = sigma_T^2"] for name, s in seen.items()}
    where = max(printed, key=lambda name: _figure(printed[name]))
    held = printed[where] <= EXACT and _equations("printed", "", normal).holds
    text = (
        "with outward normals the tangential stresses of the two bodies differ by"
        f" {printed[where]:.4g} of the largest nodal force ({where})"
    )
    data = {"problems": list(printed), "worst": _figure(printed[where]), "where": where, "limit": EXACT}
    return [
        _evidence("printed", held, text, data),
        _equations("repaired", "sigma_N^1 = sigma_N^2 and sigma_T^1 = -sigma_T^2 at the nodes", [*normal, *opposite]),
    ]


def _signorini(setting: Setting) -> list[Evidence]:
    seen = [
        Found(name=c.name, values=np.array(list(unilateral(c.weak, c.solution).values())), limit=EXACT)
        for c in setting.cases
    ]
    force = {
        case.name: case.weak.force(case.weak.two, case.solution.two)[case.weak.pair.normal] for case in setting.cases
    }
    closed = sum(int((f > EXACT * (np.abs(f).max() or 1.0)).sum()) for f in force.values())
    nodes = sum(len(f) for f in force.values())
    text = f"the three conditions at {nodes} nodes, {closed} of them pressed"
    return [_equations("printed", text, seen, nodes=nodes, pressed=closed)]


def _friction(setting: Setting) -> list[Evidence]:
    plane = _plane(setting.cases)
    seen = [Found(name=c.name, values=np.array(list(coulomb(c.weak, c.solution).values())), limit=EXACT) for c in plane]
    slips = [np.abs(c.weak.jump(c.solution.one, c.solution.two)[c.weak.pair.tangential]) for c in plane]
    sliding = sum(int((s > 1e-9 * (s.max() or 1.0)).sum()) for s in slips)
    nodes = sum(len(s) for s in slips)
    text = f"both lines at {nodes} nodes, {sliding} of them with a jump, with sigma_T that of body 1"
    return [_equations("printed", text, seen, nodes=nodes, sliding=sliding)]


def _gather(
    setting: Setting,
    key: str,
    items: Callable[[Case], Iterable[Any]],
    values: Callable[[Weak, Any, np.random.Generator], Floats],
    limit: float = EXACT,
) -> list[Found]:
    """A check at all items of all problems."""
    rng = generator(key)
    return [
        Found(name=case.name, values=values(case.weak, item, rng), limit=limit)
        for case in setting.cases
        for item in items(case)
    ]


def _original(setting: Setting) -> list[Evidence]:
    values = lambda weak, u, rng: inequality(weak, u, moves_in_K(weak, u, rng, setting.count))
    seen = _gather(setting, "4.4", lambda case: [case.solution], values)
    return [_inequalities("printed", "at the solution of the global method, for v in K", seen)]


def _lift(setting: Setting) -> list[Evidence]:
    rng, count, seen = generator("4.5"), setting.count, []
    for case in setting.cases:
        for body in (case.weak.one, case.weak.two):
            phi = rng.standard_normal((len(body.interface), count))
            lifted = np.column_stack([body.elastic.extend(column) for column in phi.T])
            v = directions(rng, body, count)
            v[body.interface] = 0.0
            pairing = np.abs(v.T @ (body.stiffness @ lifted)) / np.outer(norm(body, v), norm(body, lifted))
            trace = np.abs(lifted[body.interface] - phi).max(axis=0) / np.abs(phi).max(axis=0)
            seen.append(Found(name=case.name, values=np.concatenate([pairing.ravel(), trace]), limit=EXACT))
    return [_equations("printed", "a(R phi, v) = 0 for v = 0 on Gamma_c, and R phi = phi there, on both bodies", seen)]


def _step_1(setting: Setting) -> list[Evidence]:
    values = lambda weak, step, rng: neumann_equation(
        weak, weak.at(step[0]).two, step[0].g, directions(rng, weak.two, setting.count)
    )
    seen = _gather(setting, "4.9.1", lambda case: case.steps, values)
    return [_equations("printed", "for v in V^2, along runs", seen)]


def _step_2(setting: Setting) -> list[Evidence]:
    def values(weak: Weak, step: tuple[State, State], rng: np.random.Generator) -> Floats:
        u = weak.at(step[0])
        return shifted_inequality(weak, u, obstacle_tests(weak, u, rng, setting.count))

    text = "with the jump [u_T] in the friction term, along runs, for w in V^1_-(0)"
    seen = _gather(setting, "4.9.2", lambda case: case.steps, values)
    return [_printed_step_2(setting.cases), _inequalities("repaired", text, seen)]


def printed_defect(weak: Weak, u: Fields) -> tuple[float, Floats]:
    """(4.9) II as printed with ``w = u^1 - R u^2``: left minus right over its last integral, and the trace of w.

    The test function ``w + R u^2 - u^1`` vanishes, and with it the work: only the friction terms are left.
    """
    t, bound = weak.pair.tangential, weak.bound(u.two)
    w = weak.trace(weak.one, u.one - weak.lift(weak.one, weak.trace(weak.two, u.two)))
    own = float(bound @ np.abs(weak.trace(weak.one, u.one)[t]))
    return (float(bound @ np.abs(w[t])) - own) / (own or 1.0), w


def _printed_step_2(found: Sequence[Case]) -> Evidence:
    seen = {case.name: (*printed_defect(case.weak, case.solution), case) for case in _plane(found)}
    where = min(seen, key=lambda name: _figure(seen[name][0]))
    worst, w, case = seen[where]
    t, normal, size = case.weak.pair.tangential, case.weak.pair.normal, largest(case.solution)
    bound = case.weak.bound(case.solution.two)
    data = {
        "problems": list(seen),
        "worst": _figure(worst),
        "where": where,
        "test": "w = u^1 - R_D^1(gamma u^2) at the solution of the global method",
        "w_T": _figures(w[t], size),
        "w_N": _figures(w[normal], size),
        "u1_T": _figures(case.weak.trace(case.weak.one, case.solution.one)[t], size),
        "friction_bound": _figures(bound, float(bound.max())),
    }
    text = (
        "with |u^1_T| in the friction term the solution of (P_1) does not satisfy it: at w = u^1 - R u^2 left minus"
        f" right is {worst:.4g} of the integral of k|S(sigma_N)||u^1_T| ({where})"
    )
    return _evidence("printed", worst >= -EXACT, text, data)


def _step_3(setting: Setting) -> list[Evidence]:
    def values(weak: Weak, item: tuple[float, State, State], rng: np.random.Generator) -> Floats:
        theta, state, following = item
        image = (following.g - (1 - theta) * state.g) / theta
        return transfer(weak, weak.at(state), image, directions(rng, weak.two, setting.count))

    items = lambda case: [(float(case.run.theta), *step) for step in case.steps]
    seen = _gather(setting, "4.9.3", items, values)
    return [_equations("printed", "for v in V^2, along runs", seen)]


def _fixed_point(found: Sequence[Case]) -> Evidence:
    seen = []
    for case in found:
        neumann, g = case.weak.pair.neumann, case.g
        moved = neumann.dual_norm(image_of(case.weak.pair, g).image - g) / (neumann.dual_norm(g) or 1.0)
        seen.append(Found(name=case.name, values=np.array([moved]), limit=EXACT))
    return _equations("printed", "T g = g for the contact forces g of the global method", seen)


def _neumann_problem(setting: Setting) -> list[Evidence]:
    values = lambda weak, u, rng: balance(weak, u, directions(rng, weak.two, setting.count))
    seen = _gather(setting, "5.1", lambda case: [case.solution], values)
    return [_equations("printed", "at the solution of the global method, for v in V^2", seen)]


def _shifted_problem(setting: Setting) -> list[Evidence]:
    values = lambda weak, u, rng: shifted_inequality(weak, u, obstacle_tests(weak, u, rng, setting.count))
    seen = _gather(setting, "5.2", lambda case: [case.solution], values)
    return [_inequalities("printed", "at the solution of the global method, for w in V^1_-(0)", seen)]


def _obstacle_problem(setting: Setting) -> list[Evidence]:
    values = lambda weak, u, rng: contact_inequality(weak, u, moves_of_one(weak, u, rng, setting.count))
    seen = _gather(setting, "5.3", lambda case: [case.solution], values)
    return [_inequalities("printed", "at the solution of the global method, for v in V^1_-(u^2_N)", seen)]


def _definition_of_T(setting: Setting) -> list[Evidence]:
    values = lambda weak, state, rng: transfer(
        weak, weak.at(state), state.image, directions(rng, weak.two, setting.count)
    )
    seen = _gather(setting, "5.4", lambda case: case.arbitrary, values)
    return [_equations("printed", "at random psi, for v in V^2", seen), _fixed_point(setting.cases)]


def _contact_problem(setting: Setting) -> list[Evidence]:
    def values(weak: Weak, state: State, rng: np.random.Generator) -> Floats:
        w = weak.at(state)
        return contact_inequality(weak, w, moves_of_one(weak, w, rng, setting.count))

    seen = _gather(setting, "5.5", lambda case: case.arbitrary, values)
    return [_inequalities("printed", "at random psi, for v in V^1_-(w^2_N)", seen)]


def _loaded_problem(setting: Setting) -> list[Evidence]:
    values = lambda weak, state, rng: neumann_equation(
        weak, weak.at(state).two, state.g, directions(rng, weak.two, setting.count)
    )
    seen = _gather(setting, "5.6", lambda case: case.arbitrary, values)
    return [_equations("printed", "at random psi, for v in V^2", seen)]


# Section 3 and the convergence of the iteration.

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
            image = T(g)[1].force
        except ContactError:
            image = image_of(pair, g).image
        g = sign * theta * image + (1 - theta) * g
    return np.array(result)


def _strong_form(setting: Setting) -> list[Evidence]:
    """Step III of (3.1): ``sigma^1 n^1`` is minus T g, so that the printed sign is that of minus T g."""
    loaded = [case for case in setting.cases if np.abs(case.g).any()]
    printed = {case.name: distances(case, -1, STEPS) for case in loaded}
    repaired = {case.name: distances(case, +1, 3000) for case in loaded}
    nearest = {name: float(d[1:].min()) for name, d in printed.items()}
    where = min(nearest, key=lambda name: _figure(nearest[name], 3))
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
        _evidence(
            "printed",
            nearest[where] <= LIMIT,
            text,
            data | {"nearest": {name: _figure(d, 3) for name, d in nearest.items()}, "where": where},
        ),
        _evidence("repaired", good, seen, data | {"iterations": {n: len(d) - 1 for n, d in repaired.items()}}),
    ]


class Norms:
    """The norms of V and of the dual of V^2, from the whole Gram matrices."""

    def __init__(self, weak: Weak) -> None:
        self.weak, self._solve = weak, solver(weak.two.gram_matrix)

    def of(self, body: Body, field: Floats) -> float:
        """The H1 norm."""
        return float(np.sqrt(field @ (body.gram_matrix @ field)))

    def dual(self, force: Floats) -> float:
        """The norm of V^2' of nodal forces on Gamma_c."""
        load = np.zeros(len(self.weak.two.free))
        load[self.weak.two.interface] = self.weak.pair.orient(force)
        return float(np.sqrt(max(float(load @ self._solve(load)), 0.0)))


def strong_convergence(weak: Weak, states: Sequence[State], theta: float, m: float) -> Floats:
    """Proposition 5.1: left side of its estimate over the right side, for pairs of steps of a run."""
    norms = Norms(weak)
    fields = [weak.at(state) for state in states[:-1]]
    dual = lambda i, j: norms.dual(states[i].g - states[j].g)
    result = []
    for i in range(len(fields)):
        for j in range(i):
            difference = fields[i].one - fields[j].one
            size = norms.of(weak.one, difference)
            lifted = norms.of(weak.two, weak.lift(weak.two, weak.trace(weak.one, difference)))
            right = (dual(i, j) + dual(i + 1, i) + dual(j + 1, j)) * lifted / (theta * m)
            result.append(size**2 / right if right > 0 else 0.0)
    return np.array(result)


def _strong_convergence(setting: Setting) -> list[Evidence]:
    ratios, ends = {}, []
    for case in setting.cases:
        clear = [s for s in case.run.states if s.relative_residual > CLEAR]
        if len(clear) > 2:
            m = measure(case.weak.pair).m.value
            ratios[case.name] = float(strong_convergence(case.weak, clear[:12], float(case.run.theta), m).max())
        if case.run.converged:
            ends.append(Found(name=case.name, values=np.array([apart(case)]), limit=LIMIT))
    where = max(ratios, key=lambda name: _figure(ratios[name]))
    data = {"problems": list(ratios), "worst": _figure(ratios[where]), "where": where}
    text = f"its estimate along runs, left over right side at most {ratios[where]:.3g} ({where})"
    return [
        _evidence("step", ratios[where] <= 1, text, data),
        _equations("printed", "u_i at the end of runs against the solution of the global method, in V", ends),
    ]


def apart(case: Case) -> float:
    """The distance in V of the end of the run to the global solution, relative to the latter."""
    norms, weak = Norms(case.weak), case.weak
    parts = [
        (norms.of(body, a - b), norms.of(body, b))
        for body, a, b in ((weak.one, case.limit.one, case.solution.one), (weak.two, case.limit.two, case.solution.two))
    ]
    return math.hypot(*(p[0] for p in parts)) / math.hypot(*(p[1] for p in parts))


def _limit(setting: Setting) -> list[Evidence]:
    values = lambda weak, u, rng: inequality(weak, u, moves_in_K(weak, u, rng, setting.count))
    items = lambda case: [case.limit] if case.run.converged else []
    seen = _gather(setting, "lemma-5.2", items, values, LIMIT)
    return [_inequalities("printed", "(4.4) at the limit of runs, for v in K", seen)]


# Theorem 5.9.


@dataclass(frozen=True, kw_only=True, eq=False)
class Convergence:
    """A run beside the contraction factor K that is proved of it."""

    case: Case
    factor: float

    @cached_property
    def ratio(self) -> float:
        """The largest ``|||g_i - g||| / |||g_{i-1} - g|||`` while the distance stands clear of rounding.

        g is the functional of Theorem 5.9, from the displacement of body 1.
        """
        weak = self.case.weak
        neumann, g = weak.pair.neumann, -weak.force(weak.one, self.case.solution.one)
        distance = np.array([neumann.dual_norm(state.g - g) for state in self.case.run.states])
        count = int((distance > CLEAR * neumann.dual_norm(g)).sum())
        return float((distance[1:count] / distance[: count - 1]).max(initial=0.0))


def inside(level: Level) -> list[Convergence]:
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
            steps = 300 if level == "quick" else 20_000
            iteration = replace(problem.iteration, max_iterations=steps)
            problem = replace(problem, contact=replace(problem.contact, friction=k), iteration=iteration)
            measured = measured.with_friction(float(k))
        constants = measured.constants()
        assert constants is not None
        theta = min(evaluate(edition, constants).C0.value for edition in EDITIONS)
        factors = [evaluate(edition, constants, theta=theta).factor for edition in EDITIONS]
        factor = max(2.0 if f is None else f.value for f in factors)
        result.append(Convergence(case=Case(name=name, problem=problem.with_theta(theta)), factor=factor))
    return result


def sharp(level: Level) -> list[Convergence]:
    """Runs with half the friction that the theorem in energy norms allows, at its best theta."""
    result = []
    for name, problem in ((case.name, case.problem) for case in cases(level)):
        measured = measure(problem)
        threshold = measured.friction_threshold
        if threshold is not None and float(problem.contact.friction) > threshold.value / 2:
            k = Fraction(threshold.value / 2).limit_denominator(10**6)
            problem = replace(problem, contact=replace(problem.contact, friction=k))
            measured = measured.with_friction(float(k))
        constants = measured.energy_constants()
        assert constants is not None
        bounds = evaluate_sharp(constants)
        if bounds.theta_proved is not None and bounds.factor_proved is not None:
            theta = min(bounds.theta_proved, CLOSEST_TO_ONE)
            case = Case(name=name, problem=problem.with_theta(theta))
            result.append(Convergence(case=case, factor=bounds.factor_proved.value))
    return result


def _forces_converge(setting: Setting) -> list[Evidence]:
    return [
        _falling(
            "printed", "inside the intervals of Proposition 5.6, printed and repaired, at theta = C_0", setting.inside
        ),
        _falling("repaired", "inside the interval of the theorem in energy norms", setting.sharp),
    ]


def _falling(of: Any, text: str, runs: Sequence[Convergence]) -> Evidence:
    """(5.47) step by step."""
    ratios = {r.case.name: r.ratio / r.factor for r in runs}
    where = max(ratios, key=lambda name: _figure(ratios[name]))
    converged = [r for r in runs if r.case.run.converged]
    ends = [Found(name=r.case.name, values=np.array([end_of(r.case)]), limit=LIMIT) for r in converged]
    arrived = _equations(of, "", ends)
    data = {
        "problems": list(ratios),
        "worst": _figure(ratios[where]),
        "where": where,
        "theta": {r.case.name: _figure(float(r.case.run.theta)) for r in runs},
        "K": {r.case.name: _figure(r.factor) for r in runs},
        "friction": {r.case.name: _figure(float(r.case.problem.contact.friction)) for r in runs},
        "steps": {r.case.name: r.case.run.iterations for r in runs},
        "converged": [r.case.name for r in converged],
    }
    holds = ratios[where] <= 1 + EXACT and bool(arrived.holds)
    seen = (
        f"{text}: |||g_i - g||| falls by K or more at every step of {len(runs)} runs, at worst {ratios[where]:.6g} of K"
        f" ({where}); {len(converged)} of them ran to the end, and arrive at the g of the global method"
    )
    if not holds:
        seen = f"{text}: a step of {ratios[where]:.6g} times K ({where}); {arrived.text.lstrip(': ')}"
    return _evidence(of, holds, seen, data)


def end_of(case: Case) -> float:
    """``|||g_i - g||| / |||g|||`` at the end of the run."""
    neumann = case.weak.pair.neumann
    return neumann.dual_norm(case.run.last.g - case.g) / (neumann.dual_norm(case.g) or 1.0)


def _fields_converge(setting: Setting) -> list[Evidence]:
    def arrive(of: Any, text: str, runs: Sequence[Convergence]) -> Evidence:
        ends = [
            Found(name=r.case.name, values=np.array([apart(r.case)]), limit=LIMIT) for r in runs if r.case.run.converged
        ]
        return _equations(of, f"u_i at the end of runs {text}, against the global method in V", ends)

    return [
        arrive("printed", "inside the intervals of Proposition 5.6", setting.inside),
        arrive("repaired", "inside the interval of the theorem in energy norms", setting.sharp),
    ]


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """What the checks share."""

    level: Level

    @cached_property
    def cases(self) -> list[Case]:
        """The problems, solved when first asked."""
        return cases(self.level)

    @cached_property
    def inside(self) -> list[Convergence]:
        """Runs inside Proposition 5.6."""
        return inside(self.level)

    @cached_property
    def sharp(self) -> list[Convergence]:
        """Runs inside the theorem in energy norms."""
        return sharp(self.level)

    @property
    def count(self) -> int:
        """Random test functions of each kind."""
        return 10 if self.level == "quick" else 60


Check = Callable[[Setting], list[Evidence]]

#: What answers for each statement.
CHECKS: dict[str, Check] = {
    "2.3": _action_and_reaction,
    "2.4": _signorini,
    "2.6": _friction,
    "3.1.3": _strong_form,
    "4.4": _original,
    "4.5": _lift,
    "4.9.1": _step_1,
    "4.9.2": _step_2,
    "4.9.3": _step_3,
    "prop-5.1": _strong_convergence,
    "5.1": _neumann_problem,
    "5.2": _shifted_problem,
    "lemma-5.2": _limit,
    "5.3": _obstacle_problem,
    "5.4": _definition_of_T,
    "5.5": _contact_problem,
    "5.6": _loaded_problem,
    "thm-5.9.1": _forces_converge,
    "thm-5.9.2": _fields_converge,
}


def solutions(
    ids: Collection[str] | None = None, level: Level = "quick", watch: Callable[[float], None] = lambda done: None
) -> dict[str, list[Evidence]]:
    """Evidence for statements about solutions, iterates and their limit.

    Parameters
    ----------
    ids : collection of str, optional
        Statements; all by default, unknown ones have no evidence here.
    level : {'quick', 'full'}
        Full halves the meshes too, draws problems at random and runs to the end.
    watch : callable
        Called with the share done.

    Examples
    --------
    >>> [e.holds for e in solutions(["2.3"], "quick")["2.3"]]
    [False, True]
    """
    chosen = [statement for statement in CHECKS if ids is None or statement in ids]
    result = {}
    with one_thread():
        setting = Setting(level=level)
        for done, statement in enumerate(chosen):
            watch(done / len(chosen))
            result[statement] = CHECKS[statement](setting)
    watch(1.0)
    return result

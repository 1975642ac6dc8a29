"""Statements about solutions and iterates, held against the weak forms (:mod:`verification.ledger.weak_forms`)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.iterate import Iterate
from verification.ledger.convergence import (
    RunsOfLevel,
    fields_converge,
    forces_carry_displacements,
    forces_converge,
    strong_form,
)
from verification.ledger.evidence import Evidence, Level, figure, gather
from verification.ledger.found import Found, equations, evidence, figures, inequalities, with_friction
from verification.ledger.moves import directions, largest, moves_in_K, moves_of_one, obstacle_tests
from verification.ledger.weak_forms import (
    EXACT,
    LIMIT,
    Case,
    Fields,
    Weak,
    balance,
    contact_inequality,
    coulomb,
    generator,
    image_of,
    inequality,
    neumann_equation,
    norm,
    reaction,
    shifted_inequality,
    transfer,
    unilateral,
)


def _action_and_reaction(setting: RunsOfLevel) -> list[Evidence]:
    seen = [(case, reaction(case.weak, case.solution)) for case in setting.cases]
    normal = [Found(case=c, values=np.array([s["sigma_N^1 = sigma_N^2"]]), limit=EXACT) for c, s in seen]
    opposite = [Found(case=c, values=np.array([s["sigma_T^1 = -sigma_T^2"]]), limit=EXACT) for c, s in seen]
    printed = {case.name: s["sigma_T^1 = sigma_T^2"] for case, s in seen}
    where = max(printed, key=lambda name: figure(printed[name]))
    held = printed[where] <= EXACT and equations("printed", "", normal).holds
    text = (
        "with outward normals the tangential stresses of the two bodies differ by"
        f" {printed[where]:.4g} of the largest nodal force ({where})"
    )
    data = {"problems": list(printed), "worst": figure(printed[where]), "where": where, "limit": EXACT}
    return [
        evidence("printed", held, text, data),
        equations("repaired", "sigma_N^1 = sigma_N^2 and sigma_T^1 = -sigma_T^2 at the nodes", [*normal, *opposite]),
    ]


def _signorini(setting: RunsOfLevel) -> list[Evidence]:
    seen = [
        Found(case=c, values=np.array(list(unilateral(c.weak, c.solution).values())), limit=EXACT)
        for c in setting.cases
    ]
    force = {
        case.name: -case.weak.force(case.weak.one, case.solution.one)[case.weak.pair.contact.grid.normal]
        for case in setting.cases
    }
    closed = sum(int((f > EXACT * (np.abs(f).max() or 1.0)).sum()) for f in force.values())
    nodes = sum(len(f) for f in force.values())
    text = f"the three conditions at {nodes} contact nodes, {closed} of them pressed"
    lowest = min((lowest_pressure(c) for c in setting.cases if c.grids_differ), default=0.0)
    if lowest < -EXACT:
        text += f", with sigma_N that of body 1 (carried to another grid it falls to {lowest:.2g} of its largest value)"
    return [equations("printed", text, seen, nodes=nodes, pressed=closed)]


def lowest_pressure(case: Case) -> float:
    """The least normal force on body 2 at a node, over the largest one: below 0 where P' has negative entries."""
    force = case.weak.force(case.weak.two, case.solution.two)[case.weak.pair.neumann.grid.normal]
    return float(force.min() / (np.abs(force).max() or 1.0))


def _friction(setting: RunsOfLevel) -> list[Evidence]:
    plane = with_friction(setting.cases)
    seen = [Found(case=c, values=np.array(list(coulomb(c.weak, c.solution).values())), limit=EXACT) for c in plane]
    slips = [np.abs(c.weak.jump(c.solution.one, c.solution.two)[c.weak.pair.contact.grid.tangential]) for c in plane]
    sliding = sum(int((s > 1e-9 * (s.max() or 1.0)).sum()) for s in slips)
    nodes = sum(len(s) for s in slips)
    text = f"both lines at {nodes} nodes, {sliding} of them with a jump, with sigma_T that of body 1"
    return [equations("printed", text, seen, nodes=nodes, sliding=sliding)]


def _gather(
    setting: RunsOfLevel,
    key: str,
    items: Callable[[Case], Iterable[Any]],
    values: Callable[[Weak, Any, np.random.Generator], Floats],
    limit: float = EXACT,
) -> list[Found]:
    """A check at all items of all problems."""
    rng = generator(key)
    return [
        Found(case=case, values=values(case.weak, item, rng), limit=limit)
        for case in setting.cases
        for item in items(case)
    ]


def _original(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, u, rng: inequality(weak, u, moves_in_K(weak, u, rng, setting.count))
    seen = _gather(setting, "4.4", lambda case: [case.solution], values)
    return [inequalities("printed", "at the solution of the global method, for v in K", seen)]


def _lift(setting: RunsOfLevel) -> list[Evidence]:
    rng, count, seen = generator("4.5"), setting.count, []
    for case in setting.cases:
        for body in (case.weak.one, case.weak.two):
            phi = rng.standard_normal((len(body.interface), count))
            lifted = np.column_stack([body.elastic.extend(column) for column in phi.T])
            v = directions(rng, body, count)
            v[body.interface] = 0.0
            pairing = np.abs(v.T @ (body.stiffness @ lifted)) / np.outer(norm(body, v), norm(body, lifted))
            trace = np.abs(lifted[body.interface] - phi).max(axis=0) / np.abs(phi).max(axis=0)
            seen.append(Found(case=case, values=np.concatenate([pairing.ravel(), trace]), limit=EXACT))
    return [equations("printed", "a(R phi, v) = 0 for v = 0 on Gamma_c, and R phi = phi there, on both bodies", seen)]


def _step_1(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, step, rng: neumann_equation(
        weak, weak.at(step[0]).two, step[0].g, directions(rng, weak.two, setting.count)
    )
    seen = _gather(setting, "4.9.1", lambda case: case.steps, values)
    return [equations("printed", "for v in V^2, along runs", seen)]


def _step_2(setting: RunsOfLevel) -> list[Evidence]:
    def values(weak: Weak, step: tuple[Iterate, Iterate], rng: np.random.Generator) -> Floats:
        u = weak.at(step[0])
        return shifted_inequality(weak, u, obstacle_tests(weak, u, rng, setting.count))

    text = "with the jump [u_T] in the friction term, along runs, for w in V^1_-(0)"
    seen = _gather(setting, "4.9.2", lambda case: case.steps, values)
    return [_printed_step_2(setting.cases), inequalities("repaired", text, seen)]


def printed_defect(weak: Weak, u: Fields) -> tuple[float, Floats]:
    """(4.9) II as printed with ``w = u^1 - R u^2``: left minus right over its last integral, and the trace of w.

    The test function ``w + R u^2 - u^1`` vanishes, and with it the work: only the friction terms are left.
    """
    t, bound = weak.pair.contact.grid.tangential, weak.bound(u.two)
    w = weak.trace(weak.one, u.one - weak.lift(weak.one, weak.carried(u.two)))
    own = float(bound @ np.abs(weak.trace(weak.one, u.one)[t]))
    return (float(bound @ np.abs(w[t])) - own) / (own or 1.0), w


def _printed_step_2(found: Sequence[Case]) -> Evidence:
    seen = {case.name: (*printed_defect(case.weak, case.solution), case) for case in with_friction(found)}
    where = min(seen, key=lambda name: figure(seen[name][0]))
    worst, w, case = seen[where]
    t, normal, size = case.weak.pair.contact.grid.tangential, case.weak.pair.contact.grid.normal, largest(case.solution)
    bound = case.weak.bound(case.solution.two)
    data = {
        "problems": list(seen),
        "worst": figure(worst),
        "where": where,
        "test": "w = u^1 - R_D^1(gamma u^2) at the solution of the global method",
        "w_T": figures(w[t], size),
        "w_N": figures(w[normal], size),
        "u1_T": figures(case.weak.trace(case.weak.one, case.solution.one)[t], size),
        "friction_bound": figures(bound, float(bound.max())),
    }
    text = (
        "with |u^1_T| in the friction term the solution of (P_1) does not satisfy it: at w = u^1 - R u^2 left minus"
        f" right is {worst:.4g} of the integral of k|S(sigma_N)||u^1_T| ({where})"
    )
    return evidence("printed", worst >= -EXACT, text, data)


def _step_3(setting: RunsOfLevel) -> list[Evidence]:
    def values(weak: Weak, item: tuple[float, Iterate, Iterate], rng: np.random.Generator) -> Floats:
        theta, state, following = item
        image = (following.g - (1 - theta) * state.g) / theta
        return transfer(weak, weak.at(state), image, directions(rng, weak.two, setting.count))

    items = lambda case: [(float(case.run.theta), *step) for step in case.steps]
    seen = _gather(setting, "4.9.3", items, values)
    return [equations("printed", "for v in V^2, along runs", seen)]


def _fixed_point(found: Sequence[Case]) -> Evidence:
    seen = []
    for case in found:
        neumann, g = case.weak.pair.neumann, case.g
        moved = neumann.dual_norm(image_of(case.weak.pair, g).image - g) / (neumann.dual_norm(g) or 1.0)
        seen.append(Found(case=case, values=np.array([moved]), limit=EXACT))
    return equations("printed", "T g = g for the contact forces g of the global method", seen)


def _neumann_problem(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, u, rng: balance(weak, u, directions(rng, weak.two, setting.count))
    seen = _gather(setting, "5.1", lambda case: [case.solution], values)
    return [equations("printed", "at the solution of the global method, for v in V^2", seen)]


def _shifted_problem(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, u, rng: shifted_inequality(weak, u, obstacle_tests(weak, u, rng, setting.count))
    seen = _gather(setting, "5.2", lambda case: [case.solution], values)
    return [inequalities("printed", "at the solution of the global method, for w in V^1_-(0)", seen)]


def _obstacle_problem(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, u, rng: contact_inequality(weak, u, moves_of_one(weak, u, rng, setting.count))
    seen = _gather(setting, "5.3", lambda case: [case.solution], values)
    return [inequalities("printed", "at the solution of the global method, for v in V^1_-(u^2_N)", seen)]


def _definition_of_T(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, state, rng: transfer(
        weak, weak.at(state), state.image, directions(rng, weak.two, setting.count)
    )
    seen = _gather(setting, "5.4", lambda case: case.arbitrary, values)
    return [equations("printed", "at random psi, for v in V^2", seen), _fixed_point(setting.cases)]


def _contact_problem(setting: RunsOfLevel) -> list[Evidence]:
    def values(weak: Weak, state: Iterate, rng: np.random.Generator) -> Floats:
        w = weak.at(state)
        return contact_inequality(weak, w, moves_of_one(weak, w, rng, setting.count))

    seen = _gather(setting, "5.5", lambda case: case.arbitrary, values)
    return [inequalities("printed", "at random psi, for v in V^1_-(w^2_N)", seen)]


def _loaded_problem(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, state, rng: neumann_equation(
        weak, weak.at(state).two, state.g, directions(rng, weak.two, setting.count)
    )
    seen = _gather(setting, "5.6", lambda case: case.arbitrary, values)
    return [equations("printed", "at random psi, for v in V^2", seen)]


def _limit(setting: RunsOfLevel) -> list[Evidence]:
    values = lambda weak, u, rng: inequality(weak, u, moves_in_K(weak, u, rng, setting.count))
    items = lambda case: [case.limit] if case.run.converged else []
    seen = _gather(setting, "lemma-5.2", items, values, LIMIT)
    return [inequalities("printed", "(4.4) at the limit of runs, for v in K", seen)]


Check = Callable[[RunsOfLevel], list[Evidence]]

#: What answers for each statement.
CHECKS: dict[str, Check] = {
    "2.3": _action_and_reaction,
    "2.4": _signorini,
    "2.6": _friction,
    "3.1.3": strong_form,
    "4.4": _original,
    "4.5": _lift,
    "4.9.1": _step_1,
    "4.9.2": _step_2,
    "4.9.3": _step_3,
    "prop-5.1": forces_carry_displacements,
    "5.1": _neumann_problem,
    "5.2": _shifted_problem,
    "lemma-5.2": _limit,
    "5.3": _obstacle_problem,
    "5.4": _definition_of_T,
    "5.5": _contact_problem,
    "5.6": _loaded_problem,
    "thm-5.9.1": forces_converge,
    "thm-5.9.2": fields_converge,
}


def solutions(
    ids: Collection[str] | None = None, level: Level = "quick", watch: Callable[[float], None] = lambda done: None
) -> dict[str, list[Evidence]]:
    """Evidence for statements about solutions, iterates and their limit: a ``Source``.

    Full halves the meshes too, draws problems at random and runs to the end.

    Examples
    --------
    >>> [e.holds for e in solutions(["2.3"], "quick")["2.3"]]
    [False, True]
    """
    return gather(CHECKS, RunsOfLevel(level=level), ids, watch)

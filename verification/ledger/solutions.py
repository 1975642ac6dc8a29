"""Statements about solutions and iterates, checked with the weak forms (:mod:`verification.ledger.weak_forms`).

>>> [e.holds for e in solutions(["2.3"], "quick")["2.3"]]
[False, True]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
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
from verification.ledger.evidence import Evidence, figure, source
from verification.ledger.weak_forms import (
    EXACT,
    LIMIT,
    Case,
    Fields,
    Found,
    Weak,
    balance,
    contact_inequality,
    coulomb,
    directions,
    equations,
    evidence,
    figures,
    generator,
    image_of,
    inequalities,
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
    with_friction,
)

Check = Callable[[RunsOfLevel], list[Evidence]]


def _action_and_reaction(setting: RunsOfLevel) -> list[Evidence]:
    seen = [(case, reaction(case.weak, case.solution)) for case in setting.cases]
    normal = [Found(case, np.array([s["sigma_N^1 = sigma_N^2"]])) for case, s in seen]
    opposite = [Found(case, np.array([s["sigma_T^1 = -sigma_T^2"]])) for case, s in seen]
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
    seen = [Found(case, unilateral(case.weak, case.solution)) for case in setting.cases]
    forces = [
        -case.weak.force(case.weak.one, case.solution.one)[case.weak.pair.contact.grid.normal] for case in setting.cases
    ]
    closed = sum(int((f > EXACT * (np.abs(f).max() or 1.0)).sum()) for f in forces)
    nodes = sum(map(len, forces))
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
    seen = [Found(case, coulomb(case.weak, case.solution)) for case in plane]
    slips = [np.abs(c.weak.jump(c.solution.one, c.solution.two)[c.weak.pair.contact.grid.tangential]) for c in plane]
    # a jump below this share of the largest one is rounding
    sliding = sum(int((s > 1e-9 * (s.max() or 1.0)).sum()) for s in slips)
    nodes = sum(map(len, slips))
    text = f"both lines at {nodes} nodes, {sliding} of them with a jump, with sigma_T that of body 1"
    return [equations("printed", text, seen, nodes=nodes, sliding=sliding)]


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
            seen.append(Found(case, np.concatenate([pairing.ravel(), trace])))
    return [equations("printed", "a(R phi, v) = 0 for v = 0 on Gamma_c, and R phi = phi there, on both bodies", seen)]


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


def _fixed_point(found: Sequence[Case]) -> Evidence:
    seen = []
    for case in found:
        neumann, g = case.weak.pair.neumann, case.g
        moved = neumann.dual_norm(image_of(case.weak.pair, g).image - g) / (neumann.dual_norm(g) or 1.0)
        seen.append(Found(case, np.array([moved])))
    return equations("printed", "T g = g for the contact forces g of the global method", seen)


#: A check at one place of a run or at the solution: the weak forms, the place, a random generator and the number of
#: random test functions lead to residuals or to left minus right sides.
Values = Callable[[Weak, Any, np.random.Generator, int], Floats]

#: The places of a problem.
Places = Callable[[Case], Iterable[Any]]

_balance: Values = lambda weak, u, rng, n: balance(weak, u, directions(rng, weak.two, n))
_inequality: Values = lambda weak, u, rng, n: inequality(weak, u, moves_in_K(weak, u, rng, n))
_shifted: Values = lambda weak, u, rng, n: shifted_inequality(weak, u, obstacle_tests(weak, u, rng, n))
_contact: Values = lambda weak, u, rng, n: contact_inequality(weak, u, moves_of_one(weak, u, rng, n))


def _loaded(weak: Weak, state: Iterate, rng: np.random.Generator, n: int) -> Floats:
    return neumann_equation(weak, weak.at(state).two, state.g, directions(rng, weak.two, n))


def _transfer(weak: Weak, item: tuple[Iterate, Floats], rng: np.random.Generator, n: int) -> Floats:
    state, image = item
    return transfer(weak, weak.at(state), image, directions(rng, weak.two, n))


def _images(case: Case) -> list[tuple[Iterate, Floats]]:
    """Steps of the run, each with T of its force as step III of the algorithm gives it."""
    theta = float(case.run.theta)
    return [(state, (following.g - (1 - theta) * state.g) / theta) for state, following in case.steps]


_solution: Places = lambda case: [case.solution]
_limits: Places = lambda case: [case.limit] if case.run.converged else []
_begun: Places = lambda case: [state for state, _ in case.steps]
_fields_of_steps: Places = lambda case: [case.weak.at(state) for state, _ in case.steps]
_arbitrary: Places = lambda case: case.arbitrary
_arbitrary_fields: Places = lambda case: [case.weak.at(state) for state in case.arbitrary]
_arbitrary_images: Places = lambda case: [(state, state.image) for state in case.arbitrary]


def _everywhere(
    id: str,
    judge: Callable[..., Evidence],
    text: str,
    items: Places,
    values: Values,
    of: str = "printed",
    limit: float = EXACT,
) -> tuple[str, Check]:
    """A statement with the check of its weak form at all items of all problems, with its own random numbers."""

    def check(setting: RunsOfLevel) -> list[Evidence]:
        rng = generator(id)
        at = [(case, item) for case in setting.cases for item in items(case)]
        found = [Found(case, values(case.weak, item, rng, setting.count), limit) for case, item in at]
        return [judge(of, text, found)]

    return id, check


AT_SOLUTION, RANDOM, RUNS = "at the solution of the global method, for", "at random psi, for", "along runs"
LEMMA_5_2 = "(4.4) at the limit of runs, for v in K"
STEP_2 = f"with the jump [u_T] in the friction term, {RUNS}, for w in V^1_-(0)"

#: Statements that are one weak form.
FORMS: dict[str, Check] = dict(
    [
        _everywhere("4.4", inequalities, f"{AT_SOLUTION} v in K", _solution, _inequality),
        _everywhere("4.9.1", equations, f"for v in V^2, {RUNS}", _begun, _loaded),
        _everywhere("4.9.2", inequalities, STEP_2, _fields_of_steps, _shifted, of="repaired"),
        _everywhere("4.9.3", equations, f"for v in V^2, {RUNS}", _images, _transfer),
        _everywhere("5.1", equations, f"{AT_SOLUTION} v in V^2", _solution, _balance),
        _everywhere("5.2", inequalities, f"{AT_SOLUTION} w in V^1_-(0)", _solution, _shifted),
        _everywhere("lemma-5.2", inequalities, LEMMA_5_2, _limits, _inequality, limit=LIMIT),
        _everywhere("5.3", inequalities, f"{AT_SOLUTION} v in V^1_-(u^2_N)", _solution, _contact),
        _everywhere("5.4", equations, f"{RANDOM} v in V^2", _arbitrary_images, _transfer),
        _everywhere("5.5", inequalities, f"{RANDOM} v in V^1_-(w^2_N)", _arbitrary_fields, _contact),
        _everywhere("5.6", equations, f"{RANDOM} v in V^2", _arbitrary, _loaded),
    ]
)

#: The check of each statement.
CHECKS: dict[str, Check] = {
    **FORMS,
    "2.3": _action_and_reaction,
    "2.4": _signorini,
    "2.6": _friction,
    "3.1.3": strong_form,
    "4.5": _lift,
    "4.9.2": lambda setting: [_printed_step_2(setting.cases), *FORMS["4.9.2"](setting)],
    "prop-5.1": forces_carry_displacements,
    "5.4": lambda setting: [*FORMS["5.4"](setting), _fixed_point(setting.cases)],
    "thm-5.9.1": forces_converge,
    "thm-5.9.2": fields_converge,
}

#: Evidence for statements about solutions, iterates and their limit.  Full halves the meshes too, draws problems at
#: random and runs to the end.
solutions = source(CHECKS, lambda level, watch: RunsOfLevel(level=level))

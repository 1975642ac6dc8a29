"""Properties of every relaxation rule."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import islice
from math import sqrt
from typing import Any

import numpy as np
from hypothesis import strategies as st

from fem1d2d.mesh import Floats
from ndtheory import evaluate_energy
from verification.algorithm.fixed_point import FixedPointMap, iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.relaxation import Constant, Newton, Rule, Step, rule_of
from verification.algorithm.runs import run
from verification.algorithm.theta import below_one, choose, energy_bounds
from verification.constants import measure
from verification.contact import ContactError
from verification.interface.pair import ContactPair
from verification.testing.properties import Fails, Finding, Kit, Report, over
from verification.testing.strategies import force_scale, forces, pairs
from verification.testing.transforms import in_units, mirrored, reflect, upside_down

#: How many steps of two runs are compared; accelerated rules enlarge rounding from step to step.
STEPS = 6

#: Two runs are the same up to this part of their largest force.
SAME = 1e-6

#: A run is compared down to this relative residual: below it a rule divides rounding by rounding.
CLEAR = 1e-4

#: Tolerance, and most steps, of a run that looks for the solution, and of one of the rule that is checked.
SOLVED, ARRIVED, MOST = 1e-13, 1e-9, 300

#: A rate claims that ``|g_n - g| <= 4 sqrt(1 + rho) rate^n |g_0 - g|`` in the norm (5.21).  Of the triple
#: momentum method it is proved, where 4 stands for 2 (1 + p)/(2 - p) with p < 1.
CONSTANT = 4.0

#: The share of a claimed rate that the mutant has.
MUTANT = 0.9


def check_rule(rule: Rule, *, examples: int = 20) -> Report:
    """Test a relaxation rule.

    ``stays at the solution``
        Where ``T g = g`` the next g is g.
    ``ends at the solution``
        Wherever its run converges it has found the solution that the theorem says is the only one, in both roles of the
        bodies; and some run converges.
    ``starts afresh``
        A run is not changed by another one, before it or beside it.
    ``is independent of units``
        In other units of stress and length, and with loads and gaps 4, 16, .. times as large, it takes the same steps.
    ``sees no left, right, top or bottom``
        The mirror image of a pair, and the pair with the numbers of its bodies exchanged, gives the same steps.
    ``keeps its proved rate``
        ``|g_n - g| <= 4 sqrt(1 + rho) rate^n |g_0 - g|`` in the norm (5.21), where it claims a rate; ``attained`` where
        some run refutes 0.9 of that rate.

    ``examples`` is the number of cases for each property; the first property that fails raises Refused.
    """
    rule = rule_of(rule)
    kit = Kit(f"rule {rule.name!r}", examples)
    tests: dict[str, tuple[Any, Any]] = {
        "stays at the solution": (SOLVED_PAIRS, _stays),
        "starts afresh": (st.fixed_dictionaries({"case": _begun(), "other": _begun()}), _starts_afresh),
        "is independent of units": (_begun(), _is_independent_of_units),
        "sees no left, right, top or bottom": (_begun(), _sees_no_sides),
    }
    stays, *others = (kit.examine(name, cases, partial(test, rule)) for name, (cases, test) in tests.items())
    return kit.report(stays, _ends(kit, rule), *others, _rate(kit, rule))


# --- cases ------------------------------------------------------------------------------------------------------------


@st.composite
def _contracting(draw: st.DrawFn) -> ContactPair:
    """A pair with one solution, by the theorem in energy norms: k is 0, or half of what it allows in either role."""
    pair = draw(pairs())
    if not pair.friction:
        return pair
    roles = [pair, pair.swapped()] if pair.interface.one_grid else [pair]
    thresholds = [measure(role).friction_threshold for role in roles]
    allowed = min(0.0 if threshold is None else threshold.value for threshold in thresholds)
    return pair.at(friction=min(pair.friction, Fraction(allowed) / 2))


SOLVED_PAIRS = st.fixed_dictionaries({"pair": _contracting()})


@st.composite
def _begun(draw: st.DrawFn) -> dict[str, Any]:
    pair = draw(pairs())
    return {"pair": pair, "theta": Fraction(draw(st.integers(1, 19)), 20), "start": draw(forces(pair))}


def opened(pair: ContactPair) -> ContactPair:
    """The same bodies so far apart that their loads do not bring them together."""
    sides = (pair.contact, pair.neumann)
    soft = min(float(np.linalg.eigvalsh(side.schur[np.ix_(side.free, side.free)])[0]) for side in sides)
    far = 1e4 * force_scale(pair) * pair.neumann.grid.size / soft  # further than the largest of `forces` moves them
    return replace(pair, interface=replace(pair.interface, gap=pair.interface.gap + far), problem=None)


def proved_theta(pair: ContactPair) -> tuple[Fraction, float]:
    """The theta of least proved factor, and that factor."""
    constants = measure(pair).energy_constants()
    assert constants is not None
    best = evaluate_energy(constants).theta_proved
    assert best is not None
    theta = below_one(best)
    factor = evaluate_energy(constants, theta).factor
    assert factor is not None
    return theta, factor.value


def solution(pair: ContactPair) -> tuple[Floats, float]:
    """The only fixed point of T and a bound on its error in the norm (5.21), for a pair with a proved theta.

    ``|g - g*| <= theta |T g - g|/(1 - q)`` for every g; Fails where no rule of this project found it.
    """
    theta, q = proved_theta(pair)
    settings = replace(pair.settings, tolerance=SOLVED, max_iterations=40 * MOST)
    # loads along Gamma_c without friction leave no force on it but rounding of theirs
    loads = max(map(pair.neumann.dual_norm, (pair.neumann.load, pair.interface.carry_back(pair.contact.load))))
    for rule in (Newton(), Constant()):
        done = run(replace(pair, settings=settings), theta=theta, rule=rule)
        if done.last.residual <= 100 * SOLVED * max(done.last.scale, loads):
            return done.last.g, float(theta) * done.last.residual / (1 - q)
    raise Fails(f"no solution to compare with: residual {done.last.residual:.2g}")


def begun(rule: Rule, pair: ContactPair, theta: Fraction | str) -> Step:
    """The rule at the beginning of a run, which makes the next g of an iterate."""
    choice = choose(pair, theta, rule=rule)
    return rule.begin(pair, float(choice.theta), choice.rho)


def walk(rule: Rule, pair: ContactPair, theta: Fraction | str, start: Floats) -> Iterator[Iterate]:
    """The iterates of a run, without end."""
    return iterates(FixedPointMap(pair), begun(rule, pair, theta), start)


def steps(rule: Rule, pair: ContactPair, theta: Fraction, start: Floats, count: int = STEPS) -> list[Floats]:
    """The g of the first steps of a run, as long as the residual is far above rounding."""
    found: list[Floats] = []
    for step in islice(walk(rule, pair, theta, start), count):
        found.append(np.array(step.g))
        if not step.residual > CLEAR * step.scale:
            break
    return found


# --- tests of one case ------------------------------------------------------------------------------------------------


def _stays(rule: Rule, pair: ContactPair) -> None:
    g, error = solution(pair)
    norm = pair.neumann.dual_norm
    step, at = begun(rule, pair, below_one(float(proved_theta(pair)[0]))), iterate_at(FixedPointMap(pair), g)
    for n in (1, 2):
        moved = norm(step(at) - g)
        if not moved <= 1e-7 * at.scale + 100 * error:
            raise Fails(f"T g = g, and step {n} moves g by {moved:.2g} of {at.scale:.2g} in the norm (5.21)")


def _ends(kit: Kit, rule: Rule) -> Finding:
    outcomes: list[str] = []

    def test(pair: ContactPair) -> None:
        g, error = solution(pair)
        roles = [(pair, g, error)]
        if pair.interface.one_grid:
            swapped = pair.swapped()
            turned = -pair.neumann.grid.turn(g)  # the force on the other body, along the other normal
            roles.append((swapped, turned, _in(swapped, pair, error)))
        for role, expected, known in roles:
            theta, q = proved_theta(role)
            settings = replace(role.settings, tolerance=ARRIVED, max_iterations=MOST)
            try:
                done = run(replace(role, settings=settings), theta=theta, rule=rule)
            except ContactError as failure:
                raise Fails(f"it led to a force at which step II has no solution: {failure}") from None
            if done.iterations:  # it did not begin at the solution
                outcomes.append(done.outcome)
            off = role.neumann.dual_norm(done.last.g - expected)
            allowed = float(theta) * done.last.residual / (1 - q) + known
            if done.converged and not off <= 2 * allowed + 1e-12 * done.last.scale:
                raise Fails(f"its run converged {off:.2g} away from the solution, {done.last.scale:.2g} large")

    finding = kit.examine("ends at the solution", SOLVED_PAIRS, test)
    reached = outcomes.count("converged")
    if not reached:
        how = f"none of {len(outcomes)} runs converged, and a constant theta is proved to in each"
        raise kit.refused(finding.property, how, outcomes=sorted(set(outcomes)))
    return replace(finding, detail=f"{reached} of {len(outcomes)} runs converged")


def _in(role: ContactPair, other: ContactPair, error: float) -> float:
    """An error in the norm (5.21) of one role, in the norm of the other role: at most sqrt(rho) times as large."""
    rho = measure(role).rho_max if other.interface.one_grid else None
    # g' S_b^-1 g <= lambda g' S_a^-1 g with lambda = lambda_max(S_a, S_b)
    assert rho is not None
    return sqrt(rho.value) * error


def _is_independent_of_units(rule: Rule, pair: ContactPair, theta: Fraction, start: Floats) -> None:
    own = steps(rule, pair, theta, start)
    plane = pair.contact.grid.dimension == 2
    scales = (
        ("loads and gaps", {"force": 4.0**5}),
        ("the unit of stress", {"stress": 4.0**-7}),
        ("the unit of length", {"length": 4.0**4}),
    )
    for what, units in scales:
        factor = np.prod([value for name, value in units.items() if plane or name != "length"])
        other = steps(rule, in_units(pair, **units), theta, factor * start)
        _compare(own, [g / factor for g in other], f"with {what} times a power of 4")


def _starts_afresh(rule: Rule, case: dict[str, Any], other: dict[str, Any]) -> None:
    first = steps(rule, **case)
    steps(rule, **other)
    _compare(first, steps(rule, **case), "after another run", same=0.0)
    runs = [islice(walk(rule, **given), len(first)) for given in (case, other)]
    beside = [np.array(step.g) for step, _ in zip(*runs, strict=True)]
    _compare(first, beside, "beside another run", same=0.0)


def _sees_no_sides(rule: Rule, pair: ContactPair, theta: Fraction, start: Floats) -> None:
    own = steps(rule, pair, theta, start)
    image = steps(rule, mirrored(pair), theta, reflect(pair, start))
    _compare(own, [reflect(pair, g) for g in image], "in a mirror")
    _compare(own, steps(rule, upside_down(pair), theta, start), "with the numbers of the bodies exchanged")


def _compare(own: list[Floats], other: list[Floats], where: str, same: float = SAME) -> None:
    size = 0.0
    for n, (g, h) in enumerate(zip(own, other, strict=False)):
        size = max(size, float(np.abs(g).max()))
        off = float(np.abs(g - h).max())
        if not off <= same * size:
            raise Fails(f"{where} step {n} differs by {off:.2g} of {size:.2g}")
    if len(own) != len(other) and same == 0.0:
        raise Fails(f"{where} the run is another: {len(own)} steps and {len(other)}")


# --- the proved rate --------------------------------------------------------------------------------------------------


def _rate(kit: Kit, rule: Rule) -> Finding:
    property = "keeps its proved rate"
    if rule.proved_rate(1.0) is None:
        return Finding(property=property, verdict="not asked", detail="it claims none")
    refuted = 0
    tried = 0

    @st.composite
    def cases(draw: st.DrawFn) -> dict[str, Any]:
        pair = draw(pairs(friction=st.just(Fraction(0))) if rule.outside(Fraction(1)) else _contracting())
        if draw(st.booleans()):  # nothing touches: T is constant, the slowest mode of an accelerated rule
            pair = opened(pair)
        return {"pair": pair, "start": draw(forces(pair))}

    def test(pair: ContactPair, start: Floats) -> None:
        nonlocal refuted, tried
        found = energy_bounds(measure(pair))
        assert found is not None
        rate = rule.proved_rate(found.rho.value)
        if rate is None:
            return
        tried += 1
        g, error = solution(pair)
        norm, rho = pair.neumann.dual_norm, found.rho.value
        first = norm(start - g)
        noise = 10 * error + 1e-12 * (norm(start) + norm(g) + norm(pair.neumann.load))
        beaten = False
        for n, step in enumerate(islice(walk(rule, pair, "auto", start), 80)):
            off = norm(step.g - g)
            if not off <= CONSTANT * sqrt(1 + rho) * rate**n * first + noise:
                raise Fails(f"after {n} steps the error is {off / first:.2g} of the first, claimed is {rate:.4g}^n")
            beaten |= off > CONSTANT * sqrt(1 + rho) * (MUTANT * rate) ** n * first + noise
            if off <= noise:
                break
        refuted += beaten

    finding = kit.examine(property, cases(), test)
    if not refuted:
        return replace(finding, verdict="not attained", detail=f"no run refutes {MUTANT} of it; {over(tried)}")
    return replace(finding, verdict="attained", detail=f"{refuted} of {tried} runs refute {MUTANT} of it")

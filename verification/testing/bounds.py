"""Properties of every bound on the factor of one step."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import strategies as st

from fem1d2d.mesh import Floats
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.rates import ForceNorm
from verification.bounds.bound import Bound, BoundResult, Subject
from verification.constants import measure
from verification.interface.build import build
from verification.interface.pair import ContactPair
from verification.problem import Problem
from verification.semidefinite.pattern_search import largest_factor
from verification.testing.properties import Fails, Finding, Kit, Report, over
from verification.testing.strategies import SEEDS, bar_problems, forces, matrix_pairs, plane_problems
from verification.testing.transforms import problem_in_units, problem_mirrored

#: An observed factor may exceed its bound by this rounding error.
NOISE = 1e-10

#: The share of a factor that one mutant claims; another one claims 1/MUTANT of the gain.
MUTANT = 0.9

#: A bound that is attained is refused if none of so many conclusions, or more, came near a step.
ENOUGH = 5

#: Distances of two random forces, over their size.
DISTANCES = (1e-2, 1.0, 1e2)


def check_bound(bound: Bound, *, examples: int = 20) -> Report:
    """Test a bound on the factor of one step.

    ``bounds every step``
        ``|T_theta f - T_theta g| <= factor |f - g|`` in the norm of the result, for random forces, and for the two
        forces that a search over contact patterns finds worst; on pairs of meshes and of matrices, in both roles, with
        friction, constant or not, and without.  Asked where the result says that it is proved.
    ``attained``
        Whether a step refutes the mutant that claims 0.9 of the factor, and the one that claims 1/0.9 of the gain
        ``1 - factor``.  A bound that says so (``attained``) must be refuted in some case, where five or more have a
        conclusion; of another it is reported.
    ``knows no unit of stress``
        The factor is the same with both moduli and all loads 4096 times as large.  Not asked of a bound whose
        violation is a finding (``finding``): that may depend on the unit, and is proved only where m >= 1.
    ``knows no unit of length``
        The factor is the same with all lengths 1024 times as small, the length of the norm too.
    ``sees no left or right``
        The mirror image has the same factor.

    Where a bound draws no conclusion at a drawn theta, one of the interval that it names is taken.  ``examples`` is the
    number of cases for each property; the first property that fails raises Refused.
    """
    kit = Kit(f"bound {bound.name!r}", examples)
    findings = _holds(kit, bound)
    scaled: dict[str, Any] = {
        "knows no unit of stress": lambda problem: problem_in_units(problem, stress=Fraction(4096)),
        "knows no unit of length": lambda problem: problem_in_units(problem, length=Fraction(1, 1024)),
        "sees no left or right": problem_mirrored,
    }
    for property, image in scaled.items():
        if property == "knows no unit of stress" and bound.finding:
            why = "a violation is a finding: it may depend on the unit"
            findings.append(Finding(property=property, verdict="not asked", detail=why))
            continue
        test = lambda problem, theta, seen=image: _same(bound, problem, seen(problem), theta)
        findings.append(kit.examine(property, _problems(), test))
    return kit.report(*findings)


# --- cases ------------------------------------------------------------------------------------------------------------

#: None, what Section 5 allows, and what the theorem in energy norms allows, at times and always.
FRICTIONS = st.sampled_from(
    [Fraction(0), Fraction(0), Fraction(1, 10**9), Fraction(1, 10), Fraction(3, 10), Fraction(1)]
)
THETAS = st.integers(1, 19).map(lambda n: Fraction(n, 20))


#: Problems on few cells, with and without friction, constant or not.
SMALL = st.one_of(plane_problems(friction=FRICTIONS, law="nonlocal", most_cells=2, varying=True), bar_problems())


@st.composite
def _problems(draw: st.DrawFn) -> dict[str, Any]:
    """Problems whose bodies have an even number of cells along x, so that their meshes have a mirror image."""
    data = draw(SMALL)
    if data["dimension"] == 2:
        for name in ("body1", "body2"):
            along, across = data[name]["cells"]
            data[name]["cells"] = [2 * along, across]
    return {"problem": Problem.from_dict(data), "theta": draw(THETAS)}


@st.composite
def _pushed(draw: st.DrawFn) -> dict[str, Any]:
    """A pair with forces, and a seed for the search over contact patterns."""
    meshes = SMALL.map(lambda data: build(Problem.from_dict(data)))
    pair = draw(st.one_of(meshes, matrix_pairs(friction=FRICTIONS, most_nodes=3)))
    return {
        "pair": pair,
        "theta": draw(THETAS),
        "force": draw(forces(pair)),
        "other": draw(forces(pair)),
        "seed": draw(SEEDS),
    }


def conclusion(bound: Bound, pair: ContactPair, theta: Fraction) -> BoundResult:
    """The result of a bound at theta, or inside the interval that it names where it has no factor at theta."""
    subject = Subject.of(pair, measure(pair))
    result = bound.evaluate(subject, theta)
    if result.factor is None and result.interval is not None:
        low, high = result.interval
        inside = Fraction(low) + theta * (Fraction(min(high, 1.0)) - Fraction(low))
        result = bound.evaluate(subject, inside)
    return result


def observed(
    pair: ContactPair, theta: float, force: Floats, other: Floats, seed: int, own: ForceNorm | None = None
) -> float:
    """The largest factor of a step that was found, in (5.21) or another norm.

    By two random forces, and by a search over contact patterns.
    """
    random = np.random.default_rng(seed)
    T, carry_back = FixedPointMap(pair), pair.interface.carry_back
    norm = pair.neumann.dual_norm if own is None else own.of
    at = carry_back(T(force)[1].force)
    size = norm(force) / (norm(other) or 1.0)
    largest = 0.0
    for distance in DISTANCES:
        moved = distance * size * other
        change = theta * (carry_back(T(force + moved)[1].force) - at) + (1 - theta) * moved
        largest = max(largest, norm(change) / norm(moved))
    kernel = pair.interface.kernel
    if pair.rubs and kernel is not None and np.linalg.matrix_rank(kernel) < len(kernel):
        return largest  # not every contact pattern comes about
    return max(largest, largest_factor(pair, theta, random=random, starts=2, norm=own).value)


# --- tests ------------------------------------------------------------------------------------------------------------


def _holds(kit: Kit, bound: Bound) -> list[Finding]:
    asked = 0
    factor_refuted = gain_refuted = 0
    share = 0.0

    def test(pair: ContactPair, theta: Fraction, force: Floats, other: Floats, seed: int) -> None:
        nonlocal asked, factor_refuted, gain_refuted, share
        result = conclusion(bound, pair, theta)
        if result.factor is None or not result.proved or result.theta is None or result.theta == 0:
            return
        factor = result.factor.value
        gain = 1 - factor if result.one_minus_factor is None else result.one_minus_factor.value
        asked += 1
        seen = observed(pair, float(result.theta), force, other, seed, result.norm)
        if not seen <= factor + NOISE:
            raise Fails(f"a step has the factor {seen:.6g}, the bound is {factor:.6g} at theta = {result.theta:.4g}")
        factor_refuted += seen > MUTANT * factor + NOISE
        gain_refuted += 1 - seen < gain / MUTANT - NOISE
        share = max(share, gain / (1 - seen)) if seen < 1 else share

    holds = kit.examine("bounds every step", _pushed(), test)
    holds = replace(holds, detail=f"{over(asked)} with a conclusion, of {holds.detail}")
    if not asked:
        why = f"it drew no conclusion in any of {holds.detail}"
        return [replace(holds, verdict="not asked", detail=why)]
    said = (
        f"{factor_refuted} of {asked} cases refute {MUTANT} of the factor, {gain_refuted} 1/{MUTANT} of the gain;"
        f" at most {share:.3g} of the gain seen is claimed"
    )
    if bound.attained and asked >= ENOUGH and not (factor_refuted and gain_refuted):
        raise kit.refused("attained", f"no step comes near it: {said}")
    verdict = "attained" if factor_refuted and gain_refuted else "not attained"
    return [holds, Finding(property="attained", verdict=verdict, detail=said)]


def _same(bound: Bound, problem: Problem, image: Problem, theta: Fraction) -> None:
    found = [conclusion(bound, build(given), theta).factor for given in (problem, image)]
    values = [factor.value for factor in found if factor is not None]
    if len(values) == 1 or np.ptp(values or [0.0]) > bound.repeats:
        one, two = ("not there" if factor is None else f"{factor.value:.10g}" for factor in found)
        raise Fails(f"the factor is {one}, and {two} there")

"""The numerical results of Section 6: what its figures claim, as :mod:`verification.reproduce` runs them again.

The text leaves open where the upper body sits, how its top is held and who has the Neumann problem.  A claim on the
paper's own bodies holds here if some reading shows it; that none of them does decides nothing, since none may be the
paper's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.monolithic import solution_force
from verification.algorithm.runs import Run, run
from verification.interface.fields import ContactFields
from verification.interface.pair import ContactPair
from verification.ledger.evidence import Evidence, Level, figure, source
from verification.reproduce import READINGS, ModelReading, reproduce
from verification.reproduce.claims import CLAIMS, HARD, OPTIMUM, SERVES, SOFT, Claim, Curve, zones
from verification.reproduce.experiments import Outcome, Result, curve_of
from verification.reproduce.refutation import COMMON, LISTED, PRINTED, Runs, judged
from verification.sweeps.row import FAILED, PAPER, Row, meets_paper_test

#: Results are the same below this relative difference, where runs go on until this residual.
SAME, TIGHT = 1e-8, 1e-12

AT = f"theta = {float(PRINTED):g}"

#: The first of the readings that agree with the text.
LITERAL = READINGS[0]

#: What all readings assume.
ASSUMED = {"law": "nonlocal", "radius": 0.1, "elements": "P1"}


class Section6:
    """The runs of each reading, made once for all claims.

    Quick takes only the mesh of 190 nodes, and more meshes of one reading where that settles a claim.  ``run`` makes a
    row from a reading and values of a grid; by default it runs the problem of the reading.
    """

    def __init__(
        self,
        level: Level,
        readings: Sequence[ModelReading] = READINGS,
        run: Callable[[ModelReading, Mapping[str, Any]], Row] | None = None,
    ) -> None:
        self.readings = readings
        self._meshes = None if level == "full" else (COMMON["refine"],)
        given = lambda reading: None if run is None else lambda values: run(reading, values)
        self.runs = cache(lambda reading: Runs(reading, given(reading)))
        self.zones = cache(lambda reading: reproduce(["fig5"], readings=[reading]).results[0].outcomes[0])

    def result(self, claim: Claim) -> Result:
        """A claim in every reading.

        If no reading shows it on the meshes of the level, those that are undecided get all meshes until one shows it.
        """
        steps = lambda reading: judged(claim, self.runs(reading), self._meshes)
        outcome = self.zones if claim is CLAIMS["fig5"] else steps
        outcomes = {reading: outcome(reading) for reading in self.readings}
        for reading in [reading for reading, seen in outcomes.items() if seen.holds is None and not seen.refused]:
            if any(seen.holds for seen in outcomes.values()):
                break
            outcomes[reading] = judged(claim, self.runs(reading))
        return Result(figure=claim.name, outcomes=tuple(outcomes.values()))

    @property
    def compared(self) -> list[ModelReading]:
        """The readings in which runs are compared with the global method: quick takes only readings of the text."""
        return [reading for reading in self.readings if self._meshes is None or not reading.departs]


def _evidence(holds: bool | None, text: str, **data: Any) -> Evidence:
    return Evidence(method="discrete", of="printed", holds=holds, text=text, data={"assumed": ASSUMED, **data})


# What is claimed of the paper's own bodies.


def in_readings(claim: Claim, result: Result) -> Evidence:
    """A claim on the paper's own bodies: it holds where a reading shows it, under what that assumes."""
    outcomes, verdict = result.outcomes, result.verdict
    shown = [outcome.reading for outcome in outcomes if outcome.holds]
    open_ = [outcome for outcome in outcomes if outcome.holds is None and not outcome.refused]
    refused = sum(outcome.refused for outcome in outcomes)
    tried = f"the {len(outcomes)} readings tried" + (f", {refused} of which are refused" if refused else "")
    if verdict == "reproduced":
        text = f"reproduced in every reading that leaves the text nowhere, and in {len(shown)} of {tried}"
    elif verdict == "reproduced under an assumption":
        under = "; or that ".join(", ".join([*reading.assumes, *reading.departs]) for reading in shown)
        left = f", and undecided in {len(open_)}" if open_ else ""
        text = f"reproduced under an assumption, in {len(shown)} of {tried}{left}: that {under}"
    elif verdict == "undecided":
        text = f"undecided in {len(open_)} of {tried}, as {open_[0].reading.name}: {open_[0].reason}"
    else:
        text = f"in none of {tried}; {_nearest(claim, result.closest)}"
    data = {"criterion": claim.criterion, "outcome": verdict, "readings": [_data(outcome) for outcome in outcomes]}
    text = f"{claim.says} (criterion: {claim.criterion}): {text}"
    return _evidence(True if shown else None, text, departs=_departs(shown), **data)


def _departs(shown: Sequence[ModelReading]) -> bool:
    """True if some readings show a claim, and each of them departs from the text."""
    return bool(shown) and all(reading.departs for reading in shown)


def _nearest(claim: Claim, outcome: Outcome) -> str:
    """The reading that comes nearest, and what it shows instead."""
    name = outcome.reading.name
    if outcome.contact is not None:
        told = ", ".join(f"{state} from {low:.3g} to {high:.3g}" for state, low, high in zones(outcome.contact))
        return f"nearest comes {name}: {told}"
    curve = max(outcome.curves, key=lambda curve: curve.cost, default=None)
    if curve is None:
        return f"{name}: {outcome.reason}"
    met = curve.steps[float(PRINTED)]
    counts = f"takes {met} steps, theta = {curve.best[0]:g} takes {curve.fewest}" if met else "does not meet the test"
    rest = f"; ndtheory reproduce {claim.name} makes all runs" if claim.name in CLAIMS else ""
    return f"by the runs made until each is refuted, nearest comes {name}: {AT} {counts} ({curve.label}){rest}"


def _data(outcome: Outcome) -> dict[str, Any]:
    """A reading with what was found; of steps over theta, with the runs that were made."""
    found: dict[str, Any] = {"reading": outcome.reading.name, "holds": outcome.holds}
    if outcome.reason:
        found["reason"] = {"holds": outcome.reason}
    if outcome.contact is not None:
        found["zones"] = [
            {"state": state, "from": figure(low), "to": figure(high)} for state, low, high in zones(outcome.contact)
        ]
    if outcome.curves:
        found["curves"] = [_counts(curve) for curve in outcome.curves]
    return found


def _counts(curve: Curve) -> dict[str, Any]:
    """The steps of the runs that were made, and where they did not meet the test."""
    met = {f"{theta:g}": n for theta, n in curve.steps.items() if n is not None}
    return {"label": curve.label, "steps": met, "not_met": [theta for theta, n in curve.steps.items() if n is None]}


def _claimed(claim: Claim) -> Callable[[Section6], list[Evidence]]:
    return lambda section: [in_readings(claim, section.result(claim))]


def _together(section: Section6) -> list[Evidence]:
    """Section 7: a report of the runs of Figures 10, 11 and 12, which a reading shows if it shows all three."""
    results = [section.result(CLAIMS[name]) for name in ("fig10", "fig11", "fig12")]
    held = [[outcome.holds for outcome in outcomes] for outcomes in zip(*(r.outcomes for r in results), strict=True)]
    shown = [reading for reading, holds in zip(section.readings, held, strict=True) if all(holds)]
    names = [reading.name for reading in shown]
    each = ", ".join(f"{result.figure} is {result.verdict}" for result in results)
    text = f"{each}; all three are shown by {len(shown)} of the {len(held)} readings tried"
    return [_evidence(True if shown else None, text, readings=names, departs=_departs(shown))]


# What is claimed of any bodies, by the paper (6.2) or by us.


def _same_results(section: Section6) -> list[Evidence]:
    """6.2: the run against the global method, in every reading in which the run arrives."""
    apart, readings = {}, section.compared
    for reading in readings:
        runs, contact = section.runs(reading), section.zones(reading).contact
        if contact is not None and runs.row(COMMON, PRINTED)["outcome"] == "converged":
            apart[reading.name] = difference(finished(runs.pair(), PRINTED, TIGHT).contact, contact)
    whole = readings == list(section.readings)
    at, where = AT, "that were tried" if whole else "that are consistent with the text"
    if not apart:
        return [_evidence(None, f"in none of the {len(readings)} readings {where} a run at {at} arrives")]
    worst = max(apart, key=apart.__getitem__)
    data = {"readings": list(apart), "limit": SAME}
    if apart[worst] <= SAME:
        count = f"{len(apart)} of the {len(readings)} readings {where}"
        others = f"; in the others no run at {at} arrives" if len(apart) < len(readings) else ""
        text = f"stresses of runs at {at} and of the global method agree to {SAME:g} in {count}{others}"
        return [_evidence(True, text, **data)]
    text = f"a stress of the run is off by {apart[worst]:.3g} of the largest one ({worst})"
    return [_evidence(False, text, worst=figure(apart[worst], 3), where=worst, **data)]


def finished(pair: ContactPair, theta: Fraction, tolerance: float) -> Run:
    """A run that goes on until the unrelaxed residual is at most a bound."""
    settings = replace(pair.settings, tolerance=tolerance, max_iterations=3000)
    return run(replace(pair, settings=settings), theta=theta)


def difference(one: ContactFields, other: ContactFields) -> float:
    """Largest difference of nodal stress, relative to the largest stress of the other."""
    size = float(max(np.abs(other.pressure).max(), np.abs(other.shear).max()))
    apart = max(float(np.abs(one.pressure - other.pressure).max()), float(np.abs(one.shear - other.shear).max()))
    return apart / size


def _moduli(section: Section6) -> list[Evidence]:
    """Ours: no theta serves hard on soft and soft on hard.

    Every theta that serves hard on soft is tried on soft on hard.  There the steps over the fewest of the thetas tried
    are at most the true cost.
    """
    runs = section.runs(LITERAL)
    one = [runs.row(COMMON, theta) for theta in LISTED]
    hard = curve_of(f"E1 = {HARD:g}, E2 = {SOFT:g}", one)
    serve = [theta for theta in LISTED if hard.cost_at(float(theta)) <= SERVES]
    turned = {**COMMON, "young": (Fraction(SOFT), Fraction(HARD))}
    rho = runs.bodies.setting(turned).measured.rho_max
    assert rho is not None  # the reading has linear bodies that their supports hold
    near = min(LISTED, key=lambda theta: abs(theta - 2 / (2 + rho.value)))
    other = [runs.row(turned, theta) for theta in dict.fromkeys([near, *serve])]
    soft = curve_of(f"E1 = {SOFT:g}, E2 = {HARD:g}", other)
    both = [theta for theta in serve if soft.cost_at(float(theta)) <= SERVES]
    decided = all(row["outcome"] not in FAILED for row in [*one, *other]) and serve and not both
    fewest = lambda curve: "no theta arrives" if curve.fewest is None else f"{curve.fewest} steps at {curve.best[0]:g}"
    told = (
        f"{LITERAL.name}: with {hard.label} MPa theta = {_list(serve)} serves ({fewest(hard)}), of which"
        f" {_list(both)} serves with {soft.label} MPa ({fewest(soft)})"
    )
    criterion = f"a theta serves two bodies if it takes at most {SERVES:g} times the fewest steps of each"
    data = {"criterion": criterion, "reading": LITERAL.name, "curves": [_counts(hard), _counts(soft)]}
    return [_evidence(True if decided else None, told, **data)]


def _list(thetas: Sequence[Fraction]) -> str:
    """Thetas in words.

    >>> _list([Fraction(4, 5), Fraction(17, 20)]), _list([])
    ('0.8, 0.85', 'none')
    """
    return ", ".join(f"{float(theta):g}" for theta in thetas) or "none"


# The stopping test.

#: Two thetas that the increment test treats unlike, and units of stress in MPa.
SLOW, FAST = Fraction(1, 20), PRINTED
UNITS = {"MPa": 1, "TPa": 10**6}


@dataclass(frozen=True, kw_only=True)
class StoppedRuns:
    """A run when a test stops it: the unrelaxed residual over ``|||T g|||``, and the error ``|g_n - g|/|g|``."""

    steps: int
    residual: float
    error: float


def stopped(pair: ContactPair, theta: Fraction, g: Floats) -> tuple[StoppedRuns, StoppedRuns]:
    """A run where the printed test stops it, and where the unrelaxed residual does; the global method has found g."""
    seen, size = finished(pair, theta, PAPER / 10).iterates, float(np.linalg.norm(g))
    by_paper = (n for n in range(1, len(seen)) if meets_paper_test(seen[n].g[:, None], seen[n - 1].g[:, None])[0])
    by_residual = (n for n, iterate in enumerate(seen) if iterate.relative_residual <= PAPER)
    found = [
        StoppedRuns(steps=n, residual=seen[n].relative_residual, error=float(np.linalg.norm(seen[n].g - g)) / size)
        for n in (next(by_paper), next(by_residual))
    ]
    return found[0], found[1]


def _stopping(section: Section6) -> list[Evidence]:
    """Ours: the increment test depends on theta and on the unit of force, the test of the residual on neither."""
    runs = section.runs(LITERAL)
    pairs = {name: runs.pair(young=(Fraction(HARD, unit), Fraction(SOFT, unit))) for name, unit in UNITS.items()}
    found: dict[tuple[Fraction, str], tuple[StoppedRuns, StoppedRuns]] = {}
    for name, pair in pairs.items():
        g = solution_force(pair)
        found |= {(theta, name): stopped(pair, theta, g) for theta in (SLOW, FAST)}
    rho = runs.bodies.setting(COMMON).measured.rho_max
    assert rho is not None  # as above
    by = {"increment": 0, "unrelaxed relative residual": 1}
    return [on_test(name, {key: both[i] for key, both in found.items()}, rho.value) for name, i in by.items()]


def on_test(name: str, runs: Mapping[tuple[Fraction, str], StoppedRuns], rho: float) -> Evidence:
    """Evidence that the increment depends on theta or on the unit of force, or that the residual depends on neither.

    A test depends on neither if it stops at one unrelaxed residual, for all theta and units.  At one residual r the
    error ``(1 - T')^-1 r`` may still differ by the factor 1 + rho between slow and fast modes.
    """
    slow, fast = runs[SLOW, "MPa"], runs[FAST, "MPa"]
    steps = {float(theta): {unit: runs[theta, unit].steps for unit in UNITS} for theta in (SLOW, FAST)}
    same_unit = all(len(set(counts.values())) == 1 for counts in steps.values())
    ratio = {"residual": slow.residual / fast.residual, "error": slow.error / fast.error}
    # a stopped run lies within one step below the bound
    measures = max(slow.residual, fast.residual) <= PAPER and max(ratio["error"], 1 / ratio["error"]) <= 2 * (1 + rho)
    text = (
        f"a bound of {PAPER:g} on the {name} stops at theta = {float(SLOW):g} after {slow.steps} steps with a relative"
        f" residual of {slow.residual:.2g} and an error of {slow.error:.2g}, at theta = {float(FAST):g} after"
        f" {fast.steps} with {fast.residual:.2g} and {fast.error:.2g}; with forces in units of 1 MPa and of 1 TPa it"
        f" takes {steps[float(SLOW)]['MPa']} and {steps[float(SLOW)]['TPa']} steps, and {steps[float(FAST)]['MPa']} and"
        f" {steps[float(FAST)]['TPa']}"
    )
    figures = {
        f"theta {float(theta):g}, {unit}": {
            "iterations": seen.steps,
            "residual": figure(seen.residual, 3),
            "error": figure(seen.error, 3),
        }
        for (theta, unit), seen in runs.items()
    }
    ratios = {name: figure(value, 3) for name, value in ratio.items()}
    holds = (same_unit and measures) == (name != "increment")
    return _evidence(holds, text, reading=LITERAL.name, runs=figures, ratio=ratios, rho=figure(rho))


#: What answers for each statement.
CHECKS: dict[str, Callable[[Section6], list[Evidence]]] = {
    "sec-6.2": _same_results,
    "fig-5": _claimed(CLAIMS["fig5"]),
    "sec-6.3": _claimed(OPTIMUM),
    "fig-10": _claimed(CLAIMS["fig10"]),
    "fig-11": _claimed(CLAIMS["fig11"]),
    "fig-12": _claimed(CLAIMS["fig12"]),
    "sec-7": _together,
    "x-no-theta-for-all-moduli": _moduli,
    "x-increment-test": _stopping,
}

#: Evidence for the numerical results of Section 6.  Quick takes the mesh of 190 nodes, full all four.
experiments = source(CHECKS, lambda level, watch: Section6(level))

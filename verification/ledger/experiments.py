"""The numerical results of Section 6, on the model that can be read from the text.

What the text leaves open is assumed and named: where the upper body sits, how its top is held, the kernel of S, the
mesh (matching grids, so that the numbers of nodes are near the paper's 60, 190, 666, 2482 and not equal to them), which
body gets the Neumann problem (Sections 3 and 6 differ).  Nothing is tuned.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import groupby
from typing import Any, Literal

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.runs import run
from verification.interface.assembly import build
from verification.interface.pair import ContactPair
from verification.ledger.evidence import Evidence, Level, figure, gather
from verification.ledger.sweeps import (
    GEOMETRIES,
    HARD,
    MOST_STEPS,
    RADIUS,
    SAME,
    SOFT,
    STOP,
    TWO,
    Model,
    Neumann,
    Sweeps,
    Top,
    trace,
)
from verification.monolithic import solve
from verification.reproduce.claims import ALIKE, SERVES


def _evidence(of: Any, holds: bool | None, text: str, **data: Any) -> Evidence:
    assumed = {"radius": float(RADIUS), "law": "nonlocal"}
    return Evidence(method="discrete", of=of, holds=holds, text=text, data={"assumed": assumed, **data})


def _all_or_none(answers: Collection[bool]) -> bool | None:
    """A general claim: what every reading says; None where they differ."""
    return None if len(set(answers)) > 1 else next(iter(answers))


def _particular(answers: Collection[bool]) -> bool | None:
    """A claim on the paper's own bodies, which the text does not give in full.

    It holds if every reading of them says so.  That some or all say otherwise decides nothing: none may be the paper's.
    """
    return True if all(answers) else None


# The rows.


def _same_results(sweeps: Sweeps) -> list[Evidence]:
    """6.2: the run against the global method."""
    apart = {}
    for geometry in GEOMETRIES:
        for neumann, young in ((1, (HARD, SOFT)), (2, (SOFT, HARD))):
            problem = Model(geometry=geometry, neumann=neumann, young=young, halvings=sweeps.halvings).problem  # type: ignore[arg-type]
            problem = replace(problem, iteration=replace(problem.iteration, theta=Fraction(3, 5), tolerance=1e-12))
            apart[f"{geometry}, body {neumann} Neumann"] = difference(build(problem))
    worst = max(apart, key=apart.__getitem__)
    data = {"readings": list(apart), "limit": SAME}
    if apart[worst] <= SAME:
        text = f"stresses of runs at theta = 0.6 and of the global method agree to {SAME:g} in {len(apart)} readings"
        return [_evidence("printed", True, text, **data)]
    text = f"a stress of the run is off by {apart[worst]:.3g} of the largest one ({worst})"
    return [_evidence("printed", False, text, worst=figure(apart[worst], 3), where=worst, **data)]


def difference(pair: ContactPair) -> float:
    """Largest difference of nodal stress between run and global method, relative to the largest stress."""
    one, other = run(pair, solver="active-set").contact, solve(pair).contact
    size = float(max(np.abs(other.pressure).max(), np.abs(other.shear).max()))
    apart = max(float(np.abs(one.pressure - other.pressure).max()), float(np.abs(one.shear - other.shear).max()))
    return apart / size


def zones(x: Floats, states: Sequence[str]) -> list[dict[str, Any]]:
    """Runs of nodes in one state, with x from the left end of the interface.

    Examples
    --------
    >>> zones(np.array([1.0, 1.5, 2.0]), ["slip", "stick", "stick"])
    [{'state': 'slip', 'from': 0.0, 'to': 0.0}, {'state': 'stick', 'from': 0.5, 'to': 1.0}]
    """
    result, first = [], 0
    for state, members in groupby(states):
        last = first + len(list(members)) - 1
        result.append({"state": state, "from": figure(float(x[first] - x[0])), "to": figure(float(x[last] - x[0]))})
        first = last + 1
    return result


def as_printed(found: Sequence[Mapping[str, Any]], width: float) -> bool:
    """Whether zones are stick up to 0.6, slip up to 1, open beyond, within the width of a cell."""
    if [zone["state"] for zone in found] != ["stick", "slip", "open"]:
        return False
    return bool(abs(found[0]["to"] - 0.6) <= width and abs(found[1]["to"] - 1.0) <= width)


def _zones(sweeps: Sweeps) -> list[Evidence]:
    """Figure 5."""
    readings: list[dict[str, Any]] = []
    agree: list[str] = []
    tops: tuple[Top, ...] = ("held", "free")
    for geometry in GEOMETRIES:
        for top in tops:
            problem = Model(geometry=geometry, top=top, halvings=sweeps.halvings + 1).problem
            contact = solve(problem).contact
            found = zones(contact.x, contact.status)
            readings.append({"geometry": geometry, "u_x on the top": top, "zones": found})
            if as_printed(found, float(np.diff(contact.x).max())):
                agree.append(_name(readings[-1]))
    opened = [r["geometry"] for r in readings if any(zone["state"] == "open" for zone in r["zones"])]
    told = "; ".join(f"{_name(r)}: {_tell(r['zones'])}" for r in readings)
    closest = "as printed in " + ", ".join(agree) if agree else "as printed in none"
    where = "the position of the upper body is not in the text"
    text = f"{where}; {closest}, open somewhere in {len(opened)} of {len(readings)} readings: {told}"
    holds = _particular([reading in agree for reading in map(_name, readings)])
    return [_evidence("printed", holds, text, readings=readings)]


def _name(reading: Mapping[str, Any]) -> str:
    return f"{reading['geometry']}, top {reading['u_x on the top']}"


def _tell(found: Sequence[Mapping[str, Any]]) -> str:
    return ", ".join(f"{zone['state']} {zone['from']:.3g} to {zone['to']:.3g}" for zone in found)


def _one_theta(sweeps: Sweeps, families: Mapping[str, Sequence[Model]], what: str) -> Evidence:
    """Whether one theta serves all models of each reading."""
    rows = {name: [sweeps.row(model) for model in models] for name, models in families.items()}
    served = {name: sweeps.serves(models) for name, models in families.items()}
    answers = {name: cost <= SERVES for name, (_, cost) in served.items()}
    told = "; ".join(
        f"{name}: best {', '.join(_number(row['best_theta']) for row in rows[name])}"
        f" ({', '.join(_number(row['iterations']) for row in rows[name])} steps)"
        + (f", theta = {float(theta):g} takes at most {cost:.3g} times as many" if math.isfinite(cost) else "")
        for name, (theta, cost) in served.items()
    )
    unmet = [name for name, holds in answers.items() if not holds]
    verdict = f"one theta serves {what}" if not unmet else f"no one theta serves {what}"
    if unmet and len(unmet) < len(answers):
        verdict += f" in {len(unmet)} of {len(answers)} readings"
    criterion = f"one theta takes at most {SERVES:g} times the fewest steps of each, increment test at {STOP:g}"
    data = {
        "criterion": criterion,
        "rows": rows,
        "theta": {name: float(theta) if math.isfinite(cost) else None for name, (theta, cost) in served.items()},
        "cost": {name: figure(cost, 3) if math.isfinite(cost) else None for name, (_, cost) in served.items()},
        "reason": {
            name: f"no theta serves all within {MOST_STEPS} steps"
            for name, (_, cost) in served.items()
            if not math.isfinite(cost)
        },
    }
    return _evidence("printed", _all_or_none(list(answers.values())), f"{verdict}: {told}", **data)


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:g}"


def _meshes(sweeps: Sweeps) -> list[Evidence]:
    """Figure 10."""
    halvings = range(3 if sweeps.level == "quick" else 4)
    families = {name: [Model(geometry=name, halvings=h) for h in halvings] for name in TWO}
    found = _one_theta(sweeps, families, "every mesh")
    steps = [
        [row["iterations"] for row in rows if row["iterations"] is not None] for rows in found.data["rows"].values()
    ]
    alike = all(len(counts) == len(halvings) and max(counts) <= ALIKE * min(counts) for counts in steps)
    criterion = f"{found.data['criterion']}; the fewest steps differ by a factor of at most {ALIKE:g}"
    nodes = ", ".join(f"{row['nodes']}" for row in next(iter(found.data["rows"].values())))
    text = f"{found.text}; tried on matching grids of {nodes} nodes"
    data = {**found.data, "criterion": criterion}
    return [replace(found, holds=found.holds if alike else False, text=text, data=data)]


def _frictions(sweeps: Sweeps) -> list[Evidence]:
    """Figure 11."""
    values = (Fraction(1, 10), Fraction(1, 5), Fraction(2, 5))
    families = {name: [Model(geometry=name, friction=k, halvings=sweeps.halvings) for k in values] for name in TWO}
    return [_one_theta(sweeps, families, "k = 0.1, 0.2, 0.4")]


def _moduli(sweeps: Sweeps) -> list[Evidence]:
    """Figure 12."""
    families: dict[str, list[Model]] = {}
    roles: tuple[Neumann, ...] = (1, 2)
    for name in TWO:
        for neumann in roles:
            families[f"{name}, body {neumann} Neumann"] = [
                Model(geometry=name, neumann=neumann, young=young, halvings=sweeps.halvings)
                for young in ((HARD, SOFT), (SOFT, SOFT), (SOFT, HARD))
            ]
    found = _one_theta(sweeps, families, "E1/E2 = 3.5, 1, 2/7")
    figures = found.data["rows"]
    at = "; ".join(
        f"{name}: {', '.join(_number(row['iterations_at_0.6']) for row in rows)}" for name, rows in figures.items()
    )
    tried = (
        f"tried are {len(families)} readings of the geometry and of the roles, with the top held and k = 0.2, on"
        f" matching grids of {next(iter(figures.values()))[0]['nodes']} nodes"
    )
    text = f"{found.text}; steps at theta = 0.6, none where it has not converged within {MOST_STEPS}: {at}; {tried}"
    return [replace(found, text=text)]


def _optimum(sweeps: Sweeps) -> list[Evidence]:
    """6.3: theta_opt = 0.6."""
    models = [
        Model(geometry=name, neumann=neumann, young=young, halvings=sweeps.halvings)  # type: ignore[arg-type]
        for neumann, young in ((1, (HARD, SOFT)), (2, (HARD, SOFT)), (2, (SOFT, HARD)))
        for name in TWO
    ]
    rows = [sweeps.row(model) for model in models]
    told = "; ".join(
        f"{row['geometry']}, body {row['neumann_body']} Neumann, E1 = {row['E1']:g}, E2 = {row['E2']:g}:"
        f" {_number(row['best_theta'])} ({_number(row['iterations'])} steps,"
        f" {_number(row['iterations_at_0.6'])} at 0.6)"
        for row in rows
    )
    where = "the position of the upper body is not in the text, and Sections 3 and 6 give the roles differently"
    near = [serves_at_06(row) for row in rows]
    text = (
        f"{where}; at 0.6 at most {SERVES:g} times the fewest steps in {sum(near)} of {len(rows)} readings; best {told}"
    )
    return [_evidence("printed", _particular(near), text, rows=rows)]


def serves_at_06(row: Mapping[str, Any]) -> bool:
    """Whether theta = 0.6 takes at most ``SERVES`` times the fewest steps.

    Examples
    --------
    >>> serves_at_06({"iterations": 19, "iterations_at_0.6": 21})
    True
    >>> serves_at_06({"iterations": 14, "iterations_at_0.6": 23})
    False
    """
    least, steps = row["iterations"], row["iterations_at_0.6"]
    return least is not None and steps is not None and bool(steps <= SERVES * least)


#: Two thetas that the increment test treats unlike, and units of stress in MPa.
SLOW, FAST = Fraction(1, 20), Fraction(3, 5)
UNITS = {"MPa": Fraction(1), "TPa": Fraction(10) ** 6}


@dataclass(frozen=True, kw_only=True)
class Stopped:
    """A run when a test stops it.

    Attributes
    ----------
    steps : int
    residual : float
        ``|T g - g|/|T g|`` there.
    error : float
        ``|g_n - g|/|g|`` with the g of the global method.
    """

    steps: int
    residual: float
    error: float


def stopped(model: Model, theta: Fraction, unit: Fraction) -> tuple[Stopped, Stopped]:
    """Run until the printed test stops it, and until the unrelaxed residual does, at a unit of stress."""
    problem = model.problem
    lower, upper = (replace(body, young=body.young / unit) for body in (problem.body1, problem.body2))
    pair = build(replace(problem, body1=lower, body2=upper))
    seen = trace(pair, float(theta), 3000)
    solution = solve(pair).contact
    g = np.concatenate([pair.upward * solution.shear, solution.pressure]) * np.tile(solution.weights, 2)

    def at(n: int) -> Stopped:
        error = float(np.linalg.norm(seen.g[n] - g) / np.linalg.norm(g))
        return Stopped(steps=n, residual=seen.residuals[n], error=error)

    first, second = seen.stop(), next(n for n, residual in enumerate(seen.residuals) if residual <= STOP)
    assert first is not None
    return at(first), at(second)


def _stopping(sweeps: Sweeps) -> list[Evidence]:
    """6.3: the stopping test."""
    model = Model(halvings=sweeps.halvings)
    rho = sweeps.rho(model)
    runs = {(theta, unit): stopped(model, theta, UNITS[unit]) for theta in (SLOW, FAST) for unit in UNITS}
    return [
        _verdict_on_test("printed", {key: both[0] for key, both in runs.items()}, rho),
        _verdict_on_test("repaired", {key: both[1] for key, both in runs.items()}, rho),
    ]


def _verdict_on_test(
    of: Literal["printed", "repaired"], runs: Mapping[tuple[Fraction, str], Stopped], rho: float
) -> Evidence:
    """A test measures the error if it stops at one unrelaxed residual, whatever theta and the unit of force.

    At one residual r the error ``(1 - T')^-1 r`` may still differ by the factor 1 + rho between slow and fast modes.
    """
    slow, fast = runs[SLOW, "MPa"], runs[FAST, "MPa"]
    steps = {float(theta): {unit: runs[theta, unit].steps for unit in UNITS} for theta in (SLOW, FAST)}
    same_unit = all(len(set(counts.values())) == 1 for counts in steps.values())
    ratio = {"residual": slow.residual / fast.residual, "error": slow.error / fast.error}
    # a stopped run lies within one step below the bound
    measures = max(slow.residual, fast.residual) <= STOP and max(ratio["error"], 1 / ratio["error"]) <= 2 * (1 + rho)
    name = "the increment test" if of == "printed" else "the unrelaxed relative residual"
    text = (
        f"{name} at {STOP:g} stops at theta = {float(SLOW):g} after {slow.steps} steps with |Tg - g|/|Tg| ="
        f" {slow.residual:.2g} and an error of {slow.error:.2g}, at theta = {float(FAST):g} after {fast.steps} with"
        f" {fast.residual:.2g} and {fast.error:.2g}; with forces in units of 1 MPa and of 1 TPa it takes"
        f" {steps[float(SLOW)]['MPa']} and {steps[float(SLOW)]['TPa']} steps, and {steps[float(FAST)]['MPa']} and"
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
    return _evidence(of, same_unit and measures, text, runs=figures, ratio=ratios, rho=figure(rho))


#: What answers for each statement.
CHECKS: dict[str, Callable[[Sweeps], list[Evidence]]] = {
    "sec-6.2": _same_results,
    "fig-5": _zones,
    "sec-6.3-stop": _stopping,
    "sec-6.3": _optimum,
    "fig-10": _meshes,
    "fig-11": _frictions,
    "fig-12": _moduli,
}


def experiments(
    ids: Collection[str] | None = None, level: Level = "quick", watch: Callable[[float], None] = lambda done: None
) -> dict[str, list[Evidence]]:
    """Evidence for the numerical results of Section 6.

    Parameters
    ----------
    ids : collection of str, optional
        Statements; all by default, unknown ones have no evidence here.
    level : {'quick', 'full'}
        Full halves the mesh and the steps of theta once more.
    watch : callable
        Called with the share done.
    """
    return gather(CHECKS, Sweeps(level), ids, watch)

"""The best theta over friction, found in four ways, on meshes of Section 6 and for other pairs of bodies.

``python benchmarks/best_theta.py`` takes some minutes and writes two files into benchmarks/records/theta for the page
docs/examples/best_theta.md: ``best.json`` has the best thetas, ``curves.json`` the factors over theta on one mesh.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import verification as vf
from ndtheory import __version__
from ndtheory.continuum.circle import TwoLayers
from ndtheory.continuum.strip import Strip
from ndtheory.energy_norms import predicted_theta
from ndtheory.moduli import Moduli
from verification.free_norm.norm import FreeNorm
from verification.free_norm.radius import largest_radius
from verification.free_norm.search import Search
from verification.semidefinite.multipliers import QuadraticForms
from verification.sweeps.best_theta import Fewest

#: Where the page finds the numbers.
RECORD = Path(__file__).parent / "records" / "theta"

#: The frictions of the figure, and of the widget.
FRICTIONS = ("0.1", "0.2", "0.4", "0.8", "1.6")
POSITIONS = ("0.05", "0.1", "0.2", "0.3", "0.4", "0.6", "0.8", "1.2", "1.6")

#: The thetas of the figure: multiples of 1/40; the widget has every second one.
GRID = tuple(n / 40 for n in range(1, 40))

#: How many pieces of T_theta are multiplied to find what no norm goes below; the search begins with powers of one.
LENGTHS = (2, 3)

#: Digits of a factor that are kept, for tests that compare; the search for a norm ends within 0.4 %.
DIGITS = 6


@dataclass(frozen=True, kw_only=True)
class Case:
    """A pair of bodies.

    Attributes
    ----------
    title : str
    problem : Problem
        Pressed together.
    young, depth : pair
        Young's moduli and thicknesses of layers like the bodies, the Neumann body first.
    shear : str
        By how much the upper side is moved sideways under the second load.
    """

    title: str
    problem: vf.Problem
    young: tuple[int, int] = (70000, 20000)
    depth: tuple[str, str] = ("0.3", "0.3")
    shear: str = "0.006"

    @cached_property
    def pair(self) -> vf.ContactPair:
        """The pair on its mesh."""
        return vf.build(self.problem)

    @cached_property
    def search(self) -> Search:
        """The criterion by wave number, for layers like the bodies."""
        neumann, contact = (
            Strip(body=Moduli(young=E, poisson="0.3"), thickness=Fraction(d))
            for E, d in zip(self.young, self.depth, strict=True)
        )
        return Search(TwoLayers(contact=contact, neumann=neumann, radius=Fraction(str(self.problem.contact.radius))))

    @property
    def loads(self) -> dict[str, vf.Problem]:
        """Pressed, and pressed and moved sideways."""
        sheared = self.problem.to_dict()
        down = sheared["body2"]["prescribed"]["top"][1]
        sheared["body2"]["prescribed"] = {"top": [self.shear, down]}
        return {"pressed": self.problem, "sheared": vf.Problem.from_dict(sheared)}


def section_6(nodes: int, rows: int, radius: str = "0.1", **changes: Any) -> vf.Problem:
    """Section 6 with so many contact nodes and rows of cells; lower body Neumann."""
    cells = nodes - 1
    return vf.example("section6").changed(cells=((5 * cells // 3, rows), (cells, rows)), radius=radius, **changes)


def equal_blocks() -> vf.Problem:
    """Two blocks of one size and one material."""
    block = {"shape": "rectangle", "x": [0, 1], "cells": [12, 8], "young": 1, "poisson": "0.3"}
    return vf.Problem.from_dict(
        {
            "body1": block | {"y": [-1, 0], "fixed": ["bottom"]},
            "body2": block | {"y": [0, 1], "prescribed": {"top": [0, "-0.02"]}},
            "contact": {"radius": "0.2"},
            "iteration": {"neumann_body": 1, "max_iterations": 500},
        }
    )


@cache
def cases() -> Mapping[str, Case]:
    """All pairs of the figure."""
    meshes = ((7, 2, "0.2"), (13, 3, "0.1"), (25, 6, "0.1"), (49, 12, "0.1"))
    return {
        **{
            f"section-6-{nodes}": Case(title=f"Section 6, {nodes} nodes", problem=section_6(nodes, rows, radius))
            for nodes, rows, radius in meshes
        },
        "stiff-contact-body": Case(
            title="stiff contact body, 25 nodes", problem=section_6(25, 6, young=(20000, 70000)), young=(20000, 70000)
        ),
        "equal-blocks": Case(
            title="equal blocks, 13 nodes", problem=equal_blocks(), young=(1, 1), depth=("1", "1"), shear="0.01"
        ),
        "grids-that-differ": Case(title="grids that differ, 17 nodes", problem=vf.example("section6-190")),
    }


def energy_factor(pair: vf.ContactPair, theta: float) -> float:
    """The least factor in the norm (5.21) that multipliers prove."""
    return QuadraticForms(pair, vf.measure(pair)).factor(theta).value


def free_factor(pair: vf.ContactPair, theta: float) -> float | None:
    """The least factor found in a free norm; None where no norm is found."""
    found = FreeNorm(pair, vf.measure(pair)).factor(theta)
    return None if found is None else found.factor


def least(factor: Callable[[float], float | None]) -> dict[str, float] | None:
    """The theta of :data:`GRID` with the least factor, and that factor; None where none below 1 is met.

    A factor that falls and then rises is assumed: its square is convex in (5.21), the others are seen to do so.
    """
    known: dict[int, float] = {}

    def at(i: int) -> float:
        if i not in known:
            value = factor(GRID[i])
            known[i] = 1.0 if value is None else value
        return known[i]

    low, high = 0, len(GRID) - 1
    while high - low > 2:
        one, other = low + (high - low) // 3, high - (high - low) // 3
        # where no norm is found the least lies at smaller thetas
        low, high = (low, other) if at(one) <= at(other) else (one, high)
    best = min(range(low, high + 1), key=at)
    return {"theta": GRID[best], "factor": rounded(at(best))} if at(best) < 1 else None


def rounded(value: float) -> float:
    """A factor as it is kept."""
    return round(value, DIGITS)


def by_waves(case: Case, k: str) -> dict[str, float] | None:
    """The best theta by wave number; None where no theta contracts."""
    largest = case.search.largest_theta(float(k))
    if largest is None:
        return None
    theta, factor = case.search.best_theta(float(k), largest)
    return {"theta": round(theta, 3), "factor": rounded(factor)}


def seen(problem: vf.Problem, k: str) -> dict[str, float | None]:
    """The thetas of fewest steps of those on the grid, and the nodes that slip and are open at the solution."""
    given = problem.changed(friction=k)
    found = Fewest.of(vf.sweep(given, theta=[str(theta) for theta in GRID], rule=["constant"]).rows)
    nodes = vf.solve(given).contact.pattern
    steps = {"low": found.low, "high": found.high, "steps": found.steps}
    return steps | {"slip": nodes["slip"], "open": nodes["open"]}


def predicted(case: Case) -> float:
    """The theta 2/(2 + rho), which friction does not enter."""
    return round(predicted_theta(vf.measure(case.pair).rho_max.value), 3)


def no_less(pair: vf.ContactPair, theta: float) -> float:
    """A number that no norm goes below at a theta: the largest spectral radius found, of products too."""
    return max(largest_radius(pair, theta, length=length).value for length in LENGTHS)


def point(case: Case, k: str) -> dict[str, Any]:
    """The best thetas of a pair of bodies at one friction; ``no_less`` is for that in a free norm, or the least one."""
    pair = case.pair.at(friction=float(k))
    energy = least(lambda theta: energy_factor(pair, theta))
    free = least(lambda theta: free_factor(pair, theta))
    return {
        "k": float(k),
        "energy": energy,
        "free": free,
        "no_less": rounded(no_less(pair, free["theta"] if free else GRID[0])),
        "waves": by_waves(case, k),
        "runs": {load: seen(problem, k) for load, problem in case.loads.items()},
    }


#: The pair of the widget.
SHOWN = "section-6-7"


def curves(case: Case, k: str, thetas: Sequence[float]) -> dict[str, Any]:
    """The factors over theta: in (5.21), in a free norm, by wave number, the observed rate, what no norm goes below."""
    pair = case.pair.at(friction=float(k))
    short = lambda value: None if value is None else rounded(value)
    rate = lambda theta: vf.run(case.problem.changed(friction=k, max_iterations=2000), theta=str(theta)).observed_rate
    return {
        "k": float(k),
        "energy": [short(energy_factor(pair, theta)) for theta in thetas],
        "free": [short(free_factor(pair, theta)) for theta in thetas],
        "waves": [short(case.search.factor(theta, float(k))) for theta in thetas],
        "runs": [None if (found := rate(theta)) is None else short(found.value) for theta in thetas],
        "no_less": [short(no_less(pair, theta)) for theta in thetas],
    }


def lines(name: str, points: Sequence[Mapping[str, Any]]) -> list[str]:
    """A case for the terminal."""
    cell = lambda found: "    none     " if found is None else f"{found['theta']:.3f} ({found['factor']:.3f})"
    told = [f"{name}: theta (factor) in (5.21), in a free norm, by wave number; fewest steps, pressed and sheared"]
    for at in points:
        steps = [f"{run['low']:.3f}-{run['high']:.3f} ({run['steps']})" for run in at["runs"].values()]
        told.append(f"  k = {at['k']:<4} {'  '.join(cell(at[way]) for way in ('energy', 'free', 'waves'))}  {steps}")
    return told


def write(path: Path, document: Mapping[str, Any], listed: str) -> None:
    """A JSON file with one entry of a list in each line."""
    head = {name: value for name, value in document.items() if name != listed}
    entries = ",\n".join(json.dumps(entry) for entry in document[listed])
    path.write_text(f"{json.dumps(head)[:-1]}, {json.dumps(listed)}: [\n{entries}\n]}}\n", "utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="only these pairs, or 'curves'; the record keeps others"
    )
    parser.add_argument("--friction", action="append", choices=FRICTIONS, help="only at this friction; repeatable")
    parser.add_argument("--record", type=Path, default=RECORD, metavar="FOLDER")
    given = parser.parse_args()
    names = given.names or [*cases(), "curves"]
    if unknown := set(names) - {*cases(), "curves"}:
        parser.error(f"needed names among {', '.join([*cases(), 'curves'])}, received {', '.join(sorted(unknown))}")
    given.record.mkdir(parents=True, exist_ok=True)
    best = given.record / "best.json"
    found = {one["name"]: one for one in json.loads(best.read_text("utf-8"))["cases"]} if best.exists() else {}
    for name, case in cases().items():
        if name in names:
            known = {at["k"]: at for at in found.get(name, {"points": []})["points"]}
            for k in given.friction or FRICTIONS:
                known[float(k)] = point(case, k)
                points = [known[k] for k in sorted(known)]
                found[name] = {"name": name, "title": case.title, "predicted": predicted(case), "points": points}
                write(best, {"version": __version__, "cases": [found[one] for one in cases() if one in found]}, "cases")
            print("\n".join(lines(name, points)), flush=True)
    if "curves" in names:
        thetas = GRID[1::2]
        drawn = [curves(cases()[SHOWN], k, thetas) for k in POSITIONS]
        document = {"version": __version__, "case": SHOWN, "thetas": thetas, "curves": drawn}
        write(given.record / "curves.json", document, "curves")


if __name__ == "__main__":
    main()

"""One result of each kind that has sections, as functions of a problem."""

from collections.abc import Callable
from functools import partial

from problem_list import plates

import verification as vf
from ndtheory import Constants, EnergyConstants
from ndtheory.statements import recorded, statements
from verification.algorithm.loop import Outcome
from verification.bounds.bound import Region, Subject
from verification.bounds.table import Calculated
from verification.certificate.continuum import certify_continuum
from verification.free_norm.two_layers import two_layers
from verification.ledger.evidence import Evidence
from verification.ledger.rows import Finding
from verification.registry import BOUNDS
from verification.reproduce import reproduce
from verification.sweeps.grid import SweepGrid
from verification.sweeps.region import Plane, Point
from verification.sweeps.store import plan


def problem(cells: int) -> vf.Problem:
    """Section 6 with so many cells along the lower body."""
    keys = {f"body{i}.cells": f"[{cells * share // 5}, {cells // 5}]" for i, share in ((1, 5), (2, 3))}
    return vf.Problem.from_dict(plates()).with_keys(keys)


def with_steps(shown: vf.Problem) -> vf.Problem:
    """The problem, pressed and sheared."""
    tops = {"press": [0, "-0.01"], "shear": ["0.002", "-0.01"]}
    steps = [{"name": name, "increments": 2, "body2": {"prescribed": {"top": top}}} for name, top in tops.items()]
    return vf.Problem.from_dict(shown.to_dict() | {"step": steps})


def a_plane(shown: vf.Problem) -> Plane:
    region = Region(k=(0.1, 0.2), theta=((0.0, 0.5), (0.0, 0.4)), every=0.3, some=0.4)
    points = (Point(theta=0.4, k=0.1, outcome=Outcome.CONVERGED, iterations=12, coupled_residual=1e-9),)
    return Plane(
        title="a plane",
        regions={"printed": region, "energy": region},
        points=points,
        reason={"lmi": "made up"},
        units=shown.units,
        problem=shown,
    )


def a_ledger(shown: vf.Problem, *, whole: bool) -> vf.Ledger:
    """The recorded verdicts with made-up evidence; one of them is not what it was."""
    at = {"counterexample": {"kappa": "10000"}}
    rows = []
    for id, one in statements().items():
        found = Evidence(method="symbolic", of="printed", holds=False, text="made up", data=at)
        before = "INCONCLUSIVE" if id == "5.30" else recorded()[id]
        rows.append(
            Finding(statement=one, evidence=(found,), verdict=recorded()[id], method="symbolic", recorded=before)
        )
    chosen = [row for row in rows if whole or row.statement.id in ("5.12", "5.30")]
    return vf.Ledger(rows=tuple(chosen), level="quick", units=shown.units)


def calculated(shown: vf.Problem) -> Calculated:
    given = {"constants": Constants(m="1/2", M=3, C_R="1.1", C_K="1e-6"), "energy": EnergyConstants(rho="1/2")}
    results = {name: bound.evaluate(Subject(**given), "1/3") for name, bound in BOUNDS.items() if bound.calculated}
    return Calculated(**given, theta="1/3", results=results)


#: Each kind of result, as a function of the problem.
KINDS: dict[str, Callable[[vf.Problem], object]] = {
    "Measured": vf.measure,
    "Run": lambda given: vf.run(given).linearise(),
    "Run by another rule": lambda given: vf.run(given, rule="anderson"),
    "Solution": vf.solve,
    "History": lambda given: vf.march(with_steps(given)),
    "Comparison": vf.compare,
    "Advice": vf.advise,
    "Certificate": vf.certify,
    "Checked": lambda given: vf.check_again(vf.certify(given).to_dict()),
    "ContinuumCertificate": lambda given: certify_continuum(given.changed(radius="0.1")),
    "Plane": a_plane,
    "Sweep": lambda given: vf.sweep(given, theta=["0.3", "0.5"], friction=[0.1]),
}

#: The others, which tell nothing of the problem or differ in what they show.
OTHERS: dict[str, Callable[[vf.Problem], object]] = {
    "History by the global method": lambda given: vf.march(with_steps(given), method="monolithic"),
    "Exploration": lambda given: vf.explore(vf.example("two-bars")),
    "Exploration of a history": lambda given: vf.explore(with_steps(given)),
    "Measured with proofs": partial(vf.measure, verified=True),
    "Comparison with proofs": partial(vf.compare, verified=True),
    "Advice from a run": lambda given: vf.advise_run("0.1", "1.4"),
    "Advice with friction": lambda given: vf.advise_run("0.5", "0.7", friction=True),
    "Advice from moduli": lambda given: vf.advise_moduli(young=[7, 2], poisson=["0.3", "0.3"], mirror=[2]),
    "Sweep without theta": lambda given: vf.sweep(given, friction=[0.1, 0.4]),
    "Plan": lambda given: plan(given, SweepGrid.of({"theta": ["0.3", "0.5"]})),
    "Calculated": calculated,
    "Layers": lambda given: two_layers(
        young=(7, 2), poisson=("0.3", "0.3"), depth=(1, 1), friction=1, radius=1, theta="0.5"
    ),
    "Ledger": partial(a_ledger, whole=True),
    "Rows of a ledger": partial(a_ledger, whole=False),
    "Reproduction": lambda given: reproduce(("fig5",), jobs=1),
}

"""The verdict on a claim about steps over theta in one reading, with no more runs than that takes.

On a curve on which only some theta were run, 0.6 costs at least what these say: one theta of the list that takes few
enough steps refutes a reading, and only a curve that is not refuted needs all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

from verification.interface.pair import ContactPair
from verification.reproduce.claims import NODES, PRINTED_THETA, SERVES, Claim
from verification.reproduce.experiments import THETAS, Outcome, changed, curve_of, outcome_of
from verification.reproduce.readings import ModelReading
from verification.sweeps.grid import SweepGrid
from verification.sweeps.row import FAILED, REFUSED, Row, SharedBodies, row

#: The mesh of 190 nodes with the friction and the moduli of the text: a curve that Figures 10 to 12 have in common.
COMMON: Mapping[str, Any] = {"refine": NODES.index(190)}

#: Exactly, as a grid has them.
PRINTED = Fraction(str(PRINTED_THETA))
LISTED = tuple(map(Fraction, THETAS))


class Runs:
    """The runs of one reading, each made when it is first asked for.

    ``run`` makes the row of a sweep from values of a grid; by default it runs the problem of the reading.
    """

    def __init__(self, reading: ModelReading, run: Callable[[Mapping[str, Any]], Row] | None = None) -> None:
        self.reading = reading
        self.problem = reading.problem(NODES[0])
        self._run = run or (lambda values: row(self.problem, values, self.bodies))
        self._rows: dict[tuple[tuple[str, Any], ...], Row] = {}

    @cached_property
    def bodies(self) -> SharedBodies:
        """The condensed bodies that the runs share."""
        return SharedBodies(self.problem)

    def pair(self, **values: Any) -> ContactPair:
        """The bodies on the mesh of 190 nodes with other values of a grid; ProblemError if the reading is refused."""
        return self.bodies.setting({**COMMON, **values}).pair

    def row(self, values: Mapping[str, Any], theta: Fraction) -> Row:
        """The run at one theta; values that the problem has need not be given."""
        key = (*changed(self.problem, values).items(), ("theta", theta))
        if key not in self._rows:
            self._rows[key] = self._run(dict(key))
        return self._rows[key]

    def until_refuted(self, values: Mapping[str, Any]) -> list[Row]:
        """A curve from 0.6 on, then outwards from 2/(2 + rho), up to the theta that refutes it, if one does."""
        rows = [self.row(values, PRINTED)]
        rho = rows[0]["rho"]
        best = PRINTED if rho is None else 2 / (2 + rho)
        for theta in sorted((theta for theta in LISTED if theta != PRINTED), key=lambda theta: abs(theta - best)):
            if rows[0]["outcome"] in FAILED or refuted(rows):
                break
            rows.append(self.row(values, theta))
        return rows


def refuted(rows: Sequence[Row]) -> bool:
    """True if some or all runs of a curve, the first of them at 0.6, show that 0.6 does not serve it."""
    return rows[0]["outcome"] not in FAILED and curve_of("", rows).cost > SERVES


def judged(claim: Claim, runs: Runs, meshes: Collection[int] | None = None) -> Outcome:
    """The outcome of a claim on steps over theta in one reading; its true closeness is at most the one given.

    ``meshes`` are the halvings of the mesh of 60 nodes to run, by default all of the claim.  A reading that they do not
    refute is undecided where the claim has more.
    """
    curves = list(zip(claim.labels, SweepGrid.of(claim.axes).rows(), strict=True))
    chosen = [(label, values) for label, values in curves if meshes is None or values["refine"] in meshes]
    chosen.sort(key=lambda curve: changed(runs.problem, curve[1]) != COMMON)  # it may be known from another figure
    rows: dict[str, Sequence[Row]] = {}
    for label, values in chosen:
        rows[label] = some = runs.until_refuted(values)
        if some[0]["outcome"] == REFUSED or refuted(some):
            break
    left = "" if len(chosen) == len(curves) else f"not refuted by {', '.join(rows)}; the other curves were not run"
    return outcome_of(claim.name, runs.reading, rows, left)

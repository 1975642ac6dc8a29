"""Theorem against experiment: runs in the plane of theta and friction, and which of them a proof covers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import sqrt
from typing import Any

import numpy as np

import verification as vf
from builder.scenes import axis, chart, crosses, dots, line, note, scene, slider, widget
from ndtheory import energy_norms
from verification.semidefinite.multipliers import QuadraticForms
from verification.sweeps.row import Row

LABEL = (
    "Runs in the plane of theta and friction with the proofs that cover them, and the factors of a step at one friction"
)

THETAS, FRICTIONS = (0.05, *(n / 10 for n in range(1, 10))), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)

#: Where the answer leads: some runs have a proof and others none.
ASKED = 0.5

#: Enough for every run that does not stall.
STEPS = 500


@dataclass(frozen=True)
class Role:
    """Runs and proofs with the linear problem given to one body."""

    body: str
    problem: vf.Problem
    measured: vf.Measured
    rows: tuple[Row, ...]
    ends: dict[float, float]

    @classmethod
    def of(cls, body: str, problem: vf.Problem) -> Role:
        """All runs; for each friction the theta below which the semidefinite bound proves contraction."""
        measured, pair = vf.measure(problem), vf.build(problem)
        found = {k: QuadraticForms(pair, measured, friction=k).largest_theta() for k in FRICTIONS}
        runs = vf.sweep(problem.changed(max_iterations=STEPS), theta=THETAS, friction=FRICTIONS)
        ends = {k: 0.0 if end is None else end.value for k, end in found.items()}
        return cls(body, problem, measured, tuple(runs.rows), ends)

    def interval(self, k: float) -> tuple[float, float] | None:
        """The thetas for which the theorem in energy norms proves contraction."""
        at = self.measured.with_friction(k)
        return energy_norms.contraction_interval(at.rho_max.value, at.kappa_1.value, at.kappa_2.value)

    def q(self, theta: float, k: float) -> float:
        """The factor of that theorem, a bound where it is below 1."""
        at = self.measured.with_friction(k)
        return sqrt(1 - energy_norms.one_minus_square(theta, at.rho_max.value, at.kappa_1.value, at.kappa_2.value))

    def proved(self, row: Row) -> bool:
        """True if one of the two proofs covers a run."""
        low, high = self.interval(row["friction"]) or (0, 0)
        return row["theta"] < self.ends[row["friction"]] or low < row["theta"] < high

    def at(self, k: float) -> list[Row]:
        """The runs at one friction."""
        return [row for row in self.rows if row["friction"] == k]


@cache
def roles() -> tuple[Role, Role]:
    """The problem of the page, the lower body being the Neumann body, and the same with the roles exchanged."""
    problem = vf.example("section6").changed(cells=((20, 3), (12, 3)))
    return Role.of("lower", problem), Role.of("upper", problem.swapped())


@cache
def data() -> dict[str, Any]:
    """A scene for each role and each friction."""
    given, swapped = roles()
    without = [row for row in given.rows if not given.proved(row)]
    stalled = [row for row in swapped.rows if row["outcome"] != "converged"]
    if any(row["outcome"] != "converged" for row in given.rows) or any(map(swapped.proved, stalled)):
        raise ValueError("needed runs that converge, all of the given role and all that are proved to")
    others = [row for row in swapped.rows if not swapped.proved(row)]
    return widget(
        question=f"Each dot is a run of the model of Section 6, {len(given.rows)} in all. Where it is filled, a proof "
        f"says that every step contracts. Which of the other {len(without)} runs converge?",
        answers=["none of them", "those near the filled dots", "all of them"],
        right="all of them",
        wrong={
            "none of them": "no conclusion is no statement about a run.",
            "those near the filled dots": "where a proof ends nothing happens to the runs.",
        },
        why=f"all {len(given.rows)} runs converge. A proof says where convergence is certain, and nothing about the "
        f"other runs. Move the slider of the Neumann body: of {len(others)} runs without a proof {len(stalled)} stall.",
        sliders=[
            slider("neumann", "Neumann body", [role.body for role in roles()], 0),
            slider("k", "friction k", FRICTIONS, FRICTIONS.index(ASKED)),
        ],
        charts=[
            chart(
                "Runs in the plane of theta and friction",
                axis("theta", 0, 1),
                axis("friction k", 0, 0.7),
                [note(0.03, 0.66, "● proved"), note(0.28, 0.66, "○ not proved")],
                _runs(given, "grey"),
            ),
            chart("Factor of a step at this friction", axis("theta", 0, 1), axis("factor a step", 0, 1.4)),
        ],
        head=("theta", "proved", "q", "run", "rate"),
        scenes={(i, j): _scene(role, k) for i, role in enumerate(roles()) for j, k in enumerate(FRICTIONS)},
    )


def _scene(role: Role, k: float) -> dict[str, Any]:
    rows = role.at(k)
    proved = sum(map(role.proved, rows))
    arrived = [row for row in rows if row["outcome"] == "converged"]
    ends = role.interval(k)
    energy = f"theta between {ends[0]:.2f} and {ends[1]:.2f}" if ends else "no theta (q is above 1)"
    lmi = f"theta below {role.ends[k]:.2f}" if role.ends[k] else "no theta"
    curve = [(theta, role.q(theta, k)) for theta in np.linspace(0.01, 0.99, 50).round(2).tolist()]
    return scene(
        f"k = {k:g}, Neumann body {role.body}: energy proves contraction for {energy}, lmi for {lmi}. "
        f"Of {len(rows)} runs {proved} are proved to converge, and {len(arrived)} do.",
        [line([(0, k), (1, k)], "grey"), *_runs(role, "blue"), note(0.6, 0.66, "× stalls")],
        [
            line([(0, 1), (1, 1)], "grey"),
            line([(theta, float(f"{q:.3g}")) for theta, q in curve if q < 2], "red", dashed=True),
            dots([(row["theta"], row["observed_rate"]) for row in arrived], "blue"),
            crosses([(row["theta"], 1) for row in rows if row not in arrived]),
            _rate(arrived),
            _name(curve),
            *([note(0.98, 1.05, "stalls", anchor="end")] if len(arrived) < len(rows) else []),
        ],
        rows=[
            (
                row["theta"],
                "yes" if role.proved(row) else "no",
                f"{role.q(row['theta'], k):.3f}",
                row["outcome"],
                f"{row['observed_rate']:.3f}" if row in arrived else "",
            )
            for row in rows
        ],
    )


def _runs(role: Role, colour: str) -> list[Any]:
    """A dot for each run that converges, filled where a proof covers it, and a cross for each that stalls."""
    place = lambda chosen: [(row["theta"], row["friction"]) for row in chosen]
    arrived = [row for row in role.rows if row["outcome"] == "converged"]
    return [
        dots(place(row for row in arrived if role.proved(row)), colour),
        dots(place(row for row in arrived if not role.proved(row)), colour, hollow=True),
        crosses(place(row for row in role.rows if row["outcome"] != "converged")),
    ]


def _name(curve: list[tuple[float, float]]) -> Any:
    """The name of the bound beside its curve where that leaves the chart, or above its middle."""
    leaves = next((theta for theta, q in curve if q > 1.28), None)
    if leaves is None:
        theta, q = curve[len(curve) // 2]
        return note(theta, q + 0.04, "bound q")
    return note(leaves + 0.04, 1.15, "bound q") if leaves < 0.7 else note(leaves - 0.05, 1.31, "bound q", anchor="end")


def _rate(arrived: list[Row]) -> Any:
    """The name of the rates below them."""
    theta, rate = max((row["theta"], row["observed_rate"]) for row in arrived if row["theta"] <= 0.5)
    left = theta > 0.3
    return note(theta + (-0.03 if left else 0.02), rate - 0.1, "rate of the run", anchor="end" if left else "start")

"""Friction: one node, one load, and four starts of the iteration that end at different solutions."""

from __future__ import annotations

from functools import cache
from itertools import islice
from typing import Any

import numpy as np

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from verification.algorithm.fixed_point import FixedPointMap
from verification.interface.friction import Nonlocal

LABEL = "Forces at a single contact node: the edge of the friction cone, the solutions, and runs from four starts"

#: The stiffness of the contact body and of the Neumann body at the node; the jump and gap that the load alone causes.
S_C, S_N, APART = np.array([[4, 2], [2, 4]]) / 3, 2 * np.eye(2), np.array([12.0, -1.0])

#: Tangential and normal force of the starts; the question is about A and B.
STARTS = ((12.0, 1.0), (12.0, 2.5), (12.0, 3.0), (12.0, 4.0))
A, B = STARTS[1:3]

#: At k = 3 the force that slips would be infinite.
FRICTIONS, ASKED = (0.5, 0.8, 1, 2, 2.5, 3.5, 3.8, 4, 4.8, 6, 7), 4
THETA, STEPS, SHOWN = 0.4, 60, 25

#: How near to a solution a run has to end, and how exactly T has to keep a solution.
NEAR, EXACT = 1e-3, 1e-12

#: The ends of the axes of forces.
LARGEST = (17, 4.5)

COLOURS = {"open": "red", "slip": "green", "stick": "blue"}


def node(k: float) -> Any:
    """The pair of bodies: the page has the same."""
    return vf.build(S1=S_C, S2=S_N, load1=S_C @ APART, x=np.zeros(1), law=Nonlocal(radius=1), friction=k)


def solutions(pair: Any) -> dict[str, np.ndarray]:
    """The forces that T keeps, by the state of the node."""
    edge, flexibility = np.array([float(pair.friction), 1.0]), np.linalg.inv(S_C) + np.linalg.inv(S_N)
    tried = {
        "open": np.zeros(2),
        "slip": APART[1] / (flexibility @ edge)[1] * edge,
        "stick": np.linalg.solve(flexibility, APART),
    }
    T = FixedPointMap(pair)
    return {state: force for state, force in tried.items() if np.abs(T(force)[1].force - force).max() < EXACT}


def forces(pair: Any, start: tuple[float, float]) -> np.ndarray:
    """The forces of a run, a row for each step."""
    return np.array([it.g for it in islice(vf.iterate(pair, theta=str(THETA), start=np.array(start)), STEPS)])


@cache
def data() -> dict[str, Any]:
    """Four runs at each friction."""
    scenes, opening = {}, []
    limit = vf.measure(node(ASKED)).friction_limit.value
    for i, k in enumerate(FRICTIONS):
        pair = node(k)
        solved, runs = solutions(pair), [forces(pair, start) for start in STARTS]
        ends = [next(name for name, g in solved.items() if np.abs(run[-1] - g).max() < NEAR) for run in runs]
        found = [f"at {name}: {ends.count(name)}" for name in COLOURS if name in ends]
        opening += [k] * (set(ends) == {"open"})
        count = "one solution" if len(solved) == 1 else f"{len(solved)} solutions"
        scenes[(i,)] = scene(
            f"k = {k:g}: this load has {count}: {', '.join(solved)}. Starts that end {', '.join(found)}.",
            [
                *_cone(k),
                *_solutions(solved),
                dots(STARTS, "grey"),
                *(_run(end, run[: SHOWN + 1]) for end, run in zip(ends, runs, strict=True)),
            ],
            [_run(end, enumerate(run[: SHOWN + 1, 1])) for end, run in zip(ends, runs, strict=True)]
            + [note(SHOWN - 0.3, _beside(solved[end][1]), end, anchor="end") for end in dict.fromkeys(ends)],
            rows=[
                (f"({start[0]:g}, {start[1]:g})", end, f"({run[-1][0]:.2f}, {run[-1][1]:.2f})")
                for start, end, run in zip(STARTS, ends, runs, strict=True)
            ],
        )
    return widget(
        question=f"This load opens a gap of {-APART[1]:g}, so zero force, open, is one solution. "
        f"With friction k = {ASKED} the iteration starts at the force A or at the force B, each a guess that may break "
        "Coulomb's law. Where does it end?",
        answers=["A opens, B sticks", "both open, as the load parts the bodies", "both stick, as friction holds them"],
        right="A opens, B sticks",
        wrong={
            "both open, as the load parts the bodies": "one load can have several solutions.",
            "both stick, as friction holds them": "friction holds nothing without pressure.",
        },
        why=f"at k = {ASKED} this load has {len(solutions(node(ASKED)))} solutions, and the start decides which one "
        f"the iteration finds. Up to k = {max(opening):g} A, B and the two other starts in the picture open. "
        f"Below k = {limit:.2f} it is proved that there is only one solution, whatever the load. Move k.",
        sliders=[slider("k", "friction k", [f"{k:g}" for k in FRICTIONS], FRICTIONS.index(ASKED))],
        charts=[
            chart(
                "Forces at the node",
                axis("tangential force", -3, LARGEST[0]),
                axis("normal force", -0.4, LARGEST[1]),
                [dots([A, B], "grey"), *(note(x + 0.4, y - 0.15, name) for name, (x, y) in (("A", A), ("B", B)))],
                [*_cone(ASKED), *_solutions({"open": np.zeros(2)})],
            ),
            chart("Normal force over the steps", axis("step", 0, SHOWN), axis("normal force", -0.4, LARGEST[1])),
        ],
        head=("start", "end", "force at the end"),
        scenes=scenes,
    )


def _cone(k: float) -> list[Any]:
    """The edge of the cone, and its name where no run is."""
    name = (
        (LARGEST[1] * k - 1.4, LARGEST[1] - 0.3) if k < 3 else (LARGEST[0] - 0.3, min(LARGEST[1], LARGEST[0] / k) - 1.0)
    )
    return [line([(0, 0), (LARGEST[0], LARGEST[0] / k)], "grey", dashed=True), note(*name, "edge", anchor="end")]


def _solutions(solved: dict[str, np.ndarray]) -> list[Any]:
    """The solutions with their states."""
    beside = {"open": (-0.4, -0.06, "end"), "slip": (-0.4, 0.06, "end"), "stick": (-0.4, 0.15, "end")}
    shown = []
    for state, force in solved.items():
        x, y, anchor = beside[state]
        shown += [dots([force], COLOURS[state], hollow=True), note(force[0] + x, force[1] + y, state, anchor=anchor)]
    return shown


def _beside(height: float) -> float:
    """The place of a name above the end of a run, or below the runs that come down to 0."""
    return height + 0.1 if height else -0.33


def _run(end: str, points: Any) -> Any:
    """A run, dashed where it opens; three digits are more than a pixel."""
    return line(np.round(list(points), 3).tolist(), COLOURS[end], dashed=end == "open")

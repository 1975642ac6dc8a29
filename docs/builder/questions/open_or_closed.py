"""Open or closed: the factors of two errors over theta, and both over the steps."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import eigh

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from ndtheory.energy_norms import predicted_factor, predicted_theta
from verification.algorithm.fixed_point import FixedPointMap

LABEL = (
    "Factor of one step over theta for an open node and for the stiffest closed shape, and both errors over the steps"
)

#: The steps of a run, and the least error that is drawn.
STEPS, LEAST = 12, 1e-6


@cache
def data() -> dict[str, Any]:
    """Two small errors at solutions without friction, one in the stiffest closed shape and one in an open node."""
    pressed = vf.example("section6").changed(friction=0, young=(20000, 40000), cells=((10, 2), (6, 2)))
    lifted = pressed.to_dict()
    lifted["body2"]["traction"] = {"right": [0, 4000]}
    errors = {"closed": _Error(pressed, of_node=False), "open": _Error(vf.Problem.from_dict(lifted), of_node=True)}
    rho = errors["closed"].rho
    once, best, limit = 1 / (1 + rho), predicted_theta(rho), 2 / (1 + rho)
    thetas = [n / 24 for n in range(1, 19)]  # rho is nearly 2: one of them is near each answer
    closed = [[t, abs(1 - t * (1 + rho))] for t in (0, once, 1)]
    scenes = {}
    for i, theta in enumerate(thetas):
        seen = {name: error.over(theta, STEPS) for name, error in errors.items()}
        first = {name: sizes[1] for name, sizes in seen.items()}
        worse = max(first, key=lambda name: first[name])
        if abs(first["open"] - first["closed"]) < 1e-3:
            decides = "Both are equal"
        else:
            decides = "The open node decides" if worse == "open" else "The closed shape decides"
        scenes[(i,)] = scene(
            f"theta = {theta:.3f}: one step multiplies the error of the open node by {first['open']:.3f} and that of "
            f"the stiffest closed shape by {first['closed']:.3f}. {decides}: the error after {STEPS} steps is "
            f"{seen[worse][-1]:.2g} times the first.",
            [line(closed), dots([(theta, first["closed"])]), dots([(theta, first["open"])], "red", hollow=True)],
            [line(enumerate(seen["closed"])), line(enumerate(seen["open"]), "red", dashed=True), *_ends(seen)],
            rows=[(n, *map(_number, sizes)) for n, sizes in enumerate(zip(*seen.values(), strict=True))],
        )
    return widget(
        question="The error of an open node is multiplied by 1 - theta in each step, and "
        f"theta = 1/(1+rho) = {once:.3f} removes that of the stiffest closed shape at once. "
        "Which theta is best if nobody knows which nodes are open?",
        answers=[f"1/(1+rho) = {once:.3f}", f"2/(2+rho) = {best:.3f}", f"2/(1+rho) = {limit:.3f}"],
        right=f"2/(2+rho) = {best:.3f}",
        wrong={
            f"1/(1+rho) = {once:.3f}": f"there the open node keeps {1 - once:.3f} of its error in each step.",
            f"2/(1+rho) = {limit:.3f}": "there the closed shape is multiplied by -1 in each step and never falls.",
        },
        why=f"at {best:.3f} each step multiplies both errors by {predicted_factor(best, rho):.3f}. "
        "Below it the open node is slower, above it the closed shape, "
        f"which grows from {limit:.3f} on. Move theta to both sides.",
        sliders=[slider("theta", "theta", [f"{t:.3f}" for t in thetas], thetas.index(0.5))],
        charts=[
            chart(
                "Factor of one step",
                axis("theta", 0, 0.75),
                axis("factor a step", -0.05, 1.3),
                [
                    line([(0, 1), (0.75, 1)], "grey"),
                    note(0.02, 1.04, "above 1: grows", "grey"),
                    line([(0, 1), (0.75, 0.25)], "red", dashed=True),
                    note(0.2, 0.85, "open", "red"),
                    dots([(once, 0)]),
                    note(once - 0.07, 0.02, "closed", anchor="end"),
                ],
            ),
            chart(
                "Size of both errors over the steps",
                axis("step", 0, 16),
                axis("error, the first = 1", LEAST, 100, log=True),
            ),
        ],
        head=("step", "closed", "open"),
        scenes=scenes,
    )


def _number(size: float) -> str:
    """An error for the table; a smaller one is rounding."""
    return f"{size:.2e}" if size >= LEAST else f"below {LEAST:.0e}"


def _ends(seen: dict[str, list[float]]) -> list[dict[str, Any]]:
    """The name of each curve right of where it ends or leaves the chart, a single one for curves that end together."""
    low, high = sorted(sizes[-1] for sizes in seen.values())
    if high < 10 * low:
        return [note(STEPS + 0.4, (low * high) ** 0.5, "both")]
    ends = {name: max(n for n, size in enumerate(sizes) if size > 5 * LEAST) for name, sizes in seen.items()}
    return [note(end + 0.4, seen[name][end], name) for name, end in ends.items()]


class _Error:
    """A small error of the force at the solution of a problem: in the stiffest shape, or of its last node."""

    def __init__(self, problem: vf.Problem, *, of_node: bool) -> None:
        self.map = FixedPointMap(vf.build(problem))
        self.solution = vf.run(self.map.pair, theta="0.5", rule="newton").last.g
        contact, neumann = (self._normal(side.schur) for side in (self.map.pair.contact, self.map.pair.neumann))
        values, shapes = eigh(contact, neumann)
        self.rho = float(values[-1])
        shape = neumann[:, -1] if of_node else neumann @ shapes[:, -1]
        self.change = np.concatenate([np.zeros(len(shape)), 1e-4 * shape / np.abs(shape).max()])

    @staticmethod
    def _normal(S: Any) -> Any:
        """The matrix of the normal unknowns, the tangential ones condensed out."""
        n = len(S) // 2
        return np.linalg.inv(np.linalg.inv(S)[n:, n:])

    def over(self, theta: float, steps: int) -> list[float]:
        """Its size after each step, relative to the first."""
        norm, right, wrong = self.map.pair.neumann.dual_norm, self.solution, self.solution + self.change
        sizes = [norm(wrong - right)]
        for _ in range(steps):
            right, wrong = (g + theta * (self.map(g)[1].force - g) for g in (right, wrong))
            sizes.append(norm(wrong - right))
        return [float(size / sizes[0]) for size in sizes]

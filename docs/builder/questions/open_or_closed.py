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


@cache
def data() -> dict[str, Any]:
    """Two small errors at solutions without friction, one in the stiffest closed shape and one in an open node."""
    pressed = vf.example("section6").changed(friction=0, young=(20000, 40000), cells=((10, 2), (6, 2)))
    lifted = pressed.to_dict()
    lifted["body2"]["traction"] = {"right": [0, 4000]}
    errors = {"closed": _Error(pressed, of_node=False), "open": _Error(vf.Problem.from_dict(lifted), of_node=True)}
    rho, steps = errors["closed"].rho, 12
    once, best, limit = 1 / (1 + rho), predicted_theta(rho), 2 / (1 + rho)
    thetas = [n / 40 for n in range(2, 29)]
    opened = [[0, 1], [1, 0]]
    closed = [[t, abs(1 - t * (1 + rho))] for t in (0, once, 1)]
    scenes = {}
    for i, theta in enumerate(thetas):
        seen = {name: error.over(theta, steps) for name, error in errors.items()}
        first = {name: sizes[1] for name, sizes in seen.items()}
        worse = max(first, key=lambda name: first[name])
        scenes[(i,)] = scene(
            f"theta = {theta:g}: one step multiplies the error of the open node by {first['open']:.3f} and that of the "
            f"stiffest closed shape by {first['closed']:.3f}. The {worse} one decides"
            + (": it grows." if first[worse] > 1 else f"; after {steps} steps it has fallen to {seen[worse][-1]:.1e}."),
            [
                line(opened, "red", dashed=True),
                line(closed),
                dots([(theta, first["open"])], "red"),
                dots([(theta, first["closed"])]),
                note(0.04, 0.82, "open", "red"),
                note(0.17, 0.36, "closed"),
            ],
            [
                line([(n, max(size, 1e-9)) for n, size in enumerate(seen["open"])], "red", dashed=True),
                line([(n, max(size, 1e-9)) for n, size in enumerate(seen["closed"])]),
            ],
            rows=[(n, f"{a:.2e}", f"{b:.2e}") for n, (a, b) in enumerate(zip(*seen.values(), strict=True))],
        )
    return widget(
        question="The error of an open node is multiplied by 1 - theta in each step, and "
        f"theta = 1/(1+rho) = {once:.3f} removes that of the stiffest closed shape at once. "
        "Which theta is best if nobody knows which nodes are open?",
        answers=[f"1/(1+rho) = {once:.3f}", f"2/(2+rho) = {best:.3f}", f"2/(1+rho) = {limit:.3f}"],
        right=f"2/(2+rho) = {best:.3f}",
        why=f"at {best:.3f} each step multiplies both errors by {predicted_factor(best, rho):.3f}. "
        "Below it the open node is slower, above it the closed shape, "
        f"which grows from {limit:.3f} on. Move theta to both sides.",
        sliders=[slider("theta", "theta", [f"{t:.3f}" for t in thetas], thetas.index(0.5))],
        charts=[
            chart(
                "Factor of one step",
                axis("theta", 0, 0.75),
                axis("factor a step", 0, 1.3),
                [line([(0, 1), (0.75, 1)], "grey", dashed=True), note(0.02, 1.03, "above: grows", "grey")],
            ),
            chart(
                "Size of both errors over the steps",
                axis("step", 0, steps),
                axis("error, the first = 1", 1e-9, 10, log=True),
            ),
        ],
        head=("step", "closed", "open"),
        scenes=scenes,
    )


class _Error:
    """A small error of the force at the solution of a problem: in the stiffest shape, or of its last node."""

    def __init__(self, problem: vf.Problem, *, of_node: bool) -> None:
        self.map = FixedPointMap(vf.build(problem))
        self.solution = vf.run(self.map.pair, theta="0.5", rule="newton").last.g
        contact, neumann = (self._normal(side.schur) for side in (self.map.pair.contact, self.map.pair.neumann))
        values, shapes = eigh(contact, neumann)
        self.rho = float(values[-1])
        shape = neumann[:, -1] if of_node else neumann @ shapes[:, -1]
        self.change = np.concatenate([np.zeros(len(shape)), 1e-6 * shape / np.abs(shape).max()])

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

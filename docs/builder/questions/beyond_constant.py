"""Rules beside a constant theta: where the paper's test stops a run, and how wrong the force is there."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from verification.registry import RULES

LABEL = "Residual and change of the force over the steps of a rule, and the force where the paper's test stops it"

#: First thetas of the runs, the tolerance of both tests, and the most steps that are shown.
THETAS, TOLERANCE, STEPS = ("0.1", "0.15", "0.2", "0.3", "0.4", "0.5"), 1e-9, 60

#: The lowest change that is drawn; below it lies rounding.
LEAST = 1e-17


def plates() -> vf.Problem:
    """Section 6 without friction, with the Neumann problem on the soft plate."""
    return vf.example("section6").changed(cells=((20, 4), (12, 4)), friction=0).swapped()


class _Run:
    """A run of a rule until the residual is small, or for all steps, and where the test of the paper stops it."""

    def __init__(self, pair: vf.ContactPair, rule: str, theta: str) -> None:
        self.forces, self.residuals = [], []
        for iterate, _ in zip(vf.iterate(pair, rule=rule, theta=theta), range(STEPS + 1), strict=False):
            self.forces.append(iterate.g)
            self.residuals.append(float(iterate.relative_residual))
            if self.residuals[-1] < TOLERANCE:
                break
        size = np.linalg.norm
        self.changes = [float(size(b - a) / size(b)) if b.any() else inf for a, b in pairwise(self.forces)]
        self.stop = next((n for n, change in enumerate(self.changes, 1) if change < TOLERANCE), None)
        self.arrives = len(self.residuals) - 1 if self.residuals[-1] < TOLERANCE else None

    def says(self, wrong: float) -> str:
        """What the test does to it, in words; ``wrong`` is the error of the force where it stops."""
        arrives = f"the residual reaches {_share(TOLERANCE)} at step {self.arrives}"
        if self.arrives is None:
            arrives = f"the residual does not reach {_share(TOLERANCE)} in {STEPS} steps"
        if self.stop is None:
            return f"the test does not stop it, and {arrives}."
        return (
            f"the test stops it at step {self.stop}. There the residual is {_share(self.residuals[self.stop])}, and "
            f"the force is wrong by {_share(wrong)} of its size. If it goes on, {arrives}."
        )


def _share(value: float) -> str:
    """A share in percent, or as a power of ten."""
    return f"{100 * value:.0f} percent" if value > 0.01 else f"{value:.0e}".replace("e-0", "e-")


@cache
def data() -> dict[str, Any]:
    """Runs of each rule from several first thetas, their residuals and changes, and the force where they stop."""
    pair = vf.build(plates())
    grid = pair.interface.neumann
    solution = vf.run(pair, rule="newton", theta=THETAS[0]).last.g
    wrong = lambda g: float(np.linalg.norm(g - solution) / np.linalg.norm(solution))
    pressure = lambda g: list(zip(grid.x, g[grid.normal] / grid.weights, strict=True))
    runs = {(rule, theta): _Run(pair, rule, theta) for rule in RULES for theta in THETAS}
    asked = runs["anderson", "0.5"]
    assert asked.stop is not None
    error = wrong(asked.forces[asked.stop])
    ends = [g[grid.normal][0] for g in (asked.forces[asked.stop], solution)]
    right = f"{100 * error:.0f} percent of it"
    scenes = {}
    for (rule, theta), run in runs.items():
        last = run.forces[run.stop] if run.stop else run.forces[-1]
        change = [(n, min(max(each, LEAST), 1e6)) for n, each in enumerate(run.changes[: run.stop], 1)]
        stops = [change[-1], (run.stop, run.residuals[run.stop])] if run.stop else []
        begins = f", first theta {theta}" if RULES[rule].takes_theta else ""
        scenes[list(RULES).index(rule), THETAS.index(theta)] = scene(
            f"{rule.capitalize()}{begins}: {run.says(wrong(last))}",
            [
                line(enumerate(run.residuals)),
                line(change, "red", dashed=True),
                dots(stops, "red"),
                note(0.97 * STEPS, 10**3.6, "solid: residual", anchor="end"),
                note(0.97 * STEPS, 10**2.2, "dashed: change of the force", "red", anchor="end"),
            ],
            [
                line(pressure(last), "red", dashed=True),
                dots(pressure(last), "red"),
                note(1, 1180, f"dashed: at step {run.stop or len(run.forces) - 1}", "red", anchor="middle"),
            ],
            rows=[
                (n, f"{residual:.1e}", f"{change:.1e}")
                for n, (residual, change) in enumerate(zip(run.residuals[1:], run.changes, strict=True), 1)
                if n <= 20 or n % 10 == 0 or n == run.arrives
            ],
        )
    return widget(
        question="Anderson mixing begins with theta = 0.5. The test of the paper stops it after step "
        f"{asked.stop}, where the force changes by less than {_share(TOLERANCE)} of its size. How wrong is the force?",
        answers=[f"less than {_share(TOLERANCE)} of it", f"about {_share(10 * TOLERANCE)} of it", right],
        right=right,
        wrong={
            f"less than {_share(TOLERANCE)} of it": "the change of the force bounds no error of the force.",
            f"about {_share(10 * TOLERANCE)} of it": "no fixed number of digits lies between a change and an error.",
        },
        why="the test measures how far the rule chose to go. Here the mixture of the earlier forces is the last force "
        f"again, while the residual is {_share(asked.residuals[asked.stop])}. At both ends the pressure is "
        f"{ends[0] / ends[1]:.1f} times that of the solution. Choose another rule, and another first theta.",
        sliders=[
            slider("rule", "rule", RULES, list(RULES).index("anderson")),
            slider("theta", "first theta", THETAS, THETAS.index("0.5")),
        ],
        charts=[
            chart(
                "Residual and change of the force over the steps",
                axis("step", 0, STEPS),
                axis("relative residual, relative change", LEAST, 1e5, log=True),
                fixed=[
                    line([(0, TOLERANCE), (STEPS, TOLERANCE)], "grey", dashed=True),
                    note(0.97 * STEPS, TOLERANCE / 100, "stop below", "grey", anchor="end"),
                ],
                before=[
                    dots(enumerate(asked.changes[: asked.stop], 1), "red", hollow=True),
                    note(asked.stop + 2, asked.changes[asked.stop - 1] / 2, "change of the force", "red"),
                ],
            ),
            chart(
                r"Pressure along $\Gamma_c$",
                axis("x [mm]", 0.35, 1.65),
                axis("pressure [MPa]", 0, 3000),
                [line(pressure(solution), "grey"), note(1, 760, "solid: solution", "grey", anchor="middle")],
            ),
        ],
        head=("step", "residual", "change of the force"),
        scenes=scenes,
    )

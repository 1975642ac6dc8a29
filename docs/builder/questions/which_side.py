"""Which side: the steps of both choices of the Neumann body over the ratio of the moduli, and both residuals."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from ndtheory.energy_norms import predicted_rate, predicted_theta

LABEL = "Steps over the ratio of the moduli for both choices of the Neumann body, and the residuals of both runs"

#: E1/E2, those of the paper's Section 6 and its inverse among them.
RATIOS = tuple(Fraction(ratio) for ratio in ("1/8", "1/5", "2/7", "2/5", "3/5", "4/5", "1", "7/5", "2", "7/2", "5"))

#: The modulus of the upper plate in MPa.
UPPER = 20000


@cache
def data() -> dict[str, Any]:
    """Runs of the plates of Section 6 in both roles, each with the theta that is predicted as the best one."""
    runs = {name: [_run(body, ratio) for ratio in RATIOS] for body, name in ((1, "lower"), (2, "upper"))}
    curves = {name: [(float(r), run.steps) for r, run in zip(RATIOS, each, strict=True)] for name, each in runs.items()}
    start, even = RATIOS.index(Fraction(7, 2)), RATIOS.index(Fraction(1))
    good, bad = (each[start] for each in runs.values())
    stiffer = float(RATIOS[start])
    times, guess = f"{bad.steps / good.steps:.0f} times as many, {bad.steps}", round(stiffer * good.steps)
    scenes = {
        (i,): scene(
            f"E1/E2 = {float(RATIOS[i]):.3g}. " + " ".join(each[i].said(name) for name, each in runs.items()),
            [
                line(curves["lower"][: even + 1]),
                dots(curves["lower"][:even], hollow=True),
                line(curves["upper"], "red", dashed=True),
                dots(curves["upper"], "red", hollow=True),
                note(9.5, 65, "upper Neumann", anchor="end"),
                dots([curves["lower"][i]]),
                dots([curves["upper"][i]], "red"),
            ],
            [
                line(enumerate(runs["lower"][i].residuals)),
                line(enumerate(runs["upper"][i].residuals), "red", dashed=True),
                line([(78, 200), (95, 200)]),
                note(98, 110, "lower Neumann"),
                line([(78, 4), (95, 4)], "red", dashed=True),
                note(98, 2.2, "upper Neumann"),
            ],
            rows=[(f"{name} plate", *each[i].row()) for name, each in runs.items()],
        )
        for i in range(len(RATIOS))
    }
    return widget(
        question=f"The lower plate is {stiffer:g} times as stiff as the upper one. With the lower plate as Neumann "
        f"body, {good.steps} steps reach a residual of 1e-9. How many are needed with the upper plate? Each "
        "choice has the theta that is predicted as best for it.",
        answers=[f"as many, {good.steps}", f"{stiffer:g} times as many, {guess}", times],
        right=times,
        wrong={
            f"as many, {good.steps}": "both roles have the same solution, but not the same rho.",
            f"{stiffer:g} times as many, {guess}": "the steps follow rho, which is not the ratio of the moduli.",
        },
        why=f"{times}. For these roles rho is {bad.rho:.1f}, for the others {good.rho:.2f}, and a step is predicted to "
        f"leave rho/(2+rho) of the error: {predicted_rate(bad.rho):.2f} instead of {predicted_rate(good.rho):.2f}. "
        "Move E1/E2 until both take about as many steps.",
        sliders=[slider("ratio", "E1/E2", [f"{float(ratio):.3g}" for ratio in RATIOS], start)],
        charts=[
            chart(
                "Steps over the ratio of the moduli",
                axis("E1/E2, lower plate over upper plate", 0.1, 10, log=True),
                axis("steps to 1e-9", 5, 500, log=True),
                [
                    line(curves["lower"][even:]),
                    dots(curves["lower"][even:], hollow=True),
                    note(9.5, 16, "lower Neumann", anchor="end"),
                ],
            ),
            chart("Residuals of both runs", axis("step", 0, 200), axis("relative residual", 1e-9, 1e4, log=True)),
        ],
        head=("Neumann body", "rho", "theta", "predicted factor a step", "steps"),
        scenes=scenes,
    )


@dataclass(frozen=True, kw_only=True)
class _Run:
    """A run with the theta that is predicted as best."""

    rho: float
    residuals: list[float]

    @property
    def steps(self) -> int:
        return len(self.residuals) - 1

    def said(self, name: str) -> str:
        theta = predicted_theta(self.rho)
        return f"With the {name} plate as Neumann body rho = {self.rho:.3g}, theta = {theta:.3f}: {self.steps} steps."

    def row(self) -> tuple[str, ...]:
        theta, rate = predicted_theta(self.rho), predicted_rate(self.rho)
        return f"{self.rho:.4g}", f"{theta:.4f}", f"{rate:.4f}", str(self.steps)


def _run(neumann_body: int, ratio: Fraction) -> _Run:
    """One choice of the roles at one ratio of the moduli, on the mesh of the page."""
    problem = vf.example("section6").changed(
        cells=((20, 3), (12, 3)), young=(str(ratio * UPPER), str(UPPER)), neumann_body=neumann_body
    )
    pair = vf.build(problem)
    rho = vf.measure(pair).rho_max.value
    run = vf.run(pair, theta=predicted_theta(rho))
    return _Run(rho=rho, residuals=list(run.history))

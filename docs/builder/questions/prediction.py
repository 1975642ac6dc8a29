"""Prediction: the rate that the matrix of each step predicts, and how many of its digits are those of the end."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from verification.algorithm.affine_piece import Piece, piece_of

LABEL = (
    "Residual of a run with what the matrix of one step predicts for it, and the right digits of the rate at each step"
)

#: How far the frictions of the slider are above the critical one, where one more node sticks.
ABOVE = (Fraction(1, 10**4), Fraction(1, 10**6))

#: The critical friction is known so well.
SURE = Fraction(1, 10**8)

#: The last step that the slider reaches: later than the last change of state in each run.
LATEST = 20

#: The ends of the axes: the steps of the runs, the least residual, the digits.
STEPS, LEAST, DIGITS = 30, 1e-10, 12


def plates(k: Any = "0.2") -> vf.Problem:
    """The problem of the page."""
    return vf.example("section6").changed(cells=((20, 4), (12, 4)), friction=k, theta="0.5")


def critical() -> Fraction:
    """The friction at which one more node sticks, by bisection."""
    states = lambda k: vf.solve(plates(k)).contact.status
    low, high = Fraction(1, 5), Fraction(2, 5)
    slipping = states(low)
    while high - low > SURE:
        middle = (low + high) / 2
        low, high = (middle, high) if states(middle) == slipping else (low, middle)
    return round(high, 7)


@dataclass(frozen=True)
class Steps:
    """A run and the affine piece of each of its steps."""

    run: vf.Run
    pieces: tuple[Piece, ...]

    @classmethod
    def of(cls, problem: vf.Problem) -> Steps:
        """The run of a problem."""
        run = vf.run(problem)
        return cls(run, tuple(piece_of(run.pair, at.g, at.contact.pattern) for at in run.iterates))

    @property
    def settled(self) -> int:
        """The first step on the last piece."""
        known = [(piece.pattern, piece.sign.tolist()) for piece in self.pieces]
        return max((n for n in range(1, len(known)) if known[n] != known[n - 1]), default=0)

    @property
    def residuals(self) -> list[float]:
        """The residual of each step, in units of the first one."""
        return [at.residual / self.run.iterates[0].residual for at in self.run.iterates]

    def continued(self, n: int) -> list[float]:
        """The residuals from step n to the end if the run stays on the piece of step n, in units of the first one."""
        at, piece = self.run.iterates[n], self.pieces[n]
        J, residual = (
            piece.relaxed(float(self.run.theta)),
            piece.basis.T @ self.run.pair.neumann.flexibility(at.image - at.g),
        )
        sizes = [np.linalg.norm(residual)]
        for _ in range(n, self.run.observed_rate.end):
            residual = J @ residual
            sizes.append(np.linalg.norm(residual))
        return [float(size) / self.run.iterates[0].residual for size in sizes]

    def predicted(self, n: int) -> float:
        """The rate at the end that the matrix of step n predicts, over the steps at which it is observed."""
        seen, sizes = self.run.observed_rate, self.continued(n)
        steps = seen.end - seen.begin
        return (sizes[-1] / sizes[-1 - steps]) ** (1 / steps)

    def digits(self, n: int) -> float:
        """The digits of the observed rate that the matrix of step n predicts."""
        return -np.log10(max(abs(self.predicted(n) / self.run.observed_rate.value - 1), np.finfo(float).eps))


@cache
def data() -> dict[str, Any]:
    """A scene for each friction and each step."""
    edge = critical()
    runs = [Steps.of(plates(k)) for k in (Fraction(1, 5), *(edge + above for above in ABOVE))]
    names = [f"{float(run.run.pair.friction):.6f}".rstrip("0") for run in runs]
    known = [[run.digits(n) for n in range(LATEST + 1)] for run in runs]
    first, digits = runs[0], known[0]
    scenes = {}
    for i, run in enumerate(runs):
        end = run.run.observed_rate
        for n in range(LATEST + 1):
            early = n < run.settled
            scenes[i, n] = scene(
                f"k = {names[i]}: the matrix of step {n} predicts the rate {run.predicted(n):.9f}, and the run ends "
                f"with {end.value:.9f}: {known[i][n]:.1f} digits are right. "
                + ("Some node changes its state later." if early else "No node changes its state any more."),
                [
                    dots(_short(enumerate(run.residuals)), "grey", hollow=True),
                    line(_short(enumerate(run.continued(n), n)), "red" if early else "blue", dashed=early),
                ],
                [
                    line([(run.settled, 0), (run.settled, DIGITS)], "grey", dashed=True),
                    note(run.settled + 0.4, DIGITS - 0.8, "last change")
                    if run.settled < LATEST / 2
                    else note(run.settled - 0.4, DIGITS - 0.8, "last change", anchor="end"),
                    dots(_short(enumerate(known[i]))),
                    dots([(n, known[i][n])], "red", hollow=True),
                ],
                rows=[
                    (names[j], each.settled, f"{each.predicted(n):.9f}", f"{each.run.observed_rate.value:.9f}")
                    for j, each in enumerate(runs)
                ],
            )
    return widget(
        question=f"The run takes {first.run.iterations} steps. From the matrix of each step one can predict the rate "
        "with which the run will end. How do the right digits of that rate appear?",
        answers=["some more at each step", "nearly all at one step", "twice as many at each step"],
        right="nearly all at one step",
        wrong={
            "some more at each step": "while no node changes its state the matrix is the same at each step.",
            "twice as many at each step": "that is how Newton's method gains digits.",
        },
        why=f"at step {first.settled} a node changes its state for the last time. Before it at most "
        f"{max(digits[: first.settled]):.1f} digits are right, and from then on {min(digits[first.settled :]):.1f}. "
        f"Near k = {float(edge):.5f}, where one more node sticks, the last change comes later: move k.",
        sliders=[
            slider("k", "friction k", names, 0),
            slider("step", "matrix of step", range(LATEST + 1), first.settled),
        ],
        charts=[
            chart(
                "Residual, and what one matrix predicts",
                axis("step", -1, STEPS),
                axis("residual, the first = 1", LEAST, 10, log=True),
                before=[dots(_short(enumerate(first.residuals)), "grey", hollow=True)],
            ),
            chart(
                "Right digits of the rate",
                axis("step of the matrix", -1, LATEST + 1),
                axis("right digits of the rate", 0, DIGITS),
            ),
        ],
        head=("k", "last change at step", "rate predicted", "rate at the end"),
        scenes=scenes,
    )


def _short(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Three digits, enough for a picture."""
    return [(x, float(f"{y:.3g}")) for x, y in points]

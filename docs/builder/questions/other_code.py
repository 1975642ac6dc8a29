"""Logs of another code: the residuals of runs over theta, and what each shows of rho."""

from __future__ import annotations

from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from verification.coupling.advice import Advice

LABEL = "Residuals of a run over its steps, and the rho that the log of a run shows over its theta"

#: The runs, each of so many steps at most, and the residual at which a run ends.
THETAS = (0.03, 0.05, 0.07, 0.1, 0.12, 0.15, 0.18, 0.2, 0.22, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
MOST, TOLERANCE = 150, 1e-8

#: The theta of the question.
ASKED = 0.5


def plates() -> vf.Problem:
    """Section 6 without friction, with the Neumann problem on the soft plate, one corner of which is pulled off."""
    section6 = vf.example("section6").changed(cells=((20, 4), (12, 4)), friction=0).to_dict()
    section6["body2"]["traction"] = {"right": [0, 2000]}
    return vf.Problem.from_dict(section6).swapped()


def residuals(pair: vf.ContactPair, theta: float) -> list[tuple[float, float]]:
    """Absolute and relative residual of each step of a run, as a log holds them."""
    found = []
    for iterate in islice(vf.iterate(pair, theta=str(theta)), MOST):
        found.append((iterate.residual, iterate.relative_residual))
        if iterate.relative_residual < TOLERANCE:
            break
    return found


def read(log: list[tuple[float, float]], theta: float) -> Advice:
    """What the library reads from the log of a run alone."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "residuals.log"
        lines = [f"{n} {absolute:.8e} {relative:.8e}" for n, (absolute, relative) in enumerate(log, 1)]
        path.write_text("\n".join(["Iteration ResAbs ResRel", *lines, ""]), encoding="utf-8")
        return vf.advise_logs([(path, str(theta))])


def _says(theta: float, advice: Advice) -> str:
    readings = {reading.kind: reading for reading in advice.readings}
    rho = f"{readings['mode-high'].lo:.2f}"
    if "level" in readings:
        return (
            f"the residual stays at a level. Without friction theta = {theta:g} converges for every rho below "
            f"2/theta - 1 = {readings['level'].lo:.2f}, so rho is at least that."
        )
    slowest = advice.logs[0].slowest
    assert slowest is not None
    falls = f"in the end each step multiplies the residual by {float(slowest.value):.3f}."
    if len(readings) == 1:
        return f"{falls} That is slower than 1 - theta, so the stiffest mode sets the pace: rho is at least {rho}."
    return (
        f"{falls} A stiffest mode with rho = {rho} would do that, and so would a softer one: this log does not decide."
    )


@cache
def data() -> dict[str, Any]:
    """A log for each theta, and its readings."""
    pair = vf.build(plates())
    rho = vf.measure(pair).rho_normal.value
    logs = {theta: residuals(pair, theta) for theta in THETAS}
    advice = {theta: read(log, theta) for theta, log in logs.items()}
    shown = [(theta, found.readings[0].lo) for theta, found in advice.items()]
    bound = 2 / ASKED - 1
    curve = lambda log: [(n, absolute / log[0][0]) for n, (absolute, _) in enumerate(log, 1)]
    right = f"rho is {bound:g} or more"
    scenes = {}
    for i, (theta, log) in enumerate(logs.items()):
        steps = curve(log)
        scenes[(i,)] = scene(
            f"theta = {theta:g}: {_says(theta, advice[theta])} The matrices have {rho:.2f}.",
            [line(steps), dots(steps[-1:])],
            [
                line([(0, rho), (1, rho)], "green"),
                note(0.97, rho * 1.1, f"rho = {rho:.2f}", "green", anchor="end"),
                line([(t, 2 / t - 1) for t in (n / 100 for n in range(2, 100))], "grey", dashed=True),
                note(0.52, 3.4, "dashed: 2/theta - 1", "grey"),
                dots(shown, hollow=True),
                note(0.09, 40, "circles: rho, if the slowest is the stiffest"),
                dots([shown[i]]),
            ],
            rows=[(n, f"{size:.2e}") for n, size in steps[:: max(1, len(steps) // 15)]],
        )
    return widget(
        question=f"This log is of a run with theta = {ASKED:g}, without friction: the residual stays near one value "
        f"for {len(logs[ASKED])} steps. What follows for rho?",
        answers=[f"rho = 2/theta - 1 = {bound:g}", right, "nothing, as it does not converge"],
        right=right,
        wrong={
            f"rho = 2/theta - 1 = {bound:g}": "so it is for tied bodies, and not in contact.",
            "nothing, as it does not converge": "a run that does not converge excludes every rho with which it would.",
        },
        why=f"theta = {ASKED:g} converges for every rho below {bound:g}, so a run that does not converge shows that "
        f"rho is {bound:g} or more. Here it is {rho:.2f}. Contact opens and closes alternately, which keeps the "
        "residual near one value at every theta that is too large. Move theta: between which thetas does a log show "
        "rho itself?",
        sliders=[slider("theta", "theta", [f"{theta:g}" for theta in THETAS], THETAS.index(ASKED))],
        charts=[
            chart(
                "Residual over the steps",
                axis("step", 0, MOST + 5),
                axis("residual, the first = 1", 1e-9, 10, log=True),
                before=[line(curve(logs[ASKED]))],
            ),
            chart("rho that each log shows", axis("theta of the log", 0, 1), axis("rho", 1, 100, log=True)),
        ],
        head=("step", "residual, the first = 1"),
        scenes=scenes,
    )

"""The ruler of steps: how many each form of the theorem promises, and how many a run takes, on one axis."""

from __future__ import annotations

from functools import cache
from typing import Any

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget
from ndtheory import Number, energy_norms
from verification.algorithm.rates import steps
from verification.bounds.bound import BoundResult, Subject
from verification.bounds.ruler import promised
from verification.registry import BOUNDS

LABEL = "Steps to an error of 1e-9: promised by each form of the theorem, predicted, and taken by a run, on one axis"

THETAS, FRICTIONS = (
    ("3.4e-11", "5e-4", "0.1", "0.3", "0.5", "0.7", "0.8", "0.95"),
    ("1e-22", "1e-8", "0.1", "0.2", "0.4"),
)

#: Where the answer leads: the printed theorem applies, and promises least.
ASKED = ("3.4e-11", "1e-22")

#: No run is made below this theta: it would take more steps than a page can wait for.
SLOW = 0.01

TOLERANCE, FARTHEST = 1e-9, 1e14

BOUND = {"printed": "grey", "repaired": "orange", "energy": "green", "lmi": "red"}


@cache
def marks() -> dict[tuple[str, str], dict[str, int | None]]:
    """By theta and friction the steps of each bound, predicted without friction, and of the run."""
    problem = vf.example("section6").changed(cells=((20, 3), (12, 3)))
    pair, measured = vf.build(problem), vf.measure(problem)
    runs = {}
    swift = [theta for theta in THETAS if float(theta) > SLOW]
    for row in vf.sweep(problem, theta=[*map(float, swift)], friction=[*map(float, FRICTIONS)]).rows:
        runs[row["theta"], row["friction"]] = row["iterations"] if row["outcome"] == "converged" else None
    found: dict[tuple[str, str], dict[str, int | None]] = {}
    for k in FRICTIONS:
        subject = Subject.of(pair.at(friction=float(k)), measured.with_friction(float(k)))
        sharp = dict(zip(swift, BOUNDS["lmi"].curve(subject, [*map(float, swift)]), strict=True))
        for theta in THETAS:
            each = {name: promised(BOUNDS[name].evaluate(subject, theta), TOLERANCE) for name in BOUND if name != "lmi"}
            each["lmi"] = None if (q := sharp.get(theta)) is None else promised(_of("lmi", q), TOLERANCE)
            each["predicted"] = steps(energy_norms.predicted_factor(float(theta), measured.rho_max.value))
            found[theta, k] = {**each, "run": runs.get((float(theta), float(k)))}
    return found


def _of(name: str, factor: float) -> BoundResult:
    numbers = {"factor": Number.of_float(factor), "one_minus_factor": Number.of_float(1 - factor)}
    return BoundResult(name=name, proved=True, **numbers)


@cache
def data() -> dict[str, Any]:
    """A scene for each theta and each friction."""
    found = marks()
    printed, repaired = (min(n for each in found.values() if (n := each[name])) for name in ("printed", "repaired"))
    energy = found["0.8", ASKED[1]]["energy"]
    best = min((n, at) for at, each in found.items() if (n := each["run"]))
    return widget(
        question="With hardly any friction the printed theorem applies to the model of Section 6. How many steps to an "
        f"error of 1e-9 does it promise at its best theta? The fastest of these runs takes {best[0]}.",
        answers=[_count(energy), _count(repaired), _count(printed)],
        right=_count(printed),
        wrong={
            _count(energy): "that is the promise in energy norms, at a theta that is not allowed here.",
            _count(repaired): "that is the promise of the repaired theorem.",
        },
        why="the printed theorem allows only theta below 3.5e-11. With such a theta the iteration hardly moves, and "
        f"no bound promises much less than its {_count(printed)} steps. The others allow larger theta: the repaired "
        f"theorem promises {_count(repaired)} steps at 5e-4, and the bound in energy norms {energy} at 0.8, where the "
        f"run takes {best[0]}. Move theta and k.",
        sliders=[
            slider("theta", "theta", THETAS, THETAS.index(ASKED[0])),
            slider("k", "friction k", FRICTIONS, FRICTIONS.index(ASKED[1])),
        ],
        charts=[
            chart(
                "Steps to an error of 1e-9",
                axis("steps", 1, FARTHEST, log=True),
                axis("", 0, len(BOUND) + 2, bare=True),
                before=[note(3, 3, "a mark for each theorem, and one for the run")],
            )
        ],
        head=("", "steps to 1e-9"),
        scenes={(i, j): _scene(theta, k) for i, theta in enumerate(THETAS) for j, k in enumerate(FRICTIONS)},
    )


def _scene(theta: str, k: str) -> dict[str, Any]:
    found = marks()[theta, k]
    shown: list[Any] = []
    for i, (name, count) in enumerate(found.items()):
        y, colour = len(found) - i - 0.5, BOUND.get(name, "blue")
        if count is None:
            shown.append(note(1.5, y - 0.1, f"{name}: {_none(name, theta)}"))
        else:
            shown += [line([(1, y), (count, y)], colour), dots([(count, y)], colour)]
            far = count > 1e6  # then the words stand above the line
            place = (count, y + 0.15) if far else (1.6 * count, y - 0.1)
            shown.append(note(*place, f"{name} {_count(count)}", anchor="end" if far else "start"))
    promises = [count for name in BOUND if (count := found[name])]
    says = f"theta = {theta}, k = {k}: " + (
        f"at most {_count(min(promises))} steps are promised" if promises else "no promise"
    )
    taken = "no run was made" if float(theta) < SLOW else f"the run takes {found['run']}"
    rows = [(name, _none(name, theta) if count is None else _count(count)) for name, count in found.items()]
    return scene(f"{says}, {taken}.", shown, rows=rows)


def _none(name: str, theta: str) -> str:
    """Why a mark is missing."""
    return "not made" if float(theta) < SLOW and name in ("run", "lmi") else "no conclusion"


def _count(count: int) -> str:
    return f"{count:,}".replace(",", " ") if count < 1e6 else f"{count:.1e}".replace("e+", "e")
